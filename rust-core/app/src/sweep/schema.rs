//! The JSON Schema of sweep files, for editors.

use serde_json::{Value, json};

use super::curve::MOST_ORDINATES;
use super::sampling::MOST_SAMPLES;

/// JSON Schema of a sweep.
pub fn schema() -> Value {
    let range = |what: &str| {
        json!({
            "description": format!("Values of {what} spacing, both ends included; without `count`, [sampling] samples them."),
            "type": "object",
            "properties": {
                "from": { "description": "First value. Required.", "type": "number" },
                "to": { "description": "Last value. Required.", "type": "number" },
                "count": { "description": "Number of values; default: sampled.", "type": "integer", "minimum": 2, "maximum": 10_000 }
            },
            "required": ["from", "to"],
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
            "sampling": of_sampling(),
            "curve": { "description": "Curves of runs.", "type": "array", "items": of_curve() },
            "axis": { "description": "Axes; at least one.", "type": "array", "items": axis, "minItems": 1 }
        },
        "required": ["version", "scenario", "axis"],
        "additionalProperties": false
    })
}

/// The table `[sampling]`.
fn of_sampling() -> Value {
    json!({
        "description": "Samples all axes with a range without `count` together; the samples count as one axis.",
        "type": "object",
        "properties": {
            "method": {
                "description": "Sobol sequence, scrambled by the seed; Latin hypercube: each of `count` equal parts of each axis has one \
                                sample; or independent random samples. Required.",
                "enum": ["sobol", "latin-hypercube", "random"]
            },
            "count": {
                "description": "Number of samples. Required.",
                "type": "integer", "minimum": 1, "maximum": MOST_SAMPLES
            },
            "seed": { "description": "Seed; default: 1.", "type": "integer", "minimum": 0, "maximum": u32::MAX }
        },
        "required": ["method", "count"],
        "additionalProperties": false
    })
}

/// The table `[[curve]]`.
fn of_curve() -> Value {
    json!({
        "description": "A curve of each run: one series over another, at abscissas that all points share.",
        "type": "object",
        "properties": {
            "name": { "description": "Name; default: \"y over x\" with the names of both series.", "type": "string", "minLength": 1 },
            "x": { "description": "Series or component of an operator, such as \"strain\". Required.", "type": "string" },
            "y": { "description": "Series or component of an operator, such as \"stress\". Required.", "type": "string" },
            "from": { "description": "First abscissa. Required.", "type": "number" },
            "to": { "description": "Last abscissa. Required.", "type": "number" },
            "count": {
                "description": "Number of abscissas, both ends included. Required.",
                "type": "integer", "minimum": 2, "maximum": MOST_ORDINATES
            }
        },
        "required": ["x", "y", "from", "to", "count"],
        "additionalProperties": false
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::schema::SWEEPS;

    /// Keys of a table, and what the reader says about a key.
    type Reader<'a> = (&'a Value, &'a dyn Fn(&str) -> String);

    /// The keys of a table in the schema that the reader does not know.
    fn unknown(properties: &Value, read: &dyn Fn(&str) -> String) -> Vec<String> {
        let keys = properties.as_object().expect("a table").keys();
        keys.filter(|key| read(key).contains("unknown field")).cloned().collect()
    }

    /// The schema has exactly the keys of the reader, and those of the templates.
    #[test]
    fn keys_are_those_of_the_reader() {
        let schema = schema();
        let axis = &schema["properties"]["axis"]["items"]["properties"];
        let text = |error: toml::de::Error| error.to_string();
        let sweep = |key: &str| {
            toml::from_str::<super::super::Written>(&format!("{key} = {{}}")).map_or_else(text, |_| String::new())
        };
        let within = |head: &'static str| move |key: &str| sweep(&format!("{head}\n{key}"));
        let (of_axis, of_sampling, of_curve) = (within("[[axis]]"), within("[sampling]"), within("[[curve]]"));
        let range = within("[[axis]]\n[axis.linear]");
        let sampling = &schema["properties"]["sampling"]["properties"];
        let curve = &schema["properties"]["curve"]["items"]["properties"];
        let readers: [Reader<'_>; 5] = [
            (&schema["properties"], &sweep),
            (axis, &of_axis),
            (&axis["linear"]["properties"], &range),
            (sampling, &of_sampling),
            (curve, &of_curve),
        ];
        for (properties, read) in readers {
            assert!(unknown(properties, read).is_empty());
            // The error for an unknown key lists the keys that the reader knows.
            let message = read("nonsense");
            let known: Vec<&str> = message.split('`').skip(3).step_by(2).collect();
            assert!(known.len() > 2, "{message}");
            assert!(known.iter().all(|key| properties.get(*key).is_some()), "{message}");
        }
        for (sweep, _) in SWEEPS {
            let template: toml::Table = toml::from_str(sweep.text).expect("the template");
            assert!(template.keys().all(|key| schema["properties"].get(key).is_some()), "{template:?}");
        }
    }
}
