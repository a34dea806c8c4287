//! Directions of cracks.

use concordem::operator::crack_directions::{self, CrackDirections};
use pyo3::prelude::*;

use super::Any;
use crate::arrays::{Vectors, result, scalars, tensor, vectors};
use crate::errors::OrRaise;
use crate::work::answering;

/// Directions of crack faces. Args: `area` (n, 3), normals times areas, m², such as `Result.cracks["area"]`; a normal and its opposite are one
/// direction. Returns CrackDirections. Raises OperatorError for numbers that are not finite.
///
/// >>> import concordem
/// >>> found = concordem.operators.crack_directions([[-3.0, 0, 0], [0, 1, 0]])
/// >>> found.area, float(found.principal[0]), found.directions[0].tolist()
/// (4.0, 0.75, [1.0, 0.0, 0.0])
#[pyfunction]
#[pyo3(name = "crack_directions")]
fn directions<'py>(py: Python<'py>, area: Vectors<'py>) -> Any<'py> {
    let areas = area.get()?;
    let found = answering(py, areas.len(), || crack_directions::crack_directions(areas))?.or_raise()?;
    let density = found.densities();
    let CrackDirections { area, fabric, principal, directions, .. } = found;
    let fields =
        (area, tensor(py, &fabric)?, scalars(py, &principal), vectors(py, &directions)?, scalars(py, &density));
    result(py, "CrackDirections", fields)
}

/// Rose of cracks in a plane: their area (m²) by the angle of the normal. Bin k of n is the angle 180° k/n and half a bin to either side.
///
/// Args: `area` (n, 3), m²; `axis`: 0, 1, or 2, across the plane; the angle runs from the next axis to the one after; `bins`. A face that is
/// inclined to the plane counts with its projection. Raises OperatorError for numbers that are not finite, another axis, and no bins.
///
/// >>> import concordem
/// >>> concordem.operators.crack_rose([[1.0, 0, 0], [0, -2, 0], [0, 0, 1]], bins=4).tolist()
/// [1.0, 0.0, 2.0, 0.0]
#[pyfunction]
#[pyo3(signature = (area, *, axis=2, bins=24))]
fn crack_rose<'py>(py: Python<'py>, area: Vectors<'py>, axis: usize, bins: usize) -> Any<'py> {
    let areas = area.get()?;
    let found = answering(py, areas.len(), || crack_directions::rose(areas, axis, bins))?.or_raise()?;
    Ok(scalars(py, &found).into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(directions, module)?)?;
    module.add_function(wrap_pyfunction!(crack_rose, module)?)
}
