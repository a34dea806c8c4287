//! Fabric tensor and coordination number of a region.
//!
//! Page: [Fabric](fabric.md)

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, PARTICLES, RegionRule, Row, SampleKey, SampledQuantity, Sampling, scalar, tensor,
};
use concordem_operator::{OperatorError, fabric};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("fabric", "1", "Fabric tensor, trace 1"),
    scalar("coordination", "1", "Mean number of contacts per particle"),
    CONTACTS,
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "fabric",
    meaning: "Fabric tensor and coordination number.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    keys: &[SampleKey::Truncation],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let truncation = sampling.sample.truncation;
    let fabric = fabric::fabric(&sampling.contacts, sampling.region, truncation, sampling.period())?;
    row.tensor(&fabric.tensor).scalars([fabric.coordination, fabric.contacts, fabric.particles as f64]);
    Ok(())
}
