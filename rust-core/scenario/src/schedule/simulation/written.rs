//! Motions that a caller writes to the state between steps, and the energy ledger.

use super::memory;
use concordem_contact::math::Vec3;
use concordem_solver::energy::Ledger;
use concordem_solver::state::State;

/// What a caller may write to between steps, as it was after the last step.
#[derive(Debug, Clone, PartialEq)]
pub struct Written {
    position: Vec<Vec3>,
    velocity: Vec<Vec3>,
    angular_velocity: Vec<Vec3>,
}

impl Written {
    /// The motion of a state.
    pub fn of(state: &State) -> Self {
        let particles = &state.particles;
        Self {
            position: particles.position.clone(),
            velocity: particles.velocity.clone(),
            angular_velocity: particles.angular_velocity.clone(),
        }
    }

    /// Books what a caller has written since. The change of the kinetic energy is external work. Other positions have energies that no motion
    /// connects with those before: the balance starts anew with the next step. Velocities of members of clumps have no effect. A
    /// component that is prescribed by a constant goes on as it was written. Before the first step there is nothing to book: that step takes the energies of the start as they are.
    pub fn book(&self, state: &mut State) {
        if !state.ledger.started {
            return;
        }
        let particles = &state.particles;
        if particles.position != self.position {
            state.ledger = Ledger::default();
            memory::forget_turnover(&mut state.schedule_memory);
            return;
        }
        let mut work = 0.0;
        for p in (0..particles.len()).filter(|&p| particles.clump[p] == u32::MAX) {
            let (v, w) = (&particles.velocity[p], &particles.angular_velocity[p]);
            let (old_v, old_w) = (&self.velocity[p], &self.angular_velocity[p]);
            work += 0.5 * particles.mass[p] * (v - old_v).dot(&(v + old_v));
            work += 0.5 * particles.inertia[p] * (w - old_w).dot(&(w + old_w));
        }
        state.ledger.external_work.add(work);
    }
}
