//! Steps that a device takes in place of the solver.
//!
//! A device takes only steps without an event. An event is: a bond breaks, the pair of a broken bond touches again, an unbonded contact enters
//! the event log, or a contact begins whose stiffness the solver must check. The device discards a step with an event, and the solver takes
//! it. So the rules for events have one definition, and the device needs none of them. The device stops before a step for which the neighbor
//! list may be incomplete.

use concordem_contact::law::EnergySplit;
use concordem_contact::math::{Mat3, Vec3};

use super::{STIFFNESS_INTERVAL, Solver, book, check_finite};
use crate::forces::BondEvent;
use crate::integrate::{Damping, KickSums};
use crate::state::State;
use crate::{DeviceError, SolverError, StepReport};

/// A device that takes steps, with the bits of [`Solver::step`].
pub trait StepDevice: Send + Sync {
    /// What a user calls it.
    fn name(&self) -> String;

    /// Copy the state to the device, with what it needs of model and neighbor list.
    ///
    /// # Errors
    /// The device has too little memory, or fails.
    fn load(&mut self, solver: &Solver, state: &State) -> Result<(), DeviceError>;

    /// Take up to `count` steps from the state on the device; the last of them also sums what a record needs if `sample`.
    ///
    /// # Errors
    /// The device fails.
    fn advance(&mut self, count: u64, sample: bool) -> Result<Stretch, DeviceError>;

    /// Copy the positions (m) from the device.
    ///
    /// # Errors
    /// The device fails.
    fn positions(&mut self, positions: &mut [Vec3]) -> Result<(), DeviceError>;

    /// Copy force (N) and torque (N·m) of the contacts on each particle from the device; those of the last
    /// step that sampled, also after [`Self::load`] of the same particles.
    ///
    /// # Errors
    /// The device fails.
    fn forces(&mut self, forces: &mut [Vec3], torques: &mut [Vec3]) -> Result<(), DeviceError>;

    /// Copy what the steps changed from the device to `state`.
    ///
    /// # Errors
    /// The device fails.
    fn store(&mut self, state: &mut State) -> Result<(), DeviceError>;
}

/// Steps without an event.
#[derive(Debug, Clone, Default)]
pub struct Stretch {
    /// Sums of each step.
    pub steps: Vec<StretchStep>,
    /// Why no more steps were taken.
    pub end: StretchEnd,
}

/// Sums of one step.
#[derive(Debug, Clone, Default)]
pub struct StretchStep {
    /// Energies of all contacts, J; stored energies only in a step that samples.
    pub energy: EnergySplit,
    /// `Σ l⊗f`, J, only in a step that samples.
    pub virial: Mat3,
    /// Sums of the kick that the ledger reads; those of net forces only in a step that samples.
    pub kick: KickSums,
    /// Number of bonds and unbonded contacts with a force, only in a step that samples.
    pub active: [u64; 2],
    /// Sums of the squares of forces (N²) and moments (N²·m²) of the contacts, only in a step that samples.
    pub force_squared: f64,
    /// As `force_squared`.
    pub moment_squared: f64,
    /// Entries of the event log, as in [`StepReport`], in the order of the solver.
    pub bond_events: Vec<(usize, BondEvent)>,
}

/// What [`Solver::step_on`] did.
#[derive(Debug, Default)]
pub struct TakenSteps {
    /// Report of the last step.
    pub report: StepReport,
    /// Number of steps.
    pub count: u64,
    /// Whether the solver must take the next step.
    pub event: bool,
    /// Entries of the event log, each with its step.
    pub bond_events: Vec<(u64, BondEvent)>,
}

/// Why a stretch of steps ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum StretchEnd {
    /// All steps were taken.
    #[default]
    Done,
    /// A particle has used up half of the skin of the neighbor list, or its motion is no longer finite.
    Moved,
    /// The next step has an event: the solver must take it.
    Event,
}

impl Solver {
    /// What of this model or state no device supports; `None` if one can take steps.
    pub fn unsupported_by_devices(&self, state: &State) -> Option<&'static str> {
        let model = &self.model;
        let unsupported = [
            (state.cell.is_some(), "a periodic cell"),
            (!state.walls.is_empty(), "walls"),
            (!state.clumps.is_empty(), "clumps"),
            (!state.particles.loads.is_empty(), "forces on particles"),
            (state.heat.is_some() || model.heat.is_some(), "heat"),
            (model.deformable.is_some(), "deformable particles"),
            (!model.strengths.are_equal(), "strengths that scatter"),
            (model.hydrostatic_strength.is_active(), "a mean stress at which particles fail"),
            (model.mode != concordem_contact::kinematics::MotionMeasure::Finite, "kinematics other than \"finite\""),
            (!matches!(model.damping, Damping::None | Damping::Local { .. }), "damping other than local damping"),
            (!self.owned.is_empty(), "subdomains"),
        ];
        unsupported.into_iter().find_map(|(is, what)| is.then_some(what))
    }

    /// Number of steps that a device may take from now on. The first step is the solver's, because it sets the initial energy, and so
    /// are the steps that check all contacts whose stiffness grows.
    pub fn steps_for_device(&self, state: &State) -> u64 {
        let step = state.clock.step;
        let stiffens = state.contacts.iter().any(|block| block.stiffens());
        let waits = self.targets.is_some() || state.motion.is_some();
        match (state.ledger.started && !waits, self.model.watch_contacts && stiffens) {
            (false, _) => 0,
            (true, false) => u64::MAX,
            (true, true) => step.next_multiple_of(STIFFNESS_INTERVAL) - step,
        }
    }

    /// Positions at the last rebuild of the neighbor list (m) and its skin (m); `None` if no list is needed.
    pub fn neighbor_skin(&self) -> Option<(&[Vec3], f64)> {
        self.verlet.as_ref().map(|verlet| (&verlet.positions[..], verlet.skin))
    }

    /// Particles per tile.
    pub fn tile(&self) -> usize {
        self.tile
    }

    /// Let `device`, which has the present state ([`StepDevice::load`]), take up to `count` steps, and book them. Only ledger and clock of
    /// `state` are then current; [`StepDevice::store`] gives the rest. [`Self::forces`] stay those of the last step of
    /// the solver's own or of [`Self::sample_on`].
    ///
    /// # Errors
    /// The device fails; velocities that are no longer finite; input that the neighbor search rejects.
    pub fn step_on(
        &mut self,
        device: &mut dyn StepDevice,
        state: &mut State,
        count: u64,
        sample: bool,
    ) -> Result<TakenSteps, SolverError> {
        let failed = |step, source: DeviceError| SolverError::Device { step, source };
        let (mut report, mut bond_events) = (StepReport::default(), Vec::new());
        let Stretch { steps, end } = device.advance(count, sample).map_err(|error| failed(state.clock.step, error))?;
        let taken = steps.len() as u64;
        for step in steps {
            let StretchStep { energy, virial, kick, active: [bonds, contacts], force_squared, moment_squared, .. } =
                step;
            let active = [bonds, contacts, 0];
            report =
                StepReport { energy, virial, kick, active, force_squared, moment_squared, ..StepReport::default() };
            bond_events.extend(step.bond_events.into_iter().map(|(_, event)| (state.clock.step, event)));
            book(state, &mut report, [0.0; 2]);
        }
        if end == StretchEnd::Moved {
            device.store(state).map_err(|error| failed(state.clock.step, error))?;
            let speeds = state.particles.velocity.iter().map(Vec3::norm_squared);
            report.kick.max_speed_squared = speeds.fold(0.0, f64::max);
            check_finite(state, &report)?;
            self.rebuild_neighbor_list(state, 0.0)?;
            device.load(self, state).map_err(|error| failed(state.clock.step, error))?;
        }
        Ok(TakenSteps { report, count: taken, event: end == StretchEnd::Event, bond_events })
    }

    /// As [`Self::step_on`] for one step that samples, with the net forces of that step as [`Self::forces`]. `None` if the solver must take it.
    ///
    /// # Errors
    /// Those of [`Self::step_on`].
    pub fn sample_on(
        &mut self,
        device: &mut dyn StepDevice,
        state: &mut State,
    ) -> Result<Option<TakenSteps>, SolverError> {
        let taken = self.step_on(device, state, 1, true)?;
        if taken.count == 0 {
            return Ok(None);
        }
        let (forces, torques) = (&mut self.force, &mut self.torque);
        device.forces(forces, torques).map_err(|source| SolverError::Device { step: state.clock.step, source })?;
        Ok(Some(taken))
    }
}
