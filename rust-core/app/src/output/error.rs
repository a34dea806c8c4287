//! What can go wrong with files. Every message names the file and what to do about it.

use std::io;
use std::path::{Path, PathBuf};

use concordem_solver::state::columns::ColumnError;

/// What can go wrong when files are written or read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutputError {
    /// The result exists.
    #[error("{} exists already. Choose another name, or overwrite it with --force.", path.display())]
    Exists {
        /// The file.
        path: PathBuf,
    },
    /// An unfinished run of that name exists.
    #[error(
        "{} belongs to an unfinished run. Go on with it by `concordem resume`, or discard it with --force.",
        path.display()
    )]
    Unfinished {
        /// Folder of the unfinished run.
        path: PathBuf,
    },
    /// Another process works on the run.
    #[error("{} is in use by another process. Wait until it is done, or choose another name.", path.display())]
    Busy {
        /// Folder of the run.
        path: PathBuf,
    },
    /// The place cannot be written to.
    #[error("{} cannot be written: {source}. Check the folder's permissions, or choose another place.", path.display())]
    NotWritable {
        /// The file or folder.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The folder does not exist.
    #[error("the folder {} does not exist. Create it, or choose another place.", path.display())]
    NoFolder {
        /// The folder.
        path: PathBuf,
    },
    /// No space is left.
    #[error(
        "no space for {}: {message}. Free some space, then go on with `concordem resume`; what was written before \
         is intact.",
        path.display()
    )]
    NoSpace {
        /// The file that was to be written.
        path: PathBuf,
        /// What the system said.
        message: String,
    },
    /// The system failed otherwise.
    #[error("{}: cannot {action}: {source}.", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The file does not exist.
    #[error("{} does not exist. Check the name.", path.display())]
    Missing {
        /// The file.
        path: PathBuf,
    },
    /// The file was not written by this program, or its end is lost.
    #[error(
        "{} is no complete file of this program: its closing mark is missing. It is foreign, cut off, or was changed \
         by another program; use an intact copy.",
        path.display()
    )]
    NotSealed {
        /// The file.
        path: PathBuf,
    },
    /// The content differs from what was written.
    #[error("{} is damaged: {problem}. Use an intact copy or an older checkpoint, or run again.", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        problem: String,
    },
    /// The file is of another kind.
    #[error("{} is a {found}, not a {expected}.", path.display())]
    Kind {
        /// The file.
        path: PathBuf,
        /// What it is.
        found: String,
        /// What it should be.
        expected: &'static str,
    },
    /// The file is of another version.
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
        /// The version that is understood.
        supported: u64,
        /// The program version that wrote it.
        written_by: String,
    },
    /// The state is not the one that was written.
    #[error(
        "{}: the state read has the hash {computed}, the file says {stored}. Use an older checkpoint, or run again.",
        path.display()
    )]
    StateHash {
        /// The file.
        path: PathBuf,
        /// Hash in the file.
        stored: String,
        /// Hash of what was read.
        computed: String,
    },
    /// A run has no usable checkpoint.
    #[error(
        "{} holds no usable checkpoint{}. Run the scenario again with --force.",
        path.display(),
        reasons.iter().flat_map(|reason| ["; ", reason]).collect::<String>()
    )]
    NoCheckpoint {
        /// Folder of the run.
        path: PathBuf,
        /// Why the checkpoints found cannot be used.
        reasons: Vec<String>,
    },
    /// A dataset is missing.
    #[error("{} has no `{name}`. It has: {}.", path.display(), available.join(", "))]
    NoDataset {
        /// The file.
        path: PathBuf,
        /// What was asked for.
        name: String,
        /// What there is.
        available: Vec<String>,
    },
    /// A name cannot be used in a file.
    #[error("`{name}` cannot name {what}: {problem}.")]
    Name {
        /// The name.
        name: String,
        /// What it names.
        what: &'static str,
        /// What is wrong with it.
        problem: &'static str,
    },
    /// A sample has another count of values than there are series.
    #[error("a sample holds {found} values where the run has {expected} series")]
    SampleWidth {
        /// Count of series.
        expected: usize,
        /// Count of values.
        found: usize,
    },
    /// A snapshot differs in its fields from the first one.
    #[error("snapshot at step {step}: {problem}")]
    Snapshot {
        /// Step of the snapshot.
        step: u64,
        /// What is wrong with it.
        problem: String,
    },
    /// State and columns do not fit.
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
        /// What the library said.
        message: String,
    },
    /// A report cannot be made of these results.
    #[error("no report: {problem}")]
    Report {
        /// Why.
        problem: String,
    },
}

impl OutputError {
    /// An error of the system while doing `action` with `path`.
    pub fn io(path: &Path, action: &'static str, source: io::Error) -> Self {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::StorageFull | io::ErrorKind::FileTooLarge | io::ErrorKind::QuotaExceeded => {
                Self::NoSpace { path, message: source.to_string() }
            }
            io::ErrorKind::PermissionDenied | io::ErrorKind::ReadOnlyFilesystem | io::ErrorKind::NotADirectory => {
                Self::NotWritable { path, source }
            }
            _ => Self::Io { path, action, source },
        }
    }

    /// An error of the HDF5 library while working on `path`.
    pub(crate) fn hdf5(path: &Path, error: &hdf5::Error) -> Self {
        let path = path.to_owned();
        // The library keeps the system's error as text in the innermost frames only.
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

/// Attach the file's name to an error.
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
