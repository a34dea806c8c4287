//! What a simulation keeps besides its state, as columns of a checkpoint: its records, and what its laws in Python remember.

use std::collections::BTreeMap;

use concordem::assembly::restart::Change;
use concordem::fracture::Event;
use concordem::math::Vec3;
use concordem::output::{OutputError, ResultFile};
use concordem::program::recording::Moment;
use concordem::schedule::simulation::OperatorRow;
use concordem::schedule::{Record, Schedule};
use concordem::state::columns::{Column, ColumnData, ColumnError, ColumnSink, ColumnStore, WriteColumns};

/// Records of a simulation so far.
#[derive(Clone, Default)]
pub struct Records {
    /// The time series.
    pub samples: Vec<Record>,
    /// Rows of each operator.
    pub operators: Vec<Vec<OperatorRow>>,
    /// The event log.
    pub events: Vec<Event>,
    /// Snapshots.
    pub moments: Vec<Moment>,
    /// Calls of Python that have changed the run: the step before which each came first, and how often it came.
    pub given: BTreeMap<String, (u64, u64)>,
}

/// Numbers of an event in a row.
const EVENT: usize = 15;

impl Records {
    /// No records of this schedule.
    pub fn none(schedule: &Schedule) -> Self {
        Self { operators: vec![Vec::new(); schedule.operators.len()], ..Self::default() }
    }

    /// Those of a checkpoint. `operators`: whether the operators of the schedule are those of the checkpoint.
    pub fn read(kept: &ColumnStore, schedule: &Schedule, operators: bool) -> Result<Self, ColumnError> {
        let rows = |path: &str, wanted: usize| -> Result<Vec<Vec<f64>>, ColumnError> {
            let Some(column) = kept.get(path) else { return Ok(Vec::new()) };
            match &column.data {
                ColumnData::F64(reals) if column.components == wanted => {
                    Ok(reals.chunks_exact(wanted).map(<[f64]>::to_vec).collect())
                }
                _ => {
                    let (expected, found) = (wanted, column.components);
                    Err(ColumnError::Length { path: path.to_owned(), expected, found })
                }
            }
        };
        let mut records = Self::none(schedule);
        records.samples =
            rows("samples", Record::COLUMNS.len())?.iter().filter_map(|row| Record::of_row(row)).collect();
        records.events = rows("events", EVENT)?.iter().map(|row| event(row)).collect();
        records.moments = (0..).map_while(|k| Moment::read(&format!("snapshots/{k:06}"), kept)).collect();
        if let Some(ColumnData::U8(text)) = kept.get(CALLS).map(|column| &column.data) {
            records.given = String::from_utf8_lossy(text).lines().filter_map(call_of).collect();
        }
        if operators {
            for (k, sample) in schedule.operators.iter().enumerate() {
                let values: usize = sample.operator.quantities().iter().map(|q| q.components * sample.cells()).sum();
                let found = rows(&format!("operators/{k}"), 2 + values)?;
                let row = |row: &Vec<f64>| OperatorRow {
                    operator: k,
                    time: row[0],
                    step: row[1] as u64,
                    values: row[2..].to_vec(),
                };
                records.operators[k] = found.iter().map(row).collect();
            }
        }
        Ok(records)
    }

    /// Those of a result. `operators`: whether the operators of the schedule are those of the result.
    pub fn of_result(file: &ResultFile, schedule: &Schedule, operators: bool) -> Result<Self, OutputError> {
        let mut records = Self::none(schedule);
        let count = file.samples(Record::COLUMNS[0].name)?.len();
        let confined = file.has_series("lateral_stress");
        let columns = Record::columns(confined).iter().map(|column| file.samples(column.name));
        let mut columns = columns.collect::<Result<Vec<Vec<f64>>, _>>()?;
        columns.resize(Record::COLUMNS.len(), vec![0.0; count]);
        let count = columns.iter().map(Vec::len).min().unwrap_or_default();
        let row = |k: usize| Record::of_row(&columns.iter().map(|column| column[k]).collect::<Vec<f64>>());
        records.samples = (0..count).filter_map(row).collect();
        records.events = file.events()?;
        for (k, sample) in schedule.operators.iter().enumerate().filter(|_| operators) {
            let table = file.rows(&format!("samples/{}", sample.name))?;
            let column = |name: &str| {
                let found = table.iter().find(|(found, _)| found == name).map(|(_, column)| &column.data);
                match found {
                    Some(ColumnData::F64(reals)) => reals.clone(),
                    Some(ColumnData::U64(whole)) => whole.iter().map(|&number| number as f64).collect(),
                    _ => Vec::new(),
                }
            };
            let (times, steps) = (column("time"), column("step"));
            let quantities = sample.operator.quantities().iter();
            let parts: Vec<(usize, Vec<f64>)> =
                quantities.map(|q| (q.components * sample.cells(), column(q.name))).collect();
            let complete = parts.iter().all(|(width, part)| part.len() == width * times.len());
            if complete && steps.len() == times.len() {
                let values = |n: usize| parts.iter().flat_map(move |(width, part)| &part[n * width..(n + 1) * width]);
                let row = |n: usize| OperatorRow {
                    operator: k,
                    time: times[n],
                    step: steps[n] as u64,
                    values: values(n).copied().collect(),
                };
                records.operators[k] = (0..times.len()).map(row).collect();
            }
        }
        Ok(records)
    }

    /// Forget the rows of step `step` and later, which a run that goes on records again.
    pub fn before(&mut self, step: u64) {
        self.moments.retain(|moment| moment.step() < step);
        self.samples.retain(|record| record.step < step as f64);
        self.operators.iter_mut().for_each(|rows| rows.retain(|row| row.step < step));
    }
}

impl Records {
    /// Note that the scenario has changed.
    pub fn changed(&mut self, step: u64, changes: &[Change]) {
        for change in changes {
            self.given.entry(change.to_string().replace(['\n', '\t'], " ")).or_insert((step, 0)).1 += 1;
        }
    }

    /// The calls that have changed the run, on one line; `None` if there are none.
    pub fn calls(&self) -> Option<String> {
        let one = |(call, (step, count)): (&String, &(u64, u64))| match count {
            1 => format!("{call} before step {step}"),
            _ => format!("{call} {count} times from step {step}"),
        };
        (!self.given.is_empty()).then(|| self.given.iter().map(one).collect::<Vec<_>>().join("; "))
    }
}

/// Column of the calls that have changed the run.
const CALLS: &str = "calls";

/// A line of [`CALLS`].
fn call_of(line: &str) -> Option<(String, (u64, u64))> {
    let mut parts = line.split('\t');
    let (step, count) = (parts.next()?.parse().ok()?, parts.next()?.parse().ok()?);
    Some((parts.next()?.to_owned(), (step, count)))
}

/// The columns of a checkpoint besides the state.
pub struct Kept<'a> {
    /// Records so far.
    pub records: &'a Records,
    /// Names of the history of the laws in Python: of bonds, and of other contacts.
    pub histories: &'a [Option<String>; 2],
}

/// Columns of the names of histories, in the order of [`Kept::histories`].
pub const HISTORIES: [&str; 2] = ["history of bond_law", "history of contact_law"];

impl WriteColumns for Kept<'_> {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        let Records { samples, operators, events, moments, given } = self.records;
        let calls: Vec<String> =
            given.iter().map(|(call, (step, count))| format!("{step}\t{count}\t{call}\n")).collect();
        let calls = calls.concat();
        sink.column(CALLS, Column::u8(calls.as_bytes()))?;
        for (k, moment) in moments.iter().enumerate() {
            moment.write(&format!("snapshots/{k:06}"), sink)?;
        }
        let reals: Vec<f64> = samples.iter().flat_map(Record::to_row).collect();
        sink.column("samples", Column::f64(&reals, Record::COLUMNS.len(), "see samples"))?;
        for (k, rows) in operators.iter().enumerate() {
            // Without a row its length is not known, and nothing is lost.
            let Some(first) = rows.first() else { continue };
            let width = 2 + first.values.len();
            let mut reals = Vec::with_capacity(width * rows.len());
            for row in rows {
                reals.extend([row.time, row.step as f64]);
                reals.extend(&row.values);
            }
            sink.column(&format!("operators/{k}"), Column::f64(&reals, width, "see operator_samples"))?;
        }
        let reals: Vec<f64> = events.iter().flat_map(reals_of).collect();
        sink.column("events", Column::f64(&reals, EVENT, "see events"))?;
        for (name, history) in HISTORIES.into_iter().zip(self.histories) {
            if let Some(history) = history {
                sink.column(name, Column::u8(history.as_bytes()))?;
            }
        }
        Ok(())
    }
}

/// An event as a row; whole numbers are exact.
fn reals_of(event: &Event) -> [f64; EVENT] {
    let Event { time, step, id_a, id_b, position: x, mode_shares: m, in_shear, energy, damage, joint } = *event;
    let [step, a, b] = [step as f64, f64::from(id_a), f64::from(id_b)];
    let [in_shear, joint] = [f64::from(u8::from(in_shear)), joint.map_or(-1.0, f64::from)];
    [time, step, a, b, x.x, x.y, x.z, m[0], m[1], m[2], m[3], in_shear, energy, damage, joint]
}

/// The event of a row.
fn event(row: &[f64]) -> Event {
    Event {
        time: row[0],
        step: row[1] as u64,
        id_a: row[2] as u32,
        id_b: row[3] as u32,
        position: Vec3::new(row[4], row[5], row[6]),
        mode_shares: [row[7], row[8], row[9], row[10]],
        in_shear: row[11] != 0.0,
        energy: row[12],
        damage: row[13],
        joint: (row[14] >= 0.0).then_some(row[14] as u16),
    }
}
