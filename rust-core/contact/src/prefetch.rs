//! Particles of contacts, and objects of hosts, lie anywhere in memory: they are fetched before they are read.
//!
//! The only unsafe code of this crate: an instruction that neither reads nor fails, whatever the address.

#![allow(unsafe_code)]

/// How many objects of a host ahead memory is fetched.
pub const AHEAD: usize = 24;

/// Fetch the line of memory at an address, which will be read soon.
#[inline(always)]
pub fn prefetch(address: usize) {
    // Safety: a prefetch reads nothing, whatever the address.
    #[cfg(target_arch = "x86_64")]
    unsafe {
        use std::arch::x86_64::{_MM_HINT_T0, _mm_prefetch};
        _mm_prefetch::<_MM_HINT_T0>(address as *const i8);
    }
    #[cfg(not(target_arch = "x86_64"))]
    let _ = address;
}

/// Fetch the line of memory in which row `index` of an array begins.
#[inline(always)]
pub fn prefetch_row<T>(rows: &[T], index: usize) {
    prefetch(rows.as_ptr().wrapping_add(index) as usize);
}
