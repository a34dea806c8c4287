//! Energy guard: ends a run that gains or loses too much energy by integration errors.
//!
//! The ledger accounts for all energy, including errors, so their sum is known during the run. Two faults end the run:
//!
//! * **Error**: `|created|` exceeds 5 % of the largest energy present or dissipated so far ([`Ledger::created`],
//!   [`Ledger::turnover`]; gravitational energy is not included, so the energy present falls while particles rise).
//!   Contacts that begin and end within a step, and stiffnesses that grow beyond the time step bound, cause such errors.
//!   With YADE's kinematics the ledger does not close (up to 5 % in compression), so the limit is a half: in a run that
//!   diverges, nearly all energy is created.
//! * **Instability**: the kinetic energy of the ledger is `½ m v⁻·v⁺`, the mean of the step less `⅛ m a²Δt²`. In a linear
//!   system `K ≥ −(Δt/Δt_max)² U` with the stored energy U, so `K + U` is positive as long as the motion is stable. If
//!   `K + U` falls below 2 % of U, the step is at 99 % of its bound or beyond, and U grows without a source.

use concordem_contact::kinematics::MotionMeasure;
use concordem_contact::math::Vec3;
use concordem_solver::energy::Ledger;
use concordem_solver::state::{Constraint, State};

/// Largest allowed energy error, as a fraction of all energy present or dissipated.
const LARGEST_ERROR: f64 = 0.05;

/// The same with YADE's kinematics. The increments that the ledger counts are not work-conjugate to the forces, so it does not close.
const LARGEST_OPEN_ERROR: f64 = 0.5;

/// Smallest allowed sum of kinetic and stored energy, as a fraction of the stored energy.
const SMALLEST_SUM: f64 = 0.02;

/// Multiple of the kinetic energy of prescribed motions and of the motion of the cell that counts as possibly lost in the ledger's kinetic energy: a
/// history may turn back within a step, and `½ m v⁻·v⁺` is then negative without an instability. One of the two velocities can
/// be that many times larger, where a history jumps.
const TURNING: f64 = 10.0;

/// Steps between two checks by the guard; it also checks at every record.
pub(super) const INTERVAL: u64 = 256;

/// A fault found by the guard.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnergyFault {
    /// Whether the motion is unstable; otherwise the integration errors are too large.
    pub unstable: bool,
    /// Whether the run uses YADE's kinematics, with which the ledger does not close.
    pub yade: bool,
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

/// Kinetic energy of the prescribed components of motion, and that of particles that follow the cell, J.
fn prescribed_energy(state: &State) -> f64 {
    let particles = &state.particles;
    let following = state.cell.map_or(0.0, |cell| {
        let energy = |(x, m): (&Vec3, &f64)| 0.5 * m * (cell.velocity_gradient * x).norm_squared();
        particles.position.iter().zip(&particles.mass).map(energy).sum()
    });
    let given = |p: usize| particles.constraint[p];
    let energy = |p: usize, i: usize| {
        let (v, w) = (particles.velocity[p][i], particles.angular_velocity[p][i]);
        let translation = if given(p).translation(i) { particles.mass[p] * v * v } else { 0.0 };
        let rotation = if given(p).rotation(i) { particles.inertia[p] * w * w } else { 0.0 };
        0.5 * (translation + rotation)
    };
    let constrained = (0..particles.len()).filter(|&p| given(p) != Constraint::FREE);
    following + constrained.map(|p| (0..3).map(|i| energy(p, i)).sum::<f64>()).sum::<f64>()
}

/// Guards the energy of a run.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Guard {
    /// Mass of all particles, kg.
    mass: f64,
    /// Largest coordinate at the start, m.
    extent: f64,
    /// Whether the run uses YADE's kinematics.
    yade: bool,
}

impl Guard {
    pub(super) fn new(state: &State, mode: MotionMeasure) -> Self {
        Self {
            yade: matches!(mode, MotionMeasure::Yade | MotionMeasure::YadeRatcheting),
            mass: state.particles.mass.iter().sum(),
            extent: state.particles.position.iter().map(Vec3::amax).fold(0.0, f64::max),
        }
    }

    /// The fault of a state whose last step sampled the stored energies, if there is one. `largest`: largest energy
    /// present or dissipated so far, J; it is updated.
    pub(super) fn fault(&self, state: &State, largest: &mut f64) -> Option<EnergyFault> {
        let ledger: &Ledger = &state.ledger;
        // Rounding errors of positions act like small velocities: kinetic energies of that size mean nothing.
        let rounding_speed = 16.0 * f64::EPSILON * self.extent / state.clock.dt.max(f64::MIN_POSITIVE);
        let rounding = self.mass * rounding_speed * rounding_speed;
        // Walls have no energy in the ledger: the first impact of a moving wall may precede all other energy.
        let wall_speed = state.walls.iter().map(|wall| wall.speed().powi(2)).fold(0.0, f64::max);
        let turnover = largest.max(ledger.turnover());
        *largest = turnover;
        let scale = turnover + 0.5 * self.mass * wall_speed;
        let (created, stored) = (ledger.created(), ledger.stored_total() + ledger.deformation);
        let falls_short = |kinetic: f64| kinetic + stored < SMALLEST_SUM * stored;
        let unstable = stored > 1e3 * rounding
            && falls_short(ledger.kinetic)
            && falls_short(ledger.kinetic + TURNING * prescribed_energy(state));
        let largest_error = if self.yade { LARGEST_OPEN_ERROR } else { LARGEST_ERROR };
        // Energies without limits end as infinities, whose differences are not numbers.
        let wrong = created.is_nan() || created.abs() > largest_error * scale + rounding;
        (unstable || wrong).then(|| EnergyFault {
            unstable,
            yade: self.yade,
            created,
            turnover,
            integration: ledger.integration.get(),
            residual: ledger.residual(),
            kinetic: ledger.kinetic,
            stored,
        })
    }
}
