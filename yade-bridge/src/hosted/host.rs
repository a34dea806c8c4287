//! The host's bodies and forces in its memory.

use std::ffi::{CStr, c_void};

use concordem::math::Vec3;
use concordem::prefetch::{AHEAD, prefetch};
use concordem_yade::assembly::{Assembly, BodyState, PauseThreads};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use super::motion::Motion;
use crate::memory::{peek, targets};

/// A host function that adds a vector to the force or torque of a body. Arguments: `this`, id, vector.
type AddVector = unsafe extern "C" fn(*mut c_void, i32, *const f64);

/// Address of a function of the host.
pub fn symbol(name: &CStr) -> PyResult<*mut c_void> {
    // Safety: the name ends with a zero byte.
    let address = unsafe { libc::dlsym(libc::RTLD_DEFAULT, name.as_ptr()) };
    if address.is_null() {
        return Err(PyRuntimeError::new_err(format!(
            "YADE does not export {}; use a tested version",
            name.to_string_lossy()
        )));
    }
    Ok(address)
}

/// Memory layout of the host's bodies and forces.
pub struct Host {
    /// Vector of shared pointers to bodies.
    bodies: usize,
    /// Offset of the pointer to the state in a body.
    state: usize,
    /// Offsets in a state: position, velocity, angular velocity, orientation, prescribed degrees of freedom.
    pub fields: [usize; 5],
    /// Object of the forces.
    pub forces: usize,
    add_force: AddVector,
    add_torque: AddVector,
    /// OpenMP function that stops waiting threads; `None` if the host does not use OpenMP.
    pub pause: Option<PauseThreads>,
    /// Body and state of every particle when the host was attached.
    pub seen: Vec<(u64, u64)>,
    /// Particles in the order of their ids, which is the order of the host's forces in memory.
    pub by_id: Vec<u32>,
    /// How the particles are moved in place of the host; `None` if the host moves them.
    pub motion: Option<Motion>,
}

impl Host {
    /// The bodies `ids` and their states. See `Hosted::attach`.
    pub fn new(ids: &[u32], container: usize, forces: usize, offsets: [usize; 6]) -> PyResult<Self> {
        let add_force = symbol(c"_ZN4yade14ForceContainer8addForceEiRKN5Eigen6MatrixIdLi3ELi1ELi0ELi3ELi1EEE")?;
        let add_torque = symbol(c"_ZN4yade14ForceContainer9addTorqueEiRKN5Eigen6MatrixIdLi3ELi1ELi0ELi3ELi1EEE")?;
        // Safety: a member function of that mangled name takes `this`, an int, and a reference to three doubles.
        let adding = |address| unsafe { std::mem::transmute::<*mut c_void, AddVector>(address) };
        // Safety: OpenMP's function takes an enumeration, which is an int, and gives an int.
        let pausing = |address| unsafe { std::mem::transmute::<*mut c_void, PauseThreads>(address) };
        // Safety: the caller's promise.
        let bodies = unsafe { targets(container) };
        let mut seen = Vec::with_capacity(ids.len());
        for &id in ids {
            let body = bodies.get(id as usize).copied().filter(|&body| body != 0);
            let body = body.ok_or_else(|| PyRuntimeError::new_err(format!("the host has no body {id}")))?;
            // Safety: a body of the host.
            seen.push((body, unsafe { peek::<u64>(body as usize + offsets[0]) }));
        }
        let mut by_id: Vec<u32> = (0..ids.len() as u32).collect();
        by_id.sort_unstable_by_key(|&p| ids[p as usize]);
        Ok(Self {
            bodies: container,
            state: offsets[0],
            fields: [offsets[1], offsets[2], offsets[3], offsets[4], offsets[5]],
            forces,
            add_force: adding(add_force),
            add_torque: adding(add_torque),
            pause: symbol(c"omp_pause_resource_all").ok().map(pausing),
            seen,
            by_id,
            motion: None,
        })
    }

    /// Number of bodies of the host, deleted ones included.
    pub fn body_count(&self) -> usize {
        // Safety: the container belongs to the scene, which the caller has checked.
        let (begin, end): (usize, usize) = unsafe { (peek(self.bodies), peek(self.bodies + 8)) };
        (end - begin) / 16
    }

    /// Add the forces of the last step to those of the host.
    pub fn add_forces(&self, assembly: &Assembly) {
        let this = self.forces as *mut c_void;
        let (ids, force, torque) = (&assembly.state.particles.id, assembly.solver.forces(), assembly.solver.torques());
        for &p in &self.by_id {
            let p = p as usize;
            let (id, force, torque) = (ids[p] as i32, &force[p], &torque[p]);
            // Safety: `this` is the host's object, and bodies with these ids exist (compared in `gather`).
            unsafe {
                (self.add_force)(this, id, force.as_ptr());
                (self.add_torque)(this, id, torque.as_ptr());
            }
        }
    }

    /// Positions of the host's bodies now, in the order of the particles.
    pub fn present_positions(&self, assembly: &Assembly) -> Result<Vec<Vec3>, String> {
        // Safety: the container belongs to the scene, which the caller has checked.
        let begin: usize = unsafe { peek(self.bodies) };
        let count = self.body_count();
        let of = |(&id, &(body, object)): (&u32, &(u64, u64))| {
            let id = id as usize;
            // Safety: as in `gather`.
            let now = if id < count { unsafe { peek::<u64>(begin + 16 * id) } } else { 0 };
            if now != body || unsafe { peek::<u64>(body as usize + self.state) } != object {
                return Err(format!("body {id} was deleted or replaced, but has bonds"));
            }
            // Safety: a field of the state of an existing body.
            Ok(unsafe { Vec3::from(peek::<[f64; 3]>(object as usize + self.fields[0])) })
        };
        assembly.state.particles.id.iter().zip(&self.seen).map(of).collect()
    }

    /// Read positions and motion of the host's bodies; an error if a body was deleted or replaced since `attach`.
    pub fn gather(&self, assembly: &mut Assembly, dt: f64) -> Result<(), String> {
        // Safety: the container belongs to the scene, which the caller has checked.
        let begin: usize = unsafe { peek(self.bodies) };
        let count = self.body_count();
        let (rotation, constraint) = (assembly.needs_rotation, assembly.needs_constraint);
        let fields = if rotation { 4 } else { 3 };
        assembly.take_motions(dt, |k, id| {
            let (id, (body, object)) = (id as usize, self.seen[k]);
            // Prefetch, because bodies are scattered in memory.
            if let Some(&(body, object)) = self.seen.get(k + AHEAD) {
                prefetch(body as usize + self.state);
                for field in &self.fields[..fields] {
                    prefetch(object as usize + field);
                }
            }
            // Safety: within the vector; the body is read only if it has the address seen at first. (If a body was erased and
            // another created at the same address, reading it is still valid.)
            let now = if id < count { unsafe { peek::<u64>(begin + 16 * id) } } else { 0 };
            if now != body || unsafe { peek::<u64>(body as usize + self.state) } != object {
                return Err(format!(
                    "body {id} was deleted or replaced, but has bonds; before you erase a bonded body, call give_back() of the \
                     engine, which keeps the others' bonds, and take_over() after it (bond(): remove(), which deletes all bonds)"
                ));
            }
            let at = |field: usize| object as usize + self.fields[field];
            // Safety: fields of the state of an existing body.
            let three = |field: usize| unsafe { Vec3::from(peek::<[f64; 3]>(at(field))) };
            Ok(BodyState {
                position: three(0),
                velocity: three(1),
                angular_velocity: three(2),
                // Safety: as above.
                orientation: if rotation { unsafe { peek(at(3)) } } else { [0.0; 4] },
                // Safety: as above.
                constraint: if constraint { unsafe { peek(at(4)) } } else { 0 },
            })
        })
    }
}

/// The engines of a scene and their `dead` at a moment.
pub struct Engines {
    /// Vector of shared pointers to the engines.
    container: usize,
    /// Offset of `dead` in an engine.
    dead: usize,
    seen: Vec<(u64, bool)>,
}

impl Engines {
    /// The engines of the scene now.
    pub fn new(container: usize, dead: usize) -> Self {
        let mut engines = Self { container, dead, seen: Vec::new() };
        engines.seen = engines.now().collect();
        engines
    }

    fn now(&self) -> impl Iterator<Item = (u64, bool)> {
        // Safety: the container belongs to the scene, which the caller has checked.
        let (begin, end): (usize, usize) = unsafe { (peek(self.container), peek(self.container + 8)) };
        let dead = self.dead;
        (begin..end).step_by(16).map(move |at| {
            // Safety: pointers to engines of the scene.
            let engine: u64 = unsafe { peek(at) };
            // Safety: as above.
            (engine, engine != 0 && unsafe { peek::<u8>(engine as usize + dead) } != 0)
        })
    }

    /// Whether the engines are the same as at the start.
    pub fn are_the_same(&self) -> bool {
        self.now().eq(self.seen.iter().copied())
    }
}
