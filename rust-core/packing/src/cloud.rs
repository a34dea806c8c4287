//! Loose random clouds of spheres that do not touch.

use std::collections::BTreeMap;

use super::{PackingError, Random};
use concordem_contact::math::Vec3;
use concordem_operator::interruption::look;
use concordem_solver::state::particles::Sphere;

/// Largest number of positions tried for one sphere.
const ATTEMPTS: usize = 10_000;

/// Spheres between two reports; they take some 0.1 s in a cell that is nearly full.
const REPORTED: usize = 256;

/// Spheres of the given radii (m) at random positions in a periodic cube with edge `edge` (m) without contact, largest first
/// (random sequential addition). `placed` is called with the number of spheres after every [`REPORTED`] of them, so that the caller may
/// show it, or be interrupted.
///
/// # Errors
/// [`PackingError::NoRoom`].
pub(super) fn random_cloud(
    mut radii: Vec<f64>,
    edge: f64,
    random: &mut Random,
    placed: &mut dyn FnMut(usize),
) -> Result<Vec<Sphere>, PackingError> {
    radii.sort_by(|a, b| b.total_cmp(a));
    let mut spheres: Vec<Sphere> = Vec::with_capacity(radii.len());
    // Each size class is half as large as the one before. The boxes of its grid are as wide as twice its largest
    // radius, so a sphere searches only its own box and the adjacent ones in the grids of larger spheres.
    let mut levels: Vec<Level> = Vec::new();
    for radius in radii {
        if levels.last().is_none_or(|level| radius < 0.5 * level.largest) {
            levels.push(Level::new(radius, edge));
        }
        let free = (0..ATTEMPTS)
            .map(|_| random.uniform_vector() * edge)
            .find(|candidate| levels.iter().all(|level| level.is_free(candidate, radius, edge, &spheres)));
        let Some(position) = free else {
            return Err(PackingError::NoRoom { placed: spheres.len(), radius, edge, attempts: ATTEMPTS });
        };
        if let Some(level) = levels.last_mut() {
            level.boxes.entry(level.box_of(&position)).or_default().push(spheres.len());
        }
        spheres.push(Sphere { position, radius });
        if spheres.len().is_multiple_of(REPORTED) {
            look();
            placed(spheres.len());
        }
    }
    Ok(spheres)
}

/// The spheres of one size class, by box.
struct Level {
    largest: f64,
    /// Boxes per edge of the cell.
    count: i64,
    boxes_per_meter: f64,
    boxes: BTreeMap<[i64; 3], Vec<usize>>,
}

impl Level {
    fn new(largest: f64, edge: f64) -> Self {
        let count = (0.5 * edge / largest).floor().max(1.0);
        Self { largest, count: count as i64, boxes_per_meter: count / edge, boxes: BTreeMap::new() }
    }

    fn box_of(&self, position: &Vec3) -> [i64; 3] {
        [position.x, position.y, position.z].map(|c| ((c * self.boxes_per_meter) as i64).min(self.count - 1))
    }

    /// Whether a sphere at `position` touches no sphere of this level and none of their images.
    fn is_free(&self, position: &Vec3, radius: f64, edge: f64, spheres: &[Sphere]) -> bool {
        let center = self.box_of(position);
        // One box on either side, each box once.
        let offsets = |axis: usize| {
            let reach = if self.count >= 3 { -1..=1 } else { 0..=self.count - 1 };
            reach.map(move |o| (center[axis] + o).rem_euclid(self.count))
        };
        offsets(0).all(|x| {
            offsets(1).all(|y| {
                offsets(2).all(|z| {
                    self.boxes.get(&[x, y, z]).is_none_or(|members| {
                        members.iter().all(|&index| {
                            let other = &spheres[index];
                            // Only the nearest image matters.
                            let d = (other.position - position).map(|c| c - edge * (c / edge).round());
                            let sum = radius + other.radius;
                            d.norm_squared() > sum * sum
                        })
                    })
                })
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Packing, PackingSummary, SizeDistribution};
    use concordem_solver::state::Cell;

    #[test]
    fn no_two_spheres_touch() {
        let sizes = [SizeDistribution::Single(1.0), SizeDistribution::Sieve(vec![(0.1, 0.0), (1.0, 0.5), (4.0, 1.0)])];
        for (sizes, count) in sizes.iter().zip([400, 4000]) {
            let radii = sizes.radii(count, 1).unwrap();
            let edge = 3.0 * concordem_contact::math::cbrt(radii.iter().map(|r| r * r * r).sum());
            let mut reports = Vec::new();
            let spheres = random_cloud(radii, edge, &mut Random::new(2), &mut |placed| reports.push(placed)).unwrap();
            assert_eq!(spheres.len(), count);
            assert_eq!(reports, (1..=count / REPORTED).map(|k| k * REPORTED).collect::<Vec<_>>());
            let packing = Packing { spheres, cell: Some(Cell::new_box(Vec3::repeat(edge))) };
            assert_eq!(PackingSummary::new(&packing, 1.0).unwrap().coordination, 0.0);
        }
    }

    #[test]
    fn a_full_cell_is_reported() {
        let full = random_cloud(vec![1.0; 100], 6.0, &mut Random::new(1), &mut |_| {});
        assert!(matches!(full, Err(PackingError::NoRoom { .. })));
    }
}
