//! The description of a run before its first step, and what it must still be when the run is resumed.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};

use crate::output::hash::StateHasher;
use crate::output::{OperatorTable, OutputError, RunHeader, SeriesColumn};
use crate::program::Failure;
pub(in crate::program) use crate::provenance::SCENARIO_FILE;
use crate::report::{SPECIMEN_LENGTH, STRESS_ROUNDING};
use concordem_files::paths::open_regular;
use concordem_scenario::assembly::Assembly;
use concordem_scenario::sampling::{Record, SampledQuantity, ScheduledOperator};
use concordem_scenario::schema::Scenario;
use concordem_solver::state::State;
use concordem_solver::state::columns::WriteColumns;

/// Hash of a state.
fn state_hash(state: &State) -> Result<String, Failure> {
    let mut hasher = StateHasher::default();
    state.write(&mut hasher).map_err(|source| OutputError::Column { path: PathBuf::from("state"), source })?;
    Ok(hasher.finish())
}

/// Fails if a scenario that is built again gives another state than at the start of its run; `recorded`: the hash of that, if it is known.
/// `purpose`: what then cannot be done with `path`.
pub(in crate::program) fn check_initial_state(
    recorded: Option<&str>,
    state: &State,
    path: &Path,
    purpose: &str,
) -> Result<(), Failure> {
    if recorded.is_some_and(|hash| state_hash(state).is_ok_and(|now| now != hash)) {
        return Err(Failure::Usage(format!(
            "{} cannot be {purpose}: its scenario builds another initial state than at the start (a packing or mesh \
             file, or the program, has changed). Run it again with --force.",
            path.display()
        )));
    }
    Ok(())
}

/// Name of the provenance entry with the hash of the state before the first step.
pub(in crate::program) const INITIAL_HASH: &str = "initial_state_hash";
/// Beginning of the names of provenance entries with the hashes of the files that a scenario names; the key follows.
const INPUT: &str = "input_";

/// Hash of each file that the scenario names.
fn inputs(scenario: &Scenario, folder: &Path) -> Result<Vec<(String, PathBuf, String)>, Failure> {
    let entry = |(key, file): (String, &str)| {
        let path = folder.join(file);
        let bytes = open_regular(&path).and_then(|mut file| {
            let mut bytes = Vec::new();
            file.read_to_end(&mut bytes).map(|_| bytes)
        });
        let bytes = bytes.map_err(|error| Failure::File { path: path.clone(), action: "read", error })?;
        Ok((format!("{INPUT}{key}"), path, blake3::hash(&bytes).to_hex().to_string()))
    };
    scenario.files().into_iter().map(entry).collect()
}

/// Fails if a file that the scenario names differs from that at the start of its run, whose `provenance` has the hashes. The state
/// does not show all of them: a motion that is read while the run goes on is not in it.
pub(in crate::program) fn check_inputs(
    provenance: &[(String, String)],
    scenario: &Scenario,
    result: &Path,
) -> Result<(), Failure> {
    for (name, path, now) in inputs(scenario, &scenario.directory())? {
        let then = provenance.iter().find(|(other, _)| *other == name).map(|(_, hash)| hash);
        if then.is_some_and(|then| *then != now) {
            return Err(Failure::Usage(format!(
                "{} cannot be resumed: {} ({}) has changed since the start of the run. Bring the file back as it was, or run the \
                 scenario again with --force.",
                result.display(),
                path.display(),
                &name[INPUT.len()..]
            )));
        }
    }
    Ok(())
}

/// The description of a run whose paths are relative to `folder`, before its first step.
///
/// # Errors
/// A file that the scenario names cannot be read.
pub fn header(scenario: &Scenario, folder: &Path, assembly: &Assembly) -> Result<RunHeader, Failure> {
    let Assembly { state, schedule, summary, .. } = assembly;
    let file = PathBuf::from(&*scenario.source.name);
    let file = std::path::absolute(&file).unwrap_or(file);
    let bounds = &summary.bounds;
    let entries = [
        (SCENARIO_FILE, file.display().to_string()),
        (INITIAL_HASH, state_hash(state)?),
        ("time_step_s", format!("{:e}", state.clock.dt)),
        ("stability_bound_s", format!("{:e}", bounds.spectral.max(bounds.per_particle))),
        ("unstable", summary.unstable.to_string()),
    ];
    let mut provenance = entries.map(|(name, value)| (name.to_owned(), value)).to_vec();
    if let Some((_, length)) = summary.specimen {
        provenance.push((SPECIMEN_LENGTH.to_owned(), format!("{length:e}")));
    }
    if schedule.rounding.one_step > 0.0 {
        provenance.push((STRESS_ROUNDING.to_owned(), format!("{:e}", schedule.rounding.one_step)));
    }
    provenance.extend(inputs(scenario, folder)?.into_iter().map(|(name, _, hash)| (name, hash)));
    Ok(RunHeader {
        scenario: scenario.source.text.to_string(),
        provenance,
        series: Record::columns(schedule.confinement.is_some())
            .iter()
            .map(|column| SeriesColumn::new(column.name, column.unit, column.description.trim()))
            .collect(),
        operators: schedule.operators.iter().map(operator_table).collect(),
        earlier: BTreeMap::new(),
    })
}

fn operator_table(sample: &ScheduledOperator) -> OperatorTable {
    let quantities = sample.operator.quantities().iter();
    let grid =
        sample.grid.map_or_else(String::new, |[x, y, z]| format!(", in each of {x} x {y} x {z} cells, x fastest"));
    let description = format!("{}, every {} steps{grid}", sample.operator.name(), sample.interval);
    let column =
        |q: &SampledQuantity| (SeriesColumn::new(q.name, q.unit, q.description), q.components * sample.cells());
    OperatorTable { name: sample.name.clone(), description, quantities: quantities.map(column).collect() }
}
