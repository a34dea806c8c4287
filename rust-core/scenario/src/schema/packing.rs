//! The table `[packing]`: initial positions and radii of the particles.

use concordem_packing::random_dense::Protocol;
use concordem_packing::{Correction, Crop};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Length, Number};

/// Initial positions and radii of the particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Packing {
    /// Random dense packing: a periodic cell of spheres is compacted isotropically, then tiled and cropped to the shape.
    RandomDense {
        /// Number of spheres in the periodic cell. Required. Example: `count = 1000`.
        #[schemars(range(min = 1, max = 100_000_000))]
        count: u64,
        /// Radius of all spheres, m. Required unless `radii` is given. Example: `radius = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
        /// Distribution of radii. Required unless `radius` is given.
        /// Example: `radii = { kind = "uniform", minimum = "0.8 mm", maximum = "1.2 mm" }`.
        radii: Option<Radii>,
        /// Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// Friction coefficient during compaction; default: 0, which gives the densest packing. A coefficient of 0.5
        /// gives a loose one.
        #[serde(default)]
        #[schemars(extend("minimum" = 0))]
        friction: Number,
        /// Stopping rule of the compaction; default: "jammed", a packing at rest under a residual pressure. "yade" stops as
        /// YADE's compactor does, a little looser and not at rest, like the packings of Stránský 2018.
        #[serde(default)]
        protocol: Protocol,
        /// Shape that is cut out of the packing. Required.
        /// Example: `shape = { kind = "box", size = ["15 mm", "15 mm", "30 mm"] }`.
        shape: Shape,
    },
    /// Random discs in the plane z = 0: a periodic square of overlapping discs is tiled and cropped to the shape. In three
    /// dimensions they are spheres with centers in that plane.
    RandomDiscs {
        /// Number of discs in the periodic square. Required. Example: `count = 500`.
        #[schemars(range(min = 1, max = 100_000_000))]
        count: u64,
        /// Radius of all discs, m. Required unless `radii` is given. Equal discs crystallize. Example: `radius = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
        /// Distribution of radii. Required unless `radius` is given.
        /// Example: `radii = { kind = "uniform", minimum = "0.8 mm", maximum = "1.2 mm" }`.
        radii: Option<Radii>,
        /// Area of all discs divided by the area of the square; default: 0.932. Discs begin to touch at 0.84 and have a
        /// mean of 5.1 contacts at 0.93.
        #[serde(default = "overlapping")]
        #[schemars(extend("minimum" = 0.1, "maximum" = 1.1))]
        solid_fraction: Number,
        /// Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// Shape that is cut out of the packing; its size along z is ignored. Required.
        shape: Shape,
    },
    /// Dense packing between walls: spheres are inserted into a vessel at random, then by force, and relax after each packet; then
    /// the walls soften (Jebahi et al. 2015, section 2.3.1). No key gives the number of spheres. The layer at the walls is as dense as
    /// spheres at a wall can be, unlike the surface of a packing that is cut.
    Cooker {
        /// Radius of all spheres, m. Required unless `radii` is given. Example: `radius = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Option<Length>,
        /// Distribution of radii. Required unless `radius` is given.
        /// Example: `radii = { kind = "uniform", minimum = "0.875 mm", maximum = "1.125 mm" }`.
        radii: Option<Radii>,
        /// Insertion ends at this mean number of contacts of a sphere inside, more than two mean radii away from the walls; default: 6.2,
        /// unless another end is given.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 20))]
        coordination: Option<Number>,
        /// Insertion ends at this volume of all spheres over the volume of the shape; default: see `coordination`.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.9))]
        solid_fraction: Option<Number>,
        /// Insertion ends at this mean overlap of touching spheres over the mean radius; default: see `coordination`.
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 0.2))]
        overlap: Option<Number>,
        /// Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// Friction coefficient between spheres while they relax; default: 0. The walls have none.
        #[serde(default)]
        #[schemars(extend("minimum" = 0))]
        friction: Number,
        /// Number of spheres in a forced insertion; default: 2 % of the expected number. 1 inserts one at a time.
        #[schemars(range(min = 1, max = 100_000_000))]
        packet: Option<u64>,
        /// Number of failed tries to place a sphere after which it is inserted by force; default: 500.
        #[serde(default = "attempts")]
        #[schemars(range(min = 1, max = 1_000_000))]
        attempts: u64,
        /// Number of steps in which the stiffness of the walls falls to a thousandth, so that the packing expands until its overlaps
        /// vanish; default: 6. 0 keeps the overlaps.
        #[serde(default = "wall_softening")]
        #[schemars(range(min = 0, max = 100))]
        wall_softening: u64,
        /// Links that become bonds, because softening opens contacts; default: "none": contacts. "frozen-links": pairs that touch before
        /// softening, held together by springs during it. "enlarged-radii": the nearest pairs after softening, as many per sphere inside
        /// as before. The last two determine the bonds, so `[bonds]` has no `interaction_ratio` and no `coordination`.
        #[serde(default)]
        correction: Correction,
        /// Vessel: a box, a cylinder, or a mesh, without `keep`. Required.
        /// Example: `shape = { kind = "cylinder", radius = "10 mm", height = "40 mm" }`.
        shape: Shape,
    },
    /// Spheres that grow in a cube with rigid walls, with friction, until they press on the walls. Radii follow from number and cube.
    Growth {
        /// Number of spheres. Required. Example: `count = 1000`.
        #[schemars(range(min = 1, max = 100_000_000))]
        count: u64,
        /// Difference of the largest and the smallest radius over the mean radius; default: 0. Radii are uniform between them.
        #[serde(default)]
        #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 2))]
        dispersion: Number,
        /// Seed of the random numbers; default: 0. The same seed gives the same packing, bit by bit.
        #[serde(default)]
        seed: u64,
        /// Friction coefficient between spheres; default: 0.5.
        #[serde(default = "half")]
        #[schemars(extend("minimum" = 0))]
        friction: Number,
        /// Friction coefficient at the walls; default: 0.
        #[serde(default)]
        #[schemars(extend("minimum" = 0))]
        wall_friction: Number,
        /// Mean pressure on the walls at the end over Young's modulus of the spheres; default: 1e-4. Touching spheres then overlap by
        /// some thousandths of their radius.
        #[serde(default = "growth_pressure")]
        #[schemars(extend("minimum" = 1e-7, "maximum" = 1e-2))]
        pressure: Number,
        /// Vessel: a box with three equal edges, without `keep`. Required.
        /// Example: `shape = { kind = "box", size = ["20 mm", "20 mm", "20 mm"] }`.
        shape: Shape,
    },
    /// Equal spheres on a lattice; nearest neighbors touch.
    Lattice {
        /// Type of lattice. Required. Example: `lattice = "fcc"`.
        lattice: Lattice,
        /// Radius of all spheres, m. Required. Example: `radius = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Number of unit cells along x, y, z. Required unless `shape` gives a size. Example: `repeats = [10, 10, 20]`.
        #[schemars(inner(range(min = 1, max = 1_000_000)))]
        repeats: Option<[u64; 3]>,
        /// Shape that is filled with the lattice; default: a block of `repeats` unit cells.
        shape: Option<Shape>,
    },
    /// Spheres from a file: text with the columns x y z r, a comma-separated table, a data or dump file of LAMMPS, text of YADE, or an
    /// HDF5 sphere pack.
    File {
        /// Path of the file, relative to the scenario. Required. Example: `path = "packing.txt"`.
        path: String,
        /// Length of one unit of a text file, m; default: 1 m, or the unit in the header of a comma-separated table. Not for HDF5.
        /// Example: `unit = "1 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Option<Length>,
        /// Edge lengths of the periodic cell, m; default: not periodic. In two dimensions the third is 1 m, the depth of the
        /// discs. Example: `cell = ["10 mm", "10 mm", "10 mm"]`.
        #[schemars(transform = super::quantity::positive_items)]
        cell: Option<[Length; 3]>,
        /// Shape that is cut out of the packing; default: all spheres.
        shape: Option<Shape>,
    },
    /// Spheres listed in the scenario.
    Spheres {
        /// One `[x, y, z, radius]` per sphere, m. Required. Example: `spheres = [[0, 0, 0, "1 mm"]]`.
        spheres: Vec<[Length; 4]>,
        /// Edge lengths of the periodic cell, m; default: not periodic. In two dimensions the third is 1 m, the depth of the
        /// discs. Example: `cell = ["10 mm", "10 mm", "10 mm"]`.
        #[schemars(transform = super::quantity::positive_items)]
        cell: Option<[Length; 3]>,
    },
}

impl Shape {
    /// Coordinates of the center (m), if given.
    pub fn center(&self) -> Option<[Length; 3]> {
        match self {
            Self::Box { center, .. } | Self::Cylinder { center, .. } | Self::Hyperboloid { center, .. } => *center,
            Self::Mesh { .. } | Self::Periodic { .. } => None,
        }
    }

    /// Which spheres stay, if given.
    pub fn keep(&self) -> Option<Crop> {
        match self {
            Self::Box { keep, .. }
            | Self::Cylinder { keep, .. }
            | Self::Hyperboloid { keep, .. }
            | Self::Mesh { keep, .. } => *keep,
            Self::Periodic { .. } => None,
        }
    }
}

impl Packing {
    /// The shape that is cut out of the packing, if any.
    pub fn shape(&self) -> Option<&Shape> {
        match self {
            Self::RandomDense { shape, .. }
            | Self::RandomDiscs { shape, .. }
            | Self::Cooker { shape, .. }
            | Self::Growth { shape, .. } => Some(shape),
            Self::Lattice { shape, .. } | Self::File { shape, .. } => shape.as_ref(),
            Self::Spheres { .. } => None,
        }
    }

    /// Whether the packing has a periodic cell.
    pub fn is_periodic(&self) -> bool {
        match (self, self.shape()) {
            (_, Some(shape)) => matches!(shape, Shape::Periodic { .. }),
            (Self::File { cell, .. } | Self::Spheres { cell, .. }, None) => cell.is_some(),
            _ => false,
        }
    }

    /// How the packing determines the bonds, if it does.
    pub fn correction(&self) -> Option<Correction> {
        match self {
            Self::Cooker { correction, .. } if *correction != Correction::None => Some(*correction),
            _ => None,
        }
    }
}

/// Type of lattice; nearest neighbors touch.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Lattice {
    /// Simple cubic.
    Sc,
    /// Body-centered cubic.
    Bcc,
    /// Face-centered cubic.
    Fcc,
    /// Hexagonal close packed.
    Hcp,
    /// Square, in the plane z = 0.
    Square,
    /// Triangular, in the plane z = 0.
    Triangular,
}

impl Lattice {
    /// Whether all lattice points lie in the plane z = 0.
    pub fn is_planar(self) -> bool {
        matches!(self, Self::Square | Self::Triangular)
    }
}

/// Distribution of radii, by number of spheres.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Radii {
    /// Uniform distribution between two radii.
    Uniform {
        /// Smallest radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        minimum: Length,
        /// Largest radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum: Length,
    },
    /// Log-normal distribution, truncated at both ends.
    LogNormal {
        /// Median radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        median: Length,
        /// Standard deviation of the natural logarithm of the radius. Required. Example: `deviation = 0.2`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        deviation: Number,
        /// Smallest radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        minimum: Length,
        /// Largest radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        maximum: Length,
    },
    /// A list of radii and the fraction of spheres that have each radius.
    Table {
        /// Radii, m. Required. Example: `radii = ["1 mm", "2 mm"]`.
        #[schemars(transform = super::quantity::positive_items, length(min = 1))]
        radii: Vec<Length>,
        /// Fractions by number of spheres, one per radius; they are normalized to a sum of 1. Required.
        /// Example: `shares = [0.7, 0.3]`.
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

/// Shape that is cut out of a packing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum Shape {
    /// A box with edges along the axes.
    Box {
        /// Edge lengths, m. Required. Example: `size = ["15 mm", "15 mm", "30 mm"]`.
        #[schemars(transform = super::quantity::positive_items)]
        size: [Length; 3],
        /// Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`.
        center: Option<[Length; 3]>,
        /// Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that
        /// lie entirely inside, both up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other
        /// packings.
        keep: Option<Crop>,
    },
    /// A circular cylinder.
    Cylinder {
        /// Radius, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Height, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
        /// Direction of the axis; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`.
        center: Option<[Length; 3]>,
        /// Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that
        /// lie entirely inside, both up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other
        /// packings.
        keep: Option<Crop>,
    },
    /// A hyperboloid of one sheet: a cylinder with a waist.
    Hyperboloid {
        /// Radius at both ends, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        radius: Length,
        /// Radius in the middle, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        waist_radius: Length,
        /// Height, m. Required.
        #[schemars(extend("exclusiveMinimum" = 0))]
        height: Length,
        /// Direction of the axis; default: "z".
        #[serde(default)]
        axis: Axis,
        /// Coordinates of the center, m; default: the origin. Example: `center = ["0 mm", "0 mm", "25 mm"]`.
        center: Option<[Length; 3]>,
        /// Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that
        /// lie entirely inside, both up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other
        /// packings.
        keep: Option<Crop>,
    },
    /// The interior of a closed triangulated surface.
    Mesh {
        /// Path of the STL file, relative to the scenario. Required. Example: `path = "specimen.stl"`.
        path: String,
        /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
        #[serde(default = "one_meter")]
        #[schemars(extend("exclusiveMinimum" = 0))]
        unit: Length,
        /// Which spheres stay: "centers" keeps those whose centers lie inside or on the surface, "whole-spheres" those that
        /// lie entirely inside, both up to 1e-9 of the radius; default: "whole-spheres" for a lattice, "centers" for other
        /// packings.
        keep: Option<Crop>,
    },
    /// The periodic cell itself, optionally repeated.
    Periodic {
        /// Number of copies of the cell along x, y, z; default: `[1, 1, 1]`.
        #[serde(default = "one_tile")]
        #[schemars(inner(range(min = 1, max = 10_000)))]
        tiles: [u64; 3],
    },
}

/// A coordinate axis.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Axis {
    /// The x axis.
    X,
    /// The y axis.
    Y,
    /// The z axis.
    #[default]
    Z,
}

impl Axis {
    /// Index of the axis: 0, 1, or 2.
    pub fn index(self) -> usize {
        self as usize
    }
}

pub(super) fn one_meter() -> Length {
    Length::new(1.0)
}

/// Area fraction of the specimens of Madan 2019, section 4.5.
fn overlapping() -> Number {
    Number::new(0.932)
}

/// A sphere that fits into 2 ‰ of the volume is found in two of three cases.
fn attempts() -> u64 {
    500
}

fn wall_softening() -> u64 {
    6
}

fn half() -> Number {
    Number::new(0.5)
}

fn growth_pressure() -> Number {
    Number::new(1e-4)
}

fn one_tile() -> [u64; 3] {
    [1; 3]
}
