//! Mean motion of a set of particles: each value is the mean over its particles, all with the same weight.
//!
//! Page: [Load a set](../how-to/load-a-set.md)

use crate::sampling::definition::{
    Need, OperatorDefinition, PARTICLES, RegionRule, Row, SampleKey, SampledQuantity, Sampling, vector,
};
use crate::sampling::state::SampledState;
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    vector("position", "m", "Mean position, continuous across periodic borders"),
    vector("displacement", "m", "Mean displacement since the start"),
    vector("velocity", "m/s", "Mean velocity"),
    vector("angular_velocity", "rad/s", "Mean angular velocity of the particles"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "set-motion",
    meaning: "Mean position, displacement, and velocity of a set of particles.",
    quantities: QUANTITIES,
    region: RegionRule::Set,
    keys: &[SampleKey::Set],
    needs: &[Need::InitialPositions],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let particles = state.particles;
    let members = sampling.sample.sets.first().ok_or(OperatorError::EmptyRegion { what: "set" })?;
    row.vector(&SampledState::mean_over(members, |p| state.unwrapped(p)))
        .vector(&state.mean_displacement(members))
        .vector(&SampledState::mean_over(members, |p| particles.velocity[p as usize]))
        .vector(&SampledState::mean_over(members, |p| particles.angular_velocity[p as usize]))
        .scalars([members.len() as f64]);
    Ok(())
}
