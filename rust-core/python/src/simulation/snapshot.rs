//! Moments of a simulation, to go back to.

use std::sync::Arc;

use concordem::solver::SolverError;
use concordem::state::{Particles, State};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Inner;
use super::kept::Records;
use crate::scripted::ScriptedLaw;

/// A moment of a simulation: everything that its steps change, in memory.
#[pyclass(frozen, module = "concordem")]
pub struct SimulationSnapshot {
    state: State,
    records: Records,
    /// Text of the scenario.
    scenario: String,
    /// Laws in Python, which the state knows by number.
    scripted: Vec<Arc<ScriptedLaw>>,
}

impl SimulationSnapshot {
    /// The present moment of a simulation.
    pub fn of(inner: &Inner) -> Self {
        Self {
            state: inner.run.state.clone(),
            records: inner.records.clone(),
            scenario: inner.header.scenario.clone(),
            scripted: inner.scripted.clone(),
        }
    }

    /// Refuses the moment of a simulation of another scenario, of other particles, or of other laws in Python.
    pub fn check(&self, inner: &Inner) -> PyResult<()> {
        let (one, two) = (&self.state.particles, &inner.run.state.particles);
        let same = |one: &[f64], two: &[f64]| one.iter().map(|x| x.to_bits()).eq(two.iter().map(|x| x.to_bits()));
        let message = if self.scenario != inner.header.scenario {
            "the snapshot is of a simulation of another scenario; restore one of the same scenario"
        } else if one.id != two.id || one.material != two.material || !same(&one.radius, &two.radius) {
            "the snapshot has other particles than the simulation: a file that the scenario names has changed between both"
        } else if !self.scripted.iter().map(Arc::as_ptr).eq(inner.scripted.iter().map(Arc::as_ptr)) {
            "the snapshot is of a simulation with other laws in Python; restore one of this simulation or of a copy"
        } else {
            return Ok(());
        };
        Err(PyValueError::new_err(message))
    }

    /// Go back to this moment.
    pub fn restore(&self, inner: &mut Inner) -> Result<(), SolverError> {
        let mut before = inner.run.replace_state(self.state.clone())?;
        keep_places(&mut before.particles, &mut inner.run.state.particles);
        inner.records.clone_from(&self.records);
        Ok(())
    }
}

/// Gives the new particles the arrays of the old ones, with the new values, because Python has views of them.
pub fn keep_places(old: &mut Particles, new: &mut Particles) {
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
}

/// Gives the new array the place of the old one.
fn keep<T: Copy>(old: &mut Vec<T>, new: &mut Vec<T>) {
    old.copy_from_slice(new);
    std::mem::swap(old, new);
}
