//! Yield surfaces: the bound of the shear stress as a function of the normal stress. The plain thesis form uses Mohr–Coulomb
//! directly, the full model all of them.

use super::Cpm;
use super::parameters::YieldSurface;
#[cfg(not(feature = "std"))]
use crate::math::Real as _;

impl Cpm {
    /// Largest shear stress y(σ_N, ω) without flow, Pa (formulas in the [module documentation](super)).
    #[inline(always)]
    pub fn yield_stress(&self, normal_stress: f64, omega: f64) -> f64 {
        let p = &self.parameters;
        let (cohesion, tangent) = (p.cohesion, p.friction_coefficient);
        let radius = match p.yield_surface {
            YieldSurface::MohrCoulomb => self.mohr_coulomb(normal_stress, omega),
            YieldSurface::Parabolic => {
                (cohesion * (cohesion - 2.0 * tangent * normal_stress)).max(0.0).sqrt() - cohesion * omega
            }
            YieldSurface::LogarithmicLinear if normal_stress > 0.0 => self.mohr_coulomb(normal_stress, omega),
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

    /// `c₀(1−ω) − σ_N tan φ`, Pa; can be negative.
    #[inline(always)]
    pub(super) fn mohr_coulomb(&self, normal_stress: f64, omega: f64) -> f64 {
        self.parameters.cohesion * (1.0 - omega) - normal_stress * self.parameters.friction_coefficient
    }
}
