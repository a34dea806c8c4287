//! How long a list of candidate pairs stays complete.

use rayon::prelude::*;

use crate::state::Cell;
use concordem_contact::math::{Mat3, Vec3};

/// Positions at the last neighbor-list rebuild. Its search used an extra distance, the skin; the candidate pairs stay
/// complete until the skin may be used up.
///
/// The bound: let F map the cell at the rebuild to the present one and `u_i = x_i − F x_i⁰` be the non-affine
/// displacements (F = 1 without a cell). A pair that was not listed had `|d⁰| > c + s` with its cutoff distance c and
/// the skin s, and now has `|d| = |F d⁰ + u_b − u_a| ≥ σ (c + s) − 2 U`, with the smallest stretch σ of F and U the
/// largest `|u_i − ū|` for any constant ū. The list misses no pair as long as `2U + (1 − σ) c < σ s` for the pair's c;
/// the worst case is the largest c for σ < 1, and c = 0 otherwise. Radii that have grown by g since the rebuild take 2g
/// from the skin.
#[derive(Debug, Clone, PartialEq)]
pub struct VerletList {
    /// Extra distance of the search, m: the reaches of a pair add up to its cutoff distance plus this.
    pub skin: f64,
    /// Largest cutoff distance of any pair, without the skin, m.
    pub largest_cutoff: f64,
    /// Largest growth of a radius since the rebuild, m.
    pub growth: f64,
    /// Positions at the rebuild, m.
    pub positions: Vec<Vec3>,
    /// Cell matrix at the rebuild, m.
    pub cell_matrix: Option<Mat3>,
}

impl VerletList {
    /// Store the present positions and cell; `skin` and `largest_cutoff` in m.
    pub fn new(positions: &[Vec3], cell: Option<&Cell>, skin: f64, largest_cutoff: f64) -> Self {
        Self { skin, largest_cutoff, growth: 0.0, positions: positions.to_vec(), cell_matrix: cell.map(|c| c.matrix) }
    }

    /// Largest component of the displacement of any particle since the rebuild, m; NaN if a position is not finite.
    fn largest_component(&self, positions: &[Vec3]) -> f64 {
        let pieces = positions.par_chunks(4096).zip(self.positions.par_chunks(4096));
        pieces.map(|(now, then)| largest_difference(reals(now), reals(then))).reduce(|| 0.0, max_or_nan)
    }

    /// Whether a pair within its cutoff distance may be missing from the candidates.
    ///
    /// Positions must not have been wrapped or reordered since the rebuild. Also true if the number of particles
    /// changed, the cell appeared or disappeared, or a position is not finite. The result does not depend on the number
    /// of threads.
    pub fn needs_rebuild(&self, positions: &[Vec3], cell: Option<&Cell>) -> bool {
        if positions.len() != self.positions.len() {
            return true;
        }
        let map = match (self.cell_matrix, cell) {
            (None, None) => None,
            (Some(old), Some(new)) if old == new.matrix => None,
            (Some(old), Some(new)) => match old.try_inverse() {
                Some(inverse) => Some(new.matrix * inverse),
                None => return true,
            },
            _ => return true,
        };
        let stretch = map.as_ref().map_or(1.0, smallest_stretch);
        let allowance = stretch * self.skin - (1.0 - stretch).max(0.0) * self.largest_cutoff - 2.0 * self.growth;
        if map.is_none() && 2.0 * 3.0_f64.sqrt() * self.largest_component(positions) < allowance {
            return false;
        }
        let displacement = |(now, then): (&Vec3, &Vec3)| map.as_ref().map_or_else(|| now - then, |f| now - f * then);
        let pairs = || positions.par_iter().zip(&self.positions).with_min_len(4096);

        // Minima and maxima do not depend on the order; NaN is kept on purpose.
        let none = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        let (low, high) = pairs()
            .map(displacement)
            .map(|u| (u, u))
            .reduce(|| none, |p, q| (p.0.zip_map(&q.0, min_or_nan), p.1.zip_map(&q.1, max_or_nan)));
        if positions.is_empty() {
            return false;
        }
        let extent = high - low;
        if !(extent.max() < allowance && extent.iter().all(|e| e.is_finite())) {
            return true;
        }
        // |u − ū| is at most half the diagonal of the box of displacements around ū: usually enough to decide.
        if extent.norm() < allowance {
            return false;
        }
        let middle = 0.5 * (low + high);
        let largest = pairs().map(|p| (displacement(p) - middle).norm_squared()).reduce(|| 0.0, max_or_nan).sqrt();
        // Not `>=`: NaN must rebuild.
        let holds = 2.0 * largest < allowance;
        !holds
    }
}

/// The components of vectors, one after the other.
fn reals(vectors: &[Vec3]) -> &[f64] {
    bytemuck::cast_slice(vectors)
}

/// Numbers that are compared at a time.
const LANES: usize = 8;

/// Largest `|a − b|`, and NaN if a difference is not finite.
fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
    // Comparisons drop NaN; the sum keeps it.
    let (mut largest, mut sum) = ([0.0_f64; LANES], [0.0; LANES]);
    let (eights, rest) = a.as_chunks::<LANES>();
    let (others, other_rest) = b.as_chunks::<LANES>();
    for (a, b) in eights.iter().zip(others) {
        for lane in 0..LANES {
            let difference = (a[lane] - b[lane]).abs();
            largest[lane] = if difference > largest[lane] { difference } else { largest[lane] };
            sum[lane] += difference;
        }
    }
    let rest = rest.iter().zip(other_rest).map(|(a, b)| (a - b).abs()).fold(0.0, max_or_nan);
    let largest = largest.into_iter().fold(rest, max_or_nan);
    if sum.iter().all(|sum| sum.is_finite()) { largest } else { f64::NAN }
}

fn min_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || a < b { a } else { b }
}

fn max_or_nan(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// Smallest singular value of `f`: the square root of the smallest eigenvalue of `fᵀf`, which is
/// `q + 2p cos(φ + 2π/3)` (Smith 1961, Commun. ACM 4, 168), lowered by 1e-12 for rounding.
fn smallest_stretch(f: &Mat3) -> f64 {
    let c = f.transpose() * f;
    let q = c.trace() / 3.0;
    let b = c - Mat3::identity() * q;
    let p = (b.norm_squared() / 6.0).sqrt();
    let smallest = if p > 0.0 {
        let r = ((b / p).determinant() * 0.5).clamp(-1.0, 1.0);
        let phi = libm::acos(r) / 3.0;
        q + 2.0 * p * libm::cos(phi + 2.0 * std::f64::consts::FRAC_PI_3)
    } else {
        q
    };
    smallest.max(0.0).sqrt() * (1.0 - 1.0e-12)
}
