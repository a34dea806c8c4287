//! Figures for papers: curves with bands over labeled axes, as SVG and PDF with text.

mod canvas;
mod letters;
mod pdf;
mod svg;

use canvas::{Anchor, Canvas, Ink, Place};
use letters::width_of;

use crate::report::Scale;

/// Colors that color-blind readers tell apart (Okabe and Ito 2008).
const COLORS: [Ink; 6] = [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [230, 159, 0], [86, 180, 233]];
/// Dashes of the curves, so that they differ without colors; the first one is solid.
const DASHES: [&[f64]; 4] = [&[], &[5.0, 2.0], &[1.5, 1.5], &[6.0, 2.0, 1.5, 2.0]];
const BLACK: Ink = [31, 38, 45];
const GRAY: Ink = [222, 226, 230];
/// Share of the paper that a band covers.
const BAND: f64 = 0.22;
/// Size of the text, and of the gap between labels and what they belong to, pt.
pub(crate) const TEXT: f64 = 8.0;
const GAP: f64 = 4.0;
/// Length of the sample of a curve in the legend, pt.
const SWATCH: f64 = 18.0;

/// A curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Curve {
    /// Name in the legend.
    pub name: String,
    /// Its points.
    pub points: Vec<[f64; 2]>,
    /// Lowest and highest ordinates at each point; empty without a band.
    pub band: Vec<[f64; 2]>,
}

/// A figure.
#[derive(Debug, Clone, PartialEq)]
pub struct Figure {
    /// Labels of the axes, to the right and up.
    pub labels: [String; 2],
    /// The curves.
    pub curves: Vec<Curve>,
    /// Width and height, pt.
    pub size: [f64; 2],
}

impl Figure {
    /// The figure as SVG; `None` if no point is finite.
    pub fn svg(&self) -> Option<String> {
        let mut canvas = svg::Svg::new(self.size);
        self.draw(&mut canvas)?;
        Some(canvas.finish())
    }

    /// The figure as PDF; `None` if no point is finite.
    pub fn pdf(&self) -> Option<Vec<u8>> {
        let mut canvas = pdf::Pdf::new(self.size);
        self.draw(&mut canvas)?;
        Some(canvas.finish())
    }

    fn draw(&self, canvas: &mut dyn Canvas) -> Option<()> {
        let [width, height] = self.size;
        let (right, bottom) = (width - 2.0 * GAP, height - 2.0 * TEXT - 3.0 * GAP);
        let legend = if self.curves.len() > 1 { self.curves.len() as f64 * 1.4 * TEXT + GAP } else { 0.0 };
        let top = 2.0 * GAP + legend;
        let finite = |value: &f64| value.is_finite();
        let ordinates = self.curves.iter().flat_map(|curve| {
            curve.points.iter().map(|point| point[1]).chain(curve.band.iter().flatten().copied()).filter(finite)
        });
        let y = Scale::new(ordinates, false, bottom, top)?;
        let longest = y.ticks().iter().map(|(_, label)| width_of(label, TEXT)).fold(0.0, f64::max);
        let left = TEXT + 4.0 * GAP + longest;
        let abscissas = self.curves.iter().flat_map(|curve| curve.points.iter().map(|point| point[0]).filter(finite));
        let x = Scale::new(abscissas, false, left, right)?;
        Self::axes(canvas, &x, &y, [left, right, top, bottom]);
        canvas.text((0.5 * (left + right), height - 2.0 * GAP), Anchor::Middle, false, &self.labels[0]);
        canvas.text((TEXT + GAP, 0.5 * (top + bottom)), Anchor::Middle, true, &self.labels[1]);
        let place = |point: &[f64; 2]| (x.place(point[0]), y.place(point[1]));
        for (k, curve) in self.curves.iter().enumerate() {
            let color = COLORS[k % COLORS.len()];
            let (lower, upper): (Vec<Place>, Vec<Place>) = (curve.points.iter().zip(&curve.band))
                .filter(|(point, band)| point[0].is_finite() && band.iter().all(|end| end.is_finite()))
                .map(|(point, band)| (place(&[point[0], band[0]]), place(&[point[0], band[1]])))
                .unzip();
            if !lower.is_empty() {
                let outline: Vec<Place> = lower.into_iter().chain(upper.into_iter().rev()).collect();
                canvas.area(&outline, color, BAND);
            }
        }
        for (k, curve) in self.curves.iter().enumerate() {
            let (color, dash) = (COLORS[k % COLORS.len()], DASHES[k % DASHES.len()]);
            // A line has gaps at points that are not finite.
            for part in curve.points.split(|point| !point.iter().all(|value| value.is_finite())) {
                let part: Vec<Place> = part.iter().map(place).collect();
                if part.len() > 1 {
                    canvas.line(&part, color, 1.2, dash);
                }
            }
            if self.curves.len() > 1 {
                let at = 2.0 * GAP + (k as f64 + 0.5) * 1.4 * TEXT;
                canvas.line(&[(left, at), (left + SWATCH, at)], color, 1.2, dash);
                canvas.text((left + SWATCH + GAP, at + 0.35 * TEXT), Anchor::Start, false, &curve.name);
            }
        }
        Some(())
    }

    /// Grid, ticks, and frame; the frame: left, right, top, bottom.
    fn axes(canvas: &mut dyn Canvas, x: &Scale, y: &Scale, [left, right, top, bottom]: [f64; 4]) {
        let ticks = x.ticks();
        // Every second label, if they would touch each other.
        let widest = ticks.iter().map(|(_, label)| width_of(label, TEXT)).fold(0.0, f64::max) + 2.0 * GAP;
        let every = (widest * ticks.len() as f64 / (right - left)).ceil().max(1.0) as usize;
        for (value, label) in ticks.iter().step_by(every) {
            let at = x.place(*value);
            canvas.line(&[(at, top), (at, bottom)], GRAY, 0.5, &[]);
            canvas.text((at, bottom + TEXT + 0.5 * GAP), Anchor::Middle, false, label);
        }
        for (value, label) in y.ticks() {
            let at = y.place(value);
            canvas.line(&[(left, at), (right, at)], GRAY, 0.5, &[]);
            canvas.text((left - GAP, at + 0.35 * TEXT), Anchor::End, false, &label);
        }
        canvas.line(&[(left, top), (left, bottom), (right, bottom)], BLACK, 0.8, &[]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn figure() -> Figure {
        let curve = |name: &str, slope: f64| Curve {
            name: name.to_owned(),
            points: (0..=10).map(|k| [f64::from(k), slope * f64::from(k)]).collect(),
            band: (0..=10).map(|k| [slope * f64::from(k) - 1.0, slope * f64::from(k) + 1.0]).collect(),
        };
        let labels = ["strain, ‰".to_owned(), "stress <σ>, MPa".to_owned()];
        Figure { labels, curves: vec![curve("a & b", 1.0), curve("c", 2.0)], size: [240.0, 170.0] }
    }

    /// A line and a band per curve, names and labels as text; equal bytes.
    #[test]
    fn svg_has_curves_bands_and_text() {
        let svg = figure().svg().unwrap();
        assert_eq!((svg.matches("<polygon").count(), svg.matches("stroke-width=\"1.2\"").count()), (2, 4));
        for text in ["strain, ‰", "stress &lt;σ&gt;, MPa", "a &amp; b", ">10<"] {
            assert!(svg.contains(text), "{text}");
        }
        assert_eq!(svg, figure().svg().unwrap());
        assert_eq!(Figure { curves: Vec::new(), ..figure() }.svg(), None);
    }

    /// The PDF is one, has the size of the figure, and its text is that of the figure.
    #[test]
    fn pdf_has_the_size_and_the_text() {
        let pdf = figure().pdf().unwrap();
        assert!(pdf.starts_with(b"%PDF-") && pdf == figure().pdf().unwrap());
        let text = String::from_utf8_lossy(&pdf);
        assert!(text.contains("[0 0 240 170]"), "{text}");
        for part in ["(a & b)", "(10)"] {
            assert!(text.contains(part), "{part}");
        }
    }
}
