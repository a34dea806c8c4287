//! Converts errors of the solver to exceptions of `concordem`.

use std::any::Any;
use std::io;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;
use std::sync::{Mutex, PoisonError};

use concordem::assembly::AssemblyError;
use concordem::assembly::restart::RestartError;
use concordem::calibration::elastic::ElasticCalibrationError;
use concordem::characterise::CharacteriseError;
use concordem::operator::OperatorError;
use concordem::output::OutputError;
use concordem::packing::PackingError;
use concordem::program::Failure;
use concordem::scenario::{Problem, ReadError, Scenario, ScenarioError};
use concordem::schedule::simulation::RunError;
use concordem::solver::SolverError;
use concordem::solver::own_thread::with_all_processors;
use concordem::state::ColumnError;
use concordem::statics::StaticsError;
use pyo3::exceptions::{PyOSError, PyValueError};
use pyo3::panic::PanicException;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Make pyo3's class of panics a subclass of `concordem.InternalError`, with its name.
///
/// pyo3 raises that class for every panic between Python and this library that nobody has caught: while arguments are converted, in
/// getters, in `__repr__`. Its own base is `BaseException`, which `except Exception` does not catch. A Python that does not allow
/// the change keeps pyo3's class.
pub fn adopt_panics(py: Python<'_>) -> PyResult<()> {
    let (panic, base) = (py.get_type::<PanicException>(), py.import("concordem._errors")?.getattr("InternalError")?);
    if panic.setattr("__bases__", (base,)).is_ok() {
        for (name, value) in
            [("__name__", "InternalError"), ("__qualname__", "InternalError"), ("__module__", "concordem")]
        {
            panic.setattr(name, value)?;
        }
    }
    Ok(())
}

/// Run `work` without the interpreter's lock. A panic becomes `concordem.InternalError` here, so that the caller can react to it.
pub fn detach<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    detach_here(py, || with_all_processors(work))
}

/// As [`detach`], but on this thread even if it has a pool of its own.
pub fn detach_here<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| catch_unwind(AssertUnwindSafe(work))).map_err(|payload| internal(&*payload))
}

/// Run `work` with the interpreter's lock. A panic becomes `concordem.InternalError`.
pub fn caught<T>(work: impl FnOnce() -> T) -> PyResult<T> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|payload| internal(&*payload))
}

/// A panic that carries an exception of Python through Rust code that has no other way to end.
pub struct Raised(Mutex<Option<PyErr>>);

impl Raised {
    /// The payload for an exception.
    pub fn new(error: PyErr) -> Self {
        Self(Mutex::new(Some(error)))
    }
}

/// The exception for a panic.
pub fn internal(payload: &(dyn Any + Send)) -> PyErr {
    if let Some(Raised(error)) = payload.downcast_ref()
        && let Some(error) = error.lock().unwrap_or_else(PoisonError::into_inner).take()
    {
        return error;
    }
    let message = payload
        .downcast_ref::<&str>()
        .map(ToString::to_string)
        .or_else(|| payload.downcast_ref::<String>().cloned())
        .unwrap_or_default();
    exception("InternalError", &message, "Panic")
}

/// An error that converts to an exception.
pub trait Raise {
    /// The exception.
    fn raise(self) -> PyErr;
}

/// Converts the error of a result to an exception.
pub trait OrRaise<T> {
    /// The result with its error as an exception.
    fn or_raise(self) -> PyResult<T>;
}

impl<T, E: Raise> OrRaise<T> for Result<T, E> {
    fn or_raise(self) -> PyResult<T> {
        self.map_err(Raise::raise)
    }
}

/// An exception of class `class` with the name of the error's variant.
fn exception(class: &str, message: &str, debug: &str) -> PyErr {
    let kind: String = debug.chars().take_while(|c| c.is_alphanumeric()).collect();
    Python::attach(|py| {
        let make = || -> PyResult<PyErr> {
            let options = PyDict::new(py);
            options.set_item("kind", kind)?;
            let object = py.import("concordem._errors")?.getattr(class)?.call((message,), Some(&options))?;
            Ok(PyErr::from_value(object))
        };
        // Making it may run the handler of a signal, whose exception goes on.
        make().unwrap_or_else(|other| other)
    })
}

macro_rules! raise {
    ($($error:ty => $class:literal,)*) => {
        $(impl Raise for $error {
            fn raise(self) -> PyErr {
                exception($class, &self.to_string(), &format!("{self:?}"))
            }
        })*
    };
}

raise! {
    SolverError => "SolverError",
    RunError => "SolverError",
    OperatorError => "OperatorError",
    PackingError => "PackingError",
    StaticsError => "StaticsError",
    ElasticCalibrationError => "CalibrationError",
    concordem::calibration::cohesive_beam::CalibrationError => "CalibrationError",
    ColumnError => "ResultError",
}

/// The class of a result, checkpoint, or other file that does not exist; it is a `ResultError` and a `FileNotFoundError`.
const MISSING: &str = "MissingFileError";

impl Raise for OutputError {
    fn raise(self) -> PyErr {
        // The option of the program is an argument of functions.
        let message = self.to_string().replace("overwrite it with --force", "give overwrite=True");
        let message = message.replace("discard it with --force", "discard it with overwrite=True");
        let class = match self {
            Self::Missing { .. } | Self::NoRun { .. } => MISSING,
            _ => "ResultError",
        };
        exception(class, &message, &format!("{self:?}"))
    }
}

impl Raise for concordem_continuum::ContinuumError {
    fn raise(self) -> PyErr {
        exception("ContinuumError", &self.to_string(), &format!("{self:?}"))
    }
}

impl<E: std::error::Error> Raise for (usize, E) {
    /// An error at one of many points or cells.
    fn raise(self) -> PyErr {
        let (index, error) = self;
        exception("ContinuumError", &format!("number {index}: {error}"), &format!("{error:?}"))
    }
}

impl Raise for concordem_multiscale::CellError {
    fn raise(self) -> PyErr {
        exception("ContinuumError", &self.to_string(), &format!("{self:?}"))
    }
}

impl Raise for ScenarioError {
    fn raise(self) -> PyErr {
        scenario("ScenarioError", &self)
    }
}

/// Fields of a Python `Problem`.
type Entry<'a> = (String, &'a str, Option<&'a str>, usize, usize, &'a str, &'a str);

/// A problem at this line and column, as the fields of a Python `Problem`.
pub fn entry((line, column): (usize, usize), problem: &Problem) -> Entry<'_> {
    let kind = format!("{:?}", problem.kind);
    (kind, &*problem.key, problem.value.as_deref(), line, column, &*problem.message, &*problem.help)
}

fn scenario(class: &str, error: &ScenarioError) -> PyErr {
    Python::attach(|py| {
        let make = || -> PyResult<PyErr> {
            let places = error.locate(&error.problems);
            let problems: Vec<_> =
                error.problems.iter().zip(places).map(|(problem, place)| entry(place.position, problem)).collect();
            let class = py.import("concordem._errors")?.getattr(class)?;
            Ok(PyErr::from_value(class.call1((error.to_string(), &*error.source_text.name, problems))?))
        };
        make().unwrap_or_else(|other| other)
    })
}

/// The exception for problems of a table that a call of Python has given; messages begin with the `call`, and keys are those in the table,
/// which the scenario has at the key path `table`.
pub fn of_call(call: &str, table: &str, error: &ScenarioError) -> PyErr {
    let own = |problem: &Problem| {
        let key = problem.key.strip_prefix(table).map_or(&problem.key[..], |rest| rest.trim_start_matches('.'));
        Problem { key: key.to_owned(), span: 0..0, ..problem.clone() }
    };
    let line = |problem: &Problem| {
        let help = if problem.help.is_empty() { String::new() } else { format!("\n  help: {}", problem.help) };
        format!("{call}: {}{help}", own(problem))
    };
    let lines: Vec<String> = error.shown().0.iter().map(line).collect();
    let problems: Vec<Problem> = error.problems.iter().map(own).collect();
    Python::attach(|py| {
        let make = || -> PyResult<PyErr> {
            let entries: Vec<_> = problems.iter().map(|problem| entry((1, 1), problem)).collect();
            let class = py.import("concordem._errors")?.getattr("ScenarioError")?;
            Ok(PyErr::from_value(class.call1((lines.join("\n"), call, entries))?))
        };
        make().unwrap_or_else(|other| other)
    })
}

impl Raise for ReadError {
    fn raise(self) -> PyErr {
        match self {
            Self::Scenario(error) => error.raise(),
            Self::Setting(problem) => PyValueError::new_err(problem),
            // The class that Python itself would raise, such as FileNotFoundError.
            Self::Io { error, path } => Python::attach(|py| {
                let make = || -> PyResult<PyErr> {
                    let Some(number) = error.raw_os_error() else {
                        return Ok(PyErr::from(io::Error::other(error.to_string())));
                    };
                    let reason = py.import("os")?.call_method1("strerror", (number,))?;
                    let file = path.display().to_string();
                    Ok(PyErr::from_value(py.get_type::<PyOSError>().call1((number, reason, file))?))
                };
                make().unwrap_or_else(|other| other)
            }),
            other => exception("ResultError", &other.to_string(), &format!("{other:?}")),
        }
    }
}

/// Refuses a file that cannot be looked at, with the class that Python itself would raise, such as FileNotFoundError.
pub fn check_file(path: &Path) -> PyResult<()> {
    std::fs::metadata(path).map(drop).map_err(|error| ReadError::Io { path: path.to_owned(), error }.raise())
}

impl Raise for CharacteriseError {
    fn raise(self) -> PyErr {
        match self {
            Self::Packing(error) => error.raise(),
            other => Failure::from(other).raise(),
        }
    }
}

impl Raise for Failure {
    fn raise(self) -> PyErr {
        match self {
            Self::Scenario(error) => error.raise(),
            Self::Unstable(error) => scenario("UnstableError", &error),
            Self::Assembly(error) => exception("AssemblyError", &error.to_string(), &format!("{error:?}")),
            Self::Output(error) => error.raise(),
            Self::Solver(error) => error.raise(),
            Self::Statics(error) => error.raise(),
            Self::Run(error) => error.raise(),
            Self::Operator(error) => error.raise(),
            Self::Elastic(error) => error.raise(),
            Self::Calibration(message) => exception("CalibrationError", &message, "Calibration"),
            Self::Usage(message) => PyValueError::new_err(message),
            Self::File { ref error, .. } => {
                let class = if error.kind() == io::ErrorKind::NotFound { MISSING } else { "ResultError" };
                exception(class, &self.to_string(), "File")
            }
            other => exception("ConcordemError", &other.to_string(), &format!("{other:?}")),
        }
    }
}

/// The exception for a scenario that cannot be built, with its position in the scenario if known.
pub fn of_assembly(scenario: &Scenario, error: AssemblyError) -> PyErr {
    Failure::of_assembly(scenario, error).raise()
}

/// The exception for a state that a scenario cannot continue.
pub fn of_restart(scenario: &Scenario, error: RestartError) -> PyErr {
    match error {
        RestartError::Scenario(error) => error.raise(),
        RestartError::Column(error) => error.raise(),
        RestartError::Assembly(error) => of_assembly(scenario, error),
        other => PyValueError::new_err(other.to_string()),
    }
}
