//! Guard of the energy: a run must not gain or lose energy by errors of its integration.
//!
//! The ledger accounts for all energy, errors included, so that their sum is known while the run goes on. Two faults end it:
//!
//! * **Error**: `|created|` exceeds 5 % of the largest energy present or dissipated so far ([`Ledger::created`],
//!   [`Ledger::turnover`]; the energy of gravity is not part of it, so that it falls while particles rise).
//!   Contacts that begin and end within a step, and stiffnesses that grow beyond the bound of the time step, make such errors.
//!   YADE's kinematics do not close the ledger (up to 5 % in compression): there only the other fault is looked for.
//! * **Instability**: kinetic energy of the ledger is `½ m v⁻·v⁺`, the mean of the step less `⅛ m a²Δt²`. In a linear system
//!   that is `K ≥ −(Δt/Δt_max)² U` with the stored energy U, so that `K + U` is positive as long as the motion is stable. Where
//!   `K + U` falls below 2 % of U, the step is at 99 % of its limit or beyond, and U grows without a source.

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::math::Vec3;
use concordem_solver::energy::Ledger;
use concordem_solver::state::State;

/// Largest error of the energy, as a fraction of all energy present or dissipated.
const LARGEST_ERROR: f64 = 0.05;

/// Smallest sum of kinetic and stored energy as a fraction of the stored one.
const SMALLEST_SUM: f64 = 0.02;

/// Steps between two looks of the guard; it also looks at every record.
pub(super) const INTERVAL: u64 = 256;

/// What the guard found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyFault {
    /// Whether the motion is unstable; otherwise the integration errors are too large.
    pub unstable: bool,
    /// Energy without a source, J; negative if energy was lost.
    pub created: f64,
    /// Largest energy present or dissipated so far, J.
    pub turnover: f64,
    /// Errors where contacts begin, end, or have kinks, J; positive if energy was lost.
    pub integration: f64,
    /// Residual of the ledger, J.
    pub residual: f64,
    /// Kinetic energy of the ledger, J.
    pub kinetic: f64,
    /// Stored energy, J.
    pub stored: f64,
}

/// Guards the energy of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Guard {
    /// Mass of all particles, kg.
    mass: f64,
    /// Largest coordinate at the start, m.
    extent: f64,
    /// Whether the ledger closes; in YADE's kinematics the forces do not work on the increments that it counts.
    closes: bool,
}

impl Guard {
    pub(super) fn new(state: &State, mode: MotionMeasure) -> Self {
        Self {
            closes: matches!(mode, MotionMeasure::Finite | MotionMeasure::FirstOrder),
            mass: state.particles.mass.iter().sum(),
            extent: state.particles.position.iter().map(Vec3::amax).fold(0.0, f64::max),
        }
    }

    /// The fault of a state whose last step sampled the stored energies, if there is one. `largest`: largest energy present or
    /// dissipated so far, J, updated.
    pub(super) fn fault(&self, state: &State, largest: &mut f64) -> Option<EnergyFault> {
        let ledger: &Ledger = &state.ledger;
        // Positions are known to some roundings, which move per step: energies of that size mean nothing.
        let rounding_speed = 16.0 * f64::EPSILON * self.extent / state.clock.dt.max(f64::MIN_POSITIVE);
        let rounding = self.mass * rounding_speed * rounding_speed;
        // Walls are not part of the ledger: the first impact of one comes before any other energy.
        let wall_speed = state.walls.iter().map(|wall| wall.velocity.norm_squared()).fold(0.0, f64::max);
        let turnover = largest.max(ledger.turnover());
        *largest = turnover;
        let scale = turnover + 0.5 * self.mass * wall_speed;
        let (created, stored) = (ledger.created(), ledger.stored_total() + ledger.deformation);
        let unstable = stored > 1e3 * rounding && ledger.kinetic + stored < SMALLEST_SUM * stored;
        let wrong = self.closes && created.abs() > LARGEST_ERROR * scale + rounding;
        (unstable || wrong).then(|| EnergyFault {
            unstable,
            created,
            turnover,
            integration: ledger.integration.get(),
            residual: ledger.residual(),
            kinetic: ledger.kinetic,
            stored,
        })
    }
}
