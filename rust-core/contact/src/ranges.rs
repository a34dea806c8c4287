//! Ranges of numbers as the schema of a table has them.

use schemars::JsonSchema;
use serde::Serialize;
use serde_json::Value;

/// What a number must be, such as "at least 0 and at most 1 m", if it is not; `bound`: a limit by its name in a JSON schema.
pub fn violated(bound: impl Fn(&str) -> Option<f64>, number: f64, unit: &str) -> Option<String> {
    let unit = if unit == "1" || unit.is_empty() { String::new() } else { format!(" {unit}") };
    let limits = [
        (bound("minimum"), "at least", (|x, limit| x < limit) as fn(f64, f64) -> bool),
        (bound("exclusiveMinimum"), "greater than", |x, limit| x <= limit),
        (bound("maximum"), "at most", |x, limit| x > limit),
        (bound("exclusiveMaximum"), "less than", |x, limit| x >= limit),
    ];
    let mut demands = Vec::new();
    let mut broken = false;
    for (limit, phrase, outside) in limits {
        if let Some(limit) = limit {
            let zero_unit = if limit == 0.0 { "" } else { unit.as_str() };
            demands.push(format!("{phrase} {limit}{zero_unit}"));
            broken |= outside(number, limit);
        }
    }
    broken.then(|| demands.join(" and "))
}

/// The first number of a table outside of its range: its key, such as `source[0].power`, and what it must be.
pub fn first_violation<T: JsonSchema + Serialize>(table: &T) -> Option<(String, String)> {
    let schema = schemars::schema_for!(T).to_value();
    // Quantities are finite, so that every number is one in JSON.
    let table = serde_json::to_value(table).ok()?;
    Walk { definitions: &schema["$defs"] }.visit(&[&schema], &table, "")
}

struct Walk<'a> {
    definitions: &'a Value,
}

impl<'a> Walk<'a> {
    /// `schemas`: what is said about the value, the declaration of its key first.
    fn visit(&self, schemas: &[&'a Value], value: &Value, key: &str) -> Option<(String, String)> {
        let mut all = Vec::new();
        for schema in schemas {
            self.collect(schema, &mut all);
        }
        let member = |part: &str| all.iter().map(|schema| &schema[part]).find(|found| !found.is_null());
        match value {
            Value::Number(number) => {
                let unit = member("x-units").and_then(|units| units[0].as_str()).unwrap_or_default();
                let bound = |name: &str| member(name).and_then(Value::as_f64);
                violated(bound, number.as_f64()?, unit).map(|demands| (key.to_owned(), format!("must be {demands}")))
            }
            Value::Object(fields) => fields.iter().find_map(|(name, field)| {
                let declared = all.iter().map(|schema| &schema["properties"][name]).find(|found| !found.is_null())?;
                let key = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                self.visit(&[declared], field, &key)
            }),
            Value::Array(items) => {
                let declared = member("items")?;
                items.iter().enumerate().find_map(|(at, item)| self.visit(&[declared], item, &format!("{key}[{at}]")))
            }
            _ => None,
        }
    }

    /// The schema with those that it refers to.
    fn collect(&self, schema: &'a Value, all: &mut Vec<&'a Value>) {
        all.push(schema);
        let name = schema["$ref"].as_str().and_then(|reference| reference.strip_prefix("#/$defs/"));
        let others = ["anyOf", "oneOf", "allOf"].into_iter().filter_map(|list| schema[list].as_array());
        let others = name.map(|name| &self.definitions[name]).into_iter().chain(others.flatten());
        others.for_each(|other| self.collect(other, all));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heat::Heat;

    fn heat(text: &str) -> Option<(String, String)> {
        let mut table = serde_json::json!({ "temperature": 300 });
        let more: serde_json::Map<String, Value> = serde_json::from_str(text).unwrap();
        table.as_object_mut().unwrap().extend(more);
        first_violation(&serde_json::from_value::<Heat>(table).unwrap())
    }

    #[test]
    fn numbers_of_nested_tables_are_compared_with_their_schemas() {
        assert_eq!(heat("{}"), None);
        for (text, key, demand) in [
            (r#"{"temperature": -1}"#, "temperature", "must be at least 0"),
            (r#"{"reference_temperature": -1}"#, "reference_temperature", "must be at least 0"),
            (r#"{"time_factor": 0}"#, "time_factor", "must be greater than 0"),
            (r#"{"contact": {"resistance": -1}}"#, "contact.resistance", "must be at least 0"),
            (
                r#"{"initial": [{"set": "a", "temperature": 1}, {"set": "a", "temperature": -1}]}"#,
                "initial[1].temperature",
                "must be at least 0",
            ),
            (
                r#"{"boundary": [{"convection": {"coefficient": 0, "ambient": 1}}]}"#,
                "boundary[0].convection.coefficient",
                "must be greater than 0",
            ),
            (
                r#"{"boundary": [{"radiation": {"emissivity": 2, "ambient": 1}}]}"#,
                "boundary[0].radiation.emissivity",
                "must be greater than 0 and at most 1",
            ),
            (
                r#"{"source": [{"spot": {"center": [0, 0, 0], "radius": 0}}]}"#,
                "source[0].spot.radius",
                "must be greater than 0",
            ),
        ] {
            assert_eq!(heat(text), Some((key.to_owned(), demand.to_owned())), "{text}");
        }
        for text in
            [r#"{"boundary": [{"radiation": {"emissivity": 1, "ambient": 0}}]}"#, r#"{"contact": {"resistance": 0}}"#]
        {
            assert_eq!(heat(text), None, "{text}");
        }
    }
}
