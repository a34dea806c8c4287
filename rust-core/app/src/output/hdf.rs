//! Reading and writing HDF5 objects of our files.

use std::path::Path;
use std::str::FromStr;

use hdf5::types::{FixedAscii, FloatSize, IntSize, TypeDescriptor, VarLenUnicode};
use hdf5::{Dataset, Group, H5Type, Location};
use ndarray::{ArrayView1, ArrayView2, s};

use super::error::{At, OutputError};
use concordem_solver::state::columns::{
    Column, ColumnData, ColumnError, ColumnSink, ColumnStore, RowsOfReals, StoredColumn,
};

/// Version of the layout of all our files.
pub(crate) const FORMAT_VERSION: u64 = 3;

/// Values of the attribute `kind`.
pub(crate) mod kind {
    pub const CHECKPOINT: &str = "checkpoint";
    pub const HEADER: &str = "run header";
    pub const SEGMENT: &str = "result segment";
    pub const RESULT: &str = "result";
    pub const SWEEP: &str = "sweep";
}

pub(crate) use concordem_files::checked_hdf5::options;
use concordem_files::{checked_hdf5 as checked, hdf5_text};

/// Writes kind and version into a new file.
pub(crate) fn write_identity(file: &Group, kind: &str, path: &Path) -> Result<(), OutputError> {
    write_text_attribute(file, "kind", kind, path)?;
    write_attribute(file, "format_version", &FORMAT_VERSION, path)?;
    write_text_attribute(file, "written_by", crate::provenance::PROGRAM, path)
}

/// Refuses a file of another kind or version.
pub(crate) fn check_identity(file: &Group, expected: &'static str, path: &Path) -> Result<(), OutputError> {
    let found = read_text_attribute(file, "kind", path)?;
    if found != expected {
        return Err(OutputError::Kind { path: path.to_owned(), found, expected });
    }
    let version: u64 = read_attribute(file, "format_version", path)?;
    if version != FORMAT_VERSION {
        return Err(OutputError::Version {
            path: path.to_owned(),
            found: version,
            supported: FORMAT_VERSION,
            written_by: read_text_attribute(file, "written_by", path)?,
        });
    }
    Ok(())
}

/// Members of a group whose names are `prefix` and a number, in the order of the numbers, which must be 0, 1, 2, …
///
/// HDF5 lists names in the order of their characters: `operator-1000` before `operator-101`.
pub(crate) fn numbered_members(group: &Group, prefix: &str, path: &Path) -> Result<Vec<String>, OutputError> {
    let mut members: Vec<(usize, String)> = Vec::new();
    for name in group.member_names().at(path)? {
        let Some(digits) = name.strip_prefix(prefix) else { continue };
        // For fields of snapshots the name follows the number.
        let digits = digits.split(' ').next().unwrap_or_default();
        match digits.parse() {
            Ok(number) => members.push((number, name)),
            Err(_) => return Err(damaged(path, format!("`{name}` is not `{prefix}` with a number"))),
        }
    }
    members.sort();
    if let Some((expected, (_, name))) = members.iter().enumerate().find(|(k, (number, _))| k != number) {
        return Err(damaged(path, format!("`{name}` is found where number {expected} is expected")));
    }
    Ok(members.into_iter().map(|(_, name)| name).collect())
}

/// Refuses names that have a special meaning in HDF5.
pub(crate) fn check_name(name: &str, what: &'static str) -> Result<(), OutputError> {
    let problem = if name.is_empty() || name == "." || name == ".." {
        "it is empty or a relative path"
    } else if name.contains(['/', '\0']) {
        "it contains a slash or a zero"
    } else {
        return Ok(());
    };
    Err(OutputError::Name { name: name.to_owned(), what, problem })
}

fn text_of(text: &str, path: &Path) -> Result<VarLenUnicode, OutputError> {
    VarLenUnicode::from_str(text).map_err(|_| OutputError::Hdf5 {
        path: path.to_owned(),
        message: format!("the text {:?}... contains a zero character", text.chars().take(40).collect::<String>()),
    })
}

/// Writes a scalar attribute.
pub(crate) fn write_attribute<T: H5Type>(at: &Location, name: &str, value: &T, path: &Path) -> Result<(), OutputError> {
    at.new_attr::<T>().create(name).and_then(|attribute| attribute.write_scalar(value)).at(path)
}

/// Writes a text attribute.
pub(crate) fn write_text_attribute(at: &Location, name: &str, text: &str, path: &Path) -> Result<(), OutputError> {
    write_attribute(at, name, &text_of(text, path)?, path)
}

/// Error for content that this program would not write.
pub(crate) fn damaged(path: &Path, problem: String) -> OutputError {
    OutputError::Damaged { path: path.to_owned(), problem }
}

/// Reads a scalar attribute.
pub(crate) fn read_attribute<T: H5Type>(at: &Location, name: &str, path: &Path) -> Result<T, OutputError> {
    let attribute = at.attr(name).at(path)?;
    checked::number(&attribute).map_err(|problem| damaged(path, format!("the attribute `{name}` {problem}")))
}

/// Reads a text attribute.
pub(crate) fn read_text_attribute(at: &Location, name: &str, path: &Path) -> Result<String, OutputError> {
    hdf5_text::attribute(path, at, name).map_err(|problem| damaged(path, format!("the attribute `{name}` {problem}")))
}

/// Names of all attributes.
pub(crate) fn attribute_names(at: &Location, path: &Path) -> Result<Vec<String>, OutputError> {
    hdf5_text::attribute_names(path, at).map_err(|problem| damaged(path, format!("an attribute {problem}")))
}

/// Writes text as a dataset.
pub(crate) fn write_text(group: &Group, name: &str, text: &str, path: &Path) -> Result<(), OutputError> {
    let stored = text_of(text, path)?;
    let dataset = group.new_dataset::<VarLenUnicode>().create(name).at(path)?;
    dataset.write_scalar(&stored).at(path)?;
    complete(&dataset, blake3::Hasher::new().update(text.as_bytes()), path)
}

/// Attribute of every dataset: hash of its values, row by row, or of its text.
const HASH: &str = "blake3";

/// Completes a dataset whose values have the hash in `hasher`: stores the hash, and brings all values to the file.
///
/// The library keeps the last values back until the dataset is closed. Closing it is dropping it, which reports no errors: what cannot
/// be written then is lost. So nothing may be left for that moment.
pub(super) fn complete(dataset: &Dataset, hasher: &blake3::Hasher, path: &Path) -> Result<(), OutputError> {
    let hash = FixedAscii::<64>::from_ascii(hasher.finalize().to_hex().as_bytes()).unwrap_or_default();
    write_attribute(dataset, HASH, &hash, path)?;
    dataset.flush().at(path)
}

/// The hash that [`complete`] stored with a dataset.
pub(super) fn stored_hash(dataset: &Dataset, path: &Path) -> Result<String, OutputError> {
    let hash: FixedAscii<64> = dataset.attr(HASH).and_then(|attribute| attribute.read_scalar()).at(path)?;
    Ok(hash.as_str().to_owned())
}

/// Adds values to the hash of a dataset, on all threads if there are many.
pub(super) fn add_to_hash<T: bytemuck::NoUninit>(hasher: &mut blake3::Hasher, values: &[T]) {
    const MANY: usize = 1 << 18;
    let bytes: &[u8] = bytemuck::cast_slice(values);
    if bytes.len() < MANY {
        hasher.update(bytes)
    } else {
        hasher.update_rayon(bytes)
    };
}

/// Reads a text dataset.
pub(crate) fn read_text(group: &Group, name: &str, path: &Path) -> Result<String, OutputError> {
    let dataset = group.dataset(name).at(path)?;
    hdf5_text::dataset(path, &dataset).map_err(|problem| damaged(path, format!("`{name}` {problem}")))
}

/// Whether all bits are zero. Such values are not written: HDF5 then stores nothing, and readers get its fill value, zero.
pub(crate) fn is_zero<T: bytemuck::NoUninit>(data: &[T]) -> bool {
    const ZEROS: [u8; 4096] = [0; 4096];
    bytemuck::cast_slice::<T, u8>(data).chunks(ZEROS.len()).all(|part| *part == ZEROS[..part.len()])
}

/// Writes an array: one-dimensional for `components` = 1, otherwise one row per item. Creates parent groups as needed.
pub(crate) fn write_array<T: H5Type + bytemuck::NoUninit>(
    group: &Group,
    name: &str,
    data: &[T],
    components: usize,
    path: &Path,
) -> Result<Dataset, OutputError> {
    let dataset = create_array::<T>(group, name, data.len() / components.max(1), components, path)?;
    if !is_zero(data) {
        dataset.write_raw(data).at(path)?;
    }
    let mut hasher = blake3::Hasher::new();
    add_to_hash(&mut hasher, data);
    complete(&dataset, &hasher, path)?;
    Ok(dataset)
}

/// Creates the dataset of an array.
fn create_array<T: H5Type>(
    group: &Group,
    name: &str,
    rows: usize,
    components: usize,
    path: &Path,
) -> Result<Dataset, OutputError> {
    let shape = if components == 1 { vec![rows] } else { vec![rows, components] };
    group.new_dataset::<T>().obj_track_times(false).create_intermediate_group(true).shape(shape).create(name).at(path)
}

/// Writes rows piece by piece; the file is that of [`write_array`].
fn write_rows(group: &Group, name: &str, rows: &RowsOfReals<'_>, path: &Path) -> Result<Dataset, OutputError> {
    let width = rows.components;
    rows.column(&[]).rows(name).at(path)?;
    let dataset = create_array::<f64>(group, name, rows.count, width, path)?;
    let write = |first: usize, piece: &[f64]| {
        let end = first + piece.len() / width;
        if width == 1 {
            dataset.write_slice(ArrayView1::from(piece), s![first..end]).at(path)
        } else {
            let table = ArrayView2::from_shape((end - first, width), piece).map_err(hdf5::Error::from).at(path)?;
            dataset.write_slice(table, s![first..end, ..]).at(path)
        }
    };
    // HDF5 allocates the whole dataset at the first write, and then does not fill what is not written.
    let mut written = false;
    let mut hasher = blake3::Hasher::new();
    for (first, piece) in rows.pieces() {
        add_to_hash(&mut hasher, &piece);
        if !written && is_zero(&piece) {
            continue;
        }
        if !written {
            let zeros = vec![0.0; piece.len().max(width)];
            for start in (0..first).step_by(zeros.len() / width) {
                write(start, &zeros[..width * (first - start).min(zeros.len() / width)])?;
            }
        }
        written = true;
        write(first, &piece)?;
    }
    complete(&dataset, &hasher, path)?;
    Ok(dataset)
}

/// Reads an array of exactly this type.
pub(crate) fn read_array<T: H5Type>(group: &Group, name: &str, path: &Path) -> Result<Vec<T>, OutputError> {
    let dataset = group.dataset(name).at(path)?;
    let length = std::fs::metadata(path).map_err(|error| OutputError::io(path, "read", error))?.len();
    checked::values(&dataset, length).map_err(|problem| damaged(path, format!("`{name}` {problem}")))
}

/// Writes a column with its unit and description.
pub(crate) fn write_column(
    group: &Group,
    name: &str,
    column: &Column<'_>,
    unit: &str,
    description: &str,
    path: &Path,
) -> Result<(), OutputError> {
    column.rows(name).at(path)?;
    let dataset = match *column {
        Column::F64 { data, components, .. } => write_array(group, name, data, components, path),
        Column::U64 { data, components, .. } => write_array(group, name, data, components, path),
        Column::U32 { data, components, .. } => write_array(group, name, data, components, path),
        Column::U16 { data, components, .. } => write_array(group, name, data, components, path),
        Column::U8 { data, components, .. } => write_array(group, name, data, components, path),
        Column::I8 { data, components, .. } => write_array(group, name, data, components, path),
    }?;
    describe(&dataset, unit, description, path)
}

/// Writes unit and description of a dataset.
pub(crate) fn describe(dataset: &Dataset, unit: &str, description: &str, path: &Path) -> Result<(), OutputError> {
    write_text_attribute(dataset, "unit", unit, path)?;
    write_text_attribute(dataset, "description", description, path)
}

/// Reads unit and description of a dataset.
pub(crate) fn read_description(dataset: &Dataset, path: &Path) -> Result<(String, String), OutputError> {
    Ok((read_text_attribute(dataset, "unit", path)?, read_text_attribute(dataset, "description", path)?))
}

/// Reads a column of any type.
pub(crate) fn read_column(group: &Group, name: &str, path: &Path) -> Result<StoredColumn, OutputError> {
    let dataset = group.dataset(name).at(path)?;
    let components = match dataset.shape()[..] {
        [_] => 1,
        [_, components] if components > 0 => components,
        ref shape => {
            return Err(damaged(
                path,
                format!("`{name}` has the shape {shape:?}, but arrays have one or two dimensions"),
            ));
        }
    };
    let descriptor = dataset.dtype().and_then(|dtype| dtype.to_descriptor()).at(path)?;
    let data = match descriptor {
        TypeDescriptor::Float(FloatSize::U8) => ColumnData::F64(read_array(group, name, path)?),
        TypeDescriptor::Unsigned(IntSize::U8) => ColumnData::U64(read_array(group, name, path)?),
        TypeDescriptor::Unsigned(IntSize::U4) => ColumnData::U32(read_array(group, name, path)?),
        TypeDescriptor::Unsigned(IntSize::U2) => ColumnData::U16(read_array(group, name, path)?),
        TypeDescriptor::Unsigned(IntSize::U1) => ColumnData::U8(read_array(group, name, path)?),
        TypeDescriptor::Integer(IntSize::U1) => ColumnData::I8(read_array(group, name, path)?),
        // ParaView requires signed counts and offsets.
        TypeDescriptor::Integer(IntSize::U8) => {
            let counts = read_array::<i64>(group, name, path)?.into_iter().map(u64::try_from);
            let counts = counts.collect::<Result<_, _>>();
            ColumnData::U64(counts.map_err(|_| damaged(path, format!("`{name}` holds a negative number")))?)
        }
        other => return Err(damaged(path, format!("`{name}` holds {other}, an unsupported type"))),
    };
    Ok(StoredColumn { data, components })
}

/// Largest nesting depth of groups in a checkpoint. In a forged file a group may contain itself.
const DEEPEST: usize = 8;

/// Reads all columns below a group.
pub(crate) fn read_columns(group: &Group, path: &Path) -> Result<ColumnStore, OutputError> {
    fn walk(group: &Group, prefix: &str, store: &mut ColumnStore, path: &Path) -> Result<(), OutputError> {
        if prefix.matches('/').count() >= DEEPEST {
            return Err(damaged(path, format!("`{prefix}` lies more than {DEEPEST} groups deep")));
        }
        for name in group.member_names().at(path)? {
            let full = if prefix.is_empty() { name.clone() } else { format!("{prefix}/{name}") };
            if let Ok(inner) = group.group(&name) {
                walk(&inner, &full, store, path)?;
            } else {
                store.insert(&full, read_column(group, &name, path)?).at(path)?;
            }
        }
        Ok(())
    }
    let mut store = ColumnStore::default();
    walk(group, "", &mut store, path)?;
    Ok(store)
}

/// Writes columns into a group; stores the first error in full, because the error type of the sink has less detail.
pub(crate) struct GroupSink<'a> {
    pub group: &'a Group,
    pub path: &'a Path,
    /// Groups that may receive columns; if empty, any group may.
    pub allowed: &'a [&'a str],
    pub failure: Option<OutputError>,
}

impl GroupSink<'_> {
    /// The result of writing, with the stored error instead of the one in `result`.
    pub fn outcome(self, result: Result<(), ColumnError>) -> Result<(), OutputError> {
        let path = self.path;
        match self.failure {
            Some(failure) => Err(failure),
            None => result.at(path),
        }
    }
}

impl ColumnSink for GroupSink<'_> {
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError> {
        self.described_column(path, column, "")
    }

    fn described_column(&mut self, path: &str, column: Column<'_>, description: &str) -> Result<(), ColumnError> {
        self.check(path)?;
        let written = write_column(self.group, path, &column, column.unit(), description, self.path);
        self.store(path, written)
    }

    fn rows(&mut self, path: &str, rows: &RowsOfReals<'_>) -> Result<(), ColumnError> {
        self.check(path)?;
        let written = write_rows(self.group, path, rows, self.path)
            .and_then(|dataset| describe(&dataset, rows.unit, "", self.path));
        self.store(path, written)
    }
}

impl GroupSink<'_> {
    /// Whether a column may have this path.
    fn check(&self, path: &str) -> Result<(), ColumnError> {
        let storage = |message: String| ColumnError::Storage { path: path.to_owned(), message };
        if path.is_empty() || path.split('/').any(|part| check_name(part, "a column").is_err()) {
            return Err(storage("the path has an empty or impossible part".into()));
        }
        if !self.allowed.is_empty() && !self.allowed.iter().any(|group| path.starts_with(&format!("{group}/"))) {
            return Err(storage(format!("final columns must be below {}", self.allowed.join(" or "))));
        }
        if self.group.link_exists(path) {
            return Err(ColumnError::Duplicate { path: path.to_owned() });
        }
        Ok(())
    }

    /// Keep the error of a column that was not written.
    fn store(&mut self, path: &str, written: Result<(), OutputError>) -> Result<(), ColumnError> {
        written.map_err(|error| {
            let message = error.to_string();
            self.failure = Some(error);
            ColumnError::Storage { path: path.to_owned(), message }
        })
    }
}
