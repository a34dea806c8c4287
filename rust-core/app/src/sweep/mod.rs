//! Sweeps: elastic constants, structures of packings, or results of whole runs, for all combinations of given values of a scenario's keys.
//!
//! A sweep is a TOML file with a scenario and axes:
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
//! The last axis varies fastest in the numbering of points. Axes with a range without a count are [sampled](sampling) together: they
//! count as one axis, at the place of the first of them. Points with the same packing share it. A [`journal`] stores finished points, so
//! that they are not computed again. The numbers of a point depend only on the point, so the result is the same for any number of
//! interruptions, threads, and [`parts`].

mod axis;
pub mod curve;
pub mod journal;
pub mod outcome;
pub mod parts;
pub mod point;
pub mod results;
pub mod sampling;
mod schema;
pub mod series;
#[cfg(test)]
mod tests;

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use serde::Deserialize;

pub use axis::Axis;
use axis::{WrittenAxis, set};
use concordem_scenario::checks::read_text;
use concordem_scenario::schema::{
    Document, Problem, ProblemKind, ReadError, Scenario, ScenarioError, Setting, Source, large,
};
use curve::{Curve, MOST_ORDINATES, WrittenCurve};
use outcome::MOST_RESULTS;
use point::Study;
use results::{DEFAULT, RunResult};
use sampling::Sampling;
pub use schema::schema;

/// Largest number of points.
const MOST_POINTS: usize = 1_000_000;

/// A sweep whose points are all valid scenarios.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Name and text of the file.
    pub source: Source,
    /// Title.
    pub title: String,
    /// Path of the scenario.
    pub scenario: PathBuf,
    /// Text of the scenario.
    pub scenario_text: String,
    /// What it computes.
    pub study: Study,
    /// Whether to compute relaxed dynamics, too.
    pub dynamics: bool,
    /// Relative residual of the static solution.
    pub residual: f64,
    /// Results that runs record.
    pub results: Vec<RunResult>,
    /// Curves that runs record.
    pub curves: Vec<Curve>,
    /// Axes.
    pub axes: Vec<Axis>,
    base: toml::Table,
    /// Files that the scenarios of the points read.
    files: BTreeSet<PathBuf>,
}

/// The file as written.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    version: u32,
    #[serde(default)]
    title: String,
    scenario: String,
    #[serde(default)]
    study: Study,
    #[serde(default)]
    dynamics: bool,
    residual: Option<f64>,
    results: Option<Vec<String>>,
    sampling: Option<Sampling>,
    #[serde(rename = "curve", default)]
    curves: Vec<WrittenCurve>,
    #[serde(rename = "axis", default)]
    axes: Vec<WrittenAxis>,
}

/// Reads the scenario of a sweep: path and text.
type ReadScenario<'a> = dyn Fn(&str) -> Result<(PathBuf, String), ReadError> + 'a;

impl Sweep {
    /// Reads a sweep and its scenario, and checks every point.
    ///
    /// # Errors
    /// A file cannot be read, or the sweep has problems; all are reported with position and remedy.
    pub fn read(path: &Path) -> Result<Self, ReadError> {
        Self::read_with(path, &[])
    }

    /// Reads a sweep whose scenario gets these settings.
    ///
    /// # Errors
    /// Those of [`Self::read`]; a setting of a key that the sweep varies.
    pub fn read_with(path: &Path, settings: &[Setting]) -> Result<Self, ReadError> {
        let text = read_text(path)?;
        let source = Source::new(&path.display().to_string(), &text);
        let mut sweep = Self::parse(source, &|scenario| {
            let path = path.parent().unwrap_or(Path::new("")).join(scenario);
            let text = Setting::apply(&read_text(&path)?, settings).map_err(ReadError::Setting)?;
            Ok((path, text))
        })?;
        let keys: Vec<&String> = sweep.axes.iter().flat_map(|axis| &axis.keys).collect();
        let varied = |setting: &Setting| keys.iter().find(|key| setting.causes(key)).map(|key| (setting.clone(), *key));
        if let Some((setting, key)) = settings.iter().find_map(varied) {
            let message = format!("{}: the sweep varies {key}; remove the setting, or the axis", setting.shown());
            return Err(ReadError::Setting(message));
        }
        sweep.check_points()?;
        Ok(sweep)
    }

    fn parse(source: Source, read: &ReadScenario<'_>) -> Result<Self, ReadError> {
        let wrong = |problems: Vec<Problem>| ReadError::Scenario(ScenarioError::new(&source, problems));
        let document = Document::parse(&source).map_err(wrong)?;
        let written: Written = document.deserialize().map_err(|problem| {
            if Scenario::parse(&source.name, &source.text).is_ok() {
                let message = "this is a scenario, not a sweep".to_owned();
                let help = format!("write a sweep with scenario = \"{}\"; `concordem init --template elastic-sweep` shows one", source.name);
                return wrong(vec![Problem { value: None, message, help, ..problem }]);
            }
            let help = "a sweep has version, title, scenario, study, results, dynamics, residual, [[axis]] tables with name, key or \
                        keys, values or linear or logarithmic, and average; [sampling] with method (sobol, latin-hypercube, random), \
                        count, and seed; and [[curve]] tables with name, x, y, from, to, and count";
            wrong(vec![Problem { help: help.to_owned(), ..problem }])
        })?;
        let problem = |kind: ProblemKind, key: String, message: String, help: &str| {
            let (span, value) = document.locate(&key);
            Problem { kind, key, value, span, message, help: help.to_owned() }
        };
        let mut problems = Vec::new();
        if written.version != 1 {
            let message = format!("version {} is not supported", written.version);
            problems.push(problem(ProblemKind::OutOfRange, "version".into(), message, "write version = 1"));
        }
        let residual = written.residual.unwrap_or(concordem_statics::Accuracy::default().residual);
        if !(residual > 0.0 && residual < 1e-3) {
            let message = "must be between 0 and 1e-3".to_owned();
            problems.push(problem(ProblemKind::OutOfRange, "residual".into(), message, "write 1e-11, or omit the key"));
        }
        let list = |found: Vec<KeyProblem>| {
            let one = |(key, kind, message, help): KeyProblem| problem(kind, key, message, help);
            found.into_iter().map(one).collect::<Vec<_>>()
        };
        problems.extend(list(without_effect(&written)));
        if written.axes.is_empty() {
            let help = "add [[axis]] with key = \"bonds.interaction_ratio\" and values = [1.25, 1.5]";
            problems.push(problem(ProblemKind::MissingKey, "axis".into(), "the sweep has no axis".into(), help));
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
        // Problems of the scenario itself are reported at their position in the scenario.
        let first = Scenario::parse(&scenario.display().to_string(), &scenario_text)?;
        let (results, wrong_results) = results_of(&written, &first);
        problems.extend(list(wrong_results));
        let (curves, wrong_curves) = curves_of(&written, &first);
        problems.extend(list(wrong_curves));
        let base: toml::Table = toml::from_str(&large::protect(&scenario_text))
            .map_err(|error| wrong(vec![problem(ProblemKind::Syntax, "scenario".into(), error.to_string(), "")]))?;
        let (axes, wrong_axes) = resolve(written.axes, written.sampling, &base);
        problems.extend(list(wrong_axes));
        let points = combined(&axes).fold(1_usize, |points, (_, count)| points.saturating_mul(count));
        if points > MOST_POINTS {
            let message = format!("the axes span {points} points; the limit is {MOST_POINTS}");
            problems.push(problem(ProblemKind::OutOfRange, "axis".into(), message, "use fewer values"));
        }
        if !problems.is_empty() {
            return Err(wrong(problems));
        }
        Ok(Self {
            source,
            title: written.title,
            scenario,
            scenario_text,
            study: written.study,
            dynamics: written.dynamics,
            residual,
            results,
            curves,
            axes,
            base,
            files: BTreeSet::new(),
        })
    }

    /// Number of points.
    pub fn points(&self) -> usize {
        combined(&self.axes).map(|(_, count)| count).product()
    }

    /// Index of the value of each axis at point `k`; the last axis varies fastest. All sampled axes have the same index.
    pub fn place(&self, mut k: usize) -> Vec<usize> {
        let mut place = vec![0; self.axes.len()];
        let mut sample = 0;
        for (axis, count) in combined(&self.axes).rev() {
            place[axis] = k % count;
            if self.axes[axis].sampled.is_some() {
                sample = place[axis];
            }
            k /= count;
        }
        for (place, _) in place.iter_mut().zip(&self.axes).filter(|(_, axis)| axis.sampled.is_some()) {
            *place = sample;
        }
        place
    }

    /// The scenario of point `k`.
    ///
    /// # Errors
    /// Problems of this scenario, at positions in its own text.
    pub fn scenario(&self, k: usize) -> Result<Scenario, ScenarioError> {
        let mut table = self.base.clone();
        for (axis, value) in self.axes.iter().zip(self.place(k)) {
            for (key, value) in axis.keys.iter().zip(&axis.values[value]) {
                // Cannot fail: checked when the sweep was read.
                let _ = set(&mut table, key, value.clone());
            }
        }
        Scenario::parse(&self.scenario.display().to_string(), &large::restore(&table.to_string()))
    }

    /// Checks that every point is a valid scenario, for elastic constants of a bonded periodic cell; collects the files that they read.
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
                Ok(_) if self.study != Study::Elastic => None,
                Ok(scenario) if scenario.bonds.is_none() => {
                    Some(("elastic constants need bonds".into(), "add [bonds] to the scenario".into()))
                }
                Ok(scenario) if !scenario.packing.is_periodic() => Some((
                    "elastic constants need a periodic packing".into(),
                    "write kind = \"periodic\" under [packing.shape] of the scenario".into(),
                )),
                Ok(_) => None,
            };
            if let Some((message, help)) = refused {
                let document = Document::parse(&self.source)
                    .map_err(|problems| ReadError::Scenario(ScenarioError::new(&self.source, problems)))?;
                // The last axis whose value differs from that of the first point is probably the wrong one.
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

    /// Hash of everything that the numbers depend on: sweep, scenario, files that the points read, and program.
    ///
    /// # Errors
    /// A file cannot be read.
    pub fn fingerprint(&self) -> Result<String, ReadError> {
        let mut hasher = blake3::Hasher::new();
        let mut add = |part: &[u8]| {
            hasher.update(&(part.len() as u64).to_le_bytes());
            hasher.update(part);
        };
        add(self.source.text.as_bytes());
        add(self.scenario_text.as_bytes());
        add(crate::provenance::PROGRAM.as_bytes());
        add(crate::provenance::COMMIT.as_bytes());
        for path in &self.files {
            add(&std::fs::read(path).map_err(|error| ReadError::Io { path: path.clone(), error })?);
        }
        Ok(hasher.finalize().to_hex().to_string())
    }
}

/// Axes whose values are combined in full, with the numbers of their values: all but the sampled axes after the first of these.
fn combined(axes: &[Axis]) -> impl DoubleEndedIterator<Item = (usize, usize)> {
    let first = axes.iter().position(|axis| axis.sampled.is_some());
    let counts = axes.iter().enumerate().filter(move |(k, axis)| axis.sampled.is_none() || Some(*k) == first);
    counts.map(|(k, axis)| (k, axis.values.len()))
}

/// Key in the sweep, kind, message, and remedy of a problem.
type KeyProblem = (String, ProblemKind, String, &'static str);

/// Problems of keys that the study does not use.
fn without_effect(written: &Written) -> Vec<KeyProblem> {
    let mut problems = Vec::new();
    if written.study != Study::Run && written.results.is_some() {
        let message = "has no effect: only the study \"run\" records results of runs".to_owned();
        problems.push(("results".into(), ProblemKind::Conflict, message, "write study = \"run\", or remove the key"));
    }
    if written.study != Study::Run && !written.curves.is_empty() {
        let message = "has no effect: only the study \"run\" records curves of runs".to_owned();
        problems.push((
            "curve[0]".into(),
            ProblemKind::Conflict,
            message,
            "write study = \"run\", or remove the table",
        ));
    }
    if written.study != Study::Elastic {
        for (key, given) in [("dynamics", written.dynamics), ("residual", written.residual.is_some())] {
            if given {
                let message = "has no effect: only the study \"elastic\" computes a stiffness".to_owned();
                problems.push((key.into(), ProblemKind::Conflict, message, "remove the key"));
            }
        }
    }
    problems
}

/// The results of runs of a scenario that a sweep names, and the problems of the others.
fn results_of(written: &Written, scenario: &Scenario) -> (Vec<RunResult>, Vec<KeyProblem>) {
    let (mut results, mut problems) = (Vec::new(), Vec::new());
    if written.study != Study::Run {
        return (results, problems);
    }
    let names = written.results.clone().unwrap_or_else(|| DEFAULT.map(str::to_owned).to_vec());
    for (k, name) in names.iter().enumerate() {
        match RunResult::find(name, scenario) {
            Ok(result) => results.push(result),
            Err(message) => {
                let help = "write \"f_t\", \"max stress\", or \"last broken\"";
                problems.push((format!("results[{k}]"), ProblemKind::UnknownName, message, help));
            }
        }
    }
    if !(1..=MOST_RESULTS).contains(&names.len()) {
        let message = format!("{} results are named; there must be 1 to {MOST_RESULTS}", names.len());
        problems.push(("results".into(), ProblemKind::OutOfRange, message, "name the results of interest"));
    }
    (results, problems)
}

/// The curves of runs of a scenario, and the problems of the others.
fn curves_of(written: &Written, scenario: &Scenario) -> (Vec<Curve>, Vec<KeyProblem>) {
    let (mut curves, mut problems) = (Vec::new(), Vec::new());
    if written.study != Study::Run {
        return (curves, problems);
    }
    for (k, curve) in written.curves.iter().enumerate() {
        match curve.clone().resolve(scenario, &curves) {
            Ok(curve) => curves.push(curve),
            Err((key, message, help)) => {
                problems.push((format!("curve[{k}].{key}"), ProblemKind::Conflict, message, help));
            }
        }
    }
    let count: usize = curves.iter().map(|curve| curve.abscissas.len()).sum();
    if count > MOST_ORDINATES {
        let message = format!("the curves have {count} numbers per point; the limit is {MOST_ORDINATES}");
        problems.push((
            "curve[0].count".into(),
            ProblemKind::OutOfRange,
            message,
            "use fewer abscissas, or fewer curves",
        ));
    }
    (curves, problems)
}

/// The axes with all their values, and the problems of the others; `base` is the scenario.
fn resolve(written: Vec<WrittenAxis>, sampling: Option<Sampling>, base: &toml::Table) -> (Vec<Axis>, Vec<KeyProblem>) {
    let mut axes: Vec<Axis> = Vec::new();
    let mut problems = Vec::new();
    let sampled = written.iter().filter(|axis| axis.is_sampled()).count();
    if let Some((key, message, help)) = sampling.and_then(|sampling| sampling.problem(sampled)) {
        problems.push((key.to_owned(), ProblemKind::OutOfRange, message, help));
        return (axes, problems);
    }
    let samples = sampling.map(|sampling| sampling.samples(sampled));
    let mut of_axes = samples.iter().flatten().map(Vec::as_slice);
    for (k, axis) in written.into_iter().enumerate() {
        let numbers = if axis.is_sampled() { of_axes.next() } else { None };
        let axis = match axis.resolve(numbers) {
            Ok(axis) => axis,
            Err(error) => {
                let place = format!("axis[{k}]{}{}", if error.key.is_empty() { "" } else { "." }, error.key);
                problems.push((place, ProblemKind::Conflict, error.message, error.help));
                continue;
            }
        };
        for (j, key) in axis.keys.iter().enumerate() {
            let twice = axes.iter().any(|axis| axis.keys.contains(key)) || axis.keys[..j].contains(key);
            let failure = if twice {
                Some(format!("two axes set `{key}`"))
            } else {
                set(&mut base.clone(), key, axis.values[0][j].clone()).err()
            };
            if let Some(message) = failure {
                let help = "keys are those of the scenario: packing.count, bonds.interaction_ratio, \
                            material[0].cpm.shear_ratio; use each key in one axis only";
                let place = format!("axis[{k}].{}", if axis.keys.len() == 1 { "key" } else { "keys" });
                problems.push((place, ProblemKind::UnknownKey, message, help));
            }
        }
        axes.push(axis);
    }
    (axes, problems)
}
