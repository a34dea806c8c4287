//! Checks of the files that a scenario reads and writes.

use std::path::Path;

use super::Checker;
use crate::schema::{Document, Problem, ProblemKind, Scenario};

/// Checks the files that a scenario names; `directory` is the folder of the scenario.
pub(super) fn check(document: &Document<'_>, scenario: &Scenario, directory: &Path) -> Vec<Problem> {
    let mut checker = Checker { document, scenario, problems: Vec::new() };
    for (key, path) in scenario.files() {
        checker.file(&key, directory, path);
    }
    if let Some(file) = &scenario.output.file {
        let target = directory.join(file);
        let parent = target.parent().unwrap_or(directory);
        if target.is_dir() {
            let help = format!("name a file in it: \"{}/result.h5\"", file.trim_end_matches('/'));
            checker.add(ProblemKind::File, "output.file", "is a folder", help);
        } else if !parent.as_os_str().is_empty() && !parent.is_dir() {
            let message = format!("the folder {} does not exist", parent.display());
            checker.add(ProblemKind::File, "output.file", message, "create the folder, or name another file");
        }
    }
    checker.problems
}

impl Checker<'_> {
    /// Checks a file that the scenario reads.
    fn file(&mut self, key: &str, directory: &Path, path: &str) {
        let full = directory.join(path);
        match std::fs::metadata(&full) {
            Ok(data) if data.is_dir() => self.add(ProblemKind::File, key, "is a folder", "name a file"),
            Ok(data) if !data.is_file() => {
                let message = "is a device, a pipe, or a socket, not a regular file";
                self.add(ProblemKind::File, key, message, "copy the data into a file, and name that");
            }
            Ok(_) => {}
            Err(error) => {
                let message = format!("cannot read {}: {error}", full.display());
                let help = "check the path; it is relative to the folder of the scenario";
                self.add(ProblemKind::File, key, message, help);
            }
        }
    }

    /// Checks the name of the result file.
    pub(super) fn output(&mut self) {
        let Some(file) = &self.scenario.output.file else { return };
        let extension = Path::new(file).extension().and_then(|extension| extension.to_str());
        if !matches!(extension, Some("h5" | "hdf5" | "vtkhdf")) {
            let name = Path::new(file).with_extension("h5");
            let help = format!("write \"{}\"; csv = true also writes the time series as CSV", name.display());
            self.range("output.file", "the result file must be HDF5", help);
        }
    }
}
