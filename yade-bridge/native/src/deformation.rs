//! The pass over deformable particles of a YADE scene: the solver's own
//! ([`DeformationPass`]) on the forces of bonds that YADE holds.
//!
//! It keeps nothing between steps: what strains a body is in its state, where YADE saves it.

#![allow(unsafe_code)]

use std::ffi::{CStr, c_char};

use concordem_contact::kinematics::deformable::{Condition, Deformable, ParticleVirial, Update};
use concordem_contact::law::Elastic;
use concordem_contact::math::{Symmetric, Vec3};
use concordem_solver::deformation::{DeformationPass, DeformationSums};
use concordem_solver::state::{Constraint, Deformation, Particles};

use crate::beam::vector;
use crate::guard::{Message, guarded};
use crate::linear_bond::viscous_force;

/// Elastic constants of a particle.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct Elasticity {
    /// Young's modulus, Pa; infinite for a rigid particle.
    young: f64,
    poisson: f64,
}

/// A body: where what strains it and what it answers are kept, six reals each (xx, yy, zz, yz, xz, xy).
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct DeformableBody {
    /// Its elasticity, by number.
    material: u32,
    /// Prescribed degrees of freedom ([`Constraint`]).
    blocked: u32,
    /// Radius, m.
    radius: f64,
    /// History, N: [`Deformation`].
    dyad: *mut f64,
    used: *mut f64,
    other: *mut f64,
    reaction: *mut f64,
    /// How far its surface will have moved out in the next step, and has in this one, m.
    surface_displacement: *mut f64,
    surface_displacement_before: *mut f64,
    /// Stress, Pa.
    stress: *mut f64,
}

/// A bond's answer in this step.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct BondAnswer {
    /// The bodies, by row.
    bodies: [u32; 2],
    /// Direction from the first to the second, and force on the first, N: three reals each.
    normal: *const f64,
    force: *const f64,
    /// Of which dashpots exert: along the normal, and across it (three reals), N.
    normal_dashpot: f64,
    shear_dashpot: *const f64,
}

/// What the deformation of all particles did ([`DeformationSums`]), J.
#[repr(C)]
#[derive(Debug, Clone, Copy)]
pub struct DeformationEnergies {
    stored: f64,
    lag: f64,
    other: f64,
    reactions: f64,
}

/// What the pass reads of a bond: bodies by row, direction, force on the first, and the part of it that dashpots exert, N.
struct Bond {
    bodies: [u32; 2],
    normal: Vec3,
    force: Vec3,
    viscous: Vec3,
}

/// Scratch of the pass, and its threads.
pub struct Scratch {
    particles: Particles,
    bonds: Vec<Bond>,
    pass: DeformationPass,
    force: Vec<Vec3>,
    pool: rayon::ThreadPool,
}

impl Elasticity {
    /// What is wrong with it.
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

/// Six reals.
pub(crate) unsafe fn symmetric(p: *const f64) -> Symmetric {
    // SAFETY: the caller's promise.
    Symmetric(std::array::from_fn(|k| unsafe { *p.add(k) }))
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

impl Scratch {
    /// Take over what the host has.
    unsafe fn read(&mut self, bodies: &[DeformableBody], bonds: &[BondAnswer]) {
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
                    dyad: symmetric(body.dyad),
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

    /// The pass after the forces of a step; strains for the next one. Bonds are added up in their order.
    fn run(&mut self, deformable: &Deformable) -> Result<DeformationSums, String> {
        let Self { particles, bonds, pass, force, pool } = self;
        // Once: threads that sleep take long to wake.
        let (sums, strain) = pool.install(|| {
            // What the bonds saw in this step.
            pass.begin(deformable, particles, false);
            pass.clear();
            force.clear();
            force.resize(particles.len(), Vec3::zeros());
            let reacting = deformable.reacting();
            for bond in &*bonds {
                let push = ParticleVirial::of(&bond.normal, &bond.force, &bond.viscous, deformable.dashpots);
                let ([a, b], dyads) = (bond.bodies.map(|body| body as usize), push.dyads());
                force[a] += bond.force;
                force[b] -= bond.force;
                pass.dyads[a] += dyads;
                pass.dyads[b] += dyads;
                if particles.constraint[a].any(reacting) {
                    pass.held[a].add(&push);
                }
                if particles.constraint[b].any(reacting) {
                    pass.held[b].add_opposite(&push);
                }
            }
            let sums = pass.finish(deformable, particles, force, &[]);
            // What they will see in the next one.
            (sums, pass.begin(deformable, particles, true))
        });
        if strain.is_finite() {
            return Ok(sums);
        }
        Err("the strain of a particle is not a number; is the time step too large, or particleYoung too small?".into())
    }

    /// Give the host what was found.
    unsafe fn write(&self, deformable: &Deformable, bodies: &[DeformableBody]) {
        let widenings = self.pass.surface_displacement.iter().zip(&self.pass.surface_displacement_before);
        for ((body, d), (now, before)) in bodies.iter().zip(&self.particles.deformation).zip(widenings) {
            let stress = deformable.stress(&d.dyad, body.radius);
            for (to, from) in [
                (body.dyad, &d.dyad),
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

/// Scratch for `threads` threads; null and a message if they cannot be started.
///
/// # Safety
/// The message must be the shim's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_scratch(threads: i32, message: *const Message) -> *mut Scratch {
    let mut made = std::ptr::null_mut();
    // SAFETY: the caller's promise.
    unsafe {
        guarded(message, || {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads.max(1) as usize).build();
            let pool = pool.map_err(|error| format!("cannot start {threads} threads: {error}"))?;
            made = Box::into_raw(Box::new(Scratch {
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

/// The end of a scratch.
///
/// # Safety
/// Made by [`concordem_yade_deformation_scratch`], deleted once.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation_delete(scratch: *mut Scratch) {
    if !scratch.is_null() {
        // SAFETY: the caller's promise.
        drop(unsafe { Box::from_raw(scratch) });
    }
}

/// The pass after the forces of a step: history, widening, and stress of the bodies from the answers of their bonds, which are
/// added up in the order given. 0, or −1 and a message.
///
/// # Safety
/// Arrays of the lengths given, with addresses in living objects; bodies of bonds are below `body_count`, materials of bodies
/// below `material_count`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_deformation(
    scratch: *mut Scratch,
    bodies: *const DeformableBody,
    body_count: usize,
    bonds: *const BondAnswer,
    bond_count: usize,
    materials: *const Elasticity,
    material_count: usize,
    condition_name: *const c_char,
    dashpots: i32,
    energies: *mut DeformationEnergies,
    message: *const Message,
) -> i64 {
    // SAFETY: the caller's promise.
    unsafe {
        guarded(message, || {
            let scratch = &mut *scratch;
            let list = |at: *const Elasticity| std::slice::from_raw_parts(at, material_count);
            let materials = if material_count == 0 { &[] } else { list(materials) };
            let bodies = if body_count == 0 { &[] } else { std::slice::from_raw_parts(bodies, body_count) };
            let bonds = if bond_count == 0 { &[] } else { std::slice::from_raw_parts(bonds, bond_count) };
            for material in materials {
                material.check()?;
            }
            if u16::try_from(material_count).is_err() {
                return Err(format!(
                    "{material_count} materials of deformable particles; at most 65535 can be told apart"
                ));
            }
            let deformable = Deformable {
                elasticity: materials.iter().map(|m| Elastic { young: m.young, poisson: m.poisson }).collect(),
                condition: condition(condition_name)?,
                update: Update::Lagged,
                dashpots: dashpots != 0,
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
