//! `concordem sweep`: elastic constants, structures, or results of runs, for all combinations of given values of a scenario's keys.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock};

use rayon::prelude::*;

use super::drive::Interruption;
use super::meter::Meter;
use super::recording::check_result_name;
use super::settings::Settings;
use super::{Console, Failure, Work};
use crate::characterise::structure;
use crate::output::sealed::{target, write_text};
use crate::output::{OutputError, sweep as files};
use crate::report;
use crate::sweep::Sweep;
use crate::sweep::journal::{Journal, path_of};
use crate::sweep::outcome::Outcome;
use crate::sweep::point::{Study, evaluate};
use crate::sweep::results::run;
use concordem_operator::interruption::{Stopped, look, stoppable};
use concordem_scenario::assembly::{PackingCache, Placed, place, place_cached};
use concordem_scenario::schema::Scenario;
use concordem_statics::Accuracy;

/// Arguments of `concordem sweep`.
#[derive(Debug, clap::Args)]
pub(super) struct SweepArguments {
    /// Sweep file; `concordem init --template elastic-sweep` writes one. The same command continues an interrupted sweep
    sweep: PathBuf,
    /// Result file; by default the name of the sweep with .h5. The web page has the same name with .html
    #[arg(long, short, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Also write all points as comma-separated text
    #[arg(long)]
    csv: bool,
    #[command(flatten)]
    settings: Settings,
    /// Overwrite an existing result, and discard points of an unfinished sweep
    #[arg(long, short)]
    force: bool,
    #[command(flatten)]
    work: Work,
}

/// Whether the sweep shall stop.
struct Stop<'a> {
    /// Set by a signal.
    requested: Arc<AtomicBool>,
    progress: &'a Mutex<Progress>,
}

impl Stop<'_> {
    fn is_due(&self) -> bool {
        self.requested.load(Ordering::Relaxed) || locked(self.progress).failure.is_some()
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
        work: Work { threads, quiet: false },
    };
    compute_all(&arguments, console)
}

fn compute_all(arguments: &SweepArguments, console: &mut Console<'_>) -> Result<Swept, Failure> {
    let sweep = Sweep::read_with(&arguments.sweep, arguments.settings.list())?;
    let path = arguments.output.clone().unwrap_or_else(|| arguments.sweep.with_extension("h5"));
    check_result_name(if console.host.is_some() { "" } else { "--output " }, &path)?;
    let path = target(&path)?;
    let page = path.with_extension("html");
    let table = path.with_extension("csv");
    let journal_path = path_of(&path);
    // A sweep killed while writing its result still has its journal; the same command writes the result again.
    let unfinished = journal_path.exists();
    for path in [Some(&path), Some(&page), arguments.csv.then_some(&table)].into_iter().flatten() {
        if path.exists() && !arguments.force && !unfinished {
            return Err(OutputError::Exists { path: path.clone() }.into());
        }
    }
    if arguments.force && unfinished {
        std::fs::remove_file(&journal_path).map_err(|error| Failure::File {
            path: journal_path.clone(),
            action: "remove",
            error,
        })?;
    }
    let (journal, outcomes) = Journal::open(&journal_path, &sweep.fingerprint()?)?;
    let points = sweep.points();
    let known = outcomes.len();
    let groups = groups(&sweep, &outcomes)?;
    if !arguments.work.quiet && console.host.is_none() {
        let rest = if known > 0 { format!(", {known} of them known") } else { String::new() };
        console.tell(&format!("{points} points{rest}; {} packings to generate", groups.len()));
    }
    let display = console.display(&arguments.work);
    let cache = console.cache();
    let progress = Mutex::new(Progress { journal, outcomes, meter: Meter::new(display), failure: None });
    let interruption = Interruption::listen(console.host.as_ref());
    let stop = Stop { requested: Arc::clone(&interruption.requested), progress: &progress };
    arguments.work.install(|| {
        if sweep.study == Study::Run {
            compute_runs(&sweep, &groups, cache.as_ref(), &stop);
        } else {
            groups.par_iter().for_each(|group| compute(&sweep, group, &stop));
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
    let outcomes: Vec<Outcome> = outcomes.into_values().collect();
    files::write(&path, &sweep, &outcomes)?;
    write_text(&page, &report::sweep::page(&sweep, &outcomes))?;
    if arguments.csv {
        write_text(&table, &files::csv(&sweep, &outcomes))?;
    }
    std::fs::remove_file(&journal_path).map_err(|error| Failure::File {
        path: journal_path,
        action: "remove",
        error,
    })?;
    let bad = outcomes.iter().filter(|outcome| outcome.problem.is_some()).count();
    let first = outcomes.iter().find_map(|outcome| outcome.problem.as_deref()).unwrap_or_default();
    let failed = (bad > 0).then(|| format!("{bad} of {points} points failed; the first failure: {first}"));
    Ok(Swept { result: path, page, failed, sweep, outcomes })
}

/// Computes the points of a group, which share a packing, until the sweep stops.
fn compute(sweep: &Sweep, group: &[usize], stop: &Stop<'_>) {
    if stop.is_due() {
        return;
    }
    let note = |point: usize, outcome: Outcome| note(stop.progress, sweep.points(), point, outcome);
    // Every scenario was checked when the sweep was read.
    let Ok(first) = sweep.scenario(group[0]) else { return };
    let accuracy = Accuracy { residual: sweep.residual, ..Accuracy::default() };
    match stop.unless(|| place(&first, &first.directory(), &mut |_, _| look())) {
        None => {}
        Some(Err(error)) => {
            for &point in group {
                note(point, Outcome::failed(error.to_string()));
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

/// Runs the scenarios of all points. Each run has its own threads: in a shared pool, a thread that waits within one run would begin
/// another one.
fn compute_runs(sweep: &Sweep, groups: &[Vec<usize>], cache: Option<&PackingCache>, stop: &Stop<'_>) {
    let points: Vec<(usize, usize)> =
        groups.iter().enumerate().flat_map(|(g, group)| group.iter().map(move |&point| (g, point))).collect();
    let packings: Vec<OnceLock<Result<Placed, String>>> = groups.iter().map(|_| OnceLock::new()).collect();
    let next = AtomicUsize::new(0);
    let threads = rayon::current_num_threads();
    let workers = threads.min(points.len()).max(1);
    let work = || {
        let Ok(pool) = rayon::ThreadPoolBuilder::new().num_threads((threads / workers).max(1)).build() else { return };
        while let Some(&(group, point)) = points.get(next.fetch_add(1, Ordering::Relaxed)) {
            // Every scenario was checked when the sweep was read.
            let Ok(scenario) = sweep.scenario(point) else { continue };
            if stop.is_due() {
                return;
            }
            let compute = || {
                let placed = packings[group].get_or_init(|| {
                    let folder = scenario.directory();
                    place_cached(&scenario, &folder, cache, &mut |_, _| look()).map_err(|e| e.to_string())
                });
                match placed {
                    Err(problem) => Some(Outcome::failed(problem.clone())),
                    Ok(placed) => run(&scenario, placed, &sweep.results, &|| stop.is_due()),
                }
            };
            if let Some(outcome) = pool.install(|| stop.unless(compute)).flatten() {
                note(stop.progress, sweep.points(), point, outcome);
            }
        }
    };
    std::thread::scope(|scope| {
        for _ in 0..workers {
            scope.spawn(work);
        }
    });
}

fn locked(progress: &Mutex<Progress>) -> std::sync::MutexGuard<'_, Progress> {
    // The lock is poisoned only if another thread panicked, which ends the program; the data are valid.
    progress.lock().unwrap_or_else(std::sync::PoisonError::into_inner)
}

/// Saves a finished point.
fn note(progress: &Mutex<Progress>, points: usize, point: usize, outcome: Outcome) {
    let mut now = locked(progress);
    if let Err(error) = now.journal.add(point, &outcome) {
        let path = PathBuf::from("the journal of the sweep");
        now.failure = Some(Failure::File { path, action: "write", error });
    }
    now.outcomes.insert(point, outcome);
    let share = now.outcomes.len() as f64 / points as f64;
    now.meter.stage("sweep", share);
}

/// The points to compute, grouped by packing.
fn groups(sweep: &Sweep, known: &BTreeMap<usize, Outcome>) -> Result<Vec<Vec<usize>>, Failure> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    let mut index: BTreeMap<String, usize> = BTreeMap::new();
    for point in (0..sweep.points()).filter(|point| !known.contains_key(point)) {
        let key = packing_key(&sweep.scenario(point)?);
        let place = *index.entry(key.clone()).or_insert_with(|| {
            groups.push((key, Vec::new()));
            groups.len() - 1
        });
        groups[place].1.push(point);
    }
    Ok(groups.into_iter().map(|group| group.1).collect())
}

/// Scenarios with the same key have the same packing.
fn packing_key(scenario: &Scenario) -> String {
    format!("{} {:?}", scenario.dimension, scenario.packing)
}
