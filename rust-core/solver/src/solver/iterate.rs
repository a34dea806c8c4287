//! Iterated strains of deformable particles: forces and strains that agree within one step.

use concordem_contact::math::Mat3;

use super::Solver;
use crate::deformation;
use crate::forces::{BondEvent, EvaluatedContacts};
use crate::record::Forces;
use crate::state::State;
use crate::state::contacts::Pair;
use crate::{SolverError, StepReport};

impl Solver {
    /// Repeat [`Self::evaluate`] until strains and forces agree, each time from the histories at the start of the step.
    /// `strain`: the largest particle strain, updated. Also returns the contacts at the start of the last iteration.
    pub(super) fn evaluate_iterated(
        &mut self,
        state: &mut State,
        sample: bool,
        report: &mut StepReport,
        strain: &mut f64,
    ) -> Result<(Mat3, ContactsBefore), SolverError> {
        let mut start = ContactsBefore::of(state);
        let Some((tolerance, maximum, relaxation)) = deformation::iteration(self.model.deformable.as_ref()) else {
            return Ok((self.evaluate(state, sample, report), start));
        };
        let mut change = f64::INFINITY;
        for iteration in 0..maximum {
            if iteration > 0 {
                if let Some(deformable) = &self.model.deformable {
                    *strain = self.pass.relax(deformable, relaxation, &state.particles);
                }
                // A bond that broke in one iteration breaks in all that follow. If bonds broke and healed in turn, the
                // strains would not converge.
                start.release(&report.bond_events);
                if self.needs_rebuild(state, *strain) {
                    start.reset(state);
                    self.rebuild_neighbor_list(state, *strain)?;
                    report.rebuilt = true;
                    start = ContactsBefore { released: start.released, ..ContactsBefore::of(state) };
                }
                start.restore(state);
            }
            let StepReport { rebuilt, evaluations, .. } = *report;
            *report = StepReport { rebuilt, evaluations, ..StepReport::default() };
            let crossing = self.evaluate(state, sample, report);
            if iteration == 0 {
                self.pass.keep_others(&self.force);
            }
            change = self.pass.disagreement(&state.particles);
            if change <= tolerance {
                return Ok((crossing, start));
            }
        }
        Err(SolverError::NotConverged { step: state.clock.step, iterations: maximum, change })
    }

    /// The forces of [`Solver::record`] with iterated strains: those of the last iteration. The state does not change.
    pub(super) fn record_iterated(
        &mut self,
        state: &mut State,
        mut strain: f64,
        border: Option<&[bool]>,
    ) -> Result<Forces, SolverError> {
        let kept = (state.walls.clone(), self.force.clone(), self.torque.clone());
        // The work of expansion belongs to the step.
        let expansion = self.expansion.take();
        self.find_poses(state);
        let found = self.evaluate_iterated(state, false, &mut StepReport::default(), &mut strain);
        self.expansion = expansion;
        let (_, start) = found?;
        start.restore(state);
        let forces = self.record_forces(state, false, border);
        start.reset(state);
        (state.walls, self.force, self.torque) = kept;
        Ok(forces)
    }
}

/// All contacts at the start of a step, and the bonds that broke in an iteration.
pub(super) struct ContactsBefore {
    bonds: Vec<Box<dyn EvaluatedContacts>>,
    contacts: Option<Box<dyn EvaluatedContacts>>,
    wall_contacts: Option<Box<dyn EvaluatedContacts>>,
    /// Number of the block of bonds, and the pair.
    released: Vec<(usize, Pair)>,
}

impl ContactsBefore {
    fn of(state: &State) -> Self {
        Self {
            bonds: state.bonds.iter().map(|block| block.boxed_clone()).collect(),
            contacts: state.contacts.as_ref().map(|block| block.boxed_clone()),
            wall_contacts: state.wall_contacts.as_ref().map(|block| block.boxed_clone()),
            released: Vec::new(),
        }
    }

    /// Release the bonds that broke: they break at the next evaluation.
    fn release(&mut self, bond_events: &[(usize, BondEvent)]) {
        self.released.extend(bond_events.iter().filter(|(_, event)| event.broke).map(|(k, event)| (*k, event.pair)));
        self.released.sort_unstable();
        self.released.dedup();
    }

    /// Put the contacts back, without releasing any.
    fn reset(&self, state: &mut State) {
        state.bonds = self.bonds.iter().map(|block| block.boxed_clone()).collect();
        state.contacts = self.contacts.as_ref().map(|block| block.boxed_clone());
        state.wall_contacts = self.wall_contacts.as_ref().map(|block| block.boxed_clone());
    }

    /// Put the contacts back, and release those that broke.
    fn restore(&self, state: &mut State) {
        self.reset(state);
        if self.released.is_empty() {
            return;
        }
        for (k, block) in state.bonds.iter_mut().enumerate() {
            block.contacts_mut().release(&|pair| self.released.binary_search(&(k, *pair)).is_ok());
        }
    }
}
