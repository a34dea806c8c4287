//! YADE's public form of the cohesive particle model, `Law2_ScGeom_CpmPhys_Cpm`, bit for bit.

use super::parameters::{CpmError, CpmFormulation, CpmParameters, DamageLaw, YieldSurface, check};
use super::{Cpm, CpmState, Softening, StressResponse, normal_before, omega_before, release, strain_before};
use crate::kinematics::PointKinematics;
use crate::law::{EnergySplit, Response, Status};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::Vec3;

/// Parameters of one contact in YADE's `CpmPhys` and `Law2_ScGeom_CpmPhys_Cpm`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct YadeParameters {
    /// `E`, Pa.
    pub young: f64,
    /// `G`, Pa.
    pub shear_modulus: f64,
    /// `tanFrictionAngle`, 1.
    pub friction_coefficient: f64,
    /// `undamagedCohesion`, Pa.
    pub cohesion: f64,
    /// `epsCrackOnset`, 1.
    pub crack_onset_strain: f64,
    /// `epsFracture`, 1.
    pub softening_strain: f64,
    /// `equivStrainShearContrib`, 1.
    pub shear_contribution: f64,
    /// `isoPrestress`, Pa.
    pub isotropic_prestress: f64,
    /// `damLaw`.
    pub damage_law: DamageLaw,
    /// `neverDamage`.
    pub never_damage: bool,
    /// `omegaThreshold`, 1.
    pub omega_threshold: f64,
    /// `epsSoft`, 1.
    pub soft_strain: f64,
    /// `relKnSoft`, 1.
    pub relative_soft_stiffness: f64,
}

/// Friction coefficient of an angle of friction (rad), which YADE's materials have: its tangent, by the system's `tan` as in YADE.
pub fn friction_of_yade(angle: f64) -> Result<f64, CpmError> {
    let right_angle = core::f64::consts::FRAC_PI_2;
    check("friction_angle", angle, (0.0..right_angle).contains(&angle), "an angle from 0 to below π/2 rad")?;
    Ok(angle.tan())
}

impl Cpm {
    /// The law of one contact of YADE, only for [`Self::evaluate_as_yade`]. The parameters are not checked: YADE accepts
    /// any.
    #[inline(always)]
    pub fn of_yade(contact: &YadeParameters) -> Self {
        let c = contact;
        let (young, softening_strain) = (c.young, c.softening_strain);
        Self {
            parameters: CpmParameters {
                mode: CpmFormulation::YadePublic,
                young,
                shear_ratio: c.shear_modulus / young,
                cohesion: c.cohesion,
                friction_coefficient: c.friction_coefficient,
                crack_onset_strain: c.crack_onset_strain,
                relative_ductility: softening_strain / c.crack_onset_strain,
                fracture_energy: 0.0,
                damage_law: c.damage_law,
                omega_threshold: c.omega_threshold,
                never_damage: c.never_damage,
                shear_contribution: c.shear_contribution,
                soft_strain: c.soft_strain,
                relative_soft_stiffness: c.relative_soft_stiffness,
                isotropic_prestress: c.isotropic_prestress,
                yield_surface: YieldSurface::MohrCoulomb,
                yield_log_speed: 0.1,
                damage_time: 0.0,
                damage_rate_exponent: 1.0,
                plasticity_time: 0.0,
                plasticity_rate_exponent: 1.0,
            },
            shear_modulus: c.shear_modulus,
            prestress_strain: c.isotropic_prestress / young,
            inverse_shear_modulus: if c.shear_modulus > 0.0 { 1.0 / c.shear_modulus } else { 0.0 },
            softening: Softening::of(c.crack_onset_strain, softening_strain),
            characteristic_length: 0.0,
            plain: false,
        }
    }

    /// Response in YADE's formulation.
    #[inline(always)]
    pub(super) fn respond_yade(&self, k: &PointKinematics, old: &CpmState) -> Response<CpmState> {
        let stresses = self.evaluate_as_yade::<true>(k, old);
        let length = k.geometry.reference_length;
        let area = k.geometry.area;
        if stresses.lost {
            let strain_step = stresses.state.normal_strain - strain_before(k, old, 1.0 / length);
            let shear_step = k.shear_increment / length;
            let StressResponse { normal_stress, shear_stress, energy, .. } = &stresses;
            return release(k, area * length, *normal_stress, shear_stress, strain_step, &shear_step, energy);
        }
        Response {
            force: k.normal * (stresses.normal_stress * area) + stresses.shear_stress * area,
            moment: Vec3::zeros(),
            state: stresses.state,
            status: Status::Lives,
            energy: stresses.energy,
        }
    }

    /// The operations of YADE's `Law2_ScGeom_CpmPhys_Cpm::go` in their order, whatever the formulation of `self`.
    ///
    /// `CONSISTENT`: whether the history satisfies ω = g(κ), as histories of this library do. If not, every step
    /// computes ω as YADE does, whose users may set only one of the two (`setDamage`). The compiler removes unused
    /// energies.
    #[inline(always)]
    pub fn evaluate_as_yade<const CONSISTENT: bool>(&self, k: &PointKinematics, old: &CpmState) -> StressResponse {
        self.evaluate_with_damage(k, old, |kappa| {
            if CONSISTENT && kappa == old.kappa { old.omega } else { self.damage_function_yade(kappa) }
        })
    }

    /// [`Self::evaluate_as_yade`], where `damage` gives the damage ω(κ) of a bond.
    #[inline(always)]
    pub(super) fn evaluate_with_damage(
        &self,
        k: &PointKinematics,
        old: &CpmState,
        damage: impl Fn(f64) -> f64,
    ) -> StressResponse {
        use crate::math::yade_order::{dot, norm};
        let p = &self.parameters;
        let (young, shear_modulus) = (p.young, self.shear_modulus);
        let length = k.geometry.reference_length;
        let area = k.geometry.area;
        let strain = k.elongation / length;
        let shear_step = k.shear_increment / length;
        let carried_shear = k.transport.apply(&old.shear_strain);
        let shear_strain = carried_shear + shear_step;

        let adjusted = strain + self.prestress_strain;
        let mut plastic = old.plastic_normal_strain;
        let elastic = adjusted - plastic;
        let tension = if elastic < 0.0 { 0.0 } else { elastic };
        let squared_weight = p.shear_contribution * p.shear_contribution;
        let equivalent = (tension * tension + squared_weight * dot(&shear_strain, &shear_strain)).sqrt();
        let kappa = if equivalent < old.kappa { old.kappa } else { equivalent };
        let omega = if k.bonded { damage(kappa) } else { 1.0 };
        let damage = if elastic > 0.0 { omega } else { 0.0 };
        let mut stress = (1.0 - damage) * young * elastic;
        if p.soft_strain < 0.0 && elastic < p.soft_strain {
            let soft = young * (p.soft_strain + p.relative_soft_stiffness * (elastic - p.soft_strain));
            if soft > stress {
                plastic += (stress - soft) / young;
                stress = soft;
            }
        }
        let trial = (shear_strain - old.plastic_shear_strain) * shear_modulus;
        let mut shear_stress = trial;
        let mut plastic_shear = old.plastic_shear_strain;
        let bound = self.yield_stress_yade(stress, omega);
        if dot(&trial, &trial) > bound * bound {
            let scale = bound / norm(&trial);
            shear_stress *= scale;
            plastic_shear += shear_stress * (1.0 - scale) / shear_modulus;
        }
        let applied = stress - p.isotropic_prestress;

        // Energies are not part of YADE's law, so their order of operations is free.
        let volume = area * length;
        let strain_old = strain_before(k, old, 1.0 / length);
        let (plastic_old, elastic_old) = normal_before(p, k, old, strain_old + self.prestress_strain);
        let omega_old = omega_before(k, old);
        let damage_old = if elastic_old > 0.0 { omega_old } else { 0.0 };
        let stress_old = (1.0 - damage_old) * young * elastic_old;
        let elastic_new = adjusted - plastic;
        let mut energy = EnergySplit {
            stored_normal: volume
                * (0.5 * (stress * elastic_new - young * self.prestress_strain * self.prestress_strain)
                    - p.isotropic_prestress * strain),
            stored_shear: 0.5 * volume * self.inverse_shear_modulus * dot(&shear_stress, &shear_stress),
            ..EnergySplit::default()
        };
        energy.add_friction(volume * 0.5 * (stress_old + stress) * (plastic - plastic_old));
        let product = volume * 0.5 * young * elastic_old * elastic_new * (damage - damage_old);
        if elastic_old * elastic_new < 0.0 {
            energy.integration += product;
        } else {
            energy.damage = product;
        }
        // The shear stress of the previous step is the trial stress of its history, limited by the bound of that time.
        let stress_of_history = (old.shear_strain - old.plastic_shear_strain) * shear_modulus;
        let bound_old = self.yield_stress_yade(stress_old, omega_old);
        let norm_old = norm(&stress_of_history);
        let shear_stress_old =
            if norm_old > bound_old { stress_of_history * (bound_old / norm_old) } else { stress_of_history };
        let carried_stress = k.transport.apply(&shear_stress_old);
        let slip = shear_step - (shear_stress - carried_stress) * self.inverse_shear_modulus;
        energy.add_friction(volume * 0.5 * dot(&(carried_stress + shear_stress), &slip));
        energy.integration += 0.5
            * volume
            * self.inverse_shear_modulus
            * (dot(&shear_stress_old, &shear_stress_old) - dot(&carried_stress, &carried_stress));

        let state = CpmState {
            normal_strain: strain,
            kappa,
            omega,
            plastic_normal_strain: plastic,
            damage_strain: 0.0,
            shear_strain,
            plastic_shear_strain: plastic_shear,
        };
        let lost = adjusted > 0.0 && (!k.bonded || omega > p.omega_threshold);
        StressResponse { state, normal_stress: applied, shear_stress, lost, energy }
    }

    #[inline(always)]
    fn damage_function_yade(&self, kappa: f64) -> f64 {
        let p = &self.parameters;
        if kappa < p.crack_onset_strain || p.never_damage {
            return 0.0;
        }
        match p.damage_law {
            DamageLaw::Linear => {
                (1.0 - p.crack_onset_strain / kappa) / (1.0 - p.crack_onset_strain / self.softening.strain)
            }
            // The system's `exp` as in YADE: this form reproduces the bits of a program that uses the C library.
            DamageLaw::Exponential => {
                1.0 - (p.crack_onset_strain / kappa) * (-(kappa - p.crack_onset_strain) / self.softening.strain).exp()
            }
        }
    }

    #[inline(always)]
    fn yield_stress_yade(&self, normal_stress: f64, omega: f64) -> f64 {
        let radius = self.parameters.cohesion * (1.0 - omega) - normal_stress * self.parameters.friction_coefficient;
        if radius > 0.0 { radius } else { 0.0 }
    }
}
