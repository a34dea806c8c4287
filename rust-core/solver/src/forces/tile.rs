//! The loop over the contacts of a tile.
//!
//! For each batch of up to 16 contacts: prefetch the particles of contacts ahead, activate candidates that begin to
//! touch, measure the batch and evaluate the law (`batch`), then commit each result. Everything here is inlined into
//! one loop per law and kind of step (`kinds`); only rare cases are separate functions.

use std::marker::PhantomData;

use concordem_contact::columns::{BATCH, Lanes, Scalar};
use concordem_contact::kinematics::deformable::{ParticleVirial, ParticleVirials};
use concordem_contact::kinematics::sphere_sphere::ImageShift;
use concordem_contact::kinematics::{MotionMeasure, Pose, PreviousGeometry};
use concordem_contact::law::{ContactLaw, Kinematics, Reference};
use concordem_contact::prefetch::prefetch_row;
use concordem_contact::straight::ContactColumns;
use concordem_contact::wrench::Wrench;

use super::kinds::{LoopKind, WithKind, choose};
use super::tile_map::is_local;
use super::{BegunContact, StepContext, TILE, Totals};
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
    /// Factors on the strengths; empty if they do not scatter.
    pub(super) strength: &'a [f64],
    pub(super) net: &'a mut [Wrench],
    pub(super) halo: &'a mut [Wrench],
    pub(super) virials: ParticleVirials<'a>,
    pub(super) virial_halo: &'a mut [ParticleVirial],
}

/// The loop over one tile with the widest instructions of the processor.
struct WideLoop<'a, 'b, L: ContactLaw, K> {
    measure: MotionMeasure,
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: Tile<'b, L>,
    kind: PhantomData<K>,
}

impl<L: ContactLaw, K: LoopKind> LanesFnOnce for WideLoop<'_, '_, L, K> {
    type Output = Totals;
    #[inline(always)]
    fn call<T: Lanes>(self, lanes: T) -> Totals {
        // The compiler sees which measures are possible and omits the others.
        let measure = match self.measure {
            MotionMeasure::Yade if K::YADE => MotionMeasure::Yade,
            _ if K::YADE => MotionMeasure::YadeRatcheting,
            _ => MotionMeasure::Finite,
        };
        run::<L, K, T>(measure, lanes, self.context, self.rows, self.tile)
    }
}

/// The loop over one tile.
struct TileLoop<'a, 'b, L: ContactLaw> {
    context: &'a StepContext<'a>,
    rows: &'a [L],
    tile: Tile<'b, L>,
}

impl<L: ContactLaw> WithKind<L> for TileLoop<'_, '_, L> {
    type Output = Totals;
    #[inline(always)]
    fn run<K: LoopKind>(self, measure: MotionMeasure) -> Totals {
        let Self { context, rows, tile } = self;
        if K::WIDE {
            dispatch(WideLoop { measure, context, rows, tile, kind: PhantomData::<K> })
        } else {
            run::<L, K, Scalar>(measure, Scalar, context, rows, tile)
        }
    }
}

/// Evaluate the contacts of a tile with the loop for this law and kind of step.
#[inline(always)]
pub fn evaluate_tile<L: ContactLaw>(context: &StepContext<'_>, rows: &[L], tile: Tile<'_, L>) -> Totals {
    choose::<L, _>(context, TileLoop { context, rows, tile })
}

/// The loop over the contacts of a tile, a batch at a time.
#[inline(always)]
fn run<L: ContactLaw, K: LoopKind, T: Lanes>(
    measure: MotionMeasure,
    lanes: T,
    context: &StepContext<'_>,
    rows: &[L],
    tile: Tile<'_, L>,
) -> Totals {
    // In registers, which the evaluator is not.
    let (pairs, poses, base, length) = (tile.pair, context.poses, tile.base, tile.length);
    let count = pairs.len();
    let mut evaluator = TileEvaluator::<L, K, T>::new(context, rows, tile, lanes);
    let mut columns = ContactColumns::default();
    let (mut k, mut next_slot) = (0, 0);
    while k < count {
        let mut pending = 0;
        evaluator.full = None;
        if let Some(next) = evaluator.list_full(measure, pairs, poses, k, next_slot) {
            (k, next_slot, pending) = (k + BATCH, next, BATCH);
        }
        // After a run the batch is full. One call of the law in the loop: it is inlined.
        while k < count && pending < BATCH {
            if let Some(pair) = pairs.get(k + AHEAD) {
                evaluator.prefetch(measure, poses, pair.b as usize);
            }
            let slot = if is_local(pairs[k].b, base, length) {
                LOCAL
            } else {
                next_slot += 1;
                next_slot - 1
            };
            if let Some(listed) = evaluator.begin(k, pairs[k], slot) {
                evaluator.pending[pending] = listed;
                pending += 1;
            }
            k += 1;
        }
        evaluator.evaluate(measure, pending, &mut columns);
    }
    evaluator.totals
}

/// How many contacts ahead particles are prefetched.
const AHEAD: usize = 2 * BATCH;

/// In place of a halo slot: B lies in the tile.
pub(super) const LOCAL: u32 = u32::MAX;

/// Evaluates the contacts of a tile in batches, in a loop of kind `K`.
pub(super) struct TileEvaluator<'a, L: ContactLaw, K, T> {
    pub(super) context: &'a StepContext<'a>,
    pub(super) rows: &'a [L],
    pub(super) tile: Tile<'a, L>,
    pub(super) totals: Totals,
    pub(super) pending: [PendingContact; BATCH],
    /// The contacts of the batch, if it is full, and they follow each other.
    pub(super) full: Option<FullBatch>,
    /// How it moves numbers between rows and columns.
    pub(super) lanes: T,
    kind: PhantomData<K>,
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

impl<'a, L: ContactLaw, K: LoopKind, T: Lanes> TileEvaluator<'a, L, K, T> {
    /// An evaluator of the contacts of a tile.
    #[inline(always)]
    pub(super) fn new(context: &'a StepContext<'a>, rows: &'a [L], tile: Tile<'a, L>, lanes: T) -> Self {
        let (totals, pending, kind) = (Totals::default(), [PendingContact::default(); BATCH], PhantomData);
        Self { context, rows, tile, totals, pending, full: None, lanes, kind }
    }

    /// List contact `k` if it has a force: a bond has one from the start, a candidate from the step in which the surfaces meet.
    #[inline(always)]
    pub(super) fn begin(&mut self, k: usize, pair: Pair, slot: u32) -> Option<PendingContact> {
        let flags = self.tile.flags[k];
        let carried = flags.carries();
        if carried || self.activate(k) {
            let counted = !flags.has(ContactFlags::NOT_OWNED);
            return Some(PendingContact { contact: k as u32, slot, pair, begins: !carried, counted });
        }
        if slot != LOCAL {
            self.clear_slot(slot);
        }
        None
    }

    /// Whether particles deform. The loop for cells and samples supports rigid and deformable particles.
    #[inline(always)]
    pub(super) fn deforms(&self) -> bool {
        K::DEFORM && (!K::PERIODIC || !self.context.surface_displacement.is_empty())
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
            Some(cell) if K::PERIODIC => ImageShift::of(cell, self.tile.flags[k].image, self.context.mode),
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
        if !K::PERIODIC && !L::Kinematics::ONE_MODE && mode != MotionMeasure::Finite {
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
        let (pair, image) = (self.tile.pair[k], self.image(k));
        let motions = self.context.motions(pair);
        let ends = self.context.ends(pair, &motions, &image, self.deforms());
        let tile = &mut self.tile;
        let (mut reference, mut previous) = (tile.reference.get(k), tile.previous.get(k));
        let (flags, mode, dt) = (&mut tile.flags[k], self.context.mode, self.context.dt);
        let begins = ends.begin::<L>(flags, &mut reference, &mut previous, mode, dt);
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
