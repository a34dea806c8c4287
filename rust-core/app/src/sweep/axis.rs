//! Axes of a sweep: keys of a scenario and their values.

use serde::Deserialize;

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
    count: usize,
}

impl WrittenAxis {
    /// The axis with all its values.
    pub(super) fn resolve(self) -> Result<Axis, AxisError> {
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
        let several = keys.len() > 1;
        let values = match (self.values, self.linear, self.logarithmic) {
            (Some(values), None, None) => rows(values, keys.len())?,
            (None, Some(range), None) => {
                range.numbers("linear", &|share| range.from + (range.to - range.from) * share)?
            }
            (None, None, Some(range)) => {
                if !(range.from > 0.0 && range.to > 0.0) {
                    let message = format!("a range from {} to {} cannot be logarithmic", range.from, range.to);
                    return Err(AxisError::new("logarithmic", &message, "both ends must be positive"));
                }
                let (low, high) = (range.from.ln(), range.to.ln());
                range.numbers("logarithmic", &|share| (low + (high - low) * share).exp())?
            }
            _ => {
                let message = "an axis needs one of `values`, `linear`, `logarithmic`".to_owned();
                return Err(AxisError::new("", &message, "write values = [1, 2, 3]"));
            }
        };
        if values.is_empty() {
            return Err(AxisError::new("values", "the axis has no values", "give at least one"));
        }
        if several && values[0].len() != keys.len() {
            return Err(AxisError::new(
                "keys",
                "a range can set only one key",
                "write values = [[...], [...]] for several keys",
            ));
        }
        let name = self.name.unwrap_or_else(|| keys.join(", "));
        Ok(Axis { name, keys, values, average: self.average })
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

impl Range {
    /// Numbers at equal intervals; both ends are exactly as written.
    fn numbers(&self, name: &'static str, at: &dyn Fn(f64) -> f64) -> Result<Vec<Vec<toml::Value>>, AxisError> {
        if !((2..=10_000).contains(&self.count) && self.from.is_finite() && self.to.is_finite()) {
            let message = format!("a range of {} values from {} to {} is not possible", self.count, self.from, self.to);
            return Err(AxisError::new(name, &message, "give finite ends and a count from 2 to 10000"));
        }
        let one = |k: usize| match k {
            0 => self.from,
            _ if k + 1 == self.count => self.to,
            // Twelve digits avoid rounding noise in tables.
            _ => format!("{:.11e}", at(k as f64 / (self.count - 1) as f64)).parse().unwrap_or(f64::NAN),
        };
        Ok((0..self.count).map(|k| vec![toml::Value::Float(one(k))]).collect())
    }
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
