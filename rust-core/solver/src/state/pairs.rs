//! Bonds that broke.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::Reference;
pub use concordem_contact::pair::{ContactFlags, Pair};

/// A bond that broke. It is no longer in a block; the damage operator counts it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BrokenBond {
    /// Index of its block in [`State::bonds`](super::State::bonds).
    pub block: u16,
    /// Its particles.
    pub pair: Pair,
    /// Image of B, as [`ContactFlags::image`].
    pub image: [i8; 3],
    /// Reference length and area.
    pub reference: Reference,
    /// Normal and length at the break.
    pub previous: PreviousGeometry,
    /// Whether it never had strength, as a bond of an open joint: it came apart, but nothing broke.
    pub open: bool,
}
