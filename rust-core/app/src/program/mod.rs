//! The command line program `concordem`.
//!
//! One file per command. Commands write to a [`Console`] and return a [`Failure`] or nothing, so that tests can run
//! them without a process.

mod calibrate;
mod check;
mod drive;
mod elastic;
mod failure;
mod info;
mod init;
mod measure;
mod pack;
mod report;
mod resume;
mod run;
mod schema;
mod sweep;
mod tables;

use std::ffi::OsString;
use std::io::{IsTerminal, Write};
use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand};

pub use calibrate::{ElasticRequest, ElasticSearch, Spelling, calibrate_elastic, calibrated_law};
pub use failure::Failure;

/// Exit codes, as documented in the program's help.
pub mod exit {
    /// Done.
    pub const DONE: u8 = 0;
    /// The program has a fault.
    pub const INTERNAL: u8 = 1;
    /// Wrong arguments, or a scenario that cannot be built.
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
  concordem check cpm-small.toml               what would be built, and how long it takes
  concordem run cpm-small.toml                 run it; the result is cpm-small.h5
  concordem resume cpm-small.h5                go on after Ctrl-C, a kill, or a power cut
  concordem report cpm-small.h5                curves and figures as a web page, cpm-small.html
  concordem measure cpm-small.h5 --operator region-stress \\
    --region '{ kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }'
  concordem sweep elastic-sweep.toml           constants over a range of parameters; elastic-sweep.h5 and .html
  concordem info cpm-small.h5 --hash           hash of the final state, to compare runs

A scenario is a TOML file in SI units; quantities may carry units: young = \"30 GPa\". Tension is positive.
`concordem init` lists the templates; `concordem schema` writes the JSON Schema for editors.

Exit codes:
  0    done
  1    fault of the program; please report it
  2    wrong arguments, or a scenario that cannot be built
  3    a file cannot be read or written, or is damaged
  4    the calculation was refused or failed (unstable time step, motion no longer finite)
  130  interrupted by Ctrl-C or SIGTERM; a checkpoint was written and `concordem resume` goes on";

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
    /// Write a commented scenario to start from
    Init(init::Arguments),
    /// Validate a scenario and print what would be built: particles, links, memory, time step, estimated time
    Check(check::Arguments),
    /// Run a scenario
    Run(run::Arguments),
    /// Go on with a run that was interrupted or killed; the result equals that of an undisturbed run
    Resume(resume::Arguments),
    /// Print what a result file holds
    Info(info::Arguments),
    /// Evaluate operators on a finished run: stress, couple stress, strain, fabric, porosity, damage of a region
    Measure(measure::Arguments),
    /// Write a web page about one or more results: curves, figures, cracks, energies
    Report(report::Arguments),
    /// Young's modulus, Poisson's ratio, and all elastic constants of a bonded periodic packing, four ways
    Elastic(elastic::Arguments),
    /// The elastic constants at all combinations of values of a scenario's keys: one file, one page of figures
    Sweep(sweep::Arguments),
    /// Make only the packing of a scenario and write it as a text file
    Pack(pack::Arguments),
    /// Find parameters of bonds for wanted properties of a material, and write a scenario with them
    Calibrate(calibrate::Arguments),
    /// Write the JSON Schema of scenarios, for editors with completion
    Schema(schema::Arguments),
}

/// Options of commands that calculate.
#[derive(Debug, Clone, Args)]
struct Work {
    /// Threads to use; all processors by default. Results do not depend on it, bit by bit
    #[arg(long, short = 'j', value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    threads: Option<u16>,
    /// Print errors only
    #[arg(long, short)]
    quiet: bool,
}

impl Work {
    /// Do the work on a pool of the wanted number of threads.
    fn install<T: Send>(&self, work: impl FnOnce() -> Result<T, Failure> + Send) -> Result<T, Failure> {
        let threads = self.threads.map_or(0, usize::from);
        rayon::ThreadPoolBuilder::new()
            .num_threads(threads)
            .build()
            .map_err(|error| Failure::Usage(format!("cannot start {threads} threads: {error}")))?
            .install(work)
    }
}

/// Names and values, one pair per line and indented.
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

/// Where a command writes.
pub struct Console<'a> {
    /// What was asked for.
    pub out: &'a mut (dyn Write + Send),
    /// What goes on, and errors.
    pub err: &'a mut (dyn Write + Send),
    /// Whether `err` is a terminal that a person looks at.
    pub interactive: bool,
    /// Whether `out` is one.
    pub out_interactive: bool,
}

impl Console<'_> {
    /// Write to `out`. A reader that has gone away (`concordem schema | head`) is no fault.
    fn print(&mut self, text: &str) -> Result<(), Failure> {
        match self.out.write_all(text.as_bytes()).and_then(|()| self.out.flush()) {
            Err(error) if error.kind() != std::io::ErrorKind::BrokenPipe => {
                Err(Failure::File { path: PathBuf::from("standard output"), action: "write", error })
            }
            _ => Ok(()),
        }
    }

    /// Tell what goes on; that nobody listens is no reason to stop.
    fn tell(&mut self, text: &str) {
        let _ = writeln!(self.err, "{text}");
    }
}

/// Run a command; the exit code. `arguments` begin with the program's name.
pub fn run(arguments: impl IntoIterator<Item = OsString>, console: &mut Console<'_>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
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
        Command::Report(arguments) => report::report(arguments, console),
        Command::Elastic(arguments) => elastic::elastic(arguments, console),
        Command::Sweep(arguments) => sweep::sweep(arguments, console),
        Command::Pack(arguments) => pack::pack(arguments, console),
        Command::Calibrate(arguments) => calibrate::calibrate(arguments, console),
        Command::Schema(arguments) => schema::schema(arguments, console),
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

/// The program.
pub fn main() -> ExitCode {
    // A panic is a fault of the program; say so in place of a stack trace, and say where.
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
            "concordem {} has a fault{place}: {message}\nThis is not your doing. Please report it with the command, \
             the scenario, and these lines.",
            env!("CARGO_PKG_VERSION")
        );
    }));
    let code = std::panic::catch_unwind(|| {
        let (mut out, mut err) = (std::io::stdout(), std::io::stderr());
        let (out_interactive, interactive) = (out.is_terminal(), err.is_terminal());
        run(std::env::args_os(), &mut Console { out: &mut out, err: &mut err, interactive, out_interactive })
    });
    ExitCode::from(code.unwrap_or(exit::INTERNAL))
}
