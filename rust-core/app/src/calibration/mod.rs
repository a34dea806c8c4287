//! From wanted properties of a material to parameters of its bonds.

pub mod cohesive_beam;
pub mod concrete;
pub mod deformation;
pub mod elastic;
