//! The finite measure; see the [parent module](super) for the equations.

use super::super::transport::Turn;
use super::super::{ContactInput, PointKinematics, Pose, PoseInput};
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::math::{Quat, Vec3, norm};

/// Result of the finite measure.
#[derive(Debug, Clone, Copy)]
pub struct FiniteMeasure {
    length: f64,
    gap: f64,
    normal: Vec3,
    shear_increment: Vec3,
    turn: Turn,
}

/// Measure a contact, without branches.
#[inline(always)]
fn finite(input: &PoseInput) -> FiniteMeasure {
    let PoseInput { a, b, shift, previous } = *input;
    let (rotation_a, rotation_b, radius_a, radius_b) = (a.rotation, b.rotation, a.radius, b.radius);
    let branch = b.position + shift - a.position;
    let length = norm(&branch);
    let normal = branch * (1.0 / length);
    let gap = length - radius_a - radius_b;
    let rotation_sum = Quat::from(rotation_a.coords + rotation_b.coords);
    let swing_axis = previous.normal.cross(&normal);
    let turn = Turn::finite(&previous.normal, &normal, &swing_axis, &rotation_sum);
    let mean_length = 0.5 * (length + previous.length);
    let mean_half_gap = 0.5 * (mean_length - radius_a - radius_b);
    // 2 w u is the sine vector of a rotation (u, w).
    let turn_a = 2.0 * rotation_a.w * (radius_a + mean_half_gap);
    let turn_b = 2.0 * rotation_b.w * (radius_b + mean_half_gap);
    let turned = rotation_a.imag() * turn_a + rotation_b.imag() * turn_b;
    let c = previous.normal.dot(&normal);
    let late = (previous.normal - normal * c) * mean_length + turned.cross(&normal);
    let along = (turned.dot(&previous.normal) + turned.dot(&normal)) / (1.0 + c);
    let early = late - swing_axis * along;
    let shear_increment = (turn.twist(&normal, &early) + late) * -0.5;
    FiniteMeasure { length, gap, normal, shear_increment, turn }
}

impl FiniteMeasure {
    /// The measure as the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, previous: &PreviousGeometry, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: previous.length,
            elongation: self.length - geometry.reference_length,
            elongation_old: previous.length - geometry.reference_length,
            gap: self.gap,
            normal: self.normal,
            shear_increment: self.shear_increment,
            arm_a: geometry.radius_a + 0.5 * self.gap,
            arm_b: geometry.radius_b + 0.5 * self.gap,
            bonded,
            transport: self.turn.transport(self.normal),
        }
    }
}

#[inline(always)]
pub(super) fn measure(input: &ContactInput<'_>) -> PointKinematics {
    let ContactInput { a, b, geometry, previous, bonded, .. } = *input;
    let input = PoseInput {
        a: Pose { position: a.position, rotation: a.rotation_increment, radius: geometry.radius_a },
        b: Pose { position: b.position, rotation: b.rotation_increment, radius: geometry.radius_b },
        shift: input.image.displacement,
        previous: *previous,
    };
    finite(&input).point(geometry, previous, bonded)
}
