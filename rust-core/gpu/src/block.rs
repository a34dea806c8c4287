//! A block of contacts on a device.

use bytemuck::Pod;
use concordem_contact::columns::Item;
use concordem_contact::geometry::{PreviousGeometry, Reference};
use concordem_contact::law::{ContactLaw, EnergySplit};
use concordem_contact::math::{Mat3, Vec3};
use concordem_contact::pair::{ContactFlags, Pair};
use concordem_solver::StretchStep;
use concordem_solver::forces::BondEvent;
use concordem_solver::state::contacts::{ContactBlock, Contacts};
use concordem_solver::state::table::Table;

use crate::arguments::{ContactArrays, Dissipated, Launch, Logged, ParticleArrays, Sampled, Stops, SumTable};
use crate::buffer::Buffer;
use crate::contact::Loads;
use crate::device::{Device, DeviceError, Kernel};
use crate::sums::{STRETCH, TileSums};

/// Most rows of an array that are copied at once to read some of them.
const WINDOW: usize = 4096;

/// What the blocks of a state share.
pub struct Shared {
    /// The particles on the device.
    pub particles: ParticleArrays,
    /// Number of particles.
    pub count: usize,
    /// Particles per tile.
    pub tile: usize,
    /// Where the steps end, on the device.
    pub stops: *mut Stops,
    /// Time step, s.
    pub dt: f64,
    /// Damage at which a bond enters the event log.
    pub threshold: f64,
    /// Whether the solver must see contacts begin whose stiffness grows.
    pub watched: bool,
}

/// A block of contacts on a device, whatever its law.
pub trait BlockOnDevice: Send + Sync {
    /// Name of the law.
    fn law(&self) -> &'static str;
    /// Whether the contacts are bonds.
    fn bonds(&self) -> bool;
    /// Copy the contacts to the device. `loads`: where the kernel writes theirs. Adds the tables that are to be summed to `sums`.
    fn load(
        &mut self,
        device: &mut dyn Device,
        contacts: &dyn Contacts,
        shared: &Shared,
        loads: *mut Loads,
        sums: &mut Vec<SumTable>,
    ) -> Result<(), DeviceError>;
    /// Launch the evaluation of all contacts.
    fn evaluate(&self, device: &mut dyn Device, launch: Launch) -> Result<(), DeviceError>;
    /// Add the energies of the steps taken to `steps`; `sampled`: the last one sampled.
    fn add_energies(
        &self,
        device: &mut dyn Device,
        steps: &mut [StretchStep],
        sampled: bool,
    ) -> Result<(), DeviceError>;
    /// The entries of the event log since the last call, each with the [`Launch::serial`] of its step. Entries after the step `last` are of a
    /// discarded step: they do not count, and their flags are taken back.
    fn logged(&mut self, device: &mut dyn Device, last: u32) -> Result<Vec<(u32, BondEvent)>, DeviceError>;
    /// Copy what the steps changed to `contacts`; `from`: the copy that the next step reads.
    fn store(&self, device: &mut dyn Device, contacts: &mut dyn Contacts, from: u32) -> Result<(), DeviceError>;
    /// Give the memory back.
    fn free(&mut self, device: &mut dyn Device);
}

/// An empty block of the law with this name, of bonds or of unbonded contacts.
pub fn new(law: &str, bonds: bool) -> Result<Box<dyn BlockOnDevice>, DeviceError> {
    macro_rules! of_law {
        ($($key:ident: $Law:ident,)*) => {
            match law {
                $(stringify!($key) => Ok(Box::new(Block::<concordem_contact::law::$key::$Law>::new(bonds))),)*
                _ => Err(DeviceError(format!("there is no kernel for the law \"{law}\""))),
            }
        };
    }
    concordem_contact::for_each_law!(of_law)
}

struct Block<L: ContactLaw> {
    count: usize,
    rows: Buffer<L>,
    pair: Buffer<Pair>,
    /// One copy for bonds.
    flags: Vec<Buffer<ContactFlags>>,
    /// Column by column, as the others.
    reference: Vec<Buffer<f64>>,
    previous: [Buffer<f64>; 2],
    history: [Buffer<f64>; 2],
    /// Even and odd steps.
    dissipated: [Buffer<Dissipated>; 2],
    sampled: Buffer<Sampled>,
    /// Only for bonds.
    reported: Buffer<u32>,
    logged: Buffer<Logged>,
    /// Serial number of the last step whose entries were read.
    read: u32,
    /// Whether flags have changed since the contacts were copied to the device.
    flagged: bool,
    arguments: Buffer<ContactArrays<L>>,
    dissipated_sums: TileSums<4>,
    sampled_sums: TileSums<16>,
}

impl<L: ContactLaw> Block<L> {
    fn new(bonds: bool) -> Self {
        let copies = if bonds { 1 } else { 2 };
        Self {
            count: 0,
            rows: Buffer::default(),
            pair: Buffer::default(),
            flags: (0..copies).map(|_| Buffer::default()).collect(),
            reference: (0..copies).map(|_| Buffer::default()).collect(),
            previous: Default::default(),
            history: Default::default(),
            dissipated: Default::default(),
            sampled: Buffer::default(),
            reported: Buffer::default(),
            logged: Buffer::default(),
            read: 0,
            flagged: false,
            arguments: Buffer::default(),
            dissipated_sums: TileSums::default(),
            sampled_sums: TileSums::default(),
        }
    }
}

/// Replace the columns on a device by those of a table.
fn put_table<T: Item + Pod>(
    columns: &mut Buffer<f64>,
    device: &mut dyn Device,
    table: &Table<T>,
) -> Result<(), DeviceError> {
    columns.resize(device, Table::<T>::WIDTH * table.len())?;
    (0..Table::<T>::WIDTH).try_for_each(|n| columns.put_at(device, n * table.len(), table.column(n)))
}

/// Read columns from a device into a table of the same length.
fn get_table<T: Item + Pod>(
    columns: &Buffer<f64>,
    device: &mut dyn Device,
    table: &mut Table<T>,
) -> Result<(), DeviceError> {
    let count = table.len();
    (0..Table::<T>::WIDTH).try_for_each(|n| columns.get_at(device, n * count, table.column_mut(n)))
}

/// The rows of these indices, which ascend, each with its index. Those near each other are read together.
fn rows<T: Pod>(
    array: &Buffer<T>,
    device: &mut dyn Device,
    mut indices: &[usize],
) -> Result<Vec<(usize, T)>, DeviceError> {
    let mut found = Vec::with_capacity(indices.len());
    while let Some(&first) = indices.first() {
        let (near, rest) = indices.split_at(indices.partition_point(|&k| k < first + WINDOW));
        let mut window = vec![T::zeroed(); near.last().map_or(0, |last| last + 1 - first)];
        array.get_at(device, first, &mut window)?;
        found.extend(near.iter().map(|&k| (k, window[k - first])));
        indices = rest;
    }
    Ok(found)
}

impl<L: ContactLaw> BlockOnDevice for Block<L> {
    fn law(&self) -> &'static str {
        L::NAME
    }

    fn bonds(&self) -> bool {
        self.flags.len() == 1
    }

    fn load(
        &mut self,
        device: &mut dyn Device,
        contacts: &dyn Contacts,
        shared: &Shared,
        loads: *mut Loads,
        sums: &mut Vec<SumTable>,
    ) -> Result<(), DeviceError> {
        let wrong = || DeviceError(format!("the block of the law \"{}\" has another type", L::NAME));
        let block = contacts.as_any().downcast_ref::<ContactBlock<L>>().ok_or_else(wrong)?;
        self.count = block.len();
        self.rows.put_raw(device, &block.rows)?;
        self.pair.put(device, &block.pair)?;
        self.flags[0].put(device, &block.flags)?;
        put_table(&mut self.reference[0], device, &block.reference)?;
        if let ([_, flags], [_, reference]) = (&mut self.flags[..], &mut self.reference[..]) {
            flags.resize(device, self.count)?;
            reference.resize(device, Table::<Reference>::WIDTH * self.count)?;
        }
        put_table(&mut self.previous[0], device, &block.previous)?;
        put_table(&mut self.history[0], device, &block.history)?;
        self.previous[1].resize(device, Table::<PreviousGeometry>::WIDTH * self.count)?;
        self.history[1].resize(device, Table::<L::State>::WIDTH * self.count)?;
        self.dissipated.iter_mut().try_for_each(|rows| rows.resize(device, self.count))?;
        self.sampled.resize(device, self.count)?;
        if self.bonds() {
            self.reported.put(device, &vec![0; self.count])?;
            self.logged.resize(device, self.count)?;
        }
        (self.read, self.flagged) = (0, false);
        let arguments = ContactArrays {
            count: self.count as u64,
            rows: self.rows.pointer(),
            pair: self.pair.pointer(),
            flags: [0, self.flags.len() - 1].map(|k| self.flags[k].pointer()),
            reference: [0, self.reference.len() - 1].map(|k| self.reference[k].pointer()),
            previous: self.previous.each_ref().map(Buffer::pointer),
            history: self.history.each_ref().map(Buffer::pointer),
            loads,
            dissipated: self.dissipated.each_ref().map(Buffer::pointer),
            sampled: self.sampled.pointer(),
            reported: self.reported.pointer(),
            logged: self.logged.pointer(),
            stops: shared.stops,
            particles: shared.particles,
            dt: shared.dt,
            threshold: shared.threshold,
            watched: u64::from(shared.watched),
        };
        self.arguments.put_raw(device, &[arguments])?;
        let tiles = shared.count.div_ceil(shared.tile).max(1);
        let start: Vec<u32> = (0..=tiles)
            .map(|tile| block.pair.partition_point(|pair| (pair.a as usize) < tile * shared.tile) as u32)
            .collect();
        let dissipated = self.dissipated.each_ref().map(|rows| rows.pointer().cast_const().cast());
        sums.push(self.dissipated_sums.load(device, dissipated, &start, STRETCH)?);
        let sampled = self.sampled.pointer().cast_const().cast();
        sums.push(self.sampled_sums.load(device, [sampled; 2], &start, 1)?);
        Ok(())
    }

    fn evaluate(&self, device: &mut dyn Device, launch: Launch) -> Result<(), DeviceError> {
        if self.count == 0 {
            return Ok(());
        }
        device.launch(Kernel::Contacts(L::NAME), self.count, self.arguments.address(), launch)
    }

    fn add_energies(
        &self,
        device: &mut dyn Device,
        steps: &mut [StretchStep],
        sampled: bool,
    ) -> Result<(), DeviceError> {
        let dissipated = self.dissipated_sums.totals(device, steps.len())?;
        for (step, [damage, friction, viscous, integration]) in steps.iter_mut().zip(dissipated) {
            step.energy += EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
        }
        if let Some(last) = steps.last_mut().filter(|_| sampled) {
            for sums in self.sampled_sums.totals(device, 1)? {
                let [stored_normal, stored_shear, stored_bending, stored_twist, virial @ .., force, moment, active] =
                    sums;
                let stored =
                    EnergySplit { stored_normal, stored_shear, stored_bending, stored_twist, ..EnergySplit::default() };
                last.energy += stored;
                last.virial += Mat3::from_column_slice(&virial);
                last.force_squared += force;
                last.moment_squared += moment;
                last.active[usize::from(!self.bonds())] += active as u64;
            }
        }
        Ok(())
    }

    fn logged(&mut self, device: &mut dyn Device, last: u32) -> Result<Vec<(u32, BondEvent)>, DeviceError> {
        if !self.bonds() {
            return Ok(Vec::new());
        }
        let mut reported = vec![0; self.count];
        self.reported.get(device, &mut reported)?;
        let bonds: Vec<usize> = (0..self.count).filter(|&k| reported[k] > self.read).collect();
        self.read = last;
        self.flagged |= !bonds.is_empty();
        let (discarded, bonds): (Vec<usize>, Vec<usize>) = bonds.into_iter().partition(|&k| reported[k] > last);
        for (k, mut flags) in rows(&self.flags[0], device, &discarded)? {
            flags.bits &= !ContactFlags::REPORTED;
            self.flags[0].put_at(device, k, &[flags])?;
        }
        let pairs = rows(&self.pair, device, &bonds)?;
        let entries = rows(&self.logged, device, &bonds)?;
        let event = |((k, pair), (_, entry)): ((usize, Pair), (usize, Logged))| {
            let [x, y, z, energy, damage, stored @ .., in_shear] = entry;
            let position = Vec3::new(x, y, z);
            let fails = L::OUTLIVES_FAILURE && damage >= 1.0;
            let in_shear = in_shear != 0.0;
            (reported[k], BondEvent { pair, broke: false, fails, in_shear, damage, position, energy, stored })
        };
        Ok(pairs.into_iter().zip(entries).map(event).collect())
    }

    fn store(&self, device: &mut dyn Device, contacts: &mut dyn Contacts, from: u32) -> Result<(), DeviceError> {
        let wrong =
            || DeviceError(format!("the block of the law \"{}\" has changed during steps on a device", L::NAME));
        let block = contacts.as_any_mut().downcast_mut::<ContactBlock<L>>();
        let block = block.filter(|block| block.len() == self.count).ok_or_else(wrong)?;
        if self.flagged {
            self.flags[0].get(device, &mut block.flags)?;
        }
        if !self.bonds() {
            self.flags[from as usize].get(device, &mut block.flags)?;
            get_table(&self.reference[from as usize], device, &mut block.reference)?;
        }
        get_table(&self.previous[from as usize], device, &mut block.previous)?;
        get_table(&self.history[from as usize], device, &mut block.history)
    }

    fn free(&mut self, device: &mut dyn Device) {
        self.rows.free(device);
        self.pair.free(device);
        self.flags.iter_mut().for_each(|buffer| buffer.free(device));
        self.reference.iter_mut().for_each(|buffer| buffer.free(device));
        self.previous.iter_mut().for_each(|buffer| buffer.free(device));
        self.history.iter_mut().for_each(|buffer| buffer.free(device));
        self.dissipated.iter_mut().for_each(|buffer| buffer.free(device));
        self.sampled.free(device);
        self.reported.free(device);
        self.logged.free(device);
        self.arguments.free(device);
        self.dissipated_sums.free(device);
        self.sampled_sums.free(device);
    }
}
