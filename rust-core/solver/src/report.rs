//! Result of one step.

use concordem_contact::law::EnergySplit;
use concordem_contact::math::Mat3;

use crate::deformation::DeformationSums;
use crate::evaluation::{BegunContact, BondEvent};
use crate::integrate::KickSums;
use crate::state::contacts::Pair;

/// Sums, counts, and events of one step.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Energies of all contacts, J.
    pub energy: EnergySplit,
    /// `Σ l⊗f` over all particle contacts, J (periodic scenes only).
    pub virial: Mat3,
    /// Sums of the kick.
    pub kick: KickSums,
    /// Number of contacts with a force: bonds, unbonded contacts, wall contacts.
    pub active: [u64; 3],
    /// Bond events, each with the index of its block in [`State::bonds`](crate::state::State::bonds).
    pub bond_events: Vec<(usize, BondEvent)>,
    /// Unbonded contacts between particles that opened.
    pub opened: Vec<Pair>,
    /// Unbonded contacts between particles, and those with walls, that began under laws whose stiffness grows with the overlap.
    pub begun: [Vec<BegunContact>; 2],
    /// `Σ|f|²` over all contacts, N², in steps that sample.
    pub force_squared: f64,
    /// `Σ|m|²` of the moments that contacts transmit, N²·m², in steps that sample.
    pub moment_squared: f64,
    /// Whether the neighbor list was rebuilt before the forces of this step.
    pub rebuilt: bool,
    /// Evaluations of the contact forces: more than one where strains are iterated.
    pub evaluations: u32,
    /// Work of the thermal expansion of bonds over the half steps before and after the present instant, J.
    pub expansion: [f64; 2],
    /// Work of the change of stiffness with the temperature, J.
    pub stiffness_work: f64,
    /// Energy that contacts dissipated by damage, friction, and dashpots, J, if it becomes heat; at walls, twice the same particle.
    pub dissipated: Vec<(Pair, f64)>,
    /// Kinetic energy of the mean motion of a periodic cell, J, which [`Ledger::kinetic`](crate::energy::Ledger::kinetic) contains, in steps
    /// that sample.
    pub affine_kinetic: f64,
    /// Sums over deformable particles.
    pub deformation: DeformationSums,
}

impl StepReport {
    /// Distance from equilibrium of forces and moments: the larger one of
    ///
    /// `F_net/F` and `M_net/(r F + M)`
    ///
    /// with the root mean squares of the net force `F_net` and the net moment `M_net` over the free components of the bodies,
    /// of the contact forces `F`, and of the moments `M` that contacts transmit, and the radius `r` of the particles (m) as
    /// arm of the forces. 0 without contact forces.
    ///
    /// With forces alone, a twisted beam, or a lattice that only rotations can relax, would seem to be in equilibrium
    /// at once.
    pub fn unbalanced(&self, radius: f64) -> f64 {
        let root = |squared: f64, count: u64| (squared / count.max(1) as f64).sqrt();
        let contacts: u64 = self.active.iter().sum();
        let (force, moment) = (root(self.force_squared, contacts), root(self.moment_squared, contacts));
        let ratio = |net: f64, carried: f64| if carried > 0.0 { net / carried } else { 0.0 };
        let kick = &self.kick;
        let of_forces = ratio(root(kick.net_force_squared, kick.free_particles), force);
        of_forces.max(ratio(root(kick.net_torque_squared, kick.free_rotations), radius * force + moment))
    }

    /// Root mean square of the contact forces, N, in steps that sample.
    pub fn contact_force(&self) -> f64 {
        (self.force_squared / self.active.iter().sum::<u64>().max(1) as f64).sqrt()
    }

    /// Whether a bond broke in the step.
    pub fn bonds_broke(&self) -> bool {
        self.bond_events.iter().any(|(_, event)| event.broke)
    }
}
