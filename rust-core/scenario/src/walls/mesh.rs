//! Triangles whose vertices move.

use concordem_contact::law::Fault;
use concordem_packing::Surface;
use concordem_solver::state::{self, WallShape};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::kind::{NamedFile, Unfit, WallKind};
use crate::schema::quantity::{Length, Quantity, vector};

/// Triangles whose vertices move with `motion`, or by calls from Python; particles touch them from both sides. Give `path`, or
/// `vertices` and `triangles`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Mesh {
    /// Path of an STL file, relative to the scenario. Its vertices are numbered in the order in which they first appear. Example:
    /// `path = "drum.stl"`.
    pub path: Option<String>,
    /// Length of one unit of the file, m; default: 1 m. Example for a file in millimeters: `unit = "1 mm"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub unit: Option<Length>,
    /// Positions of the vertices at the start, m. Example: `vertices = [[0, 0, 0], ["1 mm", 0, 0], [0, "1 mm", 0]]`.
    pub vertices: Option<Vec<[Length; 3]>>,
    /// Vertices of each triangle, counted from 0. Example: `triangles = [[0, 1, 2]]`.
    pub triangles: Option<Vec<[u32; 3]>>,
}

impl WallKind for Mesh {
    /// A mesh is read, or given by its vertices and triangles. Its geometry is checked when it is built.
    fn faults(&self) -> Vec<Fault> {
        let mut faults = Vec::new();
        match (self.path.is_some(), self.vertices.is_some(), self.triangles.is_some()) {
            (true, false, false) | (false, true, true) => {}
            (true, vertices, _) => {
                let name = if vertices { "vertices" } else { "triangles" };
                let help = "keep `path`, or `vertices` and `triangles`";
                faults.push(Fault::conflict(name, "the mesh is read from `path`, too", help));
            }
            (false, ..) => {
                let help = "give `path`, or both `vertices` and `triangles`";
                faults.push(Fault::missing("", "the mesh has neither a file nor vertices with triangles", help));
            }
        }
        if self.unit.is_some() && self.path.is_none() {
            faults.push(Fault::conflict("unit", "is the unit of a file, but there is none", "remove `unit`"));
        }
        faults
    }

    /// Its triangles are checked when they are read.
    fn faults_in_plane(&self) -> Vec<Fault> {
        Vec::new()
    }

    fn surfaces(&self, file: Option<Surface>) -> Result<Vec<WallShape>, Unfit> {
        let surface = match (file, &self.vertices, &self.triangles) {
            (Some(file), ..) => file,
            (None, Some(vertices), Some(triangles)) => {
                Surface { vertices: vertices.iter().map(vector).collect(), triangles: triangles.clone() }
            }
            _ => return Err(("", "give `path`, or both `vertices` and `triangles`".to_owned())),
        };
        if let Some(problem) = surface.repeated() {
            return Err(("", problem));
        }
        let Surface { vertices, triangles } = surface;
        let mesh = state::Mesh::new(vertices, triangles).map_err(|error| ("", error.to_string()))?;
        Ok(vec![WallShape::Mesh(mesh)])
    }

    fn file(&self) -> Option<NamedFile<'_>> {
        Some(NamedFile { path: self.path.as_deref()?, unit: self.unit.map_or(1.0, Quantity::si) })
    }

    fn is_mesh(&self) -> bool {
        true
    }

    fn vertices(&self) -> Option<usize> {
        self.vertices.as_ref().map(Vec::len)
    }
}
