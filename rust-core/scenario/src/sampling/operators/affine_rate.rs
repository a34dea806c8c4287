//! Rate of the best affine fit: of velocity and angular velocity.
//!
//! Page: [Strain](strain.md#affine-fit)

use super::affine_strain::evaluate;
use crate::sampling::definition::{OperatorDefinition, PARTICLES, RegionRule, SampledQuantity, scalar, tensor, vector};
use crate::sampling::state::MotionKind;

const QUANTITIES: &[SampledQuantity] = &[
    tensor("gradient", "1/s", "Velocity gradient dv_i/dx_j"),
    tensor("cosserat_rate", "1/s", "Cosserat strain rate dv_j/dx_i - e_ijk w_k"),
    tensor("curvature_rate", "1/(m s)", "Rate of curvature dw_j/dx_i"),
    vector("spin", "rad/s", "Mean angular velocity of the particles"),
    scalar("residual", "m/s", "Root mean square of the non-affine velocity"),
    PARTICLES,
];

pub(super) const DEFINITION: OperatorDefinition = OperatorDefinition {
    name: "affine-rate",
    meaning: "Best affine fit of velocity and angular velocity: gradient, Cosserat strain rate, rate of curvature.",
    quantities: QUANTITIES,
    region: RegionRule::Any,
    evaluate: |sampling, row| evaluate(sampling, MotionKind::Rate, row),
    ..OperatorDefinition::PLAIN
};
