//! The loop over the contacts of a tile.
//!
//! For each batch of up to 16 contacts: prefetch the particles of contacts ahead, activate candidates that begin to
//! touch, measure the batch and evaluate the law ([`Batch`]), then commit each result. Everything here is inlined into
//! one loop per law and kind of step; only rare cases are separate functions.

use concordem_contact::activate::{activate, length_of};
use concordem_contact::columns::{BATCH, Columns, Lanes, Scalar};
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::kinematics::sphere_sphere::ImageShift;
use concordem_contact::kinematics::{MotionMeasure, Pose, PreviousGeometry};
use concordem_contact::law::{ContactLaw, Kinematics, Reference};
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
    let full = None;
    let mut evaluator =
        TileEvaluator::<L, T, PERIODIC, SAMPLE, DEFORM, SIZE> { context, rows, tile, totals, pending, full, lanes };
    let mut columns = Columns::default();
    let (mut k, mut next_slot) = (0, 0);
    while k < count {
        let mut pending = 0;
        evaluator.full = None;
        if let Some(next) = evaluator.list_full(mode, pairs, poses, k, next_slot) {
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
    pub(super) full: Option<FullBatch>,
    /// How it moves numbers between rows and columns.
    pub(super) lanes: T,
}

/// A full batch of contacts that follow each other, have forces, and count.
#[derive(Clone, Copy)]
pub(super) struct FullBatch {
    /// Its first contact.
    pub first: usize,
    /// The bits that the flags of all its contacts have.
    pub all: ContactFlags,
    /// The bits that any of them has.
    pub any: ContactFlags,
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
    fn list_full(
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
        self.full = Some(FullBatch { first: k, all, any });
        Some(slot)
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
