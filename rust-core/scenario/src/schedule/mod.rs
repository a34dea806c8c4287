//! The schedule of a run: loading, samples, and stop conditions; [`Simulation`] runs it.

mod bonding;
mod cell_servo;
mod confinement;
mod driven;
mod expression;
mod field;
mod flexure;
mod guard;
mod history;
pub mod loading;
mod membrane;
mod opening;
mod recorded;
mod rounding;
mod servo;
pub mod simulation;
mod stage;
pub mod stop;
mod watch;

pub use crate::sampling::{Operator, Record, ScheduledOperator, SeriesColumn};
pub use bonding::{Bonding, Moment};
pub use confinement::{Confinement, Side, Sides};
pub use driven::{HeatHistories, Histories, TimedLoads, TimedMesh, TimedMotion, TimedTurning, TimedWall};
pub use expression::{Expression, ExpressionFault};
pub use field::{Field, FieldStep};
pub use flexure::{Bearings, Flexure};
pub use guard::EnergyFault;
pub use history::History;
pub use loading::Loading;
pub use membrane::Membrane;
pub use opening::{Extensometer, Opening, OpeningServo};
pub use recorded::{Moved, RecordedMotion};
pub use rounding::Rounding;
pub use servo::{Aim, Gain, Servo, Standing, Target};
pub use simulation::{Advance, Simulation};
pub use stage::{Stage, StageEnd, StageReason};
pub use stop::{Stop, StopReason};
pub use watch::Swinging;

use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::PairCoefficients;

/// Loading, samples, and stop conditions of a run.
#[derive(Debug, Clone, PartialEq)]
pub struct Schedule {
    /// Loading of the specimen.
    pub loading: Loading,
    /// The gauge that the loading follows; `None`: its rate is given.
    pub opening: Option<Opening>,
    /// What presses on the sides of the specimen; `None`: nothing, or it is not known.
    pub confinement: Option<Confinement>,
    /// Stages of the loading; without any, its rate is constant.
    pub stages: Vec<Stage>,
    /// Motions, walls, and loads that change with time.
    pub histories: Histories,
    /// Walls that keep a force constant.
    pub servos: Vec<Servo>,
    /// Bonds made during the run.
    pub bondings: Vec<Bonding>,
    /// Pair coefficients of these bonds.
    pub bond_rows: PairCoefficients,
    /// How large the stress of the loading is by rounding alone.
    pub rounding: Rounding,
    /// Conditions that end the run.
    pub stop: Stop,
    /// Whether the run continues even if integration errors have changed its energy.
    pub allow_energy_error: bool,
    /// Whether the run continues even if bonds made during the run are too stiff for the time step.
    pub allow_unstable: bool,
    /// Steps between two records of the time series.
    pub sample_interval: u64,
    /// Operators that are evaluated during the run.
    pub operators: Vec<ScheduledOperator>,
    /// Initial positions, m, for strains; may be empty if no operator needs them.
    pub initial_positions: Vec<Vec3>,
    /// Edges of the periodic cell at the start, as columns, m.
    pub initial_edges: Option<Mat3>,
    /// Whether particles are discs of unit depth.
    pub planar: bool,
    /// Steps between two snapshots; only the first and the last state if `None`.
    pub snapshot_interval: Option<u64>,
    /// Steps between two checkpoints; only on interruption if `None`.
    pub checkpoint_interval: Option<u64>,
}

impl Default for Schedule {
    fn default() -> Self {
        Self {
            loading: Loading::None,
            opening: None,
            confinement: None,
            stages: Vec::new(),
            histories: Histories::default(),
            servos: Vec::new(),
            bondings: Vec::new(),
            bond_rows: PairCoefficients::default(),
            rounding: Rounding::default(),
            stop: Stop::default(),
            allow_energy_error: false,
            allow_unstable: false,
            sample_interval: 10,
            operators: Vec::new(),
            initial_positions: Vec::new(),
            initial_edges: None,
            planar: false,
            snapshot_interval: None,
            checkpoint_interval: None,
        }
    }
}
