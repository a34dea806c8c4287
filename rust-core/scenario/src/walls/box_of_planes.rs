//! The six faces of a box.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface;
use concordem_solver::state::{WallShape, surface};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{Unfit, WallKind};
use crate::schema::quantity::{Length, corner_faults, vector};

/// The six faces of a box with the particles inside; each face is a separate wall.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Box {
    /// Corner with the smallest coordinates, m. Required.
    pub minimum: [Length; 3],
    /// Corner with the largest coordinates, m. Required.
    pub maximum: [Length; 3],
}

impl WallKind for Box {
    fn faults(&self) -> Vec<Fault> {
        corner_faults(&self.minimum, &self.maximum)
    }

    fn faults_in_plane(&self) -> Vec<Fault> {
        Vec::new()
    }

    fn surfaces(&self, _file: Option<Surface>) -> Result<Vec<WallShape>, Unfit> {
        let corners = [vector(&self.minimum), vector(&self.maximum)];
        let face = |face: usize| surface::Plane { point: corners[face % 2], normal: inward(face) };
        Ok((0..6).map(face).map(WallShape::rigid).collect())
    }

    fn faces(&self) -> &'static [&'static str] {
        &[" x minimum", " x maximum", " y minimum", " y maximum", " z minimum", " z maximum"]
    }

    fn encloses(&self) -> bool {
        true
    }

    fn normal(&self, face: usize) -> Option<Vec3> {
        Some(inward(face))
    }

    fn width(&self) -> Option<f64> {
        Some((vector(&self.maximum) - vector(&self.minimum)).max())
    }
}

/// Unit normal of a face.
fn inward(face: usize) -> Vec3 {
    let mut normal = Vec3::zeros();
    normal[face / 2] = 1.0;
    if face.is_multiple_of(2) { normal } else { -normal }
}
