//! Small computations on the host's own thread.
//!
//! A pool of one thread computes on another thread than the caller's: in every step of the host, the caller sleeps, the worker wakes,
//! computes, and looks for more work before it sleeps. For specimens of hundreds of particles this takes as long as the computation.

use std::cell::{Cell, OnceCell};

use rayon::{ThreadPool, ThreadPoolBuilder};

/// Number of computations of a thread before it gets a pool of its own. Such a pool lives as long as the process (some kilobytes), so
/// threads of short runs do not get one.
const WORTH: u32 = 256;

thread_local! {
    static COMPUTATIONS: Cell<u32> = const { Cell::new(0) };
    /// A pool whose only thread is this one; `None`: none can be made.
    static OWN: OnceCell<Option<ThreadPool>> = const { OnceCell::new() };
}

/// Whether this is the first thread of the process. A script may use all processors there, which a pool of its own would prevent.
fn is_first_thread() -> bool {
    let this = std::fs::read_link("/proc/thread-self").ok();
    let name = this.as_deref().and_then(|path| path.file_name());
    name.is_none_or(|name| name.to_string_lossy() == std::process::id().to_string())
}

/// Run `work` inside `pool`, or on this thread if the pool has one thread. Results do not depend on this.
pub fn inside<T: Send>(pool: &ThreadPool, work: impl FnOnce() -> T + Send) -> T {
    let count = COMPUTATIONS.get();
    if pool.current_num_threads() > 1 || count < WORTH {
        COMPUTATIONS.set(count.saturating_add(1));
        return pool.install(work);
    }
    let make = || ThreadPoolBuilder::new().num_threads(1).use_current_thread().build().ok();
    OWN.with(|own| match own.get_or_init(|| if is_first_thread() { None } else { make() }) {
        Some(own) => own.install(work),
        None => pool.install(work),
    })
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
    fn a_larger_pool_does_not() {
        let (found, caller) = threads(2);
        assert!(found.iter().all(|&thread| thread != caller));
    }
}
