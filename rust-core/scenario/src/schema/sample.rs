//! Operators that are evaluated during a run.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::{Area, Length, Number, StrainRate, Velocity, Volume};
use crate::schedule::Operator;
use concordem_operator::Truncation;
use concordem_operator::stress::Partition;

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
    /// Cells along x, y, z that a box is divided into: a map of the field.
    pub grid: Option<[usize; 3]>,
    /// How contacts count that cross the region's border.
    pub truncation: Option<Truncation>,
    /// How the branch of a contact is divided between its particles, for `particle-stress`.
    pub partition: Option<Partition>,
    /// Name of the wall, for `wall-traction`; a box has walls of its own: "NAME x minimum", …
    pub wall: Option<String>,
    /// Area that the traction refers to, m².
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub area: Option<Area>,
    /// Velocity of the region, m/s.
    #[serde(default)]
    pub velocity: [Velocity; 3],
    /// Velocity gradient with which the region deforms about its centre, 1/s; row i: of the velocity along i.
    #[serde(default)]
    pub velocity_gradient: [[StrainRate; 3]; 3],
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
    /// Where several half-spaces overlap.
    HalfSpaces {
        /// The planes that bound them.
        planes: Vec<SamplePlane>,
        /// Volume of the region, m³.
        #[schemars(extend("exclusiveMinimum" = 0))]
        volume: Volume,
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

/// A plane that bounds a sampled region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SamplePlane {
    /// A point of the plane, m.
    pub point: [Length; 3],
    /// Normal out of the region, of any length.
    pub normal: [Number; 3],
}

/// What of a sample makes no sense together.
pub struct Misuse {
    /// Key within the sample's table.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// The remedy.
    pub help: &'static str,
}

impl OperatorSample {
    /// Whether `key` is given, for the keys that not every operator knows.
    fn gives(&self, key: &str) -> bool {
        match key {
            "wall" => self.wall.is_some(),
            "area" => self.area.is_some(),
            "partition" => self.partition.is_some(),
            "truncation" => self.truncation.is_some(),
            "grid" => self.grid.is_some(),
            "region" => self.region.is_some(),
            "velocity" => self.velocity.iter().any(|v| v.si() != 0.0),
            "velocity_gradient" => self.velocity_gradient.iter().flatten().any(|v| v.si() != 0.0),
            _ => false,
        }
    }

    /// Keys that the operator does not know, regions that it cannot work with.
    pub fn misuse(&self, dimension: u8) -> Option<Misuse> {
        use Operator as O;
        use SampleRegion as R;
        let name = self.operator.name();
        let refuse = |key, message: String, help| Some(Misuse { key, message, help });
        let unknown: &[(&str, &str)] = match self.operator {
            O::RegionStress | O::Fabric => &[],
            O::WallTraction => &[
                ("region", "the wall is its region: leave `region` out"),
                ("grid", "leave `grid` out"),
                ("velocity", "leave `velocity` out: the wall moves as it does"),
                ("velocity_gradient", "leave `velocity_gradient` out"),
            ],
            _ => &[("truncation", "leave it out; region-stress and fabric know it")],
        };
        let elsewhere = [
            ("wall", O::WallTraction, "leave it out; wall-traction knows it"),
            ("area", O::WallTraction, "leave it out; wall-traction knows it"),
            ("partition", O::ParticleStress, "leave it out; particle-stress knows it"),
        ];
        let elsewhere = elsewhere.into_iter().filter(|(_, operator, _)| *operator != self.operator);
        let truncation = (self.operator == O::WallTraction).then_some(("truncation", "leave it out"));
        let mut unknown = unknown.iter().copied().chain(elsewhere.map(|(key, _, help)| (key, help))).chain(truncation);
        if let Some((key, help)) = unknown.find(|(key, _)| self.gives(key)) {
            return refuse(key, format!("the operator {name} has no use for it"), help);
        }
        if self.operator == O::WallTraction {
            let help = "wall = \"box z maximum\", area = \"36 mm^2\"";
            return match (&self.wall, self.area) {
                (Some(_), Some(_)) => None,
                _ => refuse("operator", "wall-traction needs a wall and the area to refer to".into(), help),
            };
        }
        let region = self.region.as_ref();
        let is_list = region.is_some_and(SampleRegion::is_list);
        let is_cell = matches!(region, None | Some(R::Cell));
        let whole = "region = { kind = \"all\", volume = \"1 cm^3\" }, with the volume of the body";
        let fault = match self.operator {
            O::BoundaryStress if !matches!(region, Some(R::All { .. })) => {
                Some(("is of the whole body: what acts on its boundary says nothing of a part of it", whole))
            }
            O::Power if !is_cell && !matches!(region, Some(R::All { .. })) => {
                Some(("is of the whole body: a part of it does not keep its power to itself", whole))
            }
            O::CoarseGrain if !matches!(region, Some(R::Sphere { .. })) => Some((
                "is at a point, the middle of a sphere in which the kernel is not zero",
                "region = { kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }",
            )),
            O::ContactCellStrain | O::ContactCellRate if !is_cell => Some((
                "is of the periodic cell: the motion of another border is not known",
                "region = { kind = \"cell\" }, or cell-strain for a region",
            )),
            O::CellStrain | O::CellRate | O::DamageTensor if is_list => Some((
                "is of a place, and a list of particles has none",
                "give a box, a sphere, or another region with a shape",
            )),
            _ => None,
        };
        if let Some((message, help)) = fault {
            let key = if region.is_some() { "region" } else { "operator" };
            return refuse(key, format!("the operator {name} {message}"), help);
        }
        if is_list && self.truncation == Some(Truncation::BranchClipped) {
            let message = "a list of particles has no border to clip at".into();
            return refuse("truncation", message, "use \"half-crossing\" or \"internal-only\"");
        }
        if self.gives("velocity") && (is_cell || is_list || matches!(region, Some(R::All { .. }))) {
            return refuse("velocity", "this region has no place that could move".into(), "leave it out");
        }
        if self.gives("velocity_gradient") && is_cell {
            let message = "the periodic cell follows its own motion".into();
            return refuse("velocity_gradient", message, "leave it out");
        }
        if self.gives("velocity_gradient") && dimension == 2 {
            let message = "regions of two dimensions, which have no end along z, do not deform".into();
            return refuse("velocity_gradient", message, "leave it out, or move the region by `velocity`");
        }
        match (self.grid, region) {
            (Some([0, ..] | [_, 0, _] | [_, _, 0]), _) => {
                refuse("grid", "a direction without cells".into(), "grid = [4, 4, 8]; 1 where it is not to be divided")
            }
            (Some([_, _, z]), Some(R::Box { .. })) if dimension == 2 && z != 1 => {
                refuse("grid", "two dimensions have one cell along z".into(), "grid = [4, 4, 1]")
            }
            (Some(_), Some(R::Box { .. })) | (None, _) => None,
            (Some(_), _) => refuse(
                "grid",
                "a grid divides a box".into(),
                "region = { kind = \"box\", minimum = [...], maximum = [...] }",
            ),
        }
    }
}

impl SampleRegion {
    /// Whether it is a list of particles.
    pub fn is_list(&self) -> bool {
        matches!(self, Self::Set { .. } | Self::Material { .. })
    }
}
