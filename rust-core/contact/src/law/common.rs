//! Code that several laws share: parameter errors, energy bookkeeping, and a dashpot under a Coulomb limit.

use super::EnergySplit;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::Vec3;

/// A parameter of a law outside its valid range.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "std", derive(thiserror::Error))]
#[non_exhaustive]
pub enum ParameterError {
    /// A value outside of its range.
    #[cfg_attr(feature = "std", error("law {law}: {parameter} = {value} must be {requirement}"))]
    OutOfRange {
        /// Name of the law.
        law: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// Value given, in SI units.
        value: f64,
        /// Range of valid values.
        requirement: &'static str,
    },
    /// Tables of two materials that cannot be combined.
    #[cfg_attr(feature = "std", error("{0}"))]
    Unlike(&'static str),
    /// The concrete particle model rejects its parameters.
    #[cfg_attr(feature = "std", error(transparent))]
    Cpm(super::cpm::CpmError),
}

/// Return an error unless `accepted`. Comparisons with NaN are false, so NaN is an error too.
pub fn require(
    accepted: bool,
    law: &'static str,
    parameter: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), ParameterError> {
    if accepted { Ok(()) } else { Err(ParameterError::OutOfRange { law, parameter, value, requirement }) }
}

/// Strength of a bond between two materials: the mean of their strengths. If one of them never breaks (`None`), the bond has
/// the strength of the other; if both, it is infinite.
pub fn mean_strength(a: Option<f64>, b: Option<f64>) -> f64 {
    match (a, b) {
        (Some(a), Some(b)) => 0.5 * (a + b),
        (one, other) => one.or(other).unwrap_or(f64::INFINITY),
    }
}

impl EnergySplit {
    /// All stored energy, J.
    #[inline]
    pub fn stored(&self) -> f64 {
        self.stored_normal + self.stored_shear + self.stored_bending + self.stored_twist
    }

    /// All energy dissipated in the step, J.
    #[inline]
    pub fn dissipated(&self) -> f64 {
        self.damage + self.friction + self.viscous
    }

    /// Add the trapezoidal work `½(f_old + f_new)·Δ` of a dashpot (J).
    ///
    /// A dashpot's force comes from the mean rate of the step and lags by half a step. In a step that reverses the motion the
    /// rule can therefore give a negative work. This error of third order in the step is no dissipation; it goes to
    /// [`integration`](Self::integration).
    #[inline(always)]
    pub fn add_viscous(&mut self, work: f64) {
        self.viscous += work.max(0.0);
        self.integration += work.min(0.0);
    }

    /// Add the trapezoidal work `½(f_old + f_new)·slip` of friction (J).
    ///
    /// It is never negative while the friction limit is constant. It can be negative if sliding reverses and the limit falls
    /// in the same step. This error of the rule goes to [`integration`](Self::integration).
    #[inline(always)]
    pub fn add_friction(&mut self, work: f64) {
        self.friction += work.max(0.0);
        self.integration += work.min(0.0);
    }
}

/// `1/dt`, and 0 for a step without duration, in which dashpot forces are zero.
#[inline(always)]
pub fn reciprocal_of_step(dt: f64) -> f64 {
    if dt > 0.0 { 1.0 / dt } else { 0.0 }
}

/// The largest part `s·dashpot`, `0 ≤ s ≤ 1`, for which `|elastic + s·dashpot| ≤ limit`, given `|elastic| ≤ limit`.
///
/// It keeps the direction of the dashpot's force, so the dashpot never drives the motion. Without branches, so that it runs in columns.
#[inline(always)]
pub fn dashpot_within_limit(elastic: &Vec3, dashpot: &Vec3, limit: f64) -> Vec3 {
    let fits = (elastic + dashpot).norm_squared() <= limit * limit;
    // |e|² + 2s e·d + s²|d|² = limit², positive root. Clip `room` at zero because of rounding where |e| = limit.
    let squared = dashpot.norm_squared();
    let projection = elastic.dot(dashpot);
    let room = (limit * limit - elastic.norm_squared()).max(0.0);
    let root = (projection * projection + squared * room).sqrt();
    let scale = if projection > 0.0 { room / (projection + root) } else { (root - projection) / squared };
    // The 0/0 of a dashpot without force becomes 0.
    let scale = if scale > 0.0 { scale.min(1.0) } else { 0.0 };
    dashpot * if fits { 1.0 } else { scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashpot_is_cut_exactly_to_the_limit() {
        let elastic = Vec3::new(0.3, -0.2, 0.1);
        for (dashpot, scale) in [
            // Within the limit: unchanged.
            (Vec3::new(0.1, 0.1, 0.0), 1.0),
            // Along the elastic force, limit 1: s = (1 − |e|)/|d| with |d| = 2|e|
            (elastic * 2.0, (1.0 - elastic.norm()) / (2.0 * elastic.norm())),
            // Against it: s = (1 + |e|)/|d| with |d| = 7|e|
            (elastic * -7.0, (1.0 + elastic.norm()) / (7.0 * elastic.norm())),
        ] {
            let cut = dashpot_within_limit(&elastic, &dashpot, 1.0);
            // A handful of roundings of numbers of order 1.
            assert!((cut - dashpot * scale).norm() < 1e-15, "{cut} {scale}");
        }
    }

    #[test]
    fn no_room_means_no_dashpot() {
        let elastic = Vec3::new(1.0, 0.0, 0.0);
        assert_eq!(dashpot_within_limit(&elastic, &Vec3::new(3.0, 0.0, 0.0), 1.0), Vec3::zeros());
        assert_eq!(dashpot_within_limit(&Vec3::zeros(), &Vec3::new(3.0, 1.0, 0.0), 0.0), Vec3::zeros());
    }

    /// A spring at the limit may exceed it by rounding. A dashpot without force stays without force.
    #[test]
    fn no_dashpot_is_cut_to_none() {
        let mut beyond = 0;
        for k in 1..100 {
            let elastic = Vec3::new(0.3, -0.2, 0.1) * f64::from(k).sqrt();
            let limit = elastic.norm();
            beyond += i32::from(elastic.norm_squared() > limit * limit);
            assert_eq!(dashpot_within_limit(&elastic, &Vec3::zeros(), limit), Vec3::zeros());
        }
        assert!(beyond > 10, "{beyond}");
    }

    #[test]
    fn a_bond_with_an_unbreakable_material_keeps_its_strength() {
        assert_eq!(mean_strength(Some(1.0), None), 1.0);
        assert_eq!(mean_strength(None, Some(3.0)), 3.0);
        assert_eq!(mean_strength(Some(1.0), Some(3.0)), 2.0);
        assert_eq!(mean_strength(None, None), f64::INFINITY);
    }

    #[test]
    fn nan_is_refused() {
        let value = f64::NAN;
        let error = require(value >= 0.0, "law", "parameter", value, "positive").unwrap_err();
        assert_eq!(error.to_string(), "law law: parameter = NaN must be positive");
    }
}
