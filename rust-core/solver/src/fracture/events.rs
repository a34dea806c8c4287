//! The event log: bonds that broke or were damaged.

use concordem_contact::math::Vec3;

/// A bond broke, or its damage exceeded the threshold of the event log.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Event {
    /// Time, s, as in records.
    pub time: f64,
    /// Number of steps done before.
    pub step: u64,
    /// Stable id of particle A.
    pub id_a: u32,
    /// Stable id of particle B, or of the wall.
    pub id_b: u32,
    /// Contact point, m.
    pub position: Vec3,
    /// Fractions of normal, shear, bending, and twist deformation in the energy stored before the event; their sum is 1, or
    /// 0 if no energy was stored.
    pub mode_shares: [f64; 4],
    /// Whether shear made the bond fail, where its law has a criterion of shear besides one of tension.
    pub in_shear: bool,
    /// Energy dissipated by damage of the contact in this step, J; for a broken bond including the energy it still stored.
    pub energy: f64,
    /// Damage after the event: 0 intact, 1 without strength.
    pub damage: f64,
    /// Number of the table of the joint that the bond lies across, from 0; `None` off joints.
    pub joint: Option<u16>,
}
