//! Elastic spheres: Hertz's normal force, Mindlin's no-slip shear stiffness, Coulomb friction, restitution.
//!
//! With the overlap `δ = −elongation`, `1/E* = (1−ν_A²)/E_A + (1−ν_B²)/E_B`, `1/G* = (2−ν_A)/G_A + (2−ν_B)/G_B`,
//! `R* = R_A R_B/(R_A+R_B)` (`R_A` against a wall) and the reduced mass `m`:
//!
//! | | | |
//! |---|---|---|
//! | normal spring | `k δ^{3/2}`, `k = (4/3)E*√R*` (compressive) | Hertz 1882; Johnson 1985 (4.22) |
//! | shear stiffness | `k_t = 8 G* √(R*δ)`, incremental | Mindlin 1949; Johnson 1985 (7.43) |
//! | normal dashpot | `√5 ζ √(m k) δ^{1/4} δ̇` | Tsuji, Tanaka & Ishida 1992 |
//! | its `ζ` from the restitution `e` | exact, see [`restitution`](super::restitution) | Antypov & Elliott 2011; Schwager & Pöschel 2007 |
//! | shear dashpot | `2 ζ_t √(m k_t) u̇_t` | |
//! | friction | `‖f_t‖ ≤ μ|f_n|`, whole forces | Coulomb |
//!
//! Forces in N, lengths in m. Unless [`HertzMindlin::tension_from_damping`] is on, the normal force never pulls, and
//! `ζ` is the one that gives the restitution `e` under that rule.
//!
//! **Shear spring under changing overlap.** While the overlap grows, the shear force is kept and increments are
//! added with the present stiffness, because the new ring of contact area carries no traction; while it shrinks, the
//! elastic displacement is kept, so that the force falls with the stiffness, because the ring that is lost gives up
//! its traction (Walton 1993, Mech. Mater. 16:239; Thornton, Cummins & Cleary 2013, Powder Technology 233:30). Both
//! lose stored energy and neither makes any: micro-slip, `½(1/k_old − 1/k)f_old²` and `½(1/k − 1/k_old) f_old·f`,
//! booked as [`EnergySplit::friction`]. (Scaling the stiffness alone would create energy on unloading.)
//!
//! **Energy.** Stored: `(2/5)kδ^{5/2}` and `f_t²/(2k_t)`. The trapezoidal rule integrates Hertz's force with the error
//! `(k/10)(√δ − √δ_old)³(δ_old + 3√(δ_old δ) + δ)`, of third order in the step, which is the
//! [`EnergySplit::integration`] term (with the part of a step in which there is no contact added).

use super::common::{ParameterError, dashpot_within_limit, reciprocal_of_step, require};
use super::restitution::{End, damping_of_restitution};
use super::{ContactGeometry, ContactLaw, EnergySplit, Response, Status, Stiffness};
use crate::kinematics::PointKinematics;
use crate::math::Vec3;

/// Elastic constants of a particle or wall.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// Young's modulus, Pa; infinite for a rigid body.
    pub young: f64,
    /// Poisson's ratio, 1.
    pub poisson: f64,
}

impl Elastic {
    /// A rigid body.
    pub const RIGID: Self = Self { young: f64::INFINITY, poisson: 0.0 };
}

/// Parameters of the Hertz-Mindlin contact.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HertzMindlin {
    /// `E*`, Pa.
    pub effective_young: f64,
    /// `G*`, Pa.
    pub effective_shear: f64,
    /// Coefficient of friction `μ`, 1.
    pub friction: f64,
    /// Normal damping ratio `ζ`, 1.
    pub damping_ratio: f64,
    /// Shear damping ratio `ζ_t`, 1.
    pub shear_damping_ratio: f64,
    /// Whether the normal dashpot may pull the particles together while they part.
    pub tension_from_damping: bool,
    /// Overlap, as a share of `R*`, up to which the time step bound must hold, 1. The stiffness grows with the
    /// overlap without limit, so that one must be chosen.
    pub largest_relative_overlap: f64,
}

crate::law_state! {
    /// History of a [`HertzMindlin`] contact.
    pub struct HertzMindlinState {
        /// Elastic shear force on A.
        shear_force: Vec3, "N", Odd;
        /// Normal dashpot force of the last step, as limited.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step, as limited.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl HertzMindlin {
    /// A contact of two bodies with the given friction coefficient and coefficient of restitution, which never pulls,
    /// without a shear dashpot, with a time step bound good for overlaps up to `R*/20`.
    ///
    /// ```
    /// use concordem_contact::law::{Elastic, HertzMindlin};
    /// let glass = Elastic { young: 48e9, poisson: 0.2 };
    /// let law = HertzMindlin::new(glass, Elastic::RIGID, 0.35, 0.9).unwrap();
    /// assert!((law.effective_young - 50e9).abs() < 1.0);
    /// assert!(HertzMindlin::new(Elastic::RIGID, Elastic::RIGID, 0.35, 0.9).is_err());
    /// ```
    pub fn new(a: Elastic, b: Elastic, friction: f64, restitution: f64) -> Result<Self, ParameterError> {
        for body in [a, b] {
            require(body.young > 0.0, Self::NAME, "young", body.young, "positive (Pa; inf for a rigid body)")?;
            let nu = body.poisson;
            require(nu > -1.0 && nu <= 0.5, Self::NAME, "poisson", nu, "above -1 and at most 0.5")?;
        }
        require(a.young.is_finite() || b.young.is_finite(), Self::NAME, "young", a.young, "finite for one body")?;
        require(
            restitution > 0.0 && restitution <= 1.0,
            Self::NAME,
            "restitution",
            restitution,
            "above 0 and at most 1 (a contact that never pulls needs infinite damping for 0)",
        )?;
        // G = E/(2(1+ν)); a rigid body's compliances are zero
        let normal_compliance = |body: Elastic| (1.0 - body.poisson * body.poisson) / body.young;
        let shear_compliance = |body: Elastic| 2.0 * (1.0 + body.poisson) * (2.0 - body.poisson) / body.young;
        let contact = Self {
            effective_young: 1.0 / (normal_compliance(a) + normal_compliance(b)),
            effective_shear: 1.0 / (shear_compliance(a) + shear_compliance(b)),
            friction,
            damping_ratio: damping_of_restitution(restitution, End::ForceSpent),
            shear_damping_ratio: 0.0,
            tension_from_damping: false,
            largest_relative_overlap: 0.05,
        };
        contact.validate()?;
        Ok(contact)
    }

    /// The same contact with a normal dashpot that may pull, and its damping ratio for the restitution `0 ≤ e ≤ 1`.
    pub fn with_tension_from_damping(mut self, restitution: f64) -> Result<Self, ParameterError> {
        self.damping_ratio = damping_of_restitution(restitution, End::OverlapSpent);
        self.tension_from_damping = true;
        require(self.damping_ratio >= 0.0, Self::NAME, "restitution", restitution, "between 0 and 1")?;
        Ok(self)
    }

    /// Refuse parameters without meaning.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let (young, shear) = (self.effective_young, self.effective_shear);
        let (zeta, zeta_t, overlap) = (self.damping_ratio, self.shear_damping_ratio, self.largest_relative_overlap);
        require(positive(young), Self::NAME, "effective_young", young, "positive and finite (Pa)")?;
        require(positive(shear), Self::NAME, "effective_shear", shear, "positive and finite (Pa)")?;
        require(not_negative(self.friction), Self::NAME, "friction", self.friction, "finite and not negative")?;
        require(not_negative(zeta), Self::NAME, "damping_ratio", zeta, "finite and not negative")?;
        require(not_negative(zeta_t), Self::NAME, "shear_damping_ratio", zeta_t, "finite and not negative")?;
        require(positive(overlap), Self::NAME, "largest_relative_overlap", overlap, "positive and finite")
    }
}

impl ContactLaw for HertzMindlin {
    type State = HertzMindlinState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "hertz_mindlin";
    const DEFORMS: bool = true;

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &HertzMindlinState, dt: f64) -> Response<HertzMindlinState> {
        let geometry = &kinematics.geometry;
        let radius_root = geometry.effective_radius().sqrt();
        let hertz = 4.0 / 3.0 * self.effective_young * radius_root;
        let overlap = -kinematics.elongation;
        let old_overlap = -kinematics.elongation_old;
        let root = overlap.max(0.0).sqrt();
        let old_root = old_overlap.max(0.0).sqrt();
        let shear_stiffness = 8.0 * self.effective_shear * radius_root * root;
        let old_shear_stiffness = 8.0 * self.effective_shear * radius_root * old_root;

        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        let old_shear = kinematics.transport.apply(&old.shear_force);
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        // compressive magnitudes: k δ^{3/2}
        let spring = hertz * root * root * root;
        let old_spring = hertz * old_root * old_root * old_root;

        let growth = root - old_root;
        let mut energy = EnergySplit {
            integration: 0.1
                * hertz
                * (growth * growth * growth)
                * (old_root * old_root + 3.0 * old_root * root + root * root)
                + 0.5 * (spring * (-old_overlap).max(0.0) - old_spring * (-overlap).max(0.0)),
            ..EnergySplit::default()
        };
        if overlap <= 0.0 {
            // the elastic displacement that was left, and this step's, are slip under the mean of old force and zero
            if old_shear_stiffness > 0.0 {
                energy.add_friction(0.5 * old_shear.dot(&(old_shear / old_shear_stiffness + slide)));
            }
            energy.add_viscous(0.5 * old.normal_dashpot * lengthening);
            energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
            return Response {
                force: Vec3::zeros(),
                moment: Vec3::zeros(),
                state: HertzMindlinState::default(),
                status: Status::Opened,
                energy,
            };
        }

        let mass = geometry.reduced_mass();
        let rate = reciprocal_of_step(dt);
        let mut normal_dashpot = if self.damping_ratio > 0.0 {
            5.0_f64.sqrt() * self.damping_ratio * (mass * hertz).sqrt() * root.sqrt() * lengthening * rate
        } else {
            0.0
        };
        if !self.tension_from_damping {
            normal_dashpot = normal_dashpot.min(spring);
        }
        let normal_force = normal_dashpot - spring;

        let unloading = overlap < old_overlap;
        let kept = if unloading { old_shear * (root / old_root) } else { old_shear };
        let trial = kept + slide * shear_stiffness;
        let trial_size = trial.norm();
        let limit = self.friction * (-normal_force).max(0.0);
        let (shear_force, shear_dashpot) = if trial_size > limit {
            let shear_force = trial * (limit / trial_size);
            let slip = (trial - shear_force) / shear_stiffness;
            energy.add_friction(0.5 * (old_shear + shear_force).dot(&slip));
            (shear_force, Vec3::zeros())
        } else {
            let viscosity = 2.0 * self.shear_damping_ratio * (mass * shear_stiffness).sqrt();
            (trial, dashpot_within_limit(&trial, &(slide * (viscosity * rate)), limit))
        };
        if old_shear_stiffness > 0.0 {
            let compliance_change = 1.0 / shear_stiffness - 1.0 / old_shear_stiffness;
            energy.add_friction(if unloading {
                0.5 * compliance_change * old_shear.dot(&shear_force)
            } else {
                -0.5 * compliance_change * old_shear.norm_squared()
            });
        }

        energy.stored_normal = 0.4 * spring * overlap;
        energy.stored_shear = 0.5 * shear_force.norm_squared() / shear_stiffness;
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        Response {
            force: kinematics.normal * normal_force + shear_force + shear_dashpot,
            moment: Vec3::zeros(),
            state: HertzMindlinState { shear_force, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        }
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    /// At the overlap [`HertzMindlin::largest_relative_overlap`]`·R*`: `2E*√(R*δ)` and `8G*√(R*δ)`.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let contact_radius = geometry.effective_radius() * self.largest_relative_overlap.sqrt();
        let normal = 2.0 * self.effective_young * contact_radius;
        let shear = 8.0 * self.effective_shear * contact_radius;
        let mass = geometry.reduced_mass();
        Stiffness {
            normal,
            shear,
            // √5 ζ √(m k) δ^{1/4} with k√δ = (2/3) k_n
            normal_damping: (10.0_f64 / 3.0).sqrt() * self.damping_ratio * (mass * normal).sqrt(),
            shear_damping: 2.0 * self.shear_damping_ratio * (mass * shear).sqrt(),
            ..Stiffness::default()
        }
    }
}

#[cfg(test)]
mod tests {
    //! Benchmark tests 1 to 4 of Chung & Ooi 2011, Granular Matter 13:643, by direct integration of the two bodies.

    use super::*;
    use crate::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry, measure};
    use crate::kinematics::{MotionMeasure, PreviousGeometry, Transport};
    use crate::math::sin_cos;

    /// Course of a collision.
    #[derive(Debug, Clone, Copy, Default)]
    struct Collision {
        largest_force: f64,
        largest_overlap: f64,
        duration: f64,
        /// Velocity and angular velocity of A afterwards.
        velocity: Vec3,
        spin: Vec3,
    }

    fn mass_of(radius: f64, density: f64) -> f64 {
        4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius * density
    }

    /// Closed form of the elastic collision: `δ = (5 m v²/(4k))^{2/5}`, `F = k δ^{3/2}`, `t = 2.943 δ/v` with the
    /// constant `(4/5)√π Γ(2/5)/Γ(9/10) = 2.9432751`, at relative velocity `v`, reduced mass `m`.
    fn hertz(law: &HertzMindlin, radius: f64, mass: f64, speed: f64) -> (f64, f64, f64) {
        let k = 4.0 / 3.0 * law.effective_young * radius.sqrt();
        let overlap = libm::pow(1.25 * mass * speed * speed / k, 0.4);
        (k * overlap * overlap.sqrt(), overlap, 2.9432751 * overlap / speed)
    }

    /// Two equal spheres meeting head on with ±`speed`, through the library's own kinematics.
    fn two_spheres(law: &HertzMindlin, radius: f64, mass: f64, speed: f64, dt: f64) -> Collision {
        let geometry = ContactGeometry {
            reference_length: 2.0 * radius,
            area: 0.0,
            radius_a: radius,
            radius_b: radius,
            mass_a: mass,
            mass_b: mass,
        };
        let body = |x: f64, v: f64| Motion {
            position: Vec3::new(x, 0.0, 0.0),
            velocity: Vec3::new(v, 0.0, 0.0),
            angular_velocity: Vec3::zeros(),
            rotation_increment: crate::math::Quat::identity(),
            orientation: crate::math::Quat::identity(),
        };
        let (mut a, mut b) = (body(-radius, speed), body(radius, -speed));
        let mut frame = initial_geometry(&a.position, &b.position, &Vec3::zeros());
        let mut state = HertzMindlinState::default();
        let mut out = Collision::default();
        let mut steps = 0;
        loop {
            a.position += a.velocity * dt;
            b.position += b.velocity * dt;
            let kinematics =
                measure(MotionMeasure::Finite, &a, &b, &ImageShift::default(), &geometry, &frame, false, dt);
            let answer = law.respond(&kinematics, &state, dt);
            out.largest_force = out.largest_force.max(answer.force.norm());
            out.largest_overlap = out.largest_overlap.max(-kinematics.elongation);
            steps += 1;
            if answer.status == Status::Opened {
                out.duration = f64::from(steps) * dt;
                out.velocity = a.velocity;
                return out;
            }
            a.velocity += answer.force * (dt / mass);
            b.velocity -= answer.force * (dt / mass);
            state = answer.state;
            frame = PreviousGeometry { normal: kinematics.normal, length: kinematics.length };
        }
    }

    /// A sphere hitting the fixed plane `y = 0`, coming down with `speed` at `angle` from the plane's normal, moving
    /// in +x; leapfrog with velocities at half steps, so the displacement of a step is exact.
    fn sphere_on_wall(law: &HertzMindlin, radius: f64, mass: f64, speed: f64, angle: f64, dt: f64) -> Collision {
        let geometry = ContactGeometry {
            reference_length: radius,
            area: 0.0,
            radius_a: radius,
            radius_b: 0.0,
            mass_a: mass,
            mass_b: f64::INFINITY,
        };
        let inertia = 0.4 * mass * radius * radius;
        let (sine, cosine) = sin_cos(angle);
        let normal = -Vec3::y();
        let mut length = radius;
        let mut velocity = Vec3::new(speed * sine, -speed * cosine, 0.0);
        let mut spin = Vec3::zeros();
        let mut state = HertzMindlinState::default();
        let mut out = Collision::default();
        let mut steps = 0;
        loop {
            let length_old = length;
            length += velocity.y * dt;
            let gap = length - radius;
            let arm_a = radius + 0.5 * gap;
            // the wall's point relative to the sphere's: 0 − (v + ω × a n)
            let slide = -(velocity + spin.cross(&(normal * arm_a))) * dt;
            let kinematics = PointKinematics {
                geometry,
                length,
                length_old,
                elongation: gap,
                elongation_old: length_old - radius,
                gap,
                normal,
                shear_increment: slide - normal * slide.dot(&normal),
                arm_a,
                arm_b: 0.5 * gap,
                bonded: false,
                transport: Transport::identity(normal),
            };
            let answer = law.respond(&kinematics, &state, dt);
            out.largest_force = out.largest_force.max(answer.force.norm());
            out.largest_overlap = out.largest_overlap.max(-gap);
            steps += 1;
            if answer.status == Status::Opened {
                out.duration = f64::from(steps) * dt;
                out.velocity = velocity;
                out.spin = spin;
                return out;
            }
            velocity += answer.force * (dt / mass);
            spin += (normal * arm_a).cross(&answer.force) * (dt / inertia);
            state = answer.state;
        }
    }

    fn close(value: f64, expected: f64, tolerance: f64, what: &str) {
        assert!((value / expected - 1.0).abs() < tolerance, "{what}: {value} instead of {expected}");
    }

    /// Test 1. The closed form to 1e-6 (leapfrog with 2e4 steps per collision: (2π/4e4)²/24 ≈ 1e-9 for the peak; the
    /// sampled peak misses the true one by as little; the duration is known to one step, 5e-5), and the published
    /// numbers to their last digit.
    #[test]
    fn chung_ooi_1_two_spheres() {
        for (young, poisson, density, force, overlap, duration) in
            [(48e9, 0.20, 2800.0, 10_696.9, 274.11e-6, 40.34e-6), (20e9, 0.25, 2500.0, 7_108.2, 368.30e-6, 54.20e-6)]
        {
            let body = Elastic { young, poisson };
            let law = HertzMindlin::new(body, body, 0.35, 1.0).unwrap();
            let (radius, mass) = (0.01, mass_of(0.01, density));
            let (f, d, t) = hertz(&law, 0.5 * radius, 0.5 * mass, 20.0);
            close(f, force, 0.06 / force, "published force");
            close(d, overlap, 0.006e-6 / overlap, "published overlap");
            close(t, duration, 0.006e-6 / duration, "published duration");
            let out = two_spheres(&law, radius, mass, 10.0, t / 2e4);
            close(out.largest_force, f, 1e-6, "force");
            close(out.largest_overlap, d, 1e-6, "overlap");
            close(out.duration, t, 1e-4, "duration");
            close(-out.velocity.x, 10.0, 1e-6, "velocity afterwards");
        }
    }

    /// Test 2; tolerances as in test 1.
    #[test]
    fn chung_ooi_2_sphere_on_rigid_plane() {
        for (young, poisson, density, force, overlap, duration) in
            [(70e9, 0.30, 2699.0, 11_369.9, 49.717e-6, 731.6e-6), (40e9, 0.35, 1800.0, 7_232.7, 52.123e-6, 767.1e-6)]
        {
            let law = HertzMindlin::new(Elastic { young, poisson }, Elastic::RIGID, 0.0, 1.0).unwrap();
            let (radius, mass) = (0.1, mass_of(0.1, density));
            let (f, d, t) = hertz(&law, radius, mass, 0.2);
            close(f, force, 0.06 / force, "published force");
            close(d, overlap, 0.0006e-6 / overlap, "published overlap");
            close(t, duration, 0.06e-6 / duration, "published duration");
            let out = sphere_on_wall(&law, radius, mass, 0.2, 0.0, t / 2e4);
            close(out.largest_force, f, 1e-6, "force");
            close(out.largest_overlap, d, 1e-6, "overlap");
            close(out.duration, t, 1e-4, "duration");
        }
    }

    /// Test 3: restitution. 1e-3 is the benchmark's own tolerance; with 2e4 steps per elastic collision the lag of
    /// half a step of the dashpot leaves less than 2e-4, which is asserted. `e = 0` needs a dashpot that may pull.
    #[test]
    fn chung_ooi_3_restitution() {
        for (young, poisson, density) in [(380e9, 0.23, 4000.0), (100e9, 0.25, 7000.0)] {
            let body = Elastic { young, poisson };
            let (radius, mass, speed) = (0.0025, mass_of(0.0025, density), 3.9);
            for e in [0.2, 0.4, 0.6, 0.8, 1.0] {
                let never_pulls = HertzMindlin::new(body, Elastic::RIGID, 0.0, e).unwrap();
                let pulls = never_pulls.with_tension_from_damping(e).unwrap();
                let (_, _, t) = hertz(&never_pulls, radius, mass, speed);
                for law in [never_pulls, pulls] {
                    let out = sphere_on_wall(&law, radius, mass, speed, 0.0, t / 2e4);
                    let found = out.velocity.y / speed;
                    println!("chung-ooi 3: e {e} pulls {} gives {found}", law.tension_from_damping);
                    assert!((found - e).abs() < 2e-4, "{e}: {found}");
                }
            }
        }
        let body = Elastic { young: 380e9, poisson: 0.23 };
        assert!(HertzMindlin::new(body, Elastic::RIGID, 0.0, 0.0).is_err());
    }

    /// Test 4: oblique impact of an aluminium oxide sphere on a rigid plane, `e = 0.98`, `μ = 0.092`, against the
    /// closed form of gross sliding, `e_t = 1 − μ(1+e)/tan θ`, `ω = (5/2)μ(1+e)v cos θ/R`, valid from
    /// `tan θ ≥ (7/2)μ(1+e)` on (32.5°). 2e-3: the closed form has the torque's arm `R` instead of `R − δ/2`
    /// (δ/2R = 1.6e-3); lag of the dashpot 1e-4.
    #[test]
    fn chung_ooi_4_sliding() {
        let (friction, e, radius, speed) = (0.092, 0.98, 0.0025, 3.9);
        let law = HertzMindlin::new(Elastic { young: 380e9, poisson: 0.23 }, Elastic::RIGID, friction, e).unwrap();
        let mass = mass_of(radius, 4000.0);
        let (_, _, t) = hertz(&law, radius, mass, speed);
        for degrees in [40.0_f64, 50.0, 60.0, 70.0, 80.0, 85.0] {
            let (sine, cosine) = sin_cos(degrees.to_radians());
            let out = sphere_on_wall(&law, radius, mass, speed, degrees.to_radians(), t / 2e4);
            let impulse = friction * (1.0 + e) * speed * cosine;
            close(out.velocity.x, speed * sine - impulse, 2e-3, "tangential velocity");
            close(-out.spin.z, 2.5 * impulse / radius, 2e-3, "spin");
        }
    }

    /// Test 4 against the curves of the paper (digitised): angle, ratio of tangential velocities, spin (rad/s),
    /// rebound angle of the contact patch (degrees). Measure: `Σ|Δ|/Σ|reference|`, as in the benchmark's users.
    /// Tolerances 8e-3, 1.2e-2 and 2e-2 (Kratos' own tests of its law take 1.6e-2, 2.2e-2 and 2.5e-2): where gross
    /// sliding makes the answer known, the digitised values are off by 2e-3, 7e-3 and 5e-3 (up to 2 % at 85°, where
    /// the spin is small); the rest is the difference at 10° and 15° between an incremental no-slip spring and the
    /// paper's curves.
    #[test]
    fn chung_ooi_4_digitised() {
        const TABLE: [[f64; 4]; 12] = [
            [10.0, 0.6870, -213.0, -1.56],
            [15.0, 0.6244, -377.8, -5.54],
            [20.0, 0.6161, -510.6, -7.54],
            [25.0, 0.6343, -599.4, -7.54],
            [30.0, 0.6837, -616.5, -3.55],
            [35.0, 0.7372, -582.3, 3.43],
            [40.0, 0.7809, -544.8, 11.57],
            [50.0, 0.8451, -457.0, 29.35],
            [60.0, 0.8929, -357.5, 47.79],
            [70.0, 0.9316, -246.2, 64.58],
            [80.0, 0.9662, -126.3, 78.70],
            [85.0, 0.9827, -63.1, 84.52],
        ];
        let (radius, speed) = (0.0025, 3.9);
        let law = HertzMindlin::new(Elastic { young: 380e9, poisson: 0.23 }, Elastic::RIGID, 0.092, 0.98).unwrap();
        let mass = mass_of(radius, 4000.0);
        let (_, _, t) = hertz(&law, radius, mass, speed);
        let (mut error, mut size) = ([0.0; 3], [0.0; 3]);
        for row in &TABLE {
            let angle = row[0].to_radians();
            let out = sphere_on_wall(&law, radius, mass, speed, angle, t / 2e4);
            let patch = out.velocity.x + radius * out.spin.z;
            let found = [
                out.velocity.x / (speed * sin_cos(angle).0),
                out.spin.z,
                crate::math::atan2(patch, out.velocity.y).to_degrees(),
            ];
            println!("chung-ooi 4: {:2.0}° {found:?} paper {:?}", row[0], &row[1..]);
            for k in 0..3 {
                error[k] += (found[k] - row[k + 1]).abs();
                size[k] += row[k + 1].abs();
            }
        }
        for (k, tolerance) in [8e-3, 1.2e-2, 2e-2].into_iter().enumerate() {
            println!("chung-ooi 4: column {k}: {:.2e}", error[k] / size[k]);
            assert!(error[k] / size[k] < tolerance, "column {k}: {}", error[k] / size[k]);
        }
    }

    // -----------------------------------------------------------------------------------------------------------
    // Conformance

    use crate::law::conformance::{Native, Observed, Properties, Station, Subject, Window, atlas, atlas_paths, check};

    const GEOMETRY: ContactGeometry =
        ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 0.8, radius_b: 1.2, mass_a: 1.0, mass_b: 2.0 };
    const BODY: Elastic = Elastic { young: 1e6, poisson: 0.25 };

    /// Overlaps are a good part of the length, so that rounding of positions does not hide anything.
    fn subject(name: &'static str, law: HertzMindlin) -> Subject<Native<HertzMindlin>> {
        let window = Window { elongation: [-0.4, 0.1], shear: 0.5 };
        Subject {
            name,
            host: Native(law),
            geometry: GEOMETRY,
            bonded: false,
            properties: Properties {
                conservative_normal: law.damping_ratio == 0.0,
                conservative_shear: false,
                dissipation_nonnegative: true,
                // the dashpot vanishes with the overlap, so even a pulling one opens without a jump
                continuous_failure: true,
                brittle: false,
            },
            elastic: window,
            inelastic: window,
            held: Station { elongation: -0.3, shear: [0.05, -0.04], twist: 0.0 },
            failure: 0.1,
            dt: 1e-3,
        }
    }

    /// The law in plain numbers for two components of shear, without dashpots. Between turning points of the overlap
    /// the shear force follows `k_t = 8G*√(R*δ)`: kept while δ grows, scaled with `√δ` while it shrinks.
    fn closed_form(law: HertzMindlin) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
        let radius = 0.8 * 1.2 / 2.0;
        let (mut shear_before, mut overlap_before) = ([0.0; 2], 0.0_f64);
        let mut force = [0.0; 2];
        move |now| {
            let overlap = (-now.station.elongation).max(0.0);
            let pressure = 4.0 / 3.0 * law.effective_young * (radius * overlap * overlap * overlap).sqrt();
            let stiffness = 8.0 * law.effective_shear * (radius * overlap).sqrt();
            for k in 0..2 {
                if overlap < overlap_before {
                    force[k] *= (overlap / overlap_before).sqrt();
                }
                force[k] += stiffness * (now.station.shear[k] - shear_before[k]);
            }
            (shear_before, overlap_before) = (now.station.shear, overlap);
            let size = (force[0] * force[0] + force[1] * force[1]).sqrt();
            if size > law.friction * pressure {
                for x in &mut force {
                    *x *= law.friction * pressure / size;
                }
            }
            Some([-pressure, force[0], force[1]])
        }
    }

    #[test]
    fn undamped_contact_conforms() {
        let law = HertzMindlin::new(BODY, BODY, 0.5, 1.0).unwrap();
        let subject = subject("hertz-mindlin", law);
        let mut report = check(&subject);
        report.findings.extend(atlas(
            &subject,
            &atlas_paths(&subject.inelastic, 50),
            || closed_form(law),
            1e-12,
            "rounding of orientations over 250 steps",
        ));
        println!("{report}");
        assert!(report.passed(), "{report}");
    }

    #[test]
    fn damped_contacts_conform() {
        let mut law = HertzMindlin::new(BODY, Elastic { young: 3e6, poisson: 0.1 }, 0.4, 0.6).unwrap();
        law.shear_damping_ratio = 0.1;
        for law in [law, law.with_tension_from_damping(0.6).unwrap()] {
            let report = check(&subject("damped hertz-mindlin", law));
            println!("{report}");
            assert!(report.passed(), "{report}");
        }
    }

    #[test]
    fn bad_parameters_are_named() {
        let message = HertzMindlin::new(BODY, BODY, f64::NAN, 1.0).unwrap_err().to_string();
        assert_eq!(message, "law hertz_mindlin: friction = NaN must be finite and not negative");
        assert!(HertzMindlin::new(BODY, BODY, 0.1, 1.1).is_err());
        assert!(HertzMindlin::new(Elastic { poisson: 0.6, ..BODY }, BODY, 0.1, 1.0).is_err());
        assert!(HertzMindlin::new(BODY, BODY, 0.1, 0.5).unwrap().with_tension_from_damping(-0.1).is_err());
    }
}
