//! Walls that move until they press on the particles with a given force, or open a gauge by a given length.

use concordem_contact::math::Vec3;
use concordem_solver::state::State;

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
        /// How the gain `g` follows from what the wall presses on.
        gain: Gain,
    },
    /// The elongation of a gauge, m.
    Opening(OpeningServo, f64),
}

/// Gain of the force of a wall, m/(N·s): full speed until a tenth of the force is missing, and slower where the contacts are so stiff that
/// a wall of this speed would overshoot. A particle of mass m cannot have contacts stiffer than `ω² m`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Gain {
    /// Gain of a wall that presses on nothing, m/(N·s).
    pub free: f64,
    /// Gain that removes `SERVO_STEP` of the error in a step if the wall presses on a whole layer of particles, m/(N·s).
    pub on_layer: f64,
    /// Mass of this layer, kg.
    pub layer: f64,
}

impl Gain {
    /// The gain of a wall that presses on particles of this mass, kg.
    fn on(&self, mass: f64) -> f64 {
        if mass <= 0.0 {
            return self.free;
        }
        self.free.min(if mass < self.layer { self.on_layer * self.layer / mass } else { self.on_layer })
    }

    /// Whether particles can slow the wall down.
    fn is_limited(&self) -> bool {
        self.on_layer < self.free
    }
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
pub(super) fn gap(state: &State, [a, b]: [usize; 2]) -> f64 {
    // The normals point towards each other, so the distances of any point from the two add up to that of the planes.
    let from_origin = |wall: usize| state.walls[wall].distance(0, &Vec3::zeros());
    (from_origin(a) + from_origin(b)).abs()
}

impl Servo {
    /// Sets the velocity of the wall for the coming step. `lasting`: see [`OpeningServo::speed`].
    pub(super) fn apply(&self, state: &mut State, lasting: &mut f64) {
        let clock = &state.clock;
        let (time, dt) = (clock.time(), clock.dt);
        let wanted = match &self.aim {
            Aim::Force { target, gain } => {
                let missing = self.factor(time + 0.5 * dt) * target.force(state) + self.pressing(state);
                gain.on(self.pressed(state, gain, missing)) * missing
            }
            Aim::Opening(servo, opening) => {
                let rate = opening * (self.factor(time + dt) - self.factor(time)) / dt;
                servo.speed(state, [opening * self.factor(time), rate], self.maximum_speed, lasting)
            }
        };
        let speed = wanted.clamp(-self.maximum_speed, self.maximum_speed);
        state.walls[self.wall].velocity = self.direction * speed;
    }

    /// Factor of the target at a time (s).
    fn factor(&self, time: f64) -> f64 {
        self.history.as_ref().map_or(1.0, |history| history.at(time))
    }

    /// Largest factor of the target.
    fn largest(&self) -> f64 {
        self.history.as_ref().map_or(1.0, History::largest)
    }

    /// Force with which the particles push the wall forward, N; negative where it presses on them.
    fn pressing(&self, state: &State) -> f64 {
        state.walls[self.wall].force.dot(&self.direction)
    }

    /// Mass of the particles on which the wall presses, or which it can meet in the coming step, kg. Infinite, as that of a layer or more, where
    /// it does not matter, and while less than half of the force is missing (N): a wall that presses so much has its layer.
    fn pressed(&self, state: &State, gain: &Gain, missing: f64) -> f64 {
        let full = self.maximum_speed / SLOW;
        if !gain.is_limited() || gain.free * missing.abs() < 0.5 * full || state.cell.is_some() {
            return f64::INFINITY;
        }
        mass_near(state, self.wall, 2.0 * self.maximum_speed * state.clock.dt)
    }

    /// What is wanted now, what is there, and what errors are relative to: forces, N, or elongations, m.
    pub fn standing(&self, state: &State) -> Standing {
        let factor = self.factor(state.clock.time());
        match &self.aim {
            Aim::Force { target, .. } => {
                let full = target.force(state);
                Standing { wanted: factor * full, found: -self.pressing(state), scale: (self.largest() * full).abs() }
            }
            Aim::Opening(servo, opening) => {
                let [elongation, _] = servo.gauge.measure(state);
                Standing { wanted: factor * opening, found: elongation, scale: (self.largest() * opening).abs() }
            }
        }
    }

    /// Sets the gain of a force. `frequency`: upper bound of the frequencies of contacts, rad/s; `planar`: two dimensions.
    pub(crate) fn tune(&mut self, state: &State, frequency: f64, planar: bool) {
        let largest = self.largest();
        let Aim::Force { target, gain } = &mut self.aim else { return };
        let count = state.particles.len() as f64;
        let layers = if planar { count.sqrt() } else { count.cbrt() };
        gain.free = self.maximum_speed / (SLOW * largest * target.force(state));
        gain.layer = state.particles.mass.iter().sum::<f64>() / layers;
        let stiffness = frequency * frequency * state.particles.mass.iter().sum::<f64>() / layers;
        gain.on_layer = SERVO_STEP / (stiffness * state.clock.dt);
    }
}

/// Mass of the particles nearer to a wall than `reach` (m), kg, from the positions alone: candidates of the neighbor list depend on the step at
/// which it was built. Of a wall of triangles, particles in the box around their corners.
fn mass_near(state: &State, wall: usize, reach: f64) -> f64 {
    let (particles, wall) = (&state.particles, &state.walls[wall]);
    // Surfaces of one element have no balls around it.
    let extent = wall.bounds(0).map(|_| [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| wall.span(&axis)));
    let is_near = |p: usize| {
        let (x, reach) = (&particles.position[p], particles.radius[p] + reach);
        match &extent {
            Some(spans) => spans
                .iter()
                .enumerate()
                .all(|(k, span)| span.is_none_or(|[low, high]| x[k] > low - reach && x[k] < high + reach)),
            None => wall.distance(0, x) < reach,
        }
    };
    (0..particles.len()).filter(|&p| is_near(p)).map(|p| particles.mass[p]).sum()
}

/// Largest error of a servo, relative to its target, with which a run may be in equilibrium.
const TOLERANCE: f64 = 0.01;

/// Where a servo stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// The target.
    pub wanted: f64,
    /// What is there.
    pub found: f64,
    /// Largest target of the run, to which errors are relative.
    pub scale: f64,
}

impl Standing {
    /// The error, relative to the largest target.
    pub fn error(&self) -> f64 {
        if self.scale > 0.0 { (self.wanted - self.found) / self.scale } else { 0.0 }
    }

    /// Whether the target is met.
    pub fn is_met(&self) -> bool {
        self.error().abs() <= TOLERANCE
    }
}
