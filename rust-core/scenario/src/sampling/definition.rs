//! Definition of an operator: quantities, accepted regions and keys, required data, and the function that evaluates it.

use super::scheduled::ScheduledOperator;
use super::state::SampledState;
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::{ContactSet, OperatorError, Period, Region};

/// A quantity that an operator returns: name, unit, and number of components.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SampledQuantity {
    /// Name of the column.
    pub name: &'static str,
    /// SI unit; `"1"` for a pure number.
    pub unit: &'static str,
    /// Number of components: 1 (scalar), 3 (vector), or 9 (tensor, row by row).
    pub components: usize,
    /// Description of the column.
    pub description: &'static str,
}

pub(super) const fn tensor(name: &'static str, unit: &'static str, description: &'static str) -> SampledQuantity {
    SampledQuantity { name, unit, components: 9, description }
}
pub(super) const fn vector(name: &'static str, unit: &'static str, description: &'static str) -> SampledQuantity {
    SampledQuantity { name, unit, components: 3, description }
}
pub(super) const fn scalar(name: &'static str, unit: &'static str, description: &'static str) -> SampledQuantity {
    SampledQuantity { name, unit, components: 1, description }
}

pub(super) const VOLUME: SampledQuantity = scalar("volume", "m^3", "Volume of the region");
pub(super) const CONTACTS: SampledQuantity = scalar("contacts", "1", "Number of contacts included");
pub(super) const PARTICLES: SampledQuantity = scalar("particles", "1", "Number of particles included");
pub(super) const CELLS: SampledQuantity = scalar("cells", "1", "Number of cells included");

/// Regions that an operator accepts.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RegionRule {
    /// Any region.
    Any,
    /// Only the whole body.
    WholeBody,
    /// The whole body or the periodic cell.
    WholeBodyOrCell,
    /// Only the periodic cell.
    PeriodicCell,
    /// Only a sphere (a disc in two dimensions).
    Sphere,
    /// Any region with a shape, but not a list of particles.
    Shape,
    /// No region: the operator reads a wall, and an area.
    Wall,
    /// No region: the operator reads a wall.
    WallAlone,
    /// No region: the operator reads a set of particles.
    Set,
    /// No region: the operator reads two sets of particles.
    TwoSets,
}

impl RegionRule {
    /// Whether the operator is evaluated in a region.
    pub fn has_region(self) -> bool {
        !matches!(self, Self::Wall | Self::WallAlone | Self::Set | Self::TwoSets)
    }

    /// What the operator needs and why, to complete a sentence that begins with its name.
    pub fn requirement(self) -> &'static str {
        match self {
            Self::Any => "accepts any region",
            Self::WholeBody => "needs the whole body: forces on the boundary do not determine the stress of a part",
            Self::WholeBodyOrCell => "needs the whole body or the periodic cell: a part exchanges power with the rest",
            Self::PeriodicCell => "needs the periodic cell: the motion of any other boundary is unknown",
            Self::Sphere => "needs a sphere: the support of its kernel",
            Self::Shape => "needs a region with a shape: a list of particles has none",
            Self::Wall => "needs a wall and its area",
            Self::WallAlone => "needs a wall",
            Self::Set => "needs a set of particles",
            Self::TwoSets => "needs two sets of particles",
        }
    }

    /// A value of `region` that the operator accepts.
    pub fn example(self) -> &'static str {
        match self {
            Self::WholeBody | Self::WholeBodyOrCell => {
                "write region = { kind = \"all\", volume = \"1 cm^3\" } with the volume of the body"
            }
            Self::PeriodicCell => "write region = { kind = \"cell\" }, or use cell-strain for another region",
            Self::Sphere => "write region = { kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }",
            Self::Any | Self::Shape => "use a box, a sphere, or another region with a shape",
            Self::Wall => "write wall = \"box z maximum\", area = \"36 mm^2\"",
            Self::WallAlone => "write wall = \"NAME\" with the name of a [[wall]]",
            Self::Set => "write set = \"NAME\" with the name of a [[set]]",
            Self::TwoSets => "write sets = [\"LOWER\", \"UPPER\"] with the names of two [[set]] tables",
        }
    }
}

/// A key of `[[sample]]` that not every operator uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SampleKey {
    /// `region`.
    Region,
    /// `grid`.
    Grid,
    /// `velocity`.
    Velocity,
    /// `velocity_gradient`.
    VelocityGradient,
    /// `truncation`.
    Truncation,
    /// `partition`.
    Partition,
    /// `wall`.
    Wall,
    /// `area`.
    Area,
    /// `set`.
    Set,
    /// `sets`.
    Sets,
    /// `about`.
    About,
}

impl SampleKey {
    /// All keys, in the order in which the checks look at them.
    pub const ALL: [Self; 11] = [
        Self::Region,
        Self::Grid,
        Self::Velocity,
        Self::VelocityGradient,
        Self::Truncation,
        Self::Wall,
        Self::Area,
        Self::Partition,
        Self::Set,
        Self::Sets,
        Self::About,
    ];

    /// The key as written in a scenario.
    pub fn name(self) -> &'static str {
        match self {
            Self::Region => "region",
            Self::Grid => "grid",
            Self::Velocity => "velocity",
            Self::VelocityGradient => "velocity_gradient",
            Self::Truncation => "truncation",
            Self::Partition => "partition",
            Self::Wall => "wall",
            Self::Area => "area",
            Self::Set => "set",
            Self::Sets => "sets",
            Self::About => "about",
        }
    }
}

/// Data that not every operator needs.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Need {
    /// Positions at the start.
    InitialPositions,
    /// Damage of all bonds.
    Bonds,
    /// Temperatures of the particles.
    Temperatures,
    /// Temperatures, and the heat that flows along links and through the surface.
    HeatFlows,
}

/// The scenario of an operator, as far as operators ask.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Surroundings {
    /// Whether the packing is in a periodic cell.
    pub is_periodic: bool,
}

/// Why an operator is not possible in a scenario.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong.
    pub message: &'static str,
    /// The remedy.
    pub help: &'static str,
}

/// Definition of an operator: everything that scenarios, results, and Python know of it.
pub struct OperatorDefinition {
    /// Name in scenarios and results: that of its file, with hyphens.
    pub name: &'static str,
    /// What it gives, in one sentence.
    pub meaning: &'static str,
    /// Quantities, in the order of the values.
    pub quantities: &'static [SampledQuantity],
    /// Accepted regions.
    pub region: RegionRule,
    /// Keys that it uses besides those of the region (`region`, `grid`, `velocity`, `velocity_gradient`).
    pub keys: &'static [SampleKey],
    /// Data that it needs.
    pub needs: &'static [Need],
    /// Finds out whether a scenario does not allow it.
    pub check: fn(&Surroundings) -> Option<Refusal>,
    /// Appends the values to the row, in the order of `quantities`.
    pub(super) evaluate: fn(&Sampling<'_>, &mut Row) -> Result<(), OperatorError>,
}

impl OperatorDefinition {
    /// What a definition need not write: an operator for any region without other keys and needs.
    pub(super) const PLAIN: Self = Self {
        name: "",
        meaning: "",
        quantities: &[],
        region: RegionRule::Any,
        keys: &[],
        needs: &[],
        check: |_| None,
        evaluate: |_, _| Ok(()),
    };

    /// Whether the operator uses a key of `[[sample]]`.
    pub fn uses(&self, key: SampleKey) -> bool {
        match key {
            SampleKey::Region | SampleKey::Grid | SampleKey::Velocity | SampleKey::VelocityGradient => {
                self.region.has_region()
            }
            key => self.keys.contains(&key),
        }
    }

    /// Whether the operator needs these data.
    pub fn needs(&self, data: Need) -> bool {
        self.needs.contains(&data)
    }

    /// Whether the operator needs heat conduction.
    pub fn needs_heat(&self) -> bool {
        self.needs(Need::Temperatures) || self.needs(Need::HeatFlows)
    }
}

/// The input of one evaluation: an operator, its region at this time, and the state.
pub(super) struct Sampling<'a> {
    /// The operator with its options.
    pub(super) sample: &'a ScheduledOperator,
    /// The region now, or one cell of its grid.
    pub(super) region: &'a Region,
    /// The state.
    pub(super) state: &'a SampledState<'a>,
    /// Contacts between particles, with forces.
    pub(super) contacts: ContactSet<'a>,
    /// The same, together with the forces inside rigid bodies: everything that transmits stress between particles.
    pub(super) carrying: ContactSet<'a>,
    /// Periodic images with their rate of change.
    pub(super) period: Option<Period>,
}

impl Sampling<'_> {
    /// Periodic images for the functions of the operator crate.
    pub(super) fn period(&self) -> Option<&Period> {
        self.period.as_ref()
    }
}

/// The values of a row, in the order of the operator's quantities.
#[derive(Default)]
pub(super) struct Row(pub(super) Vec<f64>);

impl Row {
    /// Appends a tensor, row by row.
    pub(super) fn tensor(&mut self, tensor: &Mat3) -> &mut Self {
        self.0.extend(tensor.transpose().iter());
        self
    }

    /// Appends a vector.
    pub(super) fn vector(&mut self, vector: &Vec3) -> &mut Self {
        self.0.extend(vector.iter());
        self
    }

    /// Appends scalars.
    pub(super) fn scalars<const N: usize>(&mut self, scalars: [f64; N]) -> &mut Self {
        self.0.extend(scalars);
        self
    }
}
