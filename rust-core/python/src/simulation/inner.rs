//! The data that steps change, and how they change.

use std::sync::Arc;
use std::time::{Duration, Instant};

use concordem::assembly::Summary;
use concordem::output::RunHeader;
use concordem::program::Failure;
use concordem::program::progress::Progress;
use concordem::program::recording::Recording;
use concordem::schedule::simulation::Written;
use concordem::schedule::{Simulation as Run, StopReason};
use concordem::state::Load;
use pyo3::prelude::*;

use super::kept::Records;
use crate::addresses::Addresses;
use crate::scenario::Scenario;
use crate::scripted::ScriptedLaw;
use crate::work::SLICE;

/// The data that steps change.
pub struct Inner {
    /// State, solver, and schedule.
    pub run: Box<Run>,
    pub(super) records: Records,
    /// How far the run, or its present stage, has come.
    pub(super) progress: Progress,
    /// What snapshots and results need besides the present state.
    pub(super) recording: Recording,
    /// Whether steps keep the snapshots that a result has.
    pub(super) keeps_snapshots: bool,
    /// The description of the run in its result.
    pub(super) header: RunHeader,
    /// Time spent in steps.
    pub(super) wall: Duration,
    pub(super) addresses: Addresses,
    /// Loads of the scenario.
    pub(super) loads: Vec<Load>,
    pub(super) scenario: Py<Scenario>,
    pub(super) summary: Summary,
    /// Laws in Python, which the blocks of contacts know by number.
    pub(super) scripted: Vec<Arc<ScriptedLaw>>,
    /// The motion after the last step, once a caller has a view to which it can write.
    pub written: Option<Written>,
}

impl Inner {
    /// Completed share of the present stage or of the run, if it can be estimated.
    pub fn share(&self) -> Option<f64> {
        let mut now = self.progress;
        now.done(&self.run, self.strain()).map(|done| done.share)
    }

    /// Notes where a stage begins.
    fn follow(&mut self) {
        let strain = self.strain();
        self.progress.done(&self.run, strain);
    }

    /// Strain of the last record.
    fn strain(&self) -> f64 {
        self.records.samples.last().map_or(0.0, |record| record.strain)
    }

    /// Book what Python has written since the last step.
    pub fn book_written(&mut self) {
        let Some(written) = &mut self.written else { return };
        let now = Written::of(&self.run.state);
        if *written != now {
            written.book(&mut self.run.state);
            *written = now;
            self.note("state.writable");
        }
    }

    /// Note that Python has changed the run by this call: its scenario alone does not describe it any more.
    pub fn note(&mut self, call: &str) {
        let step = self.run.state.clock.step;
        self.records.given.entry(call.to_owned()).or_insert((step, 0)).1 += 1;
    }

    /// Keep a snapshot of the present state, in place of one of the same step.
    pub fn keep_snapshot(&mut self) -> Result<(), Failure> {
        let moment = self.recording.snapshot(&mut self.run)?;
        self.records.moments.retain(|other| other.step() < moment.step());
        self.records.moments.push(moment);
        Ok(())
    }

    /// Advance until the interval ends, `steps` steps are done, or the run ends.
    pub fn advance(&mut self, steps: &mut u64) -> Result<Option<StopReason>, Failure> {
        let start = Instant::now();
        self.book_written();
        self.follow();
        // Python may have written velocities since the last step; what is prescribed starts from them, as in a checkpoint.
        self.run.solver.set_targets(None);
        while *steps > 0 {
            if let Some(reason) = self.run.stopped() {
                return Ok(Some(reason));
            }
            if self.keeps_snapshots && Recording::is_due(&self.run, !self.records.moments.is_empty()) {
                self.keep_snapshot()?;
            }
            let advance = self.run.advance()?;
            *steps -= 1;
            self.records.samples.extend(advance.sample.into_iter().chain(advance.last));
            for row in advance.operators {
                self.records.operators[row.operator].push(row);
            }
            self.records.events.extend(advance.events);
            if advance.stopped.is_some() && self.keeps_snapshots {
                self.keep_snapshot()?;
            }
            if start.elapsed() > SLICE {
                break;
            }
        }
        if self.written.is_some() {
            self.written = Some(Written::of(&self.run.state));
        }
        self.follow();
        self.wall += start.elapsed();
        Ok(self.run.stopped())
    }
}
