//! What a run remembers in its state: places in [`State::schedule_memory`](concordem_solver::state::State::schedule_memory).

use crate::schedule::cell_servo::CellServoMemory;
use crate::schedule::stage::StageProgress;

/// Stress of the largest magnitude so far, Pa.
pub(super) const PEAK: usize = 0;
/// Number of bonds that broke.
pub(super) const BROKEN: usize = 1;
/// Number of bonds that entered the event log by their damage.
pub(super) const DAMAGED: usize = 2;
/// `Σ l⊗f` of the last step, J, column by column.
pub(super) const VIRIAL: usize = 3;
/// Code of the reason why the run has ended; 0 if it has not.
pub(super) const STOPPED: usize = 12;
/// Largest energy present or dissipated so far, J.
pub(super) const ENERGY: usize = 13;
/// What the servo of a cell remembers: [`CellServoMemory`].
pub(super) const LASTING: usize = 14;
/// Lasting speed of a loading that follows the opening of a gauge, m/s, and after it those of up to [`super::OPENINGS`] walls. Such loadings do
/// not drive a cell, so that the place is free.
pub(super) const OPENING: usize = LASTING;
/// Work of the stress of a cell that a host deforms, J: a [sum](concordem_solver::energy::Sum) and its correction. Such a cell has no loading, so
/// that the place is free.
pub const STRESS_WORK: usize = LASTING;
/// Which bonds have been made during the run: one bit for each [`Bonding`](crate::schedule::Bonding).
pub(super) const BONDED: usize = LASTING + CellServoMemory::LENGTH;
/// How far the loading has come since the peak, in its direction: [`StageProgress::loaded_time`], s.
pub(super) const FARTHEST: usize = BONDED + 1;
/// First value of [`StageProgress`]. After it come time (s) and step of the end of each stage.
pub(super) const STAGE: usize = FARTHEST + 1;
pub(super) const COUNT: usize = STAGE + StageProgress::LENGTH;

/// Prepares the memory of an earlier run for its continuation: clears the reason for stopping, and the peak stress if
/// the loading is new.
/// `new_stages`: the first of them starts at this time (s) and step.
pub(crate) fn continue_memory(memory: &mut Vec<f64>, new_loading: bool, new_stages: Option<(f64, u64)>) {
    memory.resize(memory.len().max(COUNT), 0.0);
    if let Some((time, step)) = new_stages {
        memory.truncate(COUNT);
        StageProgress::read(&memory[STAGE..]).begin(0, time, step).write(&mut memory[STAGE..]);
    }
    if let Some(stopped) = memory.get_mut(STOPPED) {
        *stopped = 0.0;
    }
    if let (true, Some(peak)) = (new_loading, memory.get_mut(PEAK)) {
        *peak = 0.0;
        memory[FARTHEST] = 0.0;
        let progress = StageProgress { peak: 0.0, ..StageProgress::read(&memory[STAGE..]) };
        progress.write(&mut memory[STAGE..]);
        memory[LASTING..BONDED].fill(0.0);
    }
}

/// Clears the largest energy so far, when the energy balance starts again.
pub(crate) fn forget_turnover(memory: &mut [f64]) {
    if let Some(energy) = memory.get_mut(ENERGY) {
        *energy = 0.0;
    }
}
