//! A beam on two supports, bent by one or two rollers.

use concordem_solver::Solver;
use concordem_solver::state::State;

/// A beam on two supports, bent in three or four points.
#[derive(Debug, Clone, PartialEq)]
pub struct Flexure {
    /// Direction in which the supports push, 0 to 2.
    pub across: usize,
    /// What supports and presses.
    pub bearings: Bearings,
    /// Speed of the rollers towards the supports, m/s.
    pub speed: f64,
    /// Stress in the outer fiber divided by the force of all rollers, 1/m².
    pub stress_of_force: f64,
    /// Strain of the outer fiber divided by the deflection under the rollers, 1/m.
    pub strain_of_deflection: f64,
    /// Cross-section, m².
    pub area: f64,
    /// Distance of the supports, m.
    pub span: f64,
}

/// What supports a beam, and what presses on it.
#[derive(Debug, Clone, PartialEq)]
pub enum Bearings {
    /// Cylindrical walls: index of the first support; the second one and `rollers` rollers follow.
    Rollers {
        /// Index of the first support.
        first: usize,
        /// Number of rollers, 1 or 2.
        rollers: usize,
    },
    /// Particles that are held, and particles that are moved.
    Strips {
        /// Indices of the particles over both supports.
        held: Vec<u32>,
        /// Indices of the particles under the rollers.
        moved: Vec<u32>,
        /// Their mean coordinate at the start, m.
        start: f64,
    },
}

impl Flexure {
    /// Particles whose motion across the beam is prescribed.
    pub(crate) fn strips(&self) -> [&[u32]; 2] {
        match &self.bearings {
            Bearings::Rollers { .. } => [&[], &[]],
            Bearings::Strips { held, moved, .. } => [held, moved],
        }
    }

    /// Moves the rollers at `factor` times their speed.
    pub(super) fn move_rollers(&self, state: &mut State, solver: &mut Solver, factor: f64) {
        let velocity = -self.speed * factor;
        match &self.bearings {
            Bearings::Rollers { first, rollers } => {
                for wall in &mut state.walls[first + 2..first + 2 + rollers] {
                    wall.velocity[self.across] = velocity;
                }
            }
            Bearings::Strips { moved, .. } => {
                let targets = solver.targets_mut(&state.particles);
                for &p in moved {
                    targets[p as usize].0[self.across] = velocity;
                }
            }
        }
    }

    /// Strain of the outer fiber that belongs to the deflection.
    pub(super) fn strain(&self, state: &State) -> f64 {
        let deflection = match &self.bearings {
            // All rollers move together, and the supports rest.
            Bearings::Rollers { first, .. } => -state.walls[first + 2].displacement[self.across],
            Bearings::Strips { moved, start, .. } => {
                let sum: f64 = moved.iter().map(|&p| state.particles.position[p as usize][self.across]).sum();
                start - sum / moved.len() as f64
            }
        };
        deflection * self.strain_of_deflection
    }

    /// Stress in the outer fiber, Pa, from the mean of the forces of supports and rollers, which evens out waves.
    pub(super) fn stress(&self, state: &State, solver: &Solver) -> f64 {
        let across = self.across;
        let [supports, rollers] = match &self.bearings {
            Bearings::Rollers { first, rollers } => [*first..first + 2, first + 2..first + 2 + rollers]
                .map(|walls| state.walls[walls].iter().map(|wall| wall.force[across]).sum::<f64>()),
            Bearings::Strips { held, moved, .. } => {
                [held, moved].map(|strip| strip.iter().map(|&p| solver.forces()[p as usize][across]).sum::<f64>())
            }
        };
        0.5 * (rollers - supports) * self.stress_of_force
    }
}
