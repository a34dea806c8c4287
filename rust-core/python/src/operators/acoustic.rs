//! Acoustic emission.

use concordem::math::Vec3;
use concordem::operator::OperatorError;
use concordem::operator::acoustic::load::{self, Reloading};
use concordem::operator::acoustic::source::{self, Source};
use concordem::operator::acoustic::{self, Break, Emission};
use pyo3::prelude::*;

use super::Any;
use crate::arrays::{Scalars, Tensor, Vectors, result, scalars, tensor, vectors};
use crate::errors::OrRaise;
use crate::work::answering;

/// Group breaks of bonds into acoustic emissions: breaks at most `distance` and `duration` apart, or joined by a chain of such breaks.
///
/// An emission has the sum of the energies, the magnitude `⅔ log₁₀ E − 3.2` with E in J, and the mean place. Args: `time` (n,), s;
/// `position` (n, 3), m; `energy` (n,), J; `shear_share` (n,), share of shear and twist in the energy; `distance`, m; `duration`, s.
/// Returns Emissions in the order of time. Raises OperatorError for different lengths, numbers that are not finite, negative energies, and
/// a distance or duration that is not positive. Source: after Hazzard and Young (2000).
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
/// Magnitudes that are not finite do not count. Returns BValue, or None if fewer than ten events count. Raises OperatorError for a
/// completeness that is not finite.
///
/// >>> import concordem, numpy
/// >>> magnitudes = 2 - numpy.log10((numpy.arange(1000) + 0.5) / 1000)
/// >>> round(concordem.operators.b_value(magnitudes, completeness=2.0).b, 2)
/// 1.0
#[pyfunction]
#[pyo3(signature = (magnitudes, completeness=None))]
fn b_value<'py>(py: Python<'py>, magnitudes: Scalars<'py>, completeness: Option<f64>) -> Any<'py> {
    let Some(found) = acoustic::b_value(magnitudes.get()?, completeness).or_raise()? else {
        return Ok(py.None().into_bound(py));
    };
    result(py, "BValue", (found.b, found.error, found.completeness, found.count))
}

/// Find out from which load on a specimen emits again when it is reloaded (Kaiser effect; Felicity ratio).
///
/// Args: `time` (n,), s, not falling; `load` (n,), positive; `emissions` (m,), their times, s; `drop`: fall of the load, as a share of the largest
/// one so far, from which on the specimen is unloaded; `onset`: which emission after the least load counts. Returns Reloadings, one row for each
/// time that the specimen was unloaded and loaded again, with NaN where it did not emit. Raises OperatorError for different lengths, numbers that
/// are not finite, times that fall, a `drop` outside of 0 to 1, and an `onset` of 0.
///
/// >>> import concordem
/// >>> found = concordem.operators.reloadings([0, 1, 2, 3], [0.0, 10, 2, 12], [0.6, 1.25, 2.7])
/// >>> found.former.tolist(), found.felicity.round(12).tolist()
/// ([10.0], [0.9])
#[pyfunction]
#[pyo3(signature = (time, load, emissions, *, drop=0.1, onset=1))]
fn reloadings<'py>(
    py: Python<'py>,
    time: Scalars<'py>,
    load: Scalars<'py>,
    emissions: Scalars<'py>,
    drop: f64,
    onset: usize,
) -> Any<'py> {
    let (time, load, emissions) = (time.get()?, load.get()?, emissions.get()?);
    let length = time.len().saturating_add(emissions.len());
    let found = answering(py, length, || load::reloadings(time, load, emissions, drop, onset))?.or_raise()?;
    let reals = |of: fn(&Reloading) -> f64| scalars(py, &found.iter().map(of).collect::<Vec<f64>>());
    let fields = (
        reals(|turn| turn.former),
        reals(|turn| turn.time),
        reals(|turn| turn.least),
        reals(|turn| turn.onset.unwrap_or(f64::NAN)),
        reals(|turn| turn.felicity().unwrap_or(f64::NAN)),
    );
    result(py, "Reloadings", fields)
}

/// Moment tensor of an event, N m: the symmetric part of `Σ ΔF⊗R`. Args: `force` (n, 3), change of the force at each point, N; `arm` (n, 3), from
/// the center of the event to the point, m. Raises OperatorError for different lengths and numbers that are not finite. Source: Hazzard and
/// Young (2002; 2004).
#[pyfunction]
fn moment_tensor<'py>(py: Python<'py>, force: Vectors<'py>, arm: Vectors<'py>) -> Any<'py> {
    Ok(tensor(py, &source::moment_tensor(force.get()?, arm.get()?).or_raise()?)?.into_any())
}

/// What kind of source a moment tensor (3, 3) describes, N m: shares of expansion, compensated linear vector dipole, and double couple. Returns
/// SourceMechanism. Raises OperatorError for numbers that are not finite. Source: Knopoff and Randall (1970), scaled as by Vavryčuk (2015).
///
/// >>> import concordem
/// >>> concordem.operators.source_mechanism([[0.0, 2, 0], [2, 0, 0], [0, 0, 0]]).moment
/// 2.0
#[pyfunction]
fn source_mechanism<'py>(py: Python<'py>, tensor: Tensor) -> Any<'py> {
    let Source { moment, magnitude, isotropic, dipole, double_couple } = source::source(&tensor.0).or_raise()?;
    result(py, "SourceMechanism", (moment, magnitude, isotropic, dipole, double_couple))
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(acoustic_emissions, module)?)?;
    module.add_function(wrap_pyfunction!(b_value, module)?)?;
    module.add_function(wrap_pyfunction!(reloadings, module)?)?;
    module.add_function(wrap_pyfunction!(moment_tensor, module)?)?;
    module.add_function(wrap_pyfunction!(source_mechanism, module)?)
}
