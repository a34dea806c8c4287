//! Data and dump files of LAMMPS and LIGGGHTS.

use super::columns::Columns;
use super::{Read, bad, foreign};
use crate::bad_lines::BadLines;
use crate::{Packing, PackingError};
use concordem_contact::math::Vec3;

/// Number of lines in which the header of a data file is searched.
const HEADER: usize = 100;
/// Sections with what a packing cannot hold.
const REFUSED: [&str; 8] = ["Bonds", "Angles", "Dihedrals", "Impropers", "Ellipsoids", "Lines", "Triangles", "Bodies"];
/// Position outside of the box by less than this part of its edge is rounding: files have at least six digits.
const ROUNDING: f64 = 1e-6;
/// How to write the style of the atoms.
const STYLES: &str = "write `Atoms # sphere` (id type diameter density x y z) or `Atoms # bpm/sphere` (id molecule type diameter \
                      density x y z)";

/// Styles of units with the length of one unit, m; `None` for reduced units.
const UNITS: [(&str, Option<f64>); 8] = [
    ("lj", None),
    ("real", Some(1e-10)),
    ("metal", Some(1e-10)),
    ("si", Some(1.0)),
    ("cgs", Some(1e-2)),
    // Bohr radius, CODATA 2018.
    ("electron", Some(5.291_772_109_03e-11)),
    ("micro", Some(1e-6)),
    ("nano", Some(1e-9)),
];

/// Length of one unit of a style, m.
fn unit_of(number: usize, line: &str, style: &str) -> Result<Option<f64>, PackingError> {
    let found = UNITS.iter().find(|(name, _)| *name == style);
    found.map(|(_, length)| *length).ok_or_else(|| bad(number, format!("{style:?} is not a style of units"), line))
}

/// The words of a line without its comment.
fn words(line: &str) -> Vec<&str> {
    line.split('#').next().unwrap_or("").split_whitespace().collect()
}

/// The number of atoms, in the header of a data file.
fn counted_atoms(line: &str) -> Option<usize> {
    match words(line)[..] {
        [count, "atoms"] => count.parse().ok(),
        _ => None,
    }
}

/// Whether a text is a data file.
pub(super) fn is_data(text: &str) -> bool {
    text.lines().take(HEADER).any(|line| counted_atoms(line).is_some())
}

/// What the header of a data file says.
#[derive(Default)]
struct Header {
    atoms: Option<usize>,
    types: Option<usize>,
    /// Ends of the box along each axis, if given.
    ends: [Option<[f64; 2]>; 3],
    /// xy, xz, yz.
    tilt: [f64; 3],
    unit: Option<f64>,
}

impl Header {
    /// Reads the lines before the section `Atoms`.
    fn of(text: &str) -> Result<Self, PackingError> {
        let mut header = Self::default();
        for (index, line) in text.lines().enumerate() {
            // The first line is a comment; that of LAMMPS names the units.
            if index == 0 && line.contains("LAMMPS") {
                if let Some((_, style)) = line.split_once("units = ") {
                    header.unit = unit_of(1, line, style.trim())?;
                }
                continue;
            }
            let real = |word: &str| super::columns::real(index + 1, line, word);
            match words(line)[..] {
                ["Atoms"] => break,
                [_, "atoms"] => header.atoms = counted_atoms(line),
                [count, "atom", "types"] => header.types = count.parse().ok(),
                [low, high, "xlo", "xhi"] => header.ends[0] = Some([real(low)?, real(high)?]),
                [low, high, "ylo", "yhi"] => header.ends[1] = Some([real(low)?, real(high)?]),
                [low, high, "zlo", "zhi"] => header.ends[2] = Some([real(low)?, real(high)?]),
                [xy, xz, yz, "xy", "xz", "yz"] => header.tilt = [real(xy)?, real(xz)?, real(yz)?],
                _ => {}
            }
        }
        Ok(header)
    }

    /// Refuses a center outside of the box.
    fn inside(&self, number: usize, line: &str, x: &Vec3) -> Result<(), PackingError> {
        let [xy, xz, yz] = self.tilt;
        let lean = [[0.0, xy, xz, xy + xz], [0.0, yz, 0.0, 0.0], [0.0; 4]];
        for axis in 0..3 {
            let Some([low, high]) = self.ends[axis] else { continue };
            let least = lean[axis].iter().copied().fold(0.0, f64::min);
            let most = lean[axis].iter().copied().fold(0.0, f64::max);
            let slack = ROUNDING * (high - low).abs().max(low.abs()).max(high.abs());
            if !(low + least - slack..=high + most + slack).contains(&x[axis]) {
                let name = ["x", "y", "z"][axis];
                let reason = format!(
                    "{name} = {} lies outside of the box of the header, {} to {}; check the order of the columns, or wrap the atoms \
                     into the box",
                    x[axis],
                    low + least,
                    high + most
                );
                return Err(bad(number, reason, line));
            }
        }
        Ok(())
    }
}

/// Places of the columns of a style of atoms.
struct Style {
    /// Place of the type; the diameter and the density follow it.
    kind: usize,
    /// Number of columns, without image flags.
    count: usize,
}

/// The style that the line `Atoms # style` names.
fn style(number: usize, line: &str) -> Result<Style, PackingError> {
    let refuse = |reason: String| Err(bad(number, reason, line));
    match line.split_once('#').map_or("", |(_, style)| style.trim()) {
        "" => refuse(format!("the section does not say its atom style, so its columns are unknown; {STYLES}")),
        "sphere" | "granular" => Ok(Style { kind: 1, count: 7 }),
        "bpm/sphere" => Ok(Style { kind: 2, count: 8 }),
        hybrid if hybrid.starts_with("hybrid") => refuse(format!(
            "the columns of a hybrid style depend on its parts; {STYLES} with these columns, or write a dump with x y z radius"
        )),
        other => refuse(format!(
            "the columns of the atom style {other:?} give no diameters of spheres; write the file with the atom style sphere or \
             bpm/sphere, or a dump with x y z radius"
        )),
    }
}

/// The section `Atoms` of a data file with the atom style `sphere` or `bpm/sphere`.
pub(super) fn data(text: &str) -> Result<Read, PackingError> {
    let header = Header::of(text)?;
    let (mut packing, mut wrong) = (Packing::default(), BadLines::default());
    let mut section: Option<Style> = None;
    let mut found = false;
    for (index, line) in text.lines().enumerate().skip(1) {
        let (number, content) = (index + 1, words(line));
        let Some(first) = content.first() else { continue };
        if first.starts_with(|c: char| c.is_ascii_alphabetic()) {
            section = None;
            if content == ["Atoms"] {
                section = Some(style(number, line)?);
                found = true;
            } else if REFUSED.contains(first) {
                let reason = format!(
                    "the section `{first}` is not read, because a packing is spheres alone; remove it ([bonds] joins spheres by their \
                     distance)"
                );
                return Err(bad(number, reason, line));
            }
        } else if let Some(style) = &section {
            packing.spheres.extend(wrong.keep(number, atom(number, line, &content, style, &header)));
        }
    }
    wrong.end()?;
    if !found {
        return Err(foreign("it is a LAMMPS data file without a section `Atoms`"));
    }
    let packing = complete(packing, header.atoms)?;
    Ok(Read { packing, unit: header.unit })
}

/// An atom of a data file.
fn atom(
    number: usize,
    line: &str,
    words: &[&str],
    style: &Style,
    header: &Header,
) -> Result<crate::Sphere, PackingError> {
    let Style { kind, count } = *style;
    // Three image flags may follow.
    if words.len() != count && words.len() != count + 3 {
        let reason = format!("expected {count} columns, or {} with image flags, found {}", count + 3, words.len());
        return Err(bad(number, reason, line));
    }
    let types = header.types.unwrap_or(usize::MAX);
    if !words[kind].parse::<usize>().is_ok_and(|kind| (1..=types).contains(&kind)) {
        let reason = format!("{:?} is not a type of atom; check the order of the columns: {STYLES}", words[kind]);
        return Err(bad(number, reason, line));
    }
    let density = super::columns::real(number, line, words[kind + 2])?;
    if density <= 0.0 {
        let reason = format!("the density {density} is not positive; check the order of the columns: {STYLES}");
        return Err(bad(number, reason, line));
    }
    let columns = Columns {
        places: [kind + 3, kind + 4, kind + 5, kind + 1],
        factor: 0.5,
        diameter: None,
        clump: None,
        count: None,
    };
    let sphere = columns.sphere(number, line, words, [1.0; 4])?;
    header.inside(number, line, &sphere.position)?;
    Ok(sphere)
}

/// Refuses a file with another number of atoms than its header says.
fn complete(packing: Packing, expected: Option<usize>) -> Result<Packing, PackingError> {
    let found = packing.spheres.len();
    match expected {
        Some(expected) if expected != found => {
            Err(foreign(format!("its header counts {expected} atoms, but it lists {found}; is it cut off?")))
        }
        _ => Ok(packing),
    }
}

/// The last snapshot of a dump file.
pub(super) fn dump(text: &str) -> Result<Read, PackingError> {
    let (mut packing, mut wrong) = (Packing::default(), BadLines::default());
    let mut columns: Option<Columns> = None;
    let (mut expected, mut unit) = (None, None);
    // The line before, if it is the head of a section with one value.
    let mut head = "";
    let mut found = false;
    for (index, line) in text.lines().enumerate() {
        let (number, content) = (index + 1, line.trim());
        if content.is_empty() {
            continue;
        }
        match std::mem::replace(&mut head, content) {
            "ITEM: NUMBER OF ATOMS" => expected = content.parse().ok(),
            "ITEM: UNITS" => unit = unit_of(number, line, content)?,
            _ => {}
        }
        if let Some(names) = content.strip_prefix("ITEM: ATOMS") {
            packing.spheres.clear();
            let names: Vec<String> = names.split_whitespace().map(str::to_lowercase).collect();
            let of = Columns::of(&names).map_err(|reason| bad(number, reason, line))?;
            let needed = "the dump needs the columns x y z radius (or xu yu zu, or diameter): dump ID all custom N FILE id x y z radius";
            columns = Some(of.ok_or_else(|| bad(number, needed, line))?);
            found = true;
        } else if content.starts_with("ITEM:") {
            columns = None;
        } else if let Some(columns) = &columns {
            let words: Vec<&str> = content.split_whitespace().collect();
            packing.spheres.extend(wrong.keep(number, columns.sphere(number, line, &words, [1.0; 4])));
        }
    }
    wrong.end()?;
    if !found {
        return Err(foreign("it is a dump of LAMMPS without atoms; write dump ID all custom N FILE id x y z radius"));
    }
    let packing = complete(packing, expected)?;
    Ok(Read { packing, unit })
}
