//! The concrete law for one YADE contact (`CpmPhys` on `ScGeom`), bitwise equal to YADE's law.

#![allow(unsafe_code)] // C functions

use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_contact::kinematics::{PointKinematics, Transport};
use concordem_contact::law::ContactGeometry;
use concordem_contact::law::cpm::{Cpm, CpmState, DamageLaw, StressResponse, YadeParameters};
use concordem_contact::math::Vec3;

/// Parameters, motion, history, and results of one contact, named as in YADE's classes; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
#[allow(missing_docs)] // named as the attributes of YADE's classes
pub struct CpmContact {
    // CpmPhys: parameters of the contact.
    pub young: f64,
    pub shear_modulus: f64,
    pub friction_coefficient: f64,
    pub cohesion: f64,
    pub crack_onset_strain: f64,
    pub fracture: f64,
    pub shear_contribution: f64,
    pub prestress: f64,
    pub reference_length: f64,
    pub reference_penetration: f64,
    pub area: f64,
    // Attributes of the Law2 functor.
    pub omega_threshold: f64,
    pub soft_strain: f64,
    pub relative_soft_stiffness: f64,
    // ScGeom: motion of the step.
    pub penetration: f64,
    pub normal: [f64; 3],
    pub shear_increment: [f64; 3],
    /// `ScGeom::orthonormal_axis`.
    pub swing: [f64; 3],
    /// `ScGeom::twist_axis`.
    pub twist: [f64; 3],
    // CpmPhys: history, input and output.
    pub strain: f64,
    pub kappa: f64,
    pub omega: f64,
    pub plastic_strain: f64,
    pub shear_strain: [f64; 3],
    pub plastic_shear_strain: [f64; 3],
    // Result.
    pub normal_stress: f64,
    pub shear_stress: [f64; 3],
    pub residual_strength: f64,
    // Energies (J), if requested: dissipated in this step by damage and by friction, stored, error of the work rule.
    pub damage_energy: f64,
    pub friction_energy: f64,
    pub stored_energy: f64,
    pub integration_energy: f64,
    pub damage_law: i32,
    pub never_damage: i32,
    pub cohesive: i32,
    /// Whether the contact was created in this step.
    pub fresh: i32,
}

/// Outcome of a step of one contact.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CpmOutcome {
    /// The contact continues.
    Lives = 0,
    /// The contact must be deleted.
    Lost = 1,
    /// The strain is NaN.
    NotANumber = -1,
    /// `damLaw` is neither 0 nor 1.
    DamageLaw = -2,
    /// The library panicked.
    Internal = -3,
}

#[inline(always)]
fn vector(a: &[f64; 3]) -> Vec3 {
    Vec3::new(a[0], a[1], a[2])
}

/// Compute one step of a contact. An error leaves the contact unchanged.
#[expect(clippy::too_many_lines, reason = "a table of fields in and a table of fields out")]
#[inline(always)]
fn respond<const ENERGY: bool>(contact: &mut CpmContact) -> CpmOutcome {
    let c = contact;
    let law = Cpm::of_yade(&YadeParameters {
        young: c.young,
        shear_modulus: c.shear_modulus,
        friction_coefficient: c.friction_coefficient,
        cohesion: c.cohesion,
        crack_onset_strain: c.crack_onset_strain,
        softening_strain: c.fracture,
        shear_contribution: c.shear_contribution,
        isotropic_prestress: c.prestress,
        damage_law: match c.damage_law {
            0 => DamageLaw::Linear,
            1 => DamageLaw::Exponential,
            _ => return CpmOutcome::DamageLaw,
        },
        never_damage: c.never_damage != 0,
        omega_threshold: c.omega_threshold,
        soft_strain: c.soft_strain,
        relative_soft_stiffness: c.relative_soft_stiffness,
    });
    let elongation = c.reference_penetration - c.penetration;
    let length = c.reference_length + elongation;
    let strain_old = c.strain - law.prestress_strain();
    let length_old = if c.fresh != 0 { length } else { c.reference_length * (1.0 + strain_old) };
    let kinematics = PointKinematics {
        geometry: ContactGeometry {
            reference_length: c.reference_length,
            area: c.area,
            // The law reads neither radii nor masses.
            radius_a: 0.0,
            radius_b: 0.0,
            mass_a: 0.0,
            mass_b: 0.0,
        },
        length,
        length_old,
        elongation,
        elongation_old: length_old - c.reference_length,
        gap: -c.penetration,
        normal: vector(&c.normal),
        shear_increment: vector(&c.shear_increment),
        arm_a: 0.0,
        arm_b: 0.0,
        bonded: c.cohesive != 0,
        transport: Transport::FirstOrder { swing: vector(&c.swing), twist: vector(&c.twist) },
    };
    let old = CpmState {
        normal_strain: if c.fresh != 0 { elongation / c.reference_length } else { strain_old },
        kappa: c.kappa,
        omega: c.omega,
        plastic_normal_strain: c.plastic_strain,
        damage_strain: 0.0,
        shear_strain: vector(&c.shear_strain),
        plastic_shear_strain: vector(&c.plastic_shear_strain),
    };
    let StressResponse { state, normal_stress, shear_stress, lost, energy } =
        law.evaluate_as_yade::<false>(&kinematics, &old);
    if state.normal_strain.is_nan() || state.shear_strain.iter().any(|x| x.is_nan()) {
        return CpmOutcome::NotANumber;
    }
    c.strain = state.normal_strain + law.prestress_strain();
    c.kappa = state.kappa;
    c.omega = state.omega;
    c.plastic_strain = state.plastic_normal_strain;
    c.shear_strain = state.shear_strain.into();
    c.plastic_shear_strain = state.plastic_shear_strain.into();
    c.normal_stress = normal_stress;
    c.shear_stress = shear_stress.into();
    c.residual_strength = if c.cohesive == 0 {
        0.0
    } else if c.kappa < c.crack_onset_strain {
        1.0
    } else {
        (1.0 - c.omega) * c.kappa / c.crack_onset_strain
    };
    if ENERGY {
        // A deleted contact releases its stored energy.
        let released = if lost { energy.stored() } else { 0.0 };
        c.damage_energy = energy.damage + if c.cohesive != 0 { released } else { 0.0 };
        c.friction_energy = energy.friction + if c.cohesive != 0 { 0.0 } else { released };
        c.stored_energy = energy.stored() - released;
        c.integration_energy = energy.integration;
    }
    if lost { CpmOutcome::Lost } else { CpmOutcome::Lives }
}

/// Compute one step of the concrete law, without energies.
///
/// # Safety
/// `contact` must point to a contact.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_cpm(contact: *mut CpmContact) -> CpmOutcome {
    // SAFETY: guaranteed by the caller.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| respond::<false>(contact))).unwrap_or(CpmOutcome::Internal)
}

/// Compute one step of the concrete law, with energies.
///
/// # Safety
/// `contact` must point to a contact.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_cpm_with_energy(contact: *mut CpmContact) -> CpmOutcome {
    // SAFETY: guaranteed by the caller.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| respond::<true>(contact))).unwrap_or(CpmOutcome::Internal)
}
