//! Errors of continuum laws.

/// Why a continuum law cannot answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ContinuumError {
    /// A parameter is out of its range.
    #[error("{name} is {value:e}; {demand}")]
    Parameter {
        /// Name of the parameter.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        demand: String,
    },
    /// A strain, stress, or state is not finite.
    #[error("the {what} is not finite; look for the cause in what computed it")]
    NotFinite {
        /// What is not finite.
        what: &'static str,
    },
    /// A state that no calculation can have given.
    #[error("the state has {name} {value:e}; {demand}")]
    State {
        /// Name of the variable.
        name: &'static str,
        /// Its value.
        value: f64,
        /// What it must be.
        demand: &'static str,
    },
    /// The plastic strain was not found.
    #[error(
        "the plastic strain was not found for a trial stress of {mean:e} Pa (mean) and {deviator:e} Pa (norm of the deviator); \
         apply the strain in smaller steps"
    )]
    NoConvergence {
        /// Mean trial stress, Pa.
        mean: f64,
        /// Norm of the deviator of the trial stress, Pa.
        deviator: f64,
    },
    /// No bonds, or lists of different length.
    #[error("{normals} directions and {damages} damages of bonds; give one damage per direction, and at least one")]
    Links {
        /// Number of directions.
        normals: usize,
        /// Number of damages.
        damages: usize,
    },
}
