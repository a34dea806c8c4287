//! C interface to our laws and solver for the native YADE plugin (`shim/`).
//!
//! Users compile the shim against the headers of their YADE. This crate is compiled once, does not depend on YADE, and exchanges plain
//! structures with the shim. `shim/abi.h` declares functions and structures; the test `c_header` generates it.

pub mod assembly;
mod body_motion;
mod bonded_engine;
#[cfg(test)]
mod c_header;
pub mod concrete;
mod deformation;
pub mod functors;
mod law_contact;
mod linear_bond;
pub mod newton;
