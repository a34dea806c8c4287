//! Conversion of Python tables of contacts and loads.

use concordem::operator::{ContactSet, LoadSet};
use pyo3::prelude::*;

use crate::arrays::{Indices, Pairs, Vectors};
use crate::errors::OrRaise;

/// The columns of a Python table of contacts.
pub struct Contacts<'py> {
    pair: Pairs<'py>,
    branch: Vectors<'py>,
    point: Vectors<'py>,
    force: Vectors<'py>,
    moment: Option<Vectors<'py>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Contacts<'py> {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            pair: column(&object, "pair")?,
            branch: column(&object, "branch")?,
            point: column(&object, "point")?,
            force: column(&object, "force")?,
            moment: column(&object, "moment")?,
        })
    }
}

/// A column of a table; errors name the column.
fn column<'py, T: FromPyObjectOwned<'py, Error = PyErr>>(table: &Bound<'py, PyAny>, name: &str) -> PyResult<T> {
    table.getattr(name)?.extract().map_err(|error: PyErr| {
        let py = table.py();
        let message = format!("{name}: {}", error.value(py));
        // Keep the class of the error.
        error.get_type(py).call1((message,)).map_or(error, PyErr::from_value)
    })
}

impl Contacts<'_> {
    /// The contacts of the particles at `position`.
    pub fn set<'a>(&'a self, position: &'a Vectors<'_>) -> PyResult<ContactSet<'a>> {
        let moment = self.moment.as_ref().map(Vectors::get).transpose()?;
        ContactSet::new(
            position.get()?,
            self.pair.get()?,
            self.branch.get()?,
            self.point.get()?,
            self.force.get()?,
            moment,
        )
        .or_raise()
    }
}

/// The columns of a Python table of external loads.
pub struct Loads<'py> {
    particle: Indices<'py>,
    point: Vectors<'py>,
    force: Vectors<'py>,
    moment: Option<Vectors<'py>>,
}

impl<'a, 'py> FromPyObject<'a, 'py> for Loads<'py> {
    type Error = PyErr;
    fn extract(object: Borrowed<'a, 'py, PyAny>) -> PyResult<Self> {
        Ok(Self {
            particle: column(&object, "particle")?,
            point: column(&object, "point")?,
            force: column(&object, "force")?,
            moment: column(&object, "moment")?,
        })
    }
}

impl Loads<'_> {
    /// The loads on `count` particles.
    pub fn set(&self, count: usize) -> PyResult<LoadSet<'_>> {
        let moment = self.moment.as_ref().map(Vectors::get).transpose()?;
        LoadSet::new(count, self.particle.get()?, self.point.get()?, self.force.get()?, moment).or_raise()
    }
}

/// The loads on `count` particles; none if there is no table.
pub fn loads_or_none<'a>(loads: Option<&'a Loads<'_>>, count: usize) -> PyResult<LoadSet<'a>> {
    loads.map_or_else(|| Ok(LoadSet::none()), |loads| loads.set(count))
}
