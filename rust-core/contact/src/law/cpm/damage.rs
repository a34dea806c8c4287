//! Damage functions of the cohesive particle model, their inverses, and the residual strength.

use super::parameters::{CpmError, DamageLaw, ductility_of};
use super::{Cpm, CpmState, Softening};
use crate::math;

impl Cpm {
    /// Softening of a bond of the length `length`, m.
    #[inline]
    pub(super) fn softening(&self, length: f64) -> Softening {
        if self.characteristic_length == 0.0 {
            return self.softening;
        }
        let ductility = ductility_of(self.parameters.damage_law, self.characteristic_length / length);
        Softening::of(self.parameters.crack_onset_strain, self.parameters.crack_onset_strain * ductility)
    }

    /// Damage ω = g(κ) of a bond of the length `length` (m), (2.17); 0 up to ε₀.
    #[inline]
    pub fn damage_function(&self, kappa: f64, length: f64) -> f64 {
        let p = &self.parameters;
        // With this comparison a NaN stays visible; `!(κ > ε₀)` would make it undamaged.
        if kappa <= p.crack_onset_strain || p.never_damage {
            return 0.0;
        }
        let ratio = p.crack_onset_strain / kappa;
        let softening = self.softening(length);
        match p.damage_law {
            DamageLaw::Linear => ((1.0 - ratio) * softening.linear_factor).min(1.0),
            DamageLaw::Exponential => 1.0 - ratio * math::exp((p.crack_onset_strain - kappa) * softening.inverse),
        }
    }

    /// The κ that gives a bond of the length `length` (m) the damage `omega`: the inverse of [`Self::damage_function`], ε₀ for 0.
    ///
    /// Linear: ε₀/(1 − ω(1 − ε₀/ε_f)). Exponential: with u = κ/ε_f and a = ε₀/ε_f the root of
    /// u + ln u = a + ln a − ln(1−ω), by Newton's method to machine precision; infinite for ω = 1.
    pub fn kappa_of_damage(&self, omega: f64, length: f64) -> Result<f64, CpmError> {
        let p = &self.parameters;
        if !(0.0..=1.0).contains(&omega) {
            return Err(CpmError::OutOfRange { name: "omega", value: omega, requirement: "from 0 to 1" });
        }
        if omega == 0.0 {
            return Ok(p.crack_onset_strain);
        }
        let a = p.crack_onset_strain * self.softening(length).inverse;
        match p.damage_law {
            DamageLaw::Linear => Ok(p.crack_onset_strain / (1.0 - omega * (1.0 - a))),
            DamageLaw::Exponential if omega == 1.0 => Ok(f64::INFINITY),
            DamageLaw::Exponential => {
                // With κ = ε₀(1+t): a t + ln(1+t) = −ln(1−ω). The left side is concave and increasing, so Newton's method
                // rises towards the root from any t below it.
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
                Ok(p.crack_onset_strain * (1.0 + t))
            }
        }
    }

    /// Residual strength at κ relative to the intact strength: r = (1 − g(κ)) κ/ε₀, and 1 up to ε₀.
    ///
    /// Exponential: exp(−(κ−ε₀)/ε_f). Linear: (ε_f−κ)/(ε_f−ε₀), not below 0.
    pub fn relative_residual_strength(&self, kappa: f64, length: f64) -> f64 {
        1.0 - self.strength_damage(kappa, length)
    }

    /// Damage of the strength at κ, ω̂ = 1 − (1−ω)κ/ε₀ (Stránský 2018, (6.6)), clamped to 0 up to ε₀.
    pub fn strength_damage(&self, kappa: f64, length: f64) -> f64 {
        let p = &self.parameters;
        if kappa <= p.crack_onset_strain || p.never_damage {
            return 0.0;
        }
        let softening = self.softening(length);
        match p.damage_law {
            DamageLaw::Linear => ((kappa - p.crack_onset_strain) / (softening.strain - p.crack_onset_strain)).min(1.0),
            DamageLaw::Exponential => -libm::expm1((p.crack_onset_strain - kappa) * softening.inverse),
        }
    }

    /// The κ that gives the damage of the strength `omega_hat`: the inverse of [`Self::strength_damage`].
    pub fn kappa_of_strength_damage(&self, omega_hat: f64, length: f64) -> Result<f64, CpmError> {
        let p = &self.parameters;
        if !(0.0..=1.0).contains(&omega_hat) {
            return Err(CpmError::OutOfRange { name: "omega_hat", value: omega_hat, requirement: "from 0 to 1" });
        }
        let softening = self.softening(length);
        Ok(match p.damage_law {
            DamageLaw::Linear => p.crack_onset_strain + omega_hat * (softening.strain - p.crack_onset_strain),
            DamageLaw::Exponential => p.crack_onset_strain - softening.strain * libm::log1p(-omega_hat),
        })
    }

    /// History of an unstrained bond of the length `length` (m) with damage `omega`.
    pub fn damaged_state(&self, omega: f64, length: f64) -> Result<CpmState, CpmError> {
        Ok(CpmState { kappa: self.kappa_of_damage(omega, length)?, omega, ..CpmState::default() })
    }
}
