//! Stress of particles, regions, and boundaries.

use concordem::operator::stress::{self, ParticleVolume};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Any;
use super::contacts::{Contacts, Loads, loads_or_none};
use crate::arrays::{Scalars, Tensor, Tensors, Vector, Vectors, result, scalars, tensor, tensors, vector};
use crate::errors::{OrRaise, detach};
use crate::regions::{PyPeriod, PyRegion, partition, period, truncation};
use crate::work::answering;

/// Volumes of particles, m³; of discs per unit depth.
///
/// Args: `radius` (n,), m; `kind`: "sphere" or "disc"; `packing_fraction`: divide the volume of a sphere by it.
/// Returns (n,). Raises OperatorError for a radius or fraction that is not positive, ValueError for another kind.
#[pyfunction]
#[pyo3(signature = (radius, kind="sphere", packing_fraction=None))]
fn particle_volumes<'py>(py: Python<'py>, radius: Scalars<'py>, kind: &str, packing_fraction: Option<f64>) -> Any<'py> {
    let volume = match (kind, packing_fraction) {
        ("sphere", None) => ParticleVolume::Sphere,
        ("disc", None) => ParticleVolume::Disc,
        ("sphere", Some(fraction)) => ParticleVolume::Packing(fraction),
        ("disc", Some(_)) => return Err(PyValueError::new_err("packing_fraction applies to spheres only; remove it")),
        (other, _) => {
            return Err(PyValueError::new_err(format!("kind is \"{other}\"; give \"sphere\" or \"disc\"")));
        }
    };
    Ok(scalars(py, &volume.of(radius.get()?).or_raise()?).into_any())
}

/// Moments `V_p σ_p = Σ r⊗f` of the forces on every particle, J.
///
/// `r` points from the center to the contact point, or is half of the branch vector (`partition="half-branch"`). Loads act with their
/// own arm. Args: `position` (n, 3), m; `contacts`; `loads`. Returns (n, 3, 3). Raises OperatorError for inconsistent tables.
#[pyfunction]
#[pyo3(signature = (position, contacts, loads=None, partition="contact-point"))]
fn particle_moments<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    loads: Option<Loads<'py>>,
    partition: &str,
) -> Any<'py> {
    let how = self::partition(partition)?;
    let set = contacts.set(&position)?;
    let loads = loads_or_none(loads.as_ref(), set.position().len())?;
    Ok(tensors(py, detach(py, || stress::particle_moments(&set, &loads, how))?)?.into_any())
}

/// Mean stress of every particle, Pa: its moment (see `particle_moments`) divided by its volume (n,), m³.
///
/// Returns (n, 3, 3). Raises OperatorError for inconsistent tables or a volume that is not positive.
#[pyfunction]
#[pyo3(signature = (position, contacts, volumes, loads=None, partition="contact-point"))]
fn particle_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    volumes: Scalars<'py>,
    loads: Option<Loads<'py>>,
    partition: &str,
) -> Any<'py> {
    let how = self::partition(partition)?;
    let set = contacts.set(&position)?;
    let loads = loads_or_none(loads.as_ref(), set.position().len())?;
    let volumes = volumes.get()?;
    let stress = detach(py, || stress::particle_stress(&set, &loads, how, volumes))?.or_raise()?;
    Ok(tensors(py, stress)?.into_any())
}

/// Stress of a region by the branch sum `σ = (1/V) Σ w l⊗f`, Pa (Stránský 2018, (4.56)).
///
/// `truncation` chooses the weights w of contacts across the border; with `period`, periodic images in the region count.
/// Returns RegionStress. Raises OperatorError for inconsistent tables, ValueError for an unknown truncation.
#[pyfunction]
#[pyo3(signature = (position, contacts, region, truncation="branch-clipped", period=None))]
fn region_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    region: &Bound<'py, PyRegion>,
    truncation: &str,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (how, period) = (self::truncation(truncation)?, self::period(period.as_ref()));
    let set = contacts.set(&position)?;
    let region = &region.get().0;
    let found =
        answering(py, set.len() + set.position().len(), || stress::region_stress(&set, region, how, period.as_ref()))?
            .or_raise()?;
    result(py, "RegionStress", (tensor(py, &found.stress)?, found.volume, found.full, found.partial))
}

/// Stress of a region as volume average over the particles in it, `σ = (1/V) Σ V_p σ_p`, Pa.
///
/// Args: `position` (n, 3), m; `moments` (n, 3, 3), J, of `particle_moments`. Returns (3, 3).
/// Raises ValueError for another shape, OperatorError for different lengths.
#[pyfunction]
#[pyo3(signature = (position, moments, region, period=None))]
fn region_stress_from_particles<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    moments: Tensors<'py>,
    region: &Bound<'py, PyRegion>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (moments, period) = (moments.get()?, self::period(period.as_ref()));
    let (x, region) = (position.get()?, &region.get().0);
    let found = answering(py, x.len(), || stress::region_stress_from_particles(x, &moments, region, period.as_ref()))?
        .or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Stress from the forces on a body's boundary, `σ = (1/V) Σ x⊗f`, Pa (Stránský 2018, (4.54)).
///
/// Args: `count`: number of particles; `loads`; `volume`, m³. Returns (3, 3). Raises OperatorError for a volume that is not positive.
#[pyfunction]
fn boundary_stress<'py>(py: Python<'py>, count: usize, loads: Loads<'py>, volume: f64) -> Any<'py> {
    let found = stress::boundary_stress(&loads.set(count)?, volume).or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Traction on a wall: force (3,), N, divided by area, m². Returns (3,), Pa.
#[pyfunction]
fn wall_traction<'py>(py: Python<'py>, force: Vector, area: f64) -> Any<'py> {
    Ok(vector(py, &stress::wall_traction(&force.0, area).or_raise()?).into_any())
}

/// Kinetic stress `−(1/V) Σ m (v − v̄)⊗(v − v̄)` over the particles in a region, Pa.
///
/// Args: `position` (n, 3), m; `mass` (n,), kg; `velocity` (n, 3), m/s. Returns (3, 3). Raises OperatorError for different lengths.
#[pyfunction]
#[pyo3(signature = (position, mass, velocity, region, period=None))]
fn kinetic_stress<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    mass: Scalars<'py>,
    velocity: Vectors<'py>,
    region: &Bound<'py, PyRegion>,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let (x, mass, velocity, period) = (position.get()?, mass.get()?, velocity.get()?, self::period(period.as_ref()));
    let region = &region.get().0;
    let found =
        answering(py, x.len(), || stress::kinetic_stress(x, mass, velocity, region, period.as_ref()))?.or_raise()?;
    Ok(tensor(py, &found)?.into_any())
}

/// Solid fraction `(1/V) Σ V_p` of the particles whose centers are in a region; porosity is 1 minus it.
///
/// Args: `position` (n, 3), m; `volumes` (n,), m³. Raises OperatorError for different lengths.
#[pyfunction]
#[pyo3(signature = (position, volumes, region, period=None))]
fn solid_fraction(
    py: Python<'_>,
    position: Vectors<'_>,
    volumes: Scalars<'_>,
    region: &Bound<'_, PyRegion>,
    period: Option<Bound<'_, PyPeriod>>,
) -> PyResult<f64> {
    let (x, volumes, region, period) =
        (position.get()?, volumes.get()?, &region.get().0, self::period(period.as_ref()));
    answering(py, x.len(), || stress::solid_fraction(x, volumes, region, period.as_ref()))?.or_raise()
}

/// Axial vector `e_kij σ_ij` of a tensor (3, 3). Returns (3,), in the unit of the tensor.
#[pyfunction]
fn axial<'py>(py: Python<'py>, tensor: Tensor) -> Any<'py> {
    Ok(vector(py, &stress::axial(&tensor.0)).into_any())
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(particle_volumes, module)?)?;
    module.add_function(wrap_pyfunction!(particle_moments, module)?)?;
    module.add_function(wrap_pyfunction!(particle_stress, module)?)?;
    module.add_function(wrap_pyfunction!(region_stress, module)?)?;
    module.add_function(wrap_pyfunction!(region_stress_from_particles, module)?)?;
    module.add_function(wrap_pyfunction!(boundary_stress, module)?)?;
    module.add_function(wrap_pyfunction!(wall_traction, module)?)?;
    module.add_function(wrap_pyfunction!(kinetic_stress, module)?)?;
    module.add_function(wrap_pyfunction!(solid_fraction, module)?)?;
    module.add_function(wrap_pyfunction!(axial, module)?)?;
    Ok(())
}
