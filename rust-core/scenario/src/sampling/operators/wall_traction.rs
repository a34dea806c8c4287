//! Force of the particles on a wall, and the traction on a given area.
//!
//! Page: [Stress](stress.md#walls)

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, RegionRule, Row, SampleKey, SampledQuantity, Sampling, vector,
};
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;
use concordem_operator::stress::wall_traction;

const QUANTITIES: &[SampledQuantity] = &[
    vector("force", "N", "Force of the particles on the wall"),
    vector("traction", "Pa", "Force divided by the given area"),
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "wall-traction",
    meaning: "Force of the particles on a wall, and the traction on a given area.",
    quantities: QUANTITIES,
    region: RegionRule::Wall,
    keys: &[SampleKey::Wall, SampleKey::Area],
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let wall = sampling.sample.wall.ok_or(OperatorError::EmptyRegion { what: "wall" })?;
    let contacts = &sampling.state.forces.walls;
    let of_this_wall = || contacts.wall.iter().zip(&contacts.force).filter(|(k, _)| **k == wall.wall);
    let force = -of_this_wall().map(|(_, force)| force).sum::<Vec3>();
    row.vector(&force).vector(&wall_traction(&force, wall.area)?).scalars([of_this_wall().count() as f64]);
    Ok(())
}
