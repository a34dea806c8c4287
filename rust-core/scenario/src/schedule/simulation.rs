//! A run: state, solver, and plan, advanced sample by sample.

use std::sync::OnceLock;

use super::samples::{Bonds, Operator, Sampled};
use super::{Schedule, StopReason, stop};
use concordem_operator::OperatorError;
use concordem_operator::tessellation::Mesh;
use concordem_solver::fracture::Event;
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;
use concordem_solver::{Model, Solver, SolverError, StepReport};

/// A column of the time series.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SeriesColumn {
    /// Name.
    pub name: &'static str,
    /// SI unit.
    pub unit: &'static str,
    /// Meaning.
    pub description: &'static str,
}

macro_rules! series {
    ($($(#[doc = $doc:literal])+ $name:ident : $unit:literal,)*) => {
        /// One row of the time series.
        #[derive(Debug, Clone, Copy, Default, PartialEq)]
        pub struct Record { $($(#[doc = $doc])+ pub $name: f64,)* }
        impl Record {
            /// The columns, in the order of [`Self::to_row`].
            pub const COLUMNS: &'static [SeriesColumn] = &[$(SeriesColumn {
                name: stringify!($name),
                unit: $unit,
                description: concat!($($doc),+),
            }),*];
            /// The values in the order of [`Self::COLUMNS`].
            pub fn to_row(&self) -> Vec<f64> {
                vec![$(self.$name),*]
            }
        }
    };
}

series! {
    /// Time
    time: "s",
    /// Step
    step: "1",
    /// Strain along the loading axis
    strain: "1",
    /// Strain along the loading axis of the middle half of the specimen, fitted to its particles
    gauge_strain: "1",
    /// Stress along the loading axis
    stress: "Pa",
    /// Kinetic energy, ½ m v⁻·v⁺
    kinetic: "J",
    /// Stored by normal deformation of contacts
    stored_normal: "J",
    /// Stored by shear
    stored_shear: "J",
    /// Stored by bending
    stored_bending: "J",
    /// Stored by twist
    stored_twist: "J",
    /// Stored in deformable particles
    stored_deformation: "J",
    /// Dissipated by damage and breaking
    damage: "J",
    /// Dissipated by plastic slip and friction
    friction: "J",
    /// Dissipated by dashpots
    viscous: "J",
    /// Integration error at kinks of laws
    integration: "J",
    /// Taken by artificial damping
    numerical_damping: "J",
    /// Dissipated by the lag of the strains of deformable particles behind the forces
    deformation_lag: "J",
    /// Lost (negative: made) by forces that strain deformable particles without feeling it
    deformation_other: "J",
    /// Work of prescribed motion, walls, and cell
    boundary_work: "J",
    /// Work of gravity and given forces
    external_work: "J",
    /// What does not add up
    residual: "J",
    /// Bonds broken so far
    broken: "1",
    /// Bonds whose damage passed the event threshold so far
    damaged: "1",
    /// Bonds and contacts that carry force
    contacts: "1",
    /// Root mean square of net force on free particles over root mean square contact force
    unbalanced: "1",
}

/// Why a run cannot go on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum RunError {
    /// The solver failed.
    #[error(transparent)]
    Solver(#[from] SolverError),
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

/// What [`Simulation::advance`] did.
#[derive(Debug, Clone, PartialEq)]
pub struct Advance {
    /// A sample, if this step was one to take.
    pub sample: Option<Record>,
    /// Rows of the operators that were due: their place in the plan, and their values.
    pub operators: Vec<OperatorRow>,
    /// Bond incidents of the step.
    pub events: Vec<Event>,
    /// The run has ended.
    pub stopped: Option<StopReason>,
}

/// Values of an operator at one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct OperatorRow {
    /// Place of the operator in the plan.
    pub operator: usize,
    /// Time, s.
    pub time: f64,
    /// Steps done.
    pub step: u64,
    /// Values in the order of its quantities.
    pub values: Vec<f64>,
}

/// Indices into [`State::schedule_memory`].
mod memory {
    pub const PEAK: usize = 0;
    pub const BROKEN: usize = 1;
    pub const DAMAGED: usize = 2;
    pub const VIRIAL: usize = 3;
    pub const STOPPED: usize = 12;
    pub const AXIAL: usize = 13;
    pub const COUNT: usize = 15;
}

/// A running simulation.
pub struct Simulation {
    /// The state.
    pub state: State,
    /// The solver.
    pub solver: Solver,
    /// The plan.
    pub schedule: Schedule,
    last: StepReport,
    /// Delaunay cells of the particles at the start, when an operator needs them.
    mesh: OnceLock<Result<Mesh, OperatorError>>,
}

impl Simulation {
    /// Make a simulation run, from the start or from the state of a checkpoint.
    pub fn new(mut state: State, model: Model, schedule: Schedule) -> Result<Self, SolverError> {
        state.schedule_memory.resize(memory::COUNT, 0.0);
        let solver = Solver::new(model, &mut state)?;
        let mut last = StepReport::default();
        last.virial.copy_from_slice(&state.schedule_memory[memory::VIRIAL..memory::STOPPED]);
        Ok(Self { state, solver, schedule, last, mesh: OnceLock::new() })
    }

    /// The report of the last step.
    pub fn last_report(&self) -> &StepReport {
        &self.last
    }

    /// Why the run has ended, if it has.
    pub fn stopped(&self) -> Option<StopReason> {
        StopReason::of_code(self.state.schedule_memory[memory::STOPPED])
    }

    /// Values of the operators that are due, at the positions of which the next step computes the forces.
    fn operators(&mut self) -> Result<Vec<OperatorRow>, RunError> {
        let step = self.state.clock.step;
        if self.schedule.operators.iter().all(|sample| !step.is_multiple_of(sample.interval)) {
            return Ok(Vec::new());
        }
        let forces = self.solver.record(&mut self.state)?;
        let due =
            || self.schedule.operators.iter().enumerate().filter(|(_, sample)| step.is_multiple_of(sample.interval));
        let damage = due().any(|(_, sample)| sample.operator == Operator::DamageTensor);
        let at = Sampled {
            particles: &self.state.particles,
            cell: self.state.cell,
            time: self.state.clock.time(),
            bonds: &if damage { Bonds::of(&self.state) } else { Bonds::default() },
            forces: &forces,
            places: &self.schedule.places,
            mesh: &self.mesh,
            gravity: self.solver.model().gravity,
            plane: self.schedule.plane,
        };
        due()
            .map(|(operator, sample)| {
                let values = sample.evaluate(&at).map_err(|source| RunError::Operator {
                    name: sample.name.clone(),
                    step,
                    source,
                })?;
                Ok(OperatorRow { operator, time: self.state.clock.time(), step, values })
            })
            .collect()
    }

    /// One step; a sample when it is due.
    pub fn advance(&mut self) -> Result<Advance, RunError> {
        let operators = self.operators()?;
        let step = self.state.clock.step;
        let due = step.is_multiple_of(self.schedule.sample_interval);
        let axial = [self.state.schedule_memory[memory::AXIAL], self.state.schedule_memory[memory::AXIAL + 1]];
        self.schedule.loading.act(&self.state, &mut self.solver, &self.last, axial);
        let time = self.state.clock.time();
        let (strain, gauge_strain) = if due {
            (self.schedule.loading.strain(&self.state), self.schedule.loading.gauge_strain(&self.state))
        } else {
            (0.0, 0.0)
        };
        let volume = self.state.cell.map_or(1.0, |cell| cell.volume());
        let report = self.solver.step_with(&mut self.state, due)?;
        let events = self.events(&report, time, step);
        for (_, bond_event) in &report.bond_events {
            self.state.schedule_memory[if bond_event.broke { memory::BROKEN } else { memory::DAMAGED }] += 1.0;
        }
        self.state.schedule_memory[memory::VIRIAL..memory::STOPPED].copy_from_slice(report.virial.as_slice());
        self.state.schedule_memory[memory::AXIAL..].copy_from_slice(&self.schedule.loading.axial_forces(&self.solver));
        let mut stopped = None;
        let sample = due.then(|| {
            let measure = self.schedule.loading.stress(&self.state, &self.solver, &report, volume);
            stop::update_peak(&mut self.state.schedule_memory[memory::PEAK], measure.stress);
            let ledger = &self.state.ledger;
            let kick = &report.kick;
            let contacts: u64 = report.active.iter().sum();
            let net = (kick.net_force_squared / (kick.free_particles.max(1)) as f64).sqrt();
            let contact = (report.force_squared / contacts.max(1) as f64).sqrt();
            let unbalanced = if contact > 0.0 { net / contact } else { 0.0 };
            stopped = self.schedule.stop.reason(
                time,
                strain,
                measure.stress,
                self.state.schedule_memory[memory::PEAK],
                unbalanced,
                self.schedule.loading.reached(&measure) && contact > 0.0,
            );
            Record {
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
            }
        });
        if stopped.is_none() && self.schedule.stop.steps.is_some_and(|limit| self.state.clock.step >= limit) {
            stopped = Some(StopReason::Steps);
        }
        // Kept in the state, so that a run that is killed while its result is written knows that it has ended.
        self.state.schedule_memory[memory::STOPPED] = stopped.map_or(0.0, StopReason::code);
        self.last = report;
        Ok(Advance { sample, operators, events, stopped })
    }

    fn events(&self, report: &StepReport, time: f64, step: u64) -> Vec<Event> {
        report
            .bond_events
            .iter()
            .map(|(_, bond_event)| {
                let total: f64 = bond_event.stored.iter().sum();
                let share = |k: usize| if total > 0.0 { bond_event.stored[k] / total } else { 0.0 };
                let ids = [bond_event.pair.a, bond_event.pair.b].map(|p| self.state.particles.id[p as usize]);
                Event {
                    time,
                    step,
                    id_a: ids[0].min(ids[1]),
                    id_b: ids[0].max(ids[1]),
                    position: bond_event.position,
                    mode_shares: [share(0), share(1), share(2), share(3)],
                    energy: bond_event.energy,
                    damage: bond_event.damage,
                }
            })
            .collect()
    }

    /// How far the run is, 0 to 1, by the condition that is nearest (a drop of stress is not foreseen).
    pub fn progress(&self) -> f64 {
        let stop = &self.schedule.stop;
        let mut share: f64 = 0.0;
        if let Some(steps) = stop.steps {
            share = share.max(self.state.clock.step as f64 / steps as f64);
        }
        if let Some(time) = stop.time {
            share = share.max(self.state.clock.time() / time);
        }
        if let Some(strain) = stop.strain {
            share = share.max(self.schedule.loading.strain(&self.state).abs() / strain);
        }
        share.min(1.0)
    }

    /// Bonds that have not broken.
    pub fn intact_bonds(&self) -> usize {
        self.state
            .bonds
            .iter()
            .map(|block| (0..block.len()).filter(|&k| !block.view(k).flags.has(ContactFlags::BROKEN)).count())
            .sum()
    }
}
