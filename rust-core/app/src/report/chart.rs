//! Charts as inline SVG: lines, markers, stacked areas, reference lines, and a marked peak.
//!
//! A chart needs no script. `chart.js` adds a read-out under the pointer; for it, every series carries its points in a
//! `polyline` with the attribute `data-name`, and the drawing carries its scales.

mod scale;
#[cfg(test)]
mod tests;

use std::fmt::Write as _;

use super::html::{escape, number};
pub(crate) use scale::Scale;

/// Size of the drawing, in its own units; the page scales it to the width of its column.
const WIDTH: f64 = 480.0;
const HEIGHT: f64 = 320.0;
/// Margins for labels of ticks and axes; the left one grows with the labels of the ticks.
const LEAST_LEFT: f64 = 68.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 48.0;
/// Points that deviate less than this from the simplified line are omitted.
const TOLERANCE: f64 = 0.1;

/// An axis.
#[derive(Debug, Clone, Default)]
pub(super) struct Axis {
    /// Label with unit.
    pub label: String,
    /// Logarithmic scale; all values must be positive.
    pub logarithmic: bool,
}

impl Axis {
    /// A linear axis.
    pub fn new(label: &str) -> Self {
        Self { label: label.to_owned(), logarithmic: false }
    }
}

/// Appearance of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Style {
    /// Solid line.
    Line,
    /// Solid line with a dot at every point.
    LineAndDots,
    /// Dashed line.
    Dashed,
    /// Dotted line.
    Dotted,
    /// Crosses without a line.
    Crosses,
    /// Open diamonds without a line.
    Diamonds,
    /// Dots without a line.
    Dots,
    /// Area stacked on the areas before it.
    StackedArea,
}

/// Points with one name and one color.
#[derive(Debug, Clone)]
pub(super) struct Series {
    /// Name in the legend and the read-out.
    pub name: String,
    /// Color, "#1f6fb4".
    pub color: &'static str,
    /// Appearance.
    pub style: Style,
    /// Abscissas and ordinates; a line has gaps at points that are not finite.
    pub points: Vec<(f64, f64)>,
    /// Whether the legend shows it.
    pub in_legend: bool,
    /// Whether the point of largest magnitude is marked with its value.
    pub marks_peak: bool,
}

/// A horizontal line at a given value.
#[derive(Debug, Clone)]
pub(super) struct ReferenceLine {
    /// Name in the legend.
    pub name: String,
    /// Ordinate.
    pub value: f64,
}

/// A chart.
#[derive(Debug, Clone, Default)]
pub(super) struct Chart {
    /// Identifier within the page.
    pub id: String,
    /// Title for screen readers.
    pub title: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// Series, drawn in this order.
    pub series: Vec<Series>,
    /// Horizontal lines behind the series.
    pub reference_lines: Vec<ReferenceLine>,
    /// Whether there is a legend.
    pub legend: bool,
}

/// Charts with their headings side by side under a heading, with a note (HTML) below; empty without charts.
pub(super) fn side_by_side(heading: &str, charts: &[(String, Chart)], note: &str) -> String {
    if charts.is_empty() {
        return String::new();
    }
    let one = |(heading, chart): &(String, Chart)| format!("<div><h3>{}</h3>{}</div>\n", escape(heading), chart.html());
    let charts = charts.iter().map(one).collect::<String>();
    format!("<h2>{heading}</h2>\n<div class=\"pair\">\n{charts}</div>\n<p class=\"quiet\">{note}</p>\n")
}

impl Chart {
    /// The chart as HTML; a note instead of a drawing if no point is finite.
    pub fn html(&self) -> String {
        let tops = self.tops();
        let all = || tops.iter().flatten().copied().filter(|point| self.drawable(*point));
        let references = self.reference_lines.iter().map(|line| line.value);
        let stacked = self.series.iter().any(|series| series.style == Style::StackedArea);
        // Room for the text at a peak, beyond all curves and lines.
        let peaks = self.series.iter().filter(|series| series.marks_peak && !self.y.logarithmic);
        let texts = peaks.filter_map(|series| Some(peak(&series.points)?.1 * PEAK_ROOM));
        let values = all().map(|point| point.1).chain(references).chain(texts).chain(stacked.then_some(0.0));
        let y = Scale::new(values, self.y.logarithmic, HEIGHT - BOTTOM, TOP);
        let left = y.as_ref().map_or(LEAST_LEFT, left_margin);
        let x = Scale::new(all().map(|point| point.0), self.x.logarithmic, left, WIDTH - RIGHT);
        let (Some(x), Some(y)) = (x, y) else { return "<p>There are no finite values to draw.</p>\n".to_owned() };
        let id = &self.id;
        let mut svg = format!(
            "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-labelledby=\"{id}-title {id}-desc\" \
             data-x=\"{}\" data-y=\"{}\" data-x-label=\"{}\" data-y-label=\"{}\">\n<title id=\"{id}-title\">{}</title>\n\
             <desc id=\"{id}-desc\">{}</desc>\n",
            x.as_attribute(),
            y.as_attribute(),
            escape(&self.x.label),
            escape(&self.y.label),
            escape(&self.title),
            escape(&self.description()),
        );
        svg += &self.axes(&x, &y, left);
        for line in &self.reference_lines {
            let at = y.place(line.value);
            let _ = writeln!(
                svg,
                "<line class=\"reference\" x1=\"{left:.2}\" x2=\"{:.0}\" y1=\"{at:.2}\" y2=\"{at:.2}\"/>",
                WIDTH - RIGHT
            );
        }
        let mut below: Option<&[(f64, f64)]> = None;
        let mut texts = Vec::new();
        for (series, top) in self.series.iter().zip(&tops) {
            let place = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
                let drawable = |point: &(f64, f64)| self.drawable(*point);
                points
                    .iter()
                    .map(|p| if drawable(p) { (x.place(p.0), y.place(p.1)) } else { (f64::NAN, f64::NAN) })
                    .collect()
            };
            let placed = place(top);
            if series.style == Style::StackedArea {
                let floor =
                    below.map_or_else(|| top.iter().map(|point| (x.place(point.0), y.place(0.0))).collect(), place);
                svg += &area(series, &placed, &floor);
                below = Some(top);
            } else {
                svg += &line_or_markers(series, &placed);
            }
            if series.marks_peak
                && let Some((at, value)) = peak(&series.points)
            {
                svg += &peak_mark(series, (x.place(at), y.place(value)), value, &mut texts);
            }
        }
        svg += "</svg>\n";
        format!("<figure class=\"plot\">\n{}{svg}</figure>\n", if self.legend { self.legend() } else { String::new() })
    }

    /// Points at which the series are drawn: those of stacked areas lie on top of the areas before.
    fn tops(&self) -> Vec<Vec<(f64, f64)>> {
        let mut stack: Vec<f64> = Vec::new();
        let top = |series: &Series| {
            if series.style != Style::StackedArea {
                return series.points.clone();
            }
            stack.resize(series.points.len(), 0.0);
            let stacked = series.points.iter().zip(&mut stack).map(|(&(x, y), sum)| {
                *sum += y;
                (x, *sum)
            });
            stacked.collect()
        };
        self.series.iter().map(top).collect()
    }

    fn drawable(&self, (x, y): (f64, f64)) -> bool {
        let fits = |value: f64, axis: &Axis| value.is_finite() && (!axis.logarithmic || value > 0.0);
        fits(x, &self.x) && fits(y, &self.y)
    }

    /// Ranges and peaks in words.
    fn description(&self) -> String {
        let mut text = format!("{} over {}.", self.y.label, self.x.label);
        for series in &self.series {
            let points = || series.points.iter().filter(|point| self.drawable(**point));
            let range = |of: fn(&(f64, f64)) -> f64| {
                let ends = points().map(of).fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
                format!("{} to {}", number(ends.0), number(ends.1))
            };
            if let Some((at, value)) = peak(&series.points) {
                let (x, y) = (range(|point| point.0), range(|point| point.1));
                let (at, value) = (number(at), number(value));
                let _ = write!(text, " {}: {x}, values {y}, largest magnitude {value} at {at}.", series.name);
            }
        }
        for line in &self.reference_lines {
            let _ = write!(text, " {}: {}.", line.name, number(line.value));
        }
        text
    }

    /// Grid, ticks, and labels; `left`: where the drawing begins.
    fn axes(&self, x: &Scale, y: &Scale, left: f64) -> String {
        let (right, bottom) = (WIDTH - RIGHT, HEIGHT - BOTTOM);
        let mut svg = String::from("<g class=\"axes\">\n");
        for (value, label) in x.ticks() {
            let at = x.place(value);
            let class = if value == 0.0 && !x.logarithmic { "zero" } else { "grid" };
            let _ = writeln!(
                svg,
                "<line class=\"{class}\" x1=\"{at:.2}\" x2=\"{at:.2}\" y1=\"{TOP}\" y2=\"{bottom}\"/>\
                 <text x=\"{:.2}\" y=\"{:.0}\" text-anchor=\"middle\">{label}</text>",
                at.min(WIDTH - 0.5 * NARROW * label.chars().count() as f64),
                bottom + 17.0
            );
        }
        for (value, label) in y.ticks() {
            let at = y.place(value);
            let class = if value == 0.0 && !y.logarithmic { "zero" } else { "grid" };
            let _ = writeln!(
                svg,
                "<line class=\"{class}\" x1=\"{left:.2}\" x2=\"{right}\" y1=\"{at:.2}\" y2=\"{at:.2}\"/>\
                 <text x=\"{:.0}\" y=\"{at:.2}\" dy=\"0.33em\" text-anchor=\"end\">{label}</text>",
                left - TICK_GAP
            );
        }
        let (middle_x, middle_y) = (0.5 * (left + right), 0.5 * (TOP + bottom));
        let _ = writeln!(
            svg,
            "<text x=\"{middle_x}\" y=\"{:.0}\" text-anchor=\"middle\">{}</text>\n\
             <text transform=\"translate(14 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>\n</g>",
            HEIGHT - 8.0,
            escape(&self.x.label),
            escape(&self.y.label)
        );
        svg
    }

    fn legend(&self) -> String {
        let mut html = String::from("<ul class=\"legend\">");
        let mut entry = |swatch: &str, name: &str| {
            let _ =
                write!(html, "<li><svg viewBox=\"0 0 24 12\" aria-hidden=\"true\">{swatch}</svg>{}</li>", escape(name));
        };
        for series in self.series.iter().filter(|series| series.in_legend) {
            let swatch = match series.style {
                Style::StackedArea => format!("<rect width=\"24\" height=\"12\" fill=\"{}\"/>", series.color),
                Style::Crosses | Style::Diamonds | Style::Dots => marker(series, (12.0, 6.0)),
                _ => format!("<polyline points=\"0,6 24,6\" {}/>", stroke(series)),
            };
            entry(&swatch, &series.name);
        }
        for line in &self.reference_lines {
            entry("<line class=\"reference\" x1=\"0\" x2=\"24\" y1=\"6\" y2=\"6\"/>", &line.name);
        }
        html + "</ul>\n"
    }
}

/// Distance between the labels of the ticks and the drawing, and room for the label of the axis beside them.
const TICK_GAP: f64 = 6.0;
const AXIS_LABEL: f64 = 24.0;

/// Width of a character of the labels of ticks; the last label must not leave the drawing.
const NARROW: f64 = 6.2;

/// Where the drawing begins, so that the label of the vertical axis stands clear of the labels of its ticks.
fn left_margin(y: &Scale) -> f64 {
    let longest = y.ticks().iter().map(|(_, label)| label.chars().count()).max().unwrap_or(0);
    LEAST_LEFT.max(AXIS_LABEL + CHARACTER * longest as f64 + TICK_GAP)
}

/// The finite point of largest magnitude.
fn peak(points: &[(f64, f64)]) -> Option<(f64, f64)> {
    let finite = points.iter().copied().filter(|(x, y)| x.is_finite() && y.is_finite());
    finite.reduce(|peak, point| if point.1.abs() > peak.1.abs() { point } else { peak })
}

fn stroke(series: &Series) -> String {
    let (width, dash) = match series.style {
        Style::Dashed => (1.6, " stroke-dasharray=\"6 4\""),
        Style::Dotted => (1.4, " stroke-dasharray=\"1.5 3\""),
        _ => (2.0, ""),
    };
    format!("fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"{dash}", series.color)
}

/// One marker of a series.
fn marker(series: &Series, (x, y): (f64, f64)) -> String {
    let color = series.color;
    match series.style {
        Style::Crosses => {
            let path = format!("M{:.2} {y:.2}h8M{x:.2} {:.2}v8", x - 4.0, y - 4.0);
            format!("<path d=\"{path}\" stroke=\"{color}\" stroke-width=\"1.6\"/>")
        }
        Style::Diamonds => {
            let path = format!("M{:.2} {y:.2}l6 -6 6 6 -6 6z", x - 6.0);
            format!("<path d=\"{path}\" fill=\"none\" stroke=\"{color}\" stroke-width=\"2\"/>")
        }
        _ => format!("<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"3\" fill=\"{color}\"/>"),
    }
}

fn as_points(points: &[(f64, f64)]) -> String {
    points.iter().map(|(x, y)| format!("{x:.2},{y:.2}")).collect::<Vec<_>>().join(" ")
}

/// The parts of a line, split at points that are not finite.
fn parts(points: &[(f64, f64)]) -> impl Iterator<Item = &[(f64, f64)]> {
    points.split(|point| point.0.is_nan()).filter(|part| !part.is_empty())
}

fn line_or_markers(series: &Series, placed: &[(f64, f64)]) -> String {
    let name = escape(&series.name);
    let scatter = matches!(series.style, Style::Crosses | Style::Diamonds | Style::Dots);
    let mut svg = String::new();
    for part in parts(placed) {
        if scatter {
            let _ = writeln!(
                svg,
                "<polyline data-name=\"{name}\" data-scatter=\"\" fill=\"none\" points=\"{}\"/>",
                as_points(part)
            );
        } else {
            let points = as_points(&simplified(part));
            let _ = writeln!(svg, "<polyline data-name=\"{name}\" points=\"{points}\" {}/>", stroke(series));
        }
        if scatter || series.style == Style::LineAndDots {
            svg.extend(part.iter().map(|point| marker(series, *point)));
            svg.push('\n');
        }
    }
    svg
}

/// Area between two lines over the same abscissas, with its upper edge for the read-out.
fn area(series: &Series, top: &[(f64, f64)], floor: &[(f64, f64)]) -> String {
    let finite = |edge: &[(f64, f64)]| edge.iter().copied().filter(|point| !point.0.is_nan()).collect::<Vec<_>>();
    let (top, mut floor) = (simplified(&finite(top)), simplified(&finite(floor)));
    floor.reverse();
    format!(
        "<polygon points=\"{} {}\" fill=\"{}\"/>\n\
         <polyline data-name=\"{}\" data-stacked=\"\" points=\"{}\" fill=\"none\" stroke=\"#fff\" stroke-width=\"0.6\"/>\n",
        as_points(&top),
        as_points(&floor),
        series.color,
        escape(&series.name),
        as_points(&top),
    )
}

/// Extent of the axis over the value of a marked peak.
const PEAK_ROOM: f64 = 1.08;

/// Height of a line of text, and width of a character, px.
const LINE: f64 = 15.0;
const CHARACTER: f64 = 7.5;

/// A dot at the peak with its value. `texts`: left, right, and baseline of the texts that are already there.
fn peak_mark(series: &Series, (x, y): (f64, f64), value: f64, texts: &mut Vec<[f64; 3]>) -> String {
    let text = number(value);
    let width = CHARACTER * text.chars().count() as f64;
    let (right, left) = (("start", 8.0), ("end", -8.0));
    let sides = if x > 0.7 * WIDTH { [left, right] } else { [right, left] };
    // The text is on the side away from the curve, which rises to the peak from zero.
    let text_y = if value > 0.0 { (y - 6.0).max(TOP + 10.0) } else { (y + 15.0).min(HEIGHT - BOTTOM - 4.0) };
    let extent = |(anchor, shift): (&str, f64), line: f64| {
        let start = if anchor == "end" { x + shift - width } else { x + shift };
        [start, start + width, text_y + LINE * line]
    };
    let is_free =
        |new: &[f64; 3]| texts.iter().all(|old| new[1] < old[0] || old[1] < new[0] || (new[2] - old[2]).abs() >= LINE);
    // Beside another text, or below it.
    let places = [0.0, 1.0, 2.0, 3.0].into_iter().flat_map(|line| sides.map(|side| (side, line)));
    let (side, line) = places.into_iter().find(|&(side, line)| is_free(&extent(side, line))).unwrap_or((sides[0], 0.0));
    let place = extent(side, line);
    texts.push(place);
    format!(
        "<circle cx=\"{x:.2}\" cy=\"{y:.2}\" r=\"3.5\" fill=\"{}\"/>\
         <text class=\"halo\" x=\"{:.2}\" y=\"{:.2}\" text-anchor=\"{}\">{text}</text>\n",
        series.color,
        x + side.1,
        place[2],
        side.0,
    )
}

/// Simplifies a line: omits points that deviate less than [`TOLERANCE`] from it (Ramer 1972, Douglas and Peucker 1973).
fn simplified(points: &[(f64, f64)]) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut kept = vec![false; points.len()];
    let last = points.len() - 1;
    (kept[0], kept[last]) = (true, true);
    let mut open = vec![(0, last)];
    while let Some((first, last)) = open.pop() {
        let farthest = (first + 1..last)
            .map(|k| (k, distance(points[k], points[first], points[last])))
            .reduce(|most, next| if next.1 > most.1 { next } else { most });
        if let Some((k, distance)) = farthest
            && distance > TOLERANCE
        {
            kept[k] = true;
            open.extend([(first, k), (k, last)]);
        }
    }
    points.iter().zip(kept).filter_map(|(point, kept)| kept.then_some(*point)).collect()
}

/// Distance of a point from the segment between two others.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (px, py) = (point.0 - from.0, point.1 - from.1);
    let length = dx * dx + dy * dy;
    let along = if length > 0.0 { ((px * dx + py * dy) / length).clamp(0.0, 1.0) } else { 0.0 };
    (px - along * dx).hypot(py - along * dy)
}
