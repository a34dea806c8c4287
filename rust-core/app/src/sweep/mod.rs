//! Sweeps: the elastic constants of a scenario at all combinations of given values of its keys.
//!
//! A sweep is a TOML file that names a scenario and the axes:
//! ```toml
//! version = 1
//! scenario = "cell.toml"
//! [[axis]]
//! key = "bonds.interaction_ratio"
//! values = [1.25, 1.5]
//! [[axis]]
//! key = "packing.seed"
//! values = [1, 2, 3]
//! average = true
//! ```
//! Points are numbered with the last axis fastest. Packings are made once for all points that share them. Every finished
//! point is noted in a [`journal`]; what is there is not computed again, and since a point's numbers depend on nothing but
//! the point, the file at the end is the same whether or not the sweep was interrupted, on any number of threads.

pub mod journal;
pub mod point;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use concordem_scenario::schema::{Document, Problem, ProblemKind, ReadError, Scenario, ScenarioError, Source};

/// More points than this are taken for a mistake.
const MOST_POINTS: usize = 1_000_000;

/// A sweep, read and checked: every point is a valid scenario.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Name and text of the file.
    pub source: Source,
    /// Title.
    pub title: String,
    /// Path of the scenario.
    pub scenario: PathBuf,
    /// Its text.
    pub scenario_text: String,
    /// Whether the relaxed dynamics are computed, too.
    pub dynamics: bool,
    /// Relative residual of the static solution.
    pub residual: f64,
    /// Axes.
    pub axes: Vec<Axis>,
    base: toml::Table,
    /// Files that the scenarios of the points read.
    files: BTreeSet<PathBuf>,
}

/// One axis of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Name, for tables and figures.
    pub name: String,
    /// Keys of the scenario that it sets.
    pub keys: Vec<String>,
    /// Values, one for each key.
    pub values: Vec<Vec<toml::Value>>,
    /// Figures show the mean over it.
    pub average: bool,
}

impl Axis {
    /// Its value `k` as a number, where it is one.
    pub fn number(&self, k: usize) -> Option<f64> {
        match &self.values[k][..] {
            [toml::Value::Integer(value)] => Some(*value as f64),
            [toml::Value::Float(value)] => Some(*value),
            _ => None,
        }
    }

    /// Its value `k` as text.
    pub fn text(&self, k: usize) -> String {
        let one = |value: &toml::Value| match value {
            toml::Value::String(text) => text.clone(),
            other => other.to_string(),
        };
        self.values[k].iter().map(one).collect::<Vec<_>>().join(", ")
    }
}

/// The file, as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    version: u32,
    #[serde(default)]
    title: String,
    scenario: String,
    #[serde(default)]
    dynamics: bool,
    residual: Option<f64>,
    #[serde(rename = "axis", default)]
    axes: Vec<WrittenAxis>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct WrittenAxis {
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

/// Finds the text of the scenario that a sweep names, with its path.
type ReadScenario<'a> = dyn Fn(&str) -> Result<(PathBuf, String), ReadError> + 'a;

impl Sweep {
    /// Read a sweep and its scenario, and check every point.
    ///
    /// # Errors
    /// Files that cannot be read; all that is wrong with the sweep, at its place and with a remedy.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        let text = read_text(path)?;
        let source = Source { name: path.display().to_string().into(), text: text.into() };
        let mut sweep = Self::parse(source, &|scenario| {
            let path = path.parent().unwrap_or(Path::new("")).join(scenario);
            read_text(&path).map(|text| (path, text))
        })?;
        sweep.check_points()?;
        Ok(sweep)
    }

    fn parse(source: Source, read: &ReadScenario<'_>) -> Result<Self, ReadError> {
        let wrong = |problems: Vec<Problem>| ReadError::Scenario(ScenarioError::new(&source, problems));
        let document = Document::parse(&source).map_err(wrong)?;
        let written: Written = document.deserialize().map_err(|problem| {
            let help = "a sweep has version, title, scenario, dynamics, residual, and [[axis]] tables with name, key or \
                        keys, values or linear or logarithmic, and average";
            wrong(vec![Problem { help: help.to_owned(), ..problem }])
        })?;
        let problem = |kind: ProblemKind, key: String, message: String, help: &str| {
            let (span, value) = document.locate(&key);
            Problem { kind, key, value, span, message, help: help.to_owned() }
        };
        let mut problems = Vec::new();
        if written.version != 1 {
            let message = format!("version {} is not known", written.version);
            problems.push(problem(ProblemKind::OutOfRange, "version".into(), message, "write version = 1"));
        }
        let residual = written.residual.unwrap_or(concordem_statics::Accuracy::default().residual);
        if !(residual > 0.0 && residual < 1e-3) {
            let message = "a share between 0 and 1e-3 is wanted".to_owned();
            problems.push(problem(ProblemKind::OutOfRange, "residual".into(), message, "write 1e-11, or leave it out"));
        }
        if written.axes.is_empty() {
            let help = "add [[axis]] with key = \"bonds.interaction_ratio\" and values = [1.25, 1.5]";
            problems.push(problem(ProblemKind::MissingKey, "axis".into(), "there is no axis".into(), help));
        }
        let (scenario, scenario_text) = match read(&written.scenario) {
            Ok(read) => read,
            Err(ReadError::Io { path, error }) => {
                let message = format!("{} cannot be read: {error}", path.display());
                let help = "name a scenario, relative to the sweep; `concordem init` writes some";
                problems.push(problem(ProblemKind::File, "scenario".into(), message, help));
                return Err(wrong(problems));
            }
            Err(other) => return Err(other),
        };
        // What is wrong with the scenario itself is said of the scenario.
        Scenario::parse(&scenario.display().to_string(), &scenario_text)?;
        let base: toml::Table = toml::from_str(&scenario_text)
            .map_err(|error| wrong(vec![problem(ProblemKind::Syntax, "scenario".into(), error.to_string(), "")]))?;
        let mut axes: Vec<Axis> = Vec::new();
        let mut points = 1_usize;
        for (k, axis) in written.axes.into_iter().enumerate() {
            match axis.meant() {
                Ok(axis) => {
                    points = points.saturating_mul(axis.values.len());
                    for (j, key) in axis.keys.iter().enumerate() {
                        let mut trial = base.clone();
                        let twice = axes.iter().any(|axis| axis.keys.contains(key)) || axis.keys[..j].contains(key);
                        let failure = if twice {
                            Some(format!("`{key}` is set twice"))
                        } else {
                            set(&mut trial, key, axis.values[0][j].clone()).err()
                        };
                        if let Some(message) = failure {
                            let help = "keys are those of the scenario: packing.count, bonds.interaction_ratio, \
                                        material[0].cpm.shear_ratio; each one in one axis";
                            let place = format!("axis[{k}].{}", if axis.keys.len() == 1 { "key" } else { "keys" });
                            problems.push(problem(ProblemKind::UnknownKey, place, message, help));
                        }
                    }
                    axes.push(axis);
                }
                Err((part, message, help)) => {
                    let place = format!("axis[{k}]{}{part}", if part.is_empty() { "" } else { "." });
                    problems.push(problem(ProblemKind::Conflict, place, message, help));
                }
            }
        }
        if points > MOST_POINTS {
            let message = format!("the axes span {points} points; at most {MOST_POINTS} are possible");
            problems.push(problem(ProblemKind::OutOfRange, "axis".into(), message, "leave out values"));
        }
        if !problems.is_empty() {
            return Err(wrong(problems));
        }
        let Written { title, dynamics, .. } = written;
        Ok(Self { source, title, scenario, scenario_text, dynamics, residual, axes, base, files: BTreeSet::new() })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        self.axes.iter().map(|axis| axis.values.len()).product()
    }

    /// Which value of each axis point `k` has; the last axis is fastest.
    pub fn place(&self, mut k: usize) -> Vec<usize> {
        let mut place = vec![0; self.axes.len()];
        for (place, axis) in place.iter_mut().zip(&self.axes).rev() {
            *place = k % axis.values.len();
            k /= axis.values.len();
        }
        place
    }

    /// The scenario of point `k`.
    ///
    /// # Errors
    /// What is wrong with it, with lines of its own text.
    pub fn scenario(&self, k: usize) -> Result<Scenario, ScenarioError> {
        let mut table = self.base.clone();
        for (axis, value) in self.axes.iter().zip(self.place(k)) {
            for (key, value) in axis.keys.iter().zip(&axis.values[value]) {
                // Checked when the sweep was read.
                let _ = set(&mut table, key, value.clone());
            }
        }
        Scenario::parse(&self.scenario.display().to_string(), &table.to_string())
    }

    /// Every point must be a valid scenario of a bonded periodic cell. Notes the files that they read.
    fn check_points(&mut self) -> Result<(), ReadError> {
        for k in 0..self.points() {
            let scenario = self.scenario(k);
            if let Ok(scenario) = &scenario {
                let folder = scenario.directory();
                self.files.extend(scenario.files().into_iter().map(|(_, file)| folder.join(file)));
            }
            let refused = match scenario {
                Err(error) => {
                    let first = error.problems.first();
                    first.map(|p| (p.to_string(), p.help.clone()))
                }
                Ok(scenario) if scenario.bonds.is_none() => {
                    Some(("elastic constants are those of bonds".into(), "add [bonds] to the scenario".into()))
                }
                Ok(scenario) if !scenario.packing.is_periodic() => Some((
                    "elastic constants are those of a periodic packing".into(),
                    "write kind = \"periodic\" under [packing.shape] of the scenario".into(),
                )),
                Ok(_) => None,
            };
            if let Some((message, help)) = refused {
                let document = Document::parse(&self.source)
                    .map_err(|problems| ReadError::Scenario(ScenarioError::new(&self.source, problems)))?;
                // The values that differ from the first point, which tells the axis that is to blame.
                let place = self.place(k);
                let blamed = (0..place.len()).rev().find(|&axis| place[axis] > 0).unwrap_or(0);
                let (span, _) = document.locate(&format!("axis[{blamed}]"));
                let values: Vec<String> = self
                    .axes
                    .iter()
                    .zip(&place)
                    .map(|(axis, &value)| format!("{} = {}", axis.name, axis.text(value)))
                    .collect();
                let problem = Problem {
                    kind: ProblemKind::Conflict,
                    key: format!("axis[{blamed}]"),
                    value: None,
                    span,
                    message: format!("{} refuses {}: {message}", self.scenario.display(), values.join(", ")),
                    help,
                };
                return Err(ReadError::Scenario(ScenarioError::new(&self.source, vec![problem])));
            }
        }
        Ok(())
    }

    /// What the numbers depend on: the sweep, its scenario, the files that its points read, and the program.
    ///
    /// # Errors
    /// A file, of a packing or a surface, that cannot be read.
    pub fn fingerprint(&self) -> Result<String, ReadError> {
        let mut hasher = blake3::Hasher::new();
        let mut add = |part: &[u8]| {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        };
        add(self.source.text.as_bytes());
        add(self.scenario_text.as_bytes());
        add(crate::output::provenance::PROGRAM.as_bytes());
        add(crate::output::provenance::COMMIT.as_bytes());
        for path in &self.files {
            add(&std::fs::read(path).map_err(|error| ReadError::Io { path: path.clone(), error })?);
        }
        Ok(hasher.finalize().to_hex().to_string())
    }
}

impl WrittenAxis {
    /// The axis, or the key that is wrong, why, and what to do.
    fn meant(self) -> Result<Axis, (&'static str, String, &'static str)> {
        let keys = match (self.key, self.keys) {
            (Some(key), None) => vec![key],
            (None, Some(keys)) if !keys.is_empty() => keys,
            _ => return Err(("", "it needs either key or keys".into(), "write key = \"bonds.interaction_ratio\"")),
        };
        let several = keys.len() > 1;
        let values = match (self.values, self.linear, self.logarithmic) {
            (Some(values), None, None) => {
                let mut rows = Vec::new();
                for value in values {
                    let row = match value {
                        toml::Value::Array(row) if several => row,
                        value => vec![value],
                    };
                    if row.len() != keys.len() {
                        let message = format!("{} keys, but a value of {}", keys.len(), row.len());
                        return Err(("values", message, "give one list per point with a value for each key"));
                    }
                    rows.push(row);
                }
                rows
            }
            (None, Some(range), None) => {
                range.numbers("linear", &|share| range.from + (range.to - range.from) * share)?
            }
            (None, None, Some(range)) => {
                if !(range.from > 0.0 && range.to > 0.0) {
                    let message = format!("from {} to {} has no logarithms", range.from, range.to);
                    return Err(("logarithmic", message, "both ends must be positive"));
                }
                let (low, high) = (range.from.ln(), range.to.ln());
                range.numbers("logarithmic", &|share| (low + (high - low) * share).exp())?
            }
            _ => {
                let message = "it needs one of values, linear, logarithmic".to_owned();
                return Err(("", message, "write values = [1, 2, 3]"));
            }
        };
        if values.is_empty() {
            return Err(("values", "there is no value".into(), "give at least one"));
        }
        if several && values[0].len() != keys.len() {
            return Err(("keys", "ranges set one key".into(), "write values = [[...], [...]] for several keys"));
        }
        let name = self.name.unwrap_or_else(|| keys.join(", "));
        Ok(Axis { name, keys, values, average: self.average })
    }
}

impl Range {
    /// Numbers at equal shares; both ends exactly as written.
    fn numbers(
        &self,
        name: &'static str,
        at: &dyn Fn(f64) -> f64,
    ) -> Result<Vec<Vec<toml::Value>>, (&'static str, String, &'static str)> {
        if !((2..=10_000).contains(&self.count) && self.from.is_finite() && self.to.is_finite()) {
            let message = format!("{} values from {} to {}", self.count, self.from, self.to);
            return Err((name, message, "give finite ends and a count from 2 to 10000"));
        }
        let one = |k: usize| match k {
            0 => self.from,
            _ if k + 1 == self.count => self.to,
            // Twelve digits: no tails of rounding in tables.
            _ => format!("{:.11e}", at(k as f64 / (self.count - 1) as f64)).parse().unwrap_or(f64::NAN),
        };
        Ok((0..self.count).map(|k| vec![toml::Value::Float(one(k))]).collect())
    }
}

/// Set the value at a key path such as `material[0].cpm.young`; tables on the way must be there, the last key need not.
fn set(table: &mut toml::Table, path: &str, new: toml::Value) -> Result<(), String> {
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
            return Err(format!("the scenario has no `{}` on the way to `{path}`", way[..=k].join(".")));
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
            *item.ok_or_else(|| format!("`{path}` names an item that is not there"))? = new;
        }
        Some(_) => return Err(format!("`{path}` goes below a value")),
    }
    Ok(())
}

fn read_text(path: &Path) -> Result<String, ReadError> {
    let bytes = std::fs::read(path).map_err(|error| ReadError::Io { path: path.to_owned(), error })?;
    String::from_utf8(bytes).map_err(|error| {
        let start = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..start].split(|byte| *byte == b'\n').count();
        ReadError::NotText { path: path.to_owned(), line }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENARIO: &str = "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\n\
        repeats = [2, 2, 2]\nshape = { kind = \"periodic\" }\n[[material]]\nname = \"m\"\ndensity = 2000\n\
        linear_bond = { normal_stiffness = 1e7, shear_stiffness = 0 }\n[bonds]\nlaw = \"linear_bond\"\n\
        interaction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n[stop]\nsteps = 1\n";

    fn sweep(axes: &str) -> Result<Sweep, ReadError> {
        let text = format!("version = 1\nscenario = \"s.toml\"\n{axes}");
        let source = Source { name: "sweep.toml".into(), text: text.into() };
        let mut sweep = Sweep::parse(source, &|_| Ok(("s.toml".into(), SCENARIO.to_owned())))?;
        sweep.check_points()?;
        Ok(sweep)
    }

    #[test]
    fn points_are_all_combinations() {
        let sweep = sweep(
            "[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalues = [1.1, 1.5]\n[[axis]]\nname = \"springs\"\n\
             keys = [\"material[0].linear_bond.normal_stiffness\", \"material[0].linear_bond.shear_stiffness\"]\n\
             values = [[1e7, 0], [\"2e7 N/m\", 1e6], [3e7, 3e7]]\n[[axis]]\nkey = \"title\"\nvalues = [\"a\"]\n",
        )
        .unwrap();
        assert_eq!((sweep.points(), sweep.place(4)), (6, vec![1, 1, 0]));
        let scenario = sweep.scenario(4).unwrap();
        let bond = scenario.materials[0].linear_bond.as_ref().unwrap();
        assert_eq!((bond.normal_stiffness.si(), bond.shear_stiffness.si()), (2e7, 1e6));
        assert_eq!(scenario.bonds.unwrap().interaction_ratio.si(), 1.5);
        assert_eq!((scenario.title.as_str(), sweep.axes[1].text(1).as_str()), ("a", "2e7 N/m, 1000000.0"));
    }

    #[test]
    fn ranges_keep_their_ends() {
        let sweep =
            sweep("[[axis]]\nkey = \"bonds.interaction_ratio\"\nlogarithmic = { from = 1.1, to = 1.9, count = 3 }\n")
                .unwrap();
        let numbers: Vec<f64> = (0..3).filter_map(|k| sweep.axes[0].number(k)).collect();
        assert_eq!((numbers[0], numbers[2]), (1.1, 1.9));
        assert!((numbers[1] - (1.1_f64 * 1.9).sqrt()).abs() < 1e-11);
    }

    /// A started sweep does not go on when a file has changed that only an axis names; where the folder lies is of no account.
    #[test]
    fn fingerprints_know_the_files_of_all_points() {
        let fingerprint = |second: &str| {
            let folder = tempfile::tempdir().unwrap();
            let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
            write("first.txt", "0 0 0 1e-3\n");
            write("second.txt", second);
            let file = "kind = \"file\"\npath = \"first.txt\"\ncell = [2e-3, 2e-3, 2e-3]\n";
            let lattice = "kind = \"lattice\"\nlattice = \"fcc\"\nradius = 1e-3\nrepeats = [2, 2, 2]\n";
            write("s.toml", &SCENARIO.replace(lattice, file));
            let axis = "[[axis]]\nkey = \"packing.path\"\nvalues = [\"first.txt\", \"second.txt\"]\n";
            write("sweep.toml", &format!("version = 1\nscenario = \"s.toml\"\n{axis}"));
            Sweep::read(&folder.path().join("sweep.toml")).unwrap().fingerprint().unwrap()
        };
        let spheres = "0 0 0 1e-3\n";
        assert_eq!(fingerprint(spheres), fingerprint(spheres));
        assert_ne!(fingerprint(spheres), fingerprint(&spheres.replace("0 0 0", "0 0 1e-4")));
    }

    #[test]
    fn what_is_wrong_is_said_with_place_and_remedy() {
        for (axes, line, words) in [
            ("", 1, "there is no axis"),
            ("[[axis]]\nvalues = [1]\n", 3, "either key or keys"),
            ("[[axis]]\nkey = \"bonds.interaction_ratio\"\n", 3, "one of values, linear, logarithmic"),
            ("[[axis]]\nkey = \"bond.interaction_ratio\"\nvalues = [1]\n", 4, "no `bond` on the way"),
            ("[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalues = [1.1, -2]\n", 3, "interaction_ratio = -2"),
            ("[[axis]]\nkey = \"material[0].linear_bond.stiffness\"\nvalues = [1]\n", 3, "stiffness"),
            ("[[axis]]\nkey = \"packing.shape.kind\"\nvalues = [\"cube\"]\n", 3, "cube"),
            ("[[axis]]\nkeys = [\"a\", \"b\"]\nvalues = [[1]]\n", 5, "2 keys, but a value of 1"),
            (
                "[[axis]]\nkey = \"bonds.interaction_ratio\"\nlogarithmic = { from = 0, to = 1, count = 3 }\n",
                5,
                "logarithms",
            ),
            ("[[axis]]\nkey = \"bonds.interaction_ratio\"\nvalue = [1]\n", 5, "unknown field"),
        ] {
            let ReadError::Scenario(error) = sweep(axes).unwrap_err() else { panic!("{axes}: another error") };
            let text = error.to_string();
            assert!(text.contains(words), "{axes}\n{text}");
            assert!(text.starts_with(&format!("sweep.toml:{line}:")), "{axes}\n{text}");
            assert!(text.contains("help: "), "{text}");
        }
    }
}
