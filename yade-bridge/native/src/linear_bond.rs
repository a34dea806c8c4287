//! The brittle linear bond on one contact of YADE (`LinearBondPhys_Rust` on `ScGeom`), between particles that may deform: the
//! library's law on the bodies' own places and rotations.
//!
//! Motion is measured by [`MotionMeasure::Finite`], the default of the solver and of the bonded engine: YADE's integrator turns a body
//! by `ω Δt` in a step and moves it by `v Δt`, as ours does, so that increments of finite rotations are known and the work of
//! the bonds adds up to their energies.

#![allow(unsafe_code)]

use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_contact::kinematics::sphere_sphere::{ImageShift, initial_geometry, measure};
use concordem_contact::kinematics::{MotionMeasure, PreviousGeometry};
use concordem_contact::law::{ContactGeometry, ContactLaw, LinearBond, LinearBondState, Status};
use concordem_contact::math::{Symmetric, Vec3, quaternion_of_rotation_vector};

use crate::beam::{BodyMotion, Outcome};
use crate::deformation::{Elasticity, symmetric};
use crate::guard::{Message, guarded};

/// Parameters of a bond: [`LinearBond`].
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct LinearBondParameters {
    normal_stiffness: f64,
    shear_stiffness: f64,
    damping_ratio: f64,
    normal_strength: f64,
    shear_strength: f64,
    subtract_initial_gap: i32,
}

/// A body of a bond.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct BondedBody {
    motion: BodyMotion,
    /// Radius, m, and mass, kg.
    radius: f64,
    mass: f64,
    /// How far its surface moved out in this step and in the one before, m: six reals each ([`Symmetric`]), or null if it is
    /// rigid.
    surface_displacement: [*const f64; 2],
}

/// One bond, its history, and what it answers; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct LinearBondContact {
    parameters: LinearBondParameters,
    bodies: [BondedBody; 2],
    /// Displacement of the second body's periodic image, m.
    shift: [f64; 3],
    dt: f64,
    /// Length without force, m; 0 before the first evaluation, which sets it.
    reference_length: f64,
    /// History: distance of the centres in the step before, m, the direction from the first to the second, and
    /// [`LinearBondState`].
    length: f64,
    normal: [f64; 3],
    shear_displacement: [f64; 3],
    normal_dashpot: f64,
    shear_dashpot: [f64; 3],
    /// Force on the first body, N; the second gets the opposite.
    force: [f64; 3],
    /// Torques on both about their centres, N·m.
    torque: [[f64; 3]; 2],
    /// Stored, J.
    stored_energy: f64,
    /// Released by breaking, dissipated by dashpots, and error of the work rule in this step, J.
    damage_energy: f64,
    viscous_energy: f64,
    integration_energy: f64,
}

impl LinearBondParameters {
    fn law(&self) -> LinearBond {
        LinearBond {
            normal_stiffness: self.normal_stiffness,
            shear_stiffness: self.shear_stiffness,
            damping_ratio: self.damping_ratio,
            normal_strength: self.normal_strength,
            shear_strength: self.shear_strength,
            subtract_initial_gap: self.subtract_initial_gap != 0,
        }
    }
}

impl BondedBody {
    /// How far the surface moved out, now and one step ago.
    unsafe fn surface_displacement(&self) -> [Symmetric; 2] {
        // SAFETY: six reals, or null.
        self.surface_displacement.map(|p| if p.is_null() { Symmetric::default() } else { unsafe { symmetric(p) } })
    }
}

/// One step of one bond; history and length are changed only if the outcome is not an error.
unsafe fn respond(c: &mut LinearBondContact) -> Outcome {
    // SAFETY: the caller's promise.
    let mut motions = unsafe { [c.bodies[0].motion.read(), c.bodies[1].motion.read()] };
    let (mut reference_length, mut frame) =
        (c.reference_length, PreviousGeometry { normal: c.normal.into(), length: c.length });
    if reference_length > 0.0 {
        for motion in &mut motions {
            motion.rotation_increment = quaternion_of_rotation_vector(&(motion.angular_velocity * c.dt));
        }
    } else {
        // The bond begins here: how the bodies came to where they are does not strain it.
        frame = initial_geometry(&motions[0].position, &motions[1].position, &c.shift.into());
        reference_length = frame.length;
    }
    let [a, b] = &c.bodies;
    let geometry = ContactGeometry {
        reference_length,
        // The law reads no area.
        area: 0.0,
        radius_a: a.radius,
        radius_b: b.radius,
        mass_a: a.mass,
        mass_b: b.mass,
    };
    let image = ImageShift { displacement: c.shift.into(), ..ImageShift::default() };
    let kinematics = measure(MotionMeasure::Finite, &motions[0], &motions[1], &image, &geometry, &frame, true, c.dt);
    // SAFETY: the caller's promise.
    let [[a, a_old], [b, b_old]] = unsafe { [a.surface_displacement(), b.surface_displacement()] };
    let normal = kinematics.normal;
    let kinematics =
        kinematics.with_surface_displacement((a + b).quadratic(&normal), (a_old + b_old).quadratic(&frame.normal));
    let old = LinearBondState {
        shear_displacement: c.shear_displacement.into(),
        normal_dashpot: c.normal_dashpot,
        shear_dashpot: c.shear_dashpot.into(),
    };
    let response = c.parameters.law().respond(&kinematics, &old, c.dt);
    let (force, energy) = (response.force, response.energy);
    if !(force.norm_squared() + energy.stored()).is_finite() {
        return Outcome::NotANumber;
    }
    let lever = normal.cross(&force);
    c.force = force.into();
    c.torque = [(lever * kinematics.arm_a).into(), (lever * kinematics.arm_b).into()];
    c.reference_length = reference_length;
    c.length = kinematics.length;
    c.normal = normal.into();
    c.shear_displacement = response.state.shear_displacement.into();
    c.normal_dashpot = response.state.normal_dashpot;
    c.shear_dashpot = response.state.shear_dashpot.into();
    c.damage_energy = energy.damage;
    c.viscous_energy = energy.viscous;
    c.integration_energy = energy.integration;
    let lives = response.status == Status::Lives;
    c.stored_energy = if lives { energy.stored() } else { 0.0 };
    if lives { Outcome::Lives } else { Outcome::Broke }
}

/// Force of the dashpots of a bond with this direction and history, N.
pub fn viscous_force(normal: &Vec3, normal_dashpot: f64, shear_dashpot: Vec3) -> Vec3 {
    LinearBond::viscous_force(
        normal,
        &LinearBondState { shear_displacement: Vec3::zeros(), normal_dashpot, shear_dashpot },
    )
}

/// One step of a bond; see [`Outcome`].
///
/// # Safety
/// `contact` must point to a bond whose addresses are those of living bodies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_linear_bond(contact: *mut LinearBondContact) -> Outcome {
    // SAFETY: the caller's promise.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| unsafe { respond(contact) })).unwrap_or(Outcome::Internal)
}

/// Whether the parameters of a bond and the elasticities of its two particles have a meaning; −1 and a message if not.
///
/// # Safety
/// The pointers must be the shim's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_linear_bond_check(
    parameters: *const LinearBondParameters,
    elasticity: *const [Elasticity; 2],
    message: *const Message,
) -> i64 {
    // SAFETY: the caller's promise.
    unsafe {
        guarded(message, || {
            (*parameters).law().validate().map_err(|error| error.to_string())?;
            for particle in &*elasticity {
                particle.check()?;
            }
            Ok::<_, String>(0)
        })
    }
}

/// Size of [`LinearBondContact`] in bytes, for the shim to compare with its own.
#[unsafe(no_mangle)]
pub extern "C" fn concordem_yade_linear_bond_size() -> usize {
    size_of::<LinearBondContact>()
}
