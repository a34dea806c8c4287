//! New bonds: from the user's list, from the host's lists, or by distance.

use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::math::Vec3;
use concordem_solver::neighbor::{CandidatePair, candidate_pairs};
use concordem_solver::state::contacts::Pair;

use super::bonds::{BondsOfAtom, Fresh, ends};
use super::exchange::Arriving;
use super::{Network, NetworkError};
use crate::atoms::Tag;
use crate::bond_list::{BondOfList, read_bonds};
use crate::options::{Creation, OptionError};
use crate::pieces::{PieceReader, check_once, given_twice, sort_entries};
use crate::records::ascending;

/// The user's list of bonds on one processor.
#[derive(Default)]
pub(super) struct UserList {
    /// While this processor reads the file.
    reader: Option<PieceReader>,
    /// What this processor keeps.
    share: Vec<BondOfList>,
}

impl Network {
    /// Read the next bonds of the user's list, on one processor. Returns their number; 0: it has ended.
    ///
    /// # Errors
    /// It cannot be read, or a line is wrong.
    pub fn read_bond_list(&mut self, bonds: &mut [BondOfList]) -> Result<usize, OptionError> {
        let Creation::List(path) = &self.options.creation else { return Ok(0) };
        let reader = match &mut self.user_list.reader {
            Some(reader) => reader,
            none => none.insert(PieceReader::open(path)?),
        };
        let count = read_bonds(reader, bonds);
        // Nobody reads on after the end or an error.
        if !matches!(count, Ok(1..)) {
            self.user_list.reader = None;
        }
        count
    }

    /// Keep bonds of the user's list on this processor.
    pub fn keep_listed(&mut self, bonds: &[BondOfList]) {
        self.user_list.share.extend_from_slice(bonds);
    }

    /// All bonds of the user's list that this processor keeps are here.
    ///
    /// # Errors
    /// Two lines have the same bond: the lowest second one, and the message.
    pub fn sort_listed(&mut self) -> Result<(), (i64, OptionError)> {
        let share = &mut self.user_list.share;
        // No more will come.
        share.shrink_to_fit();
        sort_entries(share);
        let Creation::List(path) = &self.options.creation else { return Ok(()) };
        check_once(given_twice(share), path)
    }

    /// The bonds of the user's list that this processor keeps.
    pub fn listed(&self) -> &[BondOfList] {
        &self.user_list.share
    }

    /// Queue bonds of the user's list for the next rebuild, and forget those that this processor kept. Every processor must call this.
    pub fn make_listed(&mut self, bonds: &[BondOfList]) {
        self.fresh.extend(bonds.iter().map(|bond| Fresh { tags: bond.ids, length: bond.length, row: 0 }));
        self.user_list.share = Vec::new();
    }

    /// Queue the bonds of the host's lists for the next rebuild.
    pub fn make_of_lists(&mut self, lists: &[BondsOfAtom<'_>]) {
        self.fresh.reserve_exact(lists.iter().map(|atom| atom.partners.len()).sum());
        self.make_given(ends(lists));
    }

    /// Queue bonds (two ids and the bond type) for the next rebuild. A bond may be given on any processor, also on several.
    pub(super) fn make_given(&mut self, bonds: impl Iterator<Item = [Tag; 3]>) {
        for [a, b, bond_type] in bonds {
            let row = self.row_of_type(bond_type);
            self.fresh.push(Fresh { tags: ascending([a, b]), length: 0.0, row });
        }
    }

    /// Row of the pair coefficients of a bond type; 0 if parameters do not belong to bond types. Each type has its own row.
    pub(super) fn row_of_type(&self, bond_type: Tag) -> u16 {
        if self.options.bond_types.is_empty() {
            return 0;
        }
        let kind = (bond_type - 1) as u16;
        // A type without parameters does not exist: the bond style requires them for all.
        self.bond_coefficients.get(kind, kind).unwrap_or_default()
    }

    /// Queue bonds between all unbonded pairs of the group that are closer than the user's factor times the sum of their radii; with
    /// `limit`, begin to choose among these pairs ([`Self::name_partners`]). Call [`Self::rebuild`] afterwards.
    ///
    /// # Errors
    /// The neighbor search fails.
    pub fn make_near(&mut self) -> Result<(), NetworkError> {
        let Creation::Distance(factor) = self.options.creation else { return Ok(()) };
        let particles = &self.state.particles;
        // Search slightly farther: rounding in the search depends on the other atoms of this processor and must not affect the result.
        let reach: Vec<f64> = particles.radius.iter().map(|r| r * factor * (1.0 + 1e-9)).collect();
        let between = self.options.between.as_deref();
        let present = self.state.bonds[0].contacts().pairs();
        let distance = |pair: &CandidatePair| {
            let shift = self.state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
            let [a, b] = [pair.a, pair.b].map(|end| &particles.position[end as usize]);
            initial_geometry(a, b, &shift).length
        };
        let sum_of_radii = |pair: &CandidatePair| particles.radius[pair.a as usize] + particles.radius[pair.b as usize];
        let mut pairs = candidate_pairs(&particles.position, &reach, self.state.cell.as_ref())?;
        pairs.retain(|pair| {
            let (a, b) = (pair.a as usize, pair.b as usize);
            distance(pair) < factor * sum_of_radii(pair)
                && (self.owned[a] || self.owned[b])
                && between.is_none_or(|types| {
                    let [a, b] = [particles.material[a], particles.material[b]];
                    types.contains(&[a.min(b), a.max(b)])
                })
                && self.bond_coefficients.get(particles.material[a], particles.material[b]).is_some()
                && present.binary_search(&Pair { a: pair.a, b: pair.b }).is_err()
        });
        if let Some(limits) = self.options.limit.clone() {
            let chosen: Vec<_> =
                pairs.iter().map(|pair| (Pair { a: pair.a, b: pair.b }, distance(pair) / sum_of_radii(pair))).collect();
            self.begin_choice(&limits, chosen.into_iter());
            return Ok(());
        }
        self.fresh.reserve_exact(pairs.len());
        self.fresh.extend(pairs.iter().map(|pair| {
            let tags = [self.tags[pair.a as usize], self.tags[pair.b as usize]];
            Fresh { tags: ascending(tags), length: 0.0, row: 0 }
        }));
        Ok(())
    }

    /// Queue bonds between atoms of the same clump that are closer than the user's factor times the sum of their radii. `clump`: a number per atom of
    /// the host, equal within a clump, 0 outside. Returns the number of bonds. Call [`Self::rebuild`] afterwards.
    ///
    /// # Errors
    /// The neighbor search fails.
    pub fn make_clumps(&mut self, clump: &[f64]) -> Result<usize, NetworkError> {
        let Creation::Clumps(factor) = self.options.creation else { return Ok(0) };
        let particles = &self.state.particles;
        let number = |p: usize| clump[self.atom[p] as usize];
        let members: Vec<usize> = (0..self.atom.len()).filter(|&p| number(p) != 0.0).collect();
        let position: Vec<Vec3> = members.iter().map(|&p| particles.position[p]).collect();
        // As in `make_near`.
        let reach: Vec<f64> = members.iter().map(|&p| particles.radius[p] * factor * (1.0 + 1e-9)).collect();
        let before = self.fresh.len();
        for pair in candidate_pairs(&position, &reach, self.state.cell.as_ref())? {
            let [a, b] = [members[pair.a as usize], members[pair.b as usize]];
            let [one, other] = [a, b].map(|p| particles.material[p]);
            let shift = self.state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
            let distance = initial_geometry(&particles.position[a], &particles.position[b], &shift).length;
            let joins = number(a) == number(b) && distance < factor * (particles.radius[a] + particles.radius[b]);
            let known = self.bond_coefficients.get(one, other).is_some();
            if joins && known && (self.owned[a] || self.owned[b]) {
                self.fresh.push(Fresh { tags: ascending([self.tags[a], self.tags[b]]), length: 0.0, row: 0 });
            }
        }
        Ok(self.fresh.len() - before)
    }

    /// Take the queued bonds, without duplicates, sorted by ids. `arriving`: records of this rebuild.
    ///
    /// # Errors
    /// A bond is queued in two ways, or has arrived with an atom.
    pub(super) fn take_fresh(&mut self, arriving: &Arriving) -> Result<Vec<Fresh>, NetworkError> {
        let mut fresh = std::mem::take(&mut self.fresh);
        fresh.sort_unstable_by_key(|bond| bond.tags);
        let differ = |pair: &&[Fresh]| pair[0].tags == pair[1].tags && pair[0] != pair[1];
        let arrived = |bond: &&Fresh| arriving.has_bond(bond.tags);
        let twice = fresh.windows(2).find(differ).map(|pair| pair[0]);
        if let Some(Fresh { tags: [a, b], .. }) = twice.or_else(|| fresh.iter().find(arrived).copied()) {
            return Err(NetworkError::CopiesDiffer { a, b });
        }
        fresh.dedup_by_key(|bond| bond.tags);
        Ok(fresh)
    }

    /// Ids of atoms with a queued bond, sorted.
    pub fn queued_atoms(&self) -> Vec<Tag> {
        let mut tags: Vec<Tag> = self.fresh.iter().flat_map(|bond| bond.tags).collect();
        tags.sort_unstable();
        tags.dedup();
        tags
    }
}
