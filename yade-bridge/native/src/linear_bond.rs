//! The linear bond for one YADE contact (`LinearBondPhys_Rust` on `ScGeom`) between particles that may deform, computed from the
//! positions and rotations of the bodies.
//!
//! The kinematics is [`MotionMeasure::Finite`], the default of the solver and of the bonded engine. YADE's integrator rotates a body by
//! `ω Δt` and moves it by `v Δt` in a step, as our solver does. The finite rotation increments are therefore known, and the work of the
//! bonds equals the change of their energies.

#![allow(unsafe_code)] // C functions and pointers into YADE's objects

use std::panic::{AssertUnwindSafe, catch_unwind};

use concordem_c_abi::{Message, guarded};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, initial_geometry};
use concordem_contact::kinematics::{MotionMeasure, PreviousGeometry};
use concordem_contact::law::{ContactLaw, LinearBond, LinearBondState, Reference, Status};
use concordem_contact::math::{Symmetric, Vec3, quaternion_of_rotation_vector};
use concordem_contact::step::{Contact, Ends, How, step};

use crate::body_motion::{BodyMotion, BondOutcome, symmetric};
use crate::deformation::Elasticity;

/// Parameters of `LinearBond`, SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
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
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondedBody {
    motion: BodyMotion,
    /// Radius, m.
    radius: f64,
    /// Mass, kg.
    mass: f64,
    /// Surface displacement in this step and in the previous one, m: addresses of six reals each (xx, yy, zz, yz, xz, xy), or null for
    /// a rigid body.
    surface_displacement: [*const f64; 2],
}

/// Parameters, motion, history, and results of one bond; SI units.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct LinearBondContact {
    parameters: LinearBondParameters,
    bodies: [BondedBody; 2],
    /// Displacement of the second body's periodic image, m.
    shift: [f64; 3],
    /// Time step, s.
    dt: f64,
    /// Reference length, m; 0 before the first step, which sets it.
    reference_length: f64,
    /// History: distance of the centers at the last step, m, then the unit vector from the first body to the second and the fields of
    /// `LinearBondState`.
    length: f64,
    normal: [f64; 3],
    shear_displacement: [f64; 3],
    normal_dashpot: f64,
    shear_dashpot: [f64; 3],
    /// Force on the first body, N; the second gets the opposite.
    force: [f64; 3],
    /// Torques on both bodies about their centers, N·m.
    torque: [[f64; 3]; 2],
    /// Stored energy, J.
    stored_energy: f64,
    /// Energies of this step, J: dissipated by breaking, dissipated by dashpots, error of the work rule.
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
    /// Surface displacement in this step and in the previous one, m.
    unsafe fn surface_displacement(&self) -> [Symmetric; 2] {
        // SAFETY: six reals, or null.
        self.surface_displacement.map(|p| if p.is_null() { Symmetric::default() } else { unsafe { symmetric(p) } })
    }
}

/// Compute one step of a bond. An error leaves history and length unchanged.
unsafe fn respond(c: &mut LinearBondContact) -> BondOutcome {
    // SAFETY: guaranteed by the caller.
    let mut motions = unsafe { [c.bodies[0].motion.read(), c.bodies[1].motion.read()] };
    let (mut reference_length, mut previous) =
        (c.reference_length, PreviousGeometry { normal: c.normal.into(), length: c.length });
    if reference_length > 0.0 {
        for motion in &mut motions {
            motion.rotation_increment = quaternion_of_rotation_vector(&(motion.angular_velocity * c.dt));
        }
    } else {
        // A new bond: earlier motion of the bodies does not strain it.
        previous = initial_geometry(&motions[0].position, &motions[1].position, &c.shift.into());
        reference_length = previous.length;
    }
    let image = ImageShift { displacement: c.shift.into(), ..ImageShift::default() };
    let [a, b] = &c.bodies;
    // SAFETY: guaranteed by the caller.
    let [[a_now, a_before], [b_now, b_before]] = unsafe { [a.surface_displacement(), b.surface_displacement()] };
    let ends = Ends {
        motion: [&motions[0], &motions[1]],
        radius: [a.radius, b.radius],
        mass: [a.mass, b.mass],
        image: &image,
        surface_displacement: Some([a_now + b_now, a_before + b_before]),
    };
    let history = LinearBondState {
        shear_displacement: c.shear_displacement.into(),
        normal_dashpot: c.normal_dashpot,
        shear_dashpot: c.shear_dashpot.into(),
    };
    // The law does not read the area.
    let reference = Reference { length: reference_length, area: 0.0 };
    let before = Contact { bonded: true, reference, previous, history };
    let stepped = step(&c.parameters.law(), &before, &ends, &How::new(MotionMeasure::Finite, c.dt));
    let (response, wrenches) = (stepped.response, stepped.wrenches());
    let (force, energy) = (response.force, response.energy);
    if !(force.norm_squared() + energy.stored()).is_finite() {
        return BondOutcome::NotANumber;
    }
    let PreviousGeometry { normal, length } = stepped.geometry();
    c.force = force.into();
    c.torque = [wrenches.a.torque.into(), wrenches.b.torque.into()];
    c.reference_length = reference_length;
    c.length = length;
    c.normal = normal.into();
    c.shear_displacement = response.state.shear_displacement.into();
    c.normal_dashpot = response.state.normal_dashpot;
    c.shear_dashpot = response.state.shear_dashpot.into();
    c.damage_energy = energy.damage;
    c.viscous_energy = energy.viscous;
    c.integration_energy = energy.integration;
    let lives = response.status == Status::Lives;
    c.stored_energy = if lives { energy.stored() } else { 0.0 };
    if lives { BondOutcome::Lives } else { BondOutcome::Broke }
}

/// Dashpot force of a bond on the first body, N.
pub fn viscous_force(normal: &Vec3, normal_dashpot: f64, shear_dashpot: Vec3) -> Vec3 {
    LinearBond::viscous_force(
        normal,
        &LinearBondState { shear_displacement: Vec3::zeros(), normal_dashpot, shear_dashpot },
    )
}

/// Compute one step of a bond.
///
/// # Safety
/// `contact` must point to a bond; its addresses must be those of existing bodies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_linear_bond(contact: *mut LinearBondContact) -> BondOutcome {
    // SAFETY: guaranteed by the caller.
    let contact = unsafe { &mut *contact };
    catch_unwind(AssertUnwindSafe(|| unsafe { respond(contact) })).unwrap_or(BondOutcome::Internal)
}

/// Check the parameters of a bond and the elastic constants of its two particles. Returns 0, or −1 and a message.
///
/// # Safety
/// The pointers must be valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_linear_bond_check(
    parameters: *const LinearBondParameters,
    elasticity: *const [Elasticity; 2],
    message: *const Message,
) -> i64 {
    // SAFETY: guaranteed by the caller.
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
