//! Errors of specimens and searches.

use concordem_contact::law::ParameterError;
use concordem_packing::PackingError;
use concordem_scenario::assembly::AssemblyError;
use concordem_scenario::schedule::simulation::RunError;
use concordem_scenario::schema::ScenarioError;
use concordem_solver::SolverError;
use concordem_solver::neighbor::NeighborError;

/// Error of a specimen or a search.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// The packing failed.
    #[error("packing: {0}")]
    Packing(#[from] PackingError),
    /// Bonding failed.
    #[error("bonding: {0}")]
    Neighbor(#[from] NeighborError),
    /// Invalid parameters.
    #[error("{0}")]
    Parameter(#[from] ParameterError),
    /// The relaxation failed.
    #[error("relaxation: {0}")]
    Solver(#[from] SolverError),
    /// The run that breaks the specimen failed.
    #[error("{0}")]
    Run(#[from] RunError),
    /// The packing has fewer near pairs than wanted bonds.
    #[error("this packing cannot have {coordination} bonds per particle; random packings have 6 to 12 near pairs")]
    Coordination {
        /// Wanted bonds per particle.
        coordination: f64,
    },
    /// The scenario that breaks the specimen is invalid.
    #[error("{0}")]
    Scenario(#[from] ScenarioError),
    /// The scenario that breaks the specimen cannot be assembled.
    #[error("{0}")]
    Assembly(#[from] AssemblyError),
    /// The temporary folder cannot be used.
    #[error("temporary folder: {0}")]
    Folder(std::io::Error),
    /// The specimen did not reach equilibrium.
    #[error("no equilibrium after {steps} steps: the load still changes by a relative {change:.1e}")]
    NotSettled {
        /// Steps done.
        steps: u64,
        /// Relative change.
        change: f64,
    },
    /// The pulse is too long for the specimen.
    #[error(
        "a pulse of half length {struck:.3e} m is too long for a specimen of {length:.3e} m; use less than a quarter of the length"
    )]
    Pulse {
        /// Length over which the specimen is struck, m.
        struck: f64,
        /// Length of the specimen, m.
        length: f64,
    },
    /// The specimen is too small to measure its deformation.
    #[error("a specimen of {count} spheres is too small to measure its deformation; use a thousand or more")]
    TooSmall {
        /// Spheres.
        count: usize,
    },
    /// The beams cannot give the wanted Poisson's ratio.
    #[error(
        "a Poisson's ratio of {wanted} is out of reach: radius ratios from {low} to {high} give {at_low:.3} to \
         {at_high:.3}; change the coordination, or use a Poisson's ratio in this range"
    )]
    Poisson {
        /// Wanted.
        wanted: f64,
        /// Smallest radius ratio tried.
        low: f64,
        /// Largest radius ratio tried.
        high: f64,
        /// Poisson's ratio at the smallest.
        at_low: f64,
        /// Poisson's ratio at the largest.
        at_high: f64,
    },
}
