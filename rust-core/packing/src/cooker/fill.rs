//! Places for new spheres.

use crate::{PackingError, Random, Shape};
use concordem_contact::math::Vec3;
use concordem_solver::state::particles::Sphere;

/// Tries to find a point of the shape for every try to place a sphere. A vessel that fills a thousandth of its bounding box is hit once in
/// a thousand draws.
const DRAWS: usize = 100_000;

/// Spheres in a vessel, sorted into boxes as wide as the largest sphere.
pub(super) struct Filler<'a> {
    shape: &'a Shape,
    low: Vec3,
    size: Vec3,
    width: f64,
    count: [usize; 3],
    boxes: Vec<Vec<u32>>,
    spheres: Vec<Sphere>,
}

impl<'a> Filler<'a> {
    /// `largest`: the largest radius, m.
    pub(super) fn new(shape: &'a Shape, largest: f64, spheres: &[Sphere]) -> Self {
        let (low, high) = shape.bounds();
        let size = high - low;
        let width = 2.0 * largest;
        let count: [usize; 3] = std::array::from_fn(|k| ((size[k] / width).floor() as usize).max(1));
        let mut filler = Self {
            shape,
            low,
            size,
            width,
            count,
            boxes: vec![Vec::new(); count.iter().product()],
            spheres: Vec::new(),
        };
        for sphere in spheres {
            filler.add(*sphere);
        }
        filler
    }

    pub(super) fn into_spheres(self) -> Vec<Sphere> {
        self.spheres
    }

    pub(super) fn add(&mut self, sphere: Sphere) {
        let place = self.place_of(&sphere.position);
        let number = self.number(place);
        self.boxes[number].push(self.spheres.len() as u32);
        self.spheres.push(sphere);
    }

    /// A place for a sphere of `radius` (m), and its smallest distance (m) to others: the first of `attempts` random places inside that
    /// is free, or the one with the most room.
    pub(super) fn place(&self, radius: f64, attempts: usize, random: &mut Random) -> Result<(Vec3, f64), PackingError> {
        let mut best: Option<(Vec3, f64)> = None;
        for _ in 0..attempts {
            let inside = |x: &Vec3| self.shape.contains(x, radius);
            let found = (0..DRAWS).map(|_| self.low + random.uniform_vector().component_mul(&self.size)).find(inside);
            let Some(x) = found else {
                let reason =
                    format!("a sphere of radius {radius:e} m does not fit into it ({DRAWS} random places tried)");
                return Err(PackingError::BadShape { reason });
            };
            let gap = self.gap(&x, radius, best.map_or(f64::NEG_INFINITY, |best| best.1));
            if gap >= 0.0 {
                return Ok((x, gap));
            }
            if best.is_none_or(|best| gap > best.1) {
                best = Some((x, gap));
            }
        }
        best.ok_or(PackingError::Empty)
    }

    /// Distance to the nearest sphere (m), if it exceeds `least`; otherwise anything up to that. Zero if nothing is near.
    fn gap(&self, x: &Vec3, radius: f64, least: f64) -> f64 {
        let center = self.place_of(x);
        let range = |k: usize| center[k].saturating_sub(1)..(center[k] + 2).min(self.count[k]);
        let mut gap = 0.0_f64;
        for k in range(2) {
            for j in range(1) {
                for i in range(0) {
                    for &index in &self.boxes[self.number([i, j, k])] {
                        let other = &self.spheres[index as usize];
                        gap = gap.min((other.position - x).norm() - radius - other.radius);
                        if gap <= least {
                            return gap;
                        }
                    }
                }
            }
        }
        gap
    }

    fn place_of(&self, x: &Vec3) -> [usize; 3] {
        // Boxes are at least `width` wide; the last one of an axis may be wider.
        std::array::from_fn(|k| (((x[k] - self.low[k]) / self.width).max(0.0) as usize).min(self.count[k] - 1))
    }

    fn number(&self, [i, j, k]: [usize; 3]) -> usize {
        (k * self.count[1] + j) * self.count[0] + i
    }
}
