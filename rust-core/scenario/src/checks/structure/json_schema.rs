//! Look-ups in a JSON Schema.

use serde_json::Value;

/// Follows `$ref`, and `anyOf` with null, which is how schemars writes an optional table.
pub(super) fn resolve<'a>(root: &'a Value, mut schema: &'a Value) -> &'a Value {
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

/// The allowed words, if the schema is a choice of words.
pub(super) fn words(schema: &Value) -> Option<Vec<&str>> {
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

/// The allowed values of `kind`, if the schema is a tagged choice.
pub(super) fn kinds(schema: &Value) -> Vec<&str> {
    schema["oneOf"]
        .as_array()
        .into_iter()
        .flatten()
        .filter_map(|variant| variant["properties"]["kind"]["const"].as_str())
        .collect()
}

/// The type that a schema requires, apart from null.
pub(super) fn type_name(schema: &Value) -> &str {
    match &schema["type"] {
        Value::String(name) => name,
        Value::Array(names) => names.iter().filter_map(Value::as_str).find(|name| *name != "null").unwrap_or(""),
        _ => "",
    }
}

/// Whether the items of an array are tables.
pub(super) fn items_are_tables(root: &Value, schema: &Value) -> bool {
    let items = resolve(root, &schema["items"]);
    items["properties"].is_object() || items["oneOf"].is_array()
}
