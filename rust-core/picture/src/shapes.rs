//! What can be drawn.

use concordem_contact::math::Vec3;

use crate::camera::View;
use crate::image::Color;

/// A sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// Center, m.
    pub center: Vec3,
    /// Radius, m.
    pub radius: f64,
    /// Its color.
    pub color: Color,
}

/// A rod with round ends, such as a bond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rod {
    /// Ends, m.
    pub ends: [Vec3; 2],
    /// Radius, m.
    pub radius: f64,
    /// Its color.
    pub color: Color,
}

/// A flat convex polygon, such as the face of a crack.
#[derive(Debug, Clone, PartialEq)]
pub struct Polygon {
    /// Corners in their order, m.
    pub corners: Vec<Vec3>,
    /// Its color.
    pub color: Color,
}

/// A line of constant width on the image, such as the edge of a cell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Ends, m.
    pub ends: [Vec3; 2],
    /// Its color.
    pub color: Color,
}

/// A plane that removes what lies on its outer side.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cut {
    /// Unit normal, to the side that is removed.
    pub normal: Vec3,
    /// Distance of the plane from the origin along the normal, m.
    pub distance: f64,
}

impl Cut {
    /// Whether the point lies on the side that is removed.
    pub fn removes(&self, x: &Vec3) -> bool {
        x.dot(&self.normal) > self.distance
    }
}

/// Bodies that hide each other.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Layer {
    /// Spheres.
    pub spheres: Vec<Sphere>,
    /// Rods.
    pub rods: Vec<Rod>,
    /// Polygons.
    pub polygons: Vec<Polygon>,
    /// Lines.
    pub lines: Vec<Line>,
    /// Planes that cut spheres open, and remove rods and polygons whose middle lies outside.
    pub cuts: Vec<Cut>,
    /// Whether spheres are discs of one color with a dark rim, as in the plane.
    pub is_flat: bool,
}

impl Layer {
    /// Lowest and highest coordinates in a view, m; `None` if it is empty.
    pub fn extent(&self, view: &View) -> Option<[Vec3; 2]> {
        let spheres = self.spheres.iter().map(|sphere| (sphere.center, sphere.radius));
        let rods = self.rods.iter().flat_map(|rod| rod.ends.map(|end| (end, rod.radius)));
        let corners = self.polygons.iter().flat_map(|polygon| polygon.corners.iter().map(|corner| (*corner, 0.0)));
        let lines = self.lines.iter().flat_map(|line| line.ends.map(|end| (end, 0.0)));
        let all = spheres.chain(rods).chain(corners).chain(lines);
        all.fold(None, |extent: Option<[Vec3; 2]>, (x, radius)| {
            let (at, reach) = (view.of(&x), Vec3::repeat(radius));
            let [low, high] = extent.unwrap_or([at, at]);
            Some([low.inf(&(at - reach)), high.sup(&(at + reach))])
        })
    }
}
