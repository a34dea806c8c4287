//! Executes a run from its start or from a checkpoint to its end, with its files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::meter::Meter;
use super::progress::{Done, Progress};
use super::readable::{count, seconds};
use super::recording::{Recording, bond_damage, result_path};
use super::watch::Live;
use super::{Failure, Host, shell};
use crate::output::RunFiles;
use concordem_scenario::assembly::{Assembly, PackingCache, Sharpness, assemble_cached};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::{Advance, Simulation};
use concordem_scenario::schema::Scenario;

/// Longest and shortest time between checkpoints; early in a run they are more frequent, so that `info` has something to show. The
/// result does not depend on them.
const CHECKPOINT_EVERY: Duration = Duration::from_secs(60);
const CHECKPOINT_AT_MOST_EVERY: Duration = Duration::from_secs(5);
/// Except for the longest time, checkpoints take at most this part of a run.
const CHECKPOINT_SHARE: f64 = 0.01;
/// A run with more particles and bonds begins without a checkpoint: with 4e6 of them it would have 0.6 GB. The first one follows after
/// [`CHECKPOINT_AT_MOST_EVERY`].
const MOST_AT_START: usize = 200_000;
/// Snapshots stay in memory until the next checkpoint; more bytes than this trigger a checkpoint.
const MOST_SNAPSHOT_BYTES: usize = 256 << 20;

/// Assembles a scenario, with sharp bounds of the time step.
pub(super) fn build(scenario: &Scenario, cache: Option<&PackingCache>, meter: &Meter) -> Result<Assembly, Failure> {
    build_with(scenario, cache, Sharpness::Sharp, meter)
}

/// Assembles a scenario.
pub(super) fn build_with(
    scenario: &Scenario,
    cache: Option<&PackingCache>,
    sharpness: Sharpness,
    meter: &Meter,
) -> Result<Assembly, Failure> {
    let folder = scenario.directory();
    let progress = &mut |stage: &str, share: f64| meter.stage(stage, share);
    let assembly = assemble_cached(scenario, &folder, cache, sharpness, progress);
    assembly.map_err(|error| {
        meter.finish();
        Failure::of_assembly(scenario, error)
    })
}

/// Handler of SIGINT and SIGTERM, unless a host handles them. A second signal ends the process at once.
pub(super) struct Interruption {
    /// Set by the first signal, or by the host.
    pub requested: Arc<AtomicBool>,
    registered: Vec<signal_hook::SigId>,
}

impl Interruption {
    /// Handles signals until this value is dropped, or leaves them to the host.
    pub(super) fn listen(host: Option<&Host>) -> Self {
        if let Some(host) = host {
            return Self { requested: Arc::clone(&host.interrupted), registered: Vec::new() };
        }
        let requested = Arc::new(AtomicBool::new(false));
        let mut registered = Vec::new();
        for signal in [signal_hook::consts::SIGINT, signal_hook::consts::SIGTERM] {
            let hard = signal_hook::flag::register_conditional_shutdown(
                signal,
                i32::from(super::exit::INTERRUPTED),
                Arc::clone(&requested),
            );
            let soft = signal_hook::flag::register(signal, Arc::clone(&requested));
            registered.extend(hard.into_iter().chain(soft));
        }
        Self { requested, registered }
    }
}

impl Drop for Interruption {
    fn drop(&mut self) {
        for id in self.registered.drain(..) {
            signal_hook::low_level::unregister(id);
        }
    }
}

/// End of a run.
#[derive(Debug)]
pub enum Outcome {
    /// The run has ended and its result is written.
    Finished {
        /// Result file.
        path: PathBuf,
        /// Summary of the run.
        text: String,
    },
    /// The run was interrupted and a checkpoint is written.
    Interrupted {
        /// Result file of the run.
        path: PathBuf,
        /// Number of steps.
        step: u64,
    },
}

/// A run with its files.
pub(super) struct Run {
    simulation: Simulation,
    files: RunFiles,
    recording: Recording,
    /// Bytes of the snapshots since the last checkpoint.
    pending_bytes: usize,
    /// The page that shows the run.
    live: Option<Live>,
    progress: Progress,
    /// When the command began.
    begun: Instant,
    /// Time from then to the end of the first step.
    first_step: Option<Duration>,
}

impl Run {
    pub(super) fn new(simulation: Simulation, files: RunFiles, recording: Recording, begun: Instant) -> Self {
        Self {
            simulation,
            files,
            recording,
            pending_bytes: 0,
            live: None,
            progress: Progress::default(),
            begun,
            first_step: None,
        }
    }

    /// The run with a page that shows it.
    pub(super) fn watched(self, live: Option<Live>) -> Self {
        Self { live, ..self }
    }

    /// Shows the present state on the page, if it is due or at the `end`.
    fn show(&mut self, record: &Record, start: Instant, end: bool) {
        let Some(mut live) = self.live.take() else { return };
        live.record(record.strain, record.stress);
        if end || live.is_due() {
            let begun = Instant::now();
            let state = &self.simulation.state;
            let status = format!(
                "step {}, {:.4e} s, strain {:.3e}, stress {:.3e} Pa, running for {}",
                count(state.clock.step as usize),
                state.clock.time(),
                record.strain,
                record.stress,
                seconds(start.elapsed().as_secs_f64())
            );
            let share = self.progress.done(&self.simulation, record.strain).map(|done| done.share);
            live.publish(state, share, &self.recording.displacement(state), &bond_damage(state), &status, begun);
        }
        self.live = Some(live);
    }

    /// Runs to the end. A `fresh` run first writes a checkpoint of its initial state, unless that takes long: a run killed before its
    /// first checkpoint begins again.
    pub(super) fn drive(mut self, meter: &Meter, fresh: bool, host: Option<&Host>) -> Result<Outcome, Failure> {
        let interruption = Interruption::listen(host);
        let outcome = self.steps(meter, fresh, &interruption.requested);
        drop(interruption);
        if self.simulation.stopped().is_some() {
            meter.complete();
        }
        meter.finish();
        let Some((steps, time)) = outcome? else {
            let step = self.simulation.state.clock.step;
            return Ok(Outcome::Interrupted { path: self.files.path().to_owned(), step });
        };
        self.finish(steps, time)
    }

    /// Takes all steps; returns their number and duration, or `None` if interrupted.
    fn steps(
        &mut self,
        meter: &Meter,
        fresh: bool,
        interrupted: &AtomicBool,
    ) -> Result<Option<(u64, Duration)>, Failure> {
        let start = Instant::now();
        let first_step = self.simulation.state.clock.step;
        let bonds: usize = self.simulation.state.bonds.iter().map(|block| block.len()).sum();
        if fresh && self.simulation.state.particles.len() + bonds <= MOST_AT_START {
            self.commit()?;
        }
        let mut last_commit = Instant::now();
        let mut pause = CHECKPOINT_AT_MOST_EVERY;
        let mut last_look = Instant::now();
        // What ends next, and when and with which share this process began with it.
        let mut ending = (String::new(), Duration::ZERO, 0.0);
        while self.simulation.stopped().is_none() {
            let step = self.simulation.state.clock.step;
            let begun = step > first_step;
            let due =
                self.simulation.schedule.checkpoint_interval.is_some_and(|interval| step.is_multiple_of(interval));
            let late = last_commit.elapsed() >= pause || self.pending_bytes > MOST_SNAPSHOT_BYTES;
            let stop = interrupted.load(Ordering::Relaxed);
            if stop || (begun && (due || late)) {
                let before = Instant::now();
                self.commit()?;
                last_commit = Instant::now();
                pause = pause_after(before.elapsed(), start.elapsed());
            }
            if stop {
                return Ok(None);
            }
            if Recording::is_due(&self.simulation, self.files.has_snapshot()) {
                self.snapshot()?;
            }
            let advance = self.simulation.advance()?;
            self.first_step.get_or_insert_with(|| self.begun.elapsed());
            if let Some(sample) = self.append_records(&advance)? {
                self.show(&sample, start, false);
                if last_look.elapsed() > Duration::from_millis(100) {
                    last_look = Instant::now();
                    let done = (self.simulation.state.clock.step - first_step) as f64;
                    let each = start.elapsed().as_secs_f64() / done;
                    let known = self.progress.done(&self.simulation, sample.strain);
                    let name = known.as_ref().map_or_else(|| "running".to_owned(), Done::name);
                    let share = known.as_ref().map(|known| known.share);
                    if ending.0 != name {
                        ending = (name.clone(), start.elapsed(), share.unwrap_or(0.0));
                    }
                    let rate = if bonds > 0 {
                        format!(", {:.0} ns per bond and step", each * 1e9 / bonds as f64)
                    } else {
                        String::new()
                    };
                    let left =
                        share.and_then(|share| remaining(start.elapsed().saturating_sub(ending.1), ending.2, share));
                    let of = if known.is_some_and(|known| known.stage.is_some()) { " of this stage" } else { "" };
                    let left = left.map_or_else(String::new, |left| format!(", at most {}{of} left", seconds(left)));
                    meter.stage_with(&name, share, || {
                        format!(
                            "step {}{rate}, strain {:.3e}, stress {:.3e} Pa{left}",
                            count(self.simulation.state.clock.step as usize),
                            sample.strain,
                            sample.stress
                        )
                    });
                }
            }
            self.announce(&advance, meter);
            if let Some(last) = advance.last {
                self.files.append_sample(&last.to_row()[..self.files.width()])?;
                self.show(&last, start, true);
            }
            for row in &advance.operators {
                self.files.append_operator(row.operator, row.time, row.step, &row.values)?;
            }
            for event in advance.events {
                self.files.append_event(event);
            }
            if advance.stopped.is_some() {
                self.snapshot()?;
            }
        }
        Ok(Some((self.simulation.state.clock.step - first_step, start.elapsed())))
    }

    /// Writes the records. Returns the last one: the state is that of its step.
    fn append_records(&mut self, advance: &Advance) -> Result<Option<Record>, Failure> {
        let mut last = None;
        for &record in advance.records.iter().chain(&advance.sample) {
            self.files.append_sample(&record.to_row()[..self.files.width()])?;
            // [`Self::show`] draws the last one.
            if let (Some(live), Some(Record { strain, stress, .. })) = (&mut self.live, last.replace(record)) {
                live.record(strain, stress);
            }
        }
        Ok(last)
    }

    /// Prints the end of a stage, and bonds made during the run.
    fn announce(&self, advance: &Advance, meter: &Meter) {
        let clock = self.simulation.state.clock;
        let (time, step) = (clock.time(), clock.step);
        if let Some(end) = &advance.stage {
            let name = &self.simulation.schedule.stages[end.stage].name;
            meter.line(&format!("stage `{name}` ended at {time:.6e} s, step {step}: {}", end.reason));
        }
        if let Some(made) = advance.bonded {
            meter.line(&format!("{made} bonds made at {time:.6e} s, step {step}"));
        }
    }

    fn commit(&mut self) -> Result<(), Failure> {
        self.files.commit(&self.simulation.state)?;
        self.pending_bytes = 0;
        Ok(())
    }

    fn snapshot(&mut self) -> Result<(), Failure> {
        let moment = self.recording.snapshot(&mut self.simulation)?;
        self.pending_bytes += moment.bytes();
        self.files.append_snapshot(moment.particles)?;
        if let Some(bonds) = moment.bonds {
            self.files.append_bonds(bonds);
        }
        Ok(())
    }

    fn finish(mut self, steps: u64, time: Duration) -> Result<Outcome, Failure> {
        let path = self.files.path().to_owned();
        if let Some((device, steps)) = self.simulation.steps_on_device() {
            self.files.note("device", &device);
            self.files.note("steps_on_device", &steps.to_string());
        }
        self.files.note("wall_time_s", &format!("{:.3}", time.as_secs_f64()));
        if let Some(time) = self.first_step {
            self.files.note("first_step_after_s", &format!("{:.3}", time.as_secs_f64()));
        }
        let reason = self.simulation.stopped().map(|reason| reason.to_string()).unwrap_or_default();
        let [unmet, torn] = [self.simulation.unmet(), self.simulation.torn()].map(|all| all.join("; "));
        self.recording.finish(&mut self.simulation, self.files, &reason)?;
        let mut text =
            format!("{} steps in {}; ended because {reason}", count(steps as usize), seconds(time.as_secs_f64()));
        if !unmet.is_empty() {
            text += ". Not reached: ";
            text += &unmet;
        }
        if !torn.is_empty() {
            text += ". ";
            text += &torn;
        }
        Ok(Outcome::Finished { path, text })
    }
}

/// Time until the next checkpoint, after one that took `cost`, in a run that has gone on for `elapsed`.
fn pause_after(cost: Duration, elapsed: Duration) -> Duration {
    let early = (elapsed / 4).max(CHECKPOINT_AT_MOST_EVERY).max(cost.div_f64(CHECKPOINT_SHARE));
    early.min(CHECKPOINT_EVERY)
}

/// Time until the end, s, if the share of a run or a stage grows as it did since the process began with it. A drop of the stress may end the run
/// earlier.
fn remaining(elapsed: Duration, before: f64, now: f64) -> Option<f64> {
    let grown = now - before;
    (grown > 0.0).then(|| elapsed.as_secs_f64() * (1.0 - now) / grown)
}

/// Refuses names of web pages without an HTML extension: browsers would not show the file. `option`: what messages begin with.
pub(super) fn check_page_name(option: &str, path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("html" | "htm") => Ok(()),
        _ => Err(Failure::Usage(format!(
            "{option}{}: the page is HTML and needs the extension .html; use {}. Browsers print it to PDF.",
            path.display(),
            path.with_extension("html").display()
        ))),
    }
}

/// An error if the file is a scenario where a result is needed.
pub(super) fn scenario_instead(path: &Path) -> Result<(), Failure> {
    if path.extension().is_none_or(|extension| extension != "toml") || !path.is_file() {
        return Ok(());
    }
    let result = Scenario::read(path).map_or_else(|_| path.with_extension("h5"), |scenario| result_path(&scenario));
    let remedy = if result.is_file() {
        format!("its result is {}", result.display())
    } else {
        format!("run it first: concordem run {}", shell::argument(path))
    };
    Err(Failure::NotText(format!("{} is a scenario, not a result; {remedy}", path.display())))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn checkpoints_are_frequent_at_first_unless_they_are_slow() {
        let seconds = Duration::from_secs;
        assert_eq!(pause_after(Duration::from_millis(10), seconds(5)), seconds(5));
        assert_eq!(pause_after(Duration::from_millis(10), seconds(100)), seconds(25));
        assert_eq!(pause_after(Duration::from_millis(10), seconds(1000)), seconds(60));
        assert_eq!(pause_after(seconds(2), seconds(5)), seconds(60));
    }
}
