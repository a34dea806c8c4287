//! Walls that move until they press on the particles with a given force, or open a gauge by a given length.

use concordem_contact::math::Vec3;
use concordem_solver::state::{State, WallShape};

use super::{History, OpeningServo};

/// Fraction of the wanted force below which a wall slows down.
const SLOW: f64 = 0.1;

/// Largest fraction of the error that a wall removes in one step if all contacts it can have are closed. The force is known one
/// step late, and waves carry the answer of the specimen back, so at 1 the wall would oscillate.
const SERVO_STEP: f64 = 0.1;

/// A wall that moves along a direction until it reaches its aim, at most with a speed `v_max`.
#[derive(Debug, Clone, PartialEq)]
pub struct Servo {
    /// Index of the wall.
    pub wall: usize,
    /// Unit vector along which the wall pushes.
    pub direction: Vec3,
    /// What it aims at.
    pub aim: Aim,
    /// A factor of the target, over the time of the run.
    pub history: Option<History>,
    /// Largest speed, m/s.
    pub maximum_speed: f64,
}

/// What a servo aims at.
#[derive(Debug, Clone, PartialEq)]
pub enum Aim {
    /// A force. The speed of the wall is `min(g (F₀ − F), v_max)` with the force `F` of the last step, positive towards the particles.
    Force {
        /// The wanted force `F₀`.
        target: Target,
        /// Gain `g`, m/(N·s).
        gain: f64,
    },
    /// The elongation of a gauge, m.
    Opening(OpeningServo, f64),
}

/// A force that a servo keeps constant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Target {
    /// Force, N.
    Force(f64),
    /// Pressure, Pa, on an area, m².
    Pressure(f64, f64),
    /// Pressure, Pa, on the face of a box between pairs of other planes, by index of their walls; in two dimensions one pair.
    Face(f64, [Option<[usize; 2]>; 2]),
}

impl Target {
    /// The wanted force, N, before the history.
    fn force(&self, state: &State) -> f64 {
        match self {
            Self::Force(force) => *force,
            Self::Pressure(pressure, area) => pressure * area,
            Self::Face(pressure, pairs) => {
                pressure * pairs.iter().flatten().map(|pair| gap(state, *pair)).product::<f64>()
            }
        }
    }
}

/// Distance of two parallel planes, m.
fn gap(state: &State, [a, b]: [usize; 2]) -> f64 {
    let place = |wall: usize| match &state.walls[wall].shape {
        WallShape::Plane { point, normal } => (point + state.walls[wall].displacement).dot(normal),
        _ => 0.0,
    };
    // The normals point towards each other.
    (place(a) + place(b)).abs()
}

impl Servo {
    /// Sets the velocity of the wall for the coming step. `lasting`: see [`OpeningServo::speed`].
    pub(super) fn apply(&self, state: &mut State, lasting: &mut f64) {
        let clock = &state.clock;
        let (time, dt) = (clock.time(), clock.dt);
        let factor = |time: f64| self.history.as_ref().map_or(1.0, |history| history.at(time));
        let wanted = match &self.aim {
            Aim::Force { target, gain } => {
                let pressing = state.walls[self.wall].force.dot(&self.direction);
                gain * (factor(time + 0.5 * dt) * target.force(state) + pressing)
            }
            Aim::Opening(servo, opening) => {
                let rate = opening * (factor(time + dt) - factor(time)) / dt;
                servo.speed(state, [opening * factor(time), rate], self.maximum_speed, lasting)
            }
        };
        let speed = wanted.clamp(-self.maximum_speed, self.maximum_speed);
        state.walls[self.wall].velocity = self.direction * speed;
    }

    /// Sets the gain of a force: full speed until a tenth of the force is missing, and slower where the contacts are so stiff that a
    /// wall of this speed would overshoot. `frequency`: upper bound of the frequencies of contacts, rad/s; `planar`: two dimensions.
    ///
    /// A particle of mass m cannot have contacts stiffer than `ω² m`; the wall touches one layer of particles.
    pub(crate) fn tune(&mut self, state: &State, frequency: f64, planar: bool) {
        let Aim::Force { target, gain } = &mut self.aim else { return };
        let count = state.particles.len() as f64;
        let layers = if planar { count.sqrt() } else { count.cbrt() };
        let stiffness = frequency * frequency * state.particles.mass.iter().sum::<f64>() / layers;
        let largest = self.history.as_ref().map_or(1.0, History::largest);
        let wanted = self.maximum_speed / (SLOW * largest * target.force(state));
        let stable = SERVO_STEP / (stiffness * state.clock.dt);
        *gain = wanted.min(stable);
    }
}
