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
//! | friction | `‖f_t‖ ≤ μ|f_n|`, springs and dashpots together | Coulomb |
//!
//! Forces in N, lengths in m. Unless [`HertzMindlin::tension_from_damping`] is on, the normal force never pulls, and
//! `ζ` gives the restitution `e` under that rule.
//!
//! **Shear spring under changing overlap.** While the overlap grows, the law keeps the shear force and adds increments
//! with the present stiffness, because the new ring of contact area carries no traction. While the overlap shrinks, the
//! law keeps the elastic displacement, so the force falls with the stiffness, because the lost ring releases its
//! traction (Walton 1993, Mech. Mater. 16:239; Thornton, Cummins & Cleary 2013, Powder Technology 233:30). Both
//! dissipate stored energy by micro-slip and neither creates any: `½(1/k_old − 1/k)f_old²` and
//! `½(1/k − 1/k_old) f_old·f`, booked as [`EnergySplit::friction`]. (Scaling the stiffness alone would create energy on
//! unloading.)
//!
//! **Energy.** Stored: `(2/5)kδ^{5/2}` and `f_t²/(2k_t)`. The trapezoidal rule integrates Hertz's force with the error
//! `(k/10)(√δ − √δ_old)³(δ_old + 3√(δ_old δ) + δ)`, of third order in the step. It is the
//! [`EnergySplit::integration`] term, together with the error from the part of a step without contact.

use super::common::{ParameterError, dashpot_within_limit, reciprocal_of_step, require};
use super::restitution::{End, damping_of_restitution};
use super::{ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Response, Status, Stiffness};
pub use crate::elastic::Elastic;
use crate::kinematics::PointKinematics;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, norm, pow};
#[cfg(feature = "std")]
use {
    super::{
        Factors,
        factors::times,
        table::{Fault, LawTable, RegisteredLaw},
    },
    crate::quantity::{Number, Stress},
    schemars::JsonSchema,
    serde::{Deserialize, Serialize},
};

/// Parameters of the Hertz-Mindlin contact.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, Elastic, HertzMindlin, HertzMindlinState};
/// use concordem_contact::math::Vec3;
///
/// let glass = Elastic { young: 48e9, poisson: 0.2 };
/// let law = HertzMindlin::new(glass, glass, 0.35, 1.0).unwrap();
/// // Two spheres of radius 1 m overlap by 10 µm.
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let point = PointKinematics {
///     geometry,
///     length: 1.99999,
///     length_old: 2.0,
///     elongation: 1.99999 - 2.0,
///     elongation_old: 0.0,
///     gap: 1.99999 - 2.0,
///     normal: Vec3::x(),
///     shear_increment: Vec3::zeros(),
///     arm_a: 0.5 * 1.99999,
///     arm_b: 0.5 * 1.99999,
///     bonded: false,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let response = law.respond(&point, &HertzMindlinState::default(), 1.0e-6);
/// // (4/3) E* √R* δ^(3/2) with E* = 25 GPa, R* = 0.5 m
/// let expected = 4.0 / 3.0 * 25e9 * 0.5_f64.sqrt() * 1e-5_f64.powf(1.5);
/// assert!((-response.force.x / expected - 1.0).abs() < 1e-9);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct HertzMindlin {
    /// Effective Young's modulus `E*`, Pa.
    pub effective_young: f64,
    /// Effective shear modulus `G*`, Pa.
    pub effective_shear: f64,
    /// Coefficient of friction `μ`, 1.
    pub friction: f64,
    /// Normal damping ratio `ζ`, 1.
    pub damping_ratio: f64,
    /// Shear damping ratio `ζ_t`, 1.
    pub shear_damping_ratio: f64,
    /// Whether the normal dashpot may pull the particles together while they separate.
    pub tension_from_damping: bool,
    /// Overlap as a fraction of `R*` up to which the time step bound must hold, 1. The stiffness grows with the overlap
    /// without limit, so the bound needs a largest overlap.
    pub largest_relative_overlap: f64,
}

crate::law_state! {
    /// History of a [`HertzMindlin`] contact.
    pub struct HertzMindlinState {
        /// Elastic shear force on A.
        shear_force: Vec3, "N", Odd;
        /// Normal dashpot force of the last step, after limiting.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step, after limiting.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl HertzMindlin {
    /// A contact of two bodies with the given friction coefficient and coefficient of restitution. It never pulls and
    /// has no shear dashpot; its time step bound holds for overlaps up to `R*/20`.
    ///
    /// No finite damping gives the restitution 0 to a contact that never pulls. For 0 the contact may therefore pull:
    /// it is critically damped ([`Self::with_tension_from_damping`]), and its overlap decays without rebound.
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
        require((0.0..=1.0).contains(&restitution), Self::NAME, "restitution", restitution, "between 0 and 1")?;
        let end = if restitution == 0.0 { End::OverlapSpent } else { End::ForceSpent };
        // G = E/(2(1+ν)); the compliances of a rigid body are zero.
        let normal_compliance = |body: Elastic| (1.0 - body.poisson * body.poisson) / body.young;
        let shear_compliance = |body: Elastic| 2.0 * (1.0 + body.poisson) * (2.0 - body.poisson) / body.young;
        let contact = Self {
            effective_young: 1.0 / (normal_compliance(a) + normal_compliance(b)),
            effective_shear: 1.0 / (shear_compliance(a) + shear_compliance(b)),
            friction,
            damping_ratio: damping_of_restitution(restitution, end),
            shear_damping_ratio: 0.0,
            tension_from_damping: end == End::OverlapSpent,
            largest_relative_overlap: 0.05,
        };
        contact.validate()?;
        Ok(contact)
    }

    /// The same contact with a normal dashpot that may pull, and the damping ratio for the restitution `0 ≤ e ≤ 1`.
    pub fn with_tension_from_damping(mut self, restitution: f64) -> Result<Self, ParameterError> {
        self.damping_ratio = damping_of_restitution(restitution, End::OverlapSpent);
        self.tension_from_damping = true;
        require(self.damping_ratio >= 0.0, Self::NAME, "restitution", restitution, "between 0 and 1")?;
        Ok(self)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        let (young, shear) = (self.effective_young, self.effective_shear);
        let (zeta, zeta_t, overlap) = (self.damping_ratio, self.shear_damping_ratio, self.largest_relative_overlap);
        require(positive(young), Self::NAME, "effective_young", young, "positive and finite (Pa)")?;
        require(positive(shear), Self::NAME, "effective_shear", shear, "positive and finite (Pa)")?;
        require(
            not_negative(self.friction),
            Self::NAME,
            "friction_coefficient",
            self.friction,
            "finite and not negative",
        )?;
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
    const STIFFENS: bool = true;

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &HertzMindlinState, dt: f64) -> Response<HertzMindlinState> {
        if kinematics.elongation >= 0.0 {
            self.opening(kinematics, old)
        } else {
            self.pressing::<true>(kinematics, old, dt)
        }
    }

    const COLUMNS: Option<ColumnUse> = Some(ColumnUse {
        // The shear dashpot force.
        optional: 3,
        damage: false,
        ..ColumnUse::ALL
    });

    /// Contacts that stay closed. Slip is a selection.
    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &HertzMindlinState,
        given: &Given,
        dt: f64,
    ) -> (Response<HertzMindlinState>, bool) {
        let response = if given.reduced {
            self.pressing::<false>(kinematics, old, dt)
        } else {
            self.pressing::<true>(kinematics, old, dt)
        };
        (response, kinematics.elongation < 0.0)
    }

    #[inline(always)]
    fn uses_optional_part(&self) -> bool {
        self.has_shear_dashpot()
    }

    /// The friction limit depends on the dashpot, so the shear force comes from the history.
    fn last_force(&self, still: &PointKinematics, state: &HertzMindlinState) -> (Vec3, Vec3) {
        let hertz = 4.0 / 3.0 * self.effective_young * still.geometry.effective_radius().sqrt();
        let root = (-still.elongation).max(0.0).sqrt();
        let elastic = state.shear_force - still.normal * (hertz * root * root * root);
        (elastic + Self::viscous_force(&still.normal, state), Vec3::zeros())
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    /// At the overlap [`HertzMindlin::largest_relative_overlap`]`·R*`: `2E*√(R*δ)` and `8G*√(R*δ)`.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        self.stiffness_of_contact_radius(geometry, geometry.effective_radius() * self.largest_relative_overlap.sqrt())
    }

    /// `2E*√(R*δ)` and `8G*√(R*δ)` at the given overlap δ.
    fn stiffness_at(&self, geometry: &ContactGeometry, overlap: f64) -> Stiffness {
        self.stiffness_of_contact_radius(geometry, (geometry.effective_radius() * overlap.max(0.0)).sqrt())
    }

    /// `(F/k)^{2/3}`.
    fn overlap_under(&self, geometry: &ContactGeometry, force: f64) -> f64 {
        let hertz = 4.0 / 3.0 * self.effective_young * geometry.effective_radius().sqrt();
        pow(force / hertz, 2.0 / 3.0)
    }

    /// The energy grows with `δ^{5/2}`.
    #[inline(always)]
    fn work_before(&self, motion: &PointKinematics, stored: f64) -> f64 {
        let ratio = motion.elongation_old / motion.elongation;
        stored * (ratio * ratio * ratio.sqrt())
    }

    /// `(5mv²/4k)^{2/5}`: all kinetic energy is stored, `½mv² = (2/5)kδ^{5/2}` (Johnson 1985, (11.25)).
    fn impact_overlap(&self, geometry: &ContactGeometry, speed: f64) -> f64 {
        let hertz = 4.0 / 3.0 * self.effective_young * geometry.effective_radius().sqrt();
        pow(1.25 * geometry.reduced_mass() * (speed * speed) / hertz, 0.4)
    }
}

/// Springs of a contact now and one step ago.
struct Springs {
    /// `√δ`, √m; 0 without overlap.
    root: f64,
    old_root: f64,
    /// Hertz's constant `k`, N/m^{3/2}.
    hertz: f64,
    /// Compressive force of the spring `k δ^{3/2}`, N.
    spring: f64,
    /// `k_t`, N/m; 0 without overlap.
    shear_stiffness: f64,
    old_shear_stiffness: f64,
    /// Error of the trapezoidal rule for the work of the normal spring, J.
    integration: f64,
}

impl HertzMindlin {
    #[inline(always)]
    fn springs(&self, kinematics: &PointKinematics) -> Springs {
        let radius_root = kinematics.geometry.effective_radius().sqrt();
        let hertz = 4.0 / 3.0 * self.effective_young * radius_root;
        let overlap = -kinematics.elongation;
        let old_overlap = -kinematics.elongation_old;
        let root = overlap.max(0.0).sqrt();
        let old_root = old_overlap.max(0.0).sqrt();
        let spring = hertz * root * root * root;
        let old_spring = hertz * old_root * old_root * old_root;
        let growth = root - old_root;
        let integration =
            0.1 * hertz * (growth * growth * growth) * (old_root * old_root + 3.0 * old_root * root + root * root)
                + 0.5 * (spring * (-old_overlap).max(0.0) - old_spring * (-overlap).max(0.0));
        Springs {
            root,
            old_root,
            hertz,
            spring,
            shear_stiffness: 8.0 * self.effective_shear * radius_root * root,
            old_shear_stiffness: 8.0 * self.effective_shear * radius_root * old_root,
            integration,
        }
    }

    /// Response of a contact without overlap.
    #[inline(always)]
    fn opening(&self, kinematics: &PointKinematics, old: &HertzMindlinState) -> Response<HertzMindlinState> {
        let Springs { old_shear_stiffness, integration, .. } = self.springs(kinematics);
        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        // The forces of the last step, in the present axes.
        let old_shear = kinematics.transport.apply(&old.shear_force);
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        let mut energy = EnergySplit { integration, ..EnergySplit::default() };
        // The remaining elastic displacement, and that of this step, slip under the mean of the old force and zero.
        if old_shear_stiffness > 0.0 {
            energy.add_friction(0.5 * old_shear.dot(&(old_shear / old_shear_stiffness + slide)));
        }
        energy.add_viscous(0.5 * old.normal_dashpot * lengthening);
        energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
        Response {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            state: HertzMindlinState::default(),
            status: Status::Opened,
            energy,
        }
    }
}

impl HertzMindlin {
    /// Whether the law has a shear dashpot.
    #[inline(always)]
    fn has_shear_dashpot(&self) -> bool {
        self.shear_damping_ratio > 0.0
    }

    /// Response of a contact with overlap, which survives the step, without branches. `SHEAR_DASHPOT`: false if neither the law nor
    /// the last step has a shear dashpot force; then the response leaves it out. For finite motion, the bits are the same.
    #[inline(always)]
    fn pressing<const SHEAR_DASHPOT: bool>(
        &self,
        kinematics: &PointKinematics,
        old: &HertzMindlinState,
        dt: f64,
    ) -> Response<HertzMindlinState> {
        let geometry = &kinematics.geometry;
        let Springs { root, old_root, hertz, spring, shear_stiffness, old_shear_stiffness, integration } =
            self.springs(kinematics);
        let (overlap, old_overlap) = (-kinematics.elongation, -kinematics.elongation_old);
        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        let old_shear = kinematics.transport.apply(&old.shear_force);

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
        let trial_size = norm(&trial);
        let limit = self.friction * (-normal_force).max(0.0);
        let slips = trial_size > limit;
        // Without slip: the trial force itself, and no work.
        let shear_force = trial * if slips { limit / trial_size } else { 1.0 };
        let compliance = 1.0 / shear_stiffness;
        let slip = (trial - shear_force) * compliance;
        let shear_dashpot = if SHEAR_DASHPOT && self.has_shear_dashpot() {
            let viscosity = 2.0 * self.shear_damping_ratio * (mass * shear_stiffness).sqrt();
            let room = dashpot_within_limit(&trial, &(slide * (viscosity * rate)), limit);
            if slips { Vec3::zeros() } else { room }
        } else {
            Vec3::zeros()
        };
        // A contact that begins has no shear force to change.
        let old_compliance = if old_shear_stiffness > 0.0 { 1.0 / old_shear_stiffness } else { compliance };
        let compliance_change = compliance - old_compliance;
        let micro_slip = if unloading {
            0.5 * compliance_change * old_shear.dot(&shear_force)
        } else {
            -0.5 * compliance_change * old_shear.norm_squared()
        };

        let mut energy = EnergySplit { integration, ..EnergySplit::default() };
        energy.add_friction(0.5 * (old_shear + shear_force).dot(&slip));
        energy.add_friction(micro_slip);
        energy.stored_normal = 0.4 * spring * overlap;
        energy.stored_shear = 0.5 * shear_force.norm_squared() / shear_stiffness;
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        if SHEAR_DASHPOT {
            let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
            energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        }
        Response {
            force: kinematics.normal * normal_force + shear_force + shear_dashpot,
            moment: Vec3::zeros(),
            state: HertzMindlinState { shear_force, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        }
    }
}

impl HertzMindlin {
    /// Stiffnesses at the radius √(R*δ) of the contact area, m.
    fn stiffness_of_contact_radius(&self, geometry: &ContactGeometry, contact_radius: f64) -> Stiffness {
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

/// Hertz contact with Mindlin's shear stiffness, Coulomb friction, and restitution.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "HertzMindlin", deny_unknown_fields)]
pub struct HertzMindlinTable {
    /// Young's modulus of the particles, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Poisson's ratio of the particles.
    #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
    pub poisson: Number,
    /// Friction coefficient (tangent of the angle).
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Coefficient of restitution. At 0 the contact may pull while the spheres separate, so that they stay together.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 0, "maximum" = 1))]
    pub restitution: Number,
    /// Shear dashpot as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub shear_damping_ratio: Number,
}

#[cfg(feature = "std")]
fn one() -> Number {
    Number::new(1.0)
}

#[cfg(feature = "std")]
impl LawTable for HertzMindlinTable {
    fn modulus(&self) -> Option<f64> {
        Some(self.young.si())
    }
}

#[cfg(feature = "std")]
impl RegisteredLaw for HertzMindlin {
    type Table = HertzMindlinTable;
    type Unbonded = Self;
    const TITLE: &'static str = "Hertz-Mindlin contact";
    const AS_CONTACT: Option<&'static str> = Some("Hertz-Mindlin contact with Coulomb friction and restitution.");

    fn row(a: &HertzMindlinTable, b: &HertzMindlinTable) -> Result<Self, ParameterError> {
        let elastic = |t: &HertzMindlinTable| Elastic { young: t.young.si(), poisson: t.poisson.si() };
        let contact = Self::new(
            elastic(a),
            elastic(b),
            a.friction_coefficient.si().min(b.friction_coefficient.si()),
            0.5 * (a.restitution.si() + b.restitution.si()),
        )?;
        let shear_damping_ratio = 0.5 * (a.shear_damping_ratio.si() + b.shear_damping_ratio.si());
        let contact = Self { shear_damping_ratio, ..contact };
        contact.validate()?;
        Ok(contact)
    }

    fn unbonded_row(a: &HertzMindlinTable, b: &HertzMindlinTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    /// Only bonds have strength and ductility.
    fn scaled(table: &HertzMindlinTable, factors: &Factors) -> Result<HertzMindlinTable, Fault> {
        Ok(HertzMindlinTable { young: times(table.young, factors.stiffness), ..table.clone() })
    }
}

#[cfg(test)]
#[path = "hertz_mindlin_tests.rs"]
mod tests;
