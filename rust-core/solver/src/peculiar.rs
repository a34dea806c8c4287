//! Kinetic energy of the mean motion of a periodic cell, which is no part of the energy of its content.
//!
//! A particle at `x` has the velocity `v' = v − L x` relative to the affine motion of the cell. `v` depends on the image at which a particle is
//! listed, `v'` does not. The ledger books the kinetic energy of `v`, because the leapfrog balance holds for it. The part
//! `Σ ½ m (v⁻·v⁺ − v'⁻·v'⁺)` is work that the boundary has done on the mean motion: without it both the kinetic energy and the work of the boundary
//! are those of the content.

use concordem_contact::Cell;
use concordem_contact::math::{Mat3, Vec3};
use rayon::prelude::*;

use crate::state::State;

/// Velocities of free particles and clumps before a kick, m/s.
pub(crate) struct Before {
    gradient: Mat3,
    particles: Vec<Vec3>,
    clumps: Vec<Vec3>,
}

impl Before {
    /// The velocities of a cell that moves, or begins to move by `change` (1/s); `None` for others.
    pub(crate) fn of(state: &State, change: Option<&Mat3>) -> Option<Self> {
        let gradient = state.cell.as_ref()?.velocity_gradient;
        let moves = gradient != Mat3::zeros() || change.is_some_and(|change| *change != Mat3::zeros());
        moves.then(|| Self {
            gradient,
            particles: state.particles.velocity.clone(),
            clumps: state.clumps.iter().map(|clump| clump.velocity).collect(),
        })
    }

    /// The kinetic energy of the mean motion, J, after kick and drift, before the cell moves.
    pub(crate) fn affine_kinetic(&self, state: &State, change: Option<&Mat3>) -> f64 {
        let Some(Cell { velocity_gradient, .. }) = &state.cell else { return 0.0 };
        let gradient = velocity_gradient + change.copied().unwrap_or_else(Mat3::zeros);
        let dt = state.clock.dt;
        let part = |mass: f64, after: &Vec3, moved: &Vec3, before: &Vec3| {
            let x = moved - after * dt;
            let (of_cell, with_cell) = (self.gradient * x, gradient * x);
            0.5 * mass * (of_cell.dot(after) + with_cell.dot(before) - of_cell.dot(&with_cell))
        };
        let particles = &state.particles;
        let free: Vec<f64> = (0..particles.len())
            .into_par_iter()
            .map(|p| {
                let is_free = particles.clump[p] == u32::MAX;
                let (v, x) = (&particles.velocity[p], &particles.position[p]);
                if is_free { part(particles.mass[p], v, x, &self.particles[p]) } else { 0.0 }
            })
            .collect();
        let clumps = state.clumps.iter().zip(&self.clumps);
        free.iter().sum::<f64>()
            + clumps.map(|(clump, before)| part(clump.mass, &clump.velocity, &clump.position, before)).sum::<f64>()
    }
}
