//! What a laboratory hears and sieves: emissions and fragments of a finished run.

pub mod emission;
pub mod fragments;
