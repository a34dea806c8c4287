//! The state hash: equal for two states if and only if all their bits are equal.
//!
//! Definition: for every column the BLAKE3 hash of its path, its type, its number of components, its number of
//! values, and its values as little-endian bytes; the state hash is the BLAKE3 hash of the column hashes in the
//! order of their paths. It does not depend on the order in which columns are written, nor on units.

use std::collections::BTreeMap;

use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, RowsOfReals, WriteColumns};

#[cfg(target_endian = "big")]
compile_error!("the state hash and the file formats are defined for little-endian numbers");

/// Hashes columns.
#[derive(Debug, Default)]
pub struct StateHasher {
    columns: BTreeMap<String, blake3::Hash>,
}

impl StateHasher {
    /// Hash of all columns, 64 hexadecimal digits.
    pub fn finish(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        for hash in self.columns.values() {
            hasher.update(hash.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }
}

impl StateHasher {
    /// Begin the hash of a column of `length` numbers that has the type and the components of `column`.
    fn begin(path: &str, column: &Column<'_>, length: usize) -> blake3::Hasher {
        let mut hasher = blake3::Hasher::new();
        // Hashing lengths before variable parts makes the byte sequences of different columns differ.
        hasher.update(&(path.len() as u64).to_le_bytes());
        hasher.update(path.as_bytes());
        hasher.update(column.kind().to_string().as_bytes());
        hasher.update(&(column.components() as u64).to_le_bytes());
        hasher.update(&(length as u64).to_le_bytes());
        hasher
    }

    /// Keep the hash of a column.
    fn keep(&mut self, path: &str, hasher: &blake3::Hasher) -> Result<(), ColumnError> {
        if self.columns.insert(path.to_owned(), hasher.finalize()).is_some() {
            return Err(ColumnError::Duplicate { path: path.to_owned() });
        }
        Ok(())
    }
}

impl ColumnSink for StateHasher {
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError> {
        column.rows(path)?;
        let mut hasher = Self::begin(path, &column, column.len());
        hasher.update_rayon(column.bytes());
        self.keep(path, &hasher)
    }

    fn rows(&mut self, path: &str, rows: &RowsOfReals<'_>) -> Result<(), ColumnError> {
        rows.column(&[]).rows(path)?;
        let mut hasher = Self::begin(path, &rows.column(&[]), rows.count * rows.components);
        for (_, piece) in rows.pieces() {
            hasher.update_rayon(rows.column(&piece).bytes());
        }
        self.keep(path, &hasher)
    }
}

/// Hash of a state.
pub fn state_hash(state: &dyn WriteColumns) -> Result<String, ColumnError> {
    let mut hasher = StateHasher::default();
    state.write(&mut hasher)?;
    Ok(hasher.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hash(columns: &[(&str, Column<'_>)]) -> String {
        let mut hasher = StateHasher::default();
        for (path, column) in columns {
            hasher.column(path, *column).unwrap();
        }
        hasher.finish()
    }

    #[test]
    fn order_of_writing_does_not_matter() {
        let (x, n) = (Column::f64(&[1.0, 2.0], 1, "m"), Column::u32(&[7]));
        assert_eq!(hash(&[("x", x), ("n", n)]), hash(&[("n", n), ("x", x)]));
    }

    /// More rows than a piece has.
    #[test]
    fn rows_hash_as_their_column() {
        let values: Vec<f64> = (0..200_000).map(f64::from).collect();
        let numbers = |rows: std::ops::Range<usize>| values[2 * rows.start..2 * rows.end].to_vec();
        let mut hasher = StateHasher::default();
        hasher.rows("x", &RowsOfReals { components: 2, unit: "m", count: 100_000, numbers: &numbers }).unwrap();
        assert_eq!(hasher.finish(), hash(&[("x", Column::f64(&values, 2, "m"))]));
    }

    #[test]
    fn path_shape_and_every_bit_change_the_hash() {
        let values = [1.0, 2.0, 3.0];
        let base = hash(&[("x", Column::f64(&values, 1, "m"))]);
        let bits = values.map(f64::to_bits);
        for (what, other) in [
            ("path", hash(&[("y", Column::f64(&values, 1, "m"))])),
            ("shape", hash(&[("x", Column::f64(&values, 3, "m"))])),
            ("type", hash(&[("x", Column::u64(&bits))])),
            ("last bit", hash(&[("x", Column::f64(&[1.0, 2.0, 3.0_f64.next_up()], 1, "m"))])),
            ("sign of zero", hash(&[("x", Column::f64(&[1.0, 2.0, -0.0], 1, "m"))])),
            ("more", hash(&[("x", Column::f64(&values, 1, "m")), ("y", Column::f64(&[], 1, "m"))])),
        ] {
            assert_ne!(base, other, "{what} must change the hash");
        }
        assert_eq!(base, hash(&[("x", Column::f64(&values, 1, "mm"))]), "the unit is a label only");
    }

    #[test]
    fn the_hash_of_a_given_state_never_changes() {
        // Any change to the definition makes old checkpoints unreadable, so it must be deliberate.
        let hash = hash(&[("a/x", Column::f64(&[1.5, -2.0, 0.0], 3, "m")), ("a/id", Column::u32(&[4]))]);
        assert_eq!(hash, "19b012b8409ba4fe98110657b430843bae4616f34a841332880100cca756123b");
    }
}
