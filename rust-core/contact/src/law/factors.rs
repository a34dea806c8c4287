//! Factors on the parameters of a material at an interface.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::table::Fault;
use crate::quantity::{Dimension, Number, Quantity};

/// Factors on the parameters of a material, for the bonds and contacts of an interface: weaker and softer than the mortar, for
/// example (Stránský 2018, section 8.1).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Factors {
    /// Factor on the stiffness in all directions; also that of contacts without a bond.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub stiffness: Number,
    /// Factor on the strength: on all stresses or forces at which a bond fails.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub strength: Number,
    /// Factor on the ductility: on the softening strain divided by the crack onset strain. Only for laws that soften ("cpm", "softening_beam": on the fracture energies).
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub ductility: Number,
}

impl Default for Factors {
    fn default() -> Self {
        let one = Number::new(1.0);
        Self { stiffness: one, strength: one, ductility: one }
    }
}

impl Factors {
    /// The factors that contacts without a bond have: that of the stiffness.
    pub fn of_contacts(self) -> Self {
        Self { stiffness: self.stiffness, ..Self::default() }
    }

    /// Whether the parameters stay as they are.
    pub fn is_one(self) -> bool {
        self == Self::default()
    }

    /// A fault if the factor of the ductility is given to a law without softening.
    ///
    /// # Errors
    /// The fault.
    pub(super) fn refuse_ductility(self) -> Result<(), Fault> {
        if self.ductility.si() == 1.0 {
            return Ok(());
        }
        let help = "remove the factor, or use the law \"cpm\" or \"softening_beam\"";
        Err(Fault::conflict("ductility", "the bonds of this law are brittle: they have no softening to scale", help))
    }

    /// A fault if the factor of the strength is given to a table without any strength.
    ///
    /// # Errors
    /// The fault.
    pub(super) fn refuse_strength(self, has_strength: bool, keys: &str) -> Result<(), Fault> {
        if self.strength.si() == 1.0 || has_strength {
            return Ok(());
        }
        let help = format!("give {keys} to the material, or remove the factor");
        Err(Fault::conflict("strength", "the bonds of this material have no strength to scale", help))
    }
}

/// The quantity times a factor.
pub(super) fn times<D: Dimension>(value: Quantity<D>, factor: Number) -> Quantity<D> {
    Quantity::new(value.si() * factor.si())
}
