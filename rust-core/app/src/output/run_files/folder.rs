//! The working folder of a run: names of its files, its lock, and its removal.

use std::collections::BTreeMap;
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::Duration;

use super::Resumed;
use crate::output::checkpoint::{self, Checkpoint};
use crate::output::error::OutputError;
use crate::output::hdf::{self, kind};
use crate::output::sealed;
use concordem_files::paths::UNFINISHED;

/// Working folder of the run whose result is `path`.
pub fn parts_folder(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".parts");
    PathBuf::from(name)
}

pub(super) fn header_path(parts: &Path) -> PathBuf {
    parts.join("header.h5")
}

pub(super) fn numbered(parts: &Path, stem: &str, number: u64) -> PathBuf {
    parts.join(format!("{stem}-{number:04}.h5"))
}

/// The files `STEM-NUMBER.h5` in a folder, by number.
pub(super) fn list_numbered(parts: &Path, stem: &str) -> Result<BTreeMap<u64, PathBuf>, OutputError> {
    let failed = |error| OutputError::io(parts, "list", error);
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(parts).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let number = path
            .file_name()
            .and_then(|name| name.to_str()?.strip_prefix(stem)?.strip_prefix('-')?.strip_suffix(".h5")?.parse().ok());
        // Smaller ones than 64 bits hold, so that the next one does not wrap.
        if let Some(number) = number.map(|number: u32| u64::from(number)) {
            found.insert(number, path);
        }
    }
    Ok(found)
}

pub(super) fn remove(path: &Path) -> Result<(), OutputError> {
    fs::remove_file(path).map_err(|error| OutputError::io(path, "remove", error))
}

pub(super) fn remove_folder(path: &Path) -> Result<(), OutputError> {
    fs::remove_dir_all(path).map_err(|error| OutputError::io(path, "remove", error))
}

/// Removes what remains of the working folder of a finished run.
pub(super) fn cleared(parts: &Path) -> Result<Resumed, OutputError> {
    // The process may have ended before the name of the result was on the disk.
    sealed::sync_folder(&sealed::folder_of(parts))?;
    remove_folder(parts)?;
    Ok(Resumed::Finished)
}

/// Creates a temporary folder in `folder`, to be renamed.
pub(super) fn new_folder(folder: &Path) -> Result<tempfile::TempDir, OutputError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(UNFINISHED);
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.tempdir_in(folder).map_err(|error| match error.kind() {
        // Some folders of the system, such as /proc, exist but take no files.
        std::io::ErrorKind::NotFound if !folder.is_dir() => OutputError::NoFolder { path: folder.to_owned() },
        std::io::ErrorKind::NotFound => OutputError::not_writable(folder, &error),
        _ => OutputError::io(folder, "create", error),
    })
}

/// How often, and after which pause, a lock is tried again that somebody else may hold only to look.
const LOOKS: u32 = 10;
const LOOK: Duration = Duration::from_millis(10);

/// Locks the run for this process.
pub(super) fn lock(parts: &Path) -> Result<File, OutputError> {
    let path = parts.join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .map_err(|error| OutputError::io(&path, "create", error))?;
    let mut locked = file.try_lock();
    // Whoever looks at the run holds its lock for a moment.
    for _ in 0..LOOKS {
        if !matches!(locked, Err(TryLockError::WouldBlock)) {
            break;
        }
        std::thread::sleep(LOOK);
        locked = file.try_lock();
    }
    match locked {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(OutputError::Busy { path: parts.to_owned() }),
        // Some network file systems do not support locks; runs there are not locked.
        Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => Ok(file),
        Err(TryLockError::Error(error)) => Err(OutputError::io(&path, "lock", error)),
    }
}

/// Unique identity of a run: hash of scenario, process, path, and time.
pub(super) fn new_run_id(path: &Path, scenario: &str) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(scenario.as_bytes());
    hasher.update(path.as_os_str().as_encoded_bytes());
    hasher.update(&std::process::id().to_le_bytes());
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    hasher.update(&now.as_nanos().to_le_bytes());
    hasher.finalize().to_hex()[..32].to_owned()
}

/// Identity of the run that wrote the result at `path`; `None` if there is no intact result.
pub(super) fn finished_run_id(path: &Path) -> Result<Option<String>, OutputError> {
    // A damaged older result is not an error: the run will overwrite it.
    let Ok(file) = sealed::open(path) else { return Ok(None) };
    if hdf::check_identity(&file, kind::RESULT, path).is_err() {
        return Ok(None);
    }
    hdf::read_text_attribute(&file, "run_id", path).map(Some)
}

/// Reads a checkpoint; fails unless it belongs to the run and all segments before it are intact.
pub(super) fn usable(path: &Path, run_id: &str, parts: &Path) -> Result<Checkpoint, OutputError> {
    let foreign =
        |path: &Path| OutputError::Damaged { path: path.to_owned(), problem: "it belongs to another run".to_owned() };
    let checkpoint = checkpoint::read(path)?;
    if checkpoint.run.run_id != run_id {
        return Err(foreign(path));
    }
    for k in 0..checkpoint.run.segments {
        let segment = numbered(parts, "segment", k);
        let file = sealed::open(&segment)?;
        hdf::check_identity(&file, kind::SEGMENT, &segment)?;
        if hdf::read_text_attribute(&file, "run_id", &segment)? != run_id {
            return Err(foreign(&segment));
        }
    }
    Ok(checkpoint)
}

/// Refuses to remove a folder that no run has created.
pub(super) fn check_own(parts: &Path) -> Result<(), OutputError> {
    let failed = |error| OutputError::io(parts, "list", error);
    let not_parts = |found: String| OutputError::NotParts { path: parts.to_owned(), found };
    if !fs::symlink_metadata(parts).map_err(failed)?.is_dir() {
        return Err(not_parts("another kind of file".to_owned()));
    }
    for entry in fs::read_dir(parts).map_err(failed)? {
        let name = entry.map_err(failed)?.file_name().to_string_lossy().into_owned();
        let own = name == "lock"
            || name == "header.h5"
            || name.starts_with(UNFINISHED)
            || (Path::new(&name).extension().is_some_and(|end| end == "h5")
                && (name.starts_with("segment-") || name.starts_with("checkpoint-")));
        if !own {
            return Err(not_parts(name));
        }
    }
    Ok(())
}

/// Removes files that a killed process had not finished writing.
pub(super) fn remove_unfinished(parts: &Path) -> Result<(), OutputError> {
    let failed = |error| OutputError::io(parts, "list", error);
    for entry in fs::read_dir(parts).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(UNFINISHED.as_bytes())) {
            remove(&path)?;
        }
    }
    Ok(())
}
