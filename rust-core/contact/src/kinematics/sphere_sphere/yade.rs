//! YADE's measure: `Ig2_Sphere_Sphere_ScGeom` and `ScGeom::precompute`.

use super::super::{ContactInput, ImageShift, Motion, PointKinematics, Pose, PoseInput, Transport, VelocityInput};
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::math::yade_order::{cross, dot, norm};
use crate::math::{Quat, Vec3};

/// Result of YADE's measure.
#[derive(Debug, Clone, Copy)]
pub struct YadeMeasure {
    length: f64,
    penetration: f64,
    elongation: f64,
    arm_a: f64,
    arm_b: f64,
    normal: Vec3,
    shear_increment: Vec3,
    swing: Vec3,
    twist: Vec3,
}

/// Measure a contact, with or without YADE's correction of ratcheting (`avoidGranularRatcheting`); the rotations of the poses and
/// their shift are not read. `dt` is the time step, s.
///
/// The order of floating point operations is YADE's (sums of three as `x + (y + z)`, no fused operations), so that the
/// result equals a trace of YADE bit for bit. The correction is a type parameter: each form compiles without the other.
#[inline(always)]
pub fn yade<const RATCHETING: bool>(
    poses: &PoseInput,
    velocities: &VelocityInput,
    image: &ImageShift,
    reference_length: f64,
    dt: f64,
) -> YadeMeasure {
    let PoseInput { a, b, previous, .. } = *poses;
    let (position_a, position_b, radius_a, radius_b) = (a.position, b.position, a.radius, b.radius);
    let VelocityInput { velocity_a, velocity_b, angular_velocity_a, angular_velocity_b } = *velocities;
    let normal_old = previous.normal;
    let (shift, shift_velocity) = (image.displacement, image.velocity);
    let l = position_b + shift - position_a;
    let length = norm(&l);
    let normal = l / length;
    let penetration = radius_a + radius_b - length;
    let reference_penetration = radius_a + radius_b - reference_length;
    let relative_velocity = if RATCHETING {
        let alpha = (radius_a + radius_b) / (radius_a + radius_b - penetration);
        (velocity_b - velocity_a) * alpha + cross(&angular_velocity_b, &(normal * -radius_b))
            - cross(&angular_velocity_a, &(normal * radius_a))
            + shift_velocity * alpha
    } else {
        let contact_point = position_a + normal * (radius_a - 0.5 * penetration);
        let arm_a = contact_point - position_a;
        let arm_b = contact_point - position_b - shift;
        (velocity_b + cross(&angular_velocity_b, &arm_b)) - (velocity_a + cross(&angular_velocity_a, &arm_a))
            + shift_velocity
    };
    let tangential = relative_velocity - normal * dot(&normal, &relative_velocity);
    let twist = dt * 0.5 * dot(&normal_old, &(angular_velocity_a + angular_velocity_b));
    let periodic_arm = 0.5 * (reference_penetration - penetration);
    let (arm_a, arm_b) = if image.periodic {
        (radius_a + periodic_arm, radius_b + periodic_arm)
    } else {
        (radius_a - 0.5 * penetration, radius_b - 0.5 * penetration)
    };
    YadeMeasure {
        length,
        penetration,
        elongation: reference_penetration - penetration,
        arm_a,
        arm_b,
        normal,
        shear_increment: tangential * dt,
        swing: cross(&normal_old, &normal),
        twist: normal_old * twist,
    }
}

impl YadeMeasure {
    /// The measure as the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, previous: &PreviousGeometry, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: previous.length,
            elongation: self.elongation,
            elongation_old: previous.length - geometry.reference_length,
            gap: -self.penetration,
            normal: self.normal,
            shear_increment: self.shear_increment,
            arm_a: self.arm_a,
            arm_b: self.arm_b,
            bonded,
            transport: Transport::FirstOrder { swing: self.swing, twist: self.twist },
        }
    }
}

#[inline(always)]
pub(super) fn measure<const RATCHETING: bool>(input: &ContactInput<'_>) -> PointKinematics {
    let ContactInput { a, b, image, geometry, previous, bonded, dt } = *input;
    let pose = |motion: &Motion, radius: f64| Pose { position: motion.position, rotation: Quat::identity(), radius };
    let poses = PoseInput {
        a: pose(a, geometry.radius_a),
        b: pose(b, geometry.radius_b),
        shift: Vec3::zeros(),
        previous: *previous,
    };
    let velocities = VelocityInput {
        velocity_a: a.velocity,
        velocity_b: b.velocity,
        angular_velocity_a: a.angular_velocity,
        angular_velocity_b: b.angular_velocity,
    };
    yade::<RATCHETING>(&poses, &velocities, image, geometry.reference_length, dt).point(geometry, previous, bonded)
}
