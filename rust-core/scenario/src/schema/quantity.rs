//! Quantities that may be given as a word: a free component, an automatic time step, a measured cross-section.

use concordem_contact::law::Fault;
use serde::de::{self, Deserialize, Deserializer};
use serde::{Serialize, Serializer};

pub use concordem_contact::quantity::*;

/// A component of a prescribed motion: a quantity, or free.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum Component<D: Dimension> {
    /// Not prescribed; written `"free"`.
    #[default]
    Free,
    /// Prescribed.
    Value(Quantity<D>),
}

impl<D: Dimension> Component<D> {
    /// The prescribed value in SI units.
    pub fn si(self) -> Option<f64> {
        match self {
            Self::Free => None,
            Self::Value(value) => Some(value.si()),
        }
    }
}

impl<D: Dimension> Serialize for Component<D> {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Free => serializer.serialize_str("free"),
            Self::Value(value) => value.serialize(serializer),
        }
    }
}

/// A quantity, or a word in its place.
#[derive(serde::Deserialize)]
#[serde(untagged)]
enum WordOr<Q> {
    Quantity(Q),
    Word(String),
}

impl<'de, D: Dimension> Deserialize<'de> for Component<D> {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        match WordOr::<Quantity<D>>::deserialize(deserializer)? {
            WordOr::Quantity(value) => Ok(Self::Value(value)),
            WordOr::Word(word) if word == "free" => Ok(Self::Free),
            WordOr::Word(word) => {
                Err(de::Error::custom(format!("`{word}` is neither \"free\" nor {}", with_article(D::NAME))))
            }
        }
    }
}

impl<D: Dimension> schemars::JsonSchema for Component<D> {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        format!("free or {}", D::NAME).into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": ["number", "string"], "x-dimension": D::NAME, "x-units": D::UNITS, "x-words": ["free"]
        })
    }
}

/// The time step: a time, or `"auto"` for the tightest stability bound times the safety factor.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum TimeStep {
    /// From the stability bound.
    #[default]
    Auto,
    /// Given.
    Given(Time),
}

impl Serialize for TimeStep {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Auto => serializer.serialize_str("auto"),
            Self::Given(value) => value.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for TimeStep {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        match WordOr::<Time>::deserialize(deserializer)? {
            WordOr::Quantity(value) => Ok(Self::Given(value)),
            WordOr::Word(word) if word == "auto" => Ok(Self::Auto),
            WordOr::Word(word) => Err(de::Error::custom(format!("`{word}` is neither \"auto\" nor a time"))),
        }
    }
}

impl schemars::JsonSchema for TimeStep {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "TimeStep".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": ["number", "string"], "x-dimension": dimension::OfTime::NAME, "x-units": dimension::OfTime::UNITS,
            "x-words": ["auto"]
        })
    }
}

/// The cross-section of a specimen: an area, `"hull"` to measure it on the spheres, or `"splitting"`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum CrossSection {
    /// The smallest of eight sections; the area of a section is that of the convex hull of the spheres that its plane cuts.
    Hull,
    /// `π D L/2` of a cylinder that plates split along its length: the stress is then the tension `2P/(π D L)` in its middle.
    Splitting,
    /// Given.
    Given(Area),
}

impl Serialize for CrossSection {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Self::Hull => serializer.serialize_str("hull"),
            Self::Splitting => serializer.serialize_str("splitting"),
            Self::Given(value) => value.serialize(serializer),
        }
    }
}

impl<'de> Deserialize<'de> for CrossSection {
    fn deserialize<S: Deserializer<'de>>(deserializer: S) -> Result<Self, S::Error> {
        match WordOr::<Area>::deserialize(deserializer)? {
            WordOr::Quantity(value) => Ok(Self::Given(value)),
            WordOr::Word(word) if word == "hull" => Ok(Self::Hull),
            WordOr::Word(word) if word == "splitting" => Ok(Self::Splitting),
            WordOr::Word(word) => {
                Err(de::Error::custom(format!("`{word}` is neither \"hull\", nor \"splitting\", nor an area")))
            }
        }
    }
}

impl schemars::JsonSchema for CrossSection {
    fn inline_schema() -> bool {
        true
    }
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "CrossSection".into()
    }
    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({
            "type": ["number", "string"], "x-dimension": dimension::OfArea::NAME, "x-units": dimension::OfArea::UNITS,
            "x-words": ["hull", "splitting"]
        })
    }
}

/// Faults of two corners that do not span a box: `minimum` must be below `maximum`.
pub(crate) fn corner_faults(minimum: &[Length; 3], maximum: &[Length; 3]) -> Vec<Fault> {
    let keys = [("minimum[0]", "x"), ("minimum[1]", "y"), ("minimum[2]", "z")];
    let wrong = keys.into_iter().zip(minimum.iter().zip(maximum)).filter(|(_, (low, high))| low.si() >= high.si());
    wrong
        .map(|((key, axis), _)| {
            Fault::conflict(key, format!("must be less than `maximum` along {axis}"), "swap the two")
        })
        .collect()
}

/// Declares in a schema that the items of an array are positive.
pub(super) fn positive_items(schema: &mut schemars::Schema) {
    bound_items(schema, "exclusiveMinimum");
}

/// Declares in a schema that the items of an array are not negative.
pub(super) fn non_negative_items(schema: &mut schemars::Schema) {
    bound_items(schema, "minimum");
}

fn bound_items(schema: &mut schemars::Schema, bound: &str) {
    if let Some(items) = schema.get_mut("items").and_then(serde_json::Value::as_object_mut) {
        items.insert(bound.to_owned(), 0.into());
    }
}
