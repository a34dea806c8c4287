//! Merges the segments of a run into one result file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hdf5::Group;

use super::header::{EARLIER, OperatorTable, RunHeader};
use super::snapshot::{POSITION, SnapshotBatch, batches_of, bond_batches_of};
use super::stage;
use crate::output::error::{At, OutputError};
use crate::output::events::{read_events, write_events};
use crate::output::hdf::{self, GroupSink, kind};
use crate::output::stream::{FieldStream, StoredField};
use crate::output::vtk::{Cells, VtkWriter};
use crate::output::{checkpoint, sealed};
use concordem_solver::state::columns::{ColumnData, WriteColumns};

/// Parts of a result.
pub(super) struct Merge<'a> {
    pub path: &'a Path,
    pub scratch: &'a Path,
    pub header: &'a RunHeader,
    pub run_id: &'a str,
    pub notes: &'a BTreeMap<String, String>,
    pub segments: &'a [PathBuf],
}

impl Merge<'_> {
    pub fn write(&self, state: &dyn WriteColumns, tables: &dyn WriteColumns) -> Result<(), OutputError> {
        let path = self.path;
        sealed::write(path, self.scratch, |file| {
            hdf::write_identity(file, kind::RESULT, path)?;
            hdf::write_text_attribute(file, "run_id", self.run_id, path)?;
            self.write_provenance(file)?;
            let mut samples = Vec::new();
            let mut operators = vec![Vec::new(); self.header.operators.len()];
            let mut events = Vec::new();
            let mut snapshots: Option<VtkWriter<'_>> = None;
            let mut bonds: Option<BondWriter<'_>> = None;
            for segment_path in self.segments {
                let segment = sealed::open(segment_path)?;
                samples.extend(hdf::read_array::<f64>(&segment, "samples", segment_path)?);
                for (k, rows) in operators.iter_mut().enumerate() {
                    rows.extend(hdf::read_array::<f64>(&segment, &operator_rows(k), segment_path)?);
                }
                events.extend(read_events(&segment, segment_path)?);
                let (group, names) = batches_of(&segment, segment_path)?;
                for name in names {
                    let batch = SnapshotBatch::read(&group.group(&name).at(segment_path)?, segment_path)?;
                    let writer = match &mut snapshots {
                        Some(writer) => writer,
                        none => none.insert(VtkWriter::new(file, Cells::Vertices, "Centers of the particles.", path)?),
                    };
                    append_particles(writer, &batch, path)?;
                }
                for name in bond_batches_of(&segment, segment_path)? {
                    let batch = SnapshotBatch::read(&segment.group(&name).at(segment_path)?, segment_path)?;
                    let writer = match &mut bonds {
                        Some(writer) => writer,
                        none => none.insert(BondWriter::new(file, path)?),
                    };
                    writer.append(&batch)?;
                }
                stage("within merge");
            }
            self.write_samples(file, &samples)?;
            for (table, rows) in self.header.operators.iter().zip(&operators) {
                write_operator(file, table, rows, path)?;
            }
            write_events(file, &events, path)?;
            if let Some(writer) = snapshots {
                writer.finish()?;
            }
            if let Some(writer) = bonds {
                writer.finish()?;
            }
            let state_hash = checkpoint::write_state(file, state, path)?;
            hdf::write_text_attribute(file, "state_hash", &state_hash, path)?;
            let mut sink = GroupSink { group: file, path, allowed: &["cell", "contacts", "particles"], failure: None };
            let written = tables.write(&mut sink);
            sink.outcome(written)
        })
    }

    fn write_provenance(&self, file: &Group) -> Result<(), OutputError> {
        let group = file.create_group("provenance").at(self.path)?;
        hdf::write_text(&group, "scenario", &self.header.scenario, self.path)?;
        // Notes override entries of the header.
        let mut entries: BTreeMap<&str, &str> = BTreeMap::new();
        entries.extend(self.header.provenance.iter().map(|(name, value)| (&name[..], &value[..])));
        entries.extend(self.notes.iter().map(|(name, value)| (&name[..], &value[..])));
        entries.into_iter().try_for_each(|(name, value)| hdf::write_text_attribute(&group, name, value, self.path))
    }

    fn write_samples(&self, file: &Group, samples: &[f64]) -> Result<(), OutputError> {
        let group = file.create_group("samples").at(self.path)?;
        let width = self.header.series.len();
        for (k, series) in self.header.series.iter().enumerate() {
            let values: Vec<f64> = samples.iter().skip(k).step_by(width).copied().collect();
            let dataset = hdf::write_array(&group, &series.name, &values, 1, self.path)?;
            hdf::write_attribute(&dataset, "order", &(k as u64), self.path)?;
            hdf::describe(&dataset, &series.unit, &series.description, self.path)?;
        }
        self.write_earlier(file)
    }

    /// Writes the series of the run that this one continues.
    fn write_earlier(&self, file: &Group) -> Result<(), OutputError> {
        if self.header.earlier.is_empty() {
            return Ok(());
        }
        let group = file.create_group(EARLIER).at(self.path)?;
        for (name, values) in &self.header.earlier {
            let dataset = hdf::write_array(&group, name, values, 1, self.path)?;
            let series = self.header.series.iter().find(|series| series.name == *name);
            let (unit, description) = series.map_or(("1", ""), |series| (&series.unit, &series.description));
            hdf::describe(&dataset, unit, description, self.path)?;
        }
        Ok(())
    }
}

/// Name of the rows of an operator in a segment.
pub(super) fn operator_rows(k: usize) -> String {
    format!("operators-{k:03}")
}

/// Writes the rows of an operator as columns below `/samples/NAME`.
fn write_operator(file: &Group, table: &OperatorTable, rows: &[f64], path: &Path) -> Result<(), OutputError> {
    let group = file.group("samples").and_then(|samples| samples.create_group(&table.name)).at(path)?;
    hdf::write_text_attribute(&group, "description", &table.description, path)?;
    let rows: Vec<&[f64]> = rows.chunks_exact(table.width()).collect();
    let time: Vec<f64> = rows.iter().map(|row| row[0]).collect();
    let step: Vec<u64> = rows.iter().map(|row| row[1] as u64).collect();
    let dataset = hdf::write_array(&group, "time", &time, 1, path)?;
    hdf::describe(&dataset, "s", "Time", path)?;
    let dataset = hdf::write_array(&group, "step", &step, 1, path)?;
    hdf::describe(&dataset, "1", "Steps done", path)?;
    let mut from = 2;
    for (column, components) in &table.quantities {
        let values: Vec<f64> = rows.iter().flat_map(|row| row[from..from + components].iter().copied()).collect();
        let dataset = hdf::write_array(&group, &column.name, &values, *components, path)?;
        hdf::describe(&dataset, &column.unit, &column.description, path)?;
        from += components;
    }
    Ok(())
}

/// Appends snapshots of particles.
fn append_particles(writer: &mut VtkWriter<'_>, batch: &SnapshotBatch, path: &Path) -> Result<(), OutputError> {
    let position = batch.fields.iter().find(|field| field.name == POSITION);
    let Some(ColumnData::F64(position)) = position.map(|field| &field.column.data) else {
        let problem = "its snapshots have no positions".to_owned();
        return Err(OutputError::Damaged { path: path.to_owned(), problem });
    };
    let others: Vec<&StoredField> = batch.fields.iter().filter(|field| field.name != POSITION).collect();
    writer.append(&batch.time, &batch.step, position, &others)?;
    writer.append_cells(&batch.cells);
    Ok(())
}

/// Writes the bonds of all snapshots below `/bonds`: one dataset per field, and in `Steps` times, steps, numbers of bonds, and the offset
/// of every field.
struct BondWriter<'a> {
    path: &'a Path,
    steps: Group,
    fields: FieldStream<'a>,
    time: Vec<f64>,
    step: Vec<u64>,
    count: Vec<u64>,
    offsets: Vec<Vec<i64>>,
}

impl<'a> BondWriter<'a> {
    fn new(file: &Group, path: &'a Path) -> Result<Self, OutputError> {
        let group = file.create_group("bonds").at(path)?;
        let steps = group.create_group("Steps").at(path)?;
        let fields = FieldStream::new(group, path);
        let (time, step, count, offsets) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Ok(Self { path, steps, fields, time, step, count, offsets })
    }

    fn append(&mut self, batch: &SnapshotBatch) -> Result<(), OutputError> {
        let count = batch.time.len();
        let rows = batch.fields.first().map_or(0, |field| field.column.borrow().len() / field.column.components.max(1));
        let fields: Vec<&StoredField> = batch.fields.iter().collect();
        let offsets = self.fields.append(&fields, rows / count.max(1), count)?;
        self.offsets.resize(offsets.len(), Vec::new());
        for (all, new) in self.offsets.iter_mut().zip(offsets) {
            all.extend(new);
        }
        self.time.extend(&batch.time);
        self.step.extend(&batch.step);
        self.count.extend(std::iter::repeat_n((rows / count.max(1)) as u64, count));
        Ok(())
    }

    fn finish(self) -> Result<(), OutputError> {
        let (path, steps) = (self.path, &self.steps);
        self.fields.finish()?;
        let dataset = hdf::write_array(steps, "time", &self.time, 1, path)?;
        hdf::describe(&dataset, "s", "Times of the snapshots.", path)?;
        let dataset = hdf::write_array(steps, "step", &self.step, 1, path)?;
        hdf::describe(&dataset, "1", "Numbers of solver steps done.", path)?;
        let dataset = hdf::write_array(steps, "count", &self.count, 1, path)?;
        hdf::describe(&dataset, "1", "Numbers of bonds, with broken ones.", path)?;
        for (name, offsets) in self.fields.names().zip(&self.offsets) {
            let dataset = hdf::write_array(steps, &format!("offset_{name}"), offsets, 1, path)?;
            hdf::describe(&dataset, "1", "First row of each snapshot.", path)?;
        }
        Ok(())
    }
}
