//! Contacts come and go.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactLaw, Reference};

use super::{ContactBlock, ContactFlags, Pair};

/// Changes of the list of contacts; none changes a contact that stays, but for its particles, image, flags, and area.
pub trait EditContacts: Send + Sync {
    /// Add a contact without history; call [`Self::sort`] after the last one.
    fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry);
    /// Add a contact with the history `history`, in the order of [`history_fields`](super::ReadContacts::history_fields); call [`Self::sort`] after the
    /// last one. Missing numbers are zero, surplus ones are ignored.
    fn push_with_history(
        &mut self,
        pair: Pair,
        flags: ContactFlags,
        reference: Reference,
        previous: PreviousGeometry,
        history: &[f64],
    );
    /// Insert a contact without history into a sorted block.
    fn insert(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry);
    /// Sort by particles and image.
    fn sort(&mut self);
    /// Make room for `count` more contacts, and no more.
    fn reserve(&mut self, count: usize);
    /// Remove contacts, given in ascending order.
    fn remove(&mut self, removed: &[u32]);
    /// Keep only the contacts for whose flags `keep` holds.
    fn retain_where(&mut self, keep: &dyn Fn(&ContactFlags) -> bool);
    /// Keep the contacts of the pairs, with their images, for which `keep` holds.
    fn retain_pairs(&mut self, keep: &dyn Fn(Pair, [i8; 3]) -> bool);
    /// Replace particles and flags of every contact by those of `relink`; remove the contacts for which it returns none.
    fn relink(&mut self, relink: &dyn Fn(Pair, ContactFlags) -> Option<(Pair, ContactFlags)>);
    /// Replace the image of every contact by `image` of its particles and image.
    fn map_images(&mut self, image: &dyn Fn(Pair, [i8; 3]) -> [i8; 3]);
    /// Multiply the area of every contact by `factor` of its particles.
    fn scale_areas(&mut self, factor: &dyn Fn(Pair) -> f64);
    /// Release the bonds for which `condition` holds: they break at their next evaluation.
    fn release(&mut self, condition: &dyn Fn(&Pair) -> bool);
}

impl<L: ContactLaw> EditContacts for ContactBlock<L> {
    fn push(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        Self::push(self, pair, flags, reference, previous);
    }
    fn push_with_history(
        &mut self,
        pair: Pair,
        flags: ContactFlags,
        reference: Reference,
        previous: PreviousGeometry,
        history: &[f64],
    ) {
        Self::push(self, pair, flags, reference, previous);
        self.history.set_numbers(self.len() - 1, history);
    }
    fn insert(&mut self, pair: Pair, flags: ContactFlags, reference: Reference, previous: PreviousGeometry) {
        Self::insert(self, pair, flags, reference, previous);
    }
    fn sort(&mut self) {
        Self::sort(self);
    }
    fn reserve(&mut self, count: usize) {
        self.pair.reserve_exact(count);
        self.flags.reserve_exact(count);
        self.reference.reserve_exact(count);
        self.previous.reserve_exact(count);
        self.history.reserve_exact(count);
        if !self.rest_length.is_empty() {
            self.rest_length.reserve_exact(count);
        }
    }
    fn remove(&mut self, removed: &[u32]) {
        Self::remove(self, removed);
    }
    fn retain_where(&mut self, keep: &dyn Fn(&ContactFlags) -> bool) {
        self.retain(keep);
    }
    fn retain_pairs(&mut self, keep: &dyn Fn(Pair, [i8; 3]) -> bool) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            flags.padding = u16::from(!keep(*pair, flags.image));
        }
        self.retain(|flags| flags.padding == 0);
    }
    fn relink(&mut self, relink: &dyn Fn(Pair, ContactFlags) -> Option<(Pair, ContactFlags)>) {
        for (pair, flags) in self.pair.iter_mut().zip(&mut self.flags) {
            if let Some((new_pair, new_flags)) = relink(*pair, *flags) {
                (*pair, *flags) = (new_pair, ContactFlags { padding: 0, ..new_flags });
            } else {
                flags.padding = 1;
            }
        }
        self.retain(|flags| flags.padding == 0);
    }
    fn map_images(&mut self, image: &dyn Fn(Pair, [i8; 3]) -> [i8; 3]) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            flags.image = image(*pair, flags.image);
        }
    }
    fn scale_areas(&mut self, factor: &dyn Fn(Pair) -> f64) {
        for (k, pair) in self.pair.iter().enumerate() {
            let Reference { length, area } = self.reference.get(k);
            self.reference.set(k, Reference { length, area: area * factor(*pair) });
        }
    }
    fn release(&mut self, condition: &dyn Fn(&Pair) -> bool) {
        for (pair, flags) in self.pair.iter().zip(&mut self.flags) {
            if condition(pair) {
                flags.bits &= !ContactFlags::BONDED;
            }
        }
    }
}
