//! Division of a block of contacts into tiles, and the halo between them.

use concordem_contact::kinematics::deformable::ParticleVirial;
use concordem_contact::prefetch::prefetch_row;
use concordem_contact::wrench::Wrench;
use rayon::prelude::*;

use crate::state::Particles;
use crate::state::contacts::{Contacts, Pair};
use crate::strengths::Strengths;

/// Particles per tile. The solver of a subdomain has a single tile instead
/// ([`Solver::for_subdomain`](crate::Solver::for_subdomain)).
pub const TILE: usize = 1024;

/// Division of one block of contacts into tiles, and the halo slots of each tile. Scratch: rebuilt whenever the list of
/// contacts changes.
#[derive(Debug, Clone, Default)]
pub struct TileMap {
    /// Particles per tile.
    pub(crate) tile_length: usize,
    /// First contact of each tile, then the number of contacts.
    pub(crate) contact_start: Vec<u32>,
    /// First halo slot of each tile, then the number of slots.
    pub(crate) halo_start: Vec<u32>,
    /// First entry of each particle in `slots`, then the number of entries.
    target_start: Vec<u32>,
    /// Halo slots by target particle, ascending.
    slots: Vec<u32>,
    /// Force and torque in each halo slot.
    pub(crate) halo: Vec<Wrench>,
    /// Particle virial in each halo slot; empty if particles are rigid.
    pub(crate) virial_halo: Vec<ParticleVirial>,
    /// Factors on the strengths of the contacts; empty if they do not scatter.
    pub(crate) strength: Vec<f64>,
    /// The contacts of [`Self::strength`].
    scattered: Vec<Pair>,
}

impl TileMap {
    /// Map of a block sorted by A, for tiles of `tile_length` particles.
    pub fn new(block: &dyn Contacts, particle_count: usize, tile_length: usize) -> Self {
        let mut map = Self::default();
        map.rebuild(block, particle_count, tile_length);
        map
    }

    /// As [`Self::new`], in the memory of this map.
    pub fn rebuild(&mut self, block: &dyn Contacts, particle_count: usize, tile_length: usize) {
        let Self { contact_start, halo_start, target_start, slots, halo, .. } = self;
        self.tile_length = tile_length;
        contact_start.clear();
        halo_start.clear();
        target_start.clear();
        target_start.resize(particle_count + 1, 0);
        let tiles = particle_count.div_ceil(tile_length).max(1);
        if tiles == 1 {
            // All contacts lie in the tile, so there is no halo.
            contact_start.extend([0, block.len() as u32]);
            halo_start.extend([0, 0]);
            slots.clear();
            halo.clear();
            return;
        }
        let (mut targets, mut of_tile) = (Vec::new(), Vec::new());
        let pairs = block.pairs();
        let mut first = 0;
        for tile in 0..tiles {
            contact_start.push(first as u32);
            halo_start.push(targets.len() as u32);
            let base = tile * tile_length;
            let count = pairs[first..].partition_point(|pair| (pair.a as usize) < base + tile_length);
            let contacts = &pairs[first..first + count];
            // Without a branch, which no processor would predict.
            of_tile.resize(count, 0);
            let mut outside = 0;
            for pair in contacts {
                of_tile[outside] = pair.b;
                outside += usize::from(!is_local(pair.b, base, tile_length));
            }
            targets.extend_from_slice(&of_tile[..outside]);
            first += count;
        }
        contact_start.push(first as u32);
        halo_start.push(targets.len() as u32);
        for &target in &targets {
            target_start[target as usize + 1] += 1;
        }
        for p in 0..particle_count {
            target_start[p + 1] += target_start[p];
        }
        let mut next = target_start.clone();
        slots.resize(targets.len(), 0);
        for (slot, &target) in targets.iter().enumerate() {
            slots[next[target as usize] as usize] = slot as u32;
            next[target as usize] += 1;
        }
        // Each evaluation writes all slots.
        halo.resize(targets.len(), Wrench::default());
    }

    /// Find the factors on the strengths of the bonds of `block`, if they differ. Call it after [`Self::rebuild`].
    pub fn scatter(&mut self, block: &dyn Contacts, particles: &Particles, strengths: &Strengths) {
        if strengths.are_equal() || self.keep_strengths(block.pairs()) {
            return;
        }
        let of = |k| strengths.of_bond(particles, block.view(k).pair, block.view(k).reference.area);
        self.strength.clear();
        self.strength.par_extend((0..block.len()).into_par_iter().map(of));
        self.scattered = block.pairs().to_vec();
    }

    /// Keep the factors of the bonds that are left after others were removed; false if there are new ones.
    fn keep_strengths(&mut self, pairs: &[Pair]) -> bool {
        let (mut from, known) = (0, self.scattered.len());
        for (to, pair) in pairs.iter().enumerate() {
            while from < known && self.scattered[from] != *pair {
                from += 1;
            }
            if from == known {
                return false;
            }
            (self.scattered[to], self.strength[to]) = (*pair, self.strength[from]);
            from += 1;
        }
        self.scattered.truncate(pairs.len());
        self.strength.truncate(pairs.len());
        true
    }

    /// Forces and torques of other tiles on particle `p`, in fixed order.
    #[inline(always)]
    pub fn incoming(&self, p: usize) -> impl Iterator<Item = &Wrench> {
        let range = self.target_start[p] as usize..self.target_start[p + 1] as usize;
        self.slots[range].iter().map(|&slot| &self.halo[slot as usize])
    }

    /// Particle virials of other tiles for particle `p`, in fixed order.
    #[inline(always)]
    pub fn incoming_virials(&self, p: usize) -> impl Iterator<Item = &ParticleVirial> {
        let range = self.target_start[p] as usize..self.target_start[p + 1] as usize;
        self.slots[range].iter().map(|&slot| &self.virial_halo[slot as usize])
    }

    /// Prefetch the data that [`Self::incoming_virials`] will read for particle `p`.
    #[inline(always)]
    pub fn prefetch_virials(&self, p: usize) {
        let Some(&[start, end]) = self.target_start.get(p..p + 2) else { return };
        for &slot in &self.slots[start as usize..end as usize] {
            prefetch_row(&self.virial_halo, slot as usize);
        }
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of::<ParticleVirial>() * self.virial_halo.len()
            + 4 * (self.contact_start.len() + self.halo_start.len() + self.target_start.len() + self.slots.len())
            + size_of::<Wrench>() * self.halo.len()
            + size_of_val(&self.strength[..])
            + size_of_val(&self.scattered[..])
    }
}

/// Whether particle `b` lies in the tile of `length` particles that begins at particle `base`.
#[inline(always)]
pub(crate) fn is_local(b: u32, base: usize, length: usize) -> bool {
    (b as usize).wrapping_sub(base) < length
}
