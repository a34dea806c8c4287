//! Estimates memory and refuses scenarios that do not fit.
//!
//! The constants are fitted to the peak of the resident memory of whole runs (`concordem run`, two threads): 1e2 to 6e5
//! particles on a lattice, with linear bonds, beams, CPM, frictional and Hertzian contacts, in and without a periodic cell.
//! The peak occurs while the result is written, when tables of all contacts are in memory besides the state.

use super::{AssemblyError, Placed, unfit};
use crate::schema::Scenario;
use concordem_contact::math::{Mat3, Vec3};
use concordem_packing::memory::affordable_bytes;
use concordem_solver::state::{Cell, Particles, State};

/// The program itself, bytes.
const PROGRAM: f64 = 27e6;
/// State and solver of one particle, bytes.
const PARTICLE: f64 = 272.0;
/// Strains and virials of a deformable particle, bytes: 192 of state, 264 of scratch.
const DEFORMABLE: f64 = 456.0;
/// Halo slots per contact (half a slot on average, with its index), bytes.
const HALO: f64 = 26.0;
/// Snapshots and columns of a particle while the result is written, bytes.
const PARTICLE_TABLES: f64 = 600.0;
/// Forces and table row of a bond while the result is written, bytes.
const BOND_TABLES: f64 = 320.0;
/// The same for an unbonded contact; only contacts with a force have rows, bytes.
const CONTACT_TABLES: f64 = 235.0;
/// Additional memory of a particle in a cell that deforms, bytes.
const DRIVEN_CELL: f64 = 430.0;
/// A bond in the state and in the list of candidate pairs, bytes.
const BOND: f64 = 160.0;

/// Estimated peak memory of a run, bytes.
pub(super) fn peak(state: &State) -> usize {
    let deformable = if state.particles.deformation.is_empty() { 0.0 } else { DEFORMABLE };
    let driven = state.cell.as_ref().is_some_and(|cell| cell.velocity_gradient != Mat3::zeros());
    let driven = if driven { DRIVEN_CELL } else { 0.0 };
    let particles = state.particles.len() as f64 * (PARTICLE + deformable + driven + PARTICLE_TABLES);
    let block = |count: usize, bytes: usize, tables: f64| count as f64 * (bytes as f64 + HALO + tables);
    let bonds: f64 = state.bonds.iter().map(|b| block(b.len(), b.bytes_per_contact(), BOND_TABLES)).sum();
    let contacts = state.contacts.iter().chain(&state.wall_contacts);
    let contacts: f64 = contacts.map(|b| block(b.len(), b.bytes_per_contact(), CONTACT_TABLES)).sum();
    (PROGRAM + particles + bonds + contacts) as usize
}

/// Refuses numbers of particles that do not fit into memory, before they are built.
pub(super) fn check_particles(scenario: &Scenario, placed: &Placed) -> Result<(), AssemblyError> {
    let added = scenario.clumps.iter().flat_map(|clump| clump.spheres.iter().flatten()).count();
    let count = (placed.packing.spheres.len() + added) as f64;
    Ok(affordable_bytes(&format!("{count:.4e} particles"), count * (PARTICLE + PARTICLE_TABLES))?)
}

/// Refuses interaction ratios that give more bonds than fit into memory, estimated for a uniform density.
pub(super) fn check_bonds(particles: &Particles, cell: Option<&Cell>, ratio: f64) -> Result<(), AssemblyError> {
    let count = particles.len() as f64;
    let radius = particles.radius.iter().sum::<f64>() / count;
    let volume = cell.map_or_else(|| box_volume(particles, radius), Cell::volume);
    let reach = 2.0 * ratio * radius;
    let around = 4.0 / 3.0 * std::f64::consts::PI * reach * reach * reach * count / volume;
    // Without a cell, a particle cannot have more partners than there are particles.
    let partners = if cell.is_some() { around } else { around.min(count) };
    let bonds = 0.5 * count * partners;
    affordable_bytes(&format!("about {bonds:.1e} bonds"), bonds * BOND)
        .map_err(|error| unfit("bonds.interaction_ratio", error.to_string()))
}

/// Volume of the box around all particles, m³.
fn box_volume(particles: &Particles, radius: f64) -> f64 {
    let bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = particles.position.iter().fold(bounds, |(low, high), x| (low.inf(x), high.sup(x)));
    (high - low).add_scalar(2.0 * radius).product()
}

/// Refuses a state whose run does not fit into memory, before the neighbor search copies it.
pub(super) fn check_run(state: &State) -> Result<(), AssemblyError> {
    Ok(affordable_bytes("the run", peak(state) as f64)?)
}
