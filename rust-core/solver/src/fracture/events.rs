//! The event log: what broke, when, where, how, and at what cost.

use concordem_contact::math::Vec3;

/// A contact crossed the damage threshold of the event log, or broke.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time at which it was found, s, as that of samples.
    pub time: f64,
    /// Count of steps done before.
    pub step: u64,
    /// Stable id of particle A.
    pub id_a: u32,
    /// Stable id of particle B, or of the wall.
    pub id_b: u32,
    /// Contact point, m.
    pub position: Vec3,
    /// Shares of normal, shear, bending, and twist deformation in the energy that was stored before the event; their
    /// sum is 1, or 0 when nothing was stored.
    pub mode_shares: [f64; 4],
    /// Energy dissipated by damage of the contact in this step, J; of a bond that broke, with what it still stored.
    pub energy: f64,
    /// Damage after the event: 0 intact, 1 without strength.
    pub damage: f64,
}
