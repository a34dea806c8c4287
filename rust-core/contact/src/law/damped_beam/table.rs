//! The damped beam in scenarios.

use super::{BeamDamping, DampedBeam};
use crate::law::cohesive_beam::table::{beam_table, springs_of_table};
use crate::law::cohesive_beam::{BeamKind, CohesiveBeamTable, RadiusRule};
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{BendingTerm, CohesiveBeam, Factors, ParameterError};
use crate::quantity::{Angle, Length, Number, Stress};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

beam_table! {
    /// Cohesive beam with a dashpot beside each of its springs. It breaks as a cohesive beam does.
    DampedBeamTable, "DampedBeam" {
        /// Damping ratio of a pair that vibrates along its bond, 1 for critical damping; of shear, bending, and twist, too, where their
        /// keys are left out.
        #[schemars(extend("minimum" = 0))]
        pub damping_ratio: Number,
        /// Damping ratio in shear. Default: `damping_ratio`.
        #[schemars(extend("minimum" = 0))]
        pub shear_damping_ratio: Option<Number>,
        /// Damping ratio in bending. Default: `damping_ratio`.
        #[schemars(extend("minimum" = 0))]
        pub bending_damping_ratio: Option<Number>,
        /// Damping ratio in twist. Default: `damping_ratio`.
        #[schemars(extend("minimum" = 0))]
        pub twist_damping_ratio: Option<Number>,
    }
}

springs_of_table!(DampedBeamTable);

impl DampedBeamTable {
    fn damping(&self) -> BeamDamping {
        let or_all = |ratio: Option<Number>| ratio.unwrap_or(self.damping_ratio).si();
        BeamDamping {
            normal: self.damping_ratio.si(),
            shear: or_all(self.shear_damping_ratio),
            bending: or_all(self.bending_damping_ratio),
            twist: or_all(self.twist_damping_ratio),
        }
    }
}

impl LawTable for DampedBeamTable {
    fn faults(&self) -> Vec<Fault> {
        let mut faults = self.beam().faults();
        let springs = matches!(self.model, BeamKind::DualSpring | BeamKind::Spring);
        let without_spring = [
            ("shear_damping_ratio", self.shear_damping_ratio, self.model == BeamKind::Spring),
            ("bending_damping_ratio", self.bending_damping_ratio, springs),
            ("twist_damping_ratio", self.twist_damping_ratio, springs),
        ];
        for (key, ratio, without) in without_spring {
            if ratio.is_some() && without {
                let help = "remove this key, or write model = \"euler-bernoulli\"";
                faults.push(Fault::conflict(key, "has no effect: this model has no such spring", help));
            }
        }
        faults
    }

    fn modulus(&self) -> Option<f64> {
        self.beam().modulus()
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        self.beam().fault_of_variation()
    }

    fn hydrostatic_strength(&self) -> Option<f64> {
        self.beam().hydrostatic_strength()
    }

    fn keys_of_particles(&self) -> Vec<&'static str> {
        self.beam().keys_of_particles()
    }
}

impl RegisteredLaw for DampedBeam {
    type Table = DampedBeamTable;
    type Unbonded = Self;
    const TITLE: &'static str = "damped beam";
    const AS_BOND: Option<&'static str> = Some("Elastic beam between the centers with dashpots, brittle.");

    fn row(a: &DampedBeamTable, b: &DampedBeamTable) -> Result<Self, ParameterError> {
        let beam = CohesiveBeam::row(&a.beam(), &b.beam())?;
        let mean = |of: fn(&BeamDamping) -> f64| 0.5 * (of(&a.damping()) + of(&b.damping()));
        let damping = BeamDamping {
            normal: mean(|d| d.normal),
            shear: mean(|d| d.shear),
            bending: mean(|d| d.bending),
            twist: mean(|d| d.twist),
        };
        let damped = Self { beam, damping };
        damped.validate()?;
        Ok(damped)
    }

    /// Never called: beams do not act as unbonded contacts.
    fn unbonded_row(a: &DampedBeamTable, b: &DampedBeamTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    fn scaled(table: &DampedBeamTable, factors: &Factors) -> Result<DampedBeamTable, Fault> {
        let CohesiveBeamTable { young, tensile_strength, cohesion, .. } = CohesiveBeam::scaled(&table.beam(), factors)?;
        Ok(DampedBeamTable { young, tensile_strength, cohesion, ..table.clone() })
    }
}
