//! How many bytes a step must move.

use concordem_contact::geometry::{PreviousGeometry, Reference};
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::pair::{ContactFlags, Pair};
use concordem_solver::state::State;

use crate::arguments::{Dissipated, Works};

/// Bytes that a step without a sample moves between the memory of a device and its processors, if each kernel reads and writes every
/// number once: particles read for several contacts come from a cache.
pub fn bytes_per_step(state: &State) -> u64 {
    let motion = 3 * size_of::<Vec3>() + 2 * size_of::<Quat>();
    // First kernel: motion, radius, mass. Second kernel: motion twice, mass, inertia, constraint, places, listed position, works, which the third one reads.
    let of_particle = motion + 16 + 2 * motion + 16 + 1 + 8 + size_of::<Vec3>() + 2 * size_of::<Works>();
    let particles = state.particles.len() * of_particle;
    let link = size_of::<ContactFlags>() + size_of::<Reference>();
    // Loads: three vectors written; force and one torque read for each of two ends, by number. Energies: written, and read by the third kernel.
    let exchanged = 7 * size_of::<Vec3>() + 2 * size_of::<u32>() + 2 * size_of::<Dissipated>();
    let of_block = |(k, block): (usize, &dyn concordem_solver::state::contacts::Contacts)| {
        let width: usize = block.history_fields().iter().map(|field| field.components).sum();
        let history = block.len() * width * size_of::<f64>();
        let copies = if k < state.bonds.len() { 1 } else { 2 };
        block.len() * (size_of::<Pair>() + copies * link + 2 * size_of::<PreviousGeometry>() + exchanged) + 2 * history
    };
    let blocks = state.bonds.iter().chain(&state.contacts).map(|block| block.contacts()).enumerate();
    (particles + blocks.map(of_block).sum::<usize>()) as u64
}
