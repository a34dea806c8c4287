//! A run: state, solver, and schedule, advanced step by step.

mod bonds;
mod device;
mod error;
mod memory;
mod servos;
mod written;

use std::sync::OnceLock;

use super::cell_servo::CellServoMemory;
use super::guard::{self, Guard};
use super::stage::{StageEnd, StageProgress};
use super::stop::{self, StopReason, StopValues};
use super::watch::Watch;
use super::{Record, Schedule, Stage, StageReason};
use crate::sampling::{Bonds, Need, SampledHeat, SampledState, ScheduledOperator, rigid_links};
use concordem_operator::OperatorError;
use concordem_operator::tessellation::Mesh;
use concordem_solver::energy::Ledger;
use concordem_solver::forces::BondEvent;
use concordem_solver::fracture::Event;
use concordem_solver::heat::{HeatFlows, HeatLedger};
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;
use concordem_solver::{Model, Solver, SolverError, StepReport};

pub use error::RunError;
pub use memory::STRESS_WORK;
pub(crate) use memory::{continue_memory, forget_turnover};
pub use written::Written;

/// Result of [`Simulation::advance`].
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Advance {
    /// Records of the steps that [a device](Simulation::use_device) took.
    pub records: Vec<Record>,
    /// A record of the time series, if one was due.
    pub sample: Option<Record>,
    /// Values of the operators that were due; at the end of the run, also the values of all operators at the final state.
    pub operators: Vec<OperatorRow>,
    /// At the end of the run, the record of the final state, as the next step would compute it.
    pub last: Option<Record>,
    /// Bonds that broke or passed the damage threshold in this step.
    pub events: Vec<Event>,
    /// The stage that ended with this step, if one did.
    pub stage: Option<StageEnd>,
    /// Number of bonds made after this step, if it was time to make some.
    pub bonded: Option<usize>,
    /// Why the run has ended, if it has.
    pub stopped: Option<StopReason>,
}

/// Values of an operator at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorRow {
    /// Index of the operator in [`Schedule::operators`].
    pub operator: usize,
    /// Time, s.
    pub time: f64,
    /// Steps done.
    pub step: u64,
    /// Values in the order of its quantities.
    pub values: Vec<f64>,
}

/// The solver of a state, and what the run needs of the last step. The particles follow the motion of the cell that the loading wants, which a restart
/// may have changed.
fn start(state: &mut State, model: Model, schedule: &Schedule) -> Result<(Solver, StepReport), SolverError> {
    let length = state.schedule_memory.len().max(memory::COUNT);
    state.schedule_memory.resize(length, 0.0);
    let mut solver = Solver::new(model, state)?;
    solver.set_sliders(schedule.loading.sliders());
    if let (Some(cell), Some(gradient)) = (&state.cell, schedule.loading.cell_gradient())
        && cell.velocity_gradient != gradient
        && schedule.stages.is_empty()
    {
        solver.set_velocity_gradient(cell, gradient);
    }
    let mut last = StepReport::default();
    last.virial.copy_from_slice(&state.schedule_memory[memory::VIRIAL..memory::STOPPED]);
    Ok((solver, last))
}

/// Values of each of the operators `due`, at the present positions.
fn evaluate(
    solver: &mut Solver,
    state: &mut State,
    schedule: &Schedule,
    mesh: &OnceLock<Result<Mesh, OperatorError>>,
    due: &[&ScheduledOperator],
) -> Result<Vec<Vec<f64>>, RunError> {
    if due.is_empty() {
        return Ok(Vec::new());
    }
    let step = state.clock.step;
    let forces = solver.record(state)?;
    let bodies: Vec<Vec<u32>> = state.clumps.iter().map(|clump| clump.members.clone()).collect();
    let failed = |name: &str, source| RunError::Operator { name: name.to_owned(), step, source };
    let links = rigid_links(&state.particles, &forces, &bodies).map_err(|error| failed("clumps", error))?;
    let needs = |data| due.iter().any(|sample| sample.operator.definition().needs(data));
    let flows = if needs(Need::HeatFlows) { solver.heat_flows(state)? } else { HeatFlows::default() };
    let heat = match (&solver.model().heat, &state.heat) {
        (Some(model), Some(heat)) => {
            let (temperature, capacity) = (&heat.temperature, &model.capacity);
            Some(SampledHeat { temperature, capacity, flows: &flows })
        }
        _ => None,
    };
    let sampled = SampledState {
        particles: &state.particles,
        cell: state.cell,
        time: state.clock.time(),
        bonds: &if needs(Need::Bonds) { Bonds::of(state, &forces) } else { Bonds::default() },
        forces: &forces,
        links: &links,
        initial_positions: &schedule.initial_positions,
        initial_edges: schedule.initial_edges,
        mesh,
        heat,
        gravity: solver.model().gravity,
        planar: schedule.planar,
    };
    due.iter().map(|sample| sample.evaluate(&sampled).map_err(|error| failed(&sample.name, error))).collect()
}

/// Largest number of walls that follow the opening of a gauge: the state has so many places for them.
pub(crate) const OPENINGS: usize = 8;

/// A running simulation.
pub struct Simulation {
    /// The state.
    pub state: State,
    /// The solver.
    pub solver: Solver,
    /// Loading, samples, and stop conditions.
    pub schedule: Schedule,
    last: StepReport,
    /// The device that takes steps in place of the solver, if there is one.
    device: Option<device::Device>,
    guard: Guard,
    /// Watches over the six stresses of a cell, and over the servos of walls.
    watches: Vec<Watch>,
    /// Root mean square of the radii, m.
    radius: f64,
    /// Delaunay mesh of the initial positions, built when an operator first needs it.
    mesh: OnceLock<Result<Mesh, OperatorError>>,
}

/// Values at the positions at which a step evaluates the forces.
struct BeforeStep {
    time: f64,
    step: u64,
    /// Strain and gauge strain; zero unless a record is due.
    strain: f64,
    gauge_strain: f64,
    /// Volumetric strain of a specimen under lateral pressure; zero unless a record is due.
    volumetric_strain: f64,
    /// Volume of the periodic cell, m³; 1 without a cell.
    volume: f64,
    /// Mean temperature (K), heat from sources and through the surface, and residual of the heat (J); zero unless a record is due.
    heat: [f64; 5],
}

impl Simulation {
    /// Starts a simulation, or continues one from the state of a checkpoint.
    ///
    /// # Errors
    /// The solver refuses the state.
    pub fn new(mut state: State, model: Model, schedule: Schedule) -> Result<Self, SolverError> {
        let (solver, last) = start(&mut state, model, &schedule)?;
        let guard = Guard::new(&state, solver.model().mode);
        let radius = state.particles.mean_radius();
        let watches = Vec::new();
        Ok(Self { state, solver, schedule, last, device: None, guard, watches, radius, mesh: OnceLock::new() })
    }

    /// Goes back to an earlier state of this run, or on to a later one; returns the state so far. Schedule and model stay. If the solver
    /// refuses the state, nothing changes.
    ///
    /// # Errors
    /// The solver refuses the state.
    pub fn replace_state(&mut self, mut state: State) -> Result<State, SolverError> {
        let (solver, last) = start(&mut state, self.solver.model().clone(), &self.schedule)?;
        (self.solver, self.last) = (solver, last);
        Ok(std::mem::replace(&mut self.state, state))
    }

    /// Begin the energy balance anew with the next step: the state has other energies than before, which no motion connects.
    pub fn start_balance(&mut self) {
        self.state.ledger = Ledger::default();
        forget_turnover(&mut self.state.schedule_memory);
    }

    /// The report of the last step.
    pub fn last_report(&self) -> &StepReport {
        &self.last
    }

    /// Why the run has ended, if it has.
    pub fn stopped(&self) -> Option<StopReason> {
        StopReason::of_code(self.state.schedule_memory[memory::STOPPED])
    }

    /// Values of the operators that are due (or of all), at the positions at which the next step evaluates the forces.
    fn operators(&mut self, all: bool) -> Result<Vec<OperatorRow>, RunError> {
        let clock = self.state.clock;
        let is_due = |sample: &ScheduledOperator| all || clock.step.is_multiple_of(sample.interval);
        let operators = self.schedule.operators.iter().enumerate();
        let (numbers, due): (Vec<_>, Vec<_>) = operators.filter(|(_, sample)| is_due(sample)).unzip();
        let rows = evaluate(&mut self.solver, &mut self.state, &self.schedule, &self.mesh, &due)?;
        let row = |(operator, values)| OperatorRow { operator, time: clock.time(), step: clock.step, values };
        Ok(numbers.into_iter().zip(rows).map(row).collect())
    }

    /// Values of an operator at the present positions, whether the schedule has it or not; see [`ScheduledOperator::evaluate`].
    ///
    /// # Errors
    /// The operator cannot be evaluated, or needs initial positions that the schedule does not have.
    pub fn sample(&mut self, operator: &ScheduledOperator) -> Result<Vec<f64>, RunError> {
        let rows = evaluate(&mut self.solver, &mut self.state, &self.schedule, &self.mesh, &[operator])?;
        Ok(rows.into_iter().next().unwrap_or_default())
    }

    /// Advances one step, with the record and the operators that are due. The step that ends the run also gives the
    /// record and all operators of the final state. With [a device](Self::use_device), advances many steps where none has operators, a
    /// snapshot, or a broken bond; records and events of these steps come together, and are lost if a later one of them fails.
    ///
    /// # Errors
    /// The solver or the device fails, or an operator cannot be evaluated.
    pub fn advance(&mut self) -> Result<Advance, RunError> {
        let mut advance = match self.advance_on_device()? {
            Some(advance) => advance,
            None => self.step(false)?,
        };
        if advance.stopped.is_none() {
            advance.bonded = self.bond(advance.stage.as_ref().map(|end| end.stage))?;
        }
        if advance.stopped.is_some()
            && let Some(last) = self.final_rows(advance.stage.as_ref())
        {
            advance.last = last.sample;
            advance.operators.extend(last.operators);
        }
        Ok(advance)
    }

    /// The record and all operators of the present state, as the next step would compute them, for a result of a run that has not ended.
    /// `None` if that step fails.
    pub fn present(&mut self) -> Option<Advance> {
        self.final_rows(None)
    }

    /// The record and all operators of the present state, as the next step would compute them. A copy of the simulation takes that step,
    /// which changes nothing here; bonds that break in it are not counted. After the last stage, which has just `ended`, the copy
    /// continues that stage. `None` if the step fails.
    fn final_rows(&mut self, ended: Option<&StageEnd>) -> Option<Advance> {
        let model = Model { watch_contacts: false, ..self.solver.model().clone() };
        let mut state = self.state.clone();
        if let Some(end) = ended.filter(|end| end.stage + 1 == self.schedule.stages.len()) {
            let progress = StageProgress::read(&state.schedule_memory[memory::STAGE..]);
            let last = progress.begin(end.stage, end.start.0, end.start.1);
            last.write(&mut state.schedule_memory[memory::STAGE..]);
        }
        let (solver, last) = start(&mut state, model, &self.schedule).ok()?;
        let (schedule, mesh) = (std::mem::take(&mut self.schedule), std::mem::take(&mut self.mesh));
        let (guard, radius) = (self.guard, self.radius);
        let mut ahead = Self { state, solver, schedule, last, device: None, guard, watches: Vec::new(), radius, mesh };
        let guarded = std::mem::replace(&mut ahead.schedule.allow_energy_error, true);
        let rows = ahead.step(true);
        ahead.schedule.allow_energy_error = guarded;
        (self.schedule, self.mesh) = (ahead.schedule, ahead.mesh);
        let mut rows = rows.ok()?;
        if let Some(last) = &mut rows.sample {
            // The event log and the tables of the state end before that step.
            [last.broken, last.damaged] =
                [memory::BROKEN, memory::DAMAGED].map(|place| self.state.schedule_memory[place]);
        }
        Some(rows)
    }

    /// Takes one step, with the record and the operators that are due, or with all of them.
    fn step(&mut self, all: bool) -> Result<Advance, RunError> {
        if let Some(motion) = self.state.motion.take() {
            self.solver.set_targets(Some(motion));
        }
        self.schedule.histories.apply(&mut self.state, &mut self.solver);
        self.apply_servos();
        let operators = self.operators(all)?;
        let step = self.state.clock.step;
        let due = all || step.is_multiple_of(self.schedule.sample_interval);
        let (factor, loaded_time) = (self.stage_factor(), self.loaded_time());
        let loading = &self.schedule.loading;
        let before = self.before_step(due);
        let by_stress = self.stage().is_some_and(|(stage, _)| stage.by_stress);
        // The factor of the stages is that of the opening, if the loading follows one.
        let mut followed = self.state.schedule_memory[memory::OPENING];
        let opening = self.schedule.opening.as_ref();
        let driven = opening
            .map(|opening| opening.factor(&self.state, loaded_time, factor.unwrap_or(1.0), &mut followed))
            .or(factor);
        if opening.is_some() {
            self.state.schedule_memory[memory::OPENING] = followed;
        }
        let mut lasting = [0.0; CellServoMemory::LENGTH];
        lasting.copy_from_slice(&self.state.schedule_memory[memory::LASTING..memory::BONDED]);
        loading.apply(&mut self.state, &mut self.solver, driven);
        let of_cell = (driven.unwrap_or(1.0), by_stress);
        loading.apply_to_cell(&self.state, &mut self.solver, &self.last, of_cell, &mut lasting);
        self.state.schedule_memory[memory::LASTING..memory::BONDED].copy_from_slice(&lasting);
        let before = BeforeStep { volume: self.state.cell.map_or(1.0, |cell| cell.volume()), ..before };
        let guarded = !self.schedule.allow_energy_error && (due || step.is_multiple_of(guard::INTERVAL));
        let report = self.solver.step_with(&mut self.state, due || guarded)?;
        let mut largest = self.state.schedule_memory[memory::ENERGY];
        let fault = if guarded { self.guard.fault(&self.state, &mut largest) } else { None };
        self.state.schedule_memory[memory::ENERGY] = largest;
        if let Some(fault) = fault {
            return Err(RunError::Energy { step, time: before.time, fault: Box::new(fault) });
        }
        self.watch_servos((factor.unwrap_or(1.0), by_stress), &report)?;
        let events = self.events(&report, before.time, step);
        self.remember(&report);
        self.look_at_cell();
        let (sample, values) = match due.then(|| self.record(&before, &report, factor.unwrap_or(1.0))) {
            Some((record, values)) => (Some(record), Some(values)),
            None => (None, None),
        };
        let stage = self.advance_stage(factor, values.as_ref());
        let mut stopped = values.and_then(|values| self.schedule.stop.reason(&values));
        if stopped.is_none() && self.schedule.stop.steps.is_some_and(|limit| self.state.clock.step >= limit) {
            stopped = Some(StopReason::Steps);
        }
        if stopped.is_none() && stage.as_ref().is_some_and(|end| end.stage + 1 == self.schedule.stages.len()) {
            stopped = Some(StopReason::Stages);
        }
        // The state stores the reason, so that a run killed while writing its result is known to have ended.
        self.state.schedule_memory[memory::STOPPED] = stopped.map_or(0.0, StopReason::code);
        self.last = report;
        for motion in &self.schedule.histories.recorded {
            motion.place(&mut self.state)?;
        }
        Ok(Advance { sample, operators, events, stage, stopped, ..Advance::default() })
    }

    /// Values at the present positions; `due`: also those that only a record needs.
    fn before_step(&self, due: bool) -> BeforeStep {
        let (loading, loaded_time) = (&self.schedule.loading, self.loaded_time());
        let (strain, gauge_strain) = if due {
            (loading.strain(&self.state, loaded_time), loading.gauge_strain(&self.state, loaded_time))
        } else {
            (0.0, 0.0)
        };
        let sides = self.schedule.confinement.as_ref().filter(|_| due);
        let volumetric_strain = sides.map_or(0.0, |sides| sides.volumetric_strain(&self.state, gauge_strain));
        let heat = if due { self.heat() } else { [0.0; 5] };
        let volume = self.state.cell.map_or(1.0, |cell| cell.volume());
        let clock = &self.state.clock;
        BeforeStep { time: clock.time(), step: clock.step, strain, gauge_strain, volumetric_strain, volume, heat }
    }

    /// Mean temperature (K), heat from sources and through the surface, and residual of the heat (J); zero without heat conduction.
    fn heat(&self) -> [f64; 5] {
        let (Some(model), Some(heat)) = (&self.solver.model().heat, &self.state.heat) else { return [0.0; 5] };
        let HeatLedger { sources, boundary, dissipation, .. } = &heat.ledger;
        [model.mean_temperature(heat), sources.get(), boundary.get(), dissipation.get(), model.residual(heat)]
    }

    /// Stores in the state the data of this step that the next step and a resumed run need.
    fn remember(&mut self, report: &StepReport) {
        for (_, bond_event) in report.bond_events.iter().filter(|(_, event)| is_told(event)) {
            self.state.schedule_memory[if bond_event.fails { memory::BROKEN } else { memory::DAMAGED }] += 1.0;
        }
        self.state.schedule_memory[memory::VIRIAL..memory::STOPPED].copy_from_slice(report.virial.as_slice());
    }

    /// The present stage, and the progress in it; `None` without stages, and after the last one.
    fn stage(&self) -> Option<(&Stage, StageProgress)> {
        let progress = StageProgress::read(&self.state.schedule_memory[memory::STAGE..]);
        Some((self.schedule.stages.get(progress.stage)?, progress))
    }

    /// Factor of the loading's rate for the coming step, in its middle. After the last stage the loading stands still.
    fn stage_factor(&self) -> Option<f64> {
        let clock = &self.state.clock;
        match self.stage() {
            Some((stage, progress)) => Some(stage.factor(clock.time() + 0.5 * clock.dt - progress.time)),
            None => (!self.schedule.stages.is_empty()).then_some(0.0),
        }
    }

    /// Time of a run at constant rate that has come as far, s.
    fn loaded_time(&self) -> f64 {
        if self.schedule.stages.is_empty() {
            return self.state.clock.time();
        }
        StageProgress::read(&self.state.schedule_memory[memory::STAGE..]).loaded_time
    }

    /// Books the step in the present stage, and begins the next one if it has ended. `values`: of a record, if one was due.
    fn advance_stage(&mut self, factor: Option<f64>, values: Option<&StopValues>) -> Option<StageEnd> {
        let clock = self.state.clock;
        let (stage, mut progress) = self.stage()?;
        progress.loaded_time += factor.unwrap_or(1.0) * clock.dt;
        let rounding = self.schedule.rounding.after(clock.step);
        let stress = values.map_or(0.0, |values| values.stress);
        if stress.abs() > progress.peak.abs().max(rounding) {
            progress.peak = stress;
        }
        let values =
            values.map(|values| StopValues { time: values.time - progress.time, peak: progress.peak, ..*values });
        let by_steps = stage.stop.steps.is_some_and(|limit| clock.step.saturating_sub(progress.step) >= limit);
        let reason = values
            .and_then(|values| stage.reason(&mut progress, &values))
            .or_else(|| by_steps.then_some(StageReason::Stop(StopReason::Steps)));
        let start = (progress.time, progress.step);
        let end = reason.map(|reason| StageEnd { stage: progress.stage, reason, start });
        if end.is_some() {
            progress = progress.begin(progress.stage + 1, clock.time(), clock.step);
            // The next stage begins where this one ends: unloading, it drops from there.
            progress.peak = if stress.abs() > rounding { stress } else { 0.0 };
        }
        progress.write(&mut self.state.schedule_memory[memory::STAGE..]);
        if end.is_some() {
            self.state.schedule_memory.extend([clock.time(), clock.step as f64]);
        }
        end
    }

    /// Name, end time (s), and last step of each stage that has ended.
    pub fn ended_stages(&self) -> impl Iterator<Item = (&str, f64, u64)> {
        let ends = self.state.schedule_memory[memory::COUNT..].chunks_exact(2);
        self.schedule.stages.iter().zip(ends).map(|(stage, end)| (stage.name.as_str(), end[0], end[1] as u64))
    }

    /// The record of a step, and the values that end runs and stages. `factor`: of the loading, from the present stage.
    fn record(&mut self, before: &BeforeStep, report: &StepReport, factor: f64) -> (Record, StopValues) {
        let &BeforeStep { time, step, strain, gauge_strain, volumetric_strain, volume, heat } = before;
        let [mean_temperature, heat_sources, heat_boundary, heat_dissipation, heat_residual] = heat;
        let measure = self.schedule.loading.stress(&self.state, &self.solver, report, volume);
        let loaded = self.loaded_time();
        let [mut peak, mut farthest] = [memory::PEAK, memory::FARTHEST].map(|place| self.state.schedule_memory[place]);
        stop::update_peak(&mut peak, &mut farthest, measure.stress, loaded, self.schedule.rounding.after(step));
        self.state.schedule_memory[memory::PEAK] = peak;
        self.state.schedule_memory[memory::FARTHEST] = farthest;
        let contacts: u64 = report.active.iter().sum();
        let unbalanced = report.unbalanced(self.radius);
        let (loading, contact_force) = (&self.schedule.loading, report.contact_force());
        let by_stress = self.stage().is_some_and(|(stage, _)| stage.by_stress);
        let values = StopValues {
            time,
            strain,
            stress: measure.stress,
            peak,
            is_farthest: loaded == farthest,
            unbalanced: if loading.is_rounding(contact_force, self.radius) { 0.0 } else { unbalanced },
            at_rest: loading.reached(&measure, contact_force, factor, by_stress) && self.servos_stand(),
        };
        let sides = self.schedule.confinement.as_ref();
        let lateral_stress = sides.map_or(0.0, |sides| {
            sides.lateral_stress(&self.state, &self.schedule.histories.membranes, &measure.tensor, (time, strain))
        });
        let ledger = &self.state.ledger;
        let record = Record {
            time,
            step: step as f64,
            strain,
            gauge_strain,
            stress: measure.stress,
            kinetic: ledger.kinetic - report.affine_kinetic,
            stored_normal: ledger.stored[0],
            stored_shear: ledger.stored[1],
            stored_bending: ledger.stored[2],
            stored_twist: ledger.stored[3],
            stored_deformation: ledger.deformation,
            damage: ledger.damage.get(),
            friction: ledger.friction.get(),
            viscous: ledger.viscous.get(),
            integration: ledger.integration.get(),
            numerical_damping: ledger.numerical_damping.get(),
            deformation_lag: ledger.deformation_lag.get(),
            deformation_other: ledger.deformation_other.get(),
            boundary_work: ledger.boundary_work.get() - report.affine_kinetic,
            external_work: ledger.external_work.get(),
            expansion_work: ledger.expansion_work.get(),
            stiffness_work: ledger.stiffness_work.get(),
            residual: ledger.residual(),
            mean_temperature,
            heat_sources,
            heat_boundary,
            heat_dissipation,
            heat_residual,
            broken: self.state.schedule_memory[memory::BROKEN],
            damaged: self.state.schedule_memory[memory::DAMAGED],
            contacts: contacts as f64,
            unbalanced,
            lateral_stress,
            volumetric_strain,
        };
        (record, values)
    }

    /// Entries of the event log for the bonds of a step.
    fn events(&self, report: &StepReport, time: f64, step: u64) -> Vec<Event> {
        let told = report.bond_events.iter().filter(|(_, bond_event)| is_told(bond_event));
        told.map(|(_, bond_event)| self.event(bond_event, time, step)).collect()
    }

    /// Entry of the event log for a bond.
    fn event(&self, bond_event: &BondEvent, time: f64, step: u64) -> Event {
        let total: f64 = bond_event.stored.iter().sum();
        let fraction = |k: usize| if total > 0.0 { bond_event.stored[k] / total } else { 0.0 };
        let ids = [bond_event.pair.a, bond_event.pair.b].map(|p| self.state.particles.id[p as usize]);
        Event {
            time,
            step,
            id_a: ids[0].min(ids[1]),
            id_b: ids[0].max(ids[1]),
            position: bond_event.position,
            mode_shares: [fraction(0), fraction(1), fraction(2), fraction(3)],
            in_shear: bond_event.in_shear,
            energy: bond_event.energy,
            damage: bond_event.damage,
            joint: self.solver.model().joints.table_between(ids),
        }
    }

    /// Completed fraction of the run, 0 to 1, by the stop condition nearest to being met; a stress drop cannot be predicted.
    pub fn progress(&self) -> f64 {
        let stop = &self.schedule.stop;
        let mut fraction: f64 = 0.0;
        if let Some(steps) = stop.steps {
            fraction = fraction.max(self.state.clock.step as f64 / steps as f64);
        }
        if let Some(time) = stop.time {
            fraction = fraction.max(self.state.clock.time() / time);
        }
        if let Some(strain) = stop.strain {
            fraction = fraction.max(self.schedule.loading.strain(&self.state, self.loaded_time()).abs() / strain);
        }
        fraction.min(1.0)
    }

    /// Number of bonds that are not broken.
    pub fn intact_bonds(&self) -> usize {
        self.state
            .bonds
            .iter()
            .map(|block| (0..block.len()).filter(|&k| !block.view(k).flags.has(ContactFlags::BROKEN)).count())
            .sum()
    }
}

/// Whether records and the log tell of an event; not of the end of a bond that had failed before.
fn is_told(event: &BondEvent) -> bool {
    event.fails || !event.broke
}
