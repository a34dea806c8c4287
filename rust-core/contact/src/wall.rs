//! Contact of a particle with a wall.

use crate::math::Vec3;

/// The point of a wall element that is closest to a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoint {
    /// Unit vector from the particle's center to the wall.
    pub normal: Vec3,
    /// Distance of the center from the surface, m (negative behind a plane or cylinder).
    pub distance: f64,
    /// Whether the point lies inside a face (not on an edge or corner).
    pub interior: bool,
}
