//! The jointed bond in scenarios: its parameter table and the pair coefficients computed from two tables.

use super::Jointed;
use crate::law::factors::times;
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{Factors, ParameterError};
use crate::quantity::{Angle, Number, Stress};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Brittle bond with tensile strength, cohesion, and friction, as in YADE's JCFpm.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "Jointed", deny_unknown_fields)]
pub struct JointedTable {
    /// Modulus, Pa: the normal stiffness of two equal spheres is modulus × radius. In YADE: `young`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Shear stiffness divided by normal stiffness. In YADE: `poisson`.
    #[schemars(extend("minimum" = 0))]
    pub stiffness_ratio: Number,
    /// Tensile strength of a bond, Pa; 0 for none of its own: then the friction cone ends it, at cohesion / friction coefficient.
    #[schemars(extend("minimum" = 0))]
    pub tensile_strength: Stress,
    /// Shear strength of a bond without normal force, Pa.
    #[schemars(extend("minimum" = 0))]
    pub cohesion: Stress,
    /// Tangent of the angle of friction of a bond, whole or cracked in shear; or give `friction_angle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Option<Number>,
    /// Angle of friction of a bond, rad. In YADE: `frictionAngle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_angle: Option<Angle>,
    /// Tangent of the angle of friction of contacts that were no bond, or whose bond is gone; or give `residual_friction_angle`.
    /// Default: that of bonds.
    #[schemars(extend("minimum" = 0))]
    pub residual_friction_coefficient: Option<Number>,
    /// Angle of friction of contacts that were no bond, or whose bond is gone, rad. In YADE: `residualFrictionAngle`.
    #[schemars(extend("minimum" = 0))]
    pub residual_friction_angle: Option<Angle>,
}

/// A coefficient of friction, given as such or by its angle.
struct Friction {
    keys: [&'static str; 2],
    coefficient: Option<Number>,
    angle: Option<Angle>,
}

impl Friction {
    fn value(&self) -> Option<f64> {
        self.coefficient.map(Number::si).or_else(|| self.angle.map(|angle| libm::tan(angle.si())))
    }

    fn faults(&self) -> impl Iterator<Item = Fault> {
        let [coefficient, angle] = self.keys;
        let twice = (self.coefficient.is_some() && self.angle.is_some()).then(|| {
            let help = format!("keep one: `{coefficient}` is the tangent of `{angle}`");
            Fault::conflict(angle, format!("both `{angle}` and `{coefficient}`"), help)
        });
        let large = self.angle.filter(|angle| angle.si() >= std::f64::consts::FRAC_PI_2).map(|given| {
            let help = format!("plain numbers are radians; did you mean \"{} deg\"?", given.si());
            Fault::range(angle, "must be less than a right angle", help)
        });
        twice.into_iter().chain(large)
    }
}

impl JointedTable {
    fn of_bonds(&self) -> Friction {
        let keys = ["friction_coefficient", "friction_angle"];
        Friction { keys, coefficient: self.friction_coefficient, angle: self.friction_angle }
    }

    fn of_contacts(&self) -> Friction {
        let keys = ["residual_friction_coefficient", "residual_friction_angle"];
        Friction { keys, coefficient: self.residual_friction_coefficient, angle: self.residual_friction_angle }
    }

    /// Coefficients of friction of bonds and of contacts without bond.
    fn friction(&self) -> [f64; 2] {
        let bonds = self.of_bonds().value().unwrap_or(0.0);
        [bonds, self.of_contacts().value().unwrap_or(bonds)]
    }
}

impl LawTable for JointedTable {
    fn faults(&self) -> Vec<Fault> {
        let mut faults: Vec<Fault> = self.of_bonds().faults().chain(self.of_contacts().faults()).collect();
        if self.of_bonds().value().is_none() {
            let help = "add `friction_coefficient = 0.6` (the tangent), or `friction_angle = \"30 deg\"`";
            faults.push(Fault::missing("friction_angle", "neither `friction_angle` nor `friction_coefficient`", help));
        }
        if self.tensile_strength.si() == 0.0 && self.cohesion.si() == 0.0 {
            let help = "give one of both; for grains without bonds use the law \"frictional\"";
            faults.push(Fault::conflict("cohesion", "bonds have neither tensile strength nor cohesion", help));
        }
        faults
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }

    fn modulus(&self) -> Option<f64> {
        Some(self.young.si())
    }
}

impl RegisteredLaw for Jointed {
    type Table = JointedTable;
    type Unbonded = Self;
    const TITLE: &'static str = "jointed cohesive frictional model";
    const AS_BOND: Option<&'static str> =
        Some("Brittle bond with tensile strength, cohesion, and friction, as in YADE's JCFpm.");
    const AS_CONTACT: Option<&'static str> =
        Some("Contact with friction that begins without force, as in YADE's JCFpm.");

    /// The weaker and smoother material decides.
    fn row(a: &JointedTable, b: &JointedTable) -> Result<Self, ParameterError> {
        let ([friction_a, residual_a], [friction_b, residual_b]) = (a.friction(), b.friction());
        let bond = Self {
            young_a: a.young.si(),
            young_b: b.young.si(),
            stiffness_ratio_a: a.stiffness_ratio.si(),
            stiffness_ratio_b: b.stiffness_ratio.si(),
            tensile_strength: a.tensile_strength.si().min(b.tensile_strength.si()),
            cohesion: a.cohesion.si().min(b.cohesion.si()),
            friction: friction_a.min(friction_b),
            residual_friction: residual_a.min(residual_b),
        };
        bond.validate()?;
        Ok(bond)
    }

    fn unbonded_row(a: &JointedTable, b: &JointedTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    fn scaled(table: &JointedTable, factors: &Factors) -> Result<JointedTable, Fault> {
        factors.refuse_ductility()?;
        Ok(JointedTable {
            young: times(table.young, factors.stiffness),
            tensile_strength: times(table.tensile_strength, factors.strength),
            cohesion: times(table.cohesion, factors.strength),
            ..table.clone()
        })
    }
}
