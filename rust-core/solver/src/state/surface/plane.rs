//! Planes.

use super::{ClosestPoint, PARALLEL, Surface};
use crate::state::Cell;
use concordem_contact::math::{Mat3, Vec3};

/// Solid half-space behind a plane. In a periodic cell, a plane across one of the edges is a sheet.
#[derive(Debug, Clone, PartialEq)]
pub struct Plane {
    /// A point of the surface, m.
    pub point: Vec3,
    /// Unit normal, pointing out of the wall towards the particles.
    pub normal: Vec3,
}

impl Surface for Plane {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let distance = (x - self.point).dot(&self.normal);
        Some(ClosestPoint { normal: -self.normal, distance, interior: true })
    }

    /// A plane that is steep against the direction does not bound the space along it.
    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        (self.normal.dot(along).abs() > 0.5).then(|| [self.point.dot(along); 2])
    }

    fn is_sheet_in_cell(&self) -> bool {
        true
    }

    fn repeats_with(&self, cell: &Cell) -> Result<(), &'static str> {
        across(&self.normal, &cell.matrix)
            .map(|_| ())
            .ok_or("the images of a plane must not cut each other: in a periodic cell it must be parallel to two edges")
    }

    fn images_near(&self, x: &Vec3, reach: f64, cell: &Cell) -> Vec<[i64; 3]> {
        let Some(edge) = across(&self.normal, &cell.matrix) else { return Vec::new() };
        let period = self.normal.dot(&cell.matrix.column(edge));
        let (place, reach) = ((x - self.point).dot(&self.normal) / period, reach / period.abs());
        let image = |number: i64| std::array::from_fn(|k| if k == edge { number } else { 0 });
        ((place - reach).ceil() as i64..=(place + reach).floor() as i64).map(image).collect()
    }
}

/// The edge of a cell that a plane with this normal cuts, if the plane is parallel to the other two.
fn across(normal: &Vec3, edges: &Mat3) -> Option<usize> {
    let cut = |k: &usize| normal.dot(&edges.column(*k)).abs() > PARALLEL * edges.column(*k).norm();
    let mut edges_cut = (0..3).filter(cut);
    edges_cut.next().filter(|_| edges_cut.next().is_none())
}
