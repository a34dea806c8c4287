//! Errors of representative cells.

use concordem_operator::OperatorError;
use concordem_scenario::schedule::StopReason;
use concordem_scenario::schedule::simulation::RunError;
use concordem_solver::SolverError;
use concordem_statics::StaticsError;

/// Why a cell cannot answer.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CellError {
    /// The scenario has no periodic cell.
    #[error(
        "the scenario has no periodic cell; a representative cell needs a periodic packing and `bonds` or `contacts` in it"
    )]
    NoCell,
    /// Something else than the continuum moves the cell or ends the run.
    #[error("the scenario has {what}; the continuum alone deforms a representative cell, so remove it")]
    Driven {
        /// What the scenario has.
        what: &'static str,
    },
    /// A deformation gradient that no body can have.
    #[error("the deformation gradient has determinant {determinant:e}; it must be positive: the element is inverted")]
    Inverted {
        /// Its determinant.
        determinant: f64,
    },
    /// No steps.
    #[error("a deformation in 0 steps; give at least 1")]
    NoSteps,
    /// All bonds broke.
    #[error(
        "the cell has lost its last bond at step {step}; it no longer represents the material: take the element out"
    )]
    NoBonds {
        /// Step.
        step: u64,
    },
    /// A condition of the scenario's `[stop]` holds.
    #[error(
        "the cell has ended at step {step} ([stop] of its scenario: {reason:?}); give a larger limit, such as `steps`"
    )]
    Ended {
        /// Step.
        step: u64,
        /// Which condition.
        reason: StopReason,
    },
    /// A snapshot of another cell.
    #[error("the snapshot has {found} particles, the cell {wanted}; restore the snapshot of this cell")]
    OtherCell {
        /// Particles of the snapshot.
        found: usize,
        /// Particles of the cell.
        wanted: usize,
    },
    /// The solver refuses the state.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// A step failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An average cannot be taken.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// The bonds have no stiffness.
    #[error(transparent)]
    Statics(#[from] StaticsError),
    /// The damage of the bonds cannot be averaged.
    #[error(transparent)]
    Continuum(#[from] concordem_continuum::ContinuumError),
}
