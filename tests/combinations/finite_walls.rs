//! Plates, rods, and tubes in a random scenario, in place of its planes and vessels.

use concordem::math::Vec3;
use concordem_tests::random::Random;

use crate::case::{Case, Shape};

/// Makes walls finite: they are within the infinite ones, so nothing overlaps them, and their edges lie below particles.
pub fn add(random: &mut Random, case: &mut Case) {
    // Multiples of a micrometer's binary neighbor, so that corners of triangles fit into 32 bits.
    let grid = |value: f64, step: f64| (value / step).round() * step;
    let micrometer = 2.0_f64.powi(-20);
    let bounds = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
    let (low, high) = case.spheres.iter().fold(bounds, |(low, high), (x, _)| (low.inf(x), high.sup(x)));
    let plane = case.dimension == 2;
    let (cell, size, middle) = (case.cell, high - low, (low + high) * 0.5);
    for wall in case.walls.iter_mut().filter(|wall| wall.rotation.is_none()) {
        if random.happens(0.4) {
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
                    let length = edges.iter().map(|edge| edge[along]).fold(0.0, f64::max);
                    wall.shape = Shape::Cylinder(center - shift, along, radius, false, Some(length));
                } else {
                    wall.shape = Shape::Plate(center, edges);
                }
            }
            Shape::Cylinder(center, axis, .., length) if !plane => {
                center[*axis] = middle[*axis];
                *length = Some(random.between(0.3, 0.9) * (size[*axis] + 1e-3));
            }
            _ => {}
        }
    }
}
