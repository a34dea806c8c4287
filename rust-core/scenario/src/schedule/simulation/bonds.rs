//! Bonds that come and go during a run, besides those that break by themselves.

use super::{RunError, Simulation, memory};
use crate::schedule::{Bonding, bonding};
use concordem_solver::state::contacts::Pair;
use concordem_solver::{Solver, SolverError, time_step};

impl Simulation {
    /// Makes the bonds that are due; `ended`: the stage that has just ended. Returns their number.
    pub(super) fn bond(&mut self, ended: Option<usize>) -> Result<Option<usize>, RunError> {
        let done = self.state.schedule_memory[memory::BONDED] as u64;
        let is_due = |k: &usize| done >> k & 1 == 0 && self.schedule.bondings[*k].is_due(&self.state, ended);
        let due: Vec<usize> = (0..self.schedule.bondings.len()).filter(is_due).collect();
        if due.is_empty() {
            return Ok(None);
        }
        let bondings: Vec<Bonding> = due.iter().map(|&k| self.schedule.bondings[k].clone()).collect();
        for k in due {
            self.state.schedule_memory[memory::BONDED] += (1_u64 << k) as f64;
        }
        self.make_bonds(&bondings).map(Some)
    }

    /// Makes bonds now, whatever their moment is, in place of unbonded contacts, which lose what they stored; returns their number. Pairs
    /// that have a bond, or had one that broke, get none.
    ///
    /// # Errors
    /// The time step is too large for the bonds, unless the scenario allows that.
    pub fn make_bonds(&mut self, bondings: &[Bonding]) -> Result<usize, RunError> {
        let clock = self.state.clock;
        let model = self.solver.model().clone();
        let before = bonding::stored_energy(&model, &self.state)?;
        let mut made = 0;
        for bonding in bondings {
            let failed = |source| SolverError::Neighbor { step: clock.step, source };
            made += bonding.make(&mut self.state, &self.schedule.bond_rows).map_err(failed)?;
        }
        let after = bonding::stored_energy(&model, &self.state)?;
        // The contacts that bonds replace lose what they stored.
        self.state.ledger.damage.add(before - after);
        let bound = time_step::bounds(&self.state).limit(&model.damping);
        if clock.dt > bound && !self.schedule.allow_unstable {
            return Err(RunError::Bonds { step: clock.step, time: clock.time(), made, dt: clock.dt, bound });
        }
        self.solver = Solver::new(model, &mut self.state)?;
        Ok(made)
    }

    /// Lets the bonds of these pairs of particles break in the next step, as particle-level failure does; returns their number. `pairs`:
    /// indices, sorted, the lower one first.
    pub fn break_bonds(&mut self, pairs: &[Pair]) -> usize {
        let wanted = |pair: &Pair| pairs.binary_search(pair).is_ok();
        let mut released = 0;
        for block in &mut self.state.bonds {
            let block = block.contacts_mut();
            released += block.pairs().iter().filter(|pair| wanted(pair)).count();
            block.release(&wanted);
        }
        released
    }
}
