//! What Python gives a running simulation: motions, loads, meshes, and bonds.

use std::collections::HashMap;

use concordem::math::Vec3;
use concordem::schedule::Bonding;
use concordem::schedule::simulation::RunError;
use concordem::state::MeshError;
use concordem::state::contacts::{ContactFlags, Pair};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::{Inner, SimulationSnapshot};
use crate::errors::OrRaise;
use crate::meshes::free_mesh;
use crate::shared::Access;
use crate::work::Pool;

fn finite(vectors: &[Vec3]) -> bool {
    vectors.iter().all(|v| v.iter().all(|c| c.is_finite()))
}

/// See `Simulation.set_motion`.
pub fn motion(py: Python<'_>, inner: &mut Access<'_, Inner>, velocity: &[Vec3], angular: &[Vec3]) -> PyResult<()> {
    let particles = inner.run.state.particles.len();
    if velocity.len() != particles || angular.len() != particles {
        let (v, a) = (velocity.len(), angular.len());
        let message =
            format!("{v} velocities and {a} angular velocities for {particles} particles; give one row per particle");
        return Err(PyValueError::new_err(message));
    }
    if !(finite(velocity) && finite(angular)) {
        return Err(PyValueError::new_err("a velocity is not finite"));
    }
    inner.change(py, |inner| {
        inner.note("set_motion");
        inner.run.state.motion = Some(velocity.iter().copied().zip(angular.iter().copied()).collect());
    })
}

/// See `Simulation.set_loads`.
pub fn loads(py: Python<'_>, inner: &mut Access<'_, Inner>, force: &[Vec3], moment: Option<&[Vec3]>) -> PyResult<()> {
    let particles = inner.run.state.particles.len();
    for (name, given) in [("forces", Some(force.len())), ("moments", moment.map(<[_]>::len))] {
        if let Some(given) = given.filter(|given| *given != particles) {
            let message = format!("{given} {name} for {particles} particles; give one row per particle");
            return Err(PyValueError::new_err(message));
        }
    }
    if !finite(force) || !moment.is_none_or(finite) {
        return Err(PyValueError::new_err("a load is not finite"));
    }
    if !inner.run.schedule.histories.membranes.is_empty() {
        let message = "the scenario's [[membrane]] sets the loads in every step; remove it, and give its forces here";
        return Err(PyValueError::new_err(message));
    }
    if !inner.run.schedule.histories.loads.is_empty() {
        let message = "the histories of the scenario's [[force]] set the loads in every step; remove their `history`, and give these \
                       loads here";
        return Err(PyValueError::new_err(message));
    }
    inner.change(py, |inner| {
        inner.note("set_loads");
        let Inner { run, loads, .. } = inner;
        let particles = &mut run.state.particles;
        particles.loads.clone_from(loads);
        for (p, force) in force.iter().enumerate() {
            let moment = moment.map_or_else(Vec3::zeros, |moment| moment[p]);
            if *force != Vec3::zeros() || moment != Vec3::zeros() {
                particles.add_load(p as u32, *force, moment);
            }
        }
    })
}

/// The exception for a motion that a mesh refuses.
fn of_mesh(name: &str, error: &MeshError) -> PyErr {
    PyValueError::new_err(format!("mesh \"{name}\": {error}"))
}

/// See `Simulation.drive_mesh`.
pub fn mesh_velocities(py: Python<'_>, inner: &mut Access<'_, Inner>, name: &str, velocity: &[Vec3]) -> PyResult<()> {
    let wall = free_mesh(&inner.run, name, &[velocity])?;
    let drive = |inner: &mut Inner| {
        let Some(mesh) = inner.run.state.walls[wall].mesh_mut() else { return Ok(()) };
        mesh.drive(velocity)?;
        inner.note("drive_mesh");
        Ok(())
    };
    inner.change(py, drive)?.map_err(|error| of_mesh(name, &error))
}

/// See `Simulation.place_mesh`.
pub fn mesh_positions(
    py: Python<'_>,
    inner: &mut Access<'_, Inner>,
    name: &str,
    position: &[Vec3],
    velocity: &[Vec3],
) -> PyResult<()> {
    let wall = free_mesh(&inner.run, name, &[position, velocity])?;
    let place = |inner: &mut Inner| {
        let state = &mut inner.run.state;
        let Some(mesh) = state.walls[wall].mesh_mut() else { return Ok(()) };
        let work = mesh.place(position, velocity, state.clock.dt)?;
        state.ledger.add_boundary_work(work);
        inner.note("place_mesh");
        Ok(())
    };
    inner.change(py, place)?.map_err(|error| of_mesh(name, &error))
}

/// See `Simulation.break_bonds`.
pub fn broken_bonds(py: Python<'_>, inner: &mut Access<'_, Inner>, ids: &[[u32; 2]]) -> PyResult<usize> {
    let state = &inner.run.state;
    let index: HashMap<u32, u32> = state.particles.id.iter().copied().zip(0..).collect();
    let place = |id: u32| {
        let found = index.get(&id).copied();
        found.ok_or_else(|| PyValueError::new_err(format!("there is no particle with id {id}")))
    };
    let pair_of = |&[one, two]: &[u32; 2]| {
        let (a, b) = (place(one)?, place(two)?);
        Ok(Pair { a: a.min(b), b: a.max(b) })
    };
    let mut pairs: Vec<Pair> = ids.iter().map(pair_of).collect::<PyResult<_>>()?;
    let mut intact: Vec<Pair> = state
        .bonds
        .iter()
        .map(|block| block.contacts())
        .flat_map(|block| block.pairs().iter().zip(block.flags()))
        .filter(|(_, flags)| !flags.has(ContactFlags::BROKEN))
        .map(|(pair, _)| *pair)
        .collect();
    intact.sort_unstable();
    if let Some(k) = pairs.iter().position(|pair| intact.binary_search(pair).is_err()) {
        let [one, two] = ids[k];
        return Err(PyValueError::new_err(format!("the particles with ids {one} and {two} have no intact bond")));
    }
    pairs.sort_unstable();
    inner.change(py, |inner| {
        inner.note("break_bonds");
        inner.run.break_bonds(&pairs)
    })
}

/// See `Simulation.make_bonds`.
pub fn new_bonds(py: Python<'_>, inner: &mut Access<'_, Inner>, pool: &Pool, ratio: f64) -> PyResult<usize> {
    if inner.run.state.bonds.is_empty() {
        let message = "the scenario has no [bonds], whose law new bonds would have; add the table, with at_start = false for none at first";
        return Err(PyValueError::new_err(message));
    }
    if !(ratio.is_finite() && ratio > 0.0) {
        return Err(PyValueError::new_err(format!(
            "interaction_ratio is {ratio}; give a positive number, such as 1.05"
        )));
    }
    let moment = concordem::schedule::Moment::After { time: 0.0, kinetic_energy: None };
    let bonding = Bonding { moment, interaction_ratio: ratio, between: None };
    let make = |inner: &mut Inner| {
        pool.inside(|| {
            let before = SimulationSnapshot::of(inner);
            let made = inner.run.make_bonds(&[bonding]);
            match made {
                Ok(_) => inner.note("make_bonds"),
                Err(_) => before.restore(inner).map_err(RunError::from)?,
            }
            made
        })
    };
    inner.change(py, make)?.or_raise()
}
