//! The functions that the C++ shims call; the test `c_header` generates their header `shim/abi.h`.
//!
//! A function that can fail returns −1 or a null pointer and writes a message; none unwinds into C++. Pointers lead into the arrays
//! of the host; the shim states their lengths.

pub mod atoms;
#[cfg(test)]
mod c_header;
pub mod network;
pub mod pair;
pub mod results;
