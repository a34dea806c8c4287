//! The cohesive beam on one contact of YADE (`BeamPhys_Rust` on `ScGeom6D`): the library's law on the bodies' own places and
//! orientations.

#![allow(unsafe_code)]

use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry};
use concordem_contact::kinematics::{FrameKinematics, PreviousGeometry};
use concordem_contact::law::{
    BeamModel, BendingTerm, CohesiveBeam, CohesiveBeamState, ContactGeometry, ContactLaw, Response, Section, Status,
};
use concordem_contact::math::{Quat, Vec3, quaternion_of_rotation_vector};

use crate::guard::{Message, guarded};

/// Where a body is and how it moves: addresses of three, three, three, and four reals (orientation x, y, z, w).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct BodyMotion {
    position: *const f64,
    velocity: *const f64,
    spin: *const f64,
    orientation: *const f64,
}

/// Parameters of a beam.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct BeamParameters {
    /// Young's modulus, Pa.
    young: f64,
    /// Poisson's ratio.
    poisson: f64,
    /// Shear coefficient (Timoshenko) or ratio of the springs (dual spring); not read otherwise.
    shear: f64,
    /// Tensile strength, Pa; infinite: unbreakable.
    strength: f64,
    /// Cross-section, m².
    area: f64,
    /// Length without strain, m; 0 before the first evaluation, which sets it.
    length: f64,
    /// Number of the model, in the order of [`BeamModel`].
    model: i32,
    /// Number of the bending term, in the order of [`BendingTerm`].
    bending_term: i32,
}

/// One beam, its history, and what it answers; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct BeamContact {
    parameters: BeamParameters,
    bodies: [BodyMotion; 2],
    /// Displacement of the second body's periodic image, m, and its rate, m/s.
    shift: [f64; 3],
    shift_velocity: [f64; 3],
    dt: f64,
    /// History: addresses of three reals each ([`CohesiveBeamState`]).
    rest_direction: *mut f64,
    rest_rotation: *mut f64,
    /// Force on the first body, N; the second gets the opposite.
    force: [f64; 3],
    /// Torques on both about their centres, N·m.
    torque: [[f64; 3]; 2],
    /// Moment of the middle section on the first body, N·m.
    moment: [f64; 3],
    /// Unit vector from the first body to the second.
    normal: [f64; 3],
    /// Stored, J.
    stored_energy: f64,
    /// Released by breaking in this step, J.
    damage_energy: f64,
    /// Error of the work rule in this step, J.
    integration_energy: f64,
}

/// What became of a beam.
#[repr(i32)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Outcome {
    /// It holds.
    Lives = 0,
    /// It broke.
    Broke = 1,
    /// The force is not a number.
    NotANumber = -1,
    /// The parameters have no meaning; [`concordem_yade_beam_stiffness`] tells which.
    Parameters = -2,
    /// A panic was stopped.
    Internal = -3,
}

/// Three reals.
pub(crate) unsafe fn vector(p: *const f64) -> Vec3 {
    // SAFETY: three reals.
    unsafe { Vec3::new(*p, *p.add(1), *p.add(2)) }
}

impl BodyMotion {
    /// The motion; how far the body turned in the step is left out.
    pub(crate) unsafe fn read(&self) -> Motion {
        // SAFETY: as the struct says.
        unsafe {
            let q = self.orientation;
            Motion {
                position: vector(self.position),
                velocity: vector(self.velocity),
                angular_velocity: vector(self.spin),
                rotation_increment: Quat::identity(),
                orientation: Quat::new(*q.add(3), *q, *q.add(1), *q.add(2)),
            }
        }
    }
}

impl BeamParameters {
    /// The law; what is wrong with the numbers of its words.
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
                        "BeamPhys_Rust.model is {other}; it may be 0 (euler-bernoulli), 1 (timoshenko), 2 (dual-spring), 3 (spring)"
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
                        "BeamPhys_Rust.bendingTerm is {other}; it may be 0 (mid-section), 1 (half-sum), 2 (larger-end)"
                    ));
                }
            },
        })
    }

    fn geometry(&self) -> ContactGeometry {
        // Neither radii nor masses matter to the law.
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

/// Answer of the law to the present state of `a` and `b`.
fn answer(
    law: &CohesiveBeam,
    c: &BeamContact,
    [a, b]: &[Motion; 2],
    old: &CohesiveBeamState,
) -> (FrameKinematics, Response<CohesiveBeamState>) {
    let image = ImageShift { displacement: c.shift.into(), velocity: c.shift_velocity.into(), periodic: false };
    let geometry = c.parameters.geometry();
    // The law reads no length of the last step.
    let frame = PreviousGeometry { normal: Vec3::zeros(), length: geometry.reference_length };
    let kinematics = FrameKinematics::new(a, b, &image, &geometry, &frame, true, c.dt);
    (kinematics, law.respond(&kinematics, old, c.dt))
}

/// One step of one beam; history and length are changed only if the outcome is not an error.
unsafe fn respond(c: &mut BeamContact) -> Outcome {
    // SAFETY: the caller's promise.
    let mut motions = unsafe { [c.bodies[0].read(), c.bodies[1].read()] };
    if c.parameters.length <= 0.0 {
        c.parameters.length = initial_geometry(&motions[0].position, &motions[1].position, &c.shift.into()).length;
    }
    let Ok(law) = c.parameters.law() else { return Outcome::Parameters };
    // SAFETY: the caller's promise.
    let old = unsafe {
        CohesiveBeamState { rest_direction: vector(c.rest_direction), rest_rotation: vector(c.rest_rotation) }
    };
    let (mut kinematics, mut response) = answer(&law, c, &motions, &old);
    if response.status != Status::Lives {
        // Only the work of the step in which it breaks asks how far the bodies turned.
        for motion in &mut motions {
            motion.rotation_increment = quaternion_of_rotation_vector(&(motion.angular_velocity * c.dt));
        }
        (kinematics, response) = answer(&law, c, &motions, &old);
    }
    let Response { force, moment, state, status, energy } = response;
    if !(force.norm_squared() + moment.norm_squared() + energy.stored()).is_finite() {
        return Outcome::NotANumber;
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
    // SAFETY: the caller's promise.
    unsafe {
        for k in 0..3 {
            *c.rest_direction.add(k) = state.rest_direction[k];
            *c.rest_rotation.add(k) = state.rest_rotation[k];
        }
    }
    if status == Status::Lives { Outcome::Lives } else { Outcome::Broke }
}

/// One step of a beam; see [`Outcome`].
///
/// # Safety
/// `contact` must point to a beam whose addresses are those of living bodies and of its history.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_beam(contact: *mut BeamContact) -> Outcome {
    // SAFETY: the caller's promise.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| unsafe { respond(contact) })).unwrap_or(Outcome::Internal)
}

/// Stiffnesses of a beam whose length is known, in tension (N/m), shear (N/m), bending (N·m/rad), and twist (N·m/rad);
/// −1 and a message if its parameters have no meaning.
///
/// # Safety
/// The pointers must be the shim's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_beam_stiffness(
    parameters: *const BeamParameters,
    stiffness: *mut [f64; 4],
    message: *const Message,
) -> i64 {
    // SAFETY: the caller's promise.
    unsafe {
        guarded(message, || {
            let parameters = &*parameters;
            let law = parameters.law()?;
            law.validate().map_err(|error| error.to_string())?;
            if !(parameters.length > 0.0 && parameters.length.is_finite()) {
                return Err(format!("the length of the beam is {} m", parameters.length));
            }
            let k = law.stiffnesses(&parameters.geometry());
            *stiffness = [k.normal, k.shear, k.bending, k.twist];
            Ok(0)
        })
    }
}

/// Size of [`BeamContact`] in bytes, for the shim to compare with its own.
#[unsafe(no_mangle)]
pub extern "C" fn concordem_yade_beam_size() -> usize {
    size_of::<BeamContact>()
}
