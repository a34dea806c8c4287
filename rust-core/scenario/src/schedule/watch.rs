//! Watch over servos: ends a run whose servo swings about its target in place of reaching it.
//!
//! The gains of servos follow from upper bounds of the stiffness, with which a servo approaches its target from one side. One that swings all the
//! same has a target that it cannot keep with this speed, time step, and damping. A servo whose error alternates in every few steps drives
//! these oscillations itself: contacts and vibrations of particles last longer.

/// Error relative to the target from which a side counts.
const SIDE: f64 = 0.05;

/// Steps of a window.
const WINDOW: u64 = 256;

/// Changes of the side in a window, at least, of a servo that swings: one in 8 steps. A servo with too much gain has a period of 6 to 12
/// steps, an impact lasts 16 steps at the default time step.
const CHANGES: u32 = 32;

/// Windows in a row after which the run ends.
const WINDOWS: u32 = 8;

/// A servo that swings about its target.
#[derive(Debug, Clone, PartialEq)]
pub struct Swinging {
    /// What has the servo.
    pub what: String,
    /// Keys that make the servo slower.
    pub remedy: &'static str,
    /// Lowest and highest error of the last window, relative to the target.
    pub errors: [f64; 2],
}

/// Watch over one controlled quantity. It is no part of the state: a restart begins to count anew.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct Watch {
    /// Side of the target on which the quantity was last, -1 or 1.
    side: f64,
    /// Changes of the side in this window.
    changes: u32,
    /// Lowest and highest error in this window.
    errors: [f64; 2],
    /// Windows in a row with many changes.
    windows: u32,
}

impl Watch {
    /// Books the relative error after a step of this number; the lowest and the highest error of the last window if the servo swings.
    pub(super) fn book(&mut self, step: u64, error: f64) -> Option<[f64; 2]> {
        if error.abs() > SIDE {
            let side = error.signum();
            self.changes += u32::from(side * self.side < 0.0);
            self.side = side;
        }
        self.errors = [self.errors[0].min(error), self.errors[1].max(error)];
        if !step.is_multiple_of(WINDOW) {
            return None;
        }
        self.windows = if self.changes >= CHANGES { self.windows + 1 } else { 0 };
        let errors = std::mem::take(&mut self.errors);
        self.changes = 0;
        (self.windows >= WINDOWS).then_some(errors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Step at which the watch ends a run with this error.
    fn end(error: impl Fn(u64) -> f64) -> Option<u64> {
        let mut watch = Watch::default();
        (1..20_000).find(|&step| watch.book(step, error(step)).is_some())
    }

    /// A servo with a gain g and a delay of one step, `x' = x - g x_old`, swings with a period of 6 steps at g = 1.
    #[test]
    fn ends_what_swings_and_nothing_else() {
        let loop_of = |gain: f64| {
            let mut errors = vec![0.5, 0.5];
            for k in 2..20_000 {
                errors.push(errors[k - 1] - gain * errors[k - 2]);
            }
            end(|step| errors[step as usize])
        };
        assert_eq!([loop_of(0.1), loop_of(0.3), loop_of(0.9)], [None; 3]);
        assert_eq!([loop_of(1.0), loop_of(1.001)], [Some(u64::from(WINDOWS) * WINDOW); 2]);
        // Impacts of 16 steps with as long breaks, small errors, and errors of one sign.
        assert_eq!(end(|step| if step / 16 % 2 == 0 { 1.0 } else { -1.0 }), None);
        assert_eq!(end(|step| if step % 2 == 0 { 0.04 } else { -0.04 }), None);
        assert_eq!(end(|step| 0.3 + 0.2 * (step as f64).sin()), None);
    }
}
