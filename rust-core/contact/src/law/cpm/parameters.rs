//! Parameters of the cohesive particle model and their validation.

#[cfg(feature = "std")]
use schemars::JsonSchema;
#[cfg(feature = "std")]
use serde::{Deserialize, Serialize};

/// Published form of the law. The [module documentation](super) lists the differences.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize, JsonSchema), serde(rename_all = "kebab-case"))]
#[repr(C)]
pub enum CpmFormulation {
    /// Stránský 2018, corrected; with all options, the full model of Šmilauer 2010.
    #[default]
    Thesis,
    /// YADE's public `Law2_ScGeom_CpmPhys_Cpm`, bit for bit.
    YadePublic,
    /// Woo's `Law2_L6Geom_ConcretePhys`.
    Woo,
}

impl CpmFormulation {
    /// Whether the formulation has the options of the full model: yield surfaces other than Mohr–Coulomb
    /// (`yield_surface`), viscous damage (`damage_time`), and viscous slip (`plasticity_time`).
    ///
    /// In YADE's public form these parameters exist but have no effect.
    pub const fn has_full_model(self) -> bool {
        match self {
            Self::Thesis | Self::Woo => true,
            Self::YadePublic => false,
        }
    }
}

/// Form of the damage function g(κ).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize, JsonSchema), serde(rename_all = "kebab-case"))]
#[repr(C)]
pub enum DamageLaw {
    /// Linear softening to zero stress at ε_f (`damLaw = 0`).
    Linear,
    /// Exponential softening, (2.17) (`damLaw = 1`).
    #[default]
    Exponential,
}

/// Bound of the shear stress as a function of the normal stress. Formulas in the [module documentation](super).
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize, JsonSchema), serde(rename_all = "kebab-case"))]
#[repr(C)]
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
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "std", derive(Serialize, Deserialize, JsonSchema), serde(deny_unknown_fields))]
#[repr(C)]
pub struct CpmParameters {
    /// Formulation.
    #[cfg_attr(feature = "std", serde(default))]
    pub mode: CpmFormulation,
    /// Normal modulus Ē, Pa (YADE `young`).
    pub young: f64,
    /// Ratio Ḡ/Ē of shear to normal modulus, 1 (YADE `poisson`, Woo `ktDivKn`). Not Poisson's ratio.
    pub shear_ratio: f64,
    /// Cohesion c₀ of the undamaged bond, Pa (YADE `sigmaT`).
    pub cohesion: f64,
    /// Friction coefficient tan φ, 1, φ the angle of friction (YADE `tanFrictionAngle`).
    pub friction_coefficient: f64,
    /// Crack onset strain ε₀, 1 (YADE `epsCrackOnset`).
    pub crack_onset_strain: f64,
    /// Ratio ε_f/ε₀, 1 (YADE `relDuctility`); 0 with a fracture energy.
    pub relative_ductility: f64,
    /// Energy G per area, J/m², that a bond of any length dissipates in tension until it has no strength; 0 with a ratio ε_f/ε₀.
    #[cfg_attr(feature = "std", serde(default))]
    pub fracture_energy: f64,
    /// Form of the damage function.
    #[cfg_attr(feature = "std", serde(default))]
    pub damage_law: DamageLaw,
    /// Damage at which a bond in tension breaks, 1; with 1 or more a bond breaks only when its strength is zero.
    #[cfg_attr(feature = "std", serde(default = "one"))]
    pub omega_threshold: f64,
    /// Whether bonds never damage (ω stays 0).
    #[cfg_attr(feature = "std", serde(default))]
    pub never_damage: bool,
    /// Weight ξ of shear in the equivalent strain, 1.
    #[cfg_attr(feature = "std", serde(default))]
    pub shear_contribution: f64,
    /// Strain ε_s < 0 at which plasticity in compression starts, 1 (`epsSoft`); 0 or more: none.
    #[cfg_attr(feature = "std", serde(default))]
    pub soft_strain: f64,
    /// Relative stiffness K̃ of the plastic branch in compression, 1 (`relKnSoft`).
    #[cfg_attr(feature = "std", serde(default))]
    pub relative_soft_stiffness: f64,
    /// Isotropic prestress σ₀ of the bonds, Pa, negative for confinement (`isoPrestress`).
    #[cfg_attr(feature = "std", serde(default))]
    pub isotropic_prestress: f64,
    /// Bound of the shear stress.
    #[cfg_attr(feature = "std", serde(default))]
    pub yield_surface: YieldSurface,
    /// Parameter Y₀ of the logarithmic surfaces, 1 (`yieldLogSpeed`).
    #[cfg_attr(feature = "std", serde(default = "tenth"))]
    pub yield_log_speed: f64,
    /// Characteristic time τ_d of viscous damage, s (`dmgTau`); 0 or less: none.
    #[cfg_attr(feature = "std", serde(default))]
    pub damage_time: f64,
    /// Exponent M_d of viscous damage, 1 (`dmgRateExp`).
    #[cfg_attr(feature = "std", serde(default = "one"))]
    pub damage_rate_exponent: f64,
    /// Characteristic time τ_p of viscous slip, s (`plTau`); 0 or less: none.
    #[cfg_attr(feature = "std", serde(default))]
    pub plasticity_time: f64,
    /// Exponent M_p of viscous slip, 1 (`plRateExp`).
    #[cfg_attr(feature = "std", serde(default = "one"))]
    pub plasticity_rate_exponent: f64,
}

#[cfg(feature = "std")]
fn one() -> f64 {
    1.0
}

#[cfg(feature = "std")]
fn tenth() -> f64 {
    0.1
}

/// Parameters outside their valid range, or that contradict each other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
#[non_exhaustive]
pub enum CpmError {
    /// A value outside its range.
    #[cfg_attr(feature = "std", error("CPM parameter `{name}` is {value}, but must be {requirement}"))]
    OutOfRange {
        /// Field of [`CpmParameters`], or argument.
        name: &'static str,
        /// Value given.
        value: f64,
        /// Range of valid values.
        requirement: &'static str,
    },
    /// An option that the formulation does not have.
    #[cfg_attr(
        feature = "std",
        error("CPM option `{name}` has no effect in mode yade-public; use mode thesis or woo, or remove it")
    )]
    NotInYade {
        /// Field of [`CpmParameters`].
        name: &'static str,
    },
    /// A fracture energy in a published form that has none.
    #[cfg_attr(feature = "std", error("CPM option `fracture_energy` exists in mode thesis only"))]
    OnlyInThesis,
    /// Softening given twice.
    #[cfg_attr(feature = "std", error("CPM: `relative_ductility` must be 0 with a `fracture_energy`"))]
    SoftensTwice,
    /// Two materials whose parameters cannot be averaged.
    #[cfg_attr(feature = "std", error("CPM materials with different `{name}` cannot be averaged"))]
    Unlike {
        /// Field of [`CpmParameters`].
        name: &'static str,
    },
}

impl CpmParameters {
    /// Parameters of the basic law (Stránský 2018, table 2.1): exponential softening, Mohr–Coulomb, no options.
    pub fn new(
        young: f64,
        shear_ratio: f64,
        cohesion: f64,
        friction_coefficient: f64,
        crack_onset_strain: f64,
        relative_ductility: f64,
    ) -> Self {
        Self {
            mode: CpmFormulation::Thesis,
            young,
            shear_ratio,
            cohesion,
            friction_coefficient,
            crack_onset_strain,
            relative_ductility,
            fracture_energy: 0.0,
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
            plasticity_time: 0.0,
            plasticity_rate_exponent: 1.0,
        }
    }

    /// Parameters of a contact between two materials: arithmetic means; `never_damage` if either has it.
    ///
    /// As in both programs, Ḡ is the mean ratio times the mean Ē, and ε_f the product of the means of ε₀ and ε_f/ε₀. YADE uses
    /// the tangent of the mean angle of friction, Woo the mean of the tangents; the thesis formulation follows YADE. Equal tangents
    /// keep their bits. Formulation, yield surface, and whether a fracture energy is given must agree. The damage law must agree too, except in YADE's formulation, which
    /// uses that of the first material.
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
        if (self.fracture_energy > 0.0) != (other.fracture_energy > 0.0) {
            return Err(CpmError::Unlike { name: "fracture_energy" });
        }
        let mean = |field: fn(&Self) -> f64| 0.5 * (field(self) + field(other));
        let friction_coefficient =
            if self.mode == CpmFormulation::Woo || self.friction_coefficient == other.friction_coefficient {
                mean(|p| p.friction_coefficient)
            } else {
                libm::tan(mean(|p| libm::atan(p.friction_coefficient)))
            };
        Ok(Self {
            mode: self.mode,
            young: mean(|p| p.young),
            shear_ratio: mean(|p| p.shear_ratio),
            cohesion: mean(|p| p.cohesion),
            friction_coefficient,
            crack_onset_strain: mean(|p| p.crack_onset_strain),
            relative_ductility: mean(|p| p.relative_ductility),
            fracture_energy: mean(|p| p.fracture_energy),
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
            plasticity_time: mean(|p| p.plasticity_time),
            plasticity_rate_exponent: mean(|p| p.plasticity_rate_exponent),
        })
    }

    /// Check every value against its range, and every option against the formulation.
    ///
    /// All callers use this rule: [`CpmFormulation::Thesis`] and [`CpmFormulation::Woo`] have all options;
    /// [`CpmFormulation::YadePublic`] has neither other yield surfaces nor viscosity, see
    /// [`CpmFormulation::has_full_model`].
    pub fn validate(&self) -> Result<(), CpmError> {
        check("young", self.young, self.young > 0.0, "positive")?;
        check("shear_ratio", self.shear_ratio, self.shear_ratio >= 0.0, "zero or positive")?;
        check("cohesion", self.cohesion, self.cohesion >= 0.0, "zero or positive")?;
        let friction = self.friction_coefficient;
        check("friction_coefficient", friction, friction >= 0.0, "zero or positive")?;
        check("crack_onset_strain", self.crack_onset_strain, self.crack_onset_strain > 0.0, "positive")?;
        let (ductility, energy) = (self.relative_ductility, self.fracture_energy);
        check("fracture_energy", energy, energy >= 0.0, "zero or positive")?;
        match self.damage_law {
            _ if energy > 0.0 && ductility != 0.0 => return Err(CpmError::SoftensTwice),
            _ if energy > 0.0 && self.mode != CpmFormulation::Thesis => return Err(CpmError::OnlyInThesis),
            _ if energy > 0.0 => {}
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
        self.validate_options()
    }

    /// Check yield surface and viscosity.
    fn validate_options(&self) -> Result<(), CpmError> {
        if matches!(self.yield_surface, YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear) {
            check("yield_log_speed", self.yield_log_speed, self.yield_log_speed > 0.0, "positive")?;
            check("cohesion", self.cohesion, self.cohesion > 0.0, "positive with a logarithmic yield surface")?;
        }
        if self.damage_time > 0.0 {
            check("damage_time", self.damage_time, true, "finite")?;
            let exponent = self.damage_rate_exponent;
            check("damage_rate_exponent", exponent, exponent > 0.0, "positive with viscous damage")?;
        }
        if self.plasticity_time > 0.0 {
            check("plasticity_time", self.plasticity_time, true, "finite")?;
            let exponent = self.plasticity_rate_exponent;
            check("plasticity_rate_exponent", exponent, exponent > 0.0, "positive with viscous slip")?;
            check("cohesion", self.cohesion, self.cohesion > 0.0, "positive with viscous slip")?;
            check("shear_ratio", self.shear_ratio, self.shear_ratio > 0.0, "positive with viscous slip")?;
        }
        if !self.mode.has_full_model() {
            if self.yield_surface != YieldSurface::MohrCoulomb {
                return Err(CpmError::NotInYade { name: "yield_surface" });
            }
            if self.damage_time > 0.0 {
                return Err(CpmError::NotInYade { name: "damage_time" });
            }
            if self.plasticity_time > 0.0 {
                return Err(CpmError::NotInYade { name: "plasticity_time" });
            }
        }
        Ok(())
    }

    /// Shear modulus Ḡ, Pa.
    pub fn shear_modulus(&self) -> f64 {
        self.young * self.shear_ratio
    }

    /// Softening strain ε_f of a bond of the length `length` (m), 1; see the [module documentation](super). Not positive, or with linear
    /// damage not above ε₀, if the bond is longer than [`Self::longest_bond`].
    pub fn softening_strain(&self, length: f64) -> f64 {
        self.crack_onset_strain
            * if self.fracture_energy > 0.0 {
                ductility_of(self.damage_law, self.characteristic_length() / length)
            } else {
                self.relative_ductility
            }
    }

    /// With the softening strain of `ductility` times ε₀ for a bond of the length `length` (m): by a fracture energy if there is one, for bonds
    /// of all lengths if not.
    #[must_use]
    pub fn with_ductility(mut self, ductility: f64, length: f64) -> Self {
        if self.fracture_energy > 0.0 {
            let ratio = match self.damage_law {
                DamageLaw::Linear => 0.5 * ductility,
                DamageLaw::Exponential => ductility + 0.5,
            };
            self.fracture_energy = ratio * length * self.young * (self.crack_onset_strain * self.crack_onset_strain);
        } else {
            self.relative_ductility = ductility;
        }
        self
    }

    /// Length G/(Ēε₀²), m, over which the elastic energy at the onset of cracks is half of the fracture energy; 0 without fracture energy.
    pub fn characteristic_length(&self) -> f64 {
        self.fracture_energy / (self.young * self.crack_onset_strain * self.crack_onset_strain)
    }

    /// Length, m, from which on a bond stores more energy at the onset of cracks than its fracture energy; infinite without one.
    pub fn longest_bond(&self) -> f64 {
        if self.fracture_energy > 0.0 { 2.0 * self.characteristic_length() } else { f64::INFINITY }
    }

    /// Elastic strain at the plastic limit in compression, of a contact with the strain `strain` beyond it.
    #[inline(always)]
    pub(super) fn strain_at_limit(&self, strain: f64) -> f64 {
        (self.soft_strain + self.relative_soft_stiffness * (strain - self.soft_strain)).min(0.0)
    }

    fn prestress_is_beyond_the_plastic_limit(&self) -> bool {
        self.mode == CpmFormulation::Thesis
            && self.soft_strain < 0.0
            && self.isotropic_prestress < self.young * self.soft_strain
    }

    /// Normal strain of a bond under the isotropic prestress alone (Šmilauer 2010, "Isotropic confinement").
    pub(super) fn prestress_strain(&self) -> f64 {
        if self.mode == CpmFormulation::Woo {
            0.0
        } else if self.prestress_is_beyond_the_plastic_limit() {
            self.soft_strain
                + (self.isotropic_prestress - self.young * self.soft_strain)
                    / (self.young * self.relative_soft_stiffness)
        } else {
            self.isotropic_prestress / self.young
        }
    }
}

/// ε_f/ε₀ of a bond whose characteristic length is `ratio` times its length: the area under its stress over strain is G/L.
#[inline]
pub(super) fn ductility_of(damage_law: DamageLaw, ratio: f64) -> f64 {
    match damage_law {
        DamageLaw::Linear => 2.0 * ratio,
        DamageLaw::Exponential => ratio - 0.5,
    }
}

/// Return an error unless `holds` and the value is finite.
pub(super) fn check(name: &'static str, value: f64, holds: bool, requirement: &'static str) -> Result<(), CpmError> {
    if holds && value.is_finite() { Ok(()) } else { Err(CpmError::OutOfRange { name, value, requirement }) }
}
