//! Errors when reading or writing files. Every message names the file and a remedy.

use std::io;
use std::path::{Path, PathBuf};

use concordem_solver::state::columns::ColumnError;

/// Error when reading or writing a file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The result already exists.
    #[error("{} already exists. Choose another name, or overwrite it with --force.", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// An unfinished run with this result name exists.
    #[error(
        "{} belongs to an unfinished run. Continue it with `concordem resume`, or discard it with --force.",
        path.display()
    )]
    Unfinished {
        /// Folder of the unfinished run.
        path: PathBuf,
    },
    /// Another process is working on the run.
    #[error("{} is in use by another process. Wait until it ends, or choose another name.", path.display())]
    Busy {
        /// Folder of the run.
        path: PathBuf,
    },
    /// The file or folder cannot be written.
    #[error("{} cannot be written: {source}. Check the permissions of the folder, or choose another folder.", path.display())]
    NotWritable {
        /// The file or folder.
        path: PathBuf,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The path leads to something that we never replace, such as a device.
    #[error("{} cannot be written: {source}. Choose another name.", path.display())]
    NotReplaceable {
        /// The path.
        path: PathBuf,
        /// What it is.
        source: io::Error,
    },
    /// The folder does not exist.
    #[error("the folder {} does not exist. Create it, or choose another folder.", path.display())]
    NoFolder {
        /// The folder.
        path: PathBuf,
    },
    /// No space is left on the device.
    #[error(
        "no space for {}: {message}. Free some space, then continue with `concordem resume`; earlier data are \
         intact.",
        path.display()
    )]
    NoSpace {
        /// The file that could not be written.
        path: PathBuf,
        /// Error of the operating system.
        message: String,
    },
    /// What was written is not what the file holds.
    #[error(
        "{} was not kept: {problem}, read back, is not what was written. The disk or the file system lost it; repeat the command, or \
         continue a run with `concordem resume`.",
        path.display()
    )]
    NotAsWritten {
        /// The file.
        path: PathBuf,
        /// What differs.
        problem: String,
    },
    /// Another error of the operating system.
    #[error("{}: cannot {action}: {source}.", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Attempted action.
        action: &'static str,
        /// Error of the operating system.
        source: io::Error,
    },
    /// The file does not exist.
    #[error("{} does not exist. Check the name.", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// There is neither a result nor the working folder of an unfinished run.
    #[error(
        "there is no run {}: neither the result nor the folder {} of an unfinished run exists. Check the name.",
        path.display(),
        parts.display()
    )]
    NoRun {
        /// The result.
        path: PathBuf,
        /// The working folder.
        parts: PathBuf,
    },
    /// The file was not written by this program, or is incomplete.
    #[error(
        "{} is not a complete file of this program: its seal is missing. Another program wrote or changed it, \
         or it is cut off; use an intact copy.",
        path.display()
    )]
    NotSealed {
        /// The file.
        path: PathBuf,
    },
    /// The content has changed since it was written.
    #[error("{} is damaged: {problem}. Use an intact copy or an older checkpoint, or repeat the run.", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// The file is of the wrong kind.
    #[error("{} is a {found}, not a {expected}.", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// Its kind.
        found: String,
        /// The expected kind.
        expected: &'static str,
    },
    /// The file has an unknown format version.
    #[error(
        "{} has format version {found}; this program reads version {supported}. Use the program version that wrote \
         it: {written_by}.",
        path.display()
    )]
    Version {
        /// The file.
        path: PathBuf,
        /// Its format version.
        found: u64,
        /// The supported version.
        supported: u64,
        /// The program version that wrote it.
        written_by: String,
    },
    /// The state differs from the one that was written.
    #[error(
        "{}: the state has the hash {computed}, but the file records {stored}. Use an older checkpoint, or repeat the run.",
        path.display()
    )]
    StateHash {
        /// The file.
        path: PathBuf,
        /// Hash in the file.
        stored: String,
        /// Hash of the state read.
        computed: String,
    },
    /// The folder with the name of the run's working folder contains other files.
    #[error(
        "{} is not the working folder of a run: it contains `{found}`. Move it away, or choose another name for the result.",
        path.display()
    )]
    NotParts {
        /// The folder.
        path: PathBuf,
        /// A file in it that no run writes.
        found: String,
    },
    /// A run has no usable checkpoint.
    #[error(
        "{} has no usable checkpoint{}. Run the scenario again with --force.",
        path.display(),
        reasons.iter().flat_map(|reason| ["; ", reason]).collect::<String>()
    )]
    NoCheckpoint {
        /// Folder of the run.
        path: PathBuf,
        /// Why the checkpoints found cannot be used.
        reasons: Vec<String>,
    },
    /// The result was written by an older version of the program and has no state to continue from.
    #[error("{} has no state: an older version of this program wrote it. Run its scenario again.", path.display())]
    NoState {
        /// The file.
        path: PathBuf,
    },
    /// A dataset is missing.
    #[error("{} has no `{name}`. It has: {}.", path.display(), available.join(", "))]
    NoDataset {
        /// The file.
        path: PathBuf,
        /// Name of the dataset.
        name: String,
        /// Datasets of the file.
        available: Vec<String>,
    },
    /// A group is not a table of columns.
    #[error("`{name}` of {} is not a table of numbers: {problem}.", path.display())]
    NoTable {
        /// The file.
        path: PathBuf,
        /// Name of the group.
        name: String,
        /// What is in it.
        problem: String,
    },
    /// A name cannot be used in a file.
    #[error("`{name}` cannot name {what}: {problem}.")]
    Name {
        /// The name.
        name: String,
        /// What it names.
        what: &'static str,
        /// What is wrong.
        problem: &'static str,
    },
    /// The number of values of a sample differs from the number of series of the run.
    #[error("a sample has {found} values, but the run has {expected} series")]
    SampleWidth {
        /// Number of series.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// The fields of a snapshot differ from those of the first one.
    #[error("snapshot at step {step}: {problem}")]
    Snapshot {
        /// Step of the snapshot.
        step: u64,
        /// What is wrong.
        problem: String,
    },
    /// The columns do not match the state.
    #[error("{}: {source}", path.display())]
    Column {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: ColumnError,
    },
    /// The HDF5 library failed.
    #[error("{}: HDF5: {message}.", path.display())]
    Hdf5 {
        /// The file.
        path: PathBuf,
        /// Error of the library.
        message: String,
    },
    /// The report cannot be written.
    #[error("no report: {problem}")]
    Report {
        /// Cause.
        problem: String,
    },
}

impl OutputError {
    /// Error of the operating system during `action` on `path`.
    pub fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::FileTooLarge | io::ErrorKind::QuotaExceeded => {
                Self::NoSpace { path, message: source.to_string() }
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::NotADirectory => {
                Self::not_writable(&path, &source)
            }
            _ => Self::Io { path, action, source },
        }
    }

    /// The file or folder cannot be written. A working folder is named in full, and a temporary file not at all.
    pub(crate) fn not_writable(path: &Path, source: &io::Error) -> Self {
        let path = if path == Path::new(".") { std::env::current_dir().ok() } else { None }.unwrap_or(path.to_owned());
        let cause = source.get_ref().and_then(|inner| inner.source()).map(ToString::to_string);
        let source = cause.map_or_else(|| io::Error::from(source.kind()), |cause| io::Error::new(source.kind(), cause));
        Self::NotWritable { path, source }
    }

    /// Error of the HDF5 library for `path`.
    pub(crate) fn hdf5(path: &Path, error: &hdf5::Error) -> Self {
        let path = path.to_owned();
        // The library stores the system error as text, and only in the innermost frames.
        let system = error.stack().and_then(|stack| {
            stack.iter().find_map(|frame| {
                let text = frame.desc();
                ["No space left", "File too large", "quota exceeded"]
                    .into_iter()
                    .find(|sign| text.contains(sign))
                    .map(str::to_owned)
            })
        });
        match system {
            Some(message) => Self::NoSpace { path, message },
            None => Self::Hdf5 { path, message: error.to_string() },
        }
    }
}

/// Attaches a path to an error.
pub(crate) trait At<T> {
    fn at(self, path: &Path) -> Result<T, OutputError>;
}

impl<T> At<T> for hdf5::Result<T> {
    fn at(self, path: &Path) -> Result<T, OutputError> {
        self.map_err(|error| OutputError::hdf5(path, &error))
    }
}

impl<T> At<T> for Result<T, ColumnError> {
    fn at(self, path: &Path) -> Result<T, OutputError> {
        self.map_err(|source| OutputError::Column { path: path.to_owned(), source })
    }
}
