//! Fracture seen above the single contact.

pub mod events;

pub use events::Event;
