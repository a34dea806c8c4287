//! The command line program `concordem`.
//!
//! One file per command. Commands write to a [`Console`] and return a [`Failure`] on error, so that tests can run them in
//! the test process.

mod calibrate;
mod characterise;
pub mod check;
mod completions;
mod device;
mod drive;
mod elastic;
mod events;
pub mod explain;
pub mod export;
mod failure;
mod fragments;
mod info;
mod init;
pub mod measure;
mod meter;
mod pack;
pub mod plot;
pub mod progress;
mod readable;
pub mod recording;
pub mod render;
pub mod report;
mod restart;
pub mod resume;
pub mod run;
mod schema;
mod settings;
mod shell;
mod so_far;
pub mod sweep;
mod watch;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use clap::{Args, CommandFactory, FromArgMatches, Parser, Subcommand};

pub use calibrate::{ElasticRequest, ElasticSearch, Spelling, calibrate_elastic, calibrated_law};
pub use failure::Failure;

use concordem_scenario::assembly::PackingCache;
use concordem_scenario::schema::{Problem, Scenario, ScenarioError};
use meter::Display;
pub use meter::Listener;

/// Exit codes, documented in the help of the program.
pub mod exit {
    /// Success.
    pub const DONE: u8 = 0;
    /// Internal error.
    pub const INTERNAL: u8 = 1;
    /// Wrong arguments, or an invalid scenario.
    pub const USAGE: u8 = 2;
    /// A file cannot be read or written, or is damaged.
    pub const FILE: u8 = 3;
    /// The calculation was refused or failed: unstable time step, motion no longer finite.
    pub const PHYSICS: u8 = 4;
    /// Stopped by SIGINT or SIGTERM after a checkpoint.
    pub const INTERRUPTED: u8 = 130;
}

const EXAMPLES: &str = "\
Examples:
  concordem init --template cpm-small          write cpm-small.toml, a commented scenario
  concordem check cpm-small.toml               particles, memory, time step, and estimated run time
  concordem run cpm-small.toml                 run it; the result is cpm-small.h5
  concordem run cpm-small.toml --set loading.strain_rate='10 1/s' -o fast.h5
                                               the same with another value of a key
  concordem resume cpm-small.h5                continue after Ctrl-C, a kill, or a power failure
  concordem run further.toml --from cpm-small.h5
                                               extend a finished run, or load the specimen further
  concordem report cpm-small.h5                curves and values as a web page, cpm-small.html
  concordem plot a.h5 b.h5 c.h5 --mean -o curve.pdf
                                               mean and scatter of repeated runs, as a figure for a paper
  concordem render cpm-small.h5 --cut y        the particles by their damage, cut open, as a picture, cpm-small.png
  concordem measure cpm-small.h5 --operator region-stress \\
    --region '{ kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }'
  concordem sweep elastic-sweep.toml           elastic constants over ranges of parameters
  concordem info cpm-small.h5 --hash           hash of the final state, to compare runs

A scenario is a TOML file in SI units; quantities may have other units: young = \"30 GPa\". Tension is positive.
`concordem init` lists the templates; `concordem explain KEY` explains a key; `concordem schema` writes the JSON Schema for editors.

Exit codes:
  0    done
  1    internal error; please report it
  2    wrong arguments, or an invalid scenario
  3    a file cannot be read or written, or is damaged
  4    the calculation was refused or failed (unstable time step, motion no longer finite)
  130  interrupted by Ctrl-C or SIGTERM; a checkpoint was written and `concordem resume` continues";

#[derive(Debug, Parser)]
#[command(
    name = "concordem",
    version,
    about = "Discrete element method for cohesive materials: concrete, rock, glass, ceramics, powders",
    after_help = EXAMPLES,
    max_term_width = 110,
    subcommand_required = true,
    arg_required_else_help = true
)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Debug, Subcommand)]
enum Command {
    /// Write a commented scenario template
    Init(init::InitArguments),
    /// Validate a scenario and print its particles, bonds, memory, time step, and estimated run time
    Check(check::CheckArguments),
    /// Run a scenario
    Run(run::RunArguments),
    /// Continue an interrupted or killed run; the result equals that of an uninterrupted run
    Resume(resume::ResumeArguments),
    /// Print the contents of a result file
    Info(info::InfoArguments),
    /// Show a run that goes on, in this or another terminal, on a web page that only this computer can open
    Watch(watch::WatchArguments),
    /// Evaluate operators on a finished run: stress, couple stress, strain, fabric, porosity, damage of a region
    Measure(measure::MeasureArguments),
    /// Count the cracks of a finished run by mode, and group them into acoustic emissions with magnitudes and a b-value
    Events(events::EventsArguments),
    /// Sieve the fragments of a finished run: sizes, debris, largest fragment, speeds; fit Rosin-Rammler and Gaudin-Schuhmann
    Fragments(fragments::FragmentsArguments),
    /// Write a web page about one or more results: curves, strengths, cracks, energies
    Report(report::ReportArguments),
    /// Draw one sampled quantity over another as SVG or PDF, of one or more results; with mean and band of repeated runs
    Plot(plot::PlotArguments),
    /// Draw a result at chosen times as PNG: particles by any field, bonds, cracks, walls; from any side, cut open, as a slice, animated
    Render(render::RenderArguments),
    /// Write particles and bonds at all snapshots for ParaView, OVITO, or LAMMPS
    Export(export::ExportArguments),
    /// Measure the structure of a packing: coordination, density, sizes, directions, order; write a web page and JSON
    Characterise(characterise::CharacteriseArguments),
    /// Compute the elastic constants of a bonded periodic packing by four methods
    Elastic(elastic::ElasticArguments),
    /// Compute elastic constants, structures of packings, or results and curves of whole runs, for all combinations or samples of values
    /// of a scenario's keys; write one file and one web page
    Sweep(sweep::SweepArguments),
    /// Generate only the packing of a scenario and write it to a file
    Pack(pack::PackArguments),
    /// Find bond parameters for target material properties, and write a scenario with them
    Calibrate(calibrate::CalibrateArguments),
    /// Explain a key of a scenario: meaning, unit, default, allowed words
    Explain(explain::ExplainArguments),
    /// Write the JSON Schema of scenarios, or of sweeps, for editors with completion
    Schema(schema::SchemaArguments),
    /// Write a script that completes commands and options in a shell
    Completions(completions::CompletionsArguments),
}

/// Options of commands that compute.
#[derive(Debug, Clone, Args)]
struct Work {
    /// Number of threads; by default one per processor. Results are bitwise equal for any number
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print errors only
    #[arg(long, short)]
    quiet: bool,
}

impl Work {
    /// Runs `work` on the given number of threads.
    fn install<T: Send>(&self, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
        let threads = self.threads.map_or(0, usize::from);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| Failure::Usage(format!("cannot start {threads} threads: {error}")))?
            .install(work)
    }
}

/// Names and values, one indented pair per line.
#[derive(Default)]
struct Facts(Vec<(String, String)>);

impl Facts {
    fn add(&mut self, name: &str, value: impl Into<String>) {
        self.0.push((name.to_owned(), value.into()));
    }
}

impl std::fmt::Display for Facts {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let width = self.0.iter().map(|(name, _)| name.chars().count()).max().unwrap_or(0) + 2;
        self.0.iter().try_for_each(|(name, value)| writeln!(formatter, "  {name:width$}{value}"))
    }
}

/// Output of a command.
pub struct Console<'a> {
    /// Results.
    pub out: &'a mut (dyn Write + Send),
    /// Progress and errors.
    pub err: &'a mut (dyn Write + Send),
    /// Whether `err` is a terminal.
    pub interactive: bool,
    /// Whether `out` is a terminal.
    pub out_interactive: bool,
    /// Folder in which packings are stored, so that the next command need not make them again; `None`: nowhere.
    pub packings: Option<PathBuf>,
    /// The file with this code, whose content identifies the build; `None`: the running executable. In Python's process, that is
    /// the interpreter, which stays the same when the package changes.
    pub code: Option<PathBuf>,
    /// The program that calls the command as a function, if one does.
    pub host: Option<Host>,
}

/// A program that calls commands as functions: it handles signals, progress, and warnings.
#[derive(Clone)]
pub struct Host {
    /// Set to end the command; a run then writes a checkpoint.
    pub interrupted: Arc<AtomicBool>,
    /// Receives the progress.
    pub progress: Listener,
    /// Receives the warnings about scenarios.
    pub warn: Warn,
}

/// What receives the warnings about a scenario.
pub type Warn = Arc<dyn Fn(&Scenario, &[Problem]) + Send + Sync>;

/// Folder of stored packings: `CONCORDEM_CACHE`, or `concordem` in the user's cache folder. `CONCORDEM_CACHE=off`: none.
pub fn packings_folder() -> Option<PathBuf> {
    match std::env::var_os("CONCORDEM_CACHE") {
        Some(word) if word == "off" || word.is_empty() => return None,
        Some(folder) => return Some(PathBuf::from(folder)),
        None => {}
    }
    let absolute = |name: &str| std::env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let folder = absolute("XDG_CACHE_HOME").or_else(|| absolute("HOME").map(|home| home.join(".cache")))?;
    Some(folder.join("concordem"))
}

impl Console<'_> {
    /// The store of packings.
    fn cache(&self) -> Option<PackingCache> {
        let folder = self.packings.clone()?;
        // Another build may make another packing.
        let code = self.code.clone().map_or_else(std::env::current_exe, Ok);
        let program = code.and_then(std::fs::read).ok()?;
        Some(PackingCache::new(folder, blake3::hash(&program).to_hex().to_string()))
    }

    /// How to show the progress of a command: a bar on a terminal, lines from time to time elsewhere.
    fn display(&self, work: &Work) -> Display {
        match (work.quiet, self.interactive, &self.host) {
            (_, _, Some(host)) => Display::Host(host.progress.clone()),
            (true, ..) => Display::Nothing,
            (false, true, None) => Display::Bar,
            (false, false, None) => Display::Lines,
        }
    }

    /// Writes to `out`. A closed pipe (`concordem schema | head`) is not an error.
    fn print(&mut self, text: &str) -> Result<(), Failure> {
        match self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Failure::File { path: PathBuf::from("standard output"), action: "write", error })
            }
            _ => Ok(()),
        }
    }

    /// Writes warnings about a scenario to `err`.
    fn warn(&mut self, scenario: &Scenario, warnings: &[Problem]) {
        if let Some(host) = &self.host {
            return (host.warn)(scenario, warnings);
        }
        for warning in warnings {
            let text = ScenarioError::new(&scenario.source, vec![warning.clone()]).to_string();
            self.tell(&format!("warning: {text}"));
        }
    }

    /// Writes a line to `err`; failures are ignored.
    fn tell(&mut self, text: &str) {
        let _ = writeln!(self.err, "{text}");
    }
}

/// Names of values that are numbers or quantities.
const NUMBERS: [&str; 13] =
    ["NUMBER", "STRESS", "DENSITY", "LENGTH", "TIME", "AREA", "RATIO", "SHARE", "M", "N", "PORT", "X,Y,Z", "NX,NY,NZ"];

/// The command line. Numbers and quantities may begin with a minus, so that what reads them says what is wrong with "-75 GPa".
fn command_line() -> clap::Command {
    fn with_minus(command: clap::Command) -> clap::Command {
        let is_number = |argument: &clap::Arg| {
            let names = argument.get_value_names().unwrap_or_default();
            // An option that may stand alone would take the next one as its value.
            let stands_alone = argument.get_num_args().is_some_and(|range| range.min_values() == 0);
            !stands_alone && names.iter().any(|name| NUMBERS.contains(&name.as_str()))
        };
        let command = command
            .mut_args(|argument| if is_number(&argument) { argument.allow_hyphen_values(true) } else { argument });
        command.mut_subcommands(with_minus)
    }
    with_minus(Cli::command())
}

/// Reads the command line.
fn parse(arguments: &[OsString]) -> Result<Cli, clap::Error> {
    let mut command = command_line();
    let matches = command.try_get_matches_from_mut(arguments)?;
    Cli::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
}

/// Runs a command; returns the exit code. `arguments` start with the name of the program.
pub fn run(arguments: impl IntoIterator<Item = OsString>, console: &mut Console<'_>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = match parse(&arguments) {
        Ok(cli) => cli,
        Err(error) => {
            if let Some(problem) = settings::without_sign(&arguments) {
                console.tell(&format!("error: {problem}"));
                return exit::USAGE;
            }
            let text = error.render();
            if error.use_stderr() {
                let text = if console.interactive { text.ansi().to_string() } else { text.to_string() };
                let _ = write!(console.err, "{text}");
                return exit::USAGE;
            }
            let text = if console.out_interactive { text.ansi().to_string() } else { text.to_string() };
            return if console.print(&text).is_ok() { exit::DONE } else { exit::FILE };
        }
    };
    let outcome = match &cli.command {
        Command::Init(arguments) => init::init(arguments, console),
        Command::Check(arguments) => check::check(arguments, console),
        Command::Run(arguments) => run::run(arguments, console),
        Command::Resume(arguments) => resume::resume(arguments, console),
        Command::Measure(arguments) => measure::measure(arguments, console),
        Command::Info(arguments) => info::info(arguments, console),
        Command::Events(arguments) => events::events(arguments, console),
        Command::Fragments(arguments) => fragments::fragments(arguments, console),
        Command::Report(arguments) => report::report(arguments, console),
        Command::Plot(arguments) => plot::plot(arguments, console),
        Command::Render(arguments) => render::render(arguments, console),
        Command::Export(arguments) => export::export(arguments, console),
        Command::Characterise(arguments) => characterise::run(arguments, console),
        Command::Elastic(arguments) => elastic::elastic(arguments, console),
        Command::Sweep(arguments) => sweep::sweep(arguments, console),
        Command::Pack(arguments) => pack::pack(arguments, console),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments, console),
        Command::Explain(arguments) => explain::explain(arguments, console),
        Command::Schema(arguments) => schema::schema(arguments, console),
        Command::Watch(arguments) => watch::watch(arguments, console),
        Command::Completions(arguments) => completions::completions(arguments, console),
    };
    match outcome {
        Ok(()) => exit::DONE,
        Err(failure) => {
            let text = failure.render(console.interactive);
            let _ = write!(console.err, "{text}");
            failure.code()
        }
    }
}

/// Stack of the program's work, bytes.
const STACK: usize = 8 << 20;

/// Entry point of the program.
pub fn main() -> ExitCode {
    // A panic is an internal error; print its location instead of a stack trace.
    std::panic::set_hook(Box::new(|panic| {
        let place = panic.location().map(|place| format!(" at {}:{}", place.file(), place.line())).unwrap_or_default();
        let payload = panic.payload();
        let message = payload
            .downcast_ref::<&str>()
            .map(ToString::to_string)
            .or_else(|| payload.downcast_ref::<String>().cloned())
            .unwrap_or_default();
        let _ = writeln!(
            std::io::stderr(),
            "concordem {}: internal error{place}: {message}\nPlease report it with the command, the scenario, and \
             these lines.",
            env!("CARGO_PKG_VERSION")
        );
    }));
    let work = || {
        let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
        let (out_interactive, interactive) = (out.is_terminal(), err.is_terminal());
        let packings = packings_folder();
        let (out, err, code) = (&mut out, &mut err, None);
        run(std::env::args_os(), &mut Console { out, err, interactive, out_interactive, packings, code, host: None })
    };
    // In a thread, whose stack does not depend on the limit of the shell.
    let code = match std::thread::Builder::new().stack_size(STACK).spawn(work) {
        Ok(thread) => thread.join().unwrap_or(exit::INTERNAL),
        Err(error) => {
            let _ = writeln!(std::io::stderr(), "concordem: cannot start a thread: {error}");
            exit::PHYSICS
        }
    };
    ExitCode::from(code)
}
