//! Kinematics: how the two sides of a contact moved relative to each other in one step.
//!
//! Measures of the same motion, selected in the scenario by `kinematics`, between spheres and at walls:
//! * [`MotionMeasure::Finite`] (default): exact for finite rotations, see [`sphere_sphere`] and [`sphere_wall`];
//! * [`MotionMeasure::FirstOrder`]: Stránský 2018, (2.3)–(2.12) with the corrected sign of (2.8), and rotation of the shear
//!   history to first order in the step;
//! * [`MotionMeasure::Yade`]: YADE's `ScGeom` with its ratcheting correction and its arms.
//!
//! Bonds that carry moments are measured by [`bond_frame`], in all modes alike. Many contacts are measured together, with the
//! same bits: [`batch`]. Particles that deform under their contacts
//! correct the measure of those: [`deformable`].

pub mod batch;
pub mod bond_frame;
pub mod deformable;
pub mod sphere_sphere;
pub mod sphere_wall;
pub mod transport;

pub use batch::{BATCH, Batch, BatchResult, Columns, Pose};
pub use bond_frame::{BranchVector, EndRotations, FrameKinematics, RestFrame};
pub use transport::Transport;

use crate::law::ContactGeometry;
use crate::math::Vec3;

/// How relative motion is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum MotionMeasure {
    /// Finite increments, exactly objective under rigid motion.
    #[default]
    Finite,
    /// First order in the step, from velocities (the printed form with its sign corrected).
    FirstOrder,
    /// YADE's `ScGeom` without the ratcheting correction: first order, arms to the common contact point.
    Yade,
    /// YADE's `ScGeom` with `avoidGranularRatcheting = True`, YADE's default.
    YadeRatcheting,
}

/// Motion of a contact between two spheres, or a sphere and a wall, seen as a point contact.
#[derive(Debug, Clone, Copy)]
pub struct PointKinematics {
    /// Constants of the contact.
    pub geometry: ContactGeometry,
    /// Centre distance `|x_B − x_A|` (sphere against wall: distance to the surface), m.
    pub length: f64,
    /// `length` one step ago, m.
    pub length_old: f64,
    /// `length − reference_length`, m, computed once here; positive in tension.
    pub elongation: f64,
    /// `elongation` one step ago, m.
    pub elongation_old: f64,
    /// `length − R_A − R_B`, m; negative when the spheres overlap.
    pub gap: f64,
    /// Unit normal from A to B, now.
    pub normal: Vec3,
    /// Tangential displacement of B relative to A at the contact during this step, m; perpendicular to `normal`.
    pub shear_increment: Vec3,
    /// Distance from the centre of A to the contact point along `normal`, m; arm of the force's torque on A.
    pub arm_a: f64,
    /// Distance from the centre of B to the contact point along `−normal`, m; arm of the force's torque on B.
    pub arm_b: f64,
    /// Whether the contact is a bond (cohesive) or an ordinary contact.
    pub bonded: bool,
    /// Carries history vectors from the axes of the last step to those of this step.
    pub transport: Transport,
}

impl PointKinematics {
    /// Mean rate of [`Self::length`] in the step, m/s; positive when the particles part.
    #[inline(always)]
    pub fn normal_velocity(&self, dt: f64) -> f64 {
        (self.length - self.length_old) / dt
    }

    /// The same contact between particles whose surfaces were pushed towards each other, along the normal and in sum, by
    /// `now` (m), and `before` one step ago: of what the contact is stretched, that much is not its own. Distances and
    /// rates of the centres stay.
    #[inline(always)]
    #[must_use]
    pub fn with_surface_displacement(mut self, now: f64, before: f64) -> Self {
        self.elongation -= now;
        self.elongation_old -= before;
        self.gap -= now;
        self
    }
}

/// Torques on A and B about their centres, N·m, of a force on A (N) at the contact point, which lies at the end of A's arm and of
/// B's (m).
#[inline(always)]
pub fn torques(normal: &Vec3, force: &Vec3, arms: [f64; 2]) -> [Vec3; 2] {
    let lever = normal.cross(force);
    arms.map(|arm| lever * arm)
}

/// What a contact remembers of its own geometry from one step to the next.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct PreviousGeometry {
    /// Unit normal from A to B.
    pub normal: Vec3,
    /// Centre distance, m.
    pub length: f64,
}
