//! Bond parameters for target properties of a material.

pub mod cohesive_beam;
pub mod concrete;
pub mod deformation;
pub mod elastic;
pub mod measured;
pub mod peak;
pub mod rock;
