//! State, neighbor search, contact forces, integration, time step, energy ledger, and fracture.
//!
//! [`Solver::step`] advances a [`State`](state::State) under a [`Model`]. The solver holds only scratch data: it can be
//! dropped and rebuilt from the state without changing a bit of the next step.
//!
//! ```
//! use concordem_contact::math::Vec3;
//! use concordem_solver::state::{Particles, Sphere, State};
//! use concordem_solver::{Model, Solver};
//!
//! // A sphere of 2 kg falls for a tenth of a second.
//! let mut particles = Particles::default();
//! particles.push(Sphere { position: Vec3::zeros(), radius: 0.5 }, 0, 2.0, 0.2);
//! let mut state = State { particles, ..State::default() };
//! state.clock.dt = 1e-3;
//! let model = Model { gravity: Vec3::new(0.0, 0.0, -9.81), ..Model::default() };
//! let mut solver = Solver::new(model, &mut state).unwrap();
//! for _ in 0..100 {
//!     solver.step(&mut state).unwrap();
//! }
//! assert!((state.particles.velocity[0].z + 0.981).abs() < 1e-12);
//! ```
//!
//! * [`state`]: everything that changes during a run; [`neighbor`]: candidate pairs;
//! * [`evaluation`]: what an evaluation of contacts reads and gives; [`forces`]: the contact forces ([`walls`], [`record`]); [`deformation`]: the strains of deformable particles, and
//!   [`coupling`]: whether they converge;
//! * [`integrate`]: kick and drift; [`time_step`]: its stability limit, [`collision`]: the limit for possible contacts;
//!   [`energy`]: the ledger;
//! * [`heat`]: heat conduction, and thermal expansion of bonds;
//! * [`fracture`]: event log, fragments, and failure of whole particles;
//! * [`own_thread`]: pools of threads inside a program with threads and forks that are not ours.

pub mod collision;
pub mod coupling;
pub mod deformation;
pub mod energy;
mod error;
pub mod evaluation;
pub mod forces;
pub mod fracture;
pub mod heat;
pub mod integrate;
pub mod joints;
mod lanczos;
mod lanes;
pub mod laws;
mod model;
pub mod neighbor;
pub mod own_thread;
mod pair_coefficients;
mod peculiar;
mod report;
mod solver;
pub mod state;
mod step_sums;
mod strengths;
pub mod time_step;
mod wrap;

pub use error::{DeviceError, SolverError};
pub use forces::{record, walls};
pub use model::{Model, Scheme};
pub use pair_coefficients::PairCoefficients;
pub use report::StepReport;
pub use solver::{
    Excluded, Exclusion, Slider, Solver, StageTimes, StepDevice, Stretch, StretchEnd, StretchStep, TakenSteps,
};
pub use strengths::Strengths;

/// The code of the README is tested.
#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
