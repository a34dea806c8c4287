//! All that changes during a run: particles, contacts, cell, walls, clock, ledger. Serialisable and complete.

pub mod cell;
pub mod columns;
pub mod particles;

pub use cell::Cell;
pub use particles::{Constraint, Particles};
