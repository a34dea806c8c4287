//! ConcorDEM's contact laws as styles of the stock LIGGGHTS program.
//!
//! [`network`] holds the bonds of one processor's atoms and finds their forces with the solver of the library; [`pair`]
//! evaluates contacts along LIGGGHTS' neighbour lists, by the library's laws or by LIGGGHTS' own ([`host_laws`]);
//! [`options`] reads the arguments of the script; [`abi`] is what the C++ shim calls, and the only place with unsafe code.

pub mod abi;
pub mod atoms;
pub mod host_laws;
pub mod network;
pub mod options;
pub mod pair;
pub mod records;
