//! `concordem sweep`: elastic constants, structures, or results of runs, for all combinations of given values of a scenario's keys.

mod merge;
mod slurm;

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;

use super::drive::Interruption;
use super::meter::Meter;
use super::recording::check_result_name;
use super::settings::Settings;
use super::{Console, Failure, Work, shell};
use crate::characterise::structure;
use crate::output::sealed::{target, write_text};
use crate::output::{OutputError, sweep as files};
use crate::report;
use crate::side_by_side::side_by_side;
use crate::sweep::Sweep;
use crate::sweep::journal::{Journal, path_of};
use crate::sweep::outcome::Outcome;
use crate::sweep::parts::{MOST_PARTS, Part};
use crate::sweep::point::{Study, evaluate};
use crate::sweep::results::run;
use concordem_operator::interruption::{Stopped, look, stoppable};
use concordem_scenario::assembly::{PackingCache, Placed, place, place_cached};
use concordem_statics::Accuracy;

/// Arguments of `concordem sweep`.
#[derive(Debug, clap::Args)]
pub(super) struct SweepArguments {
    /// Sweep file; `concordem init --template elastic-sweep` or `concrete-ensemble` writes one. The same command continues an interrupted sweep
    sweep: PathBuf,
    /// Result file; by default the name of the sweep with .h5. The web page has the same name with .html
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also write all points as comma-separated text
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    settings: Settings,
    /// Overwrite an existing result, and discard points of an unfinished sweep; with --part, those of the part; with --merge, none
    #[arg(long, short)]
    force: bool,
    /// Compute only one of several parts, into a file beside the result: --part 3/10
    #[arg(long, value_name = "PART/PARTS", conflicts_with_all = ["merge", "slurm", "csv"])]
    part: Option<Part>,
    /// Write the result from the files of all parts
    #[arg(long, conflicts_with = "slurm")]
    merge: bool,
    /// Write a script that computes all parts as an array job of SLURM, and merges them; compute nothing
    #[arg(long, value_name = "SCRIPT", requires = "parts")]
    slurm: Option<PathBuf>,
    /// Number of parts of the script
    #[arg(long, value_name = "N", requires = "slurm", value_parser = clap::value_parser!(u32).range(1..=MOST_PARTS as i64))]
    parts: Option<u32>,
    #[command(flatten)]
    work: Work,
}

/// Whether the sweep shall stop.
struct Stop<'a> {
    /// Set by a signal.
    requested: Arc<AtomicBool>,
    /// Set when a point cannot be saved.
    failed: AtomicBool,
    progress: &'a Mutex<Progress>,
    /// Number of points to compute, with those that are known.
    points: usize,
}

impl Stop<'_> {
    fn is_due(&self) -> bool {
        self.requested.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed)
    }

    /// What `work` finds; `None` if a signal comes first. What it has done until then is lost.
    fn unless<T>(&self, work: impl FnOnce() -> T) -> Option<T> {
        match catch_unwind(AssertUnwindSafe(|| stoppable(Some(Arc::clone(&self.requested)), work))) {
            Ok(found) => Some(found),
            Err(payload) if payload.is::<Stopped>() => None,
            Err(payload) => resume_unwind(payload),
        }
    }
}

/// Progress, shared by all threads.
struct Progress {
    journal: Journal,
    outcomes: BTreeMap<usize, Outcome>,
    meter: Meter,
    failure: Option<Failure>,
}

pub(super) fn sweep(arguments: &SweepArguments, console: &mut Console<'_>) -> Result<(), Failure> {
    if let (Some(script), Some(parts)) = (&arguments.slurm, arguments.parts) {
        return slurm::write(arguments, script, parts as usize, console);
    }
    if let Some(part) = arguments.part {
        return compute_part(arguments, part, console);
    }
    let swept = compute_all(arguments, console)?;
    if let Some(note) = swept.failed {
        console.tell(&note);
    }
    console.print(&format!("{}\n{}\n", swept.result.display(), swept.page.display()))
}

/// The files of a sweep.
pub struct Swept {
    /// Result.
    pub result: PathBuf,
    /// Web page.
    pub page: PathBuf,
    /// How many points failed, and why the first one did, if any did.
    pub failed: Option<String>,
    /// What was computed.
    pub sweep: Sweep,
    /// The numbers of each point.
    pub outcomes: Vec<Outcome>,
}

/// Computes a sweep as the command does, for a host.
///
/// # Errors
/// The errors of the command.
pub fn sweep_file(
    sweep: &Path,
    output: Option<&Path>,
    csv: bool,
    overwrite: bool,
    threads: Option<u16>,
    console: &mut Console<'_>,
) -> Result<Swept, Failure> {
    let arguments = SweepArguments {
        sweep: sweep.to_owned(),
        output: output.map(Path::to_owned),
        csv,
        settings: Settings::default(),
        force: overwrite,
        part: None,
        merge: false,
        slurm: None,
        parts: None,
        work: Work { threads, quiet: false },
    };
    compute_all(&arguments, console)
}

/// Path of the result. Without `--force`, neither it nor what is written with it may exist, except for an unfinished sweep: one killed while
/// writing its result still has its journal, and the same command writes the result again.
fn result_path(arguments: &SweepArguments, console: &Console<'_>) -> Result<PathBuf, Failure> {
    let path = arguments.output.clone().unwrap_or_else(|| arguments.sweep.with_extension("h5"));
    check_result_name(if console.host.is_some() { "" } else { "--output " }, &path)?;
    let path = target(&path)?;
    let others = [Some(path.with_extension("html")), arguments.csv.then(|| path.with_extension("csv"))];
    let exists = [Some(path.clone())].into_iter().chain(others).flatten().find(|path| path.exists());
    match exists {
        Some(path_of_old) if !arguments.force && !path_of(&path).exists() => {
            Err(OutputError::Exists { path: path_of_old }.into())
        }
        _ => Ok(path),
    }
}

/// Removes a file, if it exists.
fn remove(path: &Path) -> Result<(), Failure> {
    match std::fs::remove_file(path) {
        Err(error) if error.kind() != std::io::ErrorKind::NotFound => {
            Err(Failure::File { path: path.to_owned(), action: "remove", error })
        }
        _ => Ok(()),
    }
}

fn compute_all(arguments: &SweepArguments, console: &mut Console<'_>) -> Result<Swept, Failure> {
    let sweep = Sweep::read_with(&arguments.sweep, arguments.settings.list())?;
    let path = result_path(arguments, console)?;
    let page = path.with_extension("html");
    let journal = path_of(&path);
    let groups = sweep.groups()?;
    if arguments.merge {
        merge::merge(&sweep, &groups, &path, arguments)?;
    } else if arguments.force {
        remove(&journal)?;
    }
    let points = sweep.points();
    let outcomes: Vec<Outcome> = complete(&sweep, groups, &journal, arguments, console)?.into_values().collect();
    files::write(&path, &sweep, &outcomes)?;
    write_text(&page, &report::sweep::page(&sweep, &outcomes))?;
    if arguments.csv {
        write_text(&path.with_extension("csv"), &files::csv(&sweep, &outcomes))?;
    }
    remove(&journal)?;
    let failed = failures(outcomes.iter(), points);
    Ok(Swept { result: path, page, failed, sweep, outcomes })
}

/// How many points failed, and why the first one did, if any did.
fn failures<'a>(outcomes: impl Iterator<Item = &'a Outcome>, points: usize) -> Option<String> {
    let problems: Vec<&str> = outcomes.filter_map(|outcome| outcome.problem.as_deref()).collect();
    let first = problems.first()?;
    Some(format!("{} of {points} points failed; the first failure: {first}", problems.len()))
}

/// Computes one part into its own journal.
fn compute_part(arguments: &SweepArguments, part: Part, console: &mut Console<'_>) -> Result<(), Failure> {
    let sweep = Sweep::read_with(&arguments.sweep, arguments.settings.list())?;
    let path = result_path(arguments, console)?;
    check_parts(part.of, &sweep)?;
    let journal = part.path(&path);
    if arguments.force {
        remove(&journal)?;
    }
    let share = part.share(&sweep.groups()?);
    let outcomes = complete(&sweep, share, &journal, arguments, console)?;
    if let Some(note) = failures(outcomes.values(), outcomes.len()) {
        console.tell(&note);
    }
    if !arguments.work.quiet {
        let command = command(arguments, &|word| shell::argument(Path::new(word)));
        console.tell(&format!("part {} of {} is finished; when all parts are: {command} --merge", part.part, part.of));
    }
    console.print(&format!("{}\n", journal.display()))
}

/// The command for this sweep and result, without options of the work; `quote` makes one word of the shell.
fn command(arguments: &SweepArguments, quote: &dyn Fn(&str) -> String) -> String {
    let file = |path: &Path| {
        let text = path.to_string_lossy();
        // A name that begins with a dash would be an option.
        quote(&if text.starts_with('-') { format!("./{text}") } else { text.into_owned() })
    };
    let mut words = vec!["concordem sweep".to_owned(), file(&arguments.sweep)];
    words.extend(arguments.output.iter().flat_map(|output| ["-o".to_owned(), file(output)]));
    words.extend(arguments.settings.list().iter().flat_map(|setting| ["--set".to_owned(), quote(&setting.given)]));
    words.join(" ")
}

/// Refuses more parts than points.
fn check_parts(parts: usize, sweep: &Sweep) -> Result<(), Failure> {
    let points = sweep.points();
    if parts <= points {
        return Ok(());
    }
    Err(Failure::Usage(format!("{parts} parts of {points} points are not possible; use at most {points} parts")))
}

/// Computes those points of the groups that the journal does not have; returns all of them.
fn complete(
    sweep: &Sweep,
    mut groups: Vec<Vec<usize>>,
    journal_path: &Path,
    arguments: &SweepArguments,
    console: &mut Console<'_>,
) -> Result<BTreeMap<usize, Outcome>, Failure> {
    let (journal, outcomes) = Journal::open(journal_path, &sweep.fingerprint()?, sweep.numbers())?;
    let points = groups.iter().map(Vec::len).sum();
    let known = outcomes.len();
    for group in &mut groups {
        group.retain(|point| !outcomes.contains_key(point));
    }
    groups.retain(|group| !group.is_empty());
    if !arguments.work.quiet && console.host.is_none() {
        let rest = if known > 0 { format!(", {known} of them known") } else { String::new() };
        console.tell(&format!("{points} points{rest}; {} packings to generate", groups.len()));
    }
    let display = console.display(&arguments.work);
    let cache = console.cache();
    let progress = Mutex::new(Progress { journal, outcomes, meter: Meter::new(display), failure: None });
    let interruption = Interruption::listen(console.host.as_ref());
    let requested = Arc::clone(&interruption.requested);
    let stop = Stop { requested, failed: AtomicBool::new(false), progress: &progress, points };
    arguments.work.install(|| {
        if sweep.study == Study::Run {
            compute_runs(sweep, &groups, cache.as_ref(), &stop);
        } else {
            groups.par_iter().for_each(|group| compute(sweep, group, &stop));
        }
        Ok(())
    })?;
    drop(interruption);
    let Progress { outcomes, meter, failure, .. } =
        progress.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    meter.finish();
    if let Some(failure) = failure {
        return Err(failure);
    }
    if outcomes.len() < points {
        return Err(Failure::Interrupted(format!(
            "interrupted; {} of {points} points are saved in {}; repeat the command to compute the others",
            outcomes.len(),
            journal_path.display()
        )));
    }
    Ok(outcomes)
}

/// Computes the points of a group, which share a packing, until the sweep stops.
fn compute(sweep: &Sweep, group: &[usize], stop: &Stop<'_>) {
    if stop.is_due() {
        return;
    }
    let note = |point: usize, outcome: Outcome| note(stop, point, outcome);
    // Every scenario was checked when the sweep was read.
    let Ok(first) = sweep.scenario(group[0]) else { return };
    let accuracy = Accuracy { residual: sweep.residual, ..Accuracy::default() };
    match stop.unless(|| place(&first, &first.directory(), &mut |_, _| look())) {
        None => {}
        Some(Err(error)) => {
            for &point in group {
                note(point, Outcome::failed(sweep.numbers(), error.to_string()));
            }
        }
        Some(Ok(placed)) => group.par_iter().for_each(|&point| {
            let (false, Ok(scenario)) = (stop.is_due(), sweep.scenario(point)) else { return };
            let outcome = stop.unless(|| match sweep.study {
                Study::Elastic => evaluate(&scenario, &placed, accuracy, sweep.dynamics),
                Study::Structure | Study::Run => structure(&scenario, &placed),
            });
            if let Some(outcome) = outcome {
                note(point, outcome);
            }
        }),
    }
}

/// Runs the scenarios of all points, [side by side](side_by_side).
fn compute_runs(sweep: &Sweep, groups: &[Vec<usize>], cache: Option<&PackingCache>, stop: &Stop<'_>) {
    // The first points of all groups come first, so that the threads generate different packings.
    let longest = groups.iter().map(Vec::len).max().unwrap_or(0);
    let of_rank = |rank: usize| groups.iter().enumerate().filter_map(move |(g, group)| Some((g, *group.get(rank)?)));
    let points: Vec<(usize, usize)> = (0..longest).flat_map(of_rank).collect();
    let packings: Vec<OnceLock<Result<Placed, String>>> = groups.iter().map(|_| OnceLock::new()).collect();
    side_by_side(points.len(), |k| {
        let (group, point) = points[k];
        // Every scenario was checked when the sweep was read.
        let (false, Ok(scenario)) = (stop.is_due(), sweep.scenario(point)) else { return };
        let compute = || {
            let placed = packings[group].get_or_init(|| {
                let folder = scenario.directory();
                place_cached(&scenario, &folder, cache, &mut |_, _| look()).map_err(|e| e.to_string())
            });
            match placed {
                Err(problem) => Some(Outcome::failed(sweep.numbers(), problem.clone())),
                Ok(placed) => run(sweep, &scenario, placed, &|| stop.is_due()),
            }
        };
        if let Some(outcome) = stop.unless(compute).flatten() {
            note(stop, point, outcome);
        }
    });
}

fn locked(progress: &Mutex<Progress>) -> std::sync::MutexGuard<'_, Progress> {
    // The lock is poisoned only if another thread panicked, which ends the program; the data are valid.
    progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Saves a finished point.
fn note(stop: &Stop<'_>, point: usize, outcome: Outcome) {
    let mut now = locked(stop.progress);
    if let Err(error) = now.journal.add(point, &outcome) {
        let path = PathBuf::from("the journal of the sweep");
        now.failure = Some(Failure::File { path, action: "write", error });
        stop.failed.store(true, Ordering::Relaxed);
    }
    now.outcomes.insert(point, outcome);
    let share = now.outcomes.len() as f64 / stop.points as f64;
    now.meter.stage("sweep", share);
}
