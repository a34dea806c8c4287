//! A run: state, solver, and schedule, advanced step by step.

use std::sync::OnceLock;

use super::guard::{self, EnergyFault, Guard};
use super::stop::{self, StopReason, StopValues};
use super::{Record, Schedule};
use crate::sampling::{Bonds, SampledState, ScheduledOperator, rigid_links};
use concordem_operator::OperatorError;
use concordem_operator::tessellation::Mesh;
use concordem_solver::fracture::Event;
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;
use concordem_solver::{Model, Solver, SolverError, StepReport};

/// Why a run cannot continue.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The solver failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
    /// Errors of the integration have changed the energy.
    #[error("at step {step} (t = {time} s) {}", describe(fault))]
    Energy {
        /// Step.
        step: u64,
        /// Time, s.
        time: f64,
        /// What is wrong.
        fault: Box<EnergyFault>,
    },
    /// An operator cannot be evaluated.
    #[error("sample `{name}` at step {step}: {source}")]
    Operator {
        /// Name of the sample.
        name: String,
        /// Step.
        step: u64,
        /// Why.
        source: OperatorError,
    },
}

/// The sentence of an [`EnergyFault`].
fn describe(fault: &EnergyFault) -> String {
    let EnergyFault { unstable, created, turnover, integration, residual, kinetic, stored } = fault;
    let remedy = "The time step is too large for the contacts that have formed: lower integration.contact_safety or \
                  integration.time_step. With integration.allow_energy_error = true the run goes on";
    if *unstable {
        return format!(
            "the motion is unstable: {stored:.3e} J are stored, kinetic and stored energy together are {:.3e} J. {remedy}",
            kinetic + stored
        );
    }
    let (verb, without) = if *created > 0.0 { ("gained", "without a source") } else { ("lost", "without a sink") };
    format!(
        "the run has {verb} {:.3e} J {without}, {:.1} % of its energy of {turnover:.3e} J (ledger: integration \
         {integration:.3e} J, residual {residual:.3e} J). {remedy}",
        created.abs(),
        100.0 * created.abs() / turnover
    )
}

/// Result of [`Simulation::advance`].
#[derive(Debug, Clone, PartialEq)]
pub struct Advance {
    /// A record of the time series, if one was due.
    pub sample: Option<Record>,
    /// Values of the operators that were due; at the end of the run also those of all operators at the final state.
    pub operators: Vec<OperatorRow>,
    /// At the end of the run, the record of the final state, as the next step would give it.
    pub last: Option<Record>,
    /// Bonds that broke or passed the damage threshold in this step.
    pub events: Vec<Event>,
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

/// Indices of [`State::schedule_memory`].
mod memory {
    pub const PEAK: usize = 0;
    pub const BROKEN: usize = 1;
    pub const DAMAGED: usize = 2;
    pub const VIRIAL: usize = 3;
    pub const STOPPED: usize = 12;
    pub const AXIAL: usize = 13;
    /// Largest energy present or dissipated so far, J.
    pub const ENERGY: usize = 15;
    pub const COUNT: usize = 16;
}

/// Prepares the memory of an earlier run for its continuation: it has not stopped. A new loading has its own peak stress.
pub(crate) fn continue_memory(memory: &mut [f64], new_loading: bool) {
    if let Some(stopped) = memory.get_mut(memory::STOPPED) {
        *stopped = 0.0;
    }
    if let (true, Some(peak)) = (new_loading, memory.get_mut(memory::PEAK)) {
        *peak = 0.0;
    }
}

/// Forgets the largest energy so far, for a balance that starts anew.
pub(crate) fn forget_turnover(memory: &mut [f64]) {
    if let Some(energy) = memory.get_mut(memory::ENERGY) {
        *energy = 0.0;
    }
}

/// A running simulation.
pub struct Simulation {
    /// The state.
    pub state: State,
    /// The solver.
    pub solver: Solver,
    /// Loading, samples, and stop conditions.
    pub schedule: Schedule,
    last: StepReport,
    guard: Guard,
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
    /// Volume of the periodic cell, m³; 1 without a cell.
    volume: f64,
}

impl Simulation {
    /// Starts a simulation, or continues one from the state of a checkpoint.
    ///
    /// # Errors
    /// The solver refuses the state.
    pub fn new(mut state: State, model: Model, schedule: Schedule) -> Result<Self, SolverError> {
        state.schedule_memory.resize(memory::COUNT, 0.0);
        let mut solver = Solver::new(model, &mut state)?;
        // A restart may begin another stage of loading. The particles follow the change of the cell's motion.
        if let (Some(cell), Some(gradient)) = (&state.cell, schedule.loading.cell_gradient())
            && cell.velocity_gradient != gradient
        {
            solver.set_velocity_gradient(cell, gradient);
        }
        let mut last = StepReport::default();
        last.virial.copy_from_slice(&state.schedule_memory[memory::VIRIAL..memory::STOPPED]);
        let guard = Guard::new(&state, solver.model().mode);
        let radius = state.particles.mean_radius();
        Ok(Self { state, solver, schedule, last, guard, radius, mesh: OnceLock::new() })
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
        let step = self.state.clock.step;
        let is_due = |sample: &ScheduledOperator| all || step.is_multiple_of(sample.interval);
        if !self.schedule.operators.iter().any(is_due) {
            return Ok(Vec::new());
        }
        let forces = self.solver.record(&mut self.state)?;
        let due = || self.schedule.operators.iter().enumerate().filter(|(_, sample)| is_due(sample));
        let bodies: Vec<Vec<u32>> = self.state.clumps.iter().map(|clump| clump.members.clone()).collect();
        let failed = |name: &str, source| RunError::Operator { name: name.to_owned(), step, source };
        let links = rigid_links(&self.state.particles, &forces, &bodies).map_err(|error| failed("clumps", error))?;
        let needs_bonds = due().any(|(_, sample)| sample.operator.definition().needs_bonds);
        let state = SampledState {
            particles: &self.state.particles,
            cell: self.state.cell,
            time: self.state.clock.time(),
            bonds: &if needs_bonds { Bonds::of(&self.state, &forces) } else { Bonds::default() },
            forces: &forces,
            links: &links,
            initial_positions: &self.schedule.initial_positions,
            initial_edges: self.schedule.initial_edges,
            mesh: &self.mesh,
            gravity: self.solver.model().gravity,
            planar: self.schedule.planar,
        };
        due()
            .map(|(operator, sample)| {
                let values = sample.evaluate(&state).map_err(|error| failed(&sample.name, error))?;
                Ok(OperatorRow { operator, time: state.time, step, values })
            })
            .collect()
    }

    /// Advances one step, with the record and the operators that are due. The step that ends the run also gives the record and
    /// all operators of the final state.
    ///
    /// # Errors
    /// The solver fails, or an operator cannot be evaluated.
    pub fn advance(&mut self) -> Result<Advance, RunError> {
        let mut advance = self.step(false)?;
        if advance.stopped.is_some()
            && let Some(last) = self.final_rows()
        {
            advance.last = last.sample;
            advance.operators.extend(last.operators);
        }
        Ok(advance)
    }

    /// The record and all operators of the present state. They belong to the step that would follow, which a copy takes.
    /// Nothing, if that step fails.
    fn final_rows(&mut self) -> Option<Advance> {
        let mut ahead = Self::new(self.state.clone(), self.solver.model().clone(), Schedule::default()).ok()?;
        let mut exchange = |ahead: &mut Self| {
            std::mem::swap(&mut self.schedule, &mut ahead.schedule);
            std::mem::swap(&mut self.mesh, &mut ahead.mesh);
        };
        exchange(&mut ahead);
        let rows = ahead.step(true);
        exchange(&mut ahead);
        rows.ok()
    }

    /// One step, with the record and the operators that are due, or with all of them.
    fn step(&mut self, all: bool) -> Result<Advance, RunError> {
        let operators = self.operators(all)?;
        let step = self.state.clock.step;
        let due = all || step.is_multiple_of(self.schedule.sample_interval);
        let axial = [self.state.schedule_memory[memory::AXIAL], self.state.schedule_memory[memory::AXIAL + 1]];
        self.schedule.loading.apply(&self.state, &mut self.solver, &self.last, axial);
        let (strain, gauge_strain) = if due {
            (self.schedule.loading.strain(&self.state), self.schedule.loading.gauge_strain(&self.state))
        } else {
            (0.0, 0.0)
        };
        let volume = self.state.cell.map_or(1.0, |cell| cell.volume());
        let before = BeforeStep { time: self.state.clock.time(), step, strain, gauge_strain, volume };
        let guarded = !self.schedule.allow_energy_error && (due || step.is_multiple_of(guard::INTERVAL));
        let report = self.solver.step_with(&mut self.state, due || guarded)?;
        let mut largest = self.state.schedule_memory[memory::ENERGY];
        let fault = if guarded { self.guard.fault(&self.state, &mut largest) } else { None };
        self.state.schedule_memory[memory::ENERGY] = largest;
        if let Some(fault) = fault {
            return Err(RunError::Energy { step, time: before.time, fault: Box::new(fault) });
        }
        let events = self.events(&report, before.time, step);
        self.remember(&report);
        let (sample, mut stopped) = match due.then(|| self.record(&before, &report)) {
            Some((record, stopped)) => (Some(record), stopped),
            None => (None, None),
        };
        if stopped.is_none() && self.schedule.stop.steps.is_some_and(|limit| self.state.clock.step >= limit) {
            stopped = Some(StopReason::Steps);
        }
        // The state keeps the reason, so that a run killed while it writes its result knows that it has ended.
        self.state.schedule_memory[memory::STOPPED] = stopped.map_or(0.0, StopReason::code);
        self.last = report;
        Ok(Advance { sample, operators, last: None, events, stopped })
    }

    /// Stores in the state what the next step and a resumed run need of this step.
    fn remember(&mut self, report: &StepReport) {
        for (_, bond_event) in &report.bond_events {
            self.state.schedule_memory[if bond_event.broke { memory::BROKEN } else { memory::DAMAGED }] += 1.0;
        }
        self.state.schedule_memory[memory::VIRIAL..memory::STOPPED].copy_from_slice(report.virial.as_slice());
        self.state.schedule_memory[memory::AXIAL..memory::ENERGY]
            .copy_from_slice(&self.schedule.loading.axial_forces(&self.solver));
    }

    /// The record of a step, and why the run ends with it, if it does.
    fn record(&mut self, before: &BeforeStep, report: &StepReport) -> (Record, Option<StopReason>) {
        let &BeforeStep { time, step, strain, gauge_strain, volume } = before;
        let measure = self.schedule.loading.stress(&self.state, &self.solver, report, volume);
        stop::update_peak(&mut self.state.schedule_memory[memory::PEAK], measure.stress);
        let contacts: u64 = report.active.iter().sum();
        let unbalanced = report.unbalanced(self.radius);
        let (loading, contact_force) = (&self.schedule.loading, report.contact_force());
        let stopped = self.schedule.stop.reason(&StopValues {
            time,
            strain,
            stress: measure.stress,
            peak: self.state.schedule_memory[memory::PEAK],
            unbalanced: if loading.is_rounding(contact_force, self.radius) { 0.0 } else { unbalanced },
            at_rest: loading.reached(&measure, contact_force),
        });
        let ledger = &self.state.ledger;
        let record = Record {
            time,
            step: step as f64,
            strain,
            gauge_strain,
            stress: measure.stress,
            kinetic: ledger.kinetic,
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
            boundary_work: ledger.boundary_work.get(),
            external_work: ledger.external_work.get(),
            residual: ledger.residual(),
            broken: self.state.schedule_memory[memory::BROKEN],
            damaged: self.state.schedule_memory[memory::DAMAGED],
            contacts: contacts as f64,
            unbalanced,
        };
        (record, stopped)
    }

    /// Entries of the event log for the bonds of a step.
    fn events(&self, report: &StepReport, time: f64, step: u64) -> Vec<Event> {
        report
            .bond_events
            .iter()
            .map(|(_, bond_event)| {
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
                    energy: bond_event.energy,
                    damage: bond_event.damage,
                }
            })
            .collect()
    }

    /// Completed fraction of the run, 0 to 1, by the nearest stop condition; a drop of stress cannot be predicted.
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
            fraction = fraction.max(self.schedule.loading.strain(&self.state).abs() / strain);
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
