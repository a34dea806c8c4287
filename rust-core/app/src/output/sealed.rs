//! Writes files completely or not at all, and verifies them before reading.
//!
//! A file is written under another name in the same folder, closed, read back (`read_back`), sealed, synchronized to the
//! disk, and only then renamed. The seal is described in [`concordem_files::seal`]. A file whose seal does not match is refused
//! before the HDF5 library reads it: damaged files can crash that library.
//!
//! Only regular files are replaced. If the path is a symbolic link, the link stays and its target is replaced.

use std::fs::File;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::error::{At, OutputError};
use super::hdf::options;
use super::read_back;
use concordem_files::seal::{self, SealError};
use concordem_files::{hdf5_groups, leftovers, paths};

/// Folder that holds `path`.
pub(crate) fn folder_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder.to_owned(),
        _ => PathBuf::from("."),
    }
}

/// The file to replace when writing to `path`; see [`paths::target`].
///
/// # Errors
/// The path cannot be followed.
pub fn target(path: &Path) -> Result<PathBuf, OutputError> {
    paths::target(path).map_err(|source| OutputError::NotReplaceable { path: path.to_owned(), source })
}

/// Writes an HDF5 file completely or not at all; `fill` writes its content.
///
/// `scratch` is the folder for the unfinished file; it must be in the same file system as `path`.
pub(crate) fn write(
    path: &Path,
    scratch: &Path,
    fill: impl FnOnce(&hdf5::File) -> Result<(), OutputError>,
) -> Result<(), OutputError> {
    let path = &target(path)?;
    let unfinished = new_unfinished(path, scratch)?;
    let early = unfinished.as_file().try_clone().and_then(EarlySync::begin);
    let early = early.map_err(|error| OutputError::io(path, "write", error))?;
    // Errors of the library must name the final file, not the temporary one.
    let content = options().create(unfinished.path()).at(path)?;
    let filled =
        fill(&content).and_then(|()| content.flush().at(path)).and_then(|()| read_back::datasets(&content, path));
    let closed = content.close().at(path);
    let datasets = filled?;
    closed?;
    early.end().map_err(|error| OutputError::io(path, "write", error))?;
    read_back::check(unfinished.path(), &datasets, path)?;
    seal::append(unfinished.path()).map_err(|error| OutputError::io(path, "write", error))?;
    put_in_place(unfinished, path)
}

/// Time between two early synchronizations. Most files are complete before the first one.
const PAUSE: Duration = Duration::from_millis(300);

/// Brings the content of a large file to the disk while the rest is computed, so that the last synchronization has little to wait for.
struct EarlySync {
    /// Dropping it ends the thread.
    filling: mpsc::Sender<()>,
    thread: JoinHandle<io::Result<()>>,
}

impl EarlySync {
    fn begin(file: File) -> io::Result<Self> {
        let (filling, filled) = mpsc::channel();
        let thread = thread::Builder::new().spawn(move || {
            while filled.recv_timeout(PAUSE) == Err(RecvTimeoutError::Timeout) {
                file.sync_data()?;
            }
            Ok(())
        })?;
        Ok(Self { filling, thread })
    }

    /// Ends it. The system reports a failure of the disk only once, so it must not get lost here.
    fn end(self) -> io::Result<()> {
        drop(self.filling);
        self.thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic))
    }
}

/// Writes a text file completely or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_text(path: &Path, text: &str) -> Result<(), OutputError> {
    let mut file = TextFile::create(path)?;
    file.put(text)?;
    file.finish()
}

/// Writes a file of bytes, such as a picture, completely or not at all.
///
/// # Errors
/// The file cannot be written.
pub fn write_bytes(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let mut file = TextFile::create(path)?;
    file.put_bytes(bytes)?;
    file.finish()
}

/// Writes a text file completely or not at all, unless it exists.
pub(crate) fn write_new_text(path: &Path, text: &str) -> Result<(), OutputError> {
    if path.exists() {
        return Err(OutputError::Exists { path: path.to_owned() });
    }
    let mut file = TextFile::create(path)?;
    file.put(text)?;
    let unfinished = file.complete()?;
    let file = unfinished.persist_noclobber(path).map_err(|error| match error.error.kind() {
        io::ErrorKind::AlreadyExists => OutputError::Exists { path: path.to_owned() },
        _ => OutputError::io(path, "rename to", error.error),
    })?;
    let _ = file.unlock();
    sync_folder(&folder_of(path))
}

/// A file that is written in parts, completely or not at all.
pub(crate) struct TextFile {
    path: PathBuf,
    unfinished: io::BufWriter<tempfile::NamedTempFile>,
}

impl TextFile {
    pub(crate) fn create(path: &Path) -> Result<Self, OutputError> {
        let path = target(path)?;
        let unfinished = io::BufWriter::new(new_unfinished(&path, &folder_of(&path))?);
        Ok(Self { path, unfinished })
    }

    /// Appends text.
    pub(crate) fn put(&mut self, text: &str) -> Result<(), OutputError> {
        self.put_bytes(text.as_bytes())
    }

    fn put_bytes(&mut self, bytes: &[u8]) -> Result<(), OutputError> {
        self.unfinished.write_all(bytes).map_err(|error| OutputError::io(&self.path, "write", error))
    }

    /// Puts the file in its place; without this call nothing is kept.
    pub(crate) fn finish(self) -> Result<(), OutputError> {
        let path = self.path.clone();
        put_in_place(self.complete()?, &path)
    }

    /// The file, whose content is on the disk.
    fn complete(self) -> Result<tempfile::NamedTempFile, OutputError> {
        let failed = |error| OutputError::io(&self.path, "write", error);
        let unfinished = self.unfinished.into_inner().map_err(|error| failed(error.into_error()))?;
        unfinished.as_file().sync_all().map_err(failed)?;
        Ok(unfinished)
    }
}

fn new_unfinished(path: &Path, scratch: &Path) -> Result<tempfile::NamedTempFile, OutputError> {
    // What killed processes have left.
    leftovers::sweep(scratch);
    paths::new_unfinished(scratch).map_err(|error| match error.kind() {
        io::ErrorKind::NotFound if !scratch.is_dir() => OutputError::NoFolder { path: scratch.to_owned() },
        io::ErrorKind::NotFound => OutputError::not_writable(scratch, &error),
        _ => OutputError::io(path, "create", error),
    })
}

fn put_in_place(unfinished: tempfile::NamedTempFile, path: &Path) -> Result<(), OutputError> {
    paths::put_in_place(unfinished, path).map_err(|error| OutputError::io(path, "rename to", error))?;
    sync_folder(&folder_of(path))
}

/// Synchronizes renamed and removed files of a folder to disk.
pub(crate) fn sync_folder(folder: &Path) -> Result<(), OutputError> {
    paths::sync_folder(folder).map_err(|error| OutputError::io(folder, "synchronize", error))
}

/// Checks that a file is complete and unchanged.
pub fn verify(path: &Path) -> Result<(), OutputError> {
    seal::check(path).map_err(|error| match error {
        SealError::Io(error) if error.kind() == io::ErrorKind::NotFound => {
            OutputError::Missing { path: path.to_owned() }
        }
        SealError::Io(source) => OutputError::Io { path: path.to_owned(), action: "read", source },
        SealError::Differs(problem) => OutputError::Damaged { path: path.to_owned(), problem: problem.to_owned() },
        _ => OutputError::NotSealed { path: path.to_owned() },
    })
}

/// Verifies a sealed HDF5 file and opens it for reading.
pub(crate) fn open(path: &Path) -> Result<hdf5::File, OutputError> {
    verify(path)?;
    // A forged file can have a valid seal.
    hdf5_groups::check(path)
        .map_err(|problem| OutputError::Damaged { path: path.to_owned(), problem: format!("it {problem}") })?;
    options().open(path).at(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A process that another thread forks has a copy of each open descriptor until it starts its program. A copy of the descriptor
    /// stands for it: both belong to one lock.
    #[test]
    fn a_finished_file_is_not_locked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("finished");
        let unfinished = new_unfinished(&path, folder.path()).unwrap();
        let of_fork = unfinished.as_file().try_clone().unwrap();
        assert!(File::open(unfinished.path()).unwrap().try_lock().is_err());
        put_in_place(unfinished, &path).unwrap();
        File::open(&path).unwrap().try_lock().unwrap();
        drop(of_fork);
    }
}
