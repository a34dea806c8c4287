//! What a step reports.

use concordem_contact::law::EnergySplit;
use concordem_contact::math::Mat3;

use crate::deformation::DeformationSums;
use crate::forces::BondEvent;
use crate::integrate::KickSums;

/// What a step reports.
#[derive(Debug, Clone, Default)]
pub struct StepReport {
    /// Energies of all contacts, J.
    pub energy: EnergySplit,
    /// `Σ l⊗f` over all particle contacts, J (periodic scenes only).
    pub virial: Mat3,
    /// Sums of the kick.
    pub kick: KickSums,
    /// Number of contacts that carry a force: bonds, unbonded contacts, wall contacts.
    pub active: [u64; 3],
    /// Bond events, each with the index of its block in [`State::bonds`](crate::state::State::bonds).
    pub bond_events: Vec<(usize, BondEvent)>,
    /// `Σ|f|²` over all contacts, N², in steps that sample.
    pub force_squared: f64,
    /// Whether the neighbor list was rebuilt before the forces of this step.
    pub rebuilt: bool,
    /// Evaluations of the contact forces: more than one where strains are iterated.
    pub evaluations: u32,
    /// Sums over deformable particles.
    pub deformation: DeformationSums,
}

impl StepReport {
    /// Whether a bond broke in the step.
    pub fn bonds_broke(&self) -> bool {
        self.bond_events.iter().any(|(_, event)| event.broke)
    }
}
