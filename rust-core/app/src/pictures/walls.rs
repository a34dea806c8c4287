//! Walls of a result: their surfaces from the scenario, in the places where they are at the end.

use std::collections::HashMap;
use std::io::Read;
use std::path::Path;

use concordem_contact::math::Vec3;
use concordem_contact::wall::ClosestPoint;
use concordem_files::paths::open_regular;
use concordem_packing::{Surface, read_stl};
use concordem_picture::Sheet;
use concordem_scenario::schema::{Loading, Scenario};
use concordem_scenario::walls::{NamedFile, WallKind};
use concordem_solver::state::WallShape;
use concordem_solver::state::columns::ColumnData;
use concordem_solver::state::surface::Plane;

use super::PictureError;
use super::fields::reals;
use crate::output::ResultFile;
use crate::output::frames::Frame;

/// A wall in its place.
pub(super) struct Placed {
    pub name: String,
    /// Whether it has been there from the start.
    pub stays: bool,
    shape: WallShape,
    displacement: Vec3,
}

/// One surface of a wall, or one of its triangles.
pub(super) struct Element<'a> {
    wall: &'a Placed,
    number: usize,
}

impl Sheet for Element<'_> {
    fn closest(&self, x: &Vec3) -> Option<ClosestPoint> {
        self.wall.shape.surface().closest_point(self.number, &(x - self.wall.displacement))
    }
}

impl Placed {
    /// Its elements, with the balls around them.
    pub(super) fn elements(&self) -> impl Iterator<Item = (Element<'_>, Option<(Vec3, f64)>)> {
        let surface = self.shape.surface();
        let ball = move |number| surface.ball(number).map(|(center, radius)| (center + self.displacement, radius));
        (0..surface.elements()).map(move |number| (Element { wall: self, number }, ball(number)))
    }
}

/// The walls of a result. `first`: its first snapshot; `notes`: what cannot be drawn.
///
/// # Errors
/// The state of the walls cannot be read.
pub(super) fn of(
    result: &ResultFile,
    scenario: &Scenario,
    folder: &Path,
    first: &Frame,
    notes: &mut Vec<String>,
) -> Result<Vec<Placed>, PictureError> {
    let names = scenario.wall_names();
    if names.is_empty() {
        return Ok(Vec::new());
    }
    let state: HashMap<String, _> = result.table("state/walls")?.into_iter().collect();
    let mut shapes: Vec<Option<WallShape>> = Vec::new();
    for wall in &scenario.walls {
        let kind = wall.shape.kind();
        let made = read(kind, folder).and_then(|file| kind.surfaces(file).map_err(|(_, problem)| problem));
        match made {
            Ok(surfaces) => shapes.extend(surfaces.into_iter().map(Some)),
            Err(problem) => {
                let from = shapes.len();
                notes.push(format!("the wall “{}” is not drawn: {problem}", names[from]));
                shapes.extend(kind.faces().iter().map(|_| None));
            }
        }
    }
    match &scenario.loading {
        Loading::Platens { axis, .. } => shapes.extend(platens(first, axis.index()).map(Some)),
        _ if names.len() > shapes.len() => {
            notes.push("the supports and rollers of the loading are not drawn".to_owned());
        }
        _ => {}
    }
    let mut walls = Vec::new();
    for (k, (shape, name)) in shapes.into_iter().zip(names).enumerate() {
        let Some(mut shape) = shape else { continue };
        let reals = |name: &str| match state.get(name).map(|column| &column.data) {
            Some(ColumnData::F64(values)) => &values[..],
            _ => &[],
        };
        let moved = reals(&k.to_string());
        let vector = |at: usize| moved.get(at..at + 3).map_or_else(Vec3::zeros, Vec3::from_column_slice);
        let (displacement, velocity) = (vector(0), vector(3));
        let mut stays = displacement == Vec3::zeros() && velocity == Vec3::zeros();
        if let WallShape::Mesh(mesh) = &mut shape {
            let vertices = reals(&format!("{k}_vertices"));
            for (vertex, row) in mesh.position.iter_mut().zip(vertices.chunks_exact(12)) {
                let now = Vec3::new(row[0], row[1], row[2]);
                stays &= now == *vertex;
                *vertex = now;
            }
        }
        walls.push(Placed { name, stays, shape, displacement });
    }
    Ok(walls)
}

/// The file of a wall.
fn read(kind: &dyn WallKind, folder: &Path) -> Result<Option<Surface>, String> {
    let Some(NamedFile { path, unit }) = kind.file() else { return Ok(None) };
    let path = folder.join(path);
    let problem = |error: &dyn std::fmt::Display| format!("{}: {error}", path.display());
    let mut bytes = Vec::new();
    open_regular(&path).and_then(|mut file| file.read_to_end(&mut bytes)).map_err(|error| problem(&error))?;
    read_stl(&bytes, unit).map(Some).map_err(|error| problem(&error))
}

/// The plates of the loading at the start: they touch the outermost particles.
fn platens(first: &Frame, axis: usize) -> [WallShape; 2] {
    let places = first.points.iter().skip(axis).step_by(3).zip(reals(first, "radius"));
    let [low, high] = places.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (x, radius)| {
        [low.min(x - radius), high.max(x + radius)]
    });
    [(low, 1.0), (high, -1.0)].map(|(at, sign)| {
        let (mut point, mut normal) = (Vec3::zeros(), Vec3::zeros());
        (point[axis], normal[axis]) = (at, sign);
        WallShape::rigid(Plane { point, normal })
    })
}
