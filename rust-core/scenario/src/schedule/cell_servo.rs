//! The servo of a periodic cell: strain rates that bring its stress to a target.
//!
//! The strain follows the error of the stress through the gain `g`, so a cell of the stiffness `C` removes the share `g C Δt` of the error in
//! a step. The stress is known one step late: the cell oscillates from a share of 1/4 on, and its oscillation grows from 1 on. Vibrations of
//! particles about the mean motion do not change this: work of the servo on them is positive at all frequencies below `π/3Δt`. So the gain is
//! bounded by the stiffness, of which `Σ k l²/V` over all contacts is an upper bound.

use concordem_contact::law::Stiffness;
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
    /// Largest stiffness of the cell so far, Pa.
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

/// The stiffness of the cell after a step, Pa, if it is time to look at it.
pub(super) fn stiffness_now(state: &State) -> Option<f64> {
    (state.clock.step % LOOK == FIRST_LOOK).then(|| stiffness_of_contacts(state))
}

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
        // Without bonds, the bound before the first step is that of deep overlaps of all candidates.
        let loose = state.bonds.is_empty() && remembered.stiffness > 0.0;
        let bound = if loose { remembered.stiffness } else { stiffness.max(remembered.stiffness) };
        let gain = self.gain(bound, state.clock.dt);
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

    /// Gives a servo of a cell the stiffness of the cell before the first step, Pa, and with it the reference of a target of zero.
    pub(crate) fn tune(&mut self, of_cell: f64) {
        let Self::CellStress { stress, reference, stiffness, .. } = self else { return };
        *stiffness = of_cell;
        if of_cell > 0.0 && *stress == Mat3::zeros() {
            *reference = ZERO_STRESS_STRAIN * of_cell;
        }
    }

    /// Shortest time in which a servo can bring a cell without stress to its target, s: at the largest rate, with a cell as stiff as the
    /// upper bound. `None` without a servo, without contacts at the start, and where other axes follow a strain rate.
    pub(crate) fn shortest_approach(&self) -> Option<f64> {
        let Self::CellStress { stress, strain_rate, maximum_rate, tolerance, stiffness, .. } = self else {
            return None;
        };
        let undriven = strain_rate.iter().all(Option::is_none);
        (undriven && *stiffness > 0.0).then(|| (1.0 - tolerance) * stress.abs().max() / (stiffness * maximum_rate))
    }
}
