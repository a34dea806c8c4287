//! Hardening, and its ductility under confinement (Grassl and Jirásek 2006, section 3.3).

use concordem_contact::math::exp;

/// The hardening law `q(κ) = q₀ + (1−q₀) κ(κ² − 3κ + 3)` for κ < 1, else 1, with the ductility `x_h(σ_V)` of
///
/// ```text
/// κ̇ = ‖ε̇_p‖ (2 cos θ)²/x_h,   x = −σ_V/f_c − 1/3
/// x_h = A_h − (A_h − B_h) exp(−x/C_h)            x ≥ 0
/// x_h = (B_h − D_h) exp(x/F_h) + D_h             x < 0,   F_h = (B_h − D_h) C_h/(A_h − B_h)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hardening {
    /// `q₀`: first yield over strength.
    pub initial: f64,
    /// `A_h`: ductility at high pressure.
    pub confined: f64,
    /// `B_h`: ductility in simple compression.
    pub compression: f64,
    /// `C_h`: pressure over strength at which it changes.
    pub pressure: f64,
    /// `D_h`: least ductility, in tension.
    pub tension: f64,
}

impl Hardening {
    /// `q` and `dq/dκ`.
    pub fn variable(&self, kappa: f64) -> (f64, f64) {
        if kappa >= 1.0 {
            return (1.0, 0.0);
        }
        let rest = 1.0 - kappa;
        // κ(κ² − 3κ + 3) = 1 − (1−κ)³, without cancellation near κ = 1.
        (1.0 - (1.0 - self.initial) * rest * rest * rest, 3.0 * (1.0 - self.initial) * rest * rest)
    }

    /// `x_h` and its derivative with respect to `s = σ_V/f_c`.
    pub fn ductility(&self, s: f64) -> (f64, f64) {
        let x = -s - 1.0 / 3.0;
        if x >= 0.0 {
            let decaying = (self.confined - self.compression) * exp(-x / self.pressure);
            (self.confined - decaying, -decaying / self.pressure)
        } else {
            let rise = self.compression - self.tension;
            let scale = rise * self.pressure / (self.confined - self.compression);
            let growing = rise * exp(x / scale);
            (growing + self.tension, -growing / scale)
        }
    }
}
