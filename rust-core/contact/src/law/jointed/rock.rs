//! Jointed rock: bonds and contacts of [`Jointed`], and smooth joints between particles on two sides of a joint, as YADE's
//! `Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM` computes them with `smoothJoint` (Scholtès and Donzé 2012, Int. J. Rock Mech. Min.
//! Sci. 52:18; the smooth joint is that of Mas Ivars et al. 2011, Int. J. Rock Mech. Min. Sci. 48:219).
//!
//! A contact across a joint does not see the directions of its particles, but the joint: with the unit normal `n` of the joint, the branch
//! vector `l`, and the area `A` of the contact,
//!
//! | | |
//! |---|---|
//! | opening | `u = |l·n| − d`, `d` is that of the first step |
//! | normal force | `f_n = K_n A u` |
//! | shear force | `f_t ← f_t + K_s A Δl_t`, `Δl_t = (1 − n n) Δl` |
//! | crack in tension | `u > t A/(K_n A)` |
//! | crack in shear | `‖f_t‖ > c A − f_n tan φ` |
//! | after a crack | `‖f_t‖ ≤ −f_n tan φ` |
//! | dilation | `d ← d + ‖Δl_t‖ tan ψ` after a step in which the shear force has met its limit |
//! | end | apart without cohesion, or after a slip `Σ‖Δl_t‖` of twice the smaller radius |
//!
//! The forces act at the centers, without torques: rotations of the particles do not matter. The normal stays as it is in space.

use super::{Jointed, JointedState, event_of};
use crate::geometry::contact_area;
use crate::kinematics::{MotionMeasure, PointKinematics};
use crate::law::common::{ParameterError, require};
use crate::law::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Reference, Response, Status, Stiffness,
    TemperatureFactors,
};
use crate::math::{Vec3, yade_order::norm};

/// Constants of a joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// Unit normal `n`; its sign does not matter.
    pub normal: Vec3,
    /// Normal stiffness per area `K_n`, Pa/m.
    pub normal_stiffness: f64,
    /// Shear stiffness per area `K_s`, Pa/m.
    pub shear_stiffness: f64,
    /// Tensile strength `t`, Pa; 0 for that of the cone.
    pub tensile_strength: f64,
    /// Cohesion `c`, Pa.
    pub cohesion: f64,
    /// Coefficient of friction `tan φ`, 1.
    pub friction: f64,
    /// Tangent of the angle of dilation `tan ψ`, 1.
    pub dilation: f64,
}

/// The law between two particles in jointed rock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointedRock {
    /// The law off joints.
    pub bond: Jointed,
    /// The joint between the particles, if they lie on two sides of one.
    pub joint: Option<Joint>,
}

crate::law_state! {
    /// History of a [`JointedRock`] contact.
    pub struct JointedRockState {
        /// Shear force on A.
        shear_force: Vec3, "N", Odd;
        /// As in `jointed` bonds: 0 without a crack, 1 for one in shear in the last step, 2 for one before; 3 from the start for joints without strength.
        crack: f64, "1", Even;
        /// Branch vector from A to B across a joint; 0 off joints.
        branch: Vec3, "m", Odd;
        /// Distance of the centers across a joint without normal force; 0 off joints.
        rest: f64, "m", Even;
        /// By how much `rest` grew at the end of the last step.
        dilation: f64, "m", Even;
        /// Length of the path that the particles slid along a joint.
        slip: f64, "m", Even;
    }
}

/// [`JointedRockState::crack`] of a bond that is open from the start.
pub const OPEN: f64 = 3.0;

impl JointedRockState {
    fn of_bond(state: JointedState) -> Self {
        Self { shear_force: state.shear_force, crack: state.crack, ..Self::default() }
    }

    #[inline(always)]
    fn bond(&self) -> JointedState {
        JointedState { shear_force: self.shear_force, crack: self.crack }
    }
}

impl Joint {
    /// Check that all constants are in their ranges.
    ///
    /// # Errors
    /// The first that is not.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let name = JointedRock::NAME;
        for (key, value) in [("normal_stiffness", self.normal_stiffness), ("shear_stiffness", self.shear_stiffness)] {
            require(value > 0.0 && value.is_finite(), name, key, value, "positive and finite (Pa/m)")?;
        }
        for (key, value) in [
            ("tensile_strength", self.tensile_strength),
            ("cohesion", self.cohesion),
            ("friction_coefficient", self.friction),
            ("dilation_angle", self.dilation),
        ] {
            require(value >= 0.0 && value.is_finite(), name, key, value, "finite and not negative")?;
        }
        let unit = (self.normal.norm() - 1.0).abs() < 1e-9;
        require(unit, name, "normal", self.normal.norm(), "of length 1")
    }

    /// Whether bonds across the joint have a strength.
    pub fn is_cohesive(&self) -> bool {
        self.tensile_strength > 0.0 || self.cohesion > 0.0
    }

    fn scaled(&self, factors: &TemperatureFactors) -> Self {
        Self {
            normal_stiffness: self.normal_stiffness * factors.stiffness,
            shear_stiffness: self.shear_stiffness * factors.stiffness,
            tensile_strength: self.tensile_strength * factors.strength,
            cohesion: self.cohesion * factors.strength,
            ..*self
        }
    }

    /// `(K_n A, K_s A)`, N/m.
    fn springs(&self, geometry: &ContactGeometry) -> [f64; 2] {
        [self.normal_stiffness * geometry.area, self.shear_stiffness * geometry.area]
    }

    /// The motion of a contact across the joint in a step.
    fn motion(&self, kinematics: &PointKinematics, old: &JointedRockState) -> Motion {
        let branch = kinematics.normal * kinematics.length;
        let begins = old.rest == 0.0;
        let before = if begins {
            kinematics.transport.normal_before(&kinematics.normal) * kinematics.length_old
        } else {
            old.branch
        };
        let toward = self.normal.dot(&branch);
        let normal = if toward < 0.0 { -self.normal } else { self.normal };
        let (distance, moved) = (toward.abs(), branch - before);
        let rest = if begins { distance } else { old.rest };
        let opening_before = if begins { 0.0 } else { self.normal.dot(&before).abs() - (old.rest - old.dilation) };
        let slid = moved - normal * normal.dot(&moved);
        Motion { normal, branch, moved, slid, rest, opening: distance - rest, opening_before }
    }

    /// Response to the motion of a step.
    fn respond(&self, kinematics: &PointKinematics, old: &JointedRockState) -> Response<JointedRockState> {
        let PointKinematics { geometry, bonded, .. } = kinematics;
        let [normal_stiffness, shear_stiffness] = self.springs(geometry);
        let step = Step { normal_stiffness, shear_stiffness, motion: self.motion(kinematics, old), old: *old };
        let Motion { slid, opening, rest, branch, .. } = step.motion;
        let whole = *bonded && old.crack == 0.0;
        let smaller = geometry.radius_a.min(geometry.radius_b);
        if old.slip > 2.0 * smaller || !whole && opening > 0.0 {
            return step.end(if *bonded { Status::Broke } else { Status::Opened });
        }
        let tension = self.tensile_strength * geometry.area;
        if whole && tension > 0.0 && opening > tension / normal_stiffness {
            return step.crack(Status::Broke);
        }
        let trial = old.shear_force + slid * shear_stiffness;
        let cohesion = if whole { self.cohesion * geometry.area } else { 0.0 };
        let limit = cohesion - (normal_stiffness * opening) * self.friction;
        let size = norm(&trial);
        let slides = size > limit;
        if slides && whole && opening > 0.0 {
            return step.crack(Status::BrokeInShear);
        }
        let path = slid.norm();
        let dilation = if slides { path * self.dilation } else { 0.0 };
        let of_bond = match (whole, slides) {
            (true, false) => 0.0,
            (true, true) => 1.0,
            (false, _) => old.crack.max(2.0),
        };
        step.go_on(JointedRockState {
            shear_force: if slides { trial * (limit / size) } else { trial },
            crack: if *bonded { of_bond } else { 0.0 },
            branch,
            rest: rest + dilation,
            dilation,
            slip: old.slip + path,
        })
    }
}

/// Motion of a contact across a joint.
struct Motion {
    /// Normal of the joint, from A to B.
    normal: Vec3,
    /// Branch vector, m.
    branch: Vec3,
    /// Its change in the step, m.
    moved: Vec3,
    /// The part of that along the joint, m.
    slid: Vec3,
    /// Distance across the joint without normal force, m.
    rest: f64,
    /// Opening, m.
    opening: f64,
    /// Opening of the normal spring in the last step, m.
    opening_before: f64,
}

/// A step of a contact across a joint, and what its springs store.
struct Step {
    normal_stiffness: f64,
    shear_stiffness: f64,
    motion: Motion,
    old: JointedRockState,
}

impl Step {
    /// Force on A, N.
    fn force(&self, opening: f64, shear_force: &Vec3) -> Vec3 {
        self.motion.normal * (self.normal_stiffness * opening) + shear_force
    }

    /// Energies of both springs, J.
    fn stored(&self, opening: f64, shear_force: &Vec3) -> [f64; 2] {
        let Self { normal_stiffness, shear_stiffness, .. } = *self;
        [0.5 * normal_stiffness * opening * opening, 0.5 * shear_force.norm_squared() / shear_stiffness]
    }

    /// A contact that lives on with this history.
    fn go_on(&self, state: JointedRockState) -> Response<JointedRockState> {
        let Self { motion: Motion { opening, opening_before, moved, .. }, old, .. } = self;
        let force = self.force(*opening, &state.shear_force);
        let [stored_normal, stored_shear] = self.stored(*opening, &state.shear_force);
        let mut energy = EnergySplit { stored_normal, stored_shear, ..EnergySplit::default() };
        let cracks = state.crack == 1.0 || old.crack == 1.0;
        let elastic = old.shear_force + self.motion.slid * self.shear_stiffness == state.shear_force;
        if !elastic || old.dilation != 0.0 {
            // What of the work is not stored; in the step after a crack, the fall of the shear force.
            let [normal_before, shear_before] = self.stored(*opening_before, &old.shear_force);
            let work = 0.5 * (self.force(*opening_before, &old.shear_force) + force).dot(moved);
            let lost = work - (stored_normal + stored_shear - normal_before - shear_before);
            if cracks {
                (energy.damage, energy.integration) = (lost.max(0.0), lost.min(0.0));
            } else {
                energy.add_friction(lost);
            }
        }
        Response { force, moment: Vec3::zeros(), state, status: Status::Lives, energy }
    }

    /// A whole contact cracks, and no force remains.
    fn crack(&self, status: Status) -> Response<JointedRockState> {
        let Motion { opening, moved, slid, .. } = &self.motion;
        let trial = self.old.shear_force + slid * self.shear_stiffness;
        let damage = self.stored(*opening, &trial).iter().sum();
        // The released energy contains the half of this step's work that the void force would have done.
        let integration = -0.5 * self.force(*opening, &trial).dot(moved);
        // The event log takes the mode of the crack from here.
        let [stored_normal, stored_shear] = if status == Status::BrokeInShear { [0.0, damage] } else { [damage, 0.0] };
        over(status, EnergySplit { stored_normal, stored_shear, damage, integration, ..EnergySplit::default() })
    }

    /// A contact without cohesion opens, or has slid to its end.
    fn end(&self, status: Status) -> Response<JointedRockState> {
        let Self { motion: Motion { opening, opening_before, moved, slid, normal, .. }, old, .. } = self;
        let [stored_normal, stored_shear] = self.stored(*opening_before, &old.shear_force);
        let mut energy = EnergySplit::default();
        energy.add_friction(0.5 * old.shear_force.dot(slid) + stored_shear);
        let of_normal = 0.5 * self.normal_stiffness * opening_before * normal.dot(moved) + stored_normal;
        // Opened, it had no energy left: this is the kink of the spring in the step.
        if *opening > 0.0 {
            energy.integration += of_normal;
        } else {
            energy.add_friction(of_normal);
        }
        let mut response = over(status, energy);
        // Tells a bond that was open from the start.
        response.state.crack = old.crack;
        response
    }
}

/// A contact without force.
fn over(status: Status, energy: EnergySplit) -> Response<JointedRockState> {
    Response { force: Vec3::zeros(), moment: Vec3::zeros(), state: JointedRockState::default(), status, energy }
}

impl ContactLaw for JointedRock {
    type State = JointedRockState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = Jointed::NAME;
    const VARIES: bool = true;
    const OUTLIVES_FAILURE: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        Self { bond: self.bond.at_temperature(factors), joint: self.joint.map(|joint| joint.scaled(factors)) }
    }

    fn history_at(state: &JointedRockState, factors: &TemperatureFactors) -> JointedRockState {
        JointedRockState { shear_force: state.shear_force * factors.stiffness, ..*state }
    }

    fn history_from(
        state: &JointedRockState,
        _old: &JointedRockState,
        factors: &TemperatureFactors,
    ) -> JointedRockState {
        JointedRockState { shear_force: state.shear_force / factors.stiffness, ..*state }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &JointedRockState, dt: f64) -> Response<JointedRockState> {
        match &self.joint {
            Some(joint) => joint.respond(kinematics, old),
            None => of_bond(self.bond.respond(kinematics, &old.bond(), dt)),
        }
    }

    /// Joints measure the motion across them, and act without torques.
    #[inline(always)]
    fn acting(&self, kinematics: PointKinematics, old: &JointedRockState) -> PointKinematics {
        let Some(joint) = &self.joint else { return kinematics };
        let Motion { opening, opening_before, .. } = joint.motion(&kinematics, old);
        PointKinematics { arm_a: 0.0, arm_b: 0.0, elongation: opening, elongation_old: opening_before, ..kinematics }
    }

    const COLUMNS: Option<ColumnUse> = Jointed::COLUMNS;

    /// Off joints.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &JointedRockState,
        given: &Given,
        dt: f64,
    ) -> (Response<JointedRockState>, bool) {
        let (response, certain) = self.bond.straight(kinematics, &old.bond(), given, dt);
        (of_bond(response), certain)
    }

    #[inline(always)]
    fn is_straight(&self, measure: MotionMeasure) -> bool {
        self.joint.is_none() && self.bond.is_straight(measure)
    }

    fn last_force(&self, still: &PointKinematics, state: &JointedRockState) -> (Vec3, Vec3) {
        let Some(joint) = &self.joint else { return self.bond.last_force(still, &state.bond()) };
        let [normal_stiffness, _] = joint.springs(&still.geometry);
        let toward = joint.normal.dot(&state.branch);
        let opening = toward.abs() - (state.rest - state.dilation);
        (joint.normal * (toward.signum() * normal_stiffness * opening) + state.shear_force, Vec3::zeros())
    }

    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        Jointed::unbonded_reference(length, radius_a, radius_b)
    }

    /// A joint is no stiffer in any direction than its stiffer spring.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let Some(joint) = &self.joint else { return self.bond.stiffness(geometry) };
        let area = contact_area(geometry.radius_a, geometry.radius_b);
        let [normal, shear] = joint.springs(&ContactGeometry { area, ..*geometry });
        Stiffness { normal: normal.max(shear), shear: normal.max(shear), ..Stiffness::default() }
    }

    fn exchanged(&self) -> Self {
        Self { bond: self.bond.exchanged(), ..*self }
    }

    /// A bond that had no strength has no damage.
    fn damage(state: &JointedRockState) -> f64 {
        if state.crack == OPEN { 0.0 } else { state.crack.min(1.0) }
    }

    fn lost_strength(&self, _reference: Reference, state: &JointedRockState) -> f64 {
        state.crack.min(1.0)
    }

    #[inline(always)]
    fn event(response: &Response<JointedRockState>) -> (f64, [f64; 4], bool) {
        event_of(&response.energy, response.status)
    }
}

/// The response of a contact off joints.
#[inline(always)]
fn of_bond(response: Response<JointedState>) -> Response<JointedRockState> {
    let Response { force, moment, state, status, energy } = response;
    Response { force, moment, state: JointedRockState::of_bond(state), status, energy }
}
