//! Lists of the host: bonds that other commands add to or remove from the atoms' lists, and neighbor lists of pair styles, which
//! must not compute forces that the network computes.

use concordem_contact::law::ContactLawName;

use super::Network;
use super::exchange::adjacency;
use super::rebuild::ABSENT;
use crate::atoms::Atoms;
use crate::records::{Kind, Record};

/// Neighbor lists of a pair style of the host.
pub struct NeighborLists<'a> {
    /// Atoms that have a list, and their neighbors.
    pub lists: Vec<(usize, &'a [i32])>,
    /// Bits of an entry that are the neighbor's index.
    pub index_bits: i32,
    /// Factors on the forces of a pair by its two upper bits: LAMMPS' weights of special bonds.
    pub weights: [f64; 4],
}

/// One end of a bond as a number, such that sums over different sets of ends differ (the finalizer of splitmix64).
fn scrambled([tag, partner]: [i32; 2]) -> u64 {
    let mut z = (u64::from(tag as u32) << 32 | u64::from(partner as u32)).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Network {
    /// Compare the bonds with the host's lists at the next rebuild. `ends`: the listed bonds of owned atoms: owned atom, partner, bond
    /// type.
    pub fn follow(&mut self, ends: &[[i32; 3]]) {
        self.listed = Some(ends.to_vec());
    }

    /// Remove bonds that are no longer in the host's lists from `records`, and remember those that are new. Particles must be placed;
    /// `ends` are those of the records. Returns whether records were removed.
    pub(super) fn follow_lists(&mut self, records: &mut Vec<Record>, ends: &[[u32; 2]]) -> bool {
        let Some(of_atoms) = self.listed.take() else { return false };
        let owns = |p: u32| p != ABSENT && self.owned[p as usize];
        // Usually nothing has changed. Sums decide that without sorting.
        let mut difference = of_atoms.iter().fold(0, |sum: u64, &[a, b, _]| sum.wrapping_add(scrambled([a, b])));
        for (record, particles) in records.iter().zip(ends).filter(|(record, _)| record.kind == Kind::Bond) {
            let [a, b] = record.tags;
            for (end, _) in [[a, b], [b, a]].into_iter().zip(particles).filter(|(_, p)| owns(**p)) {
                difference = difference.wrapping_sub(scrambled(end));
            }
        }
        if difference == 0 {
            return false;
        }
        let before = records.len();
        let mut of_record = ends.iter();
        let mut listed: Vec<[i32; 3]> = of_atoms.iter().map(|&[a, b, kind]| [a.min(b), a.max(b), kind]).collect();
        listed.sort_unstable();
        listed.dedup();
        records.retain(|record| {
            let is_owned = of_record.next().is_some_and(|particles| particles.iter().any(|&p| owns(p)));
            record.kind != Kind::Bond
                || !is_owned
                || listed.binary_search_by_key(&record.tags, |l| [l[0], l[1]]).is_ok()
        });
        // Bonds come first in the records, sorted by ids.
        let bonds = records.partition_point(|record| record.kind == Kind::Bond);
        let is_new = |l: &[i32; 3]| records[..bonds].binary_search_by_key(&[l[0], l[1]], |record| record.tags).is_err();
        self.added = listed.into_iter().filter(is_new).collect();
        records.len() < before
    }

    /// Queue the bonds that another command added to the host's lists for the next rebuild. Returns their number.
    pub fn make_added(&mut self) -> usize {
        let added = std::mem::take(&mut self.added);
        self.make_given(&added);
        added.len()
    }

    /// A number that increases whenever the bonds or the numbers of atoms change.
    pub fn generation(&self) -> i64 {
        self.generation
    }

    /// Find the pairs of a pair style whose forces the network computes: with a contact law all pairs of the group, else the bonded
    /// ones. Sets `marks` (one per entry, in order) to 1 for them unless it is empty. Returns their number and the ids of the first one.
    pub fn own_pairs(&mut self, atoms: &Atoms<'_>, lists: &NeighborLists<'_>, marks: &mut [u8]) -> (usize, [i32; 2]) {
        if self.particle_of.len() != atoms.tag.len() {
            let particle = |(&tag, mask): (&i32, &i32)| {
                let found = (mask & atoms.group != 0).then(|| self.tags.binary_search(&tag).ok()).flatten();
                found.map_or(ABSENT, |p| p as u32)
            };
            self.particle_of = atoms.tag.iter().zip(atoms.mask).map(particle).collect();
        }
        let all = self.options.contact != ContactLawName::NONE;
        let (start, contacts) = self.adjacency.get_or_insert_with(|| adjacency(&self.state));
        let bonds = self.state.bonds[0].contacts();
        // Atom whose bonds were marked last, by particle.
        let mut bonded_to = vec![ABSENT; if all { 0 } else { self.tags.len() }];
        let (mut count, mut first, mut entry) = (0, [0; 2], 0);
        for &(i, neighbors) in &lists.lists {
            let p = self.particle_of[i];
            if p != ABSENT && !all {
                for &(kind, k) in &contacts[start[p as usize] as usize..start[p as usize + 1] as usize] {
                    if kind == Kind::Bond {
                        let pair = bonds.view(k as usize).pair;
                        bonded_to[(if pair.a == p { pair.b } else { pair.a }) as usize] = p;
                    }
                }
            }
            for &neighbor in neighbors {
                let j = (neighbor & lists.index_bits) as usize;
                let q = self.particle_of[j];
                let acts = lists.weights[(neighbor >> 30 & 3) as usize] != 0.0;
                if acts && p != ABSENT && q != ABSENT && (all || bonded_to[q as usize] == p) {
                    if count == 0 {
                        first = [atoms.tag[i], atoms.tag[j]];
                    }
                    count += 1;
                    if let Some(mark) = marks.get_mut(entry) {
                        *mark = 1;
                    }
                }
                entry += 1;
            }
        }
        (count, first)
    }

    /// Ids of atoms with a queued bond, sorted.
    pub fn queued_atoms(&self) -> Vec<i32> {
        let mut tags: Vec<i32> = self.fresh.iter().flat_map(|record| record.tags).collect();
        tags.sort_unstable();
        tags.dedup();
        tags
    }
}
