//! Motion of particles in a step, and the inputs of the motion measures.

use crate::Cell;
use crate::columns::{BATCH, Item, Lanes};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
use crate::math::{Quat, Symmetric, Vec3};
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

/// Motion of the contacts of a batch. The data of a contact stay constant until it is evaluated, or its results are stored
/// ([`Batch::store_geometries`](crate::law::Batch::store_geometries)).
pub trait MotionSource {
    /// Whether there may be a periodic cell.
    const PERIODIC: bool;
    /// Whether particles may deform.
    const DEFORM: bool;

    /// How the batch moves numbers between rows and columns.
    fn lanes(&self) -> impl Lanes;

    /// Poses of A and B of contact `i`. Their rotations are those in the step, unless [`Self::rotations`] gives these.
    fn poses(&self, i: usize) -> [&Pose; 2];

    /// Poses of A, and those of B, of four contacts.
    #[inline(always)]
    fn four_poses(&self, [i, j, k, l]: [usize; 4]) -> [[&Pose; 4]; 2] {
        let [[ai, bi], [aj, bj], [ak, bk], [al, bl]] = [self.poses(i), self.poses(j), self.poses(k), self.poses(l)];
        [[ai, aj, ak, al], [bi, bj, bk, bl]]
    }

    /// Whether [`Self::rotations`] gives any.
    fn has_rotations(&self) -> bool;

    /// Whether a contact of the batch may cross the border of the cell.
    fn may_cross_border(&self) -> bool;

    /// Whether all contacts of the batch are known to be bonds.
    fn all_bonded(&self) -> bool;

    /// Rotations of A and B in the step, if the poses contain orientations in their place: in scenes with beams.
    fn rotations(&self, i: usize) -> Option<[Quat; 2]>;

    /// Displacement of B's image, m; `None` if the contact does not cross the border of the cell.
    fn shift(&self, i: usize) -> Option<Vec3>;

    /// Motions of A and B, and the image of B.
    fn motions(&self, i: usize) -> ([Motion; 2], ImageShift);

    /// Velocities of A and B (m/s), and their angular velocities (rad/s), in the step.
    fn velocities(&self, i: usize) -> ([&Vec3; 2], [&Vec3; 2]);

    /// Positions (m) and orientations of A and B, and the displacement of B's image (m).
    fn ends(&self, i: usize) -> ([Vec3; 2], [Quat; 2], Vec3);

    /// Constants, geometry of the previous step, and whether the contact is a bond.
    fn constants(&self, i: usize) -> (ContactGeometry, PreviousGeometry, bool);

    /// Whether contact `i` is a bond.
    fn bonded(&self, i: usize) -> bool;

    /// Read the unstrained geometries of the first `count` contacts. As all methods that read, it fills a group of four places to its
    /// end.
    fn read_references(&self, count: usize, arrays: &mut <Reference as Item>::Arrays);

    /// Geometry of contact `i` in the previous step.
    fn previous(&self, i: usize) -> PreviousGeometry;

    /// Read the geometries of the first `count` contacts in the previous step.
    fn read_previous(&self, count: usize, arrays: &mut <PreviousGeometry as Item>::Arrays);

    /// Part of [`Self::constants`]: masses of A and B, kg.
    fn masses(&self, i: usize) -> [f64; 2];

    /// Read the masses of the first `count` contacts.
    fn read_masses(&self, count: usize, arrays: [&mut [f64; BATCH]; 2]);

    /// Sum of the surface displacements of A and B, m; only if particles deform.
    fn surface_displacement(&self, i: usize) -> Symmetric;
}

/// Contacts that are measured and evaluated in one batch. A trait instead of a closure, because implementations must be
/// inlined into functions that are compiled for newer processors.
pub trait MotionSink<K>: MotionSource {
    /// Let the law respond to the motion of contact `i`, and store its response.
    fn evaluate(&mut self, i: usize, kinematics: &K);
}
