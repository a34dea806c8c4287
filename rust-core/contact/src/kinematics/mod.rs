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
//! elongation of contacts between particles that deform. [`Kinematics::of_poses`] and [`Kinematics::of_velocities`] measure
//! contacts in columns, with the bits of [`Kinematics::measure`].

pub mod bond_frame;
pub mod deformable;
pub mod motion;
pub mod sphere_sphere;
pub mod sphere_wall;
pub mod transport;

pub use crate::geometry::{PreviousGeometry, initial_geometry};
pub use bond_frame::{BranchVector, EndLoads, EndRotations, FrameKinematics, RestFrame};
pub use motion::{ContactInput, ImageShift, Motion, MotionMeasure, Pose, PoseInput, VelocityInput, WallInput};
pub use transport::Transport;

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

    /// Measure one contact in columns by [`MotionMeasure::Finite`]. Parts that follow from velocities are NaN.
    #[inline(always)]
    fn of_poses(input: &PoseInput, geometry: &ContactGeometry, bonded: bool) -> Self {
        let unknown = Vec3::repeat(f64::NAN);
        let motion = |pose: &Pose| Motion {
            position: pose.position,
            velocity: unknown,
            angular_velocity: unknown,
            rotation_increment: pose.rotation,
            orientation: pose.rotation,
        };
        let PoseInput { a, b, shift, previous } = input;
        let (a, b, image) = (&motion(a), &motion(b), &ImageShift { displacement: *shift, ..ImageShift::default() });
        Self::measure(MotionMeasure::Finite, &ContactInput { a, b, image, geometry, previous, bonded, dt: f64::NAN })
    }

    /// As [`Self::of_poses`], by YADE's measures without a periodic cell. `dt` is the time step, s. Kinematics with one measure
    /// use that.
    fn of_velocities<const RATCHETING: bool>(
        input: &PoseInput,
        velocities: &VelocityInput,
        geometry: &ContactGeometry,
        bonded: bool,
        dt: f64,
    ) -> Self {
        let _ = (velocities, dt);
        Self::of_poses(input, geometry, bonded)
    }

    /// The kinematics of a point contact; `None` if this one has more numbers.
    #[inline(always)]
    fn of_point(point: &PointKinematics) -> Option<Self> {
        let _ = point;
        None
    }

    /// Whether [`Self::of_point`] has the kinematics of any point contact.
    const IS_POINT: bool = false;

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

crate::columns! {
    /// The numbers of a [`PointKinematics`] that a measure computes.
    pub struct Measured {
        length: f64,
        gap: f64,
        elongation: f64,
        arm_a: f64,
        arm_b: f64,
        normal: Vec3,
        shear_increment: Vec3,
        /// `bisector` or `swing` of the [`Transport`].
        swing: Vec3,
        /// `cosine` and `sine`, or `twist` of the [`Transport`].
        twist: Vec3,
    }
}

impl Measured {
    /// The kinematics with the constants of the contact, its geometry of the previous step, and whether it is a bond. `finite`: whether
    /// the measure was [`MotionMeasure::Finite`].
    #[inline(always)]
    pub fn point(
        &self,
        geometry: &ContactGeometry,
        previous: &PreviousGeometry,
        bonded: bool,
        finite: bool,
    ) -> PointKinematics {
        let Self { length, gap, elongation, arm_a, arm_b, normal, shear_increment, swing, twist } = *self;
        PointKinematics {
            geometry: *geometry,
            length,
            length_old: previous.length,
            elongation,
            elongation_old: previous.length - geometry.reference_length,
            gap,
            normal,
            shear_increment,
            arm_a,
            arm_b,
            bonded,
            transport: if finite {
                Transport::Finite { normal, bisector: swing, cosine: twist.x, sine: twist.y }
            } else {
                Transport::FirstOrder { swing, twist }
            },
        }
    }
}

impl PointKinematics {
    /// What the measure computed.
    #[inline(always)]
    pub fn measured(&self) -> Measured {
        let Self { length, gap, elongation, arm_a, arm_b, normal, shear_increment, transport, .. } = *self;
        let (swing, twist) = match transport {
            Transport::Finite { bisector, cosine, sine, .. } => (bisector, Vec3::new(cosine, sine, 0.0)),
            Transport::FirstOrder { swing, twist } => (swing, twist),
        };
        Measured { length, gap, elongation, arm_a, arm_b, normal, shear_increment, swing, twist }
    }

    /// Mean rate of [`Self::length`] in the step of `dt` (s), m/s; positive when the particles separate.
    #[inline(always)]
    pub fn normal_velocity(&self, dt: f64) -> f64 {
        (self.length - self.length_old) / dt
    }

    /// Distance from the center of A to the contact point along [`Self::normal`], m, also where forces have no arms
    /// ([`ContactLaw::acting`](crate::law::ContactLaw::acting)).
    pub fn to_contact_point(&self) -> f64 {
        if self.arm_a == 0.0 { self.geometry.radius_a + 0.5 * self.gap } else { self.arm_a }
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
    const IS_POINT: bool = true;

    #[inline(always)]
    fn measure(mode: MotionMeasure, input: &ContactInput<'_>) -> Self {
        sphere_sphere::measure(mode, input)
    }

    #[inline(always)]
    fn of_velocities<const RATCHETING: bool>(
        input: &PoseInput,
        velocities: &VelocityInput,
        geometry: &ContactGeometry,
        bonded: bool,
        dt: f64,
    ) -> Self {
        let image = ImageShift::default();
        let measure = sphere_sphere::yade::<RATCHETING>(input, velocities, &image, geometry.reference_length, dt);
        measure.point(geometry, &input.previous, bonded)
    }

    fn measure_wall(mode: MotionMeasure, input: &WallInput<'_>) -> Option<Self> {
        Some(sphere_wall::measure(mode, input))
    }

    #[inline(always)]
    fn of_point(point: &PointKinematics) -> Option<Self> {
        Some(*point)
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
