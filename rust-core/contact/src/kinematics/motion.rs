//! Motion of particles in a step, and the inputs of the motion measures.

use crate::Cell;
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::math::{Quat, Vec3};
use crate::wall::ClosestPoint;

/// How relative motion is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(
    feature = "std",
    derive(serde::Serialize, serde::Deserialize, schemars::JsonSchema),
    serde(rename_all = "kebab-case")
)]
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

/// Motion of one particle in a step.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Center at the end of the step, m.
    pub position: Vec3,
    /// Velocity in the step, m/s.
    pub velocity: Vec3,
    /// Angular velocity in the step, rad/s.
    pub angular_velocity: Vec3,
    /// Rotation in the step.
    pub rotation_increment: Quat,
    /// Orientation at the end of the step, body to world.
    pub orientation: Quat,
}

/// The part of a particle's motion that the default measure reads, in one cache line.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
pub struct Pose {
    /// Center at the end of the step, m.
    pub position: Vec3,
    /// Rotation in the step for the default measure, or orientation (body to world) for beams.
    pub rotation: Quat,
    /// Radius, m.
    pub radius: f64,
}

crate::column_arrays! { pub Pose { position: Vec3, rotation: Quat, radius: f64 } }

/// Displacement and velocity of the periodic image of B in a contact with A.
#[derive(Debug, Clone, Copy, Default)]
pub struct ImageShift {
    /// `H·image`, m.
    pub displacement: Vec3,
    /// `L·H·image`, m/s.
    pub velocity: Vec3,
    /// Whether the scene is periodic. YADE's torque arms depend on it.
    pub periodic: bool,
}

impl ImageShift {
    /// The image with the given indices in a cell. YADE's measures use the velocity of the cell edges at the start of the
    /// step, `L·(H − ΔH)·image` (YADE's `intrShiftVel`).
    #[inline(always)]
    pub fn of(cell: &Cell, image: [i8; 3], mode: MotionMeasure) -> Self {
        let displacement = cell.shift(image);
        let from = match mode {
            MotionMeasure::Finite | MotionMeasure::FirstOrder => displacement,
            MotionMeasure::Yade | MotionMeasure::YadeRatcheting => {
                displacement - cell.matrix_change * Vec3::from(image.map(f64::from))
            }
        };
        Self { displacement, velocity: cell.velocity_gradient * from, periodic: true }
    }
}

/// Input of a measure for a contact between two particles.
#[derive(Debug, Clone, Copy)]
pub struct ContactInput<'a> {
    /// Motion of A.
    pub a: &'a Motion,
    /// Motion of B.
    pub b: &'a Motion,
    /// Periodic image of B.
    pub image: &'a ImageShift,
    /// Constants of the contact.
    pub geometry: &'a ContactGeometry,
    /// Geometry at the end of the previous step.
    pub previous: &'a PreviousGeometry,
    /// Whether the contact is a bond.
    pub bonded: bool,
    /// Time step, s.
    pub dt: f64,
}

impl ContactInput<'_> {
    /// Branch vector `l = x_B + shift − x_A`, m.
    #[inline(always)]
    pub fn branch(&self) -> Vec3 {
        self.b.position + self.image.displacement - self.a.position
    }
}

/// Input of a measure for a contact between a particle and a wall.
#[derive(Debug, Clone, Copy)]
pub struct WallInput<'a> {
    /// Motion of the particle.
    pub a: &'a Motion,
    /// Closest point of the wall.
    pub closest_point: &'a ClosestPoint,
    /// Velocity of the wall there, m/s.
    pub wall_velocity: &'a Vec3,
    /// Rotation of the surface there in the step: identity for a wall that only translates.
    pub wall_rotation: &'a Quat,
    /// Constants of the contact.
    pub geometry: &'a ContactGeometry,
    /// Geometry at the end of the previous step.
    pub previous: &'a PreviousGeometry,
    /// Time step, s.
    pub dt: f64,
}

crate::columns! {
    /// What measures read of a contact and its particles, in columns.
    pub struct PoseInput {
        /// A with its rotation in the step; for beams, with its orientation.
        pub a: Pose,
        /// B with its rotation in the step; for beams, with its orientation.
        pub b: Pose,
        /// Displacement of B's image, m.
        pub shift: Vec3,
        /// Geometry of the previous step.
        pub previous: PreviousGeometry,
    }

    /// What YADE's measures also read.
    pub struct VelocityInput {
        /// Velocity of A, m/s.
        pub velocity_a: Vec3,
        /// Velocity of B, m/s.
        pub velocity_b: Vec3,
        /// Angular velocity of A, rad/s.
        pub angular_velocity_a: Vec3,
        /// Angular velocity of B, rad/s.
        pub angular_velocity_b: Vec3,
    }
}
