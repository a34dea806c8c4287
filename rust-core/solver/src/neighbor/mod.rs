//! Neighbor list: candidate pairs, the Verlet criterion for how long they stay complete, and the spatial order that
//! keeps neighbors close to each other in memory.

mod grid;
mod order;
mod verlet;

#[cfg(test)]
mod tests;

pub use grid::{CandidatePair, candidate_pairs, candidate_pairs_with_others};
pub use order::{hilbert, spatial_order};
pub use verlet::VerletList;

use crate::state::Cell;
use concordem_contact::math::{Mat3, Vec3};

/// Why the neighbor search rejects its input.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NeighborError {
    /// A coordinate is NaN or infinite.
    #[error("particle {index} has the position ({x}, {y}, {z}) m, which is not finite")]
    PositionNotFinite {
        /// Index of the particle.
        index: usize,
        /// Its coordinates, m.
        x: f64,
        /// Its coordinates, m.
        y: f64,
        /// Its coordinates, m.
        z: f64,
    },
    /// A reach is NaN, infinite, or negative.
    #[error("particle {index} has the reach {reach} m; it must be finite and not negative")]
    BadReach {
        /// Index of the particle.
        index: usize,
        /// Its reach, m.
        reach: f64,
    },
    /// Different numbers of positions and reaches.
    #[error("{positions} positions but {reaches} reaches")]
    LengthMismatch {
        /// Number of positions.
        positions: usize,
        /// Number of reaches.
        reaches: usize,
    },
    /// More particles than 32-bit indices can count.
    #[error("{count} particles; at most 4294967295 can be indexed")]
    TooManyParticles {
        /// Number of particles.
        count: usize,
    },
    /// More pairs than the memory holds.
    #[error("the memory does not suffice for {count} pairs of near particles, {:.1} GB; give them a smaller reach", *bytes as f64 * 1e-9)]
    Memory {
        /// Number of pairs, at least.
        count: usize,
        /// Memory for them, bytes.
        bytes: usize,
    },
    /// The cell has no volume, or its matrix is not finite.
    #[error("the periodic cell with the edge vectors {edges:?} m has no volume")]
    FlatCell {
        /// Edge vectors, m.
        edges: [[f64; 3]; 3],
    },
    /// The cell is so thin compared with the reach that image numbers would leave their range.
    #[error(
        "particle {index} with the reach {reach} m sees more than 127 images of itself in the periodic cell, whose \
         faces {axis} lie {width} m apart"
    )]
    CellTooThin {
        /// Particle with the largest reach.
        index: usize,
        /// Its reach, m.
        reach: f64,
        /// Axis of the cell (0, 1, 2).
        axis: usize,
        /// Distance of the two faces, m.
        width: f64,
    },
    /// Positions so far from a periodic cell that wrapping them into it loses the sizes of the particles.
    #[error(
        "a position lies {distance:e} m from the periodic cell, where a reach of {reach:e} m is lost in rounding: at most \
         {limit:e} m are possible. Check what flies away, or wrap the positions into the cell"
    )]
    TooFar {
        /// Largest coordinate, m.
        distance: f64,
        /// Smallest reach, m.
        reach: f64,
        /// Largest possible coordinate for this reach, m.
        limit: f64,
    },
    /// A pair is so many cells apart that its image number does not fit into −128…127.
    #[error(
        "particles {a} and {b} touch across ({}, {}, {}) periods of the cell; at most 127 are possible: wrap the \
         positions into the cell",
        image[0], image[1], image[2]
    )]
    ImageOutOfRange {
        /// First particle.
        a: u32,
        /// Second particle.
        b: u32,
        /// Cell index of the image of B that A sees.
        image: [f64; 3],
    },
}

/// A valid periodic cell, its inverse and its widths.
#[derive(Debug, Clone, Copy)]
struct Lattice {
    cell: Cell,
    inverse: Mat3,
    /// Distances between opposite faces, m.
    widths: Vec3,
}

impl Lattice {
    fn new(cell: &Cell) -> Result<Self, NeighborError> {
        let h = cell.matrix;
        let edge = |k: usize| h.column(k).into_owned();
        let flat = || NeighborError::FlatCell { edges: [edge(0).into(), edge(1).into(), edge(2).into()] };
        let volume = cell.volume();
        let box_volume = edge(0).norm() * edge(1).norm() * edge(2).norm();
        // Below this fraction of the volume of a box with the same edge lengths the inverse has no correct digits.
        let smallest = 1.0e-12 * box_volume;
        if !(volume.is_finite() && volume > smallest) {
            return Err(flat());
        }
        let inverse = h.try_inverse().ok_or_else(flat)?;
        let face = |i: usize, j: usize| edge(i).cross(&edge(j)).norm();
        let widths = Vec3::new(volume / face(1, 2), volume / face(2, 0), volume / face(0, 1));
        Ok(Self { cell: *cell, inverse, widths })
    }

    /// Index of the cell in which a position lies, as whole numbers.
    fn cell_of(&self, position: &Vec3) -> Vec3 {
        (self.inverse * position).map(f64::floor)
    }

    /// The position's image in the cell at the origin.
    fn wrapped(&self, position: &Vec3) -> Vec3 {
        position - self.cell.matrix * self.cell_of(position)
    }
}

fn first_position_not_finite(positions: &[Vec3]) -> Option<NeighborError> {
    use rayon::prelude::*;
    positions.par_iter().position_first(|p| !p.iter().all(|c| c.is_finite())).map(|index| {
        let p = positions[index];
        NeighborError::PositionNotFinite { index, x: p.x, y: p.y, z: p.z }
    })
}

/// Typical low and high coordinates of the positions along each axis: the 2nd and 98th percentiles of a fixed sample.
///
/// A few distant particles then do not affect the choice of a grid. Infinite and NaN entries are skipped.
fn typical_bounds(positions: &[Vec3]) -> (Vec3, Vec3) {
    const SAMPLE: usize = 4096;
    let stride = positions.len().div_ceil(SAMPLE).max(1);
    let (mut low, mut high) = (Vec3::zeros(), Vec3::zeros());
    for axis in 0..3 {
        let mut values: Vec<f64> =
            positions.iter().step_by(stride).map(|p| p[axis]).filter(|value| value.is_finite()).collect();
        values.sort_unstable_by(f64::total_cmp);
        if let Some(last) = values.len().checked_sub(1) {
            low[axis] = values[last / 50];
            high[axis] = values[last - last / 50];
        }
    }
    (low, high)
}
