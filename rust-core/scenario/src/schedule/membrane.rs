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
    /// Radius of the widest gap that the membrane spans, m.
    pub reach: f64,
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

    /// Longest edge of a face over the widest gap. At the start at most 1; more, where its particles have moved apart.
    fn stretch(&self, face: usize, position: &[Vec3]) -> f64 {
        let [a, b, c] = self.faces[face].map(|p| position[p as usize]);
        let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
        longest.sqrt() / (2.0 * self.reach)
    }

    /// Share of the pressure that a face carries, which falls from 1 at the widest gap to 0 at twice as much. Else a particle that leaves
    /// the body would draw out its faces, whose forces grow with their areas, and fly off ever faster.
    fn hold(stretch: f64) -> f64 {
        (2.0 - stretch).clamp(0.0, 1.0)
    }

    /// The number of faces that have torn, or begin to.
    pub fn torn(&self, position: &[Vec3]) -> usize {
        (0..self.faces.len()).filter(|&face| self.stretch(face, position) > 1.0).count()
    }

    /// Pressure at `time` (s), Pa.
    pub(super) fn pressure_at(&self, time: f64) -> f64 {
        self.pressure * self.history.as_ref().map_or(1.0, |history| history.at(time))
    }

    /// Adds the forces at `time` (s) to the loads.
    pub(super) fn press(&self, position: &[Vec3], time: f64, loads: &mut [Load]) {
        let pressure = self.pressure_at(time);
        let corners = if self.planar { 2 } else { 3 };
        for (face, places) in self.places.iter().enumerate() {
            let held = pressure * Self::hold(self.stretch(face, position));
            let force = self.area(face, position) * (-held / corners as f64);
            for place in &places[..corners] {
                loads[*place as usize].force += force;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use concordem_contact::math::Symmetric;

    use super::*;

    /// A triangle that is drawn out by one corner: all of its force up to the widest gap, none from twice as much on, and no jump between.
    #[test]
    fn a_face_that_is_drawn_out_tears() {
        let membrane = Membrane {
            pressure: 3.0,
            history: None,
            faces: vec![[0, 1, 2]],
            places: vec![[0, 1, 2]],
            planar: false,
            reach: 1.0,
        };
        let pressed = |x: f64| {
            let position = [Vec3::zeros(), Vec3::y(), Vec3::new(x, 0.0, 0.0)];
            let mut loads: Vec<Load> = (0..3)
                .map(|particle| Load {
                    particle,
                    force: Vec3::zeros(),
                    moment: Vec3::zeros(),
                    virial: Symmetric::default(),
                })
                .collect();
            membrane.press(&position, 0.0, &mut loads);
            (loads[2].force.z, membrane.torn(&position))
        };
        let wide = 3.0_f64.sqrt();
        // The force on a corner is a third of the pressure times the area, here x/2.
        assert_eq!(pressed(1.0), (0.5, 0));
        assert!((pressed(wide).0 - 0.5 * wide).abs() < 1e-12);
        let last = pressed(wide * (1.0 + 1e-9));
        assert!((last.0 - 0.5 * wide).abs() < 1e-8 && last.1 == 1, "{last:?}");
        // The longest edge is √(x² + 1) = 3, in the middle between the widest gap 2 and its double.
        let half = 8.0_f64.sqrt();
        assert!((pressed(half).0 - 0.25 * half).abs() < 1e-12, "{:?}", pressed(half));
        assert_eq!(pressed(4.0), (0.0, 1));
    }
}
