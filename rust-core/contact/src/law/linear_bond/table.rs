//! The linear bond in scenarios: its parameter table and the pair coefficients computed from two tables.

use super::LinearBond;
use crate::law::common::mean_strength;
use crate::law::factors::times;
use crate::law::frictional::{Frictional, FrictionalTable};
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{Factors, ParameterError};
use crate::quantity::{self, Force, Number};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Linear elastic bond with dashpots and brittle failure; after failure a contact with Coulomb friction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "LinearBond", deny_unknown_fields)]
pub struct LinearBondTable {
    /// Normal stiffness of a bond, N/m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_stiffness: quantity::Stiffness,
    /// Shear stiffness of a bond, N/m.
    #[schemars(extend("minimum" = 0))]
    pub shear_stiffness: quantity::Stiffness,
    /// Dashpots as a fraction of critical damping.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub damping_ratio: Number,
    /// Tensile force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only
    /// one given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub normal_strength: Option<Force>,
    /// Shear force at which a bond breaks, N; unbreakable if left out. Between two materials: the mean, or the only one
    /// given.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub shear_strength: Option<Force>,
    /// Friction coefficient (tangent of the angle) after failure.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Number,
    /// Whether a bond is unstressed at its length at bonding.
    #[serde(default = "yes")]
    pub subtract_initial_gap: bool,
}

fn yes() -> bool {
    true
}

impl LawTable for LinearBondTable {
    fn keys_of_bonds(&self) -> Vec<&'static str> {
        let keys = [
            ("normal_strength", self.normal_strength.is_some()),
            ("shear_strength", self.shear_strength.is_some()),
            ("subtract_initial_gap", !self.subtract_initial_gap),
        ];
        keys.into_iter().filter(|(_, given)| *given).map(|(key, _)| key).collect()
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }

    fn fault_in_plane(&self) -> Option<Fault> {
        None
    }
}

impl LinearBondTable {
    /// The contact that replaces a broken bond: the same springs and dashpots, with friction.
    fn after_breaking(&self) -> FrictionalTable {
        FrictionalTable {
            young: None,
            stiffness_ratio: None,
            normal_stiffness: Some(self.normal_stiffness),
            shear_stiffness: Some(self.shear_stiffness),
            friction_coefficient: self.friction_coefficient,
            damping_ratio: self.damping_ratio,
        }
    }
}

impl RegisteredLaw for LinearBond {
    type Table = LinearBondTable;
    type Unbonded = Frictional;
    const TITLE: &'static str = "linear bond";
    const AS_BOND: Option<&'static str> = Some("Linear elastic bond, brittle; after failure a frictional contact.");
    const AS_CONTACT: Option<&'static str> = Some("Linear bond after failure: linear contact with friction.");

    fn row(a: &LinearBondTable, b: &LinearBondTable) -> Result<Self, ParameterError> {
        let mean = |of: fn(&LinearBondTable) -> f64| 0.5 * (of(a) + of(b));
        let strength =
            |of: fn(&LinearBondTable) -> Option<Force>| mean_strength(of(a).map(Force::si), of(b).map(Force::si));
        let mut bond = Self::new(
            mean(|t| t.normal_stiffness.si()),
            mean(|t| t.shear_stiffness.si()),
            mean(|t| t.damping_ratio.si()),
            strength(|t| t.normal_strength),
            strength(|t| t.shear_strength),
        )?;
        bond.subtract_initial_gap = a.subtract_initial_gap && b.subtract_initial_gap;
        Ok(bond)
    }

    fn unbonded_row(a: &LinearBondTable, b: &LinearBondTable) -> Result<Frictional, ParameterError> {
        Frictional::row(&a.after_breaking(), &b.after_breaking())
    }

    fn scaled(table: &LinearBondTable, factors: &Factors) -> Result<LinearBondTable, Fault> {
        factors.refuse_ductility()?;
        let has_strength = table.normal_strength.is_some() || table.shear_strength.is_some();
        factors.refuse_strength(has_strength, "`normal_strength` or `shear_strength`")?;
        Ok(LinearBondTable {
            normal_stiffness: times(table.normal_stiffness, factors.stiffness),
            shear_stiffness: times(table.shear_stiffness, factors.stiffness),
            normal_strength: table.normal_strength.map(|strength| times(strength, factors.strength)),
            shear_strength: table.shear_strength.map(|strength| times(strength, factors.strength)),
            ..table.clone()
        })
    }
}
