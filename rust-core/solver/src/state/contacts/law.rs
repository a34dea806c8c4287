//! What the law of a block says.

use concordem_contact::law::{ContactLaw, Kinematics, Reference};

use super::{ContactBlock, ContactFlags};
use crate::state::particles::Particles;

/// What the law of a block says, besides forces and stiffnesses.
pub trait LawOfContacts: Send + Sync {
    /// Name of the law.
    fn law(&self) -> &'static str;
    /// Whether the law supports deformable particles ([`ContactLaw::DEFORMS`]).
    fn deforms(&self) -> bool;
    /// Whether the measure reads orientations (otherwise rotations of the step).
    fn reads_orientations(&self) -> bool;
    /// [`ContactLaw::READS_OLD_ELONGATION`].
    fn reads_old_elongation(&self) -> bool;
    /// Damage of contact `k`, 0 to 1.
    fn damage(&self, k: usize) -> f64;
    /// Fraction of its strength that contact `k` has lost, 0 to 1.
    fn lost_strength(&self, k: usize) -> f64;
    /// Longest bond with the pair coefficients `row`, m; see [`ContactLaw::longest_bond`].
    fn longest_bond(&self, row: u16) -> f64;
    /// The bond that is longest compared to the longest one of its pair coefficients, and the ratio of these lengths; `None` if any length
    /// will do.
    fn relatively_longest(&self) -> Option<(usize, f64)>;
    /// Cross-section of a bond with the pair coefficients `row`, m²; see [`ContactLaw::bonded_area`].
    fn bonded_area(&self, row: u16, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64;
    /// Axial force of bond `k`, N, at its length in the last evaluation; see [`ContactLaw::axial_force`].
    fn axial_force(&self, k: usize, particles: &Particles) -> Option<f64>;
    /// Distances from the centers of A and B to the contact point of contact `k`, m, at the center distance `length` (m).
    fn arms(&self, k: usize, particles: &Particles, length: f64) -> (f64, f64);
    /// Reference of an unbonded contact that begins; see [`ContactLaw::unbonded_reference`].
    fn unbonded_reference(&self, length: f64, radius_a: f64, radius_b: f64) -> Reference;
    /// Reference that the broken bond `k` leaves to the unbonded contact; see [`ContactLaw::kept_reference`].
    fn kept_reference(&self, k: usize) -> Option<Reference>;
    /// Center distance at which bond `k` is without normal force, m; see [`ContactLaw::unstrained_length`].
    fn unstrained_length(&self, k: usize, particles: &Particles) -> f64;
}

/// Whether contact `k` never had strength, as a bond of an open joint: it has lost all without damage.
pub fn is_open<C: LawOfContacts + ?Sized>(block: &C, k: usize) -> bool {
    block.damage(k) == 0.0 && block.lost_strength(k) == 1.0
}

impl<L: ContactLaw> LawOfContacts for ContactBlock<L> {
    fn law(&self) -> &'static str {
        L::NAME
    }
    fn deforms(&self) -> bool {
        L::DEFORMS
    }
    fn reads_orientations(&self) -> bool {
        L::Kinematics::READS_ORIENTATIONS
    }
    fn reads_old_elongation(&self) -> bool {
        L::READS_OLD_ELONGATION
    }
    fn damage(&self, k: usize) -> f64 {
        L::damage(&self.history.get(k))
    }
    fn lost_strength(&self, k: usize) -> f64 {
        self.rows[self.flags[k].row as usize].lost_strength(self.reference.get(k), &self.history.get(k))
    }
    fn longest_bond(&self, row: u16) -> f64 {
        self.rows[row as usize].longest_bond()
    }
    fn relatively_longest(&self) -> Option<(usize, f64)> {
        if self.rows.iter().all(|law| law.longest_bond() == f64::INFINITY) {
            return None;
        }
        let ratio = |k: usize| self.reference.get(k).length / self.longest_bond(self.flags[k].row);
        let bonds = (0..self.flags.len()).filter(|&k| self.flags[k].has(ContactFlags::BONDED));
        bonds.map(|k| (k, ratio(k))).max_by(|a, b| a.1.total_cmp(&b.1))
    }
    fn bonded_area(&self, row: u16, radius_a: f64, radius_b: f64, mean_radius: f64) -> f64 {
        self.rows[row as usize].bonded_area(radius_a, radius_b, mean_radius)
    }
    fn axial_force(&self, k: usize, particles: &Particles) -> Option<f64> {
        let geometry = self.geometry(k, particles, false);
        self.rows[self.flags[k].row as usize].axial_force(&geometry, self.previous.get(k).length)
    }
    fn arms(&self, k: usize, particles: &Particles, length: f64) -> (f64, f64) {
        L::Kinematics::arms(&self.geometry(k, particles, false), length)
    }
    fn unbonded_reference(&self, length: f64, radius_a: f64, radius_b: f64) -> Reference {
        L::unbonded_reference(length, radius_a, radius_b)
    }
    fn kept_reference(&self, k: usize) -> Option<Reference> {
        self.rows[self.flags[k].row as usize].kept_reference(self.reference.get(k))
    }
    fn unstrained_length(&self, k: usize, particles: &Particles) -> f64 {
        self.rows[self.flags[k].row as usize].unstrained_length(&self.geometry(k, particles, false))
    }
}
