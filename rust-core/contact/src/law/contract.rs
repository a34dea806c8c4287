//! The interface of a contact law.

use super::state::LawState;
use super::straight_form::{ColumnUse, Given};
use crate::columns::Item;
use crate::geometry::{ContactGeometry, Reference, contact_area};
use crate::kinematics::{Kinematics, MotionMeasure, PointKinematics};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::Vec3;

/// A contact law: parameters of a pair of materials, and the response of a contact to its motion.
pub trait ContactLaw: Copy + Send + Sync + 'static {
    /// History of one contact (all zero before its first evaluation).
    type State: LawState;
    /// What the law reads: [`PointKinematics`], or
    /// [`FrameKinematics`](crate::kinematics::FrameKinematics) for beams.
    type Kinematics: Kinematics;
    /// Key of the law in scenarios, result files, and hosts.
    const NAME: &'static str;
    /// Whether the law transmits moments; if not, the solver neither stores nor gathers [`Response::moment`]. Default: yes, if the law
    /// reads orientations.
    const TRANSMITS_MOMENT: bool = <Self::Kinematics as Kinematics>::READS_ORIENTATIONS;
    /// Whether the law supports particles that deform; if not, the solver rejects such particles.
    const DEFORMS: bool = false;
    /// Whether the response of a contact that survives the step depends on
    /// [`elongation_old`](crate::kinematics::PointKinematics::elongation_old). Between particles that deform this value is
    /// expensive; if the law does not read it, surviving contacts get NaN.
    const READS_OLD_ELONGATION: bool = true;

    /// Whether the stiffness grows with the overlap, so that [`Self::stiffness`] bounds it up to some overlap only.
    const STIFFENS: bool = false;

    /// Whether stiffness and strength may depend on the temperature ([`Self::at_temperature`]). The solver then needs elastic forces
    /// and stored energies that are proportional to the stiffness at any given history.
    const VARIES: bool = false;

    /// Response of a contact to the motion of one step of `dt` seconds, which ended in the state `kinematics`.
    ///
    /// `old` is the history before the step, in the world axes of that time. The law rotates its vectors to the present with
    /// [`PointKinematics::transport`](crate::kinematics::PointKinematics::transport).
    fn respond(&self, kinematics: &Self::Kinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// Whether the law has a straight form ([`Self::straight`]), and what that reads and changes. The solver then evaluates up to 16
    /// contacts with equal parameters at a time, in the vector registers of the processor.
    const COLUMNS: Option<ColumnUse> = None;

    /// [`Self::respond`] without branches, and whether the contact certainly survives the step with this response. Where it does, the
    /// bits are those of [`Self::respond`]; where it does not, the response is void, and the solver calls [`Self::respond`].
    ///
    /// Without branches: a choice between two numbers (`min`, `if a > b { x } else { y }` of values that are computed anyway) is none;
    /// `&`, not `&&`; no early return; no transcendental function. `sqrt` and divisions are fine. Constants of the law and of `given` may
    /// choose between formulas.
    ///
    /// What [`ColumnUse`] leaves out is void: masses. In [`FrameKinematics`](crate::kinematics::FrameKinematics), `displacement`, both
    /// turns, and the old length and elongation of `point` are void as well. The conformance suite compares the straight forms of point
    /// laws; for a law with moments, compare a sampled run with one that is not.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &Self::Kinematics,
        old: &Self::State,
        given: &Given,
        dt: f64,
    ) -> (Response<Self::State>, bool) {
        let _ = given;
        (self.respond(kinematics, old, dt), false)
    }

    /// Whether [`Self::straight`] exists for these parameters under this measure; never under
    /// [`MotionMeasure::FirstOrder`].
    #[inline(always)]
    fn is_straight(&self, measure: MotionMeasure) -> bool {
        measure == MotionMeasure::Finite
    }

    /// Whether the optional part of the law acts with these parameters; see [`ColumnUse::optional`].
    #[inline(always)]
    fn uses_optional_part(&self) -> bool {
        false
    }

    /// Whether [`Self::straight`] needs values that have no formula without branches, such as an exponential. The solver finds their
    /// arguments in columns, computes the values one by one, and gives both ([`Given::ahead`]).
    const LOOKS_AHEAD: bool = false;

    /// Whether a contact of a batch may need such a value, judged by the histories before the step. It decides about time only: a contact
    /// that needs a value and has none is not certain.
    #[inline(always)]
    fn may_look_ahead(&self, histories: &<Self::State as Item>::Arrays) -> bool {
        let _ = histories;
        false
    }

    /// Argument of the value that [`Self::straight`] needs; NaN if it needs none. `new` is the history that it returns without the value.
    #[inline(always)]
    fn argument_ahead(old: &Self::State, new: &Self::State) -> f64 {
        let _ = (old, new);
        f64::NAN
    }

    /// The value at an argument, for a contact with this reference.
    #[inline(always)]
    fn value_ahead(&self, reference: Reference, argument: f64) -> f64 {
        let _ = reference;
        argument
    }

    /// The law at a temperature at which its stiffnesses and strengths have these factors.
    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        let _ = factors;
        *self
    }

    /// A history as [`Self::at_temperature`] reads it. Histories are stored for factors of 1; most are the same for all.
    fn history_at(state: &Self::State, factors: &TemperatureFactors) -> Self::State {
        let _ = factors;
        *state
    }

    /// The history to store from that which [`Self::at_temperature`] returned. `old`: stored before the step.
    fn history_from(state: &Self::State, old: &Self::State, factors: &TemperatureFactors) -> Self::State {
        let _ = (old, factors);
        *state
    }

    /// [`Self::respond`] at a temperature with these factors.
    fn respond_at(
        &self,
        factors: &TemperatureFactors,
        kinematics: &Self::Kinematics,
        old: &Self::State,
        dt: f64,
    ) -> Response<Self::State> {
        let read = Self::history_at(old, factors);
        let response = self.at_temperature(factors).respond(kinematics, &read, dt);
        Response { state: Self::history_from(&response.state, old, factors), ..response }
    }

    /// The motion with the arms of the forces, and the elongations of the normal spring, if they are not those of the spheres. `old`: the
    /// history before the step.
    #[inline(always)]
    fn acting(&self, kinematics: Self::Kinematics, old: &Self::State) -> Self::Kinematics {
        let _ = old;
        kinematics
    }

    /// Upper bounds of the contact's stiffness, for the time step.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness;

    /// Largest stiffnesses up to the overlap `overlap` (m). Laws whose stiffness does not grow with the overlap leave the
    /// default: [`Self::stiffness`].
    fn stiffness_at(&self, geometry: &ContactGeometry, overlap: f64) -> Stiffness {
        let _ = overlap;
        self.stiffness(geometry)
    }

    /// Largest overlap (m) of an elastic impact at the relative speed `speed` (m/s); 0 where the stiffness does not depend
    /// on it.
    fn impact_overlap(&self, geometry: &ContactGeometry, speed: f64) -> f64 {
        let _ = (geometry, speed);
        0.0
    }

    /// Reference length (m) and area (m²) of an unbonded contact that begins at center distance `length` (m) between
    /// spheres of the given radii (m; `radius_b` is 0 for a wall). Default: the touching distance and `π min(R)²`.
    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        let _ = length;
        let smaller = if radius_b > 0.0 { radius_a.min(radius_b) } else { radius_a };
        Reference { length: radius_a + radius_b, area: core::f64::consts::PI * (smaller * smaller) }
    }

    /// Reference that a broken bond keeps when it continues as an unbonded contact. `None`: the pair is treated like any
    /// other that comes into contact.
    fn kept_reference(&self, reference: Reference) -> Option<Reference> {
        let _ = reference;
        None
    }

    /// Center distance, m, at which the normal spring of a bond is without force. Default: its reference length.
    fn unstrained_length(&self, geometry: &ContactGeometry) -> f64 {
        geometry.reference_length
    }

    /// Overlap, m, at which an unbonded contact at rest presses with `force` (N). Default: that of a linear spring.
    fn overlap_under(&self, geometry: &ContactGeometry, force: f64) -> f64 {
        force / self.stiffness(geometry).normal
    }

    /// Work, J, that compresses an unbonded contact to its overlap one step ago, if it stores `stored` (J) in its normal spring at the
    /// present one and has just begun. Default: that of a linear spring.
    #[inline(always)]
    fn work_before(&self, motion: &PointKinematics, stored: f64) -> f64 {
        let ratio = motion.elongation_old / motion.elongation;
        stored * (ratio * ratio)
    }

    /// Cross-section, m², of a bond between spheres of the given radii in a packing of the given mean radius, m. Default:
    /// `π min(R)²`.
    fn bonded_area(&self, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        let _ = mean_radius;
        contact_area(radius_a, radius_b)
    }

    /// Axial force (N, tension positive) of a bond whose center distance is `length` (m), for laws in which it depends on
    /// nothing else. The particle-level failure criterion (`fracture::virial`) needs it.
    fn axial_force(&self, geometry: &ContactGeometry, length: f64) -> Option<f64> {
        let _ = (geometry, length);
        None
    }

    /// Force (N) and moment (N·m) on A of a contact that survived its last step, from the history `state` after that step.
    /// `still` is the motion of a step without motion, at the positions of the last one. Default: [`Self::respond`] without motion,
    /// and the dashpots of the history. A law whose dashpots change other forces overrides it.
    fn last_force(&self, still: &Self::Kinematics, state: &Self::State) -> (Vec3, Vec3) {
        // A step so short that nothing viscous flows in it.
        let Response { force, moment, .. } = self.respond(still, state, 1e-30);
        (force + Self::viscous_force(&still.point().normal, state), moment)
    }

    /// Part of the force on A that comes from dashpots, N, from the history after the step; `normal` points from A to B.
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        let _ = (normal, state);
        Vec3::zeros()
    }

    /// Parameters of the same pair with A and B exchanged. They differ only if a parameter belongs to one of the two
    /// particles.
    fn exchanged(&self) -> Self {
        *self
    }

    /// Scalar damage of a history (0 intact, 1 without strength); 0 for laws without damage.
    ///
    /// The event log reports when it crosses a threshold.
    fn damage(_state: &Self::State) -> f64 {
        0.0
    }

    /// Whether a bond whose damage is 1 lives on while it presses. The event log tells of its damage, and its end is no further event.
    const OUTLIVES_FAILURE: bool = false;

    /// What the event log says of a bond in the step in which it is damaged or breaks: its energy, J, the energies of normal, shear,
    /// bending, and twist deformation (J) that give the shares of the modes, and whether shear made it fail. Default: the damage, what the
    /// bond stores, and its status.
    #[inline(always)]
    fn event(response: &Response<Self::State>) -> (f64, [f64; 4], bool) {
        let EnergySplit { damage, stored_normal, stored_shear, stored_bending, stored_twist, .. } = response.energy;
        let in_shear = response.status == Status::BrokeInShear;
        (damage, [stored_normal, stored_shear, stored_bending, stored_twist], in_shear)
    }

    /// Lost fraction of the contact's strength, 0 to 1, if it differs from [`Self::damage`].
    fn lost_strength(&self, reference: Reference, state: &Self::State) -> f64 {
        let _ = reference;
        Self::damage(state)
    }

    /// Length, m, beyond which the law cannot describe a bond; the solver and the hosts refuse longer ones. Default: none.
    fn longest_bond(&self) -> f64 {
        f64::INFINITY
    }
}

/// Factors on the constants of a law at a temperature, and on the strength of a single bond, 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TemperatureFactors {
    /// On all stiffnesses.
    pub stiffness: f64,
    /// On all stresses or forces at which a bond fails or slips.
    pub strength: f64,
}

/// Upper bounds of a contact's stiffness and damping, for the time step.
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
    /// Dashpot in bending, N·m·s/rad.
    pub bending_damping: f64,
    /// Dashpot in twist, N·m·s/rad.
    pub twist_damping: f64,
}

impl Stiffness {
    /// With a factor on the stiffnesses. Dashpots follow `√k`.
    #[must_use]
    pub fn times(self, factor: f64) -> Self {
        let root = factor.sqrt();
        Self {
            normal: self.normal * factor,
            shear: self.shear * factor,
            bending: self.bending * factor,
            twist: self.twist * factor,
            normal_damping: self.normal_damping * root,
            shear_damping: self.shear_damping * root,
            bending_damping: self.bending_damping * root,
            twist_damping: self.twist_damping * root,
        }
    }
}

/// Response of a law to the motion of one step.
#[derive(Debug, Clone, Copy)]
pub struct Response<S> {
    /// Force on A, N. B gets the opposite. Tension pulls A towards B.
    pub force: Vec3,
    /// Moment on A about the contact point, N·m. B gets the opposite. Zero for point laws.
    pub moment: Vec3,
    /// History after the step.
    pub state: S,
    /// Whether the contact survives.
    pub status: Status,
    /// Energies of the contact.
    pub energy: EnergySplit,
}

impl<S: LawState> Response<S> {
    /// Of a contact that survives with this force on A (N) and history, without moment and energies.
    #[inline(always)]
    pub fn of_force(force: Vec3, state: S) -> Self {
        Self { force, moment: Vec3::zeros(), state, status: Status::Lives, energy: EnergySplit::default() }
    }

    /// Of an unbonded contact that opens.
    #[inline(always)]
    pub fn opened(energy: EnergySplit) -> Self {
        Self { force: Vec3::zeros(), moment: Vec3::zeros(), state: S::default(), status: Status::Opened, energy }
    }
}

/// Status of a contact after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Status {
    /// The contact survives.
    #[default]
    Lives,
    /// The bond broke in this step. Force and history of the response are void; after the next neighbor-list rebuild the
    /// pair continues as an unbonded contact. [`EnergySplit::damage`] contains the released energy; the `stored_*` fields
    /// give its modes for the event log.
    Broke,
    /// As [`Self::Broke`], and shear broke it, where the law has a criterion of shear besides one of tension.
    BrokeInShear,
    /// An unbonded contact opened or was never closed: the force is zero, and the history is deleted.
    Opened,
}

impl Status {
    /// Whether a bond broke, in whatever way.
    #[inline(always)]
    pub const fn is_broken(self) -> bool {
        matches!(self, Self::Broke | Self::BrokeInShear)
    }
}

/// Energies of one contact, J: stored energies are state functions, dissipated energies are increments of this step. Each
/// has its own formula; none is a remainder.
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
    /// Error of the trapezoidal work rule where the law has a kink (crack closure): of either sign, proportional to the
    /// square of the step.
    pub integration: f64,
}

impl core::ops::AddAssign for EnergySplit {
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
