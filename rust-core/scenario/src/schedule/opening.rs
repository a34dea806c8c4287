//! A loading or a wall that moves so that the elongation of a gauge follows a target.

use concordem_contact::math::Vec3;
use concordem_solver::state::{Particles, State};

/// Extensometer between two sets of particles; see the operator `gauge`.
#[derive(Debug, Clone, PartialEq)]
pub struct Extensometer {
    /// Indices of the particles of both sets, with their initial positions, m.
    sets: [Vec<(u32, Vec3)>; 2],
    /// Mean initial position of the second set minus that of the first, m.
    start: Vec3,
}

impl Extensometer {
    /// An extensometer between two sets of particles at their initial positions.
    pub fn new(particles: &Particles, sets: [&[u32]; 2]) -> Self {
        let sets = sets.map(|set| set.iter().map(|&p| (p, particles.position[p as usize])).collect::<Vec<_>>());
        let mean = |set: &[(u32, Vec3)]| set.iter().map(|(_, x)| *x).sum::<Vec3>() / set.len().max(1) as f64;
        let start = mean(&sets[1]) - mean(&sets[0]);
        Self { sets, start }
    }

    /// Elongation, m, and its rate, m/s.
    pub fn measure(&self, state: &State) -> [f64; 2] {
        let particles = &state.particles;
        let mean = |set: &[(u32, Vec3)], of: &dyn Fn(usize, &Vec3) -> Vec3| {
            set.iter().map(|(p, x)| of(*p as usize, x)).sum::<Vec3>() / set.len().max(1) as f64
        };
        let moved = |p: usize, x: &Vec3| particles.position[p] + particles.unwrapping(p, state.cell.as_ref()) - x;
        let opening = mean(&self.sets[1], &moved) - mean(&self.sets[0], &moved);
        let velocity = |p: usize, _: &Vec3| particles.velocity[p];
        let rate = mean(&self.sets[1], &velocity) - mean(&self.sets[0], &velocity);
        let (branch, length) = (self.start + opening, (self.start + opening).norm());
        // Not the difference of two lengths, which would lose the digits of small openings.
        [opening.dot(&(self.start + branch)) / (length + self.start.norm()), rate.dot(&branch) / length]
    }
}

/// Share of the lasting part in the speed of the servo: it changes by this share of the error over `τ²`. With it the two others are damped
/// critically where the loading moves three times as far as the gauge opens, and more than that where it moves less.
const LASTING: f64 = 0.1;

/// A servo that makes the elongation `e` of a gauge follow a target `e₀`. What it moves has the speed
///
/// ```text
/// ± (g (ė₀ − ė) + (e₀ − e)/τ + 0.1/τ² ∫ (e₀ − e) dt),
/// ```
///
/// at most a given one, at which the integral stays as it is. Where a specimen snaps back, the crack grows by itself at a constant
/// position of the loading. The first term then turns the loading back in the same step. The second one removes errors, and the third
/// one what the second leaves while the target moves at a constant rate.
#[derive(Debug, Clone, PartialEq)]
pub struct OpeningServo {
    /// The gauge.
    pub gauge: Extensometer,
    /// Whether moving forward lengthens the gauge: 1, or shortens it: −1.
    pub sign: f64,
    /// Displacement per error of the elongation `g`, at once.
    pub gain: f64,
    /// Response time `τ`, s.
    pub response_time: f64,
}

impl OpeningServo {
    /// The speed, m/s, not above `most`, for a target elongation (m) that changes at `rate` (m/s). `lasting`: the third term, m/s, a part
    /// of the state.
    pub fn speed(&self, state: &State, [target, rate]: [f64; 2], most: f64, lasting: &mut f64) -> f64 {
        let [elongation, speed] = self.gauge.measure(state);
        let error = self.sign * (target - elongation);
        let now = self.sign * self.gain * (rate - speed) + error / self.response_time;
        let next = *lasting + LASTING * error * state.clock.dt / (self.response_time * self.response_time);
        let wanted = now + next;
        if wanted.abs() < most || next.abs() < lasting.abs() {
            *lasting = next;
        }
        wanted.clamp(-most, most)
    }
}

/// A loading that follows the opening of a gauge.
#[derive(Debug, Clone, PartialEq)]
pub struct Opening {
    /// The servo.
    pub servo: OpeningServo,
    /// Rate of the elongation, m/s.
    pub rate: f64,
    /// Relative speed of the two ends of the loading, m/s, which is also the largest one.
    pub full_speed: f64,
}

impl Opening {
    /// Factor of the loading's rate in the coming step. `loaded_time`: integral of the stages' factor over the time of the run, s;
    /// `factor`: that of the present stage; `lasting`: see [`OpeningServo::speed`].
    pub(super) fn factor(&self, state: &State, loaded_time: f64, factor: f64, lasting: &mut f64) -> f64 {
        let target = [self.rate * loaded_time, self.rate * factor];
        self.servo.speed(state, target, self.full_speed, lasting) / self.full_speed
    }
}
