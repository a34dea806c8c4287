//! A flat plate: a rectangle or a disc.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface as Triangles;
use concordem_solver::state::surface::{ClosestPoint, SEAM, edge, face, half_circle};
use concordem_solver::state::{Surface, WallShape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{Unfit, WallKind};
use crate::schema::quantity::{Length, Number, Quantity, vector};

/// Largest cosine of the angle between the edges of a rectangle.
const PERPENDICULAR: f64 = 1e-9;

/// A flat plate without thickness; particles touch it from both sides. A rectangle has `edges`, a disc `normal` and `radius`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plate {
    /// Center, m. Required.
    pub center: [Length; 3],
    /// Two neighboring edges of a rectangle, vectors perpendicular to each other, m.
    /// Example: `edges = [["20 mm", 0, 0], [0, "10 mm", 0]]`.
    pub edges: Option<[[Length; 3]; 2]>,
    /// Direction across a disc, a vector of any length. Example: `normal = [0, 0, 1]`.
    pub normal: Option<[Number; 3]>,
    /// Radius of a disc, m.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Option<Length>,
}

impl WallKind for Plate {
    fn faults(&self) -> Vec<Fault> {
        let of_disc = [("normal", self.normal.is_some()), ("radius", self.radius.is_some())];
        let help = "give `edges` of a rectangle, or `normal` and `radius` of a disc";
        if let Some(edges) = &self.edges {
            let given = of_disc.into_iter().filter(|(_, given)| *given);
            let mut faults: Vec<Fault> =
                given.map(|(name, _)| Fault::conflict(name, "the plate is a rectangle with `edges`", help)).collect();
            faults.extend(fault_of_edges(edges.each_ref().map(vector)));
            return faults;
        }
        let mut faults = Vec::new();
        match of_disc.map(|(_, given)| given) {
            [false, false] => faults.push(Fault::missing("", "the plate has no outline", help)),
            [true, false] => faults.push(Fault::missing("", "the disc has no `radius`", help)),
            [false, true] => faults.push(Fault::missing("", "the disc has no `normal`", help)),
            [true, true] => {}
        }
        if self.normal.as_ref().is_some_and(|normal| vector(normal).norm() == 0.0) {
            let help = "give a direction across the disc: normal = [0, 0, 1]";
            faults.push(Fault::range("normal", "must not be zero", help));
        }
        faults
    }

    fn faults_in_plane(&self) -> Vec<Fault> {
        let Self { center, edges, normal, radius } = self;
        let upright = |[a, b]: &[[Length; 3]; 2]| {
            let across = |edge: &[Length; 3]| edge[0].si() == 0.0 && edge[1].si() == 0.0;
            (across(a) && b[2].si() == 0.0) || (across(b) && a[2].si() == 0.0)
        };
        let mut faults = Vec::new();
        if center[2].si() != 0.0 {
            let help = "write 0; in two dimensions the plate is a line in the plane";
            faults.push(Fault::conflict("center[2]", "lies outside the plane", help));
        }
        let outlined = edges.is_some() || normal.is_some() || radius.is_some();
        if outlined && !edges.as_ref().is_some_and(upright) {
            let help = "give edges of which one is across the plane: edges = [[\"20 mm\", 0, 0], [0, 0, \"1 mm\"]]";
            faults.push(Fault::conflict("", "the plate is not perpendicular to the plane z = 0", help));
        }
        faults
    }

    fn surfaces(&self, _file: Option<Triangles>) -> Result<Vec<WallShape>, Unfit> {
        let center = vector(&self.center);
        let shape = if let Some(edges) = &self.edges {
            let half_edges = edges.each_ref().map(|edge| 0.5 * vector(edge));
            let normal = half_edges[0].cross(&half_edges[1]).normalize();
            WallShape::rigid(Rectangle { center, normal, half_edges })
        } else {
            let normal = self.axis().unwrap_or_default();
            WallShape::rigid(Disc { center, normal, radius: self.radius.map_or(0.0, Quantity::si) })
        };
        Ok(vec![shape])
    }

    fn axis(&self) -> Option<Vec3> {
        self.normal.as_ref().map(|normal| vector(normal).normalize())
    }

    /// A disc turns; one without a normal is refused as such.
    fn can_turn(&self) -> bool {
        self.edges.is_none()
    }

    fn point(&self) -> Option<Vec3> {
        Some(vector(&self.center))
    }

    fn width(&self) -> Option<f64> {
        Some(match &self.edges {
            Some(edges) => edges.iter().map(|edge| vector(edge).norm()).fold(0.0, f64::max),
            None => 2.0 * self.radius.map_or(0.0, Quantity::si),
        })
    }
}

/// The edges of a rectangle are perpendicular.
fn fault_of_edges([a, b]: [Vec3; 2]) -> Option<Fault> {
    if a.norm() == 0.0 || b.norm() == 0.0 {
        return Some(Fault::range("edges", "an edge is zero", "give two vectors, each as long as the edge"));
    }
    (a.dot(&b).abs() > PERPENDICULAR * a.norm() * b.norm()).then(|| {
        let help = "the edges of a rectangle are perpendicular; for another outline use \"facets\"";
        let angle = (a.dot(&b) / (a.norm() * b.norm())).acos().to_degrees();
        let message = format!("are not perpendicular to each other: they meet at {angle:.9} degrees");
        Fault::range("edges", message, help)
    })
}

/// Flat rectangle without thickness, touched from both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Rectangle {
    /// Center, m.
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Vectors from the center to the middles of two neighboring edges, perpendicular to each other and to the normal, m.
    pub half_edges: [Vec3; 2],
}

impl Surface for Rectangle {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let Self { center, normal, half_edges } = self;
        let r = x - center;
        let place = half_edges.map(|edge| r.dot(&edge) / edge.norm_squared());
        if place.iter().all(|t| t.abs() <= 1.0) {
            let interior = place.iter().all(|t| t.abs() < 1.0 - SEAM);
            return face(normal, r.dot(normal), interior);
        }
        let [s, t] = place.map(|t| t.clamp(-1.0, 1.0));
        edge(half_edges[0] * s + half_edges[1] * t - r)
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        let [a, b] = self.half_edges.map(|half| half.dot(along).abs());
        let middle = self.center.dot(along);
        Some([middle - (a + b), middle + (a + b)])
    }
}

/// Flat disc without thickness, touched from both sides.
#[derive(Debug, Clone, PartialEq)]
pub struct Disc {
    /// Center, m.
    pub center: Vec3,
    /// Unit normal.
    pub normal: Vec3,
    /// Radius, m.
    pub radius: f64,
}

impl Surface for Disc {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let Self { center, normal, radius } = self;
        let r = x - center;
        let height = r.dot(normal);
        let radial = r - normal * height;
        let rho = radial.norm();
        if rho <= *radius {
            return face(normal, height, true);
        }
        edge(radial * (radius / rho - 1.0) - normal * height)
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        let (middle, half) = (self.center.dot(along), half_circle(&self.normal, self.radius, along));
        Some([middle - half, middle + half])
    }
}
