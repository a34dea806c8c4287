//! Data that the network stores per atom in the host's arrays, and its transfer to and from the solver's state.

use concordem_contact::math::{Quat, Symmetric, Vec3, normalized, quaternion_of_rotation_vector};
use concordem_contact::prefetch::{AHEAD, prefetch_row};
use concordem_solver::neighbor::hilbert;
use concordem_solver::state::Deformation;

use super::{Network, NetworkError};
use crate::atoms::{Atoms, add, vector};

/// Number of reals for the net force and torque of the last step.
const NET: usize = 6;
/// Place of the atom's id at the last rebuild; 0 for a new atom.
const ID: usize = NET;

/// Offsets in the data of an atom. Data for the owner only come first, then data that ghosts also need.
#[derive(Debug, Clone, Copy)]
pub(super) struct Layout {
    /// What rounding has cut off from the temperature (K), then, with a file of heat capacities, heat capacity (J/K) and volume (m³).
    heat: usize,
    /// Virials of a deformable particle: from forces that do not depend on its strain, and from reactions (six reals each).
    others: usize,
    /// Place in the order of the particles, from 1; 0 for a new atom. Ghosts need it at rebuilds only.
    place: usize,
    /// Orientation (x, y, z, w).
    orientation: usize,
    /// Virials that determine the strain of the next step, and of the last step (six reals each).
    virials: usize,
    /// Temperature, K.
    temperature: usize,
    /// Reals per atom.
    pub(super) width: usize,
}

impl Layout {
    /// Whether atoms have an orientation.
    pub(super) fn has_orientation(&self) -> bool {
        self.virials > self.orientation
    }

    /// Heat capacity (J/K) and volume (m³) of a file in the data of an atom; `None` without a file.
    pub(super) fn heat_of_file(&self, memory: &[f64]) -> Option<[f64; 2]> {
        (self.others == self.heat + 3).then(|| [memory[self.heat + 1], memory[self.heat + 2]])
    }

    /// The same, to be changed.
    pub(super) fn heat_of_file_mut<'a>(&self, memory: &'a mut [f64]) -> Option<&'a mut [f64]> {
        (self.others == self.heat + 3).then(|| &mut memory[self.heat + 1..self.heat + 3])
    }

    /// Set the temperature (K) in the data of an atom; returns the two parts of the old one.
    pub(super) fn set_temperature(&self, memory: &mut [f64], temperature: f64) -> [f64; 2] {
        let old = std::mem::replace(&mut memory[self.temperature], temperature);
        [old, std::mem::take(&mut memory[self.heat])]
    }

    /// Place of the temperature in the data of an atom; `None` without heat conduction.
    pub(super) fn temperature(&self) -> Option<usize> {
        (self.width > self.temperature).then_some(self.temperature)
    }

    /// `heat`: reals of heat for the owner; 0 without heat conduction.
    pub(super) fn new(oriented: bool, deformable: bool, heat: usize) -> Self {
        let others = ID + 1 + heat;
        let place = others + if deformable { 12 } else { 0 };
        let orientation = place + 1;
        let virials = orientation + if oriented { 4 } else { 0 };
        let temperature = virials + if deformable { 12 } else { 0 };
        let width = temperature + usize::from(heat > 0);
        Self { heat: ID + 1, others, place, orientation, virials, temperature, width }
    }
}

impl Network {
    /// Reals stored per atom: net force and torque of the last step, the id at the last rebuild, the place in the order of the particles,
    /// the orientation (x, y, z, w) if the law reads it, and four virials if the particle is deformable; with heat conduction, the
    /// temperature and what belongs to it.
    pub fn atom_width(&self) -> usize {
        self.layout.width
    }

    /// How many of these reals ghosts need at every step; they come last. At rebuilds, ghosts need one more, the one before.
    pub fn communicated(&self) -> usize {
        self.layout.width - self.layout.orientation
    }

    /// Place of the temperature among these reals; `None` without heat conduction.
    pub fn temperature_place(&self) -> Option<usize> {
        self.layout.temperature()
    }

    /// Initialize the data of a new atom. `mask`: bits of its groups. Heat capacity and volume of a file follow before the next rebuild
    /// ([`Self::use_heat_entries`]), since another processor may keep them.
    pub fn initial_memory(&self, mask: i32, memory: &mut [f64]) {
        memory.fill(0.0);
        if let Some(thermal) = &self.thermal {
            memory[self.layout.temperature] = thermal.initial_temperature(mask);
        }
        if self.needs_orientation() {
            memory[self.layout.orientation + 3] = 1.0;
        }
    }

    /// Give new owned atoms their place in the order of the particles: that of their position on a space-filling curve through the box.
    /// They keep it, on all processors and in restart files, so that the order of sums stays the same. The caller must then update the
    /// ghosts.
    pub fn place_new(&self, atoms: &mut Atoms<'_>) {
        // The result is exact as a real, and so fine that few atoms share a place; their ids decide.
        const BITS: u32 = 17;
        let boxes = f64::from(1_u32 << BITS);
        let (low, high) = (atoms.low, atoms.high);
        let longest = [0, 1, 2].map(|axis| high[axis] - low[axis]).into_iter().fold(0.0, f64::max);
        for (i, memory) in atoms.memory.chunks_mut(self.layout.width).take(atoms.owned).enumerate() {
            let place = &mut memory[self.layout.place];
            if *place == 0.0 {
                let x = vector(atoms.position, i);
                let at = |axis: usize| ((x[axis] - low[axis]) / longest * boxes).clamp(0.0, boxes - 1.0) as u32;
                *place = (1 + hilbert([at(0), at(1), at(2)], BITS)) as f64;
            }
        }
    }

    /// Place of an atom in the order of the particles.
    pub(super) fn place_of(&self, atoms: &Atoms<'_>, i: usize) -> u64 {
        atoms.memory[i * self.layout.width + self.layout.place] as u64
    }

    /// Number of owned atoms that existed at the last rebuild.
    pub fn known(&self, atoms: &Atoms<'_>) -> usize {
        atoms.memory.chunks(self.layout.width).take(atoms.owned).filter(|memory| memory[ID] != 0.0).count()
    }

    /// Compare the ids of owned atoms with those of the last rebuild, and store them. Bonds are known by ids, so they would join other
    /// atoms after a renumbering.
    ///
    /// # Errors
    /// An atom with another id.
    pub(super) fn check_ids(&self, atoms: &mut Atoms<'_>) -> Result<(), NetworkError> {
        for (tag, memory) in atoms.tag.iter().take(atoms.owned).zip(atoms.memory.chunks_mut(self.layout.width)) {
            let id = tag as f64;
            if memory[ID] != 0.0 && memory[ID] != id {
                return Err(NetworkError::Renumbered { tag, before: memory[ID] as i64 });
            }
            memory[ID] = id;
        }
        Ok(())
    }

    /// Rotate owned atoms by the angular velocity of the step. The caller must then update the ghosts.
    pub fn rotate(&self, atoms: &mut Atoms<'_>) {
        if !self.needs_orientation() {
            return;
        }
        let width = self.atom_width();
        for i in 0..atoms.owned {
            let memory = &mut atoms.memory[i * width + self.layout.orientation..][..4];
            let rotated = normalized(
                &(quaternion_of_rotation_vector(&(vector(atoms.angular_velocity, i) * atoms.dt)) * orientation(memory)),
            );
            memory.copy_from_slice(rotated.coords.as_slice());
        }
    }

    /// Read sizes, positions, motion, and virials of all particles from the host's arrays. `still`: nothing moves (setup of a run).
    ///
    /// # Errors
    /// The type of an atom has changed since the last rebuild.
    pub(super) fn read_atoms(&mut self, atoms: &Atoms<'_>, still: bool) -> Result<(), NetworkError> {
        self.read_sizes(atoms)?;
        let Layout { others, orientation: oriented, virials, width, .. } = self.layout;
        self.read_temperatures(atoms);
        let particles = &mut self.state.particles;
        for (p, &i) in self.atom.iter().enumerate() {
            if let Some(&next) = self.atom.get(p + AHEAD) {
                let next = next as usize;
                for rows in [atoms.position, atoms.velocity, atoms.angular_velocity] {
                    prefetch_row(rows, 3 * next);
                }
                prefetch_row(atoms.memory, width * next + oriented);
            }
            let i = i as usize;
            particles.position[p] = vector(atoms.position, i);
            if still {
                particles.velocity[p] = Vec3::zeros();
                particles.angular_velocity[p] = Vec3::zeros();
                particles.rotation_increment[p] = Quat::identity();
            } else {
                let angular_velocity = vector(atoms.angular_velocity, i);
                particles.velocity[p] = vector(atoms.velocity, i);
                particles.angular_velocity[p] = angular_velocity;
                particles.rotation_increment[p] = quaternion_of_rotation_vector(&(angular_velocity * atoms.dt));
            }
            if virials > oriented {
                particles.orientation[p] = orientation(&atoms.memory[i * width + oriented..][..4]);
            }
        }
        if self.model.deformable.is_some() {
            let virial = |i: u32, place: usize| {
                let mut reals = [0.0; 6];
                reals.copy_from_slice(&atoms.memory[i as usize * width + place..][..6]);
                Symmetric(reals)
            };
            particles.deformation.clear();
            particles.deformation.extend(self.atom.iter().map(|&i| Deformation {
                virial: virial(i, virials),
                used: virial(i, virials + 6),
                other: virial(i, others),
                reaction: virial(i, others + 6),
            }));
        }
        Ok(())
    }

    /// Read radii and masses, which a host may change at any step.
    ///
    /// # Errors
    /// The type of an atom has changed since the last rebuild, because ghosts get types at rebuilds only; or it is no sphere any more.
    fn read_sizes(&mut self, atoms: &Atoms<'_>) -> Result<(), NetworkError> {
        let particles = &mut self.state.particles;
        let mut growth = 0.0f64;
        let mut changes = Vec::new();
        for (p, &i) in self.atom.iter().enumerate() {
            let i = i as usize;
            let (radius, mass) = (atoms.radius[i], atoms.effective_mass[i]);
            if radius != particles.radius[p] || mass != particles.mass[p] {
                atoms.check_sphere(i)?;
                let change = radius - particles.radius[p];
                growth = growth.max(change);
                if change != 0.0 {
                    changes.push((p, change));
                }
                particles.radius[p] = radius;
                particles.mass[p] = mass;
                particles.inertia[p] = inertia(mass, radius);
            }
            if i32::from(particles.material[p]) + 1 != atoms.kind[i] {
                return Err(NetworkError::OtherAtomType { tag: self.tags[p] });
            }
        }
        if growth > 0.0 {
            self.grown += growth;
            if let Some(solver) = &mut self.solver {
                solver.spheres_grew(growth);
            }
        }
        self.resize_contacts(&changes)
    }

    /// By how much radii may have grown since the last rebuild at most, m.
    pub fn grown(&self) -> f64 {
        self.grown
    }

    /// Read the temperatures of all particles.
    pub(super) fn read_temperatures(&mut self, atoms: &Atoms<'_>) {
        let (Some(state), Layout { heat, temperature, width, .. }) = (&mut self.state.heat, self.layout) else {
            return;
        };
        for (p, &i) in self.atom.iter().enumerate() {
            let memory = &atoms.memory[i as usize * width..];
            state.temperature[p] = memory[temperature];
            // Ghosts have none.
            state.correction[p] = if self.owned[p] { memory[heat] } else { 0.0 };
        }
    }

    /// Store the temperatures of owned atoms.
    ///
    /// # Errors
    /// The host has other atoms than at the last rebuild, or a temperature is not finite.
    pub(super) fn write_temperatures(&self, atoms: &mut Atoms<'_>) -> Result<(), NetworkError> {
        let (Some(state), Layout { heat, temperature, width, .. }) = (&self.state.heat, self.layout) else {
            return Ok(());
        };
        for (p, &i) in self.atom.iter().enumerate().filter(|(p, _)| self.owned[*p]) {
            let tag = self.tags[p];
            let memory = atoms.memory.get_mut(i as usize * width..).filter(|memory| memory[ID] == tag as f64);
            let Some(memory) = memory else { return Err(NetworkError::Moved { tag }) };
            if !state.temperature[p].is_finite() {
                return Err(NetworkError::TemperatureNotFinite { step: atoms.step, tag });
            }
            memory[temperature] = state.temperature[p];
            memory[heat] = state.correction[p];
        }
        Ok(())
    }

    /// Add the stored net forces and torques of the last step to owned atoms.
    pub(super) fn add_stored_forces(&self, atoms: &mut Atoms<'_>) {
        let width = self.layout.width;
        for &i in self.atom.iter().filter(|&&i| (i as usize) < atoms.owned) {
            let i = i as usize;
            let memory = &atoms.memory[i * width..][..NET];
            add(atoms.force, i, &vector(memory, 0));
            add(atoms.torque, i, &vector(memory, 1));
        }
    }

    /// Add net forces and torques to owned atoms, and store them and the virials.
    pub(super) fn write_atoms(&self, atoms: &mut Atoms<'_>) -> Result<(), NetworkError> {
        let Some(solver) = &self.solver else { return Ok(()) };
        let Layout { others, virials, width, .. } = self.layout;
        let deforms = self.model.deformable.is_some();
        for (p, &i) in self.atom.iter().enumerate() {
            if let Some(&next) = self.atom.get(p + AHEAD) {
                let next = next as usize;
                prefetch_row(atoms.force, 3 * next);
                prefetch_row(atoms.torque, 3 * next);
                prefetch_row(atoms.memory, width * next);
            }
            let i = i as usize;
            if i >= atoms.owned {
                continue;
            }
            let (force, torque) = (solver.forces()[p], solver.torques()[p]);
            if !(force.norm_squared() + torque.norm_squared()).is_finite() {
                return Err(NetworkError::NotFinite { step: atoms.step, tag: self.tags[p] });
            }
            let memory = &mut atoms.memory[i * width..][..width];
            memory[..3].copy_from_slice(force.as_slice());
            memory[3..NET].copy_from_slice(torque.as_slice());
            if deforms {
                let Deformation { virial, used, other, reaction } = self.state.particles.deformation[p];
                for (place, virial) in [(virials, virial), (virials + 6, used), (others, other), (others + 6, reaction)]
                {
                    memory[place..place + 6].copy_from_slice(&virial.0);
                }
            }
            add(atoms.force, i, &force);
            add(atoms.torque, i, &torque);
        }
        Ok(())
    }
}

/// Moment of inertia of a solid sphere, kg·m².
pub(super) fn inertia(mass: f64, radius: f64) -> f64 {
    0.4 * mass * (radius * radius)
}

/// The orientation stored as x, y, z, w.
fn orientation(memory: &[f64]) -> Quat {
    Quat::new(memory[3], memory[0], memory[1], memory[2])
}
