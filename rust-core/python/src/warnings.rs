//! Warnings about scenarios, for Python.

use concordem::scenario::{Problem, Scenario, ScenarioError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::errors::entry;

/// Give each of these warnings about a scenario as a `concordem.ConcordemWarning` at the calling line of Python. The filters of
/// Python's `warnings` may turn it into an exception.
pub fn warn(py: Python<'_>, scenario: &Scenario, warnings: &[Problem]) -> PyResult<()> {
    for problem in warnings {
        let alone = ScenarioError::new(&scenario.source, vec![problem.clone()]);
        let (problem, place) = (&alone.problems[0], &alone.locate(&alone.problems)[0]);
        let class = py.import("concordem._errors")?.getattr("ConcordemWarning")?;
        let warning = class.call1((alone.to_string(), entry(place.position, problem)))?;
        let options = PyDict::new(py);
        // Functions of this library have no frame of their own, so 1 is the line that called it.
        options.set_item("stacklevel", 1)?;
        py.import("warnings")?.call_method("warn", (warning,), Some(&options))?;
    }
    Ok(())
}

/// Give a line of the program as a `concordem.ConcordemWarning`.
pub fn tell(py: Python<'_>, line: &str) -> PyResult<()> {
    let class = py.import("concordem._errors")?.getattr("ConcordemWarning")?;
    py.import("warnings")?.call_method1("warn", (class.call1((line,))?,)).map(drop)
}
