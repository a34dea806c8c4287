//! Acoustic emission.

use concordem::math::Vec3;
use concordem::operator::OperatorError;
use concordem::operator::acoustic::{self, Break, Emission};
use pyo3::prelude::*;

use super::Any;
use crate::arrays::{Scalars, Vectors, result, scalars, vectors};
use crate::errors::OrRaise;
use crate::work::answering;

/// Group breaks of bonds into acoustic emissions: breaks at most `distance` and `duration` apart, or joined by a chain of such breaks.
///
/// An emission has the sum of the energies, the magnitude `⅔ log₁₀ E − 3.2` with E in J, and the mean place. Args: `time` (n,), s;
/// `position` (n, 3), m; `energy` (n,), J; `shear_share` (n,), share of shear and twist in the energy; `distance`, m; `duration`, s.
/// Returns Emissions in the order of time. Raises OperatorError for different lengths, numbers that are not finite, and a distance or
/// duration that is not positive. Source: after Hazzard and Young (2000).
///
/// >>> events = result.events                                       # doctest: +SKIP
/// >>> shear = events["mode_shares"][:, 1] + events["mode_shares"][:, 3]   # doctest: +SKIP
/// >>> found = concordem.operators.acoustic_emissions(
/// ...     events["time"], events["position"], events["energy"], shear, distance=2e-3, duration=1e-6)   # doctest: +SKIP
/// >>> concordem.operators.b_value(found.magnitude).b               # doctest: +SKIP
#[pyfunction]
#[pyo3(signature = (time, position, energy, shear_share, *, distance, duration))]
fn acoustic_emissions<'py>(
    py: Python<'py>,
    time: Scalars<'py>,
    position: Vectors<'py>,
    energy: Scalars<'py>,
    shear_share: Scalars<'py>,
    distance: f64,
    duration: f64,
) -> Any<'py> {
    let (time, position, energy, shear) = (time.get()?, position.get()?, energy.get()?, shear_share.get()?);
    for (name, found) in [("position", position.len()), ("energy", energy.len()), ("shear_share", shear.len())] {
        if found != time.len() {
            let error = OperatorError::Length { name, expected: time.len(), found, each: "time" };
            return Err(error).or_raise();
        }
    }
    let events = answering(py, time.len().saturating_mul(100), || {
        let rows = time.iter().zip(position).zip(energy).zip(shear);
        let breaks: Vec<Break> = rows
            .map(|(((&time, &position), &energy), &shear_share)| Break { time, position, energy, shear_share })
            .collect();
        acoustic::emissions(&breaks, distance, duration)
    })?
    .or_raise()?;
    let reals = |of: fn(&Emission) -> f64| scalars(py, &events.iter().map(of).collect::<Vec<f64>>());
    let places: Vec<Vec3> = events.iter().map(|event| event.position).collect();
    let breaks: Vec<u64> = events.iter().map(|event| event.breaks as u64).collect();
    let fields = (
        reals(|event| event.time),
        reals(|event| event.duration),
        vectors(py, &places)?,
        scalars(py, &breaks),
        reals(|event| event.energy),
        reals(Emission::magnitude),
        reals(|event| event.shear_share),
    );
    result(py, "Emissions", fields)
}

/// b-value of events with these magnitudes, by maximum likelihood: `b = log₁₀ e/(mean(M) − M_c)` with the error `b/√n` (Aki 1965).
///
/// Args: `magnitudes` (n,); `completeness` M_c, from which on events count; by default the most frequent class of 0.1 and 0.2 more.
/// Magnitudes that are not finite do not count. Returns BValue, or None if fewer than ten events count.
///
/// >>> import concordem, numpy
/// >>> magnitudes = 2 - numpy.log10((numpy.arange(1000) + 0.5) / 1000)
/// >>> round(concordem.operators.b_value(magnitudes, completeness=2.0).b, 2)
/// 1.0
#[pyfunction]
#[pyo3(signature = (magnitudes, completeness=None))]
fn b_value<'py>(py: Python<'py>, magnitudes: Scalars<'py>, completeness: Option<f64>) -> Any<'py> {
    let Some(found) = acoustic::b_value(magnitudes.get()?, completeness) else {
        return Ok(py.None().into_bound(py));
    };
    result(py, "BValue", (found.b, found.error, found.completeness, found.count))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(acoustic_emissions, module)?)?;
    module.add_function(wrap_pyfunction!(b_value, module)?)
}
