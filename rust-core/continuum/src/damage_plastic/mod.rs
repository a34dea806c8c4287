//! The damage-plastic model of Grassl and Jirásek (2006), <https://doi.org/10.1016/j.ijsolstr.2006.06.032>: plasticity in the
//! effective stress, and isotropic damage that plastic strain drives.
//!
//! ```text
//! σ = (1−ω) D_e : (ε − ε_p)
//! ```
//!
//! Stránský 2018, chapter 6, hands the state of a packing over to it. The update is fully implicit: the result depends on the strain
//! at the end of the step and on the state before it.

mod hardening;
mod plastic_return;
mod softening;
mod surface;
mod update;

use concordem_contact::math::Mat3;
use serde::{Deserialize, Serialize};

use crate::elasticity::Elasticity;
use crate::error::ContinuumError;
use crate::voigt::{components, tensor};
use hardening::Hardening;
use softening::Softening;
use surface::Surface;

pub use update::Update;

/// Parameters of the model, in SI units.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Parameters {
    /// Young's modulus, Pa.
    pub young: f64,
    /// Poisson's ratio.
    pub poisson: f64,
    /// Strength in simple compression, positive, Pa.
    pub compressive_strength: f64,
    /// Strength in simple tension, Pa.
    pub tensile_strength: f64,
    /// Fracture energy in tension, J/m².
    pub fracture_energy: f64,
    /// Eccentricity `e` of the deviatoric section, in (½, 1]; see [`Parameters::eccentricity_of_biaxial_strength`].
    pub eccentricity: f64,
    /// `q₀`: first yield over strength.
    pub initial_hardening: f64,
    /// `A_h`: hardening ductility at high pressure.
    pub confined_ductility: f64,
    /// `B_h`: hardening ductility in simple compression.
    pub compressive_ductility: f64,
    /// `C_h`: pressure over strength at which the ductility changes.
    pub ductility_pressure: f64,
    /// `D_h`: least hardening ductility, in tension.
    pub tensile_ductility: f64,
    /// Lateral over axial plastic strain at the strength in simple compression, in [−1, −½).
    pub dilation: f64,
    /// `A_s`: slows damage under compression.
    pub softening_ductility: f64,
}

impl Parameters {
    /// The default constants of the model for a material with these moduli (Pa), strengths (Pa), and fracture energy (J/m²).
    pub fn new(
        young: f64,
        poisson: f64,
        compressive_strength: f64,
        tensile_strength: f64,
        fracture_energy: f64,
    ) -> Self {
        Self {
            young,
            poisson,
            compressive_strength,
            tensile_strength,
            fracture_energy,
            eccentricity: 0.525,
            initial_hardening: 0.1,
            confined_ductility: 0.08,
            compressive_ductility: 0.003,
            ductility_pressure: 2.0,
            tensile_ductility: 1e-6,
            dilation: -0.85,
            softening_ductility: 15.0,
        }
    }

    /// The eccentricity with which the strength in equal biaxial compression is `biaxial` (Pa):
    /// `e = (1+t)/(2−t)`, `t = (f_t/f_b) (f_b² − f_c²)/(f_c² − f_t²)`.
    pub fn eccentricity_of_biaxial_strength(compressive: f64, tensile: f64, biaxial: f64) -> f64 {
        let t = tensile / biaxial * (biaxial * biaxial - compressive * compressive)
            / (compressive * compressive - tensile * tensile);
        (1.0 + t) / (2.0 - t)
    }
}

/// What a point remembers.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Plastic strain `ε_p`: 11, 22, 33, 23, 31, 12 of the tensor (no factor 2).
    pub plastic_strain: [f64; 6],
    /// Hardening variable `κ_P`; the strength is reached at 1.
    pub hardening: f64,
    /// Damage variable `κ_D`.
    pub damage: f64,
}

impl State {
    /// Number of reals of a state.
    pub const REALS: usize = 8;
    /// A point without history.
    pub const VIRGIN: Self = Self { plastic_strain: [0.0; 6], hardening: 0.0, damage: 0.0 };

    /// The state as reals: plastic strain, `κ_P`, `κ_D`.
    pub fn to_reals(&self) -> [f64; Self::REALS] {
        let [a, b, c, d, e, f] = self.plastic_strain;
        [a, b, c, d, e, f, self.hardening, self.damage]
    }

    /// The state with these reals.
    pub fn from_reals(reals: &[f64; Self::REALS]) -> Self {
        let [a, b, c, d, e, f, hardening, damage] = *reals;
        Self { plastic_strain: [a, b, c, d, e, f], hardening, damage }
    }

    /// Plastic strain as a tensor.
    pub fn plastic_tensor(&self) -> Mat3 {
        tensor(&self.plastic_strain.into())
    }

    fn set_plastic_tensor(&mut self, strain: &Mat3) {
        self.plastic_strain = components(strain).into();
    }

    fn check(&self) -> Result<(), ContinuumError> {
        if !self.to_reals().iter().all(|real| real.is_finite()) {
            return Err(ContinuumError::NotFinite { what: "state" });
        }
        let demand = "it must not be negative";
        if self.hardening < 0.0 {
            return Err(ContinuumError::State { name: "the hardening variable", value: self.hardening, demand });
        }
        if self.damage < 0.0 {
            return Err(ContinuumError::State { name: "the damage variable", value: self.damage, demand });
        }
        if self.damage > 0.0 && self.hardening < 1.0 {
            let demand = "with damage it must be at least 1";
            return Err(ContinuumError::State { name: "the hardening variable", value: self.hardening, demand });
        }
        Ok(())
    }
}

impl Default for State {
    fn default() -> Self {
        Self::VIRGIN
    }
}

/// The law with checked parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DamagePlastic {
    parameters: Parameters,
    elasticity: Elasticity,
    surface: Surface,
    hardening: Hardening,
}

impl DamagePlastic {
    /// Check the parameters.
    ///
    /// # Errors
    /// A parameter out of range: the message gives its name and what it must be.
    pub fn new(parameters: Parameters) -> Result<Self, ContinuumError> {
        let p = &parameters;
        let elasticity = Elasticity::new(p.young, p.poisson)?;
        let check = |name: &'static str, value: f64, holds: bool, demand: &str| {
            if holds && value.is_finite() {
                Ok(())
            } else {
                Err(ContinuumError::Parameter { name, value, demand: demand.to_owned() })
            }
        };
        let positive = |name, value: f64| check(name, value, value > 0.0, "it must be positive");
        positive("compressive_strength", p.compressive_strength)?;
        positive("tensile_strength", p.tensile_strength)?;
        positive("fracture_energy", p.fracture_energy)?;
        let ratio = p.tensile_strength / p.compressive_strength;
        check("tensile_strength", p.tensile_strength, ratio < 1.0, "it must be less than the compressive strength")?;
        let e = p.eccentricity;
        check("eccentricity", e, e > 0.5 && e <= 1.0, "it must be greater than 0.5 and at most 1")?;
        let q = p.initial_hardening;
        check("initial_hardening", q, q > 0.0 && q < 1.0, "it must lie between 0 and 1")?;
        positive("tensile_ductility", p.tensile_ductility)?;
        let b = p.compressive_ductility;
        check("compressive_ductility", b, b > p.tensile_ductility, "it must be greater than tensile_ductility")?;
        let a = p.confined_ductility;
        check("confined_ductility", a, a > b, "it must be greater than compressive_ductility")?;
        positive("ductility_pressure", p.ductility_pressure)?;
        let d = p.dilation;
        check("dilation", d, (-1.0..-0.5).contains(&d), "it must be at least -1 and less than -0.5")?;
        let s = p.softening_ductility;
        check("softening_ductility", s, s >= 0.0, "it must not be negative")?;
        let surface = Surface::new(ratio, e, d);
        surface.check(p.tensile_strength)?;
        let hardening = Hardening {
            initial: q,
            confined: a,
            compression: b,
            pressure: p.ductility_pressure,
            tension: p.tensile_ductility,
        };
        Ok(Self { parameters, elasticity, surface, hardening })
    }

    /// The parameters.
    pub fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    /// The elastic part.
    pub fn elasticity(&self) -> &Elasticity {
        &self.elasticity
    }

    /// Friction `m` of the yield function.
    pub fn friction(&self) -> f64 {
        self.surface.friction
    }

    /// `q(κ_P)`: yield stress over strength in simple compression.
    pub fn hardening(&self, kappa: f64) -> f64 {
        self.hardening.variable(kappa).0
    }

    /// Size of the largest element that does not snap back, `E G_f/f_t²`, m.
    pub fn largest_size(&self) -> f64 {
        let p = &self.parameters;
        p.young * p.fracture_energy / (p.tensile_strength * p.tensile_strength)
    }

    fn softening(&self, size: f64) -> Result<Softening, ContinuumError> {
        let p = &self.parameters;
        let largest = self.largest_size();
        if !(size > 0.0 && size < largest) {
            let demand = format!(
                "it must be positive and less than E G_f/f_t^2 = {largest:e} m, above which the element snaps back; use smaller elements"
            );
            return Err(ContinuumError::Parameter { name: "size", value: size, demand });
        }
        let slope = size * p.tensile_strength / p.fracture_energy;
        Ok(Softening { elastic: slope * p.tensile_strength / p.young, slope })
    }

    /// Damage `ω` of a damage variable `κ_D` in an element of this size (m).
    ///
    /// # Errors
    /// A size that is not positive, or an element that snaps back.
    pub fn damage(&self, variable: f64, size: f64) -> Result<f64, ContinuumError> {
        Ok(self.softening(size)?.damage(variable).0)
    }

    /// Damage variable `κ_D` of a damage `ω`, 0 ≤ ω < 1, in an element of this size (m).
    ///
    /// # Errors
    /// A damage out of range, a size that is not positive, or an element that snaps back.
    pub fn damage_variable(&self, damage: f64, size: f64) -> Result<f64, ContinuumError> {
        if !(0.0..1.0).contains(&damage) {
            let demand = "it must be at least 0 and less than 1".to_owned();
            return Err(ContinuumError::Parameter { name: "damage", value: damage, demand });
        }
        Ok(self.softening(size)?.variable(damage))
    }
}
