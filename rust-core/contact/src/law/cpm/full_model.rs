//! The full model with all options (Šmilauer 2010), in the thesis formulation and in Woo's: [yield
//! surfaces](super::yield_surface), viscous damage and slip, plasticity in compression, isotropic prestress, shear in the
//! equivalent strain.
//!
//! [`thesis`](super::thesis) is the same model without options. The [parent module](super) lists Woo's quirks.

use super::parameters::CpmFormulation;
use super::{Cpm, CpmState, Step, StressResponse, normal_before, omega_before};
use crate::kinematics::PointKinematics;
use crate::law::{EnergySplit, Response};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{self, Vec3};

impl Cpm {
    /// Response in the thesis formulation with options, or in Woo's.
    #[inline(always)]
    pub(super) fn respond_full(&self, k: &PointKinematics, old: &CpmState, dt: f64) -> Response<CpmState> {
        Self::response_of(k, old, &self.evaluate_full(k, old, dt))
    }

    #[inline(always)]
    fn evaluate_full(&self, k: &PointKinematics, old: &CpmState, dt: f64) -> StressResponse {
        let p = &self.parameters;
        let woo = p.mode == CpmFormulation::Woo;
        let step = Step::new(k, old);
        // An unbonded contact has no prestress, but Woo subtracts the prestress from every contact.
        let (shift, prestress) = if k.bonded {
            (self.prestress_strain, p.isotropic_prestress)
        } else {
            (0.0, if woo { p.isotropic_prestress } else { 0.0 })
        };
        let mut energy = EnergySplit::default();
        let normal = self.full_normal(k, old, &step, shift, &mut energy);
        let Normal { adjusted, elastic, elastic_old, kappa, omega, damage, damage_old, plastic, stress } = normal;
        let (shear_stress, plastic_shear) = self.full_shear(&step, self.yield_stress(stress, omega), dt, &mut energy);

        // Viscous overstress.
        let mut damage_strain = 0.0;
        let mut normal_stress = stress - prestress;
        if p.damage_time > 0.0 && k.bonded {
            let (driving, driving_old) = if woo {
                (omega * adjusted, old.omega * (step.strain_old + shift))
            } else {
                (damage * elastic, damage_old * elastic_old)
            };
            damage_strain = self.viscous_damage_strain(driving, old.damage_strain, omega, dt);
            let overstress = p.young * (driving - damage_strain);
            let overstress_old = p.young * (driving_old - old.damage_strain);
            normal_stress += overstress;
            energy.viscous += step.volume * 0.5 * (overstress_old + overstress) * (step.strain - step.strain_old);
        }

        energy.stored_normal =
            step.volume * (0.5 * (stress * elastic - p.young * shift * shift) - prestress * step.strain);
        self.add_shear(&mut energy, k, old, &step, &shear_stress);
        let state = CpmState {
            normal_strain: step.strain,
            kappa,
            omega,
            plastic_normal_strain: plastic,
            damage_strain,
            shear_strain: step.shear_strain(),
            plastic_shear_strain: plastic_shear,
        };
        // A bond without strength breaks even with a threshold of 1 (linear damage beyond ε_f).
        let lost = adjusted > 0.0 && (!k.bonded || omega > p.omega_threshold || omega >= 1.0);
        StressResponse { state, normal_stress, shear_stress, lost, energy }
    }

    /// Normal direction: damage, and plasticity in compression. `shift` is the strain of the prestress.
    #[inline(always)]
    fn full_normal(
        &self,
        k: &PointKinematics,
        old: &CpmState,
        step: &Step,
        shift: f64,
        energy: &mut EnergySplit,
    ) -> Normal {
        let p = &self.parameters;
        let woo = p.mode == CpmFormulation::Woo;
        let adjusted = step.strain + shift;
        let mut plastic = old.plastic_normal_strain;
        let mut elastic = adjusted - plastic;
        let (plastic_old, elastic_old) = normal_before(p, k, old, step.strain_old + shift);
        let (mut kappa, mut omega) = (old.kappa, old.omega);
        if k.bonded {
            let mut equivalent = elastic;
            if p.shear_contribution > 0.0 && !woo {
                let tension = elastic.max(0.0);
                let squared = p.shear_contribution * p.shear_contribution * step.shear_strain().norm_squared();
                equivalent = (tension * tension + squared).sqrt();
            }
            if equivalent > kappa {
                kappa = equivalent;
                omega = self.damage_function(kappa, k.geometry.reference_length);
            }
        } else {
            omega = 1.0;
        }
        let damage_old = if elastic_old > 0.0 { omega_before(k, old) } else { 0.0 };
        let damage = if elastic > 0.0 { omega } else { 0.0 };
        let stress_old = (1.0 - damage_old) * p.young * elastic_old;
        let mut stress = (1.0 - damage) * p.young * elastic;
        if p.soft_strain < 0.0 && (if woo { elastic } else { adjusted }) < p.soft_strain {
            let line = p.strain_at_limit(adjusted);
            let bound = p.young * line;
            if bound > stress {
                stress = bound;
                elastic = line;
                plastic = adjusted - elastic;
                let slip = plastic - plastic_old;
                energy.add_friction(step.volume * 0.5 * (stress_old + stress) * slip);
            }
        }
        self.add_damage(energy, step.volume, [elastic_old, elastic], [damage_old, damage]);
        Normal { adjusted, elastic, elastic_old, kappa, omega, damage, damage_old, plastic, stress }
    }

    /// Shear stress (Pa) and plastic shear strain under the bound `bound` (Pa).
    #[inline(always)]
    fn full_shear(&self, step: &Step, bound: f64, dt: f64, energy: &mut EnergySplit) -> (Vec3, Vec3) {
        let p = &self.parameters;
        let woo = p.mode == CpmFormulation::Woo;
        let carried_plastic = step.carried_plastic;
        let trial_strain = if woo { step.shear_strain() } else { step.carried_elastic() + step.shear_strain_increment };
        let trial = trial_strain * self.shear_modulus;
        let trial_squared = trial.norm_squared();
        let mut shear_stress = trial;
        let mut plastic_shear = if woo { Vec3::zeros() } else { carried_plastic };
        let flows = trial_squared > bound * bound;
        if flows {
            let trial_norm = trial_squared.sqrt();
            let mut scale = bound / trial_norm;
            if p.plasticity_time > 0.0 {
                scale = self.viscous_slip_scale(trial_norm, bound, dt);
                energy.viscous = step.volume
                    * (trial_norm * scale - bound)
                    * math::norm(&(plastic_shear + trial_strain * (1.0 - scale) - carried_plastic));
            }
            shear_stress = trial * scale;
            plastic_shear += trial_strain * (1.0 - scale);
        }
        if flows || woo {
            let mean_stress = (step.carried_elastic() * self.shear_modulus + shear_stress) * 0.5;
            let work = step.volume * mean_stress.dot(&(plastic_shear - carried_plastic)) - energy.viscous;
            if woo {
                // Recovered slip returns work for any step size, so a negative value is not an error of the rule.
                energy.friction += work;
            } else {
                energy.add_friction(work);
            }
        }
        (shear_stress, plastic_shear)
    }

    /// Damage strain after a step of `dt` (s) towards `driving` = ωe.
    #[inline(never)]
    fn viscous_damage_strain(&self, driving: f64, old: f64, omega: f64, dt: f64) -> f64 {
        let p = &self.parameters;
        let distance = driving - old;
        if distance <= 0.0 {
            return driving;
        }
        let n = p.damage_rate_exponent;
        let ln_c = math::ln(p.crack_onset_strain * (1.0 - omega))
            + n * math::ln(p.damage_time / dt)
            + (n - 1.0) * math::ln(distance);
        old + distance * math::exp(solve_beta(ln_c, n))
    }

    /// Factor s of the trial stress after a step of `dt` (s) of viscous slip.
    #[inline(never)]
    fn viscous_slip_scale(&self, trial: f64, bound: f64, dt: f64) -> f64 {
        let p = &self.parameters;
        let n = p.plasticity_rate_exponent;
        let ln_c = math::ln(p.cohesion)
            + n * math::ln(p.plasticity_time / (self.shear_modulus * dt))
            + (n - 1.0) * math::ln(trial - bound);
        1.0 - math::exp(solve_beta(ln_c, n)) * (1.0 - bound / trial)
    }
}

/// The root β ≤ 0 of ln(eᵝ + c e^{nβ}) = 0 for `ln_c` = ln c and n > 0 (Šmilauer 2010, "Visco-damage").
///
/// The left side is convex and increasing in β, and not negative at min(0, −ln c/n), so Newton's method from there falls
/// monotonically to the root until rounding stops it. Logarithms keep c of any size finite.
pub fn solve_beta(ln_c: f64, n: f64) -> f64 {
    let mut beta = (-ln_c / n).min(0.0);
    for _ in 0..60 {
        let (residual, slope) = beta_residual(beta, ln_c, n);
        let next = beta - residual / slope;
        // Monotone from above: the first step that does not fall is rounding.
        if residual <= 0.0 || next >= beta {
            break;
        }
        beta = next;
    }
    beta
}

/// ln(eᵝ + c e^{nβ}) and its derivative, without overflow.
pub(super) fn beta_residual(beta: f64, ln_c: f64, n: f64) -> (f64, f64) {
    let other = n * beta + ln_c;
    let (large, small, slope_large, slope_small) =
        if beta > other { (beta, other, 1.0, n) } else { (other, beta, n, 1.0) };
    let weight = math::exp(small - large);
    (large + libm::log1p(weight), (slope_large + slope_small * weight) / (1.0 + weight))
}

/// Normal direction at the end of a step.
struct Normal {
    /// Strain with the shift by the prestress.
    adjusted: f64,
    elastic: f64,
    elastic_old: f64,
    kappa: f64,
    omega: f64,
    /// Damage of the normal stiffness: ω in tension, 0 in compression.
    damage: f64,
    damage_old: f64,
    plastic: f64,
    /// Stress before prestress and overstress, Pa.
    stress: f64,
}
