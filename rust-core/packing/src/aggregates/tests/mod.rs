//! Tests of aggregates.

mod bodies;
mod gradings;
mod places;
