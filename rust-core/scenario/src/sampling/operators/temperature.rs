//! Temperature of the particles with centers in a region.
//!
//! Page: [Heat](heat.md)

use crate::sampling::definition::{
    Need, OperatorDefinition, PARTICLES, RegionRule, Row, SampledQuantity, Sampling, scalar,
};
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    scalar("temperature", "K", "Mean temperature, weighted by heat capacity"),
    scalar("minimum", "K", "Lowest temperature of a particle"),
    scalar("maximum", "K", "Highest temperature of a particle"),
    scalar("heat_capacity", "J/K", "Heat capacity of the particles"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "temperature",
    meaning: "Mean, lowest, and highest temperature of the particles; needs `[heat]`.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    needs: &[Need::Temperatures],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let state = sampling.state;
    let heat = state.heat.ok_or(OperatorError::EmptyRegion { what: "particle with a temperature" })?;
    let images = sampling.region.images(sampling.period());
    let (mut sum, mut capacity, mut count) = (0.0, 0.0, 0);
    let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
    for (p, x) in state.particles.position.iter().enumerate() {
        for _ in images.inside(p, x) {
            let temperature = heat.temperature[p];
            sum += heat.capacity[p] * temperature;
            capacity += heat.capacity[p];
            (low, high, count) = (low.min(temperature), high.max(temperature), count + 1);
        }
    }
    if count == 0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    row.scalars([sum / capacity, low, high, capacity, f64::from(count)]);
    Ok(())
}
