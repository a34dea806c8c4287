//! The page of a sweep: constants over each axis, and a table of the means.

use std::fmt::Write as _;

use plotly::Scatter;
use plotly::common::{DashType, Line, Marker, MarkerSymbol, Mode};
use plotly::layout::AxisType;

use super::{axis, escape, frame, number, plot_between};
use crate::sweep::Sweep;
use crate::sweep::point::Outcome;

/// Colours of the curves.
const COLOURS: [&str; 8] = ["#1f6fb4", "#c8501e", "#3f8f5a", "#7d57a8", "#b08a00", "#4a5560", "#0d8f8f", "#b03a6f"];
/// More curves than this are not told apart.
const MOST_CURVES: usize = 8;
/// A table longer than this is not read; the files have all.
const MOST_ROWS: usize = 400;

/// A curve of a figure: quantity, how it is drawn, what is written beside it.
struct Drawn {
    of: fn(&Outcome) -> f64,
    style: Style,
}

#[derive(Clone, Copy, PartialEq)]
enum Style {
    Main,
    Dashed,
    Dotted,
    Points,
}

struct Figure {
    title: &'static str,
    label: &'static str,
    curves: Vec<Drawn>,
}

fn figures() -> Vec<Figure> {
    use Style::{Dashed, Dotted, Main, Points};
    let drawn = |of, style| Drawn { of, style };
    let one = |title, label, of| Figure { title, label, curves: vec![drawn(of, Main)] };
    vec![
        Figure {
            title: "Young’s modulus",
            label: "E, GPa",
            curves: vec![
                drawn(|o| o.get("young") * 1e-9, Main),
                drawn(|o| o.get("affine_young") * 1e-9, Dotted),
                drawn(|o| o.get("closed_young") * 1e-9, Dashed),
                drawn(|o| o.get("dynamic_young") * 1e-9, Points),
            ],
        },
        Figure {
            title: "Poisson’s ratio",
            label: "ν",
            curves: vec![
                drawn(|o| o.get("poisson"), Main),
                drawn(|o| o.get("affine_poisson"), Dotted),
                drawn(|o| o.get("closed_poisson"), Dashed),
                drawn(|o| o.get("dynamic_poisson"), Points),
            ],
        },
        Figure {
            title: "Relaxation off the uniform field",
            label: "E / E of the affine sum",
            curves: vec![
                drawn(|o| o.get("young") / o.get("affine_young"), Main),
                drawn(|o| o.get("dynamic_young") / o.get("affine_young"), Points),
            ],
        },
        Figure {
            title: "Error of the closed form",
            label: "E of the closed form / E − 1",
            curves: vec![drawn(|o| o.get("closed_young") / o.get("young") - 1.0, Main)],
        },
        one("Anisotropy of E", "ΔE/E", |o| o.get("anisotropy_young")),
        one("Anisotropy of ν", "Δν", |o| o.get("anisotropy_poisson")),
        one("Relation of G to E and ν", "ΔG/G", |o| o.get("anisotropy_shear")),
        one("Entries that should vanish", "Δ/E", |o| o.get("anisotropy_coupling")),
    ]
}

/// The page as text.
pub fn page(sweep: &Sweep, outcomes: &[Outcome]) -> String {
    let name = sweep.source.name.rsplit('/').next().unwrap_or_default();
    let title = if sweep.title.is_empty() { name } else { &sweep.title };
    let bad = outcomes.iter().filter(|outcome| outcome.problem.is_some()).count();
    let mut body = format!(
        "<h1>{}</h1>\n<p class=\"quiet\">Sweep <code>{}</code>, {} points, computed by {}. Solid: static network; dotted: \
         affine sum; dashed: closed form; crosses: relaxed dynamics.</p>\n",
        escape(title),
        escape(name),
        outcomes.len(),
        super::super::provenance::PROGRAM
    );
    if bad > 0 {
        let _ = writeln!(
            body,
            "<details><summary>{bad} points have a problem</summary><pre>{}</pre></details>",
            escape(&super::super::sweep::problems(outcomes))
        );
    }
    let shown: Vec<usize> = (0..sweep.axes.len()).filter(|&k| !sweep.axes[k].average).collect();
    for &x in &shown {
        body += &over(sweep, outcomes, x, &shown);
    }
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

/// Points that have these values of the axes `of`, whatever those of the others are.
fn matching<'a>(
    sweep: &'a Sweep,
    outcomes: &'a [Outcome],
    of: &'a [usize],
    values: &'a [usize],
) -> impl Iterator<Item = &'a Outcome> {
    outcomes.iter().enumerate().filter_map(move |(point, outcome)| {
        let place = sweep.place(point);
        of.iter().zip(values).all(|(&axis, &value)| place[axis] == value).then_some(outcome)
    })
}

/// Mean and standard deviation of the finite ones.
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

/// All combinations of values of these axes, the last one fastest.
fn combinations(sweep: &Sweep, axes: &[usize]) -> Vec<Vec<usize>> {
    axes.iter().fold(vec![Vec::new()], |all, &axis| {
        let longer = |start: Vec<usize>| {
            (0..sweep.axes[axis].values.len()).map(move |value| start.iter().copied().chain([value]).collect())
        };
        all.into_iter().flat_map(longer).collect()
    })
}

/// Figures over one axis; none where it has no two numbers.
fn over(sweep: &Sweep, outcomes: &[Outcome], x: usize, shown: &[usize]) -> String {
    let along = &sweep.axes[x];
    let numbers: Option<Vec<f64>> = (0..along.values.len()).map(|k| along.number(k)).collect();
    let Some(numbers) = numbers.filter(|numbers| numbers.len() > 1) else { return String::new() };
    let (low, high) = numbers.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), &v| (l.min(v), h.max(v)));
    let logarithmic = low > 0.0 && high / low > 20.0;
    let others: Vec<usize> = shown.iter().copied().filter(|&k| k != x && sweep.axes[k].values.len() > 1).collect();
    let all = combinations(sweep, &others);
    let every = all.len().div_ceil(MOST_CURVES);
    let curves: Vec<&Vec<usize>> = all.iter().step_by(every).collect();
    let mut html = format!("<h2>Over {}</h2>\n", escape(&along.name));
    if every > 1 {
        let _ = writeln!(html, "<p class=\"quiet\">{} of {} curves are shown.</p>", curves.len(), all.len());
    }
    html += "<div class=\"pair\">\n";
    for (f, figure) in figures().iter().enumerate() {
        let mut traces = Vec::new();
        for (c, values) in curves.iter().enumerate() {
            let name = others
                .iter()
                .zip(*values)
                .map(|(&axis, &value)| format!("{} {}", sweep.axes[axis].name, sweep.axes[axis].text(value)))
                .collect::<Vec<_>>()
                .join(", ");
            let axes: Vec<usize> = others.iter().copied().chain([x]).collect();
            for drawn in &figure.curves {
                let mut points: Vec<(f64, f64)> = (0..numbers.len())
                    .filter_map(|k| {
                        let place: Vec<usize> = values.iter().copied().chain([k]).collect();
                        let found = mean(matching(sweep, outcomes, &axes, &place).map(drawn.of))?;
                        Some((numbers[k], found.0))
                    })
                    .collect();
                if points.is_empty() {
                    continue;
                }
                points.sort_by(|a, b| a.0.total_cmp(&b.0));
                let (xs, ys) = points.into_iter().unzip();
                let colour = COLOURS[c % COLOURS.len()];
                let line = Line::new().color(colour).width(if drawn.style == Style::Main { 2.0 } else { 1.2 });
                let (mode, line, symbol) = match drawn.style {
                    Style::Main => (Mode::LinesMarkers, line, MarkerSymbol::Circle),
                    Style::Dashed => (Mode::Lines, line.dash(DashType::Dash), MarkerSymbol::Circle),
                    Style::Dotted => (Mode::Lines, line.dash(DashType::Dot), MarkerSymbol::Circle),
                    Style::Points => (Mode::Markers, line, MarkerSymbol::Cross),
                };
                traces.push(
                    Scatter::new(xs, ys)
                        .mode(mode)
                        .name(if name.is_empty() { "all".to_owned() } else { escape(&name) })
                        .show_legend(drawn.style == Style::Main && curves.len() > 1)
                        .marker(Marker::new().color(colour).size(6).symbol(symbol))
                        .line(line),
                );
            }
        }
        if traces.is_empty() {
            continue;
        }
        let mut across = axis(&along.name);
        if logarithmic {
            across = across.type_(AxisType::Log);
        }
        let id = format!("over-{x}-{f}");
        let legend = curves.len() > 1;
        let _ = writeln!(
            html,
            "<div><h3>{}</h3>{}</div>",
            figure.title,
            plot_between(traces, across, axis(figure.label), &id, legend)
        );
    }
    html + "</div>\n"
}

/// A column of the table, and its figure.
type Head = (&'static str, fn(&Outcome) -> f64);

fn table(sweep: &Sweep, outcomes: &[Outcome], shown: &[usize]) -> String {
    let rows = combinations(sweep, shown);
    let mut html = String::from("<h2>All</h2>\n");
    if rows.len() > MOST_ROWS {
        let _ = writeln!(html, "<p>The first {MOST_ROWS} of {} rows; the files have all.</p>", rows.len());
    }
    html += "<div class=\"scroll\"><table>\n<tr>";
    for &axis in shown {
        let _ = write!(html, "<th>{}</th>", escape(&sweep.axes[axis].name));
    }
    let heads: [Head; 11] = [
        ("E, GPa", |o| o.get("young") * 1e-9),
        ("ν", |o| o.get("poisson")),
        ("E / affine", |o| o.get("young") / o.get("affine_young")),
        ("closed / E", |o| o.get("closed_young") / o.get("young")),
        ("dynamics / E − 1", |o| o.get("dynamic_young") / o.get("young") - 1.0),
        ("ΔE/E", |o| o.get("anisotropy_young")),
        ("Δν", |o| o.get("anisotropy_poisson")),
        ("ΔG/G", |o| o.get("anisotropy_shear")),
        ("Δ/E", |o| o.get("anisotropy_coupling")),
        ("bonds each", |o| o.get("coordination")),
        ("rattlers", |o| o.get("rattlers")),
    ];
    for (head, _) in heads {
        let _ = write!(html, "<th class=\"number\">{head}</th>");
    }
    html += "</tr>\n";
    for values in rows.iter().take(MOST_ROWS) {
        html += "<tr>";
        for (&axis, &value) in shown.iter().zip(values) {
            let _ = write!(html, "<td>{}</td>", escape(&sweep.axes[axis].text(value)));
        }
        for (k, (_, of)) in heads.into_iter().enumerate() {
            let cell = match mean(matching(sweep, outcomes, shown, values).map(of)) {
                None => "–".to_owned(),
                Some((value, spread)) if k < 2 && spread > 0.0 => format!("{} ± {}", number(value), number(spread)),
                Some((value, _)) => number(value),
            };
            let _ = write!(html, "<td class=\"number\">{cell}</td>");
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n<p class=\"quiet\">Means and standard deviations over the averaged axes.</p>\n"
}
