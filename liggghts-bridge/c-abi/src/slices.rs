//! Arrays of the host as slices.
#![allow(unsafe_code)] // pointers of a C caller

/// The array of `length` elements at `pointer`; a null pointer or no length is an empty array.
///
/// # Safety
/// `pointer` must be null or lead to `length` elements that nothing changes during `'a`.
pub unsafe fn slice<'a, T>(pointer: *const T, length: usize) -> &'a [T] {
    // SAFETY: the caller's promise.
    if pointer.is_null() || length == 0 { &[] } else { unsafe { std::slice::from_raw_parts(pointer, length) } }
}

/// The array of `length` elements at `pointer`, to be changed; a null pointer or no length is an empty array.
///
/// # Safety
/// `pointer` must be null or lead to `length` elements that nothing else reads or changes during `'a`.
pub unsafe fn slice_mut<'a, T>(pointer: *mut T, length: usize) -> &'a mut [T] {
    // SAFETY: the caller's promise.
    if pointer.is_null() || length == 0 { &mut [] } else { unsafe { std::slice::from_raw_parts_mut(pointer, length) } }
}
