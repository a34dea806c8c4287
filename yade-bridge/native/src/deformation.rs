//! The pass over the deformable particles of a YADE scene: the solver's [`DeformationPass`] with the forces of bonds that YADE
//! stores.
//!
//! It stores nothing between steps: the history of a body lies in its YADE state, which YADE saves.

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

/// Elastic constants of a particle: `young` (Pa; infinite for a rigid particle) and `poisson`.
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
    /// Mask of its prescribed degrees of freedom (`Constraint`).
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

/// Result of a bond in this step.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondForce {
    /// Indices of the two bodies.
    bodies: [u32; 2],
    /// Direction from the first body to the second: address of three reals.
    normal: *const f64,
    /// Force on the first body, N: address of three reals.
    force: *const f64,
    /// Part of the dashpots along the normal, N.
    normal_dashpot: f64,
    /// Part of the dashpots across the normal, N: address of three reals.
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

/// A bond for the pass: bodies, direction, force on the first (N), and its part by dashpots (N).
struct Bond {
    bodies: [u32; 2],
    normal: Vec3,
    force: Vec3,
    viscous: Vec3,
}

/// Working memory and threads of the pass.
pub struct DeformationScratch {
    particles: Particles,
    bonds: Vec<Bond>,
    pass: DeformationPass,
    force: Vec<Vec3>,
    pool: rayon::ThreadPool,
}

impl Elasticity {
    /// An error unless the constants are possible.
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
            return Err(format!("LinearBondMat_Rust.particlePoisson = {poisson} must be above -1 and at most 0.5"));
        }
        Ok(())
    }
}

unsafe fn condition(name: *const c_char) -> Result<Condition, String> {
    // SAFETY: the shim passes strings that end with a zero.
    match unsafe { CStr::from_ptr(name) }.to_str() {
        Ok("solid") => Ok(Condition::Solid),
        Ok("plane-strain") => Ok(Condition::PlaneStrain),
        Ok("plane-stress") => Ok(Condition::PlaneStress),
        other => Err(format!(
            "condition is \"{}\"; it may be \"solid\", \"plane-strain\", \"plane-stress\"",
            other.unwrap_or("no text")
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
            // SAFETY: the caller's promise.
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
            // SAFETY: the caller's promise.
            let (normal, force, shear) =
                unsafe { (vector(bond.normal), vector(bond.force), vector(bond.shear_dashpot)) };
            Bond { bodies: bond.bodies, normal, force, viscous: viscous_force(&normal, bond.normal_dashpot, shear) }
        }));
    }

    /// The pass after the forces of a step. It sums the bonds in their order and strains the particles for the next step.
    fn run(&mut self, deformable: &Deformable) -> Result<DeformationSums, String> {
        let Self { particles, bonds, pass, force, pool } = self;
        // One entry into the pool: waking its threads takes long.
        let (sums, strain) = pool.install(|| {
            // Strains of this step.
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
            // Strains of the next step.
            (sums, pass.begin(deformable, particles, true))
        });
        if strain.is_finite() {
            return Ok(sums);
        }
        Err("the strain of a particle is not a number; is the time step too large, or particleYoung too small?".into())
    }

    /// Write the results into the host's bodies.
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
                // SAFETY: the caller's promise: six reals.
                unsafe { to.copy_from_nonoverlapping(from.0.as_ptr(), 6) };
            }
        }
    }
}

/// Working memory of the pass with `threads` threads; null and a message if they cannot be started.
///
/// # Safety
/// The message must be the shim's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_scratch(
    threads: i32,
    message: *const Message,
) -> *mut DeformationScratch {
    let mut made = std::ptr::null_mut();
    // SAFETY: the caller's promise.
    unsafe {
        guarded(message, || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1) as usize).build();
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

/// Delete working memory of the pass.
///
/// # Safety
/// Made by [`concordem_yade_deformation_scratch`], deleted once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_delete(scratch: *mut DeformationScratch) {
    if !scratch.is_null() {
        // SAFETY: the caller's promise.
        drop(unsafe { Box::from_raw(scratch) });
    }
}

/// A scene for [`concordem_yade_deformation`].
#[repr(C)]
#[derive(Debug, Clone, Copy)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct DeformableScene {
    bodies: *const DeformableBody,
    body_count: usize,
    /// Bonds, summed in this order.
    bonds: *const BondForce,
    bond_count: usize,
    materials: *const Elasticity,
    material_count: usize,
    /// solid, plane-strain, or plane-stress.
    condition: *const c_char,
    /// Whether forces of dashpots strain the particles.
    dashpots: i32,
}

/// The pass after the forces of a step: from the forces of the bonds follow history, surface displacement, and stress of the
/// bodies. 0, or −1 and a message.
///
/// # Safety
/// Arrays of the stated lengths, with addresses in living objects; bodies of bonds are below `body_count`, materials of bodies
/// below `material_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation(
    scratch: *mut DeformationScratch,
    scene: *const DeformableScene,
    energies: *mut DeformationEnergies,
    message: *const Message,
) -> i64 {
    // SAFETY: the caller's promise.
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
                    "{} materials of deformable particles; at most 65535 can be told apart",
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
