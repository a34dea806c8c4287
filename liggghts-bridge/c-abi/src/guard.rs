//! Converts errors and panics to a status code and a message, so that no panic unwinds into C++.
#![allow(unsafe_code)] // the message buffer of a C caller

use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Caller's buffer for an error message, zero-terminated.
#[repr(C)]
#[derive(Debug)]
#[cfg_attr(feature = "header", derive(type_layout::TypeLayout))]
pub struct Message {
    /// First byte of the buffer; if null, the message is dropped.
    text: *mut c_char,
    /// Size of the buffer, bytes.
    capacity: usize,
}

impl Message {
    /// Write `text` and a zero byte; text that does not fit is truncated at a character boundary.
    ///
    /// # Safety
    /// The buffer must have the stated capacity.
    unsafe fn put(&self, text: &str) {
        if self.text.is_null() || self.capacity == 0 {
            return;
        }
        let mut length = text.len().min(self.capacity - 1);
        while !text.is_char_boundary(length) {
            length -= 1;
        }
        // SAFETY: `length` is below the capacity.
        unsafe {
            std::ptr::copy_nonoverlapping(text.as_ptr(), self.text.cast(), length);
            *self.text.add(length) = 0;
        }
    }
}

fn text_of(panic: &(dyn std::any::Any + Send)) -> String {
    let what = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    format!("internal error of concordem, please report it: {}", what.unwrap_or("unknown"))
}

/// Run `body` and return its value; on an error or a panic, write the message and return −1.
///
/// # Safety
/// `message` must be null or point to a [`Message`] whose buffer has the stated capacity.
pub unsafe fn guarded<E: std::fmt::Display>(message: *const Message, body: impl FnOnce() -> Result<i64, E>) -> i64 {
    let text = match catch_unwind(AssertUnwindSafe(body)) {
        Ok(Ok(value)) => return value,
        Ok(Err(error)) => error.to_string(),
        Err(panic) => text_of(&*panic),
    };
    // SAFETY: as the caller's.
    if let Some(message) = unsafe { message.as_ref() } {
        unsafe { message.put(&text) };
    }
    -1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn run(capacity: usize, body: impl FnOnce() -> Result<i64, String>) -> (i64, String) {
        let mut buffer = vec![0x55_u8; 64];
        let message = Message { text: buffer.as_mut_ptr().cast(), capacity };
        // SAFETY: the buffer is longer than the capacity.
        let status = unsafe { guarded(&raw const message, body) };
        assert!(buffer[capacity..].iter().all(|&byte| byte == 0x55), "wrote past the end of the buffer");
        let end = buffer.iter().position(|&byte| byte == 0 || byte == 0x55).unwrap_or(0);
        (status, String::from_utf8(buffer[..end].to_vec()).expect("whole characters"))
    }

    #[test]
    fn errors_and_panics_become_a_status_and_a_text() {
        assert_eq!(run(32, || Ok(7)), (7, String::new()));
        assert_eq!(run(32, || Err("wrong".into())), (-1, "wrong".into()));
        assert_eq!(run(64, || panic!("no {}", 5)), (-1, "internal error of concordem, please report it: no 5".into()));
        assert_eq!(run(3, || Err("ü€".into())), (-1, "ü".into()));
        assert_eq!(run(0, || Err("wrong".into())), (-1, String::new()));
    }
}
