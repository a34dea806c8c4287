//! The softening beam in scenarios.

use super::{BeamFractureEnergy, Softening, SofteningBeam};
use crate::law::cohesive_beam::table::{beam_table, springs_of_table};
use crate::law::cohesive_beam::{BeamKind, CohesiveBeamTable, RadiusRule};
use crate::law::factors::times;
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{BendingTerm, CohesiveBeam, Factors, ParameterError};
use crate::quantity::{Angle, FractureEnergy, Length, Number, Stress};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

beam_table! {
    /// Cohesive beam whose strength ends gradually, by a fracture energy per area.
    SofteningBeamTable, "SofteningBeam" {
        /// Energy per area of a beam that tension and bending take to break it, J/m^2. Between two materials: the mean.
        #[schemars(extend("exclusiveMinimum" = 0))]
        pub fracture_energy: FractureEnergy,
        /// Energy per area of a beam that shear and twist take to break it, J/m^2. Default: `fracture_energy`.
        #[schemars(extend("exclusiveMinimum" = 0))]
        pub shear_fracture_energy: Option<FractureEnergy>,
        /// Exponent of the mixture of both (Benzeggagh and Kenane 1996); only with `shear_fracture_energy`. Default: 1.
        #[schemars(extend("exclusiveMinimum" = 0))]
        pub mixture_exponent: Option<Number>,
        /// How the force falls over the deformation.
        #[serde(default)]
        pub softening: Softening,
    }
}

springs_of_table!(SofteningBeamTable);

impl SofteningBeamTable {
    fn energy(&self) -> BeamFractureEnergy {
        BeamFractureEnergy {
            tension: self.fracture_energy.si(),
            shear: self.shear_fracture_energy.unwrap_or(self.fracture_energy).si(),
            exponent: self.mixture_exponent.map_or(1.0, Number::si),
        }
    }
}

impl LawTable for SofteningBeamTable {
    fn faults(&self) -> Vec<Fault> {
        let mut faults = self.beam().faults();
        if self.tensile_strength.is_none() && self.cohesion.is_none() {
            let help = "add `tensile_strength`, `cohesion`, or both: softening begins there";
            faults.push(Fault::missing("tensile_strength", "the beam has no strength", help));
        }
        if self.mixture_exponent.is_some() && self.shear_fracture_energy.is_none() {
            let help = "add `shear_fracture_energy`, or remove this key";
            faults.push(Fault::conflict("mixture_exponent", "has no effect with one fracture energy", help));
        }
        if self.hydrostatic_strength.is_some() {
            let help = "use \"cohesive_beam\", or remove this key";
            let message = "the failure of particles knows no damage of their beams";
            faults.push(Fault::conflict("hydrostatic_strength", message, help));
        }
        faults
    }

    fn modulus(&self) -> Option<f64> {
        self.beam().modulus()
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        None
    }
}

impl RegisteredLaw for SofteningBeam {
    type Table = SofteningBeamTable;
    type Unbonded = Self;
    const TITLE: &'static str = "softening beam";
    const AS_BOND: Option<&'static str> = Some("Elastic beam between the centers that softens by a fracture energy.");

    fn row(a: &SofteningBeamTable, b: &SofteningBeamTable) -> Result<Self, ParameterError> {
        if a.softening != b.softening {
            return Err(ParameterError::Unlike("the materials have different `softening`; add an [[interface]]"));
        }
        let beam = CohesiveBeam::row(&a.beam(), &b.beam())?;
        let mean = |of: fn(&BeamFractureEnergy) -> f64| 0.5 * (of(&a.energy()) + of(&b.energy()));
        let energy = BeamFractureEnergy {
            tension: mean(|e| e.tension),
            shear: mean(|e| e.shear),
            exponent: mean(|e| e.exponent),
        };
        Self::new(beam, energy, a.softening)
    }

    /// Never called: beams do not act as unbonded contacts.
    fn unbonded_row(a: &SofteningBeamTable, b: &SofteningBeamTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    fn scaled(table: &SofteningBeamTable, factors: &Factors) -> Result<SofteningBeamTable, Fault> {
        // Their own factor; the springs have none.
        let springs = Factors { ductility: Number::new(1.0), ..*factors };
        let CohesiveBeamTable { young, tensile_strength, cohesion, .. } =
            CohesiveBeam::scaled(&table.beam(), &springs)?;
        Ok(SofteningBeamTable {
            young,
            tensile_strength,
            cohesion,
            fracture_energy: times(table.fracture_energy, factors.ductility),
            shear_fracture_energy: table.shear_fracture_energy.map(|energy| times(energy, factors.ductility)),
            ..table.clone()
        })
    }
}
