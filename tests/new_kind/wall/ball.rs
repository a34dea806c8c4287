//! A solid ball, as an indenter.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface as Triangles;
use concordem_solver::state::surface::ClosestPoint;
use concordem_solver::state::{Surface, WallShape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{IN_TWO_DIMENSIONS, Unfit, WallKind};
use crate::schema::quantity::{Length, Number, vector};

/// A solid ball, which a servo pushes along `normal`; particles are outside.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Ball {
    /// Center, m. Required.
    pub center: [Length; 3],
    /// Radius, m. Required.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub radius: Length,
    /// Direction from the ball to the particles, a vector of any length. Required. Example: `normal = [0, 0, -1]`.
    pub normal: [Number; 3],
}

impl WallKind for Ball {
    fn faults(&self) -> Vec<Fault> {
        let zero = vector(&self.normal).norm() == 0.0;
        let help = "it points from the ball to the particles: normal = [0, 0, -1] for one above them";
        zero.then(|| Fault::range("normal", "must not be zero", help)).into_iter().collect()
    }

    fn faults_in_plane(&self) -> Vec<Fault> {
        let outside = [("center[2]", &self.center[2].si()), ("normal[2]", &self.normal[2].si())];
        let outside = outside.into_iter().filter(|(_, value)| **value != 0.0);
        outside.map(|(key, _)| Fault::conflict(key, "leaves the plane", IN_TWO_DIMENSIONS)).collect()
    }

    fn surfaces(&self, _file: Option<Triangles>) -> Result<Vec<WallShape>, Unfit> {
        Ok(vec![WallShape::rigid(Solid { center: vector(&self.center), radius: self.radius.si() })])
    }

    fn point(&self) -> Option<Vec3> {
        Some(vector(&self.center))
    }

    fn normal(&self, _face: usize) -> Option<Vec3> {
        Some(vector(&self.normal))
    }

    fn width(&self) -> Option<f64> {
        Some(2.0 * self.radius.si())
    }
}

/// Solid ball.
#[derive(Debug, Clone, PartialEq)]
struct Solid {
    /// Center, m.
    center: Vec3,
    /// Radius, m.
    radius: f64,
}

impl Surface for Solid {
    fn closest_point(&self, _element: usize, x: &Vec3) -> Option<ClosestPoint> {
        let r = x - self.center;
        let rho = r.norm();
        (rho > 0.0).then(|| ClosestPoint { normal: -r / rho, distance: rho - self.radius, interior: true })
    }

    /// At the center.
    fn distance_without_direction(&self, _x: &Vec3) -> f64 {
        -self.radius
    }

    fn span(&self, along: &Vec3) -> Option<[f64; 2]> {
        let middle = self.center.dot(along);
        Some([middle - self.radius, middle + self.radius])
    }
}
