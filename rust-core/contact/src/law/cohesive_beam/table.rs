//! The cohesive beam in scenarios: its parameter table and the pair coefficients computed from two tables.

use super::{BeamModel, BendingTerm, CohesiveBeam, PairRadius, Section, ShearStrength};
use crate::law::common::mean_strength;
use crate::law::factors::times;
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{Factors, ParameterError};
use crate::quantity::{Angle, Length, Number, Stress};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// The table of a law of beams: the keys of a beam, and more.
macro_rules! beam_table {
    ($(#[$meta:meta])* $name:ident, $title:literal { $($more:tt)* }) => {
        $(#[$meta])*
        #[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
        #[serde(rename = $title, deny_unknown_fields)]
        pub struct $name {
            /// Young's modulus of the beam, Pa.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub young: Stress,
            /// Poisson's ratio of the beam.
            #[serde(default = "crate::law::cohesive_beam::table::beam_poisson")]
            #[schemars(extend("exclusiveMinimum" = -1, "maximum" = 0.5))]
            pub poisson: Number,
            /// Radius of the beam divided by the radius that `radius_rule` names; or give `radius`.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub radius_ratio: Option<Number>,
            /// Radius that `radius_ratio` multiplies; only with `radius_ratio`. Default: the mean over all bonded particles.
            pub radius_rule: Option<RadiusRule>,
            /// Radius of the beam, m; or give `radius_ratio`.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub radius: Option<Length>,
            /// Deformations that the bond resists.
            #[serde(default)]
            pub model: BeamKind,
            /// Shear coefficient of the section; 0.9 if left out; only with model "timoshenko".
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub shear_coefficient: Option<Number>,
            /// Tangential stiffness divided by normal stiffness; only with model "dual-spring".
            #[schemars(extend("minimum" = 0))]
            pub shear_ratio: Option<Number>,
            /// Largest principal stress on the surface of a beam at which it breaks, Pa, with `cohesion` the largest normal stress; unbreakable
            /// if left out. Between two materials: the mean, or the only one given.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub tensile_strength: Option<Stress>,
            /// Bending moment in the stress that `tensile_strength` limits.
            #[serde(default)]
            pub bending_term: BendingTerm,
            /// Shear stress at which a beam without normal force breaks, Pa (Potyondy and Cundall 2004). With this key a beam breaks in tension
            /// or in shear; without it, at its largest principal stress.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub cohesion: Option<Stress>,
            /// Tangent of the angle of friction in the shear strength; or give `friction_angle`; only with `cohesion`. Default: 0.
            #[schemars(extend("minimum" = 0))]
            pub friction_coefficient: Option<Number>,
            /// Angle of friction in the shear strength, rad; only with `cohesion`.
            #[schemars(extend("minimum" = 0))]
            pub friction_angle: Option<Angle>,
            /// Share of bending and twisting moments in the stresses of a beam, from 0 to 1; only with `cohesion`. Default: 1.
            #[schemars(extend("minimum" = 0, "maximum" = 1))]
            pub moment_share: Option<Number>,
            /// Mean stress of a particle at which all its beams break, Pa; no such failure if left out.
            #[schemars(extend("exclusiveMinimum" = 0))]
            pub hydrostatic_strength: Option<Stress>,
            $($more)*
        }
    };
}
pub(crate) use beam_table;

/// The springs of a table with the keys of a beam and more.
macro_rules! springs_of_table {
    ($name:ident) => {
        impl $name {
            /// The springs, and when they break.
            fn beam(&self) -> $crate::law::cohesive_beam::CohesiveBeamTable {
                $crate::law::cohesive_beam::CohesiveBeamTable {
                    young: self.young,
                    poisson: self.poisson,
                    radius_ratio: self.radius_ratio,
                    radius_rule: self.radius_rule,
                    radius: self.radius,
                    model: self.model,
                    shear_coefficient: self.shear_coefficient,
                    shear_ratio: self.shear_ratio,
                    tensile_strength: self.tensile_strength,
                    bending_term: self.bending_term,
                    cohesion: self.cohesion,
                    friction_coefficient: self.friction_coefficient,
                    friction_angle: self.friction_angle,
                    moment_share: self.moment_share,
                    hydrostatic_strength: self.hydrostatic_strength,
                }
            }
        }
    };
}
pub(crate) use springs_of_table;

beam_table! {
    /// Elastic beam between the centers of two particles (Jebahi et al. 2015, section 2.4.1). It breaks at its largest
    /// principal stress, in tension or shear, or at the mean stress of a particle.
    CohesiveBeamTable, "CohesiveBeam" {}
}

/// Models of a cohesive bond.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "BeamModel", rename_all = "kebab-case")]
pub enum BeamKind {
    /// Slender beam.
    #[default]
    EulerBernoulli,
    /// Beam with shear deformation.
    Timoshenko,
    /// Normal and tangential spring.
    DualSpring,
    /// Normal spring only.
    Spring,
}

/// Radius that the ratio of a beam's radius refers to.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum RadiusRule {
    /// Mean over all bonded particles: every beam has the same radius.
    #[default]
    MeanOfAll,
    /// Smaller one of the two particles.
    Smaller,
    /// Mean of the two particles.
    Mean,
    /// Harmonic mean of the two particles, `2 r_A r_B/(r_A + r_B)`.
    HarmonicMean,
}

impl RadiusRule {
    /// A section with this ratio.
    fn section(self, ratio: f64) -> Section {
        let radius = match self {
            Self::MeanOfAll => return Section::Ratio(ratio),
            Self::Smaller => PairRadius::Smaller,
            Self::Mean => PairRadius::Mean,
            Self::HarmonicMean => PairRadius::HarmonicMean,
        };
        Section::RatioOfPair { ratio, radius }
    }
}

pub(crate) fn beam_poisson() -> Number {
    Number::new(0.3)
}

impl CohesiveBeamTable {
    fn shear_strength(&self) -> ShearStrength {
        let friction = match (self.friction_coefficient, self.friction_angle) {
            (Some(coefficient), _) => coefficient.si(),
            (None, angle) => libm::tan(angle.map_or(0.0, Angle::si)),
        };
        ShearStrength {
            cohesion: self.cohesion.map_or(f64::INFINITY, Stress::si),
            friction_coefficient: friction,
            moment_share: self.moment_share.map_or(1.0, Number::si),
        }
    }

    fn faults_of_shear(&self) -> Vec<Fault> {
        let given = [
            ("friction_coefficient", self.friction_coefficient.is_some()),
            ("friction_angle", self.friction_angle.is_some()),
            ("moment_share", self.moment_share.is_some()),
        ];
        let mut faults = Vec::new();
        if self.cohesion.is_none() {
            let help = "add `cohesion`, the shear strength without normal force, or remove this key";
            let alone = given.into_iter().filter(|(_, given)| *given);
            faults.extend(alone.map(|(key, _)| Fault::conflict(key, "has no effect without `cohesion`", help)));
        }
        if self.friction_coefficient.is_some() && self.friction_angle.is_some() {
            let help = "keep one: `friction_coefficient` is the tangent of `friction_angle`";
            faults.push(Fault::conflict("friction_angle", "both `friction_angle` and `friction_coefficient`", help));
        }
        if let Some(angle) = self.friction_angle.filter(|angle| angle.si() >= std::f64::consts::FRAC_PI_2) {
            // An angle with the unit of degrees is at most a few radians.
            let help = if angle.si() > std::f64::consts::PI {
                format!("plain numbers are radians; did you mean \"{} deg\"?", angle.si())
            } else {
                "rock has some \"35 deg\"".to_owned()
            };
            faults.push(Fault::range("friction_angle", "must be less than a right angle", help));
        }
        faults
    }
}

impl LawTable for CohesiveBeamTable {
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let help = "give `radius_ratio` (relative to the mean radius of all bonded particles, or as `radius_rule` says) or `radius`";
        match (self.radius_ratio.is_some(), self.radius.is_some()) {
            (true, true) => faults.push(Fault::conflict("radius", "the radius of the beam is given twice", help)),
            (false, false) => faults.push(Fault::missing("", "the radius of the beam is missing", help)),
            _ => {}
        }
        if self.radius_rule.is_some() && self.radius_ratio.is_none() {
            let help = "give `radius_ratio` in place of `radius`, or remove this key";
            faults.push(Fault::conflict("radius_rule", "has no effect without `radius_ratio`", help));
        }
        if self.shear_coefficient.is_some() && self.model != BeamKind::Timoshenko {
            let help = "write model = \"timoshenko\", or remove this key";
            faults.push(Fault::conflict("shear_coefficient", "has no effect with this model", help));
        }
        if self.shear_ratio.is_some() && self.model != BeamKind::DualSpring {
            let help = "write model = \"dual-spring\", or remove this key";
            faults.push(Fault::conflict("shear_ratio", "has no effect with this model", help));
        }
        if self.shear_ratio.is_none() && self.model == BeamKind::DualSpring {
            let message = "missing key, required by model \"dual-spring\"";
            faults.push(Fault::missing("shear_ratio", message, "add `shear_ratio = 0.4`"));
        }
        faults.extend(self.faults_of_shear());
        faults
    }

    fn modulus(&self) -> Option<f64> {
        Some(self.young.si())
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        self.hydrostatic_strength?;
        let help = "remove the factors, or use `tensile_strength` in place of this key";
        let message = "the failure of particles knows no factors on stiffness and strength";
        Some(Fault::conflict("hydrostatic_strength", message, help))
    }

    fn hydrostatic_strength(&self) -> Option<f64> {
        self.hydrostatic_strength.map(Stress::si)
    }

    fn keys_of_particles(&self) -> Vec<&'static str> {
        self.hydrostatic_strength.iter().map(|_| "hydrostatic_strength").collect()
    }
}

impl RegisteredLaw for CohesiveBeam {
    type Table = CohesiveBeamTable;
    type Unbonded = Self;
    const TITLE: &'static str = "cohesive beam";
    const AS_BOND: Option<&'static str> = Some("Elastic beam between the centers, brittle.");

    fn row(a: &CohesiveBeamTable, b: &CohesiveBeamTable) -> Result<Self, ParameterError> {
        let mean = |of: fn(&CohesiveBeamTable) -> f64| 0.5 * (of(a) + of(b));
        let section = match (a.radius_ratio, b.radius_ratio, a.radius, b.radius) {
            (Some(ratio_a), Some(ratio_b), _, _) => {
                let rule = a.radius_rule.unwrap_or_default();
                if rule != b.radius_rule.unwrap_or_default() {
                    return Err(ParameterError::Unlike(
                        "the materials have different `radius_rule`; give both the same, or an [[interface]]",
                    ));
                }
                rule.section(0.5 * (ratio_a.si() + ratio_b.si()))
            }
            (_, _, Some(a), Some(b)) => Section::Radius(0.5 * (a.si() + b.si())),
            _ => {
                return Err(ParameterError::Unlike(
                    "one material gives `radius_ratio`, the other `radius`; give both the same, or an [[interface]]",
                ));
            }
        };
        if a.model != b.model || a.bending_term != b.bending_term {
            return Err(ParameterError::Unlike(
                "the materials have different `model` or `bending_term`; add an [[interface]]",
            ));
        }
        let model = match a.model {
            BeamKind::EulerBernoulli => BeamModel::EulerBernoulli,
            BeamKind::Timoshenko => {
                BeamModel::Timoshenko { shear_coefficient: mean(|t| t.shear_coefficient.map_or(0.9, Number::si)) }
            }
            BeamKind::DualSpring => BeamModel::DualSpring { ratio: mean(|t| t.shear_ratio.map_or(0.0, Number::si)) },
            BeamKind::Spring => BeamModel::Spring,
        };
        if a.cohesion.is_some() != b.cohesion.is_some() {
            return Err(ParameterError::Unlike(
                "one material has a `cohesion`, the other has none; add an [[interface]]",
            ));
        }
        let shear = ShearStrength {
            cohesion: mean(|t| t.shear_strength().cohesion),
            friction_coefficient: mean(|t| t.shear_strength().friction_coefficient),
            moment_share: mean(|t| t.shear_strength().moment_share),
        };
        let beam = Self {
            young: mean(|t| t.young.si()),
            poisson: mean(|t| t.poisson.si()),
            section,
            model,
            strength: mean_strength(a.tensile_strength.map(Stress::si), b.tensile_strength.map(Stress::si)),
            bending_term: a.bending_term,
            shear,
        };
        beam.validate()?;
        Ok(beam)
    }

    /// Never called: beams do not act as unbonded contacts.
    fn unbonded_row(a: &CohesiveBeamTable, b: &CohesiveBeamTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    fn scaled(table: &CohesiveBeamTable, factors: &Factors) -> Result<CohesiveBeamTable, Fault> {
        factors.refuse_ductility()?;
        let breaks = table.tensile_strength.is_some() || table.cohesion.is_some();
        factors.refuse_strength(breaks, "`tensile_strength` or `cohesion`")?;
        Ok(CohesiveBeamTable {
            young: times(table.young, factors.stiffness),
            tensile_strength: table.tensile_strength.map(|strength| times(strength, factors.strength)),
            cohesion: table.cohesion.map(|cohesion| times(cohesion, factors.strength)),
            ..table.clone()
        })
    }
}
