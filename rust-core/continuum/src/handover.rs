//! The state of a packing of the concrete particle model as a state of the damage-plastic model (Stránský 2018, section 6.2).
//!
//! Per point of the continuum: average the stress and the damage of the bonds near it; reduce the damage tensor to a damage `ω`; then
//!
//! ```text
//! ω ≤ m:  κ_D = 0,        κ_P = 0.3 + 900 ω,  ω = 0          (6.15), (6.19), m = 5e-4
//! ω > m:  κ_D = g⁻¹(ω),   κ_P = 1 + κ_D                      (6.15)
//! ε = 0,  ε_p = −D_e⁻¹ : σ/(1−ω)                             (6.16)
//! ```
//!
//! The strain of the continuum counts from the hand-over, so that it starts with the stress of the packing. Where that stress lies
//! outside the yield surface, the first update returns it.

use concordem_contact::math::{Mat3, Vec3, exp, ln};
use serde::{Deserialize, Serialize};

use crate::damage_plastic::{DamagePlastic, State};
use crate::error::ContinuumError;
use crate::voigt::components;

/// Damage up to this is hardening of the continuum (Stránský 2018, (6.19)).
const HARDENING_DAMAGE: f64 = 5e-4;
/// Hardening variable of an undamaged packing, and its slope (Stránský 2018, (6.19)).
const HARDENING: (f64, f64) = (0.3, 900.0);

/// Mean damage of bonds, `⟨ω̂⟩` and `⟨ω̂ n⊗n⟩`, from which both damage tensors follow.
///
/// `ω̂` is the fraction of the strength that a link has lost, 1 for links that broke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkDamage {
    /// `⟨ω̂⟩`.
    pub scalar: f64,
    /// `⟨ω̂ n⊗n⟩`.
    pub dyad: Mat3,
}

impl LinkDamage {
    /// Of links with these unit directions and damages, in this order.
    ///
    /// # Errors
    /// No links; lists of different length; numbers that are not finite.
    pub fn of(normals: &[Vec3], damages: &[f64]) -> Result<Self, ContinuumError> {
        if normals.is_empty() || normals.len() != damages.len() {
            return Err(ContinuumError::Links { normals: normals.len(), damages: damages.len() });
        }
        let mut mean = Self { scalar: 0.0, dyad: Mat3::zeros() };
        for (normal, damage) in normals.iter().zip(damages) {
            mean.scalar += damage;
            mean.dyad += normal * normal.transpose() * *damage;
        }
        mean.scalar /= normals.len() as f64;
        mean.dyad /= normals.len() as f64;
        if mean.scalar.is_finite() && mean.dyad.iter().all(|value| value.is_finite()) {
            Ok(mean)
        } else {
            Err(ContinuumError::NotFinite { what: "damage of the bonds" })
        }
    }
}

/// Damage tensor and damage of a point. The two pairs of formulas give similar damages; the tensor of one in the damage of the other
/// is wrong by an order of magnitude, so they come together.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum HandOver {
    /// The thesis: `Ω = −(3/2)⟨ω̂⟩1 + (15/2)⟨ω̂ n⊗n⟩` (6.13) and `ω = 2.09 (0.85 Ω₁ + 0.15 Ω₃)^4.7` (6.17).
    Printed,
    /// The author's programs, behind the published figures: `Ω' = −(3/2)⟨ω̂⟩1 + (12/2)⟨ω̂ n⊗n⟩` and
    /// `ω = (2.09 (0.85 Ω'₁ + 0.15 Ω'₃))^4.7`.
    Coded,
}

impl HandOver {
    /// Damage tensor.
    pub fn tensor(self, links: &LinkDamage) -> Mat3 {
        let weight = match self {
            Self::Printed => 7.5,
            Self::Coded => 6.0,
        };
        links.dyad * weight - Mat3::identity() * (1.5 * links.scalar)
    }

    /// Damage `ω`, 0 to 1, of a damage tensor with the largest principal value `Ω₁` and the smallest `Ω₃`. A negative argument of the
    /// power is no damage.
    pub fn damage(self, tensor: &Mat3) -> f64 {
        let values = ((tensor + tensor.transpose()) * 0.5).symmetric_eigenvalues();
        let argument = 0.85 * values.max() + 0.15 * values.min();
        if argument <= 0.0 {
            return 0.0;
        }
        let power = |base: f64| exp(4.7 * ln(base));
        let damage = match self {
            Self::Printed => 2.09 * power(argument),
            Self::Coded => power(2.09 * argument),
        };
        damage.min(1.0)
    }

    /// The state of the continuum at zero strain with this stress (Pa) and damage `ω`, in an element of this size (m).
    ///
    /// # Errors
    /// A damage of 1, which leaves no stress; a stress that is not finite; an element that snaps back.
    pub fn state(law: &DamagePlastic, stress: &Mat3, damage: f64, size: f64) -> Result<State, ContinuumError> {
        if !stress.iter().all(|value| value.is_finite()) {
            return Err(ContinuumError::NotFinite { what: "stress" });
        }
        let variable = law.damage_variable(damage, size)?;
        let (damage, variable, hardening) = if damage <= HARDENING_DAMAGE {
            (0.0, 0.0, HARDENING.0 + HARDENING.1 * damage)
        } else {
            (damage, variable, 1.0 + variable)
        };
        let stress = (stress + stress.transpose()) * 0.5;
        let plastic = law.elasticity().strain(&stress) / (damage - 1.0);
        Ok(State { plastic_strain: components(&plastic).into(), hardening, damage: variable })
    }
}
