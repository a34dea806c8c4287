//! Cohesive particle model for concrete (CPM): damage in tension, Mohr–Coulomb plasticity in shear.
//!
//! Sources: Stránský 2018, §2.5 (equations quoted as (2.x), (6.x)); Šmilauer 2010, chapter "Concrete particle model"
//! (the full model: rate dependence, logarithmic yield surface, plasticity in compression, confinement); the programs
//! YADE (`ConcretePM`) and Woo (`Concrete`), read for behaviour.
//!
//! # The law
//!
//! Symbols: Ē, Ḡ normal and shear modulus (Pa), ε₀ limit elastic strain, ε_f softening strain, c₀ cohesion (Pa), φ angle
//! of friction, L and A reference length (m) and area (m²) of the link, n its unit normal from A to B. Tension positive.
//!
//! Normal direction, (2.3)–(2.5), (2.13)–(2.17), with e = ε_N + σ₀/Ē − ε_Np:
//! ```text
//! ε_N = (d − L)/L                              κ = max over time of ε̃,  ε̃ = √(⟨e⟩² + ξ²|ε_T|²)
//! ω = g(κ) = 1 − (ε₀/κ) exp(−(κ−ε₀)/ε_f)       exponential softening (2.17), 0 for κ < ε₀
//!   or       (1 − ε₀/κ)/(1 − ε₀/ε_f)           linear softening, 1 for κ ≥ ε_f
//! σ_N = [1 − ω H(e)] Ē e − σ₀                  f_N = A σ_N
//! ```
//! ξ (`shear_contribution`) and σ₀ (`isotropic_prestress`, Šmilauer 2010, "Isotropic confinement") are 0 by default.
//! Plasticity in compression (Šmilauer 2010, "Compressive plasticity"; ε_s = `soft_strain` < 0 switches it on): for
//! ε_N + σ₀/Ē < ε_s the stress is at least Ē(ε_s + K̃(ε_N + σ₀/Ē − ε_s)) ≤ 0 and the difference goes to ε_Np.
//!
//! Shear, (2.18)–(2.20): σ_T = Ḡ(ε_T − ε_Tp), |σ_T| ≤ y(σ_N, ω), flow along σ_T, radial return. With
//! v = `yield_log_speed` (Y₀ of Šmilauer 2010) the radius of the elastic domain, clipped at 0, is
//! ```text
//! 0 Mohr–Coulomb (2.19)      y = c₀(1−ω) − σ_N tan φ
//! 1 parabolic                y = √(c₀² − 2 c₀ σ_N tan φ) − c₀ ω
//! 2 logarithmic              y = c₀[(1−ω) + v tan φ ln(1 − σ_N/(c₀ v))],  0 for σ_N ≥ c₀ v
//! 3 logarithmic-linear       2 in compression, 0 in tension
//! ```
//! σ_N in y is taken before σ₀ is subtracted and before the viscous overstress is added.
//!
//! Rate dependence (Šmilauer 2010, "Visco-damage", "Visco-plasticity"). With characteristic times τ_d, τ_p and exponents
//! M_d, M_p:
//! ```text
//! σ_N ← σ_N + Ē(ωe − ε_d),     ωe − ε_d = (1−ω) ε₀ ⟨τ_d ε̇_d⟩^M_d       (tension; ε_d the damage strain)
//! |σ_T| = y + c₀ (τ_p |ε̇_Tp|)^M_p                                       (while flowing)
//! ```
//! Both are one backward Euler step Δε = s eᵝ of size s = (ωe − ε_d or (|σ_trial| − y)/Ḡ), with β ≤ 0 the root of
//! ln(eᵝ + c e^{Mβ}) = 0, where c = (1−ω) ε₀ (τ_d/Δt)^M_d s^{M_d−1}, or c = c₀ (τ_p/(ḠΔt))^M_p (|σ_trial|−y)^{M_p−1}.
//! The factor (1−ω) is in the published algorithm and in both programs, not in the published continuous equation.
//!
//! A contact that is not a bond has ω = 1: no cohesion, no tension; it is over once ε_N > 0.
//!
//! # Modes
//!
//! * [`CpmFormulation::Thesis`] (default): the equations above. Slip is returned exactly and ε_Tp is carried with the contact
//!   like ε_T. All options may be switched on; with all of them this is the published full model.
//! * [`CpmFormulation::YadePublic`]: YADE's `Law2_ScGeom_CpmPhys_Cpm`, bit for bit when fed with
//!   [`MotionMeasure::Yade`](crate::kinematics::MotionMeasure) kinematics. Quirks: the plastic increment uses the already scaled stress,
//!   Δε_Tp = s(1−s)σ_trial/Ḡ instead of (1−s)σ_trial/Ḡ; ε_Tp is not rotated with the contact; the hardening line uses e
//!   in place of ε_N (so the hardening modulus depends on the step size: in the limit of small steps the branch is
//!   perfectly plastic whatever K̃); linear damage exceeds 1 beyond ε_f. Other yield surfaces and viscosity are
//!   parameters without effect there, and are refused here. Uses the system's `exp` and `tan`.
//! * [`CpmFormulation::Woo`]: Woo's `Law2_L6Geom_ConcretePhys`. Quirks: shear has no memory, the trial stress is Ḡ times the
//!   total ε_T (the published model has ε_Tp), so unloading recovers slip, and slip viscosity depends on Δt; ε_d is
//!   compared with ω ε_N also in compression; σ₀ is subtracted but ε_N is not adjusted; ξ is not used.
//!
//! # Energies
//!
//! With V = A L, D = ω H(e), subscripts o and n for the two ends of a step, per step and exactly (but for rounding)
//! ```text
//! V ½(σ_o+σ_n)·Δε = Δ stored + damage + friction + viscous + integration
//! stored normal   V[½(1−D)Ē e² − σ₀ ε_N − ½σ₀²/Ē]        stored shear  V ½|σ_T|²/Ḡ
//! damage          V ½Ē e_o e_n (D_n − D_o)                 while e keeps its sign, else counted as integration
//! friction        ⟨V ½(σ_o+σ_n)·Δε_p⟩, shear and normal    viscous       V ½(σ_v,o + σ_v,n)·Δε
//! ```
//! because ½[(1−D_o)e_o + (1−D_n)e_n](e_n − e_o) = Δ½(1−D)e² + ½e_o e_n(D_n − D_o). The viscous overstress counts as a
//! stress without stored energy, so its part of a step of unloading can be negative. A bond that breaks releases the
//! energy stored at the end of its last step into `damage`; as the force of that end is not applied, −V ½σ_n·Δε goes
//! to `integration`. Where sliding turns round while the bound falls, the rule can give a negative friction: that part is
//! `integration` too (not in Woo mode, whose slip is recovered in unloading at any size of the step). First-order transport does not keep lengths: V ½Ḡ(|e_T|² − |transported e_T|²) is `integration`;
//! it also leaves a part of σ_T along n, of second order in the rotations of a step, whose work is not counted.
//! In YADE mode the slip is Δε_T − Δσ_T/Ḡ, which is not the increment of YADE's ε_Tp (quirk above).

use super::{
    ContactGeometry, ContactLaw, EnergySplit, Kinematics, Reference, Response, Status, Stiffness, evaluate_one,
};
use crate::kinematics::batch::Formula;
use crate::kinematics::sphere_sphere::{FINITE_INPUT, FiniteMeasure, YADE_INPUT, YADE_OUTPUT, Yade, YadeMeasure};
use crate::kinematics::{BATCH, Batch, Columns, MotionMeasure, PointKinematics, PreviousGeometry, Transport};
use crate::law_state;
use crate::math::{self, Vec3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

law_state! {
    /// History of a CPM contact.
    pub struct CpmState {
        /// Normal strain ε_N = (d − L)/L, without the shift by an isotropic prestress (Stránský 2018, (2.5)).
        normal_strain: f64, "1", Even;
        /// Largest equivalent strain so far, κ (Stránský 2018, (2.16)).
        kappa: f64, "1", Even;
        /// Damage ω of the normal stiffness and of the cohesion (Stránský 2018, (2.17)); 1 for a contact that is no bond.
        omega: f64, "1", Even;
        /// Plastic normal strain ε_Np ≤ 0 of compression (Šmilauer 2010, "Compressive plasticity").
        plastic_normal_strain: f64, "1", Even;
        /// Damage strain ε_d, which lags behind ωe when damage is viscous (Šmilauer 2010, "Visco-damage").
        damage_strain: f64, "1", Even;
        /// Shear strain ε_T (Stránský 2018, (2.12) divided by L).
        shear_strain: Vec3, "1", Odd;
        /// Plastic shear strain ε_Tp (Stránský 2018, (2.20)); in Woo mode ε_T − σ_T/Ḡ, which is not read back.
        plastic_shear_strain: Vec3, "1", Odd;
    }
}

/// Which published form of the law is computed. The differences are listed in the [module documentation](self).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum CpmFormulation {
    /// Stránský 2018, corrected; with all options the full model of Šmilauer 2010.
    #[default]
    Thesis,
    /// YADE's public `Law2_ScGeom_CpmPhys_Cpm`, bit for bit.
    YadePublic,
    /// Woo's `Law2_L6Geom_ConcretePhys`.
    Woo,
}

/// Form of the damage function g(κ).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DamageLaw {
    /// Linear softening to zero stress at ε_f (`damLaw = 0`).
    Linear,
    /// Exponential softening, (2.17) (`damLaw = 1`).
    #[default]
    Exponential,
}

/// Bound of the shear stress as a function of the normal stress. Formulas in the [module documentation](self).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum YieldSurface {
    /// Linear, (2.19).
    #[default]
    MohrCoulomb,
    /// Parabolic.
    Parabolic,
    /// Logarithmic everywhere.
    Logarithmic,
    /// Logarithmic in compression, linear in tension; once continuously differentiable.
    LogarithmicLinear,
}

/// Parameters of the law as a user gives them.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CpmParameters {
    /// Published form to compute.
    #[serde(default)]
    pub mode: CpmFormulation,
    /// Normal modulus Ē of the link, Pa (YADE `young`).
    pub normal_modulus: f64,
    /// Ratio Ḡ/Ē of shear to normal modulus, 1 (YADE `poisson`, Woo `ktDivKn`). Not Poisson's ratio.
    pub shear_ratio: f64,
    /// Cohesion c₀ of the undamaged link, Pa (YADE `sigmaT`).
    pub cohesion: f64,
    /// Angle of friction φ, rad.
    pub friction_angle: f64,
    /// Limit elastic strain ε₀, 1 (YADE `epsCrackOnset`).
    pub limit_strain: f64,
    /// Ratio ε_f/ε₀, 1 (YADE `relDuctility`).
    pub relative_ductility: f64,
    /// Form of the damage function.
    #[serde(default)]
    pub damage_law: DamageLaw,
    /// Damage at which a bond in tension breaks, 1; 1 or more: only without any strength left.
    #[serde(default = "one")]
    pub omega_threshold: f64,
    /// Keep ω = 0 in bonds.
    #[serde(default)]
    pub never_damage: bool,
    /// Weight ξ of shear in the equivalent strain, 1.
    #[serde(default)]
    pub shear_contribution: f64,
    /// Strain ε_s < 0 at which plasticity in compression starts, 1 (`epsSoft`); 0 or more: none.
    #[serde(default)]
    pub soft_strain: f64,
    /// Relative stiffness K̃ of the plastic branch in compression, 1 (`relKnSoft`).
    #[serde(default)]
    pub relative_soft_stiffness: f64,
    /// Isotropic prestress σ₀ of the bonds, Pa, negative for confinement (`isoPrestress`).
    #[serde(default)]
    pub isotropic_prestress: f64,
    /// Bound of the shear stress.
    #[serde(default)]
    pub yield_surface: YieldSurface,
    /// Parameter Y₀ of the logarithmic surfaces, 1 (`yieldLogSpeed`).
    #[serde(default = "tenth")]
    pub yield_log_speed: f64,
    /// Characteristic time τ_d of viscous damage, s (`dmgTau`); 0 or less: none.
    #[serde(default)]
    pub damage_time: f64,
    /// Exponent M_d of viscous damage, 1 (`dmgRateExp`).
    #[serde(default = "one")]
    pub damage_rate_exponent: f64,
    /// Characteristic time τ_p of viscous slip, s (`plTau`); 0 or less: none.
    #[serde(default)]
    pub plastic_time: f64,
    /// Exponent M_p of viscous slip, 1 (`plRateExp`).
    #[serde(default = "one")]
    pub plastic_rate_exponent: f64,
}

fn one() -> f64 {
    1.0
}

fn tenth() -> f64 {
    0.1
}

/// Parameters that do not make a law.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CpmError {
    /// A value outside its range.
    #[error("CPM parameter `{name}` is {value}, but must be {requirement}")]
    OutOfRange {
        /// Field of [`CpmParameters`], or argument.
        name: &'static str,
        /// The value given.
        value: f64,
        /// What it must be.
        requirement: &'static str,
    },
    /// An option the chosen mode does not have.
    #[error("CPM option `{name}` has no effect in mode yade-public; use mode thesis or woo, or remove it")]
    NotInYade {
        /// Field of [`CpmParameters`].
        name: &'static str,
    },
    /// Two materials that cannot be averaged.
    #[error("CPM materials with different `{name}` cannot be averaged")]
    Unlike {
        /// Field of [`CpmParameters`].
        name: &'static str,
    },
}

impl CpmParameters {
    /// Parameters of the basic law (Stránský 2018, table 2.1): exponential softening, Mohr–Coulomb, no options.
    pub fn new(
        normal_modulus: f64,
        shear_ratio: f64,
        cohesion: f64,
        friction_angle: f64,
        limit_strain: f64,
        relative_ductility: f64,
    ) -> Self {
        Self {
            mode: CpmFormulation::Thesis,
            normal_modulus,
            shear_ratio,
            cohesion,
            friction_angle,
            limit_strain,
            relative_ductility,
            damage_law: DamageLaw::Exponential,
            omega_threshold: 1.0,
            never_damage: false,
            shear_contribution: 0.0,
            soft_strain: 0.0,
            relative_soft_stiffness: 0.0,
            isotropic_prestress: 0.0,
            yield_surface: YieldSurface::MohrCoulomb,
            yield_log_speed: 0.1,
            damage_time: 0.0,
            damage_rate_exponent: 1.0,
            plastic_time: 0.0,
            plastic_rate_exponent: 1.0,
        }
    }

    /// Parameters of a link between two materials: arithmetic means; `never_damage` if either has it.
    ///
    /// As in both programs Ḡ is the mean ratio times the mean Ē, and ε_f the product of the means of ε₀ and ε_f/ε₀. YADE
    /// takes the tangent of the mean angle, Woo the mean of the tangents; the corrected law does as YADE. Mode and yield
    /// surface must agree; the damage law too, except that YADE takes that of the first.
    pub fn average(&self, other: &Self) -> Result<Self, CpmError> {
        if self.mode != other.mode {
            return Err(CpmError::Unlike { name: "mode" });
        }
        if self.yield_surface != other.yield_surface {
            return Err(CpmError::Unlike { name: "yield_surface" });
        }
        if self.damage_law != other.damage_law && self.mode != CpmFormulation::YadePublic {
            return Err(CpmError::Unlike { name: "damage_law" });
        }
        let mean = |field: fn(&Self) -> f64| 0.5 * (field(self) + field(other));
        let friction_angle = if self.mode == CpmFormulation::Woo {
            libm::atan(0.5 * (libm::tan(self.friction_angle) + libm::tan(other.friction_angle)))
        } else {
            mean(|p| p.friction_angle)
        };
        Ok(Self {
            mode: self.mode,
            normal_modulus: mean(|p| p.normal_modulus),
            shear_ratio: mean(|p| p.shear_ratio),
            cohesion: mean(|p| p.cohesion),
            friction_angle,
            limit_strain: mean(|p| p.limit_strain),
            relative_ductility: mean(|p| p.relative_ductility),
            damage_law: self.damage_law,
            omega_threshold: mean(|p| p.omega_threshold),
            never_damage: self.never_damage || other.never_damage,
            shear_contribution: mean(|p| p.shear_contribution),
            soft_strain: mean(|p| p.soft_strain),
            relative_soft_stiffness: mean(|p| p.relative_soft_stiffness),
            isotropic_prestress: mean(|p| p.isotropic_prestress),
            yield_surface: self.yield_surface,
            yield_log_speed: mean(|p| p.yield_log_speed),
            damage_time: mean(|p| p.damage_time),
            damage_rate_exponent: mean(|p| p.damage_rate_exponent),
            plastic_time: mean(|p| p.plastic_time),
            plastic_rate_exponent: mean(|p| p.plastic_rate_exponent),
        })
    }

    /// Check every value against its range.
    pub fn validate(&self) -> Result<(), CpmError> {
        let check = |name, value: f64, holds: bool, requirement| {
            if holds && value.is_finite() { Ok(()) } else { Err(CpmError::OutOfRange { name, value, requirement }) }
        };
        check("normal_modulus", self.normal_modulus, self.normal_modulus > 0.0, "positive")?;
        check("shear_ratio", self.shear_ratio, self.shear_ratio >= 0.0, "zero or positive")?;
        check("cohesion", self.cohesion, self.cohesion >= 0.0, "zero or positive")?;
        let angle = self.friction_angle;
        let right_angle = std::f64::consts::FRAC_PI_2;
        check("friction_angle", angle, (0.0..right_angle).contains(&angle), "an angle from 0 to below π/2 rad")?;
        check("limit_strain", self.limit_strain, self.limit_strain > 0.0, "positive")?;
        let ductility = self.relative_ductility;
        match self.damage_law {
            DamageLaw::Exponential => check("relative_ductility", ductility, ductility > 0.0, "positive")?,
            DamageLaw::Linear => check("relative_ductility", ductility, ductility > 1.0, "above 1 for linear damage")?,
        }
        check("omega_threshold", self.omega_threshold, self.omega_threshold > 0.0, "positive")?;
        check("shear_contribution", self.shear_contribution, self.shear_contribution >= 0.0, "zero or positive")?;
        check("soft_strain", self.soft_strain, true, "finite")?;
        check("relative_soft_stiffness", self.relative_soft_stiffness, self.relative_soft_stiffness < 1.0, "below 1")?;
        check("isotropic_prestress", self.isotropic_prestress, true, "finite")?;
        if self.prestress_is_beyond_the_plastic_limit() {
            let stiffness = self.relative_soft_stiffness;
            let requirement = "positive when the isotropic prestress exceeds the plastic limit in compression";
            check("relative_soft_stiffness", stiffness, stiffness > 0.0, requirement)?;
        }
        if matches!(self.yield_surface, YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear) {
            check("yield_log_speed", self.yield_log_speed, self.yield_log_speed > 0.0, "positive")?;
            check("cohesion", self.cohesion, self.cohesion > 0.0, "positive with a logarithmic yield surface")?;
        }
        if self.damage_time > 0.0 {
            check("damage_time", self.damage_time, true, "finite")?;
            let exponent = self.damage_rate_exponent;
            check("damage_rate_exponent", exponent, exponent > 0.0, "positive with viscous damage")?;
        }
        if self.plastic_time > 0.0 {
            check("plastic_time", self.plastic_time, true, "finite")?;
            let exponent = self.plastic_rate_exponent;
            check("plastic_rate_exponent", exponent, exponent > 0.0, "positive with viscous slip")?;
            check("cohesion", self.cohesion, self.cohesion > 0.0, "positive with viscous slip")?;
            check("shear_ratio", self.shear_ratio, self.shear_ratio > 0.0, "positive with viscous slip")?;
        }
        if self.mode == CpmFormulation::YadePublic {
            if self.yield_surface != YieldSurface::MohrCoulomb {
                return Err(CpmError::NotInYade { name: "yield_surface" });
            }
            if self.damage_time > 0.0 {
                return Err(CpmError::NotInYade { name: "damage_time" });
            }
            if self.plastic_time > 0.0 {
                return Err(CpmError::NotInYade { name: "plastic_time" });
            }
        }
        Ok(())
    }

    /// Shear modulus Ḡ, Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.normal_modulus * self.shear_ratio
    }

    /// Softening strain ε_f, 1.
    pub fn softening_strain(&self) -> f64 {
        self.limit_strain * self.relative_ductility
    }

    fn prestress_is_beyond_the_plastic_limit(&self) -> bool {
        self.mode == CpmFormulation::Thesis
            && self.soft_strain < 0.0
            && self.isotropic_prestress < self.normal_modulus * self.soft_strain
    }

    /// Shift of the normal strain that the isotropic prestress makes (Šmilauer 2010, "Isotropic confinement").
    fn prestress_strain(&self) -> f64 {
        if self.mode == CpmFormulation::Woo {
            0.0
        } else if self.prestress_is_beyond_the_plastic_limit() {
            self.soft_strain
                + (self.isotropic_prestress - self.normal_modulus * self.soft_strain)
                    / (self.normal_modulus * self.relative_soft_stiffness)
        } else {
            self.isotropic_prestress / self.normal_modulus
        }
    }
}

/// Area of a link, π min(r_A, r_B)² in m² (Stránský 2018, (2.14); YADE). A radius of 0 stands for a wall or facet.
pub fn contact_area(radius_a: f64, radius_b: f64) -> f64 {
    let radius = if radius_a <= 0.0 {
        radius_b
    } else if radius_b <= 0.0 {
        radius_a
    } else {
        radius_a.min(radius_b)
    };
    std::f64::consts::PI * (radius * radius)
}

/// Parameters of one contact as YADE's `CpmPhys` and `Law2_ScGeom_CpmPhys_Cpm` have them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YadeParameters {
    /// `E`, Pa.
    pub normal_modulus: f64,
    /// `G`, Pa.
    pub shear_modulus: f64,
    /// `tanFrictionAngle`, 1.
    pub tan_friction: f64,
    /// `undamagedCohesion`, Pa.
    pub cohesion: f64,
    /// `epsCrackOnset`, 1.
    pub limit_strain: f64,
    /// `epsFracture`, 1.
    pub softening_strain: f64,
    /// `equivStrainShearContrib`, 1.
    pub shear_contribution: f64,
    /// `isoPrestress`, Pa.
    pub isotropic_prestress: f64,
    /// `damLaw`.
    pub damage_law: DamageLaw,
    /// `neverDamage`.
    pub never_damage: bool,
    /// `omegaThreshold`, 1.
    pub omega_threshold: f64,
    /// `epsSoft`, 1.
    pub soft_strain: f64,
    /// `relKnSoft`, 1.
    pub relative_soft_stiffness: f64,
}

/// What the law finds in a step.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// History after the step, also of a contact that is lost.
    pub state: CpmState,
    /// Normal stress on the contact, with overstress and without prestress, Pa (YADE's `sigmaN`).
    pub normal_stress: f64,
    /// Shear stress, Pa (YADE's `sigmaT`).
    pub shear_stress: Vec3,
    /// Whether the contact ends: a bond breaks, another opens.
    pub lost: bool,
    /// Energies of the contact, were it not lost.
    pub energy: EnergySplit,
}

/// The cohesive particle model: one row of the parameter table, with what follows from the parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cpm {
    parameters: CpmParameters,
    shear_modulus: f64,
    softening_strain: f64,
    tan_friction: f64,
    prestress_strain: f64,
    inverse_softening_strain: f64,
    inverse_shear_modulus: f64,
    /// `1/(1 − ε₀/ε_f)`, for linear damage.
    linear_factor: f64,
    /// Mode thesis without its options: what most runs use.
    plain: bool,
}

impl Cpm {
    /// The law with these parameters.
    pub fn new(parameters: &CpmParameters) -> Result<Self, CpmError> {
        parameters.validate()?;
        let softening_strain = parameters.softening_strain();
        let shear_modulus = parameters.shear_modulus();
        let tan_friction = if parameters.mode == CpmFormulation::YadePublic {
            parameters.friction_angle.tan()
        } else {
            libm::tan(parameters.friction_angle)
        };
        Ok(Self {
            parameters: *parameters,
            shear_modulus,
            softening_strain,
            tan_friction,
            prestress_strain: parameters.prestress_strain(),
            inverse_softening_strain: 1.0 / softening_strain,
            inverse_shear_modulus: if shear_modulus > 0.0 { 1.0 / shear_modulus } else { 0.0 },
            linear_factor: 1.0 / (1.0 - parameters.limit_strain / softening_strain),
            plain: parameters.mode == CpmFormulation::Thesis
                && parameters.yield_surface == YieldSurface::MohrCoulomb
                && parameters.shear_contribution == 0.0
                && parameters.soft_strain >= 0.0
                && parameters.isotropic_prestress == 0.0
                && parameters.damage_time == 0.0
                && parameters.plastic_time == 0.0,
        })
    }

    /// The row of one contact of YADE, for [`Self::answer_as_yade`] alone. Nothing is checked: YADE has its own values.
    #[inline(always)]
    pub fn of_yade(contact: &YadeParameters) -> Self {
        let c = contact;
        let (young, softening_strain) = (c.normal_modulus, c.softening_strain);
        Self {
            parameters: CpmParameters {
                mode: CpmFormulation::YadePublic,
                normal_modulus: young,
                shear_ratio: c.shear_modulus / young,
                cohesion: c.cohesion,
                friction_angle: f64::NAN,
                limit_strain: c.limit_strain,
                relative_ductility: softening_strain / c.limit_strain,
                damage_law: c.damage_law,
                omega_threshold: c.omega_threshold,
                never_damage: c.never_damage,
                shear_contribution: c.shear_contribution,
                soft_strain: c.soft_strain,
                relative_soft_stiffness: c.relative_soft_stiffness,
                isotropic_prestress: c.isotropic_prestress,
                yield_surface: YieldSurface::MohrCoulomb,
                yield_log_speed: 0.1,
                damage_time: 0.0,
                damage_rate_exponent: 1.0,
                plastic_time: 0.0,
                plastic_rate_exponent: 1.0,
            },
            shear_modulus: c.shear_modulus,
            softening_strain,
            tan_friction: c.tan_friction,
            prestress_strain: c.isotropic_prestress / young,
            inverse_softening_strain: 1.0 / softening_strain,
            inverse_shear_modulus: if c.shear_modulus > 0.0 { 1.0 / c.shear_modulus } else { 0.0 },
            linear_factor: 1.0 / (1.0 - c.limit_strain / softening_strain),
            plain: false,
        }
    }

    /// The parameters.
    pub fn parameters(&self) -> &CpmParameters {
        &self.parameters
    }

    /// Tangent of the angle of friction.
    pub fn tan_friction(&self) -> f64 {
        self.tan_friction
    }

    /// Shift σ₀/Ē that the isotropic prestress adds to the strain of a bond; YADE's `epsN` contains it.
    pub fn prestress_strain(&self) -> f64 {
        self.prestress_strain
    }

    /// Damage ω = g(κ) of a bond, (2.17); 0 up to ε₀.
    #[inline]
    pub fn damage_function(&self, kappa: f64) -> f64 {
        let p = &self.parameters;
        // the form `!(κ > ε₀)` would call a NaN undamaged; a NaN must stay visible
        if kappa <= p.limit_strain || p.never_damage {
            return 0.0;
        }
        let ratio = p.limit_strain / kappa;
        match p.damage_law {
            DamageLaw::Linear => ((1.0 - ratio) * self.linear_factor).min(1.0),
            DamageLaw::Exponential => 1.0 - ratio * math::exp((p.limit_strain - kappa) * self.inverse_softening_strain),
        }
    }

    /// The κ that gives the damage `omega`: the inverse of [`Self::damage_function`], ε₀ for 0.
    ///
    /// Linear: ε₀/(1 − ω(1 − ε₀/ε_f)). Exponential: with u = κ/ε_f and a = ε₀/ε_f the root of
    /// u + ln u = a + ln a − ln(1−ω), by Newton's method to the last bit that helps; infinite for ω = 1.
    pub fn kappa_of_damage(&self, omega: f64) -> Result<f64, CpmError> {
        let p = &self.parameters;
        if !(0.0..=1.0).contains(&omega) {
            return Err(CpmError::OutOfRange { name: "omega", value: omega, requirement: "from 0 to 1" });
        }
        if omega == 0.0 {
            return Ok(p.limit_strain);
        }
        let a = p.limit_strain * self.inverse_softening_strain;
        match p.damage_law {
            DamageLaw::Linear => Ok(p.limit_strain / (1.0 - omega * (1.0 - a))),
            DamageLaw::Exponential if omega == 1.0 => Ok(f64::INFINITY),
            DamageLaw::Exponential => {
                // with κ = ε₀(1+t): a t + ln(1+t) = −ln(1−ω); concave and increasing, so from t below the root
                // Newton's method rises towards it
                let target = -libm::log1p(-omega);
                let mut t = (target / (1.0 + a)).min(omega / (1.0 - omega));
                for _ in 0..100 {
                    let residual = target - a * t - libm::log1p(t);
                    let change = residual / (a + 1.0 / (1.0 + t));
                    t += change;
                    if change.abs() <= 1e-16 * t {
                        break;
                    }
                }
                Ok(p.limit_strain * (1.0 + t))
            }
        }
    }

    /// Strength left at κ relative to the intact strength: r = (1 − g(κ)) κ/ε₀, and 1 up to ε₀.
    ///
    /// Exponential: exp(−(κ−ε₀)/ε_f). Linear: (ε_f−κ)/(ε_f−ε₀), not below 0.
    pub fn relative_residual_strength(&self, kappa: f64) -> f64 {
        1.0 - self.strength_damage(kappa)
    }

    /// Damage of the strength at κ, ω̂ = 1 − (1−ω)κ/ε₀ (Stránský 2018, (6.6)), clamped to 0 up to ε₀.
    pub fn strength_damage(&self, kappa: f64) -> f64 {
        let p = &self.parameters;
        if kappa <= p.limit_strain || p.never_damage {
            return 0.0;
        }
        match p.damage_law {
            DamageLaw::Linear => ((kappa - p.limit_strain) / (self.softening_strain - p.limit_strain)).min(1.0),
            DamageLaw::Exponential => -libm::expm1((p.limit_strain - kappa) * self.inverse_softening_strain),
        }
    }

    /// The κ that gives the damage of the strength `omega_hat`: the inverse of [`Self::strength_damage`].
    pub fn kappa_of_strength_damage(&self, omega_hat: f64) -> Result<f64, CpmError> {
        let p = &self.parameters;
        if !(0.0..=1.0).contains(&omega_hat) {
            return Err(CpmError::OutOfRange { name: "omega_hat", value: omega_hat, requirement: "from 0 to 1" });
        }
        Ok(match p.damage_law {
            DamageLaw::Linear => p.limit_strain + omega_hat * (self.softening_strain - p.limit_strain),
            DamageLaw::Exponential => p.limit_strain - self.softening_strain * libm::log1p(-omega_hat),
        })
    }

    /// History of a bond that is unstrained and has the damage `omega`.
    pub fn damaged_state(&self, omega: f64) -> Result<CpmState, CpmError> {
        Ok(CpmState { kappa: self.kappa_of_damage(omega)?, omega, ..CpmState::default() })
    }

    /// Largest shear stress y(σ_N, ω) without flow, Pa (formulas in the [module documentation](self)).
    #[inline(always)]
    pub fn yield_stress(&self, normal_stress: f64, omega: f64) -> f64 {
        let p = &self.parameters;
        let (cohesion, tangent) = (p.cohesion, self.tan_friction);
        let linear = cohesion * (1.0 - omega) - normal_stress * tangent;
        if self.plain {
            return linear.max(0.0);
        }
        let radius = match p.yield_surface {
            YieldSurface::MohrCoulomb => linear,
            YieldSurface::Parabolic => {
                (cohesion * (cohesion - 2.0 * tangent * normal_stress)).max(0.0).sqrt() - cohesion * omega
            }
            YieldSurface::LogarithmicLinear if normal_stress > 0.0 => linear,
            YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear => {
                let relative = normal_stress / (cohesion * p.yield_log_speed);
                if relative >= 1.0 {
                    0.0
                } else {
                    cohesion * ((1.0 - omega) + tangent * p.yield_log_speed * libm::log1p(-relative))
                }
            }
        };
        radius.max(0.0)
    }

    /// Modes thesis and woo; `PLAIN` as the member of that name, the same bits with fewer questions.
    #[inline(always)]
    fn respond_exact<const PLAIN: bool>(&self, k: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        let answer = self.answer_exact::<PLAIN>(k, old, dt, |kappa| self.damage_function(kappa));
        let Answer { state, normal_stress, shear_stress, lost, energy } = answer;
        let ContactGeometry { reference_length, area, .. } = k.geometry;
        if lost {
            let inverse_length = 1.0 / reference_length;
            let strain_step = state.normal_strain - strain_before(k, old, inverse_length);
            let (volume, shear_step) = (area * reference_length, k.shear_increment * inverse_length);
            return release(k, volume, normal_stress, &shear_stress, strain_step, &shear_step, &energy);
        }
        let force = (k.normal * normal_stress + shear_stress) * area;
        Response { force, moment: Vec3::zeros(), state, status: Status::Lives, energy }
    }

    /// What [`Self::respond_exact`] finds where the damage of a bond whose κ grows is `damage` of it.
    #[inline(always)]
    fn answer_exact<const PLAIN: bool>(
        &self,
        k: &PointKinematics,
        old: &CpmState,
        dt: f64,
        damage_of: impl Fn(f64) -> f64,
    ) -> Answer {
        let p = &self.parameters;
        let woo = !PLAIN && p.mode == CpmFormulation::Woo;
        let length = k.geometry.reference_length;
        let inverse_length = 1.0 / length;
        let volume = k.geometry.area * length;
        // a contact that is no bond was never prestressed (Woo subtracts the prestress from every contact)
        let (shift, prestress) = if PLAIN {
            (0.0, 0.0)
        } else if k.bonded {
            (self.prestress_strain, p.isotropic_prestress)
        } else {
            (0.0, if woo { p.isotropic_prestress } else { 0.0 })
        };

        let strain = k.elongation * inverse_length;
        let shear_step = k.shear_increment * inverse_length;
        let carried_shear = k.transport.apply(&old.shear_strain);
        // most links never slip; the zero vector needs no transport
        let carried_plastic = if old.plastic_shear_strain == Vec3::zeros() {
            Vec3::zeros()
        } else {
            k.transport.apply(&old.plastic_shear_strain)
        };
        let shear_strain = carried_shear + shear_step;

        // normal direction
        let adjusted = strain + shift;
        let mut plastic = old.plastic_normal_strain;
        let mut elastic = adjusted - plastic;
        let strain_old = strain_before(k, old, inverse_length);
        let elastic_old = strain_old + shift - plastic;
        let mut kappa = old.kappa;
        let mut omega = old.omega;
        if k.bonded {
            let mut equivalent = elastic;
            if !PLAIN && p.shear_contribution > 0.0 && !woo {
                let tension = elastic.max(0.0);
                let squared = p.shear_contribution * p.shear_contribution * shear_strain.norm_squared();
                equivalent = (tension * tension + squared).sqrt();
            }
            if equivalent > kappa {
                kappa = equivalent;
                omega = damage_of(kappa);
            }
        } else {
            omega = 1.0;
        }
        let damage_old = if elastic_old > 0.0 { omega_before(k, old) } else { 0.0 };
        let damage = if elastic > 0.0 { omega } else { 0.0 };
        let stress_old = (1.0 - damage_old) * p.normal_modulus * elastic_old;
        let mut stress = (1.0 - damage) * p.normal_modulus * elastic;
        let mut energy = EnergySplit::default();
        if !PLAIN && p.soft_strain < 0.0 && (if woo { elastic } else { adjusted }) < p.soft_strain {
            let line = p.soft_strain + p.relative_soft_stiffness * (adjusted - p.soft_strain);
            let bound = p.normal_modulus * line.min(0.0);
            if bound > stress {
                stress = bound;
                elastic = line.min(0.0);
                plastic = adjusted - elastic;
                energy.add_friction(volume * 0.5 * (stress_old + stress) * (plastic - old.plastic_normal_strain));
            }
        }
        if damage != damage_old {
            let product = volume * 0.5 * p.normal_modulus * elastic_old * elastic * (damage - damage_old);
            if elastic_old * elastic < 0.0 {
                energy.integration += product;
            } else {
                energy.damage = product;
            }
        }

        // shear
        let bound = self.yield_stress(stress, omega);
        let carried_elastic = carried_shear - carried_plastic;
        let trial_strain = if woo { shear_strain } else { carried_elastic + shear_step };
        let trial = trial_strain * self.shear_modulus;
        let trial_squared = trial.norm_squared();
        let mut shear_stress = trial;
        let mut plastic_shear = if woo { Vec3::zeros() } else { carried_plastic };
        let flows = trial_squared > bound * bound;
        if flows {
            let trial_norm = trial_squared.sqrt();
            let mut scale = bound / trial_norm;
            if !PLAIN && p.plastic_time > 0.0 {
                scale = self.viscous_slip_scale(trial_norm, bound, dt);
                energy.viscous = volume
                    * (trial_norm * scale - bound)
                    * (plastic_shear + trial_strain * (1.0 - scale) - carried_plastic).norm();
            }
            shear_stress = trial * scale;
            plastic_shear += trial_strain * (1.0 - scale);
        }
        if flows || woo {
            let mean_stress = (carried_elastic * self.shear_modulus + shear_stress) * 0.5;
            let work = volume * mean_stress.dot(&(plastic_shear - carried_plastic)) - energy.viscous;
            if woo {
                // slip that is recovered gives work back, however small the step: no error of the rule
                energy.friction += work;
            } else {
                energy.add_friction(work);
            }
        }

        // viscous overstress
        let mut damage_strain = 0.0;
        let mut applied = stress - prestress;
        if !PLAIN && p.damage_time > 0.0 && k.bonded {
            let (driving, driving_old) = if woo {
                (omega * adjusted, old.omega * (strain_old + shift))
            } else {
                (damage * elastic, damage_old * elastic_old)
            };
            damage_strain = self.viscous_damage_strain(driving, old.damage_strain, omega, dt);
            let overstress = p.normal_modulus * (driving - damage_strain);
            let overstress_old = p.normal_modulus * (driving_old - old.damage_strain);
            applied += overstress;
            energy.viscous += volume * 0.5 * (overstress_old + overstress) * (strain - strain_old);
        }

        energy.stored_normal =
            volume * (0.5 * (stress * elastic - p.normal_modulus * shift * shift) - prestress * strain);
        energy.stored_shear = 0.5 * volume * self.inverse_shear_modulus * shear_stress.norm_squared();
        if matches!(k.transport, Transport::FirstOrder { .. }) {
            let elastic_shear_old = old.shear_strain - old.plastic_shear_strain;
            energy.integration +=
                0.5 * volume * self.shear_modulus * (elastic_shear_old.norm_squared() - carried_elastic.norm_squared());
        }
        let state = CpmState {
            normal_strain: strain,
            kappa,
            omega,
            plastic_normal_strain: plastic,
            damage_strain,
            shear_strain,
            plastic_shear_strain: plastic_shear,
        };
        // linear damage, or a threshold of 1: a bond without any strength is broken
        let lost = adjusted > 0.0 && (!k.bonded || omega > p.omega_threshold || omega >= 1.0);
        Answer { state, normal_stress: applied, shear_stress, lost, energy }
    }

    /// All that is not plain, apart from the loops: it would be compiled with each of them.
    #[inline(never)]
    fn respond_with_options(&self, k: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        if self.parameters.mode == CpmFormulation::YadePublic {
            self.respond_yade(k, old)
        } else {
            self.respond_exact::<false>(k, old, dt)
        }
    }

    /// Mode yade-public.
    #[inline(always)]
    fn respond_yade(&self, k: &PointKinematics, old: &CpmState) -> Response<CpmState> {
        let answer = self.answer_as_yade::<true>(k, old);
        let length = k.geometry.reference_length;
        let area = k.geometry.area;
        if answer.lost {
            let strain_step = answer.state.normal_strain - strain_before(k, old, 1.0 / length);
            let shear_step = k.shear_increment / length;
            let Answer { normal_stress, shear_stress, energy, .. } = &answer;
            return release(k, area * length, *normal_stress, shear_stress, strain_step, &shear_step, energy);
        }
        Response {
            force: k.normal * (answer.normal_stress * area) + answer.shear_stress * area,
            moment: Vec3::zeros(),
            state: answer.state,
            status: Status::Lives,
            energy: answer.energy,
        }
    }

    /// The operations of YADE's `Law2_ScGeom_CpmPhys_Cpm::go` in their order, whatever the mode of `self`.
    ///
    /// `CONSISTENT`: ω is known to be g(κ) where κ did not grow (our own histories); without, it is computed at every step,
    /// as YADE does, whose users may set one of them (`setDamage`). A compiler leaves the energies out where nobody reads
    /// them.
    #[inline(always)]
    pub fn answer_as_yade<const CONSISTENT: bool>(&self, k: &PointKinematics, old: &CpmState) -> Answer {
        self.answer_with_damage(k, old, |kappa| {
            if CONSISTENT && kappa == old.kappa { old.omega } else { self.damage_function_yade(kappa) }
        })
    }

    /// [`Self::answer_as_yade`] where the damage of a bond is `damage` of its κ.
    #[inline(always)]
    fn answer_with_damage(&self, k: &PointKinematics, old: &CpmState, damage: impl Fn(f64) -> f64) -> Answer {
        use crate::math::yade_order::{dot, norm};
        let p = &self.parameters;
        let (young, shear_modulus) = (p.normal_modulus, self.shear_modulus);
        let length = k.geometry.reference_length;
        let area = k.geometry.area;
        let strain = k.elongation / length;
        let shear_step = k.shear_increment / length;
        let carried_shear = k.transport.apply(&old.shear_strain);
        let shear_strain = carried_shear + shear_step;

        let adjusted = strain + self.prestress_strain;
        let mut plastic = old.plastic_normal_strain;
        let elastic = adjusted - plastic;
        let tension = if elastic < 0.0 { 0.0 } else { elastic };
        let squared_weight = p.shear_contribution * p.shear_contribution;
        let equivalent = (tension * tension + squared_weight * dot(&shear_strain, &shear_strain)).sqrt();
        let kappa = if equivalent < old.kappa { old.kappa } else { equivalent };
        let omega = if k.bonded { damage(kappa) } else { 1.0 };
        let damage = if elastic > 0.0 { omega } else { 0.0 };
        let mut stress = (1.0 - damage) * young * elastic;
        if p.soft_strain < 0.0 && elastic < p.soft_strain {
            let soft = young * (p.soft_strain + p.relative_soft_stiffness * (elastic - p.soft_strain));
            if soft > stress {
                plastic += (stress - soft) / young;
                stress = soft;
            }
        }
        let trial = (shear_strain - old.plastic_shear_strain) * shear_modulus;
        let mut shear_stress = trial;
        let mut plastic_shear = old.plastic_shear_strain;
        let bound = self.yield_stress_yade(stress, omega);
        if dot(&trial, &trial) > bound * bound {
            let scale = bound / norm(&trial);
            shear_stress *= scale;
            plastic_shear += shear_stress * (1.0 - scale) / shear_modulus;
        }
        let applied = stress - p.isotropic_prestress;

        // energies: not part of YADE's law, so in any order
        let volume = area * length;
        let strain_old = strain_before(k, old, 1.0 / length);
        let elastic_old = strain_old + self.prestress_strain - old.plastic_normal_strain;
        let omega_old = omega_before(k, old);
        let damage_old = if elastic_old > 0.0 { omega_old } else { 0.0 };
        let stress_old = (1.0 - damage_old) * young * elastic_old;
        let elastic_new = adjusted - plastic;
        let mut energy = EnergySplit {
            stored_normal: volume
                * (0.5 * (stress * elastic_new - young * self.prestress_strain * self.prestress_strain)
                    - p.isotropic_prestress * strain),
            stored_shear: 0.5 * volume * self.inverse_shear_modulus * dot(&shear_stress, &shear_stress),
            ..EnergySplit::default()
        };
        energy.add_friction(volume * 0.5 * (stress_old + stress) * (plastic - old.plastic_normal_strain));
        let product = volume * 0.5 * young * elastic_old * elastic_new * (damage - damage_old);
        if elastic_old * elastic_new < 0.0 {
            energy.integration += product;
        } else {
            energy.damage = product;
        }
        // the stress of the last step is the trial stress of its history, cut off at the bound of that time
        let stress_of_history = (old.shear_strain - old.plastic_shear_strain) * shear_modulus;
        let bound_old = self.yield_stress_yade(stress_old, omega_old);
        let norm_old = norm(&stress_of_history);
        let shear_stress_old =
            if norm_old > bound_old { stress_of_history * (bound_old / norm_old) } else { stress_of_history };
        let carried_stress = k.transport.apply(&shear_stress_old);
        let slip = shear_step - (shear_stress - carried_stress) * self.inverse_shear_modulus;
        energy.add_friction(volume * 0.5 * dot(&(carried_stress + shear_stress), &slip));
        energy.integration += 0.5
            * volume
            * self.inverse_shear_modulus
            * (dot(&shear_stress_old, &shear_stress_old) - dot(&carried_stress, &carried_stress));

        let state = CpmState {
            normal_strain: strain,
            kappa,
            omega,
            plastic_normal_strain: plastic,
            damage_strain: 0.0,
            shear_strain,
            plastic_shear_strain: plastic_shear,
        };
        let lost = adjusted > 0.0 && (!k.bonded || omega > p.omega_threshold);
        Answer { state, normal_stress: applied, shear_stress, lost, energy }
    }

    #[inline(always)]
    fn damage_function_yade(&self, kappa: f64) -> f64 {
        let p = &self.parameters;
        if kappa < p.limit_strain || p.never_damage {
            return 0.0;
        }
        match p.damage_law {
            DamageLaw::Linear => (1.0 - p.limit_strain / kappa) / (1.0 - p.limit_strain / self.softening_strain),
            // the system's `exp`, as YADE: this mode reproduces bits of a program that uses the C library
            DamageLaw::Exponential => {
                1.0 - (p.limit_strain / kappa) * (-(kappa - p.limit_strain) / self.softening_strain).exp()
            }
        }
    }

    #[inline(always)]
    fn yield_stress_yade(&self, normal_stress: f64, omega: f64) -> f64 {
        let radius = self.parameters.cohesion * (1.0 - omega) - normal_stress * self.tan_friction;
        if radius > 0.0 { radius } else { 0.0 }
    }

    /// Damage strain after a step of `dt` (s) towards `driving` = ωe.
    #[inline(never)]
    fn viscous_damage_strain(&self, driving: f64, old: f64, omega: f64, dt: f64) -> f64 {
        let p = &self.parameters;
        let distance = driving - old;
        if distance <= 0.0 {
            return driving;
        }
        let n = p.damage_rate_exponent;
        let ln_c = math::ln(p.limit_strain * (1.0 - omega))
            + n * math::ln(p.damage_time / dt)
            + (n - 1.0) * math::ln(distance);
        old + distance * math::exp(solve_beta(ln_c, n))
    }

    /// Factor s of the trial stress after a step of `dt` (s) of viscous slip.
    #[inline(never)]
    fn viscous_slip_scale(&self, trial: f64, bound: f64, dt: f64) -> f64 {
        let p = &self.parameters;
        let n = p.plastic_rate_exponent;
        let ln_c = math::ln(p.cohesion)
            + n * math::ln(p.plastic_time / (self.shear_modulus * dt))
            + (n - 1.0) * math::ln(trial - bound);
        1.0 - math::exp(solve_beta(ln_c, n)) * (1.0 - bound / trial)
    }
}

/// Normal strain at the start of the step. A contact that is no bond forgets its history when it opens, so that it
/// is told where it came from by the length.
#[inline(always)]
fn strain_before(k: &PointKinematics, old: &CpmState, inverse_length: f64) -> f64 {
    if k.bonded { old.normal_strain } else { (k.length_old - k.geometry.reference_length) * inverse_length }
}

/// Damage at the start of the step: 1 for a contact that is no bond, also before its first evaluation.
#[inline(always)]
fn omega_before(k: &PointKinematics, old: &CpmState) -> f64 {
    if k.bonded { old.omega } else { 1.0 }
}

/// Answer of a contact that is lost in this step: no force, no history, its energy let go. That of a bond stays named
/// by mode in the `stored_*` members, see [`Status::Broke`].
// Inlined, so that the answer of the common path stays in registers.
#[inline(always)]
fn release(
    k: &PointKinematics,
    volume: f64,
    normal_stress: f64,
    shear_stress: &Vec3,
    strain_step: f64,
    shear_step: &Vec3,
    energy: &EnergySplit,
) -> Response<CpmState> {
    let mut energy = *energy;
    let stored = energy.stored_normal + energy.stored_shear;
    if k.bonded {
        energy.damage += stored;
    } else {
        energy.friction += stored;
        energy.stored_normal = 0.0;
        energy.stored_shear = 0.0;
    }
    // the work of this step was split for the stress of its end, which is not applied
    energy.integration -= 0.5 * volume * (normal_stress * strain_step + shear_stress.dot(shear_step));
    Response {
        force: Vec3::zeros(),
        moment: Vec3::zeros(),
        state: CpmState::default(),
        status: if k.bonded { Status::Broke } else { Status::Opened },
        energy,
    }
}

/// The root β ≤ 0 of ln(eᵝ + c e^{nβ}) = 0 for `ln_c` = ln c and n > 0 (Šmilauer 2010, "Visco-damage").
///
/// The left side is convex and increasing in β and not negative at min(0, −ln c/n), so Newton's method from there falls
/// monotonically to the root; it stops when rounding stops it. Logarithms keep c of any size finite.
pub fn solve_beta(ln_c: f64, n: f64) -> f64 {
    let mut beta = (-ln_c / n).min(0.0);
    for _ in 0..60 {
        let (residual, slope) = beta_residual(beta, ln_c, n);
        let next = beta - residual / slope;
        // monotone from above: the first step that does not go down is rounding
        if residual <= 0.0 || next >= beta {
            break;
        }
        beta = next;
    }
    beta
}

/// ln(eᵝ + c e^{nβ}) and its derivative, without overflow.
fn beta_residual(beta: f64, ln_c: f64, n: f64) -> (f64, f64) {
    let other = n * beta + ln_c;
    let (large, small, slope_large, slope_small) =
        if beta > other { (beta, other, 1.0, n) } else { (other, beta, n, 1.0) };
    let weight = math::exp(small - large);
    (large + libm::log1p(weight), (slope_large + slope_small * weight) / (1.0 + weight))
}

/// Measures and answers of many contacts with the same parameters in mode yade-public; see [`Cpm::respond_batch`].
struct AsYade<'a> {
    law: &'a Cpm,
    kinematics: Yade,
}

/// Input: of the measure, then area (m²), length before the step (m), 1 for a bond, history without damage strain.
const AS_YADE_INPUT: usize = YADE_INPUT + 13;
/// Output: of the measure, then the answer.
const AS_YADE_OUTPUT: usize = YADE_OUTPUT + ANSWER;
/// Numbers of [`answer_row`].
const ANSWER: usize = 18;

/// The same of the plain form of the law with the finite measure.
struct Plain<'a> {
    law: &'a Cpm,
}

/// Input: of the measure, then reference length (m), area (m²), 1 for a bond, history without damage strain.
const PLAIN_INPUT: usize = FINITE_INPUT + 13;
/// Output: length (m), gap (m), normal, then the answer.
const PLAIN_OUTPUT: usize = 5 + ANSWER;

/// Components of a history without damage strain.
#[inline(always)]
fn columns_of(state: &CpmState) -> [f64; 10] {
    let CpmState {
        normal_strain, kappa, omega, plastic_normal_strain, shear_strain: s, plastic_shear_strain: p, ..
    } = *state;
    [normal_strain, kappa, omega, plastic_normal_strain, s.x, s.y, s.z, p.x, p.y, p.z]
}

/// The history of [`columns_of`].
#[inline(always)]
fn state_of([normal_strain, kappa, omega, plastic_normal_strain, sx, sy, sz, px, py, pz]: [f64; 10]) -> CpmState {
    CpmState {
        normal_strain,
        kappa,
        omega,
        plastic_normal_strain,
        damage_strain: 0.0,
        shear_strain: Vec3::new(sx, sy, sz),
        plastic_shear_strain: Vec3::new(px, py, pz),
    }
}

impl Formula<AS_YADE_INPUT, AS_YADE_OUTPUT> for AsYade<'_> {
    #[inline(always)]
    fn apply(&self, input: [f64; AS_YADE_INPUT]) -> [f64; AS_YADE_OUTPUT] {
        let law = self.law;
        let (motion, rest) = input.split_at(YADE_INPUT);
        let (motion, rest): ([f64; YADE_INPUT], [f64; 13]) = (array(motion), array(rest));
        let [area, length_old, bonded, history @ ..] = rest;
        let normal_old = Vec3::new(motion[18], motion[19], motion[20]);
        let [radius_a, radius_b, reference_length] = [motion[21], motion[22], motion[23]];
        // Masses are of no matter to this law.
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a: 0.0, mass_b: 0.0 };
        let measure = self.kinematics.measure(motion);
        let k = measure.point(&geometry, &PreviousGeometry { normal: normal_old, length: length_old }, bonded > 0.0);
        let old = state_of(history);
        let answer = law.answer_with_damage(&k, &old, |kappa| {
            if kappa == old.kappa {
                old.omega
            } else if kappa < law.parameters.limit_strain || law.parameters.never_damage {
                0.0
            } else {
                f64::NAN
            }
        });
        let force = k.normal * (answer.normal_stress * area) + answer.shear_stress * area;
        let mut output = [0.0; AS_YADE_OUTPUT];
        output[..YADE_OUTPUT].copy_from_slice(&measure.row());
        output[YADE_OUTPUT..].copy_from_slice(&answer_row(&force, &answer));
        output
    }
}

impl Formula<PLAIN_INPUT, PLAIN_OUTPUT> for Plain<'_> {
    #[inline(always)]
    fn apply(&self, input: [f64; PLAIN_INPUT]) -> [f64; PLAIN_OUTPUT] {
        let law = self.law;
        let (motion, rest) = input.split_at(FINITE_INPUT);
        let (motion, rest): ([f64; FINITE_INPUT], [f64; 13]) = (array(motion), array(rest));
        let [reference_length, area, bonded, history @ ..] = rest;
        let [.., radius_a, radius_b, nx, ny, nz, length] = motion;
        // Masses are of no matter to this law, the step is not to the plain one.
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a: 0.0, mass_b: 0.0 };
        let frame = PreviousGeometry { normal: Vec3::new(nx, ny, nz), length };
        let k = FiniteMeasure::of(motion).point(&geometry, &frame, bonded > 0.0);
        let answer = law.answer_exact::<true>(&k, &state_of(history), 0.0, |kappa| {
            if kappa <= law.parameters.limit_strain || law.parameters.never_damage { 0.0 } else { f64::NAN }
        });
        let force = (k.normal * answer.normal_stress + answer.shear_stress) * area;
        let mut output = [0.0; PLAIN_OUTPUT];
        output[..5].copy_from_slice(&[k.length, k.gap, k.normal.x, k.normal.y, k.normal.z]);
        output[5..].copy_from_slice(&answer_row(&force, &answer));
        output
    }
}

/// Force (N), energies (J), and history, with a damage that is not a number where the contact is lost.
#[inline(always)]
fn answer_row(force: &Vec3, answer: &Answer) -> [f64; ANSWER] {
    let EnergySplit { stored_normal, stored_shear, friction, damage, integration, .. } = answer.energy;
    let mut state = answer.state;
    if answer.lost {
        state.omega = f64::NAN;
    }
    let mut row = [0.0; ANSWER];
    row[..8].copy_from_slice(&[force.x, force.y, force.z, stored_normal, stored_shear, friction, damage, integration]);
    row[8..].copy_from_slice(&columns_of(&state));
    row
}

/// Answer of contact `i` whose row of [`answer_row`] starts at component `first`; none if the law must be asked.
#[inline(always)]
fn answer_in(columns: &Columns, first: usize, i: usize) -> Option<Response<CpmState>> {
    let state = state_of(columns.get_from(first + 8, i));
    if state.omega.is_nan() {
        return None;
    }
    let [fx, fy, fz, stored_normal, stored_shear, friction, damage, integration] = columns.get_from(first, i);
    let energy = EnergySplit { stored_normal, stored_shear, damage, friction, integration, ..EnergySplit::default() };
    let (force, moment) = (Vec3::new(fx, fy, fz), Vec3::zeros());
    Some(Response { force, moment, state, status: Status::Lives, energy })
}

/// A part of a row.
#[inline(always)]
fn array<const N: usize>(part: &[f64]) -> [f64; N] {
    std::array::from_fn(|i| part[i])
}

impl ContactLaw for Cpm {
    type State = CpmState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "cpm";

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        if self.plain {
            self.respond_exact::<true>(kinematics, old, dt)
        } else {
            self.respond_with_options(kinematics, old, dt)
        }
    }

    /// Contacts of the same parameters are answered in columns, but for those whose damage grows or that are lost, in mode
    /// yade-public with YADE's measure, and in the plain form of mode thesis with the finite one.
    #[inline(always)]
    fn respond_batch<B: Batch<Self>>(mode: MotionMeasure, count: usize, dt: f64, batch: &mut B, columns: &mut Columns) {
        let count = count.min(BATCH);
        if count == 0 {
            return;
        }
        let law = *batch.law(0).0;
        let alike = !B::SAMPLE && (1..count).all(|i| batch.row(i) == batch.row(0));
        if alike && mode == MotionMeasure::Finite && law.plain {
            for i in 0..count {
                FiniteMeasure::set(columns, i, batch);
                let (ContactGeometry { reference_length, area, .. }, _, bonded) = batch.constants(i);
                columns.set_from(FINITE_INPUT, i, [reference_length, area, f64::from(u8::from(bonded))]);
                columns.set_from(FINITE_INPUT + 3, i, columns_of(batch.law(i).1));
            }
            columns.apply(&Plain { law: &law });
            for i in 0..count {
                let Some(response) = answer_in(columns, 5, i) else {
                    evaluate_one(mode, i, dt, batch);
                    continue;
                };
                let [length, gap, nx, ny, nz] = columns.get(i);
                let (geometry, frame, bonded) = batch.constants(i);
                let point = FiniteMeasure::place(length, gap, Vec3::new(nx, ny, nz)).point(&geometry, &frame, bonded);
                batch.commit(i, &point, &response);
            }
            return;
        }
        let as_yade = !B::PERIODIC
            && alike
            && matches!(mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting)
            && law.parameters.mode == CpmFormulation::YadePublic;
        if !as_yade {
            PointKinematics::measure_batch::<Self, B>(mode, count, dt, batch, columns);
            return;
        }
        for i in 0..count {
            let ([a, b], _) = batch.motions(i);
            let (geometry, frame, bonded) = batch.constants(i);
            Yade::set(columns, i, &a, &b, &geometry, &frame);
            columns.set_from(YADE_INPUT, i, [geometry.area, frame.length, f64::from(u8::from(bonded))]);
            columns.set_from(YADE_INPUT + 3, i, columns_of(batch.law(i).1));
        }
        // Said so that the other measure is not computed with it.
        if mode == MotionMeasure::YadeRatcheting {
            columns.apply(&AsYade { law: &law, kinematics: Yade { dt, ratcheting_correction: true } });
        } else {
            columns.apply(&AsYade { law: &law, kinematics: Yade { dt, ratcheting_correction: false } });
        }
        for i in 0..count {
            let Some(response) = answer_in(columns, YADE_OUTPUT, i) else {
                evaluate_one(mode, i, dt, batch);
                continue;
            };
            let (geometry, frame, bonded) = batch.constants(i);
            let point = YadeMeasure::of_row(columns.get(i)).point(&geometry, &frame, bonded);
            batch.commit(i, &point, &response);
        }
    }

    /// A contact that is no bond is unstrained at the distance of its first touch (as in YADE), against a wall at the
    /// radius.
    fn unbonded_reference(length: f64, radius_a: f64, radius_b: f64) -> Reference {
        let length = if radius_b > 0.0 { length } else { radius_a };
        Reference { length, area: contact_area(radius_a, radius_b) }
    }

    /// k_N = ĒA/L, k_T = ḠA/L in N/m.
    fn stiffness(&self, geometry: &ContactGeometry) -> Stiffness {
        let area_by_length = geometry.area / geometry.reference_length;
        Stiffness {
            normal: self.parameters.normal_modulus * area_by_length,
            shear: self.shear_modulus * area_by_length,
            ..Stiffness::default()
        }
    }

    /// ω of a bond; 0 for a contact that is no bond, known by its κ = 0 (in YADE mode a contact that was flattened by
    /// plasticity in compression can have κ > 0 and then counts as damaged).
    fn damage(state: &CpmState) -> f64 {
        if state.kappa > 0.0 { state.omega } else { 0.0 }
    }

    /// `1 − (1−ω)κ/ε₀` (Stránský 2018, (6.5)–(6.6)).
    fn lost_strength(&self, state: &CpmState) -> f64 {
        self.strength_damage(state.kappa)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry, measure};
    use crate::kinematics::{MotionMeasure, PreviousGeometry};
    use crate::law::LawState;
    use crate::math::{any_perpendicular, quaternion_of_rotation_vector, rotate};
    use proptest::prelude::*;

    /// Two unit spheres 2 m apart, bonded: A = π m², L = 2 m.
    fn geometry() -> ContactGeometry {
        ContactGeometry {
            reference_length: 2.0,
            area: contact_area(1.0, 1.0),
            radius_a: 1.0,
            radius_b: 1.0,
            mass_a: 1.0,
            mass_b: 1.0,
        }
    }

    /// The reference material: Ē = 30 GPa, Ḡ/Ē = 0.2, c₀ = 3 MPa, tan φ = 0.8, ε₀ = 1e-4, ε_f/ε₀ = 30.
    fn concrete() -> CpmParameters {
        CpmParameters::new(30e9, 0.2, 3e6, 0.8_f64.atan(), 1e-4, 30.0)
    }

    fn law(parameters: CpmParameters) -> Cpm {
        Cpm::new(&parameters).expect("test parameters are valid")
    }

    /// Kinematics of a pair that keeps its direction x: strain `to`, shear displacement `shear` in this step.
    fn straight(from: f64, to: f64, shear: Vec3, bonded: bool) -> PointKinematics {
        let geometry = geometry();
        let length = geometry.reference_length;
        PointKinematics {
            geometry,
            length: length * (1.0 + to),
            length_old: length * (1.0 + from),
            elongation: length * to,
            elongation_old: length * from,
            gap: length * to,
            normal: Vec3::x(),
            shear_increment: shear,
            arm_a: 1.0,
            arm_b: 1.0,
            bonded,
            transport: Transport::identity(Vec3::x()),
        }
    }

    /// A contact driven by strains; the stresses are forces divided by the area.
    struct Bond {
        law: Cpm,
        state: CpmState,
        bonded: bool,
        normal_stress: f64,
        shear_stress: Vec3,
        energy: EnergySplit,
        status: Status,
        work: f64,
        dissipated: EnergySplit,
        dt: f64,
    }

    impl Bond {
        fn new(law: Cpm) -> Self {
            Self {
                law,
                state: CpmState::default(),
                bonded: true,
                normal_stress: 0.0,
                shear_stress: Vec3::zeros(),
                energy: EnergySplit::default(),
                status: Status::Lives,
                work: 0.0,
                dissipated: EnergySplit::default(),
                dt: 1.0,
            }
        }

        fn go(&mut self, strain: f64, shear_step: Vec3) -> f64 {
            let k = straight(self.state.normal_strain, strain, shear_step * 2.0, self.bonded);
            let (normal_old, shear_old, strain_old) = (self.normal_stress, self.shear_stress, self.state.normal_strain);
            let response = self.law.respond(&k, &self.state, self.dt);
            self.normal_stress = response.force.x / k.geometry.area;
            self.shear_stress = Vec3::new(0.0, response.force.y, response.force.z) / k.geometry.area;
            let volume = k.geometry.area * k.geometry.reference_length;
            self.work += 0.5
                * volume
                * ((normal_old + self.normal_stress) * (strain - strain_old)
                    + (shear_old + self.shear_stress).dot(&shear_step));
            self.dissipated.damage += response.energy.damage;
            self.dissipated.friction += response.energy.friction;
            self.dissipated.viscous += response.energy.viscous;
            self.dissipated.integration += response.energy.integration;
            self.energy = response.energy;
            self.state = response.state;
            self.status = response.status;
            self.normal_stress
        }

        fn pull(&mut self, strain: f64) -> f64 {
            self.go(strain, Vec3::zeros())
        }

        fn imbalance(&self) -> f64 {
            let d = &self.dissipated;
            // what a broken bond names as stored is released
            let stored = if self.status == Status::Broke { 0.0 } else { self.energy.stored() };
            self.work - stored - d.damage - d.friction - d.viscous - d.integration
        }
    }

    fn close(a: f64, b: f64, relative: f64) {
        assert!((a - b).abs() <= relative * b.abs(), "{a:e} is not {b:e}");
    }

    /// Link test of Stránský 2018, figures 2.6 and 2.7: stresses of the printed table to half a unit of their last
    /// digit, (2.15)–(2.17) to rounding.
    #[test]
    fn single_link_in_tension() {
        let law = law(CpmParameters::new(1e9, 1.0, 1e6, 0.5_f64.atan(), 1e-4, 1.5));
        let table = [
            (1.0, 100000.0, 0.0),
            (1.1, 93550.70, 0.149539),
            (1.5, 71653.13, 0.522312),
            (2.0, 51341.71, 0.743291),
            (2.5, 36787.94, 0.852848),
            (2.8, 30119.42, 0.892431),
            (3.0, 26359.7, 0.912134),
        ];
        let mut bond = Bond::new(law);
        for (strain, stress, omega) in table {
            let strain = strain * 1e-4;
            let computed = bond.pull(strain);
            assert!((computed - stress).abs() < 0.051, "{computed} {stress}");
            assert!((bond.state.omega - omega).abs() < 5.1e-7);
            // 8 roundings of 1.1e-16, amplified by 1/(1-ω) ≤ 12
            close(computed, 1e5 * (-(strain - 1e-4) / 1.5e-4).exp(), 1e-14);
        }
        // cycle: unloading along the secant, full stiffness in compression
        let mut bond = Bond::new(law);
        bond.pull(1.5e-4);
        assert!((bond.pull(0.3e-4) - 14330.63).abs() < 0.0051);
        assert!((bond.pull(2.8e-4) - 30119.42).abs() < 0.0051);
        close(bond.pull(-0.6e-4), -60000.0, 1e-15);
        assert_eq!(bond.status, Status::Lives);
    }

    /// Reference of a single bond made by YADE 2023.02a: printed digits, and the closed forms to 1e-12.
    #[test]
    fn both_damage_laws_meet_the_reference() {
        let table = [
            (5e-5, 0.0, 1.5e6, 0.0, 1.5e6),
            (1e-4, 0.0, 3.0e6, 0.0, 3.0e6),
            (1.5e-4, 0.34482759, 2.94827586e6, 0.34435236, 2.95041436e6),
            (2e-4, 0.51724138, 2.89655172e6, 0.51639195, 2.90164830e6),
            (5e-4, 0.82758621, 2.58620690e6, 0.82496534, 2.62551996e6),
            (1e-3, 0.93103448, 2.06896552e6, 0.92591818, 2.22245466e6),
            (2e-3, 0.98275862, 1.03448276e6, 0.97345903, 1.59245835e6),
        ];
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo] {
            let linear = law(CpmParameters { mode, damage_law: DamageLaw::Linear, ..concrete() });
            let exponential = law(CpmParameters { mode, ..concrete() });
            let (mut first, mut second) = (Bond::new(linear), Bond::new(exponential));
            for (strain, omega_l, stress_l, omega_e, stress_e) in table {
                let l = first.pull(strain);
                let e = second.pull(strain);
                assert!((first.state.omega - omega_l).abs() < 5.1e-9 && (l - stress_l).abs() < 5.1e-3 * 1e0);
                assert!((second.state.omega - omega_e).abs() < 5.1e-9 && (e - stress_e).abs() < 5.1e-3 * 1e0);
                if strain > 1e-4 {
                    close(l, 3e6 * (3e-3 - strain) / (3e-3 - 1e-4), 1e-12);
                    close(e, 3e6 * (-(strain - 1e-4) / 3e-3).exp(), 1e-12);
                }
            }
        }
    }

    /// Linear damage ends at ε_f: the bond breaks there even with a threshold of 1.
    #[test]
    fn linear_damage_breaks_at_the_softening_strain() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
            let mut bond = Bond::new(law(CpmParameters { mode, damage_law: DamageLaw::Linear, ..concrete() }));
            bond.pull(2.9e-3);
            assert_eq!(bond.status, Status::Lives);
            bond.pull(3.1e-3);
            assert_eq!(bond.status, Status::Broke);
            assert_eq!(bond.normal_stress, 0.0);
            assert_eq!(bond.state, CpmState::default());
        }
    }

    /// Work of pulling a bond apart: damage takes all of it, L A Ē ε₀(ε₀/2 + ε_f(1 − e^{-x})) + what is stored at the
    /// break. The trapezoid over n = 20000 equal steps of h = 1e-6 errs by h²/(12 ε_f²) ≈ 1e-8 of the softening part.
    #[test]
    fn a_broken_bond_has_dissipated_its_fracture_energy() {
        let threshold = 0.999;
        let law = law(CpmParameters { omega_threshold: threshold, ..concrete() });
        let mut bond = Bond::new(law);
        let mut strain = 0.0;
        while bond.status == Status::Lives {
            strain += 1e-6;
            bond.pull(strain);
        }
        let end = law.kappa_of_damage(threshold).expect("in range");
        assert!((strain - end).abs() < 1.1e-6);
        let volume = 2.0 * std::f64::consts::PI;
        let expected = volume * 30e9 * 1e-4 * (0.5e-4 + 3e-3 * (1.0 - (-(strain - 1e-4) / 3e-3).exp()));
        close(bond.dissipated.damage, expected, 2e-8);
        close(bond.work, bond.dissipated.damage + bond.dissipated.integration, 1e-12);
        assert!(bond.dissipated.integration.abs() < 1e-3 * bond.dissipated.damage);
    }

    /// Plateau max(0, (1−ω)c₀ − σ_N tan φ), unloading slope Ḡ, exact in one step of any size (modes thesis and yade).
    #[test]
    fn shear_plateau_and_unloading() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
            for strain in [-2e-4, 0.0, 0.5e-4, 3e-4] {
                let law = law(CpmParameters { mode, ..concrete() });
                let mut bond = Bond::new(law);
                let normal = bond.pull(strain);
                for _ in 0..5 {
                    bond.go(strain, Vec3::new(0.0, 3e-4, 4e-4));
                }
                let plateau = ((1.0 - bond.state.omega) * 3e6 - normal * 0.8).max(0.0);
                // tan(atan 0.8) and a norm: a few roundings
                assert!((bond.shear_stress.norm() - plateau).abs() <= 1e-14 * 3e6);
                if plateau > 0.0 {
                    close(bond.shear_stress.y / bond.shear_stress.z, 0.75, 1e-14);
                }
                if mode == CpmFormulation::Thesis && plateau > 1e5 {
                    let before = bond.shear_stress;
                    let back = Vec3::new(0.0, -3e-6, -4e-6);
                    bond.go(strain, back);
                    let change = (bond.shear_stress - before).norm();
                    close(change, 6e9 * 5e-6, 1e-12);
                }
            }
        }
    }

    /// YADE's plastic increment is s(1−s)σ_trial/Ḡ: after one step of twice the yield stress, half of the exact one.
    #[test]
    fn yade_slip_quirk_is_reproduced() {
        let plastic = |mode| {
            let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
            bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
            (bond.shear_stress.y, bond.state.plastic_shear_strain.y)
        };
        let (exact_stress, exact) = plastic(CpmFormulation::Thesis);
        let (yade_stress, yade) = plastic(CpmFormulation::YadePublic);
        close(exact_stress, 3e6, 1e-15);
        close(yade_stress, 3e6, 1e-15);
        close(exact, 5e-4, 1e-14);
        close(yade, 2.5e-4, 1e-14);
    }

    /// Woo's shear stress follows the total strain: after slip to ε_T and back to 0 it is 0, in thesis mode it is not.
    #[test]
    fn woo_shear_has_no_memory() {
        let back = |mode| {
            let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
            bond.go(0.0, Vec3::new(0.0, 8e-4, 0.0));
            bond.go(0.0, Vec3::new(0.0, -4e-4, 0.0));
            bond.shear_stress.y
        };
        close(back(CpmFormulation::Woo), 6e9 * 4e-4, 1e-14);
        close(back(CpmFormulation::Thesis), 6e9 * (5e-4 - 4e-4), 1e-12);
    }

    /// Each yield surface against its formula, its zero, and (3) its smoothness at σ_N = 0.
    #[test]
    fn yield_surfaces() {
        let (c, t, v): (f64, f64, f64) = (3e6, 0.8, 0.1);
        let surface = |yield_surface| law(CpmParameters { yield_surface, yield_log_speed: v, ..concrete() });
        for omega in [0.0, 0.3, 1.0] {
            for s in [-1e9, -3e7, -1e6, -1.0, 0.0, 1.0, 2e5, 1e6, 1e7] {
                let expected = [
                    c * (1.0 - omega) - s * t,
                    (c * c - 2.0 * c * t * s).max(0.0).sqrt() - c * omega,
                    if s / (c * v) >= 1.0 { 0.0 } else { c * ((1.0 - omega) + t * v * (1.0 - s / (c * v)).ln()) },
                ];
                let check = |yield_surface, expected: f64| {
                    let y = surface(yield_surface).yield_stress(s, omega);
                    // rounding of terms as large as |σ_N| t and c
                    assert!((y - expected.max(0.0)).abs() <= 1e-15 * (s.abs() + 4.0 * c), "{yield_surface:?} {s} {y}");
                };
                check(YieldSurface::MohrCoulomb, expected[0]);
                check(YieldSurface::Parabolic, expected[1]);
                check(YieldSurface::Logarithmic, expected[2]);
                check(YieldSurface::LogarithmicLinear, expected[if s > 0.0 { 0 } else { 2 }]);
            }
        }
        // derivative −tan φ on both sides of 0; one-sided differences of h = 1 Pa err by h/(2 c v) = 2e-6
        let f = |s| surface(YieldSurface::LogarithmicLinear).yield_stress(s, 0.2);
        assert!((f(0.0) - f(-1.0) + t).abs() < 2e-6);
        assert!((f(1.0) - f(0.0) + t).abs() < 1e-8);
        // high confinement: the logarithm stays far below the line, which is what it is for
        assert!(surface(YieldSurface::LogarithmicLinear).yield_stress(-4e8, 0.0) < 0.02 * 3.2e8);
    }

    /// Residual of the equation of β at the answer, over 20 decades of c; closed form for exponent 1.
    #[test]
    fn beta_solves_its_equation() {
        for n in [0.05, 0.1, 0.3, 0.5, 1.0, 1.7, 3.0] {
            for decade in -10..=10 {
                let ln_c = f64::from(decade) * 10.0_f64.ln();
                let beta = solve_beta(ln_c, n);
                assert!(beta <= 0.0);
                let residual = beta_residual(beta, ln_c, n).0;
                assert!(residual.abs() <= 1e-12, "n {n} decade {decade}: {residual:e}");
                if n == 1.0 {
                    close(beta, -libm::log1p(ln_c.exp()), 1e-13);
                }
            }
        }
        assert_eq!(solve_beta(f64::NEG_INFINITY, 0.3), 0.0);
    }

    fn viscous(mode: CpmFormulation) -> CpmParameters {
        CpmParameters {
            mode,
            damage_time: 1.0,
            damage_rate_exponent: 0.3,
            plastic_time: 2.0,
            plastic_rate_exponent: 0.4,
            ..concrete()
        }
    }

    /// Slow loading gives the law without viscosity, fast loading the elastic one, in both directions.
    ///
    /// Slow, Δt = 1e30 s: c = ε₀(1−ω)/Δt^0.3 (..)^(−0.7) ≈ 1e-9, the overstress that fraction of the stress. Fast,
    /// Δt = 1e-60 s: eᵝ = c^(−1/M) is below 1e-50.
    #[test]
    fn rate_limits() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::Woo] {
            let run = |dt, parameters| {
                let mut bond = Bond::new(law(parameters));
                bond.dt = dt;
                // in tension there is no shear strength left, so first the slip
                bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
                let shear = bond.shear_stress.y;
                bond.pull(4e-4);
                (bond.normal_stress, shear, bond.state.omega)
            };
            let inviscid = run(1.0, CpmParameters { mode, ..concrete() });
            let slow = run(1e30, viscous(mode));
            let fast = run(1e-60, viscous(mode));
            let medium = run(1e-3, viscous(mode));
            close(slow.0, inviscid.0, 1e-6);
            close(slow.1, inviscid.1, 1e-6);
            close(fast.0, 30e9 * 4e-4, 1e-14);
            close(fast.1, 6e9 * 1e-3, 1e-14);
            assert!(medium.0 > 1.01 * inviscid.0 && medium.0 < 0.99 * fast.0);
            assert!(medium.1 > 1.01 * inviscid.1 && medium.1 < 0.99 * fast.1);
            assert_eq!(slow.2, fast.2);
        }
    }

    /// Relaxation at constant strain, exponent 1. The distance x = ωe − ε_d obeys ẋ = −x/((1−ω)ε₀τ), in backward Euler
    /// steps x_k = x_0/(1 + Δt/((1−ω)ε₀τ))^k exactly; x_0 after the first step from the same formula.
    #[test]
    fn stress_relaxation_of_damage() {
        let tau = 1e4;
        let p = CpmParameters { damage_time: tau, damage_rate_exponent: 1.0, ..concrete() };
        let mut bond = Bond::new(law(p));
        bond.dt = 1e-3;
        let strain = 5e-4;
        bond.pull(strain);
        let omega = bond.state.omega;
        let ratio = 1.0 / (1.0 + bond.dt / ((1.0 - omega) * 1e-4 * tau));
        for step in 1..=1000 {
            let expected = 30e9 * ((1.0 - omega) * strain + omega * strain * ratio.powi(step));
            // each step rounds the distance a few times: 1000·4·1.1e-16
            close(bond.normal_stress, expected, 5e-13);
            bond.pull(strain);
        }
        // against the differential equation: backward Euler errs by t Δt/(2 T²) with T = 0.175 s, here 1.6e-2
        let time_constant = (1.0 - omega) * 1e-4 * tau;
        let exact = (1.0 - omega) * strain + omega * strain * (-1000.0 * bond.dt / time_constant).exp();
        close(bond.normal_stress, 30e9 * exact, 2e-2);
    }

    /// Relaxation of slip at constant shear strain, exponent 1: |σ_T| − y decays by 1/(1 + ḠΔt/(c₀τ)) a step.
    #[test]
    fn stress_relaxation_of_slip() {
        let tau = 5.0;
        let p = CpmParameters { plastic_time: tau, plastic_rate_exponent: 1.0, ..concrete() };
        let mut bond = Bond::new(law(p));
        bond.dt = 1e-5;
        bond.go(0.0, Vec3::new(0.0, 1e-3, 0.0));
        let ratio = 1.0 / (1.0 + 6e9 * bond.dt / (3e6 * tau));
        for step in 1..=1000 {
            let expected = 3e6 + (6e6 - 3e6) * ratio.powi(step);
            close(bond.shear_stress.y, expected, 5e-13);
            bond.pull(0.0);
        }
        assert!(bond.dissipated.viscous > 0.0 && bond.dissipated.friction > 0.0);
        assert!(bond.imbalance().abs() <= 1e-13 * bond.work);
    }

    /// Plastic branch in compression: slope K̃Ē for any step size (thesis); YADE's slope depends on the step size.
    #[test]
    fn compression_plasticity() {
        let slope = |mode, steps: i32| {
            let p = CpmParameters { mode, soft_strain: -1e-3, relative_soft_stiffness: 0.3, ..concrete() };
            let mut bond = Bond::new(law(p));
            for step in 1..=steps {
                bond.pull(-3e-3 * f64::from(step) / f64::from(steps));
            }
            assert!(bond.imbalance().abs() < 1e-12 * bond.work);
            let end = bond.normal_stress;
            let unloaded = bond.pull(-2.9e-3);
            close(unloaded - end, 30e9 * 1e-4, 1e-11);
            (end - 30e9 * -1e-3) / (30e9 * -2e-3)
        };
        for steps in [3, 300] {
            close(slope(CpmFormulation::Thesis, steps), 0.3, 1e-12);
            close(slope(CpmFormulation::Woo, steps), 0.3, 1e-12);
        }
        // YADE: e − ε_s → K̃(e + Δε − ε_s), which settles at K̃/(1−K̃) Δε: perfectly plastic for small steps
        close(slope(CpmFormulation::YadePublic, 3000), 0.3 / 0.7 * 1e-6 / 2e-3, 1e-6);
    }

    /// Confinement shifts the origin: no force at rest, Ē as slope, Mohr–Coulomb radius raised by |σ₀| tan φ.
    #[test]
    fn isotropic_prestress() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic] {
            let mut bond = Bond::new(law(CpmParameters { mode, isotropic_prestress: -5e6, ..concrete() }));
            assert!(bond.pull(0.0).abs() < 1e-8);
            close(bond.pull(1e-4), 30e9 * 1e-4, 1e-14);
            bond.pull(0.0);
            bond.go(0.0, Vec3::new(0.0, 5e-3, 0.0));
            close(bond.shear_stress.y, 3e6 + 0.8 * 5e6, 1e-14);
            assert!(bond.imbalance().abs() < 1e-13 * bond.work);
        }
        // beyond the plastic limit the shift follows the plastic branch
        let p = CpmParameters {
            isotropic_prestress: -60e6,
            soft_strain: -1e-3,
            relative_soft_stiffness: 0.5,
            ..concrete()
        };
        let mut bond = Bond::new(law(p));
        assert!(bond.pull(0.0).abs() < 1e-7);
        close(bond.pull(1e-4), 30e9 * 1e-4, 1e-11);
    }

    /// A contact that is no bond: friction only, no tension, over when it opens.
    #[test]
    fn unbonded_contact() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo] {
            let mut bond = Bond::new(law(CpmParameters { mode, ..concrete() }));
            bond.bonded = false;
            close(bond.pull(-1e-4), -3e6, 1e-15);
            assert_eq!(Cpm::damage(&bond.state), 0.0);
            bond.go(-1e-4, Vec3::new(0.0, 5e-3, 0.0));
            close(bond.shear_stress.y, 0.8 * 3e6, 1e-15);
            bond.pull(1e-5);
            assert_eq!((bond.status, bond.normal_stress, bond.shear_stress), (Status::Opened, 0.0, Vec3::zeros()));
            assert!(bond.imbalance().abs() < 1e-13 * bond.work.abs(), "{mode:?} {}", bond.imbalance());
        }
    }

    /// Doubling Ē and c₀ doubles every stress, to the last bit.
    #[test]
    fn stresses_scale_with_stiffness_and_cohesion() {
        let p = CpmParameters { soft_strain: -3e-4, relative_soft_stiffness: 0.2, ..concrete() };
        let mut one = Bond::new(law(p));
        let mut two = Bond::new(law(CpmParameters { normal_modulus: 60e9, cohesion: 6e6, ..p }));
        for (strain, shear) in [(1e-4, 1e-4), (3e-4, 2e-4), (-5e-4, 1e-3), (1e-3, -1e-3), (2e-4, 1e-4)] {
            let step = Vec3::new(0.0, shear, 0.3 * shear);
            one.go(strain, step);
            two.go(strain, step);
            assert_eq!(2.0 * one.normal_stress, two.normal_stress);
            assert_eq!(one.shear_stress * 2.0, two.shear_stress);
        }
    }

    /// Inverses: g(g⁻¹(ω)) = ω to a few roundings, ω̂ likewise, and (6.6) in its own words.
    #[test]
    fn damage_functions_and_their_inverses() {
        for damage_law in [DamageLaw::Linear, DamageLaw::Exponential] {
            for ductility in [1.5, 30.0, 1e4] {
                let law = law(CpmParameters { damage_law, relative_ductility: ductility, ..concrete() });
                for omega in [1e-12, 1e-6, 0.01, 0.1, 0.5, 0.9, 0.999, 1.0 - 1e-9] {
                    let kappa = law.kappa_of_damage(omega).expect("in range");
                    // the derivative dω/dκ·κ is at most 1+ε₀/ε_f times (1−ω)+…, so roundings stay roundings of 1
                    assert!((law.damage_function(kappa) - omega).abs() < 4e-16 * (1.0 + ductility / 1e4));
                    let hat = law.strength_damage(kappa);
                    let definition = 1.0 - (1.0 - law.damage_function(kappa)) * kappa / 1e-4;
                    // the definition cancels: 1 − (1−ω)κ/ε₀ loses κ/ε₀ roundings
                    assert!((hat - definition).abs() < 4e-16 * (1.0 + kappa / 1e-4), "{hat} {definition}");
                    assert!((law.relative_residual_strength(kappa) - (1.0 - hat)).abs() == 0.0);
                    let again = law.kappa_of_strength_damage(omega).expect("in range");
                    assert!((law.strength_damage(again) - omega).abs() < 1e-15 * (1.0 + 1.0 / ductility) * 2.0);
                }
                assert_eq!(law.damage_function(0.99e-4), 0.0);
                assert_eq!(law.strength_damage(0.5e-4), 0.0);
                assert_eq!(law.relative_residual_strength(0.5e-4), 1.0);
                assert_eq!(law.kappa_of_damage(0.0).expect("in range"), 1e-4);
                assert!(law.kappa_of_damage(1.1).is_err() && law.kappa_of_damage(f64::NAN).is_err());
                assert!(law.kappa_of_strength_damage(-0.1).is_err());
                let state = law.damaged_state(0.5).expect("in range");
                assert_eq!(law.respond(&straight(0.0, 1e-6, Vec3::zeros(), true), &state, 1.0).state.omega, 0.5);
            }
        }
    }

    #[test]
    fn parameters_are_checked() {
        let bad = [
            CpmParameters { normal_modulus: 0.0, ..concrete() },
            CpmParameters { normal_modulus: f64::NAN, ..concrete() },
            CpmParameters { friction_angle: 1.6, ..concrete() },
            CpmParameters { limit_strain: -1e-4, ..concrete() },
            CpmParameters { damage_law: DamageLaw::Linear, relative_ductility: 1.0, ..concrete() },
            CpmParameters { cohesion: 0.0, yield_surface: YieldSurface::Logarithmic, ..concrete() },
            CpmParameters { damage_time: 1.0, damage_rate_exponent: 0.0, ..concrete() },
        ];
        for p in bad {
            assert!(matches!(Cpm::new(&p), Err(CpmError::OutOfRange { .. })), "{p:?}");
        }
        let yade = CpmParameters { mode: CpmFormulation::YadePublic, damage_time: 1.0, ..concrete() };
        assert_eq!(Cpm::new(&yade), Err(CpmError::NotInYade { name: "damage_time" }));
        let soft = CpmParameters { normal_modulus: 10e9, friction_angle: 0.3, never_damage: true, ..concrete() };
        let mean = concrete().average(&soft).expect("alike");
        assert_eq!((mean.normal_modulus, mean.shear_modulus(), mean.never_damage), (20e9, 0.2 * 20e9, true));
        let linear = CpmParameters { damage_law: DamageLaw::Linear, ..concrete() };
        assert_eq!(concrete().average(&linear), Err(CpmError::Unlike { name: "damage_law" }));
    }

    /// A free pair moved by a script of strain, shear and rotation, measured by the solver's kinematics.
    struct Pair {
        law: Cpm,
        mode: MotionMeasure,
        a: Motion,
        b: Motion,
        frame: PreviousGeometry,
        state: CpmState,
        force: Vec3,
        normal_force: f64,
        shear_force: Vec3,
        stored: f64,
        bonded: bool,
    }

    /// What one step did: trapezoidal work, its absolute parts, and the ledger.
    struct Balance {
        work: f64,
        size: f64,
        ledger: f64,
        status: Status,
    }

    impl Pair {
        fn new(law: Cpm, mode: MotionMeasure, bonded: bool) -> Self {
            let still = |position| Motion {
                position,
                velocity: Vec3::zeros(),
                angular_velocity: Vec3::zeros(),
                rotation_increment: quaternion_of_rotation_vector(&Vec3::zeros()),
                orientation: math::Quat::identity(),
            };
            let (xa, xb) = (Vec3::zeros(), Vec3::new(0.0, 1.2, 1.6));
            let frame = initial_geometry(&xa, &xb, &Vec3::zeros());
            assert_eq!(frame.length, 2.0);
            // Woo's prestress acts from the first evaluation on
            let parameters = law.parameters();
            let at_rest = if parameters.mode == CpmFormulation::Woo { -parameters.isotropic_prestress } else { 0.0 };
            Self {
                law,
                mode,
                a: still(xa),
                b: still(xb),
                frame,
                state: CpmState::default(),
                force: Vec3::zeros(),
                normal_force: at_rest * geometry().area,
                shear_force: Vec3::zeros(),
                stored: 0.0,
                bonded,
            }
        }

        /// Shear stress of a history: Ḡ times the elastic strain, in YADE mode cut off at the bound. (The force does not
        /// tell it: first-order transport leaves a part of the shear stress along the normal.)
        fn shear_stress(&self, state: &CpmState) -> Vec3 {
            let trial = (state.shear_strain - state.plastic_shear_strain) * self.law.shear_modulus;
            if self.law.parameters.mode != CpmFormulation::YadePublic {
                return trial;
            }
            let elastic = state.normal_strain + self.law.prestress_strain - state.plastic_normal_strain;
            let damage = if elastic > 0.0 { state.omega } else { 0.0 };
            let bound =
                self.law.yield_stress((1.0 - damage) * self.law.parameters.normal_modulus * elastic, state.omega);
            if trial.norm() > bound { trial * (bound / trial.norm()) } else { trial }
        }

        /// Move B by `relative` (m, in world axes), rotate both particles by small vectors, respond.
        fn step(&mut self, relative: Vec3, spin_a: Vec3, spin_b: Vec3, dt: f64) -> Balance {
            self.b.position += relative;
            self.b.velocity = relative / dt;
            self.a.angular_velocity = spin_a / dt;
            self.b.angular_velocity = spin_b / dt;
            self.a.rotation_increment = quaternion_of_rotation_vector(&spin_a);
            self.b.rotation_increment = quaternion_of_rotation_vector(&spin_b);
            let geometry = ContactGeometry { reference_length: 2.0, ..geometry() };
            let image = ImageShift::default();
            let k = measure(self.mode, &self.a, &self.b, &image, &geometry, &self.frame, self.bonded, dt);
            let response = self.law.respond(&k, &self.state, dt);
            let lives = response.status == Status::Lives;
            let shear_old = k.transport.apply(&self.shear_force);
            let shear_new = if lives { self.shear_stress(&response.state) * geometry.area } else { Vec3::zeros() };
            let normal_old = self.normal_force;
            let normal_new = (response.force - shear_new).dot(&k.normal);
            let along = (response.force - shear_new - k.normal * normal_new).norm();
            // ε_T − ε_Tp is known to a rounding of ε_T
            let rounding = self.law.shear_modulus * geometry.area * response.state.shear_strain.norm() * 1e-15;
            assert!(along <= 1e-12 * response.force.norm() + rounding, "force is not normal plus shear: {along:e}");
            let normal_work = 0.5 * (normal_old + normal_new) * (k.length - k.length_old);
            let shear_work = 0.5 * (shear_old + shear_new).dot(&k.shear_increment);
            let e = &response.energy;
            let stored = if response.status == Status::Broke { 0.0 } else { e.stored() };
            let ledger = stored - self.stored + e.damage + e.friction + e.viscous + e.integration;
            self.stored = stored;
            self.force = response.force;
            self.normal_force = normal_new;
            self.shear_force = shear_new;
            self.state = response.state;
            self.frame = PreviousGeometry { normal: k.normal, length: k.length };
            let work = normal_work + shear_work;
            let size = 0.5 * (normal_old.abs() + normal_new.abs()) * (k.length - k.length_old).abs()
                + 0.5 * (shear_old.norm() + shear_new.norm()) * k.shear_increment.norm()
                + stored.abs()
                + e.damage.abs()
                + e.friction.abs()
                + e.viscous.abs()
                + e.integration.abs();
            Balance { work, size, ledger, status: response.status }
        }
    }

    /// Options that take part in the random paths.
    fn option(index: usize) -> CpmParameters {
        let base = CpmParameters { omega_threshold: 0.97, ..concrete() };
        match index {
            0 => base,
            1 => CpmParameters { damage_law: DamageLaw::Linear, ..base },
            2 => CpmParameters { soft_strain: -3e-4, relative_soft_stiffness: 0.3, ..base },
            3 => CpmParameters { shear_contribution: 0.5, isotropic_prestress: -2e6, ..base },
            4 => CpmParameters { yield_surface: YieldSurface::LogarithmicLinear, never_damage: true, ..base },
            _ => CpmParameters { cohesion: 0.5e6, limit_strain: 2e-4, relative_ductility: 3.0, ..base },
        }
    }

    fn small_vector(size: f64) -> impl Strategy<Value = Vec3> {
        (-size..size, -size..size, -size..size).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    fn check_balance(
        law: Cpm,
        mode: MotionMeasure,
        bonded: bool,
        path: &[(Vec3, Vec3, Vec3)],
    ) -> Result<(), TestCaseError> {
        let mut pair = Pair::new(law, mode, bonded);
        let (mut error, mut size) = (0.0_f64, 0.0_f64);
        for (relative, spin_a, spin_b) in path {
            let balance = pair.step(*relative, *spin_a, *spin_b, 1e-3);
            error += (balance.work - balance.ledger).abs();
            size += balance.size;
            if balance.status != Status::Lives {
                break;
            }
        }
        // roundings: a strain of 1e-4 is the difference of lengths of 2 m, known to 1e-16/1e-4 = 1e-12 relative, but the
        // same difference enters work and ledger; what remains is rounding of the sums
        prop_assert!(error <= 1e-12 * size, "error {:e} of {:e}", error, size);
        Ok(())
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 200, ..ProptestConfig::default() })]

        /// The energy ledger closes on random paths of stretch, slip, rolling, twist and rotation, in every step.
        #[test]
        fn energy_balance_thesis(
            index in 0..6_usize,
            bonded in any::<bool>(),
            path in prop::collection::vec((small_vector(4e-4), small_vector(3e-4), small_vector(3e-4)), 60),
        ) {
            check_balance(law(option(index)), MotionMeasure::Finite, bonded, &path)?;
            check_balance(law(option(index)), MotionMeasure::FirstOrder, bonded, &path)?;
            if index == 0 && bonded {
                check_balance(law(viscous(CpmFormulation::Thesis)), MotionMeasure::Finite, bonded, &path)?;
            }
        }

        /// The same in the compatibility modes, with the kinematics they are used with.
        #[test]
        fn energy_balance_compatibility_modes(
            index in 0..6_usize,
            bonded in any::<bool>(),
            path in prop::collection::vec((small_vector(4e-4), small_vector(3e-4), small_vector(3e-4)), 60),
        ) {
            let p = CpmParameters { mode: CpmFormulation::Woo, ..option(index) };
            check_balance(law(p), MotionMeasure::FirstOrder, bonded, &path)?;
            if index != 4 {
                let p = CpmParameters { mode: CpmFormulation::YadePublic, ..option(index) };
                check_balance(law(p), MotionMeasure::YadeRatcheting, bonded, &path)?;
                check_balance(law(p), MotionMeasure::Yade, bonded, &path)?;
            }
            check_balance(law(viscous(CpmFormulation::Woo)), MotionMeasure::FirstOrder, bonded, &path)?;
        }

        /// Damage never dissipates a negative energy in thesis mode.
        #[test]
        fn damage_dissipation_is_not_negative(
            index in 0..6_usize,
            path in prop::collection::vec((-4e-4..8e-4, small_vector(4e-4)), 40),
        ) {
            let mut bond = Bond::new(law(option(index)));
            for (strain, shear) in path {
                bond.go(strain, Vec3::new(0.0, shear.y, shear.z));
                prop_assert!(bond.energy.damage >= 0.0);
                if bond.status != Status::Lives {
                    break;
                }
            }
        }

        /// Exchanging A and B gives the opposite force and the swapped history.
        #[test]
        fn swap_symmetry(
            index in 0..6_usize,
            mode_index in 0..3_usize,
            path in prop::collection::vec((-5e-4..1e-3, small_vector(4e-4)), 20),
        ) {
            let mode = [CpmFormulation::Thesis, CpmFormulation::YadePublic, CpmFormulation::Woo][mode_index];
            // option 4 has a yield surface that YADE mode refuses
            let index = if mode == CpmFormulation::YadePublic { index % 4 } else { index };
            let law = law(CpmParameters { mode, ..option(index) });
            let (mut state, mut swapped) = (CpmState::default(), CpmState::default());
            let mut from = 0.0;
            for (strain, shear) in path {
                let k = straight(from, strain, Vec3::new(0.0, shear.y, shear.z), true);
                let mut other = k;
                other.normal = -k.normal;
                other.shear_increment = -k.shear_increment;
                other.transport = Transport::identity(other.normal);
                let one = law.respond(&k, &state, 1e-3);
                let two = law.respond(&other, &swapped, 1e-3);
                prop_assert_eq!(one.force, -two.force);
                prop_assert_eq!(one.state, two.state.swapped());
                prop_assert_eq!(one.energy, two.energy);
                from = strain;
                state = one.state;
                swapped = two.state;
            }
        }
    }

    /// In thesis mode a step's friction is not negative while the normal stress rests: σ_T and Δε_Tp are parallel to the
    /// trial stress, and both ends of the step lie on or inside the same circle.
    #[test]
    fn friction_is_positive_at_rest() {
        let mut bond = Bond::new(law(concrete()));
        for step in 0..200 {
            let angle = 0.1 * f64::from(step);
            bond.go(-1e-4, Vec3::new(0.0, angle.cos(), angle.sin()) * 3e-4);
            assert!(bond.energy.friction >= 0.0);
        }
        assert!(bond.dissipated.friction > 0.0);
    }

    /// How far YADE's ε_Tp is from the slip that its stresses imply. In steady slip by δ yield strains a step, the trial
    /// stress settles at a = 1/(1−δ) yield stresses; from then on both grow alike, and what ε_Tp misses in all is
    /// (a−1)²/a = δ²/(1−δ) yield strains. Work counted with ε_Tp misses that much times y.
    #[test]
    fn yade_recorded_slip_misses_dissipation() {
        for delta in [0.1_f64, 0.01] {
            let step = delta * 5e-4;
            let mut bond = Bond::new(law(CpmParameters { mode: CpmFormulation::YadePublic, ..concrete() }));
            let mut recorded = 0.0;
            let mut previous = 0.0;
            for _ in 0..(10.0 / delta).round() as i32 {
                let before = bond.shear_stress.y;
                bond.go(0.0, Vec3::new(0.0, step, 0.0));
                let plastic = bond.state.plastic_shear_strain.y;
                recorded += std::f64::consts::TAU * 0.5 * (before + bond.shear_stress.y) * (plastic - previous);
                previous = plastic;
            }
            assert!(bond.imbalance().abs() < 1e-12 * bond.work);
            let missed = bond.dissipated.friction - recorded;
            // the approach to steady slip shrinks by (1−δ)² a step, 10/δ steps leave e^-18
            close(missed, std::f64::consts::TAU * 3e6 * 5e-4 * delta * delta / (1.0 - delta), 1e-6);
        }
    }

    /// A stressed pair turned as a rigid body by 2π keeps its stresses (finite kinematics).
    /// Tolerance: 360 steps, each a rounding of lengths of 2 m against strains of 1e-4, adding up like a random walk.
    #[test]
    fn rigid_rotation_changes_no_stress() {
        let mut pair = Pair::new(law(concrete()), MotionMeasure::Finite, true);
        let n = pair.frame.normal;
        let t = any_perpendicular(&n);
        pair.step(n * 1e-4 + t * 2e-4, Vec3::zeros(), Vec3::zeros(), 1e-3);
        let (stored, force, state) = (pair.stored, pair.force, pair.state);
        let spin = Vec3::new(0.5, -0.3, 0.8).normalize() * (std::f64::consts::TAU / 360.0);
        let turn = quaternion_of_rotation_vector(&spin);
        for _ in 0..360 {
            let arm = pair.b.position - pair.a.position;
            pair.step(rotate(&turn, &arm) - arm, spin, spin, 1e-3);
        }
        close(pair.stored, stored, 1e-9);
        assert!((pair.force - force).norm() < 1e-9 * force.norm());
        assert!((pair.state.shear_strain - state.shear_strain).norm() < 1e-13);
    }

    /// Extreme input gives finite answers.
    #[test]
    fn no_nan_at_extremes() {
        let mut cases: Vec<CpmParameters> = (0..6).map(option).collect();
        cases.push(viscous(CpmFormulation::Thesis));
        cases.push(viscous(CpmFormulation::Woo));
        cases.push(CpmParameters { mode: CpmFormulation::YadePublic, ..concrete() });
        cases.push(CpmParameters { cohesion: 0.0, shear_ratio: 0.0, friction_angle: 0.0, ..concrete() });
        for p in cases {
            for dt in [1e-300, 1e-6, 1e300] {
                for strain in [-10.0, -1e-300, 0.0, 5e-324, 1e-4, 1.0, 1e10] {
                    for shear in [0.0, 5e-324, 1e10] {
                        let mut bond = Bond::new(law(p));
                        bond.dt = dt;
                        for _ in 0..3 {
                            bond.go(strain, Vec3::new(0.0, shear, -shear));
                            assert!(bond.normal_stress.is_finite() && bond.shear_stress.norm().is_finite());
                            assert!(bond.state.as_reals().iter().all(|x| x.is_finite()), "{p:?} {strain} {shear} {dt}");
                        }
                    }
                }
            }
        }
    }
}
