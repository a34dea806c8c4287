//! The report: one HTML page on one or more finished runs, complete in itself.
//!
//! Stress-strain curves, the figures of the specimen beside those of the literature, where bonds were damaged, where
//! the energy went, and where the numbers come from.

pub mod figures;
pub mod sweep;

use std::fmt::Write as _;
use std::path::Path;

use plotly::common::{DashType, Fill, Font, HoverInfo, Line, Marker, MarkerSymbol, Mode, Title};
use plotly::layout::{Axis, HoverMode, Legend, Margin};
use plotly::{Configuration, Layout, Plot, Scatter};

use super::error::OutputError;
use super::result::ResultFile;
use super::sealed;
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnData;
pub use figures::{CurveFigures, Given, ReferenceFigures, Sense};

const INK: &str = "#1f262d";
const GRID: &str = "#e7eaed";
/// Colours of the runs, told apart also by readers who confuse red and green.
const RUNS: [&str; 6] = ["#1f6fb4", "#c8501e", "#3f8f5a", "#7d57a8", "#b08a00", "#4a5560"];
/// More points than this make a page slow and the picture no clearer; the most damaged ones are shown.
const MOST_POINTS: usize = 60_000;
/// Damage from which on a bond is shown, and at which the scale of colours begins.
const SHOWN_DAMAGE: f64 = 0.5;
/// Damage at which the scale of colours ends.
const DARKEST_DAMAGE: f64 = 0.999;

/// What the report needs of one result.
struct Run<'a> {
    file: &'a ResultFile,
    name: String,
    title: String,
    strain: Vec<f64>,
    stress: Vec<f64>,
    figures: Option<CurveFigures>,
    colour: &'static str,
}

/// Write the page on `inputs` to `out`, replacing what is there.
pub fn write_report(inputs: &[ResultFile], out: &Path, reference: &ReferenceFigures) -> Result<(), OutputError> {
    sealed::write_text(out, &page(inputs, reference)?)
}

/// The page as text.
pub fn page(inputs: &[ResultFile], reference: &ReferenceFigures) -> Result<String, OutputError> {
    if inputs.is_empty() {
        return Err(OutputError::Report { problem: "no result file is given".into() });
    }
    let runs = inputs.iter().enumerate().map(|(k, file)| Run::new(file, k)).collect::<Result<Vec<_>, _>>()?;
    let body = [
        heading(&runs),
        figures_section(&runs, reference),
        curves_section(&runs, reference),
        cracks_section(&runs)?,
        energy_section(&runs)?,
        provenance_section(&runs)?,
    ]
    .concat();
    Ok(frame(&page_title(&runs), &body))
}

/// A whole page with what it needs to draw.
fn frame(title: &str, body: &str) -> String {
    let plotly = plotly_script();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>{}</title>\n\
         <style>\n{}</style>\n{plotly}\n<script>\n{}</script>\n</head>\n<body>\n{body}</body>\n</html>\n",
        escape(title),
        include_str!("style.css"),
        include_str!("cracks.js"),
    )
}

/// The script that draws plots. The first of the crate's sources is plotly; the second sets formulas, and we have none.
fn plotly_script() -> String {
    let sources = Plot::offline_js_sources();
    sources.split_inclusive("</script>").next().unwrap_or_default().to_owned()
}

impl<'a> Run<'a> {
    fn new(file: &'a ResultFile, k: usize) -> Result<Self, OutputError> {
        let strain = file.samples("strain")?;
        let stress = file.samples("stress")?;
        let name = file.path().file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
        let title = toml::from_str::<toml::Table>(&file.scenario()?)
            .ok()
            .and_then(|scenario| Some(scenario.get("title")?.as_str()?.to_owned()))
            .unwrap_or_default();
        let figures = if file.has_series("gauge_strain") {
            CurveFigures::with_gauge(&strain, &file.samples("gauge_strain")?, &stress)
        } else {
            CurveFigures::of(&strain, &stress)
        };
        Ok(Self { file, name, title, figures, strain, stress, colour: RUNS[k % RUNS.len()] })
    }

    /// The last value of a series; None when it is not there or empty.
    fn last(&self, series: &str) -> Result<Option<f64>, OutputError> {
        if self.file.has_series(series) { Ok(self.file.samples(series)?.last().copied()) } else { Ok(None) }
    }

    fn label(&self) -> String {
        if self.title.is_empty() { self.name.clone() } else { format!("{} ({})", self.title, self.name) }
    }
}

fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// A number with four significant digits, without needless zeros of a power.
fn number(value: f64) -> String {
    let size = value.abs();
    if value == 0.0 {
        "0".into()
    } else if !value.is_finite() {
        "not a number".into()
    } else if (1e-3..1e5).contains(&size) {
        let digits = (3 - size.log10().floor() as i32).max(0) as usize;
        format!("{value:.digits$}").replace('-', "−")
    } else {
        let text = format!("{value:.2e}");
        let (mantissa, power) = text.split_once('e').unwrap_or((&text, "0"));
        format!("{mantissa}·10<sup>{power}</sup>").replace('-', "−")
    }
}

fn page_title(runs: &[Run]) -> String {
    let mut titles: Vec<&str> = runs.iter().map(|run| run.title.as_str()).filter(|title| !title.is_empty()).collect();
    titles.dedup();
    if titles.is_empty() { "Discrete element runs".into() } else { titles.join(" · ") }
}

fn heading(runs: &[Run]) -> String {
    let files: Vec<String> = runs.iter().map(|run| format!("<code>{}</code>", escape(&run.name))).collect();
    format!(
        "<h1>{}</h1>\n<p class=\"quiet\">Results {}, computed by {}. Tension is positive.</p>\n",
        escape(&page_title(runs)),
        files.join(", "),
        super::provenance::PROGRAM,
    )
}

fn first_of<'r>(runs: &'r [Run], sense: Sense) -> Option<&'r CurveFigures> {
    runs.iter().filter_map(|run| run.figures.as_ref()).find(|figures| figures.sense == sense)
}

fn figures_section(runs: &[Run], reference: &ReferenceFigures) -> String {
    let rows = figures::rows(first_of(runs, Sense::Tension), first_of(runs, Sense::Compression), reference);
    if rows.is_empty() {
        return String::new();
    }
    let compared = rows.iter().any(|row| row.source.is_some());
    let mut html =
        String::from("<h2>Stiffness and strength</h2>\n<table>\n<tr><th></th><th></th><th class=\"number\">here</th>");
    if compared {
        html += "<th class=\"number\">source</th><th class=\"number\">difference</th>";
    }
    html += "</tr>\n";
    for row in rows {
        let unit = if row.unit.is_empty() { String::new() } else { format!(", {}", row.unit) };
        let shown = |value: f64| number(value * row.scale);
        let ours = row.ours.map_or("–".into(), shown);
        let _ = write!(
            html,
            "<tr><td class=\"symbol\">{}</td><td>{}{unit}</td><td class=\"number\">{ours}</td>",
            row.symbol, row.name
        );
        if compared {
            let source = row.source.map_or("–".into(), |given| {
                if given.low == given.high {
                    shown(given.low)
                } else {
                    format!("{} to {}", shown(given.low), shown(given.high))
                }
            });
            let difference = row.ours.zip(row.source).map_or("–".into(), |(ours, source)| {
                format!("{:+.1} %", 100.0 * (ours / source.middle() - 1.0)).replace('-', "−")
            });
            let _ = write!(html, "<td class=\"number\">{source}</td><td class=\"number\">{difference}</td>");
        }
        let _ = writeln!(html, "</tr>");
    }
    html +=
        "</table>\n<p class=\"quiet\">E is the slope of the straight line through the beginning of the curve, up to ";
    let _ = write!(html, "{:.0} % of the peak stress (least squares", 100.0 * figures::FITTED_SHARE);
    if let Some(curve) = first_of(runs, Sense::Tension).or(first_of(runs, Sense::Compression)) {
        let sense = if curve.sense == Sense::Tension { "tension" } else { "compression" };
        let _ = write!(html, ", {} samples, in {sense}", curve.fitted);
    }
    html += "). f<sub>t</sub> and f<sub>c</sub> are the largest stresses. \
             The layers that hold the ends are rigid: measured between them, E contains their stiffness.";
    if let Some((modulus, strain)) = reference.link_modulus.zip(reference.limit_strain) {
        let _ = write!(html, " Links: Ē = {} GPa, ε<sub>0</sub> = {} ‰.", number(modulus * 1e-9), number(strain * 1e3));
    }
    if compared {
        let _ = write!(html, " Source: {}. The packings are not the same.", escape(&reference.source));
    }
    html += "</p>\n";
    if runs.len() > 1 {
        html += "<table>\n<tr><th>run</th><th class=\"number\">E, GPa</th><th class=\"number\">peak stress, MPa</th>\
                 <th class=\"number\">strain at it, ‰</th></tr>\n";
        for run in runs {
            let cell = |value: Option<f64>| format!("<td class=\"number\">{}</td>", value.map_or("–".into(), number));
            let _ = writeln!(
                html,
                "<tr><td>{}</td>{}{}{}</tr>",
                escape(&run.label()),
                cell(run.figures.and_then(|figures| figures.modulus).map(|modulus| modulus * 1e-9)),
                cell(run.figures.map(|figures| figures.peak_stress * 1e-6)),
                cell(run.figures.map(|figures| figures.peak_strain * 1e3)),
            );
        }
        html += "</table>\n";
    }
    html
}

fn axis(title: &str) -> Axis {
    Axis::new()
        .title(Title::with_text(title))
        .grid_color(GRID)
        .zero_line_color("#b9c0c7")
        .line_color("#b9c0c7")
        .auto_margin(true)
}

// The plotting crate makes and takes boxes.
#[allow(clippy::vec_box)]
fn plot(traces: Vec<Box<Scatter<f64, f64>>>, x: &str, y: &str, id: &str, legend: bool) -> String {
    plot_between(traces, axis(x), axis(y), id, legend)
}

// The plotting crate makes and takes boxes.
#[allow(clippy::vec_box)]
fn plot_between(traces: Vec<Box<Scatter<f64, f64>>>, x: Axis, y: Axis, id: &str, legend: bool) -> String {
    let mut plot = Plot::new();
    for trace in traces {
        plot.add_trace(trace);
    }
    plot.set_layout(
        Layout::new()
            .x_axis(x)
            .y_axis(y)
            .margin(Margin::new().left(60).right(12).top(12).bottom(52))
            .font(Font::new().family("system-ui, DejaVu Sans, sans-serif").size(13).color(INK))
            .paper_background_color("#ffffff")
            .plot_background_color("#ffffff")
            .hover_mode(HoverMode::Closest)
            .legend(
                Legend::new()
                    .orientation(plotly::common::Orientation::Horizontal)
                    .x(0.0)
                    .y(1.02)
                    .y_anchor(plotly::common::Anchor::Bottom),
            )
            .show_legend(legend),
    );
    plot.set_configuration(
        Configuration::new()
            .responsive(true)
            .display_logo(false)
            .display_mode_bar(plotly::configuration::DisplayModeBar::False),
    );
    format!("<div class=\"plot\">{}</div>\n", plot.to_inline_html(Some(id)))
}

/// A stress-strain pair per sense of loading: the scales differ tenfold.
fn curves_section(runs: &[Run], reference: &ReferenceFigures) -> String {
    // Runs without a stress and a strain of their own have no curve.
    if runs.iter().all(|run| run.figures.is_none()) {
        return String::new();
    }
    let mut html = String::from("<h2>Stress and strain</h2>\n<div class=\"pair\">\n");
    for (sense, name) in [(Sense::Tension, "tension"), (Sense::Compression, "compression")] {
        let mut traces = Vec::new();
        for run in runs.iter().filter(|run| run.figures.is_some_and(|figures| figures.sense == sense)) {
            let strain = run.strain.iter().map(|strain| strain * 1e3).collect();
            let stress = run.stress.iter().map(|stress| stress * 1e-6).collect();
            traces.push(
                Scatter::new(strain, stress)
                    .mode(Mode::Lines)
                    .name(escape(&run.name))
                    .line(Line::new().color(run.colour).width(2.0)),
            );
        }
        if traces.is_empty() {
            continue;
        }
        let (given, sign) = match sense {
            Sense::Tension => (reference.tensile_strain.zip(reference.tensile_strength), 1.0),
            Sense::Compression => (reference.compressive_strain.zip(reference.compressive_strength), -1.0),
        };
        if let Some((strain, stress)) = given {
            traces.push(
                Scatter::new(vec![strain.middle() * 1e3], vec![sign * stress.middle() * 1e-6])
                    .mode(Mode::Markers)
                    .name("peak in the source")
                    .marker(
                        Marker::new()
                            .symbol(MarkerSymbol::DiamondOpen)
                            .size(11)
                            .color(INK)
                            .line(Line::new().width(2.0).color(INK)),
                    ),
            );
        }
        let _ = writeln!(
            html,
            "<div><h3>In {name}</h3>{}</div>",
            plot(traces, "strain, ‰", "stress, MPa", &format!("curve-{name}"), true)
        );
    }
    html + "</div>\n"
}

/// A point of the crack picture.
struct Spot {
    position: Vec3,
    damage: f64,
}

/// Places of damaged bonds with their damage at the end: from the tables of contacts where these have both, else from
/// the event log (the last event of each pair).
fn spots(file: &ResultFile) -> Result<Vec<Spot>, OutputError> {
    let mut spots = Vec::new();
    for law in file.laws()? {
        let table = file.table(&format!("contacts/{law}"))?;
        let column = |name: &str, components: usize| {
            table.iter().find(|(column, _)| column == name).and_then(|(_, column)| match &column.data {
                ColumnData::F64(data) if column.components == components => Some(data),
                _ => None,
            })
        };
        if let (Some(position), Some(damage)) = (column("position", 3), column("damage", 1)) {
            let rows = position.chunks_exact(3).zip(damage);
            spots.extend(
                rows.filter(|(_, damage)| **damage >= SHOWN_DAMAGE)
                    .map(|(position, &damage)| Spot { position: Vec3::from_column_slice(position), damage }),
            );
        }
    }
    if spots.is_empty() {
        let last: std::collections::BTreeMap<(u32, u32), Spot> = file
            .events()?
            .into_iter()
            .map(|event| ((event.id_a, event.id_b), Spot { position: event.position, damage: event.damage }))
            .collect();
        spots = last.into_values().collect();
    }
    spots.retain(|spot| spot.damage.is_finite() && spot.position.iter().all(|x| x.is_finite()));
    // A stable sort keeps pages of the same result the same.
    spots.sort_by(|a, b| b.damage.total_cmp(&a.damage));
    Ok(spots)
}

fn cracks_section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::from("<h2>Where bonds were damaged</h2>\n");
    for (k, run) in runs.iter().enumerate() {
        let mut spots = spots(run.file)?;
        let total = spots.len();
        spots.truncate(MOST_POINTS);
        let _ = writeln!(html, "<h3>{}</h3>", escape(&run.label()));
        if spots.is_empty() {
            html += "<p>No bond was damaged so far that it was logged.</p>\n";
            continue;
        }
        let broken = run.last("broken")?.map_or(String::new(), |broken| format!(" {broken:.0} bonds broke."));
        let shown = if total > spots.len() {
            format!("the {} most damaged of {total} bonds", spots.len())
        } else {
            format!("{total} bonds")
        };
        let _ = writeln!(html, "<p>Each point is a damaged bond: {shown}.{broken} Colour is damage:</p>\n{}", ramp());
        let _ = write!(
            html,
            "<div class=\"pair\">\n<div><canvas id=\"front-{k}\"></canvas><p class=\"quiet\">From the front.</p></div>\n\
             <div><canvas class=\"turns\" id=\"turn-{k}\"></canvas><p class=\"quiet\">Drag to turn.</p></div>\n</div>\n\
             <script>drawCracks(\"front-{k}\", \"turn-{k}\", {});</script>\n",
            points_as_json(run.file, &spots)?
        );
    }
    Ok(html)
}

/// Place of a damage on the scale of colours, 0 to 1: every tenth that is left of the remaining stiffness `1 − ω` is an
/// equal step, since in a crack damage comes close to 1 everywhere.
fn share_of_scale(damage: f64) -> f64 {
    let decades = |damage: f64| ((1.0 - SHOWN_DAMAGE) / (1.0 - damage)).log10();
    (decades(damage.clamp(SHOWN_DAMAGE, DARKEST_DAMAGE)) / decades(DARKEST_DAMAGE)).clamp(0.0, 1.0)
}

/// The scale of colours with its marks.
fn ramp() -> String {
    let mut html = String::from("<div class=\"ramp\">");
    for (damage, text) in [(SHOWN_DAMAGE, "0.5"), (0.9, "0.9"), (0.99, "0.99"), (DARKEST_DAMAGE, "0.999 to 1")] {
        let _ = write!(html, "<span style=\"left: {:.0}%\">{text}</span>", 100.0 * share_of_scale(damage));
    }
    html + "</div>"
}

/// The points in whole numbers: positions in 1/10000 of the longest edge of the box around the specimen.
fn points_as_json(file: &ResultFile, spots: &[Spot]) -> Result<String, OutputError> {
    let around = |bounds: Option<(Vec3, Vec3)>, point: Vec3| {
        Some(bounds.map_or((point, point), |(low, high)| (low.inf(&point), high.sup(&point))))
    };
    let bounds = spots.iter().map(|spot| spot.position).fold(file.bounds()?, around);
    let (corner, far) = bounds.unwrap_or_default();
    let longest = (far - corner).max();
    let unit = if longest > 0.0 { 10_000.0 / longest } else { 0.0 };
    let size = (far - corner) * unit;
    let mut json = format!("{{size: [{:.0}, {:.0}, {:.0}], points: [", size.x, size.y, size.z);
    for (k, spot) in spots.iter().enumerate() {
        let place = (spot.position - corner) * unit;
        let shade = 255.0 * share_of_scale(spot.damage);
        let separator = if k == 0 { "" } else { "," };
        let _ = write!(json, "{separator}{:.0},{:.0},{:.0},{shade:.0}", place.x, place.y, place.z);
    }
    Ok(json + "]}")
}

/// One entry of the energy ledger.
struct Term {
    name: &'static str,
    colour: &'static str,
    series: &'static [&'static str],
}

/// Where energy can be, in the order in which the picture stacks it.
const TERMS: [Term; 6] = [
    Term {
        name: "stored in bonds and contacts",
        colour: "#7fb2de",
        series: &["stored_normal", "stored_shear", "stored_bending", "stored_twist"],
    },
    Term { name: "motion", colour: "#bfdcc0", series: &["kinetic"] },
    Term { name: "damage and breaking", colour: "#e2794a", series: &["damage"] },
    Term { name: "friction and plastic slip", colour: "#f0bf7a", series: &["friction"] },
    Term { name: "dashpots", colour: "#b7a3d4", series: &["viscous"] },
    Term { name: "artificial damping", colour: "#c9ced4", series: &["numerical_damping"] },
];

/// Work put in: its series.
const WORK: [&str; 2] = ["boundary_work", "external_work"];

/// Sum of those of the series that exist, sample by sample; None when there is none of them.
fn sum_of(file: &ResultFile, series: &[&str]) -> Result<Option<Vec<f64>>, OutputError> {
    let mut sum: Option<Vec<f64>> = None;
    for name in series.iter().filter(|name| file.has_series(name)) {
        let values = file.samples(name)?;
        sum = Some(match sum {
            None => values,
            Some(sum) => sum.iter().zip(&values).map(|(a, b)| a + b).collect(),
        });
    }
    Ok(sum)
}

fn energy_section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::from("<h2>Where the energy went</h2>\n<div class=\"pair\">\n");
    let mut shown = false;
    for (k, run) in runs.iter().enumerate() {
        if let Some(ledger) = ledger_of_run(run, k)? {
            let _ = write!(html, "<div><h3>{}</h3>\n{ledger}</div>\n", escape(&run.label()));
            shown = true;
        }
    }
    html += "</div>\n";
    if shown {
        html += "<p class=\"quiet\">Each line is computed from its own formula (the laws’ stored energy, the damping force, \
                 the force at the boundary), none as a remainder; what does not add up is the error of the \
                 calculation. Where the line of the work runs along the top of the stack, nothing is missing.</p>\n";
        Ok(html)
    } else {
        Ok(String::new())
    }
}

/// Table and picture of one run's ledger; None when the result has none.
fn ledger_of_run(run: &Run, k: usize) -> Result<Option<String>, OutputError> {
    let Some(work) = sum_of(run.file, &WORK)? else { return Ok(None) };
    let mut terms = Vec::new();
    for term in &TERMS {
        if let Some(values) = sum_of(run.file, term.series)? {
            terms.push((term, values));
        }
    }
    let zeros = || vec![0.0; work.len()];
    let integration = sum_of(run.file, &["integration"])?.unwrap_or_else(zeros);
    let residual = sum_of(run.file, &["residual"])?;
    // Energy before the first step is no work but is found again in the terms.
    let found = |k: usize| terms.iter().map(|(_, values)| values[k]).sum::<f64>() + integration[k];
    let initial = if work.is_empty() { 0.0 } else { found(0) + residual.as_ref().map_or(0.0, |r| r[0]) - work[0] };
    let largest = work.iter().fold(0.0_f64, |largest, work| largest.max(work.abs()));
    let (unit, scale) = if largest >= 1.0 { ("J", 1.0) } else { ("mJ", 1e3) };

    let (along, label): (Vec<f64>, _) = if run.strain.iter().all(|strain| *strain == 0.0) {
        (run.file.samples("time")?.iter().map(|time| time * 1e3).collect(), "time, ms")
    } else {
        (run.strain.iter().map(|strain| strain.abs() * 1e3).collect(), "strain, ‰ (magnitude)")
    };
    let scaled = |values: &[f64]| values.iter().map(|value| value * scale).collect::<Vec<f64>>();
    let mut traces = Vec::new();
    for (term, values) in terms.iter().filter(|(_, values)| values.iter().any(|value| *value != 0.0)) {
        traces.push(
            Scatter::new(along.clone(), scaled(values))
                .mode(Mode::Lines)
                .name(term.name)
                .stack_group("energy")
                .fill(Fill::ToNextY)
                .fill_color(term.colour)
                .line(Line::new().color("#ffffff").width(0.6)),
        );
    }
    let put_in: Vec<f64> = work.iter().map(|work| work + initial).collect();
    traces.push(
        Scatter::new(along, scaled(&put_in))
            .mode(Mode::Lines)
            .name("work put in")
            .hover_info(HoverInfo::All)
            .line(Line::new().color(INK).width(1.6).dash(DashType::Dash)),
    );
    let picture = plot(traces, label, &format!("energy, {unit}"), &format!("energy-{k}"), false);

    let mut table = format!(
        "<table>\n<tr><th>at the end</th><th class=\"number\">{unit}</th><th class=\"number\">share</th></tr>\n"
    );
    let last = |values: &[f64]| values.last().copied().unwrap_or(0.0);
    let total = last(&work) + initial;
    let mut line = |class: &str, key: &str, name: &str, value: f64| {
        let share =
            if total == 0.0 { String::new() } else { format!("{:.1} %", 100.0 * value / total).replace('-', "−") };
        let _ = writeln!(
            table,
            "<tr{class}><td>{key}{name}</td><td class=\"number\">{}</td><td class=\"number\">{share}</td></tr>",
            number(value * scale)
        );
    };
    // From top to bottom as in the stack.
    for (term, values) in terms.iter().rev() {
        let key = format!("<span class=\"key\" style=\"background: {}\"></span>", term.colour);
        line("", &key, term.name, last(values));
    }
    if integration.iter().any(|value| *value != 0.0) {
        line("", "<span class=\"key\"></span>", "integration error at kinks of the law", last(&integration));
    }
    let key = "<span class=\"key line\"></span>";
    if initial == 0.0 {
        line(" class=\"sum\"", key, "work put in", total);
    } else {
        line(" class=\"sum\"", key, "work put in, with the energy at the start", total);
    }
    table += "</table>\n";
    if let Some(residual) = residual {
        let most = residual.iter().fold(0.0_f64, |most, residual| most.max(residual.abs()));
        let relative = if largest > 0.0 {
            format!(", {} of the largest work", number(most / largest))
        } else if initial > 0.0 {
            format!(", {} of the energy at the start", number(most / initial))
        } else {
            String::new()
        };
        let _ = writeln!(table, "<p>What does not add up: at most {} {unit}{relative}.</p>", number(most * scale));
    }
    Ok(Some(picture + &table))
}

fn provenance_section(runs: &[Run]) -> Result<String, OutputError> {
    let mut names: Vec<String> = vec!["state hash".into()];
    let mut columns = Vec::new();
    for run in runs {
        let mut entries = std::collections::BTreeMap::from([("state hash".to_owned(), run.file.state_hash()?)]);
        for (name, value) in run.file.provenance()? {
            let name = name.replace('_', " ");
            if !names.contains(&name) {
                names.push(name.clone());
            }
            entries.insert(name, value);
        }
        columns.push(entries);
    }
    let mut html = String::from("<h2>Where this comes from</h2>\n<div class=\"scroll\"><table>\n<tr><th></th>");
    for run in runs {
        let _ = write!(html, "<th>{}</th>", escape(&run.name));
    }
    html += "</tr>\n";
    for name in names {
        let values: Vec<&str> = columns.iter().map(|column| column.get(&name).map_or("–", String::as_str)).collect();
        let _ = write!(html, "<tr><td>{}</td>", escape(&name));
        if values.len() > 1 && values.iter().all(|value| *value == values[0]) {
            let _ = write!(html, "<td class=\"value\" colspan=\"{}\">{}</td>", values.len(), escape(values[0]));
        } else {
            for value in values {
                let _ = write!(html, "<td class=\"value\">{}</td>", escape(value));
            }
        }
        html += "</tr>\n";
    }
    html += "</table></div>\n";
    for run in runs {
        let _ = writeln!(
            html,
            "<details><summary>Scenario of {}</summary><pre>{}</pre></details>",
            escape(&run.name),
            escape(&run.file.scenario()?)
        );
    }
    Ok(html)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::output::{RunFiles, RunHeader, SeriesColumn, Snapshot};
    use concordem_solver::fracture::Event;
    use concordem_solver::state::columns::{ColumnError, ColumnSink, WriteColumns};

    struct Nothing;
    impl WriteColumns for Nothing {
        fn write(&self, _: &mut dyn ColumnSink) -> Result<(), ColumnError> {
            Ok(())
        }
    }

    /// A made-up specimen: a curve with the given peak, an energy ledger that closes, and a slanted crack.
    fn synthetic(path: &Path, peak_stress: f64, peak_strain: f64, title: &str) -> ResultFile {
        const NAMES: [&str; 19] = [
            "time",
            "step",
            "strain",
            "stress",
            "kinetic",
            "stored_normal",
            "stored_shear",
            "stored_bending",
            "stored_twist",
            "damage",
            "friction",
            "viscous",
            "integration",
            "numerical_damping",
            "boundary_work",
            "external_work",
            "residual",
            "broken",
            "damaged",
        ];
        let header = RunHeader {
            scenario: format!("title = \"{title}\"\n# a < b & c\n"),
            provenance: vec![("threads".into(), "2".into()), ("time_step".into(), "2.4787e-7 s".into())],
            series: NAMES.map(|name| SeriesColumn::new(name, "1", "")).to_vec(),
            operators: vec![],
        };
        let mut files = RunFiles::create(path, header, false).unwrap();
        let modulus = 27e9 * peak_stress.signum();
        let volume = 1.25e-4;
        let (mut work, mut last) = (0.0, (0.0, 0.0));
        let mut random = 12345_u64;
        let mut uniform = || {
            random = random.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (random >> 11) as f64 / (1_u64 << 53) as f64
        };
        let end = peak_strain * 2.6;
        for k in 0..=300 {
            let strain = end * f64::from(k) / 300.0;
            let x = strain / peak_strain;
            // Straight at first, rounded at the peak, softening after it.
            let initial = modulus * peak_strain.abs() / peak_stress;
            let stress = peak_stress * (initial * x) / (1.0 + (initial - 2.0) * x + x * x).max(initial * x * 0.2);
            work += 0.5 * (stress + last.1) * (strain - last.0) * volume;
            last = (strain, stress);
            let stored = (0.5 * stress * stress / 27e9 * volume).min(work);
            let lost = work - stored;
            let row = [
                strain / 0.4,
                f64::from(k),
                strain,
                stress,
                0.02 * lost,
                0.8 * stored,
                0.2 * stored,
                0.0,
                0.0,
                0.6 * lost,
                0.3 * lost,
                0.0,
                1e-9 * lost,
                0.08 * lost,
                work,
                0.0,
                1e-12 * work,
                f64::from(k),
                0.0,
            ];
            files.append_sample(&row).unwrap();
        }
        for k in 0..4000 {
            let (x, y) = (uniform() * 0.05, uniform() * 0.05);
            let z = 0.02 + 0.3 * x + 0.006 * (uniform() - 0.5) * (1.0 + 4.0 * uniform());
            files.append_event(Event {
                time: 0.0,
                step: k,
                id_a: k as u32,
                id_b: k as u32 + 1,
                position: Vec3::new(x, y, z),
                mode_shares: [1.0, 0.0, 0.0, 0.0],
                energy: 1e-6,
                damage: 0.9 + 0.1 * uniform(),
            });
        }
        let position = [Vec3::zeros(), Vec3::new(0.05, 0.05, 0.05)];
        let snapshot = Snapshot { time: 0.0, step: 0, id: &[0, 1], position: &position, fields: vec![] };
        files.append_snapshot(&snapshot).unwrap();
        files.note("wall_time", "71.2 s");
        files.finish(&Nothing, &Nothing).unwrap();
        ResultFile::open(path).unwrap()
    }

    #[test]
    fn page_holds_the_figures_and_nothing_from_elsewhere() {
        let folder = tempfile::tempdir().unwrap();
        let tension = synthetic(&folder.path().join("tension.h5"), 3.5e6, 1.6e-4, "Cube <in> tension");
        let compression = synthetic(&folder.path().join("compression.h5"), -32e6, -1.9e-3, "Cube in compression");
        let page = page(&[tension, compression], &ReferenceFigures::stransky_specimen_1()).unwrap();
        for expected in [
            "Cube &lt;in&gt; tension · Cube in compression",
            // f_t, f_c, and their ratio, here and in the source.
            "<td class=\"number\">3.500</td><td class=\"number\">3.475</td><td class=\"number\">+0.7 %</td>",
            "<td class=\"number\">32.00</td><td class=\"number\">32.50</td><td class=\"number\">−1.5 %</td>",
            "<td class=\"number\">9.143</td><td class=\"number\">9.350</td>",
            "E/Ē",
            ": 4000 bonds. 300 bonds broke.",
            "What does not add up: at most",
            "1.00·10<sup>−12</sup> of the largest work",
            "<td>threads</td><td class=\"value\" colspan=\"2\">2</td>",
            "<td>wall time</td>",
            "# a &lt; b &amp; c",
        ] {
            assert!(page.contains(expected), "no {expected}");
        }
        // Nothing is loaded from elsewhere: no sources, style sheets, or imports.
        let own = page.replace(&plotly_script(), "");
        assert!(own.len() < 1_000_000, "the script was not found in the page");
        for loading in ["src=\"", "<link", "@import"] {
            assert!(!own.contains(loading), "{loading}");
        }
        if let Ok(path) = std::env::var("CONCORDEM_TEST_REPORT") {
            std::fs::write(path, page).unwrap();
        }
    }

    #[test]
    fn a_result_without_a_specimen_is_no_error() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.h5");
        let series = ["strain", "stress"].map(|name| SeriesColumn::new(name, "1", "")).to_vec();
        let header = RunHeader { scenario: "not even TOML =".into(), provenance: vec![], series, operators: vec![] };
        RunFiles::create(&path, header, false).unwrap().finish(&Nothing, &Nothing).unwrap();
        let empty = page(&[ResultFile::open(&path).unwrap()], &ReferenceFigures::none(None, None)).unwrap();
        assert!(empty.contains("No bond was damaged") && !empty.contains("Where the energy went"));
        assert!(matches!(page(&[], &ReferenceFigures::default()), Err(OutputError::Report { .. })));
    }

    #[test]
    fn scale_of_damage() {
        assert_eq!(share_of_scale(0.2), 0.0, "below the scale");
        assert_eq!(share_of_scale(0.5), 0.0);
        assert_eq!(share_of_scale(1.0), 1.0, "no stiffness left");
        // Steps of ten in what is left: equal to the rounding of 1 - 0.99 and 1 - 0.999.
        let steps = [0.9, 0.99, 0.999].map(share_of_scale);
        assert!(((steps[2] - steps[1]) - (steps[1] - steps[0])).abs() < 1e-12, "{steps:?}");
    }

    #[test]
    fn numbers_have_four_digits() {
        for (value, text) in [
            (27.034_f64, "27.03"),
            (3.4749e-2, "0.03475"),
            (-1.859, "−1.859"),
            (12345.6, "12346"),
            (0.0, "0"),
            (1.5e-9, "1.50·10<sup>−9</sup>"),
            (f64::NAN, "not a number"),
        ] {
            assert_eq!(number(value), text);
        }
    }
}
