//! Pairs that the host takes out of the unbonded contacts: `neigh_modify exclude`, and LAMMPS' lists of special atoms.

use concordem_solver::state::contacts::Pair;
use concordem_solver::{Excluded, Exclusion};

use super::Network;
use crate::atoms::Tag;

/// What the rules of the host say about an atom.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct Rules {
    /// Bits of the rules for two types or groups of which the atom is in the first one.
    pub first: u64,
    /// Of which it is in the second one.
    pub second: u64,
    /// Bits of the rules that exclude pairs within a molecule.
    pub same_molecule: u64,
    /// Bits of those that exclude pairs of two molecules.
    pub other_molecule: u64,
    /// Its molecule.
    pub molecule: i64,
}

/// What the host excludes.
#[derive(Debug, Default)]
pub struct Exclusions {
    /// For each atom of the host, ghosts included; empty without rules.
    pub rules: Vec<Rules>,
    /// Further pairs of atoms; a pair may be given twice.
    pub pairs: Vec<[Tag; 2]>,
}

impl Network {
    /// Set what the next rebuild excludes.
    pub fn exclude(&mut self, exclusions: Exclusions) {
        self.exclusions = exclusions;
    }

    /// The exclusions for the present particles.
    pub(super) fn excluded(&mut self) -> Excluded {
        let Exclusions { rules, pairs } = std::mem::take(&mut self.exclusions);
        let of_particle = |&i: &u32| {
            let Rules { first, second, same_molecule, other_molecule, molecule } = rules[i as usize];
            Exclusion { first, second, same_molecule, other_molecule, molecule }
        };
        let of_particles = if rules.is_empty() { Vec::new() } else { self.atom.iter().map(of_particle).collect() };
        let pair = |tags: &[Tag; 2]| {
            let [Some(a), Some(b)] = tags.map(|tag| self.particle(tag)) else { return None };
            Some(Pair { a: a.min(b) as u32, b: a.max(b) as u32 })
        };
        let pairs = pairs.iter().filter_map(pair).collect();
        Excluded::new(of_particles, pairs)
    }

    /// Drop contacts of pairs that the host excludes or that have just been `bonded`: the bond replaces the contact.
    pub(super) fn drop_contacts(&mut self, excluded: &Excluded, bonded: &[Pair]) {
        if excluded.is_empty() && bonded.is_empty() {
            return;
        }
        let mut bonded = bonded.to_vec();
        bonded.sort_unstable();
        if let Some(contacts) = &mut self.state.contacts {
            contacts
                .contacts_mut()
                .retain_pairs(&|pair, _| !excluded.has(pair) && bonded.binary_search(&pair).is_err());
        }
    }
}
