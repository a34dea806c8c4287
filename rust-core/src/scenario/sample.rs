//! Operators that are evaluated during a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Length, Number, Velocity, Volume};
use crate::operator::Truncation;
use crate::plan::Operator;

/// An operator that is evaluated during the run; its rows go to `/samples/NAME` of the result.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OperatorSample {
    /// What is evaluated.
    pub operator: Operator,
    /// Name in the result; by default that of the operator.
    pub name: Option<String>,
    /// Where; by default the periodic cell.
    pub region: Option<SampleRegion>,
    /// How contacts count that cross the region's border.
    pub truncation: Option<Truncation>,
    /// Velocity of the region, m/s.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Steps between two evaluations; by default that of the other samples.
    #[schemars(range(min = 1))]
    pub interval: Option<u64>,
}

impl OperatorSample {
    /// Name in the result.
    pub fn name(&self) -> &str {
        self.name.as_deref().unwrap_or_else(|| self.operator.name())
    }
}

/// Where an operator samples.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum SampleRegion {
    /// Everything, in the volume of the specimen.
    All {
        /// Volume of the specimen, m³.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
    /// The periodic cell.
    Cell,
    /// A box.
    Box {
        /// Corner of smallest coordinates, m.
        minimum: [Length; 3],
        /// Corner of largest coordinates, m.
        maximum: [Length; 3],
    },
    /// A sphere (in two dimensions a disc of unit depth).
    Sphere {
        /// Centre, m.
        center: [Length; 3],
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
    },
    /// A circular cylinder with flat ends.
    Cylinder {
        /// Centre, m.
        center: [Length; 3],
        /// Direction of its axis, of any length.
        axis: [Number; 3],
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
    },
    /// An ellipsoid with its axes along x, y, z.
    Ellipsoid {
        /// Centre, m.
        center: [Length; 3],
        /// Half axes, m.
        #[schemars(transform = super::quantity::positive_items)]
        half_axes: [Length; 3],
    },
    /// The particles of a set.
    Set {
        /// Name of the set.
        set: String,
        /// Volume they stand for, m³.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
    /// The particles of a material.
    Material {
        /// Name of the material.
        material: String,
        /// Volume they stand for, m³.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
    },
}

impl SampleRegion {
    /// Whether it is a list of particles.
    pub fn is_list(&self) -> bool {
        matches!(self, Self::Set { .. } | Self::Material { .. })
    }
}
