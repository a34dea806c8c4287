//! Results of a run that a sweep records: properties of the specimen, and values of series and operators.

use concordem_scenario::assembly::{Placed, assemble_placed};
use concordem_scenario::sampling::{Operator, Record};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::{OperatorSample, Scenario};

use super::outcome::{MOST_RESULTS, Outcome, Quantity};
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
    /// A series of the record, by its place.
    Series(Of, usize),
    /// A component of an operator: number of the `[[sample]]`, first number of the component in a row.
    Operator(Of, usize, usize),
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

const AXES: [&str; 3] = ["x", "y", "z"];

/// Names of the numbers of an operator's row, as in CSV tables, with their units; maps have none.
fn columns_of(sample: &OperatorSample) -> Vec<(String, String)> {
    if sample.grid.is_some() {
        return Vec::new();
    }
    let name = |quantity: &str, k: usize, components: usize| match components {
        3 => format!("{} {quantity}_{}", sample.name(), AXES[k]),
        9 => format!("{} {quantity}_{}{}", sample.name(), AXES[k / 3], AXES[k % 3]),
        _ => format!("{} {quantity}", sample.name()),
    };
    let operator: Operator = sample.operator;
    let quantities = operator.quantities().iter();
    quantities
        .flat_map(|q| (0..q.components).map(move |k| (q.name, k, q.components, q.unit)))
        .map(|(quantity, k, components, unit)| (name(quantity, k, components), unit.to_owned()))
        .collect()
}

impl RunResult {
    /// The quantity of files and pages.
    pub(super) fn quantity(&self) -> Quantity {
        let description = match &self.source {
            Source::Property(symbol) if symbol == RISES => {
                "1 if the stress still rises at the end of the run, so that its largest value is no strength; else 0"
                    .to_owned()
            }
            Source::Property(symbol) => format!("{symbol} of the specimen"),
            Source::Series(..) | Source::Operator(..) => "Number of a series".to_owned(),
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
        if let Some(at) = Record::COLUMNS.iter().position(|column| column.name == rest) {
            return Ok(found(Record::COLUMNS[at].unit, Source::Series(of, at)));
        }
        let mut known = Vec::new();
        for (k, sample) in scenario.samples.iter().enumerate() {
            let columns = columns_of(sample);
            if let Some(at) = columns.iter().position(|(name, _)| name == rest) {
                return Ok(found(&columns[at].1, Source::Operator(of, k, at)));
            }
            known.extend(columns.into_iter().map(|(name, _)| name));
        }
        let properties = PROPERTIES.map(|(symbol, _)| symbol.to_owned());
        let series = Record::COLUMNS.iter().map(|column| column.name.to_owned());
        let all: Vec<String> = properties.into_iter().chain(series).chain(known).collect();
        Err(format!(
            "a run has no result `{words}`; there are {}, the series and operators also after max, min, mean, or last",
            all.join(", ")
        ))
    }
}

/// Runs a scenario to its end, in memory; `None` if `stopped` returns true before.
pub fn run(scenario: &Scenario, placed: &Placed, results: &[RunResult], stopped: &dyn Fn() -> bool) -> Option<Outcome> {
    match try_run(scenario, placed, results, stopped) {
        Ok(outcome) => outcome,
        Err(problem) => Some(Outcome::failed(problem)),
    }
}

/// Steps between two looks at the signals.
const LOOK: u64 = 64;

fn try_run(
    scenario: &Scenario,
    placed: &Placed,
    results: &[RunResult],
    stopped: &dyn Fn() -> bool,
) -> Result<Option<Outcome>, String> {
    let assembly =
        assemble_placed(scenario, &scenario.directory(), placed, &mut |_, _| {}).map_err(|e| e.to_string())?;
    let length = assembly.summary.specimen.map(|(_, length)| length);
    let mut simulation =
        Simulation::new(assembly.state, assembly.model, assembly.schedule).map_err(|error| error.to_string())?;
    let mut records: Vec<Vec<f64>> = Vec::new();
    let mut rows: Vec<Vec<Vec<f64>>> = vec![Vec::new(); scenario.samples.len()];
    while simulation.stopped().is_none() {
        if simulation.state.clock.step % LOOK == 0 && stopped() {
            return Ok(None);
        }
        let advance = simulation.advance().map_err(|error| error.to_string())?;
        records.extend(advance.sample.iter().chain(&advance.last).map(Record::to_row));
        for row in advance.operators {
            rows[row.operator].push(row.values);
        }
    }
    let column = |name: &str| -> Vec<f64> {
        let at = Record::COLUMNS.iter().position(|column| column.name == name);
        at.map_or_else(Vec::new, |at| records.iter().map(|record| record[at]).collect())
    };
    let [strain, gauge, stress] = ["strain", "gauge_strain", "stress"].map(column);
    let rounding = simulation.schedule.rounding.after(simulation.state.clock.step);
    let properties = properties_of_run(scenario, [&strain, &gauge, &stress], length, rounding);
    let mut outcome = Outcome::default();
    for (k, result) in results.iter().take(MOST_RESULTS).enumerate() {
        outcome.values[k] = match &result.source {
            Source::Property(symbol) => {
                properties.iter().find(|(name, _)| name == symbol).map_or(f64::NAN, |(_, value)| *value)
            }
            Source::Series(of, at) => of.number(&mut records.iter().map(|record| record[*at])),
            Source::Operator(of, sample, at) => of.number(&mut rows[*sample].iter().map(|row| row[*at])),
        };
    }
    Ok(Some(outcome))
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
