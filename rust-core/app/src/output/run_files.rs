//! The files of a run while it runs, and how they become one result.
//!
//! A run with the result `NAME.h5` works in the folder `NAME.h5.parts`:
//!
//! * `header.h5`: scenario, provenance, series; written once.
//! * `segment-0000.h5`, …: the samples, events, and snapshots between two commits.
//! * `checkpoint-0000.h5`, …: the state at a commit, with the count of segments that belong to it; the two last ones
//!   are kept.
//! * `lock`: held by the process that works on the run.
//!
//! Every file appears whole or not at all. A commit writes the segment first and then the checkpoint that counts it.
//! A resumed run starts from the newest checkpoint that is whole, together with all segments it counts, and throws
//! away the segments after it, whose rows it makes again, bit for bit. At the end all segments are merged into
//! `NAME.h5`, and the folder is removed. So the finished result does not depend on where, or how often, the process
//! was killed; its attributes (wall times, number of resumptions) may.

use std::collections::{BTreeMap, BTreeSet};
use std::fs::{self, File, TryLockError};
use std::path::{Path, PathBuf};

use super::checkpoint::{self, Checkpoint, RunMark};
use super::error::{At, OutputError};
use super::hdf::{self, kind};
use super::{merge, sealed};
use concordem_contact::math::Vec3;
use concordem_solver::fracture::Event;
use concordem_solver::state::columns::{Column, ColumnData, StoredColumn, WriteColumns};

/// Description of one series: a number that is sampled through the run.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SeriesColumn {
    /// Name, also of the dataset under `/samples`.
    pub name: String,
    /// SI unit, "1" when dimensionless.
    pub unit: String,
    /// Meaning.
    pub description: String,
}

impl SeriesColumn {
    /// A series.
    pub fn new(name: &str, unit: &str, description: &str) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), description: description.to_owned() }
    }
}

/// Operator that is evaluated through the run: a table of its own, `/samples/NAME`.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct OperatorTable {
    /// Name, also of the group under `/samples`.
    pub name: String,
    /// The operator and its region, in words.
    pub description: String,
    /// Its quantities, each with its number of reals.
    pub quantities: Vec<(SeriesColumn, usize)>,
}

impl OperatorTable {
    /// Reals of a row: time, step, and all quantities.
    pub fn width(&self) -> usize {
        2 + self.quantities.iter().map(|(_, components)| components).sum::<usize>()
    }
}

/// What is known about a run before its first step.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunHeader {
    /// Text of the scenario file.
    pub scenario: String,
    /// Pairs of name and value, written as attributes of `/provenance`; [`super::provenance::of_program`] is added.
    pub provenance: Vec<(String, String)>,
    /// The series, in the order of the values of a sample.
    pub series: Vec<SeriesColumn>,
    /// Operators that are evaluated at intervals of their own.
    pub operators: Vec<OperatorTable>,
}

/// The particles at one moment, for `/VTKHDF`.
#[derive(Debug, Clone)]
pub struct Snapshot<'a> {
    /// Time, s.
    pub time: f64,
    /// Count of steps done.
    pub step: u64,
    /// Stable ids; the rows are written in their order, so that a point stays the same particle.
    pub id: &'a [u32],
    /// Positions, m.
    pub position: &'a [Vec3],
    /// Further fields: radius, displacement, velocity, damage and so on. Every snapshot of a run has the same.
    pub fields: Vec<SnapshotField<'a>>,
}

/// One field of a snapshot, a row per particle.
#[derive(Debug, Clone)]
pub struct SnapshotField<'a> {
    /// Name.
    pub name: &'a str,
    /// Meaning.
    pub description: &'a str,
    /// Values with unit.
    pub column: Column<'a>,
}

/// A snapshot kept until the next commit.
#[derive(Debug)]
pub(super) struct StoredSnapshot {
    pub time: f64,
    pub step: u64,
    pub fields: Vec<StoredField>,
}

#[derive(Debug)]
pub(super) struct StoredField {
    pub name: String,
    pub unit: String,
    pub description: String,
    pub column: StoredColumn,
}

/// Name of the positions among the fields of a stored snapshot.
pub(super) const POSITION: &str = "position";
/// Name of the ids among the fields of a stored snapshot.
const ID: &str = "id";

/// The open files of a run.
#[derive(Debug)]
pub struct RunFiles {
    path: PathBuf,
    parts: PathBuf,
    header: RunHeader,
    run_id: String,
    /// Holds the lock as long as it is open; the system releases it with the process, however that ends.
    _lock: File,
    segments: u64,
    next_checkpoint: u64,
    last_hash: String,
    notes: BTreeMap<String, String>,
    samples: Vec<f64>,
    /// Rows of each operator.
    operators: Vec<Vec<f64>>,
    events: Vec<Event>,
    snapshots: Vec<StoredSnapshot>,
    /// Names and shapes of the fields of the run's snapshots, from the first one on.
    fields: Option<Vec<(String, String)>>,
}

/// Outcome of [`RunFiles::resume`].
#[derive(Debug)]
pub enum Resumed {
    /// The run goes on.
    Continue {
        /// Its files.
        files: Box<RunFiles>,
        /// The state to go on from.
        checkpoint: Box<Checkpoint>,
        /// Newer checkpoints that could not be used, for the user's information.
        unusable: Vec<OutputError>,
    },
    /// The run is done and its result is in place.
    Finished,
}

/// Folder in which the run with the result `path` works.
pub fn parts_folder(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".parts");
    PathBuf::from(name)
}

fn header_path(parts: &Path) -> PathBuf {
    parts.join("header.h5")
}

fn numbered(parts: &Path, stem: &str, number: u64) -> PathBuf {
    parts.join(format!("{stem}-{number:04}.h5"))
}

/// Files `STEM-NUMBER.h5` of a folder by their numbers.
fn list_numbered(parts: &Path, stem: &str) -> Result<BTreeMap<u64, PathBuf>, OutputError> {
    let failed = |error| OutputError::io(parts, "list", error);
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(parts).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let number = path
            .file_name()
            .and_then(|name| name.to_str()?.strip_prefix(stem)?.strip_prefix('-')?.strip_suffix(".h5")?.parse().ok());
        if let Some(number) = number {
            found.insert(number, path);
        }
    }
    Ok(found)
}

fn remove(path: &Path) -> Result<(), OutputError> {
    fs::remove_file(path).map_err(|error| OutputError::io(path, "remove", error))
}

fn remove_folder(path: &Path) -> Result<(), OutputError> {
    fs::remove_dir_all(path).map_err(|error| OutputError::io(path, "remove", error))
}

/// Remove what is left of the folder of a finished run.
fn cleared(parts: &Path) -> Result<Resumed, OutputError> {
    remove_folder(parts)?;
    Ok(Resumed::Finished)
}

/// A folder without a name of its own yet.
fn new_folder(folder: &Path) -> Result<tempfile::TempDir, OutputError> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".unfinished-");
    #[cfg(unix)]
    builder.permissions(std::os::unix::fs::PermissionsExt::from_mode(0o777));
    builder.tempdir_in(folder).map_err(|error| match error.kind() {
        std::io::ErrorKind::NotFound => OutputError::NoFolder { path: folder.to_owned() },
        _ => OutputError::io(folder, "create", error),
    })
}

/// Take the run's lock.
fn lock(parts: &Path) -> Result<File, OutputError> {
    let path = parts.join("lock");
    let file = File::options()
        .create(true)
        .truncate(false)
        .write(true)
        .open(&path)
        .map_err(|error| OutputError::io(&path, "create", error))?;
    match file.try_lock() {
        Ok(()) => Ok(file),
        Err(TryLockError::WouldBlock) => Err(OutputError::Busy { path: parts.to_owned() }),
        // Some network file systems know no locks; a run there is as good as it was without them.
        Err(TryLockError::Error(error)) if error.kind() == std::io::ErrorKind::Unsupported => Ok(file),
        Err(TryLockError::Error(error)) => Err(OutputError::io(&path, "lock", error)),
    }
}

/// An identity that no other run has: hash of scenario, process, place, and the present moment.
fn new_run_id(path: &Path, header: &RunHeader) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(header.scenario.as_bytes());
    hasher.update(path.as_os_str().as_encoded_bytes());
    hasher.update(&std::process::id().to_le_bytes());
    let now = std::time::SystemTime::now().duration_since(std::time::UNIX_EPOCH).unwrap_or_default();
    hasher.update(&now.as_nanos().to_le_bytes());
    hasher.finalize().to_hex()[..32].to_owned()
}

impl RunFiles {
    /// Begin a run whose result will be `path`.
    ///
    /// An existing result, or an unfinished run, is refused unless `overwrite`. An overwritten result stays in place
    /// until the new one is whole.
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
        let parts = parts_folder(path);
        if !overwrite && path.exists() {
            return Err(OutputError::Exists { path: path.to_owned() });
        }
        if parts.exists() {
            if !overwrite {
                return Err(OutputError::Unfinished { path: parts });
            }
            // Another process may be at work on the run that is to be discarded.
            drop(lock(&parts)?);
            remove_folder(&parts)?;
        }
        for (name, value) in super::provenance::of_program() {
            if header.provenance.iter().all(|(other, _)| *other != name) {
                header.provenance.push((name, value));
            }
        }
        // The folder gets its name only with the header inside: one without it is what is left of a finished run.
        let folder = sealed::folder_of(path);
        let run_id = new_run_id(path, &header);
        let operators = vec![Vec::new(); header.operators.len()];
        let new = new_folder(&folder)?;
        let lock = lock(new.path())?;
        write_header(new.path(), &header, &run_id)?;
        fs::rename(new.path(), &parts).map_err(|error| OutputError::io(&parts, "create", error))?;
        let _renamed = new.keep();
        sealed::sync_folder(&folder)?;
        Ok(Self {
            path: path.to_owned(),
            parts,
            header,
            run_id,
            _lock: lock,
            segments: 0,
            next_checkpoint: 0,
            last_hash: String::new(),
            notes: BTreeMap::new(),
            samples: Vec::new(),
            operators,
            events: Vec::new(),
            snapshots: Vec::new(),
            fields: None,
        })
    }

    /// Go on with the run whose result will be `path`, from its newest usable checkpoint.
    pub fn resume(path: &Path) -> Result<Resumed, OutputError> {
        let parts = parts_folder(path);
        if !parts.is_dir() {
            return match sealed::verify(path) {
                Ok(()) => Ok(Resumed::Finished),
                Err(OutputError::Missing { .. }) => Err(OutputError::Missing { path: parts }),
                Err(other) => Err(other),
            };
        }
        let lock = lock(&parts)?;
        let header = read_header(&parts);
        // Killed between putting the result in place and removing the folder, or while removing it.
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
                    // What came after the checkpoint is made again.
                    for (_, later) in checkpoints.range(number + 1..) {
                        remove(later)?;
                    }
                    for (_, later) in segments.range(checkpoint.run.segments..) {
                        remove(later)?;
                    }
                    remove_unfinished(&parts)?;
                    sealed::sync_folder(&parts)?;
                    let files = Self {
                        path: path.to_owned(),
                        operators: vec![Vec::new(); header.operators.len()],
                        fields: snapshot_fields(&parts, checkpoint.run.segments)?,
                        parts,
                        header,
                        run_id,
                        _lock: lock,
                        segments: checkpoint.run.segments,
                        next_checkpoint: number + 1,
                        last_hash: checkpoint.state_hash.clone(),
                        notes: BTreeMap::new(),
                        samples: Vec::new(),
                        events: Vec::new(),
                        snapshots: Vec::new(),
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
        let reasons = unusable.iter().map(ToString::to_string).collect();
        Err(OutputError::NoCheckpoint { path: parts, reasons })
    }

    /// What was known about the run before its first step.
    pub fn header(&self) -> &RunHeader {
        &self.header
    }

    /// The result that the run will have.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Add the values of the series at one moment.
    pub fn append_sample(&mut self, values: &[f64]) -> Result<(), OutputError> {
        if values.len() != self.header.series.len() {
            return Err(OutputError::SampleWidth { expected: self.header.series.len(), found: values.len() });
        }
        self.samples.extend_from_slice(values);
        Ok(())
    }

    /// Add a row of an operator: its place in the header, time, step, values.
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

    /// Add an entry to the event log.
    pub fn append_event(&mut self, event: Event) {
        self.events.push(event);
    }

    /// Add a snapshot. It is kept in memory until the next [`Self::commit`].
    pub fn append_snapshot(&mut self, snapshot: &Snapshot<'_>) -> Result<(), OutputError> {
        let stored = StoredSnapshot::of(snapshot)?;
        let fields: Vec<_> = stored.fields.iter().map(|field| (field.name.clone(), field.shape())).collect();
        match &self.fields {
            Some(first) if *first != fields => {
                let list = |fields: &[(String, String)]| {
                    fields.iter().map(|(name, shape)| format!("{name} ({shape})")).collect::<Vec<_>>().join(", ")
                };
                let problem = format!("it has the fields {}; the first had {}", list(&fields), list(first));
                return Err(OutputError::Snapshot { step: snapshot.step, problem });
            }
            Some(_) => {}
            None => self.fields = Some(fields),
        }
        self.snapshots.push(stored);
        Ok(())
    }

    /// Note something for the result's provenance (wall time and the like): an attribute of `/provenance`.
    pub fn note(&mut self, name: &str, value: &str) {
        self.notes.insert(name.to_owned(), value.to_owned());
    }

    /// Make everything up to now permanent: what was appended, and the state. Gives the state hash.
    ///
    /// When it fails, the last commit still stands, what was appended is still there, and it can be tried again.
    pub fn commit(&mut self, state: &dyn WriteColumns) -> Result<String, OutputError> {
        let empty = self.samples.is_empty()
            && self.operators.iter().all(Vec::is_empty)
            && self.events.is_empty()
            && self.snapshots.is_empty();
        let segment = numbered(&self.parts, "segment", self.segments);
        if !empty {
            stage("before segment");
            self.write_segment(&segment)?;
            stage("after segment");
        }
        let run = RunMark { run_id: self.run_id.clone(), segments: self.segments + u64::from(!empty) };
        let checkpoint = numbered(&self.parts, "checkpoint", self.next_checkpoint);
        let hash = checkpoint::write_in_run(&checkpoint, state, &self.header.scenario, &run).inspect_err(|_| {
            // Its number will be used again; should it stay, the next commit replaces it.
            let _ = fs::remove_file(&segment);
        })?;
        stage("after checkpoint");
        self.segments = run.segments;
        self.next_checkpoint += 1;
        self.samples.clear();
        self.operators.iter_mut().for_each(Vec::clear);
        self.events.clear();
        self.snapshots.clear();
        self.last_hash.clone_from(&hash);
        for (&number, old) in &list_numbered(&self.parts, "checkpoint")? {
            if number + 2 < self.next_checkpoint {
                remove(old)?;
            }
        }
        Ok(hash)
    }

    /// Merge all segments into the result and remove the working folder.
    ///
    /// `last` is the state at the end, which is committed first; `tables` writes its columns for people, below
    /// `cell/`, `contacts/`, and `particles/`. A run that was killed in here is resumed like any other: its newest checkpoint
    /// is the state at the end.
    pub fn finish(mut self, last: &dyn WriteColumns, tables: &dyn WriteColumns) -> Result<(), OutputError> {
        self.commit(last)?;
        stage("before merge");
        let segments: Vec<PathBuf> = (0..self.segments).map(|k| numbered(&self.parts, "segment", k)).collect();
        let result = merge::Merge {
            path: &self.path,
            scratch: &self.parts,
            header: &self.header,
            run_id: &self.run_id,
            state_hash: &self.last_hash,
            notes: &self.notes,
            segments: &segments,
        };
        result.write(tables)?;
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
            merge::write_events(file, &self.events, path)?;
            let group = file.create_group("snapshots").at(path)?;
            for (k, snapshot) in self.snapshots.iter().enumerate() {
                let group = group.create_group(&format!("{k:06}")).at(path)?;
                snapshot.write(&group, path)?;
            }
            stage("within segment");
            Ok(())
        })
    }
}

/// Identity of the run whose result is in place, if there is a whole one.
fn finished_run_id(path: &Path) -> Result<Option<String>, OutputError> {
    // An older result, even a damaged one, is no obstacle to a run that will overwrite it.
    let Ok(file) = sealed::open(path) else { return Ok(None) };
    if hdf::check_identity(&file, kind::RESULT, path).is_err() {
        return Ok(None);
    }
    hdf::read_text_attribute(&file, "run_id", path).map(Some)
}

/// Read a checkpoint, and check that it belongs to the run and that all segments it counts are whole.
fn usable(path: &Path, run_id: &str, parts: &Path) -> Result<Checkpoint, OutputError> {
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

/// Fields of the first snapshot of the run, if there is one.
fn snapshot_fields(parts: &Path, segments: u64) -> Result<Option<Vec<(String, String)>>, OutputError> {
    for k in 0..segments {
        let path = numbered(parts, "segment", k);
        let file = sealed::open(&path)?;
        let group = file.group("snapshots").at(&path)?;
        if let Some(first) = group.member_names().at(&path)?.first() {
            let snapshot = StoredSnapshot::read(&group.group(first).at(&path)?, &path)?;
            return Ok(Some(snapshot.fields.iter().map(|field| (field.name.clone(), field.shape())).collect()));
        }
    }
    Ok(None)
}

/// Remove what a killed process was writing.
fn remove_unfinished(parts: &Path) -> Result<(), OutputError> {
    let failed = |error| OutputError::io(parts, "list", error);
    for entry in fs::read_dir(parts).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        if path.file_name().is_some_and(|name| name.as_encoded_bytes().starts_with(b".unfinished-")) {
            remove(&path)?;
        }
    }
    Ok(())
}

fn write_header(parts: &Path, header: &RunHeader, run_id: &str) -> Result<(), OutputError> {
    let path = &header_path(parts);
    sealed::write(path, parts, |file| {
        hdf::write_identity(file, kind::HEADER, path)?;
        hdf::write_text_attribute(file, "run_id", run_id, path)?;
        hdf::write_text(file, "scenario", &header.scenario, path)?;
        let texts = |name: &str, values: Vec<(&str, &str)>| -> Result<(), OutputError> {
            let group = file.create_group(name).at(path)?;
            for (k, (key, value)) in values.into_iter().enumerate() {
                let entry = group.create_group(&format!("{k:06}")).at(path)?;
                hdf::write_text_attribute(&entry, "key", key, path)?;
                hdf::write_text_attribute(&entry, "value", value, path)?;
            }
            Ok(())
        };
        texts("provenance", header.provenance.iter().map(|(key, value)| (&key[..], &value[..])).collect())?;
        texts("units", header.series.iter().map(|series| (&series.name[..], &series.unit[..])).collect())?;
        texts("descriptions", header.series.iter().map(|s| (&s.name[..], &s.description[..])).collect())?;
        for (k, table) in header.operators.iter().enumerate() {
            let group = file.create_group(&format!("operator-{k:03}")).at(path)?;
            hdf::write_text_attribute(&group, "name", &table.name, path)?;
            hdf::write_text_attribute(&group, "description", &table.description, path)?;
            for (q, (column, components)) in table.quantities.iter().enumerate() {
                let entry = group.create_group(&format!("{q:03}")).at(path)?;
                hdf::write_text_attribute(&entry, "name", &column.name, path)?;
                hdf::write_text_attribute(&entry, "unit", &column.unit, path)?;
                hdf::write_text_attribute(&entry, "description", &column.description, path)?;
                hdf::write_attribute(&entry, "components", &(*components as u64), path)?;
            }
        }
        Ok(())
    })
}

fn read_header(parts: &Path) -> Result<(RunHeader, String), OutputError> {
    let path = &header_path(parts);
    let file = sealed::open(path)?;
    hdf::check_identity(&file, kind::HEADER, path)?;
    let texts = |name: &str| -> Result<Vec<(String, String)>, OutputError> {
        let group = file.group(name).at(path)?;
        let entry = |member: &String| {
            let entry = group.group(member).at(path)?;
            let text = |key| hdf::read_text_attribute(&entry, key, path);
            Ok((text("key")?, text("value")?))
        };
        group.member_names().at(path)?.iter().map(entry).collect()
    };
    let series = texts("units")?
        .into_iter()
        .zip(texts("descriptions")?)
        .map(|((name, unit), (_, description))| SeriesColumn { name, unit, description })
        .collect();
    let scenario = hdf::read_text(&file, "scenario", path)?;
    let run_id = hdf::read_text_attribute(&file, "run_id", path)?;
    let mut operators = Vec::new();
    for name in file.member_names().at(path)?.iter().filter(|name| name.starts_with("operator-")) {
        let group = file.group(name).at(path)?;
        let mut quantities = Vec::new();
        for member in group.member_names().at(path)? {
            let entry = group.group(&member).at(path)?;
            let text = |key| hdf::read_text_attribute(&entry, key, path);
            let column = SeriesColumn { name: text("name")?, unit: text("unit")?, description: text("description")? };
            quantities.push((column, hdf::read_attribute::<u64>(&entry, "components", path)? as usize));
        }
        operators.push(OperatorTable {
            name: hdf::read_text_attribute(&group, "name", path)?,
            description: hdf::read_text_attribute(&group, "description", path)?,
            quantities,
        });
    }
    Ok((RunHeader { scenario, provenance: texts("provenance")?, series, operators }, run_id))
}

impl StoredField {
    /// Type and shape of a row, as text.
    fn shape(&self) -> String {
        format!("{} {}", self.column.components, self.column.kind())
    }
}

impl StoredSnapshot {
    /// Check a snapshot and sort its rows by id.
    fn of(snapshot: &Snapshot<'_>) -> Result<Self, OutputError> {
        let wrong = |problem: String| OutputError::Snapshot { step: snapshot.step, problem };
        let count = snapshot.id.len();
        if snapshot.position.len() != count {
            return Err(wrong(format!("{} positions for {count} ids", snapshot.position.len())));
        }
        let mut order: Vec<usize> = (0..count).collect();
        order.sort_by_key(|&k| snapshot.id[k]);
        let position: Vec<f64> = order.iter().flat_map(|&k| snapshot.position[k].iter().copied()).collect();
        let field = |name: &str, unit: &str, description: &str, components, data| StoredField {
            name: name.to_owned(),
            unit: unit.to_owned(),
            description: description.to_owned(),
            column: StoredColumn { data, components },
        };
        let id = order.iter().map(|&k| snapshot.id[k]).collect();
        let mut fields = vec![
            field(POSITION, "m", "Centre of the particle.", 3, ColumnData::F64(position)),
            field(ID, "1", "Stable id of the particle.", 1, ColumnData::U32(id)),
        ];
        for given in &snapshot.fields {
            hdf::check_name(given.name, "a field of a snapshot")?;
            if fields.iter().any(|field| field.name == given.name) {
                return Err(wrong(format!("the field `{}` appears twice", given.name)));
            }
            let rows = given.column.rows(given.name).map_err(|error| wrong(error.to_string()))?;
            if rows != count {
                return Err(wrong(format!("the field `{}` has {rows} rows for {count} particles", given.name)));
            }
            let column = sorted(&given.column, &order);
            fields.push(field(given.name, given.column.unit(), given.description, given.column.components(), column));
        }
        Ok(Self { time: snapshot.time, step: snapshot.step, fields })
    }

    fn write(&self, group: &hdf5::Group, path: &Path) -> Result<(), OutputError> {
        hdf::write_attribute(group, "time", &self.time, path)?;
        hdf::write_attribute(group, "step", &self.step, path)?;
        // Members of a group come back in the order of their names; the number keeps that of the fields.
        for (k, field) in self.fields.iter().enumerate() {
            let name = format!("{k:03} {}", field.name);
            hdf::write_column(group, &name, &field.column.borrow(), &field.unit, &field.description, path)?;
        }
        Ok(())
    }

    pub(super) fn read(group: &hdf5::Group, path: &Path) -> Result<Self, OutputError> {
        let mut fields = Vec::new();
        for name in group.member_names().at(path)? {
            let dataset = group.dataset(&name).at(path)?;
            let (unit, description) = hdf::read_description(&dataset, path)?;
            fields.push(StoredField {
                name: name.get(4..).unwrap_or_default().to_owned(),
                unit,
                description,
                column: hdf::read_column(group, &name, path)?,
            });
        }
        Ok(Self {
            time: hdf::read_attribute(group, "time", path)?,
            step: hdf::read_attribute(group, "step", path)?,
            fields,
        })
    }
}

/// The rows of a column in another order.
fn sorted(column: &Column<'_>, order: &[usize]) -> ColumnData {
    fn pick<T: Copy>(data: &[T], components: usize, order: &[usize]) -> Vec<T> {
        order.iter().flat_map(|&k| data[k * components..(k + 1) * components].iter().copied()).collect()
    }
    match *column {
        Column::F64 { data, components, .. } => ColumnData::F64(pick(data, components, order)),
        Column::U64 { data, components, .. } => ColumnData::U64(pick(data, components, order)),
        Column::U32 { data, components, .. } => ColumnData::U32(pick(data, components, order)),
        Column::U16 { data, components, .. } => ColumnData::U16(pick(data, components, order)),
        Column::U8 { data, components, .. } => ColumnData::U8(pick(data, components, order)),
        Column::I8 { data, components, .. } => ColumnData::I8(pick(data, components, order)),
    }
}

/// A point at which the tests kill the process.
#[cfg(not(test))]
#[inline]
pub(super) fn stage(_name: &str) {}
#[cfg(test)]
pub(super) use tests::stage;

#[cfg(test)]
#[path = "run_files_tests.rs"]
mod tests;
