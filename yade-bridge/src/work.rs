//! Long work without the interpreter's lock: thread pools, progress, and signals.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::time::{Duration, Instant};

use concordem_yade::own_thread::with_all_processors;
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::internal;

/// Interval between checks for signals.
pub const SLICE: Duration = Duration::from_millis(50);
/// Interval between calls of the progress function.
pub const REPORT: Duration = Duration::from_millis(200);

/// Payload that carries an exception of a signal handler or progress function back to Python.
struct Interrupted(PyErr);

/// A pool with this number of threads; `None`: the global pool, with all processors.
pub fn pool(threads: Option<usize>) -> PyResult<Option<rayon::ThreadPool>> {
    let Some(threads) = threads else { return Ok(None) };
    if threads == 0 {
        return Err(PyValueError::new_err("threads is 0; give at least 1"));
    }
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    pool.map(Some).map_err(|error| PyRuntimeError::new_err(format!("cannot start {threads} threads: {error}")))
}

/// Run `work` inside a pool, so that parallel loops do not enter it individually.
pub fn inside<T: Send>(pool: Option<&rayon::ThreadPool>, work: impl FnOnce() -> T + Send) -> T {
    match pool {
        Some(pool) => pool.install(work),
        None => with_all_processors(|| rayon::scope(|_| work())),
    }
}

/// The progress function for the argument `progress`: a callable, or a bar for True, or none.
pub fn reporter<'py>(py: Python<'py>, progress: Option<&Bound<'py, PyAny>>) -> PyResult<Option<Py<PyAny>>> {
    match progress {
        None => Ok(None),
        Some(object) if object.is_none() => Ok(None),
        Some(object) if object.is_callable() => Ok(Some(object.clone().unbind())),
        Some(object) => match object.extract::<bool>() {
            Ok(true) => Ok(Some(py.import("concordem._progress")?.getattr("bar")?.call0()?.unbind())),
            Ok(false) => Ok(None),
            Err(_) => Err(PyTypeError::new_err("progress must be True, False, or a function")),
        },
    }
}

/// Run long work without the interpreter's lock. When it reports, `progress` (stage, fraction) is called and signals are checked;
/// both may stop it with an exception.
pub fn guarded<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut dyn FnMut(&str, f64)) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let report = reporter(py, progress)?;
    let outcome = py.detach(|| {
        catch_unwind(AssertUnwindSafe(|| {
            inside(pool.as_ref(), || {
                let mut last: Option<Instant> = None;
                let mut look = |stage: &str, share: f64| {
                    if last.is_some_and(|at| at.elapsed() < SLICE) {
                        return;
                    }
                    let told = Python::attach(|py| {
                        py.check_signals()?;
                        match &report {
                            Some(report) if last.is_none_or(|at| at.elapsed() >= REPORT) => {
                                report.call1(py, (stage, share)).map(drop)
                            }
                            _ => Ok(()),
                        }
                    });
                    last = Some(Instant::now());
                    if let Err(error) = told {
                        // Unwind to cancel the work, which has no other way to stop; none of its data is kept.
                        resume_unwind(Box::new(Interrupted(error)));
                    }
                };
                work(&mut look)
            })
        }))
    });
    close(py, report.as_ref())?;
    outcome.map_err(|payload: Box<dyn Any + Send>| match payload.downcast::<Interrupted>() {
        Ok(interrupted) => interrupted.0,
        Err(other) => internal(&*other),
    })
}

/// End the line of a progress bar.
pub fn close(py: Python<'_>, report: Option<&Py<PyAny>>) -> PyResult<()> {
    match report {
        Some(report) if report.bind(py).hasattr("close")? => report.call_method0(py, "close").map(drop),
        _ => Ok(()),
    }
}
