//! ConcorDEM: periodic cells of particles as material points of a continuum (Stránský 2018, section 5.3).
//!
//! A [`RepresentativeCell`] takes the deformation gradient of the continuum and returns stress, couple stress, damage of its bonds,
//! and elastic stiffness. Cells are independent: [`deform`] advances many of them on all processors, and the result does not depend
//! on their number.
//!
//! The cell is a dynamic system of its own: inertia and damping of its particles act in every step. Deform it slowly compared with
//! the time a wave needs across it, or give it more steps.

mod cell;
mod error;

pub use cell::{RepresentativeCell, Response, Snapshot, deform};
pub use error::CellError;

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
