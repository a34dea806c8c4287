//! Named columns of numbers: the interface between the state and files.
//!
//! The state writes everything that changes during a run into a [`ColumnSink`] and reads it back from a [`ColumnSource`]
//! bit for bit. Checkpoints, the state hash, and tests implement these traits.

use std::collections::BTreeMap;
use std::ops::Range;

/// One column: contiguous rows of `components` numbers each.
#[derive(Debug, Clone, Copy, PartialEq)]
#[allow(missing_docs)] // the fields are the same in every variant and described on the enum's methods
pub enum Column<'a> {
    /// Reals.
    F64 { data: &'a [f64], components: usize, unit: &'static str },
    /// Unsigned integers of 64 bits.
    U64 { data: &'a [u64], components: usize, unit: &'static str },
    /// Unsigned integers of 32 bits.
    U32 { data: &'a [u32], components: usize, unit: &'static str },
    /// Unsigned integers of 16 bits.
    U16 { data: &'a [u16], components: usize, unit: &'static str },
    /// Bytes: flags, text.
    U8 { data: &'a [u8], components: usize, unit: &'static str },
    /// Signed bytes: periodic image indices.
    I8 { data: &'a [i8], components: usize, unit: &'static str },
}

/// Type of the numbers in a column.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[allow(missing_docs)]
pub enum ColumnKind {
    F64,
    U64,
    U32,
    U16,
    U8,
    I8,
}

impl std::fmt::Display for ColumnKind {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::F64 => "f64",
            Self::U64 => "u64",
            Self::U32 => "u32",
            Self::U16 => "u16",
            Self::U8 => "u8",
            Self::I8 => "i8",
        })
    }
}

/// Evaluate an expression for the data of any kind of column.
macro_rules! for_each_kind {
    ($column:expr, $data:ident => $body:expr) => {
        match $column {
            Column::F64 { data: $data, .. } => $body,
            Column::U64 { data: $data, .. } => $body,
            Column::U32 { data: $data, .. } => $body,
            Column::U16 { data: $data, .. } => $body,
            Column::U8 { data: $data, .. } => $body,
            Column::I8 { data: $data, .. } => $body,
        }
    };
}

impl<'a> Column<'a> {
    /// Reals; `components` is 1 for scalars, 3 for vectors, 4 for quaternions, 9 for matrices.
    pub fn f64(data: &'a [f64], components: usize, unit: &'static str) -> Self {
        Self::F64 { data, components, unit }
    }

    /// Scalars of 64-bit unsigned integers.
    pub fn u64(data: &'a [u64]) -> Self {
        Self::U64 { data, components: 1, unit: "1" }
    }

    /// Scalars of 32-bit unsigned integers.
    pub fn u32(data: &'a [u32]) -> Self {
        Self::U32 { data, components: 1, unit: "1" }
    }

    /// Scalars of 16-bit unsigned integers.
    pub fn u16(data: &'a [u16]) -> Self {
        Self::U16 { data, components: 1, unit: "1" }
    }

    /// Bytes.
    pub fn u8(data: &'a [u8]) -> Self {
        Self::U8 { data, components: 1, unit: "1" }
    }

    /// Rows of signed bytes.
    pub fn i8(data: &'a [i8], components: usize) -> Self {
        Self::I8 { data, components, unit: "1" }
    }

    /// Type of the numbers.
    pub fn kind(&self) -> ColumnKind {
        match self {
            Self::F64 { .. } => ColumnKind::F64,
            Self::U64 { .. } => ColumnKind::U64,
            Self::U32 { .. } => ColumnKind::U32,
            Self::U16 { .. } => ColumnKind::U16,
            Self::U8 { .. } => ColumnKind::U8,
            Self::I8 { .. } => ColumnKind::I8,
        }
    }

    /// Numbers per row.
    pub fn components(&self) -> usize {
        match self {
            Self::F64 { components, .. }
            | Self::U64 { components, .. }
            | Self::U32 { components, .. }
            | Self::U16 { components, .. }
            | Self::U8 { components, .. }
            | Self::I8 { components, .. } => *components,
        }
    }

    /// SI unit, "1" when dimensionless.
    pub fn unit(&self) -> &'static str {
        match self {
            Self::F64 { unit, .. }
            | Self::U64 { unit, .. }
            | Self::U32 { unit, .. }
            | Self::U16 { unit, .. }
            | Self::U8 { unit, .. }
            | Self::I8 { unit, .. } => unit,
        }
    }

    /// Number of numbers: rows times components.
    pub fn len(&self) -> usize {
        for_each_kind!(self, data => data.len())
    }

    /// Whether the column is empty.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Number of rows.
    ///
    /// # Errors
    /// [`ColumnError::Ragged`].
    pub fn rows(&self, path: &str) -> Result<usize, ColumnError> {
        let (len, components) = (self.len(), self.components());
        if components == 0 || len % components != 0 {
            return Err(ColumnError::Ragged { path: path.to_owned(), len, components });
        }
        Ok(len / components)
    }

    /// Bytes of the numbers in the byte order of the machine.
    pub fn bytes(&self) -> &'a [u8] {
        for_each_kind!(*self, data => bytemuck::cast_slice(data))
    }
}

/// Why columns cannot be written or read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ColumnError {
    /// The column does not exist.
    #[error("column `{path}` is missing")]
    Missing {
        /// Path of the column.
        path: String,
    },
    /// A column of that path was written before.
    #[error("column `{path}` is written twice")]
    Duplicate {
        /// Path of the column.
        path: String,
    },
    /// The numbers are of another type.
    #[error("column `{path}` holds {found} where {expected} is needed")]
    Kind {
        /// Path of the column.
        path: String,
        /// Expected type.
        expected: ColumnKind,
        /// Type found.
        found: String,
    },
    /// The number of numbers is wrong.
    #[error("column `{path}` holds {found} numbers where {expected} are needed")]
    Length {
        /// Path of the column.
        path: String,
        /// Expected number.
        expected: usize,
        /// Number found.
        found: usize,
    },
    /// The number of values is not a whole number of rows.
    #[error("column `{path}` holds {len} numbers, which is not a multiple of its {components} components")]
    Ragged {
        /// Path of the column.
        path: String,
        /// Number of numbers.
        len: usize,
        /// Numbers per row.
        components: usize,
    },
    /// A value is invalid.
    #[error("column `{path}`, row {row}: {problem}")]
    Value {
        /// Path of the column.
        path: String,
        /// Index of the row.
        row: usize,
        /// What is wrong with it.
        problem: String,
    },
    /// The storage failed.
    #[error("column `{path}`: {message}")]
    Storage {
        /// Path of the column.
        path: String,
        /// Message of the storage.
        message: String,
    },
}

/// A column of reals whose rows are not stored as such: they are made when they are needed.
pub struct RowsOfReals<'a> {
    /// Numbers per row.
    pub components: usize,
    /// SI unit.
    pub unit: &'static str,
    /// Number of rows.
    pub count: usize,
    /// The numbers of some rows, row by row.
    pub numbers: &'a dyn Fn(Range<usize>) -> Vec<f64>,
}

impl RowsOfReals<'_> {
    /// Rows of a piece: some megabytes.
    const PIECE: usize = 1 << 15;

    /// The rows in pieces: first row, and numbers row by row.
    pub fn pieces(&self) -> impl Iterator<Item = (usize, Vec<f64>)> + '_ {
        (0..self.count).step_by(Self::PIECE).map(|first| (first, self.of(first..self.count.min(first + Self::PIECE))))
    }

    /// All rows.
    pub fn all(&self) -> Vec<f64> {
        self.of(0..self.count)
    }

    fn of(&self, rows: Range<usize>) -> Vec<f64> {
        let expected = rows.len() * self.components;
        let numbers = (self.numbers)(rows);
        assert_eq!(numbers.len(), expected, "numbers of the rows");
        numbers
    }

    /// A column of the same shape whose numbers are `data`.
    pub fn column<'a>(&self, data: &'a [f64]) -> Column<'a> {
        Column::f64(data, self.components, self.unit)
    }
}

/// Receives columns. Paths are `group/name`, unique, without a leading slash.
pub trait ColumnSink {
    /// Receive one column.
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError>;

    /// Receive one column as [`RowsOfReals`]: by default as a copy of all rows.
    fn rows(&mut self, path: &str, rows: &RowsOfReals<'_>) -> Result<(), ColumnError> {
        self.column(path, rows.column(&rows.all()))
    }

    /// Receive one column with a description for readers; by default the description is ignored.
    fn described_column(&mut self, path: &str, column: Column<'_>, _description: &str) -> Result<(), ColumnError> {
        self.column(path, column)
    }
}

/// Returns columns, bit for bit.
pub trait ColumnSource {
    /// Whether the column exists.
    fn exists(&mut self, path: &str) -> bool;
    /// Reals.
    fn f64(&mut self, path: &str) -> Result<Vec<f64>, ColumnError>;
    /// Unsigned integers of 64 bits.
    fn u64(&mut self, path: &str) -> Result<Vec<u64>, ColumnError>;
    /// Unsigned integers of 32 bits.
    fn u32(&mut self, path: &str) -> Result<Vec<u32>, ColumnError>;
    /// Unsigned integers of 16 bits.
    fn u16(&mut self, path: &str) -> Result<Vec<u16>, ColumnError>;
    /// Bytes.
    fn u8(&mut self, path: &str) -> Result<Vec<u8>, ColumnError>;
    /// Signed bytes.
    fn i8(&mut self, path: &str) -> Result<Vec<i8>, ColumnError>;
}

/// Something that can be written as columns completely, such as the state of a run.
pub trait WriteColumns {
    /// Write every column.
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError>;
}

/// The values, or [`ColumnError::Length`] if there are not exactly `expected` numbers.
pub fn with_length<T>(path: &str, values: Vec<T>, expected: usize) -> Result<Vec<T>, ColumnError> {
    if values.len() == expected {
        Ok(values)
    } else {
        Err(ColumnError::Length { path: path.to_owned(), expected, found: values.len() })
    }
}

/// A column that owns its numbers.
#[derive(Debug, Clone, PartialEq)]
#[allow(missing_docs)]
pub enum ColumnData {
    F64(Vec<f64>),
    U64(Vec<u64>),
    U32(Vec<u32>),
    U16(Vec<u16>),
    U8(Vec<u8>),
    I8(Vec<i8>),
}

/// A [`ColumnData`] with its shape.
#[derive(Debug, Clone, PartialEq)]
pub struct StoredColumn {
    /// The numbers.
    pub data: ColumnData,
    /// Numbers per row.
    pub components: usize,
}

impl StoredColumn {
    /// Type of the numbers.
    pub fn kind(&self) -> ColumnKind {
        self.borrow().kind()
    }

    /// The column as a view; its unit is not stored.
    pub fn borrow(&self) -> Column<'_> {
        let (components, unit) = (self.components, "1");
        match &self.data {
            ColumnData::F64(data) => Column::F64 { data, components, unit },
            ColumnData::U64(data) => Column::U64 { data, components, unit },
            ColumnData::U32(data) => Column::U32 { data, components, unit },
            ColumnData::U16(data) => Column::U16 { data, components, unit },
            ColumnData::U8(data) => Column::U8 { data, components, unit },
            ColumnData::I8(data) => Column::I8 { data, components, unit },
        }
    }
}

/// Columns in memory: sink and source.
///
/// As a source it returns each column once and drops it, so that reading a large state does not hold it twice.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ColumnStore {
    columns: BTreeMap<String, StoredColumn>,
}

impl ColumnStore {
    /// All columns that `state` writes.
    pub fn of(state: &dyn WriteColumns) -> Result<Self, ColumnError> {
        let mut store = Self::default();
        state.write(&mut store)?;
        Ok(store)
    }

    /// Add a column.
    ///
    /// # Errors
    /// [`ColumnError::Duplicate`] if the path exists.
    pub fn insert(&mut self, path: &str, column: StoredColumn) -> Result<(), ColumnError> {
        if self.columns.contains_key(path) {
            return Err(ColumnError::Duplicate { path: path.to_owned() });
        }
        self.columns.insert(path.to_owned(), column);
        Ok(())
    }

    /// A column by its path.
    pub fn get(&self, path: &str) -> Option<&StoredColumn> {
        self.columns.get(path)
    }

    /// Paths and columns in the order of the paths.
    pub fn iter(&self) -> impl Iterator<Item = (&str, &StoredColumn)> {
        self.columns.iter().map(|(path, column)| (path.as_str(), column))
    }

    fn take(&mut self, path: &str) -> Result<StoredColumn, ColumnError> {
        self.columns.remove(path).ok_or_else(|| ColumnError::Missing { path: path.to_owned() })
    }
}

impl WriteColumns for ColumnStore {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        self.columns.iter().try_for_each(|(path, column)| sink.column(path, column.borrow()))
    }
}

impl ColumnSink for ColumnStore {
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError> {
        column.rows(path)?;
        let data = match column {
            Column::F64 { data, .. } => ColumnData::F64(data.to_vec()),
            Column::U64 { data, .. } => ColumnData::U64(data.to_vec()),
            Column::U32 { data, .. } => ColumnData::U32(data.to_vec()),
            Column::U16 { data, .. } => ColumnData::U16(data.to_vec()),
            Column::U8 { data, .. } => ColumnData::U8(data.to_vec()),
            Column::I8 { data, .. } => ColumnData::I8(data.to_vec()),
        };
        self.insert(path, StoredColumn { data, components: column.components() })
    }

    fn rows(&mut self, path: &str, rows: &RowsOfReals<'_>) -> Result<(), ColumnError> {
        rows.column(&[]).rows(path)?;
        self.insert(path, StoredColumn { data: ColumnData::F64(rows.all()), components: rows.components })
    }
}

macro_rules! take_kind {
    ($name:ident, $type:ty, $variant:ident) => {
        fn $name(&mut self, path: &str) -> Result<Vec<$type>, ColumnError> {
            match self.take(path)? {
                StoredColumn { data: ColumnData::$variant(data), .. } => Ok(data),
                other => Err(ColumnError::Kind {
                    path: path.to_owned(),
                    expected: ColumnKind::$variant,
                    found: other.kind().to_string(),
                }),
            }
        }
    };
}

impl ColumnSource for ColumnStore {
    fn exists(&mut self, path: &str) -> bool {
        self.columns.contains_key(path)
    }

    take_kind!(f64, f64, F64);
    take_kind!(u64, u64, U64);
    take_kind!(u32, u32, U32);
    take_kind!(u16, u16, U16);
    take_kind!(u8, u8, U8);
    take_kind!(i8, i8, I8);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_come_back_bit_for_bit() {
        let odd = [f64::from_bits(0x7ff8_0000_dead_beef), -0.0, f64::MIN_POSITIVE / 8.0];
        let mut store = ColumnStore::default();
        store.column("a/x", Column::f64(&odd, 3, "m")).unwrap();
        store.column("a/image", Column::i8(&[-1, 0, 1], 3)).unwrap();
        let back = store.f64("a/x").unwrap();
        assert_eq!(back.iter().map(|v| v.to_bits()).collect::<Vec<_>>(), odd.map(f64::to_bits));
        assert_eq!(store.i8("a/image").unwrap(), [-1, 0, 1]);
        assert_eq!(store.f64("a/x"), Err(ColumnError::Missing { path: "a/x".into() }), "given once");
    }

    #[test]
    fn misuse_is_named() {
        let mut store = ColumnStore::default();
        store.column("n", Column::u32(&[1])).unwrap();
        assert_eq!(store.column("n", Column::u32(&[1])), Err(ColumnError::Duplicate { path: "n".into() }));
        let error = store.f64("n").unwrap_err();
        assert_eq!(error.to_string(), "column `n` holds u32 where f64 is needed");
        let error = store.column("v", Column::f64(&[1.0, 2.0], 3, "m")).unwrap_err();
        assert_eq!(error, ColumnError::Ragged { path: "v".into(), len: 2, components: 3 });
        assert_eq!(
            with_length("n", vec![1_u8], 2).unwrap_err().to_string(),
            "column `n` holds 1 numbers where 2 are needed"
        );
    }
}
