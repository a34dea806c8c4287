//! Results of unfinished runs: what they had done at their newest checkpoint, for the commands that read results.

use std::path::Path;

use super::drive::scenario_instead;
use super::meter::{Display, Meter};
use super::readable::count;
use super::recording::{INITIAL_HASH, Recording, SCENARIO_FILE, check_inputs};
use super::resume::{Before, CHANGED_LATER, assembled};
use super::{Console, Failure};
use crate::output::{OutputError, ResultFile, Resumed, RunFiles, SoFar};
use crate::provenance::UNFINISHED;
use concordem_scenario::assembly::Sharpness;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

/// Opens a result, or what an unfinished run has done so far; says what to do if the file is a scenario.
pub(super) fn open_result(path: &Path, console: &mut Console<'_>) -> Result<ResultFile, Failure> {
    scenario_instead(path)?;
    match ResultFile::open(path) {
        Err(OutputError::Unfinished { .. }) => {}
        opened => return Ok(opened?),
    }
    unfinished(path, console).or_else(|error| {
        // It may have ended at this moment.
        ResultFile::open(path).map_err(|_| error)
    })
}

/// The result of the unfinished run whose result will be `path`, in a folder that goes with it. The run is not touched.
///
/// # Errors
/// The run has no checkpoint yet, its files cannot be read, or its scenario cannot be assembled again.
fn unfinished(path: &Path, console: &mut Console<'_>) -> Result<ResultFile, Failure> {
    let too_early =
        || Failure::Usage(format!("{} is not finished, and has no checkpoint yet: wait some seconds", path.display()));
    let so_far = match SoFar::of(path) {
        Err(OutputError::NoCheckpoint { reasons, .. }) if reasons.is_empty() => return Err(too_early()),
        so_far => so_far?,
    };
    let Resumed::Continue { mut files, checkpoint, .. } = RunFiles::resume(&so_far.path)? else {
        return Err(too_early());
    };
    let entry =
        |name: &str| files.header().provenance.iter().find(|(other, _)| other == name).map(|(_, value)| value.clone());
    let scenario = Scenario::parse(&entry(SCENARIO_FILE).unwrap_or_default(), &files.header().scenario)?;
    check_inputs(&files.header().provenance, &scenario, path)?;
    let edited = entry(CHANGED_LATER).is_some();
    let initial_hash = entry(INITIAL_HASH).filter(|_| !edited);
    let before = Before { checkpoint: Some(checkpoint), origin: None, initial_hash, path };
    let meter = Meter::new(Display::Nothing);
    let cache = console.cache();
    // As when it is resumed.
    let sharpness = if edited { Sharpness::Sharp } else { Sharpness::Sufficient };
    let (assembly, initial_positions) = assembled(&scenario, before, cache.as_ref(), sharpness, &meter)?;
    let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
    let recording = Recording::new(&scenario, initial_positions);
    // A run writes a checkpoint before the snapshot of its step.
    let moment = recording.snapshot(&mut simulation)?;
    files.append_snapshot(moment.particles)?;
    if let Some(bonds) = moment.bonds {
        files.append_bonds(bonds);
    }
    let clock = simulation.state.clock;
    let state = if so_far.is_running { "goes on" } else { "was stopped" };
    let reason = format!(
        "{UNFINISHED}: the run {state}, and this is its newest checkpoint, step {}, {:.6e} s",
        count(clock.step as usize),
        clock.time()
    );
    console.tell(&format!("{}: {reason}", path.display()));
    recording.finish(&mut simulation, *files, &reason)?;
    let result = ResultFile::open(&so_far.path)?;
    Ok(result.keeping(so_far.keep()))
}
