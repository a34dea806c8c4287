//! Long work without the interpreter's lock: thread pools, progress, and signals.

use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use concordem::operator::interruption::{Stopped, look, stoppable};
use concordem::program::Listener;
use concordem::solver::own_thread::{Workers, alone, beside, beside_all_processors, with_all_processors};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

use crate::errors::{detach, internal};

/// Interval between checks for signals.
pub const SLICE: Duration = Duration::from_millis(50);
/// Interval between calls of the progress function.
pub const REPORT: Duration = Duration::from_millis(200);

/// The threads on which work is done. Results do not depend on them.
pub enum Pool {
    /// One for each processor.
    All,
    /// The caller's thread alone; no other one is started.
    One,
    /// This number of threads.
    Some(usize, Workers),
}

impl Pool {
    /// The pool for the argument `threads`.
    pub fn new(threads: Option<usize>) -> PyResult<Self> {
        match threads {
            None => Ok(Self::All),
            Some(0) => Err(PyValueError::new_err("threads is 0; give at least 1")),
            Some(1) => Ok(Self::One),
            Some(threads) => match Workers::new(threads) {
                Ok(workers) => Ok(Self::Some(threads, workers)),
                Err(error) => Err(PyRuntimeError::new_err(format!("cannot start {threads} threads: {error}"))),
            },
        }
    }

    /// Run `work` on these threads, so that parallel loops do not enter them individually.
    pub fn inside<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        let work = || stoppable(None, work);
        match self {
            Self::All => with_all_processors(|| rayon::scope(|_| work())),
            Self::One => alone(work),
            Self::Some(_, workers) => workers.install(work),
        }
    }

    /// Run `work` on these threads, and meanwhile `here` on the present one.
    fn beside<T: Send>(&self, work: impl FnOnce() -> T + Send, here: impl FnOnce()) -> PyResult<Option<T>> {
        Ok(match self {
            Self::All => beside_all_processors(work, here),
            // A worker beside this thread, which ends with the work.
            Self::One => {
                beside(Workers::new(1).map_err(|e| PyRuntimeError::new_err(e.to_string()))?.pool(), work, here)
            }
            Self::Some(_, workers) => beside(workers.pool(), work, here),
        })
    }

    /// The argument `threads` for a pool like this one.
    pub fn wanted(&self) -> Option<usize> {
        match self {
            Self::All => None,
            Self::One => Some(1),
            Self::Some(threads, _) => Some(*threads),
        }
    }

    /// Number of threads.
    pub fn threads(&self) -> usize {
        match self {
            Self::All => with_all_processors(rayon::current_num_threads),
            Self::One => 1,
            Self::Some(threads, _) => *threads,
        }
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

/// Run long work without the interpreter's lock, in other threads. Meanwhile this thread checks for signals, which Python handles in its
/// main thread alone, and calls `progress` with the last stage and fraction that the work has reported. Both may stop the work with an
/// exception; it ends when it reports again, or when one of its loops looks.
pub fn guarded<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(&mut dyn FnMut(&str, f64)) -> T + Send,
) -> PyResult<T> {
    settled(watched(py, &Pool::new(threads)?, progress, |report, stop| {
        // The work has no other way to stop than to unwind.
        stoppable(Some(stop), || {
            work(&mut |stage, share| {
                look();
                report(stage, share);
            })
        })
    })?)
}

/// Stages that end by themselves when they are told to, and keep what they have.
const KEEPING: [&str; 2] = ["running", "sweep"];

/// Run a command of the program as [`guarded`] does, on its own thread, from which it starts others. It gets a flag that asks it to
/// end, and a function that receives its progress.
pub fn commanded<T: Send>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Listener, Arc<AtomicBool>) -> T + Send,
) -> PyResult<T> {
    settled(watched(py, &Pool::One, progress, |report, stop| {
        let own = stop.clone();
        let listener = move |stage: &str, share: f64| {
            if own.load(Ordering::Relaxed) && !KEEPING.contains(&stage) {
                resume_unwind(Box::new(Stopped));
            }
            report(stage, share);
        };
        work(Arc::new(listener), stop)
    })?)
}

/// What became of work, and the exception that should have stopped it.
type Ended<T> = (std::thread::Result<T>, Option<PyErr>);

fn settled<T>((outcome, failure): Ended<T>) -> PyResult<T> {
    match (outcome, failure) {
        (_, Some(error)) => Err(error),
        (Ok(found), None) => Ok(found),
        (Err(payload), None) => Err(internal(&*payload)),
    }
}

/// What [`guarded`] and [`commanded`] do, on the threads of `pool`; the work receives a function to report to, and a flag that asks it to end.
pub fn watched<T: Send>(
    py: Python<'_>,
    pool: &Pool,
    progress: Option<&Bound<'_, PyAny>>,
    work: impl FnOnce(Box<dyn Fn(&str, f64) + Send + Sync>, Arc<AtomicBool>) -> T + Send,
) -> PyResult<Ended<T>> {
    let report = reporter(py, progress)?;
    let (stop, last) = (Arc::new(AtomicBool::new(false)), Arc::new(Mutex::new(None::<(String, f64)>)));
    // Whether there was something to tell.
    let tell = |py: Python<'_>| {
        let latest = last.lock().map_or(None, |mut last| last.take());
        match (&report, latest) {
            (Some(report), Some(latest)) => report.call1(py, latest).map(|_| true),
            _ => Ok(false),
        }
    };
    let mut failure = None;
    let mut told: Option<Instant> = None;
    let outcome = py.detach(|| {
        let (running, ended) = channel::<()>();
        let (stop_work, latest) = (stop.clone(), last.clone());
        let keep = move |stage: &str, share: f64| {
            if let Ok(mut last) = latest.lock() {
                *last = Some((stage.to_owned(), share));
            }
        };
        let guarded = || {
            let _running = running;
            catch_unwind(AssertUnwindSafe(|| work(Box::new(keep), stop_work)))
        };
        let look = || {
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
        };
        pool.beside(guarded, look)
    })?;
    let outcome = outcome.unwrap_or_else(|| Err(Box::new("the work did not begin")));
    let ended = if failure.is_none() && outcome.is_ok() { tell(py).map(|_| ()) } else { Ok(()) };
    close(py, report.as_ref())?;
    ended?;
    Ok((outcome, failure))
}

/// Particles, contacts, and points from which on an operator may take so long that signals must be answered meanwhile. Below, starting
/// a thread would take as long as the work.
const LONG: usize = 20_000;

/// As [`detach`], for work on `size` particles, contacts, or points: where that is long, signals may stop it with an
/// exception.
pub fn answering<T: Send>(py: Python<'_>, size: usize, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    if size < LONG { detach(py, work) } else { guarded(py, None, None, |_| work()) }
}

/// End the line of a progress bar.
pub fn close(py: Python<'_>, report: Option<&Py<PyAny>>) -> PyResult<()> {
    match report {
        Some(report) if report.bind(py).hasattr("close")? => report.call_method0(py, "close").map(drop),
        _ => Ok(()),
    }
}
