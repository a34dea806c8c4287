//! Results of a run that a sweep records: properties of the specimen, and values of series and operators.

use concordem_scenario::assembly::{Placed, assemble_placed};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

use super::Sweep;
use super::outcome::{Outcome, Quantity};
use super::series::{Place, Rows, Series};
use crate::report::{RISES, properties_of_run};

/// Which number of a series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Of {
    Last,
    Maximum,
    Minimum,
    Mean,
}

/// Where a result comes from.
#[derive(Debug, Clone, PartialEq)]
enum Source {
    /// A property of the specimen, by its symbol.
    Property(String),
    /// A number of a series.
    Series(Of, Place),
}

/// A result that a sweep records.
#[derive(Debug, Clone, PartialEq)]
pub struct RunResult {
    /// Name as written, such as "f_t" or "max broken".
    pub name: String,
    /// SI unit.
    pub unit: String,
    source: Source,
}

/// Properties that runs may have, with their units.
pub const PROPERTIES: [(&str, &str); 10] = [
    ("E", "Pa"),
    ("E_gauge", "Pa"),
    ("f_t", "Pa"),
    ("f_c", "Pa"),
    ("strain_at_peak", "1"),
    ("f_fl", "Pa"),
    ("f_st", "Pa"),
    ("K_Ic", "Pa m^0.5"),
    ("G_F", "N/m"),
    (RISES, "1"),
];

/// Results that a sweep records if it names none.
pub const DEFAULT: [&str; 6] = ["E", "f_t", "f_c", "strain_at_peak", RISES, "last broken"];

impl RunResult {
    /// The quantity of files and pages.
    pub(super) fn quantity(&self) -> Quantity {
        let description = match &self.source {
            Source::Property(symbol) if symbol == RISES => {
                "1 if the stress still rises at the end of the run, so that its largest value is no strength; else 0"
                    .to_owned()
            }
            Source::Property(symbol) => format!("{symbol} of the specimen"),
            Source::Series(..) => "Number of a series".to_owned(),
        };
        Quantity { name: self.name.clone().into(), unit: self.unit.clone().into(), description: description.into() }
    }

    /// The result with this name, in runs of this scenario.
    ///
    /// # Errors
    /// No run of the scenario has it; with the names that exist.
    pub fn find(name: &str, scenario: &Scenario) -> Result<Self, String> {
        let words = name.trim();
        let found = |unit: &str, source| Self { name: words.to_owned(), unit: unit.to_owned(), source };
        if let Some((symbol, unit)) = PROPERTIES.iter().find(|(symbol, _)| *symbol == words) {
            return Ok(found(unit, Source::Property((*symbol).to_owned())));
        }
        let (of, rest) = match words.split_once(' ') {
            Some(("max", rest)) => (Of::Maximum, rest),
            Some(("min", rest)) => (Of::Minimum, rest),
            Some(("mean", rest)) => (Of::Mean, rest),
            Some(("last", rest)) => (Of::Last, rest),
            _ => (Of::Last, words),
        };
        match Series::find(rest, scenario) {
            Ok(series) => Ok(found(&series.unit, Source::Series(of, series.place))),
            Err(known) => {
                let properties = PROPERTIES.map(|(symbol, _)| symbol.to_owned());
                let all: Vec<String> = properties.into_iter().chain(known).collect();
                Err(format!(
                    "a run has no result `{words}`; there are {}, the series and operators also after max, min, mean, or last",
                    all.join(", ")
                ))
            }
        }
    }
}

/// Runs a scenario of the sweep to its end, in memory; `None` if `stopped` returns true before.
pub fn run(sweep: &Sweep, scenario: &Scenario, placed: &Placed, stopped: &dyn Fn() -> bool) -> Option<Outcome> {
    match try_run(sweep, scenario, placed, stopped) {
        Ok(outcome) => outcome,
        Err(problem) => Some(Outcome::failed(sweep.numbers(), problem)),
    }
}

/// Steps between two looks at the signals.
const LOOK: u64 = 64;

fn try_run(
    sweep: &Sweep,
    scenario: &Scenario,
    placed: &Placed,
    stopped: &dyn Fn() -> bool,
) -> Result<Option<Outcome>, String> {
    let assembly =
        assemble_placed(scenario, &scenario.directory(), placed, &mut |_, _| {}).map_err(|e| e.to_string())?;
    let length = assembly.summary.specimen.map(|(_, length)| length);
    let mut simulation =
        Simulation::new(assembly.state, assembly.model, assembly.schedule).map_err(|error| error.to_string())?;
    let mut rows = Rows { records: Vec::new(), operators: vec![Vec::new(); scenario.samples.len()] };
    while simulation.stopped().is_none() {
        if simulation.state.clock.step % LOOK == 0 && stopped() {
            return Ok(None);
        }
        let advance = simulation.advance().map_err(|error| error.to_string())?;
        let records = advance.sample.iter().chain(&advance.last);
        rows.records.extend(records.map(|record| (record.step as u64, record.to_row())));
        for row in advance.operators {
            rows.operators[row.operator].push((row.step, row.values));
        }
    }
    let column = |name: &str| -> Vec<f64> {
        let at = Record::COLUMNS.iter().position(|column| column.name == name);
        at.map_or_else(Vec::new, |at| rows.records.iter().map(|(_, record)| record[at]).collect())
    };
    let [strain, gauge, stress] = ["strain", "gauge_strain", "stress"].map(column);
    let rounding = simulation.schedule.rounding.after(simulation.state.clock.step);
    let properties = properties_of_run(scenario, [&strain, &gauge, &stress], length, rounding);
    let number = |result: &RunResult| match &result.source {
        Source::Property(symbol) => {
            properties.iter().find(|(name, _)| name == symbol).map_or(f64::NAN, |(_, value)| *value)
        }
        Source::Series(of, place) => of.number(&mut rows.of(*place).map(|(_, value)| value)),
    };
    let results = sweep.results.iter().map(number);
    let curves = sweep.curves.iter().flat_map(|curve| curve.ordinates(&rows));
    Ok(Some(Outcome { values: results.chain(curves).collect(), problem: None }))
}

impl Of {
    /// The number of a series; NaN if it is empty. Numbers that are not finite are left out, except the last one.
    fn number(self, values: &mut dyn Iterator<Item = f64>) -> f64 {
        if self == Self::Last {
            return values.last().unwrap_or(f64::NAN);
        }
        let values: Vec<f64> = values.filter(|value| value.is_finite()).collect();
        if values.is_empty() {
            return f64::NAN;
        }
        match self {
            Self::Maximum => values.iter().copied().fold(f64::NEG_INFINITY, f64::max),
            Self::Minimum => values.iter().copied().fold(f64::INFINITY, f64::min),
            Self::Mean | Self::Last => values.iter().sum::<f64>() / values.len() as f64,
        }
    }
}
