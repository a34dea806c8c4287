//! Fracture seen above the single contact.

pub mod events;
pub mod fragments;
pub mod virial;

pub use events::Event;
