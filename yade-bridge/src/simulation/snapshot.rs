//! Moments of a simulation, to go back to.

use std::sync::Arc;

use concordem::math::Vec3;
use concordem::schedule::{Schedule, Simulation as Run};
use concordem::solver::SolverError;
use concordem::state::State;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Inner;

/// A moment of a simulation: everything that its steps change, in memory.
#[pyclass(frozen, module = "concordem")]
pub struct SimulationSnapshot {
    state: State,
    /// Velocities and angular velocities of `Simulation.set_motion`.
    targets: Option<Vec<(Vec3, Vec3)>>,
    /// Numbers of records so far: samples, rows of each operator, events.
    samples: usize,
    operators: Vec<usize>,
    events: usize,
    /// Identity of the simulation.
    owner: Arc<()>,
}

impl SimulationSnapshot {
    /// The present moment of the simulation with this identity.
    pub fn of(inner: &Inner, owner: &Arc<()>) -> Self {
        Self {
            state: inner.run.state.clone(),
            targets: inner.run.solver.targets().map(<[_]>::to_vec),
            samples: inner.samples.len(),
            operators: inner.operators.iter().map(Vec::len).collect(),
            events: inner.events.len(),
            owner: owner.clone(),
        }
    }

    /// Refuses the moment of another simulation.
    pub fn check(&self, identity: &Arc<()>) -> PyResult<()> {
        if Arc::ptr_eq(&self.owner, identity) {
            return Ok(());
        }
        Err(PyValueError::new_err("the snapshot is of another simulation; restore one of this simulation"))
    }

    /// Go back to this moment. The particle arrays keep their places, because Python has views of them.
    pub fn restore(&self, inner: &mut Inner) -> Result<(), SolverError> {
        let mut run = Run::new(self.state.clone(), inner.run.solver.model().clone(), Schedule::default())?;
        std::mem::swap(&mut run.schedule, &mut inner.run.schedule);
        run.solver.set_targets(self.targets.clone());
        let (old, new) = (&mut inner.run.state.particles, &mut run.state.particles);
        keep(&mut old.id, &mut new.id);
        keep(&mut old.position, &mut new.position);
        keep(&mut old.velocity, &mut new.velocity);
        keep(&mut old.orientation, &mut new.orientation);
        keep(&mut old.angular_velocity, &mut new.angular_velocity);
        keep(&mut old.radius, &mut new.radius);
        keep(&mut old.mass, &mut new.mass);
        keep(&mut old.inertia, &mut new.inertia);
        keep(&mut old.material, &mut new.material);
        keep(&mut old.clump, &mut new.clump);
        keep(&mut old.tags, &mut new.tags);
        inner.run = run;
        inner.samples.truncate(self.samples);
        for (rows, count) in inner.operators.iter_mut().zip(&self.operators) {
            rows.truncate(*count);
        }
        inner.events.truncate(self.events);
        Ok(())
    }
}

/// Gives the new state the old array with the new values.
fn keep<T: Copy>(old: &mut Vec<T>, new: &mut Vec<T>) {
    old.copy_from_slice(new);
    std::mem::swap(old, new);
}
