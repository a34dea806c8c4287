//! The published form of the cohesive particle model (Stránský 2018, (2.3)–(2.20)) without options: Mohr–Coulomb yield
//! surface, no viscosity, no plasticity in compression, no prestress, no shear in the equivalent strain.
//!
//! With options see [`full_model`](super::full_model).

use super::{Cpm, CpmState, Step, StressResponse, omega_before};
use crate::kinematics::PointKinematics;
use crate::law::{EnergySplit, Response};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;

impl Cpm {
    /// Response in the plain thesis form.
    #[inline(always)]
    pub(super) fn respond_thesis(&self, k: &PointKinematics, old: &CpmState) -> Response<CpmState> {
        Self::response_of(
            k,
            old,
            &self.evaluate_thesis(k, old, |kappa| self.damage_function(kappa, k.geometry.reference_length)),
        )
    }

    /// Stresses, history, and energies; `damage_of` gives the damage ω(κ) of a bond whose κ grows.
    #[inline(always)]
    pub(super) fn evaluate_thesis(
        &self,
        k: &PointKinematics,
        old: &CpmState,
        damage_of: impl Fn(f64) -> f64,
    ) -> StressResponse {
        let p = &self.parameters;
        let step = Step::new(k, old);

        // Normal direction, (2.13)–(2.17).
        let elastic = step.strain - old.plastic_normal_strain;
        let elastic_old = step.strain_old - old.plastic_normal_strain;
        let (mut kappa, mut omega) = (old.kappa, old.omega);
        if k.bonded {
            if elastic > kappa {
                kappa = elastic;
                omega = damage_of(kappa);
            }
        } else {
            omega = 1.0;
        }
        let damage_old = if elastic_old > 0.0 { omega_before(k, old) } else { 0.0 };
        let damage = if elastic > 0.0 { omega } else { 0.0 };
        let normal_stress = (1.0 - damage) * p.young * elastic;
        let mut energy = EnergySplit::default();
        self.add_damage(&mut energy, step.volume, [elastic_old, elastic], [damage_old, damage]);

        // Shear, (2.18)–(2.20).
        let bound = self.mohr_coulomb(normal_stress, omega).max(0.0);
        let trial_strain = step.carried_elastic() + step.shear_strain_increment;
        let trial = trial_strain * self.shear_modulus;
        let trial_squared = trial.norm_squared();
        let (mut shear_stress, mut plastic_shear) = (trial, step.carried_plastic);
        if trial_squared > bound * bound {
            let scale = bound / trial_squared.sqrt();
            shear_stress = trial * scale;
            plastic_shear += trial_strain * (1.0 - scale);
            let mean_stress = (step.carried_elastic() * self.shear_modulus + shear_stress) * 0.5;
            energy.add_friction(step.volume * mean_stress.dot(&(plastic_shear - step.carried_plastic)));
        }

        energy.stored_normal = step.volume * (0.5 * (normal_stress * elastic));
        self.add_shear(&mut energy, k, old, &step, &shear_stress);
        let state = CpmState {
            normal_strain: step.strain,
            kappa,
            omega,
            plastic_normal_strain: old.plastic_normal_strain,
            damage_strain: 0.0,
            shear_strain: step.shear_strain(),
            plastic_shear_strain: plastic_shear,
        };
        // A bond without strength breaks even with a threshold of 1 (linear damage beyond ε_f).
        let lost = step.strain > 0.0 && (!k.bonded || omega > p.omega_threshold || omega >= 1.0);
        StressResponse { state, normal_stress, shear_stress, lost, energy }
    }
}
