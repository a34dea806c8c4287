//! How a simulation begins: from a scenario, from a checkpoint, or as a copy of another one.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;

use concordem::assembly::restart::{self, Continuation};
use concordem::assembly::{Assembly, Summary, assemble_with, place};
use concordem::output::{ResultFile, checkpoint};
use concordem::program::progress::Progress;
use concordem::program::recording::{Recording, header};
use concordem::scenario::ScenarioError;
use concordem::schedule::Simulation as Run;
use concordem::schedule::simulation::Written;
use concordem::state::columns::ColumnStore;
use pyo3::prelude::*;

use super::snapshot::keep_places;
use super::{Inner, Records, Simulation};
use crate::addresses::Addresses;
use crate::errors::{OrRaise, caught, detach_here, of_assembly, of_restart};
use crate::scenario::Scenario;
use crate::scripted::Replacement;
use crate::shared::Shared;
use crate::warnings::warn;
use crate::work::{Pool, guarded};

/// How a simulation computes, and what it keeps.
pub struct Options {
    /// Number of threads; one per processor if `None`.
    pub threads: Option<usize>,
    /// Whether steps keep the snapshots that a result has.
    pub snapshots: bool,
    /// Laws in Python.
    pub laws: Replacement,
}

/// A checkpoint, or the final state of a result, and its file.
pub type Origin = (PathBuf, checkpoint::Checkpoint);

impl Simulation {
    /// Build a scenario, from the start or from a checkpoint.
    pub fn build(
        scenario: &Bound<'_, Scenario>,
        options: Options,
        progress: Option<&Bound<'_, PyAny>>,
        origin: Option<Origin>,
    ) -> PyResult<Self> {
        let py = scenario.py();
        let Scenario { inner, folder } = scenario.get();
        let Options { threads, snapshots, laws } = options;
        laws.check(py, inner)?;
        let mut scripted = Vec::new();
        let mut replace = |state: &mut _, model: &_| {
            scripted = Python::attach(|py| laws.apply(py, inner.materials.len(), state, model));
        };
        let assembly = guarded(py, threads, progress, |progress| {
            let placed = place(inner, folder, progress)?;
            let assembly = assemble_with(inner, folder, &placed, &mut replace, progress)?;
            Ok((Arc::new(placed), Box::new(assembly)))
        })?;
        let (placed, mut assembly) = assembly.map_err(|error| of_assembly(inner, error))?;
        let pool = Pool::new(threads)?;
        let header = detach_here(py, || pool.inside(|| header(inner, folder, &assembly)))?.or_raise()?;
        let loads = assembly.state.particles.loads.clone();
        let positions = assembly.state.particles.position.clone();
        if assembly.schedule.initial_positions.is_empty() {
            // `sample` may ask for any operator later.
            assembly.schedule.initial_positions.clone_from(&positions);
        }
        warn(py, inner, &assembly.summary.warnings)?;
        let mut records = Records::none(&assembly.schedule);
        if let Some((path, mut checkpoint)) = origin {
            let before = concordem::scenario::Scenario::parse("<checkpoint>", &checkpoint.provenance).or_raise()?;
            let changes = caught(|| restart::check(&before, inner, Continuation::NewResult))?.or_raise()?;
            let columns = &mut checkpoint.columns;
            let further = !changes.is_empty();
            caught(|| pool.inside(|| restart::apply(&mut assembly, columns, inner, &changes, further)))?
                .map_err(|error| of_restart(inner, error))?;
            let operators = !changes.iter().any(|change| change.key.starts_with("sample"));
            records = match caught(|| ResultFile::open(&path))? {
                Ok(result) => Records::of_result(&result, &assembly.schedule, operators).or_raise()?,
                // Not a result.
                Err(_) => Records::read(&checkpoint.kept, &assembly.schedule, operators).or_raise()?,
            };
            records.changed(assembly.state.clock.step, &changes);
        }
        let (run, summary) = started(py, threads, assembly)?;
        if run.stopped().is_none() {
            records.before(run.state.clock.step);
        }
        let recording = Recording::new(inner, positions);
        let addresses = Addresses::of(&run.state.particles);
        let inner = Inner {
            progress: Progress::default(),
            run,
            records,
            recording,
            keeps_snapshots: snapshots,
            header,
            wall: Duration::ZERO,
            addresses,
            loads,
            scenario: scenario.clone().unbind(),
            summary,
            scripted,
            written: None,
        };
        let histories = laws.histories(py)?;
        Ok(Self { inner: shared(inner), pool, placed, laws, histories })
    }

    /// A simulation in the present state of this one, with the same scenario and laws, which goes on for itself.
    pub fn copied(&self, py: Python<'_>) -> PyResult<Self> {
        let mut now = self.lock()?;
        now.change(py, Inner::book_written)?;
        let pool = Pool::new(self.pool.wanted())?;
        let run = &now.run;
        let copy = || Run::new(run.state.clone(), run.solver.model().clone(), run.schedule.clone()).map(Box::new);
        let run = guarded(py, pool.wanted(), None, |_| copy())?.or_raise()?;
        let inner = Inner {
            progress: now.progress,
            addresses: Addresses::of(&run.state.particles),
            run,
            records: now.records.clone(),
            recording: now.recording.clone(),
            keeps_snapshots: now.keeps_snapshots,
            header: now.header.clone(),
            wall: now.wall,
            loads: now.loads.clone(),
            scenario: now.scenario.clone_ref(py),
            summary: now.summary.clone(),
            scripted: now.scripted.clone(),
            written: None,
        };
        drop(now);
        let (laws, histories) = (self.laws.clone_ref(py), self.histories.clone());
        Ok(Self { inner: shared(inner), pool, placed: self.placed.clone(), laws, histories })
    }

    /// Go on with a changed scenario, as from a checkpoint.
    pub fn changed(&self, settings: &Bound<'_, PyAny>) -> PyResult<()> {
        let py = settings.py();
        let mut now = self.lock()?;
        now.change(py, Inner::book_written)?;
        let before = now.scenario.clone_ref(py);
        let scenario = Bound::new(py, before.get().changed(settings)?)?;
        let Scenario { inner, folder } = scenario.get();
        let check = || restart::check(&before.get().inner, inner, Continuation::SameResult);
        let changes = caught(check)?.map_err(with_reasons).or_raise()?;
        if changes.is_empty() {
            return Ok(());
        }
        let mut scripted = Vec::new();
        let mut replace = |state: &mut _, model: &_| {
            scripted = Python::attach(|py| self.laws.apply(py, inner.materials.len(), state, model));
        };
        let (wanted, placed) = (self.pool.wanted(), &self.placed);
        let assembly = guarded(py, wanted, None, |progress| {
            assemble_with(inner, folder, placed, &mut replace, progress).map(Box::new)
        })?;
        let mut assembly = assembly.map_err(|error| of_assembly(inner, error))?;
        warn(py, inner, &assembly.summary.warnings)?;
        let loads = assembly.state.particles.loads.clone();
        assembly.schedule.initial_positions.clone_from(&now.run.schedule.initial_positions);
        let mut columns = ColumnStore::of(&now.run.state).or_raise()?;
        let apply = || restart::apply(&mut assembly, &mut columns, inner, &changes, true);
        caught(|| self.pool.inside(apply))?.map_err(|error| of_restart(inner, error))?;
        let (run, summary) = started(py, wanted, assembly)?;
        let text = inner.source.text.to_string();
        let scenario = scenario.clone().unbind();
        now.change(py, move |now| {
            let step = run.state.clock.step;
            if now.run.stopped().is_some() {
                // The run goes on and records them again.
                now.records.before(step);
            }
            let mut old = std::mem::replace(&mut now.run, run);
            keep_places(&mut old.state.particles, &mut now.run.state.particles);
            now.records.changed(step, &changes);
            now.header.scenario = text;
            if now.written.is_some() {
                now.written = Some(Written::of(&now.run.state));
            }
            (now.loads, now.summary, now.scripted, now.scenario) = (loads, summary, scripted, scenario);
        })
    }
}

/// Say of keys that cannot change why, or which call of Python does it.
fn with_reasons(mut error: ScenarioError) -> ScenarioError {
    for problem in &mut error.problems {
        let reason = match problem.key.split(['.', '[']).next().unwrap_or_default() {
            "packing" | "aggregates" | "phases" | "fibers" | "cut" | "clump" => {
                "particles cannot be added or removed: arrays of `state` are views of memory that stays. Begin a new simulation; "
            }
            "bonds" | "bonding" => "call make_bonds and break_bonds, which act on the bonds that there are; ",
            "wall" => "walls cannot be added or removed; call drive_wall and place_wall to move them; ",
            "material" => "masses and the rows of the laws follow from it; ",
            _ => continue,
        };
        problem.help.insert_str(0, reason);
    }
    error
}

/// The run that an assembly begins. On a thread of its own and in a box, as assemblies: they have tens of kilobytes, and the caller's thread may
/// have a stack of 64 kB.
fn started(py: Python<'_>, threads: Option<usize>, assembly: Box<Assembly>) -> PyResult<(Box<Run>, Summary)> {
    guarded(py, threads, None, |_| {
        let Assembly { state, model, schedule, summary } = *assembly;
        Run::new(state, model, schedule).map(|run| (Box::new(run), summary))
    })?
    .or_raise()
}

/// The data behind a lock.
fn shared(inner: Inner) -> Shared<Inner> {
    Shared::new(
        inner,
        "the simulation is running in another thread; access it from its progress function, or wait",
        "the simulation failed in the middle of a step, so its state is invalid; load a checkpoint, or start again",
    )
}
