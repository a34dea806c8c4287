//! New bonds: from the user's list, from the host's lists, or by distance.

use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::math::Vec3;
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::contacts::Pair;

use super::exchange::Arriving;
use super::{Network, NetworkError};
use crate::atoms::Tag;
use crate::options::{Creation, Listed};
use crate::records::ascending;

/// A bond that the next rebuild creates and measures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Fresh {
    /// Ids, the lower one first.
    pub(super) tags: [Tag; 2],
    /// Reference length, m; 0: the current distance.
    pub(super) length: f64,
    /// Row of the pair coefficients, if parameters belong to bond types.
    pub(super) row: u16,
}

impl Network {
    /// Queue bonds of the user's list for the next rebuild, and forget those that this processor kept. Every processor must call this.
    pub fn make_listed(&mut self, bonds: impl Iterator<Item = Listed>) {
        self.fresh.extend(bonds.map(|(tags, length)| Fresh {
            tags: ascending(tags),
            length: length.unwrap_or(0.0),
            row: 0,
        }));
        if let Creation::List(kept) = &mut self.options.creation {
            *kept = Vec::new();
        }
    }

    /// Queue bonds from the host's lists (two ids and the bond type) for the next rebuild. A bond may be given on any processor, also on
    /// several.
    pub fn make_given(&mut self, bonds: &[[Tag; 3]]) {
        self.fresh.reserve_exact(bonds.len());
        for &[a, b, bond_type] in bonds {
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

    /// Queue bonds between all unbonded pairs of the group that are closer than the user's factor times the sum of their radii. Call
    /// [`Self::rebuild`] afterwards. Returns the number of bonds that this processor counts.
    ///
    /// # Errors
    /// The neighbor search fails.
    pub fn make_near(&mut self) -> Result<usize, NetworkError> {
        let Creation::Distance(factor) = self.options.creation else { return Ok(0) };
        let particles = &self.state.particles;
        // Search slightly farther: rounding in the search depends on the other atoms of this processor and must not affect the result.
        let reach: Vec<f64> = particles.radius.iter().map(|r| r * factor * (1.0 + 1e-9)).collect();
        let present = self.state.bonds[0].contacts().pairs();
        let mut pairs = candidate_pairs(&particles.position, &reach, self.state.cell.as_ref())?;
        pairs.retain(|pair| {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let shift = self.state.cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
            let distance = initial_geometry(&particles.position[a], &particles.position[b], &shift).length;
            distance < factor * (particles.radius[a] + particles.radius[b])
                && (self.owned[a] || self.owned[b])
                && self.bond_coefficients.get(particles.material[a], particles.material[b]).is_some()
                && present.binary_search(&Pair { a: pair.a, b: pair.b }).is_err()
        });
        self.fresh.reserve_exact(pairs.len());
        self.fresh.extend(pairs.iter().map(|pair| {
            let tags = [self.tags[pair.a as usize], self.tags[pair.b as usize]];
            Fresh { tags: ascending(tags), length: 0.0, row: 0 }
        }));
        Ok(pairs.iter().filter(|pair| self.owned[pair.a as usize]).count())
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
