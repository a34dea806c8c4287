//! ConcorDEM: the discrete element method for cohesive materials.
//!
//! This crate is the program `concordem` and everything that leaves it: results, reports, calibration, sweeps. It re-exports the
//! crates below it under one name, so that `concordem` is all a user of the library needs.
//!
//! A scenario is assembled into a state, a model, and a schedule; the solver steps the state; operators read it; sinks write it.
//! Conventions: SI units; tension positive; the force of a contact is the one on A, and the normal points from A to B;
//! quaternions map body to world.

pub mod calibration;
pub mod output;
pub mod program;
pub mod sweep;

pub use concordem_contact::{for_each_law, kinematics, law, law_state, material, math, prefetch, quantity};
pub use concordem_operator as operator;
pub use concordem_packing as packing;
pub use concordem_scenario::{assembly, schedule, schema as scenario};
pub use concordem_solver as solver;
pub use concordem_solver::{fracture, neighbor, state};
pub use concordem_statics as statics;
