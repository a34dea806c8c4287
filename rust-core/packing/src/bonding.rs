//! Bonds between neighboring particles at the start of a run.

use concordem_contact::kinematics::sphere_sphere::initial_geometry;
use concordem_contact::law::Reference;
use concordem_contact::math::Vec3;
use concordem_solver::PairCoefficients;
use concordem_solver::neighbor::{NeighborError, candidate_pairs};
use concordem_solver::state::contacts::{ContactFlags, Contacts, Pair};
use concordem_solver::state::{Cell, Particles};

/// Bond all pairs whose center distance is below `interaction_ratio` times the sum of their radii (Stránský 2018,
/// §2.1), except within a clump and between materials without a common row. Bonds take the present length and normal,
/// and the cross-section of their law ([`ContactLaw::bonded_area`](concordem_contact::law::ContactLaw::bonded_area)). Returns the
/// number of bonds.
///
/// # Errors
/// Input that the neighbor search refuses.
pub fn bond(
    block: &mut dyn Contacts,
    rows: &PairCoefficients,
    particles: &Particles,
    cell: Option<&Cell>,
    interaction_ratio: f64,
) -> Result<usize, NeighborError> {
    let reach: Vec<f64> = particles.radius.iter().map(|r| r * interaction_ratio).collect();
    let mean_radius = particles.radius.iter().sum::<f64>() / particles.len().max(1) as f64;
    for candidate in candidate_pairs(&particles.position, &reach, cell)? {
        let (a, b) = (candidate.a as usize, candidate.b as usize);
        if particles.clump[a] != u32::MAX && particles.clump[a] == particles.clump[b] {
            continue;
        }
        let Some(row) = rows.get(particles.material[a], particles.material[b]) else { continue };
        let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(candidate.image));
        let geometry = initial_geometry(&particles.position[a], &particles.position[b], &shift);
        let flags =
            ContactFlags { row, bits: ContactFlags::BONDED | ContactFlags::ACTIVE, image: candidate.image, padding: 0 };
        let area = block.bonded_area(row, particles.radius[a], particles.radius[b], mean_radius);
        block.push(
            Pair { a: candidate.a, b: candidate.b },
            flags,
            Reference { length: geometry.length, area },
            geometry,
        );
    }
    block.sort();
    Ok(block.len())
}

/// Interaction ratio at which a packing has `coordination` bonds per particle, and the coordination reached: the network
/// correction of Jebahi et al. 2015, section 2.3.1.3 (radii enlarged for the search alone), solved by sorting the pairs by
/// center distance through sum of radii instead of bisection. `None` when there are too few pairs within twice the radii.
pub fn ratio_for_coordination(
    spheres: &[concordem_solver::state::Sphere],
    cell: Option<&Cell>,
    coordination: f64,
) -> Result<Option<(f64, f64)>, NeighborError> {
    /// Largest ratio searched.
    const REACH: f64 = 2.0;
    let wanted = (0.5 * coordination * spheres.len() as f64).round() as usize;
    let positions: Vec<Vec3> = spheres.iter().map(|s| s.position).collect();
    let mut reach = 1.1;
    loop {
        let radii: Vec<f64> = spheres.iter().map(|s| s.radius * reach).collect();
        let mut ratios: Vec<f64> = candidate_pairs(&positions, &radii, cell)?
            .iter()
            .map(|pair| {
                let (a, b) = (pair.a as usize, pair.b as usize);
                let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
                (positions[b] + shift - positions[a]).norm() / (spheres[a].radius + spheres[b].radius)
            })
            .collect();
        ratios.sort_unstable_by(f64::total_cmp);
        // One pair more, so that the ratio can lie between two of them.
        if wanted > 0 && ratios.len() > wanted {
            let reached = 2.0 * wanted as f64 / spheres.len() as f64;
            return Ok(Some((0.5 * (ratios[wanted - 1] + ratios[wanted]), reached)));
        }
        if reach >= REACH || wanted == 0 {
            return Ok(None);
        }
        reach = (reach * 1.3).min(REACH);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lattice::Lattice;

    /// A simple cubic lattice has 6 touching neighbors, and 18 up to √2 of the distance: any coordination between them
    /// is reached at a ratio between 1 and √2, or at √2 itself when it cuts through a shell.
    #[test]
    fn coordination_is_reached() {
        let packing = Lattice::SimpleCubic.periodic(1.0, [4, 4, 4]).unwrap();
        let ratio = |z: f64| ratio_for_coordination(&packing.spheres, packing.cell.as_ref(), z).unwrap();
        let (between, reached) = ratio(6.0).unwrap();
        // Half way from 1 to √2.
        assert!((between - 0.5 * (1.0 + 2f64.sqrt())).abs() < 1e-12 && reached == 6.0, "{between} {reached}");
        assert!((ratio(10.0).unwrap().0 - 2f64.sqrt()).abs() < 1e-12);
        assert_eq!(ratio(1000.0), None);
    }
}
