//! Stress, state, and consistent tangent at the end of a step.

use concordem_contact::math::Mat3;
use nalgebra::{Matrix6, Vector6};

use super::plastic_return::{PlasticReturn, Returned, Trial};
use super::softening::ductility;
use super::{DamagePlastic, State};
use crate::error::ContinuumError;
use crate::spectrum::Spectrum;
use crate::voigt::{components, contract, contract_matrix, deviatoric, identity};

/// Yield functions up to this value count as elastic. Returned stresses have values of 1e-12 and less; the stress changes by 1e-10 of
/// the strength.
const ELASTIC: f64 = 1e-10;

/// The result of a step.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Update {
    /// Stress `σ = (1−ω) σ̄`, Pa.
    pub stress: Mat3,
    /// State at the end of the step.
    pub state: State,
    /// Damage `ω`.
    pub damage: f64,
    /// Consistent tangent `∂σ/∂ε` for six components with engineering shears, Pa. Not symmetric.
    pub tangent: Matrix6<f64>,
}

impl DamagePlastic {
    /// Stress, state, and tangent for a total strain at the end of the step, in an element of this size (m).
    ///
    /// # Errors
    /// A strain or state that is not finite, an impossible state, an element that snaps back, or no convergence.
    pub fn update(&self, strain: &Mat3, state: &State, size: f64) -> Result<Update, ContinuumError> {
        state.check()?;
        if !strain.iter().all(|value| value.is_finite()) {
            return Err(ContinuumError::NotFinite { what: "strain" });
        }
        let softening = self.softening(size)?;
        let strain = (strain + strain.transpose()) * 0.5;
        let trial_stress = self.elasticity.stress(&(strain - state.plastic_tensor()));
        let spectrum = Spectrum::of(&trial_stress);
        let strength = self.parameters.compressive_strength;
        let trial = Trial {
            s: spectrum.mean / strength,
            p: spectrum.deviator / strength,
            cos_lode: spectrum.cos_lode,
            kappa: state.hardening,
        };
        let (q, _) = self.hardening.variable(state.hardening);
        if self.surface.yield_function(trial.s, trial.p, q, trial.cos_lode).value <= ELASTIC {
            let (damage, _) = softening.damage(state.damage);
            let left = 1.0 - damage;
            let tangent = self.elasticity.stiffness() * left;
            return Ok(Update { stress: trial_stress * left, state: *state, damage, tangent });
        }
        let plastic_return = PlasticReturn {
            surface: &self.surface,
            hardening: &self.hardening,
            bulk: self.elasticity.bulk / (2.0 * self.elasticity.shear),
            strain: strength / (2.0 * self.elasticity.shear),
        };
        let returned = plastic_return
            .solve(&trial)
            .ok_or(ContinuumError::NoConvergence { mean: spectrum.mean, deviator: spectrum.deviator })?;
        let effective = spectrum.unit * (returned.p * strength) + Mat3::identity() * (returned.s * strength);
        let tangent = self.effective_tangent(&spectrum, &trial, &returned);

        let mut next = *state;
        let volume = (trial.s - returned.s) * strength / self.elasticity.bulk;
        let deviator = (trial.p - returned.p) * strength / (2.0 * self.elasticity.shear);
        let increment = Mat3::identity() * (volume / 3.0) + spectrum.unit * deviator;
        next.set_plastic_tensor(&(state.plastic_tensor() + increment));
        next.hardening = returned.kappa;
        let hardening_rate = self.hardening_rate(&spectrum, &returned);
        let damage_rate =
            self.advance_damage(state, &mut next, &spectrum, [volume, deviator], &tangent, &hardening_rate);
        let (damage, slope) = softening.damage(next.damage);
        let left = 1.0 - damage;
        let tangent = tangent * left - components(&effective) * damage_rate.transpose() * slope;
        Ok(Update { stress: effective * left, state: next, damage, tangent })
    }

    /// Rows `∂/∂ε` of the trial invariants over the strength: `s`, `p`, `cos θ`.
    fn trial_rows(&self, spectrum: &Spectrum) -> [Vector6<f64>; 3] {
        let strength = self.parameters.compressive_strength;
        let unit = components(&spectrum.unit);
        let shear = 2.0 * self.elasticity.shear;
        let cos = if spectrum.deviator > 0.0 {
            // dn = (2G/ρ)(I_dev − n⊗n) : dε.
            let gradient = components(&spectrum.cos_lode_gradient());
            let projected = contract_matrix(&gradient, &(deviatoric() - unit * unit.transpose()));
            projected * (shear / spectrum.deviator)
        } else {
            Vector6::zeros()
        };
        [identity() * (self.elasticity.bulk / strength), unit * (shear / strength), cos]
    }

    /// `∂σ̄/∂ε`.
    fn effective_tangent(&self, spectrum: &Spectrum, trial: &Trial, returned: &Returned) -> Matrix6<f64> {
        let strength = self.parameters.compressive_strength;
        let rows = self.trial_rows(spectrum);
        let row = |k: usize| {
            rows[0] * returned.slope[(k, 0)] + rows[1] * returned.slope[(k, 1)] + rows[2] * returned.slope[(k, 2)]
        };
        let unit = components(&spectrum.unit);
        let mut tangent = (identity() * row(0).transpose() + unit * row(1).transpose()) * strength;
        if trial.p > 0.0 {
            tangent += (deviatoric() - unit * unit.transpose()) * (2.0 * self.elasticity.shear * returned.p / trial.p);
        }
        tangent
    }

    /// `∂κ_P/∂ε`.
    fn hardening_rate(&self, spectrum: &Spectrum, returned: &Returned) -> Vector6<f64> {
        let rows = self.trial_rows(spectrum);
        rows[0] * returned.slope[(2, 0)] + rows[1] * returned.slope[(2, 1)] + rows[2] * returned.slope[(2, 2)]
    }

    /// Advance `κ_D`, and return `∂κ_D/∂ε`.
    ///
    /// Damage begins at `κ_P = 1`. A step across it counts with the part of the hardening beyond.
    fn advance_damage(
        &self,
        before: &State,
        next: &mut State,
        spectrum: &Spectrum,
        [volume, deviator]: [f64; 2],
        tangent: &Matrix6<f64>,
        hardening_rate: &Vector6<f64>,
    ) -> Vector6<f64> {
        if next.hardening <= 1.0 || volume <= 0.0 {
            return Vector6::zeros();
        }
        let mut shrinking = Mat3::zeros();
        let mut shortening = 0.0;
        for (value, direction) in spectrum.unit_values.iter().zip(&spectrum.directions) {
            let principal = volume / 3.0 + deviator * value;
            if principal < 0.0 {
                shortening -= principal;
                shrinking += direction * direction.transpose();
            }
        }
        let ratio = shortening / volume;
        let (ductility, ductility_slope) = ductility(self.parameters.softening_ductility, ratio);
        let (part, part_slope) = if before.hardening >= 1.0 {
            (1.0, 0.0)
        } else {
            let step = next.hardening - before.hardening;
            ((next.hardening - 1.0) / step, (1.0 - before.hardening) / (step * step))
        };
        next.damage = before.damage + part * volume / ductility;

        // Of the plastic strain: dε_p = dε − D_e⁻¹ : dσ̄.
        let trace = contract_matrix(&identity(), tangent);
        let volume_rate = identity() - trace / (3.0 * self.elasticity.bulk);
        let shrinking = components(&shrinking);
        let mean = contract(&shrinking, &identity()) / 3.0;
        let shrinking_deviator = shrinking - identity() * mean;
        let shortening_rate = -(shrinking
            - contract_matrix(&shrinking_deviator, tangent) / (2.0 * self.elasticity.shear)
            - trace * (mean / (3.0 * self.elasticity.bulk)));
        let ratio_rate = shortening_rate / volume - volume_rate * (shortening / (volume * volume));
        hardening_rate * (part_slope * volume / ductility) + volume_rate * (part / ductility)
            - ratio_rate * (part * volume * ductility_slope / (ductility * ductility))
    }
}
