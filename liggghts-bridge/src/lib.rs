//! ConcorDEM contact laws as styles of the stock LIGGGHTS program and of LAMMPS.
//!
//! | module | contains |
//! |---|---|
//! | [`network`] | bonds and contacts of one processor's atoms; computes their forces with our solver |
//! | [`pair`] | contacts of LIGGGHTS' neighbor lists, with our laws or LIGGGHTS' own ([`host_laws`]) |
//! | [`options`], [`bond_list`], [`heat_network`], [`pieces`] | arguments of the script command, and their files |
//! | [`abi`] | functions called from the C++ shims |
//! | [`driver`] | LIGGGHTS as a library of a Rust program |
//!
//! Only [`abi`], `law_names`, and [`driver`] contain unsafe code.

pub mod abi;
pub mod atoms;
pub mod bond_list;
pub mod driver;
pub mod heat_network;
pub mod host_laws;
mod law_names;
pub mod network;
pub mod options;
pub mod pair;
pub mod pieces;
pub mod records;
