//! Compares the datasets of a complete file with what was written into it.
//!
//! Neither the HDF5 library nor every file system reports each write that failed. So a file is closed and opened again, and every
//! dataset is read and compared with the hash of the values that it was given ([`hdf::complete`]), before the file gets its seal.

use std::collections::BTreeSet;
use std::path::Path;

use hdf5::types::{IntSize, TypeDescriptor};
use hdf5::{Dataset, Group};

use super::error::{At, OutputError};
use super::frames;
use super::hdf::{self, options};
use concordem_files::hdf5_text;

/// Bytes that are read and hashed at a time.
const BLOCK: usize = 8 << 20;

/// Names of all datasets of an open file.
pub(super) fn datasets(file: &Group, path: &Path) -> Result<BTreeSet<String>, OutputError> {
    let (mut names, mut groups) = (BTreeSet::new(), vec![(String::new(), file.clone())]);
    while let Some((prefix, group)) = groups.pop() {
        for name in group.member_names().at(path)? {
            let full = format!("{prefix}{name}");
            match group.group(&name) {
                Ok(inner) => groups.push((format!("{full}/"), inner)),
                Err(_) => _ = names.insert(full),
            }
        }
    }
    Ok(names)
}

/// Compares the closed file at `unfinished`, which becomes `path`, with what was written into it: `names` of its datasets, and their
/// hashes.
pub(super) fn check(unfinished: &Path, names: &BTreeSet<String>, path: &Path) -> Result<(), OutputError> {
    let differs = |problem: String| OutputError::NotAsWritten { path: path.to_owned(), problem };
    let unreadable = |error: OutputError| differs(format!("the file ({error})"));
    let file = options().open(unfinished).at(path).map_err(unreadable)?;
    if datasets(&file, path).map_err(unreadable)? != *names {
        return Err(differs("its list of tables".to_owned()));
    }
    for name in names {
        let unreadable = |error: OutputError| differs(format!("`{name}` ({error})"));
        let dataset = file.dataset(name).at(path).map_err(unreadable)?;
        let stored = hdf::stored_hash(&dataset, path).map_err(unreadable)?;
        if hash(unfinished, &dataset).map_err(unreadable)? != stored {
            return Err(differs(format!("`{name}`")));
        }
    }
    file.close().at(path)
}

/// Hash of the values of a dataset in the file at `path`.
fn hash(path: &Path, dataset: &Dataset) -> Result<String, OutputError> {
    let mut hasher = blake3::Hasher::new();
    let kind = dataset.dtype().and_then(|kind| kind.to_descriptor()).at(path)?;
    if kind == TypeDescriptor::VarLenUnicode {
        let text = hdf5_text::dataset(path, dataset);
        hasher.update(text.map_err(|problem| hdf::damaged(path, problem))?.as_bytes());
        return Ok(hasher.finalize().to_hex().to_string());
    }
    let shape = dataset.shape();
    let (rows, components) = (shape.first().copied().unwrap_or(0), shape.get(1).copied().unwrap_or(1));
    let each = (BLOCK / (8 * components.max(1))).max(1);
    for first in (0..rows).step_by(each) {
        let (from, count) = (first as u64, each.min(rows - first));
        if kind == TypeDescriptor::Integer(IntSize::U8) {
            hdf::add_to_hash(&mut hasher, &frames::part::<i64>(dataset, from, count, components, path)?);
        } else {
            hdf::add_to_hash(&mut hasher, frames::column(dataset, from, count, path)?.borrow().bytes());
        }
    }
    Ok(hasher.finalize().to_hex().to_string())
}
