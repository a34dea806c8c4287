//! An infinite plane.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface;
use concordem_solver::state::{WallShape, surface};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{IN_TWO_DIMENSIONS, Unfit, WallKind};
use crate::schema::quantity::{Length, Number, vector};

/// An infinite plane.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Plane {
    /// A point on the plane, m. Required.
    pub point: [Length; 3],
    /// Direction from the wall to the particles, a vector of any length. Required. Example: `normal = [0, 0, 1]`.
    pub normal: [Number; 3],
}

impl WallKind for Plane {
    fn faults(&self) -> Vec<Fault> {
        let help = "it points from the wall to the particles: normal = [0, 0, 1] for a floor";
        let zero = vector(&self.normal).norm() == 0.0;
        zero.then(|| Fault::range("normal", "must not be zero", help)).into_iter().collect()
    }

    fn faults_in_plane(&self) -> Vec<Fault> {
        let leaning = self.normal[2].si() != 0.0;
        let fault = || Fault::conflict("normal[2]", "points out of the plane", IN_TWO_DIMENSIONS);
        leaning.then(fault).into_iter().collect()
    }

    fn surfaces(&self, _file: Option<Surface>) -> Result<Vec<WallShape>, Unfit> {
        let normal = vector(&self.normal);
        let plane = surface::Plane { point: vector(&self.point), normal: normal / normal.norm() };
        Ok(vec![WallShape::rigid(plane)])
    }

    fn axis(&self) -> Option<Vec3> {
        Some(vector(&self.normal).normalize())
    }

    fn can_turn_in_plane(&self) -> bool {
        false
    }

    fn has_own_axis(&self) -> bool {
        false
    }

    fn point(&self) -> Option<Vec3> {
        Some(vector(&self.point))
    }

    fn normal(&self, _face: usize) -> Option<Vec3> {
        Some(vector(&self.normal))
    }

    fn unbounded(&self) -> Option<&'static str> {
        Some("point")
    }

    fn remedy(&self) -> &'static str {
        "move the wall or the particle, or turn the normal of the wall toward the particles"
    }
}
