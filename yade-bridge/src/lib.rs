//! `concordem._core`: the solver for Python (`concordem_python`), and what `concordem.yade` needs: the engine that YADE hosts, and its memory.
//!
//! Everything built from this folder is under the GNU General Public License, version 3 or later.

// The bridge to a running YADE needs raw pointers; each use states why it is sound.
#![allow(unsafe_code)]
// pyo3 requires arguments by value and equal return types, and 'py is written out.
#![allow(clippy::needless_pass_by_value, clippy::unnecessary_wraps, clippy::elidable_lifetime_names)]
// Every keyword argument of a Python function is an argument of the Rust function.
#![allow(clippy::too_many_arguments)]

mod hosted;
mod memory;

use pyo3::prelude::*;

#[pymodule]
fn _core(module: &Bound<'_, PyModule>) -> PyResult<()> {
    concordem_python::register(module)?;
    memory::register(module)?;
    hosted::register(module)
}
