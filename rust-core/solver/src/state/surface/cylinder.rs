//! Infinite circular cylinders.

use super::{ClosestPoint, PARALLEL, Surface, across_edge};
use crate::state::Cell;
use concordem_contact::math::{Mat3, Vec3};

/// Circular cylinder, infinite along its axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Cylinder {
    /// A point of the axis, m.
    pub point: Vec3,
    /// Unit vector of the axis.
    pub axis: Vec3,
    /// Radius, m.
    pub radius: f64,
    /// Whether particles are inside (a vessel) or outside (a rod).
    pub inside: bool,
}

impl Surface for Cylinder {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let Self { point, axis, radius, inside } = self;
        let r = x - point;
        let radial = r - axis * r.dot(axis);
        let rho = radial.norm();
        if rho == 0.0 {
            return None;
        }
        let outward = radial / rho;
        Some(if *inside {
            ClosestPoint { normal: outward, distance: radius - rho, interior: true }
        } else {
            ClosestPoint { normal: -outward, distance: rho - radius, interior: true }
        })
    }

    fn distance_without_direction(&self, _x: &Vec3) -> f64 {
        if self.inside { self.radius } else { -self.radius }
    }

    fn span(&self, _along: &Vec3) -> Option<[f64; 2]> {
        None
    }

    fn repeats_with(&self, cell: &Cell) -> Result<(), &'static str> {
        let along = along(&self.axis, &cell.matrix).ok_or(
            "the images of a cylinder must not cut each other: in a periodic cell its axis must be parallel to an edge",
        )?;
        let others: [usize; 2] = [(along + 1) % 3, (along + 2) % 3];
        let narrowest = others.map(|k| across_edge(cell, k).1).into_iter().fold(f64::INFINITY, f64::min);
        if self.inside && 2.0 * self.radius > narrowest {
            return Err("the vessel is wider than the periodic cell, so that its images cut each other");
        }
        Ok(())
    }

    /// Of a vessel, the image that contains `x`.
    fn images_near(&self, x: &Vec3, reach: f64, cell: &Cell) -> Vec<[i64; 3]> {
        let Self { point, axis, radius, inside } = self;
        let (Some(edge), Some(inverse)) = (along(axis, &cell.matrix), cell.matrix.try_inverse()) else {
            return Vec::new();
        };
        let r = x - point;
        let place = inverse * r;
        let distance = |image: &[i64; 3]| {
            let r = r - cell.matrix * Vec3::from(image.map(|n| n as f64));
            (r - axis * r.dot(axis)).norm()
        };
        let others: [usize; 2] = [(edge + 1) % 3, (edge + 2) % 3];
        let around = [0, 1, 2].map(|k| if k == edge { 0 } else { place[k].round() as i64 });
        let mut near: Vec<[i64; 3]> = (0..9)
            .map(|k| {
                let mut image = around;
                image[others[0]] += k % 3 - 1;
                image[others[1]] += k / 3 - 1;
                image
            })
            .collect();
        if *inside {
            near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
            near.truncate(1);
            near.retain(|image| radius - distance(image) < reach);
        } else {
            near.retain(|image| distance(image) - radius < reach);
        }
        near
    }
}

/// The edge of a cell along a unit vector, if there is one.
fn along(axis: &Vec3, edges: &Mat3) -> Option<usize> {
    (0..3).find(|&k| axis.cross(&edges.column(k)).norm() < PARALLEL * edges.column(k).norm())
}
