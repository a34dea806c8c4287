//! How stiff contacts are, for the bounds of the time step.

use concordem_contact::law::{ContactGeometry, ContactLaw, Stiffness};

use super::{ContactBlock, ContactFlags};
use crate::state::particles::Particles;

/// Largest stiffnesses of contacts, now and where particles may meet: they bound the time step.
pub trait ContactStiffness: Send + Sync {
    /// Largest stiffness of contact `k`.
    fn stiffness(&self, k: usize, particles: &Particles, with_wall: bool) -> Stiffness;
    /// Largest stiffness of contact `k` at its present overlap `overlap` (m), if that is beyond the overlap for which
    /// [`Self::stiffness`] holds.
    fn stiffness_at(&self, k: usize, particles: &Particles, with_wall: bool, overlap: f64) -> Stiffness;
    /// Largest stiffness of a contact with the pair coefficients `row` between particles of the given masses (kg) and
    /// radii (m; B is a wall with radius 0 and infinite mass) that meet at `speed` (m/s), and its overlap (m).
    fn impact(&self, row: u16, geometry: &ContactGeometry, speed: f64) -> (Stiffness, f64);
    /// [`ContactLaw::STIFFENS`].
    fn stiffens(&self) -> bool;
    /// Largest stiffness of a contact with the pair coefficients `row` up to the overlap `overlap` (m).
    fn compressed(&self, row: u16, geometry: &ContactGeometry, overlap: f64) -> Stiffness;
    /// Overlap at which a contact of parameter row `row` presses with `force` (N), m; see [`ContactLaw::overlap_under`].
    fn overlap_under(&self, row: u16, geometry: &ContactGeometry, force: f64) -> f64;
}

impl<L: ContactLaw> ContactStiffness for ContactBlock<L> {
    fn stiffness(&self, k: usize, particles: &Particles, with_wall: bool) -> Stiffness {
        let mut geometry = self.geometry(k, particles, with_wall);
        if !self.flags[k].has(ContactFlags::ACTIVE) && !self.flags[k].has(ContactFlags::KEPT_REFERENCE) {
            // A candidate is treated as if it touched now.
            let touching =
                L::unbonded_reference(geometry.radius_a + geometry.radius_b, geometry.radius_a, geometry.radius_b);
            geometry.reference_length = touching.length;
            geometry.area = touching.area;
        }
        self.rows[self.flags[k].row as usize].stiffness(&geometry)
    }
    fn stiffness_at(&self, k: usize, particles: &Particles, with_wall: bool, overlap: f64) -> Stiffness {
        let geometry = self.geometry(k, particles, with_wall);
        self.rows[self.flags[k].row as usize].stiffness_at(&geometry, overlap)
    }
    fn impact(&self, row: u16, geometry: &ContactGeometry, speed: f64) -> (Stiffness, f64) {
        let touching =
            L::unbonded_reference(geometry.radius_a + geometry.radius_b, geometry.radius_a, geometry.radius_b);
        let geometry = ContactGeometry { reference_length: touching.length, area: touching.area, ..*geometry };
        let law = &self.rows[row as usize];
        let overlap = law.impact_overlap(&geometry, speed);
        let stiffness = if overlap > 0.0 { law.stiffness_at(&geometry, overlap) } else { law.stiffness(&geometry) };
        (stiffness, overlap)
    }
    fn stiffens(&self) -> bool {
        L::STIFFENS
    }
    fn compressed(&self, row: u16, geometry: &ContactGeometry, overlap: f64) -> Stiffness {
        self.rows[row as usize].stiffness_at(geometry, overlap)
    }
    fn overlap_under(&self, row: u16, geometry: &ContactGeometry, force: f64) -> f64 {
        self.rows[row as usize].overlap_under(geometry, force)
    }
}
