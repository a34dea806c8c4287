//! A circular cylinder: an infinite one, a rod, or a tube.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface as Triangles;
use concordem_solver::state::surface::{self, ClosestPoint, Cylindrical, SEAM, edge, half_circle};
use concordem_solver::state::{Surface, WallShape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{Unfit, WallKind};
use crate::schema::Axis;
use crate::schema::quantity::{Length, Quantity, vector};

/// A circular cylinder, infinite along its axis or of a given `length`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cylinder {
    /// A point on the axis, m; with `length` the center. Required.
    pub center: [Length; 3],
    /// Direction of the axis; default: "z".
    #[serde(default)]
    pub axis: Axis,
    /// Radius, m. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Length,
    /// Side on which the particles are; default: "inside".
    #[serde(default)]
    pub side: Side,
    /// Length along the axis, m; default: infinite. With the particles outside, the cylinder then is a solid rod with flat ends; inside
    /// it is a tube with open ends, which particles touch from both sides.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub length: Option<Length>,
}

/// Side of a cylinder.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Side {
    /// Particles are inside.
    #[default]
    Inside,
    /// Particles are outside.
    Outside,
}

impl Cylinder {
    fn direction(&self) -> Vec3 {
        let mut direction = Vec3::zeros();
        direction[self.axis.index()] = 1.0;
        direction
    }
}

impl WallKind for Cylinder {
    fn faults_in_plane(&self) -> Vec<Fault> {
        if self.axis != Axis::Z {
            let help = "write axis = \"z\", a circle in the plane";
            vec![Fault::conflict("axis", "the axis of the cylinder lies in the plane", help)]
        } else if self.length.is_some() {
            let help = "remove `length`; in two dimensions a cylinder is a circle";
            vec![Fault::conflict("length", "lies across the plane", help)]
        } else {
            Vec::new()
        }
    }

    fn surfaces(&self, _file: Option<Triangles>) -> Result<Vec<WallShape>, Unfit> {
        let (center, axis, radius) = (vector(&self.center), self.direction(), self.radius.si());
        let half_length = self.length.map(|length| 0.5 * length.si());
        let inside = self.side == Side::Inside;
        Ok(vec![match (half_length, inside) {
            (None, _) => WallShape::rigid(surface::Cylinder { point: center, axis, radius, inside }),
            (Some(half_length), false) => WallShape::rigid(Rod { center, axis, radius, half_length }),
            (Some(half_length), true) => WallShape::rigid(Tube { center, axis, radius, half_length }),
        }])
    }

    fn encloses(&self) -> bool {
        self.side == Side::Inside
    }

    fn axis(&self) -> Option<Vec3> {
        Some(self.direction())
    }

    fn point(&self) -> Option<Vec3> {
        Some(vector(&self.center))
    }

    fn width(&self) -> Option<f64> {
        Some((2.0 * self.radius.si()).max(self.length.map_or(0.0, Quantity::si)))
    }
}

/// Solid circular cylinder with flat ends; particles are outside.
#[derive(Debug, Clone, PartialEq)]
pub struct Rod {
    /// Center, m.
    pub center: Vec3,
    /// Unit vector of the axis.
    pub axis: Vec3,
    /// Radius, m.
    pub radius: f64,
    /// Half of the length, m.
    pub half_length: f64,
}

impl Surface for Rod {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let Self { center, axis, radius, half_length } = self;
        let Cylindrical { along, radial, rho } = Cylindrical::of(&(x - center), axis);
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

    /// On the axis, deep inside.
    fn distance_without_direction(&self, _x: &Vec3) -> f64 {
        -self.radius
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        Some(span(&self.center, &self.axis, self.radius, self.half_length, along))
    }
}

/// Mantle of a circular cylinder, without thickness and with open ends, touched from both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Tube {
    /// Center, m.
    pub center: Vec3,
    /// Unit vector of the axis.
    pub axis: Vec3,
    /// Radius, m.
    pub radius: f64,
    /// Half of the length, m.
    pub half_length: f64,
}

impl Surface for Tube {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let Self { center, axis, radius, half_length } = self;
        let Cylindrical { along, radial, rho } = Cylindrical::of(&(x - center), axis);
        let outward = (rho > 0.0).then(|| radial / rho)?;
        let beyond = along.abs() - half_length;
        if beyond <= 0.0 {
            let normal = if rho <= *radius { outward } else { -outward };
            let interior = beyond < -SEAM * half_length;
            return Some(ClosestPoint { normal, distance: (radius - rho).abs(), interior });
        }
        edge(outward * (radius - rho) - axis * (beyond * along.signum()))
    }

    /// On the axis.
    fn distance_without_direction(&self, x: &Vec3) -> f64 {
        let Cylindrical { along, rho, .. } = Cylindrical::of(&(x - self.center), &self.axis);
        (self.radius - rho).hypot((along.abs() - self.half_length).max(0.0))
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        Some(span(&self.center, &self.axis, self.radius, self.half_length, along))
    }
}

fn span(center: &Vec3, axis: &Vec3, radius: f64, half_length: f64, along: &Vec3) -> [f64; 2] {
    let (middle, half) = (center.dot(along), half_length * axis.dot(along).abs() + half_circle(axis, radius, along));
    [middle - half, middle + half]
}
