//! Walls of finite size: plates, rods, and tubes.

use concordem_contact::math::Vec3;
use concordem_contact::wall::ClosestPoint;

/// Part of a face at its edge, over half of its length, whose points count as points of the edge: where two periodic images of a wall meet,
/// one of two edges acts, but two faces would both act.
const SEAM: f64 = 1e-9;

/// Shape of a wall of finite size at zero displacement. Its closest point changes continuously over edges and rims.
#[derive(Debug, Clone, PartialEq)]
pub enum FiniteShape {
    /// Flat rectangle without thickness, touched from both sides.
    Rectangle {
        /// Center, m.
        center: Vec3,
        /// Unit normal.
        normal: Vec3,
        /// Vectors from the center to the middles of two neighboring edges, perpendicular to each other and to the normal, m.
        half_edges: [Vec3; 2],
    },
    /// Flat disc without thickness, touched from both sides.
    Disc {
        /// Center, m.
        center: Vec3,
        /// Unit normal.
        normal: Vec3,
        /// Radius, m.
        radius: f64,
    },
    /// Solid circular cylinder with flat ends; particles are outside.
    Rod {
        /// Center, m.
        center: Vec3,
        /// Unit vector of the axis.
        axis: Vec3,
        /// Radius, m.
        radius: f64,
        /// Half of the length, m.
        half_length: f64,
    },
    /// Mantle of a circular cylinder, without thickness and with open ends, touched from both sides.
    Tube {
        /// Center, m.
        center: Vec3,
        /// Unit vector of the axis.
        axis: Vec3,
        /// Radius, m.
        radius: f64,
        /// Half of the length, m.
        half_length: f64,
    },
}

impl FiniteShape {
    /// Center, m.
    pub fn center(&self) -> &Vec3 {
        match self {
            Self::Rectangle { center, .. }
            | Self::Disc { center, .. }
            | Self::Rod { center, .. }
            | Self::Tube { center, .. } => center,
        }
    }

    /// Half of the extent along the unit vector `along`, m.
    pub fn half_extent(&self, along: &Vec3) -> f64 {
        // Extent of a circle about the unit vector `axis`.
        let circle = |axis: &Vec3, radius: f64| radius * (1.0 - axis.dot(along).powi(2)).max(0.0).sqrt();
        match self {
            Self::Rectangle { half_edges: [a, b], .. } => a.dot(along).abs() + b.dot(along).abs(),
            Self::Disc { normal, radius, .. } => circle(normal, *radius),
            Self::Rod { axis, radius, half_length, .. } | Self::Tube { axis, radius, half_length, .. } => {
                half_length * axis.dot(along).abs() + circle(axis, *radius)
            }
        }
    }

    /// Closest point to the point `x` (m); `None` where its direction is undefined: on the axis of a tube, on the axis of a rod deep
    /// inside, and on a plate.
    pub fn closest_point(&self, x: &Vec3) -> Option<ClosestPoint> {
        let r = x - self.center();
        match self {
            Self::Rectangle { normal, half_edges, .. } => {
                let place = half_edges.map(|edge| r.dot(&edge) / edge.norm_squared());
                if place.iter().all(|t| t.abs() <= 1.0) {
                    let interior = place.iter().all(|t| t.abs() < 1.0 - SEAM);
                    return face(normal, r.dot(normal), interior);
                }
                let [s, t] = place.map(|t| t.clamp(-1.0, 1.0));
                edge(half_edges[0] * s + half_edges[1] * t - r)
            }
            Self::Disc { normal, radius, .. } => {
                let height = r.dot(normal);
                let radial = r - normal * height;
                let rho = radial.norm();
                if rho <= *radius {
                    return face(normal, height, true);
                }
                edge(radial * (radius / rho - 1.0) - normal * height)
            }
            Self::Rod { axis, radius, half_length, .. } => {
                let Cylindrical { along, radial, rho } = Cylindrical::of(&r, axis);
                // Distances from the mantle and from the nearer end, negative inside.
                let (mantle, end) = (rho - radius, along.abs() - half_length);
                if mantle > 0.0 && end > 0.0 {
                    return edge(-radial * (mantle / rho) - axis * (end * along.signum()));
                }
                if end > mantle {
                    return Some(ClosestPoint { normal: -axis * along.signum(), distance: end, interior: true });
                }
                let outward = (rho > 0.0).then(|| radial / rho)?;
                let interior = end < -SEAM * half_length;
                Some(ClosestPoint { normal: -outward, distance: mantle, interior })
            }
            Self::Tube { axis, radius, half_length, .. } => {
                let Cylindrical { along, radial, rho } = Cylindrical::of(&r, axis);
                let outward = (rho > 0.0).then(|| radial / rho)?;
                let beyond = along.abs() - half_length;
                if beyond <= 0.0 {
                    let normal = if rho <= *radius { outward } else { -outward };
                    let interior = beyond < -SEAM * half_length;
                    return Some(ClosestPoint { normal, distance: (radius - rho).abs(), interior });
                }
                edge(outward * (radius - rho) - axis * (beyond * along.signum()))
            }
        }
    }

    /// Distance of the point `x` (m) from the surface, m, negative inside a rod; also where [`Self::closest_point`] is `None`.
    pub fn distance(&self, x: &Vec3) -> f64 {
        if let Some(found) = self.closest_point(x) {
            return found.distance;
        }
        match self {
            Self::Rectangle { .. } | Self::Disc { .. } => 0.0,
            Self::Rod { radius, .. } => -radius,
            Self::Tube { axis, radius, half_length, .. } => {
                let Cylindrical { along, rho, .. } = Cylindrical::of(&(x - self.center()), axis);
                (radius - rho).hypot((along.abs() - half_length).max(0.0))
            }
        }
    }
}

/// A vector from the center, m, in parts along and across an axis.
struct Cylindrical {
    along: f64,
    radial: Vec3,
    /// Length of `radial`.
    rho: f64,
}

impl Cylindrical {
    fn of(r: &Vec3, axis: &Vec3) -> Self {
        let along = r.dot(axis);
        let radial = r - axis * along;
        Self { along, radial, rho: radial.norm() }
    }
}

/// The point below a center at the height `height` (m, with its sign) over a face with this unit normal.
fn face(normal: &Vec3, height: f64, interior: bool) -> Option<ClosestPoint> {
    (height != 0.0).then(|| ClosestPoint { normal: -normal * height.signum(), distance: height.abs(), interior })
}

/// The point of an edge or rim at the vector `to` (m) from the center of the particle.
fn edge(to: Vec3) -> Option<ClosestPoint> {
    let distance = to.norm();
    (distance > 0.0).then(|| ClosestPoint { normal: to / distance, distance, interior: false })
}
