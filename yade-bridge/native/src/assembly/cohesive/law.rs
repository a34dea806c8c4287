//! YADE's contact of cohesive and frictional spheres with moments, `Law2_ScGeom6D_CohFrictPhys_CohesionMoment`, by its formulas.
//!
//! The history of a contact is what YADE keeps in `CohFrictPhys` and `ScGeom6D`, so stiffnesses and strengths that a script has given to
//! single contacts come along. A new contact gets those of its two materials, as from `Ip2_CohFrictMat_CohFrictMat_CohFrictPhys`.
//!
//! With the overlap `δ` and the normal `n` from A to B:
//!
//! * normal force `F = k_n (δ − δ_p)`, positive in compression; a contact in tension holds up to the adhesion `a_n`;
//! * shear force: the sum of `−k_s du`, turned with the contact; it holds up to `a_s + F tan φ`;
//! * bending and twist: `k_r` and `k_tw` times the rotation of B relative to A since the contact began, or the sum of its increments
//!   (`useIncrementalForm`); each has an adhesion and a friction coefficient.
//!
//! What happens beyond a limit differs between the two versions of YADE, see [`Version`].

use concordem_contact::kinematics::{
    ContactInput, Kinematics, MotionMeasure, PointKinematics, WallInput, sphere_sphere,
};
use concordem_contact::law::{ContactGeometry, ContactLaw, EnergySplit, LawState as _, Response, Status, Stiffness};
use concordem_contact::math::{Quat, Vec3, atan2};
use serde::{Deserialize, Serialize};

use super::super::host_law::HostLaw;

/// Which YADE's law.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub enum Version {
    /// A fragile contact ends under too much tension, and too much shear makes it frictional; moments have limits of friction only.
    #[serde(rename = "2023.02a")]
    V2023,
    /// Each of the four limits breaks a fragile contact, which ends if its spheres do not overlap, else goes on with friction.
    #[serde(rename = "2025.2.0")]
    V2025,
}

/// What YADE's functors apply to all contacts.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rules {
    /// Whose law.
    pub version: Version,
    /// `setCohesionOnNewContacts`.
    pub cohesion_on_new_contacts: bool,
    /// `always_use_moment_law`: moments also without cohesion.
    pub moments_without_cohesion: bool,
    /// `useIncrementalForm`.
    pub incremental_moments: bool,
    /// Viscosity of `shear_creep`, N·s/m; 0 without creep.
    pub shear_creep_viscosity: f64,
}

/// Attributes of `CohFrictMat`.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// `young`, Pa.
    pub young: f64,
    /// `poisson`: the ratio of the stiffnesses in shear and along the normal.
    pub poisson: f64,
    /// Tangent of `frictionAngle`.
    pub friction_coefficient: f64,
    /// `alphaKr`.
    pub rolling_stiffness: f64,
    /// `alphaKtw`.
    pub twisting_stiffness: f64,
    /// `etaRoll`.
    pub rolling_friction: f64,
    /// `etaTwist`.
    pub twisting_friction: f64,
    /// `normalCohesion`, Pa.
    pub normal_cohesion: f64,
    /// `shearCohesion`, Pa.
    pub shear_cohesion: f64,
    /// `isCohesive`.
    pub cohesive: bool,
    /// `fragile`.
    pub fragile: bool,
    /// `momentRotationLaw`.
    pub moments: bool,
}

/// The law between two materials.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CohesiveFriction {
    /// Of A and of B.
    pub materials: [Material; 2],
    /// For all contacts.
    pub rules: Rules,
}

concordem_contact::law_state! {
    /// What YADE keeps of a contact. Flags are 0 or 1. Vectors act on B, as in YADE.
    pub struct CohesiveFrictionState {
        /// `kn`; 0 before the first evaluation.
        normal_stiffness: f64, "N/m", Even;
        /// `ks`.
        shear_stiffness: f64, "N/m", Even;
        /// `kr`.
        rolling_stiffness: f64, "N m", Even;
        /// `ktw`.
        twisting_stiffness: f64, "N m", Even;
        /// `tangensOfFrictionAngle`.
        friction_coefficient: f64, "1", Even;
        /// `normalAdhesion`.
        normal_adhesion: f64, "N", Even;
        /// `shearAdhesion`.
        shear_adhesion: f64, "N", Even;
        /// `rollingAdhesion`.
        rolling_adhesion: f64, "N m", Even;
        /// `twistingAdhesion`.
        twisting_adhesion: f64, "N m", Even;
        /// `maxRollPl`.
        rolling_friction: f64, "m", Even;
        /// `maxTwistPl`.
        twisting_friction: f64, "m", Even;
        /// `unp`: the overlap without force.
        plastic_overlap: f64, "m", Even;
        /// `unpMax`.
        largest_plastic_displacement: f64, "m", Even;
        /// Whether there is cohesion: not `cohesionBroken`.
        cohesive: f64, "1", Even;
        /// `fragile`.
        fragile: f64, "1", Even;
        /// `cohesionDisablesFriction`.
        friction_off: f64, "1", Even;
        /// `momentRotationLaw`.
        moments: f64, "1", Even;
        /// `normalForce`, positive in compression.
        normal_force: f64, "N", Even;
        /// `shearForce`.
        shear_force: Vec3, "N", Odd;
        /// `moment_bending`.
        bending_moment: Vec3, "N m", Odd;
        /// `moment_twist`.
        twisting_moment: Vec3, "N m", Odd;
        /// Real part of the orientation of B relative to A when the contact began, in the axes of A.
        rest_rotation_real: f64, "1", Even;
        /// Its other parts.
        rest_rotation: Vec3, "1", Odd;
        /// `twist`.
        twist: f64, "rad", Even;
        /// `bending`.
        bending: Vec3, "rad", Odd;
    }
}

/// Motion of a contact as YADE's `ScGeom6D` measures it.
#[derive(Debug, Clone, Copy)]
pub struct TurningContact {
    point: PointKinematics,
    /// Orientations of A and B, body to world.
    orientations: [Quat; 2],
    /// Angular velocity of B relative to A, rad/s.
    spin: Vec3,
}

impl Kinematics for TurningContact {
    const READS_ORIENTATIONS: bool = true;

    #[inline(always)]
    fn measure(mode: MotionMeasure, input: &ContactInput<'_>) -> Self {
        Self {
            point: sphere_sphere::measure(mode, input),
            orientations: [input.a.orientation, input.b.orientation],
            spin: input.b.angular_velocity - input.a.angular_velocity,
        }
    }

    /// YADE computes contacts with other shapes.
    fn measure_wall(_mode: MotionMeasure, _input: &WallInput<'_>) -> Option<Self> {
        None
    }

    fn point(&self) -> &PointKinematics {
        &self.point
    }

    fn with_surface_displacement(&self, now: f64, before: f64) -> Self {
        Self { point: self.point.with_surface_displacement(now, before), ..*self }
    }
}

/// Twist and bending of a contact with this normal, rad, by a rotation.
fn parts_of_rotation(rotation: &Quat, normal: &Vec3) -> (f64, Vec3) {
    let sine = rotation.imag().norm();
    if sine == 0.0 {
        return (0.0, Vec3::zeros());
    }
    // By the shorter way round.
    let angle = 2.0 * atan2(sine, rotation.w.abs());
    let axis = rotation.imag() / if rotation.w < 0.0 { -sine } else { sine };
    let twist = angle * axis.dot(normal);
    (twist, axis * angle - normal * twist)
}

/// The harmonic mean, and 0 if one is 0.
fn harmonic(one: f64, two: f64) -> f64 {
    if one != 0.0 && two != 0.0 { 2.0 * one * two / (one + two) } else { 0.0 }
}

fn flag(value: bool) -> f64 {
    f64::from(u8::from(value))
}

impl CohesiveFriction {
    /// What a new contact of spheres with these radii (m) gets of its materials.
    fn begun(&self, radii: [f64; 2], orientations: &[Quat; 2]) -> CohesiveFrictionState {
        let [a, b] = &self.materials;
        let Rules { version, cohesion_on_new_contacts, .. } = self.rules;
        let [ka, kb] = [a.young * radii[0], b.young * radii[1]];
        let shear_stiffness = harmonic(ka * a.poisson, kb * b.poisson);
        let by_shear = radii[0] * radii[1] * shear_stiffness;
        let (moments, cohesive) = (a.moments && b.moments, cohesion_on_new_contacts && a.cohesive && b.cohesive);
        let smaller = radii[0].min(radii[1]);
        let [area, volume] = [smaller * smaller, smaller * smaller * smaller];
        let rest = orientations[0].conjugate() * orientations[1];
        let mut begun = CohesiveFrictionState {
            normal_stiffness: harmonic(ka, kb),
            shear_stiffness,
            rolling_stiffness: by_shear * harmonic(a.rolling_stiffness, b.rolling_stiffness),
            twisting_stiffness: by_shear * harmonic(a.twisting_stiffness, b.twisting_stiffness),
            friction_coefficient: a.friction_coefficient.min(b.friction_coefficient),
            rolling_friction: (a.rolling_friction * radii[0]).min(b.rolling_friction * radii[1]),
            twisting_friction: (a.twisting_friction * radii[0]).min(b.twisting_friction * radii[1]),
            largest_plastic_displacement: if version == Version::V2023 { 0.0 } else { -1.0 },
            cohesive: flag(cohesive),
            // As long as a contact has no cohesion, YADE has the default.
            fragile: flag(!cohesive || a.fragile || b.fragile),
            moments: flag(moments),
            rest_rotation_real: rest.w,
            rest_rotation: rest.imag(),
            ..CohesiveFrictionState::default()
        };
        if version == Version::V2025 && !moments {
            (begun.rolling_friction, begun.twisting_friction) = (0.0, 0.0);
        }
        if cohesive {
            let normal_cohesion = a.normal_cohesion.min(b.normal_cohesion);
            let shear_cohesion = a.shear_cohesion.min(b.shear_cohesion);
            (begun.normal_adhesion, begun.shear_adhesion) = (normal_cohesion * area, shear_cohesion * area);
            if version == Version::V2025 && moments {
                begun.rolling_adhesion = 0.25 * normal_cohesion * volume;
                begun.twisting_adhesion = 0.5 * shear_cohesion * volume;
            }
        }
        begun
    }

    /// Whether a contact has moments now.
    fn has_moments(&self, s: &CohesiveFrictionState) -> bool {
        s.moments != 0.0 && (s.cohesive != 0.0 || self.rules.moments_without_cohesion)
    }

    /// Turn the history with the contact.
    fn turn(&self, motion: &TurningContact, s: &mut CohesiveFrictionState, dt: f64) {
        if self.rules.shear_creep_viscosity > 0.0 {
            s.shear_force -= (s.shear_force * dt / self.rules.shear_creep_viscosity) * s.shear_stiffness;
        }
        let transport = &motion.point.transport;
        s.shear_force = transport.apply(&s.shear_force);
        if self.has_moments(s) && self.rules.incremental_moments {
            for (moment, stiffness) in
                [(&mut s.bending_moment, s.rolling_stiffness), (&mut s.twisting_moment, s.twisting_stiffness)]
            {
                if stiffness > 0.0 || self.rules.version == Version::V2023 {
                    *moment = transport.apply(moment);
                }
            }
        }
    }

    /// The moments of the elastic contact.
    fn bend(&self, motion: &TurningContact, s: &mut CohesiveFrictionState, dt: f64) {
        let normal = &motion.point.normal;
        if self.rules.incremental_moments {
            let twist = normal * normal.dot(&motion.spin);
            s.bending_moment -= (motion.spin - twist) * s.rolling_stiffness * dt;
            s.twisting_moment -= twist * dt * s.twisting_stiffness;
        } else {
            s.bending_moment = s.bending * s.rolling_stiffness;
            s.twisting_moment = normal * (s.twist * s.twisting_stiffness);
        }
        if self.rules.version == Version::V2025 {
            if s.rolling_stiffness <= 0.0 {
                s.bending_moment = Vec3::zeros();
            }
            if s.twisting_stiffness <= 0.0 {
                s.twisting_moment = Vec3::zeros();
            }
        }
    }

    /// The contact within its limits by the law of 2023.02a, or `None` if it ends.
    fn limited_2023(
        &self,
        motion: &TurningContact,
        trial: &CohesiveFrictionState,
        dt: f64,
    ) -> Option<CohesiveFrictionState> {
        let mut s = *trial;
        let overlap = -motion.point.gap;
        if -s.normal_force > s.normal_adhesion {
            if s.fragile != 0.0 {
                return None;
            }
            s.normal_force = -s.normal_adhesion;
            s.plastic_overlap = overlap + s.normal_adhesion / s.normal_stiffness;
            if s.largest_plastic_displacement >= 0.0 && -s.plastic_overlap > s.largest_plastic_displacement {
                return None;
            }
        }
        let mut limit = s.shear_adhesion;
        if s.friction_off == 0.0 || limit == 0.0 {
            limit += s.normal_force * s.friction_coefficient;
        }
        limit = limit.max(0.0);
        let size = s.shear_force.norm();
        if size > limit {
            if s.fragile != 0.0 && s.cohesive != 0.0 {
                lose_cohesion(&mut s);
                limit = (s.normal_force * s.friction_coefficient).max(0.0);
            }
            s.shear_force *= limit / size;
            s.normal_force = s.normal_force.max(0.0);
        }
        if self.has_moments(&s) {
            self.bend(motion, &mut s, dt);
            for (moment, friction) in
                [(&mut s.bending_moment, s.rolling_friction), (&mut s.twisting_moment, s.twisting_friction)]
            {
                let (limit, size) = (friction * s.normal_force.abs(), moment.norm());
                if friction >= 0.0 && size > limit {
                    *moment *= limit / size;
                }
            }
        }
        Some(s)
    }

    /// The contact within its limits by the law of 2025.2.0, or `None` if it ends. `moments`: whether it had moments before this step.
    fn limited_2025(
        &self,
        trial: &CohesiveFrictionState,
        overlap: f64,
        moments: bool,
    ) -> Option<CohesiveFrictionState> {
        let mut s = *trial;
        // Without cohesion, nothing breaks any more.
        loop {
            if s.cohesive == 0.0 && s.normal_force < 0.0 {
                return None;
            }
            let brittle = s.fragile != 0.0 && s.cohesive != 0.0;
            let ends = s.largest_plastic_displacement >= 0.0;
            let too_far = ends && -(overlap + s.normal_adhesion / s.normal_stiffness) > s.largest_plastic_displacement;
            let torn = (brittle || ends) && (-s.normal_force > s.normal_adhesion || too_far);
            let of = |adhesion: f64, friction: f64| {
                let free = s.friction_off == 0.0 || adhesion == 0.0;
                (adhesion + if free { friction * s.normal_force } else { 0.0 }).max(0.0)
            };
            let shear = of(s.shear_adhesion, s.friction_coefficient);
            let rolling = of(s.rolling_adhesion, s.rolling_friction);
            let twisting = of(s.twisting_adhesion, s.twisting_friction);
            let beyond = |force: &Vec3, limit: f64| force.norm_squared() > limit * limit;
            let slides = s.shear_stiffness > 0.0 && beyond(&s.shear_force, shear);
            let limited = |stiffness: f64, friction: f64, adhesion: f64| {
                moments && stiffness > 0.0 && (friction >= 0.0 || adhesion >= 0.0)
            };
            let rolls = limited(s.rolling_stiffness, s.rolling_friction, s.rolling_adhesion)
                && beyond(&s.bending_moment, rolling);
            let twists = limited(s.twisting_stiffness, s.twisting_friction, s.twisting_adhesion)
                && beyond(&s.twisting_moment, twisting);
            let bent = rolls && s.rolling_adhesion > 0.0 || twists && s.twisting_adhesion > 0.0;
            if torn || brittle && (slides || bent) {
                if overlap < 0.0 {
                    return None;
                }
                if s.cohesive == 0.0 {
                    // A script has set an adhesion without cohesion, which would break again and again.
                    return None;
                }
                lose_cohesion(&mut s);
                if !self.rules.moments_without_cohesion {
                    // YADE clears this friction, and not that of bending.
                    s.twisting_friction = 0.0;
                }
                continue;
            }
            if -s.normal_force > s.normal_adhesion {
                s.normal_force = -s.normal_adhesion;
                s.plastic_overlap = overlap + s.normal_adhesion / s.normal_stiffness;
            }
            for (vector, limit, exceeds) in [
                (&mut s.shear_force, shear, slides),
                (&mut s.bending_moment, rolling, rolls),
                (&mut s.twisting_moment, twisting, twists),
            ] {
                if exceeds {
                    *vector *= (limit * limit / vector.norm_squared()).sqrt();
                }
            }
            return Some(s);
        }
    }
}

/// The contact goes on with friction alone.
fn lose_cohesion(s: &mut CohesiveFrictionState) {
    s.cohesive = 0.0;
    (s.normal_adhesion, s.shear_adhesion, s.rolling_adhesion, s.twisting_adhesion) = (0.0, 0.0, 0.0, 0.0);
}

impl ContactLaw for CohesiveFriction {
    type State = CohesiveFrictionState;
    type Kinematics = TurningContact;
    const NAME: &'static str = "cohesive_friction";

    fn respond(
        &self,
        motion: &TurningContact,
        old: &CohesiveFrictionState,
        dt: f64,
    ) -> Response<CohesiveFrictionState> {
        let ContactGeometry { radius_a, radius_b, .. } = motion.point.geometry;
        let mut s = *old;
        if s.normal_stiffness == 0.0 {
            s = self.begun([radius_a, radius_b], &motion.orientations);
        }
        let overlap = -motion.point.gap;
        let rest = Quat::from_parts(s.rest_rotation_real, s.rest_rotation);
        let rotation = (motion.orientations[0] * rest * motion.orientations[1].conjugate()).normalize();
        (s.twist, s.bending) = parts_of_rotation(&rotation, &motion.point.normal);
        let moments = self.has_moments(&s);
        self.turn(motion, &mut s, dt);
        s.normal_force = s.normal_stiffness * (overlap - s.plastic_overlap);
        s.shear_force -= motion.point.shear_increment * s.shear_stiffness;
        let (limited, moments) = match self.rules.version {
            Version::V2023 => {
                let limited = self.limited_2023(motion, &s, dt);
                (limited, limited.is_some_and(|s| self.has_moments(&s)))
            }
            Version::V2025 => {
                if moments {
                    self.bend(motion, &mut s, dt);
                }
                (self.limited_2025(&s, overlap, moments), moments)
            }
        };
        let Some(s) = limited else { return Response::opened(EnergySplit::default()) };
        let (force, moment) = loads(&s, &motion.point.normal, moments);
        let per = |square: f64, stiffness: f64| if stiffness > 0.0 { 0.5 * square / stiffness } else { 0.0 };
        let energy = EnergySplit {
            stored_normal: per(s.normal_force * s.normal_force, s.normal_stiffness),
            stored_shear: per(s.shear_force.norm_squared(), s.shear_stiffness),
            stored_bending: per(s.bending_moment.norm_squared(), s.rolling_stiffness),
            stored_twist: per(s.twisting_moment.norm_squared(), s.twisting_stiffness),
            ..EnergySplit::default()
        };
        Response { force, moment, state: s, status: Status::Lives, energy }
    }

    /// A contact that has lost its cohesion in the last step may have had moments in it; YADE's `moment_bending` tells no more.
    fn last_force(&self, still: &TurningContact, s: &CohesiveFrictionState) -> (Vec3, Vec3) {
        loads(s, &still.point.normal, self.has_moments(s))
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let upright = [Quat::identity(); 2];
        let begun = self.begun([geometry.radius_a, geometry.radius_b], &upright);
        Stiffness {
            normal: begun.normal_stiffness,
            shear: begun.shear_stiffness,
            bending: begun.rolling_stiffness,
            twist: begun.twisting_stiffness,
            ..Stiffness::default()
        }
    }

    fn exchanged(&self) -> Self {
        let [a, b] = self.materials;
        Self { materials: [b, a], ..*self }
    }

    /// Whether the contact is without cohesion.
    fn damage(state: &CohesiveFrictionState) -> f64 {
        1.0 - state.cohesive
    }
}

/// Force and moment on A.
fn loads(s: &CohesiveFrictionState, normal: &Vec3, moments: bool) -> (Vec3, Vec3) {
    let moment = if moments { -(s.twisting_moment + s.bending_moment) } else { Vec3::zeros() };
    (-(normal * s.normal_force + s.shear_force), moment)
}

impl HostLaw for CohesiveFriction {
    type Material = Material;
    type Rules = Rules;

    fn of(materials: [Material; 2], rules: Rules) -> Self {
        Self { materials, rules }
    }

    fn is_valid(state: &CohesiveFrictionState) -> bool {
        state.normal_stiffness > 0.0 && state.as_reals().iter().all(|x| x.is_finite())
    }

    fn is_bond(state: &CohesiveFrictionState) -> bool {
        state.cohesive != 0.0
    }
}

concordem_solver::compile_loops!(CohesiveFriction);
