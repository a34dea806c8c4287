//! Stages of the loading: each has a factor of the loading's rate, and conditions that end it.

use super::History;
use super::stop::{Stop, StopReason, StopValues};

/// A stage of the loading.
#[derive(Debug, Clone, PartialEq)]
pub struct Stage {
    /// Name.
    pub name: String,
    /// Factor of the rate of the loading (of the target of a stress servo).
    pub rate: f64,
    /// Whether all axes of the cell follow their stress, also those with a strain rate.
    pub by_stress: bool,
    /// A further factor; its time starts with the stage.
    pub history: Option<History>,
    /// Strain that ends the stage when it is passed.
    pub strain: Option<f64>,
    /// Stress that ends the stage when it is passed, Pa.
    pub stress: Option<f64>,
    /// Conditions that are the same for stages and runs; time (s) and steps count from the start of the stage.
    pub stop: Stop,
}

/// Where a run is in its stages. It is part of the state, so that a restart continues within a stage.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct StageProgress {
    /// Index of the stage; the number of stages after the last one.
    pub(super) stage: usize,
    /// Time at the start of the stage, s.
    pub(super) time: f64,
    /// Step at the start of the stage.
    pub(super) step: u64,
    /// Sign of strain minus its limit at the first record of the stage; 0 before it.
    pub(super) strain_side: f64,
    /// The same for the stress.
    pub(super) stress_side: f64,
    /// Integral of the factor over the time of the run, s: the time of a run at constant rate with the same motion.
    pub(super) loaded_time: f64,
    /// Stress of the largest magnitude in the stage so far, Pa.
    pub(super) peak: f64,
}

impl StageProgress {
    /// Number of values that hold it in the state.
    pub(super) const LENGTH: usize = 7;

    pub(super) fn read(memory: &[f64]) -> Self {
        Self {
            stage: memory[0] as usize,
            time: memory[1],
            step: memory[2] as u64,
            strain_side: memory[3],
            stress_side: memory[4],
            loaded_time: memory[5],
            peak: memory[6],
        }
    }

    pub(super) fn write(&self, memory: &mut [f64]) {
        memory[..Self::LENGTH].copy_from_slice(&[
            self.stage as f64,
            self.time,
            self.step as f64,
            self.strain_side,
            self.stress_side,
            self.loaded_time,
            self.peak,
        ]);
    }

    /// The start of stage number `stage` at `time` (s) and `step`.
    pub(super) fn begin(&self, stage: usize, time: f64, step: u64) -> Self {
        Self { stage, time, step, strain_side: 0.0, stress_side: 0.0, peak: 0.0, ..*self }
    }
}

/// End of a stage.
#[derive(Debug, Clone, PartialEq)]
pub struct StageEnd {
    /// Index of the stage.
    pub stage: usize,
    /// Why it ended.
    pub reason: StageReason,
    /// Time (s) and step at its start.
    pub start: (f64, u64),
}

/// Why a stage ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StageReason {
    /// The strain passed its value.
    Strain,
    /// The stress passed its value.
    Stress,
    /// A condition that runs have, too.
    Stop(StopReason),
}

impl std::fmt::Display for StageReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Strain => f.write_str("the strain passed the given value"),
            Self::Stress => f.write_str("the stress passed the given value"),
            Self::Stop(reason) => reason.fmt(f),
        }
    }
}

impl Stage {
    /// The factor at `time` (s) since the start of the stage.
    pub(crate) fn factor(&self, time: f64) -> f64 {
        self.rate * self.history.as_ref().map_or(1.0, |history| history.at(time))
    }

    /// Why the stage ends at a record, if it does. Time and peak in `values` are those of the stage, which may end at a fraction of the peak also
    /// while it unloads.
    pub(super) fn reason(&self, progress: &mut StageProgress, values: &StopValues) -> Option<StageReason> {
        if passed(self.strain, values.strain, &mut progress.strain_side) {
            return Some(StageReason::Strain);
        }
        if passed(self.stress, values.stress, &mut progress.stress_side) {
            return Some(StageReason::Stress);
        }
        self.stop.reason(&StopValues { is_farthest: true, ..*values }).map(StageReason::Stop)
    }
}

/// Whether `value` has passed the limit since the first record of the stage, at which it was on the side `side`.
fn passed(limit: Option<f64>, value: f64, side: &mut f64) -> bool {
    let Some(limit) = limit else { return false };
    let difference = value - limit;
    if *side == 0.0 {
        *side = if difference < 0.0 { -1.0 } else { 1.0 };
        return difference == 0.0;
    }
    difference * *side <= 0.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A value is passed from below and from above; a stage that starts on it ends at once.
    #[test]
    fn values_are_passed_from_both_sides() {
        let cases = [
            ([0.0, 1.0, 2.5], Some(2)),
            ([5.0, 3.0, 1.0], Some(2)),
            ([2.0, 3.0, 4.0], Some(0)),
            ([3.0, 4.0, 5.0], None),
        ];
        for (values, at) in cases {
            let mut side = 0.0;
            assert_eq!(values.iter().position(|value| passed(Some(2.0), *value, &mut side)), at, "{values:?}");
        }
    }
}
