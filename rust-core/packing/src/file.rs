//! Sphere packings as text: one line `x y z r` (m) per sphere; text after `#` is a comment.
//!
//! A periodic packing stores its cell in a comment: `# cell` with the nine components of the three edge vectors, one
//! vector after the other. The reader also accepts YADE's `##PERIODIC:: x y z` (edges of a box) and more columns, if YADE's
//! comment `#format x_y_z_r_matId` names them. Other formats: [`import`](super::import()).

use std::io::{BufRead, Write};

use super::{Packing, PackingError};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::Cell;
use concordem_solver::state::particles::Sphere;

/// Read spheres from text.
///
/// # Errors
/// Lines that are not four finite numbers with a positive radius, each with its number; errors of the reader.
pub fn import_text(mut reader: impl BufRead) -> Result<Packing, PackingError> {
    let mut packing = Packing::default();
    // Kept from line to line: packings have millions of them.
    let (mut line, mut values) = (String::new(), Vec::new());
    // Whether a comment of YADE names columns after x y z r, which are skipped.
    let mut further = false;
    for number in 1.. {
        line.clear();
        let failed = |source| PackingError::Io { action: format!("cannot read line {number}"), source };
        if reader.read_line(&mut line).map_err(failed)? == 0 {
            break;
        }
        let line = line.strip_suffix('\n').unwrap_or(&line);
        let line = line.strip_suffix('\r').unwrap_or(line);
        let bad =
            |reason: String| PackingError::BadLine { line: number, reason, text: line.chars().take(80).collect() };
        let mut numbers = |text: &str| -> Result<(), PackingError> {
            values.clear();
            for word in text.split_whitespace() {
                match word.parse::<f64>() {
                    Ok(value) if value.is_finite() => values.push(value),
                    Ok(value) => return Err(bad(format!("{value} is not finite"))),
                    Err(_) => return Err(bad(format!("{word:?} is not a number"))),
                }
            }
            Ok(())
        };
        if let Some(cell) = line.trim_start().strip_prefix("##PERIODIC::") {
            numbers(cell)?;
            let size = &values;
            if size.len() != 3 || size.iter().any(|edge| *edge <= 0.0) {
                return Err(bad("a periodic cell needs three positive edges".into()));
            }
            packing.cell = Some(Cell::new_box(Vec3::new(size[0], size[1], size[2])));
            continue;
        }
        if let Some(cell) = line.trim_start().strip_prefix("# cell ") {
            numbers(cell)?;
            if values.len() != 9 {
                return Err(bad("a cell has three edge vectors with three components each".into()));
            }
            let cell = Cell::new(Mat3::from_column_slice(&values));
            if !cell.volume().is_normal() {
                return Err(bad("the cell has no volume".into()));
            }
            packing.cell = Some(cell);
            continue;
        }
        if let Some(format) = line.trim_start().strip_prefix("#format ") {
            let Some(rest) = format.trim().strip_prefix("x_y_z_r") else {
                return Err(bad("the columns must begin with x_y_z_r".into()));
            };
            further = !rest.is_empty();
            continue;
        }
        let content = line.split('#').next().unwrap_or("");
        if further {
            numbers(&content.split_whitespace().take(4).collect::<Vec<_>>().join(" "))?;
        } else {
            numbers(content)?;
        }
        match values[..] {
            [] => {}
            [x, y, z, radius] if radius > 0.0 => {
                packing.spheres.push(Sphere { position: Vec3::new(x, y, z), radius });
            }
            [_, _, _, radius] => return Err(bad(format!("the radius {radius} is not positive"))),
            _ => return Err(bad(format!("expected the four numbers x y z r, found {}", values.len()))),
        }
    }
    Ok(packing)
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
    }

    #[test]
    fn errors_name_the_line() {
        let cases = [
            ("0 0 0 1\n0 0 0", "line 2: expected the four numbers x y z r, found 3: \"0 0 0\""),
            ("# c\n\n0 0 x 1", "line 3: \"x\" is not a number: \"0 0 x 1\""),
            ("0 0 0 -1", "line 1: the radius -1 is not positive: \"0 0 0 -1\""),
            ("0 0 NaN 1", "line 1: NaN is not finite: \"0 0 NaN 1\""),
            ("0 0 0 1 5", "line 1: expected the four numbers x y z r, found 5: \"0 0 0 1 5\""),
            ("##PERIODIC:: 1 2", "line 1: a periodic cell needs three positive edges: \"##PERIODIC:: 1 2\""),
            ("#format x_y_z\n0 0 0", "line 1: the columns must begin with x_y_z_r: \"#format x_y_z\""),
            ("# cell 1 0 0 2 0 0 0 0 1", "line 1: the cell has no volume: \"# cell 1 0 0 2 0 0 0 0 1\""),
        ];
        for (text, message) in cases {
            assert_eq!(import_text(text.as_bytes()).unwrap_err().to_string(), message);
        }
        assert!(matches!(import_text(&b"0 0 0 1\n\xff\xfe"[..]), Err(PackingError::Io { .. })));
    }
}
