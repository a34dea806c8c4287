//! A look at an unfinished run, without disturbing it.

use std::path::Path;
use std::time::SystemTime;

use super::folder::{header_path, list_numbered, lock, parts_folder};
use super::header::{RunHeader, read_header};
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
    let parts = if path.extension().is_some_and(|extension| extension == "parts") && path.is_dir() {
        path.to_owned()
    } else {
        parts_folder(&sealed::target(path)?)
    };
    if !parts.is_dir() {
        return Ok(None);
    }
    let is_running = matches!(lock(&parts), Err(OutputError::Busy { .. }));
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
