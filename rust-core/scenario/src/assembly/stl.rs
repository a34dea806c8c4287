//! Surfaces of a scenario that are read from STL files.

use std::path::Path;

use super::{AssemblyError, unfit};
use concordem_contact::math::Vec3;
use concordem_files::paths::open_regular;
use concordem_packing::shape::Mesh;
use concordem_packing::{Surface, read_stl};
use std::io::Read;

/// A surface that the scenario names at a key.
pub(super) struct Named<'a> {
    pub(super) folder: &'a Path,
    pub(super) path: &'a str,
    /// Length of one unit of the file, m.
    pub(super) unit: f64,
    /// Key of the path.
    pub(super) key: &'a str,
}

impl Named<'_> {
    pub(super) fn fail(&self, problem: &dyn ToString) -> AssemblyError {
        unfit(self.key, format!("{}: {}", self.folder.join(self.path).display(), problem.to_string()))
    }

    /// Reads the surface.
    pub(super) fn read(&self) -> Result<Surface, AssemblyError> {
        let mut bytes = Vec::new();
        open_regular(&self.folder.join(self.path))
            .and_then(|mut file| file.read_to_end(&mut bytes))
            .map_err(|error| self.fail(&error))?;
        read_stl(&bytes, self.unit).map_err(|error| self.fail(&error))
    }

    /// Reads a closed surface.
    pub(super) fn closed(&self) -> Result<Mesh, AssemblyError> {
        let Surface { vertices, triangles } = self.read()?;
        Mesh::new(vertices, triangles).map_err(|error| self.fail(&error))
    }

    /// Reads the corners of all triangles that have an area.
    pub(super) fn triangles(&self) -> Result<Vec<[Vec3; 3]>, AssemblyError> {
        let triangles = self.read()?.triangles_with_area();
        if triangles.is_empty() {
            return Err(self.fail(&"none of its triangles has an area"));
        }
        Ok(triangles)
    }
}
