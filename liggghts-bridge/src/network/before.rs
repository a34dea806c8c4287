//! The particles of a processor before a rebuild.

use concordem_solver::state::contacts::Pair;

use super::particle_of;
use crate::atoms::Tag;

/// Stands for the particle of an atom that is neither owned nor a ghost.
pub(super) const ABSENT: u32 = u32::MAX;

/// The particles before a rebuild.
pub(super) struct Before {
    /// Their ids.
    pub(super) tags: Vec<Tag>,
    /// The particles in the order of their ids.
    pub(super) by_tag: Vec<u32>,
}

impl Before {
    /// Ids of a contact's atoms.
    pub(super) fn tags_of(&self, pair: Pair) -> [Tag; 2] {
        [pair.a, pair.b].map(|p| self.tags[p as usize])
    }

    /// The pair of two atoms; `None` if one of them was not here.
    pub(super) fn pair(&self, tags: [Tag; 2]) -> Option<Pair> {
        let [Some(p), Some(q)] = tags.map(|tag| particle_of(&self.tags, &self.by_tag, tag)) else { return None };
        Some(Pair { a: p.min(q) as u32, b: p.max(q) as u32 })
    }

    /// Present number of each particle, [`ABSENT`] if it is gone. `tags`, `by_tag`: the present particles.
    pub(super) fn renumbering(&self, tags: &[Tag], by_tag: &[u32]) -> Vec<u32> {
        let mut numbers = vec![ABSENT; self.tags.len()];
        let mut after = by_tag.iter().peekable();
        for &p in &self.by_tag {
            let tag = self.tags[p as usize];
            while after.next_if(|&&q| tags[q as usize] < tag).is_some() {}
            if let Some(&q) = after.next_if(|&&q| tags[q as usize] == tag) {
                numbers[p as usize] = q;
            }
        }
        numbers
    }
}
