//! The scenario: the types behind a TOML file, its JSON Schema, templates, and problem reports.
//!
//! The doc comments of these types are the key reference: they appear in the JSON Schema and in error messages. The first
//! paragraph names the quantity, its unit, its default or when it is required, and an example value.
//!
//! ```
//! use concordem_scenario::schema::{Packing, Scenario};
//!
//! let scenario = Scenario::parse("two.toml", r#"
//!     version = 1
//!     [packing]
//!     kind = "spheres"
//!     spheres = [[0, 0, 0, "1 mm"], ["2.5 mm", 0, 0, "1 mm"]]
//!     [[material]]
//!     name = "glass"
//!     density = "2500 kg/m^3"
//!     hertz_mindlin = { young = "70 GPa", poisson = 0.2 }
//!     [contacts]
//!     law = "hertz_mindlin"
//!     [stop]
//!     steps = 100
//! "#)?;
//! assert_eq!(scenario.materials[0].density.si(), 2500.0);
//! assert!(matches!(scenario.packing, Packing::Spheres { .. }));
//! # Ok::<(), concordem_scenario::schema::ScenarioError>(())
//! ```

mod aggregates;
mod bodies;
mod bonding;
mod cut;
mod document;
mod error;
mod fibers;
mod history;
mod joint;
pub mod large;
mod material;
mod membrane;
mod motion;
mod opening;
mod packing;
mod phases;
pub mod quantity;
mod sample;
mod setting;
mod slave;
pub(crate) mod syntax;
mod templates;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use aggregates::{AggregateGroup, AggregateShape, Aggregates, GradingTable, Mix, MixComponent, Surface};
pub use bodies::{
    AppliedForce, Clump, End, Initial, MeshMotion, ParticleSet, Prescribe, Selection, Servo, VelocityField, Wall,
    WallRotation,
};
pub use bonding::Bonding;
pub use concordem_contact::heat::{
    Convection, Heat, HeatBoundary, HeatContact, HeatInitial, HeatNetwork, HeatPairs, HeatScheme, HeatSource, HeatSpot,
    Radiation,
};
pub use cut::{Cut, CutShape};
pub use document::Document;
pub use error::{Location, MOST_SHOWN, Problem, ProblemKind, ReadError, ScenarioError, Source};
pub use fibers::{FiberGroup, Fibers};
pub use history::{Control, History, HistoryShape, Stage, StageStop};
pub(crate) use joint::Orientation;
pub use joint::{Joint, JointShape};
pub use material::{
    BeamModel, BendingTerm, Bonds, Condition, ContactLawName, Contacts, CpmFormulation, DamageLaw, Deformable,
    DeformableUpdate, Interface, LawName, Material, ParticleElasticity, Thermal, YieldSurface,
};
pub use membrane::Membrane;
pub use motion::{Damping, DampingForm, Integration, Lateral, Loading, Output, Safety, Scheme, Stop};
pub use opening::OpeningControl;
pub use packing::{Axis, Lattice, Packing, Radii, Shape};
pub use phases::Phases;
pub use quantity::{Component, Quantity, TimeStep};
pub use sample::{OperatorSample, SamplePlane, SampleRegion};
pub use setting::{Door, Given, Setting};
pub use slave::Slave;
pub use templates::{OTHER_NAMES, SWEEPS, TEMPLATES, Template, template};

use concordem_contact::kinematics::MotionMeasure;

/// A scenario. Numbers are in SI units or strings with a unit (`"30 GPa"`); tension is positive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of the format. Required: `version = 1`.
    #[schemars(extend("enum" = [1]))]
    pub version: u32,
    /// Title for reports; default: empty. Example: `title = "Column collapse"`.
    #[serde(default)]
    pub title: String,
    /// Author, or several, for reports; default: empty. Example: `author = "A. Mason, Testing Laboratory"`.
    #[serde(default)]
    pub author: String,
    /// Number of space dimensions; default: 3. With 2, particles are discs of unit depth in the plane z = 0.
    #[serde(default = "three")]
    #[schemars(extend("enum" = [2, 3]))]
    pub dimension: u8,
    /// Kinematics: how relative motion at contacts is measured; default: "finite".
    #[serde(default)]
    pub kinematics: MotionMeasure,
    /// Initial positions and radii of the particles. Required.
    pub packing: Packing,
    /// Materials; at least one is required.
    #[serde(rename = "material")]
    #[schemars(length(min = 1))]
    pub materials: Vec<Material>,
    /// Parameters for contacts between two materials, instead of the averages of both materials.
    #[serde(default, rename = "interface")]
    pub interfaces: Vec<Interface>,
    /// Bonds, made at the start unless `at_start` is false; default: none.
    pub bonds: Option<Bonds>,
    /// Bonds made during the run; default: none.
    #[serde(default, rename = "bonding")]
    pub bondings: Vec<Bonding>,
    /// Aggregates and pores, which divide the particles of the packing; default: none.
    pub aggregates: Option<Aggregates>,
    /// Materials and aggregates of given particles, instead of `aggregates`; default: none.
    pub phases: Option<Phases>,
    /// Fibers in the packing; default: none.
    pub fibers: Option<Fibers>,
    /// Notches, holes, and cracks that exist from the start; default: none.
    #[serde(default, rename = "cut")]
    pub cuts: Vec<Cut>,
    /// Joints of rock, along which bonds and contacts of the law "jointed" slide; default: none.
    #[serde(default, rename = "joint")]
    pub joints: Vec<Joint>,
    /// Contacts between particles without a bond, and with walls. Required.
    pub contacts: Contacts,
    /// Options of deformable particles (those whose material has a table `deformable`); default: see its keys.
    pub deformable: Option<Deformable>,
    /// Time integration, damping, and gravity; default: see its keys.
    #[serde(default)]
    pub integration: Integration,
    /// Loading of the specimen; default: none.
    #[serde(default)]
    pub loading: Loading,
    /// Stages of the loading, in their order; default: one stage of constant rate, until `stop` ends it.
    #[serde(default, rename = "stage")]
    pub stages: Vec<Stage>,
    /// Factors that change with time, for motions, forces, walls, and stages; default: none.
    #[serde(default, rename = "history")]
    pub histories: Vec<History>,
    /// Rigid walls; default: none.
    #[serde(default, rename = "wall")]
    pub walls: Vec<Wall>,
    /// Flexible membranes that press on the specimen; default: none.
    #[serde(default, rename = "membrane")]
    pub membranes: Vec<Membrane>,
    /// Named sets of particles; default: none.
    #[serde(default, rename = "set")]
    pub sets: Vec<ParticleSet>,
    /// Prescribed motions; default: none. A later one overrides an earlier one, component by component.
    #[serde(default, rename = "prescribe")]
    pub prescribed: Vec<Prescribe>,
    /// Particles and meshes that repeat the motion in a file; default: none.
    #[serde(default, rename = "slave")]
    pub slaves: Vec<Slave>,
    /// Rigid bodies made of several spheres; default: none.
    #[serde(default, rename = "clump")]
    pub clumps: Vec<Clump>,
    /// Forces on particles; default: none.
    #[serde(default, rename = "force")]
    pub forces: Vec<AppliedForce>,
    /// Initial velocities; default: zero. A later one overrides an earlier one.
    #[serde(default, rename = "initial")]
    pub initials: Vec<Initial>,
    /// Heat conduction and thermal expansion; default: none.
    pub heat: Option<Heat>,
    /// Operators that are evaluated during the run; default: none.
    #[serde(default, rename = "sample")]
    pub samples: Vec<OperatorSample>,
    /// End of the run. Required without stages: at least one of its keys.
    #[serde(default)]
    pub stop: Stop,
    /// Output; default: see its keys.
    #[serde(default)]
    pub output: Output,
    /// Name and text of the scenario file.
    #[serde(skip)]
    pub source: Source,
}

fn three() -> u8 {
    3
}

impl Scenario {
    /// Names of the walls in the order of the state: those of `[[wall]]`, where a box has six, and the platens.
    pub fn wall_names(&self) -> Vec<String> {
        let walls = self.walls.iter().enumerate();
        walls.flat_map(|(number, wall)| wall.names(number)).chain(self.names_of_loading_walls()).collect()
    }

    /// Whether a membrane or walls enclose the particles, which then are a specimen under a pressure.
    pub fn is_enclosed(&self) -> bool {
        !self.membranes.is_empty() || self.walls.iter().any(|wall| wall.shape.kind().encloses())
    }

    /// Names of the walls that the loading adds.
    pub fn names_of_loading_walls(&self) -> Vec<String> {
        let mut names = Vec::new();
        if let Loading::Platens { strip_width: None, .. } = self.loading {
            names.extend(["lower platen", "upper platen"].map(str::to_owned));
        }
        if let Loading::Flexure { inner_span, roller_radius: Some(_), .. } = &self.loading {
            let rollers: &[&str] = if inner_span.si() > 0.0 { &["first roller", "second roller"] } else { &["roller"] };
            names.extend(["first support", "second support"].iter().chain(rollers).map(|name| (*name).to_owned()));
        }
        names
    }

    /// The files that the scenario reads (packing, surfaces, cuts, joints, and aggregates), with their keys.
    pub fn files(&self) -> Vec<(String, &str)> {
        let mut files = Vec::new();
        if let Packing::File { path, .. } = &self.packing {
            files.push(("packing.path".to_owned(), &path[..]));
        }
        if let Some(Shape::Mesh { path, .. }) = self.packing.shape() {
            files.push(("packing.shape.path".to_owned(), path));
        }
        for (at, wall) in self.walls.iter().enumerate() {
            if let Some(file) = wall.shape.kind().file() {
                files.push((format!("wall[{at}].shape.path"), file.path));
            }
        }
        for (at, slave) in self.slaves.iter().enumerate() {
            files.push((format!("slave[{at}].path"), &slave.path[..]));
        }
        for (at, cut) in self.cuts.iter().enumerate() {
            if let CutShape::Facets { path, .. } = &cut.shape {
                files.push((format!("cut[{at}].shape.path"), path));
            }
        }
        for (at, joint) in self.joints.iter().enumerate() {
            if let JointShape::Facets { path, .. } = &joint.shape {
                files.push((format!("joint[{at}].shape.path"), path));
            }
        }
        for (at, group) in self.aggregates.iter().flat_map(|aggregates| &aggregates.groups).enumerate() {
            if let Some(AggregateShape::Mesh { path }) = &group.shape {
                files.push((format!("aggregates.group[{at}].shape.path"), path));
            }
        }
        files
    }

    /// Names of the materials of aggregates.
    pub fn materials_of_aggregates(&self) -> Vec<&str> {
        let groups = self.aggregates.iter().flat_map(|aggregates| &aggregates.groups);
        let mut names: Vec<&str> = groups.filter_map(|group| group.material.as_deref()).collect();
        if let Some(phases) = &self.phases {
            let of = phases.aggregates.iter().zip(&phases.materials).filter(|(aggregate, _)| **aggregate > 0);
            let mut materials: Vec<u16> = of.map(|(_, material)| *material).collect();
            materials.sort_unstable();
            materials.dedup();
            names.extend(materials.iter().filter_map(|&at| Some(&self.materials.get(usize::from(at))?.name[..])));
        }
        names
    }

    /// Numbers of the groups of fibers that have a material.
    pub fn fibers_of<'a>(&'a self, material: &'a str) -> impl Iterator<Item = usize> + 'a {
        let groups = self.fibers.iter().flat_map(|fibers| &fibers.groups).enumerate();
        groups.filter(move |(_, group)| group.material == material).map(|(at, _)| at)
    }

    /// Folder of the scenario, to which the paths in it are relative.
    pub fn directory(&self) -> PathBuf {
        Path::new(&*self.source.name).parent().unwrap_or(Path::new("")).to_owned()
    }

    /// A problem found during assembly or the run, at a key path such as `"integration.time_step"`.
    pub fn problem(
        &self,
        kind: ProblemKind,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> ScenarioError {
        ScenarioError::new(&self.source, vec![self.located(kind, key, message, help)])
    }

    /// A warning about the key path `key`; see [`ProblemKind::Warning`].
    pub fn warning(&self, key: &str, message: impl Into<String>, help: impl Into<String>) -> Problem {
        self.located(ProblemKind::Warning, key, message, help)
    }

    /// A problem with its position in the text.
    fn located(&self, kind: ProblemKind, key: &str, message: impl Into<String>, help: impl Into<String>) -> Problem {
        let (span, value) = match Document::parse(&self.source) {
            Ok(document) => document.locate(key),
            Err(_) => (0..0, None),
        };
        Problem { kind, key: key.to_owned(), value, span, message: message.into(), help: help.into() }
    }
}

/// JSON Schema of a scenario.
///
/// Quantities carry their dimension as `x-dimension` and suggested units as `x-units`; bounds are in SI units.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Scenario).to_value()
}
