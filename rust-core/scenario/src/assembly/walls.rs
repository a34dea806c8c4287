//! Walls of a scenario.

use std::path::Path;

use super::motions::{history, largest};
use super::overlaps::key_of_wall;
use super::stl::Named;
use super::time_step::Step;
use super::{AssemblyError, material_index, opening, unfit};
use crate::schedule::{Aim, Gain, Servo, Target};
use crate::schema::quantity::vector;
use crate::schema::{self, Quantity, Scenario};
use crate::walls::{self, NamedFile};
use concordem_contact::math::Vec3;
use concordem_solver::state::{Mesh, State, Turning, Wall, WallShape};

/// Adds the walls of `[[wall]]`.
pub(super) fn add(scenario: &Scenario, folder: &Path, state: &mut State) -> Result<(), AssemblyError> {
    for (number, wall) in scenario.walls.iter().enumerate() {
        // The fastest motion bounds the time step; `histories::build` sets that of the first step.
        let velocity = |face: usize| match &wall.servo {
            None => vector(&wall.velocity) * largest(scenario, wall.history.as_deref()),
            Some(servo) => pushing(servo, &wall.shape, face) * servo.maximum_speed.si(),
        };
        let material = material_index(scenario, &wall.material);
        let names = wall.names(number).into_iter();
        for (face, (name, mut shape)) in names.zip(surfaces(number, &wall.shape, folder)?).enumerate() {
            if let WallShape::Mesh(mesh) = &mut shape {
                start(scenario, number, wall, mesh)?;
            }
            let mut made = Wall::new(name, shape, material, velocity(face));
            made.turning = wall.rotation.as_ref().map(|rotation| turning(scenario, rotation, &wall.shape));
            state.walls.push(made);
        }
    }
    if let Some(cell) = &state.cell {
        for (number, wall) in state.walls.iter().enumerate() {
            wall.repeats_with(cell).map_err(|problem| {
                unfit(
                    &key_of_wall(scenario, number),
                    format!(
                        "wall `{}`: {problem}; make it fit, use \"facets\", or a packing without a cell",
                        wall.name
                    ),
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
fn turning(scenario: &Scenario, rotation: &schema::WallRotation, shape: &walls::WallShape) -> Turning {
    let factor = largest(scenario, rotation.history.as_deref());
    let angular_velocity = shape.kind().axis().unwrap_or_default() * (rotation.angular_velocity.si() * factor);
    let center = rotation.point.as_ref().map_or_else(|| shape.kind().point().unwrap_or_default(), vector);
    Turning { center, angular_velocity, previous: angular_velocity }
}

/// Direction in which a servo pushes, of length 1; `face`: index of the face of a box.
fn pushing(servo: &schema::Servo, shape: &walls::WallShape, face: usize) -> Vec3 {
    let given = || servo.direction.as_ref().map(vector).unwrap_or_default();
    shape.kind().normal(face).unwrap_or_else(given).normalize()
}

/// The servos of the walls, which are at rest before the first step.
pub(super) fn servos(scenario: &Scenario, step: &Step, state: &mut State) -> Result<Vec<Servo>, AssemblyError> {
    let planar = scenario.dimension == 2;
    let frequency = step.bounds.closed_frequency.max(step.collision.map_or(0.0, |collision| collision.frequency));
    let mut servos = Vec::new();
    let mut first = 0;
    for wall in &scenario.walls {
        let faces = wall.shape.kind().faces().len();
        if let Some(servo) = &wall.servo {
            // In two dimensions particles do not touch the faces of z.
            for face in 0..if planar { faces.min(4) } else { faces } {
                let mut servo = Servo {
                    wall: first + face,
                    direction: pushing(servo, &wall.shape, face),
                    aim: aim(scenario, servo, [first, face], state)?,
                    history: wall.history.as_deref().and_then(|name| history(scenario, name)),
                    maximum_speed: servo.maximum_speed.si(),
                };
                servo.tune(state, frequency, planar);
                servos.push(servo);
            }
            (first..first + faces).for_each(|wall| state.walls[wall].velocity = Vec3::zeros());
        }
        first += faces;
    }
    Ok(servos)
}

/// Default of [`OpeningServo::gain`](crate::schedule::OpeningServo::gain).
const GAIN: f64 = 0.5;

/// What a servo of a wall aims at; `first`: index of the wall (of a box, its first face), `face`: of the face.
fn aim(
    scenario: &Scenario,
    servo: &schema::Servo,
    [first, face]: [usize; 2],
    state: &State,
) -> Result<Aim, AssemblyError> {
    if let (Some(elongation), Some(gauge), Some(response_time)) = (servo.opening, &servo.gauge, servo.response_time) {
        let times = [servo.gain.map_or(GAIN, Quantity::si), response_time.si()];
        let servo = opening::servo(scenario, &state.particles, gauge, elongation.si().signum(), times)?;
        return Ok(Aim::Opening(servo, elongation.si()));
    }
    let planar = scenario.dimension == 2;
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
    Ok(Aim::Force { target, gain: Gain::default() })
}

/// Surfaces of wall `number`; a box has six.
fn surfaces(number: usize, shape: &walls::WallShape, folder: &Path) -> Result<Vec<WallShape>, AssemblyError> {
    let key = format!("wall[{number}].shape");
    let path = format!("{key}.path");
    let named =
        shape.kind().file().map(|NamedFile { path: file, unit }| Named { folder, path: file, unit, key: &path });
    let read = named.as_ref().map(Named::read).transpose()?;
    shape.kind().surfaces(read).map_err(|(part, message)| match (part, named) {
        ("path", Some(named)) => named.fail(&message),
        ("", _) => unfit(&key, message),
        (part, _) => unfit(&format!("{key}.{part}"), message),
    })
}

/// Sine of the largest angle between a triangle and the direction across the plane in two dimensions; vertices of files have 32 bits.
const UPRIGHT: f64 = 1e-6;

/// Checks the mesh of wall `number`, and gives its vertices the largest velocity of their motion, which bounds the time step;
/// `histories::build` sets those of the first step.
fn start(scenario: &Scenario, number: usize, wall: &schema::Wall, mesh: &mut Mesh) -> Result<(), AssemblyError> {
    if scenario.dimension == 2
        && let Some(leaning) = (0..mesh.triangles().len()).find(|&t| mesh.normal(t).z.abs() > UPRIGHT)
    {
        let message =
            format!("triangle {leaning} is not perpendicular to the plane z = 0; in two dimensions all must be");
        return Err(unfit(&format!("wall[{number}].shape"), message));
    }
    if let Some(motion) = super::motions::mesh_motion(scenario, wall, &mesh.position, 0) {
        if motion.single.len() != mesh.position.len() && !motion.single.is_empty() {
            let message = format!("{} rows for the {} vertices of the mesh", motion.single.len(), mesh.position.len());
            return Err(unfit(&format!("wall[{number}].motion.vertices"), message));
        }
        for k in 0..mesh.position.len() {
            mesh.velocity[k] = Vec3::x() * motion.fastest(k);
        }
    }
    Ok(())
}
