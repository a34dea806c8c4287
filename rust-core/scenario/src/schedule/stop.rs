//! Conditions that end a run.

/// Conditions that end a run; the first one that holds ends it. All are checked with each record, `steps` after every step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stop {
    /// The stress drops to this fraction of its peak (of the same sign).
    pub drop_to: Option<f64>,
    /// Absolute strain.
    pub strain: Option<f64>,
    /// Time, s.
    pub time: Option<f64>,
    /// Number of steps.
    pub steps: Option<u64>,
    /// Unbalanced force ratio.
    pub unbalanced: Option<f64>,
}

/// Why a run ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The stress dropped.
    Drop,
    /// The strain was reached.
    Strain,
    /// The time was reached.
    Time,
    /// The number of steps was reached.
    Steps,
    /// Equilibrium was reached, and with a stress servo the target stress, too.
    Equilibrium,
    /// The last stage ended.
    Stages,
}

impl StopReason {
    const ALL: [Self; 6] = [Self::Drop, Self::Strain, Self::Time, Self::Steps, Self::Equilibrium, Self::Stages];

    /// Number of the reason in the state, from 1; 0 means that the run has not stopped.
    pub(super) fn code(self) -> f64 {
        Self::ALL.iter().position(|reason| *reason == self).map_or(0.0, |at| (at + 1) as f64)
    }

    /// The reason with this number.
    pub(super) fn of_code(code: f64) -> Option<Self> {
        Self::ALL.into_iter().find(|reason| reason.code() == code)
    }
}

impl std::fmt::Display for StopReason {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Drop => "the stress dropped to the given fraction of its peak",
            Self::Strain => "the given strain was reached",
            Self::Time => "the given time was reached",
            Self::Steps => "the given number of steps was reached",
            Self::Equilibrium => "equilibrium was reached",
            Self::Stages => "the last stage ended",
        })
    }
}

/// Updates the stress of the largest magnitude so far, with its sign.
pub(super) fn update_peak(peak: &mut f64, stress: f64) {
    if stress.abs() > peak.abs() {
        *peak = stress;
    }
}

/// Values that the conditions compare.
#[derive(Debug, Clone, Copy)]
pub(super) struct StopValues {
    /// Time, s.
    pub(super) time: f64,
    /// Strain along the loading axis.
    pub(super) strain: f64,
    /// Stress along the loading axis, Pa.
    pub(super) stress: f64,
    /// Stress of the largest magnitude so far, Pa.
    pub(super) peak: f64,
    /// Unbalanced force ratio.
    pub(super) unbalanced: f64,
    /// Whether contacts carry forces (if there should be any), and a stress servo, if any, has reached its target.
    pub(super) at_rest: bool,
}

impl Stop {
    /// The first condition that holds, if any.
    pub(super) fn reason(&self, values: &StopValues) -> Option<StopReason> {
        let &StopValues { time, strain, stress, peak, unbalanced, at_rest } = values;
        if let Some(fraction) = self.drop_to {
            let dropped = if peak > 0.0 { stress < fraction * peak } else { stress > fraction * peak };
            // A peak of zero means that there was no stress yet.
            if peak != 0.0 && dropped {
                return Some(StopReason::Drop);
            }
        }
        if self.strain.is_some_and(|limit| strain.abs() >= limit) {
            return Some(StopReason::Strain);
        }
        if self.time.is_some_and(|limit| time >= limit) {
            return Some(StopReason::Time);
        }
        if self.unbalanced.is_some_and(|limit| unbalanced < limit) && at_rest {
            return Some(StopReason::Equilibrium);
        }
        None
    }
}
