//! Executes a run from its start or from a checkpoint to its end, with its files.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

use super::meter::Meter;
use super::readable::{count, seconds};
use super::tables::{BondRows, Tables, bond_damage};
use super::watch::Live;
use super::{Failure, shell};
use crate::output::{BondSnapshot, OutputError, ResultFile, RunFiles, Snapshot, SnapshotField, csv};
use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{Assembly, PackingCache, Sharpness, assemble_cached};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::{Advance, Simulation};
use concordem_scenario::schema::Scenario;
use concordem_solver::fracture::fragments::fragments;
use concordem_solver::state::columns::Column;

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

/// Result file of a scenario.
pub(super) fn result_path(scenario: &Scenario) -> PathBuf {
    match &scenario.output.file {
        Some(file) => scenario.directory().join(file),
        None => PathBuf::from(&*scenario.source.name).with_extension("h5"),
    }
}

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

/// Handler of SIGINT and SIGTERM. A second signal ends the process at once.
pub(super) struct Interruption {
    /// Set by the first signal.
    pub requested: Arc<AtomicBool>,
    registered: Vec<signal_hook::SigId>,
}

impl Interruption {
    /// Handles signals until this value is dropped.
    pub(super) fn listen() -> Self {
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
pub(super) enum Outcome {
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
    /// Initial positions, m, in the order of the state, which does not change during a run.
    initial_positions: Vec<Vec3>,
    csv: bool,
    /// Whether snapshots contain the bonds.
    with_bonds: bool,
    pending_bytes: usize,
    /// The page that shows the run.
    live: Option<Live>,
    /// When the command began.
    begun: Instant,
    /// Time from then to the end of the first step.
    first_step: Option<Duration>,
}

impl Run {
    pub(super) fn new(
        simulation: Simulation,
        files: RunFiles,
        initial_positions: &[Vec3],
        scenario: &Scenario,
        begun: Instant,
    ) -> Self {
        Self {
            simulation,
            files,
            initial_positions: initial_positions.to_vec(),
            csv: scenario.output.csv,
            with_bonds: scenario.output.bond_snapshots && scenario.bonds.is_some(),
            pending_bytes: 0,
            live: None,
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
            let share = self.simulation.progress();
            live.publish(state, share, &self.displacement(), &bond_damage(state), &status, begun);
        }
        self.live = Some(live);
    }

    /// Runs to the end. A `fresh` run first writes a checkpoint of its initial state, unless that takes long: a run killed before its
    /// first checkpoint begins again.
    pub(super) fn drive(mut self, meter: &Meter, fresh: bool) -> Result<Outcome, Failure> {
        let interruption = Interruption::listen();
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
        let share_before = self.simulation.progress();
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
            let due = self.simulation.schedule.snapshot_interval.is_some_and(|every| step.is_multiple_of(every));
            if due || !self.files.has_snapshot() {
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
                    let share = self.simulation.progress();
                    let rate = if bonds > 0 {
                        format!(", {:.0} ns per bond and step", each * 1e9 / bonds as f64)
                    } else {
                        String::new()
                    };
                    let left = remaining(start.elapsed(), share_before, share);
                    let left = left.map_or_else(String::new, |left| format!(", at most {} left", seconds(left)));
                    meter.stage_with("running", share, || {
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
                self.files.append_sample(&last.to_row())?;
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
            self.files.append_sample(&record.to_row())?;
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

    fn displacement(&self) -> Vec<Vec3> {
        let now = self.simulation.state.unwrapped_positions();
        now.iter().zip(&self.initial_positions).map(|(now, then)| now - then).collect()
    }

    fn snapshot(&mut self) -> Result<(), Failure> {
        if self.with_bonds {
            self.snapshot_of_bonds()?;
        }
        let state = &self.simulation.state;
        let particles = &state.particles;
        let displacement = self.displacement();
        let position = state.unwrapped_positions();
        let fragments = fragments(state);
        let damage = bond_damage(state);
        let reals = |data| Column::f64(data, 1, "m");
        let mut fields = vec![
            SnapshotField { name: "radius", description: "Radius", column: reals(&particles.radius) },
            SnapshotField {
                name: "displacement",
                description: "Displacement since the start",
                column: Column::f64(bytemuck::cast_slice(&displacement), 3, "m"),
            },
            SnapshotField {
                name: "velocity",
                description: "Velocity",
                column: Column::f64(bytemuck::cast_slice(&particles.velocity), 3, "m/s"),
            },
            SnapshotField {
                name: "angular_velocity",
                description: "Angular velocity",
                column: Column::f64(bytemuck::cast_slice(&particles.angular_velocity), 3, "rad/s"),
            },
            SnapshotField {
                name: "damage",
                description: "Mean damage of the particle's bonds; broken bonds count as 1",
                column: Column::f64(&damage, 1, "1"),
            },
            SnapshotField {
                name: "material",
                description: "Number of the material in the scenario, from 0",
                column: Column::u16(&particles.material),
            },
        ];
        if !state.bonds.is_empty() {
            fields.push(SnapshotField {
                name: "fragment",
                description: "Smallest id of the particles that intact bonds connect",
                column: Column::u32(&fragments),
            });
            self.pending_bytes += particles.len() * 4;
        }
        if let Some(heat) = &state.heat {
            let column = Column::f64(&heat.temperature, 1, "K");
            fields.push(SnapshotField { name: "temperature", description: "Temperature", column });
            self.pending_bytes += particles.len() * 8;
        }
        if !particles.aggregate.is_empty() {
            fields.push(SnapshotField {
                name: "aggregate",
                description: "Number of the aggregate, from 1; 0 outside of all",
                column: Column::u32(&particles.aggregate),
            });
        }
        let snapshot = Snapshot {
            time: state.clock.time(),
            step: state.clock.step,
            id: &particles.id,
            position: &position,
            cell: state.cell.as_ref().map(|cell| cell.matrix),
            fields,
        };
        self.files.append_snapshot(&snapshot)?;
        // Radius, damage; position, displacement, two velocities; id, material; aggregate.
        self.pending_bytes +=
            particles.len() * (2 * 8 + 4 * 24 + 6 + if particles.aggregate.is_empty() { 0 } else { 4 });
        Ok(())
    }

    /// Stores the bonds, with their forces at the present positions.
    fn snapshot_of_bonds(&mut self) -> Result<(), Failure> {
        let forces = self.simulation.solver.record(&mut self.simulation.state)?;
        let state = &self.simulation.state;
        let rows = BondRows::of(state, &forces);
        let mut fields = vec![
            SnapshotField {
                name: "damage",
                description: "Damage, 0 intact, 1 without strength",
                column: Column::f64(&rows.damage, 1, "1"),
            },
            SnapshotField {
                name: "normal_force",
                description: "Force along the bond, positive in tension",
                column: Column::f64(&rows.normal_force, 1, "N"),
            },
            SnapshotField {
                name: "shear_force",
                description: "Magnitude of the force across the bond",
                column: Column::f64(&rows.shear_force, 1, "N"),
            },
            SnapshotField {
                name: "opening",
                description: "Length less the length without strain",
                column: Column::f64(&rows.opening, 1, "m"),
            },
            SnapshotField {
                name: "broken",
                description: "1 if the bond has broken, otherwise 0",
                column: Column::u8(&rows.broken),
            },
        ];
        if state.cell.is_some() {
            fields.push(SnapshotField {
                name: "branch",
                description: "From the center of the first particle to that of the second or its periodic image",
                column: Column::f64(bytemuck::cast_slice(&rows.branch), 3, "m"),
            });
        }
        let snapshot = BondSnapshot { time: state.clock.time(), step: state.clock.step, ids: &rows.ids, fields };
        self.files.append_bonds(&snapshot)?;
        self.pending_bytes += rows.ids.len() * if state.cell.is_some() { 65 } else { 41 };
        Ok(())
    }

    fn finish(mut self, steps: u64, time: Duration) -> Result<Outcome, Failure> {
        let path = self.files.path().to_owned();
        let reason = self.simulation.stopped().map(|reason| reason.to_string()).unwrap_or_default();
        self.files.note("stopped_because", &reason);
        let unmet = self.simulation.unmet().join("; ");
        if !unmet.is_empty() {
            self.files.note("servos_not_at_target", &unmet);
        }
        let stages = self.simulation.ended_stages();
        let stages: Vec<String> = stages.map(|(name, time, step)| format!("{name}: {time:e} s, step {step}")).collect();
        if !stages.is_empty() {
            self.files.note("stages_ended", &stages.join("; "));
        }
        self.files.note("threads", &rayon::current_num_threads().to_string());
        if let Some((device, steps)) = self.simulation.steps_on_device() {
            self.files.note("device", &device);
            self.files.note("steps_on_device", &steps.to_string());
        }
        self.files.note("wall_time_s", &format!("{:.3}", time.as_secs_f64()));
        if let Some(time) = self.first_step {
            self.files.note("first_step_after_s", &format!("{:.3}", time.as_secs_f64()));
        }
        let displacement = self.displacement();
        let forces = self.simulation.solver.record(&mut self.simulation.state)?;
        let state = &self.simulation.state;
        let tables = Tables { state, displacement: &displacement, forces: &forces };
        remove_old_csv(&path, self.csv)?;
        self.files.finish(state, &tables)?;
        if self.csv {
            write_csv(&path)?;
        }
        let mut text =
            format!("{} steps in {}; ended because {reason}", count(steps as usize), seconds(time.as_secs_f64()));
        if !unmet.is_empty() {
            text += ". Not reached: ";
            text += &unmet;
        }
        Ok(Outcome::Finished { path, text })
    }
}

/// Time until the next checkpoint, after one that took `cost`, in a run that has gone on for `elapsed`.
fn pause_after(cost: Duration, elapsed: Duration) -> Duration {
    let early = (elapsed / 4).max(CHECKPOINT_AT_MOST_EVERY).max(cost.div_f64(CHECKPOINT_SHARE));
    early.min(CHECKPOINT_EVERY)
}

/// Time until the end, s, if the share of the run grows as it did since the process began with it. A drop of the stress may end the run
/// earlier.
fn remaining(elapsed: Duration, before: f64, now: f64) -> Option<f64> {
    let grown = now - before;
    (grown > 0.0).then(|| elapsed.as_secs_f64() * (1.0 - now) / grown)
}

/// Removes the CSV table of an older result that the new result replaces: it could be mistaken for that of the new result.
///
/// `expected`: the new result will have a table, too.
fn remove_old_csv(path: &Path, expected: bool) -> Result<(), Failure> {
    let table = csv_path(path);
    let of_old_result = || {
        let text = ResultFile::open(path).and_then(|old| old.scenario()).ok()?;
        Some(Scenario::parse("result", &text).ok()?.output.csv)
    };
    if !table.is_file() || !(expected || of_old_result() == Some(true)) {
        return Ok(());
    }
    std::fs::remove_file(&table).map_err(|error| Failure::File { path: table, action: "remove", error })
}

/// Writes the CSV table of the result at `path`.
pub(super) fn write_csv(path: &Path) -> Result<(), OutputError> {
    csv::write(&ResultFile::open(path)?, &csv_path(path), true)
}

/// Path of the CSV table of a result.
pub(super) fn csv_path(path: &Path) -> PathBuf {
    path.with_extension("csv")
}

/// Refuses result names without an HDF5 extension: readers would not recognize the file, and the name may belong to
/// another file.
pub(super) fn check_result_name(path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("h5" | "hdf5" | "vtkhdf") => Ok(()),
        _ => Err(Failure::Usage(format!(
            "--output {}: a result is an HDF5 file and needs the extension .h5, .hdf5, or .vtkhdf; use {}",
            path.display(),
            path.with_extension("h5").display()
        ))),
    }
}

/// Refuses names of web pages without an HTML extension: browsers would not show the file.
pub(super) fn check_page_name(path: &Path) -> Result<(), Failure> {
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("html" | "htm") => Ok(()),
        _ => Err(Failure::Usage(format!(
            "--output {}: the page is HTML and needs the extension .html; use {}. Browsers print it to PDF.",
            path.display(),
            path.with_extension("html").display()
        ))),
    }
}

/// Opens a result; says what to do if the file is a scenario.
pub(super) fn open_result(path: &Path) -> Result<ResultFile, Failure> {
    scenario_instead(path)?;
    Ok(ResultFile::open(path)?)
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
