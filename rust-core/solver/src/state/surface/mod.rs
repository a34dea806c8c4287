//! Surfaces of walls: a [`Surface`] has its own file, here those that packings and loadings use, elsewhere those of other kinds of walls.
//!
//! In a periodic cell, which must be at rest, walls have images like particles: image i is the wall moved by `H i`.

mod cylinder;
mod plane;
mod triangles;

pub use concordem_contact::wall::ClosestPoint;
pub use cylinder::Cylinder;
pub use plane::Plane;
pub use triangles::Facets;

use super::Cell;
use concordem_contact::math::Vec3;
use std::fmt::Debug;

/// Part of a face at its edge, over half of its length, whose points count as points of the edge: where two periodic images of a wall meet,
/// one of two edges acts, but two faces would both act.
pub const SEAM: f64 = 1e-9;

/// Sine below which two directions are parallel.
const PARALLEL: f64 = 1e-9;

/// A surface that particles touch, at the place where its wall was put. Bounded ones say where they begin and end along any direction
/// ([`Self::span`]), and then repeat with periodic cells, too; triangles are elements with a ball around each.
pub trait Surface: Debug + Send + Sync {
    /// Closest point of element `element` to the point `x` (m); `None` where its direction is undefined, as on an axis. It changes
    /// continuously over edges and rims.
    fn closest_point(&self, element: usize, x: &Vec3) -> Option<ClosestPoint>;

    /// Distance (m), negative inside a solid wall, of a point (m) where [`Self::closest_point`] is `None`. By default the point lies on
    /// the surface.
    fn distance_without_direction(&self, _x: &Vec3) -> f64 {
        0.0
    }

    /// Its lowest and highest place along the unit vector `along`, m; `None` where it has no end, or does not bound the space.
    fn span(&self, along: &Vec3) -> Option<[f64; 2]>;

    /// Number of elements, which particles touch one by one.
    fn elements(&self) -> usize {
        1
    }

    /// Center and radius (m) of a ball around an element, for the neighbor search. `None`: the surface is one element, and maybe large.
    fn ball(&self, _element: usize) -> Option<(Vec3, f64)> {
        None
    }

    /// Whether in a periodic cell it is a sheet with two sides, because the next image of the space in front lies behind it.
    fn is_sheet_in_cell(&self) -> bool {
        false
    }

    /// Whether it repeats with a periodic cell. By default it has to fit into the cell.
    ///
    /// # Errors
    /// What prevents it.
    fn repeats_with(&self, cell: &Cell) -> Result<(), &'static str> {
        let fits = (0..3).all(|edge| {
            let (normal, width) = across_edge(cell, edge);
            self.span(&normal).is_some_and(|[low, high]| high - low <= width * (1.0 + PARALLEL))
        });
        fits.then_some(()).ok_or("the wall is longer than the periodic cell is wide, so that its images cut each other")
    }

    /// Images of a surface without [`Self::ball`] nearer to the point `x` (m) than `reach` (m). Their numbers may exceed the range of the
    /// flags of a contact. By default those of a bounded surface.
    fn images_near(&self, x: &Vec3, reach: f64, cell: &Cell) -> Vec<[i64; 3]> {
        let numbers: [Vec<i64>; 3] = std::array::from_fn(|edge| {
            let (normal, width) = across_edge(cell, edge);
            let Some([low, high]) = self.span(&normal) else { return Vec::new() };
            let place = x.dot(&normal);
            let (first, last) = ((place - high - reach) / width, (place - low + reach) / width);
            (first.ceil() as i64..=last.floor() as i64).collect()
        });
        let mut near = Vec::new();
        for &i in &numbers[0] {
            for &j in &numbers[1] {
                near.extend(numbers[2].iter().map(|&k| [i, j, k]));
            }
        }
        near.retain(|image| {
            let shift = cell.matrix * Vec3::from(image.map(|n| n as f64));
            distance(self, 0, &(x - shift)) < reach
        });
        near
    }
}

/// Distance of the point `x` (m) from element `element`, m, negative behind it; also where [`Surface::closest_point`] is `None`.
pub(super) fn distance<S: Surface + ?Sized>(surface: &S, element: usize, x: &Vec3) -> f64 {
    let found = surface.closest_point(element, x);
    found.map_or_else(|| surface.distance_without_direction(x), |found| found.distance)
}

/// Unit normal of the face of a cell that edge `edge` crosses, towards its end, and the distance of the two faces, m.
fn across_edge(cell: &Cell, edge: usize) -> (Vec3, f64) {
    let column = |k: usize| cell.matrix.column(k % 3).into_owned();
    let normal = column(edge + 1).cross(&column(edge + 2)).normalize();
    let width = normal.dot(&column(edge));
    (normal * width.signum(), width.abs())
}

/// A vector from a center, m, in parts along and across an axis.
pub struct Cylindrical {
    /// Part along the axis.
    pub along: f64,
    /// The vector across the axis.
    pub radial: Vec3,
    /// Length of `radial`.
    pub rho: f64,
}

impl Cylindrical {
    /// Parts of the vector `r` (m) along and across the unit vector `axis`.
    pub fn of(r: &Vec3, axis: &Vec3) -> Self {
        let along = r.dot(axis);
        let radial = r - axis * along;
        Self { along, radial, rho: radial.norm() }
    }
}

/// Half of the extent along the unit vector `along` of a circle about the unit vector `axis`, m.
pub fn half_circle(axis: &Vec3, radius: f64, along: &Vec3) -> f64 {
    radius * (1.0 - axis.dot(along).powi(2)).max(0.0).sqrt()
}

/// The point below a center at the height `height` (m, with its sign) over a face with this unit normal, touched from both sides.
pub fn face(normal: &Vec3, height: f64, interior: bool) -> Option<ClosestPoint> {
    (height != 0.0).then(|| ClosestPoint { normal: -normal * height.signum(), distance: height.abs(), interior })
}

/// The point of an edge or rim at the vector `to` (m) from the center of the particle.
pub fn edge(to: Vec3) -> Option<ClosestPoint> {
    let distance = to.norm();
    (distance > 0.0).then(|| ClosestPoint { normal: to / distance, distance, interior: false })
}
