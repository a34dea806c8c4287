//! Coordination number, solid fraction, and overlaps of a packing between walls.

use crate::{PackingError, Shape, TIE};
use concordem_contact::math::Vec3;
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::particles::Sphere;

/// Spheres whose centers are nearer to the wall than this many mean radii belong to the boundary. A wall touches centers at one radius; up
/// to two mean radii the space on the side of the wall is too narrow for another sphere, so contacts are missing there.
pub const BOUNDARY_DEPTH: f64 = 2.0;

/// Facts about a packing between walls.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// Number of spheres.
    pub count: usize,
    /// Volume of all spheres over volume of the vessel.
    pub solid_fraction: f64,
    /// Mean number of contacts of a sphere inside, `(2 N_ii + N_ib)/N_i`; NaN if no sphere is inside.
    pub coordination: f64,
    /// Mean number of contacts of a sphere at the boundary ([`BOUNDARY_DEPTH`]).
    pub at_boundary: f64,
    /// Mean overlap of touching spheres over the mean radius.
    pub overlap: f64,
    /// Largest overlap over the mean radius.
    pub largest_overlap: f64,
}

/// Whether each sphere belongs to the boundary of the vessel `shape`.
pub fn boundary(spheres: &[Sphere], shape: &Shape) -> Vec<bool> {
    let mean = spheres.iter().map(|sphere| sphere.radius).sum::<f64>() / spheres.len().max(1) as f64;
    spheres.iter().map(|sphere| !shape.contains(&sphere.position, BOUNDARY_DEPTH * mean)).collect()
}

/// Pairs of touching spheres.
pub(super) fn touching(spheres: &[Sphere]) -> Result<Vec<[u32; 2]>, PackingError> {
    pairs_within(spheres, 1.0)
}

/// Pairs with center distance up to `ratio` times the sum of the radii.
pub(super) fn pairs_within(spheres: &[Sphere], ratio: f64) -> Result<Vec<[u32; 2]>, PackingError> {
    let positions: Vec<Vec3> = spheres.iter().map(|sphere| sphere.position).collect();
    let reach: Vec<f64> = spheres.iter().map(|sphere| sphere.radius * ratio * (1.0 + TIE)).collect();
    Ok(candidate_pairs(&positions, &reach, None)?.iter().map(|pair| [pair.a, pair.b]).collect())
}

/// Mean number of links of a sphere that is not at the boundary; NaN if there is none.
pub(super) fn links_inside(links: &[[u32; 2]], boundary: &[bool]) -> f64 {
    let ends = links.iter().flatten().filter(|p| !boundary[**p as usize]).count();
    ends as f64 / boundary.iter().filter(|outer| !**outer).count() as f64
}

/// Measures spheres in a vessel of the given volume (m³).
pub(super) fn measure(spheres: &[Sphere], shape: &Shape, volume: f64) -> Result<Measured, PackingError> {
    let outer = boundary(spheres, shape);
    let links = touching(spheres)?;
    let mean = spheres.iter().map(|sphere| sphere.radius).sum::<f64>() / spheres.len().max(1) as f64;
    let overlap = |[a, b]: [u32; 2]| {
        let (a, b) = (&spheres[a as usize], &spheres[b as usize]);
        (a.radius + b.radius - (a.position - b.position).norm()).max(0.0)
    };
    let sum: f64 = links.iter().map(|link| overlap(*link)).sum();
    let opposite: Vec<bool> = outer.iter().map(|outer| !outer).collect();
    Ok(Measured {
        count: spheres.len(),
        solid_fraction: spheres.iter().map(super::volume_of).sum::<f64>() / volume,
        coordination: links_inside(&links, &outer),
        at_boundary: links_inside(&links, &opposite),
        overlap: if links.is_empty() { 0.0 } else { sum / links.len() as f64 / mean },
        largest_overlap: links.iter().map(|link| overlap(*link)).fold(0.0, f64::max) / mean,
    })
}
