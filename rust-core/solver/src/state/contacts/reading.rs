//! Which contacts a block holds, and their histories.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::{ContactLaw, Field, LawState, Reference};

use super::{ContactBlock, ContactFlags, ContactView, Pair};
use crate::state::table::Table;

/// What a block of contacts holds: who touches whom, since which geometry, with which history.
pub trait ReadContacts: Send + Sync {
    /// Number of entries, broken and inactive ones included.
    fn len(&self) -> usize;
    /// Whether there are no contacts.
    fn is_empty(&self) -> bool {
        self.len() == 0
    }
    /// Contact `k`.
    fn view(&self, k: usize) -> ContactView;
    /// Particles of all contacts.
    fn pairs(&self) -> &[Pair];
    /// Flags of all contacts.
    fn flags(&self) -> &[ContactFlags];
    /// References of all contacts.
    fn references(&self) -> &Table<Reference>;
    /// Normals and lengths of all contacts in the last step.
    fn previous(&self) -> &Table<PreviousGeometry>;
    /// Fields of the history.
    fn history_fields(&self) -> &'static [Field];
    /// Number `n` of the histories of all contacts, in the order of [`Self::history_fields`]; a vector has three.
    fn history_column(&self, n: usize) -> &[f64];
    /// Memory per contact in bytes.
    fn bytes_per_contact(&self) -> usize;
}

impl<L: ContactLaw> ReadContacts for ContactBlock<L> {
    fn len(&self) -> usize {
        self.pair.len()
    }
    fn view(&self, k: usize) -> ContactView {
        ContactView {
            pair: self.pair[k],
            flags: self.flags[k],
            reference: self.reference.get(k),
            previous: self.previous.get(k),
        }
    }
    fn pairs(&self) -> &[Pair] {
        &self.pair
    }
    fn flags(&self) -> &[ContactFlags] {
        &self.flags
    }
    fn references(&self) -> &Table<Reference> {
        &self.reference
    }
    fn previous(&self) -> &Table<PreviousGeometry> {
        &self.previous
    }
    fn history_fields(&self) -> &'static [Field] {
        L::State::FIELDS
    }
    fn history_column(&self, n: usize) -> &[f64] {
        self.history.column(n)
    }
    fn bytes_per_contact(&self) -> usize {
        size_of::<Pair>()
            + size_of::<ContactFlags>()
            + size_of::<Reference>()
            + size_of::<PreviousGeometry>()
            + size_of::<L::State>()
    }
}
