//! Stresses that are nothing but rounding errors: those of a specimen that nobody loads.

use concordem_contact::math::Vec3;
use concordem_solver::state::State;

/// Roundings of a coordinate in a step, in units of the relative rounding error: position, motion, difference of two positions, and what forces
/// make of them.
const ROUNDINGS: f64 = 16.0;

/// Size of the stress that roundings cause. A step moves each particle by rounding errors of its coordinates, as a load with random signs would:
/// the errors of n steps add up as √n.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Rounding {
    /// Stress by the roundings of one step, Pa.
    pub one_step: f64,
}

impl Rounding {
    /// That of a body of this volume (m³) whose contacts have `Σ k l²` (J): its stiffness times the strain between neighbors that roundings are.
    pub fn new(state: &State, volume: Option<f64>, stiffness_sum: f64) -> Self {
        let extent = state.particles.position.iter().map(Vec3::amax).fold(0.0, f64::max);
        let strain = ROUNDINGS * f64::EPSILON * extent / state.particles.mean_radius();
        Self { one_step: volume.map_or(0.0, |volume| stiffness_sum / volume * strain) }
    }

    /// Stress by the roundings of so many steps, Pa. What is smaller is no stress.
    pub fn after(&self, steps: u64) -> f64 {
        self.one_step * (1.0 + steps as f64).sqrt()
    }
}
