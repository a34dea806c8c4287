//! Laws of bonds and contacts, and options of deformable particles. The tables of materials belong to the laws
//! ([`concordem_contact::material`]).

pub use concordem_contact::kinematics::deformable::Condition;
pub use concordem_contact::law::cohesive_beam::{BeamKind as BeamModel, BendingTerm};
pub use concordem_contact::law::cpm::{CpmFormulation, DamageLaw, YieldSurface};
pub use concordem_contact::law::{ContactLawName, LawName};
pub use concordem_contact::material::{Interface, Material, ParticleElasticity, Thermal};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::quantity::Number;

/// Options of deformable particles.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Deformable {
    /// Relation between the strains and stresses of a particle; default: "plane-strain" in two dimensions, "solid" in three.
    pub condition: Option<Condition>,
    /// When the strains of a step are computed; default: "lagged".
    pub update: DeformableUpdate,
    /// Largest relative change in the last iteration, with update "iterated"; default: 1e-10.
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub tolerance: Option<Number>,
    /// Number of iterations after which the run fails, with update "iterated"; default: 200.
    #[schemars(range(min = 1))]
    pub maximum_iterations: Option<u32>,
    /// Fraction of the change that each iteration applies, with update "iterated"; default: 1.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub relaxation: Option<Number>,
    /// Whether dashpot forces strain the particles, too.
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

/// When the strains of deformable particles are computed.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DeformableUpdate {
    /// From the forces of the previous step.
    #[default]
    Lagged,
    /// By iteration in each step, until strains and forces agree.
    Iterated,
}

/// Bonds made at the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bonds {
    /// Law of the bonds.
    pub law: LawName,
    /// Two particles are bonded if their center distance is at most this ratio times the sum of their radii, up to a
    /// relative tolerance of 1e-9. With 1, only particles that touch are bonded; 1.5 is usual for concrete.
    #[serde(default = "one")]
    #[schemars(extend("minimum" = 1, "maximum" = 10))]
    pub interaction_ratio: Number,
    /// Mean number of bonds per particle, instead of an interaction ratio. It is counted in the periodic packing,
    /// before the shape is cut out, and in packings between walls ("cooker", "growth") for the particles inside, more than two mean radii
    /// away from the walls; the pairs with the smallest center distance over sum of radii are bonded. 6.2 in Jebahi et al. 2015.
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 100))]
    pub coordination: Option<Number>,
    /// Whether bonds are made at the start; default: true. With false, only `[[bonding]]` makes bonds.
    #[serde(default = "yes")]
    pub at_start: bool,
    /// Factors on the strengths of the bonds of each sphere, in the order of the packing; a bond has the mean of its two spheres. They multiply
    /// those of `material.strength_scatter`. Default: 1. Example: `strength_factors = [1, 0.8, 1.2]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub strength_factors: Vec<Number>,
    /// Whether bonds near the faces of a body that is cut from a periodic packing get larger areas, in place of the bonds that the cut
    /// removes; default: false, where a layer of a quarter of a diameter has no stiffness. For "cpm", and a shape with `keep = "centers"`.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub face_correction: bool,
}

/// Contacts between particles without a bond, and with walls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Contacts {
    /// Law of the contacts.
    pub law: ContactLawName,
    /// Pairs of materials that pass through each other: particles do not touch particles and walls of the other material. A name
    /// twice: the particles and walls of this material among themselves. Bonds are not affected. Default: none.
    /// Example: `exclude = [["skin", "skin"], ["skin", "body"]]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub exclude: Vec<[String; 2]>,
}

fn yes() -> bool {
    true
}

fn one() -> Number {
    Number::new(1.0)
}
