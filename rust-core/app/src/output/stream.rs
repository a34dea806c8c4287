//! Fields of many snapshots, one after the other in one dataset per field; a field that has not changed is stored once.

use std::path::Path;

use hdf5::{Dataset, Group, H5Type};
use ndarray::{ArrayView1, ArrayView2, s};

use super::error::{At, OutputError};
use super::hdf;
use concordem_solver::state::columns::{ColumnData, StoredColumn};

/// A field of one snapshot, or of several with equal numbers of rows, one after the other.
#[derive(Debug)]
pub(crate) struct StoredField {
    pub name: String,
    pub unit: String,
    pub description: String,
    pub column: StoredColumn,
}

impl StoredField {
    /// Type and shape of a row, as text.
    pub(super) fn shape(&self) -> String {
        format!("{} {}", self.column.components, self.column.kind())
    }
}

/// The fields of all snapshots, in a group.
pub(super) struct FieldStream<'a> {
    path: &'a Path,
    group: Group,
    fields: Vec<(String, Appended)>,
}

impl<'a> FieldStream<'a> {
    /// A stream into `group`.
    pub fn new(group: Group, path: &'a Path) -> Self {
        Self { path, group, fields: Vec::new() }
    }

    /// Names of the fields.
    pub fn names(&self) -> impl Iterator<Item = &str> {
        self.fields.iter().map(|(name, _)| &name[..])
    }

    /// Appends `count` snapshots with `rows` rows each; returns the offsets of every field in every snapshot.
    ///
    /// # Errors
    /// The fields are not those of the first snapshot, or their lengths differ.
    pub fn append(&mut self, fields: &[&StoredField], rows: usize, count: usize) -> Result<Vec<Vec<i64>>, OutputError> {
        let path = self.path;
        let damaged = |problem: &str| OutputError::Damaged { path: path.to_owned(), problem: problem.to_owned() };
        if self.fields.is_empty() {
            for field in fields {
                let appended = Appended::of_kind(&self.group, field, rows.clamp(1 << 8, 1 << 16), path)?;
                hdf::describe(&appended.dataset, &field.unit, &field.description, path)?;
                self.fields.push((field.name.clone(), appended));
            }
        }
        if !fields.iter().map(|field| &field.name).eq(self.fields.iter().map(|(name, _)| name)) {
            return Err(damaged("the fields of its snapshots are not those of the first one"));
        }
        let mut offsets = Vec::new();
        for ((_, appended), field) in self.fields.iter_mut().zip(fields) {
            let components = field.column.components;
            if field.column.borrow().rows(&field.name).at(path)? != rows * count {
                return Err(damaged("the lengths of the fields of its snapshots differ"));
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
        Ok(offsets)
    }

    /// Completes the datasets.
    pub fn finish(&self) -> Result<(), OutputError> {
        self.fields.iter().try_for_each(|(_, appended)| appended.finish(self.path))
    }
}

/// A growing dataset, the hash of its values, and the bytes and the offset of the part appended last.
pub(super) struct Appended {
    pub dataset: Dataset,
    pub rows: usize,
    hasher: blake3::Hasher,
    last: Option<(Vec<u8>, i64)>,
}

impl Appended {
    pub fn new<T: H5Type>(
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
        Ok(Self { dataset: dataset.at(path)?, rows: 0, hasher: blake3::Hasher::new(), last: None })
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
        let length = data.len() / count.max(1);
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

    pub fn append<T: H5Type + bytemuck::NoUninit>(
        &mut self,
        data: &[T],
        components: usize,
        path: &Path,
    ) -> Result<(), OutputError> {
        let (start, added) = (self.rows, data.len() / components);
        if added == 0 {
            return Ok(());
        }
        let end = start + added;
        let zero = hdf::is_zero(data);
        if components == 1 {
            self.dataset.resize([end]).at(path)?;
            if !zero {
                self.dataset.write_slice(ArrayView1::from(data), s![start..end]).at(path)?;
            }
        } else {
            self.dataset.resize([end, components]).at(path)?;
            if !zero {
                let view = ArrayView2::from_shape((added, components), data)
                    .map_err(|error| OutputError::Hdf5 { path: path.to_owned(), message: error.to_string() })?;
                self.dataset.write_slice(view, s![start..end, ..]).at(path)?;
            }
        }
        hdf::add_to_hash(&mut self.hasher, data);
        self.rows = end;
        Ok(())
    }

    /// Completes the dataset.
    pub fn finish(&self, path: &Path) -> Result<(), OutputError> {
        hdf::complete(&self.dataset, &self.hasher, path)
    }
}
