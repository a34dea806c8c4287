//! The allocator of the program: where memory does not suffice, it ends with a message and an exit code instead of an abort.

#![allow(unsafe_code)] // `GlobalAlloc`

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;

/// The allocator of the system, whose refusals end the program.
pub struct OrExit;

unsafe extern "C" {
    /// Ends the process at once. Functions that libraries have registered for its end would need memory, or a lock that this thread holds.
    safe fn _exit(code: i32) -> !;
}

/// The memory at `pointer`, or the end of the program if there is none.
fn or_exit(pointer: *mut u8, bytes: usize) -> *mut u8 {
    if pointer.is_null() {
        refused(bytes);
    }
    pointer
}

/// Ends the program because the system refuses so many bytes.
#[cold]
fn refused(bytes: usize) -> ! {
    // Formatted in place: there is no memory to take.
    let mut text = [0_u8; 400];
    let mut rest = &mut text[..];
    let _ = writeln!(
        rest,
        "concordem: the memory does not suffice: {bytes} bytes more were refused. Take fewer particles or threads, or raise the limit of the \
         process (ulimit -v).\nWhat a checkpoint holds is safe: `concordem resume` continues from it."
    );
    let left = rest.len();
    let length = text.len() - left;
    let _ = std::io::stderr().write_all(&text[..length]);
    _exit(i32::from(concordem::program::exit::PHYSICS))
}

// SAFETY: the allocator of the system, except that it does not return where memory is refused.
unsafe impl GlobalAlloc for OrExit {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        or_exit(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: as the caller's.
        or_exit(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, pointer: *mut u8, layout: Layout, size: usize) -> *mut u8 {
        // SAFETY: as the caller's.
        or_exit(unsafe { System.realloc(pointer, layout, size) }, size)
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as the caller's.
        unsafe { System.dealloc(pointer, layout) }
    }
}
