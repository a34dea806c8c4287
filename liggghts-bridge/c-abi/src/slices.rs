//! The host's arrays as slices.
#![allow(unsafe_code)] // pointers of a C caller

/// The array of `length` elements at `pointer`; empty if `pointer` is null or `length` is 0.
///
/// # Safety
/// `pointer` must be null or point to `length` elements that do not change during `'a`.
pub unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    // SAFETY: guaranteed by the caller.
    if pointer.is_null() || length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } }
}

/// Mutable counterpart of [`slice()`].
///
/// # Safety
/// `pointer` must be null or point to `length` elements that nobody else reads or writes during `'a`.
pub unsafe fn slice_mut<'a, T>(pointer: *mut T, length: usize) -> &'a mut [T] {
    // SAFETY: guaranteed by the caller.
    if pointer.is_null() || length == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, length) } }
}
