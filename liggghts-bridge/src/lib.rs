//! ConcorDEM's contact laws as styles of the stock LIGGGHTS program.
//!
//! [`network`] holds the bonds of one processor's atoms and finds their forces with the solver of the library; [`pair`]
//! evaluates contacts along LIGGGHTS' neighbour lists, by the library's laws or by LIGGGHTS' own ([`host_laws`]);
//! [`options`] reads the arguments of the script; [`abi`] is what the C++ shim calls. [`driver`] goes the other way: it opens
//! LIGGGHTS as a library of a Rust program. Unsafe code is in these two only.

pub mod abi;
pub mod atoms;
pub mod driver;
pub mod host_laws;
mod law_names;
pub mod network;
pub mod options;
pub mod pair;
pub mod records;
