//! `concordem resume`: continue a run.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::device::DeviceArguments;
use super::drive::{Outcome, Run, build_with};
use super::meter::Meter;
use super::recording::{
    INITIAL_HASH, Recording, SCENARIO_FILE, check_initial_state, check_inputs, csv_path, result_path, write_csv,
};
use super::restart::{CONTINUED_HASH, CONTINUES, Origin, apply_changes, listed};
use super::run::conclude;
use super::settings::Settings;
use super::watch::Live;
use super::{Console, Failure, Work, shell};
use crate::output::checkpoint::Checkpoint;
use crate::output::sealed::target;
use crate::output::{ResultFile, Resumed, RunFiles};
use concordem_contact::math::Vec3;
use concordem_scenario::assembly::restart::{Continuation, changes, check};
use concordem_scenario::assembly::{Assembly, PackingCache, Sharpness};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

/// Arguments of `concordem resume`.
#[derive(Debug, clap::Args)]
pub(super) struct ResumeArguments {
    /// Result file of the run, its scenario, or its folder FILE.parts. If the scenario was edited since the start, the run
    /// continues with the edited one if a restart may make the changes (stop, output, loading, ...)
    run: PathBuf,
    #[command(flatten)]
    settings: Settings,
    /// Show the running specimen on a web page that only this computer can open; PORT 0, the default, takes any free port
    #[arg(long, value_name = "PORT", num_args = 0..=1, default_missing_value = "0")]
    watch: Option<u16>,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    work: Work,
}

pub(super) fn resume(arguments: &ResumeArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    match proceed(arguments, console)? {
        Some(outcome) => conclude(outcome, arguments.work.quiet, console),
        None => Ok(()),
    }
}

/// Continues a run as the command does, for a host; `None`: it is finished. `run`: its result, or its folder.
///
/// # Errors
/// The errors of the command.
pub fn resume_run(run: &Path, threads: Option<u16>, console: &mut Console<'_>) -> Result<Option<Outcome>, Failure> {
    let arguments = ResumeArguments {
        run: run.to_owned(),
        settings: Settings::default(),
        watch: None,
        device: DeviceArguments::default(),
        work: Work { threads, quiet: false },
    };
    proceed(&arguments, console)
}

/// Continues a run; `None`: it is finished.
fn proceed(arguments: &ResumeArguments, console: &mut Console<'_>) -> Result<Option<Outcome>, Failure> {
    let begun = Instant::now();
    let settings = &arguments.settings;
    let (path, edited_file) = result_of(&arguments.run, settings)?;
    let (mut files, checkpoint) = match RunFiles::resume(&path)? {
        Resumed::Finished => return finished(&path, edited_file, settings, console).map(|()| None),
        Resumed::Begin { files } => (files, None),
        Resumed::Continue { files, checkpoint, unusable } => {
            for error in unusable {
                console.tell(&format!("using an older checkpoint: {error}"));
            }
            (files, Some(checkpoint))
        }
    };
    let entry =
        |name: &str| files.header().provenance.iter().find(|(other, _)| other == name).map(|(_, value)| value.clone());
    let file = entry(SCENARIO_FILE).unwrap_or_default();
    let first = Scenario::parse(&file, &files.header().scenario)?;
    let recorded = Settings::recorded(files.header().provenance.iter().map(|(name, value)| (&**name, &**value)));
    let given = given(edited_file, &first, &recorded, settings)?;
    let changes = given.as_ref().map(|given| check(&first, given, Continuation::SameResult)).transpose()?;
    let changes = changes.unwrap_or_default();
    let scenario = given.filter(|_| !changes.is_empty()).unwrap_or(first);
    check_inputs(&files.header().provenance, &scenario, &path)?;
    let device = arguments.device.open(&scenario)?;
    let origin = entry(CONTINUES).filter(|_| checkpoint.is_none()).map(|from| (from, entry(CONTINUED_HASH)));
    let edited = entry(CHANGED_LATER).is_some() || !changes.is_empty();
    let initial_hash = entry(INITIAL_HASH).filter(|_| !edited);
    if !changes.is_empty() {
        console.tell(&format!("the scenario was changed: {}", listed(&changes)));
        let earlier = entry(CHANGED_LATER).map_or_else(String::new, |earlier| format!("{earlier}; "));
        let note = (CHANGED_LATER.to_owned(), format!("{earlier}{}", listed(&changes)));
        let notes: Vec<_> = std::iter::once(note).chain(settings.entries(&recorded)).collect();
        files.change_scenario(&scenario.source.text, &notes)?;
    }
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let host = console.host.clone();
    let outcome = arguments.work.install(|| {
        let meter = Meter::new(display);
        // A state of another scenario may need the sharp bound for its time step.
        let sharpness = if edited || origin.is_some() { Sharpness::Sharp } else { Sharpness::Sufficient };
        let fresh = checkpoint.is_none();
        let before = Before { checkpoint, origin, initial_hash, path: &path };
        let (assembly, initial_positions) = assembled(&scenario, before, cache.as_ref(), sharpness, &meter)?;
        let live = Live::begin(arguments.watch, &scenario.title, &initial_positions, &assembly.state, console)?;
        let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
        if let Some(device) = device {
            simulation.use_device(device)?;
        }
        let recording = Recording::new(&scenario, initial_positions);
        Run::new(simulation, *files, recording, begun).watched(live).drive(&meter, fresh, host.as_ref())
    })?;
    Ok(Some(outcome))
}

/// What a run has done before.
pub(super) struct Before<'a> {
    /// Its newest checkpoint; `None`: it begins again.
    pub checkpoint: Option<Box<Checkpoint>>,
    /// The run that it continues, with the hash of its state.
    pub origin: Option<(String, Option<String>)>,
    /// Hash of its initial state, unless the scenario was changed since.
    pub initial_hash: Option<String>,
    /// Its result.
    pub path: &'a Path,
}

/// Assembles model and schedule again, with the state from before. Returns the positions at the start as well, m.
pub(super) fn assembled(
    scenario: &Scenario,
    before: Before<'_>,
    cache: Option<&PackingCache>,
    sharpness: Sharpness,
    meter: &Meter,
) -> Result<(Assembly, Vec<Vec3>), Failure> {
    let Before { checkpoint, origin, initial_hash, path } = before;
    let mut assembly = build_with(scenario, cache, sharpness, meter)?;
    check_initial_state(initial_hash.as_deref(), &assembly.state, path, "resumed")?;
    let initial_positions = assembly.state.particles.position.clone();
    match (checkpoint, origin) {
        (Some(mut checkpoint), _) => restore(&mut checkpoint, &mut assembly, scenario, path)?,
        (None, Some((from, hash))) => begin_from(&from, hash.as_deref(), &mut assembly, scenario)?,
        (None, None) => {}
    }
    Ok((assembly, initial_positions))
}

/// Name of the provenance entry with the keys that were changed while the run was interrupted.
pub(super) const CHANGED_LATER: &str = "changed_keys_on_resumption";

/// Restores the state of a checkpoint, and applies the changes of the scenario since the checkpoint.
fn restore(
    checkpoint: &mut Checkpoint,
    assembly: &mut Assembly,
    scenario: &Scenario,
    path: &Path,
) -> Result<(), Failure> {
    // The header may be newer than the checkpoint: the process was killed after a change and before the next checkpoint.
    let before = Scenario::parse(&path.display().to_string(), &checkpoint.provenance)?;
    let changes = check(&before, scenario, Continuation::SameResult)?;
    apply_changes(checkpoint, assembly, scenario, &changes, path, !changes.is_empty())
}

/// Restores the state from which a run was started that was killed before its first checkpoint.
fn begin_from(from: &str, hash: Option<&str>, assembly: &mut Assembly, scenario: &Scenario) -> Result<(), Failure> {
    let origin = Origin::read(Path::new(from), scenario)?;
    if hash.is_some_and(|hash| hash != origin.state_hash()) {
        return Err(Failure::Usage(format!(
            "{from} has changed since the run was started from it. Run the scenario again with --force."
        )));
    }
    origin.apply(assembly, scenario)
}

/// Completes a finished run: writes the CSV table, if the process was killed before writing it.
fn finished(
    path: &Path,
    edited_file: Option<PathBuf>,
    settings: &Settings,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let result = ResultFile::open(path)?;
    let scenario = Scenario::parse(&path.display().to_string(), &result.scenario()?)?;
    let provenance = result.provenance()?;
    let recorded = Settings::recorded(provenance.iter().map(|(name, value)| (&**name, &**value)));
    drop(result);
    let given = given(edited_file, &scenario, &recorded, settings)?;
    let given = given.as_ref();
    let changed = given.map(|given| changes(&scenario, given)).unwrap_or_default();
    if !changed.is_empty() {
        return Err(Failure::Usage(format!(
            "{0} is finished, and the scenario has changed since ({1}). To continue from its end with a new result: concordem \
             run {2} --from {3} --output NEW.h5",
            path.display(),
            listed(&changed),
            given.map_or_else(|| "SCENARIO.toml".into(), |given| shell::argument(Path::new(&*given.source.name))),
            shell::argument(path),
        )));
    }
    if scenario.output.csv && !csv_path(path).exists() {
        write_csv(path)?;
    }
    console.tell(&format!("{} is finished; there is nothing to resume", path.display()));
    Ok(())
}

/// The result file that belongs to a path, and the file of the scenario if the path is one.
fn result_of(path: &Path, settings: &Settings) -> Result<(PathBuf, Option<PathBuf>), Failure> {
    let (result, scenario) = match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => (result_path(&settings.read(path)?), Some(path.to_owned())),
        Some("parts") => (path.with_extension(""), None),
        _ => (path.to_owned(), None),
    };
    Ok((target(&result)?, scenario))
}

/// The scenario to continue with, if it may differ from that of the run, `first`: the edited file with the settings of the run, and
/// with the `settings` of this command.
fn given(
    edited_file: Option<PathBuf>,
    first: &Scenario,
    recorded: &Settings,
    settings: &Settings,
) -> Result<Option<Scenario>, Failure> {
    match edited_file {
        Some(file) => Ok(Some(recorded.then(settings).read(&file)?)),
        None if settings.is_empty() => Ok(None),
        None => Ok(Some(settings.change(first)?)),
    }
}
