//! Section of the report: stiffness and strength, compared with published values.

use std::fmt::Write as _;

use super::Run;
use super::figures::{self, CurveFigures, ReferenceFigures, Row, Sense};
use super::html::{escape, number, percent};
use super::meaning::Meaning;

pub(super) fn section(runs: &[Run], reference: &ReferenceFigures) -> String {
    let rows = figures::rows(first_of(runs, Sense::Tension), first_of(runs, Sense::Compression), reference);
    let others = of_other_loadings(runs);
    if rows.is_empty() && others.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Stiffness and strength</h2>\n");
    if !rows.is_empty() {
        let compared = rows.iter().any(|row| row.source.is_some());
        html += &(table(&rows, compared) + &notes(runs, reference, compared));
    }
    html += &others;
    if runs.len() > 1 {
        html += &table_of_runs(runs);
    }
    html
}

/// The first run with free sides in this sense. The stress of a beam, of a confined specimen, or of a split cylinder is no strength in
/// tension or compression.
fn first_of<'r>(runs: &'r [Run], sense: Sense) -> Option<&'r CurveFigures> {
    let mut free = runs.iter().filter(|run| run.meaning.is_uniaxial_stress()).filter_map(|run| run.figures.as_ref());
    free.find(|figures| figures.sense == sense)
}

/// Slope and largest stress of the runs whose sides are not free, by the names that they have in this loading.
fn of_other_loadings(runs: &[Run]) -> String {
    let mut html = String::new();
    for run in runs.iter().filter(|run| !run.meaning.is_uniaxial_stress() && run.meaning.has_curve()) {
        let Some(figures) = run.figures else { continue };
        let slope = run.meaning.slope().zip(figures.modulus);
        let slope = slope.map(|((symbol, name), value)| (symbol, format!("{name}, GPa"), value * 1e-9));
        let (symbol, name) = run.meaning.largest(figures.sense == Sense::Tension);
        let largest = (symbol, format!("{name}, MPa"), figures.peak_stress * 1e-6);
        let strain = ("ε", "strain at this stress, ‰".to_owned(), figures.peak_strain * 1e3);
        for (symbol, name, value) in slope.into_iter().chain([largest, strain]) {
            let _ = writeln!(
                html,
                "<tr><td>{}</td><td class=\"symbol\">{symbol}</td><td>{name}</td><td class=\"number\">{}</td></tr>",
                escape(&run.label()),
                number(value)
            );
        }
    }
    if html.is_empty() {
        return html;
    }
    format!(
        "<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><th>run</th><th>symbol</th><th>meaning</th><th class=\"number\">value</th></tr>\n\
         {html}</table></div>\n<p class=\"quiet\">Slopes are those of a straight line fitted to the beginning of the curve, up to {:.0} % of the \
         largest stress.</p>\n",
        100.0 * figures::FITTED_SHARE
    )
}

fn table(rows: &[Row], compared: bool) -> String {
    let mut html = String::from(
        "<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><td></td><td></td><th class=\"number\">this work</th>",
    );
    if compared {
        html += "<th class=\"number\">published</th><th class=\"number\">difference</th>";
    }
    let scatters = rows.iter().any(|row| row.source.is_some_and(|given| given.scatter.is_some()));
    if scatters {
        html += "<th class=\"number\">scatter of packings</th>";
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
                let difference = percent(ours / source.middle() - 1.0);
                if difference.starts_with('−') { difference } else { format!("+{difference}") }
            });
            let _ = write!(html, "<td class=\"number\">{source}</td><td class=\"number\">{difference}</td>");
        }
        if scatters {
            let scatter = row.source.and_then(|given| given.scatter);
            let scatter = scatter.map_or("–".into(), |scatter| format!("±{}", percent(scatter)));
            let _ = write!(html, "<td class=\"number\">{scatter}</td>");
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n"
}

/// Definitions of the quantities, parameters of the bonds, and the source.
fn notes(runs: &[Run], reference: &ReferenceFigures, compared: bool) -> String {
    let mut html = format!(
        "<p class=\"quiet\">E is the slope of a straight line fitted to the beginning of the curve, up to {:.0} % of the \
         peak stress (least squares",
        100.0 * figures::FITTED_SHARE
    );
    if let Some(curve) = first_of(runs, Sense::Tension).or(first_of(runs, Sense::Compression)) {
        let sense = if curve.sense == Sense::Tension { "tension" } else { "compression" };
        let _ = write!(html, ", {} samples, in {sense}", curve.fitted);
    }
    html += "). f<sub>t</sub> and f<sub>c</sub> are the stresses of largest magnitude in tension and compression.";
    if runs.iter().any(|run| run.meaning == Meaning::Layers && run.figures.is_some()) {
        html += " The layers that hold the ends are rigid; E measured between the ends contains their stiffness.";
    }
    if let Some((modulus, strain)) = reference.link_modulus.zip(reference.crack_onset_strain) {
        let _ = write!(html, " Bonds: Ē = {} GPa, ε<sub>0</sub> = {} ‰.", number(modulus * 1e-9), number(strain * 1e3));
    }
    if compared {
        let _ = write!(html, " Published values: {}, for other packings.", escape(&reference.source));
        if reference.modulus.is_some_and(|given| given.scatter.is_some()) {
            html += " Scatter: standard deviation between five packings made and tested in this way; a difference of up to twice \
                     the scatter is expected.";
        }
    }
    html + "</p>\n"
}

fn table_of_runs(runs: &[Run]) -> String {
    let mut html = String::from(
        "<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><th>run</th><th>slope</th><th class=\"number\">GPa</th>\
         <th class=\"number\">peak stress, MPa</th><th class=\"number\">strain at the peak, ‰</th></tr>\n",
    );
    for run in runs {
        let cell = |value: Option<f64>| format!("<td class=\"number\">{}</td>", value.map_or("–".into(), number));
        let _ = writeln!(
            html,
            "<tr><td>{}</td><td class=\"symbol\">{}</td>{}{}{}</tr>",
            escape(&run.label()),
            run.meaning.slope().map_or("–", |(symbol, _)| symbol),
            cell(run.modulus().map(|modulus| modulus * 1e-9)),
            cell(run.figures.map(|figures| figures.peak_stress * 1e-6)),
            cell(run.figures.map(|figures| figures.peak_strain * 1e3)),
        );
    }
    html + "</table></div>\n"
}
