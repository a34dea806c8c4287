//! The commands of the program as functions: they return objects, and raise its messages as exceptions.

use std::path::PathBuf;
use std::sync::{Arc, Mutex, PoisonError};

use concordem::assembly::{assemble, samples};
use concordem::output::ResultFile;
use concordem::program::check::inspect;
use concordem::program::explain::{KeyInfo, explained};
use concordem::program::export::export_result;
use concordem::program::measure::Moment;
use concordem::program::report::report_on;
use concordem::program::resume::resume_run;
use concordem::program::run::{Outcome, run_scenario};
use concordem::program::sweep::{Swept, sweep_file};
use concordem::program::{Console, Failure, Host, packings_folder};
use concordem::sampling::ScheduledOperator;
use concordem::scenario::{Problem, Scenario as Read};
use numpy::PyArrayMethods as _;
use pyo3::exceptions::{PyTypeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::PyDict;

use crate::arrays::{TableColumn, result, scalars, table};
use crate::errors::{OrRaise, caught, check_file, detach, of_assembly};
use crate::results::PyResultFile;
use crate::scenario::Scenario;
use crate::simulation::{by_quantity, scheduled, summary_of};
use crate::warnings::{tell, warn};
use crate::work::{commanded, guarded};

type Any<'py> = PyResult<Bound<'py, PyAny>>;

/// The scenario that is given, or the scenario of a file.
fn scenario_of<'py>(object: &Bound<'py, PyAny>) -> PyResult<Bound<'py, Scenario>> {
    if let Ok(scenario) = object.cast::<Scenario>() {
        return Ok(scenario.clone());
    }
    let path: PathBuf =
        object.extract().map_err(|_| PyTypeError::new_err("give a Scenario, or the path of a scenario"))?;
    Bound::new(object.py(), Scenario::of_file(object.py(), path)?)
}

/// The result that is given, or the result of a file.
pub(crate) fn result_of(object: &Bound<'_, PyAny>) -> PyResult<PathBuf> {
    if let Ok(result) = object.cast::<PyResultFile>() {
        return Ok(result.get().file().path().to_owned());
    }
    object.extract().map_err(|_| PyTypeError::new_err("give a Result, or the path of a result"))
}

/// The results that are given, or the one result.
pub(crate) fn results_of(object: &Bound<'_, PyAny>) -> PyResult<Vec<PathBuf>> {
    match result_of(object) {
        Ok(file) => Ok(vec![file]),
        Err(error) => {
            let Ok(items) = object.try_iter() else { return Err(error) };
            items.map(|item| result_of(&item?)).collect()
        }
    }
}

/// The argument `threads` for a command.
fn number(threads: Option<usize>) -> PyResult<Option<u16>> {
    match threads {
        None => Ok(None),
        Some(threads @ 1..=1024) => Ok(Some(threads as u16)),
        Some(other) => Err(PyValueError::new_err(format!("threads is {other}; give 1 to 1024"))),
    }
}

/// Scenarios and their warnings.
type Warnings = Vec<(Read, Vec<Problem>)>;

/// Run a command of the program. Its warnings and notes become warnings of Python, then its failure an exception.
pub(crate) fn call<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut Console<'_>) -> Result<T, Failure> + Send,
) -> PyResult<T> {
    let code: PathBuf = py.import("concordem._core")?.getattr("__file__")?.extract()?;
    let warned: Arc<Mutex<Warnings>> = Arc::default();
    let found = warned.clone();
    let (outcome, told) = commanded(py, progress, move |progress, interrupted| {
        let warn = Arc::new(move |scenario: &Read, problems: &[Problem]| {
            let mut found = found.lock().unwrap_or_else(PoisonError::into_inner);
            found.push((scenario.clone(), problems.to_vec()));
        });
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let mut console = Console {
            out: &mut out,
            err: &mut err,
            interactive: false,
            out_interactive: false,
            packings: packings_folder(),
            code: Some(code),
            host: Some(Host { interrupted, progress, warn }),
        };
        let outcome = work(&mut console);
        (outcome, String::from_utf8_lossy(&err).into_owned())
    })?;
    let problems = std::mem::take(&mut *warned.lock().unwrap_or_else(PoisonError::into_inner));
    for (scenario, problems) in problems {
        warn(py, &scenario, &problems)?;
    }
    told.lines().try_for_each(|line| tell(py, line))?;
    outcome.or_raise()
}

/// Check a scenario as `concordem check` does: build it, and time some of its steps.
///
/// Parameters
/// ----------
/// scenario : Scenario, or path of a scenario.
/// threads : number of threads; by default one per processor.
/// progress : True for a bar, or a function of a stage and its share.
///
/// Returns
/// -------
/// Check : numbers of particles and bonds, time step (s), time per step (s), steps, estimated time (s), and all facts as text.
///
/// Raises
/// ------
/// ScenarioError, UnstableError, AssemblyError : the scenario cannot be built. SolverError : a step fails.
///
/// >>> import concordem
/// >>> found = concordem.check(concordem.Scenario.template("hertz-impact"), threads=1)
/// >>> found.summary.particles, found.facts["time step"].endswith("of the stability bound")
/// (2, True)
#[pyfunction]
#[pyo3(signature = (scenario, threads=None, progress=None))]
fn check<'py>(
    py: Python<'py>,
    scenario: &Bound<'py, PyAny>,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    let scenario = scenario_of(scenario)?;
    let Scenario { inner, folder } = scenario.get();
    let built = guarded(py, threads, progress.as_ref(), |progress| assemble(inner, folder, progress))?;
    let built = built.map_err(|error| of_assembly(inner, error))?;
    let warnings = built.summary.warnings.clone();
    let checked = guarded(py, threads, None, |_| inspect(inner, built))?.or_raise()?;
    warn(py, inner, &warnings)?;
    let facts = PyDict::new(py);
    for (name, text) in checked.facts() {
        facts.set_item(name, text)?;
    }
    let (steps, limit) = checked.steps.unzip();
    let time = steps.map(|steps| steps * checked.time_per_step);
    let summary = summary_of(py, &checked.summary)?;
    result(py, "Check", (summary, checked.time_step, checked.time_per_step, steps, limit, time, facts))
}

/// Run a scenario to its end as `concordem run` does, with checkpoints on the way.
///
/// Parameters
/// ----------
/// scenario : Scenario, or path of a scenario.
/// output : path of the result; by default the scenario's.
/// start : result or checkpoint to continue from, as with `--from`.
/// overwrite : whether to replace a result, or to discard an unfinished run.
/// threads : number of threads; by default one per processor. The numbers do not depend on it.
/// progress : True for a bar, or a function of a stage and its share.
///
/// Returns
/// -------
/// Result : the result file.
///
/// Raises
/// ------
/// ScenarioError, UnstableError, AssemblyError : the scenario cannot be built. ResultError : a file exists, or cannot be written.
/// SolverError : a step fails. KeyboardInterrupt : after a checkpoint, with which `concordem.resume` continues.
///
/// >>> import concordem, os, tempfile
/// >>> scenario = concordem.Scenario.template("hertz-impact").with_settings({"stop.steps": 50})
/// >>> result = concordem.run(scenario, os.path.join(tempfile.mkdtemp(), "impact.h5"), threads=1)
/// >>> result.provenance["stopped_because"]
/// 'the given number of steps was reached'
#[pyfunction]
#[pyo3(signature = (scenario, output=None, start=None, overwrite=false, threads=None, progress=None))]
fn run(
    py: Python<'_>,
    scenario: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    start: Option<PathBuf>,
    overwrite: bool,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PyResultFile> {
    let scenario = scenario_of(scenario)?;
    let output = output.map_or_else(|| scenario.get().result_path(), Ok)?;
    let inner = scenario.get().in_folder().or_raise()?;
    let threads = number(threads)?;
    let ended = call(py, progress.as_ref(), |console| {
        run_scenario(&inner, Some(&output), start.as_deref(), overwrite, threads, console)
    })?;
    opened(ended, &output)
}

/// The result of a run that has ended.
fn opened(ended: Outcome, output: &std::path::Path) -> PyResult<PyResultFile> {
    let path = if let Outcome::Finished { path, .. } = ended { path } else { output.to_owned() };
    PyResultFile::of_path(&path)
}

/// Continue an interrupted or killed run as `concordem resume` does; the result equals an uninterrupted run's.
///
/// Parameters
/// ----------
/// path : result of the run, its scenario, or its folder FILE.parts.
/// threads, progress : see `run`.
///
/// Returns
/// -------
/// Result : the result file, also if the run was finished.
///
/// Raises
/// ------
/// ResultError : there is no such run, or its files are damaged. The errors of `run`.
#[pyfunction]
#[pyo3(signature = (path, threads=None, progress=None))]
fn resume(
    py: Python<'_>,
    path: PathBuf,
    threads: Option<usize>,
    progress: Option<Bound<'_, PyAny>>,
) -> PyResult<PyResultFile> {
    let threads = number(threads)?;
    match call(py, progress.as_ref(), |console| resume_run(&path, threads, console))? {
        Some(ended) => opened(ended, &path),
        // The run is finished. Its parts are FILE.h5.parts.
        None if path.extension().is_some_and(|extension| extension == "parts") => {
            PyResultFile::of_path(&path.with_extension(""))
        }
        None => PyResultFile::of_path(&path.with_extension("h5")),
    }
}

/// Evaluate an operator on the final state of a result, as `concordem measure` does.
///
/// Parameters
/// ----------
/// result : Result, or path of a result.
/// operator : name, such as "region-stress"; by default all tables `[[sample]]` of the scenario.
/// options : keys of a table `[[sample]]`, such as `region`, `wall`, or `set`, with values as in the constructor of Scenario.
///
/// Returns
/// -------
/// dict : values by quantity, in SI units; without `operator` one such dictionary for each table, by its name.
///
/// Raises
/// ------
/// ScenarioError : the options do not fit. OperatorError, ValueError : nothing to evaluate. ResultError : the file cannot be read.
#[pyfunction]
#[pyo3(signature = (result, operator=None, **options))]
fn measure<'py>(
    py: Python<'py>,
    result: &Bound<'py, PyAny>,
    operator: Option<&str>,
    options: Option<&Bound<'py, PyDict>>,
) -> PyResult<Bound<'py, PyDict>> {
    let path = result_of(result)?;
    let (file, inner) = caught(|| -> Result<_, Failure> {
        let file = ResultFile::open(&path)?;
        let inner = Read::parse(&path.display().to_string(), &file.scenario()?)?;
        Ok((file, inner))
    })?
    .or_raise()?;
    let moment = detach(py, || Moment::read(&file, &inner))?.or_raise()?;
    let evaluated = |sample: &ScheduledOperator| detach(py, || moment.evaluate(sample))?.or_raise();
    if let Some(operator) = operator {
        let sample = scheduled(py, &inner, (moment.particles(), moment.cell()), ("measure", operator), options)?;
        return by_quantity(py, &sample, &evaluated(&sample)?);
    }
    if let Some((key, _)) = options.and_then(|options| options.iter().next()) {
        return Err(PyValueError::new_err(format!("measure got {key} without operator, whose option it is")));
    }
    let all = samples::of(&inner, moment.particles(), moment.cell()).map_err(|error| of_assembly(&inner, error))?;
    if all.is_empty() {
        let message = "the scenario of the run has no [[sample]]; choose an operator and a region, such as operator=\"region-stress\", \
                       region={\"kind\": \"sphere\", \"center\": [0, 0, 0], \"radius\": \"5 mm\"}";
        return Err(PyValueError::new_err(message));
    }
    let found = PyDict::new(py);
    for sample in &all {
        found.set_item(&sample.name, by_quantity(py, sample, &evaluated(sample)?)?)?;
    }
    Ok(found)
}

/// Write a web page about one or more results, as `concordem report` does.
///
/// Parameters
/// ----------
/// results : Result or path, or several of them.
/// output : path of the page; by default the name of the first result with .html.
/// overwrite : whether to replace a page.
/// reference : published values to compare with: "auto", "none", "specimen-1", or "specimen-4".
///
/// Returns
/// -------
/// pathlib.Path : the page.
#[pyfunction]
#[pyo3(signature = (results, output=None, overwrite=false, reference="auto"))]
fn report(
    py: Python<'_>,
    results: &Bound<'_, PyAny>,
    output: Option<PathBuf>,
    overwrite: bool,
    reference: &str,
) -> PyResult<PathBuf> {
    let files = results_of(results)?;
    call(py, None, |console| report_on(&files, output.as_deref(), overwrite, reference, console))
}

/// Write particles and bonds at all snapshots for other programs, as `concordem export` does.
///
/// Parameters
/// ----------
/// result : Result, or path of a result.
/// format : "vtk", "lammps", "cracks", or "heat-network".
/// output : beginning of the names of the files; by default the name of the result without its ending.
/// overwrite : whether to replace files.
///
/// Returns
/// -------
/// list of pathlib.Path : the files.
#[pyfunction]
#[pyo3(signature = (result, format="vtk", output=None, overwrite=false))]
fn export(
    py: Python<'_>,
    result: &Bound<'_, PyAny>,
    format: &str,
    output: Option<PathBuf>,
    overwrite: bool,
) -> PyResult<Vec<PathBuf>> {
    let file = result_of(result)?;
    Ok(call(py, None, |console| export_result(&file, format, output.as_deref(), overwrite, console))?.files)
}

/// Compute all points of a sweep file, as `concordem sweep` does; the same call continues an interrupted sweep.
///
/// Parameters
/// ----------
/// sweep : path of the sweep.
/// output : path of the result; by default the name of the sweep with .h5. The page has the same name with .html.
/// csv : whether to write all points also as comma-separated text.
/// overwrite : whether to replace a result, and to discard points of an unfinished sweep.
/// threads, progress : see `run`.
///
/// Returns
/// -------
/// Sweep : files, values of the axes, numbers of all points, and curves of runs.
///
/// Raises
/// ------
/// ScenarioError : the sweep, or a scenario of one of its points, is invalid. KeyboardInterrupt : what is finished is kept.
#[pyfunction]
#[pyo3(signature = (sweep, output=None, csv=false, overwrite=false, threads=None, progress=None))]
fn sweep<'py>(
    py: Python<'py>,
    sweep: PathBuf,
    output: Option<PathBuf>,
    csv: bool,
    overwrite: bool,
    threads: Option<usize>,
    progress: Option<Bound<'py, PyAny>>,
) -> Any<'py> {
    check_file(&sweep)?;
    let threads = number(threads)?;
    let swept = call(py, progress.as_ref(), |console| {
        let swept = sweep_file(&sweep, output.as_deref(), csv, overwrite, threads, console)?;
        if let Some(note) = &swept.failed {
            let _ = writeln!(console.err, "{note}");
        }
        Ok(swept)
    })?;
    let Swept { result: path, page, sweep, outcomes, .. } = swept;
    let axes = PyDict::new(py);
    let places: Vec<Vec<usize>> = (0..outcomes.len()).map(|point| sweep.place(point)).collect();
    for (k, axis) in sweep.axes.iter().enumerate() {
        let numbers: Option<Vec<f64>> = places.iter().map(|place| axis.number(place[k])).collect();
        match numbers {
            Some(numbers) => axes.set_item(&axis.name, scalars(py, &numbers))?,
            None => axes.set_item(&axis.name, places.iter().map(|p| axis.text(p[k])).collect::<Vec<_>>())?,
        }
    }
    let quantities = sweep.quantities();
    let columns = quantities.iter().enumerate().map(|(k, quantity)| {
        let values: Vec<f64> = outcomes.iter().map(|outcome| outcome.values[k]).collect();
        let values = scalars(py, &values).into_any();
        TableColumn { name: quantity.name.replace(' ', "_"), unit: quantity.unit.to_string(), values }
    });
    let points = table(py, columns.collect())?;
    let problems = PyDict::new(py);
    for (point, outcome) in outcomes.iter().enumerate() {
        if let Some(problem) = &outcome.problem {
            problems.set_item(point, problem)?;
        }
    }
    let curves = PyDict::new(py);
    for (k, curve) in sweep.curves.iter().enumerate() {
        let ordinates: Vec<f64> = outcomes.iter().flat_map(|outcome| sweep.ordinates(k, outcome)).copied().collect();
        let y = scalars(py, &ordinates).reshape([outcomes.len(), curve.abscissas.len()])?;
        let fields = (scalars(py, &curve.abscissas), y, &curve.x.name, &curve.y.name, &curve.x.unit, &curve.y.unit);
        curves.set_item(&curve.name, result(py, "Curve", fields)?)?;
    }
    result(py, "Sweep", (path, page, axes, points, problems, curves))
}

/// Explain a key of scenarios, as `concordem explain` does.
///
/// Parameters
/// ----------
/// key : its path ("loading.strain_rate") or its name ("young").
///
/// Returns
/// -------
/// list of Key : path, what a value is, whether it is required, meaning, and allowed words.
///
/// Raises
/// ------
/// ValueError : there is no such key; names similar ones.
///
/// >>> import concordem
/// >>> [key.path for key in concordem.explain("relative_ductility")]
/// ['interface.cpm.relative_ductility', 'material.cpm.relative_ductility']
#[pyfunction]
fn explain<'py>(py: Python<'py>, key: &str) -> PyResult<Vec<Bound<'py, PyAny>>> {
    let found = caught(|| explained(key))?.or_raise()?;
    let one = |key: &KeyInfo| {
        let words = PyDict::new(py);
        for (word, meaning) in &key.words {
            words.set_item(word, meaning)?;
        }
        result(py, "Key", (&key.path, &key.value, key.required, &key.description, words, key.kinds.clone()))
    };
    found.iter().map(one).collect()
}

pub fn register(module: &Bound<'_, PyModule>) -> PyResult<()> {
    module.add_function(wrap_pyfunction!(check, module)?)?;
    module.add_function(wrap_pyfunction!(run, module)?)?;
    module.add_function(wrap_pyfunction!(resume, module)?)?;
    module.add_function(wrap_pyfunction!(measure, module)?)?;
    module.add_function(wrap_pyfunction!(report, module)?)?;
    module.add_function(wrap_pyfunction!(export, module)?)?;
    module.add_function(wrap_pyfunction!(sweep, module)?)?;
    module.add_function(wrap_pyfunction!(explain, module)?)
}
