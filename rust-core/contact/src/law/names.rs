//! Names of laws in scenarios, result files, and hosts.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserialize, Deserializer, Error};
use serde::{Serialize, Serializer};

use super::state::{COLUMNS_OF_EVERY_CONTACT, Field};
use super::table::LawFacts;

macro_rules! law_names {
    ($($key:ident: $Law:ident,)*) => {
        /// A law, by the name of its parameter table.
        #[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
        pub enum LawName {
            $(#[doc = concat!("[`", stringify!($Law), "`](super::", stringify!($key), ")")] $Law,)*
        }

        impl LawName {
            /// All laws, in the order of [`for_each_law!`](crate::for_each_law).
            pub const ALL: &'static [Self] = &[$(Self::$Law),*];

            /// Constants of the law.
            pub const fn facts(self) -> &'static LawFacts {
                match self {
                    $(Self::$Law => const { &LawFacts::of::<super::$key::$Law>() },)*
                }
            }
        }

        // The name in the list must equal `NAME`, the key of the law's table in a material.
        const _: () = {
            $(assert!(equal(stringify!($key).as_bytes(), LawName::$Law.facts().key.as_bytes()),
                concat!("for_each_law! lists `", stringify!($Law), "` under another name than its NAME"));)*
        };

        // Tables of contacts have the fields of the history beside the columns of every contact.
        const _: () = {
            $(assert!(own_names(LawName::$Law.facts().history),
                concat!("a field in the history of `", stringify!($Law), "` has the name of a column of every contact"));)*
        };
    };
}
crate::for_each_law!(law_names);

/// Whether no field has the name of a column of every contact.
const fn own_names(fields: &[Field]) -> bool {
    let mut i = 0;
    while i < fields.len() {
        let mut k = 0;
        while k < COLUMNS_OF_EVERY_CONTACT.len() {
            if equal(fields[i].name.as_bytes(), COLUMNS_OF_EVERY_CONTACT[k].as_bytes()) {
                return false;
            }
            k += 1;
        }
        i += 1;
    }
    true
}

const fn equal(a: &[u8], b: &[u8]) -> bool {
    if a.len() != b.len() {
        return false;
    }
    let mut i = 0;
    while i < a.len() {
        if a[i] != b[i] {
            return false;
        }
        i += 1;
    }
    true
}

impl LawName {
    /// Key of the law's table in a material.
    pub const fn key(self) -> &'static str {
        self.facts().key
    }

    /// The law of this key.
    pub fn of_key(key: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|law| law.key() == key)
    }

    /// Laws that make bonds.
    pub fn bonds() -> impl Iterator<Item = Self> + Clone {
        Self::ALL.iter().copied().filter(|law| law.facts().as_bond.is_some())
    }

    /// Laws that act without a bond.
    pub fn contacts() -> impl Iterator<Item = Self> + Clone {
        Self::ALL.iter().copied().filter(|law| law.facts().as_contact.is_some())
    }
}

impl Serialize for LawName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key())
    }
}

/// Reads the name of any law that makes bonds.
impl<'de> Deserialize<'de> for LawName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = Cow::<str>::deserialize(deserializer)?;
        Self::of_key(&word)
            .filter(|law| law.facts().as_bond.is_some())
            .ok_or_else(|| Error::custom(format!("`{word}` is not a law of bonds")))
    }
}

/// Schema of a choice among words with their descriptions, as derived for an enum.
fn choice<'a>(words: impl Iterator<Item = (&'a str, &'a str)>, about: &str) -> Schema {
    let words: Vec<Schema> =
        words.map(|(word, about)| json_schema!({ "type": "string", "const": word, "description": about })).collect();
    json_schema!({ "description": about, "oneOf": words })
}

/// The keys of the laws as text: "a", "a" or "b", "a", "b", or "c".
pub fn listing(laws: impl Iterator<Item = LawName>) -> String {
    let quoted: Vec<String> = laws.map(|law| format!("\"{}\"", law.key())).collect();
    match &quoted[..] {
        [] => String::new(),
        [one] => one.clone(),
        [one, two] => format!("{one} or {two}"),
        [front @ .., last] => format!("{}, or {last}", front.join(", ")),
    }
}

/// Tell the schema which words are valid elsewhere but not here, with a message and a help for the user.
fn refuse(schema: &mut Schema, laws: impl Iterator<Item = LawName>, message: &str, help: &str) {
    let words: Vec<&str> = laws.map(LawName::key).collect();
    let refused = json_schema!({ "words": words, "message": message, "help": help });
    schema.insert("x-refused".to_owned(), refused.to_value());
}

impl JsonSchema for LawName {
    fn schema_name() -> Cow<'static, str> {
        "LawName".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let words = Self::bonds().map(|law| (law.key(), law.facts().as_bond.unwrap_or_default()));
        let mut schema = choice(words, "Laws of bonds, by the name of their parameter table.");
        let others = Self::ALL.iter().copied().filter(|law| law.facts().as_bond.is_none());
        let help = format!("use {}; omit [bonds] for a granular material", listing(Self::bonds()));
        refuse(&mut schema, others, "this law makes no bonds", &help);
        schema
    }
}

/// Law of contacts without a bond, or none: particles without a bond then pass through each other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Hash)]
pub struct ContactLawName(Option<LawName>);

impl ContactLawName {
    /// Particles without a bond pass through each other.
    pub const NONE: Self = Self(None);

    /// This law; `None` if it acts in bonds only.
    pub fn new(law: LawName) -> Option<Self> {
        law.facts().as_contact.map(|_| Self(Some(law)))
    }

    /// The law of this name; "none" is [`Self::NONE`].
    pub fn of_key(key: &str) -> Option<Self> {
        if key == "none" { Some(Self::NONE) } else { LawName::of_key(key).and_then(Self::new) }
    }

    /// The law; `None` for "none".
    pub const fn law(self) -> Option<LawName> {
        self.0
    }

    /// Key of the law; "none" for no law.
    pub fn key(self) -> &'static str {
        self.0.map_or("none", LawName::key)
    }
}

impl Serialize for ContactLawName {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_str(self.key())
    }
}

impl<'de> Deserialize<'de> for ContactLawName {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let word = Cow::<str>::deserialize(deserializer)?;
        Self::of_key(&word).ok_or_else(|| Error::custom(format!("`{word}` is not a law of contacts")))
    }
}

impl JsonSchema for ContactLawName {
    fn schema_name() -> Cow<'static, str> {
        "ContactLawName".into()
    }
    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let none = ("none", "Particles without a bond pass through each other.");
        let laws = LawName::contacts().map(|law| (law.key(), law.facts().as_contact.unwrap_or_default()));
        choice(std::iter::once(none).chain(laws), "Law of contacts without a bond.")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn laws_without_a_role_for_contacts_are_none() {
        assert_eq!(ContactLawName::of_key("none"), Some(ContactLawName::NONE));
        assert_eq!(ContactLawName::of_key("frictional").map(ContactLawName::key), Some("frictional"));
        assert_eq!(ContactLawName::of_key("cohesive_beam"), None);
    }

    /// A law without a role could not be used by any scenario.
    #[test]
    fn every_law_has_a_role() {
        for law in LawName::ALL {
            let facts = law.facts();
            assert!(facts.as_bond.is_some() || facts.as_contact.is_some(), "{}", facts.key);
            assert_eq!(LawName::of_key(facts.key), Some(*law));
        }
    }
}
