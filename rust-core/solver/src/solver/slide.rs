//! Prescribed particles that slide together along an axis.

use super::Solver;
use crate::state::State;
use crate::state::particles::load_of;

/// Particles with prescribed motion that move along an axis like one rigid body: besides the velocities of [`Solver::targets_mut`], which must
/// not move their mean along the axis, they have one common velocity, which the sum of their forces changes. Not damped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Slider {
    /// Indices of the particles.
    pub particles: Vec<u32>,
    /// Number of the axis.
    pub axis: usize,
}

impl Solver {
    /// Let these particles slide; each may belong to one slider.
    pub fn set_sliders(&mut self, sliders: Vec<Slider>) {
        self.sliders = sliders;
    }

    /// Adds the common velocities after a kick of `step` (s) to the targets. The forces are those at the present positions: with forces one step
    /// late the motion would grow.
    pub(super) fn slide(&mut self, state: &State, step: f64) {
        let particles = &state.particles;
        for slider in std::mem::take(&mut self.sliders) {
            let axis = slider.axis;
            let (mut mass, mut force, mut velocity) = (0.0, 0.0, 0.0);
            for &p in &slider.particles {
                let (load, _) = load_of(&particles.loads, p);
                let p = p as usize;
                mass += particles.mass[p];
                force += self.force[p][axis] + self.model.gravity[axis] * particles.mass[p] + load[axis];
                velocity += particles.velocity[p][axis];
            }
            let common = velocity / slider.particles.len() as f64 + force / mass * step;
            let targets = self.targets_mut(particles);
            for &p in &slider.particles {
                targets[p as usize].0[axis] += common;
            }
            self.sliders.push(slider);
        }
    }
}
