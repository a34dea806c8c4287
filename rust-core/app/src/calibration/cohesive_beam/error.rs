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
    /// The strength run failed.
    #[error("{0}")]
    Run(#[from] RunError),
    /// The packing has too few near pairs for the target number of bonds.
    #[error("this packing cannot have {coordination} bonds per particle; random packings have 6 to 12 near pairs")]
    Coordination {
        /// Target bonds per particle.
        coordination: f64,
    },
    /// The scenario of the strength run is invalid.
    #[error("{0}")]
    Scenario(#[from] ScenarioError),
    /// The scenario of the strength run cannot be assembled.
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
        /// Length of the struck part of the specimen, m.
        struck: f64,
        /// Length of the specimen, m.
        length: f64,
    },
    /// The specimen is too small to measure its deformation.
    #[error("a specimen of {count} spheres is too small to measure its deformation; use a thousand or more")]
    TooSmall {
        /// Number of spheres.
        count: usize,
    },
    /// The beams cannot give the target Poisson's ratio.
    #[error(
        "a Poisson's ratio of {wanted} is out of reach: radius ratios from {low} to {high} give {at_low:.3} to \
         {at_high:.3}; change the coordination, or use a Poisson's ratio in this range"
    )]
    Poisson {
        /// Target Poisson's ratio.
        wanted: f64,
        /// Smallest radius ratio.
        low: f64,
        /// Largest radius ratio.
        high: f64,
        /// Poisson's ratio at the smallest radius ratio.
        at_low: f64,
        /// Poisson's ratio at the largest radius ratio.
        at_high: f64,
    },
}
