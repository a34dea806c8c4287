//! The loop over the contacts of a tile.
//!
//! For each batch of up to 16 contacts: prefetch the particles of contacts ahead, activate candidates that begin to
//! touch, measure the batch and evaluate the law ([`Batch`]), then commit each result. Everything here is inlined into
//! one loop per law and kind of step; only rare cases are separate functions.

use bytemuck::Pod;
use concordem_contact::activate::{activate, length_of};
use concordem_contact::columns::{BATCH, Columns, Item, Lanes, Scalar};
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::kinematics::sphere_sphere::{ImageShift, Motion};
use concordem_contact::kinematics::{MotionMeasure, MotionSink, MotionSource, PointKinematics, Pose, PreviousGeometry};
use concordem_contact::law::{
    Batch, ColumnResult, ColumnResults, ContactGeometry, ContactLaw, Kinematics, Reference, Response, Status,
};
use concordem_contact::math::{Quat, Symmetric, Vec3};
use concordem_contact::prefetch::prefetch_row;
use concordem_contact::wrench::Wrench;

use super::tile_map::is_local;
use super::{BegunContact, StepContext, TILE, Totals, motion_of};
use crate::lanes::{LanesFnOnce, dispatch};
use crate::state::contacts::{ContactFlags, Pair};
use crate::state::table::Rows;

/// The contacts of a tile, and the particles and halo slots they act on.
pub struct Tile<'a, L: ContactLaw> {
    /// Index of the tile's first particle.
    pub(super) base: usize,
    /// Particles per tile.
    pub(super) length: usize,
    pub(super) pair: &'a [Pair],
    pub(super) flags: &'a mut [ContactFlags],
    pub(super) reference: Rows<'a, Reference>,
    pub(super) previous: Rows<'a, PreviousGeometry>,
    pub(super) history: Rows<'a, L::State>,
    /// Empty if bonds do not expand.
    pub(super) rest_length: &'a [f64],
    pub(super) net: &'a mut [Wrench],
    pub(super) halo: &'a mut [Wrench],
    pub(super) virials: ParticleVirials<'a>,
    pub(super) virial_halo: &'a mut [ParticleVirial],
}

/// The loop over one tile in a step without a sample, with the widest instructions of the processor.
struct PlainTileLoop<'a, 'b, L: ContactLaw, const PERIODIC: bool, const YADE: bool, const DEFORM: bool> {
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: Tile<'b, L>,
}

impl<L: ContactLaw, const PERIODIC: bool, const YADE: bool, const DEFORM: bool> LanesFnOnce
    for PlainTileLoop<'_, '_, L, PERIODIC, YADE, DEFORM>
{
    type Output = Totals;
    #[inline(always)]
    fn call<T: Lanes>(self, lanes: T) -> Totals {
        // The compiler sees which measures are possible and omits the others.
        let mode = match self.context.mode {
            MotionMeasure::Yade if YADE => MotionMeasure::Yade,
            _ if YADE => MotionMeasure::YadeRatcheting,
            _ => MotionMeasure::Finite,
        };
        run::<L, T, PERIODIC, false, DEFORM, BATCH>(mode, lanes, self.context, self.rows, self.tile)
    }
}

/// Evaluate the contacts of a tile with the loop for this law and kind of step.
///
/// Steps without a sample have their own loops for the default measure and, without a cell, for YADE's measures. All
/// other steps share one loop, to keep the program small.
#[inline(always)]
pub fn evaluate_tile<L: ContactLaw>(context: &StepContext<'_>, rows: &[L], tile: Tile<'_, L>) -> Totals {
    let (mode, periodic) = (context.mode, context.cell.is_some());
    // The loops without a sample compute neither the work of thermal expansion nor the heat of single contacts, and know no
    // temperatures.
    let plain = !context.sample && context.expansion.is_none() && !context.heats && context.softening.is_none();
    let finite = plain && (mode == MotionMeasure::Finite || L::Kinematics::ONE_MODE);
    let yade = plain && !periodic && matches!(mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting);
    // Conditions on constants of the law come first, so that the compiler omits the loops they exclude.
    if L::DEFORMS && !context.surface_displacement.is_empty() {
        if finite && !periodic {
            dispatch(PlainTileLoop::<L, false, false, true> { context, rows, tile })
        } else {
            run::<L, Scalar, true, true, true, BATCH>(mode, Scalar, context, rows, tile)
        }
    } else if finite && periodic {
        dispatch(PlainTileLoop::<L, true, false, false> { context, rows, tile })
    } else if finite {
        dispatch(PlainTileLoop::<L, false, false, false> { context, rows, tile })
    } else if !L::Kinematics::ONE_MODE && yade {
        dispatch(PlainTileLoop::<L, false, true, false> { context, rows, tile })
    } else if L::DEFORMS {
        run::<L, Scalar, true, true, true, BATCH>(mode, Scalar, context, rows, tile)
    } else {
        run::<L, Scalar, true, true, false, BATCH>(mode, Scalar, context, rows, tile)
    }
}

/// As [`evaluate_tile`], but the law gets up to `SIZE` contacts at a time in
/// [`respond_batch`](ContactLaw::respond_batch): for laws whose calls are expensive, such as those in another language. Particles must
/// be rigid.
pub fn evaluate_tile_in_blocks<L: ContactLaw, const SIZE: usize>(
    context: &StepContext<'_>,
    rows: &[L],
    tile: Tile<'_, L>,
) -> Totals {
    run::<L, Scalar, true, true, false, SIZE>(context.mode, Scalar, context, rows, tile)
}

/// The loop over the contacts of a tile, `SIZE` at a time.
#[inline(always)]
fn run<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>(
    mode: MotionMeasure,
    lanes: T,
    context: &StepContext<'_>,
    rows: &[L],
    tile: Tile<'_, L>,
) -> Totals {
    // In registers, which the evaluator is not.
    let (pairs, poses, base, length) = (tile.pair, context.poses, tile.base, tile.length);
    let count = pairs.len();
    let (totals, pending) = (Totals::default(), [PendingContact::default(); SIZE]);
    let run = None;
    let mut evaluator =
        TileEvaluator::<L, T, PERIODIC, SAMPLE, DEFORM, SIZE> { context, rows, tile, totals, pending, run, lanes };
    let mut columns = Columns::default();
    let (mut k, mut next_slot) = (0, 0);
    while k < count {
        let mut pending = 0;
        evaluator.run = None;
        if let Some(next) = evaluator.list_run(mode, pairs, poses, k, next_slot) {
            (k, next_slot, pending) = (k + SIZE, next, SIZE);
        }
        // After a run the batch is full. One call of the law in the loop: it is inlined.
        while k < count && pending < SIZE {
            if let Some(pair) = pairs.get(k + AHEAD) {
                evaluator.prefetch(mode, poses, pair.b as usize);
            }
            let slot = if is_local(pairs[k].b, base, length) {
                LOCAL
            } else {
                next_slot += 1;
                next_slot - 1
            };
            // Bonds have a force from the start; candidates from the step in which their surfaces meet.
            let flags = evaluator.tile.flags[k];
            let carried = flags.carries();
            if carried || evaluator.activate(k) {
                let counted = !flags.has(ContactFlags::NOT_OWNED);
                evaluator.pending[pending] =
                    PendingContact { contact: k as u32, slot, pair: pairs[k], begins: !carried, counted };
                pending += 1;
            } else if slot != LOCAL {
                evaluator.clear_slot(slot);
            }
            k += 1;
        }
        L::respond_batch(mode, pending, context.dt, &mut evaluator, &mut columns);
    }
    evaluator.totals
}

/// How many contacts ahead particles are prefetched.
const AHEAD: usize = 2 * BATCH;

/// In place of a halo slot: B lies in the tile.
pub(super) const LOCAL: u32 = u32::MAX;

/// Evaluates the contacts of a tile in batches.
///
/// The constants say what the loop supports: a periodic cell, a sample, deformable particles.
pub(super) struct TileEvaluator<
    'a,
    L: ContactLaw,
    T: Lanes,
    const PERIODIC: bool,
    const SAMPLE: bool,
    const DEFORM: bool,
    const SIZE: usize,
> {
    pub(super) context: &'a StepContext<'a>,
    pub(super) rows: &'a [L],
    pub(super) tile: Tile<'a, L>,
    pub(super) totals: Totals,
    pub(super) pending: [PendingContact; SIZE],
    /// The contacts of the batch, if it is full, and they follow each other.
    run: Option<Run>,
    /// How it moves numbers between rows and columns.
    pub(super) lanes: T,
}

/// A full batch of contacts that follow each other, have forces, and count.
#[derive(Clone, Copy)]
struct Run {
    /// Its first contact.
    first: usize,
    /// The bits that the flags of all its contacts have.
    all: ContactFlags,
    /// The bits that any of them has.
    any: ContactFlags,
}

/// A contact of the present batch.
#[derive(Clone, Copy, Default)]
pub(super) struct PendingContact {
    /// Index of the contact in the tile.
    pub contact: u32,
    /// Its slot in the halo, or [`LOCAL`].
    pub slot: u32,
    /// Its particles.
    pub pair: Pair,
    /// Whether the contact begins in this step.
    pub begins: bool,
    /// Whether the sums of this process count the contact: it is not owned by another one.
    pub counted: bool,
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    /// Whether particles deform. The loop for cells and samples supports rigid and deformable particles.
    #[inline(always)]
    pub(super) fn deforms(&self) -> bool {
        DEFORM && (!PERIODIC || !self.context.surface_displacement.is_empty())
    }

    /// List the contacts from `k` on, if they fill a batch, and all of them have forces and count; returns the next slot of the halo.
    #[inline(always)]
    fn list_run(
        &mut self,
        mode: MotionMeasure,
        pairs: &[Pair],
        poses: &[Pose],
        k: usize,
        mut slot: u32,
    ) -> Option<u32> {
        if SIZE != BATCH {
            return None;
        }
        let flags = self.tile.flags.get(k..k + BATCH)?;
        let [all, any] = ContactFlags::all_and_any(flags);
        if !all.has(ContactFlags::ACTIVE) || any.bits & (ContactFlags::BROKEN | ContactFlags::NOT_OWNED) != 0 {
            return None;
        }
        for pair in pairs.get(k + AHEAD..).unwrap_or_default().iter().take(BATCH) {
            self.prefetch(mode, poses, pair.b as usize);
        }
        let (base, length) = (self.tile.base, self.tile.length);
        let pairs = pairs.get(k..k + BATCH)?;
        for (i, (pending, pair)) in self.pending.iter_mut().zip(pairs).enumerate() {
            let local = is_local(pair.b, base, length);
            let place = if local { LOCAL } else { slot };
            slot += u32::from(!local);
            *pending =
                PendingContact { contact: (k + i) as u32, slot: place, pair: *pair, begins: false, counted: true };
        }
        self.run = Some(Run { first: k, all, any });
        Some(slot)
    }

    /// The contacts of a batch of columns.
    #[inline(always)]
    fn listed(&self) -> [u32; BATCH] {
        let mut contacts = [0; BATCH];
        for (contact, pending) in contacts.iter_mut().zip(&self.pending) {
            *contact = pending.contact;
        }
        contacts
    }

    /// Read the rows of the first `count` contacts.
    #[inline(always)]
    fn read<R: Item + Pod>(&self, rows: &Rows<'_, R>, count: usize, arrays: &mut R::Arrays) {
        match self.run {
            Some(run) => rows.read_run(run.first, arrays),
            None => rows.read(&self.listed()[..count], arrays),
        }
    }

    /// Write zeros to the halo slot of a contact without force.
    #[inline(always)]
    pub(super) fn clear_slot(&mut self, slot: u32) {
        self.tile.halo[slot as usize] = Wrench::default();
        if self.deforms() {
            self.tile.virial_halo[slot as usize] = ParticleVirial::default();
        }
    }

    #[inline(always)]
    pub(super) fn image(&self, k: usize) -> ImageShift {
        match self.context.cell {
            Some(cell) if PERIODIC => ImageShift::of(cell, self.tile.flags[k].image, self.context.mode),
            _ => ImageShift::default(),
        }
    }

    /// Prefetch what a contact will read and write of its particle `b`. A needs no prefetch, because it follows the order of the contacts.
    #[inline(always)]
    fn prefetch(&self, mode: MotionMeasure, poses: &[Pose], b: usize) {
        let particles = self.context.particles;
        prefetch_row(poses, b);
        // A tile of usual size stays in the cache.
        if self.tile.length > TILE {
            prefetch_row(self.tile.net, b.wrapping_sub(self.tile.base));
        }
        if !PERIODIC && !L::Kinematics::ONE_MODE && mode != MotionMeasure::Finite {
            prefetch_row(&particles.velocity, b);
            prefetch_row(&particles.angular_velocity, b);
        }
        if self.deforms() {
            prefetch_row(self.context.surface_displacement, b);
        }
    }

    /// Rotations of two particles in the step, where their poses contain orientations: in scenes with beams. A separate function,
    /// or else the compiler would select the address of each number for every contact.
    #[cold]
    #[inline(never)]
    fn rotations_in_step(&self, Pair { a, b }: Pair) -> [Quat; 2] {
        [a, b].map(|p| self.context.particles.rotation_increment[p as usize])
    }

    /// How far the surfaces of a contact's particles had moved towards each other one step ago, m.
    #[inline(always)]
    fn surface_approach_before(&self, contact: u32) -> f64 {
        let before = |p: u32| self.context.surface_displacement_before(p as usize);
        let Pair { a, b } = self.tile.pair[contact as usize];
        (before(a) + before(b)).quadratic(&self.tile.previous.get(contact as usize).normal)
    }

    /// Evaluate contact `i` again, because it ends in this step and its response then also depends on the elongation
    /// one step ago. `approach`: how far the surfaces have moved towards each other, m.
    #[cold]
    #[inline(never)]
    fn evaluate_again(&mut self, i: usize, kinematics: L::Kinematics, approach: f64) {
        let contact = self.pending[i].contact;
        let deformed = kinematics.with_surface_displacement(approach, self.surface_approach_before(contact));
        let response = self.law(i).respond(&deformed, &self.history(i), self.context.dt);
        self.commit(i, deformed.point(), &response);
    }

    /// Activate candidate `k` if its surfaces meet; returns whether they do.
    #[inline(never)]
    fn activate(&mut self, k: usize) -> bool {
        let flags = &self.tile.flags[k];
        if flags.has(ContactFlags::BROKEN) {
            return false;
        }
        let (a, b) = (self.tile.pair[k].a as usize, self.tile.pair[k].b as usize);
        let image = self.image(k);
        let particles = self.context.particles;
        let (radius_a, radius_b) = (particles.radius[a], particles.radius[b]);
        let (motion_a, motion_b) = (motion_of(particles, a), motion_of(particles, b));
        let between = motion_b.position + image.displacement - motion_a.position;
        // The velocities give the branch vector one step ago, so candidates need not store it.
        let before = between - (motion_b.velocity + image.velocity - motion_a.velocity) * self.context.dt;
        let surface_displacement = if self.deforms() {
            let normal = between.normalize();
            self.context.surface_approach(a, b, &normal, &normal).0
        } else {
            0.0
        };
        let tile = &mut self.tile;
        let (mut reference, mut previous) = (tile.reference.get(k), tile.previous.get(k));
        let (flags, radii) = (&mut tile.flags[k], [radius_a, radius_b]);
        let length = length_of(&between, self.context.mode);
        let begins = activate::<L>(flags, &mut reference, &mut previous, length, &before, radii, surface_displacement);
        if begins {
            tile.reference.set(k, reference);
            tile.previous.set(k, previous);
        }
        if L::STIFFENS && begins {
            let ContactFlags { row, image, .. } = *flags;
            self.totals.begun.push(BegunContact { pair: tile.pair[k], image, row });
        }
        begins
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    MotionSource for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    const PERIODIC: bool = PERIODIC;
    const DEFORM: bool = DEFORM;

    #[inline(always)]
    fn lanes(&self) -> impl Lanes {
        self.lanes
    }

    #[inline(always)]
    fn poses(&self, i: usize) -> [&Pose; 2] {
        let Pair { a, b } = self.pending[i].pair;
        [&self.context.poses[a as usize], &self.context.poses[b as usize]]
    }

    #[inline(always)]
    fn has_rotations(&self) -> bool {
        self.context.oriented
    }

    #[inline(always)]
    fn crosses(&self) -> bool {
        self.run.is_none_or(|run| run.any.image != [0; 3])
    }

    #[inline(always)]
    fn all_bonded(&self) -> bool {
        self.run.is_some_and(|run| run.all.has(ContactFlags::BONDED))
    }

    #[inline(always)]
    fn rotations(&self, i: usize) -> Option<[Quat; 2]> {
        self.context.oriented.then(|| self.rotations_in_step(self.pending[i].pair))
    }

    #[inline(always)]
    fn shift(&self, i: usize) -> Option<Vec3> {
        let k = self.pending[i].contact as usize;
        (self.tile.flags[k].image != [0; 3]).then(|| self.image(k).displacement)
    }

    #[inline(always)]
    fn motions(&self, i: usize) -> ([Motion; 2], ImageShift) {
        let PendingContact { contact, pair: Pair { a, b }, .. } = self.pending[i];
        let k = contact as usize;
        let particles = self.context.particles;
        ([motion_of(particles, a as usize), motion_of(particles, b as usize)], self.image(k))
    }

    #[inline(always)]
    fn velocities(&self, i: usize) -> ([&Vec3; 2], [&Vec3; 2]) {
        let (Pair { a, b }, particles) = (self.pending[i].pair, self.context.particles);
        let (velocity, spin) = (&particles.velocity, &particles.angular_velocity);
        ([&velocity[a as usize], &velocity[b as usize]], [&spin[a as usize], &spin[b as usize]])
    }

    #[inline(always)]
    fn ends(&self, i: usize) -> ([Vec3; 2], [Quat; 2], Vec3) {
        let PendingContact { contact, pair: Pair { a, b }, .. } = self.pending[i];
        let k = contact as usize;
        debug_assert!(self.context.oriented);
        let both = [&self.context.poses[a as usize], &self.context.poses[b as usize]];
        (both.map(|pose| pose.position), both.map(|pose| pose.rotation), self.image(k).displacement)
    }

    #[inline(always)]
    fn constants(&self, i: usize) -> (ContactGeometry, PreviousGeometry, bool) {
        let Pair { a, b } = self.pending[i].pair;
        let [radius_a, radius_b] = [a, b].map(|p| self.context.poses[p as usize].radius);
        let ([mass_a, mass_b], k) = (self.masses(i), self.pending[i].contact as usize);
        let Reference { length: reference_length, area } = self.tile.reference.get(k);
        let geometry = ContactGeometry { reference_length, area, radius_a, radius_b, mass_a, mass_b };
        (geometry, self.previous(i), self.bonded(i))
    }

    #[inline(always)]
    fn bonded(&self, i: usize) -> bool {
        self.tile.flags[self.pending[i].contact as usize].has(ContactFlags::BONDED)
    }

    #[inline(always)]
    fn read_references(&self, count: usize, arrays: &mut <Reference as Item>::Arrays) {
        self.read(&self.tile.reference, count, arrays);
    }

    #[inline(always)]
    fn previous(&self, i: usize) -> PreviousGeometry {
        self.tile.previous.get(self.pending[i].contact as usize)
    }

    #[inline(always)]
    fn read_previous(&self, count: usize, arrays: &mut <PreviousGeometry as Item>::Arrays) {
        self.read(&self.tile.previous, count, arrays);
    }

    #[inline(always)]
    fn masses(&self, i: usize) -> [f64; 2] {
        let Pair { a, b } = self.pending[i].pair;
        [a, b].map(|p| self.context.particles.mass[p as usize])
    }

    #[inline(always)]
    fn read_masses(&self, count: usize, [of_a, of_b]: [&mut [f64; BATCH]; 2]) {
        let mass = &self.context.particles.mass[..];
        for ((a, b), pending) in of_a.iter_mut().zip(of_b).zip(&self.pending[..count]) {
            (*a, *b) = (mass[pending.pair.a as usize], mass[pending.pair.b as usize]);
        }
    }

    #[inline(always)]
    fn surface_displacement(&self, i: usize) -> Symmetric {
        let Pair { a, b } = self.pending[i].pair;
        self.context.surface_displacement[a as usize].0 + self.context.surface_displacement[b as usize].0
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize>
    MotionSink<L::Kinematics> for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    #[inline(always)]
    fn evaluate(&mut self, i: usize, kinematics: &L::Kinematics) {
        if SAMPLE
            && L::VARIES
            && let Some(softened) = self.context.softening
        {
            self.evaluate_softened(i, kinematics, &softened);
            return;
        }
        let (law, history) = (self.law(i), self.history(i));
        if !self.deforms() {
            let response = law.respond(kinematics, &history, self.context.dt);
            self.commit(i, kinematics.point(), &response);
            return;
        }
        let PendingContact { contact, begins, .. } = self.pending[i];
        let now = self.surface_displacement(i).quadratic(&kinematics.point().normal);
        // The approach one step ago costs memory traffic, so it stays NaN for surviving contacts of laws that do not
        // read it.
        let reads_before = L::READS_OLD_ELONGATION || begins;
        let before = if reads_before { self.surface_approach_before(contact) } else { f64::NAN };
        let deformed = kinematics.with_surface_displacement(now, before);
        let response = law.respond(&deformed, &history, self.context.dt);
        if !reads_before && response.status != Status::Lives {
            self.evaluate_again(i, *kinematics, now);
            return;
        }
        self.commit(i, deformed.point(), &response);
    }
}

impl<L: ContactLaw, T: Lanes, const PERIODIC: bool, const SAMPLE: bool, const DEFORM: bool, const SIZE: usize> Batch<L>
    for TileEvaluator<'_, L, T, PERIODIC, SAMPLE, DEFORM, SIZE>
{
    const SAMPLE: bool = SAMPLE;

    #[inline(always)]
    fn history(&self, i: usize) -> L::State {
        self.tile.history.get(self.pending[i].contact as usize)
    }

    #[inline(always)]
    fn read_histories(&self, count: usize, arrays: &mut <L::State as Item>::Arrays) {
        self.read(&self.tile.history, count, arrays);
    }

    #[inline(always)]
    fn law(&self, i: usize) -> &L {
        &self.rows[self.tile.flags[self.pending[i].contact as usize].row as usize]
    }

    #[inline(always)]
    fn alike(&self, count: usize) -> bool {
        let row = |pending: &PendingContact| self.tile.flags[pending.contact as usize].row;
        if let Some(run) = self.run {
            return run.all.row == run.any.row;
        }
        self.rows.len() == 1 || self.pending[..count].iter().all(|pending| row(pending) == row(&self.pending[0]))
    }

    #[inline(always)]
    fn inherits(&self, i: usize) -> bool {
        let PendingContact { contact, begins, .. } = self.pending[i];
        begins && self.tile.flags[contact as usize].has(ContactFlags::KEPT_REFERENCE)
    }

    #[inline(always)]
    fn may_inherit(&self) -> bool {
        self.run.is_none()
    }

    #[inline(always)]
    fn damage_threshold(&self) -> f64 {
        self.context.damage_threshold
    }

    #[inline(always)]
    fn reports(&self, i: usize, state: &L::State) -> bool {
        let flags = &self.tile.flags[self.pending[i].contact as usize];
        L::damage(state) >= self.context.damage_threshold && !flags.has(ContactFlags::REPORTED)
    }

    #[inline(always)]
    fn dashpots_strain(&self) -> bool {
        self.context.dashpots_strain
    }

    #[inline(always)]
    fn commit(&mut self, i: usize, point: &PointKinematics, response: &Response<L::State>) {
        if self.deforms() {
            let viscous = L::viscous_force(&point.normal, &response.state);
            let virial = ParticleVirial::of(&point.normal, &response.force, &viscous, self.context.dashpots_strain);
            self.commit_response(i, point, response, Some(&virial));
        } else {
            self.commit_response(i, point, response, None);
        }
    }

    #[inline(always)]
    fn store_geometries(&mut self, count: usize, arrays: &<PreviousGeometry as Item>::Arrays) {
        match self.run {
            Some(run) => self.tile.previous.write_run(run.first, arrays),
            None => self.tile.previous.write(&self.listed()[..count], arrays),
        }
    }

    #[inline(always)]
    fn store_histories(&mut self, count: usize, arrays: &<L::State as Item>::Arrays) {
        match self.run {
            Some(run) => self.tile.history.write_run(run.first, arrays),
            None => self.tile.history.write(&self.listed()[..count], arrays),
        }
    }

    #[inline(always)]
    fn commit_result(&mut self, i: usize, result: &impl ColumnResult) {
        self.commit_batch_result(i, result);
    }

    #[inline(always)]
    fn commit_four(&mut self, i: usize, results: &impl ColumnResults<L>) {
        self.commit_four_results(i, results);
    }
}
