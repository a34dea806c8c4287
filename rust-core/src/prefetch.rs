//! Objects of a host lie anywhere in memory: they are fetched before they are read.

#![allow(unsafe_code)]

/// How many objects ahead memory is fetched.
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
}
