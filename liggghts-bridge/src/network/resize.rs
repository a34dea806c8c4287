//! Contacts of atoms whose radii change in a run.

use concordem_contact::law::Reference;
use concordem_solver::Solver;
use concordem_solver::state::contacts::ContactFlags;

use super::{Network, NetworkError};
use crate::records::HISTORY;

impl Network {
    /// Give contacts that touch the reference of the present radii. `changes`: particles, and by how much their radii have changed (m).
    ///
    /// # Errors
    /// Heat conduction, whose areas do not follow; or an error of the solver.
    pub(super) fn resize_contacts(&mut self, changes: &[(usize, f64)]) -> Result<(), NetworkError> {
        let Some(&(first, _)) = changes.first() else { return Ok(()) };
        if self.thermal.is_some() {
            return Err(NetworkError::HeatOfOtherRadius { tag: self.tags[first] });
        }
        let Some(block) = &mut self.state.contacts else { return Ok(()) };
        let (block, radius) = (block.contacts_mut(), &self.state.particles.radius);
        let mut change = vec![0.0; radius.len()];
        for &(p, by) in changes {
            change[p] = by;
        }
        let width: usize = block.history_fields().iter().map(|field| field.components).sum();
        let (mut places, mut contacts) = (Vec::new(), Vec::new());
        for k in 0..block.len() {
            let view = block.view(k);
            let [a, b] = [view.pair.a as usize, view.pair.b as usize];
            let keeps = view.flags.has(ContactFlags::KEPT_REFERENCE);
            // Candidates take the reference when they begin to touch.
            if change[a] + change[b] == 0.0 || !keeps && !view.flags.has(ContactFlags::ACTIVE) {
                continue;
            }
            let new = block.unbonded_reference(view.previous.length, radius[a], radius[b]);
            let reference = if !keeps && new.length == radius[a] + radius[b] {
                new
            } else {
                let area = if keeps { view.reference.area } else { new.area };
                Reference { length: view.reference.length + (change[a] + change[b]), area }
            };
            let mut history = [0.0; HISTORY];
            for (n, number) in history[..width].iter_mut().enumerate() {
                *number = block.history_column(n)[k];
            }
            places.push(k as u32);
            contacts.push((view.pair, view.flags, reference, view.previous, history));
        }
        if places.is_empty() {
            return Ok(());
        }
        block.remove(&places);
        for (pair, flags, reference, previous, history) in contacts {
            block.push_with_history(pair, flags, reference, previous, &history);
        }
        block.sort();
        self.adjacency = None;
        let (owned, excluded) = (self.owned.clone(), self.without_contacts.clone());
        self.solver = Some(Solver::for_subdomain(self.model.clone(), &mut self.state, owned, excluded)?);
        Ok(())
    }
}
