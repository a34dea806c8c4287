//! Rebuild of the neighbor list: candidates of contacts between particles and with walls, and the tile maps.

use concordem_contact::kinematics::{PreviousGeometry, sphere_sphere};
use concordem_contact::law::{ContactGeometry, Reference};
use concordem_contact::math::Vec3;
use rayon::prelude::*;

use super::Solver;
use crate::forces::TileMap;
use crate::neighbor::{NeighborError, VerletList, candidate_pairs, candidate_pairs_with_others};
use crate::state::contacts::{BrokenBond, ContactFlags, Contacts, Pair, is_open};
use crate::state::{Cell, Particles, State, Wall};
use crate::walls::element_table;
use crate::{Model, SolverError};

/// A contact: its particles and the image of B.
type Key = (Pair, [i8; 3]);

/// A broken bond: its contact, the reference that the unbonded contact keeps, if any, and its last geometry.
type Freed = (Key, Option<Reference>, PreviousGeometry);

impl Solver {
    /// Rebuild the neighbor list: remove broken bonds, begin unbonded contacts that keep a bond's reference, renew the
    /// candidates and the tile maps.
    ///
    /// The candidates are complete while no particle strain exceeds twice `strain`, or 1e-4.
    pub(super) fn rebuild_neighbor_list(&mut self, state: &mut State, strain: f64) -> Result<(), SolverError> {
        self.rebuilds += 1;
        let step = state.clock.step;
        let n = state.particles.len();
        let smallest = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = state.particles.radius.iter().copied().fold(0.0, f64::max);
        let skin = if n > 0 { self.model.skin * smallest } else { 0.0 };
        self.strain_margin = if self.model.deformable.is_some() { (2.0 * strain).max(1e-4) } else { 0.0 };
        let widest = 1.0 + self.strain_margin;
        let neighbor = |source| SolverError::Neighbor { step, source };
        let freed = self.remove_broken_bonds(state);
        if state.contacts.is_some() {
            self.renew_contacts(state, freed, skin).map_err(neighbor)?;
        }
        if let Some(block) = &mut state.wall_contacts {
            let wall_skin = skin + self.strain_margin * largest;
            let cell = state.cell.as_ref();
            renew_wall_contacts(block.contacts_mut(), &self.model, &state.walls, &state.particles, cell, wall_skin)
                .map_err(neighbor)?;
        }
        self.wall_positions = state.walls.iter().map(|wall| wall.displacement).collect();
        let vertices = |wall: &Wall| wall.mesh().map_or_else(Vec::new, |mesh| mesh.position.clone());
        self.wall_vertices = state.walls.iter().map(vertices).collect();
        self.smallest = if n > 0 { smallest } else { 0.0 };
        self.bond_maps = state.bonds.iter().map(|block| TileMap::new(block.contacts(), n, self.tile)).collect();
        for (block, map) in state.bonds.iter().zip(&mut self.bond_maps) {
            map.scatter(block.contacts(), &state.particles, &self.model.strengths);
        }
        self.verlet = (state.contacts.is_some() || state.wall_contacts.is_some()).then(|| {
            // The largest cutoff distance is that of two touching spheres.
            VerletList::new(&state.particles.position, state.cell.as_ref(), skin, 2.0 * largest * widest)
        });
        Ok(())
    }

    /// After bonds broke: their pairs continue as unbonded contacts. The candidates of all other contacts stay, so no search is needed.
    pub(super) fn free_broken_pairs(&mut self, state: &mut State) {
        let n = state.particles.len();
        let before: Vec<usize> = state.bonds.iter().map(|block| block.len()).collect();
        let freed = self.remove_broken_bonds(state);
        for ((block, map), before) in state.bonds.iter().zip(&mut self.bond_maps).zip(before) {
            if block.len() != before {
                map.rebuild(block.contacts(), n, self.tile);
                map.scatter(block.contacts(), &state.particles, &self.model.strengths);
            }
        }
        let State { bonds, contacts: Some(block), particles, cell, .. } = state else { return };
        let block = block.contacts_mut();
        let mut new = Vec::with_capacity(freed.len());
        for ((pair, image), reference, previous) in freed {
            let (a, b) = (pair.a as usize, pair.b as usize);
            let bonded_otherwise = bonds.iter().any(|block| has(block.contacts(), &(pair, image)));
            let row = self.model.contact_row(particles, pair);
            let stays_free = bonded_otherwise || self.excluded.has(pair) || has(block, &(pair, image));
            let Some(row) = row.filter(|_| !stays_free) else { continue };
            let (bits, reference, previous) = match reference {
                Some(reference) => (ContactFlags::KEPT_REFERENCE, reference, previous),
                None if in_one_clump(particles, a, b) => continue,
                None => {
                    let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(image));
                    let (a, b) = (&particles.position[a], &particles.position[b]);
                    (0, Reference::default(), sphere_sphere::initial_geometry(a, b, &shift))
                }
            };
            let flags = ContactFlags { row, bits: bits | self.ownership(pair), image, padding: 0 };
            new.push((pair, flags, reference, previous));
        }
        if new.is_empty() {
            return;
        }
        let few = new.len() <= 8;
        for (pair, flags, reference, previous) in new {
            if few {
                block.insert(pair, flags, reference, previous);
            } else {
                block.push(pair, flags, reference, previous);
            }
        }
        if !few {
            block.sort();
        }
        self.contact_map.rebuild(block, n, self.tile);
    }

    /// Move broken bonds from their blocks to [`State::broken`]. Returns them, sorted.
    fn remove_broken_bonds(&mut self, state: &mut State) -> Vec<Freed> {
        let mut freed = Vec::new();
        let State { bonds, contacts, particles, broken, .. } = state;
        for (index, block) in bonds.iter_mut().enumerate() {
            let block = block.contacts_mut();
            let is_broken = |(k, flags): (u32, &ContactFlags)| flags.has(ContactFlags::BROKEN).then_some(k);
            let gone: Vec<u32> = (0..).zip(block.flags()).filter_map(is_broken).collect();
            for &k in &gone {
                let k = k as usize;
                let view = block.view(k);
                let (pair, image) = (view.pair, view.flags.image);
                // The host of a subdomain keeps its own list for all subdomains.
                if self.owned.is_empty() {
                    let (reference, previous, open) = (view.reference, view.previous, is_open(block, k));
                    broken.push(BrokenBond { block: index as u16, pair, image, reference, previous, open });
                }
                if let (Some(contacts), Some(row)) = (contacts.as_ref(), self.model.contact_row(particles, pair)) {
                    let reference = reference_after(block, k, contacts.contacts(), row, particles);
                    freed.push(((pair, image), reference, view.previous));
                }
            }
            block.remove(&gone);
        }
        if let (Some(pass), Some(model), Some(heat)) = (&mut self.heat, &self.model.heat, &state.heat) {
            pass.crack(model, &state.particles, heat, &state.broken);
        }
        freed.sort_unstable_by_key(|freed| freed.0);
        freed
    }

    /// Renew the unbonded contacts: keep those with history, and those with a kept reference, which may touch again.
    fn renew_contacts(&mut self, state: &mut State, freed: Vec<Freed>, skin: f64) -> Result<(), NeighborError> {
        let Some(block) = &mut state.contacts else { return Ok(()) };
        let (block, particles) = (block.contacts_mut(), &state.particles);
        let widest = 1.0 + self.strain_margin;
        let reach: Vec<f64> = particles.radius.iter().map(|r| r * widest + 0.5 * skin).collect();
        // Before the list of the bonds: the search needs the most memory of all steps here.
        let candidates = candidate_pairs(&particles.position, &reach, state.cell.as_ref())?;
        // Pairs of intact bonds, which do not interact otherwise.
        let mut excluded: Vec<Key> = Vec::with_capacity(state.bonds.iter().map(|bonds| bonds.len()).sum());
        for bonds in &state.bonds {
            let bonds = bonds.contacts();
            excluded.extend((0..bonds.len()).map(|k| key_of(bonds, k)));
        }
        let row_of = |pair: Pair| self.model.contact_row(particles, pair);
        block.retain_where(&|flags| flags.has(ContactFlags::ACTIVE) || flags.has(ContactFlags::KEPT_REFERENCE));
        let present: Vec<Key> = (0..block.len())
            .map(|k| {
                let view = block.view(k);
                (view.pair, view.flags.image)
            })
            .collect();
        for ((pair, image), reference, previous) in freed {
            if let Some(reference) = reference
                && present.binary_search(&(pair, image)).is_err()
                && let Some(row) = row_of(pair)
                && !self.excluded.has(pair)
            {
                let bits = ContactFlags::KEPT_REFERENCE | self.ownership(pair);
                block.push(pair, ContactFlags { row, bits, image, padding: 0 }, reference, previous);
                excluded.push((pair, image));
            }
        }
        excluded.sort_unstable();
        // The candidates are sorted in the same way, so each list is walked through once.
        let (mut excluded, mut present) = (Walk::new(&excluded), Walk::new(&present));
        for candidate in candidates {
            let pair = Pair { a: candidate.a, b: candidate.b };
            let (a, b) = (pair.a as usize, pair.b as usize);
            let key = (pair, candidate.image);
            let same_clump = in_one_clump(particles, a, b);
            let foreign = !self.owned.is_empty() && !self.owned[a] && !self.owned[b];
            if same_clump || foreign || self.excluded.has(pair) || excluded.contains(&key) || present.contains(&key) {
                continue;
            }
            let Some(row) = row_of(pair) else { continue };
            let shift = state.cell.map_or(Vec3::zeros(), |cell| cell.shift(candidate.image));
            let geometry = sphere_sphere::initial_geometry(&particles.position[a], &particles.position[b], &shift);
            let flags = ContactFlags { row, bits: self.ownership(pair), image: candidate.image, padding: 0 };
            block.push(pair, flags, Reference::default(), geometry);
        }
        block.sort();
        self.contact_map.rebuild(block, particles.len(), self.tile);
        Ok(())
    }

    /// [`ContactFlags::NOT_OWNED`] for a new contact whose energies another subdomain counts, otherwise 0.
    fn ownership(&self, pair: Pair) -> u8 {
        let counted = self.owned.is_empty() || self.owned[pair.a as usize];
        if counted { 0 } else { ContactFlags::NOT_OWNED }
    }

    /// Whether the neighbor list may be incomplete.
    pub(super) fn needs_rebuild(&self, state: &State, strain: f64) -> bool {
        let Some(verlet) = &self.verlet else { return false };
        // A NaN strain passes this test; the check of the velocities detects it.
        if strain > self.strain_margin {
            return true;
        }
        if state.wall_contacts.is_some() && self.wall_candidates_incomplete(state, verlet) {
            return true;
        }
        verlet.needs_rebuild(&state.particles.position, state.cell.as_ref())
    }

    /// The search for wall candidates used one skin, so a particle and a wall together must not move further than that.
    fn wall_candidates_incomplete(&self, state: &State, verlet: &VerletList) -> bool {
        let wall = state
            .walls
            .iter()
            .zip(&self.wall_positions)
            .map(|(wall, old)| (wall.displacement - old).norm())
            .fold(0.0, f64::max);
        // No point of a triangle moves further than all its corners.
        let vertex = state
            .walls
            .iter()
            .zip(&self.wall_vertices)
            .filter_map(|(wall, old)| {
                Some(wall.mesh()?.position.iter().zip(old).map(|(x, old)| (x - old).norm_squared()))
            })
            .flatten()
            .fold(0.0, f64::max)
            .sqrt();
        let allowed = verlet.skin - wall.max(vertex);
        let within = |(now, then): (&Vec3, &Vec3)| (now - then).norm_squared() < allowed * allowed;
        allowed <= 0.0 || !state.particles.position.par_iter().zip(&verlet.positions).all(within)
    }
}

/// Whether two particles belong to one clump, whose members do not interact.
fn in_one_clump(particles: &Particles, a: usize, b: usize) -> bool {
    particles.clump[a] == particles.clump[b] && particles.clump[a] != u32::MAX
}

/// A walk through a sorted list.
struct Walk<'a> {
    rest: &'a [Key],
}

impl<'a> Walk<'a> {
    fn new(rest: &'a [Key]) -> Self {
        Self { rest }
    }

    /// Whether the list has this contact, which must not come before the one asked for last.
    fn contains(&mut self, key: &Key) -> bool {
        while let [first, rest @ ..] = self.rest
            && first < key
        {
            self.rest = rest;
        }
        self.rest.first() == Some(key)
    }
}

/// Contact `k` of a block.
fn key_of(block: &dyn Contacts, k: usize) -> Key {
    let view = block.view(k);
    (view.pair, view.flags.image)
}

/// Whether a sorted block has this contact.
fn has(block: &dyn Contacts, key: &Key) -> bool {
    let first = block.pairs().partition_point(|pair| *pair < key.0);
    (first..block.len()).take_while(|&k| block.pairs()[k] == key.0).any(|k| key_of(block, k) == *key)
}

/// Largest relative difference of overlaps that is rounding: then the reference of the bond stays to the last bit.
const SAME_OVERLAP: f64 = 1e-9;

/// Unstrained geometry of the contact, of parameter row `row`, that follows the broken bond `k`; `None` if it is that of any
/// other contact.
///
/// The faces of the crack touch where they parted: at the bond's unstrained length. Where the particles of a bond overlap, this
/// holds for all contacts that would otherwise start with the overlap, and with energy that nobody stored. It also holds for those of
/// the concrete law that follow a bond of another law: they would start at the length of their first step, and rounding decides which
/// step that is if the particles move as one body. After a bond of the concrete law they do, as in YADE.
///
/// A bond that breaks under pressure hands its normal force over, not more: a contact stiffer than the bond gets a smaller
/// overlap. Its force `F` at the overlap `δ` then stores less than the bond did, because `∫F dδ ≤ ½Fδ` for a force that grows at
/// least linearly.
fn reference_after(
    bonds: &dyn Contacts,
    k: usize,
    contacts: &dyn Contacts,
    row: u16,
    particles: &Particles,
) -> Option<Reference> {
    let view = bonds.view(k);
    let (a, b) = (view.pair.a as usize, view.pair.b as usize);
    let (radius_a, radius_b, length) = (particles.radius[a], particles.radius[b], view.previous.length);
    let (unstrained, touching) = (bonds.unstrained_length(k, particles), radius_a + radius_b);
    let of_others = contacts.unbonded_reference(length, radius_a, radius_b);
    let of_other_law = bonds.law() != contacts.law();
    let mut reference = match bonds.kept_reference(k) {
        Some(reference) => reference,
        None if of_others.length > length || of_other_law && touching > length => {
            Reference { length: unstrained.min(touching), ..of_others }
        }
        None => return None,
    };
    let overlap = reference.length - length;
    if overlap > 0.0 {
        let geometry = ContactGeometry {
            reference_length: reference.length,
            area: reference.area,
            radius_a,
            radius_b,
            mass_a: particles.mass[a],
            mass_b: particles.mass[b],
        };
        let force = bonds.stiffness(k, particles, false).normal * (unstrained - length).max(0.0);
        let carried = contacts.overlap_under(row, &geometry, force);
        if carried < overlap * (1.0 - SAME_OVERLAP) {
            reference.length = length + carried;
        }
    }
    Some(reference)
}

/// Renew the candidates of wall contacts; contacts with history stay.
fn renew_wall_contacts(
    block: &mut dyn Contacts,
    model: &Model,
    walls: &[Wall],
    particles: &Particles,
    cell: Option<&Cell>,
    skin: f64,
) -> Result<(), NeighborError> {
    block.retain_where(&|flags| flags.has(ContactFlags::ACTIVE));
    let present: Vec<Key> = (0..block.len())
        .map(|k| {
            let view = block.view(k);
            (view.pair, view.flags.image)
        })
        .collect();
    let elements = element_table(walls);
    for (pair, image) in wall_candidates(walls, &elements, particles, cell, skin)? {
        if present.binary_search(&(pair, image)).is_ok() {
            continue;
        }
        let a = pair.a as usize;
        let wall = &walls[elements[pair.b as usize].0 as usize];
        if let Some(row) = model.wall_rows.get(particles.material[a], wall.material) {
            let flags = ContactFlags { row, bits: 0, image, padding: 0 };
            block.push(pair, flags, Reference::default(), PreviousGeometry::default());
        }
    }
    block.sort();
    Ok(())
}

/// Pairs of a particle and a wall element, with the image of the wall, closer than `skin` (m), sorted.
fn wall_candidates(
    walls: &[Wall],
    elements: &[(u32, u32)],
    particles: &Particles,
    cell: Option<&Cell>,
    skin: f64,
) -> Result<Vec<Key>, NeighborError> {
    let n = particles.len();
    let mut pairs = Vec::new();
    let mut bounded = Vec::new();
    for (number, &(w, e)) in elements.iter().enumerate() {
        let wall = &walls[w as usize];
        if let Some(ball) = wall.bounds(e as usize) {
            bounded.push((number as u32, ball));
            continue;
        }
        for p in 0..n {
            let pair = Pair { a: p as u32, b: number as u32 };
            let reach = particles.radius[p] + skin;
            if let Some(cell) = cell {
                for image in wall.images_near(&particles.position[p], reach, cell) {
                    pairs.push((pair, small_image(pair, image)?));
                }
                continue;
            }
            if wall.distance(e as usize, &particles.position[p]) < reach {
                pairs.push((pair, [0; 3]));
            }
        }
    }
    if !bounded.is_empty() {
        // Triangles take part in the neighbor search as balls, numbered after the particles. A ball around a large triangle holds many
        // particles that are far from it.
        let positions: Vec<Vec3> = particles.position.iter().copied().chain(bounded.iter().map(|b| b.1.0)).collect();
        let reach: Vec<f64> = particles.radius.iter().map(|r| r + skin).chain(bounded.iter().map(|b| b.1.1)).collect();
        let found = candidate_pairs_with_others(&positions, &reach, n, cell)?;
        pairs.par_extend(found.par_iter().filter_map(|candidate| {
            let a = candidate.a as usize;
            let number = bounded[candidate.b as usize - n].0;
            let (w, e) = elements[number as usize];
            let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(candidate.image));
            let is_near = walls[w as usize].distance(e as usize, &(positions[a] - shift)) < reach[a];
            is_near.then_some((Pair { a: candidate.a, b: number }, candidate.image))
        }));
    }
    pairs.sort_unstable();
    Ok(pairs)
}

/// An image number that fits into the flags of a contact.
fn small_image(pair: Pair, image: [i64; 3]) -> Result<[i8; 3], NeighborError> {
    let out = || NeighborError::ImageOutOfRange { a: pair.a, b: pair.b, image: image.map(|n| n as f64) };
    let mut small = [0; 3];
    for (to, from) in small.iter_mut().zip(image) {
        *to = i8::try_from(from).map_err(|_| out())?;
    }
    Ok(small)
}
