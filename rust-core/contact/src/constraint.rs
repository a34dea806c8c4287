//! Prescribed degrees of freedom of a particle.

/// Degrees of freedom of a particle that keep a prescribed velocity, whatever the forces.
///
/// Bits 0–2: translation along x, y, z; bits 3–5: rotation about x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Hash, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(transparent)]
pub struct Constraint(pub u8);

impl Constraint {
    /// No constraint.
    pub const FREE: Self = Self(0);
    /// All three translations.
    pub const TRANSLATION: Self = Self(0b000_111);
    /// Keeps a disc in its plane: translation along z, rotations about x and y.
    pub const OUT_OF_PLANE: Self = Self(0b011_100);
    /// Translations in the plane.
    pub const IN_PLANE: Self = Self(0b000_011);
    /// All three rotations.
    pub const ROTATION: Self = Self(0b111_000);
    /// All six degrees of freedom.
    pub const ALL: Self = Self(0b111_111);

    /// Whether translation along `axis` (0, 1, 2) is prescribed.
    #[inline]
    pub fn translation(self, axis: usize) -> bool {
        self.0 >> axis & 1 == 1
    }

    /// Whether any degree of freedom of `of` is prescribed.
    #[inline(always)]
    pub fn any(self, of: Self) -> bool {
        self.0 & of.0 != 0
    }

    /// Whether rotation about `axis` (0, 1, 2) is prescribed.
    #[inline]
    pub fn rotation(self, axis: usize) -> bool {
        self.0 >> (3 + axis) & 1 == 1
    }

    /// Union of both constraints.
    #[must_use]
    pub fn with(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Translation along `axis` (0, 1, 2).
    pub fn translation_along(axis: usize) -> Self {
        Self(1 << axis)
    }
}
