//! The scenario: what is to be computed, as a TOML file.
//!
//! ```
//! use concordem::scenario::{Packing, Scenario};
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
//! # Ok::<(), concordem::scenario::ScenarioError>(())
//! ```

mod bodies;
mod document;
mod error;
mod material;
mod meaning;
mod motion;
mod packing;
pub mod quantity;
mod sample;
mod structure;
mod templates;

use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use bodies::{AppliedForce, Clump, End, Initial, ParticleSet, Prescribe, Selection, Side, Wall, WallShape};
pub use error::{Problem, ProblemKind, ScenarioError, Source};
pub use material::{
    BeamModel, BendingTerm, Bonds, Condition, ContactLawName, Contacts, CpmFormulation, DamageLaw, Deformable,
    DeformableUpdate, Interface, LawName, Material, ParticleElasticity, YieldSurface,
};
pub use motion::{Damping, DampingForm, Integration, Lateral, Loading, Output, Safety, Scheme, Stop};
pub use packing::{Axis, Lattice, Packing, Radii, Shape};
pub use quantity::{Component, Quantity, TimeStep};
pub use sample::Misuse;
pub use sample::{OperatorSample, SamplePlane, SampleRegion};
pub use templates::{SWEEP, SWEPT, TEMPLATES, Template, template};

pub use document::Document;

use concordem_contact::kinematics::MotionMeasure;

/// A scenario. Numbers are in SI units or strings with a unit (`"30 GPa"`); tension is positive.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Version of the format; 1.
    #[schemars(extend("enum" = [1]))]
    pub version: u32,
    /// Title, for reports.
    #[serde(default)]
    pub title: String,
    /// 3, or 2: discs of unit depth in the plane z = 0.
    #[serde(default = "three")]
    #[schemars(extend("enum" = [2, 3]))]
    pub dimension: u8,
    /// How relative motion at contacts is measured.
    #[serde(default)]
    pub kinematics: MotionMeasure,
    /// Where the particles come from.
    pub packing: Packing,
    /// Materials.
    #[serde(rename = "material")]
    #[schemars(length(min = 1))]
    pub materials: Vec<Material>,
    /// Parameters between unlike materials, in place of averages.
    #[serde(default, rename = "interface")]
    pub interfaces: Vec<Interface>,
    /// Bonds made at the start; none when left out.
    pub bonds: Option<Bonds>,
    /// What touching particles do that are not bonded.
    pub contacts: Contacts,
    /// How the particles deform whose material has a table `deformable`.
    pub deformable: Option<Deformable>,
    /// Time integration.
    #[serde(default)]
    pub integration: Integration,
    /// Loading.
    #[serde(default)]
    pub loading: Loading,
    /// Walls.
    #[serde(default, rename = "wall")]
    pub walls: Vec<Wall>,
    /// Named sets of particles.
    #[serde(default, rename = "set")]
    pub sets: Vec<ParticleSet>,
    /// Prescribed motions; a later one overrides an earlier one, component by component.
    #[serde(default, rename = "prescribe")]
    pub prescribed: Vec<Prescribe>,
    /// Rigid bodies of several spheres.
    #[serde(default, rename = "clump")]
    pub clumps: Vec<Clump>,
    /// Constant forces.
    #[serde(default, rename = "force")]
    pub forces: Vec<AppliedForce>,
    /// Velocities at the start; a later one overrides an earlier one.
    #[serde(default, rename = "initial")]
    pub initials: Vec<Initial>,
    /// Operators that are evaluated during the run.
    #[serde(default, rename = "sample")]
    pub samples: Vec<OperatorSample>,
    /// When the run ends.
    #[serde(default)]
    pub stop: Stop,
    /// What is written.
    #[serde(default)]
    pub output: Output,
    /// Name and text the scenario was read from.
    #[serde(skip)]
    pub source: Source,
}

fn three() -> u8 {
    3
}

impl Scenario {
    /// Names of the walls in the order of a state's: those of `[[wall]]`, a box with six faces, and platens.
    pub fn wall_names(&self) -> Vec<String> {
        let mut names = Vec::new();
        for (number, wall) in self.walls.iter().enumerate() {
            let name = wall.name.clone().unwrap_or_else(|| format!("wall {number}"));
            if let WallShape::Box { .. } = wall.shape {
                for axis in ["x", "y", "z"] {
                    names.extend(["minimum", "maximum"].map(|end| format!("{name} {axis} {end}")));
                }
            } else {
                names.push(name);
            }
        }
        if let Loading::Platens { .. } = self.loading {
            names.extend(["lower platen", "upper platen"].map(str::to_owned));
        }
        names
    }

    /// Read a scenario; `source_name` is for messages. Touches no file.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, ScenarioError> {
        Self::parse_with(source_name, text, None)
    }

    /// Read a scenario from a file and check that the files it names are there.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| ReadError::Io { path: path.to_owned(), error })?;
        let text = String::from_utf8(bytes).map_err(|error| {
            let start = error.utf8_error().valid_up_to();
            let line = error.as_bytes()[..start].split(|byte| *byte == b'\n').count();
            ReadError::NotText { path: path.to_owned(), line }
        })?;
        let directory = path.parent().unwrap_or(Path::new("")).to_owned();
        Ok(Self::parse_with(&name, &text, Some(&directory))?)
    }

    fn parse_with(source_name: &str, text: &str, directory: Option<&Path>) -> Result<Self, ScenarioError> {
        // Files written on Windows may begin with a byte order mark.
        let text = text.strip_prefix('\u{feff}').unwrap_or(text);
        let source = Source { name: source_name.into(), text: text.into() };
        let document = Document::parse(&source).map_err(|problems| ScenarioError::new(&source, problems))?;
        let mut problems = structure::check(&document, own_schema());
        let scenario = match document.deserialize::<Self>() {
            Ok(scenario) => scenario,
            Err(problem) => {
                // What serde finds first, the check of structure has found with all the rest.
                if problems.is_empty() {
                    problems.push(problem);
                }
                return Err(ScenarioError::new(&source, problems));
            }
        };
        if scenario.materials.is_empty() {
            return Err(ScenarioError::new(&source, problems));
        }
        problems.extend(meaning::check(&document, &scenario));
        if let Some(directory) = directory {
            problems.extend(meaning::check_files(&document, &scenario, directory));
        }
        if problems.is_empty() { Ok(Self { source, ..scenario }) } else { Err(ScenarioError::new(&source, problems)) }
    }

    /// The files it reads, as it names them, with their keys: packing, surfaces.
    pub fn files(&self) -> Vec<(String, &str)> {
        let mut files = Vec::new();
        if let Packing::File { path, .. } = &self.packing {
            files.push(("packing.path".to_owned(), &path[..]));
        }
        if let Some(Shape::Mesh { path, .. }) = self.packing.shape() {
            files.push(("packing.shape.path".to_owned(), path));
        }
        for (at, wall) in self.walls.iter().enumerate() {
            if let WallShape::Facets { path, .. } = &wall.shape {
                files.push((format!("wall[{at}].shape.path"), path));
            }
        }
        files
    }

    /// Folder of the scenario; the files it names are relative to it.
    pub fn directory(&self) -> PathBuf {
        Path::new(&*self.source.name).parent().unwrap_or(Path::new("")).to_owned()
    }

    /// A problem found later, while building or running, at a key path such as `"integration.time_step"`.
    pub fn problem(
        &self,
        kind: ProblemKind,
        key: &str,
        message: impl Into<String>,
        help: impl Into<String>,
    ) -> ScenarioError {
        let (span, value) = match Document::parse(&self.source) {
            Ok(document) => document.locate(key),
            Err(_) => (0..0, None),
        };
        let problem = Problem { kind, key: key.to_owned(), value, span, message: message.into(), help: help.into() };
        ScenarioError::new(&self.source, vec![problem])
    }
}

/// Why a scenario file could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadError {
    /// The operating system refused.
    #[error("cannot read {}: {error}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        #[source]
        error: std::io::Error,
    },
    /// The file is not UTF-8 text.
    #[error("{} is not a text file: line {line} has bytes that are not UTF-8", path.display())]
    NotText {
        /// The file.
        path: PathBuf,
        /// First such line, from 1.
        line: usize,
    },
    /// The scenario is wrong.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
}

/// The schema, made once.
fn own_schema() -> &'static serde_json::Value {
    static SCHEMA: std::sync::OnceLock<serde_json::Value> = std::sync::OnceLock::new();
    SCHEMA.get_or_init(schema)
}

/// JSON Schema of a scenario.
///
/// Quantities carry their dimension as `x-dimension` and the units to suggest as `x-units`; bounds are in SI units.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Scenario).to_value()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn templates_are_valid() {
        for template in TEMPLATES {
            if let Err(error) = Scenario::parse(template.name, template.text) {
                panic!("{error}");
            }
        }
    }
}
