//! Checks keys, types, units, and ranges against the JSON Schema of a scenario, and reports all problems at once.
//!
//! The schema comes from the same structs as the reader, so every key is declared once. A general JSON Schema validator
//! would know neither positions in the text nor units.

mod json_schema;
pub(super) mod keys;
mod value;
pub(super) mod wording;

use std::ops::Range;

use serde_json::{Map, Value};
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use crate::schema::syntax::on_keyboard;
use crate::schema::{Document, Problem, ProblemKind};
use json_schema::{items_are_tables, kinds, resolve, type_name, words};
use value::kind_name;
use wording::{SIMILAR, VERY_SIMILAR, YADE_NAMES, about, join, last_key, listing, nearest_of, strip_indices};

/// All problems of structure.
pub(super) fn check(document: &Document<'_>, schema: &Value) -> Vec<Problem> {
    let mut checker = Checker { document, schema, problems: Vec::new() };
    let root = document.root.get_ref();
    checker.table(root, &(0..0), schema, "");
    checker.problems
}

struct Checker<'a> {
    document: &'a Document<'a>,
    /// The whole schema, to resolve references.
    schema: &'a Value,
    problems: Vec<Problem>,
}

/// The key that is being checked.
struct Key<'a> {
    /// Path, such as `material[0].cpm.young`.
    path: &'a str,
    /// Schema as declared for the key: a reference, with bounds and description.
    declared: &'a Value,
    /// Schema that the reference resolves to.
    schema: &'a Value,
    /// Description for help texts.
    about: String,
}

impl Checker<'_> {
    /// Reports a problem at a position in the text, with the text of the value if the message shows it.
    fn report(
        &mut self,
        kind: ProblemKind,
        path: &str,
        (span, value): (Range<usize>, Option<String>),
        message: String,
        help: &str,
    ) {
        let help = help.trim_end().to_owned();
        self.problems.push(Problem { kind, key: path.to_owned(), value, span, message, help });
    }

    /// Checks a value of any type; `place` is the position of its key or table header.
    fn value(&mut self, value: &Spanned<DeValue<'_>>, place: &Range<usize>, declared: &Value, path: &str) {
        let schema = resolve(self.schema, declared);
        let description = declared["description"].as_str().or(schema["description"].as_str()).unwrap_or("");
        let key = Key { path, declared, schema, about: about(path, description) };
        if let Some(words) = words(schema) {
            self.word(value, &words, &key);
        } else if schema["x-dimension"].is_string() {
            self.quantity(value, &key);
        } else if schema["oneOf"].is_array() || schema["properties"].is_object() {
            match value.get_ref() {
                DeValue::Table(table) => self.table(table, place, schema, path),
                other => self.no_table(other, value.span(), place, &key),
            }
        } else {
            self.plain(value, place, &key);
        }
    }

    /// Reports a value where the schema requires a table.
    fn no_table(&mut self, value: &DeValue<'_>, span: Range<usize>, place: &Range<usize>, key: &Key<'_>) {
        let path = key.path;
        let tables = value.as_array().is_some_and(|array| array.iter().all(|item| item.get_ref().is_table()));
        if tables && !path.ends_with(']') {
            let message = "expected one table, found a list of tables".to_owned();
            let help = format!("there is only one `{path}`: write [{path}] with single brackets");
            self.report(ProblemKind::WrongType, path, (place.clone(), None), message, &help);
            return;
        }
        let name = last_key(path);
        let example = match kinds(key.schema).into_iter().find(|kind| *kind != "none") {
            Some(kind) => format!("{name} = {{ kind = \"{kind}\", ... }}"),
            None => format!("{name} = {{ ... }}"),
        };
        let message = format!("expected a table, found {}", kind_name(value));
        let help = format!("write [{path}] with its keys below, or {example}. {}", key.about);
        let text = Some(self.document.excerpt(&span)).filter(|text| !text.is_empty());
        self.report(ProblemKind::WrongType, path, (span, text), message, &help);
    }

    /// Checks a table, or one variant of a tagged choice of tables.
    fn table(&mut self, table: &DeTable<'_>, place: &Range<usize>, schema: &Value, path: &str) {
        let Some(variants) = schema["oneOf"].as_array() else {
            self.keys(table, place, schema, path);
            return;
        };
        let kinds = kinds(schema);
        let kind_path = join(path, "kind");
        match table.get("kind").map(|value| (value, value.get_ref().as_str())) {
            Some((_, Some(kind))) if kinds.contains(&kind) => {
                if let Some(variant) = variants.iter().find(|variant| variant["properties"]["kind"]["const"] == kind) {
                    self.keys(table, place, variant, path);
                }
            }
            Some((value, _)) => {
                let key = Key { path: &kind_path, declared: schema, schema, about: String::new() };
                self.word(value, &kinds, &key);
            }
            None => {
                let quoted: Vec<String> = kinds.iter().map(|kind| format!("\"{kind}\"")).collect();
                let help = format!("add kind = {}", listing(&quoted));
                let message = "missing key".to_owned();
                self.report(ProblemKind::MissingKey, &kind_path, (place.clone(), None), message, &help);
            }
        }
    }

    /// Checks the keys of a table: values of known keys, unknown keys, and missing keys.
    fn keys(&mut self, table: &DeTable<'_>, place: &Range<usize>, schema: &Value, path: &str) {
        let empty = Map::new();
        let properties = schema["properties"].as_object().unwrap_or(&empty);
        // Keys that the user probably meant by an unknown key; they are not reported as missing.
        let mut meant: Vec<&str> = Vec::new();
        for (key, value) in table {
            let name = key.get_ref().as_ref();
            let key_path = join(path, name);
            if let Some(property) = properties.get(name) {
                if property["const"].is_null() {
                    self.value(value, &key.span(), property, &key_path);
                }
                continue;
            }
            let (other, help) = self.help_for_unknown_key(name, table, properties, path);
            meant.extend(other);
            let message = match schema["properties"]["kind"]["const"].as_str() {
                Some(kind) => format!("unknown key for kind \"{kind}\""),
                None => "unknown key".to_owned(),
            };
            self.report(ProblemKind::UnknownKey, &key_path, (key.span(), None), message, &help);
        }
        for name in schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str) {
            if !table.contains_key(name) && !meant.contains(&name) {
                self.missing_key(name, &properties[name], place, path);
            }
        }
    }

    /// The key that the user probably meant by an unknown key, if any, and the help text.
    fn help_for_unknown_key<'s>(
        &self,
        name: &str,
        table: &DeTable<'_>,
        properties: &'s Map<String, Value>,
        path: &str,
    ) -> (Option<&'s str>, String) {
        let about_key = |key: &str| about(key, properties[key]["description"].as_str().unwrap_or(""));
        let mut of_yade = YADE_NAMES.iter().filter(|(yade, _)| *yade == name);
        if let Some((key, _)) = of_yade.find_map(|(_, ours)| properties.get_key_value(*ours)) {
            return (Some(key), format!("YADE's `{name}` is called `{key}` here. {}", about_key(key)));
        }
        if let Some((c, what, plain)) = on_keyboard(name) {
            let help = format!("`{c}` (U+{:04X}) is {what}: write `{plain}`", u32::from(c));
            return (properties.get_key_value(&plain).map(|(key, _)| key.as_str()), help);
        }
        let elsewhere = self.tables_with_key(name, path);
        // A key of another table is no slip of a key that is only somewhat like it.
        let least = if elsewhere.is_empty() { SIMILAR } else { VERY_SIMILAR };
        if let Some(other) = nearest_of(name, properties.keys().map(String::as_str), least) {
            return if table.contains_key(other) {
                (None, format!("did you mean `{other}`, which is given, too? {}", about_key(other)))
            } else {
                (Some(other), format!("did you mean `{other}`? {}", about_key(other)))
            };
        }
        if let Some(help) = self.key_of_outer_table(name, path) {
            return (None, help);
        }
        let mut keys: Vec<String> = properties.keys().map(|key| format!("`{key}`")).collect();
        keys.sort();
        let elsewhere = match listing(&elsewhere) {
            list if list.is_empty() => String::new(),
            list => format!("`{name}` is a key of {list}; "),
        };
        let here = match path {
            "" => "the top-level keys".to_owned(),
            path => format!("the keys of `{}`", strip_indices(path)),
        };
        (None, format!("{elsewhere}{here} are {}", keys.join(", ")))
    }

    /// Help for a key below the header of an inner table that belongs to a table around it, because a header reaches to the next one.
    fn key_of_outer_table(&self, name: &str, path: &str) -> Option<String> {
        let here = strip_indices(path);
        if path.is_empty() {
            return None;
        }
        if !self.schema["properties"][name].is_null()
            && !items_are_tables(self.schema, &self.schema["properties"][name])
        {
            return Some(format!("`{name}` belongs to no table: move it to the top, above the first [table]"));
        }
        let tables = self.tables_with_key(name, "");
        let mut outer = here.as_str();
        while let Some((front, _)) = outer.rsplit_once('.') {
            outer = front;
            let header = format!("[{outer}]");
            if tables.iter().any(|table| *table == header || table.starts_with(&format!("{header} of kind"))) {
                return Some(format!(
                    "`{name}` is a key of [{outer}], but stands below [{here}]: move it up, above [{here}]"
                ));
            }
        }
        None
    }

    fn missing_key(&mut self, name: &str, property: &Value, place: &Range<usize>, path: &str) {
        let resolved = resolve(self.schema, property);
        let description = property["description"].as_str().or(resolved["description"].as_str()).unwrap_or("");
        let full = join(path, name);
        let header = strip_indices(&full);
        let add = if resolved["properties"].is_object() || !kinds(resolved).is_empty() {
            format!("add [{header}]")
        } else if type_name(resolved) == "array" && items_are_tables(self.schema, resolved) {
            format!("add [[{header}]]")
        } else {
            let value = match resolved["enum"].as_array().map(Vec::as_slice) {
                Some([only]) => only.to_string(),
                _ => "...".to_owned(),
            };
            format!("add `{name} = {value}`")
        };
        let help = format!("{add}. {}", about(name, description));
        self.report(ProblemKind::MissingKey, &full, (place.clone(), None), "missing key".to_owned(), &help);
    }

    /// Tables of the schema that have a key of this name: those beside `path`, such as other laws, or else all.
    fn tables_with_key(&self, key: &str, path: &str) -> Vec<String> {
        let mut tables = Vec::new();
        self.search(self.schema, key, "", 0, &mut tables);
        tables.sort();
        tables.dedup();
        let here = strip_indices(path);
        let Some((outer, _)) = here.rsplit_once('.') else { return tables };
        let (beside, others): (Vec<_>, Vec<_>) =
            tables.into_iter().partition(|table| table.starts_with(&format!("[{outer}.")));
        if beside.is_empty() { others } else { beside }
    }

    fn search(&self, schema: &Value, key: &str, path: &str, depth: usize, tables: &mut Vec<String>) {
        // No table is nested deeper than material → law, with its choices.
        if depth > 4 {
            return;
        }
        let schema = resolve(self.schema, schema);
        for variant in schema["oneOf"].as_array().into_iter().flatten() {
            self.search(variant, key, path, depth + 1, tables);
        }
        for (name, property) in schema["properties"].as_object().into_iter().flatten() {
            let inner = resolve(self.schema, property);
            if name == key && !path.is_empty() {
                let kind = schema["properties"]["kind"]["const"].as_str();
                let kind = kind.map_or(String::new(), |kind| format!(" of kind \"{kind}\""));
                tables.push(format!("[{path}]{kind}"));
            }
            let next = if type_name(inner) == "array" { &inner["items"] } else { inner };
            self.search(next, key, &join(path, name), depth + 1, tables);
        }
    }
}
