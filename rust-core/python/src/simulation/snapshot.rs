//! Moments of a simulation, to go back to.

use std::sync::Arc;

use concordem::solver::SolverError;
use concordem::state::State;
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Inner;

/// A moment of a simulation: everything that its steps change, in memory.
#[pyclass(frozen, module = "concordem")]
pub struct SimulationSnapshot {
    state: State,
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
            samples: inner.records.samples.len(),
            operators: inner.records.operators.iter().map(Vec::len).collect(),
            events: inner.records.events.len(),
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
        let mut before = inner.run.replace_state(self.state.clone())?;
        let (old, new) = (&mut before.particles, &mut inner.run.state.particles);
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
        inner.records.samples.truncate(self.samples);
        for (rows, count) in inner.records.operators.iter_mut().zip(&self.operators) {
            rows.truncate(*count);
        }
        inner.records.events.truncate(self.events);
        Ok(())
    }
}

/// Gives the new state the old array with the new values.
fn keep<T: Copy>(old: &mut Vec<T>, new: &mut Vec<T>) {
    old.copy_from_slice(new);
    std::mem::swap(old, new);
}
