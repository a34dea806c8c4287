//! When a run ends.

/// Conditions; the first that comes true ends the run. They are looked at when a sample is taken (steps: at each).
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stop {
    /// Stress fell to this fraction of its peak (same sign as the peak).
    pub drop_to: Option<f64>,
    /// Size of the strain.
    pub strain: Option<f64>,
    /// Time, s.
    pub time: Option<f64>,
    /// Steps.
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
    /// The steps were done.
    Steps,
    /// Equilibrium (and, under a stress servo, the wanted stress) was reached.
    Equilibrium,
}

impl StopReason {
    const ALL: [Self; 5] = [Self::Drop, Self::Strain, Self::Time, Self::Steps, Self::Equilibrium];

    /// Number of the reason in the state, from 1; 0 stands for none.
    pub(super) fn code(self) -> f64 {
        Self::ALL.iter().position(|reason| *reason == self).map_or(0.0, |at| (at + 1) as f64)
    }

    /// The reason of a number.
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
            Self::Steps => "the given number of steps was done",
            Self::Equilibrium => "equilibrium was reached",
        })
    }
}

/// Peak of the stress so far: value with sign; kept among the plan's memory.
pub(super) fn update_peak(peak: &mut f64, stress: f64) {
    if stress.abs() > peak.abs() {
        *peak = stress;
    }
}

impl Stop {
    /// Whether to stop, given the sample's values.
    pub(super) fn reason(
        &self,
        time: f64,
        strain: f64,
        stress: f64,
        peak: f64,
        unbalanced: f64,
        servo_reached: bool,
    ) -> Option<StopReason> {
        if let Some(fraction) = self.drop_to {
            // The first few samples are noise of the start: a peak counts when something was carried at all.
            let dropped = if peak > 0.0 { stress < fraction * peak } else { stress > fraction * peak };
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
        if self.unbalanced.is_some_and(|limit| unbalanced < limit) && servo_reached {
            return Some(StopReason::Equilibrium);
        }
        None
    }
}
