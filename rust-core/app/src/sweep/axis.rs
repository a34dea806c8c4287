//! Axes of a sweep: keys of a scenario and their values.

use serde::Deserialize;

use super::sampling::{Sampled, Scale};

/// One axis of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name in tables and figures.
    pub name: String,
    /// Keys of the scenario that the axis sets.
    pub keys: Vec<String>,
    /// Values of all keys, for each point of the axis.
    pub values: Vec<Vec<toml::Value>>,
    /// Whether figures show the mean over this axis.
    pub average: bool,
    /// The range of a sampled axis, whose values belong together with those of the other sampled axes.
    pub sampled: Option<Sampled>,
}

impl Axis {
    /// Value `k` if it is a single number or a list of equal numbers.
    pub fn number(&self, k: usize) -> Option<f64> {
        fn of(value: &toml::Value) -> Option<f64> {
            match value {
                toml::Value::Integer(value) => Some(*value as f64),
                toml::Value::Float(value) => Some(*value),
                // The edges of a cube.
                toml::Value::Array(values) => {
                    let first = of(values.first()?)?;
                    values.iter().all(|other| of(other) == Some(first)).then_some(first)
                }
                _ => None,
            }
        }
        if let [value] = &self.values[k][..] { of(value) } else { None }
    }

    /// Value `k` as text.
    pub fn text(&self, k: usize) -> String {
        let one = |value: &toml::Value| match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        self.values[k].iter().map(one).collect::<Vec<_>>().join(", ")
    }
}

/// Error of an axis.
pub(super) struct AxisError {
    /// The wrong key; empty if the problem concerns the axis as a whole.
    pub key: &'static str,
    /// What is wrong.
    pub message: String,
    /// Remedy.
    pub help: &'static str,
}

impl AxisError {
    fn new(key: &'static str, message: &str, help: &'static str) -> Self {
        Self { key, message: message.to_owned(), help }
    }
}

/// An axis as written in the file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct WrittenAxis {
    name: Option<String>,
    key: Option<String>,
    keys: Option<Vec<String>>,
    values: Option<Vec<toml::Value>>,
    linear: Option<Range>,
    logarithmic: Option<Range>,
    #[serde(default)]
    average: bool,
}

#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Range {
    from: f64,
    to: f64,
    /// Without it, the axis is sampled.
    count: Option<usize>,
}

impl WrittenAxis {
    /// The range of a sampled axis, its scale, and its key in the file.
    fn range(&self) -> Option<(Range, Scale, &'static str)> {
        let linear = self.linear.map(|range| (range, Scale::Linear, "linear"));
        linear.or_else(|| self.logarithmic.map(|range| (range, Scale::Logarithmic, "logarithmic")))
    }

    /// Whether the axis has a range without a count.
    pub(super) fn is_sampled(&self) -> bool {
        self.range().is_some_and(|(range, ..)| range.count.is_none())
    }

    /// The axis with all its values. `samples`: numbers from 0 to 1 of a sampled axis, none without `[sampling]`.
    pub(super) fn resolve(self, samples: Option<&[f64]>) -> Result<Axis, AxisError> {
        let range = self.range();
        let keys = match (self.key, self.keys) {
            (Some(key), None) => vec![key],
            (None, Some(keys)) if !keys.is_empty() => keys,
            _ => {
                return Err(AxisError::new(
                    "",
                    "an axis needs either `key` or `keys`",
                    "write key = \"bonds.interaction_ratio\"",
                ));
            }
        };
        let ways = [self.values.is_some(), self.linear.is_some(), self.logarithmic.is_some()];
        if ways.iter().filter(|given| **given).count() != 1 {
            let message = "an axis needs one of `values`, `linear`, `logarithmic`";
            return Err(AxisError::new("", message, "write values = [1, 2, 3]"));
        }
        let (values, sampled) = match range {
            None => (rows(self.values.unwrap_or_default(), keys.len())?, None),
            Some((range, scale, key)) => range.values(scale, key, samples)?,
        };
        if values.is_empty() {
            return Err(AxisError::new("values", "the axis has no values", "give at least one"));
        }
        if keys.len() > 1 && values[0].len() != keys.len() {
            return Err(AxisError::new(
                "keys",
                "a range can set only one key",
                "write values = [[...], [...]] for several keys",
            ));
        }
        if self.average && sampled.is_some() {
            return Err(AxisError::new(
                "average",
                "a sampled axis has no mean: its values belong to those of the other sampled axes",
                "remove the key",
            ));
        }
        let name = self.name.unwrap_or_else(|| keys.join(", "));
        Ok(Axis { name, keys, values, average: self.average, sampled })
    }
}

/// One list per point, with a value for each key.
fn rows(values: Vec<toml::Value>, keys: usize) -> Result<Vec<Vec<toml::Value>>, AxisError> {
    let row = |value| {
        let row = match value {
            toml::Value::Array(row) if keys > 1 => row,
            value => vec![value],
        };
        if row.len() == keys {
            return Ok(row);
        }
        let message = format!("there are {keys} keys, but a point has {} values", row.len());
        Err(AxisError::new("values", &message, "give one list per point, with one value for each key"))
    };
    values.into_iter().map(row).collect()
}

/// One list per point, with the value of the only key; and the range, if it is sampled.
type Values = (Vec<Vec<toml::Value>>, Option<Sampled>);

impl Range {
    /// The values of the range: at equal intervals if it has a count, with both ends exactly as written; else at the samples.
    fn values(self, scale: Scale, key: &'static str, samples: Option<&[f64]>) -> Result<Values, AxisError> {
        let Self { from, to, count } = self;
        if scale == Scale::Logarithmic && !(from > 0.0 && to > 0.0) {
            let message = format!("a range from {from} to {to} cannot be logarithmic");
            return Err(AxisError::new(key, &message, "both ends must be positive"));
        }
        let floats = |numbers: Vec<f64>| numbers.into_iter().map(|number| vec![toml::Value::Float(number)]).collect();
        let refused = |message: &str, help| Err(AxisError::new(key, message, help));
        match (count, samples) {
            (None, None) => refused(
                "the range has no `count`, and the sweep has no [sampling]",
                "write count = 5 in the range; or, to sample the axis, add [sampling] with method = \"sobol\" and count = 64",
            ),
            (None, Some(samples)) if from.is_finite() && to.is_finite() => {
                let sampled = Sampled { from, to, scale };
                Ok((floats(samples.iter().map(|&share| sampled.at(share)).collect()), Some(sampled)))
            }
            (None, Some(_)) => refused(&format!("a range from {from} to {to} is not possible"), "give finite ends"),
            (Some(count), _) if (2..=10_000).contains(&count) && from.is_finite() && to.is_finite() => {
                Ok((floats(spaced(from, to, count, scale)), None))
            }
            (Some(count), _) => refused(
                &format!("a range of {count} values from {from} to {to} is not possible"),
                "give finite ends and a count from 2 to 10000",
            ),
        }
    }
}

/// Numbers at equal intervals of the scale; both ends are exactly as written.
pub(super) fn spaced(from: f64, to: f64, count: usize, scale: Scale) -> Vec<f64> {
    let range = Sampled { from, to, scale };
    let one = |k: usize| match k {
        0 => from,
        _ if k + 1 == count => to,
        _ => range.at(k as f64 / (count - 1) as f64),
    };
    (0..count).map(one).collect()
}

/// Sets the value at a key path such as `material[0].cpm.young`. Tables on the path must exist; the last key need not.
pub(super) fn set(table: &mut toml::Table, path: &str, new: toml::Value) -> Result<(), String> {
    let segments: Vec<&str> = path.split(['.', '[', ']']).filter(|segment| !segment.is_empty()).collect();
    let Some((last, way)) = segments.split_last() else { return Err("the key is empty".into()) };
    let mut place: Option<&mut toml::Value> = None;
    for (k, segment) in way.iter().enumerate() {
        let next = match place {
            None => table.get_mut(*segment),
            Some(toml::Value::Table(table)) => table.get_mut(*segment),
            Some(toml::Value::Array(items)) => segment.parse().ok().and_then(|k: usize| items.get_mut(k)),
            Some(_) => None,
        };
        let Some(next) = next else {
            return Err(format!("the scenario has no `{}`, needed for `{path}`", way[..=k].join(".")));
        };
        place = Some(next);
    }
    match place {
        None => {
            table.insert((*last).to_owned(), new);
        }
        Some(toml::Value::Table(table)) => {
            table.insert((*last).to_owned(), new);
        }
        Some(toml::Value::Array(items)) => {
            let item = last.parse().ok().and_then(|k: usize| items.get_mut(k));
            *item.ok_or_else(|| format!("`{path}` names an item that does not exist"))? = new;
        }
        Some(_) => return Err(format!("`{path}` names a key of a value that is not a table")),
    }
    Ok(())
}
