//! YADE's contact of jointed cohesive frictional spheres, `Law2_ScGeom_JCFpmPhys_JointedCohesiveFrictionalPM`, by its formulas, without smooth
//! joints.
//!
//! The history of a contact is what YADE keeps in `JCFpmPhys`, so stiffnesses and strengths that a script has given to single contacts come along.
//! A new contact gets those of its two materials, as from `Ip2_JCFpmMat_JCFpmMat_JCFpmPhys`.
//!
//! With the overlap `D` beyond that at the start and the normal `n` from A to B:
//!
//! * normal force `F = k_n D`, positive in compression; a bond cracks in tension at `−D > F_n,max/k_n`, unless `F_n,max` is 0;
//! * shear force: the sum of `−k_s du`, turned with the contact; its limit is `F_s,max + F tan φ`, at which a bond cracks in shear;
//! * a contact without cohesion ends at `D < 0`, or, with `neverErase`, goes on without forces.
//!
//! `concordem_contact::law::Jointed` is the same law with parameters of materials; there a bond that has cracked is one until it opens.

use concordem_contact::geometry::contact_area;
use concordem_contact::kinematics::PointKinematics;
use concordem_contact::law::{ContactGeometry, ContactLaw, EnergySplit, LawState as _, Response, Status, Stiffness};
use concordem_contact::math::{Vec3, yade_order::norm};
use serde::{Deserialize, Serialize};

use super::super::host_law::HostLaw;

/// What YADE's functors apply to all contacts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Whether new contacts are bonds: a negative `cohesiveTresholdIteration`.
    pub bonds_new_contacts: bool,
    /// `neverErase`: contacts without cohesion and force go on.
    pub never_erase: bool,
}

/// Attributes of `JCFpmMat`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// `young`, Pa.
    pub young: f64,
    /// `poisson`: the ratio of the stiffnesses in shear and along the normal.
    pub poisson: f64,
    /// Tangent of `frictionAngle`.
    pub friction_coefficient: f64,
    /// Tangent of `residualFrictionAngle`, or that of bonds.
    pub residual_friction_coefficient: f64,
    /// `tensileStrength`, Pa.
    pub tensile_strength: f64,
    /// `cohesion`, Pa.
    pub cohesion: f64,
    /// `type`: materials of different types have no cohesion.
    #[serde(rename = "type")]
    pub kind: i64,
}

/// The law between two materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointedFriction {
    /// Of A and of B.
    pub materials: [Material; 2],
    /// For all contacts.
    pub rules: Rules,
}

concordem_contact::law_state! {
    /// What YADE keeps of a contact. Flags are 0 or 1. Vectors act on B, as in YADE.
    pub struct JointedFrictionState {
        /// `kn`.
        normal_stiffness: f64, "N/m", Even;
        /// `ks`.
        shear_stiffness: f64, "N/m", Even;
        /// `tanFrictionAngle`.
        friction_coefficient: f64, "1", Even;
        /// `FnMax`.
        largest_tension: f64, "N", Even;
        /// `FsMax`.
        largest_shear: f64, "N", Even;
        /// `crossSection`; 0 before the first evaluation.
        cross_section: f64, "m²", Even;
        /// `initD`: the overlap without force.
        rest_overlap: f64, "m", Even;
        /// `isCohesive`.
        cohesive: f64, "1", Even;
        /// `isBroken`, `momentBroken`.
        cracked: f64, "1", Even;
        /// `crackJointAperture`.
        aperture: f64, "m", Even;
        /// `strainEnergy`: before the last step.
        strain_energy: f64, "J", Even;
        /// Energy that the bond had stored before it cracked.
        crack_energy: f64, "J", Even;
        /// `normalForce`, positive in compression.
        normal_force: f64, "N", Even;
        /// `shearForce`.
        shear_force: Vec3, "N", Odd;
        /// What happened in the last step: the sum of the constants `Event`.
        event: f64, "1", Even;
    }
}

/// What happens to a contact in a step, as bits of [`JointedFrictionState::event`].
pub(super) mod event {
    /// A crack in tension.
    pub const TENSION: u8 = 1;
    /// A crack in shear.
    pub const SHEAR: u8 = 2;
    /// The contact ends.
    pub const END: u8 = 4;
    /// A bond began.
    pub const BOND: u8 = 8;
}

/// Place of the events among the numbers of a history.
pub(super) const EVENT: usize = size_of::<JointedFrictionState>() / 8 - 1;

/// `2 a b/(a + b)`.
fn harmonic(a: f64, b: f64) -> f64 {
    2.0 * a * b / (a + b)
}

/// Energy of a spring, J; 0 without one.
fn spring_energy(force: f64, stiffness: f64) -> f64 {
    if stiffness > 0.0 { force * force / stiffness } else { 0.0 }
}

impl JointedFrictionState {
    /// Stored energy, J, from the forces of the history.
    fn energy(&self) -> f64 {
        let shear = spring_energy(norm(&self.shear_force), self.shear_stiffness);
        0.5 * (spring_energy(self.normal_force, self.normal_stiffness) + shear)
    }

    /// The same contact without cohesion.
    fn without_cohesion(self) -> Self {
        Self { cohesive: 0.0, largest_tension: 0.0, largest_shear: 0.0, ..self }
    }

    /// The same contact without forces.
    fn without_forces(self) -> Self {
        Self { normal_force: 0.0, shear_force: Vec3::zeros(), ..self }
    }
}

impl JointedFriction {
    /// What a new contact of spheres with these radii and this overlap (m) gets of its materials.
    fn begun(&self, radii: [f64; 2], overlap: f64) -> JointedFrictionState {
        let [a, b] = &self.materials;
        let [ka, kb] = [a.young * radii[0], b.young * radii[1]];
        let tensile_strength = a.tensile_strength.min(b.tensile_strength);
        let cohesion = a.cohesion.min(b.cohesion);
        let bonds = self.rules.bonds_new_contacts && (tensile_strength > 0.0 || cohesion > 0.0) && a.kind == b.kind;
        let friction = |m: &Material| if bonds { m.friction_coefficient } else { m.residual_friction_coefficient };
        let cross_section = contact_area(radii[0], radii[1]);
        let [cohesive, strength] = if bonds { [1.0, cross_section] } else { [0.0, 0.0] };
        JointedFrictionState {
            normal_stiffness: harmonic(ka, kb),
            shear_stiffness: if a.poisson == 0.0 && b.poisson == 0.0 {
                0.0
            } else {
                harmonic(ka * a.poisson, kb * b.poisson)
            },
            friction_coefficient: friction(a).min(friction(b)),
            largest_tension: tensile_strength * strength,
            largest_shear: cohesion * strength,
            cross_section,
            rest_overlap: overlap,
            cohesive,
            event: f64::from(if bonds { event::BOND } else { 0 }),
            ..JointedFrictionState::default()
        }
    }

    /// The contact after the step in which it lost its cohesion and force, or had none: it ends, or goes on without them.
    fn without_force(&self, s: JointedFrictionState, happened: u8) -> Response<JointedFrictionState> {
        let happened = if self.rules.never_erase { happened } else { happened | event::END };
        let state = JointedFrictionState { event: f64::from(happened), ..s.without_cohesion().without_forces() };
        Response {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            state,
            status: Status::Lives,
            energy: EnergySplit::default(),
        }
    }
}

impl ContactLaw for JointedFriction {
    type State = JointedFrictionState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "jointed_friction";

    fn respond(
        &self,
        motion: &PointKinematics,
        old: &JointedFrictionState,
        _dt: f64,
    ) -> Response<JointedFrictionState> {
        let ContactGeometry { radius_a, radius_b, .. } = motion.geometry;
        let overlap = -motion.gap;
        let mut s = JointedFrictionState { event: 0.0, ..*old };
        if s.cross_section == 0.0 {
            s = self.begun([radius_a, radius_b], overlap);
        }
        let mut happened = s.event as u8;
        let stretch = overlap - s.rest_overlap;
        let apart = stretch < 0.0;
        s.aperture = if apart { -stretch } else { 0.0 };
        if s.cracked == 0.0 {
            s.strain_energy = s.energy();
        }
        if apart && s.cohesive == 0.0 {
            return self.without_force(s, happened);
        }
        if apart && s.largest_tension > 0.0 && -stretch > s.largest_tension / s.normal_stiffness {
            // As in YADE: with the forces before the step.
            let cracked = JointedFrictionState { cracked: 1.0, crack_energy: s.energy(), ..s };
            return self.without_force(cracked, happened | event::TENSION);
        }
        let normal_force = s.normal_stiffness * stretch;
        let trial = motion.transport.apply(&s.shear_force) - motion.shear_increment * s.shear_stiffness;
        let limit = s.largest_shear + normal_force * s.friction_coefficient;
        let size = norm(&trial);
        s.shear_force = trial;
        if size > limit {
            s.shear_force = if size > 0.0 { trial * (limit / size) } else { Vec3::zeros() };
            if s.cohesive != 0.0 {
                // As in YADE: with the normal force before the step, and the shear force after it.
                s = JointedFrictionState { cracked: 1.0, crack_energy: s.energy(), ..s.without_cohesion() };
                happened |= event::SHEAR;
                if apart {
                    return self.without_force(s, happened);
                }
            }
        }
        s.normal_force = normal_force;
        s.event = f64::from(happened);
        let energy = EnergySplit {
            stored_normal: 0.5 * spring_energy(normal_force, s.normal_stiffness),
            stored_shear: 0.5 * spring_energy(norm(&s.shear_force), s.shear_stiffness),
            ..EnergySplit::default()
        };
        let force = load(&s, &motion.normal);
        Response { force, moment: Vec3::zeros(), state: s, status: Status::Lives, energy }
    }

    /// In the step of a crack under pressure, the force is beyond what the history allows in the next one.
    fn last_force(&self, still: &PointKinematics, s: &JointedFrictionState) -> (Vec3, Vec3) {
        (load(s, &still.normal), Vec3::zeros())
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let begun = self.begun([geometry.radius_a, geometry.radius_b], 0.0);
        Stiffness { normal: begun.normal_stiffness, shear: begun.shear_stiffness, ..Stiffness::default() }
    }

    fn exchanged(&self) -> Self {
        let [a, b] = self.materials;
        Self { materials: [b, a], ..*self }
    }

    /// Whether the contact is without cohesion.
    fn damage(state: &JointedFrictionState) -> f64 {
        1.0 - state.cohesive
    }
}

/// Force on A.
fn load(s: &JointedFrictionState, normal: &Vec3) -> Vec3 {
    -(normal * s.normal_force + s.shear_force)
}

impl HostLaw for JointedFriction {
    type Material = Material;
    type Rules = Rules;

    fn of(materials: [Material; 2], rules: Rules) -> Self {
        Self { materials, rules }
    }

    fn is_valid(state: &JointedFrictionState) -> bool {
        state.normal_stiffness > 0.0 && state.cross_section > 0.0 && state.as_reals().iter().all(|x| x.is_finite())
    }

    fn is_bond(state: &JointedFrictionState) -> bool {
        state.cohesive != 0.0
    }
}

concordem_solver::compile_loops!(JointedFriction);
