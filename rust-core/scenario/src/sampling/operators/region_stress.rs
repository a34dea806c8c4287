//! Stress of a region: `σ_ij = (1/V) Σ l_i f_j` over the branch vectors of its contacts.

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, VOLUME, tensor,
};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{kinetic_stress, region_stress};
use concordem_operator::{OperatorError, Period};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("stress", "Pa", "Branch sum, rows: normal, columns: force; tension positive"),
    tensor("kinetic_stress", "Pa", "Kinetic part, -sum m v'v'/V, not in `stress`"),
    VOLUME,
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    quantities: QUANTITIES,
    region: RegionRule::Any,
    keys: &[SampleKey::Truncation],
    needs_initial_positions: false,
    needs_bonds: false,
    evaluate,
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let mean = region_stress(&sampling.contacts, sampling.region, sampling.sample.truncation, sampling.period())?;
    let kinetic = kinetic(sampling)?;
    row.tensor(&mean.stress).tensor(&kinetic).scalars([mean.volume, mean.full + mean.partial]);
    Ok(())
}

/// Kinetic stress, Pa; zero in a region without particles. In a deforming cell it counts the velocity relative to the
/// motion of the cell.
fn kinetic(sampling: &Sampling<'_>) -> Result<Mat3, OperatorError> {
    let (particles, cell) = (sampling.state.particles, sampling.state.cell);
    let gradient = cell.map_or_else(Mat3::zeros, |cell| cell.velocity_gradient);
    let motion: Vec<Vec3> = particles.velocity.iter().zip(&particles.position).map(|(v, x)| v - gradient * x).collect();
    let period = cell.map(|cell| Period::of(cell.matrix));
    match kinetic_stress(&particles.position, &particles.mass, &motion, sampling.region, period.as_ref()) {
        Err(OperatorError::EmptyRegion { .. }) => Ok(Mat3::zeros()),
        other => other,
    }
}
