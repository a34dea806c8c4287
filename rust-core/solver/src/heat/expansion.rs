//! Thermal expansion of bonds.
//!
//! Between two steps, the reference length of each bond becomes `l₀ = l_r (1 + ½(ε_A + ε_B))` with the length `l_r` at the
//! reference temperature and the thermal strains ε of its particles. The length that the bond remembers of the last step
//! moves along, so that the law sees the elongation `l − l₀` now and then, and its rate: free expansion is without
//! force, also in dashpots.
//!
//! **Ledger.** In a step the particles do the work `½(F_o + F)Δl` against the axial force `F` of a bond (tension positive),
//! and the law stores and dissipates `½(F_o + F)(Δl − Δl₀)`. The difference is the work of the expansion,
//! `−½(F_o + F)Δl₀`: half of it belongs to the force before, half to the force after the change.

use rayon::prelude::*;

use super::{HeatModel, HeatState};
use crate::evaluation::{ExpansionRates, TILE};
use crate::state::{Particles, State};

/// Thermal strains of the particles. Scratch.
#[derive(Debug, Clone, Default)]
pub struct Expansion {
    /// Change of each strain in the last step.
    before: Vec<f64>,
    /// Change of each strain in the present step.
    after: Vec<f64>,
    /// Strains.
    strain: Vec<f64>,
}

impl Expansion {
    /// Compute the changes of the strains in the last and in the present step from those of the temperatures.
    pub fn begin(&mut self, model: &HeatModel, particles: &Particles, heat: &HeatState, increment: &[f64]) {
        let rows = |warming| heat.temperature.par_iter().zip(&particles.material).zip(warming).with_min_len(TILE);
        let before = |((now, material), warming): ((&f64, &u16), &f64)| -model.strain_of(*material, *now, -warming);
        let after = |((now, material), warming): ((&f64, &u16), &f64)| model.strain_of(*material, *now, *warming);
        rows(&heat.warming[..]).map(before).collect_into_vec(&mut self.before);
        rows(increment).map(after).collect_into_vec(&mut self.after);
    }

    /// The changes of the strains, for the work of the expansion.
    pub fn rates(&self) -> ExpansionRates<'_> {
        ExpansionRates { before: &self.before, after: &self.after }
    }

    /// Give all bonds the lengths of the present temperatures. `continued`: the remembered lengths move along.
    pub fn apply(&mut self, model: &HeatModel, state: &mut State, continued: bool) {
        let State { heat: Some(heat), particles, bonds, .. } = state else { return };
        let rows = heat.temperature.par_iter().zip(&particles.material).with_min_len(TILE);
        rows.map(|(temperature, material)| model.strain(*material, *temperature)).collect_into_vec(&mut self.strain);
        for block in bonds {
            block.contacts_mut().expand(&self.strain, continued);
        }
    }
}

/// Let the bonds of `state` expand from now on: their present reference lengths belong to the reference temperature of
/// `model`.
pub fn start(model: &HeatModel, state: &mut State) {
    for block in &mut state.bonds {
        block.contacts_mut().begin_expansion();
    }
    Expansion::default().apply(model, state, false);
}
