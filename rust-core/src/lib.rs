//! ConcorDEM: the discrete element method for cohesive materials.
//!
//! The flow is a scenario that is assembled into a state, a model, and a plan; the solver steps the state; operators
//! read it; sinks write it. Conventions: SI units; tension positive; the force of a contact is the one on A, and the
//! normal points from A to B; quaternions map body to world.

pub mod assembly;
pub mod calibration;
pub mod fracture;
pub mod kinematics;
pub mod law;
pub mod math;
pub mod neighbor;
pub mod operator;
#[cfg(feature = "hdf5")]
pub mod output;
pub mod plan;
pub mod prefetch;
#[cfg(feature = "program")]
pub mod program;
pub mod scenario;
pub mod solver;
pub mod state;
pub mod statics;
#[cfg(feature = "program")]
pub mod sweep;
