//! Motions of particles and meshes that a file gives step by step.

use concordem_contact::math::Vec3;
use concordem_solver::state::{Mesh, MeshError, State};
use concordem_solver::{Solver, SolverError};

/// What a recorded motion moves.
#[derive(Debug, Clone, PartialEq)]
pub enum Moved {
    /// Particles, by index: velocity (m/s) and angular velocity (rad/s).
    Particles(Vec<u32>),
    /// Vertices of the mesh of a wall, by index: velocities in the step, m/s.
    Driven(usize),
    /// Vertices of the mesh of a wall, by index: places after the step (m), and the velocities with which they came there (m/s).
    Placed(usize),
}

/// A motion given step by step. Entry 0 is that before the first step.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordedMotion {
    /// What moves.
    pub moved: Moved,
    /// Particles or vertices.
    pub count: usize,
    /// Vectors of all entries: one or two per particle or vertex.
    pub vectors: Vec<Vec3>,
}

impl RecordedMotion {
    /// Vectors per particle or vertex.
    fn width(&self) -> usize {
        if let Moved::Driven(_) = self.moved { 1 } else { 2 }
    }

    /// Steps of the file.
    pub fn steps(&self) -> u64 {
        (self.vectors.len() / (self.count * self.width()).max(1)).saturating_sub(1) as u64
    }

    /// The vectors of entry `step`; the last entry beyond the end.
    fn entry(&self, step: u64) -> &[Vec3] {
        let length = self.count * self.width();
        let first = step.min(self.steps()) as usize * length;
        &self.vectors[first..first + length]
    }

    /// Largest speed of each particle or vertex, m/s.
    pub fn fastest(&self) -> Vec<f64> {
        let (width, at) = (self.width(), usize::from(matches!(self.moved, Moved::Placed(_))));
        let mut fastest = vec![0.0_f64; self.count];
        for entry in self.vectors.chunks_exact((self.count * width).max(1)) {
            for (most, vectors) in fastest.iter_mut().zip(entry.chunks_exact(width)) {
                *most = most.max(vectors[at].norm());
            }
        }
        fastest
    }

    /// Sets the motion before the first step.
    ///
    /// # Errors
    /// Places at which a triangle has no area.
    pub(crate) fn start(&self, state: &mut State) -> Result<(), MeshError> {
        let entry = self.entry(0);
        match &self.moved {
            Moved::Particles(particles) => {
                for (&p, motion) in particles.iter().zip(entry.chunks_exact(2)) {
                    state.particles.velocity[p as usize] = motion[0];
                    state.particles.angular_velocity[p as usize] = motion[1];
                }
                Ok(())
            }
            Moved::Driven(wall) => {
                let Some(mesh) = state.walls[*wall].mesh_mut() else { return Ok(()) };
                mesh.velocity.fill(Vec3::zeros());
                mesh.previous_velocity.copy_from_slice(entry);
                Ok(())
            }
            Moved::Placed(wall) => {
                let dt = state.clock.dt;
                let Some(mesh) = state.walls[*wall].mesh_mut() else { return Ok(()) };
                place(mesh, entry, dt).map(drop)
            }
        }
    }

    /// Sets the velocities of the coming step.
    pub(super) fn apply(&self, state: &mut State, solver: &mut Solver) {
        let entry = self.entry(state.clock.step + 1);
        match &self.moved {
            Moved::Particles(particles) => {
                let targets = solver.targets_mut(&state.particles);
                for (&p, motion) in particles.iter().zip(entry.chunks_exact(2)) {
                    targets[p as usize] = (motion[0], motion[1]);
                }
            }
            Moved::Driven(wall) => {
                if let Some(mesh) = state.walls[*wall].mesh_mut() {
                    mesh.velocity.copy_from_slice(entry);
                }
            }
            Moved::Placed(_) => {}
        }
    }

    /// Places the vertices after a step.
    ///
    /// # Errors
    /// Places at which a triangle has no area.
    pub(super) fn place(&self, state: &mut State) -> Result<(), SolverError> {
        let Moved::Placed(wall) = self.moved else { return Ok(()) };
        let entry = self.entry(state.clock.step);
        let clock = state.clock;
        let State { walls, ledger, .. } = state;
        let wall = &mut walls[wall];
        let name = wall.name.clone();
        let Some(mesh) = wall.mesh_mut() else { return Ok(()) };
        let work = place(mesh, entry, clock.dt).map_err(|error| SolverError::Mesh {
            step: clock.step,
            time: clock.time(),
            wall: name,
            problem: error.to_string(),
        })?;
        ledger.add_boundary_work(work);
        Ok(())
    }
}

/// Places vertices; returns their work on the particles, J.
fn place(mesh: &mut Mesh, entry: &[Vec3], dt: f64) -> Result<f64, MeshError> {
    let (positions, velocities): (Vec<Vec3>, Vec<Vec3>) =
        entry.chunks_exact(2).map(|vectors| (vectors[0], vectors[1])).unzip();
    mesh.place(&positions, &velocities, dt)
}
