//! The kernels: what one thread does. A device calls them for each thread; the emulation does so in a loop.
//!
//! The only unsafe code of the crate apart from the calls of a driver. Each thread writes the row of one contact, of one particle, or of
//! one sum, and reads nothing that another thread of the same kernel writes, except for the [`Stops`]: threads that write one of these
//! write the same number; none excludes a step before the present one.

#![allow(unsafe_code)]

use bytemuck::Pod;
use concordem_contact::kinematics::Motion;
use concordem_contact::law::{ContactLaw, EnergySplit};
use concordem_contact::leapfrog::{Body, Kick, Work};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::pair::ContactFlags;

use crate::arguments::{ContactArrays, Dissipated, LAYOUT, Launch, Logged, MotionArrays, ParticleArrays, Stops};
use crate::arguments::{SumArrays, SumTable};
use crate::contact::{self, Contact, End, Evaluated, Step};
use crate::particle::{self, Advanced};

/// Rows that a thread of [`sums`] reads at once, in groups: the compiler keeps longer arrays in memory.
const READS: usize = GROUPS * 32;
const GROUPS: usize = 2;

/// Whether a step is to be taken.
///
/// Safety: `stops` can be read.
#[inline(always)]
unsafe fn takes(stops: *const Stops, launch: Launch) -> bool {
    // Other threads may write it.
    let Stops { event, moved, .. } = unsafe { stops.read_volatile() };
    launch.step < event && launch.step < moved
}

impl ParticleArrays {
    /// Safety: the arrays are longer than `p`, and no thread writes to them.
    #[inline(always)]
    unsafe fn end(&self, p: usize) -> End {
        unsafe {
            End {
                motion: Motion {
                    position: *self.position.add(p),
                    velocity: *self.velocity.add(p),
                    angular_velocity: *self.angular_velocity.add(p),
                    rotation_increment: *self.rotation_increment.add(p),
                    orientation: *self.orientation.add(p),
                },
                radius: *self.radius.add(p),
                mass: *self.mass.add(p),
            }
        }
    }
}

/// Row `k` of a table of `count` rows, whose numbers lie column by column.
///
/// Safety: the table has this size.
#[inline(always)]
unsafe fn row<T: Pod>(table: *const f64, count: usize, k: usize) -> T {
    let mut row = T::zeroed();
    if size_of::<T>() > 0 {
        for (n, number) in bytemuck::cast_slice_mut(core::slice::from_mut(&mut row)).iter_mut().enumerate() {
            *number = unsafe { *table.add(n * count + k) };
        }
    }
    row
}

/// Replace row `k` of such a table.
///
/// Safety: the table has this size, and no other thread reads or writes the row.
#[inline(always)]
unsafe fn set_row<T: Pod>(table: *mut f64, count: usize, k: usize, row: &T) {
    if size_of::<T>() > 0 {
        for (n, number) in bytemuck::cast_slice(core::slice::from_ref(row)).iter().enumerate() {
            unsafe { *table.add(n * count + k) = *number };
        }
    }
}

/// Contact number `thread`: law, history, loads, energies.
///
/// # Safety
/// The arrays are as long as [`ContactArrays`] says, and the particles exist.
#[inline(always)]
pub unsafe fn contacts<L: ContactLaw>(thread: usize, arguments: *const ContactArrays<L>, launch: Launch) {
    unsafe {
        let block = &*arguments;
        if thread >= block.count as usize || !takes(block.stops, launch) {
            return;
        }
        let (k, count) = (thread, block.count as usize);
        let (from, to) = (launch.from as usize, 1 - launch.from as usize);
        let pair = *block.pair.add(k);
        let ends = [block.particles.end(pair.a as usize), block.particles.end(pair.b as usize)];
        let before = Contact {
            flags: *block.flags[from].add(k),
            reference: row(block.reference[from], count, k),
            previous: row(block.previous[from], count, k),
            history: row(block.history[from], count, k),
        };
        let law = &*block.rows.add(before.flags.row as usize);
        let step = Step { dt: block.dt, threshold: block.threshold, watched: block.watched != 0 };
        let log = |entry: &Logged| {
            if block.reported.is_null() {
                return false;
            }
            *block.logged.add(k) = *entry;
            *block.reported.add(k) = launch.serial;
            // If the step is discarded, the host takes the flag back.
            (*block.flags[from].add(k)).bits |= ContactFlags::REPORTED;
            (&raw mut (*block.stops).logged).write_volatile(1);
            true
        };
        let evaluated = contact::evaluate(law, before, [&ends[0], &ends[1]], &step, log);
        let Some(Evaluated { contact, loads, energy, virial, squares, active }) = evaluated else {
            (&raw mut (*block.stops).event).write_volatile(launch.step);
            return;
        };
        set_row(block.previous[to], count, k, &contact.previous);
        set_row(block.history[to], count, k, &contact.history);
        if block.flags[0] != block.flags[1] {
            *block.flags[to].add(k) = contact.flags;
            set_row(block.reference[to], count, k, &contact.reference);
        }
        *block.loads.add(k) = loads;
        let EnergySplit { damage, friction, viscous, integration, .. } = energy;
        *block.dissipated[launch.parity()].add(k) = Dissipated([damage, friction, viscous, integration]);
        if launch.sample != 0 {
            let EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, .. } = energy;
            let row = &mut *block.sampled.add(k);
            [row[0], row[1], row[2], row[3]] = [stored_normal, stored_shear, stored_bending, stored_twist];
            row[4..13].copy_from_slice(virial.as_slice());
            [row[13], row[14], row[15]] = [squares[0], squares[1], f64::from(u8::from(active))];
        }
    }
}

/// Particle number `thread`: sum of the loads, kick, drift.
///
/// # Safety
/// The arrays are as long as [`MotionArrays`] says.
#[inline(always)]
pub unsafe fn particles(thread: usize, arguments: *const MotionArrays, launch: Launch) {
    unsafe {
        let motion = &*arguments;
        if thread >= motion.count as usize || !takes(motion.stops, launch) {
            return;
        }
        let (p, of) = (thread, &motion.particles);
        let body = Body {
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
            velocity: *of.velocity.add(p),
            angular_velocity: *of.angular_velocity.add(p),
            orientation: *of.orientation.add(p),
            position: *of.position.add(p),
            mass: *of.mass.add(p),
            inertia: *of.inertia.add(p),
        };
        let [first, end] = [*motion.start.add(p) as usize, *motion.start.add(p + 1) as usize];
        let entries = core::slice::from_raw_parts(motion.entries.add(first), end - first);
        let &MotionArrays { dt, gravity, damping, .. } = motion;
        let kick = Kick { dt, step: dt, gravity, damping, gradient: Mat3::zeros() };
        let loads = |k: usize| &*motion.loads.add(k);
        let advanced = particle::advance(&kick, motion.damped != 0, &body, *of.constraint.add(p), entries, loads);
        let Advanced { velocity, angular_velocity, drifted, work, reactions, net, squares } = advanced;
        *of.velocity.add(p) = velocity;
        *of.angular_velocity.add(p) = angular_velocity;
        *of.position.add(p) = drifted.position;
        *of.rotation_increment.add(p) = drifted.increment;
        *of.orientation.add(p) = drifted.orientation;
        let Work { kinetic, damping: [before, after], external } = work;
        *motion.works[launch.parity()].add(p) = [kinetic, -before, -after, external[0], external[1]];
        let rank = *motion.rank.add(p);
        if rank != u32::MAX {
            *motion.reactions[launch.parity()].add(rank as usize) = reactions;
        }
        if launch.sample != 0 {
            *motion.net[0].add(p) = net[0];
            *motion.net[1].add(p) = net[1];
            *motion.squares.add(p) = squares;
        }
        let near = (drifted.position - *motion.listed.add(p)).norm_squared() < motion.limit;
        // A number that is not finite ends the steps, too.
        if !(near && velocity.norm_squared().is_finite() && kinetic.is_finite()) {
            (&raw mut (*motion.stops).moved).write_volatile(launch.step + 1);
        }
    }
}

/// Sum number `thread`, of a column and tile of a table, in the order of the solver.
///
/// # Safety
/// The arrays are as long as [`SumArrays`] says.
#[inline(always)]
pub unsafe fn sums(thread: usize, arguments: *const SumArrays, launch: Launch) {
    unsafe {
        let of = &*arguments;
        if !takes(of.stops, launch) {
            return;
        }
        for table in core::slice::from_raw_parts(of.tables, of.count as usize) {
            let thread = thread.wrapping_sub(table.first as usize);
            if thread < (table.tiles * table.width) as usize && (table.sampled == 0 || launch.sample != 0) {
                sum(table, thread, launch);
            }
        }
    }
}

/// Sum number `thread` of a table.
///
/// Safety: that of [`sums`].
#[inline(always)]
unsafe fn sum(of: &SumTable, thread: usize, launch: Launch) {
    unsafe {
        let width = of.width as usize;
        let (tile, column) = (thread / width, thread % width);
        let [first, end] = [*of.start.add(tile) as usize, *of.start.add(tile + 1) as usize];
        let rows = of.rows[launch.parity()].add(column);
        let number = |row: usize| *rows.add(row * width);
        let (mut sum, mut row) = (0.0, first);
        // A thread waits for memory, not for additions: many reads at once.
        while row + READS <= end {
            let group = |of: usize| -> [f64; 32] { core::array::from_fn(|k| number(row + 32 * of + k)) };
            let groups: [_; GROUPS] = core::array::from_fn(group);
            for number in groups.as_flattened() {
                sum += number;
            }
            row += READS;
        }
        while row < end {
            sum += number(row);
            row += 1;
        }
        *of.sums.add(launch.step as usize * of.stride as usize + thread) = sum;
    }
}

/// Size number `thread` with which the kernels were compiled.
///
/// # Safety
/// `sizes` is as long as [`LAYOUT`].
#[inline(always)]
pub unsafe fn layout(thread: usize, sizes: *mut u64) {
    if let Some(size) = LAYOUT.get(thread) {
        unsafe { *sizes.add(thread) = *size };
    }
}
