//! Brittle bond with tensile strength, cohesion, and friction: the jointed cohesive frictional model of Scholtès and Donzé (2013, J. Mech.
//! Phys. Solids 61:352), as YADE's `Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM` computes it. [`JointedRock`] adds the
//! joints.
//!
//! With the elongation `u` of the contact since it began and the area `A = π min(R)²`,
//!
//! | | |
//! |---|---|
//! | normal force | `f_n = k_n u`, `k_n = 2 E_A R_A E_B R_B/(E_A R_A + E_B R_B)` |
//! | shear force | `f_t ← f_t + k_t Δu_t`, `k_t = 2 E_A R_A ν_A E_B R_B ν_B/(E_A R_A ν_A + E_B R_B ν_B)` |
//! | crack in tension | `u > t A/k_n` |
//! | crack in shear | `‖f_t‖ > c A − f_n tan φ` |
//! | sliding after a crack | `‖f_t‖ ≤ −f_n tan φ` |
//! | contact that was no bond | `‖f_t‖ ≤ −f_n tan φ_r` |
//!
//! in N, m, Pa; `ν` is the ratio of the stiffnesses, `t` the tensile strength, `c` the cohesion, `φ` the angle of friction, and `φ_r` that of
//! surfaces without bond. Forces are those on A, positive in tension.
//!
//! As in YADE:
//!
//! * A contact without bond begins without force, too: it presses from the length that it had in the first step in which the spheres
//!   overlapped.
//! * A bond that cracks in shear under pressure has the full cohesive limit in that step; from the next one on it slides with the friction
//!   of the bond, not the residual one, and with the length of the bond. It ends where `u > 0`.
//! * With `t = 0` the tensile strength is that of the cone, `c A/tan φ`.
//!
//! YADE leaves energies out. A crack in tension, or in shear at `u > 0`, releases the stored energy as [`EnergySplit::damage`]. Under
//! pressure the shear force falls in the step after the crack, and what that dissipates is damage; later slip is friction.

mod rock;
#[cfg(feature = "std")]
mod table;
#[cfg(test)]
mod tests;

pub use rock::{Joint, JointedRock, JointedRockState, OPEN};
#[cfg(feature = "std")]
pub use table::JointedTable;

use super::common::{ParameterError, require};
use super::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Masses, Reference, Response, Status, Stiffness,
    TemperatureFactors,
};
use crate::geometry::contact_area;
use crate::kinematics::{MotionMeasure, PointKinematics};
use crate::math::{Vec3, yade_order::norm};

/// Parameters of the jointed bond.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, Jointed, JointedState};
/// use concordem_contact::math::Vec3;
///
/// let bond = Jointed::new(1.0e9, 0.5, 1.0e6, 2.0e6, 0.5).unwrap();
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 3.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let stretched = PointKinematics {
///     geometry,
///     length: 2.001,
///     length_old: 2.0,
///     elongation: 1.0e-3,
///     elongation_old: 0.0,
///     gap: 1.0e-3,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 1.0005,
///     arm_b: 1.0005,
///     bonded: true,
///     transport: Transport::identity(Vec3::x()),
/// };
/// // Two equal spheres: the stiffness is modulus × radius.
/// let response = bond.respond(&stretched, &JointedState::default(), 1.0e-6);
/// assert_eq!(response.force, Vec3::x() * 1.0e6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Jointed {
    /// Modulus `E_A` of A, Pa.
    pub young_a: f64,
    /// Modulus `E_B` of B, Pa.
    pub young_b: f64,
    /// Ratio of shear to normal stiffness of A, `ν_A`, 1 (YADE calls it `poisson`).
    pub stiffness_ratio_a: f64,
    /// Ratio of shear to normal stiffness of B, `ν_B`, 1.
    pub stiffness_ratio_b: f64,
    /// Tensile strength `t`, Pa; 0 for that of the cone.
    pub tensile_strength: f64,
    /// Cohesion `c`, Pa.
    pub cohesion: f64,
    /// Coefficient of friction `tan φ` of a bond, whole or cracked, 1.
    pub friction: f64,
    /// Coefficient of friction `tan φ_r` of contacts that were no bond, 1.
    pub residual_friction: f64,
}

crate::law_state! {
    /// History of a [`Jointed`] contact.
    pub struct JointedState {
        /// Shear force on A.
        shear_force: Vec3, "N", Odd;
        /// 0 for a whole bond and for a contact that was none, 1 for a bond that cracked in shear in the last step, 2 for one that did before.
        crack: f64, "1", Even;
    }
}

/// Springs and limits of one contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointedContact {
    /// `k_n`, N/m.
    pub normal_stiffness: f64,
    /// `k_t`, N/m.
    pub shear_stiffness: f64,
    /// Largest tension of a whole bond `t A`, N; 0 for that of the cone.
    pub tension: f64,
    /// Largest shear force of a whole bond without normal force `c A`, N.
    pub cohesion: f64,
    /// Coefficient of friction, 1.
    pub friction: f64,
}

/// What ends a contact, or its cohesion, in a step; at most one of them.
#[derive(Clone, Copy)]
struct Ends {
    /// A crack in tension.
    tension: bool,
    /// A crack in shear.
    shear: bool,
    /// It has no cohesion, and is apart.
    apart: bool,
}

impl Jointed {
    /// A bond between equal materials: modulus (Pa), ratio of the stiffnesses, tensile strength (Pa), cohesion (Pa), and coefficient of
    /// friction, also of contacts without bond.
    pub fn new(
        young: f64,
        stiffness_ratio: f64,
        tensile_strength: f64,
        cohesion: f64,
        friction: f64,
    ) -> Result<Self, ParameterError> {
        let bond = Self {
            young_a: young,
            young_b: young,
            stiffness_ratio_a: stiffness_ratio,
            stiffness_ratio_b: stiffness_ratio,
            tensile_strength,
            cohesion,
            friction,
            residual_friction: friction,
        };
        bond.validate()?;
        Ok(bond)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        for young in [self.young_a, self.young_b] {
            require(positive(young), Self::NAME, "young", young, "positive and finite (Pa)")?;
        }
        for ratio in [self.stiffness_ratio_a, self.stiffness_ratio_b] {
            require(not_negative(ratio), Self::NAME, "stiffness_ratio", ratio, "finite and not negative")?;
        }
        for (key, value) in [
            ("tensile_strength", self.tensile_strength),
            ("cohesion", self.cohesion),
            ("friction_coefficient", self.friction),
            ("residual_friction_coefficient", self.residual_friction),
        ] {
            require(not_negative(value), Self::NAME, key, value, "finite and not negative")?;
        }
        Ok(())
    }

    /// `(k_n, k_t)` of a contact, N/m. A wall has no radius; the formulas use that of the particle for both.
    #[inline(always)]
    fn springs(&self, geometry: &ContactGeometry) -> (f64, f64) {
        let radius_b = if geometry.radius_b > 0.0 { geometry.radius_b } else { geometry.radius_a };
        let (a, b) = (self.young_a * geometry.radius_a, self.young_b * radius_b);
        let (shear_a, shear_b) = (a * self.stiffness_ratio_a, b * self.stiffness_ratio_b);
        let sum = shear_a + shear_b;
        let shear = 2.0 * (shear_a * shear_b) / sum;
        (2.0 * (a * b) / (a + b), if sum > 0.0 { shear } else { 0.0 })
    }

    /// Springs and limits of a contact, which is, or was, a bond or not.
    #[inline(always)]
    fn of(&self, geometry: &ContactGeometry, bonded: bool) -> JointedContact {
        let (normal_stiffness, shear_stiffness) = self.springs(geometry);
        JointedContact {
            normal_stiffness,
            shear_stiffness,
            tension: self.tensile_strength * geometry.area,
            cohesion: self.cohesion * geometry.area,
            friction: if bonded { self.friction } else { self.residual_friction },
        }
    }
}

impl JointedContact {
    /// Response to the motion of a step.
    #[inline(always)]
    pub fn respond(&self, kinematics: &PointKinematics, old: &JointedState) -> Response<JointedState> {
        let (response, Ends { tension, shear, apart }) = self.evaluate(kinematics, old);
        if apart {
            return self.part(kinematics, old);
        }
        if tension || shear && kinematics.elongation > 0.0 {
            return self.crack(kinematics, old, shear);
        }
        response
    }

    /// The step of a contact that survives it without an event, and how it ends. Without branches; the order of operations is YADE's.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool)] // branches would keep it out of the vector registers
    fn evaluate(&self, kinematics: &PointKinematics, old: &JointedState) -> (Response<JointedState>, Ends) {
        let Self { normal_stiffness, shear_stiffness, tension, cohesion, friction } = *self;
        let (stretch, compliance) = (kinematics.elongation, compliance(shear_stiffness));
        let whole = kinematics.bonded & (old.crack == 0.0);
        let pressure = -(normal_stiffness * stretch);
        let limit = if whole { cohesion } else { 0.0 } + pressure * friction;
        let carried = kinematics.transport.apply(&old.shear_force);
        let trial = carried + kinematics.shear_increment * shear_stiffness;
        let size = norm(&trial);
        let slides = size > limit;
        let shear_force = trial * if slides { limit / size } else { 1.0 };

        let pulled_off = whole & (tension > 0.0) & (stretch > tension / normal_stiffness);
        let sheared = whole & slides & !pulled_off;
        let ends = Ends { tension: pulled_off, shear: sheared, apart: !whole & (stretch > 0.0) };

        let mut energy = EnergySplit {
            stored_normal: 0.5 * (normal_stiffness * stretch) * stretch,
            stored_shear: 0.5 * shear_force.dot(&shear_force) * compliance,
            ..EnergySplit::default()
        };
        // A contact without bond that begins under pressure had none outside of its length.
        energy.integration = if kinematics.bonded { 0.0 } else { kink(normal_stiffness, kinematics) };
        let slip = (trial - shear_force) * compliance;
        let work = 0.5 * (carried + shear_force).dot(&slip);
        let cracking = sheared | (old.crack == 1.0);
        energy.damage = if cracking { work.max(0.0) } else { 0.0 };
        energy.friction = if cracking { 0.0 } else { work.max(0.0) };
        energy.integration += work.min(0.0);

        let crack = if whole { 0.0 } else { 2.0 };
        let crack = if sheared { 1.0 } else { crack };
        let crack = if kinematics.bonded { crack } else { 0.0 };
        let response = Response {
            force: kinematics.normal * (normal_stiffness * stretch) + shear_force,
            moment: Vec3::zeros(),
            state: JointedState { shear_force, crack },
            status: Status::Lives,
            energy,
        };
        (response, ends)
    }

    /// A whole bond cracks, and no force remains.
    fn crack(&self, kinematics: &PointKinematics, old: &JointedState, shear: bool) -> Response<JointedState> {
        let Self { normal_stiffness, shear_stiffness, .. } = *self;
        let stretch = kinematics.elongation;
        let shear_force = kinematics.transport.apply(&old.shear_force) + kinematics.shear_increment * shear_stiffness;
        let damage = 0.5 * normal_stiffness * stretch * stretch
            + 0.5 * shear_force.dot(&shear_force) * compliance(shear_stiffness);
        // The released energy contains the half of this step's work that the void force would have done.
        let undone = normal_stiffness * stretch * (stretch - kinematics.elongation_old)
            + shear_force.dot(&kinematics.shear_increment);
        // The event log takes the mode of the crack from here.
        let (stored_normal, stored_shear) = if shear { (0.0, damage) } else { (damage, 0.0) };
        let energy =
            EnergySplit { stored_normal, stored_shear, damage, integration: -0.5 * undone, ..EnergySplit::default() };
        ended(if shear { Status::BrokeInShear } else { Status::Broke }, energy)
    }

    /// A contact without bond opens, or a cracked bond does.
    fn part(&self, kinematics: &PointKinematics, old: &JointedState) -> Response<JointedState> {
        let Self { normal_stiffness, shear_stiffness, .. } = *self;
        let carried = kinematics.transport.apply(&old.shear_force);
        let mut energy = EnergySplit { integration: kink(normal_stiffness, kinematics), ..EnergySplit::default() };
        let slip = carried * compliance(shear_stiffness) + kinematics.shear_increment;
        energy.add_friction(0.5 * carried.dot(&slip));
        ended(if kinematics.bonded { Status::Broke } else { Status::Opened }, energy)
    }
}

/// [`ContactLaw::event`] of the energies and the status of a response.
#[inline(always)]
fn event_of(energy: &EnergySplit, status: Status) -> (f64, [f64; 4], bool) {
    let EnergySplit { stored_normal, stored_shear, damage, .. } = *energy;
    if status.is_broken() {
        (damage, [stored_normal, stored_shear, 0.0, 0.0], status == Status::BrokeInShear)
    } else {
        (stored_shear, [0.0, stored_shear, 0.0, 0.0], true)
    }
}

/// `1/k`, 0 without a spring.
#[inline(always)]
fn compliance(stiffness: f64) -> f64 {
    let inverse = 1.0 / stiffness;
    if stiffness > 0.0 { inverse } else { 0.0 }
}

/// Error of the trapezoidal rule for the work of a normal spring (N/m) that acts under pressure only, J.
#[inline(always)]
fn kink(stiffness: f64, kinematics: &PointKinematics) -> f64 {
    let (now, before) = (kinematics.elongation, kinematics.elongation_old);
    0.5 * stiffness * (before.min(0.0) * now.max(0.0) - now.min(0.0) * before.max(0.0))
}

/// A contact without force.
fn ended(status: Status, energy: EnergySplit) -> Response<JointedState> {
    Response { force: Vec3::zeros(), moment: Vec3::zeros(), state: JointedState::default(), status, energy }
}

impl ContactLaw for Jointed {
    type State = JointedState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "jointed";
    const VARIES: bool = true;
    const OUTLIVES_FAILURE: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        Self {
            young_a: self.young_a * factors.stiffness,
            young_b: self.young_b * factors.stiffness,
            tensile_strength: self.tensile_strength * factors.strength,
            cohesion: self.cohesion * factors.strength,
            ..*self
        }
    }

    fn history_at(state: &JointedState, factors: &TemperatureFactors) -> JointedState {
        JointedState { shear_force: state.shear_force * factors.stiffness, ..*state }
    }

    fn history_from(state: &JointedState, _old: &JointedState, factors: &TemperatureFactors) -> JointedState {
        JointedState { shear_force: state.shear_force / factors.stiffness, ..*state }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &JointedState, _dt: f64) -> Response<JointedState> {
        self.of(&kinematics.geometry, kinematics.bonded).respond(kinematics, old)
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse { masses: Masses::Unread, viscous: false, ..ColumnUse::ALL });

    /// Whole bonds that hold, and contacts and cracked bonds that stay closed. Slip is a selection.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &JointedState,
        _given: &Given,
        _dt: f64,
    ) -> (Response<JointedState>, bool) {
        let contact = self.of(&kinematics.geometry, kinematics.bonded);
        let (response, Ends { tension, shear, apart }) = contact.evaluate(kinematics, old);
        (response, !(tension | shear | apart))
    }

    #[inline(always)]
    fn is_straight(&self, measure: MotionMeasure) -> bool {
        measure != MotionMeasure::FirstOrder
    }

    /// In the step of a crack under pressure, the force is beyond what the history allows in the next one.
    fn last_force(&self, still: &PointKinematics, state: &JointedState) -> (Vec3, Vec3) {
        let (normal_stiffness, _) = self.springs(&still.geometry);
        (still.normal * (normal_stiffness * still.elongation) + state.shear_force, Vec3::zeros())
    }

    /// The length of the first step: a contact begins without force. The same at walls.
    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        Reference { length, area: contact_area(radius_a, radius_b) }
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let (normal, shear) = self.springs(geometry);
        Stiffness { normal, shear, ..Stiffness::default() }
    }

    fn exchanged(&self) -> Self {
        Self {
            young_a: self.young_b,
            young_b: self.young_a,
            stiffness_ratio_a: self.stiffness_ratio_b,
            stiffness_ratio_b: self.stiffness_ratio_a,
            ..*self
        }
    }

    fn damage(state: &JointedState) -> f64 {
        state.crack.min(1.0)
    }

    /// Under pressure only shear cracks a bond, and the energy of its shear is the most that the crack sets free.
    #[inline(always)]
    fn event(response: &Response<JointedState>) -> (f64, [f64; 4], bool) {
        event_of(&response.energy, response.status)
    }
}
