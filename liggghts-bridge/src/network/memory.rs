//! Data that the network stores per atom in the host's arrays, and its transfer to and from the solver's state.

use concordem_contact::math::{Quat, Symmetric, Vec3, normalized, quaternion_of_rotation_vector};
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
    /// Virials of a deformable particle: from forces that do not depend on its strain, and from reactions (six reals each).
    others: usize,
    /// Orientation (x, y, z, w).
    orientation: usize,
    /// Virials that determine the strain of the next step, and of the last step (six reals each).
    virials: usize,
    /// Reals per atom.
    pub(super) width: usize,
}

impl Layout {
    /// Whether atoms have an orientation.
    pub(super) fn has_orientation(&self) -> bool {
        self.virials > self.orientation
    }

    pub(super) fn new(oriented: bool, deformable: bool) -> Self {
        let others = ID + 1;
        let orientation = others + if deformable { 12 } else { 0 };
        let virials = orientation + if oriented { 4 } else { 0 };
        Self { others, orientation, virials, width: virials + if deformable { 12 } else { 0 } }
    }
}

impl Network {
    /// Reals stored per atom: net force and torque of the last step, the id at the last rebuild, the orientation (x, y, z, w) if the law reads it, and four
    /// virials if the particle is deformable.
    pub fn atom_width(&self) -> usize {
        self.layout.width
    }

    /// How many of these reals ghosts need at every step; they come last.
    pub fn communicated(&self) -> usize {
        self.layout.width - self.layout.orientation
    }

    /// Initialize the data of a new atom.
    pub fn initial_memory(&self, memory: &mut [f64]) {
        memory.fill(0.0);
        if self.needs_orientation() {
            memory[self.layout.orientation + 3] = 1.0;
        }
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

    /// Read positions, motion, and virials of all particles from the host's arrays. `still`: nothing moves (setup of a run).
    pub(super) fn read_atoms(&mut self, atoms: &Atoms<'_>, still: bool) {
        let Layout { others, orientation: oriented, virials, width } = self.layout;
        let particles = &mut self.state.particles;
        for (p, &i) in self.atom.iter().enumerate() {
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

/// The orientation stored as x, y, z, w.
fn orientation(memory: &[f64]) -> Quat {
    Quat::new(memory[3], memory[0], memory[1], memory[2])
}
