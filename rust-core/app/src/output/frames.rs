//! Snapshots of a result, read one at a time: particles, and bonds if the result has them.

use std::path::{Path, PathBuf};

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Dataset, Group, H5Type};
use ndarray::{Ix1, Ix2, s};

use super::error::{At, OutputError};
use super::hdf;
use super::stream::StoredField;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// A snapshot.
#[derive(Debug)]
pub(crate) struct Frame {
    pub time: f64,
    pub step: u64,
    /// Centers of the particles, m; empty for bonds.
    pub points: Vec<f64>,
    /// Edge vectors of the periodic cell, m, if particles are in one.
    pub cell: Option<[[f64; 3]; 3]>,
    pub fields: Vec<StoredField>,
}

impl Frame {
    /// The field with this name.
    pub fn field(&self, name: &str) -> Option<&ColumnData> {
        self.fields.iter().find(|field| field.name == name).map(|field| &field.column.data)
    }
}

/// The snapshots of a group.
pub(crate) struct Frames {
    path: PathBuf,
    /// Group of the fields.
    group: Group,
    points: Option<(Dataset, Vec<u64>)>,
    time: Vec<f64>,
    step: Vec<u64>,
    rows: Vec<u64>,
    /// Edge vectors of the cell in every snapshot; empty without a cell.
    cells: Vec<[[f64; 3]; 3]>,
    /// Name of every field, and its first row in every snapshot.
    fields: Vec<(String, Vec<u64>)>,
}

impl Frames {
    /// The particles of `/VTKHDF`.
    pub fn of_particles(file: &Group, path: &Path) -> Result<Self, OutputError> {
        let root = file.group("VTKHDF").at(path)?;
        let steps = root.group("Steps").at(path)?;
        let offsets = steps.group("PointDataOffsets").at(path)?;
        let parts = counts(&root, "NumberOfPoints", path)?;
        let rows = counts(&steps, "PartOffsets", path)?;
        let rows = rows.iter().map(|&part| parts.get(part as usize).copied().unwrap_or(0)).collect();
        let points = (root.dataset("Points").at(path)?, counts(&steps, "PointOffsets", path)?);
        let group = root.group("PointData").at(path)?;
        let fields = group.member_names().at(path)?.into_iter();
        let fields = fields.map(|name| Ok((name.clone(), counts(&offsets, &name, path)?))).collect::<Result<_, _>>()?;
        let (time, step) = (hdf::read_array(&steps, "Values", path)?, counts(&steps, "step", path)?);
        let edges: Vec<f64> =
            if steps.link_exists("cell") { hdf::read_array(&steps, "cell", path)? } else { Vec::new() };
        let (vectors, _) = edges.as_chunks::<3>();
        let cells = vectors.as_chunks::<3>().0.to_vec();
        Self { path: path.to_owned(), group, points: Some(points), time, step, rows, cells, fields }.checked()
    }

    /// The bonds of `/bonds`; `None` if the result has none.
    pub fn of_bonds(file: &Group, path: &Path) -> Result<Option<Self>, OutputError> {
        if !file.link_exists("bonds") {
            return Ok(None);
        }
        let group = file.group("bonds").at(path)?;
        let steps = group.group("Steps").at(path)?;
        let names = group.member_names().at(path)?.into_iter().filter(|name| name != "Steps");
        let fields = names
            .map(|name| {
                let offsets = counts(&steps, &format!("offset_{name}"), path)?;
                Ok((name, offsets))
            })
            .collect::<Result<_, _>>()?;
        let (time, step) = (hdf::read_array(&steps, "time", path)?, counts(&steps, "step", path)?);
        let rows = counts(&steps, "count", path)?;
        let cells = Vec::new();
        Self { path: path.to_owned(), group, points: None, time, step, rows, cells, fields }.checked().map(Some)
    }

    /// Refuses lists of different lengths.
    fn checked(self) -> Result<Self, OutputError> {
        let count = self.time.len();
        let mut lengths = vec![self.step.len(), self.rows.len()];
        lengths.extend(self.fields.iter().map(|(_, offsets)| offsets.len()));
        lengths.extend(self.points.iter().map(|(_, offsets)| offsets.len()));
        if !self.cells.is_empty() {
            lengths.push(self.cells.len());
        }
        if lengths.iter().any(|length| *length != count) {
            return Err(hdf::damaged(&self.path, "its snapshots have lists of different lengths".into()));
        }
        Ok(self)
    }

    /// Number of snapshots.
    pub fn len(&self) -> usize {
        self.time.len()
    }

    /// Index of the snapshot with this number of solver steps.
    pub fn at_step(&self, step: u64) -> Option<usize> {
        self.step.iter().position(|other| *other == step)
    }

    /// Solver steps of a snapshot.
    pub fn step(&self, k: usize) -> u64 {
        self.step[k]
    }

    /// Reads a snapshot.
    pub fn read(&self, k: usize) -> Result<Frame, OutputError> {
        let path = &self.path;
        let rows = self.rows[k] as usize;
        let points = match &self.points {
            Some((dataset, offsets)) => part::<f64>(dataset, offsets[k], rows, 3, path)?,
            None => Vec::new(),
        };
        let mut fields = Vec::new();
        for (name, offsets) in &self.fields {
            let dataset = self.group.dataset(name).at(path)?;
            let (unit, description) = hdf::read_description(&dataset, path)?;
            let column = column(&dataset, offsets[k], rows, path)?;
            fields.push(StoredField { name: name.clone(), unit, description, column });
        }
        Ok(Frame { time: self.time[k], step: self.step[k], points, cell: self.cells.get(k).copied(), fields })
    }
}

/// An array of counts or offsets, of any type.
fn counts(group: &Group, name: &str, path: &Path) -> Result<Vec<u64>, OutputError> {
    match hdf::read_column(group, name, path)?.data {
        ColumnData::U64(values) => Ok(values),
        _ => Err(hdf::damaged(path, format!("`{name}` does not hold whole numbers"))),
    }
}

/// Rows of a dataset.
pub(super) fn part<T: H5Type>(
    dataset: &Dataset,
    first: u64,
    rows: usize,
    components: usize,
    path: &Path,
) -> Result<Vec<T>, OutputError> {
    let first = first as usize;
    let shape = dataset.shape();
    let width = shape.get(1).copied().unwrap_or(1);
    if first.checked_add(rows).is_none_or(|end| shape.first().is_none_or(|&length| end > length)) || width != components
    {
        return Err(hdf::damaged(path, format!("`{}` is shorter than its snapshots", dataset.name())));
    }
    let end = first + rows;
    let values = if shape.len() == 1 {
        dataset.read_slice::<T, _, Ix1>(s![first..end]).at(path)?.into_raw_vec_and_offset().0
    } else {
        dataset.read_slice::<T, _, Ix2>(s![first..end, ..]).at(path)?.into_raw_vec_and_offset().0
    };
    Ok(values)
}

/// Rows of a dataset of any type.
pub(super) fn column(dataset: &Dataset, first: u64, rows: usize, path: &Path) -> Result<StoredColumn, OutputError> {
    let components = dataset.shape().get(1).copied().unwrap_or(1);
    let data = match dataset.dtype().and_then(|kind| kind.to_descriptor()).at(path)? {
        TypeDescriptor::Float(FloatSize::U8) => ColumnData::F64(part(dataset, first, rows, components, path)?),
        TypeDescriptor::Unsigned(IntSize::U8) => ColumnData::U64(part(dataset, first, rows, components, path)?),
        TypeDescriptor::Unsigned(IntSize::U4) => ColumnData::U32(part(dataset, first, rows, components, path)?),
        TypeDescriptor::Unsigned(IntSize::U2) => ColumnData::U16(part(dataset, first, rows, components, path)?),
        TypeDescriptor::Unsigned(IntSize::U1) => ColumnData::U8(part(dataset, first, rows, components, path)?),
        TypeDescriptor::Integer(IntSize::U1) => ColumnData::I8(part(dataset, first, rows, components, path)?),
        other => return Err(hdf::damaged(path, format!("`{}` holds {other}, an unsupported type", dataset.name()))),
    };
    Ok(StoredColumn { data, components })
}
