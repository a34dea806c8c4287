//! Plates, discs, rods, and tubes in a random scenario, in place of its planes and vessels.

use concordem::math::Vec3;
use concordem_tests::random::Random;

use crate::case::{Case, Shape};

/// Size of a wall that reaches beyond all particles, in diagonals of the box around them at the start.
const WIDE: f64 = 8.0;

/// Makes walls finite: they are within the infinite ones, so nothing overlaps them, and their edges lie below particles.
pub fn add(random: &mut Random, case: &mut Case) {
    // Multiples of a micrometer's binary neighbor, so that corners of triangles fit into 32 bits.
    let grid = |value: f64, step: f64| (value / step).round() * step;
    let micrometer = 2.0_f64.powi(-20);
    let bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = case.spheres.iter().fold(bounds, |(low, high), (x, _)| (low.inf(x), high.sup(x)));
    let plane = case.dimension == 2;
    let (cell, size, middle) = (case.cell, high - low, (low + high) * 0.5);
    for wall in &mut case.walls {
        if random.happens(0.4) {
            continue;
        }
        // Some reach beyond all particles: there an infinite wall gives the same motion.
        let wide = WIDE * (size.norm() + 1e-3);
        let is_wide = cell.is_none() && random.happens(0.6);
        if let Shape::Plane(point, normal) = &wall.shape
            && (wall.rotation.is_some() || random.happens(0.3))
        {
            // The normal of a wall that turns passes through its point.
            let mut center = if wall.rotation.is_some() { *point } else { middle };
            let axis = normal.iamax();
            center[axis] = point[axis];
            let room = (0..3).filter(|&k| k != axis).map(|k| cell.map_or(size[k] + 1e-3, |cell| cell[k]));
            let radius = if is_wide { wide } else { random.between(0.15, 0.45) * room.fold(f64::INFINITY, f64::min) };
            wall.shape = Shape::Disc(center, *normal, radius);
            continue;
        }
        if wall.rotation.is_some() {
            continue;
        }
        match &mut wall.shape {
            Shape::Plane(point, normal) => {
                let axis = normal.iamax();
                let mut center = middle.map(|x| grid(x, micrometer));
                center[axis] = point[axis];
                // Shorter than the particles reach or, in a cell, sometimes as long as it is: a floor of images.
                let mut edges = [(axis + 1) % 3, (axis + 2) % 3].map(|k| {
                    let length = match cell {
                        Some(cell) if random.happens(0.3) => cell[k],
                        _ => grid(random.between(0.3, 0.9) * (size[k] + 1e-3), 2.0 * micrometer),
                    };
                    let length = if plane && k == 2 { 1024.0 * micrometer } else { length };
                    let mut edge = Vec3::zeros();
                    edge[k] = length;
                    edge
                });
                if random.happens(0.3) {
                    edges.swap(0, 1);
                }
                // A rod that rolls with its top in the plane, in place of some plates.
                let along = (axis + 1) % 3;
                if !plane && cell.is_none() && random.happens(0.3) {
                    let radius = 1.5e-3;
                    let shift = *normal * radius;
                    let short = edges.iter().map(|edge| edge[along]).fold(0.0, f64::max);
                    let length = if is_wide { wide } else { short };
                    wall.shape = Shape::Cylinder(center - shift, along, radius, false, Some(length));
                } else {
                    wall.shape = Shape::Plate(center, edges);
                }
            }
            Shape::Cylinder(center, axis, .., length) if !plane => {
                center[*axis] = middle[*axis];
                let short = random.between(0.3, 0.9) * (size[*axis] + 1e-3);
                *length = Some(if is_wide { wide } else { short });
            }
            _ => {}
        }
    }
}

/// The scenario with infinite walls in place of those that reach beyond all particles at the start and, at `end`, still do; `None` without
/// one.
pub fn infinite(case: &Case, end: &[Vec3]) -> Option<Case> {
    let mut twin = case.clone();
    let start = case.spheres.iter().map(|(x, _)| x);
    let reaches = |wide: f64, center: &Vec3| start.clone().chain(end).all(|x| 2.0 * (x - center).norm() < wide);
    let mut changed = false;
    for wall in &mut twin.walls {
        match &mut wall.shape {
            Shape::Disc(center, normal, radius) if reaches(*radius, center) => {
                wall.shape = Shape::Plane(*center, *normal);
                changed = true;
            }
            // Half of the length lies on each side of the center.
            Shape::Cylinder(center, .., length) if length.is_some_and(|length| reaches(0.5 * length, center)) => {
                *length = None;
                changed = true;
            }
            _ => {}
        }
    }
    changed.then_some(twin)
}
