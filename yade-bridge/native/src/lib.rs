//! C functions over the library's laws and solver for the native plugin of YADE (`shim/`).
//!
//! Each user compiles the shim, which includes YADE's headers; this crate is compiled once and knows no class of YADE. The shim
//! passes plain structures. `shim/abi.h` declares functions and structures; the test `c_header` generates it.

pub mod assembly;
pub mod beam;
mod body_motion;
mod bonded_engine;
#[cfg(test)]
mod c_header;
pub mod concrete;
mod deformation;
pub mod functors;
mod law_contact;
mod linear_bond;
