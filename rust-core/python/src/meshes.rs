//! Walls that are meshes, by name.

use concordem::math::Vec3;
use concordem::schedule::{Moved, RecordedMotion, Simulation as Run};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use crate::arrays::{result, rows, vectors};

/// Index of the wall `name`, which must be a mesh.
fn mesh_number(run: &Run, name: &str) -> PyResult<usize> {
    let found = run.state.walls.iter().position(|wall| wall.name == name && wall.mesh().is_some());
    found.ok_or_else(|| no_mesh(run, name))
}

/// Names of the walls that are meshes.
pub fn mesh_names(run: &Run) -> Vec<String> {
    run.state.walls.iter().filter(|wall| wall.mesh().is_some()).map(|wall| wall.name.clone()).collect()
}

/// The mesh `name` as a Python `MeshState`.
pub fn mesh_state<'py>(py: Python<'py>, run: &Run, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let wall = mesh_number(run, name)?;
    let Some(mesh) = run.state.walls[wall].mesh() else { return Err(no_mesh(run, name)) };
    let fields = (
        vectors(py, &mesh.position)?,
        rows::<_, u32>(py, mesh.triangles(), 3)?,
        vectors(py, &mesh.previous_velocity)?,
        vectors(py, &mesh.force)?,
    );
    result(py, "MeshState", fields)
}

/// The error for a wall that is no mesh.
fn no_mesh(run: &Run, name: &str) -> PyErr {
    let names = mesh_names(run);
    PyValueError::new_err(format!(
        "no wall named \"{name}\" is a mesh; meshes of the scenario: {names:?}. Give a [[wall]] shape = {{ kind = \"mesh\", ... }}"
    ))
}

/// Index of the mesh `name`, which no history moves; in two dimensions, `vectors` must lie in the plane as the mesh does.
pub fn free_mesh(run: &Run, name: &str, vectors: &[&[Vec3]]) -> PyResult<usize> {
    let wall = mesh_number(run, name)?;
    let histories = &run.schedule.histories;
    let recorded = |motion: &RecordedMotion| matches!(motion.moved, Moved::Driven(w) | Moved::Placed(w) if w == wall);
    if histories.recorded.iter().any(recorded) {
        let message =
            format!("the mesh \"{name}\" repeats the motion of a [[slave]]; remove it to move the mesh from Python");
        return Err(PyValueError::new_err(message));
    }
    if histories.meshes.iter().any(|timed| timed.wall == wall) {
        let message =
            format!("the mesh \"{name}\" follows the `motion` of the scenario; remove it to move the mesh from Python");
        return Err(PyValueError::new_err(message));
    }
    let Some(mesh) = run.state.walls[wall].mesh() else { return Err(no_mesh(run, name)) };
    if run.schedule.planar {
        // The last array has the velocities. Positions across the plane stay what they are.
        let moves = vectors.last().is_some_and(|rows| rows.iter().any(|v| v.z != 0.0))
            || vectors.len() > 1 && vectors[0].iter().zip(&mesh.position).any(|(x, old)| x.z != old.z);
        if moves {
            return Err(PyValueError::new_err(format!(
                "mesh \"{name}\": in two dimensions vertices do not move along z"
            )));
        }
    }
    Ok(wall)
}
