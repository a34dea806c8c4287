//! Fracture beyond the single contact: event log, fragments, particle-level failure.

pub mod events;
pub mod fragments;
pub mod virial;

pub use events::Event;
