//! Steps on a device in place of the solver: arrays, launches in their order, sums.

use concordem_contact::math::{Quat, Vec3};
use concordem_contact::pair::Pair;
use concordem_solver::integrate::{Damping, KickSums};
use concordem_solver::state::contacts::Contacts;
use concordem_solver::state::{Constraint, Particles, State};
use concordem_solver::{Solver, StepDevice, Stretch, StretchEnd, StretchStep};

use crate::Incidence;
use crate::arguments::{
    LAYOUT, LAYOUTS, Launch, MotionArrays, ParticleArrays, Reactions, Squares, Stops, SumTable, Works,
};
use crate::block::{self, BlockOnDevice, Shared};
use crate::buffer::Buffer;
use crate::contact::Loads;
use crate::device::{Device, DeviceError, Kernel};
use crate::sums::{STRETCH, Sums, TileSums};

/// Takes steps on a device, with the bits of the solver.
pub struct DeviceSteps {
    device: Box<dyn Device>,
    arrays: Arrays,
    /// Bonds, then unbonded contacts.
    blocks: Vec<Box<dyn BlockOnDevice>>,
    /// Number of particles.
    count: usize,
    /// Number of particles with a free component of their motion, and of their rotation.
    free: [u64; 2],
    /// Which copy the next step reads.
    from: u32,
    /// Number of steps since the state was copied to the device.
    serial: u32,
}

#[derive(Default)]
struct Arrays {
    position: Buffer<Vec3>,
    velocity: Buffer<Vec3>,
    angular_velocity: Buffer<Vec3>,
    rotation_increment: Buffer<Quat>,
    orientation: Buffer<Quat>,
    radius: Buffer<f64>,
    mass: Buffer<f64>,
    inertia: Buffer<f64>,
    constraint: Buffer<u8>,
    loads: Buffer<Loads>,
    start: Buffer<u32>,
    entries: Buffer<u32>,
    /// Even and odd steps.
    works: [Buffer<Works>; 2],
    rank: Buffer<u32>,
    /// Even and odd steps.
    reactions: [Buffer<Reactions>; 2],
    net: [Buffer<Vec3>; 2],
    squares: Buffer<Squares>,
    listed: Buffer<Vec3>,
    stops: Buffer<Stops>,
    motion: Buffer<MotionArrays>,
    work_sums: TileSums<5>,
    reaction_sums: TileSums<2>,
    square_sums: TileSums<2>,
    sums: Sums,
}

impl DeviceSteps {
    /// Steps on `device`.
    ///
    /// # Errors
    /// Its kernels have another layout than this program.
    pub fn new(mut device: Box<dyn Device>) -> Result<Self, DeviceError> {
        let mut sizes = Buffer::<u64>::default();
        sizes.put(&mut *device, &[0; LAYOUTS])?;
        device.launch(Kernel::Layout, LAYOUTS, sizes.address(), Launch::default())?;
        let mut found = [0; LAYOUTS];
        sizes.get(&mut *device, &mut found)?;
        sizes.free(&mut *device);
        if found != LAYOUT {
            let text =
                "the kernels were compiled from other sources than this program; compile them again with `make ptx`";
            return Err(DeviceError(text.to_owned()));
        }
        Ok(Self { device, arrays: Arrays::default(), blocks: Vec::new(), count: 0, free: [0; 2], from: 0, serial: 0 })
    }

    /// Make the blocks those of the laws of `contacts`, the first `bonds` of which are bonds.
    fn renew_blocks(&mut self, contacts: &[&dyn Contacts], bonds: usize) -> Result<(), DeviceError> {
        let wanted = || contacts.iter().enumerate().map(|(k, contacts)| (contacts.law(), k < bonds));
        if !self.blocks.iter().map(|block| (block.law(), block.bonds())).eq(wanted()) {
            for mut block in self.blocks.drain(..) {
                block.free(&mut *self.device);
            }
            self.blocks = wanted().map(|(law, bonds)| block::new(law, bonds)).collect::<Result<_, _>>()?;
        }
        Ok(())
    }

    /// Launch a step.
    fn launch(&mut self, launch: Launch) -> Result<(), DeviceError> {
        let Self { device, arrays, blocks, count, .. } = self;
        for block in blocks {
            block.evaluate(&mut **device, launch)?;
        }
        device.launch(Kernel::Particles, *count, arrays.motion.address(), launch)?;
        arrays.sums.launch(&mut **device, launch)
    }

    /// Take up to `count` steps, at most [`STRETCH`].
    fn stretch(&mut self, count: usize, sample: bool) -> Result<Stretch, DeviceError> {
        self.arrays.stops.put(&mut *self.device, &[Stops::NONE])?;
        for step in 0..count {
            let last = step + 1 == count;
            let from = (self.from + step as u32) % 2;
            let (step, sample) = (step as u32, u32::from(sample && last));
            self.launch(Launch { step, from, sample, serial: self.serial + step + 1 })?;
        }
        let mut stops = [Stops::NONE];
        self.arrays.stops.get(&mut *self.device, &mut stops)?;
        let [Stops { event, moved, logged }] = stops;
        let taken = count.min(event as usize).min(moved as usize);
        let end = match () {
            () if moved as usize == taken => StretchEnd::Moved,
            () if event as usize == taken => StretchEnd::Event,
            () => StretchEnd::Done,
        };
        self.from = (self.from + taken as u32) % 2;
        let mut steps = vec![StretchStep::default(); taken];
        if logged != 0 {
            for (k, block) in self.blocks.iter_mut().enumerate() {
                for (serial, event) in block.logged(&mut *self.device, self.serial + taken as u32)? {
                    steps[(serial - self.serial - 1) as usize].bond_events.push((k, event));
                }
            }
        }
        self.serial += taken as u32;
        for block in &self.blocks {
            block.add_energies(&mut *self.device, &mut steps, sample && taken == count)?;
        }
        let works = self.arrays.work_sums.totals(&mut *self.device, taken)?;
        let reactions = self.arrays.reaction_sums.totals(&mut *self.device, taken)?;
        for ((step, [kinetic, damping @ .., before, after]), boundary) in steps.iter_mut().zip(works).zip(reactions) {
            step.kick = KickSums { kinetic, damping, boundary, external: [before, after], ..KickSums::default() };
        }
        if let Some(last) = steps.last_mut().filter(|_| sample && taken == count) {
            [last.kick.free_particles, last.kick.free_rotations] = self.free;
            for [force, torque] in self.arrays.square_sums.totals(&mut *self.device, 1)? {
                (last.kick.net_force_squared, last.kick.net_torque_squared) = (force, torque);
            }
        }
        Ok(Stretch { steps, end })
    }
}

impl StepDevice for DeviceSteps {
    fn name(&self) -> String {
        self.device.name()
    }

    fn load(&mut self, solver: &Solver, state: &State) -> Result<(), DeviceError> {
        if let Some(what) = solver.unsupported_by_devices(state) {
            return Err(DeviceError(format!("a device does not support {what}; take the steps without it")));
        }
        let contacts: Vec<&dyn Contacts> = state.bonds.iter().chain(&state.contacts).map(|b| b.contacts()).collect();
        self.renew_blocks(&contacts, state.bonds.len())?;
        let pairs: Vec<Pair> = contacts.iter().flat_map(|block| block.pairs()).copied().collect();
        if pairs.len() >= (u32::MAX / 2) as usize {
            return Err(DeviceError(format!("{} contacts are more than a device can number", pairs.len())));
        }
        self.count = state.particles.len();
        (self.from, self.serial) = (0, 0);
        let free = |of: Constraint| {
            let is_free = |constraint: &&Constraint| constraint.0 & of.0 != of.0;
            state.particles.constraint.iter().filter(is_free).count() as u64
        };
        self.free = [free(Constraint::TRANSLATION), free(Constraint::ROTATION)];
        let (device, arrays) = (&mut *self.device, &mut self.arrays);
        arrays.load_particles(device, &state.particles)?;
        arrays.stops.put(device, &[Stops::NONE])?;
        arrays.loads.resize(device, pairs.len())?;
        let shared = Shared {
            particles: arrays.particles(),
            count: self.count,
            tile: solver.tile(),
            stops: arrays.stops.pointer(),
            dt: state.clock.dt,
            threshold: solver.model().damage_threshold,
            watched: solver.model().watch_contacts,
        };
        let mut sums = arrays.load_sums(device, &state.particles.constraint, &shared)?;
        let mut first = 0;
        for (block, contacts) in self.blocks.iter_mut().zip(&contacts) {
            block.load(device, *contacts, &shared, arrays.loads.pointer_at(first), &mut sums)?;
            first += contacts.len();
        }
        let incidence = Incidence::new(&pairs, self.count, shared.tile);
        arrays.start.put(device, incidence.starts())?;
        arrays.entries.put(device, incidence.entries())?;
        arrays.sums.load(device, sums, shared.stops)?;
        arrays.load_motion(device, solver, state, &shared)
    }

    fn advance(&mut self, count: u64, sample: bool) -> Result<Stretch, DeviceError> {
        let mut all = Stretch::default();
        let mut left = count;
        while left > 0 && all.end == StretchEnd::Done {
            let now = left.min(STRETCH as u64);
            left -= now;
            let stretch = self.stretch(now as usize, sample && left == 0)?;
            all.steps.extend(stretch.steps);
            all.end = stretch.end;
        }
        Ok(all)
    }

    fn positions(&mut self, positions: &mut [Vec3]) -> Result<(), DeviceError> {
        self.arrays.position.get(&mut *self.device, positions)
    }

    fn forces(&mut self, forces: &mut [Vec3], torques: &mut [Vec3]) -> Result<(), DeviceError> {
        let [force, torque] = &self.arrays.net;
        force.get(&mut *self.device, forces)?;
        torque.get(&mut *self.device, torques)
    }

    fn store(&mut self, state: &mut State) -> Result<(), DeviceError> {
        let (device, arrays) = (&mut *self.device, &self.arrays);
        let of = &mut state.particles;
        if of.len() != self.count {
            return Err(DeviceError("the particles have changed during steps on a device".to_owned()));
        }
        arrays.position.get(device, &mut of.position)?;
        arrays.velocity.get(device, &mut of.velocity)?;
        arrays.angular_velocity.get(device, &mut of.angular_velocity)?;
        arrays.rotation_increment.get(device, &mut of.rotation_increment)?;
        arrays.orientation.get(device, &mut of.orientation)?;
        let contacts = state.bonds.iter_mut().chain(&mut state.contacts);
        self.blocks
            .iter()
            .zip(contacts)
            .try_for_each(|(b, contacts)| b.store(device, contacts.contacts_mut(), self.from))
    }
}

impl Arrays {
    fn load_particles(&mut self, device: &mut dyn Device, of: &Particles) -> Result<(), DeviceError> {
        self.position.put(device, &of.position)?;
        self.velocity.put(device, &of.velocity)?;
        self.angular_velocity.put(device, &of.angular_velocity)?;
        self.rotation_increment.put(device, &of.rotation_increment)?;
        self.orientation.put(device, &of.orientation)?;
        self.radius.put(device, &of.radius)?;
        self.mass.put(device, &of.mass)?;
        self.inertia.put(device, &of.inertia)?;
        self.constraint.put(device, bytemuck::cast_slice(&of.constraint))
    }

    /// Prepare the sums of works and reactions by tile.
    fn load_sums(
        &mut self,
        device: &mut dyn Device,
        constraint: &[Constraint],
        shared: &Shared,
    ) -> Result<Vec<SumTable>, DeviceError> {
        let mut rank = vec![u32::MAX; constraint.len()];
        let (mut constrained, mut first) = (0, 0);
        let (mut work_start, mut reaction_start) = (vec![0], vec![0]);
        for tile in constraint.chunks(shared.tile) {
            let taken = tile.iter().enumerate().filter(|(_, constraint)| **constraint != Constraint::FREE);
            for (k, _) in taken {
                rank[first + k] = constrained;
                constrained += 1;
            }
            first += tile.len();
            work_start.push(first as u32);
            // A row for each component.
            reaction_start.push(6 * constrained);
        }
        self.rank.put(device, &rank)?;
        self.reactions.iter_mut().try_for_each(|rows| rows.resize(device, constrained as usize))?;
        self.works.iter_mut().try_for_each(|rows| rows.resize(device, constraint.len()))?;
        let works = self.works.each_ref().map(|rows| rows.pointer().cast_const().cast());
        let reactions = self.reactions.each_ref().map(|rows| rows.pointer().cast_const().cast());
        let works = self.work_sums.load(device, works, &work_start, STRETCH)?;
        self.squares.resize(device, constraint.len())?;
        self.net.iter_mut().try_for_each(|rows| rows.resize(device, constraint.len()))?;
        let squares = self.square_sums.load(device, [self.squares.pointer().cast_const().cast(); 2], &work_start, 1)?;
        Ok(vec![works, self.reaction_sums.load(device, reactions, &reaction_start, STRETCH)?, squares])
    }

    /// Arguments of the second kernel.
    fn load_motion(
        &mut self,
        device: &mut dyn Device,
        solver: &Solver,
        state: &State,
        shared: &Shared,
    ) -> Result<(), DeviceError> {
        let (listed, skin) = solver.neighbor_skin().unwrap_or((&state.particles.position, f64::INFINITY));
        self.listed.put(device, listed)?;
        let (damped, damping) = match solver.model().damping {
            Damping::Local { translation, rotation } => (1, [translation, rotation]),
            _ => (0, [0.0; 2]),
        };
        let motion = MotionArrays {
            count: shared.count as u64,
            particles: shared.particles,
            loads: self.loads.pointer(),
            start: self.start.pointer(),
            entries: self.entries.pointer(),
            works: self.works.each_ref().map(Buffer::pointer),
            rank: self.rank.pointer(),
            reactions: self.reactions.each_ref().map(Buffer::pointer),
            net: self.net.each_ref().map(Buffer::pointer),
            squares: self.squares.pointer(),
            listed: self.listed.pointer(),
            stops: shared.stops,
            limit: (0.5 * skin).powi(2),
            dt: shared.dt,
            gravity: solver.model().gravity,
            damping,
            damped,
        };
        self.motion.put_raw(device, &[motion])
    }

    fn particles(&self) -> ParticleArrays {
        ParticleArrays {
            position: self.position.pointer(),
            velocity: self.velocity.pointer(),
            angular_velocity: self.angular_velocity.pointer(),
            rotation_increment: self.rotation_increment.pointer(),
            orientation: self.orientation.pointer(),
            radius: self.radius.pointer(),
            mass: self.mass.pointer(),
            inertia: self.inertia.pointer(),
            constraint: self.constraint.pointer(),
        }
    }
}
