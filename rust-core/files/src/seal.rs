//! The seal of our files: 56 bytes after the content (other HDF5 readers ignore them).
//!
//! The seal holds a 16-byte identifier, the length of the content as little-endian `u64`, and the BLAKE3 hash of the
//! content.

use std::fs::{self, File};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::Path;

const MAGIC: &[u8; 16] = b"ConcorDEM-seal-1";
const LENGTH: u64 = 16 + 8 + 32;
/// Bytes that are read and hashed at a time.
const BLOCK: u64 = 8 << 20;

/// What is wrong with the seal of a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SealError {
    /// The file cannot be read.
    #[error("{0}")]
    Io(#[from] io::Error),
    /// The seal is missing.
    #[error("its seal (a hash at the end of the file) is missing")]
    Missing,
    /// The seal does not match the content.
    #[error("{0}")]
    Differs(&'static str),
}

/// Appends the seal to a complete file, and synchronizes the file to disk.
///
/// # Errors
/// The file cannot be read or written.
pub fn append(path: &Path) -> io::Result<()> {
    let mut file = File::options().read(true).append(true).open(path)?;
    let hasher = hash(&mut file)?;
    let mut mark = Vec::with_capacity(LENGTH as usize);
    mark.extend_from_slice(MAGIC);
    mark.extend_from_slice(&hasher.count().to_le_bytes());
    mark.extend_from_slice(hasher.finalize().as_bytes());
    file.write_all(&mark)?;
    file.sync_all()
}

/// Hashes all that remains to be read, on all threads.
fn hash(reader: &mut impl Read) -> io::Result<blake3::Hasher> {
    let (mut hasher, mut block) = (blake3::Hasher::new(), Vec::new());
    while reader.by_ref().take(BLOCK).read_to_end(&mut block)? > 0 {
        hasher.update_rayon(&block);
        block.clear();
    }
    Ok(hasher)
}

/// Checks that a file is complete and unchanged.
///
/// # Errors
/// The file cannot be read, has no seal, or its content does not match the seal.
pub fn check(path: &Path) -> Result<(), SealError> {
    // Opening a pipe would block until it has a writer; a folder can be opened but not read.
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
        return Err(SealError::Differs("its length has changed since it was written"));
    }
    file.seek(SeekFrom::Start(0))?;
    let hasher = hash(&mut file.take(content))?;
    if mark[24..] != *hasher.finalize().as_bytes() {
        return Err(SealError::Differs("its content has changed since it was written"));
    }
    Ok(())
}
