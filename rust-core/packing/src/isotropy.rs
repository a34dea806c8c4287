//! Whether the links of a packing favor a direction.

use super::{Packing, PackingError, TIE, positive};
use concordem_contact::math::{Vec3, atan2};
use concordem_solver::neighbor::candidate_pairs;

/// Branch vectors `x_B − x_A` (m, periodic images included) of all pairs with center distance up to
/// `interaction_ratio · (R_A + R_B)`, within the relative tolerance [`TIE`]: the links of a cohesive material (Stránský
/// 2018, section 2.1).
///
/// # Errors
/// A ratio that is not positive; positions or radii that are not finite.
pub fn link_vectors(packing: &Packing, interaction_ratio: f64) -> Result<Vec<Vec3>, PackingError> {
    positive("the interaction ratio", interaction_ratio)?;
    let reach: Vec<f64> = packing.spheres.iter().map(|s| s.radius * interaction_ratio * (1.0 + TIE)).collect();
    let pairs = candidate_pairs(&packing.positions(), &reach, packing.cell.as_ref())?;
    let position = |index: u32| packing.spheres[index as usize].position;
    Ok(pairs
        .iter()
        .map(|pair| {
            let shift = packing.cell.map_or(Vec3::zeros(), |cell| cell.shift(pair.image));
            position(pair.b) + shift - position(pair.a)
        })
        .collect())
}

/// Histogram of link directions in the xy plane (Stránský 2018, figure 2.3).
///
/// Links with `|n_z| ≤ 0.7` are projected to the plane; their angle to x, modulo π, falls into equal bins over [0, π).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct DirectionHistogram {
    /// Links per bin.
    pub counts: Vec<u64>,
}

impl DirectionHistogram {
    /// Largest `|n_z|` of links in the histogram.
    pub const STEEPEST: f64 = 0.7;
    /// Usual number of bins.
    pub const BINS: usize = 32;

    /// The histogram of branch vectors of any length, without zero vectors. `bins` is at least 1.
    pub fn new(links: &[Vec3], bins: usize) -> Self {
        let mut counts = vec![0; bins.max(1)];
        let bins = counts.len();
        for link in links {
            let length = link.norm();
            if !(length > 0.0 && link.z.abs() <= Self::STEEPEST * length) {
                continue;
            }
            let angle = atan2(link.y, link.x);
            let turn = angle / std::f64::consts::PI;
            let fraction = turn - turn.floor();
            counts[((fraction * bins as f64) as usize).min(bins - 1)] += 1;
        }
        Self { counts }
    }

    /// Number of links in the histogram.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Mean number of links per bin.
    pub fn mean(&self) -> f64 {
        self.total() as f64 / self.counts.len() as f64
    }

    /// Standard deviation of the bins over their mean. Independent random directions give `1/√mean` on average.
    pub fn relative_deviation(&self) -> f64 {
        let mean = self.mean();
        let squares: f64 = self.counts.iter().map(|c| (*c as f64 - mean) * (*c as f64 - mean)).sum();
        (squares / self.counts.len() as f64).sqrt() / mean
    }

    /// Smallest and largest bin over the mean.
    pub fn extremes(&self) -> (f64, f64) {
        let mean = self.mean();
        let low = self.counts.iter().copied().min().unwrap_or(0) as f64;
        let high = self.counts.iter().copied().max().unwrap_or(0) as f64;
        (low / mean, high / mean)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Lattice, Random};

    #[test]
    fn directions_fall_into_their_bins() {
        let links = [
            Vec3::x(),
            -Vec3::x(),
            Vec3::new(1.0, 1.0, 0.0),
            Vec3::new(-2.0, -2.0, 0.1),
            Vec3::y(),
            Vec3::new(0.1, 0.0, 1.0),
            Vec3::zeros(),
        ];
        assert_eq!(DirectionHistogram::new(&links, 4).counts, [2, 2, 1, 0]);
    }

    #[test]
    fn random_directions_scatter_as_expected() {
        let mut random = Random::new(3);
        let mut links = Vec::new();
        while links.len() < 30_000 {
            let v = random.uniform_vector() * 2.0 - Vec3::repeat(1.0);
            if v.norm_squared() <= 1.0 {
                links.push(v);
            }
        }
        let histogram = DirectionHistogram::new(&links, DirectionHistogram::BINS);
        // |n_z| ≤ 0.7 holds for 70 % of isotropic directions: four times the standard deviation √(0.21/30000) = 0.0026.
        approx::assert_abs_diff_eq!(histogram.total() as f64 / 30_000.0, 0.7, epsilon = 0.0106);
        // The deviation of 32 bins is known to 1/√64 = 12 %; three times that.
        let expected = 1.0 / histogram.mean().sqrt();
        approx::assert_relative_eq!(histogram.relative_deviation(), expected, max_relative = 0.37);
    }

    #[test]
    fn cubic_links_are_counted() {
        let packing = Lattice::SimpleCubic.periodic(1.0, [4; 3]).unwrap();
        // 6 neighbors at 2r and 12 at 2√2 r = 1.414 · 2r.
        assert_eq!(link_vectors(&packing, 1.1).unwrap().len(), 3 * 64);
        assert_eq!(link_vectors(&packing, 1.5).unwrap().len(), 9 * 64);
        assert!(link_vectors(&packing, 0.0).is_err());
    }
}
