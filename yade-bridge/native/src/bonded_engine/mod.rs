//! C interface of the bonded engine: the shim creates an [`Assembly`], steps it, and reads it.
//!
//! A function that can fail returns −1 or a null pointer and writes a message. No panic unwinds into C++.

// Called from C++ with the shim's pointers; `abi.h` documents their lengths.
#![allow(unsafe_code, clippy::missing_safety_doc)]

mod arrays;
mod particle_results;

use std::ffi::c_char;

use concordem_c_abi::{Message, guarded, slice};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::prefetch::{AHEAD, prefetch};

use crate::assembly::{Assembly, BodyState, PAUSE_SOFT};
pub use arrays::{BodyArrays, BondedStep, ConcreteScene, Facts};
#[cfg(test)]
pub use arrays::{CellArrays, ContactArrays, PairCoefficients};
use arrays::{cell, text};
use concordem_solver::own_thread;

/// Bonds of a scene, and the threads that compute their forces.
pub struct Bonds {
    assembly: Assembly,
    pool: own_thread::Workers,
}

/// Create an assembly with `threads` threads. Returns null and a message on failure.
unsafe fn boxed(message: *const Message, threads: i32, make: impl FnOnce() -> Result<Assembly, String>) -> *mut Bonds {
    let mut made = std::ptr::null_mut();
    // SAFETY: a valid message from the shim.
    unsafe {
        guarded(message, || {
            let pool = own_thread::Workers::new(threads.max(1) as usize);
            let pool = pool.map_err(|error| format!("cannot start {threads} threads: {error}"))?;
            let assembly = make()?;
            made = Box::into_raw(Box::new(Bonds { assembly, pool }));
            Ok::<_, String>(0)
        });
    }
    made
}

/// Take over concrete from the scene. Returns null and a message if this is not possible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_concrete(
    scene: *const ConcreteScene,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: arrays of the stated lengths.
    unsafe {
        boxed(message, threads, || {
            let scene = &*scene;
            scene.with(|bodies, contacts, origin| {
                Assembly::concrete(bodies, contacts, &[], origin, cell(scene.cell, scene.dt), scene.dt)
            })
        })
    }
}

/// Create the bonds of a scenario between bodies of the scene; of `bodies`, only id, mass, and inertia are read. Returns null and a
/// message if this is not possible.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_scenario(
    scenario: *const c_char,
    bodies: *const BodyArrays,
    dt: f64,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: arrays of the stated lengths.
    unsafe {
        boxed(message, threads, || {
            let (id, mass, inertia) = (*bodies).identity();
            Assembly::of_text(text(scenario)?, id, mass, inertia, dt)
        })
    }
}

/// Load the assembly that [`concordem_yade_bonds_words`] saved. Returns null and a message if the words are invalid.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_load(
    words: *const i32,
    count: usize,
    threads: i32,
    message: *const Message,
) -> *mut Bonds {
    // SAFETY: an array of the stated length.
    unsafe { boxed(message, threads, || Assembly::from_words(slice(words, count))) }
}

/// Delete an assembly.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_delete(bonds: *mut Bonds) {
    if !bonds.is_null() {
        // SAFETY: created in this module, deleted once.
        drop(unsafe { Box::from_raw(bonds) });
    }
}

/// Save the assembly: call `take` once with `context`, the words, and their number. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_words(
    bonds: *const Bonds,
    take: extern "C" fn(context: *mut std::ffi::c_void, words: *const i32, count: usize),
    context: *mut std::ffi::c_void,
    message: *const Message,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || {
            let words = (*bonds).assembly.to_words()?;
            take(context, words.as_ptr(), words.len());
            Ok::<_, String>(0)
        })
    }
}

/// Write counts and energies.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_facts(bonds: *const Bonds, facts: *mut Facts) {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let Bonds { assembly: a, pool } = &*bonds;
        *facts = Facts {
            particles: a.state.particles.len(),
            bonds: a.state.bond_count(),
            broken: a.broken,
            steps: a.state.clock.step,
            neighbor_list_rebuilds: a.solver.neighbor_rebuilds(),
            dissipated: a.dissipated,
            stored: a.stored,
            cell_volume: a.state.cell.map_or(0.0, |cell| cell.volume()),
            needs_rotation: i32::from(a.needs_rotation),
            threads: pool.threads() as i32,
        };
    }
}

/// Ids of the bodies in the order of the particles; as many as `Facts::particles`.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_ids(bonds: *const Bonds) -> *const u32 {
    // SAFETY: valid pointers from the shim.
    unsafe { (*bonds).assembly.state.particles.id.as_ptr() }
}

/// Addresses of the forces (N) and torques (N·m) of the last step, three reals per particle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_forces(
    bonds: *const Bonds,
    force: *mut *const f64,
    torque: *mut *const f64,
) {
    // SAFETY: valid pointers from the shim.
    unsafe {
        let solver = &(*bonds).assembly.solver;
        *force = solver.forces().as_ptr().cast();
        *torque = solver.torques().as_ptr().cast();
    }
}

/// Compute one step at the positions and velocities of the bodies. Returns the number of bonds that broke, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_step(
    bonds: *mut Bonds,
    step: *const BondedStep,
    message: *const Message,
) -> i64 {
    // SAFETY: one row per particle; each address is that of an existing state of the scene.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &mut *bonds;
            let step = &*step;
            if let Some(pause) = step.pause.filter(|_| assembly.wants_host_threads_paused(pool.threads())) {
                pause(PAUSE_SOFT);
            }
            let count = assembly.state.particles.len();
            // As integers, which can be shared between threads; nobody writes to these addresses meanwhile.
            let states = slice(step.states.cast::<[usize; 4]>(), count);
            let blocked = slice(step.blocked.cast::<usize>(), count);
            let (rotation, constraint) = (assembly.needs_rotation, assembly.needs_constraint);
            let (dt, sample, present) = (step.dt, step.sample != 0, step.present);
            let cell = cell(step.cell, dt);
            let context = step.context as usize;
            let broken = own_thread::inside(pool, || {
                assembly.take_motions(dt, |k, body| {
                    if present(context as *const std::ffi::c_void, k, body) == 0 {
                        return Err(format!(
                            "body {body} was deleted or replaced, but has bonds; call release() of the engine before"
                        ));
                    }
                    if let Some(next) = states.get(k + AHEAD) {
                        next[..if rotation { 4 } else { 3 }].iter().for_each(|&address| prefetch(address));
                    }
                    let [position, velocity, angular_velocity, orientation] = states[k];
                    let vector = |address: usize| Vec3::from(*(address as *const [f64; 3]));
                    Ok(BodyState {
                        position: vector(position),
                        velocity: vector(velocity),
                        angular_velocity: vector(angular_velocity),
                        orientation: if rotation { *(orientation as *const [f64; 4]) } else { [0.0; 4] },
                        constraint: if constraint { *(blocked[k] as *const u32) } else { 0 },
                    })
                })?;
                assembly.find_forces(dt, cell, sample)
            })?;
            Ok::<_, String>(broken as i64)
        })
    }
}

/// Write the virial `Σ l⊗f` over all contacts, J: forces of the last step, branch vectors between the present positions, at the
/// addresses `positions` of all particles; if `positions` is null, between the positions of the last step. Nine reals in row-major order,
/// branch vector first. Returns 0, or −1 and a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn concordem_yade_bonds_virial(
    bonds: *const Bonds,
    positions: *const *const [f64; 3],
    virial: *mut [f64; 9],
    message: *const Message,
) -> i64 {
    // SAFETY: one address per particle, nine reals.
    unsafe {
        guarded(message, || {
            let Bonds { assembly, pool } = &*bonds;
            let present: Option<Vec<Vec3>> = (!positions.is_null()).then(|| {
                let addresses = slice(positions, assembly.state.particles.len());
                addresses.iter().map(|&address| Vec3::from(*address)).collect()
            });
            let sum = pool.install(|| assembly.virial(present.as_deref())).map_err(|error| error.to_string())?;
            *virial = row_by_row(&sum);
            Ok::<_, String>(0)
        })
    }
}

/// Components of a tensor in row-major order.
fn row_by_row(tensor: &Mat3) -> [f64; 9] {
    std::array::from_fn(|k| tensor[(k / 3, k % 3)])
}

/// Hash of the C header that this library was built with. The shim compares it to the hash of its own header.
#[unsafe(no_mangle)]
pub extern "C" fn concordem_yade_header_hash() -> u64 {
    concordem_c_abi::header_hash(include_bytes!("../../shim/abi.h"))
}
