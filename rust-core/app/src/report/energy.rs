//! Section of the report: the energy balance.

use std::fmt::Write as _;

use super::Run;
use super::chart::{Axis, Chart, Series, Style};
use super::html::{escape, number, percent};
use crate::output::{OutputError, ResultFile};

/// Color of the work.
const WORK_COLOR: &str = "#1f262d";

/// One term of the energy balance.
struct Term {
    name: &'static str,
    color: &'static str,
    series: &'static [&'static str],
}

/// The terms, in the order in which the chart stacks them.
const TERMS: [Term; 9] = [
    Term {
        name: "stored in bonds and contacts",
        color: "#7fb2de",
        series: &["stored_normal", "stored_shear", "stored_bending", "stored_twist"],
    },
    Term { name: "stored in deformable particles", color: "#4d86b8", series: &["stored_deformation"] },
    Term { name: "motion", color: "#bfdcc0", series: &["kinetic"] },
    Term { name: "damage and breaking", color: "#e2794a", series: &["damage"] },
    Term { name: "friction and plastic slip", color: "#f0bf7a", series: &["friction"] },
    Term { name: "dashpots", color: "#b7a3d4", series: &["viscous"] },
    Term { name: "artificial damping", color: "#c9ced4", series: &["numerical_damping"] },
    Term { name: "lag of the strains of deformable particles", color: "#8f9aa5", series: &["deformation_lag"] },
    Term { name: "forces without effect on the deformation", color: "#d9a3b3", series: &["deformation_other"] },
];

/// Series of the work done on the specimen.
const WORK: [&str; 4] = ["boundary_work", "external_work", "expansion_work", "stiffness_work"];

/// Sum of the given series that exist, sample by sample; `None` if none exists.
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

pub(super) fn section(runs: &[Run]) -> Result<String, OutputError> {
    let mut html = String::from("<h2>Energy balance</h2>\n<div class=\"pair\">\n");
    let mut shown = false;
    for (k, run) in runs.iter().enumerate() {
        if let Some(balance) = Balance::of(run)? {
            let name = escape(&run.label());
            let _ = write!(html, "<div><h3>{name}</h3>\n{}{}</div>\n", balance.chart(run, k)?, balance.table());
            shown = true;
        }
    }
    html += "</div>\n";
    if !shown {
        return Ok(String::new());
    }
    html += "<p class=\"quiet\">Each term is computed from its own formula (the stored energy of the laws, the damping \
             force, the force at the boundary), none as a remainder. The residual is therefore the error of the \
             calculation. Where the line of the work follows the top of the stack, the energy is balanced.";
    if runs.iter().any(|run| turns_back(&magnitudes(run))) {
        html += " Energies of a run whose strain turns back are shown over time.";
    }
    html += "</p>\n";
    Ok(html)
}

/// Magnitudes of the strain, ‰.
fn magnitudes(run: &Run) -> Vec<f64> {
    run.strain.iter().map(|strain| strain.abs() * 1e3).collect()
}

/// Share of the range by which an abscissa may fall below its maximum and still count as rising: one unit of the drawing, half a width of a line.
const TURN: f64 = 1.0 / 400.0;

/// Whether an abscissa turns back, so that areas over it would cover each other.
fn turns_back(along: &[f64]) -> bool {
    let finite = || along.iter().copied().filter(|x| x.is_finite());
    let range = finite().fold(f64::NEG_INFINITY, f64::max) - finite().fold(f64::INFINITY, f64::min);
    let mut farthest = f64::NEG_INFINITY;
    finite().any(|x| {
        farthest = farthest.max(x);
        farthest - x > TURN * range
    })
}

/// Energy balance of one run, in J.
struct Balance {
    terms: Vec<(&'static Term, Vec<f64>)>,
    work: Vec<f64>,
    /// Energy before the first step, which is not work but part of the terms.
    initial: f64,
    integration: Vec<f64>,
    residual: Option<Vec<f64>>,
    /// Largest magnitude of the work.
    largest: f64,
}

impl Balance {
    /// The balance of a run; `None` if the result has no energies.
    fn of(run: &Run) -> Result<Option<Self>, OutputError> {
        let Some(work) = sum_of(run.file, &WORK)? else { return Ok(None) };
        let mut terms = Vec::new();
        for term in &TERMS {
            if let Some(values) = sum_of(run.file, term.series)? {
                terms.push((term, values));
            }
        }
        let integration = sum_of(run.file, &["integration"])?.unwrap_or_else(|| vec![0.0; work.len()]);
        let residual = sum_of(run.file, &["residual"])?;
        let initial = if work.is_empty() {
            0.0
        } else {
            let sum = terms.iter().map(|(_, values)| values[0]).sum::<f64>() + integration[0];
            sum + residual.as_ref().map_or(0.0, |residual| residual[0]) - work[0]
        };
        let largest = work.iter().fold(0.0_f64, |largest, work| largest.max(work.abs()));
        // Heat alone has no work, and moves nothing.
        let is_still = largest == 0.0 && terms.iter().all(|(_, values)| values.iter().all(|value| *value == 0.0));
        Ok((!is_still).then_some(Self { terms, work, initial, integration, residual, largest }))
    }

    /// Terms with values other than zero.
    fn drawn(&self) -> impl Iterator<Item = &(&'static Term, Vec<f64>)> {
        self.terms.iter().filter(|(_, values)| values.iter().any(|value| *value != 0.0))
    }

    /// Unit of the chart and the table, and the factor from J.
    fn unit(&self) -> (&'static str, f64) {
        if self.largest >= 1.0 { ("J", 1.0) } else { ("mJ", 1e3) }
    }

    fn chart(&self, run: &Run, k: usize) -> Result<String, OutputError> {
        let (unit, scale) = self.unit();
        let strain = magnitudes(run);
        let stands = strain.iter().all(|strain| *strain == 0.0);
        let (along, label): (Vec<f64>, _) = if stands || turns_back(&strain) {
            (run.file.samples("time")?.iter().map(|time| time * 1e3).collect(), "time, ms".to_owned())
        } else {
            (strain, format!("{}, ‰ (magnitude)", run.meaning.strain()))
        };
        let points = |values: &[f64]| along.iter().zip(values).map(|(x, value)| (*x, value * scale)).collect();
        let mut series: Vec<Series> = self
            .drawn()
            .map(|(term, values)| Series {
                name: term.name.into(),
                color: term.color,
                style: Style::StackedArea,
                points: points(values),
                in_legend: false,
                marks_peak: false,
            })
            .collect();
        let work: Vec<f64> = self.work.iter().map(|work| work + self.initial).collect();
        series.push(Series {
            name: "work done on the specimen".into(),
            color: WORK_COLOR,
            style: Style::Dashed,
            points: points(&work),
            in_legend: false,
            marks_peak: false,
        });
        // The table beside the chart is its legend.
        let chart = Chart {
            id: format!("energy-{k}"),
            title: format!("Energy balance of {}", run.name),
            x: Axis::new(&label),
            y: Axis::new(&format!("energy, {unit}")),
            series,
            ..Chart::default()
        };
        Ok(chart.html())
    }

    fn table(&self) -> String {
        let (unit, scale) = self.unit();
        let mut table = format!(
            "<table>\n<tr><th>at the end</th><th class=\"number\">{unit}</th><th class=\"number\">share</th></tr>\n"
        );
        let last = |values: &[f64]| values.last().copied().unwrap_or(0.0);
        let total = last(&self.work) + self.initial;
        let mut row = |class: &str, key: &str, name: &str, value: f64| {
            let share = if total == 0.0 { String::new() } else { percent(value / total) };
            let _ = writeln!(
                table,
                "<tr{class}><td>{key}{name}</td><td class=\"number\">{}</td><td class=\"number\">{share}</td></tr>",
                number(value * scale)
            );
        };
        // From top to bottom, as in the stack. Terms that are zero throughout are not drawn.
        for (term, values) in self.drawn().collect::<Vec<_>>().into_iter().rev() {
            let key = format!("<span class=\"key\" style=\"background: {}\"></span>", term.color);
            row("", &key, term.name, last(values));
        }
        if self.integration.iter().any(|value| *value != 0.0) {
            row("", "<span class=\"key\"></span>", "integration error at kinks of the law", last(&self.integration));
        }
        let key = "<span class=\"key line\"></span>";
        let start = if self.initial == 0.0 { "" } else { ", with the energy at the start" };
        row(" class=\"sum\"", key, &format!("work done on the specimen{start}"), total);
        table + "</table>\n" + &self.residual_note()
    }

    /// The largest residual in words; empty if the result has none.
    fn residual_note(&self) -> String {
        let Some(residual) = &self.residual else { return String::new() };
        let (unit, scale) = self.unit();
        let most = residual.iter().fold(0.0_f64, |most, residual| most.max(residual.abs()));
        let relative = if self.largest > 0.0 {
            format!(", {} of the largest work", number(most / self.largest))
        } else if self.initial > 0.0 {
            format!(", {} of the energy at the start", number(most / self.initial))
        } else {
            String::new()
        };
        format!("<p>Residual of the balance: at most {} {unit}{relative}.</p>\n", number(most * scale))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_scenario::sampling::Record;

    /// Loading, unloading, and reloading turn back; steps in one direction and wiggles within a line do not.
    #[test]
    fn an_abscissa_that_turns_back_is_found() {
        assert!(turns_back(&[0.0, 1.0, 2.0, 1.5, 3.0]) && turns_back(&[3.0, 1.0]));
        assert!(!turns_back(&[0.0, 1.0, 1.0, 2.0, 3.0]) && !turns_back(&[]) && !turns_back(&[0.0, 1.0, 0.999, 2.0]));
        assert!(turns_back(&[0.0, 1.0, 0.994, 2.0]), "six thousandths of a range of two, more than five");
    }

    /// Series in joules that are no term of the balance of mechanical energy, but of heat.
    const OF_HEAT: [&str; 3] = ["heat_sources", "heat_boundary", "heat_dissipation"];

    /// Every energy of a result is drawn, is work, or is an error that the table names, so that the shares add up to 100 %.
    #[test]
    fn every_energy_of_a_result_is_in_the_balance() {
        let terms = TERMS.iter().flat_map(|term| term.series);
        let known: Vec<&str> = terms.chain(&WORK).copied().chain(["integration", "residual"]).collect();
        for column in Record::COLUMNS.iter().filter(|column| column.unit == "J") {
            let count = known.iter().filter(|name| **name == column.name).count();
            let expected = usize::from(!OF_HEAT.contains(&column.name) && column.name != "heat_residual");
            assert_eq!(count, expected, "{}", column.name);
        }
    }
}
