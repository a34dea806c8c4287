//! Reader of the gold files in `golden/yade` (format: see `make_gold.py` there).

use concordem::math::Vec3;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// One table of a gold file.
pub struct Table {
    /// Names of the columns.
    pub columns: Vec<String>,
    data: Vec<f64>,
}

impl Table {
    /// The rows in order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.data.chunks(self.columns.len()).map(|data| Row { table: self, data })
    }

    /// A row by its number.
    pub fn row(&self, index: usize) -> Row<'_> {
        self.rows().nth(index).expect("the table has this row")
    }
}

/// One row of a table.
pub struct Row<'a> {
    table: &'a Table,
    data: &'a [f64],
}

impl Row<'_> {
    fn position(&self, column: &str) -> usize {
        self.table.columns.iter().position(|c| c == column).unwrap_or_else(|| panic!("no column {column}"))
    }

    /// Value in a column.
    pub fn real(&self, column: &str) -> f64 {
        self.data[self.position(column)]
    }

    /// Number of columns.
    pub fn width(&self) -> usize {
        self.data.len()
    }

    /// Whether the value in a column is not zero.
    pub fn flag(&self, column: &str) -> bool {
        self.real(column) != 0.0
    }

    /// Columns `name_x`, `name_y`, `name_z`.
    pub fn vector(&self, name: &str) -> Vec3 {
        let first = self.position(&format!("{name}_x"));
        Vec3::new(self.data[first], self.data[first + 1], self.data[first + 2])
    }
}

/// All tables of a file.
pub fn read(file: &str) -> BTreeMap<String, Table> {
    let path: PathBuf = [env!("CARGO_MANIFEST_DIR"), "golden", "yade", file].iter().collect();
    let bytes = std::fs::read(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let mut rest = bytes.strip_prefix(b"CONCORDEM-GOLD 1\n".as_slice()).expect("a gold file");
    let mut tables = BTreeMap::new();
    while !rest.is_empty() {
        let end = rest.iter().position(|&byte| byte == b'\n').expect("a head line");
        let head = std::str::from_utf8(&rest[..end]).expect("ASCII");
        let words: Vec<&str> = head.split(' ').collect();
        let (rows, columns): (usize, usize) = (words[1].parse().expect("rows"), words[2].parse().expect("columns"));
        let names: Vec<String> = words[3].split(',').map(str::to_owned).collect();
        assert_eq!(names.len(), columns);
        let size = 8 * rows * columns;
        let data = rest[end + 1..end + 1 + size]
            .chunks_exact(8)
            .map(|chunk| f64::from_le_bytes(chunk.try_into().expect("8 bytes")))
            .collect();
        tables.insert(words[0].to_owned(), Table { columns: names, data });
        rest = &rest[end + 1 + size..];
    }
    tables
}
