//! The keys of a scenario with their meaning, as the JSON Schema describes them.

use serde_json::Value;

use super::json_schema::{items_are_tables, kinds, resolve, type_name, words};
use super::wording::{join, nearest};

/// A key of a scenario.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct KeyInfo {
    /// Path without indices, such as `material.cpm.young`.
    pub path: String,
    /// The values of `kind` with which its table has the key; empty if every table has it.
    pub kinds: Vec<String>,
    /// Meaning, unit, default, and example.
    pub description: String,
    /// What a value is: "length (m, cm, mm, um)", "integer", "word", "table".
    pub value: String,
    /// Allowed words with their meaning.
    pub words: Vec<(String, String)>,
    /// Whether its table must have it.
    pub required: bool,
}

/// All keys of a schema, in the order of their paths.
pub fn keys(schema: &Value) -> Vec<KeyInfo> {
    let mut found = Vec::new();
    walk(schema, schema, "", None, 0, &mut found);
    found.sort_by(|a, b| (&a.path, &a.kinds).cmp(&(&b.path, &b.kinds)));
    // The same key of several kinds of a table is one entry.
    let mut merged: Vec<KeyInfo> = Vec::new();
    for key in found {
        let same = |other: &&mut KeyInfo| KeyInfo { kinds: key.kinds.clone(), ..(**other).clone() } == key;
        match merged.iter_mut().rev().take_while(|other| other.path == key.path).find(same) {
            Some(other) => {
                let new: Vec<String> = key.kinds.into_iter().filter(|kind| !other.kinds.contains(kind)).collect();
                other.kinds.extend(new);
            }
            None => merged.push(key),
        }
    }
    merged
}

/// The keys that a word names: the whole path, its last parts, or, if there are none, the most similar keys (`false`).
pub fn find<'a>(keys: &'a [KeyInfo], word: &str) -> (Vec<&'a KeyInfo>, bool) {
    let word: String = super::wording::strip_indices(word.trim());
    let ends = |key: &&KeyInfo| key.path == word || key.path.ends_with(&format!(".{word}"));
    let exact: Vec<&KeyInfo> = keys.iter().filter(ends).collect();
    if !exact.is_empty() {
        return (exact, true);
    }
    let last = |path: &'a str| path.rsplit('.').next().unwrap_or(path);
    let by_path = nearest(&word, keys.iter().map(|key| key.path.as_str()));
    let by_name = nearest(last_part(&word), keys.iter().map(|key| last(&key.path)));
    let mut similar: Vec<&KeyInfo> =
        keys.iter().filter(|key| Some(key.path.as_str()) == by_path || Some(last(&key.path)) == by_name).collect();
    similar.dedup_by(|a, b| a.path == b.path);
    (similar, false)
}

fn last_part(word: &str) -> &str {
    word.rsplit('.').next().unwrap_or(word)
}

/// Adds the keys of a table; `kind`: that of this variant of the table.
fn walk(root: &Value, schema: &Value, path: &str, kind: Option<&str>, depth: usize, found: &mut Vec<KeyInfo>) {
    // No table is nested deeper than material → law, with its choices.
    if depth > 6 {
        return;
    }
    let schema = resolve(root, schema);
    for variant in schema["oneOf"].as_array().into_iter().flatten() {
        if let Some(kind) = variant["properties"]["kind"]["const"].as_str() {
            walk(root, variant, path, Some(kind), depth + 1, found);
        }
    }
    let choice = kinds(schema);
    if !choice.is_empty() {
        let meaning = |kind: &str| {
            let variant = schema["oneOf"].as_array()?.iter().find(|one| one["properties"]["kind"]["const"] == kind)?;
            variant["description"].as_str().map(str::to_owned)
        };
        found.push(KeyInfo {
            path: join(path, "kind"),
            kinds: Vec::new(),
            description: "Kind of the table, which determines its other keys. Required.".into(),
            value: "word".into(),
            words: choice.iter().map(|kind| ((*kind).to_owned(), meaning(kind).unwrap_or_default())).collect(),
            required: true,
        });
    }
    let required = |name: &str| schema["required"].as_array().is_some_and(|list| list.iter().any(|one| one == name));
    for (name, property) in schema["properties"].as_object().into_iter().flatten() {
        if property["const"].is_string() {
            continue;
        }
        let inner = resolve(root, property);
        let full = join(path, name);
        let text = property["description"].as_str().or(inner["description"].as_str()).unwrap_or_default();
        found.push(KeyInfo {
            path: full.clone(),
            kinds: kind.map(str::to_owned).into_iter().collect(),
            description: text.replace('\n', " "),
            value: value(root, inner),
            words: meanings(inner),
            required: required(name),
        });
        let next = if type_name(inner) == "array" { &inner["items"] } else { inner };
        walk(root, next, &full, None, depth + 1, found);
    }
}

/// What a value of this schema is.
fn value(root: &Value, schema: &Value) -> String {
    let list =
        |name: &str| -> Vec<&str> { schema[name].as_array().into_iter().flatten().filter_map(Value::as_str).collect() };
    if let Some(dimension) = schema["x-dimension"].as_str() {
        let words: Vec<String> = list("x-words").iter().map(|word| format!(", or \"{word}\"")).collect();
        return match list("x-units").join(", ") {
            units if units == "1" => format!("{dimension}{}", words.concat()),
            units => format!("{dimension} ({units}){}", words.concat()),
        };
    }
    if words(schema).is_some() {
        return "word".into();
    }
    if schema["properties"].is_object() || !kinds(schema).is_empty() {
        return "table".into();
    }
    match type_name(schema) {
        "array" if items_are_tables(root, schema) => "list of tables".into(),
        "array" => format!("list: {}", value(root, resolve(root, &schema["items"]))),
        "boolean" => "true or false".into(),
        other => other.into(),
    }
}

/// Allowed words with their meaning.
fn meanings(schema: &Value) -> Vec<(String, String)> {
    let Some(words) = words(schema) else { return Vec::new() };
    let meaning = |word: &str| {
        let one = schema["oneOf"].as_array()?.iter().find(|one| one["const"] == word)?;
        Some(one["description"].as_str()?.replace('\n', " "))
    };
    words.into_iter().map(|word| (word.to_owned(), meaning(word).unwrap_or_default())).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_found_by_path_by_name_and_by_likeness() {
        let keys = keys(&crate::schema::schema());
        let paths = |word: &str| -> Vec<&str> { find(&keys, word).0.iter().map(|key| key.path.as_str()).collect() };
        assert_eq!(paths("material[0].cpm.young"), ["material.cpm.young"]);
        assert!(paths("young").contains(&"material.cohesive_beam.young"));
        let (similar, exact) = find(&keys, "strain_rat");
        assert!(!exact && similar.iter().any(|key| key.path == "loading.strain_rate"), "{similar:?}");
        // One wrong letter is nearer than a shorter key that begins the word, with and without the table.
        for word in ["strain_rte", "loading.strain_rte"] {
            let (similar, exact) = find(&keys, word);
            assert!(!exact && similar.iter().any(|key| key.path == "loading.strain_rate"), "{word}: {similar:?}");
        }
        assert!(find(&keys, "qqqqqq").0.is_empty());
        // A key of several kinds, a choice of words, a quantity.
        let (radius, _) = find(&keys, "packing.radius");
        assert!(radius.iter().any(|key| key.kinds.contains(&"cooker".to_owned())), "{radius:?}");
        let (mode, _) = find(&keys, "material.cpm.mode");
        assert!(mode[0].words.iter().any(|(word, meaning)| word == "thesis" && !meaning.is_empty()), "{mode:?}");
        assert!(find(&keys, "loading.strain_rate").0[0].value.contains("1/s"));
        // Every key says what it means.
        for key in &keys {
            assert!(!key.description.is_empty() && !key.value.is_empty(), "{key:?}");
            // A table of several kinds, in a table of several kinds, names each once.
            assert!(key.kinds.iter().enumerate().all(|(k, kind)| !key.kinds[..k].contains(kind)), "{key:?}");
        }
    }
}
