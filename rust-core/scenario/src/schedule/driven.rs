//! What histories drive: motions, walls, meshes, loads, and heating.

use super::field::Field;
use super::recorded::RecordedMotion;
use super::{History, Membrane};
use concordem_contact::math::{Vec3, quaternion_of_rotation_vector};
use concordem_solver::Solver;
use concordem_solver::heat::supply::Factors;
use concordem_solver::state::particles::Load;
use concordem_solver::state::{Mesh, State};

/// A motion of particles that a history or a velocity field drives.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedMotion {
    /// The history; `None`: the factor is 1.
    pub history: Option<History>,
    /// Indices of the particles.
    pub particles: Vec<u32>,
    /// Velocity at the factor 1, m/s, by component; `None` for components that this motion leaves alone.
    pub velocity: [Option<f64>; 3],
    /// Angular velocity at the factor 1, rad/s, by component.
    pub angular_velocity: [Option<f64>; 3],
    /// Displacement since the start at the factor 1, m, by component.
    pub displacement: [Option<f64>; 3],
    /// Velocity field at the factor 1.
    pub field: Option<Field>,
}

impl TimedMotion {
    /// What sets the components that this motion drives of a particle at a position (m): velocity (m/s) and angular velocity
    /// (rad/s), for the step from `time` (s) to `time + dt`.
    fn setter(&self, time: f64, dt: f64) -> impl Fn(&Vec3, &mut Vec3, &mut Vec3) {
        let at = |time: f64| self.history.as_ref().map_or(1.0, |history| history.at(time));
        let factor = at(time + 0.5 * dt);
        let rate = (at(time + dt) - at(time)) / dt;
        let field = self.field.as_ref().map(|field| field.step(factor, dt));
        move |position: &Vec3, velocity: &mut Vec3, angular_velocity: &mut Vec3| {
            if let Some(field) = &field {
                field.set(position, velocity, angular_velocity);
            }
            self.set(factor, rate, velocity, angular_velocity);
        }
    }

    /// Sets the components that do not depend on the position. `rate`: of the factor, 1/s.
    fn set(&self, factor: f64, rate: f64, velocity: &mut Vec3, angular_velocity: &mut Vec3) {
        for i in 0..3 {
            if let Some(v) = self.velocity[i] {
                velocity[i] = v * factor;
            }
            if let Some(u) = self.displacement[i] {
                velocity[i] = u * rate;
            }
            if let Some(w) = self.angular_velocity[i] {
                angular_velocity[i] = w * factor;
            }
        }
    }
}

/// A wall whose velocity follows a history.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedWall {
    /// The history.
    pub history: History,
    /// Index of the wall.
    pub wall: usize,
    /// Velocity at the factor 1, m/s.
    pub velocity: Vec3,
}

/// A mesh whose vertices follow a history: over the change `g` of the factor since the start, a vertex moves from `X` to
/// `c + d g + R(θg)(X + u g − c)`.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedMesh {
    /// The history.
    pub history: History,
    /// Index of the wall.
    pub wall: usize,
    /// Vertices `X` at the start, m.
    pub reference: Vec<Vec3>,
    /// Displacement `d` of all vertices at the change 1, m.
    pub displacement: Vec3,
    /// Rotation vector `θ` at the change 1, rad.
    pub rotation: Vec3,
    /// Center `c` of the rotation, m.
    pub center: Vec3,
    /// Displacements `u` of the single vertices at the change 1, m; may be empty.
    pub single: Vec<Vec3>,
}

impl TimedMesh {
    /// Position of vertex `k` after the change `g` of the factor, m.
    pub fn position(&self, k: usize, g: f64) -> Vec3 {
        let own = self.single.get(k).map_or_else(Vec3::zeros, |u| u * g);
        let arm = self.reference[k] + own - self.center;
        if self.rotation == Vec3::zeros() {
            return self.center + self.displacement * g + arm;
        }
        let rotation = quaternion_of_rotation_vector(&(self.rotation * g));
        let (w, u) = (rotation.w, rotation.imag());
        let t = u.cross(&arm) * 2.0;
        self.center + self.displacement * g + arm + t * w + u.cross(&t)
    }

    /// Upper bound of the speed of vertex `k`, m/s, while the change of the factor does not exceed twice its largest value.
    pub fn fastest(&self, k: usize) -> f64 {
        let own = self.single.get(k).map_or(0.0, Vec3::norm);
        let arm = (self.reference[k] - self.center).norm() + own * 2.0 * self.history.largest();
        self.history.steepest() * (self.displacement.norm() + own + self.rotation.norm() * arm)
    }

    /// Set the velocities that take the vertices to their places at the end of the step from `time` (s) to `time + dt`.
    fn set(&self, time: f64, dt: f64, mesh: &mut Mesh) {
        let g = self.history.at(time + dt) - self.history.at(0.0);
        for (k, (velocity, place)) in mesh.velocity.iter_mut().zip(&mesh.position).enumerate() {
            *velocity = (self.position(k, g) - place) / dt;
        }
    }
}

/// A wall whose angular velocity follows a history.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedTurning {
    /// The history.
    pub history: History,
    /// Index of the wall.
    pub wall: usize,
    /// Angular velocity at the factor 1, rad/s.
    pub angular_velocity: Vec3,
}

impl TimedTurning {
    /// Sets the angular velocity at `time` (s).
    fn set(&self, state: &mut State, time: f64) {
        if let Some(turning) = &mut state.walls[self.wall].turning {
            turning.angular_velocity = self.angular_velocity * self.history.at(time);
        }
    }
}

/// Loads that follow a history.
#[derive(Debug, Clone, PartialEq)]
pub struct TimedLoads {
    /// The history.
    pub history: History,
    /// Loads at the factor 1, each with the index of its entry in the list of all loads.
    pub loads: Vec<(usize, Load)>,
}

/// Histories of what heats from outside, in the order of the model; all times are thermal times.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeatHistories {
    /// Thermal time that passes in one second of the run.
    pub time_factor: f64,
    /// Of the sources.
    pub sources: Vec<Option<History>>,
    /// Of the surfaces.
    pub surfaces: Vec<Option<History>>,
    /// Of the walls.
    pub walls: Vec<Option<History>>,
    /// Of the prescribed temperatures.
    pub held: Vec<Option<History>>,
}

impl HeatHistories {
    /// Factors for the step of `dt` from `time` (s, time of the run): in the middle of the step, or for prescribed
    /// temperatures at its end.
    pub fn factors(&self, time: f64, dt: f64) -> Factors {
        let at = |histories: &[Option<History>], time: f64| -> Vec<f64> {
            let thermal = time * self.time_factor;
            histories.iter().map(|history| history.as_ref().map_or(1.0, |history| history.at(thermal))).collect()
        };
        Factors {
            sources: at(&self.sources, time + 0.5 * dt),
            surfaces: at(&self.surfaces, time + 0.5 * dt),
            walls: at(&self.walls, time + 0.5 * dt),
            held: at(&self.held, time + dt),
        }
    }
}

/// Everything that histories drive.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Histories {
    /// Motions of particles.
    pub motions: Vec<TimedMotion>,
    /// Velocities of walls.
    pub walls: Vec<TimedWall>,
    /// Motions of meshes.
    pub meshes: Vec<TimedMesh>,
    /// Angular velocities of walls.
    pub turning: Vec<TimedTurning>,
    /// Loads on particles.
    pub loads: Vec<TimedLoads>,
    /// Membranes.
    pub membranes: Vec<Membrane>,
    /// All loads of the run at the factor 0: the constant ones.
    pub constant_loads: Vec<Load>,
    /// Heat from outside, if heat flows.
    pub heat: Option<HeatHistories>,
    /// Motions that files give step by step.
    pub recorded: Vec<RecordedMotion>,
}

impl Histories {
    /// Sets the velocities of the first step.
    pub(crate) fn start(&self, state: &mut State) {
        let between = 0.5 * state.clock.dt;
        for wall in &self.walls {
            state.walls[wall.wall].velocity = wall.velocity * wall.history.at(between);
        }
        for timed in &self.meshes {
            if let Some(mesh) = state.walls[timed.wall].mesh_mut() {
                timed.set(0.0, 2.0 * between, mesh);
                // They have come with it: a contact of the first step slides at once.
                mesh.previous_velocity.clone_from(&mesh.velocity);
            }
        }
        for turning in &self.turning {
            turning.set(state, between);
            // No contact has moved before the first step.
            if let Some(turning) = &mut state.walls[turning.wall].turning {
                turning.previous = turning.angular_velocity;
            }
        }
        let particles = &mut state.particles;
        for motion in &self.motions {
            let set = motion.setter(0.0, state.clock.dt);
            for &p in &motion.particles {
                let p = p as usize;
                set(&particles.position[p], &mut particles.velocity[p], &mut particles.angular_velocity[p]);
            }
        }
    }

    /// Loads for the forces at the present positions, velocities for the step to the next ones.
    pub(super) fn apply(&self, state: &mut State, solver: &mut Solver) {
        let (time, dt) = (state.clock.time(), state.clock.dt);
        let between = time + 0.5 * dt;
        self.apply_loads(state, time);
        if let Some(heat) = &self.heat {
            solver.set_heat_factors(heat.factors(time, dt));
        }
        for wall in &self.walls {
            state.walls[wall.wall].velocity = wall.velocity * wall.history.at(between);
        }
        for timed in &self.meshes {
            if let Some(mesh) = state.walls[timed.wall].mesh_mut() {
                timed.set(time, dt, mesh);
            }
        }
        for turning in &self.turning {
            turning.set(state, between);
        }
        for motion in &self.recorded {
            motion.apply(state, solver);
        }
        if self.motions.is_empty() {
            return;
        }
        let targets = solver.targets_mut(&state.particles);
        for motion in &self.motions {
            let set = motion.setter(time, dt);
            for &p in &motion.particles {
                let (velocity, angular_velocity) = &mut targets[p as usize];
                set(&state.particles.position[p as usize], velocity, angular_velocity);
            }
        }
    }

    /// Sets the loads at `time` (s).
    fn apply_loads(&self, state: &mut State, time: f64) {
        if self.loads.is_empty() && self.membranes.is_empty() {
            return;
        }
        let (all, position) = (&mut state.particles.loads, &state.particles.position);
        all.clone_from(&self.constant_loads);
        for timed in &self.loads {
            let factor = timed.history.at(time);
            for (at, load) in &timed.loads {
                let entry = &mut all[*at];
                entry.force += load.force * factor;
                entry.moment += load.moment * factor;
                // The force and the side on which it acts both change sign.
                entry.virial += load.virial * factor.abs();
            }
        }
        for membrane in &self.membranes {
            membrane.press(position, time, all);
        }
    }
}
