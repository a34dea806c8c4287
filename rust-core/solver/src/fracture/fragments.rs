//! Fragments: sets of particles connected by bonds that have strength.

use crate::state::State;
use crate::state::contacts::{ContactFlags, Contacts};

/// Fragment of each particle, by index: the smallest id of the particles in it. So a fragment keeps its number while
/// parts break off, unless that particle leaves. A particle without bonds is a fragment of its own. A cracked bond that
/// still presses connects nothing. Members of a clump are in the same fragment.
pub fn fragments(state: &State) -> Vec<u32> {
    pieces(state, |block, k| block.lost_strength(k) < 1.0)
}

/// As [`fragments`], but bonds that were made cracked, as those of an open joint, connect as well.
pub fn bonded_pieces(state: &State) -> Vec<u32> {
    pieces(state, |_, _| true)
}

/// Sets of particles that those of the unbroken bonds connect for which `connects` is true.
fn pieces(state: &State, connects: impl Fn(&dyn Contacts, usize) -> bool) -> Vec<u32> {
    let particles = &state.particles;
    let mut parent: Vec<u32> = (0..particles.len() as u32).collect();
    let join = |parent: &mut [u32], a: u32, b: u32| {
        let (a, b) = (root(parent, a), root(parent, b));
        // The root is the particle with the smallest id, whatever the order of the bonds.
        if particles.id[a as usize] < particles.id[b as usize] {
            parent[b as usize] = a;
        } else {
            parent[a as usize] = b;
        }
    };
    for block in &state.bonds {
        for k in 0..block.len() {
            let view = block.view(k);
            if !view.flags.has(ContactFlags::BROKEN) && connects(block.contacts(), k) {
                join(&mut parent, view.pair.a, view.pair.b);
            }
        }
    }
    for clump in &state.clumps {
        for pair in clump.members.windows(2) {
            join(&mut parent, pair[0], pair[1]);
        }
    }
    (0..particles.len() as u32).map(|p| particles.id[root(&mut parent, p) as usize]).collect()
}

/// The representative of the set that `p` belongs to.
fn root(parent: &mut [u32], mut p: u32) -> u32 {
    while parent[p as usize] != p {
        // Path halving.
        parent[p as usize] = parent[parent[p as usize] as usize];
        p = parent[p as usize];
    }
    p
}

/// Number of different fragments.
pub fn count(fragments: &[u32]) -> usize {
    let mut names = fragments.to_vec();
    names.sort_unstable();
    names.dedup();
    names.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::state::contacts::{ContactBlock, Pair};
    use crate::state::{Clump, Particles, Sphere};
    use concordem_contact::kinematics::PreviousGeometry;
    use concordem_contact::law::{LinearBond, Reference};
    use concordem_contact::math::Vec3;

    /// Six particles: 1–2 and 4–5 bonded, the bond 2–3 broken, 0 and 4 in one body. Fragments are {0, 4, 5}, {1, 2}, {3}, each
    /// named by its smallest id; the ids run backwards here.
    #[test]
    fn bodies_and_intact_bonds_join() {
        let mut particles = Particles::default();
        for k in 0..6 {
            particles.push(Sphere { position: Vec3::x() * (2.0 * f64::from(k)), radius: 1.0 }, 0, 1.0, 0.4);
        }
        particles.id = (0..6).map(|k| 105 - k).collect();
        let clump = Clump::new(vec![0, 4], &particles, None, None);
        (particles.clump[0], particles.clump[4]) = (0, 0);
        let mut bonds = ContactBlock::new(vec![LinearBond::new(1.0, 1.0, 0.0, 1.0, 1.0).unwrap()]);
        for (a, b, broken) in [(1, 2, 0), (2, 3, ContactFlags::BROKEN), (4, 5, 0)] {
            let flags =
                ContactFlags { bits: ContactFlags::BONDED | ContactFlags::ACTIVE | broken, ..Default::default() };
            bonds.push(Pair { a, b }, flags, Reference::default(), PreviousGeometry::default());
        }
        let state = State { particles, clumps: vec![clump], bonds: vec![Box::new(bonds)], ..State::default() };
        let found = fragments(&state);
        assert_eq!(found, [100, 103, 103, 102, 100, 100]);
        assert_eq!(count(&found), 3);
    }
}
