//! Couple stress and moments.

use concordem::math::Vec3;
use concordem::operator::couple_stress::{self, Resultant};
use concordem::operator::moment_about_contact_point;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Any;
use super::contacts::{Contacts, Loads};
use crate::arrays::{Vector, Vectors, result, tensor, vector, vectors};
use crate::errors::{OrRaise, detach};
use crate::regions::{PyPeriod, PyRegion, or_zero, period};
use crate::work::answering;

/// Couple stress from external loads about a body's centroid x⁰, N/m (Stránský 2018, (4.59)).
///
/// `V μ = V x⁰⊗(1×σ) + Σ x⊗c`. Args: `position` (n, 3), m; `loads`; `volume`, m³; `centroid` (3,), m, default 0. Returns (3, 3).
/// Raises OperatorError for a volume that is not positive.
#[pyfunction]
#[pyo3(signature = (position, loads, volume, centroid=None))]
fn couple_stress_external<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    loads: Loads<'py>,
    volume: f64,
    centroid: Option<Vector>,
) -> Any<'py> {
    let x = position.get()?;
    let found = couple_stress::external(x, &loads.set(x.len())?, volume, &or_zero(centroid)).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Couple stress from contacts about a body's centroid x⁰, N/m (Stránský 2018, (4.57)); not for periodic contacts.
///
/// Equal to `couple_stress_external` if every particle is in equilibrium. Args: `position` (n, 3), m; `contacts`; `volume`, m³;
/// `centroid` (3,), m, default 0. Returns (3, 3). Raises OperatorError for a volume that is not positive.
#[pyfunction]
#[pyo3(signature = (position, contacts, volume, centroid=None))]
fn couple_stress_internal<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    volume: f64,
    centroid: Option<Vector>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let centroid = or_zero(centroid);
    let found = detach(py, || couple_stress::internal(&set, volume, &centroid))?.or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Net force `Σ f` (N) and net moment about its center `Σ (r×f + m)` (N·m) of the contacts on every particle.
///
/// Returns (force, moment), each (n, 3). Raises OperatorError for inconsistent tables.
#[pyfunction]
fn resultants<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
    let set = contacts.set(&position)?;
    let net: Vec<Resultant> = detach(py, || couple_stress::resultants(&set))?;
    let (force, moment): (Vec<Vec3>, Vec<Vec3>) = net.into_iter().map(|net| (net.force, net.moment)).unzip();
    Ok((vectors(py, &force)?.into_any(), vectors(py, &moment)?.into_any()))
}

/// Couple stress from the net forces and moments of the contacts, `V μ = −Σ (x−x⁰)⊗M`, N/m.
///
/// Args: `position`, `force` (N), `moment` (N·m), each (n, 3); `volume`, m³; `reference` x⁰ (3,), m, default 0. Returns (3, 3).
/// Raises ValueError for different lengths.
#[pyfunction]
#[pyo3(signature = (position, force, moment, volume, reference=None))]
fn couple_stress_from_resultants<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    force: Vectors<'py>,
    moment: Vectors<'py>,
    volume: f64,
    reference: Option<Vector>,
) -> Any<'py> {
    let (force, moment) = (force.get()?, moment.get()?);
    if force.len() != moment.len() {
        return Err(PyValueError::new_err(format!(
            "{} forces and {} moments; give one moment per force",
            force.len(),
            moment.len()
        )));
    }
    let net: Vec<_> = force.iter().zip(moment).map(|(&force, &moment)| Resultant { force, moment }).collect();
    let (x, reference) = (position.get()?, or_zero(reference));
    let found = detach(py, || couple_stress::from_resultants(x, &net, volume, &reference))?.or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Stress and couple stress that are work-conjugate to the affine modes of motion of a region.
///
/// Args: `position` (n, 3), m; `contacts`; `region`; `reference` point (3,), m, default 0. Returns ConjugateStress.
/// Raises OperatorError for inconsistent tables.
#[pyfunction]
#[pyo3(signature = (position, contacts, region, reference=None, period=None))]
fn conjugate_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    region: &Bound<'py, PyRegion>,
    reference: Option<Vector>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let (region, reference, period) = (&region.get().0, or_zero(reference), self::period(period.as_ref()));
    let c = answering(py, set.len() + set.position().len(), || {
        couple_stress::conjugate(&set, region, &reference, period.as_ref())
    })?
    .or_raise()?;
    let fields = (
        tensor(py, &c.stress)?,
        tensor(py, &c.couple_stress)?,
        vector(py, &c.rigid_force),
        vector(py, &c.rigid_moment),
        vector(py, &c.rotation),
        c.volume,
        c.contacts,
    );
    result(py, "ConjugateStress", fields)
}

/// Moments about the contact points, N·m, from moments about the centers of A: `m − arm×f`.
///
/// Args: `arm` (center to contact point, m), `force` (N), `moment` (N·m), each (n, 3). Returns (n, 3). Raises ValueError for different
/// lengths.
#[pyfunction]
fn moments_about_contact_points<'py>(
    py: Python<'py>,
    arm: Vectors<'py>,
    force: Vectors<'py>,
    moment: Vectors<'py>,
) -> Any<'py> {
    let (arm, force, moment) = (arm.get()?, force.get()?, moment.get()?);
    if arm.len() != force.len() || arm.len() != moment.len() {
        let message = format!("{} arms, {} forces, {} moments", arm.len(), force.len(), moment.len());
        return Err(PyValueError::new_err(message));
    }
    let moved: Vec<Vec3> = (0..arm.len()).map(|k| moment_about_contact_point(&arm[k], &force[k], &moment[k])).collect();
    Ok(vectors(py, &moved)?.into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(couple_stress_external, module)?)?;
    module.add_function(wrap_pyfunction!(couple_stress_internal, module)?)?;
    module.add_function(wrap_pyfunction!(resultants, module)?)?;
    module.add_function(wrap_pyfunction!(couple_stress_from_resultants, module)?)?;
    module.add_function(wrap_pyfunction!(conjugate_stress, module)?)?;
    module.add_function(wrap_pyfunction!(moments_about_contact_points, module)?)?;
    Ok(())
}
