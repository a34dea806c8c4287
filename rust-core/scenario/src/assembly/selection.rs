//! Selection of particles by position or number.

use super::{AssemblyError, unfit};
use crate::schema::quantity::vector;
use crate::schema::{End, Selection};
use concordem_contact::math::Vec3;
use concordem_packing::TIE;
use concordem_solver::state::{Particles, Sphere};

/// Indices of the spheres in the selection of the set `name`, the table with this `number`. Centers on the border count as inside, up to the
/// relative tolerance [`TIE`].
pub(super) fn select(
    selection: &Selection,
    spheres: &[Sphere],
    number: usize,
    name: &str,
) -> Result<Vec<usize>, AssemblyError> {
    let chosen: Vec<usize> = match selection {
        Selection::All => (0..spheres.len()).collect(),
        Selection::Box { minimum, maximum } => {
            let (low, high) = (vector(minimum), vector(maximum));
            let slack = (high - low) * TIE;
            let inside = |x: &Vec3| (0..3).all(|i| low[i] - slack[i] <= x[i] && x[i] <= high[i] + slack[i]);
            (0..spheres.len()).filter(|&p| inside(&spheres[p].position)).collect()
        }
        Selection::Sphere { center, radius } => {
            let (center, reach) = (vector(center), radius.si() * (1.0 + TIE));
            (0..spheres.len()).filter(|&p| (spheres[p].position - center).norm() <= reach).collect()
        }
        Selection::Layer { axis, end, thickness } => {
            let axis = axis.index();
            layer(spheres.iter().map(|s| (s.position[axis], s.radius)), *end, thickness.si())
        }
        Selection::Ids { ids } => {
            if let Some(bad) = ids.iter().find(|&&id| id as usize >= spheres.len()) {
                let message = format!("set `{name}` lists particle {bad}, but there are only {}", spheres.len());
                return Err(unfit(&format!("set[{number}].selection.ids"), message));
            }
            ids.iter().map(|&id| id as usize).collect()
        }
    };
    if chosen.is_empty() {
        let (low, high) = super::bounds(spheres.iter().map(|sphere| &sphere.position));
        let message = format!(
            "no particle lies in set `{name}`; check its position and units: the centers lie {}",
            super::between(&low, &high)
        );
        return Err(unfit(&format!("set[{number}].selection"), message));
    }
    Ok(chosen)
}

/// Indices of the particles whose center lies within `thickness` of one end of the bounding box of the spheres;
/// `extents` gives coordinate and radius of each. Centers at exactly this distance belong to the layer, up to the
/// relative tolerance [`TIE`].
pub(super) fn layer(extents: impl Iterator<Item = (f64, f64)> + Clone, end: End, thickness: f64) -> Vec<usize> {
    let (low, high) = bounds_along(extents.clone());
    let reach = thickness * (1.0 + TIE);
    extents
        .enumerate()
        .filter(|(_, (x, _))| match end {
            End::Minimum => x - low <= reach,
            End::Maximum => high - x <= reach,
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

#[cfg(test)]
mod tests {
    use super::*;

    /// Layers one and a half spheres thick take two rows at both ends of a chain of spheres, whatever the radius: the
    /// center of the second row is 3 radii from the end.
    #[test]
    fn layers_at_both_ends_are_equal() {
        for radius in [1e-3, 0.7e-3, 0.6e-3, 0.3e-3, 1.1e-3, 1.3e-3] {
            let extents = (0..12).map(|k| (2.0 * radius * f64::from(k), radius));
            let rows = |end| layer(extents.clone(), end, 3.0 * radius);
            assert_eq!((rows(End::Minimum), rows(End::Maximum)), (vec![0, 1], vec![10, 11]), "radius {radius}");
        }
    }
}
