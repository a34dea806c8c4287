//! The point of a wall that a particle touches.

use crate::math::Vec3;

/// The point of a wall element nearest to a particle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosestPoint {
    /// Unit vector from the particle's centre to the wall.
    pub normal: Vec3,
    /// Distance of the centre from the surface, m (negative behind a plane or cylinder).
    pub distance: f64,
    /// The point is inside a face (not on an edge or corner).
    pub interior: bool,
}
