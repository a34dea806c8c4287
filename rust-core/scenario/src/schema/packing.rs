//! Where the particles come from.

use concordem_packing::random_dense::Protocol;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Length, Number};

/// How the particles are placed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Packing {
    /// Random dense packing: a periodic cell of spheres compacted isotropically, tiled and cropped to the shape.
    RandomDense {
        /// Number of spheres in the periodic cell.
        #[schemars(range(min = 1, max = 100_000_000))]
        count: u64,
        /// Radius of all spheres, m; or give `radii`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
        /// Distribution of radii; or give `radius`.
        radii: Option<Radii>,
        /// Seed of the random numbers: the same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// Friction coefficient (tangent of the angle) during compaction: 0 packs densest, 0.5 loosest.
        #[serde(default)]
        #[schemars(extend("minimum" = 0))]
        friction: Number,
        /// How it is compacted: "jammed" rests under its residual pressure; "yade" stops as YADE's compactor does, a
        /// little looser and not at rest, as the packings of Stránský 2018.
        #[serde(default)]
        protocol: Protocol,
        /// What is cut out of the packing.
        shape: Shape,
    },
    /// Random discs in the plane z = 0, compressed beyond touching: a periodic square, tiled and cropped to the shape. In
    /// three dimensions they are spheres whose centres lie in that plane.
    RandomDiscs {
        /// Number of discs in the periodic square.
        #[schemars(range(min = 1, max = 100_000_000))]
        count: u64,
        /// Radius of all discs, m; or give `radii`. Equal discs form crystals.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
        /// Distribution of radii; or give `radius`.
        radii: Option<Radii>,
        /// Area of all discs through that of the square; they touch from 0.84 on, and at 0.93 have 5.1 contacts each.
        #[serde(default = "overlapping")]
        #[schemars(extend("minimum" = 0.1, "maximum" = 1.1))]
        solid_fraction: Number,
        /// Seed of the random numbers: the same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// What is cut out of the packing; its size along z is of no account.
        shape: Shape,
    },
    /// Spheres of one size on a lattice, touching their nearest neighbours.
    Lattice {
        /// Kind of lattice.
        lattice: Lattice,
        /// Radius of all spheres, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Number of unit cells along x, y, z; needed unless a shape to be filled is given.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        repeats: Option<[u64; 3]>,
        /// What is cut out; the whole block when left out.
        shape: Option<Shape>,
    },
    /// Spheres from a text file with the columns x y z r in metres, or from an HDF5 sphere pack.
    File {
        /// The file, relative to the scenario.
        path: String,
        /// Edges of the periodic cell, m; not periodic when left out.
        #[schemars(transform = super::quantity::positive_items)]
        cell: Option<[Length; 3]>,
        /// What is cut out; everything when left out.
        shape: Option<Shape>,
    },
    /// Spheres listed here.
    Spheres {
        /// One `[x, y, z, radius]` per sphere, m.
        spheres: Vec<[Length; 4]>,
        /// Edges of the periodic cell, m; not periodic when left out.
        #[schemars(transform = super::quantity::positive_items)]
        cell: Option<[Length; 3]>,
    },
}

impl Packing {
    /// The shape that is cut out, if any.
    pub fn shape(&self) -> Option<&Shape> {
        match self {
            Self::RandomDense { shape, .. } | Self::RandomDiscs { shape, .. } => Some(shape),
            Self::Lattice { shape, .. } | Self::File { shape, .. } => shape.as_ref(),
            Self::Spheres { .. } => None,
        }
    }

    /// Whether the particles live in a periodic cell.
    pub fn is_periodic(&self) -> bool {
        match (self, self.shape()) {
            (_, Some(shape)) => matches!(shape, Shape::Periodic { .. }),
            (Self::File { cell, .. } | Self::Spheres { cell, .. }, None) => cell.is_some(),
            (Self::RandomDense { .. } | Self::RandomDiscs { .. } | Self::Lattice { .. }, None) => false,
        }
    }
}

/// Lattices; all nearest neighbours touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lattice {
    /// Simple cubic.
    Sc,
    /// Body-centred cubic.
    Bcc,
    /// Face-centred cubic.
    Fcc,
    /// Hexagonal close packed.
    Hcp,
    /// Square, in the plane z = 0.
    Square,
    /// Triangular, in the plane z = 0.
    Triangular,
}

impl Lattice {
    /// Whether all its points lie in the plane z = 0.
    pub fn is_planar(self) -> bool {
        matches!(self, Self::Square | Self::Triangular)
    }
}

/// Distribution of radii, by number of spheres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Radii {
    /// Uniform between two radii.
    Uniform {
        /// Smallest radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        minimum: Length,
        /// Largest radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum: Length,
    },
    /// Log-normal, cut off at both ends.
    LogNormal {
        /// Median radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        median: Length,
        /// Standard deviation of the natural logarithm of the radius.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deviation: Number,
        /// Smallest radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        minimum: Length,
        /// Largest radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum: Length,
    },
    /// A list of radii and the share of spheres that have each.
    Table {
        /// Radii, m.
        #[schemars(transform = super::quantity::positive_items, length(min = 1))]
        radii: Vec<Length>,
        /// Shares by number; scaled to sum to 1.
        #[schemars(transform = super::quantity::non_negative_items)]
        shares: Vec<Number>,
    },
}

impl Radii {
    /// Smallest and largest radius, m.
    pub fn range(&self) -> (f64, f64) {
        match self {
            Self::Uniform { minimum, maximum } | Self::LogNormal { minimum, maximum, .. } => {
                (minimum.si(), maximum.si())
            }
            Self::Table { radii, .. } => {
                radii.iter().fold((f64::INFINITY, 0.0), |(low, high), r| (r.si().min(low), r.si().max(high)))
            }
        }
    }
}

/// What is cut out of a packing. A particle belongs to the shape when its centre is inside. Centred at the origin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// Box with edges along the axes.
    Box {
        /// Edge lengths, m.
        #[schemars(transform = super::quantity::positive_items)]
        size: [Length; 3],
    },
    /// Circular cylinder.
    Cylinder {
        /// Radius, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
        /// Direction of its axis.
        #[serde(default)]
        axis: Axis,
    },
    /// Hyperboloid of one sheet: a cylinder with a waist.
    Hyperboloid {
        /// Radius at both ends, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Radius in the middle, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        waist_radius: Length,
        /// Height, m.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
        /// Direction of its axis.
        #[serde(default)]
        axis: Axis,
    },
    /// Interior of a closed triangulated surface.
    Mesh {
        /// STL file, relative to the scenario.
        path: String,
        /// Length of one unit of the file: `"1 mm"` for a file in millimetres.
        #[serde(default = "one_metre")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
    },
    /// Nothing: the periodic cell is kept and repeated.
    Periodic {
        /// Copies along x, y, z.
        #[serde(default = "one_tile")]
        #[schemars(inner(range(min = 1, max = 10_000)))]
        tiles: [u64; 3],
    },
}

/// An axis of coordinates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// x.
    X,
    /// y.
    Y,
    /// z.
    #[default]
    Z,
}

impl Axis {
    /// 0, 1, 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

pub(super) fn one_metre() -> Length {
    Length::new(1.0)
}

/// Share of the area in the samples of Madan 2019, section 4.5.
fn overlapping() -> Number {
    Number::new(0.932)
}

fn one_tile() -> [u64; 3] {
    [1; 3]
}
