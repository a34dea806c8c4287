//! Quantities with units: `young = 30e9`, `young = "30 GPa"`.
//!
//! A plain number is in SI units. A string carries a unit, which must have the declared dimension. Powers of ten of the
//! unit are added to the exponent of the number before parsing, so `"50 mm"` is the same real as `0.05`.
//!
//! Existing unit crates either check dimensions only at compile time or include a whole expression parser. A scenario
//! needs only the table below.

use std::fmt;
use std::marker::PhantomData;

use serde::de::{self, Deserialize, Deserializer, Visitor};
use serde::{Serialize, Serializer};

use crate::math::Vec3;

/// What a quantity measures. A law whose parameters have a dimension that is not below implements this trait in its own file:
///
/// ```
/// use concordem_contact::quantity::{Dimension, Quantity};
///
/// /// Energy per area, J/m².
/// #[derive(Debug, Clone, Copy, Default, PartialEq)]
/// pub struct OfSurfaceEnergy;
///
/// impl Dimension for OfSurfaceEnergy {
///     const NAME: &'static str = "surface energy";
///     const UNITS: &'static [&'static str] = &["J/m^2", "mJ/m^2"];
/// }
///
/// assert_eq!(Quantity::<OfSurfaceEnergy>::parse("50 mJ/m^2").unwrap().si(), 0.05);
/// ```
pub trait Dimension: Copy + Default + fmt::Debug + PartialEq + Send + Sync + 'static {
    /// Name, as in messages: "stress".
    const NAME: &'static str;
    /// Units to suggest, the SI unit first; its powers of meter, kilogram, second, radian, and kelvin define the dimension.
    const UNITS: &'static [&'static str];
}

macro_rules! dimensions {
    ($($(#[$meta:meta])* $alias:ident = $marker:ident, $name:literal, [$($unit:literal),+];)*) => {
        /// Markers of the dimensions, see [`Dimension`].
        pub mod dimension {
            $(
                #[doc = concat!("Dimension \"", $name, "\".")]
                #[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
                pub struct $marker;
                impl super::Dimension for $marker {
                    const NAME: &'static str = $name;
                    const UNITS: &'static [&'static str] = &[$($unit),+];
                }
            )*
        }
        $($(#[$meta])* pub type $alias = Quantity<dimension::$marker>;)*
        /// Name and units of every dimension, SI unit first.
        pub const DIMENSIONS: &[(&str, &[&str])] = &[$(($name, &[$($unit),+])),*];
    };
}

dimensions! {
    /// Pure number; a percentage may be written as `"30 %"`.
    Number = Dimensionless, "pure number", ["1", "%"];
    /// Length, m.
    Length = OfLength, "length", ["m", "cm", "mm", "um"];
    /// Area, m².
    Area = OfArea, "area", ["m^2", "cm^2", "mm^2"];
    /// Volume, m³.
    Volume = OfVolume, "volume", ["m^3", "cm^3", "mm^3"];
    /// Time, s.
    Time = OfTime, "time", ["s", "ms", "us", "ns"];
    /// Mass, kg.
    Mass = OfMass, "mass", ["kg", "g", "t"];
    /// Mass density, kg/m³.
    Density = OfDensity, "mass density", ["kg/m^3", "g/cm^3", "t/m^3"];
    /// Moment of inertia, kg·m².
    Inertia = OfInertia, "moment of inertia", ["kg*m^2", "g*mm^2"];
    /// Stress, modulus, or strength, Pa.
    Stress = OfStress, "stress", ["Pa", "kPa", "MPa", "GPa"];
    /// Fracture energy, J/m².
    FractureEnergy = OfFractureEnergy, "fracture energy", ["J/m^2", "mJ/m^2", "N/mm"];
    /// Force, N.
    Force = OfForce, "force", ["N", "mN", "kN", "MN"];
    /// Moment, N·m.
    Moment = OfMoment, "moment", ["N*m", "N*mm", "kN*m"];
    /// Stiffness, N/m.
    Stiffness = OfStiffness, "stiffness", ["N/m", "N/mm", "kN/m"];
    /// Stiffness in bending or twist, N·m/rad.
    RotationalStiffness = OfRotationalStiffness, "rotational stiffness", ["N*m/rad", "N*mm/rad", "kN*m/rad"];
    /// Velocity, m/s.
    Velocity = OfVelocity, "velocity", ["m/s", "mm/s"];
    /// Acceleration, m/s².
    Acceleration = OfAcceleration, "acceleration", ["m/s^2", "mm/s^2"];
    /// Angle, rad.
    Angle = OfAngle, "angle", ["rad", "deg"];
    /// Angular velocity, rad/s.
    AngularVelocity = OfAngularVelocity, "angular velocity", ["rad/s", "deg/s", "rpm"];
    /// Strain rate or velocity gradient, 1/s.
    StrainRate = OfStrainRate, "strain rate", ["1/s", "1/min", "%/s"];
    /// Absolute temperature, K.
    Temperature = OfTemperature, "temperature", ["K"];
    /// Heat capacity per mass, J/(kg·K).
    SpecificHeat = OfSpecificHeat, "specific heat", ["J/kg/K", "kJ/kg/K"];
    /// Thermal conductivity, W/(m·K).
    Conductivity = OfConductivity, "thermal conductivity", ["W/m/K", "kW/m/K"];
    /// Thermal expansion, 1/K.
    Expansion = OfExpansion, "thermal expansion", ["1/K"];
    /// Energy, J.
    Energy = OfEnergy, "energy", ["J", "mJ", "uJ", "kJ"];
    /// Power, W.
    Power = OfPower, "power", ["W", "mW", "kW"];
    /// Power per volume, W/m³.
    PowerDensity = OfPowerDensity, "power per volume", ["W/m^3", "W/cm^3", "W/mm^3"];
    /// Heat flux, W/m².
    HeatFlux = OfHeatFlux, "heat flux", ["W/m^2", "kW/m^2"];
    /// Coefficient of heat transfer, W/(m²·K).
    HeatTransfer = OfHeatTransfer, "heat transfer coefficient", ["W/m^2/K", "kW/m^2/K"];
    /// Thermal resistance of an area, m²·K/W.
    ThermalResistance = OfThermalResistance, "thermal resistance", ["m^2*K/W"];
}

/// A real with a dimension; holds the value in SI units.
#[derive(Clone, Copy, Default, PartialEq)]
pub struct Quantity<D: Dimension> {
    si: f64,
    dimension: PhantomData<D>,
}

impl<D: Dimension> Quantity<D> {
    /// The quantity of this value in SI units.
    pub const fn new(si: f64) -> Self {
        Self { si, dimension: PhantomData }
    }

    /// Value in SI units.
    pub const fn si(self) -> f64 {
        self.si
    }

    /// Read `"30 GPa"`.
    pub fn parse(text: &str) -> Result<Self, QuantityError> {
        parse_quantity(text, D::NAME, D::UNITS).map(Self::new)
    }
}

impl<D: Dimension> From<f64> for Quantity<D> {
    fn from(si: f64) -> Self {
        Self::new(si)
    }
}

impl<D: Dimension> fmt::Debug for Quantity<D> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{self}")
    }
}

impl<D: Dimension> fmt::Display for Quantity<D> {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        // `?` of a real switches to an exponent for very large and very small values.
        write!(formatter, "{:?}", self.si)?;
        if D::UNITS[0] == "1" { Ok(()) } else { write!(formatter, " {}", D::UNITS[0]) }
    }
}

/// A vector of quantities in SI units.
pub fn vector<D: Dimension>(components: &[Quantity<D>; 3]) -> Vec3 {
    Vec3::new(components[0].si, components[1].si, components[2].si)
}

/// A noun with its article: an area, a length.
pub fn with_article(noun: &str) -> String {
    format!("{} {noun}", if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" })
}

/// Why a string is not a quantity of the expected dimension.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum QuantityError {
    /// The string does not begin with a number.
    #[error("`{text}` does not begin with a number")]
    NoNumber {
        /// The string.
        text: String,
    },
    /// The number exceeds the range of double precision.
    #[error("`{text}` is beyond the range of double precision numbers")]
    Overflow {
        /// The string.
        text: String,
    },
    /// A decimal comma.
    #[error("`{text}` has a decimal comma; write a point")]
    Comma {
        /// The string.
        text: String,
    },
    /// A number alone, as a string.
    #[error("`{text}` has no unit, but {} is expected", with_article(dimension))]
    NoUnit {
        /// The string.
        text: String,
        /// Expected dimension.
        dimension: String,
    },
    /// A unit that is not in the table.
    #[error("unknown unit `{unit}`")]
    UnknownUnit {
        /// The symbol.
        unit: String,
    },
    /// A unit of another dimension.
    #[error("`{unit}` is a unit of {found}, but {} is expected", with_article(dimension))]
    WrongDimension {
        /// The unit.
        unit: String,
        /// Dimension of that unit, by name if it has one.
        found: String,
        /// Expected dimension.
        dimension: String,
    },
}

/// Powers of meter, kilogram, second, radian, and kelvin.
type Powers = [i32; 5];

/// A unit: `10^exponent × factor` in SI units of these powers.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Unit {
    exponent: i32,
    factor: f64,
    powers: Powers,
}

const NONE: Unit = Unit { exponent: 0, factor: 1.0, powers: [0; 5] };

/// Symbol, power of ten, other factor, powers of m, kg, s, rad, K, and whether SI prefixes may precede it.
const SYMBOLS: &[(&str, i32, f64, Powers, bool)] = &[
    ("1", 0, 1.0, [0, 0, 0, 0, 0], false),
    ("%", -2, 1.0, [0, 0, 0, 0, 0], false),
    ("m", 0, 1.0, [1, 0, 0, 0, 0], true),
    ("g", -3, 1.0, [0, 1, 0, 0, 0], true),
    ("t", 3, 1.0, [0, 1, 0, 0, 0], false),
    ("s", 0, 1.0, [0, 0, 1, 0, 0], true),
    ("min", 0, 60.0, [0, 0, 1, 0, 0], false),
    ("h", 0, 3600.0, [0, 0, 1, 0, 0], false),
    ("rad", 0, 1.0, [0, 0, 0, 1, 0], true),
    ("deg", 0, std::f64::consts::PI / 180.0, [0, 0, 0, 1, 0], false),
    ("°", 0, std::f64::consts::PI / 180.0, [0, 0, 0, 1, 0], false),
    ("rev", 0, 2.0 * std::f64::consts::PI, [0, 0, 0, 1, 0], false),
    ("rpm", 0, std::f64::consts::PI / 30.0, [0, 0, -1, 1, 0], false),
    ("Hz", 0, 1.0, [0, 0, -1, 0, 0], true),
    ("N", 0, 1.0, [1, 1, -2, 0, 0], true),
    ("Pa", 0, 1.0, [-1, 1, -2, 0, 0], true),
    ("bar", 5, 1.0, [-1, 1, -2, 0, 0], false),
    ("J", 0, 1.0, [2, 1, -2, 0, 0], true),
    ("W", 0, 1.0, [2, 1, -3, 0, 0], true),
    ("K", 0, 1.0, [0, 0, 0, 0, 1], true),
];

const PREFIXES: &[(&str, i32)] = &[
    ("T", 12),
    ("G", 9),
    ("M", 6),
    ("k", 3),
    ("h", 2),
    ("d", -1),
    ("c", -2),
    ("m", -3),
    ("u", -6),
    ("µ", -6), // micro sign
    ("μ", -6), // Greek mu
    ("n", -9),
    ("p", -12),
];

fn symbol(text: &str) -> Option<Unit> {
    let of = |name: &str, prefixed: bool| {
        SYMBOLS
            .iter()
            .find(|entry| entry.0 == name && (!prefixed || entry.4))
            .map(|&(_, exponent, factor, powers, _)| Unit { exponent, factor, powers })
    };
    of(text, false).or_else(|| {
        PREFIXES.iter().find_map(|&(prefix, exponent)| {
            let unit = of(text.strip_prefix(prefix)?, true)?;
            Some(Unit { exponent: unit.exponent + exponent, ..unit })
        })
    })
}

/// Read a product of powers of units: `kg/m^3`, `N·s/m`, `1/s`. A slash divides by the one factor that follows it.
fn parse_unit(text: &str) -> Result<Unit, QuantityError> {
    let unknown = |unit: &str| QuantityError::UnknownUnit { unit: unit.to_owned() };
    let text = text.trim();
    let mut unit = NONE;
    let mut rest = text;
    let mut sign = 1;
    loop {
        let end = rest.find(['*', '/', '·', ' ']).unwrap_or(rest.len());
        let factor = &rest[..end];
        let power_start = factor
            .char_indices()
            .find(|&(at, c)| {
                at > 0 && (c == '^' || c == '-' || c == '²' || c == '³' || c == '⁻' || c == '¹' || c.is_ascii_digit())
            })
            .map_or(factor.len(), |(at, _)| at);
        let power_text: String = factor[power_start..]
            .chars()
            .filter(|&c| c != '^')
            .map(|c| match c {
                '²' => '2',
                '³' => '3',
                '¹' => '1',
                '⁻' => '-',
                other => other,
            })
            .collect();
        let power: i32 = if factor.len() == power_start {
            1
        } else {
            power_text.parse().ok().filter(|p: &i32| (-9..=9).contains(p) && *p != 0).ok_or_else(|| unknown(factor))?
        };
        let base =
            symbol(&factor[..power_start]).ok_or_else(|| unknown(if factor.is_empty() { text } else { factor }))?;
        let power = sign * power;
        unit.exponent += base.exponent * power;
        if base.factor != 1.0 {
            unit.factor *= base.factor.powi(power);
        }
        for (total, one) in unit.powers.iter_mut().zip(base.powers) {
            *total += one * power;
        }
        let Some(separator) = rest[end..].chars().next() else { return Ok(unit) };
        sign = if separator == '/' { -1 } else { 1 };
        rest = rest[end + separator.len_utf8()..].trim_start();
        if separator == ' ' {
            // "N / m" and "N * m": the blank belongs to the operator that follows.
            if let Some(after) = rest.strip_prefix(['*', '/', '·']) {
                sign = if rest.starts_with('/') { -1 } else { 1 };
                rest = after.trim_start();
            }
        }
    }
}

fn dimension_of(powers: Powers) -> String {
    DIMENSIONS
        .iter()
        .find(|(_, units)| parse_unit(units[0]).is_ok_and(|unit| unit.powers == powers))
        .map_or_else(|| "another dimension".to_owned(), |(name, _)| (*name).to_owned())
}

/// Read a string with a unit of the dimension whose SI unit is `units[0]`; the value in SI units.
pub fn parse_quantity(text: &str, dimension: &str, units: &[&str]) -> Result<f64, QuantityError> {
    let trimmed = text.trim();
    let (mantissa, exponent, unit_text) =
        split_number(trimmed).ok_or_else(|| QuantityError::NoNumber { text: text.to_owned() })?;
    if unit_text.starts_with(',') {
        return Err(QuantityError::Comma { text: text.to_owned() });
    }
    let wanted = parse_unit(units[0])?.powers;
    let unit = if unit_text.is_empty() {
        if wanted != NONE.powers {
            return Err(QuantityError::NoUnit { text: text.to_owned(), dimension: dimension.to_owned() });
        }
        NONE
    } else {
        parse_unit(unit_text)?
    };
    if unit.powers != wanted {
        return Err(QuantityError::WrongDimension {
            unit: unit_text.to_owned(),
            found: dimension_of(unit.powers),
            dimension: dimension.to_owned(),
        });
    }
    let overflow = || QuantityError::Overflow { text: text.to_owned() };
    let total = exponent.checked_add(i64::from(unit.exponent)).ok_or_else(overflow)?;
    let value: f64 = format!("{mantissa}e{total}").parse().map_err(|_| overflow())?;
    let value = value * unit.factor;
    if value.is_finite() { Ok(value) } else { Err(overflow()) }
}

/// Split `-1.5e3 GPa` into mantissa, exponent, and unit.
fn split_number(text: &str) -> Option<(String, i64, &str)> {
    let bytes = text.as_bytes();
    let mut at = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let digits = |mut at: usize| {
        while at < bytes.len() && (bytes[at].is_ascii_digit() || bytes[at] == b'_') {
            at += 1;
        }
        at
    };
    let start = at;
    at = digits(at);
    if bytes.get(at) == Some(&b'.') {
        at = digits(at + 1);
    }
    if !bytes[start..at].iter().any(u8::is_ascii_digit) {
        return None;
    }
    let mantissa: String = text[..at].chars().filter(|&c| c != '_').collect();
    let mut exponent = 0;
    if matches!(bytes.get(at), Some(b'e' | b'E')) {
        let signed = at + 1 + usize::from(matches!(bytes.get(at + 1), Some(b'+' | b'-')));
        let end = digits(signed);
        if end > signed {
            exponent = text[at + 1..end].parse().ok()?;
            at = end;
        }
    }
    Some((mantissa, exponent, text[at..].trim_start()))
}

impl<D: Dimension> Serialize for Quantity<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_f64(self.si)
    }
}

impl<'de, D: Dimension> Deserialize<'de> for Quantity<D> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        struct QuantityVisitor<D>(PhantomData<D>);
        impl<D: Dimension> Visitor<'_> for QuantityVisitor<D> {
            type Value = Quantity<D>;
            fn expecting(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
                write!(formatter, "{} as a number in {} or a string with a unit", with_article(D::NAME), D::UNITS[0])
            }
            fn visit_f64<E: de::Error>(self, value: f64) -> Result<Self::Value, E> {
                if value.is_finite() {
                    Ok(Quantity::new(value))
                } else {
                    Err(E::custom(format!("{value} is not a finite number")))
                }
            }
            fn visit_i64<E: de::Error>(self, value: i64) -> Result<Self::Value, E> {
                Ok(Quantity::new(value as f64))
            }
            fn visit_u64<E: de::Error>(self, value: u64) -> Result<Self::Value, E> {
                Ok(Quantity::new(value as f64))
            }
            fn visit_str<E: de::Error>(self, value: &str) -> Result<Self::Value, E> {
                Quantity::parse(value).map_err(E::custom)
            }
        }
        deserializer.deserialize_any(QuantityVisitor(PhantomData))
    }
}

impl<D: Dimension> schemars::JsonSchema for Quantity<D> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        D::NAME.into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": ["number", "string"], "x-dimension": D::NAME, "x-units": D::UNITS })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn powers_of_ten_are_exact() {
        // The same bits as the plain number, because the exponent is added before parsing.
        assert_eq!(Length::parse("50 mm").unwrap().si(), 0.05);
        assert_eq!(Stress::parse("30 GPa").unwrap().si(), 30e9);
        assert_eq!(Time::parse("0.2 us").unwrap().si(), 2e-7);
        assert_eq!(Time::parse("0.2 µs").unwrap().si(), 2e-7);
        assert_eq!(Density::parse("4.8 g/cm^3").unwrap().si(), 4800.0);
        assert_eq!(Density::parse("4800kg/m³").unwrap().si(), 4800.0);
        assert_eq!(StrainRate::parse("-3 1/s").unwrap().si(), -3.0);
        assert_eq!(StrainRate::parse("0.4 s^-1").unwrap().si(), 0.4);
        assert_eq!(StrainRate::parse("0.4 s⁻¹").unwrap().si(), 0.4);
        assert_eq!(Number::parse("30 %").unwrap().si(), 0.3);
        assert_eq!(Stiffness::parse("1.5e2 N / mm").unwrap().si(), 1.5e5);
        assert_eq!(Inertia::parse("2 kg m^2").unwrap().si(), 2.0);
        assert_eq!(Mass::parse("1_000 g").unwrap().si(), 1.0);
        assert_eq!(SpecificHeat::parse("0.88 kJ/kg/K").unwrap().si(), 880.0);
        assert_eq!(HeatTransfer::parse("2 kW m^-2 K^-1").unwrap().si(), 2000.0);
    }

    #[test]
    fn other_factors() {
        assert_eq!(Angle::parse("180 deg").unwrap().si(), std::f64::consts::PI);
        assert_eq!(AngularVelocity::parse("30 rpm").unwrap().si(), std::f64::consts::PI);
        assert_eq!(Time::parse("2 min").unwrap().si(), 120.0);
    }

    #[test]
    fn invalid_quantities_are_refused() {
        assert_eq!(
            Stress::parse("30 mm"),
            Err(QuantityError::WrongDimension {
                unit: "mm".into(),
                found: "length".into(),
                dimension: "stress".into()
            })
        );
        assert!(matches!(Stress::parse("30"), Err(QuantityError::NoUnit { .. })));
        assert!(matches!(Stress::parse("30 GPas"), Err(QuantityError::UnknownUnit { .. })));
        assert!(matches!(Stress::parse("30 GPa/"), Err(QuantityError::UnknownUnit { .. })));
        assert!(matches!(Stress::parse("30 m^99"), Err(QuantityError::UnknownUnit { .. })));
        assert!(matches!(Stress::parse("GPa"), Err(QuantityError::NoNumber { .. })));
        assert!(matches!(Stress::parse(""), Err(QuantityError::NoNumber { .. })));
        assert!(matches!(Stress::parse("nan Pa"), Err(QuantityError::NoNumber { .. })));
        assert!(matches!(Stress::parse("1,5 GPa"), Err(QuantityError::Comma { .. })));
        assert!(matches!(Stress::parse("1e308 GPa"), Err(QuantityError::Overflow { .. })));
        assert!(matches!(Stress::parse("1e99999999999999999999 Pa"), Err(QuantityError::NoNumber { .. })));
        // An angle is not a pure number: "30 deg" for a friction coefficient is an error.
        assert!(matches!(Number::parse("30 deg"), Err(QuantityError::WrongDimension { .. })));
        assert!(matches!(AngularVelocity::parse("3 1/s"), Err(QuantityError::WrongDimension { .. })));
    }

    #[test]
    fn every_suggested_unit_is_of_its_dimension() {
        for (name, units) in DIMENSIONS {
            for unit in *units {
                assert!(parse_quantity(&format!("1 {unit}"), name, units).is_ok(), "{name}: {unit}");
            }
        }
    }
}
