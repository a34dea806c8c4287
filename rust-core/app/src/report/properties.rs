//! Section of the report: stiffness and strength, compared with published values.

use std::fmt::Write as _;

use super::Run;
use super::figures::{self, CurveFigures, Curves, Mean, RISING, ReferenceFigures, Row, Sense};
use super::html::{escape, number, percent};
use super::meaning::Meaning;

pub(super) fn section(runs: &[Run], reference: &ReferenceFigures) -> String {
    let columns = Column::all(runs, reference);
    let others = of_other_loadings(runs);
    if columns.is_empty() && others.is_empty() {
        return String::new();
    }
    let mut html = String::from("<h2>Stiffness and strength</h2>\n");
    if !columns.is_empty() {
        html += &(table(&columns) + &notes(&columns));
    }
    html += &others;
    html += &rising(runs);
    if runs.len() > 1 {
        html += &table_of_runs(runs);
    }
    html
}

/// The runs of one material with free sides: the stress of a beam, of a confined specimen, or of a split cylinder is no strength in tension
/// or compression.
struct Column<'r> {
    /// What the runs share.
    material: &'r str,
    runs: Vec<&'r Run<'r>>,
    curves: Curves,
    /// Published values and bond parameters of this material.
    reference: ReferenceFigures,
    rows: Vec<Row>,
}

impl<'r> Column<'r> {
    /// The columns in the order of their first runs. `reference` belongs to the material of the first run.
    fn all(runs: &'r [Run<'r>], reference: &ReferenceFigures) -> Vec<Self> {
        let mut columns: Vec<Self> = Vec::new();
        for run in runs.iter().filter(|run| run.meaning.is_uniaxial_stress()) {
            let Some(figures) = run.figures else { continue };
            let at = columns.iter().position(|column| column.material == run.material).unwrap_or_else(|| {
                let is_first = runs[0].material == run.material;
                let reference = if is_first { reference.clone() } else { run.bonds.clone() };
                let (runs, curves, rows) = (Vec::new(), Curves::default(), Vec::new());
                columns.push(Self { material: &run.material, runs, curves, reference, rows });
                columns.len() - 1
            });
            let column = &mut columns[at];
            column.runs.push(run);
            column.runs_of(figures.sense).push(figures);
        }
        for column in &mut columns {
            column.rows = figures::rows(&column.curves, &column.reference);
        }
        columns
    }

    fn runs_of(&mut self, sense: Sense) -> &mut Vec<CurveFigures> {
        match sense {
            Sense::Tension => &mut self.curves.tension,
            Sense::Compression => &mut self.curves.compression,
        }
    }

    /// Materials and files.
    fn name(&self) -> String {
        let files: Vec<String> = self.runs.iter().map(|run| escape(&run.name)).collect();
        format!("{}<br><span class=\"quiet\">{}</span>", escape(&self.runs[0].materials), files.join("<br>"))
    }
}

/// Slope and largest stress of the runs whose sides are not free, by the names that they have in this loading.
fn of_other_loadings(runs: &[Run]) -> String {
    let mut html = String::new();
    for run in runs.iter().filter(|run| !run.meaning.is_uniaxial_stress()) {
        let Some(figures) = run.figures else { continue };
        // Strengths of laboratory tests have a table for themselves; the strain at that of a notched beam or a split cylinder is none.
        let is_test = run.test.is_some_and(|test| !test.is_axial());
        if is_test && run.meaning.slope().is_none() {
            continue;
        }
        let slope = run.meaning.slope().zip(figures.modulus);
        let slope = slope.map(|((symbol, name), value)| (symbol, format!("{name}, GPa"), value * 1e-9));
        let (symbol, name) = run.meaning.largest(figures.sense == Sense::Tension);
        let note = if figures.rises { RISING } else { "" };
        let largest = (symbol, format!("{name}, MPa{note}"), figures.peak_stress * 1e-6);
        let strain = ("ε", format!("strain at the {name}, ‰"), figures.peak_strain * 1e3);
        for (symbol, name, value) in slope.into_iter().chain((!is_test).then_some(largest)).chain([strain]) {
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

/// The rows of all materials, side by side. Published values belong to the first column that has some.
fn table(columns: &[Column]) -> String {
    let published = columns.iter().find(|column| column.is_compared());
    let mut html = String::from("<div class=\"scroll\" tabindex=\"0\"><table>\n<tr><td></td><td></td>");
    for column in columns {
        let name = if columns.len() == 1 { "simulation".to_owned() } else { column.name() };
        let _ = write!(html, "<th class=\"number\">{name}</th>");
    }
    if let Some(column) = published {
        let of = if columns.len() == 1 { String::new() } else { format!(" for {}", escape(&column.runs[0].materials)) };
        let _ = write!(html, "<th class=\"number\">published{of}</th><th class=\"number\">difference</th>");
    }
    let sources = |at: usize| published.and_then(|column| column.rows[at].source);
    let rows = columns[0].rows.iter().enumerate();
    let shown: Vec<(usize, &Row)> =
        rows.filter(|(at, _)| columns.iter().any(|column| column.rows[*at].is_known())).collect();
    let scatters = shown.iter().any(|(at, _)| sources(*at).is_some_and(|given| given.scatter.is_some()));
    if scatters {
        html += "<th class=\"number\">scatter of packings</th>";
    }
    html += "</tr>\n";
    for (at, row) in shown {
        let unit = if row.unit.is_empty() { String::new() } else { format!(", {}", row.unit) };
        let note = if columns.iter().any(|column| column.rows[at].rises) { RISING } else { "" };
        let _ = write!(html, "<tr><td class=\"symbol\">{}</td><td>{}{unit}{note}</td>", row.symbol, row.name);
        for column in columns {
            let ours = column.rows[at].ours;
            let _ = write!(
                html,
                "<td class=\"number\">{}</td>",
                ours.map_or("–".into(), |mean| shown_mean(mean, row.scale))
            );
        }
        if let Some(column) = published {
            let shown = |value: f64| number(value * row.scale);
            let source = sources(at).map_or("–".into(), |given| {
                if given.low == given.high {
                    shown(given.low)
                } else {
                    format!("{} to {}", shown(given.low), shown(given.high))
                }
            });
            let difference = column.rows[at].ours.zip(sources(at)).map_or("–".into(), |(ours, source)| {
                let difference = percent(ours.value / source.middle() - 1.0);
                if difference.starts_with('−') { difference } else { format!("+{difference}") }
            });
            let _ = write!(html, "<td class=\"number\">{source}</td><td class=\"number\">{difference}</td>");
        }
        if scatters {
            let scatter = sources(at).and_then(|given| given.scatter);
            let scatter = scatter.map_or("–".into(), |scatter| format!("±{}", percent(scatter)));
            let _ = write!(html, "<td class=\"number\">{scatter}</td>");
        }
        html += "</tr>\n";
    }
    html + "</table></div>\n"
}

fn shown_mean(mean: Mean, scale: f64) -> String {
    let deviation = mean.deviation.map_or_else(String::new, |deviation| format!(" ± {}", number(deviation * scale)));
    number(mean.value * scale) + &deviation
}

impl Column<'_> {
    /// Whether there are published values for this material.
    fn is_compared(&self) -> bool {
        self.rows.iter().any(|row| row.source.is_some())
    }

    /// How E was fitted: the number of samples, if one run gives it, and the sense.
    fn fit(&self) -> Option<String> {
        let with_modulus = |curves: &[CurveFigures]| -> Vec<usize> {
            curves.iter().filter(|curve| curve.modulus.is_some()).map(|curve| curve.fitted).collect()
        };
        let pulled = with_modulus(&self.curves.tension);
        let (fitted, sense) = if pulled.is_empty() {
            (with_modulus(&self.curves.compression), "compression")
        } else {
            (pulled, "tension")
        };
        match fitted[..] {
            [] => None,
            [samples] => Some(format!("{samples} samples, in {sense}")),
            _ => Some(format!("in {sense}")),
        }
    }

    /// What the means of several runs of one kind are of.
    fn means(&self) -> Option<String> {
        let names = |sense: Sense| -> Vec<String> {
            let own = self.runs.iter().filter(|run| run.figures.is_some_and(|figures| figures.sense == sense));
            own.map(|run| escape(&run.name)).collect()
        };
        let of = |names: Vec<String>, what: &str| (names.len() > 1).then(|| format!("{what} of {}", names.join(", ")));
        let kinds = [(Sense::Tension, "in tension"), (Sense::Compression, "in compression")];
        let listed: Vec<String> = kinds.into_iter().filter_map(|(sense, what)| of(names(sense), what)).collect();
        (!listed.is_empty()).then(|| listed.join("; "))
    }
}

/// Definitions of the quantities, parameters of the bonds, and the source.
fn notes(columns: &[Column]) -> String {
    let mut html = format!(
        "<p class=\"quiet\">E is the slope of a straight line fitted to the beginning of the curve, up to {:.0} % of the \
         peak stress (least squares",
        100.0 * figures::FITTED_SHARE
    );
    if let ([_], Some(fit)) = (columns, columns[0].fit()) {
        let _ = write!(html, ", {fit}");
    }
    html += "). f<sub>t</sub> and f<sub>c</sub> are the stresses of largest magnitude in tension and compression.";
    let means: Vec<String> = columns.iter().filter_map(Column::means).collect();
    if !means.is_empty() {
        let _ = write!(
            html,
            " Of several runs of one kind the table has mean and standard deviation: {}.",
            means.join("; ")
        );
    }
    if columns.len() > 1 {
        html += " Each column is one material: the runs of its files have the same tables of materials, bonds, and particles.";
    }
    let has_layers = |column: &Column| column.runs.iter().any(|run| run.meaning == Meaning::Layers);
    if columns.iter().any(has_layers) {
        html += " The layers that hold the ends are rigid, and half of each counts in the length between the ends: E from the strain between \
                 the ends is too large by that. The strain of the middle half is free of it.";
    }
    for column in columns {
        let reference = &column.reference;
        if let Some((modulus, strain)) = reference.bond_modulus.zip(reference.crack_onset_strain) {
            let of =
                if columns.len() == 1 { String::new() } else { format!(" of {}", escape(&column.runs[0].materials)) };
            let (modulus, strain) = (number(modulus * 1e-9), number(strain * 1e3));
            let _ = write!(html, " Bonds{of}: Ē = {modulus} GPa, ε<sub>0</sub> = {strain} ‰.");
        }
    }
    if let Some(column) = columns.iter().find(|column| column.is_compared()) {
        let _ = write!(html, " Published values: {}, for other packings.", escape(&column.reference.source));
        if column.reference.modulus.is_some_and(|given| given.scatter.is_some()) {
            html += " Scatter: standard deviation between five packings made and tested in this way; a difference of up to twice \
                     the scatter is expected.";
        }
    }
    html + "</p>\n"
}

/// Names the runs whose largest stress is no strength.
fn rising(runs: &[Run]) -> String {
    let rise = |run: &&Run| run.figures.is_some_and(|figures| figures.rises);
    let names: Vec<String> = runs.iter().filter(rise).map(|run| escape(&run.name)).collect();
    if names.is_empty() {
        return String::new();
    }
    format!(
        "<p>The stress still rises at the end of {}: the largest stress so far is no strength. Run further.</p>\n",
        names.join(", ")
    )
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
            // That of a split cylinder is the approach of the plates.
            cell(run.figures.filter(|_| run.meaning != Meaning::Splitting).map(|figures| figures.peak_strain * 1e3)),
        );
    }
    html + "</table></div>\n"
}
