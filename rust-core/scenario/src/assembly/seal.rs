//! The closing mark of files: 56 bytes after the content (other readers of HDF5 ignore them).
//!
//! A 16-byte identifier, the length of the content as little-endian `u64`, and the BLAKE3 hash of the content.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

const MAGIC: &[u8; 16] = b"ConcorDEM-seal-1";
const LENGTH: u64 = 16 + 8 + 32;

/// What is wrong with the mark of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SealError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// There is no mark.
    #[error("its closing mark is missing")]
    Missing,
    /// The mark does not fit the content.
    #[error("{0}")]
    Differs(&'static str),
}

/// Appends the mark to a complete file, and synchronizes it to the disk.
///
/// # Errors
/// The file cannot be read or written.
pub fn append(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).append(true).open(path)?;
    let mut hasher = blake3::Hasher::new();
    hasher.update_reader(&mut file)?;
    let mut mark = Vec::with_capacity(LENGTH as usize);
    mark.extend_from_slice(MAGIC);
    mark.extend_from_slice(&hasher.count().to_le_bytes());
    mark.extend_from_slice(hasher.finalize().as_bytes());
    file.write_all(&mark)?;
    file.sync_all()
}

/// Checks that a file is complete and unchanged.
///
/// # Errors
/// The file cannot be read, has no mark, or another content.
pub fn check(path: &Path) -> Result<(), SealError> {
    // Opening a pipe would wait forever for a writer; a folder can be opened but not read.
    if !fs::metadata(path)?.is_file() {
        return Err(SealError::Missing);
    }
    let mut file = File::open(path)?;
    let length = file.metadata()?.len();
    let content = length.checked_sub(LENGTH).ok_or(SealError::Missing)?;
    let mut mark = [0; LENGTH as usize];
    file.seek(SeekFrom::Start(content))?;
    file.read_exact(&mut mark)?;
    if &mark[..16] != MAGIC {
        return Err(SealError::Missing);
    }
    if mark[16..24] != content.to_le_bytes() {
        return Err(SealError::Differs("it has not the length with which it was written"));
    }
    let mut hasher = blake3::Hasher::new();
    file.seek(SeekFrom::Start(0))?;
    hasher.update_reader(file.take(content))?;
    if mark[24..] != *hasher.finalize().as_bytes() {
        return Err(SealError::Differs("its content differs from what was written"));
    }
    Ok(())
}
