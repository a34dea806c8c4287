//! Solid fraction and porosity of a region.
//!
//! Page: [Fabric](fabric.md)

use crate::sampling::definition::{OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, VOLUME, scalar};
use concordem_operator::OperatorError;
use concordem_operator::stress::solid_fraction;

const QUANTITIES: &[SampledQuantity] = &[
    scalar("solid_fraction", "1", "Volume of the particles with centers in the region, divided by its volume"),
    scalar("porosity", "1", "One minus the solid fraction"),
    VOLUME,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "porosity",
    meaning: "Solid fraction and porosity.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let (state, region) = (sampling.state, sampling.region);
    let solid = solid_fraction(&state.particles.position, &state.volumes(), region, sampling.period())?;
    row.scalars([solid, 1.0 - solid, region.volume()?]);
    Ok(())
}
