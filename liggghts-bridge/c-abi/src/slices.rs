//! The host's arrays as slices.
#![allow(unsafe_code)] // pointers of a C caller

/// A number of elements as C hosts give it.
pub trait Count: Copy + std::fmt::Display {
    /// The number; `None` if it is negative.
    fn length(self) -> Option<usize>;
}

macro_rules! counts {
    ($($Number:ty)*) => { $(
        impl Count for $Number {
            fn length(self) -> Option<usize> {
                usize::try_from(self).ok()
            }
        }
    )* };
}
counts!(i32 i64 u32 u64 usize);

/// A number of elements, which must not be negative.
///
/// # Panics
/// If it is: as an unsigned number it would reach far beyond the array.
pub fn length_of(count: impl Count) -> usize {
    count.length().unwrap_or_else(|| panic!("the host gives an array of {count} elements"))
}

/// The array of `length` elements at `pointer`; empty if `pointer` is null or `length` is 0.
///
/// # Safety
/// `pointer` must be null or point to `length` elements that do not change during `'a`.
///
/// # Panics
/// If `length` is negative.
pub unsafe fn slice<'a, T>(pointer: *const T, length: impl Count) -> &'a [T] {
    if pointer.is_null() {
        return &[];
    }
    match length_of(length) {
        0 => &[],
        // SAFETY: guaranteed by the caller.
        length => unsafe { std::slice::from_raw_parts(pointer, length) },
    }
}

/// Mutable counterpart of [`slice()`].
///
/// # Safety
/// `pointer` must be null or point to `length` elements that nobody else reads or writes during `'a`.
///
/// # Panics
/// If `length` is negative.
pub unsafe fn slice_mut<'a, T>(pointer: *mut T, length: impl Count) -> &'a mut [T] {
    if pointer.is_null() {
        return &mut [];
    }
    match length_of(length) {
        0 => &mut [],
        // SAFETY: guaranteed by the caller.
        length => unsafe { std::slice::from_raw_parts_mut(pointer, length) },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_have_the_length_that_the_host_gives() {
        let mut values = [1, 2, 3];
        // SAFETY: no longer than the array.
        unsafe {
            assert_eq!(slice(values.as_ptr(), 2_i32), [1, 2]);
            assert_eq!(slice(values.as_ptr(), 0_i64), [0; 0]);
            assert_eq!(slice::<i32>(std::ptr::null(), 5_usize), [0; 0]);
            slice_mut(values.as_mut_ptr(), 3_i64)[2] = 7;
        }
        assert_eq!(values, [1, 2, 7]);
    }

    #[test]
    fn negative_lengths_are_refused() {
        for length in [-1_i64, i64::MIN] {
            // SAFETY: refused before the pointer is used.
            let read = || unsafe { slice(std::ptr::NonNull::<u8>::dangling().as_ptr(), length).len() };
            assert!(std::panic::catch_unwind(read).is_err());
            // SAFETY: as above.
            let write =
                || unsafe { slice_mut(std::ptr::NonNull::<u8>::dangling().as_ptr(), length as i32 | i32::MIN).len() };
            assert!(std::panic::catch_unwind(write).is_err());
        }
    }
}
