//! Contact forces, evaluated tile by tile: parallel, and bitwise the same for any number of threads.
//!
//! Particles are cut into tiles of [`TILE`] consecutive indices (a compact lump of space, since the order follows a
//! space-filling curve). A tile owns the contacts whose A lies in it. It adds forces on its own particles directly,
//! and writes the force on a B of another tile to a halo slot of its own. Then every particle adds the halo slots
//! meant for it in ascending order. Which operations are done, and in which order, depends on the particle numbering
//! alone, never on the threads.

use rayon::prelude::*;

use crate::record::{self, ContactForces, WallForces};
use crate::state::contacts::{ContactBlock, ContactFlags, Contacts, Pair};
use crate::state::{Cell, Constraint, Particles, Wall};
use crate::walls;
use concordem_contact::kinematics::deformable::{Deformable, ParticleVirial, ParticleVirials, SurfaceDisplacement};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion};
use concordem_contact::kinematics::{
    BATCH, Batch, BatchResult, BranchVector, Columns, MotionMeasure, PointKinematics, Pose, PreviousGeometry, torques,
};
use concordem_contact::law::{
    ContactGeometry, ContactLaw, EnergySplit, Kinematics, LawState, Reference, Response, Status,
};
use concordem_contact::math::{Mat3, Quat, Symmetric, Vec3};
use concordem_contact::prefetch::prefetch_row;

/// Particles per tile; a solver that evaluates a share of a distributed computation has one tile instead
/// ([`Solver::for_subdomain`](super::Solver::for_subdomain)).
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
    /// What measures read of them, packed.
    pub poses: &'a [Pose],
    /// Whether `poses` have orientations, and not rotations of the step.
    pub oriented: bool,
    /// Periodic cell.
    pub cell: Option<&'a Cell>,
    /// How motion is measured.
    pub mode: MotionMeasure,
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub damage_threshold: f64,
    /// Whether stored energies and the squares of the contact forces are wanted: state functions, needed only when a
    /// sample is taken. (Dissipation is summed at every step.)
    pub sample: bool,
    /// How far the surfaces of particles moved out, by particle; empty if particles do not deform.
    pub surface_displacement: &'a [SurfaceDisplacement],
    /// The same one step ago, m; empty if most contacts do not ask.
    pub surface_displacement_before: &'a [Symmetric],
    /// How particles deform, if they do.
    pub deformable: Option<&'a Deformable>,
    /// Whether forces of dashpots strain the particles.
    pub dashpots_strain: bool,
    /// Prescribed translations whose reactions strain the particles: all, or those in the plane.
    pub reacting: Constraint,
}

impl StepContext<'_> {
    /// By how much the surfaces of particles `a` and `b` moved towards each other along the normals of now and of one
    /// step ago, m.
    #[inline(always)]
    pub fn surface_approach(&self, a: usize, b: usize, normal: &Vec3, normal_old: &Vec3) -> (f64, f64) {
        let before = self.surface_displacement_before(a) + self.surface_displacement_before(b);
        (
            (self.surface_displacement[a].0 + self.surface_displacement[b].0).quadratic(normal),
            before.quadratic(normal_old),
        )
    }

    /// How far the surface of particle `p` had moved out one step ago, m.
    #[inline(always)]
    pub fn surface_displacement_before(&self, p: usize) -> Symmetric {
        self.surface_displacement_before.get(p).copied().unwrap_or_else(|| self.find_surface_displacement_before(p))
    }

    #[cold]
    #[inline(never)]
    fn find_surface_displacement_before(&self, p: usize) -> Symmetric {
        let Particles { material, radius, deformation, .. } = self.particles;
        self.deformable.map_or_else(Symmetric::default, |deformable| {
            deformable.compliance(material[p], radius[p]).surface_displacement(&deformation[p].used)
        })
    }
}

/// What happened to a bond, noted by index.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BondEvent {
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
pub struct Totals {
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
    pub bond_events: Vec<BondEvent>,
}

impl Totals {
    /// Add another tally.
    pub fn merge(&mut self, other: Self) {
        self.energy += other.energy;
        self.virial += other.virial;
        self.crossing += other.crossing;
        self.active += other.active;
        self.force_squared += other.force_squared;
        self.bond_events.extend(other.bond_events);
    }
}

/// Division of one block into tiles, and where the halo goes. Scratch: rebuilt whenever the contacts change.
#[derive(Debug, Clone, Default)]
pub struct TileMap {
    /// Particles per tile.
    tile: usize,
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
    /// The same slots for what deforms particles, if they do.
    virial_halo: Vec<ParticleVirial>,
}

impl TileMap {
    /// Map of a block sorted by A, for tiles of `tile` particles.
    pub fn new(block: &dyn Contacts, particle_count: usize, tile_length: usize) -> Self {
        let tiles = particle_count.div_ceil(tile_length).max(1);
        let mut contact_start = Vec::with_capacity(tiles + 1);
        let mut halo_start = Vec::with_capacity(tiles + 1);
        let mut target_count = vec![0u32; particle_count + 1];
        let mut targets = Vec::new();
        let (mut k, count) = (0, block.len());
        for tile in 0..tiles {
            contact_start.push(k as u32);
            halo_start.push(targets.len() as u32);
            let end = (tile + 1) * tile_length;
            while k < count {
                let pair = block.view(k).pair;
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
        Self { tile: tile_length, contact_start, halo_start, target_start, slots, halo, virial_halo: Vec::new() }
    }

    /// Halo contributions to particle `p`, in order.
    #[inline(always)]
    pub fn incoming(&self, p: usize) -> impl Iterator<Item = &Wrench> {
        let range = self.target_start[p] as usize..self.target_start[p + 1] as usize;
        self.slots[range].iter().map(|&slot| &self.halo[slot as usize])
    }

    /// What contacts of other tiles do to the shape of particle `p`, in order.
    #[inline(always)]
    pub fn incoming_virials(&self, p: usize) -> impl Iterator<Item = &ParticleVirial> {
        let range = self.target_start[p] as usize..self.target_start[p + 1] as usize;
        self.slots[range].iter().map(|&slot| &self.virial_halo[slot as usize])
    }

    /// Fetch [`Self::incoming_virials`] of particle `p`, which will be read soon.
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

#[inline(always)]
fn is_local(b: u32, base: usize, tile_len: usize) -> bool {
    (b as usize).wrapping_sub(base) < tile_len
}

/// A block the solver can evaluate.
pub trait EvaluatedContacts: Contacts {
    /// Evaluate all contacts: forces and torques on particles of the contact's own tile are added to `force` and
    /// `torque`, the others go to the map's halo. Histories advance by one step. If particles deform, the same is done
    /// with `virials`, which is empty otherwise.
    fn evaluate(
        &mut self,
        context: &StepContext<'_>,
        map: &mut TileMap,
        force: &mut [Vec3],
        torque: &mut [Vec3],
        virials: ParticleVirials<'_>,
    ) -> Totals;
    /// Evaluate contacts with walls; `b` of a pair numbers the wall elements through all walls. Forces on particles are
    /// added to `force` and `torque` (and `virials`, if particles deform), forces of the particles on the walls to the walls.
    /// Histories advance.
    fn evaluate_walls(
        &mut self,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        force: &mut [Vec3],
        torque: &mut [Vec3],
        virials: ParticleVirials<'_>,
    ) -> Totals;
    /// Add the forces of all contacts at the present positions; histories stay.
    fn record(&self, context: &StepContext<'_>, out: &mut ContactForces);
    /// The same for contacts with walls.
    fn record_walls(&self, context: &StepContext<'_>, walls: &[Wall], out: &mut WallForces);
    /// Copy of the block behind the trait.
    fn boxed_clone(&self) -> Box<dyn EvaluatedContacts>;
    /// The block as plain contacts.
    fn contacts(&self) -> &dyn Contacts;
    /// The block as plain contacts.
    fn contacts_mut(&mut self) -> &mut dyn Contacts;
}

struct Tile<'a, L: ContactLaw> {
    base: usize,
    length: usize,
    pair: &'a [Pair],
    link: &'a mut [ContactFlags],
    reference: &'a mut [Reference],
    frame: &'a mut [PreviousGeometry],
    history: &'a mut [L::State],
    force: &'a mut [Vec3],
    torque: &'a mut [Vec3],
    halo: &'a mut [Wrench],
    virials: ParticleVirials<'a>,
    virial_halo: &'a mut [ParticleVirial],
}

impl<L: ContactLaw> EvaluatedContacts for ContactBlock<L> {
    fn evaluate(
        &mut self,
        context: &StepContext<'_>,
        map: &mut TileMap,
        force: &mut [Vec3],
        torque: &mut [Vec3],
        mut virials: ParticleVirials<'_>,
    ) -> Totals {
        let rows = &self.rows;
        if !virials.dyads.is_empty() {
            map.virial_halo.resize(map.halo.len(), ParticleVirial::default());
        }
        let mut virial_halo = &mut map.virial_halo[..];
        let mut tiles = Vec::with_capacity(map.contact_start.len());
        let mut pair = &self.pair[..];
        let mut link = &mut self.link[..];
        let mut reference = &mut self.reference[..];
        let mut frame = &mut self.frame[..];
        let mut history = &mut self.history[..];
        let mut halo = &mut map.halo[..];
        let length = map.tile;
        for (t, (force, torque)) in force.chunks_mut(length).zip(torque.chunks_mut(length)).enumerate() {
            let contacts = (map.contact_start[t + 1] - map.contact_start[t]) as usize;
            let slots = (map.halo_start[t + 1] - map.halo_start[t]) as usize;
            tiles.push(Tile::<L> {
                base: t * length,
                length,
                pair: pair.split_off(..contacts).unwrap_or_default(),
                link: link.split_off_mut(..contacts).unwrap_or_default(),
                reference: reference.split_off_mut(..contacts).unwrap_or_default(),
                frame: frame.split_off_mut(..contacts).unwrap_or_default(),
                history: history.split_off_mut(..contacts).unwrap_or_default(),
                force,
                torque,
                halo: halo.split_off_mut(..slots).unwrap_or_default(),
                virials: virials.split_off(length),
                virial_halo: virial_halo.split_off_mut(..slots.min(virial_halo.len())).unwrap_or_default(),
            });
        }
        let tile_totals: Vec<Totals> = tiles.into_par_iter().map(|tile| dispatch(context, rows, tile)).collect();
        let mut total = Totals::default();
        for totals in tile_totals {
            total.merge(totals);
        }
        total
    }
    fn evaluate_walls(
        &mut self,
        context: &StepContext<'_>,
        walls: &mut [Wall],
        force: &mut [Vec3],
        torque: &mut [Vec3],
        mut virials: ParticleVirials<'_>,
    ) -> Totals {
        walls::evaluate(self, context, walls, force, torque, &mut virials, None)
    }
    fn record(&self, context: &StepContext<'_>, out: &mut ContactForces) {
        record::record(self, context, out);
    }
    fn record_walls(&self, context: &StepContext<'_>, walls: &[Wall], out: &mut WallForces) {
        record::record_walls(self, context, walls, out);
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

/// The loop over one tile without a sample, as something that [`pulp`] can run with the newest instructions of the processor.
/// They give the same bits: nothing is fused or reordered.
struct PlainTileLoop<'a, 'b, L: ContactLaw, const PERIODIC: bool, const YADE: bool, const DEFORM: bool> {
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: Tile<'b, L>,
}

impl<L: ContactLaw, const PERIODIC: bool, const YADE: bool, const DEFORM: bool> pulp::NullaryFnOnce
    for PlainTileLoop<'_, '_, L, PERIODIC, YADE, DEFORM>
{
    type Output = Totals;
    #[inline(always)]
    fn call(self) -> Totals {
        // Said so that measures of other modes are not compiled.
        let mode = match self.context.mode {
            MotionMeasure::Yade if YADE => MotionMeasure::Yade,
            _ if YADE => MotionMeasure::YadeRatcheting,
            _ => MotionMeasure::Finite,
        };
        run::<L, PERIODIC, false, DEFORM>(mode, self.context, self.rows, self.tile)
    }
}

/// Choose the loop: the default measure and, without a cell, YADE's have loops of their own when there is no sample; the others
/// share one, to keep the program small.
fn dispatch<L: ContactLaw>(context: &StepContext<'_>, rows: &[L], tile: Tile<'_, L>) -> Totals {
    let (mode, periodic) = (context.mode, context.cell.is_some());
    let finite = !context.sample && (mode == MotionMeasure::Finite || L::Kinematics::ONE_MODE);
    let yade = !context.sample && !periodic && matches!(mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
    let arch = pulp::Arch::new();
    // Conditions on constants of the law first: what they exclude is not compiled.
    if L::DEFORMS && !context.surface_displacement.is_empty() {
        if finite && !periodic {
            arch.dispatch(PlainTileLoop::<L, false, false, true> { context, rows, tile })
        } else {
            run::<L, true, true, true>(mode, context, rows, tile)
        }
    } else if finite && periodic {
        arch.dispatch(PlainTileLoop::<L, true, false, false> { context, rows, tile })
    } else if finite {
        arch.dispatch(PlainTileLoop::<L, false, false, false> { context, rows, tile })
    } else if !L::Kinematics::ONE_MODE && yade {
        arch.dispatch(PlainTileLoop::<L, false, true, false> { context, rows, tile })
    } else if L::DEFORMS {
        run::<L, true, true, true>(mode, context, rows, tile)
    } else {
        run::<L, true, true, false>(mode, context, rows, tile)
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

/// The loop over the contacts of a tile.
#[inline(always)]
fn run<L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool>(
    mode: MotionMeasure,
    context: &StepContext<'_>,
    rows: &[L],
    tile: Tile<'_, L>,
) -> Totals {
    let count = tile.pair.len();
    let (totals, pending) = (Totals::default(), [PendingContact::default(); BATCH]);
    let mut queue = TileEvaluator::<L, PERIODIC, SAMPLE, DEFORM> { context, rows, tile, totals, pending };
    let mut columns = Columns::default();
    let (mut k, mut next_slot) = (0, 0);
    while k < count {
        let mut pending = 0;
        while k < count && pending < BATCH {
            queue.fetch(k + 2 * BATCH);
            let slot = if is_local(queue.tile.pair[k].b, queue.tile.base, queue.tile.length) {
                LOCAL
            } else {
                next_slot += 1;
                next_slot - 1
            };
            // Bonds carry from the start; candidates when their surfaces (or those a broken bond kept) meet.
            let carried = queue.tile.link[k].carries();
            if carried || queue.activate(k) {
                queue.pending[pending] = PendingContact { contact: k as u32, slot, begins: !carried };
                pending += 1;
            } else if slot != LOCAL {
                queue.leave_empty(slot);
            }
            k += 1;
        }
        L::respond_batch(mode, pending, context.dt, &mut queue, &mut columns);
    }
    queue.totals
}

/// In place of a halo slot: B lies in the tile.
const LOCAL: u32 = u32::MAX;

/// A tile at work: contacts wait here until a batch of them is measured, then the law answers them in order.
struct TileEvaluator<'a, L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool> {
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: Tile<'a, L>,
    totals: Totals,
    pending: [PendingContact; BATCH],
}

#[derive(Clone, Copy, Default)]
struct PendingContact {
    contact: u32,
    /// Slot in the halo.
    slot: u32,
    /// Whether the contact carries from this step on.
    begins: bool,
}

impl<L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool>
    TileEvaluator<'_, L, PERIODIC, SAMPLE, DEFORM>
{
    /// Whether particles deform. The loop for cells and samples serves both kinds of particles.
    #[inline(always)]
    fn deforms(&self) -> bool {
        DEFORM && (!PERIODIC || !self.context.surface_displacement.is_empty())
    }

    /// Nothing comes from the contact of this halo slot.
    #[inline(always)]
    fn leave_empty(&mut self, slot: u32) {
        self.tile.halo[slot as usize] = Wrench::default();
        if self.deforms() {
            self.tile.virial_halo[slot as usize] = ParticleVirial::default();
        }
    }

    #[inline(always)]
    fn image(&self, k: usize) -> ImageShift {
        match self.context.cell {
            Some(cell) if PERIODIC => ImageShift::of(cell, self.tile.link[k].image, self.context.mode),
            _ => ImageShift::default(),
        }
    }

    /// Fetch what will be read of a contact's B; A follows the order of contacts.
    #[inline(always)]
    fn fetch(&self, k: usize) {
        let Some(pair) = self.tile.pair.get(k) else { return };
        let (b, particles) = (pair.b as usize, self.context.particles);
        prefetch_row(self.context.poses, b);
        if !PERIODIC && !L::Kinematics::ONE_MODE && self.context.mode != MotionMeasure::Finite {
            prefetch_row(&particles.position, b);
            prefetch_row(&particles.velocity, b);
            prefetch_row(&particles.angular_velocity, b);
        }
        if self.deforms() {
            prefetch_row(self.context.surface_displacement, b);
        }
    }

    /// By how much the surfaces of a contact's particles had moved towards each other one step ago, m.
    #[inline(always)]
    fn surface_approach_before(&self, contact: u32) -> f64 {
        let before = |p: u32| self.context.surface_displacement_before(p as usize);
        let Pair { a, b } = self.tile.pair[contact as usize];
        (before(a) + before(b)).quadratic(&self.tile.frame[contact as usize].normal)
    }

    /// [`Batch::evaluate`] to a contact that ends, whose answer depends on the elongation of one step ago, too. `now`: by how
    /// much its particles widened, m.
    #[cold]
    #[inline(never)]
    fn evaluate_again(&mut self, i: usize, kinematics: L::Kinematics, now: f64) {
        let contact = self.pending[i].contact;
        let deformed = kinematics.with_surface_displacement(now, self.surface_approach_before(contact));
        let (law, history) = self.law(i);
        let response = law.respond(&deformed, history, self.context.dt);
        self.commit(i, deformed.point(), &response);
    }

    /// Make a contact of candidate `k` if its surfaces, or those a broken bond kept, meet; whether they do.
    #[inline(never)]
    fn activate(&mut self, k: usize) -> bool {
        let link = &self.tile.link[k];
        if link.has(ContactFlags::BROKEN) {
            return false;
        }
        let (a, b) = (self.tile.pair[k].a as usize, self.tile.pair[k].b as usize);
        let image = self.image(k);
        let particles = self.context.particles;
        let (radius_a, radius_b) = (particles.radius[a], particles.radius[b]);
        let (motion_a, motion_b) = (motion_of(particles, a), motion_of(particles, b));
        let between = motion_b.position + image.displacement - motion_a.position;
        // Where it was one step ago follows from the velocities, so that candidates need no memory.
        let before = between - (motion_b.velocity + image.velocity - motion_a.velocity) * self.context.dt;
        let surface_displacement = if self.deforms() {
            let normal = between.normalize();
            self.context.surface_approach(a, b, &normal, &normal).0
        } else {
            0.0
        };
        let (link, reference, frame) = (&mut self.tile.link[k], &mut self.tile.reference[k], &mut self.tile.frame[k]);
        activate::<L>(link, reference, frame, &between, &before, [radius_a, radius_b], surface_displacement)
    }
}

impl<L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool> Batch<L>
    for TileEvaluator<'_, L, PERIODIC, SAMPLE, DEFORM>
{
    const PERIODIC: bool = PERIODIC;
    const SAMPLE: bool = SAMPLE;
    const DEFORM: bool = DEFORM;

    #[inline(always)]
    fn poses(&self, i: usize) -> ([Pose; 2], Vec3) {
        let k = self.pending[i].contact as usize;
        let Pair { a, b } = self.tile.pair[k];
        let mut both = [self.context.poses[a as usize], self.context.poses[b as usize]];
        if self.context.oriented {
            for (pose, p) in both.iter_mut().zip([a, b]) {
                pose.rotation = self.context.particles.rotation_increment[p as usize];
            }
        }
        (both, self.image(k).displacement)
    }

    #[inline(always)]
    fn motions(&self, i: usize) -> ([Motion; 2], ImageShift) {
        let k = self.pending[i].contact as usize;
        let Pair { a, b } = self.tile.pair[k];
        let particles = self.context.particles;
        ([motion_of(particles, a as usize), motion_of(particles, b as usize)], self.image(k))
    }

    #[inline(always)]
    fn ends(&self, i: usize) -> ([Vec3; 2], [Quat; 2], Vec3) {
        let k = self.pending[i].contact as usize;
        let Pair { a, b } = self.tile.pair[k];
        debug_assert!(self.context.oriented);
        let both = [&self.context.poses[a as usize], &self.context.poses[b as usize]];
        (both.map(|pose| pose.position), both.map(|pose| pose.rotation), self.image(k).displacement)
    }

    #[inline(always)]
    fn constants(&self, i: usize) -> (ContactGeometry, PreviousGeometry, bool) {
        let Pair { a, b } = self.tile.pair[self.pending[i].contact as usize];
        let [radius_a, radius_b] = [a, b].map(|p| self.context.poses[p as usize].radius);
        let ([mass_a, mass_b], (Reference { length, area }, bonded)) = (self.masses(i), self.reference(i));
        let geometry = ContactGeometry { reference_length: length, area, radius_a, radius_b, mass_a, mass_b };
        (geometry, self.frame(i), bonded)
    }

    #[inline(always)]
    fn reference(&self, i: usize) -> (Reference, bool) {
        let k = self.pending[i].contact as usize;
        (self.tile.reference[k], self.tile.link[k].has(ContactFlags::BONDED))
    }

    #[inline(always)]
    fn frame(&self, i: usize) -> PreviousGeometry {
        self.tile.frame[self.pending[i].contact as usize]
    }

    #[inline(always)]
    fn masses(&self, i: usize) -> [f64; 2] {
        let Pair { a, b } = self.tile.pair[self.pending[i].contact as usize];
        [a, b].map(|p| self.context.particles.mass[p as usize])
    }

    #[inline(always)]
    fn history(&self, i: usize) -> &L::State {
        &self.tile.history[self.pending[i].contact as usize]
    }

    #[inline(always)]
    fn law(&self, i: usize) -> (&L, &L::State) {
        let k = self.pending[i].contact as usize;
        (&self.rows[self.tile.link[k].row as usize], &self.tile.history[k])
    }

    #[inline(always)]
    fn row(&self, i: usize) -> u16 {
        self.tile.link[self.pending[i].contact as usize].row
    }

    #[inline(always)]
    fn surface_displacement(&self, i: usize) -> Symmetric {
        let Pair { a, b } = self.tile.pair[self.pending[i].contact as usize];
        self.context.surface_displacement[a as usize].0 + self.context.surface_displacement[b as usize].0
    }

    #[inline(always)]
    fn dashpots_strain(&self) -> bool {
        self.context.dashpots_strain
    }

    #[inline(always)]
    fn evaluate(&mut self, i: usize, kinematics: &L::Kinematics) {
        let (law, history) = self.law(i);
        if !self.deforms() {
            let response = law.respond(kinematics, history, self.context.dt);
            self.commit(i, kinematics.point(), &response);
            return;
        }
        let PendingContact { contact, begins, .. } = self.pending[i];
        let now = self.surface_displacement(i).quadratic(&kinematics.point().normal);
        let told = L::READS_OLD_ELONGATION || begins;
        let before = if told { self.surface_approach_before(contact) } else { f64::NAN };
        let deformed = kinematics.with_surface_displacement(now, before);
        let response = law.respond(&deformed, history, self.context.dt);
        if !told && response.status != Status::Lives {
            self.evaluate_again(i, *kinematics, now);
            return;
        }
        self.commit(i, deformed.point(), &response);
    }

    #[inline(always)]
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>) {
        if self.deforms() {
            let viscous = L::viscous_force(&point.normal, &response.state);
            let push = ParticleVirial::of(&point.normal, &response.force, &viscous, self.context.dashpots_strain);
            self.commit_with(i, point, response, Some(&push));
        } else {
            self.commit_with(i, point, response, None);
        }
    }

    #[inline(always)]
    fn commit_result(&mut self, i: usize, found: &BatchResult<L::State>) {
        debug_assert!(!SAMPLE && found.push.is_some() == self.deforms());
        let PendingContact { contact, slot, .. } = self.pending[i];
        let k = contact as usize;
        let BatchResult { branch: BranchVector { length, normal }, force, torques, energy, state, push } = found;
        self.tile.frame[k] = PreviousGeometry { normal: *normal, length: *length };
        if let Some(state) = state {
            self.tile.history[k] = *state;
        }
        let counted = !self.tile.link[k].has(ContactFlags::NOT_OWNED);
        if let Some([viscous, integration]) = energy
            && counted
        {
            self.totals.energy.viscous += viscous;
            self.totals.energy.integration += integration;
        }
        // Damage that passes its threshold would have to be reported.
        debug_assert!(L::damage(&self.tile.history[k]) == 0.0);
        self.accumulate(k, slot, *length, normal, force, torques, push.as_ref());
    }
}

impl<L: ContactLaw, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool>
    TileEvaluator<'_, L, PERIODIC, SAMPLE, DEFORM>
{
    /// [`Batch::commit`]; `strain`: what the contact does to the shape of its particles, if they deform.
    #[inline(always)]
    fn commit_with(
        &mut self,
        i: usize,
        point: &PointKinematics,
        response: &Response<L::State>,
        strain: Option<&ParticleVirial>,
    ) {
        let PendingContact { contact, slot, begins } = self.pending[i];
        let k = contact as usize;
        let pair = self.tile.pair[k];
        let a = pair.a as usize;
        let link = &mut self.tile.link[k];
        let history = &mut self.tile.history[k];
        let totals = &mut self.totals;
        let &PointKinematics { normal, arm_a, arm_b, .. } = point;
        if begins
            && link.has(ContactFlags::KEPT_REFERENCE)
            && !link.has(ContactFlags::NOT_OWNED)
            && point.elongation_old < 0.0
        {
            totals.energy.damage -= inherited_energy(point, &response.force, &response.energy);
        }
        self.tile.frame[k] = PreviousGeometry { normal, length: point.length };
        let counted = !link.has(ContactFlags::NOT_OWNED);
        if counted {
            totals.energy.damage += response.energy.damage;
            totals.energy.friction += response.energy.friction;
            totals.energy.viscous += response.energy.viscous;
            totals.energy.integration += response.energy.integration;
        }
        if response.status != Status::Lives {
            end(link, history, response.status, response.state);
            if response.status == Status::Broke {
                let place = self.context.poses[a].position + normal * arm_a;
                note(
                    &mut totals.bond_events,
                    pair,
                    1.0,
                    place,
                    response.energy.damage,
                    stored_by_mode(&response.energy),
                    true,
                );
            }
            if slot != LOCAL {
                self.leave_empty(slot);
            }
            return;
        }
        *history = response.state;
        let damage = L::damage(history);
        if damage >= self.context.damage_threshold && !link.has(ContactFlags::REPORTED) {
            link.flags |= ContactFlags::REPORTED;
            let place = self.context.poses[a].position + normal * arm_a;
            note(
                &mut totals.bond_events,
                pair,
                damage,
                place,
                response.energy.damage,
                stored_by_mode(&response.energy),
                false,
            );
        }
        let force = response.force;
        if SAMPLE && counted {
            totals.energy.stored_normal += response.energy.stored_normal;
            totals.energy.stored_shear += response.energy.stored_shear;
            totals.energy.stored_bending += response.energy.stored_bending;
            totals.energy.stored_twist += response.energy.stored_twist;
            totals.force_squared += force.norm_squared();
        }
        let [mut torque_a, mut torque_b] = torques(&normal, &force, [arm_a, arm_b]);
        if L::TRANSMITS_MOMENT {
            torque_a += response.moment;
            torque_b -= response.moment;
        }
        self.accumulate(k, slot, point.length, &normal, &force, &[torque_a, torque_b], strain);
    }

    /// Count contact `k` of this length (m) and normal, which carries `force` on A (N), and add that, the torques on A and B (N·m),
    /// and the strain, if particles deform, to what acts on them.
    #[inline(always)]
    fn accumulate(
        &mut self,
        k: usize,
        slot: u32,
        length: f64,
        normal: &Vec3,
        force: &Vec3,
        torques: &[Vec3; 2],
        strain: Option<&ParticleVirial>,
    ) {
        let (pair, link, totals) = (self.tile.pair[k], &self.tile.link[k], &mut self.totals);
        let counted = !link.has(ContactFlags::NOT_OWNED);
        totals.active += u64::from(counted);
        if PERIODIC && counted {
            totals.virial += (normal * length) * force.transpose();
            if link.image != [0, 0, 0] {
                let i = link.image;
                totals.crossing += force * Vec3::new(f64::from(i[0]), f64::from(i[1]), f64::from(i[2])).transpose();
            }
        }
        let (a, b) = (pair.a as usize - self.tile.base, (pair.b as usize).wrapping_sub(self.tile.base));
        if let Some(push) = strain {
            let dyads = push.dyads();
            let ParticleVirials { dyads: sums, held } = &mut self.tile.virials;
            let (constraint, reacting) = (&self.context.particles.constraint, self.context.reacting);
            sums[a] += dyads;
            if constraint[pair.a as usize].any(reacting) {
                held[a].add(push);
            }
            if slot == LOCAL {
                sums[b] += dyads;
                if constraint[pair.b as usize].any(reacting) {
                    held[b].add_opposite(push);
                }
            } else {
                self.tile.virial_halo[slot as usize] = *push;
            }
        }
        self.tile.force[a] += force;
        self.tile.torque[a] += torques[0];
        if slot == LOCAL {
            self.tile.force[b] -= force;
            self.tile.torque[b] += torques[1];
        } else {
            self.tile.halo[slot as usize] = Wrench { force: -force, torque: torques[1] };
        }
    }
}

/// What a contact holds at its beginning that nobody did as work in its first step, J: it goes on from a bond that broke
/// while it was pressed together, whose energy was booked as released, and takes a part of it back.
#[inline(always)]
fn inherited_energy(point: &PointKinematics, force: &Vec3, energy: &EnergySplit) -> f64 {
    let along = point.normal * (point.elongation - point.elongation_old);
    let work = 0.5 * force.dot(&(along + point.shear_increment));
    energy.stored() + energy.dissipated() + energy.integration - work
}

/// Make a contact of a candidate whose surfaces, or those a broken bond kept, meet when particles are `surface_displacement` (m) wider
/// than their radii say; whether they do.
#[cold]
#[inline(never)]
pub(super) fn activate<L: ContactLaw>(
    link: &mut ContactFlags,
    reference: &mut Reference,
    frame: &mut PreviousGeometry,
    between: &Vec3,
    before: &Vec3,
    [radius_a, radius_b]: [f64; 2],
    surface_displacement: f64,
) -> bool {
    let length = between.norm();
    let opening =
        if link.has(ContactFlags::KEPT_REFERENCE) { length - reference.length } else { length - radius_a - radius_b };
    if opening - surface_displacement >= 0.0 {
        return false;
    }
    let length_before = before.norm();
    *frame = PreviousGeometry { normal: before / length_before, length: length_before };
    link.flags |= ContactFlags::ACTIVE;
    if !link.has(ContactFlags::KEPT_REFERENCE) {
        *reference = L::unbonded_reference(length, radius_a, radius_b);
    }
    true
}

/// Mark a contact that broke or opened.
#[inline(always)]
fn end<S: LawState>(link: &mut ContactFlags, history: &mut S, status: Status, last: S) {
    if status == Status::Broke {
        *history = last;
        link.flags |= ContactFlags::BROKEN;
    } else {
        *history = S::default();
        link.flags &= !(ContactFlags::ACTIVE | ContactFlags::REPORTED);
    }
}

/// Energies stored in normal, shear, bending, twist, J.
#[inline(always)]
fn stored_by_mode(energy: &EnergySplit) -> [f64; 4] {
    [energy.stored_normal, energy.stored_shear, energy.stored_bending, energy.stored_twist]
}

/// Make an entry in the event log. (Of numbers made for it: an answer of which any part is given away, even as a copy, is kept in
/// memory from its beginning, not in registers, for every contact.)
#[cold]
#[inline(never)]
fn note(log: &mut Vec<BondEvent>, pair: Pair, damage: f64, position: Vec3, energy: f64, stored: [f64; 4], broke: bool) {
    log.push(BondEvent { pair, broke, damage, position, energy, stored });
}
