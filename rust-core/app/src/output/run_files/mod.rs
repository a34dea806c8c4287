//! The files of a run in progress, and how they become one result.
//!
//! A run with the result `NAME.h5` works in the folder `NAME.h5.parts`:
//!
//! * `header.h5`: scenario, provenance, series; written once.
//! * `segment-0000.h5`, …: the samples, events, and snapshots between two commits; the last one has no checkpoint.
//! * `checkpoint-0000.h5`, …: the state at a commit, with the number of segments before it; the two newest are kept.
//! * `lock`: held by the process that works on the run.
//!
//! A run killed before its first checkpoint starts again from the header. The next run or resumption in a folder removes
//! incomplete files that killed processes left there.
//!
//! Every file is written completely or not at all. A commit writes the segment first and then the checkpoint that counts
//! it. A resumed run starts from the newest intact checkpoint and the segments before it; it deletes later segments and
//! computes their rows again, bit for bit. At the end all segments are merged into `NAME.h5`, and the folder is removed.
//! The finished result therefore does not depend on where, or how often, the process was killed; its attributes (wall
//! time, number of resumptions) may differ.

mod folder;
mod header;
mod look;
mod merge;
mod snapshot;
mod so_far;

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::checkpoint::{self, Checkpoint, RunMark};
use super::error::OutputError;
use super::hdf::{self, kind};
use super::{events, sealed};
use concordem_files::leftovers;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::WriteColumns;

pub use folder::parts_folder;
use folder::{
    check_own, cleared, finished_run_id, list_numbered, lock, new_folder, new_run_id, numbered, remove, remove_folder,
    remove_unfinished, usable,
};
pub(super) use header::EARLIER;
pub use header::{OperatorTable, RunHeader, SeriesColumn};
use header::{read_header, write_header};
pub use look::{Follower, News, Unfinished, look};
use snapshot::snapshot_fields;
pub use snapshot::{BondSnapshot, Snapshot, SnapshotField, StoredSnapshot};
pub use so_far::{Kept, SoFar};

/// The open files of a run.
#[derive(Debug)]
pub struct RunFiles {
    path: PathBuf,
    parts: PathBuf,
    header: RunHeader,
    run_id: String,
    /// Holds the lock while it is open; the operating system releases it when the process ends, however it ends.
    _lock: File,
    segments: u64,
    next_checkpoint: u64,
    notes: BTreeMap<String, String>,
    samples: Vec<f64>,
    /// Rows of each operator.
    operators: Vec<Vec<f64>>,
    events: Vec<Event>,
    snapshots: Vec<Arc<StoredSnapshot>>,
    bonds: Vec<Arc<StoredSnapshot>>,
    /// Names and shapes of the fields of snapshots, set by the first one.
    fields: Option<Vec<(String, String)>>,
}

/// Outcome of [`RunFiles::resume`].
#[derive(Debug)]
pub enum Resumed {
    /// The run continues.
    Continue {
        /// Its files.
        files: Box<RunFiles>,
        /// The state to continue from.
        checkpoint: Box<Checkpoint>,
        /// Why newer checkpoints could not be used.
        unusable: Vec<OutputError>,
    },
    /// The run was killed before its first checkpoint and starts again.
    Begin {
        /// Its files.
        files: Box<RunFiles>,
    },
    /// The run is finished, and its result exists.
    Finished,
}

impl RunFiles {
    /// Starts a run whose result is `path`.
    ///
    /// Fails if a result or an unfinished run exists, unless `overwrite` is set. An overwritten result stays until the new
    /// one is complete.
    pub fn create(path: &Path, mut header: RunHeader, overwrite: bool) -> Result<Self, OutputError> {
        let mut names = BTreeSet::new();
        let operators = header.operators.iter().map(|table| &table.name);
        for name in header.series.iter().map(|series| &series.name).chain(operators) {
            hdf::check_name(name, "a series")?;
            if !names.insert(name) {
                return Err(OutputError::Name {
                    name: name.clone(),
                    what: "a series",
                    problem: "another has the same name",
                });
            }
        }
        if path.file_name().is_none() || path.is_dir() {
            let name = path.display().to_string();
            return Err(OutputError::Name { name, what: "a result", problem: "it is a folder" });
        }
        let path = &sealed::target(path)?;
        let parts = parts_folder(path);
        if !overwrite && path.exists() {
            return Err(OutputError::Exists { path: path.to_owned() });
        }
        if parts.exists() {
            if !overwrite {
                return Err(OutputError::Unfinished { path: parts });
            }
            check_own(&parts)?;
            // Another process may be working on the run that is to be discarded.
            drop(lock(&parts)?);
            remove_folder(&parts)?;
        }
        for (name, value) in crate::provenance::of_program() {
            if header.provenance.iter().all(|(other, _)| *other != name) {
                header.provenance.push((name, value));
            }
        }
        // The folder gets its name after its header is written, so a folder without a header is left over from a
        // finished run.
        let folder = sealed::folder_of(path);
        leftovers::sweep(&folder);
        let run_id = new_run_id(path, &header.scenario);
        let new = new_folder(&folder)?;
        let lock = lock(new.path())?;
        write_header(new.path(), &header, &run_id)?;
        fs::rename(new.path(), &parts).map_err(|error| OutputError::io(&parts, "create", error))?;
        let _renamed = new.keep();
        sealed::sync_folder(&folder)?;
        Ok(Self::begun(path, parts, header, run_id, lock))
    }

    /// Files of a run without a checkpoint.
    fn begun(path: &Path, parts: PathBuf, header: RunHeader, run_id: String, lock: File) -> Self {
        Self {
            path: path.to_owned(),
            parts,
            operators: vec![Vec::new(); header.operators.len()],
            header,
            run_id,
            _lock: lock,
            segments: 0,
            next_checkpoint: 0,
            notes: BTreeMap::new(),
            samples: Vec::new(),
            events: Vec::new(),
            snapshots: Vec::new(),
            bonds: Vec::new(),
            fields: None,
        }
    }

    /// Resumes the run whose result is `path` from its newest usable checkpoint.
    pub fn resume(path: &Path) -> Result<Resumed, OutputError> {
        let path = &sealed::target(path)?;
        leftovers::sweep(&sealed::folder_of(path));
        let parts = parts_folder(path);
        if !parts.is_dir() {
            return match sealed::verify(path) {
                Ok(()) => Ok(Resumed::Finished),
                Err(OutputError::Missing { .. }) => Err(OutputError::NoRun { path: path.clone(), parts }),
                Err(other) => Err(other),
            };
        }
        let lock = lock(&parts)?;
        let header = read_header(&parts);
        // The process may have been killed between renaming the result and removing the folder, or while removing it.
        let finished = finished_run_id(path)?;
        let (header, run_id) = match (header, finished) {
            (Ok((_, run_id)), Some(finished)) if run_id == finished => return cleared(&parts),
            (Err(OutputError::Missing { .. }), Some(_)) => return cleared(&parts),
            (header, _) => header?,
        };
        let checkpoints = list_numbered(&parts, "checkpoint")?;
        let segments = list_numbered(&parts, "segment")?;
        let mut unusable = Vec::new();
        for (&number, checkpoint_path) in checkpoints.iter().rev() {
            match usable(checkpoint_path, &run_id, &parts) {
                Ok(checkpoint) => {
                    // Everything after the checkpoint is computed again.
                    for (_, later) in checkpoints.range(number + 1..) {
                        remove(later)?;
                    }
                    for (_, later) in segments.range(checkpoint.run.segments..) {
                        remove(later)?;
                    }
                    remove_unfinished(&parts)?;
                    sealed::sync_folder(&parts)?;
                    let files = Self {
                        fields: snapshot_fields(&parts, checkpoint.run.segments)?,
                        segments: checkpoint.run.segments,
                        next_checkpoint: number + 1,
                        ..Self::begun(path, parts, header, run_id, lock)
                    };
                    return Ok(Resumed::Continue {
                        files: Box::new(files),
                        checkpoint: Box::new(checkpoint),
                        unusable,
                    });
                }
                Err(error) => unusable.push(error),
            }
        }
        if checkpoints.is_empty() {
            // Killed before the first checkpoint; a segment without one is computed again.
            for later in segments.values() {
                remove(later)?;
            }
            remove_unfinished(&parts)?;
            return Ok(Resumed::Begin { files: Box::new(Self::begun(path, parts, header, run_id, lock)) });
        }
        let reasons = unusable.iter().map(ToString::to_string).collect();
        Err(OutputError::NoCheckpoint { path: parts, reasons })
    }

    /// Description of the run before its first step.
    pub fn header(&self) -> &RunHeader {
        &self.header
    }

    /// Replaces the scenario of the run from the current checkpoint on, and adds `notes` to its provenance.
    ///
    /// # Errors
    /// The header cannot be written.
    pub fn change_scenario(&mut self, scenario: &str, notes: &[(String, String)]) -> Result<(), OutputError> {
        scenario.clone_into(&mut self.header.scenario);
        for (name, value) in notes {
            self.header.provenance.retain(|(other, _)| other != name);
            self.header.provenance.push((name.clone(), value.clone()));
        }
        write_header(&self.parts, &self.header, &self.run_id)
    }

    /// Path of the result.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of series.
    pub fn width(&self) -> usize {
        self.header.series.len()
    }

    /// Appends the values of all series at one time.
    pub fn append_sample(&mut self, values: &[f64]) -> Result<(), OutputError> {
        if values.len() != self.header.series.len() {
            return Err(OutputError::SampleWidth { expected: self.header.series.len(), found: values.len() });
        }
        self.samples.extend_from_slice(values);
        Ok(())
    }

    /// Appends a row of an operator, given by its index in the header: time, step, values.
    pub fn append_operator(
        &mut self,
        operator: usize,
        time: f64,
        step: u64,
        values: &[f64],
    ) -> Result<(), OutputError> {
        let expected = self.header.operators.get(operator).map_or(0, OperatorTable::width);
        if values.len() + 2 != expected {
            return Err(OutputError::SampleWidth { expected, found: values.len() + 2 });
        }
        self.operators[operator].extend([time, step as f64]);
        self.operators[operator].extend_from_slice(values);
        Ok(())
    }

    /// Appends an entry to the event log.
    pub fn append_event(&mut self, event: Event) {
        self.events.push(event);
    }

    /// Whether the run already has a snapshot.
    pub fn has_snapshot(&self) -> bool {
        self.fields.is_some()
    }

    /// Appends a snapshot of particles. It stays in memory until the next [`Self::commit`].
    ///
    /// # Errors
    /// Its fields are not those of the first one.
    pub fn append_snapshot(&mut self, snapshot: Arc<StoredSnapshot>) -> Result<(), OutputError> {
        let fields: Vec<_> = snapshot.fields.iter().map(|field| (field.name.clone(), field.shape())).collect();
        match &self.fields {
            Some(first) if *first != fields => {
                let list = |fields: &[(String, String)]| {
                    fields.iter().map(|(name, shape)| format!("{name} ({shape})")).collect::<Vec<_>>().join(", ")
                };
                let problem = format!("it has the fields {}; the first had {}", list(&fields), list(first));
                return Err(OutputError::Snapshot { step: snapshot.step(), problem });
            }
            Some(_) => {}
            None => self.fields = Some(fields),
        }
        self.snapshots.push(snapshot);
        Ok(())
    }

    /// Appends the bonds at one time. They stay in memory until the next [`Self::commit`].
    pub fn append_bonds(&mut self, snapshot: Arc<StoredSnapshot>) {
        self.bonds.push(snapshot);
    }

    /// Adds an attribute to the provenance of the result, such as the wall time.
    pub fn note(&mut self, name: &str, value: &str) {
        self.notes.insert(name.to_owned(), value.to_owned());
    }

    /// Writes everything appended since the last commit, and the state, to disk; returns the state hash.
    ///
    /// After a failure, the last commit is still valid, no appended data are lost, and the commit can be tried again.
    pub fn commit(&mut self, state: &dyn WriteColumns) -> Result<String, OutputError> {
        let segments = self.segments + u64::from(self.write_pending()?);
        let run = RunMark { run_id: self.run_id.clone(), segments };
        let checkpoint = numbered(&self.parts, "checkpoint", self.next_checkpoint);
        let hash = checkpoint::write_in_run(&checkpoint, state, &self.header.scenario, &run).inspect_err(|_| {
            // If the file cannot be removed, the next commit replaces it, because it uses the same number.
            let _ = fs::remove_file(numbered(&self.parts, "segment", self.segments));
        })?;
        stage("after checkpoint");
        self.close_segment(segments);
        self.next_checkpoint += 1;
        for (&number, old) in &list_numbered(&self.parts, "checkpoint")? {
            if number + 2 < self.next_checkpoint {
                remove(old)?;
            }
        }
        Ok(hash)
    }

    /// Writes the next segment, unless nothing was appended since the last commit; returns whether it did.
    fn write_pending(&self) -> Result<bool, OutputError> {
        let empty = self.samples.is_empty()
            && self.operators.iter().all(Vec::is_empty)
            && self.events.is_empty()
            && self.snapshots.is_empty()
            && self.bonds.is_empty();
        if !empty {
            stage("before segment");
            self.write_segment(&numbered(&self.parts, "segment", self.segments))?;
            stage("after segment");
        }
        Ok(!empty)
    }

    /// Forgets what was appended, because it is in the segments now.
    fn close_segment(&mut self, segments: u64) {
        self.segments = segments;
        self.samples.clear();
        self.operators.iter_mut().for_each(Vec::clear);
        self.events.clear();
        self.snapshots.clear();
        self.bonds.clear();
    }

    /// Merges all segments into the result and removes the working folder.
    ///
    /// `last`: the final state; `tables` writes columns below `cell/`, `contacts/`, and `particles/`. No checkpoint of the final state is
    /// written, because the result holds it: a run killed in this function is resumed like any other, from its last commit. If the result
    /// cannot be written, the final state is committed, so that no step is lost.
    pub fn finish(mut self, last: &dyn WriteColumns, tables: &dyn WriteColumns) -> Result<(), OutputError> {
        let segments = self.segments + u64::from(self.write_pending()?);
        self.close_segment(segments);
        stage("before merge");
        let segments: Vec<PathBuf> = (0..segments).map(|k| numbered(&self.parts, "segment", k)).collect();
        let result = merge::Merge {
            path: &self.path,
            scratch: &self.parts,
            header: &self.header,
            run_id: &self.run_id,
            notes: &self.notes,
            segments: &segments,
        };
        if let Err(error) = result.write(last, tables) {
            // The disk may be full; the first error tells the user more than another one here.
            let _ = self.commit(last);
            return Err(error);
        }
        stage("after merge");
        remove_folder(&self.parts)?;
        sealed::sync_folder(&sealed::folder_of(&self.path))
    }

    fn write_segment(&self, path: &Path) -> Result<(), OutputError> {
        sealed::write(path, &self.parts, |file| {
            hdf::write_identity(file, kind::SEGMENT, path)?;
            hdf::write_text_attribute(file, "run_id", &self.run_id, path)?;
            hdf::write_array(file, "samples", &self.samples, self.header.series.len(), path)?;
            for (k, (rows, table)) in self.operators.iter().zip(&self.header.operators).enumerate() {
                hdf::write_array(file, &merge::operator_rows(k), rows, table.width(), path)?;
            }
            events::write_events(file, &self.events, path)?;
            snapshot::write_batches(file, &self.snapshots, path)?;
            snapshot::write_bond_batches(file, &self.bonds, path)?;
            stage("within segment");
            Ok(())
        })
    }
}

/// A point at which tests kill the process.
#[cfg(not(test))]
#[inline]
fn stage(_name: &str) {}
#[cfg(test)]
use tests::stage;

#[cfg(test)]
mod tests;
