//! `limit N`: which of the pairs that are close enough are bonded, if an atom may have N bonds.
//!
//! Pairs are taken in ascending order of their distance over the sum of their radii, and bonded unless one of the two atoms is full. No process
//! knows all pairs. So each names, for each of its atoms, the partner in the first pair that is not decided; two atoms that name each other are
//! bonded, and an atom that names nobody takes no more. The first undecided pair of all is among those decided, and the result is that of the order,
//! on any number of processes.

use concordem_solver::state::contacts::Pair;

use super::Network;
use super::bonds::Fresh;
use crate::atoms::Tag;
use crate::records::ascending;

/// Pairs that are close enough, in their order, and how many more bonds each particle may have.
#[derive(Default)]
pub(super) struct Choice {
    undecided: Vec<Candidate>,
    left: Vec<u32>,
}

struct Candidate {
    ends: [u32; 2],
    tags: [Tag; 2],
    /// Distance over the sum of the radii, then a number of the ids, so that equal distances, as in lattices, do not wait for each other in a row.
    order: (f64, u64),
}

/// A number that looks random: splitmix64.
fn scrambled(tags: [Tag; 2]) -> u64 {
    let [a, b] = tags.map(|tag| tag as u64);
    let mut z = a.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(b);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

impl Network {
    /// Begin to choose among `pairs`, given with their distance over the sum of the radii. `limits`: bonds per atom by type.
    pub(super) fn begin_choice(&mut self, limits: &[u32], pairs: impl Iterator<Item = (Pair, f64)>) {
        let mut left: Vec<u32> = self.state.particles.material.iter().map(|kind| limits[usize::from(*kind)]).collect();
        for pair in self.state.bonds[0].contacts().pairs() {
            for end in [pair.a, pair.b] {
                left[end as usize] = left[end as usize].saturating_sub(1);
            }
        }
        let candidate = |(pair, ratio): (Pair, f64)| {
            let tags = ascending([pair.a, pair.b].map(|end| self.tags[end as usize]));
            Candidate { ends: [pair.a, pair.b], tags, order: (ratio, scrambled(tags)) }
        };
        let mut undecided: Vec<Candidate> = pairs.map(candidate).collect();
        undecided.sort_unstable_by(|one, other| {
            let [(ratio, number), (of_other, number_of_other)] = [one.order, other.order];
            ratio.total_cmp(&of_other).then(number.cmp(&number_of_other)).then(one.tags.cmp(&other.tags))
        });
        self.choice = Choice { undecided, left };
    }

    /// Set, for each of the host's atoms that this processor owns, the id of the partner in its first undecided pair; 0: it takes no more. Returns
    /// the number of undecided pairs that this processor knows.
    pub fn name_partners(&self, named: &mut [f64]) -> usize {
        named.fill(0.0);
        for candidate in &self.choice.undecided {
            for (mine, other) in [(0, 1), (1, 0)] {
                let particle = candidate.ends[mine] as usize;
                let name = &mut named[self.atom[particle] as usize];
                if self.owned[particle] && self.choice.left[particle] > 0 && *name == 0.0 {
                    // Exact: ids are below 2^53.
                    *name = self.tags[candidate.ends[other] as usize] as f64;
                }
            }
        }
        self.choice.undecided.len()
    }

    /// Queue bonds between atoms that name each other, and drop the pairs of those that name nobody. `named`: of owned atoms and ghosts.
    pub fn bond_named(&mut self, named: &[f64]) {
        let Self { choice, fresh, atom, tags, .. } = self;
        let Choice { undecided, left } = choice;
        undecided.retain(|candidate| {
            let [a, b] = candidate.ends.map(|end| end as usize);
            let [of_a, of_b] = [a, b].map(|end| named[atom[end] as usize]);
            let bonded = of_a == tags[b] as f64 && of_b == tags[a] as f64;
            if bonded {
                fresh.push(Fresh { tags: candidate.tags, length: 0.0, row: 0 });
                for end in [a, b] {
                    left[end] = left[end].saturating_sub(1);
                }
            }
            !bonded && of_a != 0.0 && of_b != 0.0
        });
    }
}
