//! Section of the report: cracks by mode, emissions over the load and by magnitude, sieve curve of the fragments.

use std::fmt::Write as _;

use super::Run;
use super::chart::{Axis, Chart, Series, Style};
use super::html::{escape, number, percent};
use crate::output::{OutputError, ParticlesAt};
use crate::signals::emission::{Rule, is_gradual, is_sheared, once_per_bond};
use crate::signals::fragments::{Fragments, Size, usual_size};
use concordem_operator::acoustic::load::cumulative;
use concordem_operator::acoustic::{BValue, Emission, b_value};
use concordem_operator::fragments::sieve::Fit;
use concordem_operator::strain::Dimension;
use concordem_scenario::schema::Scenario;
use concordem_solver::fracture::Event;

/// Color of a law.
const LAW: &str = "#c8501e";
/// Color of another law.
const OTHER_LAW: &str = "#3f8f5a";

/// Charts and a table of every run in which bonds broke; empty without such a run.
pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::new();
    for (k, run) in runs.iter().enumerate() {
        let events = run.file.events()?;
        if events.is_empty() {
            continue;
        }
        let scenario = Scenario::parse("scenario", &run.file.scenario()?).ok();
        let is_gradual = is_gradual(&events);
        let events = once_per_bond(&events);
        let mut rows = counts(&events);
        let charts = scenario.map_or_else(
            || Ok(String::new()),
            |scenario| {
                let emitted =
                    if is_gradual { String::new() } else { emissions(run, k, &scenario, &events, &mut rows)? };
                Ok(emitted + &fragments(run, k, &scenario, &mut rows)?)
            },
        );
        let charts = match charts {
            // A result that was made by hand has no particles.
            Err(OutputError::NoDataset { .. }) => String::new(),
            charts => charts?,
        };
        let _ = writeln!(html, "<h3>{}</h3>\n<table>", escape(&run.label()));
        for (name, value) in rows {
            let _ = writeln!(html, "<tr><td>{}</td><td class=\"number\">{}</td></tr>", escape(&name), escape(&value));
        }
        html += "</table>\n";
        if !charts.is_empty() {
            let _ = writeln!(html, "<div class=\"pair\">\n{charts}</div>");
        }
    }
    Ok(if html.is_empty() { html } else { format!("<h2>Cracks, emissions, and fragments</h2>\n{html}") })
}

/// Name and value in a table.
type Row = (String, String);

fn counts(events: &[Event]) -> Vec<Row> {
    let broken = || events.iter().filter(|event| event.damage >= 1.0);
    let sheared = broken().filter(|event| is_sheared(event)).count();
    let all = broken().count();
    let mut rows = vec![
        ("bonds broken in tension".to_owned(), (all - sheared).to_string()),
        ("bonds broken in shear".to_owned(), sheared.to_string()),
    ];
    if all < events.len() {
        rows.push(("events of damage in bonds that did not break".to_owned(), (events.len() - all).to_string()));
    }
    rows
}

/// Emissions so far over the strain, or over the time; and their numbers over the magnitude. Not of bonds that soften gradually: they release their
/// energy in many steps, so that an emission has no magnitude.
fn emissions(
    run: &Run,
    k: usize,
    scenario: &Scenario,
    events: &[Event],
    rows: &mut Vec<Row>,
) -> Result<String, OutputError> {
    let Some(rule) = Rule::of(run.file, scenario, None, None)? else { return Ok(String::new()) };
    let unreadable = |error| OutputError::Report { problem: format!("events of {}: {error}", run.name) };
    let found = rule.emissions(events).map_err(unreadable)?;
    rows.push(("acoustic emissions".to_owned(), found.len().to_string()));
    let magnitudes: Vec<f64> = found.iter().map(Emission::magnitude).filter(|m| m.is_finite()).collect();
    let law = b_value(&magnitudes, None).ok().flatten();
    let value = law.map_or_else(
        || "too few emissions".to_owned(),
        |law| format!("{:.2} ± {:.2} ({} emissions)", law.b, law.error, law.count),
    );
    rows.push(("b-value".to_owned(), value));
    let mut html = String::new();
    if run.file.has_series("time") {
        let time = run.file.samples("time")?;
        let pairs: Vec<[f64; 2]> = found.iter().map(|event| [event.time, event.energy]).collect();
        let sums = cumulative(&time, &pairs).map_err(unreadable)?;
        let is_strained = run.strain.iter().any(|strain| *strain != 0.0);
        let (along, label) = if is_strained { (&run.strain, "strain, ‰") } else { (&time, "time, ms") };
        let points = along.iter().zip(&sums).map(|(x, sum)| (x * 1e3, sum.count as f64)).collect();
        let chart = Chart {
            id: format!("emissions-{k}"),
            title: format!("Emissions of {}", run.name),
            x: Axis::new(label),
            y: Axis::new("emissions so far"),
            series: vec![line("emissions so far", run.color, Style::Line, points)],
            ..Chart::default()
        };
        let _ = writeln!(html, "<div><h3>Emissions</h3>{}</div>", chart.html());
    }
    if !magnitudes.is_empty() {
        let _ = writeln!(html, "<div><h3>Emissions by magnitude</h3>{}</div>", by_magnitude(run, k, magnitudes, law));
    }
    Ok(html)
}

/// Width of the classes of magnitude.
const CLASS: f64 = 0.1;

fn by_magnitude(run: &Run, k: usize, mut magnitudes: Vec<f64>, law: Option<BValue>) -> String {
    magnitudes.sort_by(f64::total_cmp);
    let count = magnitudes.len();
    let at_least = |magnitude: f64| (count - magnitudes.partition_point(|other| *other < magnitude)) as f64;
    let [first, last] = [0, count - 1].map(|at| (magnitudes[at] / CLASS).floor() as i64);
    let points = (first..=last).map(|class| (class as f64 * CLASS, at_least(class as f64 * CLASS))).collect();
    let mut series = vec![line("emissions", run.color, Style::LineAndDots, points)];
    if let Some(BValue { b, completeness, count: number, .. }) = law {
        // To the magnitude of which the law expects one emission.
        let end = completeness + (number as f64).log10() / b;
        let name = format!("b = {b:.2}");
        series.push(line(&name, LAW, Style::Dashed, vec![(completeness, number as f64), (end, 1.0)]));
    }
    let chart = Chart {
        id: format!("magnitudes-{k}"),
        title: format!("Emissions of {} by magnitude", run.name),
        x: Axis::new("magnitude"),
        y: Axis { label: "emissions of at least this magnitude".to_owned(), logarithmic: true },
        series,
        legend: true,
        ..Chart::default()
    };
    chart.html()
}

fn line(name: &str, color: &'static str, style: Style, points: Vec<(f64, f64)>) -> Series {
    Series { name: name.to_owned(), color, style, points, in_legend: true, marks_peak: false }
}

/// Points of a drawn law.
const LAW_POINTS: usize = 60;

/// The sieve curve with the laws that fit; empty while the specimen is whole.
fn fragments(run: &Run, k: usize, scenario: &Scenario, rows: &mut Vec<Row>) -> Result<String, OutputError> {
    let particles = ParticlesAt::read(run.file, None)?;
    let dimension = if scenario.dimension == 2 { Dimension::Two } else { Dimension::Three };
    let size = usual_size(dimension, particles.is_periodic);
    let found = Fragments::of(&particles, dimension, size)
        .map_err(|error| OutputError::Report { problem: format!("particles of {}: {error}", run.name) })?;
    let [largest, _, ..] = &found.fragments[..] else { return Ok(String::new()) };
    let (debris, dust) = found.debris();
    let total = found.mass();
    rows.push(("fragments".to_owned(), format!("{}, {debris} of them single particles", found.fragments.len())));
    rows.push(("mass of the largest fragment".to_owned(), percent(largest.mass / total)));
    rows.push(("mass of single particles".to_owned(), percent(dust / total)));
    let curve = &found.curve;
    // Steps: nothing lies between the sizes of two fragments.
    let before = std::iter::once(&0.0).chain(&curve.passing);
    let steps = curve.size.iter().zip(before.zip(&curve.passing));
    let points = steps.flat_map(|(x, (before, share))| [before, share].map(|share| (x * 1e3, share * 100.0))).collect();
    let mut series = vec![line("mass passing", run.color, Style::Line, points)];
    let ends = curve.size.first().zip(curve.size.last());
    let mut add = |name: &str, symbols: [&str; 2], color, fit: Option<Fit>, law: fn(f64, f64) -> f64| {
        let (Some(Fit { size, exponent, .. }), Some((&low, &high))) = (fit, ends) else { return };
        let [value, error] = [size.value, size.error].map(|size| number(size * 1e3));
        let text = format!(
            "{} = {value} ± {error} mm, {} = {} ± {}",
            symbols[0],
            symbols[1],
            number(exponent.value),
            number(exponent.error)
        );
        rows.push((name.to_owned(), text));
        let at = |point: usize| low * (high / low).powf(point as f64 / LAW_POINTS as f64);
        let share = |x: f64| 100.0 * law(x / size.value, exponent.value);
        let points = (0..=LAW_POINTS).map(|point| (at(point) * 1e3, share(at(point)))).collect();
        series.push(line(name, color, Style::Dashed, points));
    };
    add("Rosin–Rammler", ["x′", "n"], LAW, found.rosin_rammler, |x, n| 1.0 - (-x.powf(n)).exp());
    add("Gaudin–Schuhmann", ["k", "m"], OTHER_LAW, found.gaudin_schuhmann, |x, m| x.powf(m).min(1.0));
    let rule = match (size, dimension) {
        (Size::Sieve, _) => "intermediate axis",
        (Size::Sphere, Dimension::Three) => "diameter of the equal sphere",
        (Size::Sphere, Dimension::Two) => "diameter of the equal disc",
    };
    let chart = Chart {
        id: format!("sieve-{k}"),
        title: format!("Sieve curve of {}", run.name),
        x: Axis { label: format!("size ({rule}), mm"), logarithmic: true },
        y: Axis::new("mass passing, %"),
        legend: series.len() > 1,
        series,
        ..Chart::default()
    };
    Ok(format!("<div><h3>Sieve curve</h3>{}</div>\n", chart.html()))
}
