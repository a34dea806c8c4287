//! Sums over the contacts of particles.

use concordem_contact::kinematics::deformable::ParticleVirials;
use concordem_contact::wrench::Wrench;

/// Sums to which an evaluation adds forces and virials; all slices are by particle.
pub struct ParticleSums<'a> {
    /// Net contact force and torque.
    pub net: &'a mut [Wrench],
    /// Particle virials; empty if the particles are rigid.
    pub virials: ParticleVirials<'a>,
}

impl ParticleSums<'_> {
    /// The same sums, borrowed for a shorter time.
    pub fn reborrow(&mut self) -> ParticleSums<'_> {
        ParticleSums { net: self.net, virials: self.virials.reborrow() }
    }
}
