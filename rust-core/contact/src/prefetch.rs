//! Memory prefetch for particles and host objects, which lie anywhere in memory.
//!
//! This module contains the only unsafe code of the crate: a prefetch instruction, which reads nothing and cannot fail
//! at any address.

#![allow(unsafe_code)]

/// How many host objects ahead to prefetch.
pub const AHEAD: usize = 24;

/// Prefetch the cache line at an address that the program reads soon.
#[inline(always)]
pub fn prefetch(address: usize) {
    // Safety: a prefetch reads nothing, at any address.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use core::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address as *const i8);
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// Prefetch the cache line in which row `index` of an array begins.
#[inline(always)]
pub fn prefetch_row<T>(rows: &[T], index: usize) {
    prefetch(rows.as_ptr().wrapping_add(index) as usize);
}
