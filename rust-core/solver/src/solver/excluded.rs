//! Pairs that a host takes out of the unbonded contacts.

use crate::state::contacts::Pair;

/// What the host's exclusions say about a particle: one bit per rule.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Exclusion {
    /// Rules that exclude the particle from contacts with those that have the same bit in `second`.
    pub first: u64,
    /// See `first`.
    pub second: u64,
    /// Rules that exclude contacts within a molecule.
    pub same_molecule: u64,
    /// Rules that exclude contacts between molecules.
    pub other_molecule: u64,
    /// Its molecule.
    pub molecule: i64,
}

/// Pairs without unbonded contacts, by rules and by name. Bonds do not depend on them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Excluded {
    /// Per particle; empty without rules.
    rules: Vec<Exclusion>,
    /// Further pairs, ascending.
    pairs: Vec<Pair>,
}

impl Excluded {
    /// `rules`: one per particle, or none. `pairs` in any order.
    pub fn new(rules: Vec<Exclusion>, mut pairs: Vec<Pair>) -> Self {
        pairs.sort_unstable();
        pairs.dedup();
        Self { rules, pairs }
    }

    /// Whether nothing is excluded.
    pub fn is_empty(&self) -> bool {
        self.rules.is_empty() && self.pairs.is_empty()
    }

    /// Whether the pair has no unbonded contact.
    pub fn has(&self, pair: Pair) -> bool {
        let by_rule = |a: &Exclusion, b: &Exclusion| {
            let molecules = if a.molecule == b.molecule {
                a.same_molecule & b.same_molecule
            } else {
                a.other_molecule & b.other_molecule
            };
            a.first & b.second | a.second & b.first | molecules != 0
        };
        let ruled = match (self.rules.get(pair.a as usize), self.rules.get(pair.b as usize)) {
            (Some(a), Some(b)) => by_rule(a, b),
            _ => false,
        };
        ruled || !self.pairs.is_empty() && self.pairs.binary_search(&pair).is_ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rules_and_pairs_exclude() {
        let first = Exclusion { first: 2, ..Exclusion::default() };
        let second = Exclusion { second: 2, ..Exclusion::default() };
        let within = Exclusion { same_molecule: 1, other_molecule: 2, molecule: 7, ..Exclusion::default() };
        let elsewhere = Exclusion { molecule: 8, ..within };
        let outside = Exclusion { other_molecule: 0, ..elsewhere };
        let rules = vec![first, second, within, within, elsewhere, outside];
        let excluded = Excluded::new(rules, vec![Pair { a: 1, b: 2 }, Pair { a: 0, b: 5 }]);
        let mut found = Vec::new();
        for a in 0..6 {
            found.extend((a + 1..6).filter(|&b| excluded.has(Pair { a, b })).map(|b| (a, b)));
        }
        // First with second; named; one molecule; two molecules; named. Particles 4 and 5 share a molecule.
        assert_eq!(found, [(0, 1), (0, 5), (1, 2), (2, 3), (2, 4), (3, 4), (4, 5)]);
        assert!(!excluded.is_empty() && Excluded::default().is_empty());
        assert!(!Excluded::default().has(Pair { a: 0, b: 1 }));
    }
}
