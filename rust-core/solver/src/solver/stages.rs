//! Time that a solver has spent in each stage of its steps.

use std::time::{Duration, Instant};

/// Time that a solver has spent in each stage of its steps so far, see [`Solver::stage_times`](super::Solver::stage_times).
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StageTimes {
    /// Strains of deformable particles.
    pub strains: Duration,
    /// Test and rebuild of the neighbor list.
    pub neighbors: Duration,
    /// Positions and rotations packed for the contact loops.
    pub poses: Duration,
    /// Bonds.
    pub bonds: Duration,
    /// Unbonded contacts, and contacts with walls.
    pub contacts: Duration,
    /// Sums of the halo slots.
    pub gather: Duration,
    /// Kick and drift.
    pub motion: Duration,
    /// Cell, walls, ledger, heat.
    pub booking: Duration,
    /// Release of the pairs of broken bonds.
    pub release: Duration,
}

impl StageTimes {
    /// Names and times of all stages.
    pub fn named(&self) -> [(&'static str, Duration); 9] {
        [
            ("strains", self.strains),
            ("neighbors", self.neighbors),
            ("poses", self.poses),
            ("bonds", self.bonds),
            ("contacts", self.contacts),
            ("gather", self.gather),
            ("motion", self.motion),
            ("booking", self.booking),
            ("release", self.release),
        ]
    }
}

/// Measures one stage after another. A reading takes some 30 ns, ten of them less than a thousandth of a step of 1,000 bonds.
pub(super) struct Stopwatch(Instant);

impl Stopwatch {
    pub(super) fn start() -> Self {
        Self(Instant::now())
    }

    /// Add the time since the last call to a stage.
    pub(super) fn lap(&mut self, stage: &mut Duration) {
        let now = Instant::now();
        *stage += now - self.0;
        self.0 = now;
    }
}
