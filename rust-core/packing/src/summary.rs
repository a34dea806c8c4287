//! Density and contacts of a packing.

use super::{Packing, PackingError, TIE, positive};
use concordem_contact::math::Vec3;
use concordem_solver::neighbor::candidate_pairs;

/// Density and contacts of a packing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PackingSummary {
    /// Number of spheres.
    pub count: usize,
    /// Solid fraction: volume of the spheres over volume of the cell; `None` without a cell.
    pub packing_fraction: Option<f64>,
    /// `1 −` solid fraction.
    pub porosity: Option<f64>,
    /// Coordination number `2 C / N`: contacts are pairs with center distance up to `interaction_ratio·(R_A + R_B)`,
    /// within the relative tolerance [`TIE`].
    pub coordination: f64,
    /// Coordination number without the rattlers and their contacts.
    pub coordination_of_backbone: f64,
    /// Rattlers: spheres with a single contact or none, which carry no force; removed until none is left.
    pub rattlers: usize,
    /// Mean overlap of touching pairs over `R_A + R_B`.
    pub mean_overlap: f64,
    /// Largest overlap of touching pairs over `R_A + R_B`.
    pub largest_overlap: f64,
}

impl PackingSummary {
    /// Measure a packing. With `interaction_ratio` 1, contacts are touching pairs; 1.5 gives the usual cohesive links.
    ///
    /// # Errors
    /// A ratio that is not positive; positions or radii that are not finite.
    pub fn new(packing: &Packing, interaction_ratio: f64) -> Result<Self, PackingError> {
        positive("the interaction ratio", interaction_ratio)?;
        let count = packing.spheres.len();
        let reach: Vec<f64> = packing.spheres.iter().map(|s| s.radius * interaction_ratio * (1.0 + TIE)).collect();
        let pairs = candidate_pairs(&packing.positions(), &reach, packing.cell.as_ref())?;

        let (mut touching, mut overlap_sum, mut largest_overlap) = (0_usize, 0.0, 0.0_f64);
        for pair in &pairs {
            let (a, b) = (packing.spheres[pair.a as usize], packing.spheres[pair.b as usize]);
            let shift = packing.cell.map_or(Vec3::zeros(), |cell| cell.shift(pair.image));
            let sum = a.radius + b.radius;
            let overlap = 1.0 - (b.position + shift - a.position).norm() / sum;
            if overlap >= 0.0 {
                touching += 1;
                overlap_sum += overlap;
                largest_overlap = largest_overlap.max(overlap);
            }
        }

        let mut alive = vec![true; count];
        let (rattlers, backbone_contacts) = loop {
            let mut contacts = vec![0_u32; count];
            let mut total = 0_usize;
            for pair in &pairs {
                let (a, b) = (pair.a as usize, pair.b as usize);
                if alive[a] && alive[b] {
                    contacts[a] += 1;
                    contacts[b] += 1;
                    total += 1;
                }
            }
            let mut removed = false;
            for (alive, contacts) in alive.iter_mut().zip(&contacts) {
                if *alive && *contacts < 2 {
                    *alive = false;
                    removed = true;
                }
            }
            if !removed {
                break (alive.iter().filter(|a| !**a).count(), total);
            }
        };
        let per = |contacts: usize, spheres: usize| {
            if spheres == 0 { 0.0 } else { 2.0 * contacts as f64 / spheres as f64 }
        };
        Ok(Self {
            count,
            packing_fraction: packing.packing_fraction(),
            porosity: packing.packing_fraction().map(|fraction| 1.0 - fraction),
            coordination: per(pairs.len(), count),
            coordination_of_backbone: per(backbone_contacts, count - rattlers),
            rattlers,
            mean_overlap: if touching == 0 { 0.0 } else { overlap_sum / touching as f64 },
            largest_overlap,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Lattice;
    use concordem_solver::state::particles::Sphere;

    #[test]
    fn lattice_with_a_rattler() {
        let mut packing = Lattice::SimpleCubic.periodic(1.0, [3; 3]).unwrap();
        // A small sphere free in the middle of a cube of eight.
        packing.spheres.push(Sphere { position: Vec3::repeat(1.0), radius: 0.1 });
        let summary = PackingSummary::new(&packing, 1.0 + 1.0e-9).unwrap();
        assert_eq!((summary.count, summary.rattlers), (28, 1));
        assert_eq!(summary.coordination_of_backbone, 6.0);
        assert_eq!(summary.coordination, 2.0 * 81.0 / 28.0);
        // Lattice positions are exact multiples of 2.
        assert_eq!(summary.largest_overlap, 0.0);
        let porosity = 1.0 - std::f64::consts::PI / 6.0 * (1.0 + 1.0e-3 / 27.0);
        // A dozen roundings.
        approx::assert_relative_eq!(summary.porosity.unwrap(), porosity, max_relative = 1e-14);
    }

    #[test]
    fn overlaps_are_relative() {
        let sphere = |x: f64| Sphere { position: Vec3::new(x, 0.0, 0.0), radius: 1.0 };
        let packing = Packing { spheres: vec![sphere(0.0), sphere(1.8), sphere(4.0)], cell: None };
        let summary = PackingSummary::new(&packing, 1.0).unwrap();
        // One rounding of 0.9 and one of the difference.
        approx::assert_relative_eq!(summary.mean_overlap, 0.1, max_relative = 1e-14);
        assert_eq!(summary.packing_fraction, None);
        assert_eq!(summary.rattlers, 3);
    }
}
