//! `concordem._core`: the solver for Python, and what `concordem.yade` needs of it.
//!
//! The Python package around it lies in `python/concordem/`; `_core.pyi` there describes this module for type checkers.
//! What is built from this folder is under the GNU General Public License, version 3 or later.

// Views on the solver's memory and the bridge into a running YADE need raw pointers; each use says why it is sound.
#![allow(unsafe_code)]
// Arguments of Python functions are taken by value, all functions of a module return alike, and 'py is written out.
#![allow(clippy::needless_pass_by_value, clippy::unnecessary_wraps, clippy::elidable_lifetime_names)]
// Keyword arguments of a Python function are arguments here.
#![allow(clippy::too_many_arguments)]

mod arrays;
mod elastic;
mod errors;
mod hosted;
mod memory;
mod operators;
mod packing;
mod regions;
mod results;
mod scenario;
mod simulation;
mod state;
mod strain;

use std::io::IsTerminal;

use concordem::program::Console;
use pyo3::prelude::*;

/// Run the command line program with these arguments (without the program's name); its exit code.
#[pyfunction]
fn run_program(py: Python<'_>, arguments: Vec<String>) -> PyResult<u8> {
    errors::detach(py, || {
        let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
        let (out_interactive, interactive) = (out.is_terminal(), err.is_terminal());
        let mut console = Console { out: &mut out, err: &mut err, interactive, out_interactive };
        concordem::program::run(std::iter::once("concordem".to_owned()).chain(arguments).map(Into::into), &mut console)
    })
}

/// A panic, as any fault of the program is one; for the test of what becomes of it.
#[pyfunction]
fn _panic(py: Python<'_>) -> PyResult<()> {
    errors::detach(py, || panic!("as asked"))
}

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add("__version__", env!("CARGO_PKG_VERSION"))?;
    module.add_function(wrap_pyfunction!(run_program, module)?)?;
    module.add_function(wrap_pyfunction!(_panic, module)?)?;
    scenario::register(module)?;
    simulation::register(module)?;
    regions::register(module)?;
    operators::register(module)?;
    strain::register(module)?;
    packing::register(module)?;
    elastic::register(module)?;
    results::register(module)?;
    memory::register(module)?;
    hosted::register(module)
}
