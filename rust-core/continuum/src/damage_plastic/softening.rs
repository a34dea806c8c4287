//! Damage after the strength, with a fracture energy that does not depend on the element size.

use concordem_contact::math::{exp, ln};

/// Exponential softening: the stress in simple tension is `f_t exp(−w/w_f)` at an opening `w = h (κ_D + ω f_t/E)`, with
/// `w_f = G_f/f_t` and the element size `h`. Hence `1 − ω = exp(−h (κ_D + ω f_t/E)/w_f)`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Softening {
    /// `a = h f_t/(E w_f)`, below 1: otherwise the element snaps back.
    pub elastic: f64,
    /// `h/w_f`.
    pub slope: f64,
}

impl Softening {
    /// `ω` and `dω/dκ_D`.
    ///
    /// `u = 1 − ω` solves `ln u + a(1−u) + b = 0` with `b = h κ_D/w_f`. The left side increases and is concave below `1/a`, so Newton
    /// steps from below rise to the solution.
    pub fn damage(&self, kappa: f64) -> (f64, f64) {
        if kappa <= 0.0 {
            return (0.0, self.slope / (1.0 - self.elastic));
        }
        let (a, b) = (self.elastic, self.slope * kappa);
        let mut u = exp(-a - b);
        if u == 0.0 {
            return (1.0, 0.0);
        }
        for _ in 0..64 {
            let next = (u - u * (ln(u) + a * (1.0 - u) + b) / (1.0 - a * u)).min(1.0);
            // Rounding ends the rise.
            if next <= u {
                break;
            }
            u = next;
        }
        (1.0 - u, self.slope * u / (1.0 - a * u))
    }

    /// `κ_D = −((w_f/h) ln(1−ω) + ω f_t/E)` of a damage below 1.
    pub fn variable(&self, damage: f64) -> f64 {
        ((-ln(1.0 - damage) - self.elastic * damage) / self.slope).max(0.0)
    }
}

/// Ductility of damage `x_s(R)` and `dx_s/dR`, where `R` is the sum of the negative principal plastic strain increments over the
/// increment of volume: `1 + A_s R²` for `R < 1`, else `1 − 3A_s + 4A_s √R` (Grassl and Jirásek 2006, (44)).
pub fn ductility(softness: f64, r: f64) -> (f64, f64) {
    if r < 1.0 {
        (1.0 + softness * r * r, 2.0 * softness * r)
    } else {
        (1.0 - 3.0 * softness + 4.0 * softness * r.sqrt(), 2.0 * softness / r.sqrt())
    }
}
