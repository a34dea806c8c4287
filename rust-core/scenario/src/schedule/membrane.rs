//! Flexible membranes that press on the outer particles.

use concordem_contact::math::Vec3;
use concordem_solver::state::particles::Load;

use super::History;

/// A membrane between the centers of particles, with a pressure.
#[derive(Debug, Clone, PartialEq)]
pub struct Membrane {
    /// Pressure, Pa.
    pub pressure: f64,
    /// A factor of the pressure, over the time of the run.
    pub history: Option<History>,
    /// Indices of the corners of each triangle, in counterclockwise order seen from outside; lines of two corners in two dimensions,
    /// where the third one repeats the second.
    pub faces: Vec<[u32; 3]>,
    /// Places of these corners in the list of all loads.
    pub places: Vec<[u32; 3]>,
    /// Whether the faces are lines of unit depth.
    pub planar: bool,
}

impl Membrane {
    /// Area vector of a face, outward, m².
    pub fn area(&self, face: usize, position: &[Vec3]) -> Vec3 {
        let [a, b, c] = self.faces[face].map(|p| position[p as usize]);
        if self.planar {
            let d = b - a;
            return Vec3::new(d.y, -d.x, 0.0);
        }
        (b - a).cross(&(c - a)) * 0.5
    }

    /// Volume that a closed membrane encloses, m³ (of unit depth in two dimensions).
    pub fn volume(&self, position: &[Vec3]) -> f64 {
        let dimension = if self.planar { 2.0 } else { 3.0 };
        let share = |face: usize| position[self.faces[face][0] as usize].dot(&self.area(face, position)) / dimension;
        (0..self.faces.len()).map(share).sum()
    }

    /// Adds the forces at `time` (s) to the loads.
    pub(super) fn press(&self, position: &[Vec3], time: f64, loads: &mut [Load]) {
        let pressure = self.pressure * self.history.as_ref().map_or(1.0, |history| history.at(time));
        let corners = if self.planar { 2 } else { 3 };
        for (face, places) in self.places.iter().enumerate() {
            let force = self.area(face, position) * (-pressure / corners as f64);
            for place in &places[..corners] {
                loads[*place as usize].force += force;
            }
        }
    }
}
