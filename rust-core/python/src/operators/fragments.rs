//! Fragments, their sieve curve, and the laws that it follows.

use concordem::operator::OperatorError;
use concordem::operator::fragments::sieve::{self, Fit};
use concordem::operator::fragments::{self, Fragment, Membership};
use pyo3::prelude::*;

use super::Any;
use crate::arrays::{Flags, Indices, Scalars, Vectors, result, rows, scalars, vectors};
use crate::errors::OrRaise;
use crate::regions::dimension;
use crate::work::answering;

/// Measure fragments: mass, size, axes, and velocity, the heaviest first.
///
/// Args, one entry per particle: `fragment`, a number that its particles share; `position` (n, 3), m; `radius`, m; `mass`, kg; `velocity`
/// (n, 3), m/s; `dimension`: 2 or 3. Axes are those of the ellipsoid (ellipse) with the same second moments: a sieve lets through what its
/// intermediate axis fits. `sphere` is the diameter of the sphere (disc) with the volume of the particles. Distances do not reach through periodic
/// faces. Returns Fragments. Raises OperatorError for different lengths, numbers that are not finite, and a radius or mass that is not positive.
///
/// >>> import concordem
/// >>> found = concordem.operators.fragments(
/// ...     [7, 7, 9], [[0.0, 0, 0], [2, 0, 0], [9, 0, 0]], [1.0] * 3, [1.0] * 3, [[0.0, 0, 0]] * 3)
/// >>> found.number.tolist(), found.mass.tolist(), float(found.axes[0, 1].round(12))
/// ([7, 9], [2.0, 1.0], 2.0)
#[pyfunction]
#[pyo3(name = "fragments", signature = (fragment, position, radius, mass, velocity, *, dimension=3))]
fn measured<'py>(
    py: Python<'py>,
    fragment: Indices<'py>,
    position: Vectors<'py>,
    radius: Scalars<'py>,
    mass: Scalars<'py>,
    velocity: Vectors<'py>,
    dimension: u8,
) -> Any<'py> {
    let membership = Membership {
        fragment: fragment.get()?,
        position: position.get()?,
        radius: radius.get()?,
        mass: mass.get()?,
        velocity: velocity.get()?,
        dimension: self::dimension(dimension)?,
    };
    let found = answering(py, membership.fragment.len(), || fragments::measure(&membership))?.or_raise()?;
    let axes = of(&found, |fragment| fragment.axes);
    let fields = (
        scalars(py, &of(&found, |fragment| fragment.number)),
        scalars(py, &of(&found, |fragment| fragment.particles as u64)),
        scalars(py, &of(&found, |fragment| fragment.mass)),
        vectors(py, &of(&found, |fragment| fragment.position))?,
        vectors(py, &of(&found, |fragment| fragment.velocity))?,
        scalars(py, &of(&found, |fragment| fragment.sphere)),
        rows::<_, f64>(py, &axes, 3)?,
    );
    result(py, "Fragments", fields)
}

/// Share of the mass that passes each size. Args: `size` (n,), m; `mass` (n,), kg. Returns SieveCurve, smallest size first. Raises OperatorError
/// for different lengths and numbers that are not positive and finite.
///
/// >>> import concordem
/// >>> concordem.operators.sieve_curve([2.0, 1.0, 4.0], [2.0, 1.0, 1.0]).passing.tolist()
/// [0.25, 0.75, 1.0]
#[pyfunction]
fn sieve_curve<'py>(py: Python<'py>, size: Scalars<'py>, mass: Scalars<'py>) -> Any<'py> {
    let curve = sieve::SieveCurve::new(size.get()?, mass.get()?).or_raise()?;
    result(py, "SieveCurve", (scalars(py, &curve.size), scalars(py, &curve.passing)))
}

/// Fit the law of Rosin and Rammler to fragments, `P = 1 − exp(−(x/x′)ⁿ)`, by maximum likelihood with the mass as weight.
///
/// Args: `size` (n,), m; `mass` (n,), kg; `debris` (n,), whether a fragment is a single particle, of which only counts that its mass lies below its
/// size; by default none. Returns SieveFit with standard errors, or None if fewer than ten fragments of equal mass would say as much. Raises
/// OperatorError for different lengths and numbers that are not positive and finite.
///
/// >>> import concordem, numpy
/// >>> share = (numpy.arange(1000) + 0.5) / 1000
/// >>> fit = concordem.operators.rosin_rammler(3 * (-numpy.log(1 - share)) ** (1 / 1.5), numpy.ones(1000))
/// >>> round(fit.size, 2), round(fit.exponent, 2)
/// (3.0, 1.5)
#[pyfunction]
#[pyo3(signature = (size, mass, debris=None))]
fn rosin_rammler<'py>(py: Python<'py>, size: Scalars<'py>, mass: Scalars<'py>, debris: Option<Flags<'py>>) -> Any<'py> {
    fitted(py, sieve::rosin_rammler, &size, &mass, debris.as_ref())
}

/// Fit the law of Gaudin and Schuhmann to fragments, `P = (x/k)ᵐ` up to the largest size k; see `rosin_rammler`.
///
/// >>> import concordem, numpy
/// >>> share = (numpy.arange(1000) + 0.5) / 1000
/// >>> round(concordem.operators.gaudin_schuhmann(3 * share ** (1 / 0.5), numpy.ones(1000)).exponent, 2)
/// 0.5
#[pyfunction]
#[pyo3(signature = (size, mass, debris=None))]
fn gaudin_schuhmann<'py>(
    py: Python<'py>,
    size: Scalars<'py>,
    mass: Scalars<'py>,
    debris: Option<Flags<'py>>,
) -> Any<'py> {
    fitted(py, sieve::gaudin_schuhmann, &size, &mass, debris.as_ref())
}

/// Fits a law to sizes, masses, and debris.
type Law = fn(&[f64], &[f64], &[bool]) -> Result<Option<Fit>, OperatorError>;

fn fitted<'py>(
    py: Python<'py>,
    law: Law,
    size: &Scalars<'py>,
    mass: &Scalars<'py>,
    debris: Option<&Flags<'py>>,
) -> Any<'py> {
    let (size, mass) = (size.get()?, mass.get()?);
    let debris = debris.map_or_else(|| Ok(vec![false; size.len()]), |debris| debris.get().map(<[bool]>::to_vec))?;
    let Some(fit) = answering(py, size.len(), || law(size, mass, &debris))?.or_raise()? else {
        return Ok(py.None().into_bound(py));
    };
    let Fit { size, exponent, deviation, equal } = fit;
    result(py, "SieveFit", (size.value, size.error, exponent.value, exponent.error, deviation, equal))
}

/// A value of each fragment.
fn of<T>(found: &[Fragment], get: impl Fn(&Fragment) -> T) -> Vec<T> {
    found.iter().map(get).collect()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(measured, module)?)?;
    module.add_function(wrap_pyfunction!(sieve_curve, module)?)?;
    module.add_function(wrap_pyfunction!(rosin_rammler, module)?)?;
    module.add_function(wrap_pyfunction!(gaudin_schuhmann, module)?)
}
