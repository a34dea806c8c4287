//! What several laws share: errors of parameters, energy bookkeeping, and the dashpot under a Coulomb limit.

use super::EnergySplit;
use crate::math::Vec3;

/// A law's parameter that makes no sense.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// A value outside of its range.
    #[error("law {law}: {parameter} = {value} must be {requirement}")]
    OutOfRange {
        /// Name of the law.
        law: &'static str,
        /// Name of the parameter.
        parameter: &'static str,
        /// Offending value, in SI units.
        value: f64,
        /// What would be accepted.
        requirement: &'static str,
    },
    /// Tables of two materials that cannot be combined.
    #[error("{0}")]
    Unlike(&'static str),
    /// The concrete particle model refuses.
    #[error(transparent)]
    Cpm(#[from] super::cpm::CpmError),
}

/// Refuse a parameter unless `accepted`. Comparisons with NaN are false, so a NaN is refused too.
pub fn require(
    accepted: bool,
    law: &'static str,
    parameter: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), ParameterError> {
    if accepted { Ok(()) } else { Err(ParameterError::OutOfRange { law, parameter, value, requirement }) }
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

    /// Book the trapezoidal work `½(f_old + f_new)·Δ` of a dashpot (J).
    ///
    /// A dashpot's force lags by half a step (it is made of the mean rate of the step), so in a step in which the
    /// motion turns round the rule can give a negative work. That is an error of the rule, of third order in the
    /// step, and no dissipation; it is booked as such.
    #[inline(always)]
    pub fn add_viscous(&mut self, work: f64) {
        self.viscous += work.max(0.0);
        self.integration += work.min(0.0);
    }

    /// Book the trapezoidal work `½(f_old + f_new)·slip` of friction (J).
    ///
    /// With a constant friction limit it is never negative. It can be when the sliding turns round and the limit
    /// falls in the same step; that is an error of the rule and booked as such.
    #[inline(always)]
    pub fn add_friction(&mut self, work: f64) {
        self.friction += work.max(0.0);
        self.integration += work.min(0.0);
    }
}

/// `1/dt`, and 0 for a step without duration, in which a dashpot has nothing to say.
#[inline(always)]
pub fn reciprocal_of_step(dt: f64) -> f64 {
    if dt > 0.0 { 1.0 / dt } else { 0.0 }
}

/// The largest part `s·dashpot`, `0 ≤ s ≤ 1`, for which `|elastic + s·dashpot| ≤ limit`, given `|elastic| ≤ limit`.
///
/// It keeps the direction of the dashpot's force, so that the dashpot never drives the motion.
#[inline(always)]
pub fn dashpot_within_limit(elastic: &Vec3, dashpot: &Vec3, limit: f64) -> Vec3 {
    if (elastic + dashpot).norm_squared() <= limit * limit {
        return *dashpot;
    }
    // |e|² + 2s e·d + s²|d|² = limit², positive root; the room is clipped against rounding of |e| = limit
    let squared = dashpot.norm_squared();
    let projection = elastic.dot(dashpot);
    let room = (limit * limit - elastic.norm_squared()).max(0.0);
    let root = (projection * projection + squared * room).sqrt();
    let scale = if projection > 0.0 { room / (projection + root) } else { (root - projection) / squared };
    dashpot * scale.clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn dashpot_is_cut_exactly_to_the_limit() {
        let elastic = Vec3::new(0.3, -0.2, 0.1);
        for (dashpot, scale) in [
            // inside: untouched
            (Vec3::new(0.1, 0.1, 0.0), 1.0),
            // along the elastic force, limit 1: s = (1 − |e|)/|d| with |d| = 2|e|
            (elastic * 2.0, (1.0 - elastic.norm()) / (2.0 * elastic.norm())),
            // against it: s = (1 + |e|)/|d| with |d| = 7|e|
            (elastic * -7.0, (1.0 + elastic.norm()) / (7.0 * elastic.norm())),
        ] {
            let cut = dashpot_within_limit(&elastic, &dashpot, 1.0);
            // a handful of roundings of numbers of order 1
            assert!((cut - dashpot * scale).norm() < 1e-15, "{cut} {scale}");
        }
    }

    #[test]
    fn no_room_means_no_dashpot() {
        let elastic = Vec3::new(1.0, 0.0, 0.0);
        assert_eq!(dashpot_within_limit(&elastic, &Vec3::new(3.0, 0.0, 0.0), 1.0), Vec3::zeros());
        assert_eq!(dashpot_within_limit(&Vec3::zeros(), &Vec3::new(3.0, 1.0, 0.0), 0.0), Vec3::zeros());
    }

    #[test]
    fn nan_is_refused() {
        let value = f64::NAN;
        let error = require(value >= 0.0, "law", "parameter", value, "positive").unwrap_err();
        assert_eq!(error.to_string(), "law law: parameter = NaN must be positive");
    }
}
