//! ConcorDEM: the discrete element method for cohesive materials.
//!
//! This crate contains the program `concordem`, its files, reports, calibration, and sweeps. It re-exports the crates
//! below it, so that users of the library need only `concordem`. Its modules depend on each other in one direction:
//! [`calibration`] and [`mod@sweep`], then [`output`], [`signals`], [`pictures`], [`mod@characterise`], [`report`],
//! [`figure`], [`program`].
//!
//! A scenario is assembled into a state, a model, and a schedule; the solver steps the state; operators read it; sinks
//! write it. Conventions: SI units; tension positive; the force of a contact is the one on A, and the normal points
//! from A to B; quaternions map body to world.

pub mod calibration;
pub mod characterise;
pub mod figure;
pub mod output;
pub mod pictures;
mod prefix;
pub mod program;
pub mod provenance;
pub mod report;
mod side_by_side;
pub mod signals;
pub mod sweep;

#[doc(hidden)]
pub use concordem_contact::{bytemuck, law_state as law_state_in};
pub use concordem_contact::{
    columns, conformance, field, for_each_law, kinematics, law, material, math, own_loop, prefetch, quantity, scatter,
    step, straight,
};
pub use concordem_operator as operator;
pub use concordem_packing as packing;
pub use concordem_scenario::{assembly, sampling, schedule, schema as scenario};
pub use concordem_solver as solver;
pub use concordem_solver::{fracture, neighbor, state};
pub use concordem_statics as statics;

/// [`concordem_contact::law_state!`] for crates that depend on `concordem` alone.
#[macro_export]
macro_rules! law_state {
    ($($law:tt)*) => { $crate::law_state_in! { in "::concordem::bytemuck" $($law)* } };
}

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
