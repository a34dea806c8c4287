//! Export for OVITO and LAMMPS: a data file with the first snapshot and its bonds, a dump with the particles of all snapshots, and a local
//! dump with the bonds of all snapshots; a script of OVITO that shows them. Ids count from 1. A periodic cell is the box of LAMMPS.

use std::ffi::OsStr;
use std::fmt::Write as _;
use std::path::Path;

use super::bonds::AllLines;
use super::script::{filled, literal};
use super::{Exported, beside, free, name_of, particles_of};
use crate::output::error::OutputError;
use crate::output::frames::{Frame, Frames};
use crate::output::result::ResultFile;
use crate::output::sealed::{self, TextFile};
use crate::output::stream::StoredField;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnData;

/// The script of OVITO.
const SCRIPT: &str = include_str!("ovito.py");

/// Writes `STEM.data`, `STEM.dump`, `STEM.bonds.dump` if there are bonds, and `STEM.ovito.py`.
///
/// # Errors
/// A file exists and `overwrite` is not set, the result has no snapshots, or a file cannot be written.
pub fn write(result: &ResultFile, stem: &Path, overwrite: bool) -> Result<Exported, OutputError> {
    let [data, dump, bonds, script] = [".data", ".dump", ".bonds.dump", ".ovito.py"].map(|ending| beside(stem, ending));
    free(&[data.clone(), dump.clone(), bonds.clone(), script.clone()], overwrite)?;
    let frames = particles_of(result)?;
    let lines = AllLines::of(result)?;
    let surroundings = Surroundings::of(result, &frames)?;
    let mut file = TextFile::create(&dump)?;
    for k in 0..frames.len() {
        let frame = frames.read(k)?;
        file.put(&particles_dump(&frame, surroundings.region(frame.cell)))?;
    }
    file.finish()?;
    let mut file = TextFile::create(&bonds)?;
    let mut first: Vec<[u32; 2]> = Vec::new();
    let mut columns: Vec<String> = Vec::new();
    let any = lines.for_each(result, &mut |lines| {
        if first.is_empty() {
            first.clone_from(&lines.ids);
        }
        let mut text = head("ENTRIES", lines.step, lines.ids.len(), surroundings.region(lines.cell));
        let fields: Vec<&StoredField> = lines.fields.iter().filter(|field| field.column.components == 1).collect();
        let names: Vec<&str> = fields.iter().map(|field| &field.name[..]).collect();
        columns = names.iter().map(|name| literal(OsStr::new(name))).collect();
        let _ = writeln!(text, "ITEM: ENTRIES batom1 batom2 {}", names.join(" "));
        for (row, [a, b]) in lines.ids.iter().enumerate() {
            let _ = write!(text, "{} {}", a + 1, b + 1);
            for field in &fields {
                text += &value(&field.column.data, row);
            }
            text.push('\n');
        }
        file.put(&text)
    })?;
    if any {
        file.finish()?;
    }
    let mut file = TextFile::create(&data)?;
    let frame = frames.read(0)?;
    file.put(&data_file(&frame, &first, density(result), surroundings.region(frame.cell)))?;
    file.finish()?;
    let mut files = vec![data, dump];
    if any {
        files.push(bonds.clone());
    }
    let values = [
        ("PERIODIC", if frame.cell.is_some() { "True" } else { "False" }.to_owned()),
        ("DATA", literal(name_of(&files[0]))),
        ("PARTICLES", literal(name_of(&files[1]))),
        ("BONDS", literal(if any { name_of(&bonds) } else { OsStr::new("") })),
        ("COLUMNS", columns.join(", ")),
        ("SCENE", literal(name_of(&beside(stem, ".ovito")))),
    ];
    sealed::write_text(&script, &filled(SCRIPT, &values))?;
    files.push(script);
    Ok(Exported { files, snapshots: frames.len(), only_final_bonds: any && lines.are_final() })
}

/// Lowest and highest coordinate along x, y, z.
type Bounds = [[f64; 2]; 3];

/// What determines the box.
struct Surroundings {
    /// Of all spheres in all snapshots.
    bounds: Bounds,
    is_plane: bool,
}

/// The box of LAMMPS.
#[derive(Clone, Copy)]
enum Region {
    /// Not periodic.
    Bounds(Bounds),
    /// Periodic, with edges along the axes.
    Periodic(Bounds),
    /// Periodic, with these edge vectors from the origin.
    Oblique([[f64; 3]; 3]),
}

impl Surroundings {
    fn of(result: &ResultFile, frames: &Frames) -> Result<Self, OutputError> {
        let is_plane = Scenario::parse("result", &result.scenario()?).is_ok_and(|scenario| scenario.dimension == 2);
        let surroundings = Self { bounds: bounds(frames)?, is_plane };
        let is_periodic = result.root().link_exists("cell");
        if is_periodic && frames.read(0)?.cell.is_none() {
            let problem = "its snapshots do not have the edges of the periodic cell, because another version of concordem wrote them; run \
                           the scenario again"
                .to_owned();
            return Err(OutputError::Damaged { path: result.path().to_owned(), problem });
        }
        Ok(surroundings)
    }

    /// The box of a snapshot with these edge vectors. A cell of discs is as thick as the discs: its depth of 1 m would hide them.
    fn region(&self, cell: Option<[[f64; 3]; 3]>) -> Region {
        let Some(mut edges) = cell else { return Region::Bounds(self.bounds) };
        let is_along_axes = (0..3).all(|k| (0..3).all(|axis| axis == k || edges[k][axis] == 0.0));
        if is_along_axes {
            let mut bounds = [0, 1, 2].map(|k| [0.0, edges[k][k]]);
            if self.is_plane {
                bounds[2] = self.bounds[2];
            }
            return Region::Periodic(bounds);
        }
        if self.is_plane {
            edges[2] = [0.0, 0.0, self.bounds[2][1] - self.bounds[2][0]];
        }
        Region::Oblique(edges)
    }
}

impl Region {
    /// After `ITEM: BOX BOUNDS`.
    fn of_dump(self) -> String {
        match self {
            Self::Bounds(bounds) => format!(" ff ff ff\n{}", rows(&bounds, "")),
            Self::Periodic(bounds) => format!(" pp pp pp\n{}", rows(&bounds, "")),
            Self::Oblique(edges) => format!(" abc origin pp pp pp\n{}", rows(&edges, " 0.0")),
        }
    }

    /// In the head of a data file.
    fn of_data_file(self) -> String {
        match self {
            Self::Bounds(bounds) | Self::Periodic(bounds) => {
                let line = |([low, high], axis): (&[f64; 2], &str)| format!("{low:?} {high:?} {axis}lo {axis}hi\n");
                bounds.iter().zip(["x", "y", "z"]).map(line).collect()
            }
            Self::Oblique(edges) => {
                let line = |([x, y, z], name): (&[f64; 3], &str)| format!("{x:?} {y:?} {z:?} {name}vec\n");
                edges.iter().zip(["a", "b", "c"]).map(line).chain(["0.0 0.0 0.0 abc origin\n".to_owned()]).collect()
            }
        }
    }

    /// Columns of the positions. Those of periodic boxes are not wrapped.
    fn positions(self) -> &'static str {
        match self {
            Self::Bounds(_) => "x y z",
            Self::Periodic(_) | Self::Oblique(_) => "xu yu zu",
        }
    }
}

/// One line per row of numbers.
fn rows<const N: usize>(rows: &[[f64; N]], end: &str) -> String {
    let line = |row: &[f64; N]| row.map(|x| format!("{x:?}")).join(" ") + end + "\n";
    rows.iter().map(line).collect()
}

fn bounds(frames: &Frames) -> Result<Bounds, OutputError> {
    let mut bounds = [[f64::INFINITY, f64::NEG_INFINITY]; 3];
    for k in 0..frames.len() {
        let frame = frames.read(k)?;
        let radius = reals(&frame, "radius");
        let (points, _) = frame.points.as_chunks::<3>();
        for (point, radius) in points.iter().zip(radius).filter(|(point, _)| point.iter().all(|x| x.is_finite())) {
            for (range, x) in bounds.iter_mut().zip(point) {
                *range = [range[0].min(x - radius), range[1].max(x + radius)];
            }
        }
    }
    Ok(bounds)
}

fn reals<'a>(frame: &'a Frame, name: &str) -> &'a [f64] {
    match frame.field(name) {
        Some(ColumnData::F64(values)) => values,
        _ => &[],
    }
}

/// Head of a snapshot in a dump.
fn head(what: &str, step: u64, count: usize, region: Region) -> String {
    format!("ITEM: TIMESTEP\n{step}\nITEM: NUMBER OF {what}\n{count}\nITEM: BOX BOUNDS{}", region.of_dump())
}

/// A value after a space.
fn value(data: &ColumnData, row: usize) -> String {
    match data {
        ColumnData::F64(values) => format!(" {:?}", values[row]),
        ColumnData::U64(values) => format!(" {}", values[row]),
        ColumnData::U32(values) => format!(" {}", values[row]),
        ColumnData::U16(values) => format!(" {}", values[row]),
        ColumnData::U8(values) => format!(" {}", values[row]),
        ColumnData::I8(values) => format!(" {}", values[row]),
    }
}

fn ids(frame: &Frame) -> &[u32] {
    match frame.field("id") {
        Some(ColumnData::U32(ids)) => ids,
        _ => &[],
    }
}

/// Type of every particle in LAMMPS: its material, from 1.
fn kinds(frame: &Frame) -> &[u16] {
    match frame.field("material") {
        Some(ColumnData::U16(materials)) => materials,
        _ => &[],
    }
}

/// A snapshot of the particles, with all fields; vectors have one column per component.
fn particles_dump(frame: &Frame, region: Region) -> String {
    let (points, _) = frame.points.as_chunks::<3>();
    let mut text = head("ATOMS", frame.step, points.len(), region);
    let others = || frame.fields.iter().filter(|field| !["id", "material"].contains(&&field.name[..]));
    text += "ITEM: ATOMS id type ";
    text += region.positions();
    for field in others() {
        let name = match &field.name[..] {
            "velocity" => "v",
            "angular_velocity" => "omega",
            other => other,
        };
        match field.column.components {
            1 => {
                let _ = write!(text, " {name}");
            }
            3 if name == "v" => text += " vx vy vz",
            3 => ["x", "y", "z"].iter().for_each(|axis| {
                let _ = write!(text, " {name}{axis}");
            }),
            count => (0..count).for_each(|k| {
                let _ = write!(text, " {name}[{}]", k + 1);
            }),
        }
    }
    text.push('\n');
    let (ids, kinds) = (ids(frame), kinds(frame));
    for (row, [x, y, z]) in points.iter().enumerate() {
        let kind = kinds.get(row).copied().unwrap_or(0) + 1;
        let _ = write!(text, "{} {kind} {x:?} {y:?} {z:?}", ids.get(row).copied().unwrap_or(0) + 1);
        for field in others() {
            let width = field.column.components;
            (row * width..(row + 1) * width).for_each(|k| text += &value(&field.column.data, k));
        }
        text.push('\n');
    }
    text
}

/// Densities of the particles, kg/m³, by id.
fn density(result: &ResultFile) -> Vec<(u32, f64)> {
    let Ok(columns) = result.rows("particles") else { return Vec::new() };
    let column = |name: &str| columns.iter().find(|(other, _)| other == name).map(|(_, column)| &column.data);
    let (Some(ColumnData::U32(id)), Some(ColumnData::F64(mass)), Some(ColumnData::F64(radius))) =
        (column("id"), column("mass"), column("radius"))
    else {
        return Vec::new();
    };
    let volume = |radius: f64| 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius;
    id.iter().zip(mass.iter().zip(radius)).map(|(id, (mass, radius))| (*id, mass / volume(*radius))).collect()
}

/// A data file in the atom style bpm/sphere: id, molecule, type, diameter, density, x, y, z; and the bonds.
fn data_file(frame: &Frame, bonds: &[[u32; 2]], density: Vec<(u32, f64)>, region: Region) -> String {
    let (points, _) = frame.points.as_chunks::<3>();
    let (ids, kinds, radius) = (ids(frame), kinds(frame), reals(frame, "radius"));
    let density: std::collections::HashMap<u32, f64> = density.into_iter().collect();
    let types = kinds.iter().copied().max().unwrap_or(0) + 1;
    let mut text = format!("Written by concordem export, SI units\n\n{} atoms\n{types} atom types\n", points.len());
    if !bonds.is_empty() {
        let mut per_atom = std::collections::HashMap::new();
        for pair in bonds {
            *per_atom.entry(pair[0]).or_insert(0_usize) += 1;
        }
        let most = per_atom.values().max().copied().unwrap_or(0);
        let _ = writeln!(text, "{} bonds\n1 bond types\n{most} extra bond per atom", bonds.len());
    }
    text.push('\n');
    text += &region.of_data_file();
    text += "\nAtoms # bpm/sphere\n\n";
    for (row, [x, y, z]) in points.iter().enumerate() {
        let id = ids.get(row).copied().unwrap_or(0);
        let (kind, radius) = (kinds.get(row).copied().unwrap_or(0) + 1, radius.get(row).copied().unwrap_or(0.0));
        let density = density.get(&id).copied().unwrap_or(1.0);
        let _ = writeln!(text, "{} 1 {kind} {:?} {density:?} {x:?} {y:?} {z:?}", id + 1, 2.0 * radius);
    }
    if !bonds.is_empty() {
        text += "\nBonds\n\n";
        for (k, [a, b]) in bonds.iter().enumerate() {
            let _ = writeln!(text, "{} 1 {} {}", k + 1, a + 1, b + 1);
        }
    }
    text
}
