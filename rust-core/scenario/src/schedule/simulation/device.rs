//! Steps that a device takes in place of the solver.

use std::time::{Duration, Instant};

use super::super::{Loading, guard};
use super::{Advance, RunError, Simulation, memory};
use crate::schedule::StopReason;
use concordem_solver::forces::BondEvent;
use concordem_solver::fracture::Event;
use concordem_solver::{SolverError, StepDevice, TakenSteps};

/// A device, and when to use it.
pub(super) struct Device {
    steps: Box<dyn StepDevice>,
    /// Steps that the solver takes before the device is tried again.
    pause: u64,
    /// The same after the next event.
    patience: u64,
    /// Steps taken so far.
    taken: u64,
}

/// Steps on the device from which copying the state back and forth counts for little.
const WORTH: u64 = 64;

/// Most steps that the solver takes before the device is tried again.
const LONGEST_PAUSE: u64 = 256;

/// Time after which a stretch of steps returns, so that a run can be interrupted.
const STRETCH: Duration = Duration::from_secs(2);

impl Simulation {
    /// Take steps on `device` from now on, wherever it can: between operators and steps with an event, which remain the solver's.
    /// Results have the same bits. Each [`Self::advance`] may then take many steps.
    ///
    /// # Errors
    /// The run has something that no device supports.
    pub fn use_device(&mut self, device: Box<dyn StepDevice>) -> Result<(), RunError> {
        let schedule = &self.schedule;
        let histories = &schedule.histories;
        let changes = !(histories.motions.is_empty()
            && histories.loads.is_empty()
            && histories.membranes.is_empty()
            && histories.recorded.is_empty());
        let unsupported = [
            (!matches!(schedule.loading, Loading::None | Loading::Uniaxial { .. }), "this loading"),
            (schedule.opening.is_some(), "a loading that follows a gauge"),
            (!schedule.stages.is_empty(), "stages"),
            (changes, "motions and forces that change with time"),
            (!schedule.servos.is_empty(), "servos"),
            (!schedule.bondings.is_empty(), "bonds made during the run"),
        ];
        let what = unsupported.into_iter().find_map(|(is, what)| is.then_some(what));
        if let Some(what) = what.or_else(|| self.solver.unsupported_by_devices(&self.state)) {
            return Err(RunError::Device { device: device.name(), what });
        }
        self.device = Some(Device { steps: device, pause: 0, patience: 1, taken: 0 });
        Ok(())
    }

    /// Name of the device and the number of steps that it has taken, if there is one.
    pub fn steps_on_device(&self) -> Option<(String, u64)> {
        self.device.as_ref().map(|device| (device.steps.name(), device.taken))
    }

    /// Takes steps on the device, if there is one that can take the next step.
    pub(super) fn advance_on_device(&mut self) -> Result<Option<Advance>, RunError> {
        let Some(mut device) = self.device.take() else { return Ok(None) };
        let advance = if device.pause > 0 {
            device.pause -= 1;
            Ok(None)
        } else {
            self.stretch(&mut device)
        };
        self.device = Some(device);
        advance
    }

    fn stretch(&mut self, device: &mut Device) -> Result<Option<Advance>, RunError> {
        let (first, end) = (self.state.clock.step, self.end_of_stretch());
        if first >= end || self.solver.steps_for_device(&self.state) == 0 {
            return Ok(None);
        }
        let begun = Instant::now();
        let steps = &mut *device.steps;
        let failed = |step| move |source| SolverError::Device { step, source };
        steps.load(&self.solver, &self.state).map_err(failed(first))?;
        // Copying takes a tenth of the time, or less.
        let longest = STRETCH.max(10 * begun.elapsed());
        let (mut event, mut records, mut events, mut stopped) = (false, Vec::new(), Vec::new(), None);
        while self.state.clock.step < end && !event && stopped.is_none() && begun.elapsed() < longest {
            let step = self.state.clock.step;
            let record = match self.schedule.sample_interval {
                0 => u64::MAX,
                interval => step.next_multiple_of(interval),
            };
            // Often enough to look at the clock.
            let mut count = (end - step).min(self.solver.steps_for_device(&self.state)).min(guard::INTERVAL);
            if count == 0 {
                break;
            }
            if record == step {
                steps.positions(&mut self.state.particles.position).map_err(failed(step))?;
                let before = self.before_step(true);
                let Some(TakenSteps { report, bond_events, .. }) = self.solver.sample_on(steps, &mut self.state)?
                else {
                    event = true;
                    break;
                };
                if !self.schedule.allow_energy_error {
                    self.check_energy(steps, step)?;
                }
                events.extend(self.book_events(&bond_events));
                self.remember(&report);
                let (record, values) = self.record(&before, &report, 1.0);
                records.push(record);
                stopped = self.schedule.stop.reason(&values);
                self.last = report;
                continue;
            }
            count = count.min(record - step);
            // The solver samples in the steps that the guard checks, too.
            let checked = step.next_multiple_of(guard::INTERVAL);
            let guarded = !self.schedule.allow_energy_error && checked < step + count;
            if guarded {
                count = checked + 1 - step;
            }
            let taken = self.solver.step_on(steps, &mut self.state, count, guarded)?;
            let TakenSteps { report, bond_events, .. } = taken;
            event = taken.event;
            if taken.count == 0 {
                continue;
            }
            if guarded && taken.count == count {
                self.check_energy(steps, checked)?;
            }
            events.extend(self.book_events(&bond_events));
            self.remember(&report);
            self.last = report;
        }
        let step = self.state.clock.step;
        steps.store(&mut self.state).map_err(failed(step))?;
        let taken = step - first;
        device.taken += taken;
        if event {
            device.pause = device.patience;
            device.patience = if taken < WORTH { (2 * device.patience).min(LONGEST_PAUSE) } else { 1 };
        }
        if taken == 0 {
            return Ok(None);
        }
        let by_steps = || self.schedule.stop.steps.is_some_and(|limit| step >= limit).then_some(StopReason::Steps);
        let stopped = stopped.or_else(by_steps);
        self.state.schedule_memory[memory::STOPPED] = stopped.map_or(0.0, StopReason::code);
        Ok(Some(Advance { records, events, stopped, ..Advance::default() }))
    }

    /// Counts these entries of the event log.
    fn book_events(&mut self, bond_events: &[(u64, BondEvent)]) -> Vec<Event> {
        for (_, event) in bond_events {
            self.state.schedule_memory[if event.fails { memory::BROKEN } else { memory::DAMAGED }] += 1.0;
        }
        let dt = self.state.clock.dt;
        bond_events.iter().map(|(step, event)| self.event(event, *step as f64 * dt, *step)).collect()
    }

    /// The guard's check of the ledger after step `step`, which has sampled. The energy of prescribed motions is that of the last copy: they
    /// keep their velocities.
    fn check_energy(&mut self, steps: &mut dyn StepDevice, step: u64) -> Result<(), RunError> {
        let mut largest = self.state.schedule_memory[memory::ENERGY];
        let fault = self.guard.fault(&self.state, &mut largest);
        self.state.schedule_memory[memory::ENERGY] = largest;
        let Some(fault) = fault else { return Ok(()) };
        steps.store(&mut self.state).map_err(|source| SolverError::Device { step: step + 1, source })?;
        Err(RunError::Energy { step, time: step as f64 * self.state.clock.dt, fault: Box::new(fault) })
    }

    /// The step at which a stretch from the present one must end: the next one with operators, which the solver takes, or after which the
    /// state is written, or the last one.
    fn end_of_stretch(&self) -> u64 {
        let (step, schedule) = (self.state.clock.step, &self.schedule);
        let sampled = schedule.operators.iter().map(|sample| step.next_multiple_of(sample.interval.max(1)));
        let written = [schedule.snapshot_interval, schedule.checkpoint_interval];
        let written = written.into_iter().flatten().map(|interval| (step + 1).next_multiple_of(interval.max(1)));
        sampled.chain(written).chain(schedule.stop.steps).min().unwrap_or(u64::MAX)
    }
}
