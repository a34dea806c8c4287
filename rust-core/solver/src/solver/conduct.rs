//! Heat conduction within a step of the solver.

use super::Solver;
use crate::heat::HeatFlows;
use crate::heat::expansion::Expansion;
use crate::heat::pass::HeatPass;
use crate::heat::softening::Softening;
use crate::state::State;
use crate::state::contacts::Pair;
use crate::{SolverError, StepReport};

impl Solver {
    /// Prepare heat conduction, if the model has any.
    pub(super) fn start_heat(&mut self, state: &State) -> Result<(), SolverError> {
        let Some(model) = &self.model.heat else { return Ok(()) };
        if !self.owned.is_empty() {
            return Err(SolverError::Heat { problem: "is not supported in subdomains of a distributed host" });
        }
        if state.heat.as_ref().is_none_or(|heat| heat.temperature.len() != state.particles.len()) {
            return Err(SolverError::Heat { problem: "needs the temperatures of all particles (`State::heat`)" });
        }
        if model.contact.is_some() && state.contacts.is_none() {
            return Err(SolverError::Heat { problem: "through contacts needs a law of unbonded contacts" });
        }
        self.heat = Some(HeatPass::new(model, state));
        self.expansion = (model.mechanics && model.expands()).then(Expansion::default);
        self.softening = self.softening_of(state, false);
        if self.softening.is_some() && self.model.deformable.is_some() {
            return Err(SolverError::Heat { problem: "gives stiffnesses of deformable particles no temperature" });
        }
        Ok(())
    }

    /// Compute the change of the temperatures in the step. The neighbor list is complete for the present positions.
    pub(super) fn begin_heat(&mut self, state: &mut State) -> Result<(), SolverError> {
        let (Some(pass), Some(model)) = (&mut self.heat, &self.model.heat) else { return Ok(()) };
        pass.touch(model, state, &self.pass.surface_displacement);
        let Some(heat) = &mut state.heat else { return Ok(()) };
        let clock = &state.clock;
        let (time, dt) = (clock.time() * model.time_factor, clock.dt * model.time_factor);
        pass.begin(model, &state.particles, heat, time, dt)?;
        if let Some(expansion) = &mut self.expansion {
            expansion.begin(model, &state.particles, heat, &pass.increment);
        }
        if let Some(softening) = &mut self.softening {
            softening.begin(model, &state.particles, heat);
        }
        Ok(())
    }

    /// Apply the change of the temperatures; bonds expand. `dissipated`: energy of contacts that becomes heat in the next step, J.
    ///
    /// # Errors
    /// A temperature that is not finite.
    pub(super) fn finish_heat(&mut self, state: &mut State, dissipated: &[(Pair, f64)]) -> Result<(), SolverError> {
        let (Some(pass), Some(model), Some(heat)) = (&self.heat, &self.model.heat, &mut state.heat) else {
            return Ok(());
        };
        if !pass.finish(heat) {
            let first = heat.temperature.iter().position(|temperature| !temperature.is_finite()).unwrap_or_default();
            let what = format!("the temperature of the particle with id {}", state.particles.id[first]);
            return Err(SolverError::NoNumber { step: state.clock.step, time: state.clock.time(), what });
        }
        heat.take_up(dissipated);
        if let Some(expansion) = &mut self.expansion {
            expansion.apply(model, state, true);
        }
        Ok(())
    }

    /// The heat that flows at the present temperatures and positions; none without heat conduction.
    ///
    /// Changes nothing, except that the neighbor list is rebuilt now if the next step would rebuild it.
    ///
    /// # Errors
    /// Input that the neighbor search rejects.
    pub fn heat_flows(&mut self, state: &mut State) -> Result<HeatFlows, SolverError> {
        if self.heat.is_none() {
            return Ok(HeatFlows::default());
        }
        let strain = self.begin_deformation(state);
        if self.needs_rebuild(state, strain) {
            self.rebuild_neighbor_list(state, strain)?;
        }
        let (Some(pass), Some(model), Some(heat)) = (&mut self.heat, &self.model.heat, &state.heat) else {
            return Ok(HeatFlows::default());
        };
        pass.touch(model, state, &self.pass.surface_displacement);
        Ok(pass.flows(model, &state.particles, state.cell.as_ref(), heat))
    }

    /// Factors on stiffness and strength at the present temperatures, or with `last` at those of the last step; `None` if they are
    /// constant.
    pub(super) fn softening_of(&self, state: &State, last: bool) -> Option<Softening> {
        let (model, heat) = (self.model.heat.as_ref()?, state.heat.as_ref()?);
        if !model.mechanics || !model.curves.softens() {
            return None;
        }
        let mut softening = Softening::default();
        if last {
            softening.find_last(model, &state.particles, heat);
        } else {
            softening.begin(model, &state.particles, heat);
        }
        Some(softening)
    }

    /// Whether particles do not move.
    pub(super) fn rests(&self) -> bool {
        self.model.heat.as_ref().is_some_and(|heat| !heat.mechanics)
    }

    /// A step without motion.
    ///
    /// # Errors
    /// A temperature that is not finite.
    pub(super) fn only_conduct(&mut self, state: &mut State) -> Result<StepReport, SolverError> {
        state.clock.step += 1;
        self.finish_heat(state, &[])?;
        Ok(StepReport::default())
    }
}
