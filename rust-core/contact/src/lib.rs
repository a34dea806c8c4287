//! Contact mechanics: how two particles move relative to each other, and the laws that answer with a force.
//!
//! The lowest crate of ConcorDEM. It knows particles two at a time: no neighbor lists, no time stepping, no files.

pub mod cell;
pub mod constraint;
pub mod kinematics;
pub mod law;
pub mod material;
pub mod math;
pub mod prefetch;
pub mod quantity;
pub mod wall;

pub use cell::Cell;
pub use constraint::Constraint;
