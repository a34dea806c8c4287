//! The concrete particle model in scenarios: its parameter table and the pair coefficients computed from two tables.

use super::{Cpm, CpmError, CpmFormulation, CpmParameters, DamageLaw, YieldSurface};
use crate::law::factors::times;
use crate::law::table::{Fault, LawTable, RegisteredLaw};
use crate::law::{ContactLaw, Factors, ParameterError};
use crate::math;
use crate::quantity::{Angle, FractureEnergy, Number, Stress, Time};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Concrete particle model (Šmilauer 2010; Stránský 2018, section 2.5).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename = "Cpm", deny_unknown_fields)]
pub struct CpmTable {
    /// Normal modulus of a bond, Pa.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub young: Stress,
    /// Shear modulus of a bond divided by its normal modulus.
    #[schemars(extend("minimum" = 0))]
    pub shear_ratio: Number,
    /// Tensile strain at which damage begins.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub crack_onset_strain: Number,
    /// Softening strain divided by the crack onset strain; or give `fracture_energy`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub relative_ductility: Option<Number>,
    /// Energy per area that a bond in tension dissipates, whatever its length, J/m^2; or give `relative_ductility`. Only in mode `thesis`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub fracture_energy: Option<FractureEnergy>,
    /// Cohesion of the undamaged bond: shear strength without normal stress, Pa.
    #[schemars(extend("minimum" = 0))]
    pub cohesion: Stress,
    /// Angle of friction; or give `friction_coefficient`.
    #[schemars(extend("minimum" = 0))]
    pub friction_angle: Option<Angle>,
    /// Tangent of the angle of friction; or give `friction_angle`.
    #[schemars(extend("minimum" = 0))]
    pub friction_coefficient: Option<Number>,
    /// Published form of the model.
    #[serde(default)]
    pub mode: CpmFormulation,
    /// Form of the softening branch.
    #[serde(default)]
    pub damage_law: DamageLaw,
    /// Damage above which a bond in tension is deleted; 1 keeps all.
    #[serde(default = "one")]
    #[schemars(extend("exclusiveMinimum" = 0, "maximum" = 1))]
    pub omega_threshold: Number,
    /// Keep bonds undamaged at any strain.
    #[serde(default)]
    pub never_damage: bool,
    /// Normal strain (negative) beyond which compression hardens plastically; elastic if left out.
    #[schemars(extend("exclusiveMaximum" = 0))]
    pub soft_strain: Option<Number>,
    /// Hardening modulus beyond `soft_strain`, divided by the normal modulus.
    #[schemars(extend("minimum" = 0, "maximum" = 1))]
    pub relative_soft_stiffness: Option<Number>,
    /// Confinement added to the normal stress of every bond, Pa.
    #[serde(default)]
    pub isotropic_prestress: Stress,
    /// Weight of the shear strain in the equivalent strain that drives damage; not in mode `woo`.
    #[serde(default)]
    #[schemars(extend("minimum" = 0))]
    pub shear_contribution: Number,
    /// Yield surface of the shear stress; not in mode `yade-public`.
    pub yield_surface: Option<YieldSurface>,
    /// Speed of the logarithmic yield surface; not in mode `yade-public`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub yield_log_speed: Option<Number>,
    /// Characteristic time of viscous damage, s; rate independent if left out; not in mode `yade-public`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub damage_time: Option<Time>,
    /// Exponent of viscous damage; not in mode `yade-public`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub damage_rate_exponent: Option<Number>,
    /// Characteristic time of viscous plasticity, s; rate independent if left out; not in mode `yade-public`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub plasticity_time: Option<Time>,
    /// Exponent of viscous plasticity; not in mode `yade-public`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub plasticity_rate_exponent: Option<Number>,
}

fn one() -> Number {
    Number::new(1.0)
}

impl CpmTable {
    /// Friction coefficient of a bond within this material; 0 if the table gives neither form (such a scenario fails the checks).
    ///
    /// YADE's form has that of YADE, whose materials have an angle: its tangent can differ from the coefficient in the last digit.
    pub fn friction(&self) -> f64 {
        match (self.mode, self.friction_coefficient) {
            (CpmFormulation::YadePublic, _) => self.angle_in_yade().tan(),
            (_, Some(coefficient)) => coefficient.si(),
            (_, None) => libm::tan(self.friction_angle.map_or(0.0, Angle::si)),
        }
    }

    /// Angle of friction of this material in YADE, rad.
    fn angle_in_yade(&self) -> f64 {
        let coefficient = self.friction_coefficient.map_or(0.0, Number::si);
        self.friction_angle.map_or_else(|| math::atan2(coefficient, 1.0), Angle::si)
    }

    /// Parameters of a bond within this material.
    fn parameters(&self) -> CpmParameters {
        let or = |value: Option<Number>, default: f64| value.map_or(default, Number::si);
        let time = |value: Option<Time>| value.map_or(0.0, Time::si);
        CpmParameters {
            mode: self.mode,
            damage_law: self.damage_law,
            omega_threshold: self.omega_threshold.si(),
            never_damage: self.never_damage,
            shear_contribution: self.shear_contribution.si(),
            soft_strain: or(self.soft_strain, 0.0),
            relative_soft_stiffness: or(self.relative_soft_stiffness, 0.0),
            isotropic_prestress: self.isotropic_prestress.si(),
            yield_surface: self.yield_surface.unwrap_or_default(),
            yield_log_speed: or(self.yield_log_speed, 0.1),
            damage_time: time(self.damage_time),
            damage_rate_exponent: or(self.damage_rate_exponent, 1.0),
            plasticity_time: time(self.plasticity_time),
            plasticity_rate_exponent: or(self.plasticity_rate_exponent, 1.0),
            fracture_energy: self.fracture_energy.map_or(0.0, FractureEnergy::si),
            ..CpmParameters::new(
                self.young.si(),
                self.shear_ratio.si(),
                self.cohesion.si(),
                self.friction(),
                self.crack_onset_strain.si(),
                or(self.relative_ductility, 0.0),
            )
        }
    }

    /// The fault of the friction keys: given exactly once, and less than a right angle.
    fn faults_of_friction(&self) -> Option<Fault> {
        match (self.friction_coefficient, self.friction_angle) {
            (None, None) => Some(Fault::missing(
                "friction_angle",
                "neither `friction_angle` nor `friction_coefficient`",
                "add `friction_coefficient = 0.8` (the tangent), or `friction_angle = \"38 deg\"`",
            )),
            (Some(_), Some(_)) => Some(Fault::conflict(
                "friction_angle",
                "both `friction_angle` and `friction_coefficient`",
                "keep one: `friction_coefficient` is the tangent of `friction_angle`",
            )),
            (None, Some(angle)) if angle.si() >= std::f64::consts::FRAC_PI_2 => {
                let help = format!("plain numbers are radians; did you mean \"{} deg\"?", angle.si());
                Some(Fault::range("friction_angle", "must be less than a right angle", help))
            }
            _ => None,
        }
    }

    /// The fault of the softening keys: given exactly once.
    fn faults_of_softening(&self) -> Option<Fault> {
        match (self.relative_ductility, self.fracture_energy) {
            (None, None) => Some(Fault::missing(
                "relative_ductility",
                "neither `relative_ductility` nor `fracture_energy`",
                "add `relative_ductility = 30`, or `fracture_energy = \"60 J/m^2\"`, which does not depend on the size of the particles",
            )),
            (Some(_), Some(_)) => Some(Fault::conflict(
                "relative_ductility",
                "both `relative_ductility` and `fracture_energy`",
                "keep one: bonds get their ductility from the fracture energy and their length",
            )),
            (None, Some(_)) if self.mode != CpmFormulation::Thesis => Some(Fault::conflict(
                "fracture_energy",
                "the published form of this mode has no fracture energy",
                "write mode = \"thesis\", or `relative_ductility` in its place",
            )),
            (Some(ductility), None) if self.damage_law == DamageLaw::Linear && ductility.si() <= 1.0 => {
                let help = "it is the strain at zero stress divided by the strain at peak stress";
                let message = "must be greater than 1 with the linear damage law";
                Some(Fault::range("relative_ductility", message, help))
            }
            _ => None,
        }
    }

    /// Faults of keys that have no effect in the chosen mode.
    fn faults_of_mode(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        let damage = (
            ("damage_time", self.damage_time.is_some()),
            ("damage_rate_exponent", self.damage_rate_exponent.is_some()),
        );
        let plasticity = (
            ("plasticity_time", self.plasticity_time.is_some()),
            ("plasticity_rate_exponent", self.plasticity_rate_exponent.is_some()),
        );
        let yade = self.mode == CpmFormulation::YadePublic;
        let logarithmic =
            matches!(self.yield_surface, Some(YieldSurface::Logarithmic | YieldSurface::LogarithmicLinear));
        if yade {
            let refused = [
                ("yield_surface", self.yield_surface.is_some_and(|surface| surface != YieldSurface::MohrCoulomb)),
                ("yield_log_speed", self.yield_log_speed.is_some()),
                damage.0,
                damage.1,
                plasticity.0,
                plasticity.1,
            ];
            for (key, _) in refused.into_iter().filter(|(_, given)| *given) {
                let help = "write mode = \"thesis\" or \"woo\", which have it, or remove this key";
                faults.push(Fault::conflict(key, "has no effect in mode \"yade-public\"", help));
            }
            return faults;
        }
        for ((time, has_time), (exponent, has_exponent)) in [damage, plasticity] {
            if has_time != has_exponent {
                let (there, missing) = if has_time { (time, exponent) } else { (exponent, time) };
                let help = format!("add `{missing} = ...`, or remove `{there}`");
                faults.push(Fault::conflict(there, format!("`{there}` requires `{missing}`"), help));
            }
        }
        if logarithmic && self.yield_log_speed.is_none() {
            let message = "missing key, required by a logarithmic yield surface";
            faults.push(Fault::missing("yield_log_speed", message, "add `yield_log_speed = 0.1`"));
        }
        if !logarithmic && self.yield_log_speed.is_some() {
            let help = "write yield_surface = \"logarithmic\" or \"logarithmic-linear\", or remove this key";
            faults.push(Fault::conflict("yield_log_speed", "has no effect with this yield surface", help));
        }
        if self.mode == CpmFormulation::Woo && self.shear_contribution.si() != 0.0 {
            let help = "write mode = \"thesis\", or remove this key";
            faults.push(Fault::conflict("shear_contribution", "has no effect in mode \"woo\"", help));
        }
        faults
    }
}

impl LawTable for CpmTable {
    fn faults(&self) -> Vec<Fault> {
        let mut faults: Vec<Fault> = self.faults_of_friction().into_iter().chain(self.faults_of_softening()).collect();
        if self.relative_soft_stiffness.is_some() && self.soft_strain.is_none() {
            let help = "add `soft_strain = -3e-3`, the strain at which hardening begins, or remove it";
            faults.push(Fault::conflict("relative_soft_stiffness", "has no effect without `soft_strain`", help));
        }
        if self.relative_soft_stiffness.is_none() && self.soft_strain.is_some() {
            let help = "add `relative_soft_stiffness = 0.3`, the hardening modulus divided by the normal modulus";
            let message = "missing key, required by `soft_strain`";
            faults.push(Fault::missing("relative_soft_stiffness", message, help));
        }
        if self.never_damage && self.omega_threshold.si() != 1.0 {
            let help = "bonds without damage do not break: remove one of the two keys";
            faults.push(Fault::conflict("omega_threshold", "has no effect with `never_damage`", help));
        }
        faults.extend(self.faults_of_mode());
        faults
    }

    fn fault_of_variation(&self) -> Option<Fault> {
        let help = "remove the factors of stiffness and strength from `thermal.variation`, or this key";
        let refused = [
            ("mode", self.mode != CpmFormulation::Thesis),
            ("isotropic_prestress", self.isotropic_prestress.si() != 0.0),
            ("damage_time", self.damage_time.is_some()),
        ];
        let (key, _) = refused.into_iter().find(|(_, given)| *given)?;
        Some(Fault::conflict(key, "not with constants that depend on the temperature", help))
    }

    fn uniform_key(&self) -> Option<(&'static str, String)> {
        Some(("mode", format!("{:?}", self.mode)))
    }

    fn modulus(&self) -> Option<f64> {
        Some(self.young.si())
    }
}

impl From<CpmError> for ParameterError {
    fn from(error: CpmError) -> Self {
        match error {
            CpmError::OutOfRange { name, value, requirement } => {
                Self::OutOfRange { law: Cpm::NAME, parameter: name, value, requirement }
            }
            CpmError::NotInYade { .. } | CpmError::OnlyInThesis | CpmError::SoftensTwice | CpmError::Unlike { .. } => {
                Self::Cpm(error)
            }
        }
    }
}

impl RegisteredLaw for Cpm {
    type Table = CpmTable;
    type Unbonded = Self;
    const TITLE: &'static str = "concrete particle model";
    const AS_BOND: Option<&'static str> = Some("Concrete particle model: cohesion, damage, plastic slip.");
    const AS_CONTACT: Option<&'static str> = Some("Concrete particle model without cohesion.");

    fn row(a: &CpmTable, b: &CpmTable) -> Result<Self, ParameterError> {
        let (first, second) = (a.parameters(), b.parameters());
        // Averaging equal parameters could round, so they are used unchanged.
        let mut mean = if first == second { first } else { first.average(&second)? };
        if mean.mode == CpmFormulation::YadePublic {
            // The mean of the angles as they are given; those of the tangents could differ in the last digit.
            mean.friction_coefficient = (0.5 * (a.angle_in_yade() + b.angle_in_yade())).tan();
        }
        Ok(Self::new(&mean)?)
    }

    fn unbonded_row(a: &CpmTable, b: &CpmTable) -> Result<Self, ParameterError> {
        Self::row(a, b)
    }

    /// Stránský 2018, section 8.1: the stress at which damage begins is that of the strength, so the crack onset strain has the
    /// factor strength/stiffness. The factor of the ductility acts on the fracture energy where that is given; the other two do not.
    fn scaled(table: &CpmTable, factors: &Factors) -> Result<CpmTable, Fault> {
        let Factors { stiffness, strength, ductility } = *factors;
        let scaled = CpmTable {
            young: times(table.young, stiffness),
            cohesion: times(table.cohesion, strength),
            crack_onset_strain: times(table.crack_onset_strain, Number::new(strength.si() / stiffness.si())),
            relative_ductility: table.relative_ductility.map(|value| times(value, ductility)),
            fracture_energy: table.fracture_energy.map(|value| times(value, ductility)),
            ..table.clone()
        };
        if let (DamageLaw::Linear, Some(ductility)) = (scaled.damage_law, scaled.relative_ductility)
            && ductility.si() <= 1.0
        {
            let message = format!(
                "makes the relative ductility {}, but with the linear damage law it must be greater than 1",
                ductility.si()
            );
            return Err(Fault::range("ductility", message, "give a larger factor, or an exponential damage law"));
        }
        Ok(scaled)
    }
}

#[cfg(test)]
mod tests {
    use super::super::friction_of_yade;
    use super::*;

    fn concrete() -> CpmTable {
        CpmTable {
            young: Stress::new(25e9),
            shear_ratio: Number::new(0.2),
            crack_onset_strain: Number::new(1e-4),
            relative_ductility: Some(Number::new(30.0)),
            fracture_energy: None,
            cohesion: Stress::new(3e6),
            friction_angle: None,
            friction_coefficient: Some(Number::new(0.8)),
            mode: CpmFormulation::default(),
            damage_law: DamageLaw::default(),
            omega_threshold: one(),
            never_damage: false,
            soft_strain: None,
            relative_soft_stiffness: None,
            isotropic_prestress: Stress::new(0.0),
            shear_contribution: Number::new(0.0),
            yield_surface: None,
            yield_log_speed: None,
            damage_time: None,
            damage_rate_exponent: None,
            plasticity_time: None,
            plasticity_rate_exponent: None,
        }
    }

    /// The fields of the law have the names of the keys, which errors give.
    #[test]
    fn errors_name_the_keys_of_the_table() {
        let error = |change: fn(&mut CpmTable)| {
            let mut table = concrete();
            change(&mut table);
            Cpm::row(&table, &table).map_err(|error| error.to_string())
        };
        assert!(error(|_| ()).is_ok());
        let message = error(|t| t.crack_onset_strain = Number::new(-1.0)).unwrap_err();
        assert_eq!(message, "law cpm: crack_onset_strain = -1 must be positive");
        let message = error(|t| t.young = Stress::new(0.0)).unwrap_err();
        assert_eq!(message, "law cpm: young = 0 must be positive");
    }

    /// The bits of the friction coefficient between two materials.
    fn friction(a: &CpmTable, b: &CpmTable) -> u64 {
        let [bond, contact] = [Cpm::row(a, b), Cpm::unbonded_row(a, b)].map(Result::unwrap);
        assert_eq!(bond, contact);
        bond.parameters().friction_coefficient.to_bits()
    }

    /// A coefficient arrives in the law as it is written, also between materials that differ otherwise; an angle as its tangent.
    #[test]
    fn friction_arrives_in_the_law_as_it_is_written() {
        for mode in [CpmFormulation::Thesis, CpmFormulation::Woo] {
            for coefficient in [0.8, 0.1, 0.3, 0.7, 1.3] {
                let one = CpmTable { mode, friction_coefficient: Some(Number::new(coefficient)), ..concrete() };
                let other = CpmTable { young: Stress::new(50e9), ..one.clone() };
                assert_eq!(friction(&one, &one), coefficient.to_bits());
                assert_eq!(friction(&one, &other), coefficient.to_bits());
            }
            let angle = |radians| CpmTable {
                mode,
                friction_coefficient: None,
                friction_angle: Some(Angle::new(radians)),
                ..concrete()
            };
            assert_eq!(friction(&angle(0.6), &angle(0.6)), libm::tan(0.6).to_bits());
            assert_eq!(angle(0.6).friction().to_bits(), libm::tan(0.6).to_bits());
        }
    }

    /// Unlike materials: the tangent of the mean angle, in Woo's form the mean of the tangents, and in YADE's the bits of YADE.
    #[test]
    fn friction_between_unlike_materials() {
        let of =
            |mode, coefficient| CpmTable { mode, friction_coefficient: Some(Number::new(coefficient)), ..concrete() };
        let between = |mode, a, b| f64::from_bits(friction(&of(mode, a), &of(mode, b)));
        // tan ½(α + β) = (sin α + sin β)/(cos α + cos β), here with the angles of the triangles (3, 4, 5) and (5, 12, 13).
        let exact = (3.0 / 5.0 + 5.0 / 13.0) / (4.0 / 5.0 + 12.0 / 13.0);
        let thesis = between(CpmFormulation::Thesis, 3.0 / 4.0, 5.0 / 12.0);
        // Two arcs and a tangent: a few roundings.
        assert!((thesis / exact - 1.0).abs() < 1e-15, "{thesis:e} {exact:e}");
        assert_eq!(between(CpmFormulation::Woo, 0.75, 0.25).to_bits(), 0.5_f64.to_bits());

        let angle = |radians| CpmTable {
            friction_angle: Some(Angle::new(radians)),
            friction_coefficient: None,
            ..of(CpmFormulation::YadePublic, 0.0)
        };
        for (one, two) in [(0.67, 0.4), (0.6, 0.6), (0.31, 1.2), (0.123, 0.456), (0.05, 0.7)] {
            let (one, two): (f64, f64) = (one, two);
            assert_eq!(friction(&angle(one), &angle(two)), (0.5 * (one + two)).tan().to_bits(), "{one} {two}");
            assert_eq!(friction(&angle(one), &angle(one)), friction_of_yade(one).unwrap().to_bits());
        }
        // A script of YADE writes `frictionAngle = atan(0.8)`.
        let written = of(CpmFormulation::YadePublic, 0.8);
        assert_eq!(friction(&written, &written), math::atan2(0.8, 1.0).tan().to_bits());
        let error = friction_of_yade(1.6).unwrap_err().to_string();
        assert_eq!(error, "CPM parameter `friction_angle` is 1.6, but must be an angle from 0 to below π/2 rad");
    }
}
