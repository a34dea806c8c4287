//! Power put into the contacts, divided into the parts of stress, couple stress, and non-affine motion.
//!
//! Page: [Power](power.md)

use super::affine_strain;
use crate::sampling::definition::{OperatorDefinition, RegionRule, Row, SampledQuantity, Sampling, scalar};
use crate::sampling::state::MotionKind;
use concordem_contact::math::Vec3;
use concordem_operator::OperatorError;
use concordem_operator::power::power;

const QUANTITIES: &[SampledQuantity] = &[
    scalar("contacts", "W", "Power put into the contacts"),
    scalar("stress", "W", "Part due to stress and Cosserat strain rate"),
    scalar("couple", "W", "Part due to couple stress and rate of curvature"),
    scalar("gap", "W", "Remainder due to non-affine motion"),
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "power",
    meaning: "Power put into the contacts, and the parts that stress and strain rate account for.",
    quantities: QUANTITIES,
    region: RegionRule::WholeBodyOrCell,
    evaluate,
    ..OperatorDefinition::PLAIN
};

fn evaluate(sampling: &Sampling<'_>, row: &mut Row) -> Result<(), OperatorError> {
    let particles = sampling.state.particles;
    let fit = affine_strain::fit(sampling, MotionKind::Rate)?;
    let volume = sampling.region.volume()?;
    let carried = image_velocities(sampling);
    let p = power(&sampling.carrying, &particles.velocity, &particles.angular_velocity, &carried, &fit, volume)?;
    row.scalars([p.contacts, p.stress, p.couple, p.gap]);
    Ok(())
}

/// Velocity of the image of particle B relative to B for every contact, m/s; empty without a periodic cell.
fn image_velocities(sampling: &Sampling<'_>) -> Vec<Vec3> {
    let Some(cell) = sampling.state.cell else { return Vec::new() };
    let contacts = &sampling.carrying;
    let velocity = |(pair, branch): (&[u32; 2], &Vec3)| {
        let [a, b] = pair.map(|p| sampling.state.particles.position[p as usize]);
        cell.velocity_gradient * (branch - (b - a))
    };
    contacts.pair().iter().zip(contacts.branch()).map(velocity).collect()
}
