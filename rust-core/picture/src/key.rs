//! What stands beside a drawing: the bar of colors with numbers, or names of kinds; the scale; the axes.

use concordem_contact::math::Vec3;

use crate::camera::Camera;
use crate::colors::Scale;
use crate::image::{Color, Image, mixed};
use crate::text::{TEXT_HEIGHT, TEXT_WIDTH, text};

/// Color of text and lines.
pub const INK: Color = [40, 48, 56];
/// Width of the bar, and gap between it and its text, px.
const BAR: i64 = 22;
const GAP: i64 = 8;
/// Length of the axes, px.
const AXIS: f64 = 42.0;

/// What the colors mean.
#[derive(Debug, Clone, PartialEq)]
pub enum Key {
    /// Numbers.
    Bar {
        /// Name and unit.
        label: String,
        /// Values at both ends.
        range: [f64; 2],
        /// Colors.
        scale: Scale,
    },
    /// Names.
    Names(Vec<(Color, String)>),
}

impl Key {
    /// Width that it needs, px.
    pub fn width(&self) -> usize {
        let (letters, swatch) = match self {
            Self::Bar { label, range, .. } => {
                let ticks = ticks(*range).into_iter().map(|(_, text)| text.chars().count()).max().unwrap_or(0);
                // The label stands over the bar and its numbers.
                return (ticks * TEXT_WIDTH + (BAR + GAP) as usize).max(label.chars().count() * TEXT_WIDTH);
            }
            Self::Names(names) => (names.iter().map(|(_, name)| name.chars().count()).max().unwrap_or(0), BAR + GAP),
        };
        letters * TEXT_WIDTH + swatch as usize
    }

    /// Draws it into a frame: left, top, height, px.
    pub fn draw(&self, image: &mut Image, [left, top, height]: [i64; 3]) {
        let line = TEXT_HEIGHT as i64;
        match self {
            Self::Bar { label, range, scale } => {
                text(image, label, [left, top], INK);
                let (top, rows) = (top + 2 * line, (height - 3 * line).max(2));
                for row in 0..rows {
                    let share = 1.0 - (row as f64 + 0.5) / rows as f64;
                    image.fill([left, top + row, BAR, 1], scale.color(share));
                }
                for (share, label) in ticks(*range) {
                    let at = top + ((1.0 - share) * rows as f64).round() as i64;
                    image.fill([left + BAR, at.min(top + rows - 1), GAP / 2, 1], INK);
                    text(image, &label, [left + BAR + GAP, at - line / 2], INK);
                }
            }
            Self::Names(names) => {
                for (k, (color, name)) in names.iter().enumerate() {
                    let top = top + k as i64 * (line + GAP / 2);
                    image.fill([left, top, BAR, line - 4], *color);
                    text(image, name, [left + BAR + GAP, top - 2], INK);
                }
            }
        }
    }
}

/// The largest of 1, 2, and 5 times a power of ten that is at most a number, which is positive.
pub fn round_below(number: f64) -> f64 {
    let mut power = 1.0;
    while power * 10.0 <= number {
        power *= 10.0;
    }
    while power > number {
        power /= 10.0;
    }
    [5.0, 2.0].into_iter().map(|factor| factor * power).find(|candidate| *candidate <= number).unwrap_or(power)
}

/// Round numbers in a range: share of the range, and text. Both ends are those of the range if it has no width.
fn ticks([low, high]: [f64; 2]) -> Vec<(f64, String)> {
    let width = high - low;
    if !(width > 0.0 && width.is_finite()) {
        return vec![(0.5, format!("{low}"))];
    }
    let step = round_below(width / 3.0);
    // Rounding must not lose the ends.
    let slack = 1e-9 * width;
    let (first, last) = (((low - slack) / step).ceil() as i64, ((high + slack) / step).floor() as i64);
    let mut digits = 0;
    while digits < 12 && (step * 10_f64.powi(digits)).round() < 0.999 {
        digits += 1;
    }
    let label = |value: f64| format!("{value:.*}", digits as usize);
    let tick = |k: i64| (((k as f64 * step - low) / width).clamp(0.0, 1.0), label(k as f64 * step));
    (first..=last).map(tick).collect()
}

/// Draws a bar of a round length, at most a quarter of `width`, at the lower right of a frame that ends at `right` and `bottom`.
pub fn draw_length(image: &mut Image, camera: &Camera, width: f64, [right, bottom]: [i64; 2]) {
    let length = round_below(0.25 * width / camera.scale);
    let (unit, factor) = [("nm", 1e9), ("µm", 1e6), ("mm", 1e3), ("m", 1.0), ("km", 1e-3)]
        .into_iter()
        .find(|(_, factor)| length * factor < 999.0)
        .unwrap_or(("km", 1e-3));
    let label = format!("{} {unit}", rounded(length * factor));
    let pixels = (length * camera.scale).round() as i64;
    image.fill([right - pixels, bottom - 4, pixels, 4], INK);
    let letters = label.chars().count() * TEXT_WIDTH;
    text(image, &label, [right - i64::midpoint(pixels, letters as i64), bottom - 8 - TEXT_HEIGHT as i64], INK);
}

/// A round number without the digits that rounding adds.
fn rounded(number: f64) -> String {
    let digits = if number >= 1.0 { 0 } else { 6 };
    let text = format!("{number:.digits$}");
    if digits > 0 { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Draws the axes of coordinates around a point, px. Those along the view are left out.
pub fn draw_axes(image: &mut Image, camera: &Camera, [x, y]: [f64; 2]) {
    for (axis, name) in [(Vec3::x(), "x"), (Vec3::y(), "y"), (Vec3::z(), "z")] {
        let (right, up) = (axis.dot(&camera.view.right), axis.dot(&camera.view.up));
        if right.hypot(up) < 0.1 {
            continue;
        }
        let steps = (4.0 * AXIS) as usize;
        for k in 0..steps {
            let length = AXIS * k as f64 / steps as f64;
            spot(image, x + right * length, y - up * length);
        }
        let reach = AXIS + 10.0;
        let corner = [x + right * reach - 0.5 * TEXT_WIDTH as f64, y - up * reach - 0.5 * TEXT_HEIGHT as f64];
        text(image, name, corner.map(|place| place.round() as i64), INK);
    }
}

/// A soft dot of a pixel.
fn spot(image: &mut Image, x: f64, y: f64) {
    let (left, top) = ((x - 0.5).floor(), (y - 0.5).floor());
    let (right, down) = (x - 0.5 - left, y - 0.5 - top);
    for (dx, across) in [(0, 1.0 - right), (1, right)] {
        for (dy, along) in [(0, 1.0 - down), (1, down)] {
            image.cover(left as i64 + dx, top as i64 + dy, mixed(INK, [255; 3], 0.2), 0.5 * across * along);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Ticks are round numbers with equal digits, and the ends count.
    #[test]
    fn ticks_are_round() {
        let texts = |low, high| ticks([low, high]).into_iter().map(|(_, text)| text).collect::<Vec<_>>().join(" ");
        assert_eq!(texts(0.0, 1.0), "0.0 0.2 0.4 0.6 0.8 1.0");
        assert_eq!(texts(-3.2, 7.1), "-2 0 2 4 6");
        assert_eq!(texts(0.0, 0.35), "0.0 0.1 0.2 0.3");
        assert_eq!(texts(0.0, 3000.0), "0 1000 2000 3000");
        assert_eq!(texts(4.0, 4.0), "4");
        let shares: Vec<f64> = ticks([1.0, 3.0]).into_iter().map(|(share, _)| share).collect();
        assert_eq!(shares, [0.0, 0.25, 0.5, 0.75, 1.0]);
    }

    #[test]
    fn lengths_are_round() {
        assert_eq!([0.3, 1.0, 4.9, 5.0, 37.0].map(round_below), [0.2, 1.0, 2.0, 5.0, 20.0]);
        assert_eq!([20.000_000_000_1, 0.5, 0.02].map(rounded), ["20", "0.5", "0.02"]);
    }
}
