//! State, neighbor search, contact forces, integration, time step, energy ledger, and fracture.
//!
//! [`Solver::step`] advances a [`State`](state::State) under a [`Model`]. The solver holds only scratch data: it can be
//! dropped and rebuilt from the state without changing a bit of the next step.
//!
//! * [`state`]: everything that changes during a run; [`neighbor`]: candidate pairs;
//! * [`forces`]: the contact forces ([`walls`], [`record`]); [`deformation`]: the strains of deformable particles, and
//!   [`coupling`]: whether they converge;
//! * [`integrate`]: kick and drift; [`time_step`]: its stability limit, [`collision`]: the limit for possible contacts;
//!   [`energy`]: the ledger;
//! * [`heat`]: heat conduction, and thermal expansion of bonds;
//! * [`fracture`]: event log, fragments, and failure of whole particles.

pub mod collision;
pub mod coupling;
pub mod deformation;
pub mod energy;
mod error;
pub mod forces;
pub mod fracture;
pub mod heat;
pub mod integrate;
mod lanczos;
mod lanes;
pub mod laws;
mod model;
pub mod neighbor;
mod pair_coefficients;
mod peculiar;
mod report;
mod solver;
pub mod state;
pub mod time_step;
mod wrap;

pub use error::SolverError;
pub use forces::{record, walls};
pub use model::{Model, Scheme};
pub use pair_coefficients::PairCoefficients;
pub use report::StepReport;
pub use solver::{DeviceError, Solver, StageTimes, StepDevice, Stretch, StretchEnd, StretchStep, TakenSteps};
