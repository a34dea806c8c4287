//! Numbers of the pair coefficients of material pairs.

/// Which pair coefficients of a law apply to which ordered pair of materials, as an index into
/// [`ContactBlock::rows`](crate::state::contacts::ContactBlock::rows).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PairCoefficients {
    count: usize,
    rows: Vec<u16>,
    /// By material: between two aggregates of this material.
    apart: Vec<u16>,
}

impl PairCoefficients {
    /// Marks a pair without interaction.
    pub const NONE: u16 = u16::MAX;

    /// Table of `count` materials without any interaction.
    pub fn new(count: usize) -> Self {
        Self { count, rows: vec![Self::NONE; count * count], apart: vec![Self::NONE; count] }
    }

    /// Let a particle A of material `a` and a particle B of material `b` interact with the pair coefficients `row`.
    pub fn set(&mut self, a: u16, b: u16, row: u16) {
        self.rows[a as usize * self.count + b as usize] = row;
    }

    /// Let particles of the materials `a` and `b` not interact.
    pub fn remove(&mut self, a: u16, b: u16) {
        self.set(a, b, Self::NONE);
        self.set(b, a, Self::NONE);
    }

    /// Let two aggregates of `material` interact with the pair coefficients `row`, instead of those within the material.
    pub fn set_apart(&mut self, material: u16, row: u16) {
        self.apart[material as usize] = row;
    }

    /// Pair coefficients of a bond between two particles by their materials and the numbers of their aggregates (0: none).
    pub fn of_bond(&self, [a, b]: [u16; 2], aggregates: [u32; 2]) -> Option<u16> {
        let two = a == b && aggregates[0] != aggregates[1] && !aggregates.contains(&0);
        let apart = self.apart.get(a as usize).copied().filter(|&row| two && row != Self::NONE);
        apart.or_else(|| self.get(a, b))
    }

    /// Pair coefficients of materials `a`, `b` in this order; `None` if they do not interact.
    pub fn get(&self, a: u16, b: u16) -> Option<u16> {
        self.rows.get(a as usize * self.count + b as usize).copied().filter(|&row| row != Self::NONE)
    }
}
