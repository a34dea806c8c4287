//! Bonds as the host lists them, and bonds that the next rebuild creates.

use crate::atoms::{Tag, Tags};

/// The bonds in the host's list of an owned atom.
pub struct BondsOfAtom<'a> {
    /// Id of the atom.
    pub tag: Tag,
    /// Ids of its partners.
    pub partners: Tags<'a>,
    /// Types of the bonds; one that is not positive does not count.
    pub types: &'a [i32],
}

/// Ends of listed bonds: owned atom, partner, bond type.
pub(super) fn ends<'a>(lists: &'a [BondsOfAtom<'_>]) -> impl Iterator<Item = [Tag; 3]> + 'a {
    lists.iter().flat_map(|atom| {
        let bonds = atom.partners.iter().zip(atom.types).filter(|(_, bond_type)| **bond_type > 0);
        bonds.map(|(partner, &bond_type)| [atom.tag, partner, Tag::from(bond_type)])
    })
}

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
