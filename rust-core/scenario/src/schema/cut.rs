//! Cuts: notches, holes, and cracks that exist from the start.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::packing::Axis;
use super::quantity::Length;

/// A notch, a hole, or a crack that exists from the start. Bonds that cross it are not made; particles on its two sides touch by the
/// law of `contacts`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// Shape of the cut. Required.
    /// Example: `shape = { kind = "box", minimum = ["-1 mm", "-1 m", 0], maximum = ["1 mm", "1 m", "20 mm"] }`.
    pub shape: CutShape,
    /// Whether the packing also loses the particles with their center inside a "box", "sphere", or "cylinder"; default: false. The
    /// others are then numbered without gaps.
    #[serde(default)]
    pub remove_particles: bool,
}

/// Shape of a cut. A bond crosses it if the straight line between the two centers does. In a periodic cell all images of the shape
/// cut.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum CutShape {
    /// A straight line in the plane of `dimension = 2`. A center on the line belongs to its left side.
    Line {
        /// First end, m. Required. Example: `from = [0, 0]`.
        from: [Length; 2],
        /// Other end, m. Required. Example: `to = [0, "10 mm"]`.
        to: [Length; 2],
    },
    /// A parallelogram without thickness. A center on its plane belongs to the side to which the cross product of the edges points.
    Parallelogram {
        /// A corner, m. Required.
        corner: [Length; 3],
        /// The two edges that start at the corner, m. Required. Example: `edges = [["10 mm", 0, 0], [0, 0, "5 mm"]]`.
        edges: [[Length; 3]; 2],
    },
    /// A box, also its inside.
    Box {
        /// Corner with the smallest coordinates, m. Required.
        minimum: [Length; 3],
        /// Corner with the largest coordinates, m. Required.
        maximum: [Length; 3],
    },
    /// A sphere, also its inside; a circle if `dimension = 2`.
    Sphere {
        /// Center, m. Required.
        center: [Length; 3],
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// A circular cylinder, also its inside.
    Cylinder {
        /// Middle of the axis, m. Required.
        center: [Length; 3],
        /// Direction of the axis; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Length along the axis, m; default: infinite.
        #[schemars(extend("exclusiveMinimum" = 0))]
        length: Option<Length>,
    },
    /// The triangles of an STL file, without the inside of a closed surface.
    Facets {
        /// Path of the STL file, relative to the scenario. Required. Example: `path = "crack.stl"`.
        path: String,
        /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
        #[serde(default = "super::packing::one_meter")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
    },
}

impl CutShape {
    /// Whether the shape has an inside.
    pub(crate) fn is_solid(&self) -> bool {
        matches!(self, Self::Box { .. } | Self::Sphere { .. } | Self::Cylinder { .. })
    }
}
