//! The cohesive beam for one YADE contact (`BeamPhys_Rust` on `ScGeom6D`), computed from the positions and orientations of the
//! bodies.

#![allow(unsafe_code)] // C functions and pointers into YADE's objects

use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_c_abi::{Message, guarded};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry};
use concordem_contact::kinematics::{ContactInput, FrameKinematics, PreviousGeometry};
use concordem_contact::law::{
    BeamModel, BendingTerm, CohesiveBeam, CohesiveBeamState, ContactGeometry, ContactLaw, Response, Section, Status,
};
use concordem_contact::math::{Vec3, quaternion_of_rotation_vector};

use crate::body_motion::{BodyMotion, BondOutcome, vector};

/// Parameters of a beam.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BeamParameters {
    /// Young's modulus, Pa.
    young: f64,
    /// Poisson's ratio.
    poisson: f64,
    /// Shear coefficient (Timoshenko) or stiffness ratio (dual spring); other models ignore it.
    shear: f64,
    /// Tensile strength, Pa; infinite for an unbreakable beam.
    strength: f64,
    /// Cross-section, m².
    area: f64,
    /// Reference length, m; 0 before the first step, which sets it.
    length: f64,
    /// Index of the model, in the order of `BeamModel`.
    model: i32,
    /// Index of the bending term, in the order of `BendingTerm`.
    bending_term: i32,
}

/// Parameters, motion, history, and results of one beam; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BeamContact {
    parameters: BeamParameters,
    bodies: [BodyMotion; 2],
    /// Displacement of the second body's periodic image, m.
    shift: [f64; 3],
    /// Velocity of this displacement, m/s.
    shift_velocity: [f64; 3],
    /// Time step, s.
    dt: f64,
    /// History, see `CohesiveBeamState`: address of three reals.
    rest_direction: *mut f64,
    /// History, see `CohesiveBeamState`: address of three reals.
    rest_rotation: *mut f64,
    /// Force on the first body, N; the second gets the opposite.
    force: [f64; 3],
    /// Torques on both bodies about their centers, N·m.
    torque: [[f64; 3]; 2],
    /// Moment of the middle section on the first body, N·m.
    moment: [f64; 3],
    /// Unit vector from the first body to the second.
    normal: [f64; 3],
    /// Stored energy, J.
    stored_energy: f64,
    /// Energy released by breaking in this step, J.
    damage_energy: f64,
    /// Error of the work rule in this step, J.
    integration_energy: f64,
}

impl BeamParameters {
    /// The law.
    ///
    /// # Errors
    /// An unknown index of the model or the bending term.
    fn law(&self) -> Result<CohesiveBeam, String> {
        Ok(CohesiveBeam {
            young: self.young,
            poisson: self.poisson,
            section: Section::Radius((self.area / std::f64::consts::PI).sqrt()),
            model: match self.model {
                0 => BeamModel::EulerBernoulli,
                1 => BeamModel::Timoshenko { shear_coefficient: self.shear },
                2 => BeamModel::DualSpring { ratio: self.shear },
                3 => BeamModel::Spring,
                other => {
                    return Err(format!(
                        "BeamPhys_Rust.model is {other}; give 0 (euler-bernoulli), 1 (timoshenko), 2 (dual-spring), or 3 (spring)"
                    ));
                }
            },
            strength: self.strength,
            bending_term: match self.bending_term {
                0 => BendingTerm::MidSection,
                1 => BendingTerm::HalfSum,
                2 => BendingTerm::LargerEnd,
                other => {
                    return Err(format!(
                        "BeamPhys_Rust.bendingTerm is {other}; give 0 (mid-section), 1 (half-sum), or 2 (larger-end)"
                    ));
                }
            },
        })
    }

    fn geometry(&self) -> ContactGeometry {
        // The law reads neither radii nor masses.
        ContactGeometry {
            reference_length: self.length,
            area: self.area,
            radius_a: 0.0,
            radius_b: 0.0,
            mass_a: 0.0,
            mass_b: 0.0,
        }
    }
}

/// Evaluate the law for the current motion of the bodies.
fn evaluate(
    law: &CohesiveBeam,
    c: &BeamContact,
    [a, b]: &[Motion; 2],
    old: &CohesiveBeamState,
) -> (FrameKinematics, Response<CohesiveBeamState>) {
    let image = ImageShift { displacement: c.shift.into(), velocity: c.shift_velocity.into(), periodic: false };
    let geometry = c.parameters.geometry();
    // The law does not read the previous length.
    let previous = PreviousGeometry { normal: Vec3::zeros(), length: geometry.reference_length };
    let input = ContactInput { a, b, image: &image, geometry: &geometry, previous: &previous, bonded: true, dt: c.dt };
    let kinematics = FrameKinematics::new(&input);
    (kinematics, law.respond(&kinematics, old, c.dt))
}

/// Compute one step of a beam. An error leaves the history unchanged.
unsafe fn respond(c: &mut BeamContact) -> BondOutcome {
    // SAFETY: guaranteed by the caller.
    let mut motions = unsafe { [c.bodies[0].read(), c.bodies[1].read()] };
    if c.parameters.length <= 0.0 {
        c.parameters.length = initial_geometry(&motions[0].position, &motions[1].position, &c.shift.into()).length;
    }
    let Ok(law) = c.parameters.law() else { return BondOutcome::Parameters };
    // SAFETY: guaranteed by the caller.
    let old = unsafe {
        CohesiveBeamState { rest_direction: vector(c.rest_direction), rest_rotation: vector(c.rest_rotation) }
    };
    let (mut kinematics, mut response) = evaluate(&law, c, &motions, &old);
    if response.status != Status::Lives {
        // The rotation of the bodies affects only the work of the step in which the beam breaks.
        for motion in &mut motions {
            motion.rotation_increment = quaternion_of_rotation_vector(&(motion.angular_velocity * c.dt));
        }
        (kinematics, response) = evaluate(&law, c, &motions, &old);
    }
    let Response { force, moment, state, status, energy } = response;
    if !(force.norm_squared() + moment.norm_squared() + energy.stored()).is_finite() {
        return BondOutcome::NotANumber;
    }
    let point = &kinematics.point;
    let lever = point.normal.cross(&force);
    c.force = force.into();
    c.torque = [(lever * point.arm_a + moment).into(), (lever * point.arm_b - moment).into()];
    c.moment = moment.into();
    c.normal = point.normal.into();
    c.damage_energy = energy.damage;
    c.integration_energy = energy.integration;
    c.stored_energy = if status == Status::Lives { energy.stored() } else { 0.0 };
    // SAFETY: guaranteed by the caller.
    unsafe {
        for k in 0..3 {
            *c.rest_direction.add(k) = state.rest_direction[k];
            *c.rest_rotation.add(k) = state.rest_rotation[k];
        }
    }
    if status == Status::Lives { BondOutcome::Lives } else { BondOutcome::Broke }
}

/// Compute one step of a beam.
///
/// # Safety
/// `contact` must point to a beam; its addresses must be those of existing bodies and of its history.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_beam(contact: *mut BeamContact) -> BondOutcome {
    // SAFETY: guaranteed by the caller.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| unsafe { respond(contact) })).unwrap_or(BondOutcome::Internal)
}

/// Write the stiffnesses of a beam of known length: tension (N/m), shear (N/m), bending (N·m/rad), and twist (N·m/rad). Returns 0, or
/// −1 and a message if the parameters are invalid.
///
/// # Safety
/// The pointers must be valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_beam_stiffness(
    parameters: *const BeamParameters,
    stiffness: *mut [f64; 4],
    message: *const Message,
) -> i64 {
    // SAFETY: guaranteed by the caller.
    unsafe {
        guarded(message, || {
            let parameters = &*parameters;
            let law = parameters.law()?;
            law.validate().map_err(|error| error.to_string())?;
            if !(parameters.length > 0.0 && parameters.length.is_finite()) {
                return Err(format!("the length of the beam is {} m, but must be positive", parameters.length));
            }
            let k = law.stiffnesses(&parameters.geometry());
            *stiffness = [k.normal, k.shear, k.bending, k.twist];
            Ok(0)
        })
    }
}
