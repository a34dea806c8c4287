//! Forces and bonds at the present positions.

use concordem::sampling::Bonds;
use concordem::schedule::Simulation as Run;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

use super::Inner;
use crate::arrays::{result, rows, scalars, vectors};
use crate::errors::OrRaise;
use crate::shared::Access;
use crate::work::Pool;

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// See `Simulation.forces`.
pub fn forces<'py>(py: Python<'py>, inner: &mut Access<'_, Inner>, pool: &Pool, border: Option<Vec<u32>>) -> Any<'py> {
    let count = inner.run.state.particles.len();
    let member = border.map(|rows| members_of(&rows, count)).transpose()?;
    let record = |Inner { run, .. }: &mut Inner| {
        pool.inside(|| match &member {
            Some(member) => run.solver.record_border(&mut run.state, member),
            None => run.solver.record(&mut run.state),
        })
    };
    let forces = inner.change(py, record)?.or_raise()?;
    let (c, w) = (&forces.contacts, &forces.walls);
    let contacts = (
        rows::<_, u32>(py, &c.pair, 2)?,
        vectors(py, &c.branch)?,
        vectors(py, &c.point)?,
        vectors(py, &c.force)?,
        vectors(py, &c.moment)?,
    );
    let loads = (scalars(py, &w.particle), vectors(py, &w.point)?, vectors(py, &w.force)?, vectors(py, &w.moment)?);
    let (contacts, loads) = (result(py, "Contacts", contacts)?, result(py, "Loads", loads)?);
    let meshes = PyDict::new(py);
    for (wall, on_vertices) in inner.run.state.walls.iter().zip(&w.vertices).filter(|(wall, _)| wall.mesh().is_some()) {
        meshes.set_item(&wall.name, vectors(py, on_vertices)?)?;
    }
    result(py, "Forces", (contacts, loads, meshes))
}

/// See `Simulation.bonds`.
pub fn bonds<'py>(py: Python<'py>, inner: &mut Access<'_, Inner>, pool: &Pool) -> Any<'py> {
    let find = |Inner { run, .. }: &mut Inner| {
        pool.inside(|| run.solver.record(&mut run.state).map(|forces| Bonds::of(&run.state, &forces)))
    };
    let bonds = inner.change(py, find)?.or_raise()?;
    let fields = (
        rows::<_, u32>(py, &bonds.pair, 2)?,
        vectors(py, &bonds.midpoint)?,
        vectors(py, &bonds.normal)?,
        scalars(py, &bonds.damage),
        scalars(py, &bonds.lost_strength),
    );
    result(py, "Bonds", fields)
}

/// Whether each of `count` particles is among these rows.
fn members_of(rows: &[u32], count: usize) -> PyResult<Vec<bool>> {
    let mut member = vec![false; count];
    for &row in rows {
        let Some(place) = member.get_mut(row as usize) else {
            let message = format!("border names row {row}, but there are {count} particles; rows are counted from 0");
            return Err(PyValueError::new_err(message));
        };
        *place = true;
    }
    Ok(member)
}

/// See `Simulation.energies`.
pub fn energies<'py>(py: Python<'py>, run: &Run) -> PyResult<Bound<'py, PyDict>> {
    let ledger = &run.state.ledger;
    let [normal, shear, bending, twist] = ledger.stored;
    let found = [
        ("kinetic", ledger.kinetic),
        ("stored_normal", normal),
        ("stored_shear", shear),
        ("stored_bending", bending),
        ("stored_twist", twist),
        ("stored_deformation", ledger.deformation),
        ("damage", ledger.damage.get()),
        ("friction", ledger.friction.get()),
        ("viscous", ledger.viscous.get()),
        ("integration", ledger.integration.get()),
        ("numerical_damping", ledger.numerical_damping.get()),
        ("deformation_lag", ledger.deformation_lag.get()),
        ("deformation_other", ledger.deformation_other.get()),
        ("boundary_work", ledger.boundary_work.get()),
        ("external_work", ledger.external_work.get()),
        ("expansion_work", ledger.expansion_work.get()),
        ("stiffness_work", ledger.stiffness_work.get()),
        ("residual", ledger.residual()),
    ];
    let dict = PyDict::new(py);
    found.into_iter().try_for_each(|(name, value)| dict.set_item(name, value))?;
    Ok(dict)
}
