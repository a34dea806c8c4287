//! The pass over the deformable particles of a YADE scene: the solver's [`DeformationPass`] with the bond forces that YADE stores.
//!
//! It keeps no data between steps. The history of a body is in its YADE state, which YADE saves.

#![allow(unsafe_code)] // C functions and pointers into YADE's objects

use std::ffi::{CStr, c_char};

use concordem_c_abi::{Message, guarded, slice};
use concordem_contact::kinematics::deformable::{Condition, Deformable, ParticleVirial, Update};
use concordem_contact::law::Elastic;
use concordem_contact::math::Vec3;
use concordem_solver::deformation::{DeformationPass, DeformationSums};
use concordem_solver::state::{Constraint, Deformation, Particles};

use crate::body_motion::{symmetric, vector};
use crate::linear_bond::viscous_force;
use concordem_solver::own_thread;

/// Elastic constants of a particle: Young's modulus (Pa; infinite for a rigid particle) and Poisson's ratio.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct Elasticity {
    young: f64,
    poisson: f64,
}

/// A deformable body with the addresses of its history and results, six reals each (xx, yy, zz, yz, xz, xy).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct DeformableBody {
    /// Index of its elasticity.
    material: u32,
    /// Bit mask of its prescribed degrees of freedom (`Constraint`).
    blocked: u32,
    /// Radius, m.
    radius: f64,
    /// History, N: particle virials, see `Deformation`.
    dyad: *mut f64,
    used: *mut f64,
    other: *mut f64,
    reaction: *mut f64,
    /// Surface displacement in the next step, m.
    surface_displacement: *mut f64,
    /// Surface displacement in this step, m.
    surface_displacement_before: *mut f64,
    /// Stress, Pa.
    stress: *mut f64,
}

/// Force of a bond in this step.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondForce {
    /// Indices of the two bodies.
    bodies: [u32; 2],
    /// Unit vector from the first body to the second: address of three reals.
    normal: *const f64,
    /// Force on the first body, N: address of three reals.
    force: *const f64,
    /// Normal force of the dashpot, N.
    normal_dashpot: f64,
    /// Shear force of the dashpot, N: address of three reals.
    shear_dashpot: *const f64,
}

/// Energies of the deformation of all particles, J: see `DeformationSums`.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct DeformationEnergies {
    stored: f64,
    lag: f64,
    other: f64,
    reactions: f64,
}

/// A bond in the pass: bodies, normal, force on the first body (N), and the dashpot part of that force (N).
struct Bond {
    bodies: [u32; 2],
    normal: Vec3,
    force: Vec3,
    viscous: Vec3,
}

/// Scratch memory and threads of the pass.
pub struct DeformationScratch {
    particles: Particles,
    bonds: Vec<Bond>,
    pass: DeformationPass,
    force: Vec<Vec3>,
    pool: own_thread::Workers,
}

impl Elasticity {
    /// Check the elastic constants.
    ///
    /// # Errors
    /// Young's modulus is not positive, or Poisson's ratio is not in (−1, 0.5].
    pub fn check(&self) -> Result<(), String> {
        let Self { young, poisson } = *self;
        // Comparisons with NaN are false.
        let (positive, possible) = (young > 0.0, poisson > -1.0 && poisson <= 0.5);
        if !positive {
            return Err(format!(
                "LinearBondMat_Rust.particleYoung = {young} must be positive (Pa; inf for rigid particles)"
            ));
        }
        if !possible {
            return Err(format!(
                "LinearBondMat_Rust.particlePoisson = {poisson} must be greater than -1 and at most 0.5"
            ));
        }
        Ok(())
    }
}

unsafe fn condition(name: *const c_char) -> Result<Condition, String> {
    // SAFETY: the shim passes zero-terminated strings.
    match unsafe { CStr::from_ptr(name) }.to_str() {
        Ok("solid") => Ok(Condition::Solid),
        Ok("plane-strain") => Ok(Condition::PlaneStrain),
        Ok("plane-stress") => Ok(Condition::PlaneStress),
        other => Err(format!(
            "condition is \"{}\"; give \"solid\", \"plane-strain\", or \"plane-stress\"",
            other.unwrap_or("not UTF-8")
        )),
    }
}

impl DeformationScratch {
    /// Copy the host's bodies and bonds.
    unsafe fn read(&mut self, bodies: &[DeformableBody], bonds: &[BondForce]) {
        let particles = &mut self.particles;
        particles.position.resize(bodies.len(), Vec3::zeros());
        particles.radius.clear();
        particles.material.clear();
        particles.constraint.clear();
        particles.deformation.clear();
        for body in bodies {
            particles.radius.push(body.radius);
            particles.material.push(body.material as u16);
            particles.constraint.push(Constraint(body.blocked as u8));
            // SAFETY: guaranteed by the caller.
            particles.deformation.push(unsafe {
                Deformation {
                    virial: symmetric(body.dyad),
                    used: symmetric(body.used),
                    other: symmetric(body.other),
                    reaction: symmetric(body.reaction),
                }
            });
        }
        self.bonds.clear();
        self.bonds.extend(bonds.iter().map(|bond| {
            // SAFETY: guaranteed by the caller.
            let (normal, force, shear) =
                unsafe { (vector(bond.normal), vector(bond.force), vector(bond.shear_dashpot)) };
            Bond { bodies: bond.bodies, normal, force, viscous: viscous_force(&normal, bond.normal_dashpot, shear) }
        }));
    }

    /// Run the pass after the forces of a step: sum over the bonds in their order and compute the strains for the next step.
    fn run(&mut self, deformable: &Deformable) -> Result<DeformationSums, String> {
        let Self { particles, bonds, pass, force, pool } = self;
        // Enter the pool only once, because waking its threads is slow.
        let (sums, strain) = own_thread::inside(pool, || {
            // Strains that act in this step.
            pass.begin(deformable, particles, false);
            pass.clear();
            force.clear();
            force.resize(particles.len(), Vec3::zeros());
            let reacting = deformable.reacting();
            for bond in &*bonds {
                let virial = ParticleVirial::of(&bond.normal, &bond.force, &bond.viscous, deformable.dashpots);
                let ([a, b], parts) = (bond.bodies.map(|body| body as usize), virial.parts());
                force[a] += bond.force;
                force[b] -= bond.force;
                pass.virials[a] += parts;
                pass.virials[b] += parts;
                if particles.constraint[a].any(reacting) {
                    pass.reaction_sums[a].add(&virial);
                }
                if particles.constraint[b].any(reacting) {
                    pass.reaction_sums[b].add_opposite(&virial);
                }
            }
            let sums = pass.finish(deformable, particles, force, &[]);
            // Strains for the next step.
            (sums, pass.begin(deformable, particles, true))
        });
        if strain.is_finite() {
            return Ok(sums);
        }
        Err("the strain of a particle is not finite; reduce the time step, or increase particleYoung".into())
    }

    /// Write the results to the host's bodies.
    unsafe fn write(&self, deformable: &Deformable, bodies: &[DeformableBody]) {
        let displacements = self.pass.surface_displacement.iter().zip(&self.pass.surface_displacement_before);
        for ((body, d), (now, before)) in bodies.iter().zip(&self.particles.deformation).zip(displacements) {
            let stress = deformable.stress(&d.virial, body.radius);
            for (to, from) in [
                (body.dyad, &d.virial),
                (body.used, &d.used),
                (body.other, &d.other),
                (body.reaction, &d.reaction),
                (body.surface_displacement, &now.0),
                (body.surface_displacement_before, before),
                (body.stress, &stress),
            ] {
                // SAFETY: guaranteed by the caller: six reals.
                unsafe { to.copy_from_nonoverlapping(from.0.as_ptr(), 6) };
            }
        }
    }
}

/// Create scratch memory of the pass with `threads` threads. Returns null and a message if they cannot be started.
///
/// # Safety
/// `message` must be valid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_scratch(
    threads: i32,
    message: *const Message,
) -> *mut DeformationScratch {
    let mut made = std::ptr::null_mut();
    // SAFETY: guaranteed by the caller.
    unsafe {
        guarded(message, || {
            let pool = own_thread::Workers::new(threads.max(1) as usize);
            let pool = pool.map_err(|error| format!("cannot start {threads} threads: {error}"))?;
            made = Box::into_raw(Box::new(DeformationScratch {
                particles: Particles::default(),
                bonds: Vec::new(),
                pass: DeformationPass::default(),
                force: Vec::new(),
                pool,
            }));
            Ok::<_, String>(0)
        });
    }
    made
}

/// Delete scratch memory of the pass.
///
/// # Safety
/// `scratch` must be from [`concordem_yade_deformation_scratch`] and not deleted yet.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_delete(scratch: *mut DeformationScratch) {
    if !scratch.is_null() {
        // SAFETY: guaranteed by the caller.
        drop(unsafe { Box::from_raw(scratch) });
    }
}

/// Input of [`concordem_yade_deformation`].
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct DeformableScene {
    bodies: *const DeformableBody,
    body_count: usize,
    /// Bonds; sums follow this order.
    bonds: *const BondForce,
    bond_count: usize,
    materials: *const Elasticity,
    material_count: usize,
    /// solid, plane-strain, or plane-stress.
    condition: *const c_char,
    /// Whether dashpot forces strain the particles.
    dashpots: i32,
}

/// Run the pass after the forces of a step: compute history, surface displacement, and stress of the bodies from the bond forces.
/// Returns 0, or −1 and a message.
///
/// # Safety
/// Arrays must have the stated lengths and contain addresses in existing objects. Body indices must be below `body_count`, material
/// indices below `material_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation(
    scratch: *mut DeformationScratch,
    scene: *const DeformableScene,
    energies: *mut DeformationEnergies,
    message: *const Message,
) -> i64 {
    // SAFETY: guaranteed by the caller.
    unsafe {
        guarded(message, || {
            let (scratch, scene) = (&mut *scratch, &*scene);
            let materials = slice(scene.materials, scene.material_count);
            let bodies = slice(scene.bodies, scene.body_count);
            let bonds = slice(scene.bonds, scene.bond_count);
            for material in materials {
                material.check()?;
            }
            if u16::try_from(materials.len()).is_err() {
                return Err(format!(
                    "{} materials of deformable particles; at most 65535 are supported",
                    materials.len()
                ));
            }
            let deformable = Deformable {
                elasticity: materials.iter().map(|m| Elastic { young: m.young, poisson: m.poisson }).collect(),
                condition: condition(scene.condition)?,
                update: Update::Lagged,
                dashpots: scene.dashpots != 0,
            };
            scratch.read(bodies, bonds);
            let sums = scratch.run(&deformable)?;
            scratch.write(&deformable, bodies);
            *energies = DeformationEnergies {
                stored: sums.stored,
                lag: sums.lag,
                other: sums.other,
                reactions: sums.reactions,
            };
            Ok::<_, String>(0)
        })
    }
}
