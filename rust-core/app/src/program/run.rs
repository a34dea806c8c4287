//! `concordem run`: run a scenario from the start.

use std::path::{Path, PathBuf};
use std::time::Instant;

use super::device::DeviceArguments;
pub use super::drive::Outcome;
use super::drive::{Run, build_with};
use super::meter::Meter;
use super::recording::{Recording, check_result_name, header, refuse_existing, result_path};
use super::restart::Origin;
use super::settings::Settings;
use super::shell;
use super::watch::Live;
use super::{Console, Facts, Failure, Work};
use crate::output::sealed::target;
use crate::output::{ResultFile, RunFiles};
use crate::report::{Coverage, summary};
use concordem_scenario::assembly::Sharpness;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

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
    let outcome = compute(&scenario, arguments, begun, console)?;
    conclude(outcome, arguments.work.quiet, console)
}

/// Runs a scenario as the command does, for a host. `output`: result file, by default the scenario's; `from`: result or checkpoint
/// to continue.
///
/// # Errors
/// The errors of the command.
pub fn run_scenario(
    scenario: &Scenario,
    output: Option<&Path>,
    from: Option<&Path>,
    overwrite: bool,
    threads: Option<u16>,
    console: &mut Console<'_>,
) -> Result<Outcome, Failure> {
    let arguments = RunArguments {
        scenario: PathBuf::from(&*scenario.source.name),
        settings: Settings::default(),
        output: output.map(Path::to_owned),
        from: from.map(Path::to_owned),
        watch: None,
        force: overwrite,
        device: DeviceArguments::default(),
        work: Work { threads, quiet: false },
    };
    compute(scenario, &arguments, Instant::now(), console)
}

fn compute(
    scenario: &Scenario,
    arguments: &RunArguments,
    begun: Instant,
    console: &mut Console<'_>,
) -> Result<Outcome, Failure> {
    let device = arguments.device.open(scenario)?;
    let path = arguments.output.clone().unwrap_or_else(|| result_path(scenario));
    check_result_name(if console.host.is_some() { "" } else { "--output " }, &path)?;
    let path = target(&path)?;
    if !arguments.force {
        // Before making the packing, which may take minutes.
        refuse_existing(&path, scenario.output.csv)?;
    }
    let origin = arguments.from.as_deref().map(|from| Origin::read(from, scenario)).transpose()?;
    let cache = console.cache();
    let display = console.display(&arguments.work);
    let host = console.host.clone();
    arguments.work.install(|| {
        let meter = Meter::new(display);
        // A state from elsewhere may need the sharp bound for its time step.
        let sharpness = if origin.is_some() { Sharpness::Sharp } else { Sharpness::Sufficient };
        let mut assembly = build_with(scenario, cache.as_ref(), sharpness, &meter)?;
        if !arguments.work.quiet {
            meter.finish();
            console.warn(scenario, &scenario.warnings());
            console.warn(scenario, &assembly.summary.warnings);
        }
        let mut header = header(scenario, &scenario.directory(), &assembly)?;
        header.provenance.extend(arguments.settings.entries(&Settings::default()));
        let initial_positions = assembly.state.particles.position.clone();
        if let Some(origin) = origin {
            header.provenance.extend(origin.provenance());
            let coverage = origin.add_records(&mut header)?;
            if coverage != Coverage::Whole && !arguments.work.quiet {
                console.tell(&format!("note: {coverage}"));
            }
            origin.apply(&mut assembly, scenario)?;
        }
        let live = Live::begin(arguments.watch, &scenario.title, &initial_positions, &assembly.state, console)?;
        let files = RunFiles::create(&path, header, arguments.force)?;
        let mut simulation = Simulation::new(assembly.state, assembly.model, assembly.schedule)?;
        if let Some(device) = device {
            simulation.use_device(device)?;
        }
        let recording = Recording::new(scenario, initial_positions);
        Run::new(simulation, files, recording, begun).watched(live).drive(&meter, true, host.as_ref())
    })
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
