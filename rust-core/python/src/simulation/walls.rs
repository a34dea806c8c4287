//! Walls by name: where they are, and how Python moves them.

use concordem::math::Vec3;
use concordem::schedule::{Moved, Simulation as Run};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;

use super::Inner;
use crate::arrays::{result, vector};
use crate::shared::Access;

/// Number of the wall `name`.
fn number(run: &Run, name: &str) -> PyResult<usize> {
    let names = || run.state.walls.iter().map(|wall| &wall.name[..]).collect::<Vec<_>>();
    let found = run.state.walls.iter().position(|wall| wall.name == name);
    found.ok_or_else(|| PyValueError::new_err(format!("there is no wall \"{name}\"; the walls are: {:?}", names())))
}

/// See `Simulation.wall`.
pub fn state<'py>(py: Python<'py>, run: &Run, name: &str) -> PyResult<Bound<'py, PyAny>> {
    let wall = &run.state.walls[number(run, name)?];
    let turning = wall.turning.as_ref().map(|turning| vector(py, &turning.angular_velocity));
    let of = |v: &Vec3| vector(py, v);
    result(py, "WallState", (of(&wall.displacement), of(&wall.velocity), turning, of(&wall.force), of(&wall.torque)))
}

/// Number of the wall `name`, which Python may move.
fn free(inner: &Inner, name: &str, given: &[Vec3]) -> PyResult<usize> {
    let run = &inner.run;
    let wall = number(run, name)?;
    let (schedule, histories) = (&run.schedule, &run.schedule.histories);
    let moved = |moved: &Moved| matches!(moved, Moved::Driven(w) | Moved::Placed(w) if *w == wall);
    let of_loading = inner.scenario.get().inner.names_of_loading_walls().iter().any(|wall| wall == name);
    let problem = if run.state.walls[wall].mesh().is_some() {
        "it is a mesh; move its vertices with drive_mesh or place_mesh"
    } else if schedule.servos.iter().any(|servo| servo.wall == wall) {
        "its servo moves it; change the servo with change(), or remove it from the scenario"
    } else if histories.walls.iter().any(|timed| timed.wall == wall)
        || histories.turning.iter().any(|timed| timed.wall == wall)
        || histories.recorded.iter().any(|recorded| moved(&recorded.moved))
    {
        "a history of the scenario moves it; remove the history"
    } else if of_loading {
        "the loading moves it; change the loading with change()"
    } else if !given.iter().all(|v| v.iter().all(|c| c.is_finite())) {
        "a number is not finite"
    } else if schedule.planar && given.iter().any(|v| v.z != 0.0) {
        "in two dimensions walls do not move along z"
    } else {
        return Ok(wall);
    };
    Err(PyValueError::new_err(format!("wall \"{name}\": {problem}")))
}

/// See `Simulation.drive_wall`.
pub fn drive(
    py: Python<'_>,
    inner: &mut Access<'_, Inner>,
    name: &str,
    velocity: Vec3,
    angular_velocity: Option<Vec3>,
) -> PyResult<()> {
    let wall = free(inner, name, &[velocity])?;
    let turns = inner.run.state.walls[wall].turning.is_some();
    if let Some(angular) = angular_velocity {
        if !turns {
            let message = format!("wall \"{name}\": it has no axis; give it `rotation` in the scenario");
            return Err(PyValueError::new_err(message));
        }
        if !angular.iter().all(|c| c.is_finite()) {
            return Err(PyValueError::new_err(format!("wall \"{name}\": a number is not finite")));
        }
    }
    inner.change(py, |inner| {
        inner.note("drive_wall");
        let wall = &mut inner.run.state.walls[wall];
        wall.velocity = velocity;
        if let (Some(turning), Some(angular)) = (&mut wall.turning, angular_velocity) {
            turning.angular_velocity = angular;
        }
    })
}

/// See `Simulation.place_wall`.
pub fn place(py: Python<'_>, inner: &mut Access<'_, Inner>, name: &str, displacement: Vec3) -> PyResult<()> {
    let wall = free(inner, name, &[displacement])?;
    inner.change(py, |inner| {
        inner.note("place_wall");
        inner.run.state.walls[wall].displacement = displacement;
        // Contacts that jump have energies that no motion connects with those before.
        inner.run.start_balance();
    })
}
