//! The complete state in one file.
//!
//! A checkpoint holds every column of the state under `/state`, the state hash, and its provenance. It is
//! written completely or not at all ([`super::sealed`]); reading verifies seal, kind, version, and state hash.

use std::path::Path;

use super::error::{At, OutputError};
use super::hash::StateHasher;
use super::hdf::{self, GroupSink, kind};
use super::sealed;
use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, ColumnStore, RowsOfReals, WriteColumns};

/// A verified checkpoint.
#[derive(Debug)]
pub struct Checkpoint {
    /// Columns of the state.
    pub columns: ColumnStore,
    /// The state hash.
    pub state_hash: String,
    /// Provenance: text of the scenario, or any text of the writer.
    pub provenance: String,
    /// Columns of the writer besides the state, such as its records so far.
    pub kept: ColumnStore,
    pub(super) run: RunMark,
}

/// Identifies the run of a checkpoint, and its position in the run.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(super) struct RunMark {
    /// Identity of the run; empty for a checkpoint outside a run.
    pub run_id: String,
    /// Number of segments before the state.
    pub segments: u64,
}

/// Writes a checkpoint; returns the state hash. Replaces an existing file atomically, and keeps it on failure.
pub fn write(path: &Path, state: &dyn WriteColumns, provenance: &str) -> Result<String, OutputError> {
    write_in_run(path, state, provenance, &RunMark::default())
}

/// [`write()`] with columns besides the state, which its hash does not cover.
///
/// # Errors
/// As [`write()`].
pub fn write_with(
    path: &Path,
    state: &dyn WriteColumns,
    provenance: &str,
    kept: &dyn WriteColumns,
) -> Result<String, OutputError> {
    write_file(path, state, provenance, &RunMark::default(), Some(kept))
}

pub(super) fn write_in_run(
    path: &Path,
    state: &dyn WriteColumns,
    provenance: &str,
    run: &RunMark,
) -> Result<String, OutputError> {
    write_file(path, state, provenance, run, None)
}

fn write_file(
    path: &Path,
    state: &dyn WriteColumns,
    provenance: &str,
    run: &RunMark,
    kept: Option<&dyn WriteColumns>,
) -> Result<String, OutputError> {
    let mut state_hash = String::new();
    sealed::write(path, &sealed::folder_of(path), |file| {
        hdf::write_identity(file, kind::CHECKPOINT, path)?;
        hdf::write_text_attribute(file, "run_id", &run.run_id, path)?;
        hdf::write_attribute(file, "segments", &run.segments, path)?;
        hdf::write_text(file, "provenance", provenance, path)?;
        state_hash = write_state(file, state, path)?;
        if let Some(kept) = kept {
            let group = file.create_group(KEPT).at(path)?;
            let mut sink = GroupSink { group: &group, path, allowed: &[], failure: None };
            let written = kept.write(&mut sink);
            sink.outcome(written)?;
        }
        hdf::write_text_attribute(file, "state_hash", &state_hash, path)
    })?;
    Ok(state_hash)
}

/// Reads and verifies a checkpoint, or the final state in a result.
pub fn read(path: &Path) -> Result<Checkpoint, OutputError> {
    let file = sealed::open(path)?;
    if hdf::read_text_attribute(&file, "kind", path)? == kind::RESULT {
        hdf::check_identity(&file, kind::RESULT, path)?;
        if !file.link_exists(STATE) {
            return Err(OutputError::NoState { path: path.to_owned() });
        }
        let (columns, state_hash) = read_state(&file, path)?;
        let provenance = hdf::read_text(&file.group("provenance").at(path)?, "scenario", path)?;
        let kept = ColumnStore::default();
        return Ok(Checkpoint { columns, state_hash, provenance, kept, run: RunMark::default() });
    }
    hdf::check_identity(&file, kind::CHECKPOINT, path)?;
    let (columns, stored) = read_state(&file, path)?;
    let run = RunMark {
        run_id: hdf::read_text_attribute(&file, "run_id", path)?,
        segments: hdf::read_attribute(&file, "segments", path)?,
    };
    let provenance = hdf::read_text(&file, "provenance", path)?;
    let kept = if file.link_exists(KEPT) {
        hdf::read_columns(&file.group(KEPT).at(path)?, path)?
    } else {
        ColumnStore::default()
    };
    Ok(Checkpoint { columns, state_hash: stored, provenance, kept, run })
}

/// Group of the state in checkpoints and results.
pub(super) const STATE: &str = "state";

/// Group of the columns besides the state.
const KEPT: &str = "kept";

/// Reads the state and checks its hash against the one in the file.
fn read_state(file: &hdf5::Group, path: &Path) -> Result<(ColumnStore, String), OutputError> {
    let stored = hdf::read_text_attribute(file, "state_hash", path)?;
    let columns = hdf::read_columns(&file.group(STATE).at(path)?, path)?;
    let computed = super::hash::state_hash(&columns).at(path)?;
    if computed != stored {
        return Err(OutputError::StateHash { path: path.to_owned(), stored, computed });
    }
    Ok((columns, stored))
}

/// Writes the state into a file; returns the state hash.
pub(super) fn write_state(file: &hdf5::Group, state: &dyn WriteColumns, path: &Path) -> Result<String, OutputError> {
    let group = file.create_group(STATE).at(path)?;
    let mut sink = HashingSink {
        file: GroupSink { group: &group, path, allowed: &[], failure: None },
        hasher: StateHasher::default(),
    };
    let written = state.write(&mut sink);
    sink.file.outcome(written)?;
    Ok(sink.hasher.finish())
}

/// Writes and hashes the state in one pass.
struct HashingSink<'a> {
    file: GroupSink<'a>,
    hasher: StateHasher,
}

impl ColumnSink for HashingSink<'_> {
    fn column(&mut self, path: &str, column: Column<'_>) -> Result<(), ColumnError> {
        self.hasher.column(path, column)?;
        self.file.column(path, column)
    }

    fn rows(&mut self, path: &str, rows: &RowsOfReals<'_>) -> Result<(), ColumnError> {
        self.hasher.rows(path, rows)?;
        self.file.rows(path, rows)
    }

    fn described_column(&mut self, path: &str, column: Column<'_>, description: &str) -> Result<(), ColumnError> {
        self.hasher.column(path, column)?;
        self.file.described_column(path, column, description)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use concordem_solver::state::columns::ColumnSource;
    use std::fs;

    fn state() -> ColumnStore {
        let mut store = ColumnStore::default();
        let values = [1.0, -0.0, f64::from_bits(0x7ff8_0000_0000_1234), f64::MIN_POSITIVE / 4.0, 5.0, f64::INFINITY];
        store.column("particles/position", Column::f64(&values, 3, "m")).unwrap();
        store.column("particles/id", Column::u32(&[7, u32::MAX])).unwrap();
        store.column("contacts/cpm/image", Column::i8(&[-1, 0, 1], 3)).unwrap();
        store.column("contacts/none/kappa", Column::f64(&[], 1, "1")).unwrap();
        store.column("contacts/none/vector", Column::f64(&[], 3, "1")).unwrap();
        store.column("tags", Column::u64(&[u64::MAX])).unwrap();
        store.column("material", Column::u16(&[1, 2, 3])).unwrap();
        store.column("constraint", Column::u8(&[63])).unwrap();
        store
    }

    /// Reals that are not stored as rows, or the same as columns.
    struct Reals {
        as_rows: bool,
        columns: Vec<(usize, Vec<f64>)>,
    }

    impl WriteColumns for Reals {
        fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
            for (k, (components, values)) in self.columns.iter().enumerate() {
                let (path, components, unit) = (format!("reals/{k}"), *components, "m");
                if self.as_rows {
                    let numbers =
                        |rows: std::ops::Range<usize>| values[components * rows.start..components * rows.end].to_vec();
                    let count = values.len() / components;
                    sink.rows(&path, &RowsOfReals { components, unit, count, numbers: &numbers })?;
                } else {
                    sink.column(&path, Column::f64(values, components, unit))?;
                }
            }
            Ok(())
        }
    }

    /// Files of rows in pieces (of 32,768) and of whole columns have the same bytes: with zeros before, between, and after other
    /// numbers, of zeros only, and without rows.
    #[test]
    fn rows_in_pieces_give_the_same_file() {
        let mut sparse = vec![0.0; 2 * 200_000];
        (sparse[2 * 70_000], sparse[2 * 140_001 + 1]) = (1.0, -2.0);
        let full: Vec<f64> = (1..=100_000).map(f64::from).collect();
        let columns = vec![(2, sparse), (1, full), (4, vec![0.0; 4 * 40_000]), (3, Vec::new())];
        let folder = tempfile::tempdir().unwrap();
        let written = [true, false].map(|as_rows| {
            let path = folder.path().join(format!("{as_rows}.h5"));
            let hash = write(&path, &Reals { as_rows, columns: columns.clone() }, "scenario\n").unwrap();
            (hash, fs::read(&path).unwrap())
        });
        assert!(written[0].0 == written[1].0, "hashes");
        assert!(written[0].1 == written[1].1, "bytes");
    }

    #[test]
    fn a_checkpoint_is_read_back_bit_for_bit() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.h5");
        let hash = write(&path, &state(), "scenario\n").unwrap();
        let mut back = read(&path).unwrap();
        assert_eq!(back.state_hash, hash);
        assert_eq!(hash, super::super::hash::state_hash(&state()).unwrap());
        assert_eq!(back.provenance, "scenario\n");
        // Compare bytes: as numbers, -0 equals 0, and NaN does not equal itself.
        let columns = |store: &ColumnStore| {
            store
                .iter()
                .map(|(path, column)| (path.to_owned(), column.components, column.borrow().bytes().to_vec()))
                .collect::<Vec<_>>()
        };
        assert_eq!(columns(&back.columns), columns(&state()));
        assert!(back.columns.exists("contacts/none/kappa"));
        // Overwriting it gives the same file.
        let first = fs::read(&path).unwrap();
        write(&path, &state(), "scenario\n").unwrap();
        assert!(first == fs::read(&path).unwrap(), "the same state gives the same bytes");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no other files remain");
    }

    /// What a writer keeps besides the state comes back, and leaves the state hash as it was.
    #[test]
    fn columns_besides_the_state_are_read_back() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.h5");
        let mut kept = ColumnStore::default();
        kept.column("samples", Column::f64(&[1.0, 2.0, 3.0, 4.0], 2, "1")).unwrap();
        kept.column("operators/0", Column::f64(&[], 3, "1")).unwrap();
        kept.column("law", Column::u8(b"slip")).unwrap();
        let hash = write_with(&path, &state(), "scenario\n", &kept).unwrap();
        assert_eq!(hash, super::super::hash::state_hash(&state()).unwrap());
        let back = read(&path).unwrap();
        assert_eq!(back.kept, kept);
        write(&path, &state(), "scenario\n").unwrap();
        assert_eq!(read(&path).unwrap().kept, ColumnStore::default());
    }

    #[test]
    fn cuts_and_flipped_bytes_are_detected() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.h5");
        write(&path, &state(), "scenario").unwrap();
        let whole = fs::read(&path).unwrap();
        let damaged = folder.path().join("damaged.h5");
        // Strides that are coprime to the sizes of HDF5 structures, so that every kind of structure is hit.
        for length in (0..whole.len()).step_by(61) {
            fs::write(&damaged, &whole[..length]).unwrap();
            let error = read(&damaged).unwrap_err();
            assert!(matches!(error, OutputError::NotSealed { .. }), "{length}: {error}");
        }
        for position in (0..whole.len()).step_by(37).chain(whole.len() - 56..whole.len()) {
            let mut bytes = whole.clone();
            bytes[position] ^= 0x10;
            fs::write(&damaged, bytes).unwrap();
            let error = read(&damaged).unwrap_err();
            let expected = matches!(error, OutputError::NotSealed { .. } | OutputError::Damaged { .. });
            assert!(expected, "{position}: {error}");
            assert!(error.to_string().contains("damaged.h5"), "{error}");
        }
        let mut longer = whole.clone();
        longer.extend_from_slice(&whole[whole.len() - 56..]);
        fs::write(&damaged, longer).unwrap();
        assert!(matches!(read(&damaged), Err(OutputError::Damaged { .. })));
    }

    #[test]
    fn files_of_other_programs_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("foreign.h5");
        assert!(matches!(read(&path), Err(OutputError::Missing { .. })));
        assert!(matches!(read(folder.path()), Err(OutputError::NotSealed { .. })));
        for text in ["", "x,y\n1,2\n", &"long ".repeat(1000)] {
            fs::write(&path, text).unwrap();
            assert!(matches!(read(&path), Err(OutputError::NotSealed { .. })), "{text:.20}");
        }
        hdf::options().create(&path).unwrap().close().unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, OutputError::NotSealed { .. }), "{error}");
        // Sealed, but not HDF5, or HDF5 without our attributes.
        fs::write(&path, "no HDF5").unwrap();
        sealed_in_place(&path);
        let error = read(&path).unwrap_err();
        assert!(matches!(error, OutputError::Damaged { .. }), "{error}");
        sealed::write(&path, folder.path(), |_| Ok(())).unwrap();
        let error = read(&path).unwrap_err();
        assert!(matches!(error, OutputError::Damaged { .. }), "{error}");
    }

    fn sealed_in_place(path: &Path) {
        let mut bytes = fs::read(path).unwrap();
        let hash = blake3::hash(&bytes);
        let length = bytes.len() as u64;
        bytes.extend_from_slice(b"ConcorDEM-seal-1");
        bytes.extend_from_slice(&length.to_le_bytes());
        bytes.extend_from_slice(hash.as_bytes());
        fs::write(path, bytes).unwrap();
    }

    #[test]
    fn other_kinds_other_versions_and_changed_states_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("forged.h5");
        // A checkpoint with one change, and sealed again.
        let forged = |change: &dyn Fn(&hdf5::File)| {
            write(&path, &state(), "").unwrap();
            let file = hdf::options().open_rw(&path).unwrap();
            change(&file);
            file.close().unwrap();
            sealed_in_place(&path);
            read(&path).unwrap_err()
        };
        let error = forged(&|file| {
            file.delete_attr("kind").unwrap();
            hdf::write_text_attribute(file, "kind", kind::SEGMENT, &path).unwrap();
        });
        assert!(error.to_string().ends_with("forged.h5 is a result segment, not a checkpoint."), "{error}");
        let error = forged(&|file| file.attr("format_version").unwrap().write_scalar(&99_u64).unwrap());
        assert!(error.to_string().contains("has format version 99; this program reads version 3"), "{error}");
        let error = forged(&|file| file.dataset("state/particles/id").unwrap().write_raw(&[7_u32, 8]).unwrap());
        assert!(matches!(error, OutputError::StateHash { .. }), "{error}");
        let error = forged(&|file| file.unlink("state/tags").unwrap());
        assert!(matches!(error, OutputError::StateHash { .. }), "{error}");
        let error = forged(&|file| file.unlink("state").unwrap());
        assert!(matches!(error, OutputError::Hdf5 { .. }), "{error}");
        let error = forged(&|file| {
            file.new_dataset::<i32>().shape([2]).create("state/odd").unwrap();
        });
        assert!(error.to_string().contains("`odd` holds int32"), "{error}");
    }

    #[test]
    fn a_failing_state_leaves_the_old_checkpoint() {
        struct Failing;
        impl WriteColumns for Failing {
            fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
                sink.column("a", Column::u8(&[1]))?;
                sink.column("b", Column::f64(&[1.0, 2.0], 3, "m"))
            }
        }
        struct Twice;
        impl WriteColumns for Twice {
            fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
                sink.column("a", Column::u8(&[1]))?;
                sink.column("a", Column::u8(&[1]))
            }
        }
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("state.h5");
        let hash = write(&path, &state(), "").unwrap();
        for failing in [&Failing as &dyn WriteColumns, &Twice] {
            let error = write(&path, failing, "").unwrap_err();
            assert!(matches!(error, OutputError::Column { .. }), "{error}");
        }
        let error = write(&path, &state(), "a\0b").unwrap_err().to_string();
        assert!(error.contains("zero character"), "{error}");
        assert_eq!(read(&path).unwrap().state_hash, hash);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "no other files remain");
        let error = write(&folder.path().join("none/state.h5"), &state(), "").unwrap_err();
        assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    }
}
