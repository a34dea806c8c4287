//! Functions called from the C++ shims; the test `c_header` generates their header `shim/abi.h`.
//!
//! A function that can fail returns −1 or a null pointer and writes a message. No panic unwinds into C++. Pointers point into the
//! host's arrays; the shim passes their lengths.

pub mod atoms;
#[cfg(test)]
mod c_header;
pub mod heat;
pub mod network;
pub mod pair;
pub mod results;
