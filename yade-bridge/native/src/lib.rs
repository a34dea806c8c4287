//! What the native plugin of YADE (`shim/`) calls: C functions over the library's laws and solver.
//!
//! The shim is compiled on the user's machine, where YADE's headers are; this crate is compiled once and knows nothing of
//! YADE's classes. Numbers come in as plain structures that the shim fills.

pub mod assembly;
pub mod beam;
mod bonds;
pub mod concrete;
mod deformation;
mod guard;
mod linear_bond;
