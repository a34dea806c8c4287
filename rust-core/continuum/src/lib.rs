//! ConcorDEM: continuum laws of concrete, and the hand-over of a particle state to them.
//!
//! - [`damage_plastic`]: the damage-plastic model of Grassl and Jirásek (2006) at a point, with its consistent tangent.
//! - [`handover`]: stress and damage of a packing of the concrete particle model as the state of that model
//!   (Stránský 2018, chapter 6).
//!
//! Conventions: SI units; tension positive; six components in the order 11, 22, 33, 23, 31, 12, with engineering shear strains.
//! Laws are pure functions of strain and state: the same input gives the same bits.

pub mod damage_plastic;
pub mod elasticity;
mod error;
pub mod handover;
mod spectrum;
pub mod voigt;

pub use damage_plastic::{DamagePlastic, Parameters, State, Update};
pub use elasticity::Elasticity;
pub use error::ContinuumError;
pub use handover::{HandOver, LinkDamage};

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
