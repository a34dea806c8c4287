//! Functions called from the C++ shims; the test `c_header` generates their header `shim/abi.h`.
//!
//! A function that can fail returns −1 or a null pointer and writes a message. No panic unwinds into C++. Pointers point into the
//! host's arrays; the shim passes their lengths.

// As in the modules below.
#![allow(unsafe_code)]

use concordem_c_abi::{Message, guarded};

use crate::options::OptionError;

pub mod atoms;
#[cfg(test)]
mod c_header;
pub mod heat;
pub mod network;
pub mod pair;
pub mod results;

/// Run `body` and return 0; on an error, set `line` to its line of a file, write the message, and return −1.
unsafe fn guarded_with_line(
    message: *const Message,
    line: *mut i64,
    body: impl FnOnce() -> Result<(), (i64, OptionError)>,
) -> i64 {
    // SAFETY: valid pointers from the shim.
    unsafe {
        guarded(message, || {
            body().map(|()| 0).map_err(|(of_error, error)| {
                *line = of_error;
                error
            })
        })
    }
}
