//! `concordem resume`: continue a run.

use std::path::{Path, PathBuf};

use super::drive::{Meter, Run, build, csv_path, result_path, write_csv};
use super::run::{INITIAL_HASH, SCENARIO_FILE, conclude, state_hash};
use super::{Console, Failure, Work};
use crate::output::{OutputError, ResultFile, Resumed, RunFiles};
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

/// Arguments of `concordem resume`.
#[derive(Debug, clap::Args)]
pub(super) struct ResumeArguments {
    /// Result file of the run, its scenario, or its folder FILE.parts
    run: PathBuf,
    #[command(flatten)]
    work: Work,
}

pub(super) fn resume(arguments: &ResumeArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    let path = result_of(&arguments.run)?;
    let (files, mut checkpoint, unusable) = match RunFiles::resume(&path)? {
        Resumed::Finished => {
            // The run may have been killed between writing the result and its table.
            let text = ResultFile::open(&path)?.scenario()?;
            if Scenario::parse(&path.display().to_string(), &text)?.output.csv && !csv_path(&path).exists() {
                write_csv(&path)?;
            }
            console.tell(&format!("{} is finished; there is nothing to resume", path.display()));
            return Ok(());
        }
        Resumed::Continue { files, checkpoint, unusable } => (files, checkpoint, unusable),
    };
    for error in unusable {
        console.tell(&format!("using an older checkpoint: {error}"));
    }
    let entry =
        |name: &str| files.header().provenance.iter().find(|(other, _)| other == name).map(|(_, value)| value.clone());
    let file = entry(SCENARIO_FILE).unwrap_or_default();
    let scenario = Scenario::parse(&file, &files.header().scenario)?;
    let initial_hash = entry(INITIAL_HASH);
    let visible = console.interactive && !arguments.work.quiet;
    let outcome = arguments.work.install(|| {
        let meter = Meter::new(visible);
        // Model and schedule are assembled again; the state is read from the checkpoint.
        let mut assembly = build(&scenario, &meter)?;
        if initial_hash.is_some_and(|hash| state_hash(&assembly.state).is_ok_and(|now| now != hash)) {
            return Err(Failure::Usage(format!(
                "{} cannot be resumed: its scenario builds another initial state than at the start (a packing or mesh \
                 file, or the program, has changed). Run it again with --force.",
                path.display()
            )));
        }
        let initial_positions = assembly.state.particles.position.clone();
        assembly
            .state
            .read(&mut checkpoint.columns)
            .map_err(|source| OutputError::Column { path: path.clone(), source })?;
        let simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
        Run::new(simulation, *files, &initial_positions, &scenario).drive(&meter, false)
    })?;
    conclude(outcome, arguments.work.quiet, console)
}

/// The result file of a path.
fn result_of(path: &Path) -> Result<PathBuf, Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("toml") => Ok(result_path(&Scenario::read(path)?)),
        Some("parts") => Ok(path.with_extension("")),
        _ => Ok(path.to_owned()),
    }
}
