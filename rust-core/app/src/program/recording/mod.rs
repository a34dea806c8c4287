//! What a run writes besides its time series: its description, its snapshots, and its end. The loop of the program uses it, and so do
//! loops of others, such as Python's, which therefore give the program's results.

mod header;
mod snapshot;
mod tables;

use std::path::{Path, PathBuf};
use std::time::SystemTime;

use super::Failure;
use crate::output::run_files::parts_folder;
use crate::output::{OutputError, ResultFile, RunFiles, csv};
use crate::provenance::{ENDED, STOPPED, date};
use concordem_contact::math::Vec3;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::Model;
use concordem_solver::state::State;

pub use header::header;
pub(super) use header::{INITIAL_HASH, SCENARIO_FILE, check_initial_state, check_inputs};
pub use snapshot::Moment;
use tables::Tables;
pub(super) use tables::{UNBONDED, WALLS, bond_damage};

/// What snapshots and the end of a result need besides the present state.
#[derive(Debug, Clone)]
pub struct Recording {
    /// Positions at the start, m, in the order of the state, which does not change during a run.
    initial_positions: Vec<Vec3>,
    /// Whether snapshots contain the bonds.
    with_bonds: bool,
    /// Whether a table of comma-separated values belongs to the result.
    csv: bool,
}

impl Recording {
    /// The recording of a scenario whose particles start at these positions, m.
    pub fn new(scenario: &Scenario, initial_positions: Vec<Vec3>) -> Self {
        let with_bonds = scenario.output.bond_snapshots && scenario.bonds.is_some();
        Self { initial_positions, with_bonds, csv: scenario.output.csv }
    }

    /// Displacement of every particle since the start, m.
    pub(super) fn displacement(&self, state: &State) -> Vec<Vec3> {
        let now = state.unwrapped_positions();
        now.iter().zip(&self.initial_positions).map(|(now, then)| now - then).collect()
    }

    /// Completes the result of a run: notes about its end, the tables of the final state, and the CSV table if the scenario asks for it.
    /// `reason`: why the run has ended.
    ///
    /// # Errors
    /// A file cannot be written; see [`RunFiles::finish`].
    pub fn finish(&self, simulation: &mut Simulation, mut files: RunFiles, reason: &str) -> Result<(), Failure> {
        let path = files.path().to_owned();
        files.note(STOPPED, reason);
        files.note(ENDED, &date(SystemTime::now()));
        let unmet = simulation.unmet().join("; ");
        if !unmet.is_empty() {
            files.note("servos_not_at_target", &unmet);
        }
        let torn = simulation.torn().join("; ");
        if !torn.is_empty() {
            files.note("membranes_torn", &torn);
        }
        let stages = simulation.ended_stages();
        let stages: Vec<String> = stages.map(|(name, time, step)| format!("{name}: {time:e} s, step {step}")).collect();
        if !stages.is_empty() {
            files.note("stages_ended", &stages.join("; "));
        }
        files.note("threads", &rayon::current_num_threads().to_string());
        let displacement = self.displacement(&simulation.state);
        let forces = simulation.solver.record(&mut simulation.state)?;
        let state = &simulation.state;
        let Model { strengths, joints, .. } = simulation.solver.model();
        let tables = Tables { state, displacement: &displacement, forces: &forces, strengths, joints };
        remove_old_csv(&path, self.csv)?;
        files.finish(state, &tables)?;
        if self.csv {
            write_csv(&path)?;
        }
        Ok(())
    }
}

/// Result file of a scenario.
pub fn result_path(scenario: &Scenario) -> PathBuf {
    match &scenario.output.file {
        Some(file) => scenario.directory().join(file),
        None => PathBuf::from(&*scenario.source.name).with_extension("h5"),
    }
}

/// Refuses result names without an HDF5 extension: readers would not recognize the file, and the name may belong to
/// another file. `option`: what messages begin with.
///
/// # Errors
/// [`Failure::Usage`] with a name that fits.
pub fn check_result_name(option: &str, path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("h5" | "hdf5" | "vtkhdf") => Ok(()),
        _ => Err(Failure::Usage(format!(
            "{option}{}: a result is an HDF5 file and needs the extension .h5, .hdf5, or .vtkhdf; use {}",
            path.display(),
            path.with_extension("h5").display()
        ))),
    }
}

/// Refuses to write a result over another one, over its table (`csv`), or beside an unfinished run.
///
/// # Errors
/// The file that is in the way.
pub fn refuse_existing(path: &Path, csv: bool) -> Result<(), Failure> {
    for path in [Some(path.to_owned()), csv.then(|| csv_path(path))].into_iter().flatten() {
        if path.exists() {
            return Err(OutputError::Exists { path }.into());
        }
    }
    let parts = parts_folder(path);
    if parts.exists() {
        return Err(OutputError::Unfinished { path: parts }.into());
    }
    Ok(())
}

/// Removes the CSV table of an older result that the new result replaces: it could be mistaken for the table of the new result.
///
/// `expected`: the new result will have a table.
fn remove_old_csv(path: &Path, expected: bool) -> Result<(), Failure> {
    let table = csv_path(path);
    let of_old_result = || {
        let text = ResultFile::open(path).and_then(|old| old.scenario()).ok()?;
        Some(Scenario::parse("result", &text).ok()?.output.csv)
    };
    if !table.is_file() || !(expected || of_old_result() == Some(true)) {
        return Ok(());
    }
    std::fs::remove_file(&table).map_err(|error| Failure::File { path: table, action: "remove", error })
}

/// Writes the CSV table of the result at `path`.
pub(super) fn write_csv(path: &Path) -> Result<(), OutputError> {
    csv::write(&ResultFile::open(path)?, &csv_path(path), true)
}

/// Path of the CSV table of a result.
pub(super) fn csv_path(path: &Path) -> PathBuf {
    path.with_extension("csv")
}
