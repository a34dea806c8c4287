//! Unbonded contact with linear springs and Coulomb friction (Cundall & Strack 1979, Géotechnique 29:47). A broken
//! linear bond continues as such a contact (Madan 2019, (2.40)).
//!
//! With the elongation `u` (negative while the particles touch) and the elastic shear displacement `u_t`,
//!
//! * `f_n = k_n u + c_n u̇` while `u < 0`, otherwise zero; unless [`Frictional::tension_from_damping`] is on, the
//!   normal force never pulls: `f_n ≤ 0`;
//! * `u_t` follows the shear displacement; if `k_t‖u_t‖` exceeds `μ|f_n|`, it is scaled back to the limit, and the
//!   difference is slip (return to the Coulomb cone at constant normal force);
//! * a shear dashpot `c_t u̇_t` acts within what the Coulomb limit leaves, so not during sliding;
//! * `c = ξ·2√(m k)` with the reduced mass `m`.
//!
//! Forces are those on A, in N, positive in tension. Particles touch if the length is less than
//! [`ContactGeometry::reference_length`], which is `R_A + R_B` for ordinary contacts; a broken bond may keep its own.
//! The energy balance is exact for the trapezoidal rule: friction is `½(f_old + f_new)·slip`. If a contact closes or
//! opens within a step, the rule overestimates or underestimates the work of the kinked spring by
//! `½k_n(u_old⁻u⁺ − u⁻u_old⁺)`, which is the [`EnergySplit::integration`] term.

use super::common::{ParameterError, dashpot_within_limit, reciprocal_of_step, require};
use super::{
    ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Response, Status, Stiffness, TemperatureFactors,
};
use crate::kinematics::PointKinematics;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Vec3, norm};
#[cfg(feature = "std")]
use {
    super::{
        Factors,
        factors::times,
        table::{Fault, LawTable, RegisteredLaw},
    },
    crate::quantity::{self, Number, Stress},
    schemars::JsonSchema,
    serde::{Deserialize, Serialize},
};

/// Source of the stiffnesses of a contact.
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub enum ContactStiffness {
    /// The same values for every contact.
    Given {
        /// `k_n`, N/m.
        normal: f64,
        /// `k_t`, N/m.
        shear: f64,
    },
    /// From moduli and radii, as in YADE's `Ip2_FrictMat_FrictMat_FrictPhys` (Šmilauer et al. 2010): two springs
    /// `2 E r` in series, `k_n = 2 E_A r_A E_B r_B/(E_A r_A + E_B r_B)`, `k_t = ratio·k_n`. A wall has no radius; the
    /// formulas use the radius of the particle for both.
    Moduli {
        /// Modulus of A, Pa.
        young_a: f64,
        /// Modulus of B, Pa.
        young_b: f64,
        /// `k_t/k_n`, 1 (YADE calls it `poisson`).
        ratio: f64,
    },
}

impl ContactStiffness {
    /// `(k_n, k_t)` of a contact, N/m.
    #[inline(always)]
    pub fn of(&self, geometry: &ContactGeometry) -> (f64, f64) {
        match *self {
            Self::Given { normal, shear } => (normal, shear),
            Self::Moduli { young_a, young_b, ratio } => {
                let radius_b = if geometry.radius_b > 0.0 { geometry.radius_b } else { geometry.radius_a };
                let (a, b) = (young_a * geometry.radius_a, young_b * radius_b);
                let normal = 2.0 * (a * b) / (a + b);
                (normal, ratio * normal)
            }
        }
    }
}

/// Parameters of the linear frictional contact.
///
/// ```
/// use concordem_contact::kinematics::{PointKinematics, Transport};
/// use concordem_contact::law::{ContactGeometry, ContactLaw, ContactStiffness, Frictional, FrictionalState};
/// use concordem_contact::math::Vec3;
///
/// let law = Frictional::new(ContactStiffness::Given { normal: 2.0e6, shear: 1.0e6 }, 0.5, 0.0).unwrap();
/// // Two spheres of radius 1 m overlap by 0.5 m and slide along y by 2 m in one step.
/// let geometry =
///     ContactGeometry { reference_length: 2.0, area: 1.0, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
/// let point = PointKinematics {
///     geometry,
///     length: 1.5,
///     length_old: 2.0,
///     elongation: 1.5 - 2.0,
///     elongation_old: 0.0,
///     gap: 1.5 - 2.0,
///     normal: Vec3::x(),
///     shear_increment: Vec3::y() * 2.0,
///     arm_a: 0.5 * 1.5,
///     arm_b: 0.5 * 1.5,
///     bonded: false,
///     transport: Transport::identity(Vec3::x()),
/// };
/// let response = law.respond(&point, &FrictionalState::default(), 1.0e-6);
/// // Pressed, and at the limit of friction.
/// assert_eq!(response.force.x, -1.0e6);
/// assert!((response.force.y.abs() - 0.5e6).abs() < 1e-6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[repr(C)]
pub struct Frictional {
    /// Source of the stiffnesses.
    pub stiffness: ContactStiffness,
    /// Coefficient of friction `μ = tan φ`, 1.
    pub friction: f64,
    /// Damping ratio `ξ` of both dashpots, 1. [`damping_of_restitution`](super::restitution::damping_of_restitution)
    /// computes it from a coefficient of restitution.
    pub damping_ratio: f64,
    /// Whether the dashpot may pull the particles together while they separate.
    pub tension_from_damping: bool,
}

crate::law_state! {
    /// History of a [`Frictional`] contact.
    pub struct FrictionalState {
        /// Elastic shear displacement.
        shear_displacement: Vec3, "m", Odd;
        /// Normal dashpot force of the last step, after limiting.
        normal_dashpot: f64, "N", Even;
        /// Shear dashpot force of the last step, after limiting.
        shear_dashpot: Vec3, "N", Odd;
    }
}

impl Frictional {
    /// A contact that never pulls, with the given stiffnesses, friction coefficient, and damping ratio.
    pub fn new(stiffness: ContactStiffness, friction: f64, damping_ratio: f64) -> Result<Self, ParameterError> {
        let contact = Self { stiffness, friction, damping_ratio, tension_from_damping: false };
        contact.validate()?;
        Ok(contact)
    }

    /// Check that all parameters are in their ranges.
    pub fn validate(&self) -> Result<(), ParameterError> {
        let positive = |value: f64| value > 0.0 && value.is_finite();
        let not_negative = |value: f64| value >= 0.0 && value.is_finite();
        match self.stiffness {
            ContactStiffness::Given { normal, shear } => {
                require(positive(normal), Self::NAME, "normal_stiffness", normal, "positive and finite (N/m)")?;
                require(not_negative(shear), Self::NAME, "shear_stiffness", shear, "finite and not negative (N/m)")?;
            }
            ContactStiffness::Moduli { young_a, young_b, ratio } => {
                require(positive(young_a), Self::NAME, "young", young_a, "positive and finite (Pa)")?;
                require(positive(young_b), Self::NAME, "young", young_b, "positive and finite (Pa)")?;
                require(not_negative(ratio), Self::NAME, "stiffness_ratio", ratio, "finite and not negative")?;
            }
        }
        require(
            not_negative(self.friction),
            Self::NAME,
            "friction_coefficient",
            self.friction,
            "finite and not negative",
        )?;
        let xi = self.damping_ratio;
        require(not_negative(xi), Self::NAME, "damping_ratio", xi, "finite and not negative")
    }

    /// Dashpot constants `(c_n, c_t)`, N·s/m.
    #[inline(always)]
    fn dashpots(&self, geometry: &ContactGeometry, normal: f64, shear: f64) -> (f64, f64) {
        if self.damping_ratio == 0.0 {
            return (0.0, 0.0);
        }
        let mass = geometry.reduced_mass();
        (2.0 * self.damping_ratio * (mass * normal).sqrt(), 2.0 * self.damping_ratio * (mass * shear).sqrt())
    }
}

impl ContactLaw for Frictional {
    type State = FrictionalState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "frictional";
    const DEFORMS: bool = true;
    const VARIES: bool = true;

    fn at_temperature(&self, factors: &TemperatureFactors) -> Self {
        let factor = factors.stiffness;
        let stiffness = match self.stiffness {
            ContactStiffness::Given { normal, shear } => {
                ContactStiffness::Given { normal: normal * factor, shear: shear * factor }
            }
            ContactStiffness::Moduli { young_a, young_b, ratio } => {
                ContactStiffness::Moduli { young_a: young_a * factor, young_b: young_b * factor, ratio }
            }
        };
        Self { stiffness, ..*self }
    }

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &FrictionalState, dt: f64) -> Response<FrictionalState> {
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
        old: &FrictionalState,
        given: &Given,
        dt: f64,
    ) -> (Response<FrictionalState>, bool) {
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
    fn last_force(&self, still: &PointKinematics, state: &FrictionalState) -> (Vec3, Vec3) {
        let (normal_stiffness, shear_stiffness) = self.stiffness.of(&still.geometry);
        let elastic = still.normal * (normal_stiffness * still.elongation) + state.shear_displacement * shear_stiffness;
        (elastic + Self::viscous_force(&still.normal, state), Vec3::zeros())
    }

    #[inline(always)]
    fn viscous_force(normal: &Vec3, state: &Self::State) -> Vec3 {
        normal * state.normal_dashpot + state.shear_dashpot
    }

    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let (normal, shear) = self.stiffness.of(geometry);
        let (normal_damping, shear_damping) = self.dashpots(geometry, normal, shear);
        Stiffness { normal, shear, normal_damping, shear_damping, ..Stiffness::default() }
    }

    fn exchanged(&self) -> Self {
        let mut out = *self;
        if let ContactStiffness::Moduli { young_a, young_b, .. } = &mut out.stiffness {
            core::mem::swap(young_a, young_b);
        }
        out
    }
}

impl Frictional {
    /// Error of the trapezoidal rule for the work of the normal spring of stiffness `normal_stiffness` (N/m), J.
    #[inline(always)]
    fn kink(normal_stiffness: f64, kinematics: &PointKinematics) -> f64 {
        let (stretch, old_stretch) = (kinematics.elongation, kinematics.elongation_old);
        0.5 * normal_stiffness * (old_stretch.min(0.0) * stretch.max(0.0) - stretch.min(0.0) * old_stretch.max(0.0))
    }

    /// Response of a contact without overlap.
    #[inline(always)]
    fn opening(&self, kinematics: &PointKinematics, old: &FrictionalState) -> Response<FrictionalState> {
        let (normal_stiffness, shear_stiffness) = self.stiffness.of(&kinematics.geometry);
        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        // Elastic displacement and dashpot force of the last step, in the present axes.
        let old_shear = kinematics.transport.apply(&old.shear_displacement);
        let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
        let mut energy =
            EnergySplit { integration: Self::kink(normal_stiffness, kinematics), ..EnergySplit::default() };
        energy.add_friction(0.5 * shear_stiffness * old_shear.dot(&(old_shear + slide)));
        energy.add_viscous(0.5 * old.normal_dashpot * lengthening);
        energy.add_viscous(0.5 * old_shear_dashpot.dot(&slide));
        Response {
            force: Vec3::zeros(),
            moment: Vec3::zeros(),
            state: FrictionalState::default(),
            status: Status::Opened,
            energy,
        }
    }
}

impl Frictional {
    /// Whether the law has a shear dashpot.
    #[inline(always)]
    fn has_shear_dashpot(&self) -> bool {
        self.damping_ratio != 0.0
    }

    /// Response of a contact with overlap, which survives the step, without branches. `SHEAR_DASHPOT`: false if neither the law nor
    /// the last step has a shear dashpot force; then the response leaves it out. For finite motion, the bits are the same.
    #[inline(always)]
    fn pressing<const SHEAR_DASHPOT: bool>(
        &self,
        kinematics: &PointKinematics,
        old: &FrictionalState,
        dt: f64,
    ) -> Response<FrictionalState> {
        let geometry = &kinematics.geometry;
        let (normal_stiffness, shear_stiffness) = self.stiffness.of(geometry);
        let lengthening = kinematics.length - kinematics.length_old;
        let slide = kinematics.shear_increment;
        let stretch = kinematics.elongation;
        let old_shear = kinematics.transport.apply(&old.shear_displacement);

        let (normal_viscosity, shear_viscosity) =
            if SHEAR_DASHPOT { self.dashpots(geometry, normal_stiffness, shear_stiffness) } else { (0.0, 0.0) };
        let rate = reciprocal_of_step(dt);
        let elastic_normal = normal_stiffness * stretch;
        let mut normal_dashpot = normal_viscosity * lengthening * rate;
        if !self.tension_from_damping {
            normal_dashpot = normal_dashpot.min(-elastic_normal);
        }
        let normal_force = elastic_normal + normal_dashpot;

        let limit = self.friction * (-normal_force).max(0.0);
        let trial = old_shear + slide;
        let trial_force = shear_stiffness * norm(&trial);
        let slips = trial_force > limit;
        // Without slip: the trial displacement itself, and no work.
        let shear_displacement = trial * if slips { limit / trial_force } else { 1.0 };
        let slip = trial - shear_displacement;
        let shear_dashpot = if SHEAR_DASHPOT && self.has_shear_dashpot() {
            let dashpot = slide * (shear_viscosity * rate);
            let room = dashpot_within_limit(&(trial * shear_stiffness), &dashpot, limit);
            if slips { Vec3::zeros() } else { room }
        } else {
            Vec3::zeros()
        };
        let elastic_shear = shear_displacement * shear_stiffness;

        let mut energy =
            EnergySplit { integration: Self::kink(normal_stiffness, kinematics), ..EnergySplit::default() };
        energy.add_friction(0.5 * shear_stiffness * (old_shear + shear_displacement).dot(&slip));
        energy.stored_normal = 0.5 * elastic_normal * stretch;
        energy.stored_shear = 0.5 * elastic_shear.dot(&shear_displacement);
        energy.add_viscous(0.5 * (old.normal_dashpot + normal_dashpot) * lengthening);
        if SHEAR_DASHPOT {
            let old_shear_dashpot = kinematics.transport.apply(&old.shear_dashpot);
            energy.add_viscous(0.5 * (old_shear_dashpot + shear_dashpot).dot(&slide));
        }
        Response {
            force: kinematics.normal * normal_force + elastic_shear + shear_dashpot,
            moment: Vec3::zeros(),
            state: FrictionalState { shear_displacement, normal_dashpot, shear_dashpot },
            status: Status::Lives,
            energy,
        }
    }
}

/// Linear elastic contact with Coulomb friction; no tension.
#[cfg(feature = "std")]
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "Frictional", deny_unknown_fields)]
pub struct FrictionalTable {
    /// Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius; or give both stiffnesses.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Option<Stress>,
    /// Shear stiffness divided by normal stiffness; with `young`.
    #[schemars(extend("minimum" = 0))]
    pub stiffness_ratio: Option<Number>,
    /// Normal stiffness, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: Option<quantity::Stiffness>,
    /// Shear stiffness, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: Option<quantity::Stiffness>,
    /// Friction coefficient (tangent of the angle).
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
}

#[cfg(feature = "std")]
impl LawTable for FrictionalTable {
    fn faults(&self) -> Vec<Fault> {
        let moduli = [("young", self.young.is_some()), ("stiffness_ratio", self.stiffness_ratio.is_some())];
        let springs = [
            ("normal_stiffness", self.normal_stiffness.is_some()),
            ("shear_stiffness", self.shear_stiffness.is_some()),
        ];
        let help = "give `young` and `stiffness_ratio` (the stiffness grows with the radius), \
                    or `normal_stiffness` and `shear_stiffness` (the same for all contacts)";
        let any = |pair: &[(&str, bool); 2]| pair.iter().any(|(_, given)| *given);
        if any(&moduli) && any(&springs) {
            let key = springs.iter().find(|(_, given)| *given).map_or("normal_stiffness", |(key, _)| key);
            return vec![Fault::conflict(key, "the stiffness is given twice", help)];
        }
        if !any(&moduli) && !any(&springs) {
            return vec![Fault::missing("", "the stiffness is missing", help)];
        }
        let pair = if any(&moduli) { moduli } else { springs };
        pair.iter().filter(|(_, given)| !given).map(|(key, _)| Fault::missing(key, "missing key", help)).collect()
    }

    fn modulus(&self) -> Option<f64> {
        self.young.map(Stress::si)
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }

    fn fault_in_plane(&self) -> Option<Fault> {
        self.young?;
        let help = "give `normal_stiffness` and `shear_stiffness` in N/m, or use dimension = 3";
        let message = "gives the stiffness of spheres, which has no meaning between discs of unit depth";
        Some(Fault::conflict("young", message, help))
    }
}

#[cfg(feature = "std")]
impl RegisteredLaw for Frictional {
    type Table = FrictionalTable;
    type Unbonded = Self;
    const TITLE: &'static str = "linear frictional contact";
    const AS_CONTACT: Option<&'static str> = Some("Linear elastic contact with Coulomb friction.");

    fn row(a: &FrictionalTable, b: &FrictionalTable) -> Result<Self, ParameterError> {
        let mean = |x: f64, y: f64| 0.5 * (x + y);
        let stiffness = match (a.young, b.young, a.normal_stiffness, b.normal_stiffness) {
            (Some(young_a), Some(young_b), _, _) => {
                let ratio = |table: &FrictionalTable| table.stiffness_ratio.map_or(0.0, Number::si);
                ContactStiffness::Moduli {
                    young_a: young_a.si(),
                    young_b: young_b.si(),
                    ratio: mean(ratio(a), ratio(b)),
                }
            }
            (_, _, Some(normal_a), Some(normal_b)) => {
                let shear = |table: &FrictionalTable| table.shear_stiffness.map_or(0.0, quantity::Stiffness::si);
                ContactStiffness::Given { normal: mean(normal_a.si(), normal_b.si()), shear: mean(shear(a), shear(b)) }
            }
            _ => {
                return Err(ParameterError::Unlike(
                    "one material gives `young`, the other `normal_stiffness`; give both the same, or an [[interface]]",
                ));
            }
        };
        // The smoother surface slides first.
        let friction = a.friction_coefficient.si().min(b.friction_coefficient.si());
        Self::new(stiffness, friction, mean(a.damping_ratio.si(), b.damping_ratio.si()))
    }

    fn unbonded_row(a: &FrictionalTable, b: &FrictionalTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    /// Only bonds have strength and ductility.
    fn scaled(table: &FrictionalTable, factors: &Factors) -> Result<FrictionalTable, Fault> {
        Ok(FrictionalTable {
            young: table.young.map(|young| times(young, factors.stiffness)),
            normal_stiffness: table.normal_stiffness.map(|stiffness| times(stiffness, factors.stiffness)),
            shear_stiffness: table.shear_stiffness.map(|stiffness| times(stiffness, factors.stiffness)),
            ..table.clone()
        })
    }
}

#[cfg(test)]
#[path = "frictional_tests.rs"]
mod tests;
