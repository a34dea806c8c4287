//! Force and moment of the particles on a wall: `F = -Σ f`, `M = -Σ ((x − x₀) × f + m)` over the contact points `x` of the wall.
//!
//! The component of the moment along the axis of a plane or a cylinder is the torque on it.
//!
//! Page: [Walls](../how-to/walls-and-stl.md#turn-a-plane-or-a-cylinder)

use crate::sampling::definition::{
    CONTACTS, OperatorDefinition, Refusal, RegionRule, Row, SampleKey, SampledQuantity, Sampling, vector,
};
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    vector("force", "N", "Force of the particles on the wall"),
    vector("moment", "N m", "Moment of these forces about the point `about`, else the initial axis of the wall"),
    CONTACTS,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "wall-moment",
    meaning: "Force and moment of the particles on a wall: the torque of a drum, a vane, or a ring shear test.",
    quantities: QUANTITIES,
    region: RegionRule::WallAlone,
    keys: &[SampleKey::Wall, SampleKey::About],
    // The point that the moment refers to has no image, but the wall has.
    check: |scenario| {
        scenario.is_periodic.then_some(Refusal {
            message: "in a periodic cell the moment depends on the image of the wall",
            help: "use \"wall-traction\", or a packing without a cell",
        })
    },
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let wall = sampling.sample.wall.ok_or(OperatorError::EmptyRegion { what: "wall" })?;
    let about = sampling.sample.about.ok_or(OperatorError::EmptyRegion { what: "point" })?;
    let walls = &sampling.state.forces.walls;
    let of_this_wall = || (0..walls.wall.len()).filter(|&k| walls.wall[k] == wall.wall);
    let force = -of_this_wall().map(|k| walls.force[k]).sum::<Vec3>();
    let moment =
        -of_this_wall().map(|k| (walls.point[k] - about).cross(&walls.force[k]) + walls.moment[k]).sum::<Vec3>();
    row.vector(&force).vector(&moment).scalars([of_this_wall().count() as f64]);
    Ok(())
}
