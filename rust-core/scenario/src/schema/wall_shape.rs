//! Shapes of walls, and what loadings, samples, and files ask of them. The checks of shapes are in `checks/walls.rs`, their surfaces in
//! `assembly/walls.rs`.

use concordem_contact::math::Vec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::{Length, Number, Quantity, vector};

/// Surface of a wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum WallShape {
    /// An infinite plane.
    Plane {
        /// A point on the plane, m. Required.
        point: [Length; 3],
        /// Direction from the wall to the particles, a vector of any length. Required. Example: `normal = [0, 0, 1]`.
        normal: [Number; 3],
    },
    /// The six faces of a box with the particles inside; each face is a separate wall.
    Box {
        /// Corner with the smallest coordinates, m. Required.
        minimum: [Length; 3],
        /// Corner with the largest coordinates, m. Required.
        maximum: [Length; 3],
    },
    /// A circular cylinder, infinite along its axis or of a given `length`.
    Cylinder {
        /// A point on the axis, m; with `length` the center. Required.
        center: [Length; 3],
        /// Direction of the axis; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Side on which the particles are; default: "inside".
        #[serde(default)]
        side: Side,
        /// Length along the axis, m; default: infinite. With the particles outside, the cylinder then is a solid rod with flat ends; inside
        /// it is a tube with open ends, which particles touch from both sides.
        #[schemars(extend("exclusiveMinimum" = 0))]
        length: Option<Length>,
    },
    /// A flat plate without thickness; particles touch it from both sides. A rectangle has `edges`, a disc `normal` and `radius`.
    Plate {
        /// Center, m. Required.
        center: [Length; 3],
        /// Two neighboring edges of a rectangle, vectors perpendicular to each other, m.
        /// Example: `edges = [["20 mm", 0, 0], [0, "10 mm", 0]]`.
        edges: Option<[[Length; 3]; 2]>,
        /// Direction across a disc, a vector of any length. Example: `normal = [0, 0, 1]`.
        normal: Option<[Number; 3]>,
        /// Radius of a disc, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
    },
    /// Triangles of an STL file; particles touch them from both sides.
    Facets {
        /// Path of the STL file, relative to the scenario. Required. Example: `path = "hopper.stl"`.
        path: String,
        /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
        #[serde(default = "super::packing::one_meter")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
    },
    /// Triangles whose vertices move with `motion`, or by calls from Python; particles touch them from both sides. Give `path`, or
    /// `vertices` and `triangles`.
    Mesh {
        /// Path of an STL file, relative to the scenario. Its vertices are numbered in the order in which they first appear. Example:
        /// `path = "drum.stl"`.
        path: Option<String>,
        /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Option<Length>,
        /// Positions of the vertices at the start, m. Example: `vertices = [[0, 0, 0], ["1 mm", 0, 0], [0, "1 mm", 0]]`.
        vertices: Option<Vec<[Length; 3]>>,
        /// Vertices of each triangle, counted from 0. Example: `triangles = [[0, 1, 2]]`.
        triangles: Option<Vec<[u32; 3]>>,
    },
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

impl WallShape {
    /// Number of walls that it makes: a box has six faces.
    pub fn faces(&self) -> usize {
        match self {
            Self::Box { .. } => 6,
            Self::Plane { .. }
            | Self::Cylinder { .. }
            | Self::Plate { .. }
            | Self::Facets { .. }
            | Self::Mesh { .. } => 1,
        }
    }

    /// Whether its vertices move on their own.
    pub fn is_mesh(&self) -> bool {
        matches!(self, Self::Mesh { .. })
    }

    /// Whether it encloses the particles.
    pub fn encloses(&self) -> bool {
        matches!(self, Self::Box { .. } | Self::Cylinder { side: Side::Inside, .. })
    }

    /// Path of the file with its triangles.
    pub fn file(&self) -> Option<&str> {
        match self {
            Self::Facets { path, .. } | Self::Mesh { path: Some(path), .. } => Some(path),
            Self::Plane { .. }
            | Self::Box { .. }
            | Self::Cylinder { .. }
            | Self::Plate { .. }
            | Self::Mesh { path: None, .. } => None,
        }
    }

    /// Unit vector of the axis about which it can turn; zero for shapes that cannot.
    pub fn axis(&self) -> Vec3 {
        match self {
            Self::Plane { normal, .. } | Self::Plate { normal: Some(normal), .. } => vector(normal).normalize(),
            Self::Cylinder { axis, .. } => {
                let mut direction = Vec3::zeros();
                direction[axis.index()] = 1.0;
                direction
            }
            Self::Plate { normal: None, .. } | Self::Box { .. } | Self::Facets { .. } | Self::Mesh { .. } => {
                Vec3::zeros()
            }
        }
    }

    /// A point of its axis, m, also of one about which it cannot turn.
    pub fn axis_point(&self) -> Option<Vec3> {
        match self {
            Self::Plane { point, .. } | Self::Cylinder { center: point, .. } | Self::Plate { center: point, .. } => {
                Some(vector(point))
            }
            Self::Box { .. } | Self::Facets { .. } | Self::Mesh { .. } => None,
        }
    }

    /// Direction from face `face` to the particles, not of length 1, in which servos push; `None` for shapes without one.
    pub fn normal(&self, face: usize) -> Option<Vec3> {
        match self {
            Self::Plane { normal, .. } => Some(vector(normal)),
            Self::Box { .. } => {
                let mut normal = Vec3::zeros();
                normal[face / 2] = if face.is_multiple_of(2) { 1.0 } else { -1.0 };
                Some(normal)
            }
            Self::Cylinder { .. } | Self::Plate { .. } | Self::Facets { .. } | Self::Mesh { .. } => None,
        }
    }

    /// Largest edge, diameter, or length, m; `None` for planes, which have none, and triangles, which may be in a file.
    pub fn width(&self) -> Option<f64> {
        match self {
            Self::Box { minimum, maximum } => Some((vector(maximum) - vector(minimum)).max()),
            Self::Cylinder { radius, length, .. } => Some((2.0 * radius.si()).max(length.map_or(0.0, Quantity::si))),
            Self::Plate { edges: Some(edges), .. } => {
                Some(edges.iter().map(|edge| vector(edge).norm()).fold(0.0, f64::max))
            }
            Self::Plate { radius, .. } => Some(2.0 * radius.map_or(0.0, Quantity::si)),
            Self::Plane { .. } | Self::Facets { .. } | Self::Mesh { .. } => None,
        }
    }
}
