//! Reading the files of a scenario, and checking the paths that results are written to.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Size limit of a scenario or sweep file, bytes. Without it, reading a device such as `/dev/zero` would never end.
pub const LONGEST_TEXT: u64 = 64 << 20;
/// Number of symbolic links that [`target`] follows; the limit of Linux.
const MOST_LINKS: usize = 40;

/// Whether a packing file is HDF5, by its extension.
pub fn is_hdf5(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "h5" || extension == "hdf5")
}

/// Opens a regular file, or a symbolic link to one, for reading.
///
/// # Errors
/// The file cannot be opened, or is a folder, a device, or a pipe, which may never end.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Check before opening: opening a pipe blocks until it has a writer.
    if !fs::metadata(path)?.is_file() {
        return Err(not_regular());
    }
    File::open(path)
}

/// Reads a short text file: at most [`LONGEST_TEXT`] bytes.
///
/// # Errors
/// The file cannot be read or exceeds the limit.
pub fn read_short(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST_TEXT + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST_TEXT {
        let limit = LONGEST_TEXT >> 20;
        return Err(io::Error::new(ErrorKind::InvalidData, format!("it is longer than {limit} MiB, the limit")));
    }
    Ok(bytes)
}

/// The file to replace when writing to `path`. Follows symbolic links, so that a link stays and its target changes.
///
/// # Errors
/// The path leads to a folder, a device, a pipe, or a socket, or its symbolic links form a loop.
pub fn target(path: &Path) -> io::Result<PathBuf> {
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match fs::symlink_metadata(&path) {
            Ok(data) if data.is_symlink() => {
                let next = fs::read_link(&path)?;
                path = path.parent().unwrap_or_else(|| Path::new("")).join(next);
            }
            Ok(data) if data.is_file() => return Ok(path),
            Ok(_) => return Err(not_regular()),
            // A new file, or an invalid path; creating the file will report the error.
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::new(ErrorKind::InvalidInput, "its symbolic links have no end"))
}

fn not_regular() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it is not a regular file (a folder, a device, or a pipe)")
}
