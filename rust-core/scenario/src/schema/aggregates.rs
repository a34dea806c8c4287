//! The table `[aggregates]`: aggregates and pores of concrete on the mesoscale.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Density, Length, Number};
use concordem_packing::PackingError;
use concordem_packing::aggregates::{Grading, mix};

/// Aggregates and pores. They divide the particles of the packing by their initial positions: those inside an aggregate have its
/// material and its number, those inside a pore are removed, all others belong to the mortar and have the first material.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Aggregates {
    /// Seed of the random shapes and places; default: 0. The same seed gives the same aggregates, bit by bit.
    #[serde(default)]
    pub seed: u64,
    /// Smallest distance of two aggregates (or pores), divided by the mean of their sizes; default: 0.05. At least `gap`.
    #[serde(default = "clearance")]
    #[schemars(extend("minimum" = 0, "maximum" = 10))]
    pub clearance: Number,
    /// Smallest distance of two aggregates (or pores), m; default: 0.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub gap: Length,
    /// Smallest distance from the mould, m; default: 0.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub wall_gap: Length,
    /// Number of places tried for each aggregate, the largest first, before the placing fails; default: 10000.
    #[serde(default = "attempts")]
    #[schemars(range(min = 1))]
    pub attempts: u32,
    /// What the surface of the specimen is; default: "mould". A periodic packing has none, and its aggregates are periodic.
    pub surface: Option<Surface>,
    /// Mix design, from which groups take their volume fraction; default: groups give it.
    pub mix: Option<Mix>,
    /// Groups of aggregates or pores; at least one is required.
    #[serde(rename = "group")]
    #[schemars(length(min = 1))]
    pub groups: Vec<AggregateGroup>,
}

/// Surface of a specimen with aggregates.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Surface {
    /// A mould: all aggregates lie inside, so that there are fewer of them near the surface (wall effect).
    #[default]
    Mould,
    /// Sawn faces: aggregates are placed periodically in the box around the specimen, and the surface cuts them.
    Sawn,
}

/// Mix design.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mix {
    /// Components of the concrete. Required.
    /// Example: `components = [{ name = "water", content = "180 kg/m^3", density = "1000 kg/m^3" }]`.
    #[schemars(length(min = 1))]
    pub components: Vec<MixComponent>,
    /// Unit weight of the fresh concrete, from which the volume of air follows, kg/m³; or give `air`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unit_weight: Option<Density>,
    /// Volume fraction of air; or give `unit_weight`. Default: 0.
    #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 1))]
    pub air: Option<Number>,
}

/// Component of a mix.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct MixComponent {
    /// Name, to which groups refer. Required.
    pub name: String,
    /// Mass per volume of concrete, kg/m³. Required. Example: `content = "750 kg/m^3"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub content: Density,
    /// Density of the component, kg/m³. Required. Example: `density = "2590 kg/m^3"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub density: Density,
}

/// Aggregates of one kind, or pores.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AggregateGroup {
    /// Name of the material of the particles inside. Required unless `remove_particles` is given. Bonds within an aggregate have
    /// the parameters of this material, so aggregates can break.
    pub material: Option<String>,
    /// Whether the group are pores: the packing loses the particles inside, and the others are numbered without gaps; default:
    /// false.
    #[serde(default)]
    pub remove_particles: bool,
    /// Sizes. Required unless `spheres` is given.
    pub grading: Option<GradingTable>,
    /// Smallest size that is placed, m; finer aggregates belong to the mortar. Required for a "fuller" grading. Default: the first
    /// size of the grading. Example: `smallest = "4 mm"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub smallest: Option<Length>,
    /// Volume of the grading divided by that of the specimen (in two dimensions, areas), with the part finer than `smallest`, which
    /// is not placed. Or give `component` or `first_step`. Example: `volume_fraction = 0.4`.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub volume_fraction: Option<Number>,
    /// Name of the component of the mix whose volume the grading has. Example: `component = "coarse aggregate"`.
    pub component: Option<String>,
    /// Sizes by the rule of Stránský 2018 instead of an amount, m: the second size is larger than the smallest by this step, each
    /// further step has the same volume over mass, and the number of spheres follows. Example: `first_step = "5.475 um"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub first_step: Option<Length>,
    /// Shape; default: spheres (discs in two dimensions). Example: `shape = { kind = "ellipsoid", elongation = 1.4, flatness = 0.7 }`.
    pub shape: Option<AggregateShape>,
    /// Spheres in given places instead of a grading, one `[x, y, z, radius]` each, m. Where two overlap, the first one counts.
    /// Example: `spheres = [[0, 0, 0, "8 mm"]]`.
    pub spheres: Option<Vec<[Length; 4]>>,
    /// A particle is inside if its center is at least this many of its radii below the surface; default: 0, which conserves the
    /// volume fraction. 0.5 in Stránský 2018.
    #[serde(default)]
    #[schemars(extend("minimum" = 0, "maximum" = 10))]
    pub depth: Number,
}

/// Sizes of aggregates. The size is the opening of a sieve: the middle one of the three widths of an aggregate.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum GradingTable {
    /// A sieve curve. Between two sieves the passing mass is linear in the logarithm of the size.
    Sieves {
        /// Openings of the sieves, m, ascending. Required. Example: `sizes = ["4 mm", "8 mm", "16 mm"]`.
        #[schemars(transform = super::quantity::positive_items, length(min = 2))]
        sizes: Vec<Length>,
        /// Fraction of the mass that passes each sieve, ascending to 1. Required. Example: `passing = [0, 0.4, 1]`.
        #[schemars(transform = super::quantity::non_negative_items, length(min = 2))]
        passing: Vec<Number>,
    },
    /// The curve of Fuller and Thompson (1907): the fraction (size/largest)^exponent of the mass passes.
    Fuller {
        /// Largest size, m. Required. Example: `largest = "16 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        largest: Length,
        /// Exponent; default: 0.5.
        #[serde(default = "half")]
        #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 10))]
        exponent: Number,
    },
    /// Aggregates of 4.75 mm and more of the concretes in Stránský 2018, table 8.1.
    Stransky {
        /// Largest size, m: 9.5, 12.5, or 19 mm. Required. Example: `largest = "12.5 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        largest: Length,
    },
    /// One size.
    Single {
        /// Size, m. Required. Example: `size = "8 mm"`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        size: Length,
    },
}

/// Shape of aggregates or pores, in random orientation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum AggregateShape {
    /// Spheres; discs in two dimensions.
    Sphere {},
    /// Ellipsoids; ellipses in two dimensions.
    Ellipsoid {
        /// Longest width divided by the middle one; default: 1.
        #[serde(default = "one")]
        #[schemars(extend("minimum" = 1, "maximum" = 10))]
        elongation: Number,
        /// Shortest width divided by the middle one; default: 1. Only in three dimensions.
        #[serde(default = "one")]
        #[schemars(extend("minimum" = 0.1, "maximum" = 1))]
        flatness: Number,
    },
    /// Convex polyhedra, each one the hull of random points of an ellipsoid.
    Polyhedron {
        /// Number of points; default: 12.
        #[serde(default = "twelve")]
        #[schemars(range(min = 6, max = 60))]
        corners: u32,
        /// Longest width of the ellipsoid divided by the middle one; default: 1.
        #[serde(default = "one")]
        #[schemars(extend("minimum" = 1, "maximum" = 10))]
        elongation: Number,
        /// Shortest width of the ellipsoid divided by the middle one; default: 1.
        #[serde(default = "one")]
        #[schemars(extend("minimum" = 0.1, "maximum" = 1))]
        flatness: Number,
    },
    /// A closed triangulated surface, scaled to each size: the middle one of its three widths along the axes of the file. Two of
    /// them keep their distance by their convex hulls.
    Mesh {
        /// Path of the STL file, relative to the scenario. Required. Example: `path = "stone.stl"`.
        path: String,
    },
}

impl AggregateGroup {
    /// The sieve curve of the sizes that are placed, and the fraction of the grading that they are; `None` without a grading.
    ///
    /// # Errors
    /// A curve that is not one.
    pub fn curve(&self) -> Option<Result<(Grading, f64), PackingError>> {
        self.grading.as_ref().map(|table| {
            let whole = match table {
                GradingTable::Sieves { sizes, passing } => {
                    Grading::sieves(sizes.iter().zip(passing).map(|(size, share)| (size.si(), share.si())).collect())?
                }
                GradingTable::Fuller { largest, exponent } => {
                    let smallest = self.smallest.map_or(0.0, Length::si);
                    let curve = Grading::fuller(smallest, largest.si(), exponent.si())?;
                    let share = 1.0 - curve.passing(smallest);
                    return Ok((curve, share));
                }
                GradingTable::Stransky { largest } => {
                    Grading::stransky(largest.si()).ok_or_else(|| PackingError::BadSizes {
                        reason: format!("Stránský 2018 has no grading up to {} m", largest.si()),
                    })?
                }
                GradingTable::Single { size } => Grading::single(size.si())?,
            };
            if let Some(smallest) = self.smallest {
                return whole.from(smallest.si());
            }
            let share = 1.0 - whole.passing(whole.bounds().0);
            Ok((whole, share))
        })
    }

    /// What messages call the group: its material, or "pores".
    pub fn title(&self) -> &str {
        self.material.as_deref().unwrap_or("pores")
    }
}

impl Mix {
    /// Volume fraction of a component; `None` if the mix has none of this name.
    ///
    /// # Errors
    /// A unit weight above the sum of the contents.
    pub fn fraction(&self, name: &str) -> Option<Result<f64, PackingError>> {
        let component = |one: &MixComponent| mix::Component { content: one.content.si(), density: one.density.si() };
        let all: Vec<mix::Component> = self.components.iter().map(component).collect();
        let of = self.components.iter().find(|one| one.name == name).map(component)?;
        let air = match (self.unit_weight, self.air) {
            (Some(weight), _) => mix::air(&all, weight.si()),
            (None, air) => Ok(air.map_or(0.0, Number::si)),
        };
        Some(air.and_then(|air| mix::volume_fraction(&all, of, air)))
    }
}

impl Aggregates {
    /// Volume fraction of the grading of a group; `None` if the group gives no amount.
    ///
    /// # Errors
    /// A mix that gives none.
    pub fn fraction(&self, group: &AggregateGroup) -> Option<Result<f64, PackingError>> {
        match (group.volume_fraction, &group.component) {
            (Some(fraction), _) => Some(Ok(fraction.si())),
            (None, Some(name)) => self.mix.as_ref()?.fraction(name),
            (None, None) => None,
        }
    }
}

fn clearance() -> Number {
    Number::new(0.05)
}

fn attempts() -> u32 {
    10_000
}

fn one() -> Number {
    Number::new(1.0)
}

fn half() -> Number {
    Number::new(0.5)
}

fn twelve() -> u32 {
    12
}
