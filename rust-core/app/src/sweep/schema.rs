//! The JSON Schema of sweep files, for editors.

use serde_json::{Value, json};

/// JSON Schema of a sweep.
pub fn schema() -> Value {
    let range = |what: &str| {
        json!({
            "description": format!("Values of {what} spacing, both ends included."),
            "type": "object",
            "properties": {
                "from": { "description": "First value. Required.", "type": "number" },
                "to": { "description": "Last value. Required.", "type": "number" },
                "count": { "description": "Number of values. Required.", "type": "integer", "minimum": 2 }
            },
            "required": ["from", "to", "count"],
            "additionalProperties": false
        })
    };
    let axis = json!({
        "description": "One axis: `key` or `keys`, and one of `values`, `linear`, `logarithmic`.",
        "type": "object",
        "properties": {
            "name": { "description": "Name in tables and figures; default: the key.", "type": "string" },
            "key": { "description": "Key of the scenario, such as `bonds.interaction_ratio`.", "type": "string" },
            "keys": {
                "description": "Keys that are set together.",
                "type": "array", "items": { "type": "string" }, "minItems": 1
            },
            "values": { "description": "Values; with `keys`, one list per point.", "type": "array", "minItems": 1 },
            "linear": range("equal"),
            "logarithmic": range("logarithmic"),
            "average": { "description": "Whether figures show the mean over this axis; default: false.", "type": "boolean" }
        },
        "additionalProperties": false
    });
    json!({
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        "title": "Sweep",
        "description": "Elastic constants, structures of packings, or results of runs, for all combinations of values of a scenario's keys.",
        "type": "object",
        "properties": {
            "version": { "description": "Version of the format. Required: `version = 1`.", "enum": [1] },
            "title": { "description": "Title for the web page; default: empty.", "type": "string" },
            "scenario": { "description": "Path of the scenario, relative to the sweep. Required.", "type": "string" },
            "study": {
                "description": "What to compute: \"elastic\" constants of bonded periodic packings, the \"structure\" of any packing, or \
                                results of whole runs (\"run\"); default: \"elastic\".",
                "enum": ["elastic", "structure", "run"]
            },
            "results": {
                "description": "Results of runs: properties (E, E_gauge, f_t, f_c, strain_at_peak, f_fl, f_st, K_Ic, G_F, rises_at_end), series and \
                                components of operators, alone (last value) or after max, min, mean; default: E, f_t, f_c, \
                                strain_at_peak, rises_at_end, last broken.",
                "type": "array", "items": { "type": "string" }, "minItems": 1
            },
            "dynamics": { "description": "Whether to relax the packing dynamically, too; default: false.", "type": "boolean" },
            "residual": {
                "description": "Relative residual of the static solution; default: 1e-11.",
                "type": "number", "exclusiveMinimum": 0, "exclusiveMaximum": 1e-3
            },
            "axis": { "description": "Axes; at least one.", "type": "array", "items": axis, "minItems": 1 }
        },
        "required": ["version", "scenario", "axis"],
        "additionalProperties": false
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::schema::SWEEP;

    /// The keys of a table in the schema that the reader does not know.
    fn unknown(properties: &Value, read: &dyn Fn(&str) -> String) -> Vec<String> {
        let keys = properties.as_object().expect("a table").keys();
        keys.filter(|key| read(key).contains("unknown field")).cloned().collect()
    }

    /// The schema has exactly the keys of the reader, and those of the template.
    #[test]
    fn keys_are_those_of_the_reader() {
        let schema = schema();
        let axis = &schema["properties"]["axis"]["items"]["properties"];
        let text = |error: toml::de::Error| error.to_string();
        let sweep = |key: &str| {
            toml::from_str::<super::super::Written>(&format!("{key} = {{}}")).map_or_else(text, |_| String::new())
        };
        let of_axis = |key: &str| sweep(&format!("[[axis]]\n{key}"));
        assert!(unknown(&schema["properties"], &sweep).is_empty());
        assert!(unknown(axis, &of_axis).is_empty());
        // The error for an unknown key lists the keys that the reader knows.
        for (message, properties) in [(sweep("nonsense"), &schema["properties"]), (of_axis("nonsense"), axis)] {
            let known: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
            assert!(known.len() > 5, "{message}");
            assert!(known.iter().all(|key| properties.get(*key).is_some()), "{message}");
        }
        let template: toml::Table = toml::from_str(SWEEP.text).expect("the template");
        assert!(template.keys().all(|key| schema["properties"].get(key).is_some()), "{template:?}");
    }
}
