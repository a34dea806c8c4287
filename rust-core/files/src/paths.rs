//! Regular files to read, and files that get their name when they are complete.

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

/// Beginning of the names of files and folders that are not complete yet.
pub const UNFINISHED: &str = ".unfinished-";

/// A file in `folder` that gets its name when it is complete. It is locked before it has content, so that others can tell what a killed
/// process has left: what has content, and is free. On network file systems without locks, such leftovers stay.
///
/// # Errors
/// The file cannot be created.
pub fn new_unfinished(folder: &Path) -> io::Result<tempfile::NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    // The crate creates private files by default; results get the usual permissions.
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o666));
    let unfinished = builder.tempfile_in(folder)?;
    let _ = unfinished.as_file().try_lock();
    Ok(unfinished)
}

/// Gives a complete file its name, replaces what had it, and brings it to the disk. The content must be there already.
///
/// # Errors
/// The file cannot be renamed.
pub fn put_in_place(unfinished: tempfile::NamedTempFile, path: &Path) -> io::Result<()> {
    let (file, place) = unfinished.into_parts();
    fs::rename(&place, path)?;
    // Nothing has the name of the unfinished file now.
    let _ = place.keep();
    // Closing the file would not release the lock while a child process that another thread just forked has a copy of the
    // descriptor, and readers that lock the file, as HDF5 does by default, would fail.
    let _ = file.unlock();
    Ok(())
}

/// Brings the names of a folder to the disk: of files renamed and removed in it.
///
/// # Errors
/// The folder cannot be opened or synchronized.
pub fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

fn not_regular() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it is not a regular file (a folder, a device, or a pipe)")
}
