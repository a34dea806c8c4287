//! A factor that changes with time, and what it multiplies: motions, walls, and loads.

use super::Expression;

/// A factor that changes with time.
///
/// ```
/// use concordem_scenario::schedule::History;
///
/// let history = History::Table { points: vec![[0.0, 0.0], [1e-3, 1.0], [3e-3, 0.0]], repeat: false, smooth: false };
/// assert_eq!(history.at(0.5e-3), 0.5);
/// assert_eq!(history.at(2e-3), 0.5);
/// assert_eq!(history.at(1.0), 0.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum History {
    /// Straight lines, or smooth steps, between points `[time (s), factor]`; constant before the first and after the last.
    Table {
        /// Points, at least one, with increasing times.
        points: Vec<[f64; 2]>,
        /// Whether the table begins again after its last point.
        repeat: bool,
        /// Whether `s³(10 − 15 s + 6 s²)` replaces the straight line `s` between two points.
        smooth: bool,
    },
    /// `mean + amplitude sin(2π t/period + phase)`.
    Sine {
        /// Mean.
        mean: f64,
        /// Amplitude.
        amplitude: f64,
        /// Period, s.
        period: f64,
        /// Phase at time zero, rad.
        phase: f64,
    },
    /// A formula of the time.
    Formula {
        /// The formula.
        expression: Expression,
        /// Time up to which its bounds are searched, s.
        until: f64,
    },
}

/// Number of equal distances at whose ends a formula is evaluated to find its largest value and steepest slope.
const TRIALS: u32 = 10_000;

impl History {
    /// The factor at `time` (s).
    pub fn at(&self, time: f64) -> f64 {
        match self {
            Self::Formula { expression, .. } => expression.at(time),
            Self::Sine { mean, amplitude, period, phase } => {
                mean + amplitude * libm::sin(2.0 * std::f64::consts::PI * (time / period) + phase)
            }
            Self::Table { points, repeat, smooth } => {
                let (Some(first), Some(last)) = (points.first(), points.last()) else { return 1.0 };
                let length = last[0] - first[0];
                let time = if *repeat && length > 0.0 && time > last[0] {
                    first[0] + (time - first[0]).rem_euclid(length)
                } else {
                    time
                };
                let after = points.partition_point(|point| point[0] <= time);
                if after == 0 {
                    return first[1];
                }
                let Some(end) = points.get(after) else { return last[1] };
                let start = points[after - 1];
                let s = (time - start[0]) / (end[0] - start[0]);
                let s = if *smooth { s * s * s * (10.0 + s * (6.0 * s - 15.0)) } else { s };
                start[1] + (end[1] - start[1]) * s
            }
        }
    }

    /// Times (s) and values at which the bounds of a formula are searched; empty for other histories.
    pub(crate) fn trials(&self) -> impl Iterator<Item = (f64, f64)> {
        let formula = if let Self::Formula { expression, until } = self { Some((expression, *until)) } else { None };
        formula.into_iter().flat_map(|(expression, until)| {
            (0..=TRIALS).map(move |k| {
                let time = until * (f64::from(k) / f64::from(TRIALS));
                (time, expression.at(time))
            })
        })
    }

    /// Largest magnitude of the factor.
    pub fn largest(&self) -> f64 {
        match self {
            Self::Sine { mean, amplitude, .. } => mean.abs() + amplitude.abs(),
            Self::Formula { .. } => self.trials().fold(0.0, |largest, (_, value)| largest.max(value.abs())),
            Self::Table { points, .. } => points.iter().fold(0.0, |largest, point| largest.max(point[1].abs())),
        }
    }

    /// Largest magnitude of the factor's derivative, 1/s.
    pub fn steepest(&self) -> f64 {
        match self {
            Self::Sine { amplitude, period, .. } => amplitude.abs() * 2.0 * std::f64::consts::PI / period,
            Self::Formula { .. } => {
                let mut trials = self.trials();
                let Some(mut before) = trials.next() else { return 0.0 };
                let slopes = trials.map(|now| {
                    let slope = (now.1 - before.1) / (now.0 - before.0);
                    before = now;
                    slope.abs()
                });
                slopes.fold(0.0, f64::max)
            }
            Self::Table { points, smooth, .. } => {
                // The smooth step is 15/8 as steep in its middle as the straight line.
                let factor = if *smooth { 1.875 } else { 1.0 };
                let slope = |pair: &[[f64; 2]]| ((pair[1][1] - pair[0][1]) / (pair[1][0] - pair[0][0])).abs();
                points.windows(2).map(slope).fold(0.0, f64::max) * factor
            }
        }
    }
}
