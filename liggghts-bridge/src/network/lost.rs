//! Bonds of atoms that no longer exist, because they left the simulation box or were deleted.

use std::collections::HashSet;

use concordem_solver::state::contacts::Pair;

use super::before::Before;
use super::exchange::Arriving;
use super::{Network, blocks};
use crate::atoms::{Atoms, Tag};
use crate::records::{Kind, Record};

impl Network {
    /// Ids of the atoms that owned atoms are bonded to or touch, and that are neither owned nor ghosts, ascending. They are too far away,
    /// or no longer exist.
    pub fn absent(&self, atoms: &Atoms<'_>) -> Vec<Tag> {
        let in_group = |(tag, mask): (Tag, &i32)| (mask & atoms.group != 0).then_some(tag);
        let present: HashSet<Tag> = atoms.tag.iter().zip(atoms.mask).filter_map(in_group).collect();
        let owned: HashSet<Tag> = atoms.tag.iter().zip(atoms.mask).take(atoms.owned).filter_map(in_group).collect();
        let mut absent = Vec::new();
        let mut check = |tags: [Tag; 2]| {
            for [here, there] in [tags, [tags[1], tags[0]]] {
                if owned.contains(&here) && !present.contains(&there) {
                    absent.push(there);
                }
            }
        };
        for (_, block) in blocks(&self.state) {
            block.pairs().iter().for_each(|&pair| check(self.tags_of(pair)));
        }
        self.dormant.iter().for_each(|record| check(record.tags));
        for &tag in &owned {
            let reals = self.incoming_of(tag).unwrap_or_default();
            Record::all_compact(reals, self.width).for_each(|(_, head)| check(head.key.1));
        }
        absent.sort_unstable();
        absent.dedup();
        absent
    }

    /// Drop the bonds and contacts of atoms that no longer exist at the next rebuild. Returns the number of bonds between them and an owned
    /// atom that still exists. `gone`: ascending.
    pub fn forget(&mut self, atoms: &Atoms<'_>, gone: &[Tag]) -> usize {
        self.gone = gone.to_vec();
        let owned: HashSet<Tag> = atoms.tag.iter().take(atoms.owned).collect();
        let is_gone = |tag: Tag| gone.binary_search(&tag).is_ok();
        let counts = |[a, b]: [Tag; 2]| owned.contains(&a) && is_gone(b) || owned.contains(&b) && is_gone(a);
        let mut lost = HashSet::new();
        let bonds = self.state.bonds[0].contacts();
        lost.extend(bonds.pairs().iter().map(|&pair| crate::records::ascending(self.tags_of(pair))));
        for &tag in &owned {
            let records = Record::all_compact(self.incoming_of(tag).unwrap_or_default(), self.width);
            lost.extend(records.filter(|(_, head)| head.key.0 == Kind::Bond).map(|(_, head)| head.key.1));
        }
        lost.into_iter().filter(|&tags| counts(tags)).count()
    }

    /// Remove what [`Self::forget`] named from the blocks, whose particles are those `before` the rebuild, and from what `arrives`.
    pub(super) fn drop_gone(&mut self, before: &Before, arriving: &mut Arriving) {
        let gone = std::mem::take(&mut self.gone);
        if gone.is_empty() {
            return;
        }
        let stays = |tags: [Tag; 2]| tags.iter().all(|tag| gone.binary_search(tag).is_err());
        arriving.retain(|_, tags| stays(tags));
        for block in self.state.bonds.iter_mut().chain(&mut self.state.contacts) {
            block.contacts_mut().retain_pairs(&|pair: Pair, _| stays(before.tags_of(pair)));
        }
    }
}
