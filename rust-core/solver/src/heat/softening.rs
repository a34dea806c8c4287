//! Stiffness and strength that depend on the temperature.
//!
//! Factors on the constants of the laws follow from the temperature of each particle by the [`Curve`](super::Curve)s of its material. A
//! contact has the mean of its two particles. The work of the change is a term of the ledger; see `forces/factors.rs`.

use rayon::prelude::*;

use super::{HeatModel, HeatState};
use crate::evaluation::{Softened, TILE};
use crate::state::Particles;

/// Factors of the particles. Scratch.
#[derive(Debug, Clone, Default)]
pub struct Softening {
    stiffness_before: Vec<f64>,
    stiffness: Vec<f64>,
    strength: Vec<f64>,
}

impl Softening {
    /// Find the factors at the temperatures at the start of a step, and those of the last step.
    pub fn begin(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState) {
        let rows = || heat.temperature.par_iter().zip(&particles.material).zip(&heat.warming).with_min_len(TILE);
        let before =
            |((now, material), warming): ((&f64, &u16), &f64)| model.stiffness_factor(*material, now - warming);
        let stiffness = |((now, material), _): ((&f64, &u16), &f64)| model.stiffness_factor(*material, *now);
        let strength = |((now, material), _): ((&f64, &u16), &f64)| model.strength_factor(*material, *now);
        rows().map(before).collect_into_vec(&mut self.stiffness_before);
        rows().map(stiffness).collect_into_vec(&mut self.stiffness);
        rows().map(strength).collect_into_vec(&mut self.strength);
    }

    /// Find the factors at the temperatures of the last step.
    pub fn find_last(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState) {
        let rows = || heat.temperature.iter().zip(&heat.warming).zip(&particles.material);
        self.stiffness = rows().map(|((now, warming), m)| model.stiffness_factor(*m, now - warming)).collect();
        self.strength = rows().map(|((now, warming), m)| model.strength_factor(*m, now - warming)).collect();
        self.stiffness_before.clone_from(&self.stiffness);
    }

    /// The factors.
    pub fn factors(&self) -> Softened<'_> {
        Softened { stiffness_before: &self.stiffness_before, stiffness: &self.stiffness, strength: &self.strength }
    }
}
