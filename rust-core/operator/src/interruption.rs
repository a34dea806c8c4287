//! Work that can be stopped: long loops look whether it shall stop, and unwind then. A host that answers signals runs its work with a flag,
//! and sets it when the user is tired of waiting.
//!
//! ```
//! use std::sync::{Arc, atomic::{AtomicBool, Ordering}};
//! use concordem_operator::interruption::{Stopped, look, stoppable};
//!
//! let flag = Arc::new(AtomicBool::new(false));
//! assert_eq!(stoppable(Some(flag.clone()), || { look(); 1 }), 1);
//! flag.store(true, Ordering::Relaxed);
//! let end = std::panic::catch_unwind(|| stoppable(Some(flag), look));
//! assert!(end.unwrap_err().is::<Stopped>());
//! ```

use std::cell::RefCell;
use std::panic::resume_unwind;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

thread_local! {
    /// The flag of the work that this thread does.
    static FLAG: RefCell<Option<Arc<AtomicBool>>> = const { RefCell::new(None) };
}

/// With what stopped work unwinds.
#[derive(Debug)]
pub struct Stopped;

/// Run `work`, which stops when the flag is set. Without a flag it goes on to its end, also where a thread does it that waits for other work.
pub fn stoppable<T>(flag: Option<Arc<AtomicBool>>, work: impl FnOnce() -> T) -> T {
    struct Before(Option<Arc<AtomicBool>>);
    impl Drop for Before {
        fn drop(&mut self) {
            FLAG.replace(self.0.take());
        }
    }
    let _before = Before(FLAG.replace(flag));
    work()
}

/// Unwind with [`Stopped`] if the work of this thread shall stop.
pub fn look() {
    FLAG.with_borrow(|flag| look_at(flag.as_ref()));
}

fn look_at(flag: Option<&Arc<AtomicBool>>) {
    if flag.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
        // No panic: nothing is wrong, and no message appears.
        resume_unwind(Box::new(Stopped));
    }
}

/// What the parts of a loop look at that other threads take over.
#[derive(Clone)]
pub struct Watch(Option<Arc<AtomicBool>>);

impl Watch {
    /// That of the work of this thread.
    pub fn here() -> Self {
        Self(FLAG.with_borrow(Clone::clone))
    }

    /// As [`look`].
    pub fn look(&self) {
        look_at(self.0.as_ref());
    }

    /// Run a part of the work, whose own loops also look.
    pub fn part<T>(&self, work: impl FnOnce() -> T) -> T {
        stoppable(self.0.clone(), work)
    }
}
