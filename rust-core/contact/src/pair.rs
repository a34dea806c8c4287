//! The pair of a contact and its flags.

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

/// Periodic image of B, pair coefficients, and flags of a contact.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct ContactFlags {
    /// Index of the pair coefficients in the block of its law.
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
    /// The bits that all `flags` have, in each field; then those that any of them has. Without branches.
    #[inline(always)]
    pub fn all_and_any(flags: &[Self]) -> [Self; 2] {
        let [mut all, mut any] = [u64::MAX, 0];
        for flags in flags {
            let numbers: u64 = bytemuck::cast(*flags);
            all &= numbers;
            any |= numbers;
        }
        [bytemuck::cast(all), bytemuck::cast(any)]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bits are joined field by field: a bit of one field does not reach another.
    #[test]
    fn flags_are_joined_field_by_field() {
        let flags = |row, bits, image| ContactFlags { row, bits, image, padding: 0 };
        let (bonded, active) = (ContactFlags::BONDED, ContactFlags::ACTIVE);
        let [all, any] = ContactFlags::all_and_any(&[
            flags(5, bonded | active, [0, -1, 0]),
            flags(5, active, [0; 3]),
            flags(5, active | ContactFlags::REPORTED, [0; 3]),
        ]);
        assert_eq!(all, flags(5, active, [0; 3]));
        assert_eq!(any, flags(5, bonded | active | ContactFlags::REPORTED, [0, -1, 0]));
        let [all, any] = ContactFlags::all_and_any(&[flags(1, 0, [0; 3]), flags(2, 0, [0; 3])]);
        assert_ne!(all.row, any.row, "other rows");
    }
}
