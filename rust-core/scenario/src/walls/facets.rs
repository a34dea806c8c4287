//! Rigid triangles of a file.

use concordem_contact::law::Fault;
use concordem_contact::math::Vec3;
use concordem_packing::Surface;
use concordem_solver::state::{WallShape, surface};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{NamedFile, Unfit, WallKind};
use crate::schema::quantity::Length;

/// Triangles of an STL file; particles touch them from both sides.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Facets {
    /// Path of the STL file, relative to the scenario. Required. Example: `path = "hopper.stl"`.
    pub path: String,
    /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
    #[serde(default = "one_meter")]
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unit: Length,
}

fn one_meter() -> Length {
    Length::new(1.0)
}

impl WallKind for Facets {
    fn faults_in_plane(&self) -> Vec<Fault> {
        Vec::new()
    }

    /// Triangles without an area have no surface; their edges belong to their neighbors.
    fn surfaces(&self, file: Option<Surface>) -> Result<Vec<WallShape>, Unfit> {
        if let Some(problem) = file.as_ref().and_then(Surface::repeated) {
            return Err(("path", problem));
        }
        let triangles: Vec<[Vec3; 3]> = file.map_or_else(Vec::new, |file| file.triangles_with_area());
        if triangles.is_empty() {
            return Err(("path", "none of its triangles has an area".to_owned()));
        }
        Ok(vec![WallShape::rigid(surface::Facets { triangles })])
    }

    fn file(&self) -> Option<NamedFile<'_>> {
        Some(NamedFile { path: &self.path, unit: self.unit.si() })
    }
}
