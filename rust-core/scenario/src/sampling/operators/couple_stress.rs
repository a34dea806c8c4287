//! Stress and couple stress about the center of a region, from the contacts inside it.
//!
//! Page: [Couple stress](couple-stress.md)

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, VOLUME, tensor, vector,
};
use concordem_operator::{OperatorError, couple_stress};

const QUANTITIES: &[SampledQuantity] = &[
    tensor("stress", "Pa", "Stress of contacts internal to the region"),
    tensor("couple_stress", "N/m", "Couple stress about the center of the region"),
    vector("rigid_force", "N/m^3", "Sum of internal forces per volume, zero up to rounding"),
    vector("rigid_moment", "N/m^2", "Sum of internal moments per volume, zero up to rounding"),
    VOLUME,
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "couple-stress",
    meaning: "Stress and couple stress about the center of the region, from contacts internal to the region.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let center = sampling.region.center().unwrap_or_else(|| sampling.state.mean_position());
    let of = |contacts| couple_stress::conjugate(contacts, sampling.region, &center, sampling.period());
    let c = of(&sampling.carrying)?;
    let counted = match of(&sampling.contacts) {
        // Forces inside rigid bodies do not count as contacts.
        Err(OperatorError::EmptyRegion { .. }) => 0,
        other => other?.contacts,
    };
    row.tensor(&c.stress).tensor(&c.couple_stress).vector(&c.rigid_force).vector(&c.rigid_moment);
    row.scalars([c.volume, counted as f64]);
    Ok(())
}
