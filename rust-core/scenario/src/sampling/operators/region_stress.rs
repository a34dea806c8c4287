//! Stress of a region: `σ_ij = (1/V) Σ l_i f_j` over the branch vectors of its contacts. Those with walls end at the contact point.
//!
//! Page: [Stress](stress.md)

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, VOLUME, tensor,
};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{kinetic_stress, region_stress, region_stress_from_particles};
use concordem_operator::{OperatorError, Period};

const QUANTITIES: &[SampledQuantity] = &[
    tensor(
        "stress",
        "Pa",
        "Branch sum with walls and the forces inside clumps, rows: normal, columns: force; tension positive",
    ),
    tensor("kinetic_stress", "Pa", "Kinetic part, -sum m v'v'/V, not included in `stress`"),
    VOLUME,
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "region-stress",
    meaning: "Stress from the sum over branch vectors, and its kinetic part.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    keys: &[SampleKey::Truncation],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let of = |contacts| region_stress(contacts, sampling.region, sampling.sample.truncation, sampling.period());
    let mean = of(&sampling.contacts)?;
    let counted = mean.full + mean.partial;
    // Forces inside rigid bodies do not count as contacts.
    let mut stress = if sampling.state.links.pair.is_empty() { mean.stress } else { of(&sampling.carrying)?.stress };
    let state = sampling.state;
    if !state.forces.walls.particle.is_empty() {
        stress += of(&state.at_walls().set(state.particles)?)?.stress;
    }
    if let Some(moments) = state.surface_moments() {
        let position = &state.particles.position;
        stress += region_stress_from_particles(position, &moments, sampling.region, sampling.period())?;
    }
    let kinetic = match kinetic(sampling) {
        Err(OperatorError::EmptyRegion { .. }) if counted > 0.0 || stress != Mat3::zeros() => Mat3::zeros(),
        other => other?,
    };
    row.tensor(&stress).tensor(&kinetic).scalars([mean.volume, counted]);
    Ok(())
}

/// Kinetic stress, Pa. In a deforming cell, velocities are relative to the motion of the cell.
///
/// # Errors
/// The region has no particles.
fn kinetic(sampling: &Sampling<'_>) -> Result<Mat3, OperatorError> {
    let (particles, cell) = (sampling.state.particles, sampling.state.cell);
    let gradient = cell.map_or_else(Mat3::zeros, |cell| cell.velocity_gradient);
    let motion: Vec<Vec3> = particles.velocity.iter().zip(&particles.position).map(|(v, x)| v - gradient * x).collect();
    let period = cell.map(|cell| Period::of(cell.matrix));
    kinetic_stress(&particles.position, &particles.mass, &motion, sampling.region, period.as_ref())
}
