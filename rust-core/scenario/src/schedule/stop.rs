//! Conditions that end a run.

/// Conditions that end a run; the first one that holds ends it. All are checked with each record, `steps` after every step.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Stop {
    /// The stress drops to this fraction of its peak (of the same sign). That of a run does not count while a stage unloads or loads again. A
    /// stress that is nothing but [rounding](super::Rounding) has no peak.
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

/// Updates the stress of the largest magnitude so far, with its sign, and how far the loading (`loaded`: time of a run at constant rate that has
/// come as far, s) has come since then, in its direction. Stresses up to `rounding` (Pa) do not count.
pub(super) fn update_peak(peak: &mut f64, farthest: &mut f64, stress: f64, loaded: f64, rounding: f64) {
    if stress.abs() > peak.abs().max(rounding) {
        (*peak, *farthest) = (stress, loaded);
    } else if *farthest == 0.0 || loaded / *farthest > 1.0 {
        *farthest = loaded;
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
    /// Whether the loading has not come farther since the peak than it is now.
    pub(super) is_farthest: bool,
    /// Unbalanced force ratio.
    pub(super) unbalanced: f64,
    /// Whether contacts carry forces (if there should be any), and a stress servo, if any, has reached its target.
    pub(super) at_rest: bool,
}

impl Stop {
    /// The first condition that holds, if any.
    pub(super) fn reason(&self, values: &StopValues) -> Option<StopReason> {
        let &StopValues { time, strain, stress, peak, is_farthest, unbalanced, at_rest } = values;
        if let Some(fraction) = self.drop_to {
            let dropped = if peak > 0.0 { stress < fraction * peak } else { stress > fraction * peak };
            // A peak of zero means that there was no stress yet.
            if peak != 0.0 && dropped && is_farthest {
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

#[cfg(test)]
mod tests {
    use super::*;

    fn reason(stop: Stop, time: f64, strain: f64, stress: f64, peak: f64) -> Option<StopReason> {
        stop.reason(&StopValues { time, strain, stress, peak, is_farthest: true, unbalanced: 0.1, at_rest: true })
    }

    /// A specimen in compression has negative stresses and strains; it stops where its mirror image in tension does.
    #[test]
    fn tension_and_compression_stop_alike() {
        for sign in [1.0, -1.0] {
            let (mut peak, mut farthest) = (0.0, 0.0);
            for (loaded, stress) in [(1.0, 1.0), (3.0, 3.0), (4.0, 2.0), (-5.0, -2.5), (3.5, 2.5)] {
                update_peak(&mut peak, &mut farthest, sign * stress, loaded, 0.0);
            }
            assert_eq!((peak, farthest), (sign * 3.0, 4.0));
            let drop = Stop { drop_to: Some(0.5), ..Stop::default() };
            for (stress, expected) in
                [(2.0, None), (1.6, None), (1.4, Some(StopReason::Drop)), (-0.1, Some(StopReason::Drop))]
            {
                assert_eq!(reason(drop, 0.0, 0.0, sign * stress, peak), expected, "{sign} {stress}");
            }
            // Before any stress is carried, none can have dropped.
            assert_eq!(reason(drop, 0.0, 0.0, 0.0, 0.0), None);
            let strain = Stop { strain: Some(0.01), ..Stop::default() };
            for (value, expected) in [(0.009, None), (0.01, Some(StopReason::Strain)), (0.02, Some(StopReason::Strain))]
            {
                assert_eq!(reason(strain, 0.0, sign * value, 0.0, 0.0), expected, "{sign} {value}");
            }
        }
    }

    /// Rounding errors have no peak to drop from; the stress that follows has.
    #[test]
    fn rounding_errors_have_no_peak() {
        let (mut peak, mut farthest) = (0.0, 0.0);
        let drop = Stop { drop_to: Some(0.5), ..Stop::default() };
        for (stress, expected) in [(1e-9, 0.0), (-1e-10, 0.0), (-1e-8, 0.0), (2.0, 2.0), (1e-9, 2.0)] {
            update_peak(&mut peak, &mut farthest, stress, 0.0, 1e-8);
            assert_eq!(peak, expected, "{stress}");
            assert_eq!(reason(drop, 0.0, 0.0, stress, peak).is_some(), peak > 0.0 && stress < 1.0, "{stress}");
        }
    }

    /// The record at the given time is the last one; equilibrium counts only where the loading is content with it.
    #[test]
    fn time_and_equilibrium() {
        let time = Stop { time: Some(2.0), ..Stop::default() };
        for (value, expected) in [(1.9, None), (2.0, Some(StopReason::Time)), (2.1, Some(StopReason::Time))] {
            assert_eq!(reason(time, value, 0.0, 0.0, 0.0), expected);
        }
        let rest = |limit: f64, at_rest: bool| {
            let values = StopValues {
                time: 0.0,
                strain: 0.0,
                stress: 0.0,
                peak: 0.0,
                is_farthest: true,
                unbalanced: 0.1,
                at_rest,
            };
            Stop { unbalanced: Some(limit), ..Stop::default() }.reason(&values)
        };
        assert_eq!(rest(0.11, true), Some(StopReason::Equilibrium));
        assert_eq!((rest(0.1, true), rest(0.11, false)), (None, None));
    }
}
