//! The table `[fibers]`: chains of beams in a matrix.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Surface;
use super::quantity::{Length, Number};

/// Straight fibers: chains of touching spheres, joined by bonds of the law "cohesive_beam". They are added to the packing, between
/// its aggregates, and bonded to its particles with the law of `[bonds]`, by the parameters of the two materials or their
/// `[[interface]]`. Particles of the packing that are too near are removed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Fibers {
    /// Seed of the random places; default: 0. The same seed gives the same fibers, bit by bit.
    #[serde(default)]
    pub seed: u64,
    /// Smallest distance of a fiber from other fibers and from aggregates and pores, m; default: 0.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub gap: Length,
    /// Smallest distance from the mould, m; default: 0.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub wall_gap: Length,
    /// Number of places tried for each fiber before the placing fails; default: 10000.
    #[serde(default = "attempts")]
    #[schemars(range(min = 1))]
    pub attempts: u32,
    /// What the surface of the specimen is; default: "mould", or that of `[aggregates]`. A periodic packing has none.
    pub surface: Option<Surface>,
    /// Particles of the packing are removed if their center is nearer to that of a sphere of a fiber than this times the sum of both
    /// radii; default: 0.5. The others may overlap the fiber: bonds begin without force at any distance. 1 removes all that overlap.
    #[serde(default = "clearing")]
    #[schemars(extend("minimum" = 0.2, "maximum" = 1))]
    pub clearing: Number,
    /// Groups of fibers; at least one is required.
    #[serde(rename = "group")]
    #[schemars(length(min = 1))]
    pub groups: Vec<FiberGroup>,
}

/// Fibers of one kind.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct FiberGroup {
    /// Name of the material of the fibers, which nothing else has. Required. Its table `cohesive_beam` gives their stiffness and
    /// strength; there, `radius_ratio` refers to the radius of the fibers, so 1 is a cylinder with their diameter.
    pub material: String,
    /// Diameter of the spheres, m. Required. Example: `diameter = "0.5 mm"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub diameter: Length,
    /// Length from end to end, m, at least two diameters. Required unless `lines` is given. Example: `length = "12 mm"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub length: Option<Length>,
    /// Volume of the fibers, as cylinders, divided by that of the specimen. Or give `count` or `lines`.
    /// Example: `volume_fraction = 0.01`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub volume_fraction: Option<Number>,
    /// Number of fibers. Example: `count = 40`.
    #[schemars(range(min = 1))]
    pub count: Option<u32>,
    /// Direction of all fibers, of any length above 0; default: random, uniform over all directions. Example: `direction = [1, 0, 0]`.
    pub direction: Option<[Number; 3]>,
    /// Fibers in given places instead of random ones, one `[[x, y, z], [x, y, z]]` with the two ends each, m. They may leave the specimen.
    /// Example: `lines = [[["-10 mm", 0, 0], ["10 mm", 0, 0]]]`.
    pub lines: Option<Vec<[[Length; 3]; 2]>>,
}

fn attempts() -> u32 {
    10_000
}

fn clearing() -> Number {
    Number::new(0.5)
}
