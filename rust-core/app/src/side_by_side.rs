//! Independent pieces of work, side by side.

use std::sync::atomic::{AtomicUsize, Ordering};

/// Does `work` for 0 to `count` - 1, as many at once as there are threads; each then has one thread. Fewer pieces share the threads.
/// Each piece has its own threads: in a shared pool, a thread that waits within one piece would begin another one.
pub(crate) fn side_by_side(count: usize, work: impl Fn(usize) + Sync) {
    let threads = rayon::current_num_threads();
    let workers = threads.min(count).max(1);
    let next = AtomicUsize::new(0);
    let some = || {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads((threads / workers).max(1)).build() else { return };
        loop {
            let k = next.fetch_add(1, Ordering::Relaxed);
            if k >= count {
                return;
            }
            pool.install(|| work(k));
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(some);
        }
    });
}
