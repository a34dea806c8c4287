//! Granular temperature: the mean square of the velocity about its mean, `T = Σ m |v − v̄|² / (3 Σ m)`, of the particles with centers in
//! a region.
//!
//! Page: [Notation](notation.md)

use crate::sampling::definition::{
    OperatorDefinition, PARTICLES, RegionRule, Row, SampledQuantity, Sampling, scalar, vector,
};
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;

const QUANTITIES: &[SampledQuantity] = &[
    scalar("temperature", "m^2/s^2", "Mean square of the velocity about its mean, divided by three"),
    vector("velocity", "m/s", "Mean velocity, weighted by mass"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "granular-temperature",
    meaning: "Granular temperature and mean velocity.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let particles = sampling.state.particles;
    let images = sampling.region.images(sampling.period());
    let (mut count, mut mass, mut momentum, mut energy) = (0, 0.0, Vec3::zeros(), 0.0);
    for (p, x) in particles.position.iter().enumerate() {
        for _ in images.inside(p, x) {
            let (m, v) = (particles.mass[p], particles.velocity[p]);
            (count, mass, momentum, energy) = (count + 1, mass + m, momentum + v * m, energy + m * v.norm_squared());
        }
    }
    if count == 0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    let mean = momentum / mass;
    row.scalars([(energy / mass - mean.norm_squared()) / 3.0]).vector(&mean).scalars([f64::from(count)]);
    Ok(())
}
