//! Walls of a scenario.

use std::io::BufReader;
use std::path::Path;

use super::histories::{history, largest};
use super::time_step::Step;
use super::{AssemblyError, material_index, unfit};
use crate::files::open_regular;
use crate::schedule::{Servo, Target};
use crate::schema::quantity::vector;
use crate::schema::{self, Quantity, Scenario, Side};
use concordem_contact::math::Vec3;
use concordem_solver::state::{State, Turning, Wall, WallShape};

/// Adds the walls of `[[wall]]`.
pub(super) fn add(scenario: &Scenario, folder: &Path, state: &mut State) -> Result<(), AssemblyError> {
    for (number, wall) in scenario.walls.iter().enumerate() {
        let name = wall.name.clone().unwrap_or_else(|| format!("wall {number}"));
        // The fastest motion bounds the time step; `histories::build` sets that of the first step.
        let velocity = |face: usize| match &wall.servo {
            None => vector(&wall.velocity) * largest(scenario, wall.history.as_deref()),
            Some(servo) => pushing(servo, &wall.shape, face) * servo.maximum_speed.si(),
        };
        let material = material_index(scenario, &wall.material);
        for (face, (name, shape)) in shapes(name, &wall.shape, folder)?.into_iter().enumerate() {
            let mut made = Wall::new(name, shape, material, velocity(face));
            made.turning = wall.rotation.as_ref().map(|rotation| turning(scenario, rotation, &wall.shape));
            state.walls.push(made);
        }
    }
    if let Some(cell) = &state.cell {
        for wall in &state.walls {
            wall.repeats_with(cell).map_err(|problem| {
                unfit(
                    "wall.shape",
                    format!("wall `{}`: {problem}; or use \"facets\", or a packing without a cell", wall.name),
                )
            })?;
        }
    }
    if !state.walls.is_empty() && state.wall_contacts.is_none() {
        let message = "walls need a contact law; with \"none\", particles pass through them";
        return Err(unfit("contacts.law", message.into()));
    }
    Ok(())
}

/// Rotation of a wall before the first step, with the fastest angular velocity of the run unless a history changes it.
fn turning(scenario: &Scenario, rotation: &schema::WallRotation, shape: &schema::WallShape) -> Turning {
    let of_shape = match shape {
        schema::WallShape::Plane { point, .. } | schema::WallShape::Cylinder { center: point, .. } => vector(point),
        _ => Vec3::zeros(),
    };
    let factor = largest(scenario, rotation.history.as_deref());
    let angular_velocity = axis_of(shape) * (rotation.angular_velocity.si() * factor);
    let center = rotation.point.as_ref().map_or(of_shape, vector);
    Turning { center, angular_velocity, previous: angular_velocity }
}

/// Unit vector of the axis about which a wall can turn; zero for shapes that cannot.
pub(super) fn axis_of(shape: &schema::WallShape) -> Vec3 {
    match shape {
        schema::WallShape::Plane { normal, .. } => vector(normal).normalize(),
        schema::WallShape::Cylinder { axis, .. } => {
            let mut direction = Vec3::zeros();
            direction[axis.index()] = 1.0;
            direction
        }
        _ => Vec3::zeros(),
    }
}

/// Direction in which a servo pushes, of length 1; `face`: index of the face of a box.
fn pushing(servo: &schema::Servo, shape: &schema::WallShape, face: usize) -> Vec3 {
    let given = servo.direction.as_ref().map(vector);
    let direction = match shape {
        schema::WallShape::Plane { normal, .. } => vector(normal),
        schema::WallShape::Box { .. } => {
            let mut normal = Vec3::zeros();
            normal[face / 2] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
            normal
        }
        schema::WallShape::Cylinder { .. } | schema::WallShape::Facets { .. } => given.unwrap_or_default(),
    };
    direction.normalize()
}

/// The servos of the walls, which are at rest before the first step.
pub(super) fn servos(scenario: &Scenario, step: &Step, state: &mut State) -> Vec<Servo> {
    let planar = scenario.dimension == 2;
    let frequency = step.bounds.frequency.max(step.collision.map_or(0.0, |collision| collision.frequency));
    let mut servos = Vec::new();
    let mut first = 0;
    for wall in &scenario.walls {
        let faces = if matches!(wall.shape, schema::WallShape::Box { .. }) { 6 } else { 1 };
        if let Some(servo) = &wall.servo {
            // In two dimensions particles do not touch the faces of z.
            for face in 0..if planar { faces.min(4) } else { faces } {
                let across = |axis: usize| (!planar || axis < 2).then_some([first + 2 * axis, first + 2 * axis + 1]);
                let axis = face / 2;
                let target = match (servo.force, servo.pressure, servo.area) {
                    (Some(force), ..) => Target::Force(force.si()),
                    (None, pressure, area) => {
                        let pressure = pressure.map_or(0.0, Quantity::si);
                        let neighbors = [across((axis + 1) % 3), across((axis + 2) % 3)];
                        area.map_or(Target::Face(pressure, neighbors), |area| Target::Pressure(pressure, area.si()))
                    }
                };
                let mut servo = Servo {
                    wall: first + face,
                    direction: pushing(servo, &wall.shape, face),
                    target,
                    history: wall.history.as_deref().and_then(|name| history(scenario, name)),
                    maximum_speed: servo.maximum_speed.si(),
                    gain: 0.0,
                };
                servo.tune(state, frequency, planar);
                servos.push(servo);
            }
            (first..first + faces).for_each(|wall| state.walls[wall].velocity = Vec3::zeros());
        }
        first += faces;
    }
    servos
}

/// Names and surfaces of a wall; a box has six.
fn shapes(name: String, shape: &schema::WallShape, folder: &Path) -> Result<Vec<(String, WallShape)>, AssemblyError> {
    Ok(match shape {
        schema::WallShape::Plane { point, normal } => {
            let normal = vector(normal);
            vec![(name, WallShape::Plane { point: vector(point), normal: normal / normal.norm() })]
        }
        schema::WallShape::Box { minimum, maximum } => {
            let (low, high) = (vector(minimum), vector(maximum));
            let mut faces = Vec::with_capacity(6);
            for (axis, label) in ["x", "y", "z"].into_iter().enumerate() {
                let mut normal = Vec3::zeros();
                normal[axis] = 1.0;
                faces.push((format!("{name} {label} minimum"), WallShape::Plane { point: low, normal }));
                faces.push((format!("{name} {label} maximum"), WallShape::Plane { point: high, normal: -normal }));
            }
            faces
        }
        schema::WallShape::Cylinder { center, axis, radius, side } => {
            let mut direction = Vec3::zeros();
            direction[axis.index()] = 1.0;
            let (point, inside) = (vector(center), *side == Side::Inside);
            vec![(name, WallShape::Cylinder { point, axis: direction, radius: radius.si(), inside })]
        }
        schema::WallShape::Facets { path, unit } => {
            vec![(name, WallShape::Facets { triangles: triangles(folder, path, unit.si())? })]
        }
    })
}

/// Triangles of an STL file, scaled to meters.
pub(super) fn triangles(folder: &Path, path: &str, unit: f64) -> Result<Vec<[Vec3; 3]>, AssemblyError> {
    let file = folder.join(path);
    let fail = |message: String| AssemblyError::File { path: file.display().to_string(), message };
    let mut reader = BufReader::new(open_regular(&file).map_err(|error| fail(error.to_string()))?);
    let mesh = stl_io::read_stl(&mut reader).map_err(|error| fail(format!("not a readable STL file: {error}")))?;
    let corner = |index: usize| {
        mesh.vertices
            .get(index)
            .map(|v| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])) * unit)
            .ok_or_else(|| fail(format!("refers to vertex {index}, which does not exist")))
    };
    mesh.faces.iter().map(|f| Ok([corner(f.vertices[0])?, corner(f.vertices[1])?, corner(f.vertices[2])?])).collect()
}
