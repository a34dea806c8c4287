//! Reads packings of other programs: comma-separated tables, data and dump files of LAMMPS and LIGGGHTS, and text of YADE.
//!
//! [`import`] recognizes the format by its content. Files of other programs carry no units, so the caller gives the length of one unit of
//! the file.

use std::io::BufRead;

use super::{Packing, PackingError, import_text};
use concordem_contact::math::Vec3;
use concordem_contact::quantity::Length;
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;

/// Number of lines in which the header of a LAMMPS data file is searched.
const HEADER: usize = 100;

/// Reads spheres in any known text format; `unit`: length of one unit of the file, m (1 if `None`).
///
/// # Errors
/// A file without spheres, a format without radii, and lines that cannot be read, each with its number.
pub fn import(mut reader: impl BufRead, unit: Option<f64>) -> Result<Packing, PackingError> {
    let mut bytes = Vec::new();
    reader
        .read_to_end(&mut bytes)
        .map_err(|source| PackingError::Io { action: "cannot read the packing".into(), source })?;
    let foreign = |reason: &str| Err(PackingError::Foreign { reason: reason.to_owned() });
    if bytes.starts_with(b"SQLite format 3\0") {
        return foreign(
            "it is a data base of YADE (memoizeDb); read it with concordem.packing.read_memoized in Python, or load it in YADE \
             with randomDensePack and write it with SpherePack.save",
        );
    }
    if bytes.starts_with(b"\x89HDF\r\n") {
        return foreign("it is an HDF5 file; give it the extension .h5");
    }
    let text = String::from_utf8_lossy(&bytes);
    let first = text.lines().map(str::trim).find(|line| !line.is_empty() && !line.starts_with('#')).unwrap_or("");
    let mut scale = unit.unwrap_or(1.0);
    let mut packing = if first == "ITEM: TIMESTEP" {
        dump(&text)?
    } else if text.lines().take(HEADER).any(|line| counted_atoms(line).is_some()) {
        lammps_data(&text)?
    } else if first.contains([',', ';']) {
        let (mut packing, given) = table(&text)?;
        // The cell of our own tables is a comment.
        for line in text.lines().filter(|line| line.starts_with("# cell ")) {
            packing.cell = import_text(line.as_bytes())?.cell;
        }
        match (given, unit) {
            (Some(_), Some(_)) => {
                return foreign("its header gives the unit of lengths, and so does `unit`; remove one");
            }
            (Some(given), None) => scale = given,
            _ => {}
        }
        packing
    } else {
        // Reads the bytes again, to refuse those that are not UTF-8 with the number of their line.
        import_text(&bytes[..])?
    };
    if packing.spheres.is_empty() {
        return foreign("it has no spheres; a packing has one sphere per line: x y z r");
    }
    if scale != 1.0 {
        for sphere in &mut packing.spheres {
            sphere.position *= scale;
            sphere.radius *= scale;
        }
        packing.cell = packing.cell.map(|cell| Cell::new(cell.matrix * scale));
    }
    Ok(packing)
}

fn bad(number: usize, reason: impl Into<String>, line: &str) -> PackingError {
    PackingError::BadLine { line: number, reason: reason.into(), text: line.trim_end().chars().take(80).collect() }
}

/// A sphere from x, y, z and its radius.
fn sphere(number: usize, line: &str, [x, y, z, radius]: [f64; 4]) -> Result<Sphere, PackingError> {
    if radius > 0.0 {
        Ok(Sphere { position: Vec3::new(x, y, z), radius })
    } else {
        Err(bad(number, format!("the radius {radius} is not positive"), line))
    }
}

fn real(number: usize, line: &str, word: &str) -> Result<f64, PackingError> {
    match word.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        Ok(value) => Err(bad(number, format!("{value} is not finite"), line)),
        Err(_) => Err(bad(number, format!("{word:?} is not a number"), line)),
    }
}

/// Places of x, y, z, and the radius (with the factor that a diameter needs) among names of columns.
struct Columns {
    places: [usize; 4],
    factor: f64,
}

impl Columns {
    /// `None` if a coordinate or the radius is missing.
    fn of<'a>(names: impl IntoIterator<Item = &'a str>) -> Option<Self> {
        let names: Vec<String> = names.into_iter().map(|name| name.trim().trim_matches('"').to_lowercase()).collect();
        let find = |words: &[&str]| names.iter().position(|name| words.contains(&name.as_str()));
        let x = find(&["x", "xu", "points:0", "points_0", "position_x", "pos_x"])?;
        let y = find(&["y", "yu", "points:1", "points_1", "position_y", "pos_y"])?;
        let z = find(&["z", "zu", "points:2", "points_2", "position_z", "pos_z"])?;
        let radius = find(&["r", "radius", "rad"]).map(|place| (place, 1.0));
        let (r, factor) = radius.or_else(|| find(&["d", "diameter"]).map(|place| (place, 0.5)))?;
        Some(Self { places: [x, y, z, r], factor })
    }

    fn sphere(&self, number: usize, line: &str, words: &[&str]) -> Result<Sphere, PackingError> {
        let mut values = [0.0; 4];
        for (value, &place) in values.iter_mut().zip(&self.places) {
            let word = words.get(place).ok_or_else(|| bad(number, format!("expected {} columns", place + 1), line))?;
            *value = real(number, line, word)?;
        }
        values[3] *= self.factor;
        sphere(number, line, values)
    }
}

/// A table separated by commas or semicolons, with or without a header; also the unit of lengths (m) that the header gives.
fn table(text: &str) -> Result<(Packing, Option<f64>), PackingError> {
    let mut columns: Option<Columns> = None;
    let mut unit = None;
    let mut packing = Packing::default();
    for (index, line) in text.lines().enumerate() {
        let number = index + 1;
        let content = line.trim_start_matches('\u{feff}').split('#').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        // With semicolons, commas are decimal points, as spreadsheets of many countries write them.
        let (separator, content) =
            if content.contains(';') { (';', content.replace(',', ".")) } else { (',', content.to_owned()) };
        let words: Vec<&str> = content.split(separator).map(|word| word.trim().trim_matches('"')).collect();
        if let Some(columns) = &columns {
            packing.spheres.push(columns.sphere(number, line, &words)?);
            continue;
        }
        if words.iter().any(|word| word.parse::<f64>().is_err()) {
            unit = unit_of(&words).map_err(|reason| bad(number, reason, line))?;
            let names = words.iter().map(|word| word.split(['[', '(', ' ']).next().unwrap_or(word));
            columns = Some(Columns::of(names).ok_or_else(|| {
                bad(number, "the header must name the columns x, y, z, and radius (or diameter)", line)
            })?);
        } else if words.len() == 4 {
            let first = Columns { places: [0, 1, 2, 3], factor: 1.0 };
            packing.spheres.push(first.sphere(number, line, &words)?);
            columns = Some(first);
        } else {
            let reason =
                format!("expected the four numbers x, y, z, r, found {}; name other columns in a header", words.len());
            return Err(bad(number, reason, line));
        }
    }
    Ok((packing, unit))
}

/// The unit (m) that names such as `x [mm]` give.
fn unit_of(names: &[&str]) -> Result<Option<f64>, String> {
    let Some((_, rest)) = names.first().and_then(|name| name.split_once(['[', '('])) else { return Ok(None) };
    let unit = rest.trim_end_matches([']', ')']).trim();
    let length = Length::parse(&format!("1 {unit}")).map_err(|_| format!("{unit:?} is not a unit of length"))?;
    Ok(Some(length.si()))
}

/// The number of atoms, in the header of a LAMMPS data file.
fn counted_atoms(line: &str) -> Option<usize> {
    let mut words = line.split('#').next()?.split_whitespace();
    let count = words.next()?.parse().ok()?;
    (words.next() == Some("atoms") && words.next().is_none()).then_some(count)
}

/// The section `Atoms` of a LAMMPS data file with the atom style `sphere` or `bpm/sphere`.
fn lammps_data(text: &str) -> Result<Packing, PackingError> {
    let mut lines = text.lines().enumerate();
    let mut packing = Packing::default();
    let Some((number, head)) =
        lines.find(|(_, line)| line.split('#').next().is_some_and(|line| line.trim() == "Atoms"))
    else {
        return Err(PackingError::Foreign { reason: "it is a LAMMPS data file without a section `Atoms`".into() });
    };
    let style = head.split_once('#').map_or("", |(_, style)| style.trim());
    let first = match style {
        "" => None,
        // Places of the diameter and of x.
        "sphere" | "granular" => Some((2, 4)),
        "bpm/sphere" => Some((3, 5)),
        other => {
            let reason = format!(
                "atoms of the style {other:?} have no radii; write the file with the atom style sphere or bpm/sphere"
            );
            return Err(bad(number + 1, reason, head));
        }
    };
    for (index, line) in lines {
        let content = line.split('#').next().unwrap_or("").trim();
        if content.is_empty() {
            continue;
        }
        if content.starts_with(|c: char| c.is_ascii_alphabetic()) {
            break;
        }
        let words: Vec<&str> = content.split_whitespace().collect();
        let (diameter, x) = match (first, words.len()) {
            (Some(places), _) => places,
            // Image flags may follow.
            (None, 7 | 10) => (2, 4),
            (None, 8 | 11) => (3, 5),
            (None, count) => {
                let reason = format!("{count} columns fit neither the atom style sphere (7) nor bpm/sphere (8)");
                return Err(bad(index + 1, reason, line));
            }
        };
        let columns = Columns { places: [x, x + 1, x + 2, diameter], factor: 0.5 };
        packing.spheres.push(columns.sphere(index + 1, line, &words)?);
    }
    complete(packing, text.lines().find_map(counted_atoms))
}

/// Refuses a file with another number of atoms than its header says.
fn complete(packing: Packing, expected: Option<usize>) -> Result<Packing, PackingError> {
    let found = packing.spheres.len();
    match expected {
        Some(expected) if expected != found => {
            let reason = format!("its header counts {expected} atoms, but it lists {found}; is it cut off?");
            Err(PackingError::Foreign { reason })
        }
        _ => Ok(packing),
    }
}

/// The last snapshot of a dump file of LAMMPS or LIGGGHTS.
fn dump(text: &str) -> Result<Packing, PackingError> {
    let mut packing = Packing::default();
    let mut columns: Option<Columns> = None;
    // Number of atoms of the last snapshot.
    let (mut expected, mut follows) = (None, false);
    for (index, line) in text.lines().enumerate() {
        if std::mem::replace(&mut follows, line.starts_with("ITEM: NUMBER OF ATOMS")) {
            expected = line.trim().parse().ok();
        }
        if let Some(names) = line.strip_prefix("ITEM: ATOMS") {
            packing.spheres.clear();
            let found = Columns::of(names.split_whitespace());
            columns = Some(found.ok_or_else(|| bad(index + 1, "the dump needs the columns x y z radius", line))?);
        } else if line.starts_with("ITEM:") {
            columns = None;
        } else if let Some(columns) = &columns {
            let words: Vec<&str> = line.split_whitespace().collect();
            packing.spheres.push(columns.sphere(index + 1, line, &words)?);
        }
    }
    complete(packing, expected)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The same two spheres in every format.
    #[test]
    fn formats_of_other_programs_give_the_same_spheres() {
        let expected = [
            Sphere { position: Vec3::new(0.0, 1.0, 2.0), radius: 0.5 },
            Sphere { position: Vec3::new(-3.0, 4.0, 5.5), radius: 0.25 },
        ];
        let formats = [
            ("own", "# x y z r\n0 1 2 0.5\n-3 4 5.5 0.25\n"),
            ("csv", "0,1,2,0.5\n-3, 4, 5.5, 0.25\n"),
            ("header", "\u{feff}id,Radius,X,Y,Z\n1,0.5,0,1,2\n2,0.25,-3,4,5.5\n"),
            ("diameter", "\"Points:0\",\"Points:1\",\"Points:2\",diameter\n0,1,2,1\n-3,4,5.5,0.5\n"),
            ("semicolons", "x [m];y [m];z [m];r [m]\n0;1;2;0,5\n-3;4;5,5;0,25\n"),
            ("yade", "#format x_y_z_r_matId\n0\t1\t2\t0.5\t0\n-3\t4\t5.5\t0.25\t1\n"),
            (
                "data",
                "LAMMPS data\n\n2 atoms\n1 atom types\n\n-9 9 xlo xhi\n\nAtoms # sphere\n\n1 1 1.0 2500 0 1 2 0 0 0\n\
                 2 1 0.5 2500 -3 4 5.5 0 0 1\n\nVelocities\n\n1 0 0 0 0 0 0\n",
            ),
            ("bpm", "\n2 atoms # two\n\nAtoms\n\n1 1 1 1.0 2500 0 1 2\n2 1 1 0.5 2500 -3 4 5.5\n"),
            (
                "dump",
                "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n1\nITEM: ATOMS id x y z radius\n1 9 9 9 9\nITEM: TIMESTEP\n5\n\
                 ITEM: NUMBER OF ATOMS\n2\nITEM: BOX BOUNDS ff ff ff\n0 1\n0 1\n0 1\nITEM: ATOMS id x y z radius\n\
                 1 0 1 2 0.5\n2 -3 4 5.5 0.25\n",
            ),
        ];
        for (name, text) in formats {
            let packing = import(text.as_bytes(), None).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(packing.spheres, expected, "{name}");
        }
        let scaled = import("##PERIODIC:: 1 1 1\n0 1 2 0.5\n".as_bytes(), Some(1e-3)).unwrap();
        assert_eq!(scaled.spheres[0], Sphere { position: Vec3::new(0.0, 1e-3, 2e-3), radius: 5e-4 });
        assert!((scaled.cell.unwrap().volume() - 1e-9).abs() < 1e-24);
        let millimeters = import("x [mm],y [mm],z [mm],r [mm]\n1000,0,0,500\n".as_bytes(), None).unwrap();
        assert_eq!(millimeters.spheres[0], Sphere { position: Vec3::new(1.0, 0.0, 0.0), radius: 0.5 });
    }

    #[test]
    fn errors_name_the_line_and_the_remedy() {
        let cases = [
            ("", "has no spheres"),
            ("# nothing\n", "has no spheres"),
            ("a,b,c\n1,2,3\n", "line 1: the header must name the columns x, y, z, and radius"),
            ("1,2,3\n", "line 1: expected the four numbers x, y, z, r, found 3"),
            ("x,y,z,r\n1,2,three,4\n", "line 2: \"three\" is not a number"),
            ("x,y,z,r\n1,2,3\n", "line 2: expected 4 columns"),
            ("x [mile],y,z,r\n1,2,3,4\n", "line 1: \"mile\" is not a unit of length"),
            ("1,2,3,-4\n", "line 1: the radius -4 is not positive"),
            ("2 atoms\n\nAtoms # bond\n\n1 1 1 0 0 0\n", "line 3: atoms of the style \"bond\" have no radii"),
            ("2 atoms\n", "without a section `Atoms`"),
            ("2 atoms\n\nAtoms\n\n1 1 0 0 0\n", "line 5: 5 columns fit neither"),
            ("ITEM: TIMESTEP\n0\nITEM: ATOMS id x y z\n1 0 0 0\n", "line 3: the dump needs the columns x y z radius"),
            (
                "3 atoms\n\nAtoms # sphere\n\n1 1 1 9 0 0 0\n2 1 1 9 0 0 2\n",
                "counts 3 atoms, but it lists 2; is it cut off?",
            ),
            (
                "ITEM: TIMESTEP\n0\nITEM: NUMBER OF ATOMS\n2\nITEM: ATOMS id x y z radius\n1 0 0 0 1\n",
                "counts 2 atoms, but it lists 1; is it cut off?",
            ),
            ("SQLite format 3\0...", "memoizeDb"),
        ];
        for (text, message) in cases {
            let error = import(text.as_bytes(), None).expect_err(text).to_string();
            assert!(error.contains(message), "{text:?}: {error}");
        }
        let twice = import("x [mm],y [mm],z [mm],r [mm]\n1,0,0,1\n".as_bytes(), Some(1e-3)).expect_err("two units");
        assert!(twice.to_string().contains("remove one"));
    }
}
