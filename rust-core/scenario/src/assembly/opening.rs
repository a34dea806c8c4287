//! Loadings and walls that follow the opening of a gauge.

use super::samples::members;
use super::{AssemblyError, unfit};
use crate::schedule::{Extensometer, Loading, Opening, OpeningServo};
use crate::schema::{self, Scenario};
use concordem_solver::state::{Particles, State};

/// The servo of a loading that follows a gauge, if it has one.
pub(super) fn of_loading(
    scenario: &Scenario,
    loading: &Loading,
    state: &State,
) -> Result<Option<Opening>, AssemblyError> {
    let Some(control) = scenario.loading.opening() else { return Ok(None) };
    let full_speed = match (&scenario.loading, loading) {
        (_, Loading::Uniaxial { speed, .. }) => 2.0 * speed.abs(),
        (schema::Loading::Platens { closing_velocity, .. } | schema::Loading::Flexure { closing_velocity, .. }, _) => {
            closing_velocity.si()
        }
        _ => return Err(unfit("loading.opening", "this loading has no ends that could follow a gauge".into())),
    };
    let rate = control.rate.si();
    let times = [control.gain.si(), control.response_time.si()];
    let servo = servo(scenario, &state.particles, &control.gauge, rate.signum(), times)?;
    Ok(Some(Opening { servo, rate, full_speed }))
}

/// A servo that follows the gauge of a `[[sample]]`.
pub(super) fn servo(
    scenario: &Scenario,
    particles: &Particles,
    gauge: &str,
    sign: f64,
    [gain, response_time]: [f64; 2],
) -> Result<OpeningServo, AssemblyError> {
    let sets = scenario.samples.iter().find(|sample| sample.name() == gauge).and_then(|sample| sample.sets.as_ref());
    let Some([first, second]) = sets else {
        return Err(unfit("loading.opening.gauge", format!("`{gauge}` is not a gauge between two sets")));
    };
    let sets = [members(scenario, particles, first)?, members(scenario, particles, second)?];
    Ok(OpeningServo { gauge: Extensometer::new(particles, [&sets[0], &sets[1]]), sign, gain, response_time })
}
