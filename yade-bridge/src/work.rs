//! Long work without the interpreter's lock: thread pools, progress, and signals.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::{Duration, Instant};

use concordem_yade::own_thread::with_all_processors;
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::internal;

/// Interval between checks for signals.
pub const SLICE: Duration = Duration::from_millis(50);
/// Interval between calls of the progress function.
pub const REPORT: Duration = Duration::from_millis(200);

/// Payload that unwinds work which a signal handler or a progress function has stopped.
struct Stopped;

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

/// Run long work without the interpreter's lock, in a thread of its own. Meanwhile this thread checks for signals, which Python handles in its
/// main thread alone, and calls `progress` with the last stage and fraction that the work has reported. Both may stop the work with an
/// exception; it ends when it reports again.
pub fn guarded<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut dyn FnMut(&str, f64)) -> T + Send,
) -> PyResult<T> {
    let pool = pool(threads)?;
    let report = reporter(py, progress)?;
    let (stop, last) = (AtomicBool::new(false), Mutex::new(None::<(String, f64)>));
    // Whether there was something to tell.
    let tell = |py: Python<'_>| {
        let latest = last.lock().map_or(None, |mut last| last.take());
        match (&report, latest) {
            (Some(report), Some(latest)) => report.call1(py, latest).map(|_| true),
            _ => Ok(false),
        }
    };
    let mut failure = None;
    let outcome = py.detach(|| {
        std::thread::scope(|scope| {
            let (running, ended) = channel::<()>();
            let worker = scope.spawn(|| {
                let _running = running;
                catch_unwind(AssertUnwindSafe(|| {
                    inside(pool.as_ref(), || {
                        work(&mut |stage, share| {
                            if stop.load(Ordering::Relaxed) {
                                // The work has no other way to stop; none of its data is kept.
                                resume_unwind(Box::new(Stopped));
                            }
                            if let Ok(mut last) = last.lock() {
                                *last = Some((stage.to_owned(), share));
                            }
                        })
                    })
                }))
            });
            let mut told: Option<Instant> = None;
            while ended.recv_timeout(SLICE) == Err(RecvTimeoutError::Timeout) {
                if failure.is_some() {
                    continue;
                }
                let looked = Python::attach(|py| {
                    py.check_signals()?;
                    if told.is_none_or(|at| at.elapsed() >= REPORT) && tell(py)? {
                        told = Some(Instant::now());
                    }
                    Ok(())
                });
                if let Err(error) = looked {
                    failure = Some(error);
                    stop.store(true, Ordering::Relaxed);
                }
            }
            worker.join().unwrap_or_else(Err)
        })
    });
    let ended = if failure.is_none() && outcome.is_ok() { tell(py).map(|_| ()) } else { Ok(()) };
    close(py, report.as_ref())?;
    ended?;
    match (outcome, failure) {
        (_, Some(error)) => Err(error),
        (Ok(found), None) => Ok(found),
        (Err(payload), None) => Err(internal(&*payload)),
    }
}

/// End the line of a progress bar.
pub fn close(py: Python<'_>, report: Option<&Py<PyAny>>) -> PyResult<()> {
    match report {
        Some(report) if report.bind(py).hasattr("close")? => report.call_method0(py, "close").map(drop),
        _ => Ok(()),
    }
}
