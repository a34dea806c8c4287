//! Bonds and contacts of particles that a host moves. Both bonded engines use this: the one in the native plugin and the one that
//! needs no YADE headers.
//!
//! In every step, the host calls [`Assembly::take_motions`] (positions and velocities of its bodies), then
//! [`Assembly::find_forces`]. `concrete` takes over existing contacts from the host; `saved` stores an assembly in the host's save
//! file.

pub mod cohesive;
mod concrete;
mod histories;
mod host_law;
pub mod jointed;
mod results;
mod saved;
#[cfg(test)]
mod tests;

use std::path::Path;
use std::time::{Duration, Instant};

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::law::EnergySplit;
use concordem_contact::law::cpm::CpmParameters;
use concordem_contact::math::{Mat3, Quat, Vec3, quaternion_of_rotation_vector};
use concordem_scenario::assembly::assemble_without_hdf5;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::{Cell, Constraint, State};
use concordem_solver::{Model, Solver, StepReport};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

pub use concrete::{Bodies, Contacts, HostClump, PairParameters, STORED};
pub use histories::Contacts as ContactsWithHistories;
pub use host_law::HostLaw;
pub use results::ParticleResults;

/// How an assembly was created, so that it can be recreated without its state. Save files contain it, so keys must not change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Origin {
    /// Taken over from the host's concrete.
    Concrete {
        /// Kinematics.
        kinematics: MotionMeasure,
        /// Number of materials.
        materials: usize,
        /// Local damping coefficient; used only if our solver moves the particles.
        damping: f64,
        /// Gravity, m/s²; used only if our solver moves the particles.
        gravity: [f64; 3],
        /// Parameters of all pairs of materials.
        #[serde(rename = "rows")]
        pairs: Vec<PairParameters>,
        /// Parameters of contacts that differ from their materials'.
        #[serde(default)]
        own: Vec<CpmParameters>,
    },
    /// Taken over from the host's cohesive and frictional spheres.
    Cohesive {
        /// Kinematics.
        kinematics: MotionMeasure,
        /// Materials.
        materials: Vec<cohesive::Material>,
        /// What holds for all contacts.
        rules: cohesive::Rules,
    },
    /// Taken over from the host's jointed cohesive frictional spheres.
    Jointed {
        /// Kinematics.
        kinematics: MotionMeasure,
        /// Materials.
        materials: Vec<jointed::Material>,
        /// What holds for all contacts.
        rules: jointed::Rules,
    },
    /// Bonds of a scenario.
    Scenario {
        /// Text of the scenario.
        text: String,
    },
    /// Created by a caller that stores the origin itself.
    Elsewhere {},
}

/// The kinematics with this name.
///
/// # Errors
/// An unknown name; the message lists the valid ones.
pub fn motion_measure(name: &str) -> Result<MotionMeasure, String> {
    match name {
        "finite" => Ok(MotionMeasure::Finite),
        "first-order" => Ok(MotionMeasure::FirstOrder),
        "yade" => Ok(MotionMeasure::Yade),
        "yade-ratcheting" => Ok(MotionMeasure::YadeRatcheting),
        other => Err(format!(
            "kinematics is \"{other}\"; give \"finite\", \"first-order\", \"yade\", or \"yade-ratcheting\""
        )),
    }
}

/// The periodic cell with these edges (m, columns), deformation gradient, and velocity gradient (1/s). The last step moved the
/// edges: `H = (1 + LΔt) H_old`.
pub fn cell_of(matrix: Mat3, deformation_gradient: Mat3, velocity_gradient: Mat3, dt: f64) -> Cell {
    let matrix_change = (Mat3::identity() + velocity_gradient * dt)
        .try_inverse()
        .map_or_else(Mat3::zeros, |back| matrix - back * matrix);
    Cell { matrix, deformation_gradient, velocity_gradient, matrix_change }
}

/// Refuse what heat conduction needs and a host does not give.
fn refuse_heat(assembly: &concordem_scenario::assembly::Assembly) -> Result<(), String> {
    let Some(model) = &assembly.model.heat else { return Ok(()) };
    if !model.mechanics {
        return Err("heat.motion = false, but the host moves the particles; remove the key".to_owned());
    }
    let timed = assembly.schedule.histories.heat.as_ref().is_some_and(|heat| {
        [&heat.sources, &heat.surfaces, &heat.walls, &heat.held].into_iter().flatten().any(Option::is_some)
    });
    if timed {
        return Err(
            "[[heat.source]] and [[heat.boundary]] with `history` need our own solver; remove the key".to_owned()
        );
    }
    Ok(())
}

/// Check the length of array `name`.
fn same_length(name: &str, found: usize, wanted: usize) -> Result<(), String> {
    if found == wanted { Ok(()) } else { Err(format!("`{name}` has {found} entries, but must have {wanted}")) }
}

/// Position and motion of a body of the host. The orientation is read only if [`Assembly::needs_rotation`], the constraint only if
/// [`Assembly::needs_constraint`].
#[derive(Debug, Clone, Copy, Default)]
pub struct BodyState {
    /// Center, m.
    pub position: Vec3,
    /// Velocity, m/s.
    pub velocity: Vec3,
    /// Angular velocity, rad/s.
    pub angular_velocity: Vec3,
    /// Orientation, unit quaternion (x, y, z, w), body to world.
    pub orientation: [f64; 4],
    /// Bit mask of the degrees of freedom that the host prescribes, see [`Constraint`].
    pub constraint: u32,
}

/// The bodies of a host that are the spheres of a scenario, in their order.
#[derive(Debug, Clone, Copy)]
pub struct Spheres<'a> {
    /// Their ids.
    pub id: &'a [u32],
    /// Masses, kg.
    pub mass: &'a [f64],
    /// Moments of inertia, kg m².
    pub inertia: &'a [f64],
    /// Clumps that the host moves, with members among them.
    pub clumps: &'a [HostClump],
}

/// OpenMP's `omp_pause_resource_all` (version 5.0, section 3.2.44). Only the thread that starts parallel loops may call it; within
/// such a loop it fails and has no effect.
pub type PauseThreads = unsafe extern "C" fn(i32) -> i32;
/// Argument of [`PauseThreads`] that keeps all settings (`omp_pause_soft`).
pub const PAUSE_SOFT: i32 = 1;
/// Coordinates must be rounded by less than this fraction of the smallest radius.
const ROUNDED: f64 = 1e-4;
/// Pause the host's threads only for computations longer than this: stopping and restarting costs 0.06 ms for one thread (measured
/// on two idle cores) and more for several.
const LONG: Duration = Duration::from_millis(1);

/// Particles with their bonds and contacts, and the solver that computes their forces.
pub struct Assembly {
    /// Particles, bonds, contacts, cell, and clock.
    pub state: State,
    /// The solver.
    pub solver: Solver,
    /// Bonds broken so far.
    pub broken: u64,
    /// Number of bonds that each particle has lost, in the order of the particles.
    pub losses: Vec<u32>,
    /// Number of unbonded contacts of each particle that have opened.
    pub openings: Vec<u32>,
    /// Largest distance from the origin, m, at which the radii are not lost in rounding.
    farthest: f64,
    /// Whether the law or the kinematics reads orientations.
    pub needs_rotation: bool,
    /// Whether prescribed degrees of freedom affect forces, because their reactions strain deformable particles.
    pub needs_constraint: bool,
    /// Cracks and bonds that began, of jointed cohesive frictional spheres, since the host has last taken them.
    pub happenings: jointed::Happenings,
    /// Energies since the start, J: dissipated by damage, friction, and dashpots, and the error of the work rule.
    pub dissipated: [f64; 4],
    /// Energy stored at the last sampled step, J.
    pub stored: f64,
    /// Duration of the last force computation.
    force_time: Duration,
    /// Largest stable step of heat conduction, s; infinite without any.
    heat_limit: f64,
    origin: Origin,
}

impl Assembly {
    /// An assembly with this state and model.
    ///
    /// # Errors
    /// The solver rejects them.
    pub fn new(mut state: State, model: Model, origin: Origin) -> Result<Self, String> {
        // YADE's kinematics use velocities; the others use rotations.
        let oriented = state.bonds.iter().chain(&state.contacts).any(|block| block.reads_orientations());
        let needs_rotation = oriented || !matches!(model.mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
        let needs_constraint = model.deformable.is_some();
        let solver = Solver::new(model, &mut state).map_err(|error| error.to_string())?;
        let losses = vec![0; state.particles.len()];
        let smallest = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let farthest = ROUNDED / f64::EPSILON * smallest;
        Ok(Self {
            state,
            solver,
            broken: 0,
            openings: losses.clone(),
            losses,
            farthest,
            needs_rotation,
            needs_constraint,
            happenings: jointed::Happenings::default(),
            dissipated: [0.0; 4],
            stored: 0.0,
            force_time: Duration::ZERO,
            heat_limit: f64::INFINITY,
            origin,
        })
    }

    /// The spheres of a scenario with its bonds and contacts, built as for a run. Masses and moments of inertia come from the host.
    /// Members of a clump have no bonds and contacts with each other.
    ///
    /// # Errors
    /// Arrays of different lengths, a time step above the time step bound, or clumps with heat or deformable particles.
    pub fn of_scenario(
        assembly: concordem_scenario::assembly::Assembly,
        allow_unstable: bool,
        origin: Origin,
        spheres: Spheres<'_>,
        dt: f64,
    ) -> Result<Self, String> {
        let Spheres { id, mass, inertia, clumps } = spheres;
        refuse_heat(&assembly)?;
        let heat_limit = assembly.summary.heat_step.filter(|_| !allow_unstable).unwrap_or(f64::INFINITY);
        let (mut state, model) = (assembly.state, assembly.model);
        let n = state.particles.len();
        for (name, found) in [("bodies", id.len()), ("mass", mass.len()), ("inertia", inertia.len())] {
            same_length(name, found, n)?;
        }
        let limit = assembly.summary.bounds.spectral.max(assembly.summary.bounds.per_particle);
        if !(allow_unstable || dt > 0.0 && dt < limit) {
            return Err(format!(
                "the host's time step is {dt:.4e} s, but must be below {limit:.4e} s for stable bonds (with the masses of \
                 the scenario's density); set O.dt, or integration.allow_unstable"
            ));
        }
        let mut place = vec![0; n];
        for p in 0..n {
            let sphere = state.particles.id[p] as usize;
            place[sphere] = p as u32;
            state.particles.mass[p] = mass[sphere];
            state.particles.inertia[p] = inertia[sphere];
            state.particles.id[p] = id[sphere];
        }
        if !clumps.is_empty() {
            if model.deformable.is_some() || model.heat.is_some() {
                return Err("spheres of clumps are rigid and their contacts lie within, so they neither deform nor conduct heat; exclude \
                            them, or remove [deformable] and [heat]"
                    .into());
            }
            // The host moves the members, which in a cell that deforms leave their places a little.
            concrete::add_clumps(&mut state, clumps, &place, f64::INFINITY)?;
            let State { particles, bonds, contacts, .. } = &mut state;
            let of = |p: u32| particles.clump[p as usize];
            for block in bonds.iter_mut().chain(contacts) {
                block.retain_pairs(&|pair, _| of(pair.a) == u32::MAX || of(pair.a) != of(pair.b));
            }
        }
        state.clock.dt = dt;
        let mut made = Self::new(state, model, origin)?;
        made.heat_limit = heat_limit;
        made.refuse_step_of_heat(dt)?;
        Ok(made)
    }

    /// Temperature of each particle, K, in the order of the particles; `None` without heat conduction.
    pub fn temperatures(&self) -> Option<&[f64]> {
        self.state.heat.as_ref().map(|heat| &heat.temperature[..])
    }

    /// Fail if the step of the host is too large for explicit conduction.
    fn refuse_step_of_heat(&self, dt: f64) -> Result<(), String> {
        if dt <= self.heat_limit {
            return Ok(());
        }
        let limit = self.heat_limit;
        Err(format!(
            "the host's time step is {dt:.4e} s, but must be at most {limit:.4e} s for stable heat conduction; set O.dt, heat.time_factor, \
             heat.scheme = \"implicit\", or integration.allow_unstable"
        ))
    }

    /// As [`Self::of_scenario`], for the text of a scenario.
    ///
    /// # Errors
    /// An invalid scenario, or an error of [`Self::of_scenario`].
    pub fn of_text(text: &str, bodies: &[u32], mass: &[f64], inertia: &[f64], dt: f64) -> Result<Self, String> {
        let scenario = Scenario::parse("scenario", text)
            .map_err(|error| error.problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "))?;
        let made =
            assemble_without_hdf5(&scenario, Path::new("."), &mut |_, _| {}).map_err(|error| error.to_string())?;
        let origin = Origin::Scenario { text: text.to_owned() };
        let spheres = Spheres { id: bodies, mass, inertia, clumps: &[] };
        Self::of_scenario(made, scenario.integration.allow_unstable, origin, spheres, dt)
    }

    /// Compute the forces at the positions from [`Self::take_motions`] and return the number of bonds that broke. `sample`: sum stored
    /// energies.
    ///
    /// # Errors
    /// A time step that is not positive, a cell that appeared or disappeared, an error of the solver, or a force that is not finite.
    pub fn find_forces(&mut self, dt: f64, cell: Option<Cell>, sample: bool) -> Result<usize, String> {
        if !(dt > 0.0 && dt.is_finite()) {
            return Err(format!("the time step is {dt} s, but must be positive; set O.dt"));
        }
        self.refuse_step_of_heat(dt)?;
        if cell.is_some() != self.state.cell.is_some() {
            return Err(
                "O.periodic changed after the bonds were created; keep it, or create the bonds afterwards".into()
            );
        }
        if cell.is_some() {
            self.state.cell = cell;
        }
        self.state.clock.dt = dt;
        let start = Instant::now();
        let report = self.solver.find_forces(&mut self.state, sample).map_err(|error| error.to_string())?;
        self.force_time = start.elapsed();
        self.state.clock.step += 1;
        for (p, (force, torque)) in self.solver.forces().iter().zip(self.solver.torques()).enumerate() {
            if !(force.norm_squared() + torque.norm_squared()).is_finite() {
                return Err(format!(
                    "the force on body {} is not finite; reduce the time step",
                    self.state.particles.id[p]
                ));
            }
        }
        if sample {
            self.stored = report.energy.stored();
        }
        Ok(self.count(&report))
    }

    /// Add the broken bonds and dissipated energies of a step to the totals; return the number of bonds that broke.
    pub fn count(&mut self, report: &StepReport) -> usize {
        let mut count = 0;
        for (_, bond_event) in report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke) {
            self.losses[bond_event.pair.a as usize] += 1;
            self.losses[bond_event.pair.b as usize] += 1;
            count += 1;
        }
        for pair in &report.opened {
            self.openings[pair.a as usize] += 1;
            self.openings[pair.b as usize] += 1;
        }
        count += self.note_cracks();
        self.broken += count as u64;
        let EnergySplit { damage, friction, viscous, integration, .. } = report.energy;
        for (sum, part) in self.dissipated.iter_mut().zip([damage, friction, viscous, integration]) {
            *sum += part;
        }
        count
    }

    /// Whether to stop the host's waiting OpenMP threads ([`PauseThreads`]) before `threads` threads compute here, because they spin on
    /// the same cores for about 8 ms (measured). The host's next parallel loop restarts them. Results do not depend on this.
    pub fn wants_host_threads_paused(&self, threads: usize) -> bool {
        threads > 1 && self.force_time > LONG
    }

    /// Read positions and velocities of all particles. Several threads call `motion(k, id)` for particle `k`, which is body `id` of the
    /// host.
    ///
    /// # Errors
    /// The error of the first particle for which `motion` fails, is not finite, or is too far away.
    pub fn take_motions(
        &mut self,
        dt: f64,
        motion: impl Fn(usize, u32) -> Result<BodyState, String> + Sync,
    ) -> Result<(), String> {
        const CHUNK: usize = 1024;
        let (rotation, constraint, farthest) = (self.needs_rotation, self.needs_constraint, self.farthest);
        let p = &mut self.state.particles;
        let moved = p.position.par_chunks_mut(CHUNK).zip(p.velocity.par_chunks_mut(CHUNK));
        let turned = p.orientation.par_chunks_mut(CHUNK).zip(p.rotation_increment.par_chunks_mut(CHUNK));
        let rotated = p.angular_velocity.par_chunks_mut(CHUNK).zip(p.constraint.par_chunks_mut(CHUNK));
        let chunks = p.id.par_chunks(CHUNK).zip(moved).zip(turned).zip(rotated).enumerate();
        let refused = chunks.find_map_first(|(chunk, (((id, (x, v)), (q, increment)), (w, mask)))| {
            for i in 0..id.len() {
                let body = match motion(chunk * CHUNK + i, id[i]) {
                    Ok(body) => body,
                    Err(why) => return Some(why),
                };
                let BodyState { position, velocity, angular_velocity, .. } = body;
                if !(position + velocity + angular_velocity).iter().all(|c| c.is_finite()) {
                    return Some(format!("the position or velocity of body {} is not finite", id[i]));
                }
                if position.amax() > farthest {
                    let away = position.amax();
                    return Some(format!(
                        "body {} is {away:e} m from the origin, where radii are lost in rounding (at most {farthest:e} m are \
                         possible); find out what moved it",
                        id[i]
                    ));
                }
                (x[i], v[i], w[i]) = (position, velocity, angular_velocity);
                if rotation {
                    let [qx, qy, qz, qw] = body.orientation;
                    q[i] = Quat::new(qw, qx, qy, qz);
                    increment[i] = quaternion_of_rotation_vector(&(w[i] * dt));
                }
                if constraint {
                    mask[i] = Constraint(body.constraint as u8);
                }
            }
            None
        });
        refused.map_or(Ok(()), Err)
    }
}
