//! The servo of a periodic cell: strain rates that bring its stress to a target.
//!
//! The strain follows the error of the stress through the gain `g`, so a cell of the stiffness `C` removes the share `g C Δt` of the error in
//! a step. The stress is known one step late: the cell oscillates from a share of 1/4 on, and its oscillation grows from 1 on. Vibrations of
//! particles about the mean motion do not change this: work of the servo on them is positive at all frequencies below `π/3Δt`. So the gain is
//! bounded by the stiffness, of which `Σ k l²/V` over all contacts is an upper bound.
//!
//! Bonds keep their stiffness, so the largest one so far counts. Contacts of loose particles soften as they open, without end: a gain for the
//! pressure of the start would stand still at a thousandth of it. So there the present stiffness counts, and at least the one that the contacts
//! have under the target, with which particles that meet again are not met too fast.

use concordem_contact::law::{ContactGeometry, Stiffness};
use concordem_contact::math::Mat3;
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactFlags;
use concordem_solver::{Solver, StepReport};

use super::loading::Loading;

/// With a target stress of zero, the reference is the stress at this strain.
const ZERO_STRESS_STRAIN: f64 = 1e-4;

/// Largest fraction of the error that the servo removes in one step. The stress is known one step late, so at 1 the servo would oscillate.
const SERVO_STEP: f64 = 0.1;

/// The same for a servo of a cell whose other axes follow a strain rate: it must follow quickly. The bound on the stiffness is some three
/// to five times the stiffness, so the servo removes a tenth of the error.
const SERVO_DRIVEN_STEP: f64 = 0.3;

/// Share of the servo's rate by which its lasting rate changes in each step, if other axes of the cell follow a strain rate. With the
/// gain alone, the stress of a specimen that moves at a constant rate would differ from the target by this rate over the gain; with
/// the lasting rate the difference vanishes within some 1/0.02 steps (proportional and integral control). A fifth of the share of the
/// error that the gain removes in a step, so that the two together are damped nearly critically.
const SERVO_LASTING: f64 = 0.02;

/// Error of the stress, relative to the reference, above which the lasting rate does not change faster, so that a servo which starts far
/// from its target does not overshoot.
const SERVO_NEAR: f64 = 0.1;

/// Steps between two looks at the stiffness, which grows where particles come into contact. A look costs about as much as a step.
const LOOK: u64 = 64;

/// Step of the first look: not one in which particles may be wrapped, whose contacts are found anew.
const FIRST_LOOK: u64 = 32;

/// What the servo remembers, a part of the state.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct CellServoMemory {
    /// The lasting rate, 1/s; symmetric.
    lasting: Mat3,
    /// Stiffness of the cell, Pa: the largest so far, or of loose particles the present one.
    stiffness: f64,
}

impl CellServoMemory {
    /// Number of values that hold it in the state.
    pub(super) const LENGTH: usize = 9;

    /// Place of the stiffness among them.
    pub(super) const STIFFNESS: usize = 6;

    /// Places of the components of the symmetric rate in its six values.
    const COMPONENTS: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1)];

    fn read(memory: &[f64; Self::LENGTH]) -> Self {
        let mut lasting = Mat3::zeros();
        for (k, (i, j)) in Self::COMPONENTS.into_iter().enumerate() {
            (lasting[(i, j)], lasting[(j, i)]) = (memory[k], memory[k]);
        }
        Self { lasting, stiffness: memory[Self::STIFFNESS] }
    }

    fn write(&self, memory: &mut [f64; Self::LENGTH]) {
        for (k, at) in Self::COMPONENTS.into_iter().enumerate() {
            memory[k] = self.lasting[at];
        }
        memory[Self::STIFFNESS] = self.stiffness;
    }
}

/// The stiffness of the cell after a step, Pa, if it is time to look at it. Loose particles may press on each other from the first step on.
fn stiffness_now(state: &State) -> Option<f64> {
    let step = state.clock.step;
    let is_time = step % LOOK == FIRST_LOOK || step == 1 && state.bonds.is_empty();
    is_time.then(|| stiffness_of_contacts(state))
}

/// Gap, relative to the distance of the centers, up to which two particles touch: positions in files have some ten digits.
const TOUCHING: f64 = 1e-9;

/// What contacts of loose particles will do under a pressure.
struct Pressed {
    /// Upper bound of the stiffness of the cell, Pa.
    stiffness: f64,
    /// Mean share of the distance of their centers by which particles that touch now must move.
    strain: f64,
    /// Longest period in which two particles swing against each other, s.
    period: f64,
}

impl Pressed {
    /// Of the candidates in a cell under the pressure `p`, Pa: each carries the force f of `Σ f l = 3 V p`. Fewer contacts carry more, but are
    /// softer together. `None` without candidates.
    fn of(state: &State, pressure: f64) -> Option<Self> {
        let (cell, block, particles) = (state.cell.as_ref()?, state.contacts.as_ref()?.contacts(), &state.particles);
        let length = |k: usize| {
            let view = block.view(k);
            let [a, b] = [view.pair.a, view.pair.b].map(|p| particles.position[p as usize]);
            (b + cell.shift(view.flags.image) - a).norm()
        };
        let lengths: f64 = (0..block.len()).map(length).sum();
        if lengths <= 0.0 {
            return None;
        }
        let force = 3.0 * cell.volume() * pressure / lengths;
        let (mut sum, mut moved, mut touching, mut period) = (0.0, 0.0, 0.0, 0.0_f64);
        for k in 0..block.len() {
            let view = block.view(k);
            let (a, b) = (view.pair.a as usize, view.pair.b as usize);
            let length = length(k);
            let reach = particles.radius[a] + particles.radius[b];
            let geometry = ContactGeometry {
                reference_length: reach,
                area: 0.0,
                radius_a: particles.radius[a],
                radius_b: particles.radius[b],
                mass_a: particles.mass[a],
                mass_b: particles.mass[b],
            };
            let overlap = block.overlap_under(view.flags.row, &geometry, force);
            let factor = block.largest_factor(particles.material[a], particles.material[b]);
            let Stiffness { normal, shear, .. } = block.compressed(view.flags.row, &geometry, overlap).times(factor);
            sum += normal.max(shear) * (length * length);
            if normal > 0.0 {
                period = period.max(std::f64::consts::TAU * (geometry.reduced_mass() / normal).sqrt());
            }
            if length < reach * (1.0 + TOUCHING) {
                moved += (reach - length - overlap).abs() / length;
                touching += 1.0;
            }
        }
        let strain = if touching > 0.0 { moved / touching } else { 0.0 };
        Some(Self { stiffness: sum / cell.volume(), strain, period })
    }
}

/// Ratio of the upper bound of the stiffness of a cell to its stiffness, at most.
const STIFFER: f64 = 10.0;

/// Periods of its contacts in which a cell of loose particles comes to rest. In `make servos`, runs of 84 periods ended off their target where
/// those of 123 were in equilibrium: what a cell stores at its first pressure becomes motion, and the last contacts hardly hold it.
const SETTLING: f64 = 100.0;

/// Ratio of the strain of a cell of loose particles to that of its contacts, at most: they roll and slide, too.
const LOOSER: f64 = 2.0;

/// `Σ k l²/V` over the bonds, and the contacts that touched in the last step, Pa: an upper bound of the stiffness of the cell. Candidates that did not
/// touch are left out, because they depend on the step at which the neighbor list was built.
fn stiffness_of_contacts(state: &State) -> f64 {
    let (Some(cell), particles) = (&state.cell, &state.particles) else { return 0.0 };
    let mut sum = 0.0;
    for block in state.bonds.iter().chain(&state.contacts).map(|block| block.contacts()) {
        for k in 0..block.len() {
            let view = block.view(k);
            let (a, b) = (view.pair.a as usize, view.pair.b as usize);
            let length = block.previous().get(k).length;
            let overlap = particles.radius[a] + particles.radius[b] - length;
            let bonded = view.flags.has(ContactFlags::BONDED);
            if view.flags.has(ContactFlags::BROKEN) || !bonded && overlap <= 0.0 {
                continue;
            }
            let stiffness = if bonded || overlap <= 0.0 {
                block.stiffness(k, particles, false)
            } else {
                block.stiffness_at(k, particles, false, overlap)
            };
            let factor = block.largest_factor(particles.material[a], particles.material[b]);
            let Stiffness { normal, shear, .. } = stiffness.times(factor);
            sum += normal.max(shear) * (length * length);
        }
    }
    sum / cell.volume()
}

impl Loading {
    /// Sets the velocity gradient of the cell for the coming step, if a servo drives it. `factor`: see [`Self::apply`]; `memory`: a
    /// [`CellServoMemory`].
    pub(super) fn apply_to_cell(
        &self,
        state: &State,
        solver: &mut Solver,
        last: &StepReport,
        (factor, by_stress): (f64, bool),
        memory: &mut [f64; CellServoMemory::LENGTH],
    ) {
        let (Self::CellStress { stress, strain_rate, maximum_rate, reference, stiffness, .. }, Some(cell)) =
            (self, &state.cell)
        else {
            return;
        };
        let mut remembered = CellServoMemory::read(memory);
        let gain = self.gain(stiffness.max(remembered.stiffness), state.clock.dt);
        let driven = self.driven(by_stress);
        let is_driven = driven.contains(&true);
        // The factor belongs to the strain rates, if there are any.
        let target = if is_driven { *stress } else { stress * factor };
        let error = target - last.virial / cell.volume();
        let rate = (error + error.transpose()) * (0.5 * gain);
        let most = gain * SERVO_NEAR * reference;
        let change = rate.map(|r| SERVO_LASTING * r.clamp(-most, most));
        remembered.lasting = if is_driven {
            (remembered.lasting + change).map(|r| r.clamp(-maximum_rate, *maximum_rate))
        } else {
            Mat3::zeros()
        };
        let mut rate = (rate + remembered.lasting).map(|r| r.clamp(-maximum_rate, *maximum_rate));
        for axis in (0..3).filter(|&axis| driven[axis]) {
            rate[(axis, axis)] = strain_rate[axis].unwrap_or(0.0) * factor;
            remembered.lasting[(axis, axis)] = 0.0;
        }
        remembered.write(memory);
        solver.set_velocity_gradient(cell, rate);
    }

    /// Gain of the servo of a cell of this stiffness (Pa), strain rate divided by the error of the stress, 1/(Pa·s): the full rate until a
    /// tenth of the target is missing, less where the cell would overshoot.
    fn gain(&self, stiffness: f64, dt: f64) -> f64 {
        let Self::CellStress { stress, strain_rate, maximum_rate, reference, .. } = self else { return 0.0 };
        let wanted = maximum_rate / (SERVO_NEAR * reference);
        if stiffness <= 0.0 {
            return wanted;
        }
        let driven = *stress != Mat3::zeros() && strain_rate.iter().any(Option::is_some);
        wanted.min(if driven { SERVO_DRIVEN_STEP } else { SERVO_STEP } / (stiffness * dt))
    }

    /// Errors of the stresses that the servo of a cell controls after a step, relative to the largest target; `None` for axes that follow a
    /// strain rate.
    pub(super) fn cell_errors(
        &self,
        state: &State,
        report: &StepReport,
        (factor, by_stress): (f64, bool),
    ) -> Option<[f64; 6]> {
        let (Self::CellStress { stress, reference, .. }, Some(cell)) = (self, &state.cell) else { return None };
        let driven = self.driven(by_stress);
        let target = if driven.contains(&true) { *stress } else { stress * factor };
        let error = target - report.virial / cell.volume();
        Some(
            CellServoMemory::COMPONENTS.map(|(i, j)| {
                if i == j && driven[i] { 0.0 } else { 0.5 * (error[(i, j)] + error[(j, i)]) / reference }
            }),
        )
    }

    /// The stiffness of the cell to remember after a step, Pa, if it is time to look at it; `remembered`: of the last look.
    pub(super) fn look(&self, state: &State, remembered: f64) -> Option<f64> {
        let Self::CellStress { stiffness, .. } = self else { return None };
        // Without contacts at the start, nothing bounds the gain where particles meet again.
        let follows = state.bonds.is_empty() && *stiffness > 0.0;
        stiffness_now(state).map(|now| if follows { now } else { remembered.max(now) })
    }

    /// Gives a servo of a cell the stiffness of the cell and the strain that it needs, from the state before the first step with its candidates as
    /// contacts; also the reference of a target of zero. `of_contacts`: `Σ k l²` of their largest stiffnesses, J.
    pub(crate) fn tune(&mut self, state: &State, of_contacts: f64) {
        let (Self::CellStress { stress, reference, stiffness, strain, settling, tolerance, .. }, Some(cell)) =
            (self, &state.cell)
        else {
            return;
        };
        *stiffness = of_contacts / cell.volume();
        if *stiffness <= 0.0 {
            return;
        }
        if *stress == Mat3::zeros() {
            *reference = ZERO_STRESS_STRAIN * *stiffness;
        }
        let pressed = if state.bonds.is_empty() { Pressed::of(state, *reference) } else { None };
        *strain = match pressed {
            Some(pressed) => {
                (*stiffness, *settling) = (pressed.stiffness, SETTLING * pressed.period);
                LOOSER * pressed.strain
            }
            None => STIFFER * (1.0 - *tolerance) * stress.abs().max() / *stiffness,
        };
    }

    /// Time in which a servo brings a cell to its target at the largest rate, at most, s. `None` without a servo, without contacts at the start,
    /// and where other axes follow a strain rate.
    pub(crate) fn approach(&self) -> Option<f64> {
        let Self::CellStress { strain_rate, maximum_rate, strain, .. } = self else { return None };
        let undriven = strain_rate.iter().all(Option::is_none);
        (undriven && *strain > 0.0).then(|| strain / maximum_rate)
    }

    /// Time in which a cell of loose particles comes to rest under its target, s. `None` as for [`Self::approach`], and with bonds.
    pub(crate) fn settling(&self) -> Option<f64> {
        let Self::CellStress { strain_rate, settling, .. } = self else { return None };
        (strain_rate.iter().all(Option::is_none) && *settling > 0.0).then_some(*settling)
    }
}
