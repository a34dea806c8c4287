//! Forces of the last step, and results per particle for YADE's `CpmState`.

use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::stress::{ParticleVolume, Partition, particle_stress, region_stress};
use concordem_operator::{ContactSet, LoadSet, OperatorError, Region, Truncation};
use concordem_solver::record::ContactForces;
use concordem_solver::state::contacts::{ContactFlags, ContactView};

use super::Assembly;

/// Attributes of YADE's `CpmState`, in the order of the particles.
#[derive(Debug, Clone, Default)]
pub struct ParticleResults {
    /// `normDmg`: mean lost strength of the bonds, 1 for a bond or contact that ended.
    pub damage: Vec<f64>,
    /// `numBrokenCohesive`: bonds that broke, and unbonded contacts that opened, because YADE's law counts both.
    pub lost: Vec<u32>,
    /// `stress`: mean stress, Pa, symmetric.
    pub stress: Vec<Mat3>,
}

impl Assembly {
    /// Forces of all contacts in the last step. Branch vectors are those of that step, or, with the present positions (m) of the
    /// particles in the order of the particles, the present ones, as in YADE's operators.
    pub fn last_forces(&self, present: Option<&[Vec3]>) -> ContactForces {
        let mut forces = self.solver.last_forces(&self.state).contacts;
        if let Some(present) = present {
            self.replace_branches(&mut forces, |view| {
                let [a, b] = [view.pair.a, view.pair.b].map(|p| present[p as usize]);
                b + self.state.cell.map_or(Vec3::zeros(), |cell| cell.shift(view.flags.image)) - a
            });
        }
        forces
    }

    /// `Σ l⊗f` over all contacts in the last step, J, branch vector first; `present` as in [`Self::last_forces`].
    ///
    /// # Errors
    /// A force that is not finite.
    pub fn virial(&self, present: Option<&[Vec3]>) -> Result<Mat3, OperatorError> {
        let forces = self.last_forces(present);
        // With volume 1, the stress equals the sum.
        let all = Region::All { volume: 1.0 };
        Ok(region_stress(&forces.set(&self.state.particles)?, &all, Truncation::BranchClipped, None)?.stress)
    }

    /// The attributes of `CpmState`, as YADE's `CpmStateUpdater` computes them: the volume of a particle is that of the sphere divided
    /// by a solid fraction of 0.62, and it gets half of `L₀n⊗f` of every contact with the reference length `L₀` and the normal `n`.
    ///
    /// # Errors
    /// A force that is not finite.
    pub fn particle_results(&self) -> Result<ParticleResults, OperatorError> {
        let particles = &self.state.particles;
        let count = particles.len();
        let mut forces = self.last_forces(None);
        self.replace_branches(&mut forces, |view| view.previous.normal * view.reference.length);
        let ContactForces { pair, branch, point, force, .. } = &forces;
        let contacts = ContactSet::new(&particles.position, pair, branch, point, force, None)?;
        let volumes = ParticleVolume::Packing(0.62).of(&particles.radius)?;
        let stress = particle_stress(&contacts, &LoadSet::none(), Partition::HalfBranch, &volumes)?;
        let stress = stress.iter().map(|sigma| (sigma + sigma.transpose()) * 0.5).collect();
        let lost: Vec<u32> = self.losses.iter().zip(&self.openings).map(|(bonds, contacts)| bonds + contacts).collect();
        let (mut bonds, mut sums) = (vec![0_u32; count], vec![0.0; count]);
        for block in &self.state.bonds {
            for k in 0..block.len() {
                let view = block.view(k);
                if view.flags.has(ContactFlags::BROKEN) {
                    continue;
                }
                for p in [view.pair.a, view.pair.b] {
                    bonds[p as usize] += 1;
                    sums[p as usize] += block.lost_strength(k);
                }
            }
        }
        let damage = (0..count)
            .map(|p| {
                let total = bonds[p] + lost[p];
                if total > 0 { (sums[p] + f64::from(lost[p])) / f64::from(total) } else { 0.0 }
            })
            .collect();
        Ok(ParticleResults { damage, lost, stress })
    }

    /// Replace the branch vector of every contact.
    fn replace_branches(&self, forces: &mut ContactForces, branch_of: impl Fn(&ContactView) -> Vec3) {
        let mut start = 0;
        let blocks = self.state.bonds.iter().chain(&self.state.contacts);
        for (block, &end) in blocks.zip(&forces.block_end) {
            for row in start..end {
                forces.branch[row] = branch_of(&block.view(forces.place[row] as usize));
            }
            start = end;
        }
    }
}
