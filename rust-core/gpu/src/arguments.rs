//! Arguments of the kernels: addresses of arrays on the device, the same for all devices.
//!
//! A step overwrites nothing: what the first kernel changes has two copies, `from` and `to` by turns, so that a step with an event can be
//! taken again. (One flag of bonds has one copy; the host takes it back, see [`ContactArrays::reported`].) What the third kernel sums has two
//! copies, too, because it runs while the next step begins.

use concordem_contact::law::ContactLaw;
use concordem_contact::math::{Quat, Vec3};
use concordem_contact::pair::{ContactFlags, Pair};

use crate::contact::Loads;

/// Numbers of a launch besides its arguments.
#[derive(Debug, Clone, Copy, Default)]
#[repr(C)]
pub struct Launch {
    /// Number of the step in the stretch.
    pub step: u32,
    /// Which copy the step reads, 0 or 1; it writes the other one.
    pub from: u32,
    /// 1 if the step samples, otherwise 0.
    pub sample: u32,
    /// Number of the step since the state was copied to the device, from 1 on.
    pub serial: u32,
}

/// Where the steps end: the first step with an event, and the first one before which the neighbor list must be rebuilt (`u32::MAX`: none);
/// neither these nor later ones are taken. And whether there are entries of the event log.
#[derive(Debug, Clone, Copy, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Stops {
    /// First step with an event.
    pub event: u32,
    /// First step before which a particle has moved too far.
    pub moved: u32,
    /// Not 0 if a bond has entered the event log.
    pub logged: u32,
}

impl Launch {
    /// Which of the rows of even and odd steps the step writes.
    pub fn parity(&self) -> usize {
        (self.step % 2) as usize
    }
}

impl Stops {
    /// No step is excluded.
    pub const NONE: Self = Self { event: u32::MAX, moved: u32::MAX, logged: 0 };
}

/// Energies that a contact dissipates in a step: by damage, friction, dashpots, and the error of the integration, J. Aligned, so that a
/// thread writes two numbers at once.
#[derive(Debug, Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(16))]
pub struct Dissipated(pub [f64; 4]);
/// Stored energies by normal, shear, bending, and twist deformation, then `l⊗f` column by column, J; squares of force (N²) and moment
/// (N²·m²); 1 if the contact has a force.
pub type Sampled = [f64; 16];
/// Squares of the net force (N²) and moment (N²·m²) over the free components of a particle.
pub type Squares = [f64; 2];
/// An entry of the event log: position (m), energy dissipated by damage in the step (J), damage, stored energies by normal, shear, bending,
/// and twist deformation (J), and 1 if shear made the bond fail.
pub type Logged = [f64; 10];
/// Kinetic energy, and works of damping and of given forces, each before and after the kick, J. Damping counts what it dissipates.
pub type Works = [f64; 5];
/// Works of the reactions of a particle's prescribed components, before and after the kick, J.
pub type Reactions = [[f64; 2]; 6];

/// Arrays of the particles, each as long as there are particles.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct ParticleArrays {
    /// m.
    pub position: *mut Vec3,
    /// m/s.
    pub velocity: *mut Vec3,
    /// rad/s.
    pub angular_velocity: *mut Vec3,
    /// Rotation of the last step.
    pub rotation_increment: *mut Quat,
    /// Body to world.
    pub orientation: *mut Quat,
    /// m.
    pub radius: *const f64,
    /// kg.
    pub mass: *const f64,
    /// kg·m².
    pub inertia: *const f64,
    /// Prescribed components.
    pub constraint: *const u8,
}

/// Arguments of the first kernel: a block of contacts.
#[derive(Debug)]
#[repr(C)]
pub struct ContactArrays<L: ContactLaw> {
    /// Number of contacts.
    pub count: u64,
    /// Pair coefficients.
    pub rows: *const L,
    /// Particles.
    pub pair: *const Pair,
    /// Row and flags of each contact, two copies; for bonds only one: of their flags only [`ContactFlags::REPORTED`] changes on a device.
    pub flags: [*mut ContactFlags; 2],
    /// Length and area without strain, in the same way, column by column: neighboring threads read neighboring numbers.
    pub reference: [*mut f64; 2],
    /// Normal and length, two copies, column by column.
    pub previous: [*mut f64; 2],
    /// History, two copies, column by column.
    pub history: [*mut f64; 2],
    /// Loads on the particles.
    pub loads: *mut Loads,
    /// By contact; even and odd steps.
    pub dissipated: [*mut Dissipated; 2],
    /// By contact, in a step that samples.
    pub sampled: *mut Sampled,
    /// [`Launch::serial`] of the step in which the bond entered the event log; 0 if it did not. No array for unbonded contacts.
    pub reported: *mut u32,
    /// By contact that entered it.
    pub logged: *mut Logged,
    /// Where the steps end.
    pub stops: *mut Stops,
    /// The particles.
    pub particles: ParticleArrays,
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub threshold: f64,
    /// 1 if the solver must see contacts begin whose stiffness grows, otherwise 0.
    pub watched: u64,
}

/// Arguments of the second kernel.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct MotionArrays {
    /// Number of particles.
    pub count: u64,
    /// The particles.
    pub particles: ParticleArrays,
    /// Loads of the contacts of all blocks.
    pub loads: *const Loads,
    /// First entry of each particle, then the number of entries.
    pub start: *const u32,
    /// See [`particle::advance`](crate::particle::advance).
    pub entries: *const u32,
    /// By particle; even and odd steps.
    pub works: [*mut Works; 2],
    /// Rank of each particle among those with prescribed components; `u32::MAX` for free ones.
    pub rank: *const u32,
    /// By particle with prescribed components; even and odd steps.
    pub reactions: [*mut Reactions; 2],
    /// Force (N) and torque (N·m) of the contacts, by particle, in a step that samples.
    pub net: [*mut Vec3; 2],
    /// By particle, in a step that samples.
    pub squares: *mut Squares,
    /// Positions at the last rebuild of the neighbor list, m.
    pub listed: *const Vec3,
    /// Where the steps end.
    pub stops: *mut Stops,
    /// Square of the distance from these positions at which the list must be rebuilt, m².
    pub limit: f64,
    /// Time step, s.
    pub dt: f64,
    /// m/s².
    pub gravity: Vec3,
    /// λ of translation and rotation, if `damped` is not 0.
    pub damping: [f64; 2],
    /// Whether there is local damping.
    pub damped: u64,
}

/// Arguments of the third kernel: sums of rows by tile.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct SumArrays {
    /// Number of tables.
    pub count: u64,
    /// What is to be summed.
    pub tables: *const SumTable,
    /// Where the steps end.
    pub stops: *mut Stops,
}

/// A table whose rows are to be summed by tile.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub struct SumTable {
    /// First thread; those before have the sums of other tables.
    pub first: u64,
    /// 1 if only a step that samples has these sums, otherwise 0.
    pub sampled: u64,
    /// Rows of `width` numbers; even and odd steps.
    pub rows: [*const f64; 2],
    /// Numbers in a row.
    pub width: u64,
    /// Number of tiles.
    pub tiles: u64,
    /// First row of each tile, then the number of rows.
    pub start: *const u32,
    /// `width` sums for each tile, for each step `stride` further.
    pub sums: *mut f64,
    /// 0 if only the last step has sums.
    pub stride: u64,
}

/// Sizes that host and kernels must agree on, and a hash of the sources of the kernels; the kernel `layout` writes those with which it was
/// compiled.
pub const LAYOUT: [u64; LAYOUTS] = {
    let mut sizes = [0; LAYOUTS];
    sizes[0] = size_of::<Loads>() as u64;
    sizes[1] = size_of::<MotionArrays>() as u64;
    sizes[2] = size_of::<SumArrays>() as u64;
    sizes[3] = size_of::<SumTable>() as u64;
    sizes[4] = size_of::<Launch>() as u64;
    sizes[5] = SOURCES;
    let mut at = 6;
    macro_rules! of_laws {
        ($($key:ident: $Law:ident,)*) => { $(
            type $Law = concordem_contact::law::$key::$Law;
            sizes[at] = size_of::<$Law>() as u64;
            sizes[at + 1] = size_of::<<$Law as ContactLaw>::State>() as u64;
            sizes[at + 2] = size_of::<ContactArrays<$Law>>() as u64;
            at += 3;
        )* };
    }
    concordem_contact::for_each_law!(of_laws);
    sizes
};

/// Hash of the sources of this crate that the kernels consist of; those of the laws are left out.
const SOURCES: u64 = {
    let files: [&[u8]; 4] = [
        include_bytes!("arguments.rs"),
        include_bytes!("contact.rs"),
        include_bytes!("kernels.rs"),
        include_bytes!("particle.rs"),
    ];
    // FNV-1a.
    let mut hash = 0xcbf2_9ce4_8422_2325_u64;
    let mut file = 0;
    while file < files.len() {
        let mut at = 0;
        while at < files[file].len() {
            hash = (hash ^ files[file][at] as u64).wrapping_mul(0x0000_0100_0000_01b3);
            at += 1;
        }
        file += 1;
    }
    hash
};

macro_rules! count_laws {
    ($($key:ident: $Law:ident,)*) => { [$(stringify!($key)),*].len() };
}
/// Number of [`LAYOUT`].
pub const LAYOUTS: usize = 6 + 3 * concordem_contact::for_each_law!(count_laws);
