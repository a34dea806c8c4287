//! Fragments: sets of particles connected by intact bonds.

use crate::state::State;
use crate::state::contacts::ContactFlags;

/// Fragment of each particle, by index: the smallest id of the particles in it. So a fragment keeps its number while
/// parts break off, unless that particle leaves. A particle without bonds is a fragment of its own. Members of a clump
/// are in the same fragment.
pub fn fragments(state: &State) -> Vec<u32> {
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
            if !view.flags.has(ContactFlags::BROKEN) {
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
