//! Stress of a region as the sum of the particles' stresses: `(1/V) Σ V_p σ_p`.
//!
//! Page: [Stress](stress.md#particles)

use crate::sampling::definition::{
    OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, VOLUME, scalar, tensor,
};
use concordem_operator::OperatorError;
use concordem_operator::stress::{region_stress_from_particles, solid_fraction};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("stress", "Pa", "Sum of V_p sigma_p divided by the volume of the region"),
    tensor("mean_particle_stress", "Pa", "Mean of sigma_p weighted by the volumes of the particles"),
    scalar("solid_fraction", "1", "Volume of the particles with centers in the region, divided by its volume"),
    VOLUME,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "particle-stress",
    meaning: "Stress as the volume average over particles, walls included, and the mean stress in the particles.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    keys: &[SampleKey::Partition],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let (state, region, period) = (sampling.state, sampling.region, sampling.period());
    let particles = state.particles;
    let moments = state.particle_moments(sampling.sample.partition)?;
    let stress = region_stress_from_particles(&particles.position, &moments, region, period)?;
    let solid = solid_fraction(&particles.position, &state.volumes(), region, period)?;
    if solid == 0.0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    row.tensor(&stress).tensor(&(stress / solid)).scalars([solid, region.volume()?]);
    Ok(())
}
