//! Laws of bonds and contacts, and how particles deform. Materials and their tables are the laws' own
//! ([`concordem_contact::material`]).

pub use concordem_contact::kinematics::deformable::Condition;
pub use concordem_contact::law::cohesive_beam::{BeamKind as BeamModel, BendingTerm};
pub use concordem_contact::law::cpm::{CpmFormulation, DamageLaw, YieldSurface};
pub use concordem_contact::law::{ContactLawName, LawName};
pub use concordem_contact::material::{Interface, Material, ParticleElasticity};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::Number;

/// How deformable particles are computed.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Deformable {
    /// Which strains go with which stresses; "plane-strain" in two dimensions, "solid" in three when left out.
    pub condition: Option<Condition>,
    /// When the strains of a step are found.
    pub update: DeformableUpdate,
    /// Largest relative change in the last iteration; with update "iterated"; 1e-10 when left out.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<Number>,
    /// Iterations after which the run stops; with update "iterated"; 200 when left out.
    #[schemars(range(min = 1))]
    pub maximum_iterations: Option<u32>,
    /// Share of each iteration's change that is taken over; with update "iterated"; 1 when left out.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub relaxation: Option<Number>,
    /// Whether the forces of dashpots strain the particles too.
    pub dashpots: bool,
}

impl Default for Deformable {
    fn default() -> Self {
        Self {
            condition: None,
            update: DeformableUpdate::Lagged,
            tolerance: None,
            maximum_iterations: None,
            relaxation: None,
            dashpots: false,
        }
    }
}

/// When the strains of deformable particles are found.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeformableUpdate {
    /// From the forces of the step before.
    #[default]
    Lagged,
    /// By iteration in each step, until strains and forces agree.
    Iterated,
}

/// Which particles are bonded at the start, and how.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bonds {
    /// Law of the bonds.
    pub law: LawName,
    /// Two particles are bonded when their center distance is at most this times the sum of their radii, up to a relative
    /// tolerance of 1e-9; 1.5 is usual for concrete. With 1, only particles that touch are bonded.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 10))]
    pub interaction_ratio: Number,
    /// Bonds per particle (mean) to be reached instead, counted in the periodic packing before anything is cut out of it:
    /// the nearest pairs, by centre distance through sum of radii, are bonded. 6.2 in Jebahi et al. 2015.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 100))]
    pub coordination: Option<Number>,
}

/// What particles do that touch without a bond.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contacts {
    /// Law of the contacts.
    pub law: ContactLawName,
}

fn one() -> Number {
    Number::new(1.0)
}
