//! Small computations on the host's own thread.
//!
//! A pool of one thread computes on another thread than the caller's: in every step of the host, the caller sleeps, the worker wakes,
//! computes, and looks for more work before it sleeps. For specimens of hundreds of particles this takes as long as the computation.

use std::cell::{Cell, OnceCell};
use std::sync::OnceLock;

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Number of computations of a thread before it gets a pool of its own. Such a pool lives as long as the process (some kilobytes), so
/// threads of short runs do not get one.
const WORTH: u32 = 256;

thread_local! {
    static COMPUTATIONS: Cell<u32> = const { Cell::new(0) };
    /// A pool whose only thread is this one; `None`: none can be made.
    static OWN: OnceCell<Option<ThreadPool>> = const { OnceCell::new() };
}

/// Run `work` inside `pool`, or on this thread if the pool has one thread. Results do not depend on this.
pub fn inside<T: Send>(pool: &ThreadPool, work: impl FnOnce() -> T + Send) -> T {
    let count = COMPUTATIONS.get();
    if pool.current_num_threads() > 1 || count < WORTH {
        COMPUTATIONS.set(count.saturating_add(1));
        return pool.install(work);
    }
    let make = || ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok();
    OWN.with(|own| match own.get_or_init(make) {
        Some(own) => own.install(work),
        None => pool.install(work),
    })
}

/// Run `work` with all processors. A thread that has a pool of its own would compute alone, so it uses another pool of the process.
/// Results do not depend on this.
pub fn with_all_processors<T: Send>(work: impl FnOnce() -> T + Send) -> T {
    static ALL: OnceLock<Option<ThreadPool>> = OnceLock::new();
    if !OWN.with(|own| matches!(own.get(), Some(Some(_)))) {
        return work();
    }
    match ALL.get_or_init(|| ThreadPoolBuilder::new().build().ok()) {
        Some(all) => all.install(work),
        None => work(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rayon::prelude::*;

    /// The threads that compute in 300 calls from a new thread, without repetition, and that thread.
    fn threads(size: usize) -> (Vec<std::thread::ThreadId>, std::thread::ThreadId) {
        let run = move || {
            let pool = ThreadPoolBuilder::new().num_threads(size).build().expect("a pool");
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
            let pool = ThreadPoolBuilder::new().num_threads(1).build().expect("a pool");
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
