//! Series of runs: what a record holds, and components of operators.

use concordem_scenario::sampling::{Operator, Record};
use concordem_scenario::schema::{OperatorSample, Scenario};

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

/// A series of a run, or a component of an operator.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name.
    pub name: String,
    /// SI unit.
    pub unit: String,
    pub(super) place: Place,
}

/// Where the numbers of a series are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Place {
    /// A column of the record.
    Record(usize),
    /// A component of an operator: number of the `[[sample]]`, place of the component in a row.
    Operator(usize, usize),
}

impl Series {
    /// The series with this name, in runs of this scenario.
    ///
    /// # Errors
    /// No run of the scenario has it; the names that exist.
    pub(super) fn find(name: &str, scenario: &Scenario) -> Result<Self, Vec<String>> {
        let found = |unit: &str, place| Self { name: name.to_owned(), unit: unit.to_owned(), place };
        let columns = Record::columns(scenario.is_enclosed() || scenario.packing.is_periodic());
        if let Some(at) = columns.iter().position(|column| column.name == name) {
            return Ok(found(columns[at].unit, Place::Record(at)));
        }
        let mut known: Vec<String> = columns.iter().map(|column| column.name.to_owned()).collect();
        for (k, sample) in scenario.samples.iter().enumerate() {
            let columns = columns_of(sample);
            if let Some(at) = columns.iter().position(|(column, _)| column == name) {
                return Ok(found(&columns[at].1, Place::Operator(k, at)));
            }
            known.extend(columns.into_iter().map(|(name, _)| name));
        }
        Err(known)
    }
}

/// Numbers of a run, each row after its step.
pub(super) struct Rows {
    /// Records.
    pub records: Vec<(u64, Vec<f64>)>,
    /// Rows of each `[[sample]]`.
    pub operators: Vec<Vec<(u64, Vec<f64>)>>,
}

impl Rows {
    /// Steps and numbers of a series.
    pub(super) fn of(&self, place: Place) -> impl Iterator<Item = (u64, f64)> {
        let (rows, at) = match place {
            Place::Record(at) => (&self.records, at),
            Place::Operator(sample, at) => (&self.operators[sample], at),
        };
        rows.iter().map(move |(step, row)| (*step, row[at]))
    }

    /// Pairs of numbers of two series at the steps that both have.
    pub(super) fn pairs(&self, x: Place, y: Place) -> Vec<(f64, f64)> {
        let mut ordinates = self.of(y).peekable();
        let mut pairs = Vec::new();
        for (step, x) in self.of(x) {
            while ordinates.next_if(|(other, _)| *other < step).is_some() {}
            if let Some((_, y)) = ordinates.next_if(|(other, _)| *other == step) {
                pairs.push((x, y));
            }
        }
        pairs
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_of_different_intervals_meet_at_common_steps() {
        let rows = Rows {
            records: [0, 2, 4, 6].map(|step| (step, vec![step as f64])).to_vec(),
            operators: vec![[0, 3, 6].map(|step| (step, vec![0.0, 10.0 * step as f64])).to_vec()],
        };
        assert_eq!(rows.pairs(Place::Record(0), Place::Operator(0, 1)), [(0.0, 0.0), (6.0, 60.0)]);
        assert_eq!(rows.pairs(Place::Operator(0, 1), Place::Record(0)), [(0.0, 0.0), (60.0, 6.0)]);
        assert_eq!(rows.pairs(Place::Record(0), Place::Record(0)).len(), 4);
    }
}
