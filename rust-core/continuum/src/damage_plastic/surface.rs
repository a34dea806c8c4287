//! Yield function and plastic potential, in stresses over the compressive strength.
//!
//! With `s = σ_V/f_c`, `p = ρ/f_c`, `B = s + p/√6`, `X = (1−q)B² + √(3/2) p` (Grassl and Jirásek 2006, (18) and (22)):
//!
//! ```text
//! f = X² + q² m (s + p r(cos θ)/√6) − q²
//! g = X² + q² (m p/√6 + ∫ m_Q ds),  m_Q = A exp((s − f_t/(3f_c))/C)
//! ```
//!
//! `A` and `C` follow from two flow directions on the final surface: no lateral plastic strain in simple tension; a ratio
//! `dilation` of lateral to axial plastic strain in simple compression.

use concordem_contact::math::{exp, ln};

use crate::error::ContinuumError;

const SQRT6: f64 = 2.449_489_742_783_178;
const SQRT_3_2: f64 = 1.224_744_871_391_589;

/// The constants of the surfaces.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Friction `m = 3 (f_c² − f_t²)/(f_c f_t) e/(e+1)`.
    pub friction: f64,
    /// Eccentricity `e` of the deviatoric section.
    eccentricity: f64,
    /// Strength ratio `f_t/f_c`.
    ratio: f64,
    /// `A = 3 f_t/f_c + m/2`.
    dilatancy: f64,
    /// `C`: decay of the dilatancy with the mean stress.
    decay: f64,
}

/// Value and derivatives of the yield function.
#[derive(Debug, Clone, Copy)]
pub struct Yield {
    /// `f`.
    pub value: f64,
    /// `∂f/∂s`.
    pub by_mean: f64,
    /// `∂f/∂p`.
    pub by_deviator: f64,
    /// `∂f/∂q`.
    pub by_hardening: f64,
    /// `∂f/∂cos θ`.
    pub by_cos_lode: f64,
}

/// First and second derivatives of the plastic potential.
#[derive(Debug, Clone, Copy)]
pub struct Flow {
    /// `∂g/∂s`.
    pub mean: f64,
    /// `∂g/∂p`.
    pub deviator: f64,
    /// `∂²g/∂s²`.
    pub mean_mean: f64,
    /// `∂²g/∂s∂p`.
    pub mean_deviator: f64,
    /// `∂²g/∂p²`.
    pub deviator_deviator: f64,
    /// `∂²g/∂s∂q`.
    pub mean_hardening: f64,
    /// `∂²g/∂p∂q`.
    pub deviator_hardening: f64,
}

impl Surface {
    /// From `f_t/f_c`, the eccentricity, and the ratio of lateral to axial plastic strain in simple compression (−1 … −½).
    pub fn new(ratio: f64, eccentricity: f64, dilation: f64) -> Self {
        let friction = 3.0 * (1.0 - ratio * ratio) / ratio * eccentricity / (eccentricity + 1.0);
        let dilatancy = 3.0 * ratio + 0.5 * friction;
        let compression = (1.0 + 2.0 * dilation) / (dilation - 1.0) * (3.0 + 0.5 * friction);
        let decay = -(1.0 + ratio) / (3.0 * ln(compression / dilatancy));
        Self { friction, eccentricity, ratio, dilatancy, decay }
    }

    /// Whether the flow direction is well defined everywhere.
    ///
    /// On the cap, `√6 ∂g/∂p = 3(1−q)s²(2 − (1−q)|s|)` up to terms of the order `1/m`, where `(1−q)|s|` is at most `(4m/27)^(1/3)`:
    /// positive for `m < 54`. Above, stresses near the hydrostatic axis return away from it.
    pub fn check(&self, tensile_strength: f64) -> Result<(), ContinuumError> {
        let demand = if self.friction >= 50.0 {
            format!(
                "it is too small for the compressive strength: the friction m = {:.4} of the yield surface must be less than 50",
                self.friction
            )
        } else if !(self.decay > 0.0 && self.decay.is_finite()) {
            "with this dilation the dilatancy does not fall with pressure; use a greater dilation, or a larger strength ratio".to_owned()
        } else {
            return Ok(());
        };
        Err(ContinuumError::Parameter { name: "tensile_strength", value: tensile_strength, demand })
    }

    /// Radius ratio `r(cos θ)` of Willam and Warnke, and its derivative: 1 in simple compression, `1/e` in simple tension.
    fn section(&self, c: f64) -> (f64, f64) {
        let e = self.eccentricity;
        let (a, b) = (4.0 * (1.0 - e * e), 2.0 * e - 1.0);
        let root = (a * c * c + 5.0 * e * e - 4.0 * e).max(0.0).sqrt();
        let top = a * c * c + b * b;
        let bottom = 0.5 * a * c + b * root;
        let bottom_slope = 0.5 * a + b * a * c / root;
        (top / bottom, (2.0 * a * c * bottom - top * bottom_slope) / (bottom * bottom))
    }

    /// Yield function at mean stress `s`, deviator `p`, hardening variable `q`.
    pub fn yield_function(&self, s: f64, p: f64, q: f64, cos_lode: f64) -> Yield {
        let (r, slope) = self.section(cos_lode);
        let m = self.friction;
        let b = s + p / SQRT6;
        let x = (1.0 - q) * b * b + SQRT_3_2 * p;
        let y = s + p * r / SQRT6;
        Yield {
            value: x * x + q * q * (m * y - 1.0),
            by_mean: 4.0 * (1.0 - q) * b * x + q * q * m,
            by_deviator: 2.0 * x * (2.0 * (1.0 - q) * b / SQRT6 + SQRT_3_2) + q * q * m * r / SQRT6,
            by_hardening: -2.0 * x * b * b + 2.0 * q * (m * y - 1.0),
            by_cos_lode: q * q * m * p * slope / SQRT6,
        }
    }

    /// Derivatives of the plastic potential at mean stress `s`, deviator `p`, hardening variable `q`.
    pub fn flow(&self, s: f64, p: f64, q: f64) -> Flow {
        let m = self.friction;
        let b = s + p / SQRT6;
        let x = (1.0 - q) * b * b + SQRT_3_2 * p;
        let x_by_p = 2.0 * (1.0 - q) * b / SQRT6 + SQRT_3_2;
        let dilatancy = self.dilatancy * exp((s - self.ratio / 3.0) / self.decay);
        Flow {
            mean: 4.0 * (1.0 - q) * b * x + q * q * dilatancy,
            deviator: 2.0 * x * x_by_p + q * q * m / SQRT6,
            mean_mean: 4.0 * (1.0 - q) * (x + 2.0 * (1.0 - q) * b * b) + q * q * dilatancy / self.decay,
            mean_deviator: 4.0 * (1.0 - q) * (x / SQRT6 + b * x_by_p),
            deviator_deviator: 2.0 * x_by_p * x_by_p + 2.0 * (1.0 - q) * x / 3.0,
            mean_hardening: -4.0 * b * x - 4.0 * (1.0 - q) * b * b * b + 2.0 * q * dilatancy,
            deviator_hardening: -2.0 * b * b * x_by_p - 4.0 * x * b / SQRT6 + 2.0 * q * m / SQRT6,
        }
    }
}
