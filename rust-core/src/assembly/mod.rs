//! Building the initial state: packings, later bonds and aggregates.

pub mod packing;
