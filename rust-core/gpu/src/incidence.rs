//! Contacts of each particle, in the order in which the solver sums their loads.

use concordem_contact::pair::Pair;

/// Contacts of each particle, as [`particle::advance`](crate::particle::advance) reads them.
#[derive(Debug, Clone)]
pub struct Incidence {
    start: Vec<u32>,
    entries: Vec<u32>,
}

impl Incidence {
    /// Incidence of the contacts of all blocks, one block after another, each sorted by A, for tiles of `tile` particles.
    ///
    /// The solver adds the loads of the contacts whose A lies in the particle's own tile first, block by block, then those of other
    /// tiles.
    pub fn new(pairs: &[Pair], particles: usize, tile: usize) -> Self {
        let tile_of = |p: u32| p as usize / tile;
        let mut start = vec![0u32; particles + 1];
        for p in pairs.iter().flat_map(|pair| [pair.a, pair.b]) {
            start[p as usize + 1] += 1;
        }
        for p in 0..particles {
            start[p + 1] += start[p];
        }
        let mut next = start.clone();
        let mut entries = vec![0; 2 * pairs.len()];
        let mut add = |p: u32, entry: usize| {
            let place = &mut next[p as usize];
            entries[*place as usize] = entry as u32;
            *place += 1;
        };
        for (k, &Pair { a, b }) in pairs.iter().enumerate() {
            add(a, 2 * k);
            if tile_of(a) == tile_of(b) {
                add(b, 2 * k + 1);
            }
        }
        for (k, &Pair { a, b }) in pairs.iter().enumerate() {
            if tile_of(a) != tile_of(b) {
                add(b, 2 * k + 1);
            }
        }
        Self { start, entries }
    }

    /// Entries of particle `p`.
    pub fn of(&self, p: usize) -> &[u32] {
        &self.entries[self.start[p] as usize..self.start[p + 1] as usize]
    }

    /// Entries of all particles.
    pub fn entries(&self) -> &[u32] {
        &self.entries
    }

    /// First entry of each particle, then the number of entries.
    pub fn starts(&self) -> &[u32] {
        &self.start
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Particle 2 of the second tile: its own bond first, then those of the first tile, each ascending.
    #[test]
    fn own_tile_comes_first() {
        let pairs = [[0, 1], [0, 2], [1, 2], [2, 3]].map(|[a, b]| Pair { a, b });
        let incidence = Incidence::new(&pairs, 4, 2);
        assert_eq!(incidence.of(0), [0, 2]);
        assert_eq!(incidence.of(1), [1, 4]);
        assert_eq!(incidence.of(2), [6, 3, 5]);
        assert_eq!(incidence.of(3), [7]);
        assert_eq!(incidence.starts(), [0, 2, 4, 7, 8]);
    }
}
