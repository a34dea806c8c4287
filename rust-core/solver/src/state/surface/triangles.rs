//! Surfaces of triangles, rigid or with moving vertices.

use super::{ClosestPoint, Surface};
use crate::state::mesh::Mesh;
use crate::state::triangle::closest_on_triangle;
use concordem_contact::math::Vec3;

/// Rigid triangles, which particles touch from both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Facets {
    /// Corners, m.
    pub triangles: Vec<[Vec3; 3]>,
}

impl Surface for Facets {
    fn closest_point(&self, element: usize, x: &Vec3) -> Option<ClosestPoint> {
        on_triangle(x, &self.triangles[element])
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        span_of(self.triangles.iter().flatten(), along)
    }

    fn elements(&self) -> usize {
        self.triangles.len()
    }

    fn ball(&self, element: usize) -> Option<(Vec3, f64)> {
        Some(ball_around(&self.triangles[element]))
    }

    /// Its triangles have their images each.
    fn repeats_with(&self, _cell: &super::Cell) -> Result<(), &'static str> {
        Ok(())
    }
}

impl Surface for Mesh {
    fn closest_point(&self, element: usize, x: &Vec3) -> Option<ClosestPoint> {
        on_triangle(x, &self.corners(element))
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        span_of(self.position.iter(), along)
    }

    fn elements(&self) -> usize {
        self.triangles().len()
    }

    fn ball(&self, element: usize) -> Option<(Vec3, f64)> {
        Some(ball_around(&self.corners(element)))
    }

    /// Its triangles have their images each.
    fn repeats_with(&self, _cell: &super::Cell) -> Result<(), &'static str> {
        Ok(())
    }
}

fn span_of<'a>(corners: impl Iterator<Item = &'a Vec3>, along: &Vec3) -> Option<[f64; 2]> {
    let span = corners
        .map(|corner| corner.dot(along))
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], place| [low.min(place), high.max(place)]);
    (span[0] <= span[1]).then_some(span)
}

fn ball_around(t: &[Vec3; 3]) -> (Vec3, f64) {
    let center = (t[0] + t[1] + t[2]) / 3.0;
    let radius = t.iter().map(|c| (c - center).norm()).fold(0.0, f64::max);
    (center, radius)
}

/// Closest point of a triangle as seen from `x`; `None` if `x` lies on it.
fn on_triangle(x: &Vec3, corners: &[Vec3; 3]) -> Option<ClosestPoint> {
    let (nearest, interior, _) = closest_on_triangle(x, corners);
    let to = nearest - x;
    let distance = to.norm();
    (distance > 0.0).then(|| ClosestPoint { normal: to / distance, distance, interior })
}
