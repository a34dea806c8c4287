//! Scales of charts: map values to positions in the drawing, and choose ticks at round values.

use crate::report::html::superscript;

/// A linear or logarithmic scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Scale {
    /// Value at `from`.
    low: f64,
    /// Value at `to`.
    high: f64,
    pub logarithmic: bool,
    from: f64,
    to: f64,
}

/// Fraction of the range that is added at each end.
const PADDING: f64 = 0.04;
/// Approximate number of ticks.
const TICKS: f64 = 8.0;
/// Approximate number of ticks with labels that contain a power of ten, which are longer.
const LONG_TICKS: f64 = 5.0;

impl Scale {
    /// A scale from `from` to `to` over all values; None when there are none. A linear scale that begins or ends at zero
    /// is not padded there.
    pub fn new(values: impl Iterator<Item = f64>, logarithmic: bool, from: f64, to: f64) -> Option<Self> {
        let (low, high) = values.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        if !(low.is_finite() && high.is_finite()) {
            return None;
        }
        if logarithmic {
            let factor = if high > low { (high / low).powf(PADDING) } else { 2.0 };
            return Some(Self { low: low / factor, high: high * factor, logarithmic, from, to });
        }
        let range = high - low;
        // A single value, or values that differ only by rounding, get a range of the size of the value.
        let even = range <= 1e-12 * low.abs().max(high.abs());
        let padding = match (even, low == 0.0) {
            (true, true) => 1.0,
            (true, false) => 0.5 * low.abs(),
            _ => PADDING * range,
        };
        let low = if low == 0.0 && !even { 0.0 } else { low - padding };
        let high = if high == 0.0 && !even { 0.0 } else { high + padding };
        Some(Self { low, high, logarithmic, from, to })
    }

    /// Position of a value in the drawing.
    pub fn place(&self, value: f64) -> f64 {
        let share = if self.logarithmic {
            (value / self.low).log10() / (self.high / self.low).log10()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        self.from + share * (self.to - self.from)
    }

    /// The scale for the read-out: values at the ends, positions of the ends, 1 if logarithmic.
    pub fn as_attribute(&self) -> String {
        format!("{:e} {:e} {} {} {}", self.low, self.high, self.from, self.to, u8::from(self.logarithmic))
    }

    /// Round values within the scale, with their labels.
    pub fn ticks(&self) -> Vec<(f64, String)> {
        if self.logarithmic { self.decades() } else { self.round_values() }
    }

    fn round_values(&self) -> Vec<(f64, String)> {
        let largest = self.low.abs().max(self.high.abs());
        // Labels have a power of ten if plain numbers would be long.
        let plain = (1e-3..1e5).contains(&largest);
        let apart = if plain { 0 } else { largest.log10().floor() as i32 };
        let (step, power) = round_step((self.high - self.low) / if plain { TICKS } else { LONG_TICKS });
        let decimals = (apart - power).max(0) as usize;
        let ticks = (self.low / step).ceil() as i64..=(self.high / step).floor() as i64;
        ticks
            .map(|k| {
                let value = k as f64 * step;
                let mantissa = format!("{:.decimals$}", value / 10.0_f64.powi(apart)).replace('-', "−");
                let label = match (k, apart) {
                    (0, _) => "0".to_owned(),
                    (_, 0) => mantissa,
                    _ => format!("{mantissa}·10{}", superscript(apart)),
                };
                (value, label)
            })
            .collect()
    }

    fn decades(&self) -> Vec<(f64, String)> {
        let (low, high) = (self.low.log10(), self.high.log10());
        let factors: &[u8] = if high - low > 2.5 { &[1] } else { &[1, 2, 5] };
        let every = ((high - low) / TICKS).ceil().max(1.0) as i32;
        let plain = low >= -3.0 && high < 5.0;
        (low.floor() as i32..=high.ceil() as i32)
            .filter(|power| power.rem_euclid(every) == 0)
            .flat_map(|power| factors.iter().map(move |&factor| (factor, power)))
            .map(|(factor, power)| {
                let label = match (plain, factor) {
                    (true, _) => format!("{:.*}", (-power).max(0) as usize, f64::from(factor) * 10.0_f64.powi(power)),
                    (_, 1) => format!("10{}", superscript(power)),
                    _ => format!("{factor}·10{}", superscript(power)),
                };
                (f64::from(factor) * 10.0_f64.powi(power), label)
            })
            .filter(|(value, _)| (self.low..=self.high).contains(value))
            .collect()
    }
}

/// The smallest of 1, 2, 5 times a power of ten that is not below `step`, and the power.
fn round_step(step: f64) -> (f64, i32) {
    let power = step.log10().floor() as i32;
    let unit = 10.0_f64.powi(power);
    // Rounding errors must not raise a step that is already round.
    let factor = [1.0, 2.0, 5.0].into_iter().find(|factor| factor * unit >= step * (1.0 - 1e-9));
    factor.map_or((10.0_f64.powi(power + 1), power + 1), |factor| (factor * unit, power))
}
