//! Selection of particles by position or number.

use super::{AssemblyError, unfit};
use crate::schema::quantity::vector;
use crate::schema::{End, Selection};
use concordem_contact::math::Vec3;
use concordem_solver::state::{Particles, Sphere};

/// Indices of the spheres in a selection, which belongs to the set `name`.
pub(super) fn select(selection: &Selection, spheres: &[Sphere], name: &str) -> Result<Vec<usize>, AssemblyError> {
    let chosen: Vec<usize> = match selection {
        Selection::All => (0..spheres.len()).collect(),
        Selection::Box { minimum, maximum } => {
            let (low, high) = (vector(minimum), vector(maximum));
            let inside = |x: &Vec3| (0..3).all(|i| low[i] <= x[i] && x[i] <= high[i]);
            (0..spheres.len()).filter(|&p| inside(&spheres[p].position)).collect()
        }
        Selection::Sphere { center, radius } => {
            let center = vector(center);
            (0..spheres.len()).filter(|&p| (spheres[p].position - center).norm() <= radius.si()).collect()
        }
        Selection::Layer { axis, end, thickness } => {
            let axis = axis.index();
            layer(spheres.iter().map(|s| (s.position[axis], s.radius)), *end, thickness.si())
        }
        Selection::Ids { ids } => {
            if let Some(bad) = ids.iter().find(|&&id| id as usize >= spheres.len()) {
                let message = format!("set `{name}` lists particle {bad}, but there are only {}", spheres.len());
                return Err(unfit("set.selection.ids", message));
            }
            ids.iter().map(|&id| id as usize).collect()
        }
    };
    if chosen.is_empty() {
        let message = format!("no particle lies in set `{name}`; check its position and units");
        return Err(unfit("set.selection", message));
    }
    Ok(chosen)
}

/// Indices of the particles whose center lies within `thickness` of one end of the bounding box of the spheres; `extents`
/// gives coordinate and radius of each.
pub(super) fn layer(extents: impl Iterator<Item = (f64, f64)> + Clone, end: End, thickness: f64) -> Vec<usize> {
    let (low, high) = bounds_along(extents.clone());
    extents
        .enumerate()
        .filter(|(_, (x, _))| match end {
            End::Minimum => x - low <= thickness,
            End::Maximum => high - x <= thickness,
        })
        .map(|(p, _)| p)
        .collect()
}

/// Coordinate along an axis and radius of every particle.
pub(super) fn extents(particles: &Particles, axis: usize) -> impl Iterator<Item = (f64, f64)> + Clone {
    particles.position.iter().zip(&particles.radius).map(move |(x, r)| (x[axis], *r))
}

/// Ends of the bounding box of spheres along an axis, m.
pub(super) fn bounds_along(extents: impl Iterator<Item = (f64, f64)>) -> (f64, f64) {
    extents.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (x, r)| (low.min(x - r), high.max(x + r)))
}

/// The lowest id among the clump members in `chosen`, with its clump.
pub(super) fn member_of_clump(particles: &Particles, chosen: &[usize]) -> Option<(u32, u32)> {
    let members = chosen.iter().filter(|&&p| particles.clump[p] != u32::MAX);
    members.map(|&p| (particles.id[p], particles.clump[p])).min()
}
