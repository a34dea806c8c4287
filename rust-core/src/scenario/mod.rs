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
mod error;
mod material;
mod motion;
mod packing;
pub mod quantity;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use bodies::{AppliedForce, Clump, End, Initial, ParticleSet, Prescribe, Selection, Side, Wall, WallShape};
pub use error::{Problem, ProblemKind, ScenarioError, Source};
pub use material::{
    Bonds, ContactLawName, Contacts, Cpm, CpmMode, DamageLaw, Frictional, HertzMindlin, Interface, LawName, LinearBond,
    Material, YieldSurface,
};
pub use motion::{Damping, Integration, Lateral, Loading, Output, Safety, Scheme, Stop};
pub use packing::{Axis, Lattice, Packing, Radii, Shape};
pub use quantity::{Component, Quantity, TimeStep};

use crate::kinematics::Mode;

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
    pub kinematics: Mode,
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
    /// Read a scenario; `source_name` is for messages. Touches no file.
    pub fn parse(source_name: &str, text: &str) -> Result<Self, ScenarioError> {
        let source = Source { name: source_name.into(), text: text.into() };
        match toml::from_str::<Self>(text) {
            Ok(scenario) => Ok(Self { source, ..scenario }),
            Err(error) => Err(ScenarioError::new(
                &source,
                vec![Problem {
                    kind: ProblemKind::Syntax,
                    key: String::new(),
                    value: None,
                    span: error.span().unwrap_or(0..0),
                    message: error.message().to_owned(),
                    help: "see `concordem schema` for what a scenario may contain".to_owned(),
                }],
            )),
        }
    }
}

/// JSON Schema of a scenario.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Scenario).to_value()
}
