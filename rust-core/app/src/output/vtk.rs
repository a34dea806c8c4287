//! `/VTKHDF`: unstructured grids with time steps, which VTK and ParaView read.
//!
//! Format: VTK, "VTKHDF file format", version 2.0. Arrays of all time steps follow each other in one dataset; `Steps` holds the offset of
//! each step. A field that is equal to that of the previous step is not written again; the cells are written once for each number of
//! cells, as a VTK part.

use std::path::Path;

use hdf5::Group;
use hdf5::types::FixedAscii;

use super::error::{At, OutputError};
use super::hdf;
use super::stream::{Appended, FieldStream, StoredField};

/// Cells of a grid.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Cells {
    /// Cell k is a vertex at point k; the fields belong to the points.
    Vertices,
    /// Cell k is a line from point 2k to point 2k + 1; the fields belong to the lines.
    Lines,
}

impl Cells {
    /// Number of points of a cell.
    fn points(self) -> usize {
        match self {
            Self::Vertices => 1,
            Self::Lines => 2,
        }
    }

    /// Number of the type in VTK.
    fn kind(self) -> u8 {
        match self {
            Self::Vertices => 1,
            Self::Lines => 3,
        }
    }

    /// Group of the fields, and of their offsets.
    fn data(self) -> [&'static str; 2] {
        match self {
            Self::Vertices => ["PointData", "PointDataOffsets"],
            Self::Lines => ["CellData", "CellDataOffsets"],
        }
    }
}

/// Writes `/VTKHDF`.
pub(super) struct VtkWriter<'a> {
    path: &'a Path,
    group: Group,
    cells: Cells,
    steps: Vec<Step>,
    /// Edge vectors of the periodic cell, nine numbers per step; empty without a cell.
    edges: Vec<f64>,
    /// Meaning of the points.
    meaning: &'a str,
    /// From the first snapshot on, whose size that of their chunks follows.
    points: Option<Appended>,
    fields: FieldStream<'a>,
}

struct Step {
    time: f64,
    count: u64,
    cells: i64,
    point_offset: i64,
    field_offsets: Vec<i64>,
}

impl<'a> VtkWriter<'a> {
    /// A writer into the group `VTKHDF` of a file; `points`: meaning of the points.
    pub fn new(file: &Group, cells: Cells, points: &'a str, path: &'a Path) -> Result<Self, OutputError> {
        let group = file.create_group("VTKHDF").at(path)?;
        // Readers expect a string of fixed length.
        let kind = FixedAscii::<16>::from_ascii(b"UnstructuredGrid").unwrap_or_default();
        hdf::write_attribute(&group, "Type", &kind, path)?;
        let version = group.new_attr::<i64>().shape([2]).create("Version").at(path)?;
        version.write_raw(&[2_i64, 0]).at(path)?;
        let fields = FieldStream::new(group.create_group(cells.data()[0]).at(path)?, path);
        Ok(Self { path, group, cells, steps: Vec::new(), edges: Vec::new(), meaning: points, points: None, fields })
    }

    /// Begins the dataset of the points; `each`: points of a snapshot.
    fn begin_points(&self, each: usize) -> Result<Appended, OutputError> {
        let points = Appended::new::<f64>(&self.group, "Points", 3, each.clamp(1 << 8, 1 << 14), self.path)?;
        hdf::describe(&points.dataset, "m", self.meaning, self.path)?;
        Ok(points)
    }

    /// Appends snapshots with equal numbers of cells: times, steps, points (m), and fields of all snapshots, one after the other.
    pub fn append(
        &mut self,
        time: &[f64],
        step: &[u64],
        points: &[f64],
        fields: &[&StoredField],
    ) -> Result<(), OutputError> {
        let count = time.len();
        let width = 3 * self.cells.points() * count;
        if count == 0 || step.len() != count || !points.len().is_multiple_of(width) {
            let problem = "the lengths of its snapshots differ".to_owned();
            return Err(OutputError::Damaged { path: self.path.to_owned(), problem });
        }
        let rows = points.len() / width;
        let mut all = match self.points.take() {
            Some(all) => all,
            None => self.begin_points(rows * self.cells.points())?,
        };
        let first_point = all.rows;
        all.append(points, 3, self.path)?;
        self.points = Some(all);
        let offsets = self.fields.append(fields, rows, count)?;
        self.steps.extend((0..count).map(|k| Step {
            time: time[k],
            count: step[k],
            cells: rows as i64,
            point_offset: (first_point + k * rows * self.cells.points()) as i64,
            field_offsets: offsets.iter().map(|offsets| offsets[k]).collect(),
        }));
        Ok(())
    }

    /// Appends the edge vectors of the periodic cell, m, nine numbers for every snapshot appended before. Readers of VTK ignore them.
    pub fn append_cells(&mut self, edges: &[f64]) {
        self.edges.extend_from_slice(edges);
    }

    /// Writes cells and steps.
    pub fn finish(self) -> Result<(), OutputError> {
        let (path, group) = (self.path, &self.group);
        match &self.points {
            Some(points) => points.finish(path)?,
            None => self.begin_points(0)?.finish(path)?,
        }
        self.fields.finish()?;
        let each = self.cells.points() as i64;
        let mut parts: Vec<i64> = Vec::new();
        for step in &self.steps {
            if !parts.contains(&step.cells) {
                parts.push(step.cells);
            }
        }
        let part = |step: &Step| parts.iter().position(|&count| count == step.cells).unwrap_or_default();
        let cells_before = |step: &Step| parts[..part(step)].iter().sum::<i64>();
        let points: Vec<i64> = parts.iter().map(|count| each * count).collect();
        hdf::write_array(group, "NumberOfPoints", &points, 1, path)?;
        hdf::write_array(group, "NumberOfCells", &parts, 1, path)?;
        hdf::write_array(group, "NumberOfConnectivityIds", &points, 1, path)?;
        let connectivity: Vec<i64> = points.iter().flat_map(|&count| 0..count).collect();
        hdf::write_array(group, "Connectivity", &connectivity, 1, path)?;
        let offsets: Vec<i64> = parts.iter().flat_map(|&count| (0..=count).map(|k| each * k)).collect();
        hdf::write_array(group, "Offsets", &offsets, 1, path)?;
        let cells: usize = parts.iter().map(|&count| count as usize).sum();
        hdf::write_array(group, "Types", &vec![self.cells.kind(); cells], 1, path)?;
        let steps = group.create_group("Steps").at(path)?;
        hdf::write_attribute(&steps, "NSteps", &(self.steps.len() as i64), path)?;
        let of_steps = |value: &dyn Fn(&Step) -> i64| -> Vec<i64> { self.steps.iter().map(value).collect() };
        let times: Vec<f64> = self.steps.iter().map(|step| step.time).collect();
        hdf::describe(&hdf::write_array(&steps, "Values", &times, 1, path)?, "s", "Times of the steps.", path)?;
        hdf::write_array(&steps, "PartOffsets", &of_steps(&|step| part(step) as i64), 1, path)?;
        hdf::write_array(&steps, "NumberOfParts", &of_steps(&|_| 1), 1, path)?;
        hdf::write_array(&steps, "PointOffsets", &of_steps(&|step| step.point_offset), 1, path)?;
        hdf::write_array(&steps, "CellOffsets", &of_steps(&cells_before), 1, path)?;
        hdf::write_array(&steps, "ConnectivityIdOffsets", &of_steps(&|step| each * cells_before(step)), 1, path)?;
        let offsets = steps.create_group(self.cells.data()[1]).at(path)?;
        for (k, name) in self.fields.names().enumerate() {
            hdf::write_array(&offsets, name, &of_steps(&|step| step.field_offsets[k]), 1, path)?;
        }
        // Not in a run that an older version began.
        if !self.edges.is_empty() && self.edges.len() == 9 * self.steps.len() {
            let dataset = hdf::write_array(&steps, "cell", &self.edges, 9, path)?;
            hdf::describe(&dataset, "m", "Edge vectors of the periodic cell, one after the other.", path)?;
        }
        let counts: Vec<u64> = self.steps.iter().map(|step| step.count).collect();
        let dataset = hdf::write_array(&steps, "step", &counts, 1, path)?;
        hdf::describe(&dataset, "1", "Numbers of solver steps done.", path)
    }
}
