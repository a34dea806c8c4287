//! Conversion of Python tables of contacts and loads.

use concordem::operator::{ContactSet, LoadSet};
use pyo3::exceptions::PyTypeError;
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
            pair: column(&object, "Contacts", "pair")?,
            branch: column(&object, "Contacts", "branch")?,
            point: column(&object, "Contacts", "point")?,
            force: column(&object, "Contacts", "force")?,
            moment: column(&object, "Contacts", "moment")?,
        })
    }
}

/// A column of a table; errors name the column, and the class of the table where something else is given.
fn column<'py, T: FromPyObjectOwned<'py, Error = PyErr>>(
    table: &Bound<'py, PyAny>,
    class: &str,
    name: &str,
) -> PyResult<T> {
    let column = table.getattr_opt(name)?.ok_or_else(|| {
        let given = table.get_type();
        PyTypeError::new_err(format!("{given} has no `{name}`; give operators.{class}, or an object with its columns"))
    })?;
    column.extract().map_err(|error: PyErr| {
        let py = table.py();
        let message = format!("{name}: {}", error.value(py));
        // Keep the class of the error, if a message makes it. The handler of a signal may raise another one meanwhile.
        match error.get_type(py).call1((message,)) {
            Ok(named) => PyErr::from_value(named),
            Err(other) if other.is_instance_of::<PyTypeError>(py) => error,
            Err(other) => other,
        }
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
            particle: column(&object, "Loads", "particle")?,
            point: column(&object, "Loads", "point")?,
            force: column(&object, "Loads", "force")?,
            moment: column(&object, "Loads", "moment")?,
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
