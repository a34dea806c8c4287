//! ConcorDEM's contact laws as styles of the stock LIGGGHTS program.
//!
//! [`network`] holds the bonds and contacts of one processor's atoms and computes their forces with the library's solver. [`pair`]
//! evaluates contacts along LIGGGHTS' neighbor lists, by the library's laws or by LIGGGHTS' own forms ([`host_laws`]). [`options`]
//! reads the arguments of the script. The C++ shims call [`abi`]. [`driver`] opens LIGGGHTS as a library of a Rust program. Only
//! [`abi`] and [`driver`] contain unsafe code.

pub mod abi;
pub mod atoms;
pub mod driver;
pub mod host_laws;
mod law_names;
pub mod network;
pub mod options;
pub mod pair;
pub mod records;
