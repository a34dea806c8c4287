//! Errors and panics on their way to C++: a status and a text, never an unwinding stack.

use std::ffi::c_char;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Where a message goes: a buffer of the caller.
#[repr(C)]
pub struct Message {
    text: *mut c_char,
    capacity: usize,
}

impl Message {
    /// Write a text, cut to the buffer, with a zero at its end.
    ///
    /// # Safety
    /// The buffer must have the capacity it says.
    #[allow(unsafe_code)]
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

/// Text of a panic.
fn text_of(panic: &(dyn std::any::Any + Send)) -> String {
    let what = panic.downcast_ref::<String>().map(String::as_str).or(panic.downcast_ref::<&str>().copied());
    format!("internal error of concordem, please report it: {}", what.unwrap_or("unknown"))
}

/// Run `body`; −1 and a message if it fails or panics.
///
/// # Safety
/// `message` must point to a buffer, see [`Message`].
#[allow(unsafe_code)]
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
#[allow(unsafe_code)]
mod tests {
    use super::*;

    fn run(capacity: usize, body: impl FnOnce() -> Result<i64, String>) -> (i64, String) {
        let mut buffer = vec![0x55_u8; 64];
        let message = Message { text: buffer.as_mut_ptr().cast(), capacity };
        // SAFETY: the buffer is longer than the capacity.
        let status = unsafe { guarded(&raw const message, body) };
        assert!(buffer[capacity..].iter().all(|&byte| byte == 0x55), "written behind the buffer");
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
