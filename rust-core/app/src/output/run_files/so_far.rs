//! The files of an unfinished run as they are now, for a result of what it has done so far.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use tempfile::TempDir;

use super::folder::{header_path, list_numbered, lock, new_folder, numbered, parts_folder, usable};
use super::header::read_header;
use super::look::{folder_of_run, is_running};
use crate::output::error::OutputError;
use crate::output::sealed;

/// A copy of the files of an unfinished run, in a folder that goes with it. The run itself is not touched, and may go on.
#[derive(Debug)]
pub struct SoFar {
    /// Where the result of the copy belongs; it has the file name of that of the run.
    pub path: PathBuf,
    /// Whether a process works on the run.
    pub is_running: bool,
    folder: TempDir,
    /// Keeps others from sweeping the folder away.
    lock: File,
}

/// What a result of a copy needs as long as it is read.
#[derive(Debug)]
pub struct Kept(#[allow(dead_code)] TempDir, #[allow(dead_code)] File);

impl SoFar {
    /// Copies header, newest intact checkpoint, and the segments before it of the run whose result is `path`. On one file system these are
    /// links: files of a run never change, they are only replaced.
    ///
    /// # Errors
    /// There is no unfinished run, it has no checkpoint yet, or a file cannot be read; also if the run ends at this moment.
    pub fn of(path: &Path) -> Result<Self, OutputError> {
        let parts = folder_of_run(path)?;
        if !parts.is_dir() {
            return Err(OutputError::NoRun { path: path.to_owned(), parts });
        }
        let (_, run_id) = read_header(&parts)?;
        let mut reasons = Vec::new();
        let mut found = None;
        for (number, file) in list_numbered(&parts, "checkpoint")?.into_iter().rev() {
            match usable(&file, &run_id, &parts) {
                Ok(checkpoint) => {
                    found = Some((number, checkpoint.run.segments));
                    break;
                }
                Err(error) => reasons.push(error.to_string()),
            }
        }
        let Some((checkpoint, segments)) = found else {
            return Err(OutputError::NoCheckpoint { path: parts, reasons });
        };
        let beside = parts.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
        let folder = new_folder(beside).or_else(|error| tempfile::tempdir().map_err(|_| error))?;
        let lock = lock(folder.path())?;
        let result = parts.with_extension("");
        let path = folder.path().join(result.file_name().unwrap_or_default());
        let to = parts_folder(&path);
        fs::create_dir(&to).map_err(|error| OutputError::io(&to, "create", error))?;
        let copy = |from: &Path| {
            let to = to.join(from.file_name().unwrap_or_default());
            fs::hard_link(from, &to)
                .or_else(|_| fs::copy(from, &to).map(|_| ()))
                .map_err(|error| OutputError::io(from, "copy", error))
        };
        copy(&header_path(&parts))?;
        copy(&numbered(&parts, "checkpoint", checkpoint))?;
        (0..segments).try_for_each(|k| copy(&numbered(&parts, "segment", k)))?;
        sealed::sync_folder(&to)?;
        Ok(Self { path, is_running: is_running(&parts), folder, lock })
    }

    /// The folder, for whoever reads the result in it.
    pub fn keep(self) -> Kept {
        Kept(self.folder, self.lock)
    }
}
