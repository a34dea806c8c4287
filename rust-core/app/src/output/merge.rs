//! Merges the segments of a run into one result file.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use hdf5::types::FixedAscii;
use hdf5::{Dataset, Group, H5Type};
use ndarray::{ArrayView1, ArrayView2, s};

use super::checkpoint;
use super::error::{At, OutputError};
use super::hdf::{self, GroupSink, kind};
use super::run_files::{OperatorTable, POSITION, RunHeader, SnapshotBatch, StoredField, batches_of, stage};
use super::sealed;
use concordem_contact::math::Vec3;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::{ColumnData, WriteColumns};

/// Parts of a result.
pub(super) struct Merge<'a> {
    pub path: &'a Path,
    pub scratch: &'a Path,
    pub header: &'a RunHeader,
    pub run_id: &'a str,
    pub state_hash: &'a str,
    pub notes: &'a BTreeMap<String, String>,
    pub segments: &'a [PathBuf],
}

impl Merge<'_> {
    pub fn write(&self, state: &dyn WriteColumns, tables: &dyn WriteColumns) -> Result<(), OutputError> {
        let path = self.path;
        sealed::write(path, self.scratch, |file| {
            hdf::write_identity(file, kind::RESULT, path)?;
            hdf::write_text_attribute(file, "run_id", self.run_id, path)?;
            hdf::write_text_attribute(file, "state_hash", self.state_hash, path)?;
            self.write_provenance(file)?;
            let mut samples = Vec::new();
            let mut operators = vec![Vec::new(); self.header.operators.len()];
            let mut events = Vec::new();
            let mut snapshots = None;
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
                    if snapshots.is_none() {
                        snapshots = Some(VtkWriter::new(file, path)?);
                    }
                    if let Some(writer) = &mut snapshots {
                        writer.append(&batch)?;
                    }
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
            checkpoint::write_state(file, state, path)?;
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

/// Writes the event log as columns below `/events`.
pub(super) fn write_events(file: &Group, events: &[Event], path: &Path) -> Result<(), OutputError> {
    fn column<T: H5Type>(
        group: &Group,
        (name, unit, components): (&str, &str, usize),
        values: impl Iterator<Item = T>,
        description: &str,
        path: &Path,
    ) -> Result<(), OutputError> {
        let values: Vec<T> = values.collect();
        let dataset = hdf::write_array(group, name, &values, components, path)?;
        hdf::describe(&dataset, unit, description, path)
    }
    let group = &file.create_group("events").at(path)?;
    let all = || events.iter();
    column(
        group,
        ("time", "s", 1),
        all().map(|e| e.time),
        "Time of the event, at the same instant of the step as the time of samples.",
        path,
    )?;
    column(group, ("step", "1", 1), all().map(|e| e.step), "Number of steps done before the event.", path)?;
    column(group, ("id_a", "1", 1), all().map(|e| e.id_a), "Stable id of particle A.", path)?;
    column(group, ("id_b", "1", 1), all().map(|e| e.id_b), "Stable id of particle B, or of the wall.", path)?;
    let position = all().flat_map(|e| e.position.iter().copied().collect::<Vec<f64>>());
    column(group, ("position", "m", 3), position, "Contact point.", path)?;
    let shares = all().flat_map(|e| e.mode_shares);
    let meaning = "Shares of normal, shear, bending, and twist deformation in the energy stored before the event.";
    column(group, ("mode_shares", "1", 4), shares, meaning, path)?;
    let meaning = "Energy dissipated by damage of the bond in this step, including what it still stored if it broke.";
    column(group, ("energy", "J", 1), all().map(|e| e.energy), meaning, path)?;
    let meaning = "Damage after the event: 0 intact, 1 without strength.";
    column(group, ("damage", "1", 1), all().map(|e| e.damage), meaning, path)
}

/// Reads the event log.
pub(super) fn read_events(file: &Group, path: &Path) -> Result<Vec<Event>, OutputError> {
    let group = &file.group("events").at(path)?;
    let time: Vec<f64> = hdf::read_array(group, "time", path)?;
    let step: Vec<u64> = hdf::read_array(group, "step", path)?;
    let id_a: Vec<u32> = hdf::read_array(group, "id_a", path)?;
    let id_b: Vec<u32> = hdf::read_array(group, "id_b", path)?;
    let position: Vec<f64> = hdf::read_array(group, "position", path)?;
    let shares: Vec<f64> = hdf::read_array(group, "mode_shares", path)?;
    let energy: Vec<f64> = hdf::read_array(group, "energy", path)?;
    let damage: Vec<f64> = hdf::read_array(group, "damage", path)?;
    let count = time.len();
    let lengths = [step.len(), id_a.len(), id_b.len(), energy.len(), damage.len()];
    if lengths.iter().any(|&n| n != count) || position.len() != 3 * count || shares.len() != 4 * count {
        let problem = "the columns of `events` have different lengths".to_owned();
        return Err(OutputError::Damaged { path: path.to_owned(), problem });
    }
    let event = |k: usize| Event {
        time: time[k],
        step: step[k],
        id_a: id_a[k],
        id_b: id_b[k],
        position: Vec3::from_column_slice(&position[3 * k..3 * k + 3]),
        mode_shares: [shares[4 * k], shares[4 * k + 1], shares[4 * k + 2], shares[4 * k + 3]],
        energy: energy[k],
        damage: damage[k],
    };
    Ok((0..count).map(event).collect())
}

/// Writes `/VTKHDF`: an unstructured grid of vertex cells, one per particle, with time steps.
///
/// Format: VTK, "VTKHDF file format", version 2.0. Arrays of all time steps follow each other in one dataset;
/// `Steps` holds the offset of each step. A field that is equal to that of the previous step is not written again; the
/// cells (vertex k at point k) are written once for each number of particles, as a VTK part.
struct VtkWriter<'a> {
    path: &'a Path,
    group: Group,
    steps: Vec<Step>,
    points: Appended,
    fields: Vec<(String, Appended)>,
}

struct Step {
    time: f64,
    count: u64,
    points: i64,
    point_offset: i64,
    field_offsets: Vec<i64>,
}

/// A growing dataset, and the bytes and the offset of the part appended last.
struct Appended {
    dataset: Dataset,
    rows: usize,
    last: Option<(Vec<u8>, i64)>,
}

impl<'a> VtkWriter<'a> {
    fn new(file: &Group, path: &'a Path) -> Result<Self, OutputError> {
        let group = file.create_group("VTKHDF").at(path)?;
        // Readers expect a string of fixed length.
        let kind = FixedAscii::<16>::from_ascii(b"UnstructuredGrid").unwrap_or_default();
        hdf::write_attribute(&group, "Type", &kind, path)?;
        let version = group.new_attr::<i64>().shape([2]).create("Version").at(path)?;
        version.write_raw(&[2_i64, 0]).at(path)?;
        let points = Appended::new::<f64>(&group, "Points", 3, 1 << 14, path)?;
        hdf::describe(&points.dataset, "m", "Centers of the particles.", path)?;
        group.create_group("PointData").at(path)?;
        Ok(Self { path, group, steps: Vec::new(), points, fields: Vec::new() })
    }

    fn append(&mut self, batch: &SnapshotBatch) -> Result<(), OutputError> {
        let path = self.path;
        let damaged = |problem: &str| OutputError::Damaged {
            path: path.to_owned(),
            problem: format!("snapshots from step {} on: {problem}", batch.step.first().copied().unwrap_or_default()),
        };
        let position = batch.fields.iter().find(|field| field.name == POSITION);
        let Some(ColumnData::F64(position)) = position.map(|field| &field.column.data) else {
            return Err(damaged("they have no positions"));
        };
        let count = batch.time.len();
        if count == 0 || batch.step.len() != count || position.len() % (3 * count) != 0 {
            return Err(damaged("their lengths differ"));
        }
        let rows = position.len() / (3 * count);
        let others: Vec<&StoredField> = batch.fields.iter().filter(|field| field.name != POSITION).collect();
        if self.steps.is_empty() {
            let data = self.group.group("PointData").at(path)?;
            for field in &others {
                let appended = Appended::of_kind(&data, field, rows.clamp(1 << 8, 1 << 16), path)?;
                hdf::describe(&appended.dataset, &field.unit, &field.description, path)?;
                self.fields.push((field.name.clone(), appended));
            }
        }
        if !others.iter().map(|field| &field.name).eq(self.fields.iter().map(|(name, _)| name)) {
            return Err(damaged("their fields are not those of the first one"));
        }
        let first_point = self.points.rows;
        self.points.append(position, 3, path)?;
        let mut offsets = Vec::new();
        for ((_, appended), field) in self.fields.iter_mut().zip(&others) {
            let components = field.column.components;
            if field.column.borrow().rows(&field.name).at(path)? != rows * count {
                return Err(damaged("their lengths differ"));
            }
            offsets.push(match &field.column.data {
                ColumnData::F64(data) => appended.append_changed(data, components, count, path),
                ColumnData::U64(data) => appended.append_changed(data, components, count, path),
                ColumnData::U32(data) => appended.append_changed(data, components, count, path),
                ColumnData::U16(data) => appended.append_changed(data, components, count, path),
                ColumnData::U8(data) => appended.append_changed(data, components, count, path),
                ColumnData::I8(data) => appended.append_changed(data, components, count, path),
            }?);
        }
        self.steps.extend((0..count).map(|k| Step {
            time: batch.time[k],
            count: batch.step[k],
            points: rows as i64,
            point_offset: (first_point + k * rows) as i64,
            field_offsets: offsets.iter().map(|offsets| offsets[k]).collect(),
        }));
        Ok(())
    }

    fn finish(self) -> Result<(), OutputError> {
        let (path, group) = (self.path, &self.group);
        let mut parts: Vec<i64> = Vec::new();
        for step in &self.steps {
            if !parts.contains(&step.points) {
                parts.push(step.points);
            }
        }
        let part = |step: &Step| parts.iter().position(|&count| count == step.points).unwrap_or_default();
        let cells_before = |step: &Step| parts[..part(step)].iter().sum::<i64>();
        for name in ["NumberOfPoints", "NumberOfCells", "NumberOfConnectivityIds"] {
            hdf::write_array(group, name, &parts, 1, path)?;
        }
        let connectivity: Vec<i64> = parts.iter().flat_map(|&count| 0..count).collect();
        hdf::write_array(group, "Connectivity", &connectivity, 1, path)?;
        let offsets: Vec<i64> = parts.iter().flat_map(|&count| 0..=count).collect();
        hdf::write_array(group, "Offsets", &offsets, 1, path)?;
        // Type 1 is a vertex.
        hdf::write_array(group, "Types", &vec![1_u8; connectivity.len()], 1, path)?;
        let steps = group.create_group("Steps").at(path)?;
        hdf::write_attribute(&steps, "NSteps", &(self.steps.len() as i64), path)?;
        let of_steps = |value: &dyn Fn(&Step) -> i64| -> Vec<i64> { self.steps.iter().map(value).collect() };
        let times: Vec<f64> = self.steps.iter().map(|step| step.time).collect();
        hdf::describe(&hdf::write_array(&steps, "Values", &times, 1, path)?, "s", "Times of the steps.", path)?;
        hdf::write_array(&steps, "PartOffsets", &of_steps(&|step| part(step) as i64), 1, path)?;
        hdf::write_array(&steps, "NumberOfParts", &of_steps(&|_| 1), 1, path)?;
        hdf::write_array(&steps, "PointOffsets", &of_steps(&|step| step.point_offset), 1, path)?;
        hdf::write_array(&steps, "CellOffsets", &of_steps(&cells_before), 1, path)?;
        hdf::write_array(&steps, "ConnectivityIdOffsets", &of_steps(&cells_before), 1, path)?;
        let offsets = steps.create_group("PointDataOffsets").at(path)?;
        for (k, (name, _)) in self.fields.iter().enumerate() {
            hdf::write_array(&offsets, name, &of_steps(&|step| step.field_offsets[k]), 1, path)?;
        }
        let counts: Vec<u64> = self.steps.iter().map(|step| step.count).collect();
        let dataset = hdf::write_array(&steps, "step", &counts, 1, path)?;
        hdf::describe(&dataset, "1", "Numbers of solver steps done.", path)
    }
}

impl Appended {
    fn new<T: H5Type>(
        group: &Group,
        name: &str,
        components: usize,
        chunk: usize,
        path: &Path,
    ) -> Result<Self, OutputError> {
        let builder = group.new_dataset::<T>().obj_track_times(false);
        let dataset = if components == 1 {
            builder.chunk([chunk]).shape((0..,)).create(name)
        } else {
            builder.chunk([chunk, components]).shape((0.., components)).create(name)
        };
        Ok(Self { dataset: dataset.at(path)?, rows: 0, last: None })
    }

    fn of_kind(group: &Group, field: &StoredField, chunk: usize, path: &Path) -> Result<Self, OutputError> {
        let (name, components) = (&field.name, field.column.components);
        match field.column.data {
            ColumnData::F64(_) => Self::new::<f64>(group, name, components, chunk, path),
            ColumnData::U64(_) => Self::new::<u64>(group, name, components, chunk, path),
            ColumnData::U32(_) => Self::new::<u32>(group, name, components, chunk, path),
            ColumnData::U16(_) => Self::new::<u16>(group, name, components, chunk, path),
            ColumnData::U8(_) => Self::new::<u8>(group, name, components, chunk, path),
            ColumnData::I8(_) => Self::new::<i8>(group, name, components, chunk, path),
        }
    }

    /// Appends those of `count` equally long parts whose bits differ from the part before; returns the offset of each part.
    fn append_changed<T: H5Type + bytemuck::Pod>(
        &mut self,
        data: &[T],
        components: usize,
        count: usize,
        path: &Path,
    ) -> Result<Vec<i64>, OutputError> {
        let length = data.len() / count;
        let (mut changed, mut offsets) = (Vec::new(), Vec::with_capacity(count));
        for k in 0..count {
            let part = &data[k * length..(k + 1) * length];
            // Bytes distinguish -0 from 0, and NaN equals itself.
            let bytes: &[u8] = bytemuck::cast_slice(part);
            let offset = match &self.last {
                Some((last, offset)) if last == bytes => *offset,
                _ => {
                    let offset = (self.rows + changed.len() / components) as i64;
                    changed.extend_from_slice(part);
                    self.last = Some((bytes.to_vec(), offset));
                    offset
                }
            };
            offsets.push(offset);
        }
        self.append(&changed, components, path)?;
        Ok(offsets)
    }

    fn append<T: H5Type>(&mut self, data: &[T], components: usize, path: &Path) -> Result<(), OutputError> {
        let (start, added) = (self.rows, data.len() / components);
        if added == 0 {
            return Ok(());
        }
        let end = start + added;
        if components == 1 {
            self.dataset.resize([end]).at(path)?;
            self.dataset.write_slice(ArrayView1::from(data), s![start..end]).at(path)?;
        } else {
            self.dataset.resize([end, components]).at(path)?;
            let view = ArrayView2::from_shape((added, components), data)
                .map_err(|error| OutputError::Hdf5 { path: path.to_owned(), message: error.to_string() })?;
            self.dataset.write_slice(view, s![start..end, ..]).at(path)?;
        }
        self.rows = end;
        Ok(())
    }
}
