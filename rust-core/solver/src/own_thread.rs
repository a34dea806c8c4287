//! Computations of a process whose threads may be another program's: on the caller's own thread, in pools that survive a fork.
//!
//! A pool of one thread computes on another thread than the caller's: in every step of the host, the caller sleeps, the worker wakes,
//! computes, and looks for more work before it sleeps. For specimens of hundreds of particles this takes as long as the computation.
//!
//! A process that forks gives the child its memory, but only the thread that forked. A pool in that memory would wait forever for its
//! threads. So a pool belongs to its process; a child makes another one.

use std::cell::{Cell, OnceCell};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicBool, Ordering};

use rayon::{ThreadPool, ThreadPoolBuildError, ThreadPoolBuilder};

/// Number of computations of a thread before it gets a pool of its own. Such a pool lives as long as the process (some kilobytes), so
/// threads of short runs do not get one.
const WORTH: u32 = 256;

thread_local! {
    static COMPUTATIONS: Cell<u32> = const { Cell::new(0) };
    /// A pool whose only thread is this one; `None`: none can be made.
    static OWN: OnceCell<Option<ThreadPool>> = const { OnceCell::new() };
}

/// Whether a fork has made this process.
static FORKED: AtomicBool = AtomicBool::new(false);

/// A pool of threads in this process, and in each child of it that a fork makes.
pub struct Workers {
    threads: usize,
    first: OnceLock<Made>,
}

/// A pool of one process.
struct Made {
    process: u32,
    /// Empty only while it is dropped.
    pool: Option<ThreadPool>,
    /// That of a child of this process.
    next: OnceLock<Box<Made>>,
}

impl Made {
    fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        let pool = Some(ThreadPoolBuilder::new().num_threads(threads).build()?);
        Ok(Self { process: std::process::id(), pool, next: OnceLock::new() })
    }
}

impl Drop for Made {
    fn drop(&mut self) {
        // The threads of another process cannot be told to end.
        if self.process != std::process::id() {
            std::mem::forget(self.pool.take());
        }
    }
}

impl Workers {
    /// A pool with this number of threads; 0: one for each processor. The threads start now.
    ///
    /// # Errors
    /// The threads cannot be started.
    pub fn new(threads: usize) -> Result<Self, ThreadPoolBuildError> {
        Ok(Self { threads, first: OnceLock::from(Made::new(threads)?) })
    }

    /// Number of threads, for a pool that was made with one.
    pub fn threads(&self) -> usize {
        self.threads
    }

    /// The pool of this process.
    ///
    /// # Panics
    /// The threads cannot be started, in a process that a fork has made.
    pub fn pool(&self) -> &ThreadPool {
        let process = std::process::id();
        // Made before it is stored, so that no other thread can be in the middle of that when the process forks.
        let make = || Made::new(self.threads).expect("the threads of a forked process can be started");
        let mut made = if let Some(first) = self.first.get() {
            first
        } else {
            let first = make();
            self.first.get_or_init(|| first)
        };
        while made.process != process {
            made = if let Some(next) = made.next.get() {
                next
            } else {
                let next = Box::new(make());
                made.next.get_or_init(|| next)
            };
        }
        made.pool.as_ref().expect("a pool that is not dropped")
    }

    /// Run `work` on the threads of this process.
    pub fn install<T: Send>(&self, work: impl FnOnce() -> T + Send) -> T {
        self.pool().install(work)
    }
}

/// A pool with a thread for each processor.
fn all_processors() -> &'static ThreadPool {
    static ALL: Workers = Workers { threads: 0, first: OnceLock::new() };
    ALL.pool()
}

/// Run `work` on this thread alone, without starting another one. Results do not depend on this.
pub fn alone<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    OWN.with(|own| match own.get_or_init(own_pool) {
        Some(own) => own.install(work),
        // A worker of another pool, which may share the work.
        None => work(),
    })
}

fn own_pool() -> Option<ThreadPool> {
    ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok()
}

/// Run `work` inside `workers`, or on this thread if there is one thread. Results do not depend on this.
pub fn inside<T: Send>(workers: &Workers, work: impl FnOnce() -> T + Send) -> T {
    let count = COMPUTATIONS.get();
    if workers.threads != 1 || count < WORTH {
        COMPUTATIONS.set(count.saturating_add(1));
        return workers.install(work);
    }
    alone(work)
}

/// The pool in which this thread should compute with all processors; `None`: the one that it is in, or that of the process. A thread that
/// has a pool of its own would compute alone, and the pool of the process has no threads after a fork.
fn shared_pool() -> Option<&'static ThreadPool> {
    let has_own = OWN.with(|own| matches!(own.get(), Some(Some(_))));
    (has_own || FORKED.load(Ordering::Relaxed)).then(all_processors)
}

/// Run `work` with all processors. Results do not depend on this.
pub fn with_all_processors<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    match shared_pool() {
        Some(all) => all.install(work),
        None => work(),
    }
}

/// Run `work` on a thread with all processors, and meanwhile `here` on this one.
pub fn beside_all_processors<T: Send>(work: impl FnOnce() -> T + Send, here: impl FnOnce()) -> Option<T> {
    if let Some(all) = shared_pool() {
        return beside(all, work, here);
    }
    let mut found = None;
    rayon::in_place_scope(|scope| {
        scope.spawn(|_| found = Some(work()));
        here();
    });
    found
}

/// Run `work` on a thread of `pool`, and meanwhile `here` on this one, which is not one of them.
pub fn beside<T: Send>(pool: &ThreadPool, work: impl FnOnce() -> T + Send, here: impl FnOnce()) -> Option<T> {
    let mut found = None;
    pool.in_place_scope(|scope| {
        scope.spawn(|_| found = Some(work()));
        here();
    });
    found
}

/// Prepare the only thread of a process that a fork has just made: what it computes without a pool of threads, it computes alone.
pub fn after_fork() {
    FORKED.store(true, Ordering::Relaxed);
    alone(|| ());
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    /// The threads that compute in 300 calls from a new thread, without repetition, and that thread.
    fn threads(size: usize) -> (Vec<std::thread::ThreadId>, std::thread::ThreadId) {
        let run = move || {
            let pool = Workers::new(size).expect("a pool");
            let here = || (0..8).into_par_iter().map(|_| std::thread::current().id()).collect::<Vec<_>>();
            let mut found: Vec<_> = (0..WORTH + 44).map(|_| inside(&pool, here)).collect();
            let last = found.pop().expect("calls");
            (last, std::thread::current().id())
        };
        std::thread::spawn(run).join().expect("the thread ends")
    }

    #[test]
    fn a_pool_of_one_thread_computes_on_the_callers_thread() {
        let (found, caller) = threads(1);
        assert!(found.iter().all(|&thread| thread == caller));
    }

    #[test]
    fn other_work_of_that_thread_uses_all_processors() {
        let run = || {
            let pool = Workers::new(1).expect("a pool");
            let before = with_all_processors(|| std::thread::current().id());
            for _ in 0..=WORTH {
                inside(&pool, || ());
            }
            let caller = std::thread::current().id();
            let after = with_all_processors(|| (std::thread::current().id(), rayon::current_num_threads()));
            (caller, before, after, inside(&pool, || (std::thread::current().id(), rayon::current_num_threads())))
        };
        let (caller, before, after, ours) = std::thread::spawn(run).join().expect("the thread ends");
        let all = ThreadPoolBuilder::new().build().expect("a pool").current_num_threads();
        assert_eq!(before, caller);
        assert!(after.0 != caller && after.1 == all);
        assert_eq!(ours, (caller, 1));
    }

    #[test]
    fn a_larger_pool_does_not() {
        let (found, caller) = threads(2);
        assert!(found.iter().all(|&thread| thread != caller));
    }
}
