//! Coarse-grained density, velocity, and stress at the center of a sphere.
//!
//! Page: [Stress](stress.md#coarse-graining)

use crate::sampling::definition::{
    OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, scalar, tensor, vector,
};
use concordem_operator::coarse_grain::{Kernel, coarse_grain};
use concordem_operator::{OperatorError, Region};

const QUANTITIES: &[SampledQuantity] = &[
    scalar("density", "kg/m^3", "Mass density"),
    vector("velocity", "m/s", "Momentum divided by mass density"),
    tensor("stress", "Pa", "Contact stress, contacts with walls included; tension positive"),
    tensor("kinetic_stress", "Pa", "Kinetic stress, not included in `stress`"),
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "coarse-grain",
    meaning: "Density, velocity, and stress at a point by a smooth kernel; the region is a sphere, the support of the kernel.",
    quantities: QUANTITIES,
    region: RegionRule::Sphere,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    // In two dimensions, a sphere in the scenario becomes a cylinder of unit depth.
    let (Region::Sphere { center, radius } | Region::Cylinder { center, radius, .. }) = sampling.region else {
        return Err(OperatorError::Singular {
            what: "a coarse-grained field",
            reason: "its region is the support of the kernel, a sphere",
        });
    };
    let particles = sampling.state.particles;
    let kernel = Kernel::new(*radius, sampling.state.dimension())?;
    let (mass, velocity) = (&particles.mass, &particles.velocity);
    let fields = coarse_grain(&sampling.carrying, mass, velocity, &kernel, &[*center], sampling.period())?;
    let mut field = fields.first().copied().unwrap_or_default();
    if !sampling.state.forces.walls.particle.is_empty() {
        let walls = sampling.state.at_walls();
        let walls = coarse_grain(&walls.set(particles)?, mass, velocity, &kernel, &[*center], sampling.period())?;
        field.stress += walls.first().copied().unwrap_or_default().stress;
    }
    // The velocity is NaN where there is no mass.
    row.scalars([field.density]).vector(&(field.momentum / field.density));
    row.tensor(&field.stress).tensor(&field.kinetic_stress);
    Ok(())
}
