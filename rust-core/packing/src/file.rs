//! Sphere packings as text: one line `x y z r` (m) per sphere; text after `#` is a comment.
//!
//! A periodic packing stores its cell in a comment: `# cell` with the nine components of the three edge vectors, one
//! vector after the other. The reader also accepts YADE's `##PERIODIC:: x y z` (edges of a box), the fifth column of `SpherePack.save`
//! (the number of the clump, −1 for none), and more columns, if YADE's comment `#format x_y_z_r_matId` names them. Spheres of clumps are
//! refused, because they would be loose. Other formats: [`import`](super::import()).

use std::io::{BufRead, ErrorKind, Write};

use super::bad_lines::BadLines;
use super::import::loose;
use super::{Packing, PackingError};
use concordem_contact::math::{Mat3, Vec3};
use concordem_operator::interruption::look;
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;
use rayon::prelude::*;

/// Lines that are read before their numbers are found, on all threads.
const LINES_AT_A_TIME: usize = 1 << 16;

/// Read spheres from text.
///
/// # Errors
/// Lines that are not four finite numbers with a positive radius: the first one, with the numbers of the others; errors of the reader.
pub fn import_text(mut reader: impl BufRead) -> Result<Packing, PackingError> {
    let mut import = Import::default();
    let mut bad = BadLines::default();
    let mut done = 0;
    // Kept from part to part: packings have millions of lines.
    let (mut text, mut ends) = (String::new(), Vec::new());
    loop {
        look();
        text.clear();
        ends.clear();
        while ends.len() < LINES_AT_A_TIME {
            let number = done + ends.len() + 1;
            let failed = |source: std::io::Error| match source.kind() {
                ErrorKind::InvalidData => {
                    let reason = "the line has bytes that are not UTF-8; save the file as UTF-8".to_owned();
                    PackingError::BadLine { line: number, reason, text: String::new(), others: String::new() }
                }
                _ => PackingError::Io { action: format!("cannot read line {number}"), source },
            };
            if reader.read_line(&mut text).map_err(failed)? == 0 {
                break;
            }
            ends.push(text.len());
        }
        if ends.is_empty() {
            return bad.end().map(|()| import.packing);
        }
        let line = |k: usize| {
            let line = &text[if k == 0 { 0 } else { ends[k - 1] }..ends[k]];
            let line = line.strip_suffix('\n').unwrap_or(line);
            line.strip_suffix('\r').unwrap_or(line)
        };
        let spheres: Vec<Option<Sphere>> = (0..ends.len()).into_par_iter().map(|k| plain_sphere(line(k))).collect();
        for (k, sphere) in spheres.into_iter().enumerate() {
            match sphere {
                Some(sphere) => import.packing.spheres.push(sphere),
                None => drop(bad.keep(done + k + 1, import.line(done + k + 1, line(k)))),
            }
        }
        done += ends.len();
    }
}

/// The sphere of a line with four numbers and nothing else, if they are possible.
fn plain_sphere(line: &str) -> Option<Sphere> {
    let mut words = line.split_whitespace();
    let mut number = || words.next()?.parse().ok().filter(|value: &f64| value.is_finite());
    let (x, y, z, radius) = (number()?, number()?, number()?, number()?);
    (radius > 0.0 && words.next().is_none()).then_some(Sphere { position: Vec3::new(x, y, z), radius })
}

/// What lines of text have given so far.
#[derive(Default)]
struct Import {
    packing: Packing,
    /// What stands in the columns after x y z r.
    further: Further,
}

/// What stands in the columns after x y z r.
#[derive(Default, Clone, Copy, PartialEq)]
enum Further {
    /// Nothing, or the number of the clump.
    #[default]
    Unnamed,
    /// What a comment of YADE names; skipped but for the number of the clump, which is in the column with this index.
    Named(Option<usize>),
}

impl Import {
    /// Reads a line of any kind.
    fn line(&mut self, number: usize, line: &str) -> Result<(), PackingError> {
        let bad = |reason: String| PackingError::BadLine {
            line: number,
            reason,
            text: line.chars().take(80).collect(),
            others: String::new(),
        };
        let numbers = |text: &str| -> Result<Vec<f64>, PackingError> {
            let finite = |word: &str| match word.parse::<f64>() {
                Ok(value) if value.is_finite() => Ok(value),
                Ok(value) => Err(bad(format!("{value} is not finite"))),
                Err(_) => Err(bad(format!("{word:?} is not a number"))),
            };
            text.split_whitespace().map(finite).collect()
        };
        if let Some(cell) = line.trim_start().strip_prefix("##PERIODIC::") {
            let size = numbers(cell)?;
            if size.len() != 3 || size.iter().any(|edge| *edge <= 0.0) {
                return Err(bad("a periodic cell needs three positive edges".into()));
            }
            self.packing.cell = Some(Cell::new_box(Vec3::new(size[0], size[1], size[2])));
            return Ok(());
        }
        if let Some(cell) = line.trim_start().strip_prefix("# cell ") {
            let edges = numbers(cell)?;
            if edges.len() != 9 {
                return Err(bad("a cell has three edge vectors with three components each".into()));
            }
            let cell = Cell::new(Mat3::from_column_slice(&edges));
            if !cell.volume().is_normal() {
                return Err(bad("the cell has no volume".into()));
            }
            self.packing.cell = Some(cell);
            return Ok(());
        }
        if let Some(format) = line.trim_start().strip_prefix("#format ") {
            let Some(rest) = format.trim().strip_prefix("x_y_z_r") else {
                return Err(bad("the columns must begin with x_y_z_r".into()));
            };
            let clump = rest.split('_').position(|name| name.eq_ignore_ascii_case("clumpId")).map(|place| place + 3);
            self.further = if rest.is_empty() { Further::Unnamed } else { Further::Named(clump) };
            return Ok(());
        }
        let content = line.split('#').next().unwrap_or("");
        let mut words: Vec<&str> = content.split_whitespace().collect();
        let clump = match self.further {
            Further::Unnamed => (words.len() == 5).then_some(4),
            Further::Named(clump) => clump,
        };
        if let Some(word) = clump.and_then(|place| words.get(place)) {
            loose(number, line, word)?;
        }
        if clump.is_some() || self.further != Further::Unnamed {
            words.truncate(4);
        }
        let values = numbers(&words.join(" "))?;
        match values[..] {
            [] => {}
            [x, y, z, radius] if radius > 0.0 => {
                self.packing.spheres.push(Sphere { position: Vec3::new(x, y, z), radius });
            }
            [_, _, _, radius] => return Err(bad(format!("the radius {radius} is not positive"))),
            _ => return Err(bad(format!("expected the four numbers x y z r, found {}", values.len()))),
        }
        Ok(())
    }
}

/// Write spheres as text that [`import_text`] reads back bit for bit.
///
/// # Errors
/// Errors of the writer.
pub fn export_text(packing: &Packing, writer: impl Write) -> Result<(), PackingError> {
    export(packing, writer, "# x y z r (m)", " ")
}

/// Write spheres as a comma-separated table that [`import`](super::import()) reads back bit for bit.
///
/// # Errors
/// Errors of the writer.
pub fn export_csv(packing: &Packing, writer: impl Write) -> Result<(), PackingError> {
    export(packing, writer, "x [m],y [m],z [m],radius [m]", ",")
}

fn export(packing: &Packing, mut writer: impl Write, head: &str, separator: &str) -> Result<(), PackingError> {
    let mut write = || -> std::io::Result<()> {
        if let Some(cell) = &packing.cell {
            write!(writer, "# cell")?;
            for value in &cell.matrix {
                write!(writer, " {value:?}")?;
            }
            writeln!(writer)?;
        }
        writeln!(writer, "{head}")?;
        for sphere in &packing.spheres {
            let p = sphere.position;
            // `{:?}` prints the shortest text that reads back as the same number.
            writeln!(writer, "{:?}{separator}{:?}{separator}{:?}{separator}{:?}", p.x, p.y, p.z, sphere.radius)?;
        }
        writer.flush()
    };
    write().map_err(|source| PackingError::Io { action: "cannot write the packing".into(), source })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip_is_exact() {
        let spheres = (1..50)
            .map(|i| Sphere { position: Vec3::new(1.0 / f64::from(i), -1.0e-17 * f64::from(i), 0.1), radius: 1.0e-3 })
            .collect();
        let cell = Some(Cell::new(Mat3::new(1.0, 0.1, 0.0, 0.0, 1.0 / 3.0, 0.2, 0.0, 0.0, 2.0e-5)));
        let packing = Packing { spheres, cell };
        let mut text = Vec::new();
        export_text(&packing, &mut text).unwrap();
        assert_eq!(import_text(&text[..]).unwrap(), packing);
        let mut table = Vec::new();
        export_csv(&packing, &mut table).unwrap();
        assert_eq!(crate::import(&table[..], None).unwrap(), packing);
    }

    #[test]
    fn comments_blank_lines_and_yade_cells_are_understood() {
        let text = "##PERIODIC:: 1 2 3\n\n# a comment\n  0 0 0 0.5 # first\n1e-3\t2 3 0.25\r\n";
        let packing = import_text(text.as_bytes()).unwrap();
        assert_eq!(packing.spheres.len(), 2);
        assert_eq!(packing.spheres[1], Sphere { position: Vec3::new(1.0e-3, 2.0, 3.0), radius: 0.25 });
        assert_eq!(packing.cell.unwrap().volume(), 6.0);
        // As SpherePack.save of YADE writes: the fifth column is the number of the clump.
        let text = "##PERIODIC:: 0.02 0.02 0.02\n0.001 0.002 0.003 0.001 -1\n0.005 0.002 0.003 0.001 -1\n";
        let packing = import_text(text.as_bytes()).unwrap();
        assert_eq!(packing.spheres[1], Sphere { position: Vec3::new(0.005, 0.002, 0.003), radius: 0.001 });
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("0 0 0 1\n0 0 0", "line 2: expected the four numbers x y z r, found 3: \"0 0 0\""),
            ("# c\n\n0 0 x 1", "line 3: \"x\" is not a number: \"0 0 x 1\""),
            ("0 0 0 -1", "line 1: the radius -1 is not positive: \"0 0 0 -1\""),
            ("0 0 NaN 1", "line 1: NaN is not finite: \"0 0 NaN 1\""),
            ("0 0 0 1 5 6", "line 1: expected the four numbers x y z r, found 6: \"0 0 0 1 5 6\""),
            (
                "0 0 0 1 -1\n0 0 2 1 5",
                "line 2: the sphere belongs to clump 5, and a packing has no clumps; write -1 in this column, and join the spheres by \
                 [[clump]] with a `set` of their ids: \"0 0 2 1 5\"",
            ),
            ("0 0 0 1 0.5", "line 1: \"0.5\" is not a number of a clump; -1 stands for none: \"0 0 0 1 0.5\""),
            ("#format x_y_z_r_matId_clumpId\n0 0 0 1 7 -1\n0 0 0 1 7 2", "line 3: the sphere belongs to clump 2"),
            ("##PERIODIC:: 1 2", "line 1: a periodic cell needs three positive edges: \"##PERIODIC:: 1 2\""),
            ("#format x_y_z\n0 0 0", "line 1: the columns must begin with x_y_z_r: \"#format x_y_z\""),
            ("# cell 1 0 0 2 0 0 0 0 1", "line 1: the cell has no volume: \"# cell 1 0 0 2 0 0 0 0 1\""),
        ];
        for (text, message) in cases {
            let error = import_text(text.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with(message), "{error}");
        }
        let error = import_text(&b"0 0 0 1\n\xff\xfe"[..]).unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("save the file as UTF-8"), "{error}");
    }
}
