//! Walls of a scenario.

use std::io::BufReader;
use std::path::Path;

use super::histories::largest;
use super::{AssemblyError, material_index, unfit};
use crate::files::open_regular;
use crate::schema::quantity::vector;
use crate::schema::{self, Scenario, Side};
use concordem_contact::math::Vec3;
use concordem_solver::state::{State, Wall, WallShape};

/// Adds the walls of `[[wall]]`.
pub(super) fn add(scenario: &Scenario, folder: &Path, state: &mut State) -> Result<(), AssemblyError> {
    for (number, wall) in scenario.walls.iter().enumerate() {
        let name = wall.name.clone().unwrap_or_else(|| format!("wall {number}"));
        // The fastest motion bounds the time step; `histories::build` sets that of the first step.
        let velocity = vector(&wall.velocity) * largest(scenario, wall.history.as_deref());
        let material = material_index(scenario, &wall.material);
        for (name, shape) in shapes(name, &wall.shape, folder)? {
            state.walls.push(new(name, shape, material, velocity));
        }
    }
    if let Some(cell) = &state.cell {
        for wall in &state.walls {
            wall.repeats_with(cell).map_err(|problem| {
                unfit(
                    "wall.shape",
                    format!("wall `{}`: {problem}; or use \"facets\", or a packing without a cell", wall.name),
                )
            })?;
        }
    }
    if !state.walls.is_empty() && state.wall_contacts.is_none() {
        let message = "walls need a contact law; with \"none\", particles pass through them";
        return Err(unfit("contacts.law", message.into()));
    }
    Ok(())
}

/// A wall at its initial position.
pub(super) fn new(name: String, shape: WallShape, material: u16, velocity: Vec3) -> Wall {
    Wall { name, shape, material, displacement: Vec3::zeros(), velocity, force: Vec3::zeros(), torque: Vec3::zeros() }
}

/// Names and surfaces of a wall; a box has six.
fn shapes(name: String, shape: &schema::WallShape, folder: &Path) -> Result<Vec<(String, WallShape)>, AssemblyError> {
    Ok(match shape {
        schema::WallShape::Plane { point, normal } => {
            let normal = vector(normal);
            vec![(name, WallShape::Plane { point: vector(point), normal: normal / normal.norm() })]
        }
        schema::WallShape::Box { minimum, maximum } => {
            let (low, high) = (vector(minimum), vector(maximum));
            let mut faces = Vec::with_capacity(6);
            for (axis, label) in ["x", "y", "z"].into_iter().enumerate() {
                let mut normal = Vec3::zeros();
                normal[axis] = 1.0;
                faces.push((format!("{name} {label} minimum"), WallShape::Plane { point: low, normal }));
                faces.push((format!("{name} {label} maximum"), WallShape::Plane { point: high, normal: -normal }));
            }
            faces
        }
        schema::WallShape::Cylinder { center, axis, radius, side } => {
            let mut direction = Vec3::zeros();
            direction[axis.index()] = 1.0;
            let (point, inside) = (vector(center), *side == Side::Inside);
            vec![(name, WallShape::Cylinder { point, axis: direction, radius: radius.si(), inside })]
        }
        schema::WallShape::Facets { path, unit } => {
            vec![(name, WallShape::Facets { triangles: triangles(folder, path, unit.si())? })]
        }
    })
}

/// Triangles of an STL file, scaled to meters.
fn triangles(folder: &Path, path: &str, unit: f64) -> Result<Vec<[Vec3; 3]>, AssemblyError> {
    let file = folder.join(path);
    let fail = |message: String| AssemblyError::File { path: file.display().to_string(), message };
    let mut reader = BufReader::new(open_regular(&file).map_err(|error| fail(error.to_string()))?);
    let mesh = stl_io::read_stl(&mut reader).map_err(|error| fail(format!("not a readable STL file: {error}")))?;
    let corner = |index: usize| {
        mesh.vertices
            .get(index)
            .map(|v| Vec3::new(f64::from(v[0]), f64::from(v[1]), f64::from(v[2])) * unit)
            .ok_or_else(|| fail(format!("refers to vertex {index}, which does not exist")))
    };
    mesh.faces.iter().map(|f| Ok([corner(f.vertices[0])?, corner(f.vertices[1])?, corner(f.vertices[2])?])).collect()
}
