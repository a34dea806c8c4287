//! Contact laws: what two particles do to each other, given how they moved.
//!
//! A law is a pure function: parameters are `self`, memory is [`ContactLaw::State`], everything else is an argument.
//! Same inputs give the same bits, whoever calls: the solver, a host code, or a test.
//!
//! A law is one file here, declared below, and one line in the list of [`registry`]: scenarios and hosts read all the rest from
//! the law ([`RegisteredLaw`]).

pub mod cohesive_beam;
pub mod common;
pub mod conformance;
pub mod conformance_frame;
pub mod cpm;
pub mod cpm_table;
pub mod frictional;
pub mod hertz_mindlin;
pub mod linear_bond;
pub mod registry;
pub mod restitution;
pub mod state;
pub mod table;

pub use cohesive_beam::{BeamModel, BendingTerm, CohesiveBeamState, Section};
pub use common::ParameterError;
pub use cpm::{CpmParameters, CpmState};
pub use frictional::{ContactStiffness, FrictionalState};
pub use hertz_mindlin::{Elastic, HertzMindlinState};
pub use linear_bond::LinearBondState;
pub use registry::{ContactLawName, LawName};
pub use state::{Field, LawState, Parity};
pub use table::{Fault, FaultKind, HasTable, LawFacts, LawTable, RegisteredLaw};

macro_rules! laws {
    ($($key:ident: $Law:ident,)*) => { $(pub use $key::$Law;)* };
}
crate::for_each_law!(laws);

use crate::kinematics::sphere_sphere::{self, ImageShift, Motion};
use crate::kinematics::sphere_wall;
use crate::kinematics::{Batch, Columns, MotionMeasure, PointKinematics, PreviousGeometry};
use crate::math::Vec3;
use crate::wall::ClosestPoint;

/// A contact law: a row of parameters that answers kinematics with a wrench.
pub trait ContactLaw: Copy + Send + Sync + 'static {
    /// History of one contact (all zero for a contact that was never evaluated).
    type State: LawState;
    /// What the law reads: [`PointKinematics`], or [`FrameKinematics`](crate::kinematics::FrameKinematics) for beams.
    type Kinematics: Kinematics;
    /// Key of the law in scenarios, result files, and hosts.
    const NAME: &'static str;
    /// Whether the law transmits moments; when false the solver neither stores nor gathers them.
    const TRANSMITS_MOMENT: bool = false;
    /// Whether the law goes with particles that deform; when false the solver refuses such particles.
    const DEFORMS: bool = false;
    /// Whether the answer of a contact that lives on depends on [`PointKinematics::elongation_old`]. Between particles that
    /// deform it costs something to know; where this is false, a contact that lives is not told (NaN).
    const READS_OLD_ELONGATION: bool = true;

    /// The contact's answer to the motion of one step of `dt` seconds, which ended in the state `kinematics`.
    ///
    /// `old` is the history before the step, in world axes of that time; the law transports its vectors to the
    /// present with [`PointKinematics::transport`].
    fn respond(&self, kinematics: &Self::Kinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// Measures the first `count` contacts of a batch, at most [`BATCH`](crate::kinematics::BATCH), and answers them, with the
    /// bits of [`Kinematics::measure`] and [`Self::respond`]. A law may find its answers in columns, too.
    #[inline(always)]
    fn respond_batch<B: Batch<Self>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B, columns: &mut Columns) {
        Self::Kinematics::measure_batch::<Self, B>(mode, count, dt, batch, columns);
    }

    /// Largest stiffnesses the contact can show, for the time step bound.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness;

    /// Reference length (m) and area (m²) of an unbonded contact that begins at centre distance `length` (m) between
    /// spheres of the given radii (m; `radius_b` is 0 for a wall). Default: the touching distance and `π min(R)²`.
    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        let _ = length;
        let smaller = if radius_b > 0.0 { radius_a.min(radius_b) } else { radius_a };
        Reference { length: radius_a + radius_b, area: std::f64::consts::PI * (smaller * smaller) }
    }

    /// Reference length that a broken bond keeps when it goes on as an unbonded contact; `None`: the pair is treated
    /// like any other that comes into touch.
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        let _ = reference;
        None
    }

    /// Cross-section of a bond made between spheres of the given radii in a packing of the given mean radius, m².
    /// Default: `π min(R)²`.
    fn bonded_area(&self, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        let _ = mean_radius;
        cpm::contact_area(radius_a, radius_b)
    }

    /// Axial force (N, tension positive) of a bond whose centre distance is `length` (m), for laws in which nothing
    /// else matters to it; the criterion on particles (`fracture::virial`) needs it.
    fn axial_force(&self, geometry: &ContactGeometry, length: f64) -> Option<f64> {
        let _ = (geometry, length);
        None
    }

    /// Part of the answer's force on A that dashpots exert, N, by the history after the step; `normal` points from A to B.
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        let _ = (normal, state);
        Vec3::zeros()
    }

    /// The row of parameters of the same pair with A and B exchanged: differs only where a parameter belongs to one
    /// of the two particles.
    fn exchanged(&self) -> Self {
        *self
    }

    /// Scalar damage of a history (0 intact, 1 without strength); 0 for laws without damage.
    ///
    /// Crossing a threshold of it makes an entry in the event log.
    fn damage(_state: &Self::State) -> f64 {
        0.0
    }

    /// Share of its strength that a contact has lost, 0 to 1, where that is another thing than [`Self::damage`].
    fn lost_strength(&self, state: &Self::State) -> f64 {
        Self::damage(state)
    }
}

/// Kinematic input of a law, as a class: which measuring function the solver runs for it.
pub trait Kinematics: Copy + Send + Sync {
    /// Whether the measure is the same in all modes.
    const ONE_MODE: bool = false;
    /// Whether the measure reads the orientations of the particles; hosts must supply them then.
    const READS_ORIENTATIONS: bool = false;
    /// Measure a contact; see [`sphere_sphere::measure`].
    fn measure(
        mode: MotionMeasure,
        a: &Motion,
        b: &Motion,
        image: &ImageShift,
        geometry: &ContactGeometry,
        frame: &PreviousGeometry,
        bonded: bool,
        dt: f64,
    ) -> Self;
    /// Measure and answer the first `count` contacts of a batch; see [`ContactLaw::respond_batch`].
    #[inline(always)]
    fn measure_batch<L: ContactLaw<Kinematics = Self>, B: Batch<L>>(
        mode: MotionMeasure,
        count: usize,
        dt: f64,
        batch: &mut B,
        _columns: &mut Columns,
    ) {
        evaluate_each(mode, count, dt, batch);
    }
    /// Measure a contact of particle `a` with a wall moving at `wall_velocity` (m/s), whose nearest point is `closest_point`;
    /// `None` when laws of this kind have no contact with walls.
    fn measure_wall(
        mode: MotionMeasure,
        a: &Motion,
        closest_point: &ClosestPoint,
        wall_velocity: &Vec3,
        geometry: &ContactGeometry,
        frame: &PreviousGeometry,
        dt: f64,
    ) -> Option<Self>;
    /// The point-contact part of the measure: normal, length, arms.
    fn point(&self) -> &PointKinematics;
    /// The same measure between particles that deform; see [`PointKinematics::with_surface_displacement`].
    fn with_surface_displacement(&self, now: f64, before: f64) -> Self;
    /// Distances from the centres of A and B to the contact point at centre distance `length`, m.
    fn arms(geometry: &ContactGeometry, length: f64) -> (f64, f64) {
        let half_gap = 0.5 * (length - geometry.radius_a - geometry.radius_b);
        (geometry.radius_a + half_gap, geometry.radius_b + half_gap)
    }
}

/// Measure and answer the first `count` contacts of a batch one after the other.
#[inline(always)]
fn evaluate_each<L: ContactLaw, B: Batch<L>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B) {
    for i in 0..count {
        evaluate_contact(mode, i, dt, batch);
    }
}

/// Measure and answer contact `i` of a batch that is not like the others.
#[cold]
#[inline(never)]
fn evaluate_one<L: ContactLaw, B: Batch<L>>(mode: MotionMeasure, i: usize, dt: f64, batch: &mut B) {
    evaluate_contact(mode, i, dt, batch);
}

/// Measure and answer contact `i` of a batch.
#[inline(always)]
fn evaluate_contact<L: ContactLaw, B: Batch<L>>(mode: MotionMeasure, i: usize, dt: f64, batch: &mut B) {
    let ([a, b], image) = batch.motions(i);
    let (geometry, frame, bonded) = batch.constants(i);
    let measured = L::Kinematics::measure(mode, &a, &b, &image, &geometry, &frame, bonded, dt);
    batch.evaluate(i, &measured);
}

impl Kinematics for PointKinematics {
    #[inline(always)]
    fn measure(
        mode: MotionMeasure,
        a: &Motion,
        b: &Motion,
        image: &ImageShift,
        geometry: &ContactGeometry,
        frame: &PreviousGeometry,
        bonded: bool,
        dt: f64,
    ) -> Self {
        sphere_sphere::measure(mode, a, b, image, geometry, frame, bonded, dt)
    }
    #[inline(always)]
    fn measure_batch<L: ContactLaw<Kinematics = Self>, B: Batch<L>>(
        mode: MotionMeasure,
        count: usize,
        dt: f64,
        batch: &mut B,
        columns: &mut Columns,
    ) {
        match mode {
            MotionMeasure::Finite => sphere_sphere::finite_batch(count, batch, columns),
            MotionMeasure::Yade if !B::PERIODIC => sphere_sphere::yade_batch(count, dt, false, batch, columns),
            MotionMeasure::YadeRatcheting if !B::PERIODIC => sphere_sphere::yade_batch(count, dt, true, batch, columns),
            _ => evaluate_each(mode, count, dt, batch),
        }
    }
    fn measure_wall(
        mode: MotionMeasure,
        a: &Motion,
        closest_point: &ClosestPoint,
        wall_velocity: &Vec3,
        geometry: &ContactGeometry,
        frame: &PreviousGeometry,
        dt: f64,
    ) -> Option<Self> {
        Some(sphere_wall::measure(mode, a, closest_point, wall_velocity, geometry, frame, dt))
    }
    #[inline(always)]
    fn point(&self) -> &PointKinematics {
        self
    }
    #[inline(always)]
    fn with_surface_displacement(&self, now: f64, before: f64) -> Self {
        PointKinematics::with_surface_displacement(*self, now, before)
    }
}

/// Geometry of a contact that does not change while it lasts, and of its two particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ContactGeometry {
    /// Centre distance at which the contact is unstrained, m (sphere against wall: the radius).
    pub reference_length: f64,
    /// Area of the contact's cross-section, m².
    pub area: f64,
    /// Radius of A, m.
    pub radius_a: f64,
    /// Radius of B, m; 0 for a wall.
    pub radius_b: f64,
    /// Mass of A, kg.
    pub mass_a: f64,
    /// Mass of B, kg; infinite for a wall.
    pub mass_b: f64,
}

impl ContactGeometry {
    /// Reduced mass `m_A m_B/(m_A+m_B)`, kg.
    #[inline]
    pub fn reduced_mass(&self) -> f64 {
        if self.mass_b.is_infinite() { self.mass_a } else { self.mass_a * self.mass_b / (self.mass_a + self.mass_b) }
    }

    /// Effective radius `R_A R_B/(R_A+R_B)`, m; `R_A` against a wall.
    #[inline]
    pub fn effective_radius(&self) -> f64 {
        if self.radius_b <= 0.0 {
            self.radius_a
        } else {
            self.radius_a * self.radius_b / (self.radius_a + self.radius_b)
        }
    }
}

/// Reference geometry of a contact, written when it begins.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Reference {
    /// Centre distance without strain, m.
    pub length: f64,
    /// Cross-section, m².
    pub area: f64,
}

/// Bounds of a contact's stiffness and damping, for the time step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stiffness {
    /// Normal stiffness, N/m.
    pub normal: f64,
    /// Tangential stiffness, N/m.
    pub shear: f64,
    /// Bending stiffness, N·m/rad.
    pub bending: f64,
    /// Twisting stiffness, N·m/rad.
    pub twist: f64,
    /// Normal dashpot, N·s/m.
    pub normal_damping: f64,
    /// Tangential dashpot, N·s/m.
    pub shear_damping: f64,
}

/// A law's answer.
#[derive(Debug, Clone, Copy)]
pub struct Response<S> {
    /// Force on A, N. B gets the opposite. Tension pulls A towards B.
    pub force: Vec3,
    /// Moment on A about the contact point, N·m. B gets the opposite. Zero for point laws.
    pub moment: Vec3,
    /// History after the step.
    pub state: S,
    /// Whether the contact lives on.
    pub status: Status,
    /// Energies of the contact.
    pub energy: EnergySplit,
}

/// What becomes of a contact after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Status {
    /// It goes on.
    #[default]
    Lives,
    /// The bond broke in this step. Force and history of the answer are void; the pair continues, from the next
    /// neighbour search on, as an unbonded contact. The energy released is in [`EnergySplit::damage`]; the `stored_*`
    /// members of the answer tell how it was stored, for the mode shares in the event log.
    Broke,
    /// An unbonded contact opened or was never closed: force zero, history forgotten.
    Opened,
}

/// Energies of one contact: the stored ones as state functions, the dissipated ones as increments of this step.
/// All in J. Each is computed from its own formula, none as a remainder.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct EnergySplit {
    /// Stored by normal deformation.
    pub stored_normal: f64,
    /// Stored by shear.
    pub stored_shear: f64,
    /// Stored by bending.
    pub stored_bending: f64,
    /// Stored by twist.
    pub stored_twist: f64,
    /// Dissipated in this step by damage or by breaking.
    pub damage: f64,
    /// Dissipated in this step by plastic slip and friction.
    pub friction: f64,
    /// Dissipated in this step by dashpots.
    pub viscous: f64,
    /// Error of the trapezoidal work rule where the law has a kink (crack closure): appears with either sign,
    /// vanishes with the square of the step.
    pub integration: f64,
}

impl std::ops::AddAssign for EnergySplit {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        self.stored_normal += other.stored_normal;
        self.stored_shear += other.stored_shear;
        self.stored_bending += other.stored_bending;
        self.stored_twist += other.stored_twist;
        self.damage += other.damage;
        self.friction += other.friction;
        self.viscous += other.viscous;
        self.integration += other.integration;
    }
}
