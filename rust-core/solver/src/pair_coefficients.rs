//! Numbers of the pair coefficients of material pairs.

/// Which pair coefficients of a law apply to which ordered pair of materials, as an index into
/// [`ContactBlock::rows`](crate::state::contacts::ContactBlock::rows).
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct PairCoefficients {
    count: usize,
    rows: Vec<u16>,
}

impl PairCoefficients {
    /// Marks a pair without interaction.
    pub const NONE: u16 = u16::MAX;

    /// Table of `count` materials without any interaction.
    pub fn new(count: usize) -> Self {
        Self { count, rows: vec![Self::NONE; count * count] }
    }

    /// Let a particle A of material `a` and a particle B of material `b` interact with the pair coefficients `row`.
    pub fn set(&mut self, a: u16, b: u16, row: u16) {
        self.rows[a as usize * self.count + b as usize] = row;
    }

    /// Pair coefficients of materials `a`, `b` in this order; `None` if they do not interact.
    pub fn get(&self, a: u16, b: u16) -> Option<u16> {
        self.rows.get(a as usize * self.count + b as usize).copied().filter(|&row| row != Self::NONE)
    }
}
