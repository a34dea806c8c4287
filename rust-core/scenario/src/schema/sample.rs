//! Tables `[[sample]]`: operators that are evaluated during the run, and their regions.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Area, Length, Number, StrainRate, Velocity, Volume};
use crate::sampling::{Operator, SampleKey};
use concordem_operator::Truncation;
use concordem_operator::stress::Partition;

/// An operator that is evaluated during the run; its records go to `/samples/NAME` of the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatorSample {
    /// Quantity to evaluate. Required. Example: `operator = "region-stress"`.
    pub operator: Operator,
    /// Name in the result; default: the name of the operator. Example: `name = "core stress"`.
    pub name: Option<String>,
    /// Region to evaluate; default: the periodic cell. Required if there is no cell.
    /// Example: `region = { kind = "sphere", center = [0, 0, 0], radius = "5 mm" }`.
    pub region: Option<SampleRegion>,
    /// Number of cells along x, y, z into which a box is divided; each cell gives its own values.
    /// Example: `grid = [4, 4, 8]`.
    pub grid: Option<[usize; 3]>,
    /// Treatment of contacts that cross the boundary of the region, for `region-stress` and `fabric`; default:
    /// "branch-clipped", or "half-crossing" for a list of particles.
    pub truncation: Option<Truncation>,
    /// Division of the branch vector between the two particles of a contact, for `particle-stress`; default:
    /// "contact-point".
    pub partition: Option<Partition>,
    /// Name of the wall; required for `wall-traction`. A box has six walls: "NAME x minimum", "NAME x maximum", ...
    pub wall: Option<String>,
    /// Area that the traction refers to, m²; required for `wall-traction`. Example: `area = "36 mm^2"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub area: Option<Area>,
    /// Name of the set of particles; required for `set-force` and `set-motion`. Example: `set = "top"`.
    pub set: Option<String>,
    /// Names of the two sets between which `gauge` measures. Example: `sets = ["lower mark", "upper mark"]`.
    pub sets: Option<[String; 2]>,
    /// Point that the moment of `set-force` refers to, m; default: the mean position of the set. Example: `about = [0, 0, 0]`.
    pub about: Option<[Length; 3]>,
    /// Velocity of the region, m/s; default: zero. Example: `velocity = [0, 0, "1 mm/s"]`.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Velocity gradient with which the region deforms about its center, 1/s; default: zero. Row i holds the derivatives of
    /// the velocity along axis i.
    #[serde(default)]
    pub velocity_gradient: [[StrainRate; 3]; 3],
    /// Steps between two evaluations; default: `output.sample_interval`. Example: `interval = 100`.
    #[schemars(range(min = 1))]
    pub interval: Option<u64>,
}

impl OperatorSample {
    /// Name in the result.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_else(|| self.operator.name())
    }

    /// Whether the table gives `key`; zero velocities count as not given.
    pub fn gives(&self, key: SampleKey) -> bool {
        match key {
            SampleKey::Region => self.region.is_some(),
            SampleKey::Grid => self.grid.is_some(),
            SampleKey::Velocity => self.velocity.iter().any(|v| v.si() != 0.0),
            SampleKey::VelocityGradient => self.velocity_gradient.iter().flatten().any(|v| v.si() != 0.0),
            SampleKey::Truncation => self.truncation.is_some(),
            SampleKey::Partition => self.partition.is_some(),
            SampleKey::Wall => self.wall.is_some(),
            SampleKey::Area => self.area.is_some(),
            SampleKey::Set => self.set.is_some(),
            SampleKey::Sets => self.sets.is_some(),
            SampleKey::About => self.about.is_some(),
        }
    }
}

/// Region in which an operator is evaluated.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SampleRegion {
    /// All particles, in the volume of the specimen.
    All {
        /// Volume of the specimen, m³. Required. Example: `volume = "16 cm^3"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
    /// The periodic cell.
    Cell,
    /// A box with edges along the axes.
    Box {
        /// Corner with the smallest coordinates, m. Required.
        minimum: [Length; 3],
        /// Corner with the largest coordinates, m. Required.
        maximum: [Length; 3],
    },
    /// A sphere; in two dimensions a disc of unit depth.
    Sphere {
        /// Center, m. Required.
        center: [Length; 3],
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// A circular cylinder with flat ends.
    Cylinder {
        /// Center, m. Required.
        center: [Length; 3],
        /// Direction of the axis, a vector of any length. Required. Example: `axis = [0, 0, 1]`.
        axis: [Number; 3],
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Height, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
    },
    /// An ellipsoid with its axes along x, y, z.
    Ellipsoid {
        /// Center, m. Required.
        center: [Length; 3],
        /// Semi-axes, m. Required.
        #[schemars(transform = super::quantity::positive_items)]
        half_axes: [Length; 3],
    },
    /// The intersection of half-spaces.
    HalfSpaces {
        /// Planes that bound the half-spaces. Required.
        planes: Vec<SamplePlane>,
        /// Volume of the region, m³. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
    /// The particles of a set.
    Set {
        /// Name of the set. Required.
        set: String,
        /// Volume that these particles represent, m³. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
    /// The particles of a material.
    Material {
        /// Name of the material. Required.
        material: String,
        /// Volume that these particles represent, m³. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
}

impl SampleRegion {
    /// Whether the region is a list of particles, without a shape.
    pub fn is_list(&self) -> bool {
        matches!(self, Self::Set { .. } | Self::Material { .. })
    }
}

/// A plane that bounds a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SamplePlane {
    /// A point on the plane, m. Required.
    pub point: [Length; 3],
    /// Normal vector of any length that points out of the region. Required. Example: `normal = [0, 0, 1]`.
    pub normal: [Number; 3],
}
