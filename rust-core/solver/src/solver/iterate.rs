//! Iterated strains of deformable particles: forces and strains that agree within one step.

use concordem_contact::math::Mat3;

use super::Solver;
use crate::deformation;
use crate::forces::{BondEvent, EvaluatedContacts};
use crate::state::State;
use crate::state::contacts::Pair;
use crate::{SolverError, StepReport};

impl Solver {
    /// Repeat [`Self::evaluate`] until strains and forces agree, each time from the histories at the start of the step.
    /// `strain`: the largest particle strain, updated.
    pub(super) fn evaluate_iterated(
        &mut self,
        state: &mut State,
        sample: bool,
        report: &mut StepReport,
        strain: &mut f64,
    ) -> Result<Mat3, SolverError> {
        let Some((tolerance, maximum, relaxation)) = deformation::iteration(self.model.deformable.as_ref()) else {
            return Ok(self.evaluate(state, sample, report));
        };
        let mut change = f64::INFINITY;
        let mut start = Histories::of(state);
        for iteration in 0..maximum {
            if iteration > 0 {
                if let Some(deformable) = &self.model.deformable {
                    *strain = self.pass.relax(deformable, relaxation, &state.particles);
                }
                // A bond that broke in one iteration breaks in all that follow. If bonds broke and healed in turn, the
                // strains would not converge.
                start.release(&report.bond_events);
                start.restore(state);
                if self.needs_rebuild(state, *strain) {
                    self.rebuild_neighbor_list(state, *strain)?;
                    report.rebuilt = true;
                    start = Histories::of(state);
                }
            }
            let StepReport { rebuilt, evaluations, .. } = *report;
            *report = StepReport { rebuilt, evaluations, ..StepReport::default() };
            let crossing = self.evaluate(state, sample, report);
            if iteration == 0 {
                self.pass.keep_others(&self.force);
            }
            change = self.pass.disagreement(&state.particles);
            if change <= tolerance {
                return Ok(crossing);
            }
        }
        Err(SolverError::NotConverged { step: state.clock.step, iterations: maximum, change })
    }
}

/// Copies of all contacts.
struct Histories {
    bonds: Vec<Box<dyn EvaluatedContacts>>,
    contacts: Option<Box<dyn EvaluatedContacts>>,
    wall_contacts: Option<Box<dyn EvaluatedContacts>>,
}

impl Histories {
    fn of(state: &State) -> Self {
        Self {
            bonds: state.bonds.iter().map(|block| block.boxed_clone()).collect(),
            contacts: state.contacts.as_ref().map(|block| block.boxed_clone()),
            wall_contacts: state.wall_contacts.as_ref().map(|block| block.boxed_clone()),
        }
    }

    /// Release the bonds that broke: they break at the next evaluation.
    fn release(&mut self, bond_events: &[(usize, BondEvent)]) {
        for (k, block) in self.bonds.iter_mut().enumerate() {
            let broke = |(index, event): &&(usize, BondEvent)| *index == k && event.broke;
            let mut pairs: Vec<Pair> = bond_events.iter().filter(broke).map(|(_, event)| event.pair).collect();
            if !pairs.is_empty() {
                pairs.sort_unstable();
                block.contacts_mut().release(&|pair| pairs.binary_search(pair).is_ok());
            }
        }
    }

    fn restore(&self, state: &mut State) {
        state.bonds = self.bonds.iter().map(|block| block.boxed_clone()).collect();
        state.contacts = self.contacts.as_ref().map(|block| block.boxed_clone());
        state.wall_contacts = self.wall_contacts.as_ref().map(|block| block.boxed_clone());
    }
}
