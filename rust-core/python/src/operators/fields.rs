//! Fabric, damage, power, and coarse-grained fields.

use concordem::math::Vec3;
use concordem::operator::coarse_grain::{self, Kernel};
use concordem::operator::{damage, fabric, power};
use pyo3::prelude::*;

use super::Any;
use super::contacts::Contacts;
use crate::arrays::{Scalars, Vectors, result, scalars, tensor, tensors, vectors};
use crate::errors::{OrRaise, detach};
use crate::regions::{PyPeriod, PyRegion, dimension, period, truncation};
use crate::strain::PyAffineFit;
use crate::work::answering;

/// Fabric tensor, mean of n⊗n over the branch directions n, and coordination number of a region. Returns Fabric.
///
/// Raises OperatorError for inconsistent tables, ValueError for an unknown truncation.
#[pyfunction]
#[pyo3(name = "fabric", signature = (position, contacts, region, truncation="branch-clipped", period=None))]
fn fabric_of<'py>(
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
    let f = answering(py, set.len() + set.position().len(), || fabric::fabric(&set, region, how, period.as_ref()))?
        .or_raise()?;
    result(py, "Fabric", (tensor(py, &f.tensor)?, f.contacts, f.particles, f.coordination, f.branch_length))
}

/// Number of contacts of every particle, (n,).
#[pyfunction]
fn coordination<'py>(py: Python<'py>, position: Vectors<'py>, contacts: Contacts<'py>) -> Any<'py> {
    let set = contacts.set(&position)?;
    Ok(scalars(py, &detach(py, || fabric::coordination(&set))?).into_any())
}

/// Damage tensor Ω whose nᵀΩn fits the damages of bonds with directions n (Stránský 2018, (6.7)–(6.13)).
///
/// The default assumes evenly distributed directions, `Ω = −(3/2N)(Σω) 1 + (15/2N) Σ ω n⊗n`; `exact`: least squares for these directions.
/// Args: `normal` (n, 3); `damage` (n,). Returns (3, 3). Raises OperatorError for directions that do not determine Ω.
#[pyfunction]
#[pyo3(signature = (normal, damage, exact=false))]
fn damage_tensor<'py>(py: Python<'py>, normal: Vectors<'py>, damage: Scalars<'py>, exact: bool) -> Any<'py> {
    let (normal, values) = (normal.get()?, damage.get()?);
    let fit = if exact { damage::damage_tensor_exact } else { damage::damage_tensor };
    Ok(tensor(py, &detach(py, || fit(normal, values))?.or_raise()?)?.into_any())
}

/// Damage of the strength `1 − (1−ω)κ/ε₀` from that of the stiffness ω, the largest strain κ, and the onset strain ε₀; 0 for κ < ε₀.
///
/// Raises OperatorError for a damage that is not between 0 and 1, a negative strain, and an onset strain that is not positive.
#[pyfunction]
fn strength_damage(stiffness_damage: f64, largest_strain: f64, onset_strain: f64) -> PyResult<f64> {
    damage::strength_damage(stiffness_damage, largest_strain, onset_strain).or_raise()
}

/// Damage of the strength `1 − exp(−(κ−ε₀)/ε_f)` for exponential softening; 0 for κ < ε₀.
///
/// Raises OperatorError for a negative largest strain, and other strains that are not positive.
#[pyfunction]
fn strength_damage_exponential(largest_strain: f64, onset_strain: f64, softening_strain: f64) -> PyResult<f64> {
    damage::strength_damage_exponential(largest_strain, onset_strain, softening_strain).or_raise()
}

/// Power of the contacts, W, and its parts by the affine motion: contacts = stress + couple + gap.
///
/// Args: `position` (n, 3), m; `contacts`; `velocity` (n, 3), m/s; `spin` (n, 3), angular velocity, rad/s; `fit`: affine fit of this
/// motion; `volume`, m³; `image_velocity`: velocity (m/s) of the periodic image of B per contact. Returns PowerReport.
/// Raises OperatorError for different lengths.
#[pyfunction]
#[pyo3(name = "power", signature = (position, contacts, velocity, spin, fit, volume, image_velocity=None))]
fn power_of<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    velocity: Vectors<'py>,
    spin: Vectors<'py>,
    fit: &Bound<'py, PyAffineFit>,
    volume: f64,
    image_velocity: Option<Vectors<'py>>,
) -> Any<'py> {
    let set = contacts.set(&position)?;
    let (velocity, spin, fit) = (velocity.get()?, spin.get()?, &fit.get().0);
    let images = image_velocity.as_ref().map_or(Ok(&[][..]), Vectors::get)?;
    let p =
        answering(py, set.len() + set.position().len(), || power::power(&set, velocity, spin, images, fit, volume))?
            .or_raise()?;
    let (stress, couple) = (tensor(py, &p.stress_tensor)?, tensor(py, &p.couple_stress)?);
    result(py, "PowerReport", (p.contacts, p.particles, p.stress, p.couple, p.gap, stress, couple))
}

/// Density, momentum, and stress at points by coarse-graining (Goldhirsch 2010).
///
/// `ρ = Σ m φ(r−x)`, `p = Σ m v φ`, `σ = Σ l⊗f ∫φ ds`. Args: `position` (n, 3), m; `contacts`; `mass` (n,), kg; `velocity` (n, 3), m/s;
/// `support` of φ, m; `points` (k, 3), m; `dimension`: 2 or 3. Returns CoarseFields of k rows. Raises OperatorError for a support that
/// is not positive.
#[pyfunction]
#[pyo3(name = "coarse_grain", signature = (position, contacts, mass, velocity, support, points, dimension=3, period=None))]
fn coarse_fields<'py>(
    py: Python<'py>,
    position: Vectors<'py>,
    contacts: Contacts<'py>,
    mass: Scalars<'py>,
    velocity: Vectors<'py>,
    support: f64,
    points: Vectors<'py>,
    dimension: u8,
    period: Option<Bound<'py, PyPeriod>>,
) -> Any<'py> {
    let kernel = Kernel::new(support, self::dimension(dimension)?).or_raise()?;
    let period = self::period(period.as_ref());
    let set = contacts.set(&position)?;
    let (mass, velocity, points) = (mass.get()?, velocity.get()?, points.get()?);
    let size = (set.len() + set.position().len()).saturating_mul(points.len());
    let grain = || coarse_grain::coarse_grain(&set, mass, velocity, &kernel, points, period.as_ref());
    let fields = answering(py, size, grain)?.or_raise()?;
    let density: Vec<f64> = fields.iter().map(|field| field.density).collect();
    let momentum: Vec<Vec3> = fields.iter().map(|field| field.momentum).collect();
    let contact = fields.iter().map(|field| field.stress).collect();
    let kinetic = fields.iter().map(|field| field.kinetic_stress).collect();
    let fields = (scalars(py, &density), vectors(py, &momentum)?, tensors(py, contact)?, tensors(py, kinetic)?);
    result(py, "CoarseFields", fields)
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(fabric_of, module)?)?;
    module.add_function(wrap_pyfunction!(coordination, module)?)?;
    module.add_function(wrap_pyfunction!(damage_tensor, module)?)?;
    module.add_function(wrap_pyfunction!(strength_damage, module)?)?;
    module.add_function(wrap_pyfunction!(strength_damage_exponential, module)?)?;
    module.add_function(wrap_pyfunction!(power_of, module)?)?;
    module.add_function(wrap_pyfunction!(coarse_fields, module)?)?;
    Ok(())
}
