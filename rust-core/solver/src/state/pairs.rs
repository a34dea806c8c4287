//! The pair of a contact, its flags, and bonds that broke.

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::law::Reference;

/// The two particles of a contact by index, `a ≤ b` (equal only for a particle and its own periodic image). In a block
/// of wall contacts `b` is the wall element.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Pair {
    /// Particle A.
    pub a: u32,
    /// Particle B, or wall element.
    pub b: u32,
}

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
}

/// Periodic image of B, pair coefficients, and flags of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ContactFlags {
    /// Index of the pair coefficients in [`ContactBlock::rows`](super::contacts::ContactBlock::rows).
    pub row: u16,
    /// Union of [`ContactFlags::BONDED`] and the other constants.
    pub bits: u8,
    /// B is seen at `x_B + H·image`.
    pub image: [i8; 3],
    /// Unused, zero.
    pub padding: u16,
}

impl ContactFlags {
    /// Created at bonding: cohesive.
    pub const BONDED: u8 = 1;
    /// Has history: a bond, or an unbonded contact that touches.
    pub const ACTIVE: u8 = 2;
    /// Broke; has no force and is removed at the next rebuild of the neighbor list.
    pub const BROKEN: u8 = 4;
    /// An unbonded contact whose reference length was kept from a broken bond.
    pub const KEPT_REFERENCE: u8 = 8;
    /// Damage exceeded the event threshold and is in the event log.
    pub const REPORTED: u8 = 16;
    /// Evaluated for B alone: A belongs to another subdomain of a distributed host, which counts the energies of the
    /// contact.
    pub const NOT_OWNED: u8 = 32;

    /// Whether the contact has a force: active and not broken.
    #[inline(always)]
    pub fn carries(self) -> bool {
        self.bits & (Self::ACTIVE | Self::BROKEN) == Self::ACTIVE
    }
    /// Whether all of `bits` are set.
    #[inline(always)]
    pub fn has(self, bits: u8) -> bool {
        self.bits & bits == bits
    }
}
