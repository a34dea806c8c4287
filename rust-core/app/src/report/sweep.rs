//! The page of a sweep: its quantities over each axis, and a table of the means.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use super::RISES;
use super::chart::{Axis, Chart, Series, Style};
use super::html::{escape, frame, number};
use crate::output::sweep::problems;
use crate::provenance::PROGRAM;
use crate::sweep::Sweep;
use crate::sweep::outcome::{Outcome, Quantity};
use crate::sweep::point::Study;

/// Colors of the curves.
const COLORS: [&str; 8] = ["#1f6fb4", "#c8501e", "#3f8f5a", "#7d57a8", "#b08a00", "#4a5560", "#0d8f8f", "#b03a6f"];
/// Largest number of curves in a chart; more cannot be distinguished.
const MOST_CURVES: usize = 8;
/// Largest number of rows of the table; the result files contain all points.
const MOST_ROWS: usize = 400;
/// Largest number of dots in a chart.
const MOST_DOTS: usize = 2000;

/// A quantity of a figure, and its appearance.
struct Drawn {
    of: Value,
    style: Style,
    /// What it is, beside the first quantity of the figure, for names of curves: ", affine sum".
    way: &'static str,
}

/// A number of a point.
type Value = Box<dyn Fn(&Outcome) -> f64>;

struct Figure {
    title: String,
    label: String,
    curves: Vec<Drawn>,
}

fn figures(sweep: &Sweep) -> Vec<Figure> {
    match sweep.study {
        Study::Elastic => of_elasticity(),
        Study::Structure => of_structure(),
        Study::Run => of_runs(sweep),
    }
}

/// One figure per result.
fn of_runs(sweep: &Sweep) -> Vec<Figure> {
    let figure = |(k, quantity): (usize, Quantity)| {
        let (unit, scale) = shown(&quantity);
        let curves =
            vec![Drawn { of: Box::new(move |o: &Outcome| o.values[k] * scale), style: Style::LineAndDots, way: "" }];
        Figure { title: quantity.name.to_string(), label: format!("{}{unit}", quantity.name), curves }
    };
    sweep.quantities().into_iter().enumerate().map(figure).collect()
}

/// Unit to print, after a comma, and the factor from SI.
fn shown(quantity: &Quantity) -> (String, f64) {
    match (&*quantity.unit, &*quantity.name) {
        ("1", _) => (String::new(), 1.0),
        ("Pa", "E" | "E_gauge") => (", GPa".into(), 1e-9),
        ("Pa", _) => (", MPa".into(), 1e-6),
        ("Pa m^0.5", _) => (", MPa √m".into(), 1e-6),
        (unit, _) => (format!(", {unit}"), 1.0),
    }
}

fn of_structure() -> Vec<Figure> {
    use Style::{Dashed, Dotted, LineAndDots};
    let drawn = |of: fn(&Outcome) -> f64, style, way| Drawn { of: Box::new(of), style, way };
    let figure = |title: &str, label: &str, curves| Figure { title: title.into(), label: label.into(), curves };
    vec![
        figure(
            "Links per sphere",
            "inside; dashed: at the boundary",
            vec![
                drawn(|o| o.get("links_per_sphere"), LineAndDots, ""),
                drawn(|o| o.get("links_at_boundary"), Dashed, ", at the boundary"),
            ],
        ),
        figure(
            "Solid fraction",
            "hull; dashed: effective",
            vec![
                drawn(|o| o.get("hull_fraction"), LineAndDots, ""),
                drawn(|o| o.get("effective_fraction"), Dashed, ", effective"),
            ],
        ),
        figure(
            "Deviation from isotropy e",
            "percent²; dotted: independent links",
            vec![
                drawn(|o| o.get("isotropy_percent"), LineAndDots, ""),
                drawn(
                    |o| o.get("isotropy_floor_percent") + o.get("isotropy_noise_percent"),
                    Dotted,
                    ", independent links",
                ),
            ],
        ),
        figure("Mean overlap", "over sum of radii", vec![drawn(|o| o.get("overlap"), LineAndDots, "")]),
    ]
}

fn of_elasticity() -> Vec<Figure> {
    use Style::{Crosses, Dashed, Dotted, LineAndDots};
    let drawn = |of: fn(&Outcome) -> f64, style| {
        let way = match style {
            Dotted => ", affine sum",
            Dashed => ", closed form",
            Crosses => ", relaxed dynamics",
            _ => "",
        };
        Drawn { of: Box::new(of), style, way }
    };
    let figure = |title: &str, label: &str, curves| Figure { title: title.into(), label: label.into(), curves };
    let one = |title, label, of| figure(title, label, vec![drawn(of, LineAndDots)]);
    vec![
        figure(
            "Young’s modulus",
            "E, GPa",
            vec![
                drawn(|o| o.get("young") * 1e-9, LineAndDots),
                drawn(|o| o.get("affine_young") * 1e-9, Dotted),
                drawn(|o| o.get("closed_young") * 1e-9, Dashed),
                drawn(|o| o.get("dynamic_young") * 1e-9, Crosses),
            ],
        ),
        figure(
            "Poisson’s ratio",
            "ν",
            vec![
                drawn(|o| o.get("poisson"), LineAndDots),
                drawn(|o| o.get("affine_poisson"), Dotted),
                drawn(|o| o.get("closed_poisson"), Dashed),
                drawn(|o| o.get("dynamic_poisson"), Crosses),
            ],
        ),
        figure(
            "Relaxation from the uniform strain",
            "E / E of the affine sum",
            vec![
                drawn(|o| o.get("young") / o.get("affine_young"), LineAndDots),
                drawn(|o| o.get("dynamic_young") / o.get("affine_young"), Crosses),
            ],
        ),
        figure(
            "Error of the closed form",
            "E of the closed form / E − 1",
            vec![drawn(|o| o.get("closed_young") / o.get("young") - 1.0, LineAndDots)],
        ),
        one("Anisotropy of E", "ΔE/E", |o| o.get("anisotropy_young")),
        one("Anisotropy of ν", "Δν", |o| o.get("anisotropy_poisson")),
        one("Deviation of G from E/2(1 + ν)", "ΔG/G", |o| o.get("anisotropy_shear")),
        one("Coupling (zero for isotropy)", "Δ/E", |o| o.get("anisotropy_coupling")),
    ]
}

/// The page as text.
pub fn page(sweep: &Sweep, outcomes: &[Outcome]) -> String {
    let name = sweep.source.name.rsplit('/').next().unwrap_or_default();
    let title = if sweep.title.is_empty() { name } else { &sweep.title };
    let bad = outcomes.iter().filter(|outcome| outcome.problem.is_some()).count();
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"quiet\">Sweep <code>{}</code>, {} points, computed by {}.{}</p>\n",
        escape(title),
        escape(name),
        outcomes.len(),
        PROGRAM,
        if sweep.study == Study::Elastic {
            " Solid line: static network; dotted: affine sum; dashed: closed form; crosses: relaxed dynamics."
        } else {
            ""
        }
    );
    if bad > 0 {
        let _ = writeln!(
            body,
            "<details><summary>{bad} points failed</summary><pre>{}</pre></details>",
            escape(&problems(outcomes))
        );
    }
    body += &rising(sweep, outcomes);
    let shown: Vec<usize> = (0..sweep.axes.len()).filter(|&k| !sweep.axes[k].average).collect();
    for &x in &shown {
        body += &over(sweep, outcomes, x, &shown);
    }
    body += &curves(sweep, outcomes);
    body += &table(sweep, outcomes, &shown);
    let _ = write!(
        body,
        "<details><summary>Sweep</summary><pre>{}</pre></details>\n\
         <details><summary>Scenario</summary><pre>{}</pre></details>\n",
        escape(&sweep.source.text),
        escape(&sweep.scenario_text)
    );
    frame(title, &body)
}

/// Says how many points have a largest stress that is no strength.
fn rising(sweep: &Sweep, outcomes: &[Outcome]) -> String {
    let quantities = sweep.quantities();
    let Some(at) = quantities.iter().position(|quantity| quantity.name == RISES) else { return String::new() };
    let rise = outcomes.iter().filter(|outcome| outcome.values[at] == 1.0).count();
    if rise == 0 {
        return String::new();
    }
    format!(
        "<p>The stress of {rise} of {} points still rises at the end of the run (<code>{RISES}</code> is 1): their largest stress is no \
         strength. Run further.</p>\n",
        outcomes.len()
    )
}

/// Points by their values of some axes.
struct ByValues<'a>(BTreeMap<Vec<usize>, Vec<&'a Outcome>>);

impl<'a> ByValues<'a> {
    fn new(sweep: &Sweep, outcomes: &'a [Outcome], axes: &[usize]) -> Self {
        let mut all: BTreeMap<Vec<usize>, Vec<&Outcome>> = BTreeMap::new();
        for (point, outcome) in outcomes.iter().enumerate() {
            let place = sweep.place(point);
            all.entry(axes.iter().map(|&axis| place[axis]).collect()).or_default().push(outcome);
        }
        Self(all)
    }

    /// The points with these values.
    fn of(&self, values: &[usize]) -> impl Iterator<Item = &'a Outcome> {
        self.0.get(values).into_iter().flatten().copied()
    }
}

/// Mean and standard deviation of the finite values.
fn mean(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
    let n = values.len() as f64;
    if values.is_empty() {
        return None;
    }
    let mean = values.iter().sum::<f64>() / n;
    let spread = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    Some((mean, if n > 1.0 { (spread / (n - 1.0)).sqrt() } else { 0.0 }))
}

/// All combinations of values of these axes, the last one fastest. Sampled axes have the same index.
fn combinations(sweep: &Sweep, axes: &[usize]) -> Vec<Vec<usize>> {
    let is_sampled = |axis: usize| sweep.axes[axis].sampled.is_some();
    let first = axes.iter().position(|&axis| is_sampled(axis));
    axes.iter().enumerate().fold(vec![Vec::new()], |all, (k, &axis)| {
        let longer = |start: Vec<usize>| {
            let values = match first {
                Some(first) if first < k && is_sampled(axis) => start[first]..start[first] + 1,
                _ => 0..sweep.axes[axis].values.len(),
            };
            values.map(move |value| start.iter().copied().chain([value]).collect())
        };
        all.into_iter().flat_map(longer).collect()
    })
}

/// Figures over one axis; empty if the axis has fewer than two numbers. A sampled axis has one dot per sample; over the other axes, the
/// figures show means over all samples.
fn over(sweep: &Sweep, outcomes: &[Outcome], x: usize, shown: &[usize]) -> String {
    let along = &sweep.axes[x];
    let numbers: Option<Vec<f64>> = (0..along.values.len()).map(|k| along.number(k)).collect();
    let Some(numbers) = numbers.filter(|numbers| numbers.len() > 1) else { return String::new() };
    let (low, high) = numbers.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &v| (l.min(v), h.max(v)));
    let separate = |k: usize| k != x && sweep.axes[k].values.len() > 1 && sweep.axes[k].sampled.is_none();
    let others: Vec<usize> = shown.iter().copied().filter(|&k| separate(k)).collect();
    let all = combinations(sweep, &others);
    let every = all.len().div_ceil(MOST_CURVES);
    let curves: Vec<&Vec<usize>> = all.iter().step_by(every).collect();
    let mut html = format!("<h2>Over {}</h2>\n", escape(&along.name));
    if every > 1 {
        let _ = writeln!(html, "<p class=\"quiet\">{} of {} curves.</p>", curves.len(), all.len());
    }
    let step = if along.sampled.is_some() { (numbers.len() * curves.len()).div_ceil(MOST_DOTS) } else { 1 };
    let note = match step {
        1 if along.sampled.is_some() => "One dot per sample.".to_owned(),
        1 if sweep.axes.iter().any(|axis| axis.sampled.is_some()) => "Means over all samples.".to_owned(),
        1 => String::new(),
        _ => format!("One dot per sample, of every {step}th sample; the result files contain all of them."),
    };
    if !note.is_empty() {
        let _ = writeln!(html, "<p class=\"quiet\">{note}</p>");
    }
    html += "<div class=\"pair\">\n";
    let axes: Vec<usize> = others.iter().copied().chain([x]).collect();
    let points = ByValues::new(sweep, outcomes, &axes);
    let family = Family { sweep, points, numbers: &numbers, step, others: &others, dots: along.sampled.is_some() };
    for (f, figure) in figures(sweep).iter().enumerate() {
        let series: Vec<Series> =
            curves.iter().enumerate().flat_map(|(c, values)| family.series(figure, c, values)).collect();
        if series.is_empty() {
            continue;
        }
        // Dots show the first quantity only.
        let label = if family.dots { figure.label.split(';').next().unwrap_or_default() } else { &figure.label };
        let chart = Chart {
            id: format!("over-{x}-{f}"),
            title: format!("{} over {}", figure.title, along.name),
            x: Axis { label: along.name.clone(), logarithmic: low > 0.0 && high / low > 20.0 },
            y: Axis::new(label),
            series,
            legend: curves.len() > 1,
            ..Chart::default()
        };
        let _ = writeln!(html, "<div><h3>{}</h3>{}</div>", escape(&figure.title), chart.html());
    }
    html + "</div>\n"
}

/// Curves or dots over one axis, one family for each combination of values of the others.
struct Family<'a> {
    sweep: &'a Sweep,
    /// The points, by the values of the other axes and of this one.
    points: ByValues<'a>,
    /// Values of the axis.
    numbers: &'a [f64],
    /// Of how many values one is drawn.
    step: usize,
    others: &'a [usize],
    dots: bool,
}

impl Family<'_> {
    /// The quantities of a figure for the `c`-th combination `values` of the other axes.
    fn series(&self, figure: &Figure, c: usize, values: &[usize]) -> Vec<Series> {
        let name = self
            .others
            .iter()
            .zip(values)
            .map(|(&axis, &value)| format!("{} {}", self.sweep.axes[axis].name, self.sweep.axes[axis].text(value)))
            .collect::<Vec<_>>()
            .join(", ");
        let name = if name.is_empty() { "all".to_owned() } else { name };
        let drawn = figure.curves.iter().filter(|drawn| !self.dots || drawn.style == Style::LineAndDots);
        let series = drawn.map(|drawn| {
            let mut points: Vec<(f64, f64)> = (0..self.numbers.len())
                .step_by(self.step)
                .filter_map(|k| {
                    let place: Vec<usize> = values.iter().copied().chain([k]).collect();
                    let found = mean(self.points.of(&place).map(|outcome| (drawn.of)(outcome)))?;
                    Some((self.numbers[k], found.0))
                })
                .collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            Series {
                name: format!("{name}{}", drawn.way),
                color: COLORS[c % COLORS.len()],
                style: if self.dots { Style::Dots } else { drawn.style },
                points,
                in_legend: drawn.style == Style::LineAndDots,
                marks_peak: false,
            }
        });
        series.filter(|series| !series.points.is_empty()).collect()
    }
}

/// Figures of the curves of runs: all of few points; of more, mean, smallest, and largest ordinates.
fn curves(sweep: &Sweep, outcomes: &[Outcome]) -> String {
    if sweep.curves.is_empty() {
        return String::new();
    }
    let few = outcomes.len() <= MOST_CURVES;
    let note = if few { "One line per point." } else { "Solid: mean of all points; dashed: smallest and largest." };
    let mut html = format!("<h2>Curves</h2>\n<p class=\"quiet\">{note}</p>\n<div class=\"pair\">\n");
    for (k, curve) in sweep.curves.iter().enumerate() {
        let label = |series: &crate::sweep::series::Series| {
            let quantity = Quantity {
                name: series.name.clone().into(),
                unit: series.unit.clone().into(),
                description: String::new().into(),
            };
            let (unit, scale) = shown(&quantity);
            (format!("{}{unit}", series.name), scale)
        };
        let ((x_label, x_scale), (y_label, y_scale)) = (label(&curve.x), label(&curve.y));
        let line = |name: String, c: usize, style, ordinates: Vec<f64>| {
            let place = |(x, y): (&f64, f64)| (x * x_scale, y * y_scale);
            let points = curve.abscissas.iter().zip(ordinates).map(place).collect();
            Series { name, color: COLORS[c % COLORS.len()], style, points, in_legend: true, marks_peak: false }
        };
        let series: Vec<Series> = if few {
            let one = |(point, outcome)| {
                line(format!("point {point}"), point, Style::Line, sweep.ordinates(k, outcome).to_vec())
            };
            outcomes.iter().enumerate().map(one).collect()
        } else {
            let at = |j: usize| {
                outcomes.iter().map(move |outcome| sweep.ordinates(k, outcome).get(j).copied().unwrap_or(f64::NAN))
            };
            let all = |of: &dyn Fn(usize) -> f64| (0..curve.abscissas.len()).map(of).collect();
            vec![
                line("mean".into(), 0, Style::Line, all(&|j| mean(at(j)).map_or(f64::NAN, |(mean, _)| mean))),
                line("smallest".into(), 0, Style::Dashed, all(&|j| at(j).fold(f64::NAN, f64::min))),
                line("largest".into(), 0, Style::Dashed, all(&|j| at(j).fold(f64::NAN, f64::max))),
            ]
        };
        let chart = Chart {
            id: format!("curve-{k}"),
            title: curve.name.clone(),
            x: Axis::new(&x_label),
            y: Axis::new(&y_label),
            series,
            legend: few && outcomes.len() > 1,
            ..Chart::default()
        };
        let _ = writeln!(html, "<div><h3>{}</h3>{}</div>", escape(&curve.name), chart.html());
    }
    html + "</div>\n"
}

/// A column that a study always has.
type Own = (&'static str, fn(&Outcome) -> f64);

/// A column of the table: its header and its value.
type Head = (String, Value);

fn table(sweep: &Sweep, outcomes: &[Outcome], shown: &[usize]) -> String {
    let rows = combinations(sweep, shown);
    let mut html = String::from("<h2>All points</h2>\n");
    if rows.len() > MOST_ROWS {
        let _ =
            writeln!(html, "<p>The first {MOST_ROWS} of {} rows; the result files contain all rows.</p>", rows.len());
    }
    html += "<div class=\"scroll\" tabindex=\"0\"><table>\n<tr>";
    for &axis in shown {
        let _ = write!(html, "<th>{}</th>", escape(&sweep.axes[axis].name));
    }
    let heads = heads(sweep);
    let points = ByValues::new(sweep, outcomes, shown);
    for (head, _) in &heads {
        let _ = write!(html, "<th class=\"number\">{}</th>", escape(head));
    }
    html += "</tr>\n";
    for values in rows.iter().take(MOST_ROWS) {
        html += "<tr>";
        for (&axis, &value) in shown.iter().zip(values) {
            let axis = &sweep.axes[axis];
            // Samples have many digits.
            let text = match axis.number(value).filter(|_| axis.sampled.is_some()) {
                Some(value) => number(value),
                None => axis.text(value),
            };
            let _ = write!(html, "<td>{}</td>", escape(&text));
        }
        for (k, (_, of)) in heads.iter().enumerate() {
            let cell = match mean(points.of(values).map(of)) {
                None => "–".to_owned(),
                Some((value, spread)) if (k < 2 || sweep.study != Study::Elastic) && spread > 0.0 => {
                    format!("{} ± {}", number(value), number(spread))
                }
                Some((value, _)) => number(value),
            };
            let _ = write!(html, "<td class=\"number\">{cell}</td>");
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n<p class=\"quiet\">Means and standard deviations over the averaged axes.</p>\n"
}

/// Columns of the table.
fn heads(sweep: &Sweep) -> Vec<Head> {
    let own = |heads: &[Own]| -> Vec<Head> {
        heads.iter().map(|&(head, of)| (head.to_owned(), Box::new(of) as Value)).collect()
    };
    if sweep.study == Study::Run {
        let head = |(k, quantity): (usize, Quantity)| -> Head {
            let (unit, scale) = shown(&quantity);
            (format!("{}{unit}", quantity.name), Box::new(move |o: &Outcome| o.values[k] * scale))
        };
        return sweep.quantities().into_iter().enumerate().map(head).collect();
    }
    if sweep.study == Study::Structure {
        return own(&[
            ("spheres", |o| o.get("spheres")),
            ("links inside", |o| o.get("links_per_sphere")),
            ("at the boundary", |o| o.get("links_at_boundary")),
            ("hull", |o| o.get("hull_fraction")),
            ("shape", |o| o.get("shape_fraction")),
            ("effective", |o| o.get("effective_fraction")),
            ("e, percent²", |o| o.get("isotropy_percent")),
            ("less the floor", |o| o.get("isotropy_percent") - o.get("isotropy_floor_percent")),
            ("of independent links", |o| o.get("isotropy_noise_percent")),
            ("overlap", |o| o.get("overlap")),
        ]);
    }
    own(&[
        ("E, GPa", |o| o.get("young") * 1e-9),
        ("ν", |o| o.get("poisson")),
        ("E / affine", |o| o.get("young") / o.get("affine_young")),
        ("closed / E", |o| o.get("closed_young") / o.get("young")),
        ("dynamics / E − 1", |o| o.get("dynamic_young") / o.get("young") - 1.0),
        ("ΔE/E", |o| o.get("anisotropy_young")),
        ("Δν", |o| o.get("anisotropy_poisson")),
        ("ΔG/G", |o| o.get("anisotropy_shear")),
        ("Δ/E", |o| o.get("anisotropy_coupling")),
        ("bonds per particle", |o| o.get("coordination")),
        ("rattlers", |o| o.get("rattlers")),
    ])
}
