//! Bonds between particles near each other at the start.

use crate::kinematics::sphere_sphere::fresh_frame;
use crate::law::Reference;
use crate::math::Vec3;
use crate::neighbor::{NeighborError, candidate_pairs};
use crate::solver::MaterialRows;
use crate::state::contacts::{Contacts, Link, Pair};
use crate::state::{Cell, Particles};

/// Bond all pairs whose centre distance is below `interaction_ratio` times the sum of their radii (Stránský 2018,
/// §2.1), except within a clump and where the materials have no common row. Length and normal are those of now, the
/// cross-section is the law's own ([`ContactLaw::bonded_area`](crate::law::ContactLaw::bonded_area)). Returns the number
/// of bonds.
pub fn bond(
    block: &mut dyn Contacts,
    rows: &MaterialRows,
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
        let frame = fresh_frame(&particles.position[a], &particles.position[b], &shift);
        let link = Link { row, flags: Link::BONDED | Link::ACTIVE, image: candidate.image, padding: 0 };
        let area = block.bonded_area(row, particles.radius[a], particles.radius[b], mean_radius);
        block.push(Pair { a: candidate.a, b: candidate.b }, link, Reference { length: frame.length, area }, frame);
    }
    block.sort();
    Ok(block.len())
}
