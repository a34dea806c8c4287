//! `concordem run`: run a scenario from the start.

use std::collections::BTreeMap;
use std::io::Read as _;
use std::path::{Path, PathBuf};
use std::time::Instant;

use super::device::DeviceArguments;
use super::drive::{Outcome, Run, build_with, check_result_name, csv_path, result_path};
use super::meter::Meter;
use super::restart::Origin;
use super::settings::Settings;
use super::shell;
use super::watch::Live;
use super::{Console, Facts, Failure, Work};
use crate::output::hash::StateHasher;
use crate::output::run_files::parts_folder;
use crate::output::sealed::target;
use crate::output::{OperatorTable, OutputError, ResultFile, RunFiles, RunHeader, SeriesColumn};
use crate::report::{Coverage, SPECIMEN_LENGTH, summary};
use concordem_files::paths::open_regular;
use concordem_scenario::assembly::Sharpness;
use concordem_scenario::sampling::{SampledQuantity, ScheduledOperator};
use concordem_scenario::schedule::{Record, Simulation};
use concordem_scenario::schema::Scenario;
use concordem_solver::state::State;
use concordem_solver::state::columns::WriteColumns;

/// Arguments of `concordem run`.
#[derive(Debug, clap::Args)]
pub(super) struct RunArguments {
    /// Scenario file
    scenario: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Result file; by default the file named in the scenario, or the name of the scenario with .h5
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Continue from the final state of this result, or from this checkpoint, to extend a run or load the specimen further.
    /// The scenario may differ in `stop`, `output`, `sample`, `loading`, `prescribe`, `force`, gravity, damping, and numbers
    /// in the tables of laws
    #[arg(long, value_name = "FILE")]
    from: Option<PathBuf>,
    /// Show the running specimen on a web page that only this computer can open; PORT 0, the default, takes any free port
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0")]
    watch: Option<u16>,
    /// Overwrite an existing result, or discard an unfinished run
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    work: Work,
}

pub(super) fn run(arguments: &RunArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let begun = Instant::now();
    let scenario = arguments.settings.read(&arguments.scenario)?;
    let device = arguments.device.open(&scenario)?;
    let path = arguments.output.clone().unwrap_or_else(|| result_path(&scenario));
    check_result_name(&path)?;
    let path = target(&path)?;
    if !arguments.force {
        // Check the output paths before making the packing, which may take minutes.
        for path in [Some(path.clone()), scenario.output.csv.then(|| csv_path(&path))].into_iter().flatten() {
            if path.exists() {
                return Err(OutputError::Exists { path }.into());
            }
        }
        let parts = parts_folder(&path);
        if parts.exists() {
            return Err(OutputError::Unfinished { path: parts }.into());
        }
    }
    let origin = arguments.from.as_deref().map(|from| Origin::read(from, &scenario)).transpose()?;
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let outcome = arguments.work.install(|| {
        let meter = Meter::new(display);
        // A state from elsewhere may need the sharp bound for its time step.
        let sharpness = if origin.is_some() { Sharpness::Sharp } else { Sharpness::Sufficient };
        let mut assembly = build_with(&scenario, cache.as_ref(), sharpness, &meter)?;
        if !arguments.work.quiet {
            meter.finish();
            console.warn(&scenario, &scenario.warnings());
            console.warn(&scenario, &assembly.summary.warnings);
        }
        let mut header = header(&scenario, &assembly.state, &assembly.schedule.operators, &assembly.summary)?;
        if let Some((_, length)) = assembly.summary.specimen {
            header.provenance.push((SPECIMEN_LENGTH.to_owned(), format!("{length:e}")));
        }
        header.provenance.extend(arguments.settings.entries(&Settings::default()));
        header.provenance.extend(inputs(&scenario)?.into_iter().map(|(name, _, hash)| (name, hash)));
        let initial_positions = assembly.state.particles.position.clone();
        if let Some(origin) = origin {
            header.provenance.extend(origin.provenance());
            let coverage = origin.add_records(&mut header)?;
            if coverage != Coverage::Whole && !arguments.work.quiet {
                console.tell(&format!("note: {coverage}"));
            }
            origin.apply(&mut assembly, &scenario)?;
        }
        let live = Live::begin(arguments.watch, &scenario.title, &initial_positions, &assembly.state, console)?;
        let files = RunFiles::create(&path, header, arguments.force)?;
        let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
        if let Some(device) = device {
            simulation.use_device(device)?;
        }
        Run::new(simulation, files, &initial_positions, &scenario, begun).watched(live).drive(&meter, true)
    })?;
    conclude(outcome, arguments.work.quiet, console)
}

/// Reports the end of a run.
pub(super) fn conclude(outcome: Outcome, quiet: bool, console: &mut Console<'_>) -> Result<(), Failure> {
    match outcome {
        Outcome::Finished { path, text } => {
            if !quiet {
                console.tell(&text);
                let mut facts = Facts::default();
                for property in summary(&ResultFile::open(&path)?)? {
                    facts.add(&property.symbol, property.value);
                }
                if !facts.0.is_empty() {
                    console.tell(facts.to_string().trim_end());
                }
            }
            console.print(&format!("{}\n", path.display()))
        }
        Outcome::Interrupted { path, step } => Err(Failure::Interrupted(format!(
            "interrupted at step {step}; continue with: concordem resume {}",
            shell::argument(&path)
        ))),
    }
}

/// Hash of a state.
pub(super) fn state_hash(state: &State) -> Result<String, Failure> {
    let mut hasher = StateHasher::default();
    state.write(&mut hasher).map_err(|source| OutputError::Column { path: PathBuf::from("state"), source })?;
    Ok(hasher.finish())
}

/// Fails if a scenario that is built again gives another state than at the start of its run; `recorded`: the hash of that, if it is known.
/// `purpose`: what then cannot be done with `path`.
pub(super) fn check_initial_state(
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
pub(super) const INITIAL_HASH: &str = "initial_state_hash";
/// Beginning of the names of provenance entries with the hashes of the files that a scenario names; the key follows.
const INPUT: &str = "input_";

/// Hash of each file that the scenario names.
fn inputs(scenario: &Scenario) -> Result<Vec<(String, PathBuf, String)>, Failure> {
    let folder = scenario.directory();
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
pub(super) fn check_inputs(provenance: &[(String, String)], scenario: &Scenario, result: &Path) -> Result<(), Failure> {
    for (name, path, now) in inputs(scenario)? {
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

/// Name of the provenance entry with the scenario's file.
pub(super) const SCENARIO_FILE: &str = "scenario_file";

fn header(
    scenario: &Scenario,
    state: &State,
    operators: &[ScheduledOperator],
    summary: &concordem_scenario::assembly::Summary,
) -> Result<RunHeader, Failure> {
    let file = PathBuf::from(&*scenario.source.name);
    let file = std::path::absolute(&file).unwrap_or(file);
    let bounds = &summary.bounds;
    let provenance = [
        (SCENARIO_FILE, file.display().to_string()),
        (INITIAL_HASH, state_hash(state)?),
        ("time_step_s", format!("{:e}", state.clock.dt)),
        ("stability_bound_s", format!("{:e}", bounds.spectral.max(bounds.per_particle))),
        ("unstable", summary.unstable.to_string()),
    ];
    Ok(RunHeader {
        scenario: scenario.source.text.to_string(),
        provenance: provenance.map(|(name, value)| (name.to_owned(), value)).to_vec(),
        series: Record::COLUMNS
            .iter()
            .map(|column| SeriesColumn::new(column.name, column.unit, column.description.trim()))
            .collect(),
        operators: operators.iter().map(operator_table).collect(),
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
