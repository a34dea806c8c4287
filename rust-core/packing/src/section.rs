//! Cross-section of a body of spheres.

use super::TIE;
use concordem_contact::math::{Vec3, sin_cos};
use concordem_solver::state::particles::Sphere;

/// Points on the circumference of a projected sphere. The hull of a body many spheres wide is too small by 1.2e-3 radii
/// per side.
const POINTS: usize = 64;

/// Smallest cross-section of a body of spheres perpendicular to `axis` (0 to 2), m²: of `sections` planes, evenly spaced
/// between the outermost centers, the smallest area of the convex hull of the spheres that a plane cuts, projected onto it.
///
/// The definition follows `approxSectionArea` of YADE, but with finer and regular polygons instead of hexagons for the
/// projected spheres. Zero without spheres.
///
/// ```
/// use concordem_packing::{Crop, Lattice, Shape, smallest_section};
/// use concordem_contact::math::Vec3;
///
/// let cube = Shape::new_box(Vec3::zeros(), Vec3::repeat(0.05))?;
/// let packing = Lattice::SimpleCubic.fill(1e-3, &cube, Crop::WholeSpheres, Vec3::repeat(1e-3))?;
/// let area = smallest_section(&packing.spheres, 2, 8);
/// // A square of 50 mm with corners rounded by spheres of 1 mm: 2500 − (4 − π) mm².
/// assert!((area * 1e6 - 2499.14).abs() < 0.3);
/// # Ok::<(), concordem_packing::PackingError>(())
/// ```
pub fn smallest_section(spheres: &[Sphere], axis: usize, sections: usize) -> f64 {
    let centers = || spheres.iter().map(|sphere| sphere.position[axis]);
    let (low, high) = (centers().fold(f64::INFINITY, f64::min), centers().fold(f64::NEG_INFINITY, f64::max));
    (0..sections)
        .map(|k| {
            let place = low + (high - low) * (k as f64 + 0.5) / sections as f64;
            hull_area(spheres.iter().filter(|s| (s.position[axis] - place).abs() <= s.radius * (1.0 + TIE)), axis)
        })
        .reduce(f64::min)
        .unwrap_or(0.0)
}

/// Area of the convex hull of spheres projected along `axis`, m²; the monotone chain of Andrew (1979).
fn hull_area<'a>(spheres: impl Iterator<Item = &'a Sphere>, axis: usize) -> f64 {
    let on_plane = |x: &Vec3| [x[(axis + 1) % 3], x[(axis + 2) % 3]];
    let mut points: Vec<[f64; 2]> = Vec::new();
    for sphere in spheres {
        let [u, v] = on_plane(&sphere.position);
        points.extend((0..POINTS).map(|k| {
            let (sin, cos) = sin_cos(std::f64::consts::TAU * k as f64 / POINTS as f64);
            [u + sphere.radius * cos, v + sphere.radius * sin]
        }));
    }
    points.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
    let turn = |a: [f64; 2], b: [f64; 2], c: [f64; 2]| (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for point in points {
            while chain.len() > 1 && turn(chain[chain.len() - 2], chain[chain.len() - 1], point) <= 0.0 {
                chain.pop();
            }
            chain.push(point);
        }
        chain
    };
    let mut hull = chain(&mut points.iter().copied());
    hull.pop();
    hull.extend(chain(&mut points.iter().rev().copied()));
    0.5 * hull.windows(2).map(|edge| edge[0][0] * edge[1][1] - edge[1][0] * edge[0][1]).sum::<f64>()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A triangle of three spheres far apart: the hull is the triangle, a strip along each side, and a disc. The polygon of a
    /// disc lies at most 1.2e-3 radii inside it, so the area is too small by at most that times the perimeter.
    #[test]
    fn hull_of_three_spheres() {
        let radius = 0.5;
        let corners = [Vec3::zeros(), Vec3::new(9.0, 3.0, 0.0), Vec3::new(9.0, 0.0, 4.0)];
        let spheres = corners.map(|position| Sphere { position: position + Vec3::new(0.0, 7.0, -2.0), radius });
        // Along x the triangle has legs 3 and 4.
        let expected = 6.0 + radius * 12.0 + std::f64::consts::PI * radius * radius;
        let found = hull_area(spheres.iter(), 0);
        assert!(found <= expected && expected - found < 1.2e-3 * radius * (12.0 + 3.2), "{found}, {expected}");
    }

    #[test]
    fn the_smallest_section_is_that_of_the_waist() {
        let sphere = |x: f64, y: f64, z: f64| Sphere { position: Vec3::new(x, y, z), radius: 1.0 };
        let mut spheres = Vec::new();
        for k in 0..9 {
            let half = if k == 4 { 2.0 } else { 5.0 };
            for (x, y) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
                spheres.push(sphere(x, y, 2.0 * f64::from(k)));
            }
        }
        // The planes of 9 sections over the 16 m between the outermost centers; the fifth one cuts the waist.
        let expected = 16.0 + 16.0 + std::f64::consts::PI;
        let found = smallest_section(&spheres, 2, 9);
        assert!(found <= expected && expected - found < 1.2e-3 * 24.0, "{found}, {expected}");
        assert_eq!(smallest_section(&[], 0, 8), 0.0);
    }
}
