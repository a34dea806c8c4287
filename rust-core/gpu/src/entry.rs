//! Entry points of the kernels on a device.
//!
//! The only unsafe code of the crate. Each thread writes one bond or one particle, and reads nothing that another thread of the same
//! kernel writes.

#![allow(unsafe_code)]

use core::arch::nvptx::{_block_dim_x, _block_idx_x, _thread_idx_x};

use concordem_contact::geometry::{PreviousGeometry, Reference};
use concordem_contact::kinematics::Motion;
use concordem_contact::law::{CohesiveBeam, ContactLaw, Cpm, LinearBond};
use concordem_contact::leapfrog::{Body, Kick};
use concordem_contact::math::{Mat3, Quat, Vec3};

use crate::bond::{self, Bond, End, Evaluated, Loads};
use crate::particle;

/// Arrays of the particles on the device, each as long as there are particles.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct Particles {
    position: *mut Vec3,
    velocity: *mut Vec3,
    angular_velocity: *mut Vec3,
    rotation_increment: *mut Quat,
    orientation: *mut Quat,
    radius: *const f64,
    mass: *const f64,
    inertia: *const f64,
    constraint: *const u8,
}

/// Arrays of the bonds on the device.
#[repr(C)]
pub struct Bonds<L: ContactLaw> {
    count: usize,
    /// Pair coefficients, and their index by bond.
    rows: *const L,
    row: *const u16,
    pair: *const [u32; 2],
    reference: *const Reference,
    previous: *mut PreviousGeometry,
    history: *mut L::State,
    loads: *mut Loads,
    /// 1 for bonds that broke.
    broke: *mut u8,
    particles: Particles,
    /// s.
    dt: f64,
}

/// Arguments of the second kernel.
#[repr(C)]
pub struct Step {
    count: usize,
    particles: Particles,
    loads: *const Loads,
    /// First entry of each particle, then the number of entries.
    start: *const u32,
    entries: *const u32,
    /// s.
    dt: f64,
    /// Time of the kick, s.
    kick: f64,
    /// m/s².
    gravity: Vec3,
    /// λ of translation and rotation, if `damped` is not 0.
    damping: [f64; 2],
    damped: u8,
}

/// Index of this thread in the grid.
fn thread() -> usize {
    // Safety: reads registers of the thread.
    let [thread, block, size] = unsafe { [_thread_idx_x(), _block_idx_x(), _block_dim_x()] };
    block as usize * size as usize + thread as usize
}

impl Particles {
    /// Safety: the arrays are longer than `p`, and no thread writes to them.
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

/// Safety: the arrays are as long as [`Bonds`] says.
unsafe fn evaluate<L: ContactLaw>(bonds: &Bonds<L>) {
    let k = thread();
    if k >= bonds.count {
        return;
    }
    unsafe {
        let [a, b] = *bonds.pair.add(k);
        let ends = [bonds.particles.end(a as usize), bonds.particles.end(b as usize)];
        let before = Bond {
            reference: *bonds.reference.add(k),
            previous: *bonds.previous.add(k),
            history: *bonds.history.add(k),
        };
        let law = &*bonds.rows.add(*bonds.row.add(k) as usize);
        let Evaluated { loads, previous, history, broke } =
            bond::evaluate(law, &before, [&ends[0], &ends[1]], bonds.dt);
        *bonds.previous.add(k) = previous;
        *bonds.history.add(k) = history;
        *bonds.loads.add(k) = loads;
        *bonds.broke.add(k) = u8::from(broke);
    }
}

macro_rules! laws {
    ($($(#[$doc:meta])* $entry:ident: $Law:ty,)*) => { $(
        $(#[$doc])*
        ///
        /// # Safety
        /// The arrays are as long as [`Bonds`] says.
        #[unsafe(no_mangle)]
        pub unsafe extern "ptx-kernel" fn $entry(bonds: *const Bonds<$Law>) {
            unsafe { evaluate(&*bonds) }
        }
    )* };
}
laws! {
    /// Bonds of the concrete particle model.
    bonds_cpm: Cpm,
    /// Cohesive beams.
    bonds_cohesive_beam: CohesiveBeam,
    /// Linear bonds.
    bonds_linear_bond: LinearBond,
}

/// Kick and drift.
///
/// # Safety
/// The arrays are as long as [`Step`] says.
#[unsafe(no_mangle)]
pub unsafe extern "ptx-kernel" fn particles(step: *const Step) {
    let p = thread();
    unsafe {
        let step = &*step;
        if p >= step.count {
            return;
        }
        let of = &step.particles;
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
        let [first, end] = [*step.start.add(p) as usize, *step.start.add(p + 1) as usize];
        let entries = core::slice::from_raw_parts(step.entries.add(first), end - first);
        let kick = Kick {
            dt: step.dt,
            step: step.kick,
            gravity: step.gravity,
            damping: step.damping,
            gradient: Mat3::zeros(),
        };
        let advanced =
            particle::advance(&kick, step.damped != 0, &body, *of.constraint.add(p), entries, |k| *step.loads.add(k));
        *of.velocity.add(p) = advanced.velocity;
        *of.angular_velocity.add(p) = advanced.angular_velocity;
        *of.position.add(p) = advanced.drifted.position;
        *of.rotation_increment.add(p) = advanced.drifted.increment;
        *of.orientation.add(p) = advanced.drifted.orientation;
    }
}

#[panic_handler]
fn panic(_: &core::panic::PanicInfo<'_>) -> ! {
    // Safety: ends the kernel with an error.
    unsafe { core::arch::nvptx::trap() }
}
