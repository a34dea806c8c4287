//! Lists of the host: bonds that other commands add to or remove from the atoms' lists, and neighbor lists of pair styles, which
//! must not compute forces that the network computes.

use concordem_contact::law::ContactLawName;
use concordem_solver::state::contacts::Pair;

use super::before::{ABSENT, Before};
use super::bonds::{BondsOfAtom, Fresh, ends};
use super::exchange::{Arriving, adjacency};
use super::{Network, NetworkError, particle_of};
use crate::atoms::{Atoms, Tag};
use crate::records::{Kind, ascending};

/// Neighbor lists of a pair style of the host.
pub struct NeighborLists<'a> {
    /// Atoms that have a list, and their neighbors.
    pub lists: Vec<(usize, &'a [i32])>,
    /// Bits of an entry that are the neighbor's index.
    pub index_bits: i32,
    /// Factors on the forces of a pair by its two upper bits: LAMMPS' weights of special bonds.
    pub weights: [f64; 4],
}

/// One end of a bond with coefficients `row` as a number, such that sums over different sets of ends differ (the finalizer of splitmix64).
fn scrambled([tag, partner]: [Tag; 2], row: u16) -> u64 {
    let mut z = (tag as u64).rotate_left(32).wrapping_add(partner as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z ^= u64::from(row).wrapping_mul(0xd6e8_feb8_6659_fd93);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Network {
    /// Remove bonds that are no longer in the host's `lists`, and remember those that are new. Particles must be placed. `before`: the
    /// particles that the blocks refer to, `number`: their present numbers; `arriving` and `fresh` are sorted.
    ///
    /// # Errors
    /// The type of a bond has changed, and with it the parameters.
    pub(super) fn follow_lists(
        &mut self,
        lists: &[BondsOfAtom<'_>],
        before: &Before,
        number: &[u32],
        arriving: &mut Arriving,
        fresh: &mut Vec<Fresh>,
    ) -> Result<(), NetworkError> {
        // If parameters do not belong to bond types, types have no effect, and rows follow from the atoms.
        let by_type = !self.options.bond_types.is_empty();
        let row_by_type = |row: u16| if by_type { row } else { 0 };
        let (tags, by_tag, owned) = (&self.tags, &self.by_tag, &self.owned);
        let owns = |tag: Tag| particle_of(tags, by_tag, tag).is_some_and(|p| owned[p]);
        let owns_old = |p: u32| number[p as usize] != ABSENT && owned[number[p as usize] as usize];
        let bonds = self.state.bonds[0].contacts();
        // Usually nothing has changed. Sums decide that without sorting.
        let mut difference = ends(lists)
            .fold(0, |sum: u64, [a, b, bond_type]| sum.wrapping_add(scrambled([a, b], self.row_of_type(bond_type))));
        for (&pair, flags) in bonds.pairs().iter().zip(bonds.flags()) {
            let [a, b] = before.tags_of(pair);
            for (end, _) in [([a, b], pair.a), ([b, a], pair.b)].iter().filter(|(_, p)| owns_old(*p)) {
                difference = difference.wrapping_sub(scrambled(*end, row_by_type(flags.row)));
            }
        }
        // An arriving bond may be held already, because its other atom is here.
        let held =
            |pairs: &[Pair], tags: [Tag; 2]| before.pair(tags).is_some_and(|pair| pairs.binary_search(&pair).is_ok());
        let new_here = arriving.bonds().filter(|record| !held(bonds.pairs(), record.tags));
        let new_here = new_here.map(|record| (record.tags, record.row));
        for ([a, b], row) in new_here.chain(fresh.iter().map(|bond| (bond.tags, bond.row))) {
            for end in [[a, b], [b, a]].into_iter().filter(|end| owns(end[0])) {
                difference = difference.wrapping_sub(scrambled(end, row_by_type(row)));
            }
        }
        if difference == 0 {
            return Ok(());
        }
        let mut listed: Vec<[Tag; 3]> = ends(lists)
            .map(|[a, b, kind]| {
                let [a, b] = ascending([a, b]);
                [a, b, kind]
            })
            .collect();
        listed.sort_unstable();
        listed.dedup();
        if by_type {
            // A bond may be listed with two types, one at each end.
            let types_of = |tags: [Tag; 2]| {
                let first = listed.partition_point(|l| [l[0], l[1]] < tags);
                listed[first..].iter().take_while(move |l| [l[0], l[1]] == tags).map(|l| l[2])
            };
            let of_held = bonds.pairs().iter().zip(bonds.flags());
            let of_held = of_held.map(|(&pair, flags)| (ascending(before.tags_of(pair)), flags.row));
            let of_arriving = arriving.bonds().map(|record| (ascending(record.tags), record.row));
            for ([a, b], row) in of_held.chain(of_arriving).chain(fresh.iter().map(|bond| (bond.tags, bond.row))) {
                if let Some(now) = types_of([a, b]).find(|&now| self.row_of_type(now) != row) {
                    let mut types = 1..=self.options.bond_types.len() as Tag;
                    let before = types.find(|&bond_type| self.row_of_type(bond_type) == row).unwrap_or_default();
                    return Err(NetworkError::OtherType { a, b, before, now });
                }
            }
        }
        let is_listed = |tags: [Tag; 2]| listed.binary_search_by_key(&ascending(tags), |l| [l[0], l[1]]).is_ok();
        let bonds = self.state.bonds[0].contacts_mut();
        bonds.retain_pairs(&|pair, _| {
            let is_owned = [pair.a, pair.b].into_iter().any(owns_old);
            !is_owned || is_listed(before.tags_of(pair))
        });
        let stays = |tags: [Tag; 2]| !tags.into_iter().any(owns) || is_listed(tags);
        arriving.retain(|kind, tags| kind != Kind::Bond || stays(tags));
        fresh.retain(|bond| stays(bond.tags));
        let is_new = |l: &[Tag; 3]| {
            let tags = [l[0], l[1]];
            !held(bonds.pairs(), tags)
                && !arriving.has_bond(tags)
                && fresh.binary_search_by_key(&tags, |bond| bond.tags).is_err()
        };
        self.added = listed.iter().filter(|l| is_new(l)).copied().collect();
        Ok(())
    }

    /// Queue the bonds that another command added to the host's lists for the next rebuild. Returns their number.
    pub fn make_added(&mut self) -> usize {
        let added = std::mem::take(&mut self.added);
        self.make_given(added.iter().copied());
        added.len()
    }

    /// A number that increases whenever the bonds or the numbers of atoms change.
    pub fn generation(&self) -> i64 {
        self.generation
    }

    /// Find the pairs of a pair style whose forces the network computes: with a contact law all pairs of the group, else the bonded
    /// ones. Sets `marks` (one per entry, in order) to 1 for them unless it is empty. Returns their number and the ids of the first one.
    pub fn own_pairs(&mut self, atoms: &Atoms<'_>, lists: &NeighborLists<'_>, marks: &mut [u8]) -> (usize, [Tag; 2]) {
        if self.particle_of.len() != atoms.tag.len() {
            let particle = |(tag, mask): (Tag, &i32)| {
                let found = (mask & atoms.group != 0).then(|| self.particle(tag)).flatten();
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
                for link in &contacts[start[p as usize] as usize..start[p as usize + 1] as usize] {
                    if link.kind() == Kind::Bond {
                        let pair = bonds.pairs()[link.index()];
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
                        first = [atoms.tag.get(i), atoms.tag.get(j)];
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
}
