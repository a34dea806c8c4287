//! Operators on NumPy arrays. Contiguous arrays of the right type are not copied; sums release the interpreter's lock.

mod acoustic;
mod contacts;
mod couple_stress;
mod cracks;
mod fields;
mod fragments;
mod stiffness;
mod stress;

use pyo3::prelude::*;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    acoustic::register(module)?;
    cracks::register(module)?;
    fragments::register(module)?;
    stress::register(module)?;
    couple_stress::register(module)?;
    fields::register(module)?;
    stiffness::register(module)
}
