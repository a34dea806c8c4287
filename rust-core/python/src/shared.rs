//! Data that one thread of Python uses at a time.
//!
//! A panic during a change leaves the data half changed: from then on they are refused. A panic while they are only read leaves them
//! as they were, so they stay usable.

use std::ops::Deref;
use std::sync::{Mutex, MutexGuard, TryLockError};

use concordem::operator::interruption::{Stopped, stoppable};
use pyo3::exceptions::PyRuntimeError;
use pyo3::prelude::*;

use crate::errors::{detach_here, internal};
use crate::work::{Pool, watched};

/// Data behind a lock.
pub struct Shared<T> {
    content: Mutex<Content<T>>,
    /// What to say if another thread uses the data.
    busy: &'static str,
    /// What to say if a change of the data was interrupted by a panic.
    faulty: &'static str,
}

struct Content<T> {
    data: T,
    /// Whether a panic has left the data in the middle of a change.
    fault: bool,
}

/// The locked data, to read; [`Access::change`] changes them.
pub struct Access<'a, T>(MutexGuard<'a, Content<T>>);

impl<T> Shared<T> {
    /// Data with what to say while another thread uses them, and after a panic during a change.
    pub fn new(data: T, busy: &'static str, faulty: &'static str) -> Self {
        Self { content: Mutex::new(Content { data, fault: false }), busy, faulty }
    }

    /// Lock the data; an error if another thread uses them, or if a panic has left them half changed.
    pub fn lock(&self) -> PyResult<Access<'_, T>> {
        self.free().unwrap_or_else(|| Err(PyRuntimeError::new_err(self.busy)))
    }

    /// As [`Self::lock`], but wait while another thread uses the data.
    pub fn wait(&self, py: Python<'_>) -> PyResult<Access<'_, T>> {
        loop {
            if let Some(access) = self.free() {
                return access;
            }
            // Without the interpreter's lock, which the other thread may need to finish.
            py.detach(|| std::thread::sleep(std::time::Duration::from_micros(20)));
        }
    }

    /// The locked data, or an error if a panic has left them half changed; `None` if another thread uses them.
    fn free(&self) -> Option<PyResult<Access<'_, T>>> {
        let content = match self.content.try_lock() {
            Ok(content) => content,
            // A thread panicked with the lock held; `fault` says whether it was changing the data.
            Err(TryLockError::Poisoned(poisoned)) => {
                self.content.clear_poison();
                poisoned.into_inner()
            }
            Err(TryLockError::WouldBlock) => return None,
        };
        Some(if content.fault { Err(PyRuntimeError::new_err(self.faulty)) } else { Ok(Access(content)) })
    }
}

impl<T> Deref for Access<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.0.data
    }
}

impl<T: Send> Access<'_, T> {
    /// Change the data, without the interpreter's lock, on this thread. A panic becomes `concordem.InternalError`, and the data are refused
    /// from then on.
    pub fn change<R: Send>(&mut self, py: Python<'_>, work: impl FnOnce(&mut T) -> R + Send) -> PyResult<R> {
        let Content { data, fault } = &mut *self.0;
        *fault = true;
        let outcome = detach_here(py, || work(data));
        *fault = outcome.is_err();
        outcome
    }

    /// As [`Self::change`], for long work on the threads of `pool`, which signals may stop with an exception. The work may stop only where the
    /// data are sound.
    pub fn change_answering<R: Send>(
        &mut self,
        py: Python<'_>,
        pool: &Pool,
        work: impl FnOnce(&mut T) -> R + Send,
    ) -> PyResult<R> {
        let Content { data, fault } = &mut *self.0;
        *fault = true;
        let (outcome, failure) = watched(py, pool, None, |_, stop| stoppable(Some(stop), || work(data)))?;
        *fault = outcome.as_ref().is_err_and(|payload| !payload.is::<Stopped>());
        match (outcome, failure) {
            (_, Some(error)) => Err(error),
            (Ok(found), None) => Ok(found),
            (Err(payload), None) => Err(internal(&*payload)),
        }
    }
}
