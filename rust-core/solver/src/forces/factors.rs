//! Contacts with factors on their stiffness and strength: by their temperature, or by chance.
//!
//! **Ledger.** Let `s_o` and `s` be the factors on the stiffness in the last step and in this one. The law sees its history with the
//! present stiffness only: from this history, with the elastic force `F' = (s/s_o) F_o` and the stored energy `U' = (s/s_o) U_o`, it
//! balances `½(F' + d_o + F)·Δx = U + D − U'`, with the force `d_o` of the dashpots one step ago, the present force `F`, and all that it
//! dissipates or books as integration, `D`. The particles did the work of `F_o` and stored `U_o`. So the change of the stiffness has put
//! in
//!
//! `U' − U_o + ½(F' − F_o)·Δx = (1 − s_o/s)(U' + ½F'·Δx) = (1 − s_o/s)[U + D − ½(F + d_o)·Δx]`,
//!
//! for a spring `½(k − k_o) u_o u`. The last form needs nothing from the last step but the factor.

use concordem_contact::columns::Lanes;
use concordem_contact::law::{ContactLaw, Kinematics, Response, Status};
use concordem_contact::math::Vec3;
use concordem_contact::step::{How, Stepped};

use super::ContactFactors;
use super::kinds::LoopKind;
use super::tile::{PendingContact, TileEvaluator};
use crate::state::contacts::ContactFlags;

impl<L: ContactLaw, K: LoopKind, T: Lanes> TileEvaluator<'_, L, K, T> {
    /// Evaluate a contact between rigid particles with its factors.
    #[cold]
    #[inline(never)]
    pub(super) fn evaluate_with_factors(
        &mut self,
        pending: PendingContact,
        kinematics: &L::Kinematics,
        factors: &ContactFactors<'_>,
    ) {
        let PendingContact { contact, begins, .. } = pending;
        let k = contact as usize;
        let (pair, flags) = (self.tile.pair[k], self.tile.flags[k]);
        let strength = self.tile.strength.get(k).copied().unwrap_or(1.0);
        let law = self.rows[flags.row as usize];
        let old = self.tile.history.get(k);
        let of_contact = factors.of(pair, strength);
        let how = How { measure: self.context.mode, dt: self.context.dt, factors: Some(of_contact) };
        let Stepped { response, kinematics } = Stepped::of(&law, *kinematics, &old, &how);
        // A contact that begins has stored nothing.
        if !begins && !flags.has(ContactFlags::NOT_OWNED) {
            let of_change = 1.0 - factors.past(pair);
            if of_change != 0.0 {
                let normal_before = self.tile.previous.get(k).normal;
                self.totals.stiffness_work +=
                    of_change * reversible_work::<L>(&kinematics, &old, &normal_before, &response);
            }
        }
        self.commit_response(pending, kinematics.point(), &response, None);
    }
}

/// `U + D − ½(F + d_o)·Δx`, J (see the [module](self)).
fn reversible_work<L: ContactLaw>(
    kinematics: &L::Kinematics,
    old: &L::State,
    normal_before: &Vec3,
    response: &Response<L::State>,
) -> f64 {
    let point = kinematics.point();
    let dashpot = L::viscous_force(normal_before, old);
    let axial = dashpot.dot(normal_before);
    let across = point.transport.apply(&(dashpot - normal_before * axial));
    let dashpot = point.normal * axial + across;
    let ledger = response.energy.dissipated() + response.energy.integration;
    // A contact that ended stores nothing and has no force, but the response keeps the modes of the released energy.
    let (stored, force, moment) = match response.status {
        Status::Lives => (response.energy.stored(), response.force, response.moment),
        Status::Broke | Status::BrokeInShear | Status::Opened => Default::default(),
    };
    stored + ledger - 0.5 * kinematics.bond_work(&(force + dashpot), &moment)
}
