//! Motions of the scenario over time, and the fastest of a run, which bounds the time step.

use crate::schedule::{Expression, Field, History, TimedMesh};
use crate::schema::quantity::vector;
use crate::schema::{self, HistoryShape, Prescribe, Quantity, Scenario, VelocityField};
use concordem_contact::math::{Mat3, Vec3};

/// The history of a name; the checks of the scenario guarantee that it exists.
pub(super) fn history(scenario: &Scenario, name: &str) -> Option<History> {
    let found = scenario.histories.iter().find(|history| history.name == name)?;
    Some(match &found.shape {
        HistoryShape::Table { points, repeat, smooth } => History::Table {
            points: points.iter().map(|(time, factor)| [time.si(), factor.si()]).collect(),
            repeat: *repeat,
            smooth: *smooth,
        },
        HistoryShape::Sine { period, amplitude, mean, phase } => {
            History::Sine { mean: mean.si(), amplitude: amplitude.si(), period: period.si(), phase: phase.si() }
        }
        HistoryShape::Expression { expression, until } => {
            let until = until.or(scenario.stop.time).map_or(0.0, Quantity::si);
            History::Formula { expression: Expression::parse(expression).ok()?, until }
        }
    })
}

/// A velocity field of the scenario.
pub(super) fn field(of: &VelocityField) -> Field {
    let mut prescribed = [true; 3];
    of.free().iter().for_each(|axis| prescribed[axis.index()] = false);
    match of {
        VelocityField::Rotation { point, axis, angular_velocity, .. } => {
            let w = vector(axis).normalize() * angular_velocity.si();
            let gradient = Mat3::new(0.0, -w.z, w.y, w.z, 0.0, -w.x, -w.y, w.x, 0.0);
            Field { point: vector(point), gradient, angular_velocity: Some(w), prescribed }
        }
        VelocityField::Linear { point, velocity_gradient, .. } => {
            let gradient = Mat3::from_fn(|i, j| velocity_gradient[i][j].si());
            Field { point: vector(point), gradient, angular_velocity: None, prescribed }
        }
    }
}

/// The motion of the vertices of a mesh that start at `reference` (m), if it has one. `number`: index of the wall in the state.
pub(super) fn mesh_motion(
    scenario: &Scenario,
    wall: &schema::Wall,
    reference: &[Vec3],
    number: usize,
) -> Option<TimedMesh> {
    let motion = wall.motion.as_ref()?;
    Some(TimedMesh {
        history: history(scenario, &motion.history)?,
        wall: number,
        reference: reference.to_vec(),
        displacement: vector(&motion.displacement),
        rotation: motion.rotation.as_ref().map_or_else(Vec3::zeros, vector),
        center: motion.center.as_ref().map_or_else(Vec3::zeros, vector),
        single: motion.vertices.iter().flatten().map(vector).collect(),
    })
}

/// The components of a prescribed motion of a particle at `position` (m) in SI units, with the largest factor of its history: the
/// fastest motion of the run, as far as the position of the particle changes little.
pub(super) fn fastest(scenario: &Scenario, prescribe: &Prescribe, position: &Vec3) -> [[Option<f64>; 3]; 2] {
    let history = prescribe.history.as_deref().and_then(|name| history(scenario, name));
    let (largest, steepest) = history.map_or((1.0, 0.0), |history| (history.largest(), history.steepest()));
    let scaled = |value: Option<f64>| value.map(|value| value * largest);
    let velocity = std::array::from_fn(|i| {
        prescribe.displacement[i].si().map(|u| u * steepest).or_else(|| scaled(prescribe.velocity[i].si()))
    });
    let mut angular_velocity = prescribe.angular_velocity.map(|component| scaled(component.si()));
    let mut velocity: [Option<f64>; 3] = velocity;
    if let Some(field) = prescribe.field.as_ref().map(field) {
        let found = field.gradient * (position - field.point) * largest;
        (0..3).filter(|&i| field.prescribed[i]).for_each(|i| velocity[i] = Some(found[i]));
        if let Some(given) = field.angular_velocity {
            angular_velocity = [0, 1, 2].map(|i| Some(given[i] * largest));
        }
    }
    [velocity, angular_velocity]
}

/// Largest factor of a history, 1 without one.
pub(super) fn largest(scenario: &Scenario, name: Option<&str>) -> f64 {
    name.and_then(|name| history(scenario, name)).map_or(1.0, |history| history.largest())
}
