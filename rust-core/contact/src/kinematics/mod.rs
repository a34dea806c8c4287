//! Kinematics: relative motion of the two sides of a contact in one step.
//!
//! [`MotionMeasure`] selects how contacts between spheres ([`sphere_sphere`]) and with walls ([`sphere_wall`]) are measured
//! (`kinematics` in a scenario):
//! * [`Finite`](MotionMeasure::Finite) (default): exact for finite rotations;
//! * [`FirstOrder`](MotionMeasure::FirstOrder): Stránský 2018, (2.3)–(2.12) with the corrected sign of (2.8), and a rotation
//!   of the shear history to first order in the step;
//! * [`Yade`](MotionMeasure::Yade) and [`YadeRatcheting`](MotionMeasure::YadeRatcheting): YADE's `ScGeom` with its arms,
//!   without and with its ratcheting correction.
//!
//! [`bond_frame`] measures bonds that transmit moments, in the same way for all measures. [`deformable`] corrects the
//! elongation of contacts between particles that deform. [`Kinematics::measure_batch`] measures many contacts at a time
//! and gives the same bits as the scalar path.

pub mod bond_frame;
pub mod deformable;
pub mod motion;
pub mod sphere_sphere;
pub mod sphere_wall;
pub mod transport;

pub use crate::geometry::{PreviousGeometry, initial_geometry};
pub use bond_frame::{BranchVector, EndLoads, EndRotations, FrameKinematics, RestFrame};
pub use motion::{ContactInput, ImageShift, Motion, MotionMeasure, MotionSink, MotionSource, Pose, WallInput};
pub use transport::Transport;

use crate::columns::Columns;
use crate::geometry::ContactGeometry;
use crate::math::Vec3;

/// Relative motion that a contact law reads: [`PointKinematics`] or [`FrameKinematics`].
pub trait Kinematics: Copy + Send + Sync {
    /// Whether all measures give the same result.
    const ONE_MODE: bool = false;
    /// Whether the measure reads the orientations of the particles; hosts must supply them then.
    const READS_ORIENTATIONS: bool = false;

    /// Measure one contact.
    fn measure(mode: MotionMeasure, input: &ContactInput<'_>) -> Self;

    /// Measure and evaluate the first `count` contacts of `batch`, at most [`BATCH`](crate::columns::BATCH), in ascending
    /// order. Same bits as [`Self::measure`]. `dt` is the time step, s.
    #[inline(always)]
    fn measure_batch<B: MotionSink<Self>>(
        mode: MotionMeasure,
        count: usize,
        dt: f64,
        batch: &mut B,
        _columns: &mut Columns,
    ) {
        measure_each::<Self, B>(mode, count, dt, batch);
    }

    /// Measure a contact with a wall; `None` if the kinematics has no contacts with walls.
    fn measure_wall(mode: MotionMeasure, input: &WallInput<'_>) -> Option<Self>;

    /// The motion as that of a point contact: normal, length, arms.
    fn point(&self) -> &PointKinematics;

    /// Work of constant forces on the bond in the step, J: `force` (N) and `moment` (N·m, about the contact point) act on A, the
    /// opposite ones on B. The part along the normal is that of the elongation, without thermal expansion.
    fn bond_work(&self, force: &Vec3, moment: &Vec3) -> f64 {
        let (point, _) = (self.point(), moment);
        force.dot(&point.normal) * (point.elongation - point.elongation_old) + force.dot(&point.shear_increment)
    }

    /// The same motion between particles that deform; see [`PointKinematics::with_surface_displacement`].
    #[must_use]
    fn with_surface_displacement(&self, now: f64, before: f64) -> Self;

    /// Distances from the centers of A and B to the contact point at center distance `length`, m.
    fn arms(geometry: &ContactGeometry, length: f64) -> (f64, f64) {
        let half_gap = 0.5 * (length - geometry.radius_a - geometry.radius_b);
        (geometry.radius_a + half_gap, geometry.radius_b + half_gap)
    }
}

/// Measure and evaluate the first `count` contacts of `batch` one at a time.
#[inline(always)]
pub fn measure_each<K: Kinematics, B: MotionSink<K>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B) {
    for i in 0..count {
        let measured = measure_contact(mode, i, dt, batch);
        batch.evaluate(i, &measured);
    }
}

/// Measure contact `i` of `source`.
#[inline(always)]
pub fn measure_contact<K: Kinematics, S: MotionSource>(mode: MotionMeasure, i: usize, dt: f64, source: &S) -> K {
    let ([a, b], image) = source.motions(i);
    let (geometry, previous, bonded) = source.constants(i);
    let input = ContactInput { a: &a, b: &b, image: &image, geometry: &geometry, previous: &previous, bonded, dt };
    K::measure(mode, &input)
}

/// Motion of a point contact between two spheres, or a sphere and a wall.
#[derive(Debug, Clone, Copy)]
pub struct PointKinematics {
    /// Constants of the contact.
    pub geometry: ContactGeometry,
    /// Center distance `|x_B − x_A|` (sphere against wall: distance from the surface), m.
    pub length: f64,
    /// `length` at the end of the previous step, m.
    pub length_old: f64,
    /// `length − reference_length`, m; positive in tension. Kinematics computes this difference once, so that laws need not.
    pub elongation: f64,
    /// `elongation` at the end of the previous step, m.
    pub elongation_old: f64,
    /// `length − R_A − R_B`, m; negative when the spheres overlap.
    pub gap: f64,
    /// Unit normal from A to B, now.
    pub normal: Vec3,
    /// Tangential displacement of B relative to A at the contact during this step, m; perpendicular to `normal`.
    pub shear_increment: Vec3,
    /// Distance from the center of A to the contact point along `normal`, m: arm of the force's torque on A.
    pub arm_a: f64,
    /// Distance from the center of B to the contact point along `−normal`, m: arm of the force's torque on B.
    pub arm_b: f64,
    /// Whether the contact is a bond (cohesive) or an ordinary contact.
    pub bonded: bool,
    /// Rotates history vectors from the contact axes of the previous step to those of this step.
    pub transport: Transport,
}

impl PointKinematics {
    /// Mean rate of [`Self::length`] in the step of `dt` (s), m/s; positive when the particles separate.
    #[inline(always)]
    pub fn normal_velocity(&self, dt: f64) -> f64 {
        (self.length - self.length_old) / dt
    }

    /// The same contact between particles that deform. Their surfaces moved towards each other along the normal by `now`
    /// (m, the sum of both), and by `before` until the end of the previous step. The method subtracts these displacements
    /// from the elongations and the gap; center distances and rates stay.
    #[inline(always)]
    #[must_use]
    pub fn with_surface_displacement(mut self, now: f64, before: f64) -> Self {
        self.elongation -= now;
        self.elongation_old -= before;
        self.gap -= now;
        self
    }
}

impl Kinematics for PointKinematics {
    #[inline(always)]
    fn measure(mode: MotionMeasure, input: &ContactInput<'_>) -> Self {
        sphere_sphere::measure(mode, input)
    }

    #[inline(always)]
    fn measure_batch<B: MotionSink<Self>>(
        mode: MotionMeasure,
        count: usize,
        dt: f64,
        batch: &mut B,
        columns: &mut Columns,
    ) {
        match mode {
            MotionMeasure::Finite => sphere_sphere::finite_batch(count, batch, columns),
            MotionMeasure::Yade if !B::PERIODIC => {
                sphere_sphere::yade_batch::<false, B>(count, dt, batch, columns);
            }
            MotionMeasure::YadeRatcheting if !B::PERIODIC => {
                sphere_sphere::yade_batch::<true, B>(count, dt, batch, columns);
            }
            _ => measure_each::<Self, B>(mode, count, dt, batch),
        }
    }

    fn measure_wall(mode: MotionMeasure, input: &WallInput<'_>) -> Option<Self> {
        Some(sphere_wall::measure(mode, input))
    }

    #[inline(always)]
    fn point(&self) -> &PointKinematics {
        self
    }

    fn with_surface_displacement(&self, now: f64, before: f64) -> Self {
        PointKinematics::with_surface_displacement(*self, now, before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Surfaces that have moved towards each other shorten elongation and gap, each by what they had moved at its time; centers and
    /// rates stay. Exact numbers.
    #[test]
    fn surfaces_move_and_centers_stay() {
        let geometry = ContactGeometry {
            reference_length: 2.5,
            area: 1.0,
            radius_a: 1.0,
            radius_b: 1.0,
            mass_a: 1.0,
            mass_b: 1.0,
        };
        let rigid = PointKinematics {
            geometry,
            length: 2.75,
            length_old: 2.5,
            elongation: 0.25,
            elongation_old: 0.0,
            gap: 0.75,
            normal: Vec3::x(),
            shear_increment: Vec3::y() * 0.5,
            arm_a: 1.375,
            arm_b: 1.375,
            bonded: true,
            transport: Transport::identity(Vec3::x()),
        };
        let k = rigid.with_surface_displacement(0.5, 0.125);
        assert_eq!((k.elongation, k.elongation_old, k.gap), (-0.25, -0.125, 0.25));
        assert_eq!((k.length, k.length_old, k.arm_a, k.arm_b), (2.75, 2.5, 1.375, 1.375));
        assert_eq!((k.shear_increment, k.normal_velocity(0.5)), (rigid.shear_increment, 0.5));
    }
}
