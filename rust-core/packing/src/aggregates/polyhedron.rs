//! Convex polyhedra of random shape.

use crate::{PackingError, Random};
use concordem_contact::math::Vec3;

/// A convex polyhedron around the origin, its centroid.
#[derive(Debug, Clone, PartialEq)]
pub struct Polyhedron {
    vertices: Vec<Vec3>,
    /// Triangles of the surface, counter-clockwise seen from outside.
    triangles: Vec<[u32; 3]>,
    /// Outward unit normal and distance from the origin of the plane of each triangle.
    planes: Vec<(Vec3, f64)>,
    volume: f64,
}

impl Polyhedron {
    /// The convex hull of at least four points (m), moved so that its centroid is the origin.
    ///
    /// Each triangle whose plane has all other points behind it is a face; faces with more than three corners are not expected
    /// from random points, and their triangles would overlap.
    ///
    /// # Errors
    /// Points that span no volume, or four of which lie in one plane of the hull.
    pub fn hull(points: &[Vec3]) -> Result<Self, PackingError> {
        let bad = |reason: &str| PackingError::BadShape { reason: reason.to_owned() };
        let count = points.len();
        let mut triangles = Vec::new();
        for i in 0..count {
            for j in i + 1..count {
                for k in j + 1..count {
                    let normal = (points[j] - points[i]).cross(&(points[k] - points[i]));
                    let others = (0..count).filter(|&p| p != i && p != j && p != k);
                    let (mut front, mut behind) = (false, false);
                    for p in others {
                        let side = normal.dot(&(points[p] - points[i]));
                        front |= side >= 0.0;
                        behind |= side <= 0.0;
                    }
                    match (front, behind) {
                        (false, true) => triangles.push([i, j, k].map(|v| v as u32)),
                        (true, false) => triangles.push([i, k, j].map(|v| v as u32)),
                        _ => {}
                    }
                }
            }
        }
        let corners: std::collections::BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        // Euler: a closed surface of triangles with v corners has 2v − 4 of them.
        if corners.len() < 4 || triangles.len() != 2 * corners.len() - 4 {
            return Err(bad("the points of the polyhedron are not in general position"));
        }
        let inside = corners.iter().map(|&v| points[v as usize]).sum::<Vec3>() / corners.len() as f64;
        let (mut volume, mut moment) = (0.0, Vec3::zeros());
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|v| points[v as usize] - inside);
            let part = a.cross(&b).dot(&c) / 6.0;
            volume += part;
            moment += (a + b + c) * (0.25 * part);
        }
        let center = inside + moment / crate::positive("the volume of the polyhedron", volume)?;
        let number: std::collections::BTreeMap<u32, u32> = corners.iter().zip(0..).map(|(&v, k)| (v, k)).collect();
        let vertices: Vec<Vec3> = corners.iter().map(|&v| points[v as usize] - center).collect();
        let triangles: Vec<[u32; 3]> = triangles.into_iter().map(|triangle| triangle.map(|v| number[&v])).collect();
        let plane = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|v| vertices[v as usize]);
            let normal = (b - a).cross(&(c - a)).normalize();
            (normal, normal.dot(&a))
        };
        let planes = triangles.iter().map(plane).collect();
        Ok(Self { vertices, triangles, planes, volume })
    }

    /// The hull of `corners` random points of an ellipsoid, of unit size: the middle one of its widths along the axes is 1.
    /// `elongation`: longest over middle axis of the ellipsoid; `flatness`: shortest over middle axis.
    ///
    /// # Errors
    /// Fewer than 4 or more than 100 corners.
    pub fn random(corners: usize, elongation: f64, flatness: f64, random: &mut Random) -> Result<Self, PackingError> {
        crate::within("the number of corners of a polyhedron", corners as f64, 4.0, 100.0)?;
        let axes = Vec3::new(elongation, 1.0, flatness);
        loop {
            let points: Vec<Vec3> = (0..corners).map(|_| direction(random).component_mul(&axes)).collect();
            let Ok(hull) = Self::hull(&points) else { continue };
            // Points of one side only make a splinter, less than 2.5 % of the ellipsoid.
            if hull.planes.iter().all(|(normal, distance)| distance - normal.dot(&hull.vertices_center()) > 0.0)
                && hull.volume > 0.025 * 4.0 / 3.0 * std::f64::consts::PI * elongation * flatness
            {
                return Ok(hull.of_unit_size());
            }
        }
    }

    fn vertices_center(&self) -> Vec3 {
        self.vertices.iter().sum::<Vec3>() / self.vertices.len() as f64
    }

    fn of_unit_size(mut self) -> Self {
        let size = middle_width(&self.vertices);
        self.vertices.iter_mut().for_each(|vertex| *vertex /= size);
        self.planes.iter_mut().for_each(|(_, distance)| *distance /= size);
        self.volume /= size * size * size;
        self
    }

    /// Corners, m.
    pub fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    /// Triangles of the surface, as indices of corners, counter-clockwise seen from outside.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Volume, m³.
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Whether a point (m) lies inside, at least `margin` (m) away from the surface.
    pub fn contains(&self, point: &Vec3, margin: f64) -> bool {
        self.planes.iter().all(|(normal, distance)| distance - normal.dot(point) >= margin)
    }
}

/// The middle one of the three widths of points along the axes.
pub(super) fn middle_width(points: &[Vec3]) -> f64 {
    let low = points.iter().fold(Vec3::repeat(f64::INFINITY), |low, x| low.inf(x));
    let high = points.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |high, x| high.sup(x));
    let mut widths: [f64; 3] = (high - low).into();
    widths.sort_by(f64::total_cmp);
    widths[1]
}

/// A random direction, uniform on the unit sphere (Marsaglia 1972).
fn direction(random: &mut Random) -> Vec3 {
    loop {
        let (x, y) = (2.0 * random.uniform() - 1.0, 2.0 * random.uniform() - 1.0);
        let s = x * x + y * y;
        if s < 1.0 {
            let root = 2.0 * (1.0 - s).sqrt();
            return Vec3::new(x * root, y * root, 1.0 - 2.0 * s);
        }
    }
}
