//! Division of a block of contacts into tiles, and the halo between them.

use concordem_contact::kinematics::deformable::ParticleVirial;
use concordem_contact::math::Vec3;
use concordem_contact::prefetch::prefetch_row;

use crate::state::contacts::Contacts;

/// Force and torque.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force: Vec3,
    /// Torque about the particle's center, N·m.
    pub torque: Vec3,
}

/// Division of one block of contacts into tiles, and the halo slots of each tile. Scratch: rebuilt whenever the list of
/// contacts changes.
#[derive(Debug, Clone, Default)]
pub struct TileMap {
    /// Particles per tile.
    pub(super) tile_length: usize,
    /// First contact of each tile, then the number of contacts.
    pub(super) contact_start: Vec<u32>,
    /// First halo slot of each tile, then the number of slots.
    pub(super) halo_start: Vec<u32>,
    /// First entry of each particle in `slots`, then the number of entries.
    target_start: Vec<u32>,
    /// Halo slots by target particle, ascending.
    slots: Vec<u32>,
    /// Force and torque in each halo slot.
    pub(super) halo: Vec<Wrench>,
    /// Particle virial in each halo slot; empty if particles are rigid.
    pub(super) virial_halo: Vec<ParticleVirial>,
}

impl TileMap {
    /// Map of a block sorted by A, for tiles of `tile_length` particles.
    pub fn new(block: &dyn Contacts, particle_count: usize, tile_length: usize) -> Self {
        let tiles = particle_count.div_ceil(tile_length).max(1);
        if tiles == 1 {
            // All contacts lie in the tile, so there is no halo.
            return Self {
                tile_length,
                contact_start: vec![0, block.len() as u32],
                halo_start: vec![0, 0],
                target_start: vec![0; particle_count + 1],
                ..Self::default()
            };
        }
        let mut contact_start = Vec::with_capacity(tiles + 1);
        let mut halo_start = Vec::with_capacity(tiles + 1);
        let mut target_count = vec![0u32; particle_count + 1];
        let mut targets = Vec::new();
        let (mut k, pairs) = (0, block.pairs());
        for tile in 0..tiles {
            contact_start.push(k as u32);
            halo_start.push(targets.len() as u32);
            let end = (tile + 1) * tile_length;
            while let Some(pair) = pairs.get(k) {
                if pair.a as usize >= end {
                    break;
                }
                if !is_local(pair.b, tile * tile_length, tile_length) {
                    targets.push(pair.b);
                    target_count[pair.b as usize + 1] += 1;
                }
                k += 1;
            }
        }
        contact_start.push(k as u32);
        halo_start.push(targets.len() as u32);
        for p in 0..particle_count {
            target_count[p + 1] += target_count[p];
        }
        let target_start = target_count.clone();
        let mut slots = vec![0u32; targets.len()];
        for (slot, &target) in targets.iter().enumerate() {
            slots[target_count[target as usize] as usize] = slot as u32;
            target_count[target as usize] += 1;
        }
        let halo = vec![Wrench::default(); targets.len()];
        Self { tile_length, contact_start, halo_start, target_start, slots, halo, virial_halo: Vec::new() }
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
    }
}

/// Whether particle `b` lies in the tile of `length` particles that begins at particle `base`.
#[inline(always)]
pub(super) fn is_local(b: u32, base: usize, length: usize) -> bool {
    (b as usize).wrapping_sub(base) < length
}
