//! Files that a scenario reads, and places that results are written to.

use std::fs::{self, File};
use std::io::{self, ErrorKind, Read};
use std::path::{Path, PathBuf};

/// Largest text that is read as a scenario or a sweep, bytes. A device such as `/dev/zero` never ends.
pub const LONGEST_TEXT: u64 = 64 << 20;
/// Symbolic links that [`target`] follows, as many as Linux does.
const MOST_LINKS: usize = 40;

/// Opens a regular file, or a symbolic link to one, for reading.
///
/// # Errors
/// The file cannot be opened, or is a folder, a device, or a pipe: reading these may never end.
pub fn open_regular(path: &Path) -> io::Result<File> {
    // Look before opening: opening a pipe waits for its writer.
    if !fs::metadata(path)?.is_file() {
        return Err(not_regular());
    }
    File::open(path)
}

/// Reads a short text file: at most [`LONGEST_TEXT`] bytes.
///
/// # Errors
/// The file cannot be read, or is longer.
pub fn read_short(path: &Path) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    File::open(path)?.take(LONGEST_TEXT + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > LONGEST_TEXT {
        let limit = LONGEST_TEXT >> 20;
        return Err(io::Error::new(ErrorKind::InvalidData, format!("it is longer than {limit} MiB, the limit")));
    }
    Ok(bytes)
}

/// The file that writing to `path` replaces: symbolic links are followed, so that the link stays and its target changes.
///
/// # Errors
/// Something that is not a regular file: a folder, a device, a pipe, a socket.
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
            // A new file, or a path that cannot be; creating it says what is wrong.
            Err(_) => return Ok(path),
        }
    }
    Err(io::Error::new(ErrorKind::InvalidInput, "its symbolic links have no end"))
}

fn not_regular() -> io::Error {
    io::Error::new(ErrorKind::InvalidInput, "it is not a regular file (a folder, a device, or a pipe)")
}
