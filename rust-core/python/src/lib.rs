//! The solver for Python: the contents of the module `concordem._core`, but for those of `concordem.yade`.
//!
//! The Python package is in `python/concordem/`; its `_core.pyi` describes the module for type checkers. The crate of `yade-bridge/` makes
//! the module: it calls [`register`] and adds the engine that YADE hosts, for which the public modules here are.

// Views of the solver's memory need raw pointers; each use states why it is sound.
#![allow(unsafe_code)]
// pyo3 requires arguments by value and equal return types, and 'py is written out.
#![allow(clippy::needless_pass_by_value, clippy::unnecessary_wraps, clippy::elidable_lifetime_names)]
// Every keyword argument of a Python function is an argument of the Rust function.
#![allow(clippy::too_many_arguments)]
// Doc comments are docstrings, whose examples are Python: `x["name"]` is no link.
#![allow(clippy::doc_link_with_quotes)]

mod addresses;
pub mod arrays;
mod cells;
mod commands;
mod continuum;
mod elastic;
pub mod errors;
mod meshes;
mod operators;
mod packing;
mod pictures;
mod regions;
mod results;
pub mod scenario;
mod scripted;
pub mod shared;
mod simulation;
pub mod state;
mod strain;
pub mod warnings;
pub mod work;

use std::ffi::OsString;
use std::io::IsTerminal;
use std::path::PathBuf;

use concordem::program::Console;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Run the command-line program with these arguments (without the program name); returns its exit code. `code`: file of this module.
#[pyfunction]
fn run_program(py: Python<'_>, arguments: Vec<OsString>, code: PathBuf) -> PyResult<u8> {
    errors::detach(py, || {
        let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
        let (out_interactive, interactive) = (out.is_terminal(), err.is_terminal());
        let packings = concordem::program::packings_folder();
        let code = Some(code);
        let mut console =
            Console { out: &mut out, err: &mut err, interactive, out_interactive, packings, code, host: None };
        concordem::program::run(std::iter::once("concordem".into()).chain(arguments), &mut console)
    })
}

/// Where [`_panic`] panics.
struct PanicAt(String);

impl<'a, 'py> FromPyObject<'a, 'py> for PanicAt {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        let place: String = object.extract()?;
        assert!(place != "argument", "intended panic");
        Ok(Self(place))
    }
}

/// Panic, to test the conversion of panics to exceptions: in the conversion of an "argument", "with" or "without" the interpreter's
/// lock, or while a simulation is "read" or "changed".
#[pyfunction]
#[pyo3(signature = (place, simulation=None))]
fn _panic(py: Python<'_>, place: PanicAt, simulation: Option<&Bound<'_, simulation::Simulation>>) -> PyResult<()> {
    let data = simulation.map(|simulation| simulation.get().lock()).transpose()?;
    match (place.0.as_str(), data) {
        ("without", _) => errors::detach(py, || panic!("intended panic")),
        ("changed", Some(mut data)) => data.change(py, |_| panic!("intended panic")),
        // With "read", the simulation is locked here.
        _ => panic!("intended panic"),
    }
}

/// Prepare a process that a fork has just made. Python calls it in the child.
#[pyfunction]
fn _after_fork() {
    concordem::solver::own_thread::after_fork();
}

/// Add all classes and functions to the module.
///
/// # Errors
/// Those of Python.
pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    errors::adopt_panics(module.py())?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    module.add_function(wrap_pyfunction!(_panic, module)?)?;
    let after = PyDict::new(module.py());
    after.set_item("after_in_child", wrap_pyfunction!(_after_fork, module)?)?;
    module.py().import("os")?.call_method("register_at_fork", (), Some(&after))?;
    scenario::register(module)?;
    simulation::register(module)?;
    commands::register(module)?;
    pictures::register(module)?;
    regions::register(module)?;
    operators::register(module)?;
    strain::register(module)?;
    packing::register(module)?;
    elastic::register(module)?;
    results::register(module)?;
    continuum::register(module)?;
    cells::register(module)?;
    scripted::register(module)
}
