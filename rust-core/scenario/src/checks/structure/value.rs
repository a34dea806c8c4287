//! Checks of single values: words, quantities with units, numbers, strings, and lists.

use std::ops::Range;

use serde_json::Value;
use toml::Spanned;
use toml::de::DeValue;

use super::json_schema::{items_are_tables, type_name};
use super::wording::{last_key, listing};
use super::{Checker, Key};
use crate::schema::ProblemKind;
use crate::schema::quantity::{QuantityError, parse_quantity, with_article};
use crate::schema::syntax::on_keyboard;
use concordem_contact::ranges::violated;

/// The TOML type of a value, for messages.
pub(super) fn kind_name(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "a string",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "a list",
        DeValue::Table(_) => "a table",
    }
}

/// An integer or a float as a real number.
fn real(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

fn quote(words: &[&str]) -> Vec<String> {
    words.iter().map(|word| format!("\"{word}\"")).collect()
}

/// What to write in place of characters that look like those of the keyboard.
fn foreign(text: &str) -> String {
    let typed = on_keyboard(text);
    typed.map_or_else(String::new, |(c, what, plain)| {
        format!("`{c}` (U+{:04X}) is {what}: write \"{plain}\"; ", u32::from(c))
    })
}

type TomlValue<'a> = Spanned<DeValue<'a>>;

impl Checker<'_> {
    /// Reports a wrong value, with its text.
    fn wrong(&mut self, kind: ProblemKind, key: &Key<'_>, value: &TomlValue<'_>, message: String, help: &str) {
        let text = Some(self.document.excerpt(&value.span())).filter(|text| !text.is_empty());
        // The parser takes a semicolon behind a number as a part of it.
        let number = text.as_deref().and_then(|text| text.strip_suffix(';'));
        let slip = number
            .map(|number| format!("lines end without a semicolon: {} = {number}. ", last_key(key.path)))
            .unwrap_or_default();
        self.report(kind, key.path, (value.span(), text), message, &(slip + help));
    }

    /// Reports a value of the wrong type.
    fn wrong_type(&mut self, key: &Key<'_>, value: &TomlValue<'_>, expected: &str, help: &str) {
        let message = format!("expected {expected}, found {}", kind_name(value.get_ref()));
        self.wrong(ProblemKind::WrongType, key, value, message, help);
    }

    /// Checks a value that must be one of several words.
    pub(super) fn word(&mut self, value: &TomlValue<'_>, words: &[&str], key: &Key<'_>) {
        let allowed = listing(&quote(words));
        // Words that are valid elsewhere but not for this key: the schema has the message.
        let refused = &key.schema["x-refused"];
        let is_refused = |text: &str| refused["words"].as_array().is_some_and(|words| words.iter().any(|w| w == text));
        match value.get_ref() {
            DeValue::String(text) if words.contains(&text.as_ref()) => {}
            DeValue::String(text) if is_refused(text) => {
                let [message, help] = ["message", "help"].map(|name| refused[name].as_str().unwrap_or_default());
                self.wrong(ProblemKind::Conflict, key, value, message.to_owned(), help);
            }
            DeValue::String(text) => {
                let hint = super::wording::nearest(text, words.iter().copied())
                    .map(|word| format!("did you mean \"{word}\"? "))
                    .unwrap_or_default();
                let help = format!("{}{hint}write {allowed}", foreign(text));
                self.wrong(ProblemKind::WrongType, key, value, "not an allowed word".to_owned(), &help);
            }
            _ => self.wrong_type(key, value, "a word", &format!("write {allowed}. {}", key.about)),
        }
    }

    /// Checks a quantity: a number in SI units, a string with a unit, or one of a few words such as "auto".
    pub(super) fn quantity(&mut self, value: &TomlValue<'_>, key: &Key<'_>) {
        let texts = |name: &str| -> Vec<&str> {
            key.schema[name].as_array().into_iter().flatten().filter_map(Value::as_str).collect()
        };
        let dimension = key.schema["x-dimension"].as_str().unwrap_or("");
        let (units, words) = (texts("x-units"), texts("x-words"));
        let units = units.as_slice();
        let help = || {
            let units = match units[0] {
                "1" => "write a number, or a percentage as \"30 %\"".to_owned(),
                si => format!("write a number in {si}, or a string with a unit such as {}", listing(units)),
            };
            let word = words.first().map(|word| format!("; or \"{word}\"")).unwrap_or_default();
            format!("{units}{word}. {}", key.about)
        };
        let read = match value.get_ref() {
            DeValue::String(text) if words.contains(&text.as_ref()) => return,
            DeValue::String(text) => match parse_quantity(text, dimension, units) {
                Err(QuantityError::NoNumber { .. }) if !words.is_empty() => {
                    let message = format!("expected {}, or {}", listing(&quote(&words)), with_article(dimension));
                    return self.wrong(ProblemKind::WrongUnit, key, value, message, &help());
                }
                read => read.map_err(|error| (ProblemKind::WrongUnit, error)),
            },
            number @ (DeValue::Integer(_) | DeValue::Float(_)) => match real(number) {
                Some(number) if number.is_finite() => Ok(number),
                Some(number) if number.is_nan() => {
                    return self.wrong(ProblemKind::OutOfRange, key, value, "not a number".to_owned(), &help());
                }
                _ => Err((
                    ProblemKind::OutOfRange,
                    QuantityError::Overflow { text: self.document.excerpt(&value.span()) },
                )),
            },
            _ => return self.wrong_type(key, value, &with_article(dimension), &help()),
        };
        match read {
            Ok(number) => self.bounds(value, number, key, units[0]),
            Err((kind, error)) => {
                let typed = value.get_ref().as_str().map(foreign).unwrap_or_default();
                self.wrong(kind, key, value, error.to_string(), &(typed + &help()));
            }
        }
    }

    /// Checks the bounds that the schema sets for a number, in SI units.
    fn bounds(&mut self, value: &TomlValue<'_>, number: f64, key: &Key<'_>, unit: &str) {
        let bound = |name: &str| key.declared[name].as_f64().or(key.schema[name].as_f64());
        let Some(demands) = violated(bound, number, unit) else { return };
        let fraction = key.schema["x-dimension"] == "pure number"
            && number > 2.0
            && number <= 100.0
            && bound("maximum").or(bound("exclusiveMaximum")) == Some(1.0);
        let hint = if fraction { format!("did you mean \"{number} %\"? ") } else { String::new() };
        let about = if key.about.is_empty() { format!("write a value {demands}") } else { key.about.clone() };
        self.wrong(ProblemKind::OutOfRange, key, value, format!("must be {demands}"), &(hint + &about));
    }

    /// Checks a string, a boolean, an integer, or a list.
    pub(super) fn plain(&mut self, value: &TomlValue<'_>, place: &Range<usize>, key: &Key<'_>) {
        let about = &key.about;
        match (type_name(key.schema), value.get_ref()) {
            ("string", DeValue::String(_)) | ("boolean", DeValue::Boolean(_)) => {}
            ("string", _) => self.wrong_type(key, value, "a string", &format!("put the value in quotes. {about}")),
            ("boolean", _) => {
                self.wrong_type(key, value, "true or false", &format!("write true or false without quotes. {about}"));
            }
            ("integer", _) => self.integer(value, key),
            ("array", DeValue::Array(array)) => self.array(value, array, place, key),
            ("array", DeValue::Table(_)) if items_are_tables(self.schema, key.schema) => {
                let message = "expected a list of tables, found a single table".to_owned();
                let help = format!("there may be several tables: write [[{}]] with double brackets. {about}", key.path);
                self.report(ProblemKind::WrongType, key.path, (place.clone(), None), message, &help);
            }
            ("array", _) => {
                let length = key.schema["minItems"].as_u64();
                let length = length.filter(|low| key.schema["maxItems"].as_u64() == Some(*low));
                let expected = length.map_or("a list".to_owned(), |length| format!("a list of {length}"));
                let slots = vec!["..."; length.unwrap_or(2).min(4) as usize].join(", ");
                self.wrong_type(key, value, &expected, &format!("write [{slots}]. {about}"));
            }
            _ => {}
        }
    }

    fn integer(&mut self, value: &TomlValue<'_>, key: &Key<'_>) {
        let about = &key.about;
        match value.get_ref() {
            DeValue::Integer(integer) => {
                let number = i128::from_str_radix(integer.as_str(), integer.radix()).ok();
                let number = number.filter(|n| (i128::from(i64::MIN)..=i128::from(u64::MAX)).contains(n));
                let Some(number) = number else {
                    let message = "exceeds the range of 64-bit integers".to_owned();
                    return self.wrong(ProblemKind::OutOfRange, key, value, message, about);
                };
                let Some(allowed) = key.schema["enum"].as_array() else {
                    return self.bounds(value, number as f64, key, "1");
                };
                if !allowed.iter().any(|one| one.as_i64().is_some_and(|one| i128::from(one) == number)) {
                    let list: Vec<String> = allowed.iter().map(Value::to_string).collect();
                    self.wrong(ProblemKind::OutOfRange, key, value, format!("must be {}", listing(&list)), about);
                }
            }
            DeValue::Float(float) => {
                let whole = float.as_str().parse().ok().filter(|x: &f64| x.fract() == 0.0 && x.abs() < 1e15);
                let help = match whole {
                    Some(whole) => format!("write {whole:.0} without a decimal point or exponent. {about}"),
                    None => format!("write an integer. {about}"),
                };
                self.wrong_type(key, value, "an integer", &help);
            }
            _ => self.wrong_type(key, value, "an integer", &format!("write an integer without quotes. {about}")),
        }
    }

    fn array(&mut self, value: &TomlValue<'_>, array: &[TomlValue<'_>], place: &Range<usize>, key: &Key<'_>) {
        let count = array.len() as u64;
        let low = key.schema["minItems"].as_u64().unwrap_or(0);
        let high = key.schema["maxItems"].as_u64().unwrap_or(u64::MAX);
        if count < low || count > high {
            let expected = if low == high { format!("{low}") } else { format!("at least {low}") };
            let items = if low == 1 { "item" } else { "items" };
            let message = format!("expected {expected} {items}, found {count}");
            return self.wrong(ProblemKind::OutOfRange, key, value, message, &key.about);
        }
        for (index, item) in array.iter().enumerate() {
            let place = self.document.place_of_item(item, place);
            self.value(item, &place, &key.schema["items"], &format!("{}[{index}]", key.path));
        }
    }
}
