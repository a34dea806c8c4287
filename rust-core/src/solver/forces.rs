//! Contact forces, evaluated tile by tile: parallel, and bitwise the same for any number of threads.
//!
//! Particles are cut into tiles of [`TILE`] consecutive indices (a compact lump of space, since the order follows a
//! space-filling curve). A tile owns the contacts whose A lies in it. It adds forces on its own particles directly,
//! and writes the force on a B of another tile to a halo slot of its own. Then every particle adds the halo slots
//! meant for it in ascending order. Which operations are done, and in which order, depends on the particle numbering
//! alone, never on the threads.

use rayon::prelude::*;

use crate::kinematics::sphere_sphere::{ImageShift, Motion};
use crate::kinematics::{Frame, Mode, PointKinematics};
use crate::law::{ContactGeometry, ContactLaw, EnergySplit, Fate, Kinematics, LawState, Reference};
use crate::math::{Mat3, Vec3};
use crate::solver::walls;
use crate::state::contacts::{ContactBlock, Contacts, Link, Pair};
use crate::state::{Cell, Particles, Wall};

/// Particles per tile.
pub const TILE: usize = 1024;

/// Force and torque.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Wrench {
    /// Force, N.
    pub force: Vec3,
    /// Torque about the particle's centre, N·m.
    pub torque: Vec3,
}

/// What a step's force evaluation needs to know besides the contacts.
#[derive(Clone, Copy)]
pub struct StepContext<'a> {
    /// The particles.
    pub particles: &'a Particles,
    /// Periodic cell.
    pub cell: Option<&'a Cell>,
    /// How motion is measured.
    pub mode: Mode,
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub damage_threshold: f64,
    /// Whether stored energies and the squares of the contact forces are wanted: state functions, needed only when a
    /// sample is taken. (Dissipation is summed at every step.)
    pub sample: bool,
}

/// What happened to a bond, noted by index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Incident {
    /// The particles, by index.
    pub pair: Pair,
    /// Whether the bond broke (else: its damage passed the threshold).
    pub broke: bool,
    /// Damage reached.
    pub damage: f64,
    /// Contact point, m.
    pub position: Vec3,
    /// Energy dissipated by damage in this step, J.
    pub energy: f64,
    /// Stored energy before (broken) or after (damaged) by mode: normal, shear, bending, twist, J.
    pub stored: [f64; 4],
}

/// Sums over a block, and its incidents.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// Energies.
    pub energy: EnergySplit,
    /// `Σ l⊗f`, with the force on A, J; divided by the volume it is the stress (tension positive, position first).
    pub virial: Mat3,
    /// `Σ f⊗image`, N, over contacts across the periodic border.
    pub crossing: Mat3,
    /// `Σ|f|²`, N², if asked for.
    pub force_squared: f64,
    /// Contacts that carry something.
    pub active: u64,
    /// Incidents in order of contacts.
    pub incidents: Vec<Incident>,
}

impl Tally {
    /// Add another tally.
    pub fn merge(&mut self, other: Self) {
        self.energy += other.energy;
        self.virial += other.virial;
        self.crossing += other.crossing;
        self.active += other.active;
        self.force_squared += other.force_squared;
        self.incidents.extend(other.incidents);
    }
}

/// Division of one block into tiles, and where the halo goes. Scratch: rebuilt whenever the contacts change.
#[derive(Debug, Clone, Default)]
pub struct TileMap {
    /// First contact of each tile, and the end.
    contact_start: Vec<u32>,
    /// First halo slot of each tile, and the end.
    halo_start: Vec<u32>,
    /// For each particle, where its slots begin in `slots`, and the end.
    target_start: Vec<u32>,
    /// Halo slots by target particle, ascending.
    slots: Vec<u32>,
    /// The halo.
    halo: Vec<Wrench>,
}

impl TileMap {
    /// Map of a block sorted by A.
    pub fn new(block: &dyn Contacts, particle_count: usize) -> Self {
        let tiles = particle_count.div_ceil(TILE).max(1);
        let mut contact_start = Vec::with_capacity(tiles + 1);
        let mut halo_start = Vec::with_capacity(tiles + 1);
        let mut target_count = vec![0u32; particle_count + 1];
        let mut targets = Vec::new();
        let (mut k, count) = (0, block.len());
        for tile in 0..tiles {
            contact_start.push(k as u32);
            halo_start.push(targets.len() as u32);
            let end = (tile + 1) * TILE;
            while k < count {
                let pair = block.view(k).pair;
                if pair.a as usize >= end {
                    break;
                }
                if !is_local(pair.b, tile * TILE, TILE) {
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
        Self { contact_start, halo_start, target_start, slots, halo }
    }

    /// Halo contributions to particle `p`, in order.
    #[inline(always)]
    pub fn incoming(&self, p: usize) -> impl Iterator<Item = &Wrench> {
        let range = self.target_start[p] as usize..self.target_start[p + 1] as usize;
        self.slots[range].iter().map(|&slot| &self.halo[slot as usize])
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        4 * (self.contact_start.len() + self.halo_start.len() + self.target_start.len() + self.slots.len())
            + size_of::<Wrench>() * self.halo.len()
    }
}

#[inline(always)]
fn is_local(b: u32, base: usize, tile_len: usize) -> bool {
    (b as usize).wrapping_sub(base) < tile_len
}

/// A block the solver can evaluate.
pub trait EvaluatedContacts: Contacts {
    /// Evaluate all contacts: forces and torques on particles of the contact's own tile are added to `force` and
    /// `torque`, the others go to the map's halo. Histories advance by one step.
    fn evaluate(
        &mut self,
        context: &StepContext<'_>,
        map: &mut TileMap,
        force: &mut [Vec3],
        torque: &mut [Vec3],
    ) -> Tally;
    /// Evaluate contacts with walls; `b` of a pair numbers the wall elements through all walls. Forces on particles are
    /// added to `force` and `torque`, forces of the particles on the walls to the walls. Histories advance.
    fn evaluate_walls(
        &mut self,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        force: &mut [Vec3],
        torque: &mut [Vec3],
    ) -> Tally;
    /// Copy of the block behind the trait.
    fn boxed_clone(&self) -> Box<dyn EvaluatedContacts>;
    /// The block as plain contacts.
    fn contacts(&self) -> &dyn Contacts;
    /// The block as plain contacts.
    fn contacts_mut(&mut self) -> &mut dyn Contacts;
}

struct Tile<'a, L: ContactLaw> {
    base: usize,
    pair: &'a [Pair],
    link: &'a mut [Link],
    reference: &'a mut [Reference],
    frame: &'a mut [Frame],
    history: &'a mut [L::State],
    force: &'a mut [Vec3],
    torque: &'a mut [Vec3],
    halo: &'a mut [Wrench],
}

impl<L: ContactLaw> EvaluatedContacts for ContactBlock<L> {
    fn evaluate(
        &mut self,
        context: &StepContext<'_>,
        map: &mut TileMap,
        force: &mut [Vec3],
        torque: &mut [Vec3],
    ) -> Tally {
        let rows = &self.rows;
        let mut tiles = Vec::with_capacity(map.contact_start.len());
        let mut pair = &self.pair[..];
        let mut link = &mut self.link[..];
        let mut reference = &mut self.reference[..];
        let mut frame = &mut self.frame[..];
        let mut history = &mut self.history[..];
        let mut halo = &mut map.halo[..];
        for (t, (force, torque)) in force.chunks_mut(TILE).zip(torque.chunks_mut(TILE)).enumerate() {
            let contacts = (map.contact_start[t + 1] - map.contact_start[t]) as usize;
            let slots = (map.halo_start[t + 1] - map.halo_start[t]) as usize;
            tiles.push(Tile::<L> {
                base: t * TILE,
                pair: pair.split_off(..contacts).unwrap_or_default(),
                link: link.split_off_mut(..contacts).unwrap_or_default(),
                reference: reference.split_off_mut(..contacts).unwrap_or_default(),
                frame: frame.split_off_mut(..contacts).unwrap_or_default(),
                history: history.split_off_mut(..contacts).unwrap_or_default(),
                force,
                torque,
                halo: halo.split_off_mut(..slots).unwrap_or_default(),
            });
        }
        let tallies: Vec<Tally> = tiles.par_iter_mut().map(|tile| dispatch(context, rows, tile)).collect();
        let mut total = Tally::default();
        for tally in tallies {
            total.merge(tally);
        }
        total
    }
    fn evaluate_walls(
        &mut self,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        force: &mut [Vec3],
        torque: &mut [Vec3],
    ) -> Tally {
        walls::evaluate(self, context, walls, force, torque)
    }
    fn boxed_clone(&self) -> Box<dyn EvaluatedContacts> {
        Box::new(self.clone())
    }
    fn contacts(&self) -> &dyn Contacts {
        self
    }
    fn contacts_mut(&mut self) -> &mut dyn Contacts {
        self
    }
}

/// The loop over one tile with the default measure of motion, as something that [`pulp`] can run with the newest
/// instructions of the processor. They give the same bits: nothing is fused or reordered.
struct FiniteTileLoop<'a, 'b, L: ContactLaw> {
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: &'a mut Tile<'b, L>,
}

impl<L: ContactLaw> pulp::NullaryFnOnce for FiniteTileLoop<'_, '_, L> {
    type Output = Tally;
    #[inline(always)]
    fn call(self) -> Tally {
        run::<L, false, false>(Mode::Finite, self.context, self.rows, self.tile)
    }
}

/// Choose the loop: the default measure without a cell and without a sample has one of its own, the others share one,
/// to keep the program small.
fn dispatch<L: ContactLaw>(context: &StepContext<'_>, rows: &[L], tile: &mut Tile<'_, L>) -> Tally {
    let mode = context.mode;
    if mode == Mode::Finite && context.cell.is_none() && !context.sample {
        pulp::Arch::new().dispatch(FiniteTileLoop { context, rows, tile })
    } else {
        run::<L, true, true>(mode, context, rows, tile)
    }
}

/// The motion of particle `p`.
#[inline(always)]
pub fn motion_of(particles: &Particles, p: usize) -> Motion {
    Motion {
        position: particles.position[p],
        velocity: particles.velocity[p],
        angular_velocity: particles.angular_velocity[p],
        rotation_increment: particles.rotation_increment[p],
        orientation: particles.orientation[p],
    }
}

#[inline(always)]
fn run<L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool>(
    mode: Mode,
    context: &StepContext<'_>,
    rows: &[L],
    tile: &mut Tile<'_, L>,
) -> Tally {
    let particles = context.particles;
    let mut tally = Tally::default();
    let mut next_slot = 0;
    // Slices of one length, so that one comparison guards all of them.
    let n = particles.len();
    let (position, rotation_increment) = (&particles.position[..n], &particles.rotation_increment[..n]);
    let (velocity, angular_velocity) = (&particles.velocity[..n], &particles.angular_velocity[..n]);
    let (radius, mass, orientation) = (&particles.radius[..n], &particles.mass[..n], &particles.orientation[..n]);
    let motion = |p: usize| Motion {
        position: position[p],
        velocity: velocity[p],
        angular_velocity: angular_velocity[p],
        rotation_increment: rotation_increment[p],
        orientation: orientation[p],
    };
    let contacts = tile
        .pair
        .iter()
        .zip(tile.link.iter_mut())
        .zip(tile.reference.iter_mut())
        .zip(tile.frame.iter_mut())
        .zip(tile.history.iter_mut());
    for ((((pair, link), reference), frame), history) in contacts {
        let (a, b) = (pair.a as usize, pair.b as usize);
        assert!(a < n && b < n, "contact names a particle that does not exist");
        let local = is_local(pair.b, tile.base, TILE);
        let image = match context.cell {
            Some(cell) if PERIODIC => {
                let displacement = cell.shift(link.image);
                ImageShift { displacement, velocity: cell.velocity_gradient * displacement, periodic: true }
            }
            _ => ImageShift::default(),
        };
        let mut takes_over = false;
        // Bonds have the flag from the start; candidates get it when their surfaces (or those a broken bond kept) meet.
        if !link.has(Link::ACTIVE) || link.has(Link::BROKEN) {
            let between = position[b] + image.displacement - position[a];
            // Where it was one step ago follows from the velocities, so that candidates need no memory.
            let before = between - (velocity[b] + image.velocity - velocity[a]) * context.dt;
            if link.has(Link::BROKEN) || !activate::<L>(link, reference, frame, &between, &before, radius[a], radius[b])
            {
                if !local {
                    tile.halo[next_slot] = Wrench::default();
                    next_slot += 1;
                }
                continue;
            }
            takes_over = link.has(Link::KEPT_REFERENCE) && frame.length < reference.length;
        }
        let (motion_a, motion_b) = (motion(a), motion(b));
        let geometry = ContactGeometry {
            reference_length: reference.length,
            area: reference.area,
            radius_a: radius[a],
            radius_b: radius[b],
            mass_a: mass[a],
            mass_b: mass[b],
        };
        let bonded = link.has(Link::BONDED);
        let kinematics =
            L::Kinematics::measure(mode, &motion_a, &motion_b, &image, &geometry, frame, bonded, context.dt);
        let response = rows[link.row as usize].respond(&kinematics, history, context.dt);
        let point = kinematics.point();
        let (normal, arm_a, arm_b) = (point.normal, point.arm_a, point.arm_b);
        if takes_over {
            tally.energy.damage -= taken_over(point, &response.force, &response.energy);
        }
        *frame = Frame { normal, length: point.length };
        tally.energy.damage += response.energy.damage;
        tally.energy.friction += response.energy.friction;
        tally.energy.viscous += response.energy.viscous;
        tally.energy.integration += response.energy.integration;
        if response.fate != Fate::Lives {
            end(link, history, response.fate, &response.state);
            if response.fate == Fate::Broke {
                tally.incidents.push(incident(*pair, 1.0, &(position[a] + normal * arm_a), &response.energy, true));
            }
            if !local {
                tile.halo[next_slot] = Wrench::default();
                next_slot += 1;
            }
            continue;
        }
        *history = response.state;
        let damage = L::damage(history);
        if damage >= context.damage_threshold && !link.has(Link::REPORTED) {
            link.flags |= Link::REPORTED;
            tally.incidents.push(incident(*pair, damage, &(position[a] + normal * arm_a), &response.energy, false));
        }
        tally.active += 1;
        let force = response.force;
        if SAMPLE {
            tally.energy.stored_normal += response.energy.stored_normal;
            tally.energy.stored_shear += response.energy.stored_shear;
            tally.energy.stored_bending += response.energy.stored_bending;
            tally.energy.stored_twist += response.energy.stored_twist;
            tally.force_squared += force.norm_squared();
        }
        if PERIODIC {
            tally.virial += (normal * point.length) * force.transpose();
            if link.image != [0, 0, 0] {
                let i = link.image;
                tally.crossing += force * Vec3::new(f64::from(i[0]), f64::from(i[1]), f64::from(i[2])).transpose();
            }
        }
        let lever = normal.cross(&force);
        let mut torque_a = lever * arm_a;
        let mut torque_b = lever * arm_b;
        if L::TRANSMITS_MOMENT {
            torque_a += response.moment;
            torque_b -= response.moment;
        }
        tile.force[a - tile.base] += force;
        tile.torque[a - tile.base] += torque_a;
        if local {
            tile.force[b - tile.base] -= force;
            tile.torque[b - tile.base] += torque_b;
        } else {
            tile.halo[next_slot] = Wrench { force: -force, torque: torque_b };
            next_slot += 1;
        }
    }
    tally
}

/// Make a contact of a candidate whose surfaces, or those a broken bond kept, meet; whether they do.
#[cold]
#[inline(never)]
fn activate<L: ContactLaw>(
    link: &mut Link,
    reference: &mut Reference,
    frame: &mut Frame,
    between: &Vec3,
    before: &Vec3,
    radius_a: f64,
    radius_b: f64,
) -> bool {
    let length = between.norm();
    let opening = if link.has(Link::KEPT_REFERENCE) { length - reference.length } else { length - radius_a - radius_b };
    if opening >= 0.0 {
        return false;
    }
    let length_before = before.norm();
    *frame = Frame { normal: before / length_before, length: length_before };
    link.flags |= Link::ACTIVE;
    if !link.has(Link::KEPT_REFERENCE) {
        *reference = L::unbonded_reference(length, radius_a, radius_b);
    }
    true
}

/// What a contact holds at its beginning that nobody did as work in its first step, J: it goes on from a bond that broke
/// while it was pressed together, whose energy was booked as released, and takes a part of it back.
#[cold]
#[inline(never)]
fn taken_over(point: &PointKinematics, force: &Vec3, energy: &EnergySplit) -> f64 {
    let along = point.normal * (point.length - point.length_old);
    let work = 0.5 * force.dot(&(along + point.shear_increment));
    energy.stored() + energy.dissipated() + energy.integration - work
}

/// Mark a contact that broke or opened.
#[cold]
#[inline(never)]
fn end<S: LawState>(link: &mut Link, history: &mut S, fate: Fate, last: &S) {
    if fate == Fate::Broke {
        *history = *last;
        link.flags |= Link::BROKEN;
    } else {
        *history = S::default();
        link.flags &= !(Link::ACTIVE | Link::REPORTED);
    }
}

/// Entry of the event log.
#[cold]
#[inline(never)]
fn incident(pair: Pair, damage: f64, position: &Vec3, energy: &EnergySplit, broke: bool) -> Incident {
    Incident {
        pair,
        broke,
        damage,
        position: *position,
        energy: energy.damage,
        stored: [energy.stored_normal, energy.stored_shear, energy.stored_bending, energy.stored_twist],
    }
}
