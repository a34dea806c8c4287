//! A look at an unfinished run, without disturbing it.

use std::fs::{File, TryLockError};
use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::folder::{header_path, list_numbered, numbered, parts_folder};
use super::header::{RunHeader, read_header};
use crate::output::checkpoint::{self, Checkpoint};
use crate::output::error::OutputError;
use crate::output::{hdf, sealed};

/// What the files of an unfinished run say.
#[derive(Debug)]
pub struct Unfinished {
    /// Description of the run.
    pub header: RunHeader,
    /// Whether a process works on it.
    pub is_running: bool,
    /// Values of all series at the last commit; `None` before the first one with samples.
    pub last: Option<Vec<f64>>,
    /// Number of samples.
    pub samples: usize,
    /// When the run began, and when it last wrote, if the file system knows.
    pub times: [Option<SystemTime>; 2],
}

impl Unfinished {
    /// The value of a series at the last commit.
    pub fn value(&self, series: &str) -> Option<f64> {
        let at = self.header.series.iter().position(|other| other.name == series)?;
        self.last.as_ref()?.get(at).copied()
    }
}

/// Looks at the run whose result is `path`; `None` if there is no unfinished run.
///
/// # Errors
/// Its files cannot be read; also if the run ends at this moment.
pub fn look(path: &Path) -> Result<Option<Unfinished>, OutputError> {
    let parts = folder_of_run(path)?;
    if !parts.is_dir() {
        return Ok(None);
    }
    let is_running = is_running(&parts);
    let (header, _) = read_header(&parts)?;
    let width = header.series.len().max(1);
    let (mut last, mut samples) = (None, 0);
    for segment in list_numbered(&parts, "segment")?.values() {
        let file = sealed::open(segment)?;
        let values: Vec<f64> = hdf::read_array(&file, "samples", segment)?;
        samples += values.len() / width;
        if let Some(row) = values.chunks_exact(width).next_back() {
            last = Some(row.to_vec());
        }
    }
    let modified = |path: &Path| std::fs::metadata(path).and_then(|data| data.modified()).ok();
    let newest = list_numbered(&parts, "checkpoint")?.values().next_back().and_then(|path| modified(path));
    let times = [modified(&header_path(&parts)), newest];
    Ok(Some(Unfinished { header, is_running, last, samples, times }))
}

/// The working folder of the run whose result is `path`, or `path` if it is such a folder.
pub(super) fn folder_of_run(path: &Path) -> Result<PathBuf, OutputError> {
    if path.extension().is_some_and(|extension| extension == "parts") && path.is_dir() {
        Ok(path.to_owned())
    } else {
        Ok(parts_folder(&sealed::target(path)?))
    }
}

/// Whether a process holds the lock of a run. Does not create the lock: a run that removes its folder at this moment would find it not empty,
/// and fail. A shared lock does not keep others who look from seeing the same.
pub(super) fn is_running(parts: &Path) -> bool {
    let file = File::options().write(true).open(parts.join("lock"));
    file.is_ok_and(|file| matches!(file.try_lock_shared(), Err(TryLockError::WouldBlock)))
}

/// Follows a run of another process, and reads each of its files once.
#[derive(Debug)]
pub struct Follower {
    /// Description of the run.
    pub header: RunHeader,
    parts: PathBuf,
    run_id: String,
    /// Number of segments that were read.
    segments: u64,
    /// Number of the checkpoint that was read.
    checkpoint: Option<u64>,
}

/// What a run has written since the last look.
#[derive(Debug)]
pub struct News {
    /// New samples: the values of all series, one row after the other.
    pub samples: Vec<f64>,
    /// The newest state.
    pub checkpoint: Checkpoint,
}

impl Follower {
    /// Begins to follow the run whose result, or working folder, is `path`; `None` if there is no unfinished run.
    ///
    /// # Errors
    /// Its files cannot be read.
    pub fn of(path: &Path) -> Result<Option<Self>, OutputError> {
        let parts = folder_of_run(path)?;
        if !parts.is_dir() {
            return Ok(None);
        }
        let (header, run_id) = read_header(&parts)?;
        Ok(Some(Self { header, parts, run_id, segments: 0, checkpoint: None }))
    }

    /// Whether a process works on the run.
    pub fn is_running(&self) -> bool {
        self.parts.is_dir() && is_running(&self.parts)
    }

    /// The result of the run, whether or not it is finished.
    pub fn result(&self) -> PathBuf {
        self.parts.with_extension("")
    }

    /// What the run has written since the last call; `None`: nothing.
    ///
    /// # Errors
    /// A file cannot be read; also if the run removes it at this moment.
    pub fn news(&mut self) -> Result<Option<News>, OutputError> {
        let Some((number, path)) = list_numbered(&self.parts, "checkpoint")?.pop_last() else { return Ok(None) };
        if self.checkpoint == Some(number) {
            return Ok(None);
        }
        let checkpoint = checkpoint::read(&path)?;
        if checkpoint.run.run_id != self.run_id {
            return Err(OutputError::Damaged { path, problem: "it belongs to another run".to_owned() });
        }
        let mut samples = Vec::new();
        for k in self.segments..checkpoint.run.segments {
            let segment = numbered(&self.parts, "segment", k);
            let file = sealed::open(&segment)?;
            let rows: Vec<f64> = hdf::read_array(&file, "samples", &segment)?;
            samples.extend(rows);
        }
        self.segments = self.segments.max(checkpoint.run.segments);
        self.checkpoint = Some(number);
        Ok(Some(News { samples, checkpoint }))
    }
}

#[cfg(test)]
mod tests {
    use super::super::folder::lock;
    use super::*;

    /// Looking leaves no trace in the folder, and sees a lock that another holds.
    #[test]
    fn looking_creates_no_lock() {
        let folder = tempfile::tempdir().unwrap();
        assert!(!is_running(folder.path()));
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
        let held = lock(folder.path()).unwrap();
        assert!(is_running(folder.path()));
        drop(held);
        assert!(!is_running(folder.path()));
    }
}
