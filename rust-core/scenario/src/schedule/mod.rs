//! What happens when: loading, sampling, and the end of a run.

pub mod loading;
pub mod samples;
#[cfg(test)]
mod samples_tests;
pub mod simulation;
pub mod stop;

pub use loading::Loading;
pub use samples::{Operator, OperatorSample};
pub use simulation::{Advance, Record, SeriesColumn, Simulation};
pub use stop::{Stop, StopReason};

/// Intervals and thresholds of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// How the specimen is loaded.
    pub loading: Loading,
    /// When the run ends.
    pub stop: Stop,
    /// Steps between two samples.
    pub sample_interval: u64,
    /// Operators that are evaluated during the run.
    pub operators: Vec<OperatorSample>,
    /// Position of every particle at the start, m, for strains since then; may be empty when no operator needs it.
    pub places: Vec<concordem_contact::math::Vec3>,
    /// Whether particles are discs of unit depth.
    pub plane: bool,
    /// Steps between two snapshots; only first and last if `None`.
    pub snapshot_interval: Option<u64>,
    /// Steps between two checkpoints; only on interruption if `None`.
    pub checkpoint_interval: Option<u64>,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            loading: Loading::None,
            stop: Stop::default(),
            sample_interval: 10,
            operators: Vec::new(),
            places: Vec::new(),
            plane: false,
            snapshot_interval: None,
            checkpoint_interval: None,
        }
    }
}
