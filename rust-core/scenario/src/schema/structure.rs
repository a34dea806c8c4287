//! Checks a scenario's keys, types, units, and ranges against its own JSON Schema, and reports all faults at once.
//!
//! The schema comes from the same structs as the reader, so there is one declaration of every key. A general JSON
//! Schema validator would know neither the places in the text nor our units.

use std::ops::Range;

use serde_json::{Map, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::document::Document;
use super::error::{Problem, ProblemKind};
use super::quantity::{DIMENSIONS, QuantityError, parse_quantity};

/// All faults of structure.
pub(super) fn check(document: &Document<'_>, schema: &Value) -> Vec<Problem> {
    let mut checker = Checker { document, schema, problems: Vec::new() };
    let root = document.root.get_ref();
    checker.table(root, &(0..0), schema, "");
    checker.problems
}

struct Checker<'a> {
    document: &'a Document<'a>,
    schema: &'a Value,
    problems: Vec<Problem>,
}

/// A schema behind its references: `$ref`, and `anyOf` with null, which is how an optional table is written.
fn resolve<'a>(root: &'a Value, mut schema: &'a Value) -> &'a Value {
    loop {
        if let Some(reference) = schema["$ref"].as_str() {
            schema = reference.strip_prefix('#').and_then(|pointer| root.pointer(pointer)).unwrap_or(&Value::Null);
        } else if let Some(variant) =
            schema["anyOf"].as_array().and_then(|variants| variants.iter().find(|variant| variant["type"] != "null"))
        {
            schema = variant;
        } else {
            return schema;
        }
    }
}

/// The words a schema allows, if it is a choice of words.
fn words(schema: &Value) -> Option<Vec<&str>> {
    if let Some(list) = schema["enum"].as_array() {
        return list.iter().map(Value::as_str).collect();
    }
    let mut out = Vec::new();
    for variant in schema["oneOf"].as_array()? {
        match (variant["const"].as_str(), variant["enum"].as_array()) {
            (Some(word), _) => out.push(word),
            (None, Some(list)) => out.extend(list.iter().filter_map(Value::as_str)),
            (None, None) => return None,
        }
    }
    Some(out)
}

/// Values of `kind` that a tagged choice allows.
fn kinds(schema: &Value) -> Vec<&str> {
    schema["oneOf"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|variant| variant["properties"]["kind"]["const"].as_str())
        .collect()
}

/// "a", "a or b", "a, b, or c".
pub(super) fn listing(items: &[impl AsRef<str>]) -> String {
    match items {
        [] => String::new(),
        [one] => one.as_ref().to_owned(),
        [one, two] => format!("{} or {}", one.as_ref(), two.as_ref()),
        [front @ .., last] => {
            let front: Vec<&str> = front.iter().map(AsRef::as_ref).collect();
            format!("{}, or {}", front.join(", "), last.as_ref())
        }
    }
}

/// The candidate most like a word, if any is like it at all.
pub(super) fn nearest<'a>(word: &str, candidates: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let plain = |text: &str| text.to_lowercase().replace('-', "_");
    let word = plain(word);
    let mut best: Option<(f64, &str)> = None;
    for candidate in candidates {
        let other = plain(candidate);
        // A word cut short or lengthened counts as like; otherwise two thirds of the letters must be right.
        let likeness = if !word.is_empty() && (other.starts_with(&word) || word.starts_with(&other)) {
            0.9 + 0.1 * strsim::normalized_damerau_levenshtein(&word, &other)
        } else {
            strsim::normalized_damerau_levenshtein(&word, &other)
        };
        if likeness >= 0.6 && best.is_none_or(|(most, _)| likeness > most) {
            best = Some((likeness, candidate));
        }
    }
    best.map(|(_, candidate)| candidate)
}

fn join(path: &str, key: &str) -> String {
    if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") }
}

/// Names of parameters in YADE's concrete model, and here.
const YADE_NAMES: &[(&str, &str)] = &[
    ("sigmaT", "cohesion"),
    ("epsCrackOnset", "crack_onset_strain"),
    ("relDuctility", "relative_ductility"),
    ("neverDamage", "never_damage"),
    ("equivStrainShearContrib", "shear_contribution"),
    ("damLaw", "damage_law"),
    ("dmgTau", "damage_time"),
    ("dmgRateExp", "damage_rate_exponent"),
    ("plTau", "plasticity_time"),
    ("plRateExp", "plasticity_rate_exponent"),
    ("isoPrestress", "isotropic_prestress"),
    ("frictionAngle", "friction_angle"),
    ("poisson", "shear_ratio"),
    ("yieldSurfType", "yield_surface"),
    ("yieldLogSpeed", "yield_log_speed"),
    ("omegaThreshold", "omega_threshold"),
    ("epsSoft", "soft_strain"),
    ("relKnSoft", "relative_soft_stiffness"),
    ("intRadius", "interaction_ratio"),
    ("enlargeFactor", "interaction_ratio"),
    ("strainRate", "strain_rate"),
];

/// Last key of a path, without index.
fn last_key(path: &str) -> &str {
    let last = path.rsplit('.').next().unwrap_or(path);
    last.split('[').next().unwrap_or(last)
}

fn kind_name(value: &DeValue<'_>) -> &'static str {
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

/// A number in TOML, as a real.
fn real(value: &DeValue<'_>) -> Option<f64> {
    match value {
        DeValue::Integer(integer) => i128::from_str_radix(integer.as_str(), integer.radix()).ok().map(|i| i as f64),
        DeValue::Float(float) => float.as_str().parse().ok(),
        _ => None,
    }
}

/// The type a schema asks for, apart from null.
fn type_name(schema: &Value) -> &str {
    match &schema["type"] {
        Value::String(name) => name,
        Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null").unwrap_or(""),
        _ => "",
    }
}

impl Checker<'_> {
    fn report(
        &mut self,
        kind: ProblemKind,
        path: &str,
        span: Range<usize>,
        with_value: bool,
        message: String,
        help: impl AsRef<str>,
    ) {
        let value = Some(self.document.excerpt(&span)).filter(|text| with_value && !text.is_empty());
        let help = help.as_ref().trim_end().to_owned();
        self.problems.push(Problem { kind, key: path.to_owned(), value, span, message, help });
    }

    fn value(&mut self, value: &Spanned<DeValue<'_>>, place: &Range<usize>, unresolved: &Value, path: &str) {
        let schema = resolve(self.schema, unresolved);
        let description = unresolved["description"].as_str().or(schema["description"].as_str()).unwrap_or("");
        let about = about(path, description);
        if let Some(words) = words(schema) {
            self.word(value, &words, schema, path, &about);
        } else if schema["x-dimension"].is_string() {
            self.quantity(value, unresolved, schema, path, &about);
        } else if schema["oneOf"].is_array() || schema["properties"].is_object() {
            match value.get_ref() {
                DeValue::Table(table) => self.table(table, place, schema, path),
                DeValue::Array(array) if array.iter().all(|item| item.get_ref().is_table()) && !path.ends_with(']') => {
                    let help = format!("there is one `{path}`: write [{path}], with single brackets");
                    let message = "a list of tables where one table is wanted".to_owned();
                    self.report(ProblemKind::WrongType, path, place.clone(), false, message, help);
                }
                other => {
                    let key = last_key(path);
                    let example = match kinds(schema).into_iter().find(|kind| *kind != "none") {
                        Some(kind) => format!("{key} = {{ kind = \"{kind}\", ... }}"),
                        None => format!("{key} = {{ ... }}"),
                    };
                    let message = format!("{} where a table is wanted", kind_name(other));
                    let help = format!("write [{path}] and its keys below, or {example}. {about}");
                    self.report(ProblemKind::WrongType, path, value.span(), true, message, help);
                }
            }
        } else {
            self.plain(value, place, schema, path, &about);
        }
    }

    fn word(&mut self, value: &Spanned<DeValue<'_>>, words: &[&str], schema: &Value, path: &str, about: &str) {
        let quoted: Vec<String> = words.iter().map(|word| format!("\"{word}\"")).collect();
        // Words that mean something, but not here: the schema has the message.
        let refused = &schema["x-refused"];
        let is_refused = |text: &str| refused["words"].as_array().is_some_and(|words| words.iter().any(|w| w == text));
        match value.get_ref() {
            DeValue::String(text) if words.contains(&text.as_ref()) => {}
            DeValue::String(text) if is_refused(text) => {
                let [message, help] = ["message", "help"].map(|key| refused[key].as_str().unwrap_or_default());
                self.report(ProblemKind::Conflict, path, value.span(), true, message.to_owned(), help);
            }
            DeValue::String(text) => {
                let hint = nearest(text, words.iter().copied())
                    .map(|word| format!("did you mean \"{word}\"? "))
                    .unwrap_or_default();
                let message = "not one of the words allowed here".to_owned();
                let help = format!("{hint}write {}", listing(&quoted));
                self.report(ProblemKind::WrongType, path, value.span(), true, message, help);
            }
            other => {
                let message = format!("{} where a word is wanted", kind_name(other));
                let help = format!("write {}. {about}", listing(&quoted));
                self.report(ProblemKind::WrongType, path, value.span(), true, message, help);
            }
        }
    }

    fn quantity(&mut self, value: &Spanned<DeValue<'_>>, unresolved: &Value, schema: &Value, path: &str, about: &str) {
        let name = schema["x-dimension"].as_str().unwrap_or("");
        let Some(&(dimension, units)) = DIMENSIONS.iter().find(|(dimension, _)| *dimension == name) else { return };
        let si = units[0];
        let other_words: Vec<&str> =
            schema["x-words"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
        let units_help = if si == "1" {
            "write a number, or a percentage as \"30 %\"".to_owned()
        } else {
            format!("write a number in {si}, or a string with a unit such as {}", listing(units))
        };
        let words_help = other_words.first().map(|word| format!("; or \"{word}\"")).unwrap_or_default();
        let read = match value.get_ref() {
            DeValue::String(text) if other_words.contains(&text.as_ref()) => return,
            DeValue::String(text) => match parse_quantity(text, dimension, units) {
                Err(QuantityError::NoNumber { .. }) if !other_words.is_empty() => {
                    let quoted: Vec<String> = other_words.iter().map(|word| format!("\"{word}\"")).collect();
                    let message = format!("neither {} nor a {dimension}", listing(&quoted));
                    let help = format!("{units_help}{words_help}. {about}");
                    self.report(ProblemKind::WrongUnit, path, value.span(), true, message, help);
                    return;
                }
                read => read.map_err(|error| (ProblemKind::WrongUnit, error)),
            },
            number @ (DeValue::Integer(_) | DeValue::Float(_)) => match real(number) {
                Some(number) if number.is_finite() => Ok(number),
                Some(number) if number.is_nan() => {
                    let message = "not a number".to_owned();
                    let help = format!("{units_help}{words_help}. {about}");
                    self.report(ProblemKind::OutOfRange, path, value.span(), true, message, help);
                    return;
                }
                _ => Err((
                    ProblemKind::OutOfRange,
                    QuantityError::Overflow { text: self.document.excerpt(&value.span()) },
                )),
            },
            other => {
                let message = format!("{} where a {dimension} is wanted", kind_name(other));
                let help = format!("{units_help}{words_help}. {about}");
                self.report(ProblemKind::WrongType, path, value.span(), true, message, help);
                return;
            }
        };
        match read {
            Ok(number) => self.bounds(value, number, unresolved, schema, path, si, about),
            Err((kind, error)) => {
                let help = format!("{units_help}{words_help}. {about}");
                self.report(kind, path, value.span(), true, error.to_string(), help);
            }
        }
    }

    fn bounds(
        &mut self,
        value: &Spanned<DeValue<'_>>,
        number: f64,
        unresolved: &Value,
        schema: &Value,
        path: &str,
        unit: &str,
        about: &str,
    ) {
        let bound = |name: &str| unresolved[name].as_f64().or(schema[name].as_f64());
        let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
        let limits = [
            (bound("minimum"), "at least", (|x, limit| x < limit) as fn(f64, f64) -> bool),
            (bound("exclusiveMinimum"), "greater than", |x, limit| x <= limit),
            (bound("maximum"), "at most", |x, limit| x > limit),
            (bound("exclusiveMaximum"), "less than", |x, limit| x >= limit),
        ];
        let mut wanted = Vec::new();
        let mut broken = false;
        for (limit, phrase, violated) in limits {
            if let Some(limit) = limit {
                let zero_unit = if limit == 0.0 { "" } else { unit.as_str() };
                wanted.push(format!("{phrase} {limit}{zero_unit}"));
                broken |= violated(number, limit);
            }
        }
        if broken {
            let message = format!("must be {}", wanted.join(" and "));
            let fraction = schema["x-dimension"] == "pure number"
                && number > 2.0
                && number <= 100.0
                && bound("maximum").or(bound("exclusiveMaximum")) == Some(1.0);
            let hint = if fraction { format!("did you mean \"{number} %\"? ") } else { String::new() };
            let about =
                if about.is_empty() { format!("write a value {}", wanted.join(" and ")) } else { about.to_owned() };
            let help = hint + &about;
            self.report(ProblemKind::OutOfRange, path, value.span(), true, message, help);
        }
    }

    fn plain(&mut self, value: &Spanned<DeValue<'_>>, place: &Range<usize>, schema: &Value, path: &str, about: &str) {
        let wrong = |checker: &mut Self, wanted: &str, help: String| {
            let message = format!("{} where {wanted} is wanted", kind_name(value.get_ref()));
            checker.report(ProblemKind::WrongType, path, value.span(), true, message, help);
        };
        match (type_name(schema), value.get_ref()) {
            ("string", DeValue::String(_)) | ("boolean", DeValue::Boolean(_)) => {}
            ("string", _) => wrong(self, "a string", format!("put it into quotes. {about}")),
            ("boolean", _) => wrong(self, "true or false", format!("write true or false, without quotes. {about}")),
            ("integer", DeValue::Integer(integer)) => match i128::from_str_radix(integer.as_str(), integer.radix()) {
                Ok(number) if number <= i128::from(u64::MAX) && number >= i128::from(i64::MIN) => {
                    if let Some(allowed) = schema["enum"].as_array() {
                        if !allowed.iter().any(|one| one.as_i64().is_some_and(|one| i128::from(one) == number)) {
                            let list: Vec<String> = allowed.iter().map(Value::to_string).collect();
                            let message = format!("must be {}", listing(&list));
                            self.report(ProblemKind::OutOfRange, path, value.span(), true, message, about);
                        }
                    } else {
                        self.bounds(value, number as f64, schema, schema, path, "1", about);
                    }
                }
                _ => {
                    let message = "beyond the range of 64-bit integers".to_owned();
                    self.report(ProblemKind::OutOfRange, path, value.span(), true, message, about);
                }
            },
            ("integer", DeValue::Float(float)) => {
                let whole = float.as_str().parse().ok().filter(|x: &f64| x.fract() == 0.0 && x.abs() < 1e15);
                let help = match whole {
                    Some(whole) => format!("write {whole:.0}, without point or exponent. {about}"),
                    None => format!("write an integer. {about}"),
                };
                wrong(self, "an integer", help);
            }
            ("integer", _) => wrong(self, "an integer", format!("write an integer, without quotes. {about}")),
            ("array", DeValue::Array(array)) => self.array(value, array, place, schema, path, about),
            ("array", DeValue::Table(_)) if self.items_are_tables(schema) => {
                let message = "a single table where a list of tables is wanted".to_owned();
                let help = format!("there may be several: write [[{path}]], with double brackets. {about}");
                self.report(ProblemKind::WrongType, path, place.clone(), false, message, help);
            }
            ("array", _) => {
                let length = schema["minItems"].as_u64().filter(|low| schema["maxItems"].as_u64() == Some(*low));
                let wanted = length.map_or("a list".to_owned(), |length| format!("a list of {length}"));
                let slots = vec!["..."; length.unwrap_or(2).min(4) as usize].join(", ");
                wrong(self, &wanted, format!("write [{slots}]. {about}"));
            }
            _ => {}
        }
    }

    fn array(
        &mut self,
        value: &Spanned<DeValue<'_>>,
        array: &[Spanned<DeValue<'_>>],
        place: &Range<usize>,
        schema: &Value,
        path: &str,
        about: &str,
    ) {
        let count = array.len() as u64;
        let low = schema["minItems"].as_u64().unwrap_or(0);
        let high = schema["maxItems"].as_u64().unwrap_or(u64::MAX);
        if count < low || count > high {
            let wanted = if low == high { format!("{low}") } else { format!("at least {low}") };
            let message = format!("{count} items where {wanted} are wanted");
            self.report(ProblemKind::OutOfRange, path, value.span(), true, message, about);
            return;
        }
        for (index, item) in array.iter().enumerate() {
            let place = self.document.place_of_item(item, place);
            let items = &schema["items"];
            let path = format!("{path}[{index}]");
            self.value(item, &place, items, &path);
        }
    }

    fn items_are_tables(&self, schema: &Value) -> bool {
        let items = resolve(self.schema, &schema["items"]);
        items["properties"].is_object() || items["oneOf"].is_array()
    }

    fn table(&mut self, table: &DeTable<'_>, place: &Range<usize>, schema: &Value, path: &str) {
        let Some(variants) = schema["oneOf"].as_array() else {
            self.keys(table, place, schema, path);
            return;
        };
        let kinds = kinds(schema);
        let quoted: Vec<String> = kinds.iter().map(|kind| format!("\"{kind}\"")).collect();
        let kind_path = join(path, "kind");
        match table.get("kind").map(|value| (value, value.get_ref().as_str())) {
            Some((_, Some(kind))) if kinds.contains(&kind) => {
                if let Some(variant) = variants.iter().find(|variant| variant["properties"]["kind"]["const"] == kind) {
                    self.keys(table, place, variant, path);
                }
            }
            Some((value, _)) => self.word(value, &kinds, &Value::Null, &kind_path, ""),
            None => {
                let message = "missing key".to_owned();
                let help = format!("add kind = {}", listing(&quoted));
                self.report(ProblemKind::MissingKey, &kind_path, place.clone(), false, message, help);
            }
        }
    }

    fn keys(&mut self, table: &DeTable<'_>, place: &Range<usize>, schema: &Value, path: &str) {
        let empty = Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&empty);
        let mut excused: Vec<&str> = Vec::new();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let key_path = join(path, name);
            if let Some(property) = properties.get(name) {
                if property["const"].is_null() {
                    self.value(value, &key.span(), property, &key_path);
                }
                continue;
            }
            let free = properties.keys().map(String::as_str).filter(|other| !table.contains_key(*other));
            let alias = YADE_NAMES.iter().find(|(yade, ours)| *yade == name && properties.contains_key(*ours));
            let help = if let Some((yade, ours)) = alias {
                excused.push(ours);
                let about = about(ours, properties[*ours]["description"].as_str().unwrap_or(""));
                format!("YADE's `{yade}` is `{ours}` here. {about}")
            } else if let Some(other) = nearest(name, free) {
                excused.push(other);
                format!(
                    "did you mean `{other}`? {}",
                    about(other, properties[other]["description"].as_str().unwrap_or(""))
                )
            } else {
                let mut keys: Vec<String> = properties.keys().map(|key| format!("`{key}`")).collect();
                keys.sort();
                let elsewhere = self.homes_of(name);
                let elsewhere = if elsewhere.is_empty() {
                    String::new()
                } else {
                    format!("`{name}` is a key of {}; ", listing(&elsewhere))
                };
                let here =
                    if path.is_empty() { "at the top".to_owned() } else { format!("of `{}`", strip_indices(path)) };
                format!("{elsewhere}the keys {here} are {}", keys.join(", "))
            };
            let message = match schema["properties"]["kind"]["const"].as_str() {
                Some(kind) => format!("unknown key for kind \"{kind}\""),
                None => "unknown key".to_owned(),
            };
            self.report(ProblemKind::UnknownKey, &key_path, key.span(), false, message, help);
        }
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            if table.contains_key(name) || excused.contains(&name) {
                continue;
            }
            let property = &properties[name];
            let resolved = resolve(self.schema, property);
            let description = property["description"].as_str().or(resolved["description"].as_str()).unwrap_or("");
            let is_table = resolved["properties"].is_object() || !kinds(resolved).is_empty();
            let full = join(path, name);
            let plain_path: String = strip_indices(&full);
            let add = if is_table {
                format!("add [{plain_path}]")
            } else if type_name(resolved) == "array" && self.items_are_tables(resolved) {
                format!("add [[{plain_path}]]")
            } else {
                let value = match resolved["enum"].as_array().map(Vec::as_slice) {
                    Some([only]) => only.to_string(),
                    _ => "...".to_owned(),
                };
                format!("add `{name} = {value}`")
            };
            let help = format!("{add}. {}", about(name, description));
            self.report(ProblemKind::MissingKey, &full, place.clone(), false, "missing key".to_owned(), help);
        }
    }

    /// Tables elsewhere in the schema that have a key of this name.
    fn homes_of(&self, key: &str) -> Vec<String> {
        let mut homes = Vec::new();
        self.search(self.schema, key, "", 0, &mut homes);
        homes.sort();
        homes.dedup();
        homes
    }

    fn search(&self, schema: &Value, key: &str, path: &str, depth: usize, homes: &mut Vec<String>) {
        // No table lies deeper than this: material → law.
        if depth > 4 {
            return;
        }
        let schema = resolve(self.schema, schema);
        for variant in schema["oneOf"].as_array().into_iter().flatten() {
            self.search(variant, key, path, depth + 1, homes);
        }
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            let inner = resolve(self.schema, property);
            if name == key && !path.is_empty() {
                let kind = schema["properties"]["kind"]["const"].as_str();
                let kind = kind.map_or(String::new(), |kind| format!(" of kind \"{kind}\""));
                homes.push(format!("[{path}]{kind}"));
            }
            let next = if type_name(inner) == "array" { &inner["items"] } else { inner };
            self.search(next, key, &join(path, name), depth + 1, homes);
        }
    }
}

/// `material[0].cpm` → `material.cpm`, as in a header.
fn strip_indices(path: &str) -> String {
    let mut out = String::new();
    let mut inside = false;
    for c in path.chars() {
        match c {
            '[' => inside = true,
            ']' => inside = false,
            c if !inside => out.push(c),
            _ => {}
        }
    }
    out
}

/// What a key means, as a sentence for help texts.
fn about(path: &str, description: &str) -> String {
    let description = description.replace('\n', " ");
    if description.is_empty() { String::new() } else { format!("`{}`: {}", last_key(path), description) }
}
