//! Files that are complete or absent.
//!
//! A file is written under another name in the same folder, closed, sealed, synchronized to the disk, and only then
//! renamed. The seal is 56 bytes after the HDF5 content (other readers ignore them): a 16-byte identifier,
//! the length of the content as little-endian `u64`, and the BLAKE3 hash of the content. A file whose seal
//! does not match is refused before the HDF5 library reads it: damaged files can crash that library.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};

use super::error::{At, OutputError};
use super::hdf::options;

const MAGIC: &[u8; 16] = b"ConcorDEM-seal-1";
const SEAL_LENGTH: u64 = 16 + 8 + 32;

/// Folder that holds `path`.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// Write an HDF5 file completely or not at all; `fill` writes its content.
///
/// `scratch` is the folder of the unfinished file, in the same file system as `path`.
pub(crate) fn write(
    path: &Path,
    scratch: &Path,
    fill: impl FnOnce(&hdf5::File) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let unfinished = new_unfinished(path, scratch)?;
    // Errors of the library must name the file that the user knows, not the temporary one.
    let content = options().create(unfinished.path()).at(path)?;
    let filled = fill(&content).and_then(|()| content.flush().at(path));
    let closed = content.close().at(path);
    filled?;
    closed?;
    seal(unfinished.path(), path)?;
    put_in_place(unfinished, path)
}

/// Write text completely or not at all.
pub(crate) fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    let mut unfinished = new_unfinished(path, &folder_of(path))?;
    unfinished
        .write_all(text.as_bytes())
        .and_then(|()| unfinished.as_file().sync_all())
        .map_err(|error| OutputError::io(path, "write", error))?;
    put_in_place(unfinished, path)
}

fn new_unfinished(path: &Path, scratch: &Path) -> Result<tempfile::NamedTempFile, OutputError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".unfinished-");
    // The default of the crate is private; results get the permissions of other files.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    builder.tempfile_in(scratch).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound => OutputError::NoFolder { path: scratch.to_owned() },
        _ => OutputError::io(path, "create", error),
    })
}

fn put_in_place(unfinished: tempfile::NamedTempFile, path: &Path) -> Result<(), OutputError> {
    unfinished.persist(path).map_err(|error| OutputError::io(path, "rename to", error.error))?;
    sync_folder(&folder_of(path))
}

/// Synchronize renamed and removed files of a folder to the disk.
pub(crate) fn sync_folder(folder: &Path) -> Result<(), OutputError> {
    File::open(folder)
        .and_then(|folder| folder.sync_all())
        .map_err(|error| OutputError::io(folder, "synchronize", error))
}

fn seal(unfinished: &Path, path: &Path) -> Result<(), OutputError> {
    let failed = |error| OutputError::io(path, "write", error);
    let mut file = File::options().read(true).append(true).open(unfinished).map_err(failed)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(&mut file).map_err(failed)?;
    let mut mark = Vec::with_capacity(SEAL_LENGTH as usize);
    mark.extend_from_slice(MAGIC);
    mark.extend_from_slice(&hasher.count().to_le_bytes());
    mark.extend_from_slice(hasher.finalize().as_bytes());
    file.write_all(&mark).and_then(|()| file.sync_all()).map_err(failed)
}

/// Check that a file is complete and unchanged.
pub fn verify(path: &Path) -> Result<(), OutputError> {
    let failed = |error: io::Error| match error.kind() {
        io::ErrorKind::NotFound => OutputError::Missing { path: path.to_owned() },
        _ => OutputError::Io { path: path.to_owned(), action: "read", source: error },
    };
    let not_sealed = || OutputError::NotSealed { path: path.to_owned() };
    // Opening a pipe would wait forever for a writer; a folder can be opened but not read.
    if !fs::metadata(path).map_err(failed)?.is_file() {
        return Err(not_sealed());
    }
    let mut file = File::open(path).map_err(failed)?;
    let length = file.metadata().map_err(failed)?.len();
    let content = length.checked_sub(SEAL_LENGTH).ok_or_else(not_sealed)?;
    let mut mark = [0; SEAL_LENGTH as usize];
    file.seek(SeekFrom::Start(content)).and_then(|_| file.read_exact(&mut mark)).map_err(failed)?;
    if &mark[..16] != MAGIC {
        return Err(not_sealed());
    }
    let damaged = |problem: &str| OutputError::Damaged { path: path.to_owned(), problem: problem.to_owned() };
    if mark[16..24] != content.to_le_bytes() {
        return Err(damaged("it has not the length with which it was written"));
    }
    let mut hasher = blake3::Hasher::new();
    file.seek(SeekFrom::Start(0)).map_err(failed)?;
    hasher.update_reader(file.take(content)).map_err(failed)?;
    if mark[24..] != *hasher.finalize().as_bytes() {
        return Err(damaged("its content differs from what was written"));
    }
    Ok(())
}

/// Open a sealed HDF5 file for reading, after checking it.
pub(crate) fn open(path: &Path) -> Result<hdf5::File, OutputError> {
    verify(path)?;
    options().open(path).at(path)
}
