//! Moves bonded bodies in place of YADE's `NewtonIntegrator`.

use std::ffi::c_void;
use std::time::{Duration, Instant};

use concordem::math::Vec3;
use concordem::prefetch::{AHEAD, prefetch};
use concordem::solver::own_thread::Workers;
use concordem_yade::assembly::{Assembly, BodyState};
use concordem_yade::newton::{Acting, Moving, Newton};
use pyo3::prelude::*;
use rayon::prelude::*;

use concordem_python::work::Pool;

use super::host::{Host, symbol};
use crate::memory::{peek, poke};

/// A member function of `ForceContainer` that returns the sum of the forces or torques of a body.
type SumOf = unsafe extern "C" fn(*mut c_void, i32) -> *const f64;

/// Where the host keeps what moves its bodies. Offsets in bytes.
#[derive(Debug, Clone, Copy, FromPyObject)]
#[pyo3(from_item_all)]
pub struct MotionLayout {
    /// Address of the `NewtonIntegrator`.
    newton: usize,
    /// In it: coefficient of the damping, m/s² of gravity, `dampGravity`, mask of the bodies that it moves, `dead`.
    damping: usize,
    gravity: usize,
    damp_gravity: usize,
    mask: usize,
    dead: usize,
    /// In a state: mass, inertia, `isDamped`.
    mass: usize,
    inertia: usize,
    is_damped: usize,
    /// In a body: pointer to its bound.
    bound: usize,
    /// In a bound: position at the last search of the collider, and the distance from there at which the next one is due.
    reference: usize,
    sweep: usize,
    /// The mask and `dead` that the integrator has while the bodies are moved here.
    expected_mask: i32,
    expected_dead: bool,
    /// Whether other bodies may touch the particles, so that the collider must search.
    others: bool,
}

/// A body, and what acts on it.
struct Body {
    on: Acting,
    moving: Moving,
}

/// Write the motion of a body to the state at `object`.
#[inline(always)]
unsafe fn write(host: &Host, object: usize, moving: &Moving) {
    let [position, velocity, angular_velocity, orientation, _] = host.fields.map(|field| object + field);
    // Safety: the caller's promise.
    unsafe {
        poke::<[f64; 3]>(position, moving.position.into());
        poke::<[f64; 3]>(velocity, moving.velocity.into());
        poke::<[f64; 3]>(angular_velocity, moving.angular_velocity.into());
        poke(orientation, moving.orientation);
    }
}

/// Give the solver the motion of the bodies.
fn take(assembly: &mut Assembly, bodies: &[Body], dt: f64) -> Result<(), String> {
    assembly.take_motions(dt, |k, _| {
        let Body { on, moving } = &bodies[k];
        Ok(BodyState {
            position: moving.position,
            velocity: moving.velocity,
            angular_velocity: moving.angular_velocity,
            orientation: moving.orientation,
            constraint: on.blocked,
        })
    })
}

/// Move the bodies under the forces of the solver.
fn step_all(newton: &Newton, assembly: &Assembly, bodies: &mut [Body]) {
    const CHUNK: usize = 1024;
    let (forces, torques) = (assembly.solver.forces(), assembly.solver.torques());
    let parts = bodies.par_chunks_mut(CHUNK).zip(forces.par_chunks(CHUNK)).zip(torques.par_chunks(CHUNK));
    parts.for_each(|((bodies, forces), torques)| {
        for ((body, force), torque) in bodies.iter_mut().zip(forces).zip(torques) {
            // YADE adds forces to zero, which changes the sign of a zero.
            body.on.force = Vec3::zeros() + force;
            body.on.torque = Vec3::zeros() + torque;
            newton.step(&body.on, &mut body.moving);
        }
    });
}

/// What [`MotionLayout`] needs of the host's functions.
pub struct Motion {
    layout: MotionLayout,
    synchronize: unsafe extern "C" fn(*mut c_void),
    force: SumOf,
    torque: SumOf,
    /// Number of bodies of the host at the start.
    bodies: usize,
}

impl Motion {
    pub fn new(layout: MotionLayout, bodies: usize) -> PyResult<Self> {
        let synchronize = symbol(c"_ZN4yade14ForceContainer4syncEv")?;
        let (force, torque) =
            (symbol(c"_ZN4yade14ForceContainer8getForceEi")?, symbol(c"_ZN4yade14ForceContainer9getTorqueEi")?);
        // Safety: a member function of that mangled name takes `this`.
        let synchronize = unsafe { std::mem::transmute::<*mut c_void, unsafe extern "C" fn(*mut c_void)>(synchronize) };
        // Safety: member functions of these mangled names take `this` and an int and return a reference to three doubles.
        let of = |address| unsafe { std::mem::transmute::<*mut c_void, SumOf>(address) };
        Ok(Self { layout, synchronize, force: of(force), torque: of(torque), bodies })
    }

    /// Whether the integrator and the number of bodies are those of the start.
    pub fn is_undisturbed(&self, bodies: usize) -> bool {
        let MotionLayout { newton, mask, dead, expected_mask, expected_dead, .. } = self.layout;
        // Safety: fields of the integrator, which the caller keeps alive.
        let (mask, dead) = unsafe { (peek::<i32>(newton + mask), peek::<u8>(newton + dead) != 0) };
        mask == expected_mask && dead == expected_dead && bodies == self.bodies
    }

    /// Sum the forces of all threads, as NewtonIntegrator does in each step; the host's next reset expects it.
    pub fn synchronize(&self, host: &Host) {
        // Safety: the host's object.
        unsafe { (self.synchronize)(host.forces as *mut c_void) }
    }

    /// Whether the host has forces or torques on a particle, besides ours: those of a script, which act in one step. YADE's ForceResetter leaves
    /// forces that were added after the last sum. [`Self::synchronize`] must come before.
    pub fn is_pushed(&self, host: &Host, ids: &[u32]) -> bool {
        let this = host.forces as *mut c_void;
        // Safety: the host's object, which has a force for each of its bodies.
        let sum = |of: SumOf, id: i32| unsafe { Vec3::from(peek::<[f64; 3]>(of(this, id) as usize)) };
        // In the order of the forces in memory. Written so that NaN counts.
        !host
            .by_id
            .iter()
            .map(|&p| ids[p as usize] as i32)
            .all(|id| sum(self.force, id) == Vec3::zeros() && sum(self.torque, id) == Vec3::zeros())
    }

    /// Settings of the integrator now.
    fn settings(&self, dt: f64) -> Newton {
        let MotionLayout { newton, damping, gravity, damp_gravity, .. } = self.layout;
        // Safety: fields of the integrator, which the caller keeps alive.
        unsafe {
            Newton {
                dt,
                damping: peek(newton + damping),
                gravity: Vec3::from(peek::<[f64; 3]>(newton + gravity)),
                damp_gravity: peek::<u8>(newton + damp_gravity) != 0,
            }
        }
    }

    /// Move all particles of `host`, whose bodies `gather` has compared, by a step of `dt` (s), on the threads of `workers`, or all processors. Returns whether
    /// the collider must search.
    pub fn step(&self, host: &Host, ids: &[u32], dt: f64, workers: Option<&Workers>) -> bool {
        const CHUNK: usize = 1024;
        let newton = self.settings(dt);
        self.synchronize(host);
        let threads = workers.map_or_else(|| Pool::All.threads(), Workers::threads);
        if threads == 1 || host.by_id.len() <= CHUNK {
            return self.step_some(host, &newton, ids, &host.by_id);
        }
        let step = || {
            let parts = host.by_id.par_chunks(CHUNK).map(|some| self.step_some(host, &newton, ids, some));
            parts.reduce(|| false, |one, two| one | two)
        };
        match workers {
            Some(workers) => workers.install(step),
            None => Pool::All.inside(step),
        }
    }

    /// Move some of the particles.
    fn step_some(&self, host: &Host, newton: &Newton, ids: &[u32], particles: &[u32]) -> bool {
        let mut search = false;
        for (k, &p) in particles.iter().enumerate() {
            if let Some(&next) = particles.get(k + AHEAD) {
                let object = host.seen[next as usize].1 as usize;
                host.fields.iter().for_each(|field| prefetch(object + field));
                prefetch(object + self.layout.inertia);
            }
            let (body, object) = host.seen[p as usize];
            let (body, object) = (body as usize, object as usize);
            // Safety: the body and its state exist, the offsets are those of their fields, and no other thread uses this body.
            unsafe { self.step_body(host, newton, ids[p as usize] as i32, object) };
            if self.layout.others {
                // Safety: as above.
                search |= unsafe { self.is_far(host, body, object) };
            }
        }
        search
    }

    /// Compute up to `most` steps at once, in copies of the bodies; at most for `time`. Nothing but the bonds and contacts may act on the
    /// bodies. Returns the number of steps; after an error, with the motion before the step that failed.
    pub fn several(
        &self,
        host: &Host,
        assembly: &mut Assembly,
        dt: f64,
        most: u64,
        time: Duration,
    ) -> (u64, Option<String>) {
        let newton = self.settings(dt);
        // Safety: `gather` has compared the bodies.
        let mut bodies: Vec<Body> =
            host.seen.iter().map(|&(_, object)| unsafe { self.read(host, object as usize) }).collect();
        let (start, mut done) = (Instant::now(), 0);
        let failed = loop {
            let outcome = if done == 0 { Ok(()) } else { take(assembly, &bodies, dt) };
            if let Err(error) = outcome.and_then(|()| assembly.find_forces(dt, None, false)) {
                break Some(error);
            }
            step_all(&newton, assembly, &mut bodies);
            done += 1;
            if done == most || start.elapsed() > time {
                break None;
            }
        };
        for (body, &(_, object)) in bodies.iter().zip(&host.seen) {
            // Safety: as above.
            unsafe { write(host, object as usize, &body.moving) };
        }
        (done, failed)
    }

    /// The body with the state at `object`, without its forces.
    unsafe fn read(&self, host: &Host, object: usize) -> Body {
        let [position, velocity, angular_velocity, orientation, blocked] = host.fields.map(|field| object + field);
        let layout = &self.layout;
        // Safety: the caller's promise.
        unsafe {
            let three = |address: usize| Vec3::from(peek::<[f64; 3]>(address));
            let on = Acting {
                force: Vec3::zeros(),
                torque: Vec3::zeros(),
                mass: peek(object + layout.mass),
                inertia: three(object + layout.inertia),
                blocked: peek(blocked),
                damped: peek::<u8>(object + layout.is_damped) != 0,
            };
            let moving = Moving {
                position: three(position),
                velocity: three(velocity),
                angular_velocity: three(angular_velocity),
                orientation: peek(orientation),
            };
            Body { on, moving }
        }
    }

    /// Move the body `id` with the state at `object`.
    #[inline(always)]
    unsafe fn step_body(&self, host: &Host, newton: &Newton, id: i32, object: usize) {
        let this = host.forces as *mut c_void;
        // Safety: the caller's promise.
        unsafe {
            let sum = |of: SumOf| Vec3::from(peek::<[f64; 3]>(of(this, id) as usize));
            let Body { mut on, mut moving } = self.read(host, object);
            (on.force, on.torque) = (sum(self.force), sum(self.torque));
            newton.step(&on, &mut moving);
            write(host, object, &moving);
        }
    }

    /// Whether a body has left the bound in which the collider knows it, as `NewtonIntegrator::saveMaximaDisplacement` decides.
    #[inline(always)]
    unsafe fn is_far(&self, host: &Host, body: usize, object: usize) -> bool {
        let layout = &self.layout;
        // Safety: the caller's promise.
        unsafe {
            let bound: usize = peek(body + layout.bound);
            if bound == 0 {
                return false;
            }
            let three = |address: usize| Vec3::from(peek::<[f64; 3]>(address));
            let moved = (three(object + host.fields[0]) - three(bound + layout.reference)).amax();
            moved != 0.0 && moved >= peek::<f64>(bound + layout.sweep)
        }
    }
}
