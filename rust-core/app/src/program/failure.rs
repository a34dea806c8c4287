//! Failures of commands: messages and exit codes.

use std::fmt::Write as _;
use std::io;
use std::path::PathBuf;

use super::exit;
use crate::calibration::elastic::ElasticCalibrationError;
use crate::output::OutputError;
use crate::sweep::journal::JournalError;
use concordem_operator::OperatorError;
use concordem_packing::PackingError;
use concordem_scenario::assembly::AssemblyError;
use concordem_scenario::schedule::simulation::RunError;
use concordem_scenario::schema::{Location, Packing, ProblemKind, ReadError, Scenario, ScenarioError, Shape};
use concordem_solver::SolverError;
use concordem_statics::StaticsError;

/// Formats of packings.
const FORMATS: &str = "a packing file has one sphere per line, x y z r; or it is CSV with the columns x, y, z, radius, a LAMMPS data \
                       file of the atom style sphere, a dump, or an HDF5 sphere pack (.h5)";

/// Formats of surfaces.
const SURFACES: &str = "a surface is an STL file, text or binary; a body or an aggregate needs a closed one";

/// Failure of a command.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Failure {
    /// Wrong arguments.
    #[error("{0}")]
    Usage(String),
    /// The scenario is invalid.
    #[error("{0}")]
    Scenario(ScenarioError),
    /// The scenario is unstable.
    #[error("{0}")]
    Unstable(ScenarioError),
    /// The scenario cannot be assembled.
    #[error("{0}")]
    Assembly(AssemblyError),
    /// A file cannot be read or written.
    #[error("cannot {action} {}: {error}", path.display())]
    File {
        /// The file.
        path: PathBuf,
        /// Attempted action, such as "read".
        action: &'static str,
        /// Error of the operating system.
        error: io::Error,
    },
    /// A scenario is not a text file.
    #[error("{0}")]
    NotText(String),
    /// A result or checkpoint cannot be read or written.
    #[error("{0}")]
    Output(#[from] OutputError),
    /// The calculation failed.
    #[error("{0}")]
    Solver(#[from] SolverError),
    /// A static problem has no solution.
    #[error("{0}")]
    Statics(#[from] StaticsError),
    /// The journal of a sweep failed.
    #[error(transparent)]
    Journal(#[from] JournalError),
    /// The run failed.
    #[error(transparent)]
    Run(#[from] RunError),
    /// An operator failed.
    #[error(transparent)]
    Operator(#[from] OperatorError),
    /// No bonds have the target elastic constants.
    #[error("{0}")]
    Elastic(ElasticCalibrationError),
    /// The search for parameters failed.
    #[error("{0}")]
    Calibration(String),
    /// Interrupted by a signal.
    #[error("{0}")]
    Interrupted(String),
}

impl From<ReadError> for Failure {
    fn from(error: ReadError) -> Self {
        match error {
            ReadError::Scenario(error) => Self::Scenario(error),
            ReadError::Io { path, error } => {
                let with_ending = path.with_extension("toml");
                if error.kind() == io::ErrorKind::NotFound && with_ending.exists() {
                    let (path, meant) = (path.display(), with_ending.display());
                    return Self::NotText(format!("cannot read {path}: {error}. Did you mean {meant}?"));
                }
                let remedy = match error.kind() {
                    io::ErrorKind::NotFound => "Check the name; `concordem init` lists templates",
                    io::ErrorKind::IsADirectory => "Name a scenario file in it",
                    _ => return Self::File { path, action: "read", error },
                };
                Self::NotText(format!("cannot read {}: {error}. {remedy}.", path.display()))
            }
            ReadError::Setting(message) => Self::Usage(message),
            other => Self::NotText(other.to_string()),
        }
    }
}

impl From<ScenarioError> for Failure {
    fn from(error: ScenarioError) -> Self {
        Self::Scenario(error)
    }
}

impl Failure {
    /// An assembly error with its position in the scenario, if known.
    pub fn of_assembly(scenario: &Scenario, error: AssemblyError) -> Self {
        match error {
            AssemblyError::Unfit { key, message } => {
                let help = match key.as_str() {
                    "packing.path" => FORMATS,
                    key if key.ends_with(".shape.path") => SURFACES,
                    _ => "",
                };
                Self::Scenario(scenario.problem(ProblemKind::Conflict, &key, message, help))
            }
            AssemblyError::Unstable { given, bound, frequency } => Self::Unstable(scenario.problem(
                ProblemKind::OutOfRange,
                "integration.time_step",
                format!(
                    "{given:.5e} s is above the stability bound of {bound:.5e} s (largest angular frequency \
                     {frequency:.4e} rad/s)"
                ),
                "write \"auto\" or a smaller step, or set allow_unstable = true to run anyway",
            )),
            AssemblyError::NotConvergent { spectral_radius, lagged, relaxation, young } => {
                let first = scenario.materials.iter().position(|m| m.deformable.is_some()).unwrap_or(0);
                let other = if lagged {
                    format!("update = \"iterated\" and relaxation below {relaxation:.3} in [deformable]")
                } else {
                    format!("a relaxation below {relaxation:.3} in [deformable]")
                };
                Self::Unstable(scenario.problem(
                    ProblemKind::OutOfRange,
                    &format!("material[{first}].deformable.young"),
                    format!("the iteration between strains and forces does not converge: spectral radius {spectral_radius:.5}"),
                    format!(
                        "use a modulus above {young:.5e} Pa, or {other}, or set integration.allow_unstable = true to \
                         run anyway"
                    ),
                ))
            }
            AssemblyError::NoTimeStep => Self::Scenario(scenario.problem(
                ProblemKind::Conflict,
                "integration.time_step",
                "no particle that is free to move touches anything at the start, so \"auto\" has no stiffness for a time step",
                "give a time step in seconds: time_step = \"1 us\"",
            )),
            AssemblyError::Packing(error @ (PackingError::Memory { .. } | PackingError::TooMany { .. })) => {
                let key = match &scenario.packing {
                    Packing::RandomDense { .. } | Packing::RandomDiscs { .. } | Packing::Growth { .. } => {
                        "packing.count"
                    }
                    Packing::Lattice { repeats: Some(_), .. } => "packing.repeats",
                    Packing::File { .. } => "packing.path",
                    other if other.shape().is_some() => "packing.shape",
                    _ => "packing",
                };
                let help = match scenario.packing.shape() {
                    Some(Shape::Mesh { .. }) => {
                        "if the numbers of the STL file are millimeters, write unit = \"1 mm\" in the shape; otherwise use larger particles"
                    }
                    _ => {
                        "use fewer or larger particles, and check the units of sizes and radii; plain numbers are meters"
                    }
                };
                Self::Scenario(scenario.problem(ProblemKind::OutOfRange, key, error.to_string(), help))
            }
            AssemblyError::Packing(error) => {
                Self::Scenario(scenario.problem(ProblemKind::Conflict, "packing", error.to_string(), ""))
            }
            other => Self::Assembly(other),
        }
    }

    /// Exit code.
    pub fn code(&self) -> u8 {
        match self {
            Self::Assembly(AssemblyError::File { .. })
            | Self::File { .. }
            | Self::NotText(_)
            | Self::Output(_)
            | Self::Journal(_) => exit::FILE,
            Self::Usage(_) | Self::Scenario(_) | Self::Assembly(_) => exit::USAGE,
            Self::Unstable(_)
            | Self::Solver(_)
            | Self::Statics(_)
            | Self::Elastic(_)
            | Self::Calibration(_)
            | Self::Run(_)
            | Self::Operator(_) => exit::PHYSICS,
            Self::Interrupted(_) => exit::INTERRUPTED,
        }
    }

    /// The message to print, with colors on a terminal.
    pub(super) fn render(&self, interactive: bool) -> String {
        match self {
            Self::Scenario(error) | Self::Unstable(error) => render_scenario(error, interactive),
            Self::Interrupted(message) => format!("{message}\n"),
            other => format!("error: {other}\n"),
        }
    }
}

fn render_scenario(error: &ScenarioError, interactive: bool) -> String {
    let colors = interactive && std::env::var_os("NO_COLOR").is_none();
    let handler = miette::MietteHandlerOpts::new()
        .color(colors)
        .unicode(interactive)
        .terminal_links(false)
        .context_lines(1)
        .without_cause_chain()
        .width(110)
        .build();
    let mut text = String::new();
    let (shown, further) = error.shown();
    for (problem, place) in shown.iter().zip(error.locate(shown)) {
        let one = One { place, problem };
        // Writing to a string cannot fail. If the graphical message fails, print the plain text, which has the same content.
        if write!(text, "{}", Picture { handler: &handler, one: &one }).is_err() {
            let (line, _) = one.place.position;
            let _ = write!(text, "{}:{line}: {problem}\n  help: {}", one.place.source.name, problem.help);
        }
        text.push('\n');
    }
    let count = error.problems.len();
    let plural = if count == 1 { "problem" } else { "problems" };
    let hidden = if further > 0 { format!("; {further} of them are not shown") } else { String::new() };
    let _ = writeln!(text, "{}: {count} {plural}{hidden}", error.source_text.name);
    text
}

/// One problem with its source text.
#[derive(Debug)]
struct One<'a> {
    place: Location,
    problem: &'a concordem_scenario::schema::Problem,
}

impl std::fmt::Display for One<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        std::fmt::Display::fmt(self.problem, formatter)
    }
}

impl std::error::Error for One<'_> {}

impl miette::Diagnostic for One<'_> {
    fn severity(&self) -> Option<miette::Severity> {
        self.problem.severity()
    }
    fn help<'b>(&'b self) -> Option<Box<dyn std::fmt::Display + 'b>> {
        self.problem.help()
    }
    fn labels(&self) -> Option<Box<dyn Iterator<Item = miette::LabeledSpan> + '_>> {
        self.problem.labels()
    }
    fn source_code(&self) -> Option<&dyn miette::SourceCode> {
        Some(&self.place.source)
    }
}

struct Picture<'a> {
    handler: &'a miette::MietteHandler,
    one: &'a One<'a>,
}

impl std::fmt::Display for Picture<'_> {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        use miette::ReportHandler as _;
        self.handler.debug(self.one, formatter)
    }
}
