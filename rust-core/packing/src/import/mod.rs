//! Reads packings of other programs: comma-separated tables, data and dump files of LAMMPS and LIGGGHTS, and text of YADE.
//!
//! [`import`] recognizes the format by its content. Most files of other programs carry no units, so the caller gives the length of one unit
//! of the file. Where a file gives its unit, that holds, and the caller must not give another.

mod columns;
mod lammps;
mod table;

use std::borrow::Cow;
use std::io::BufRead;

use super::{Packing, PackingError, import_text};
pub(crate) use columns::loose;
use columns::split_name;
use concordem_solver::state::Cell;

/// Begin of files of other formats, and what to do with them.
const OTHERS: [(&[u8], &str); 14] = [
    (
        b"SQLite format 3\0",
        "a data base of YADE (memoizeDb); read it with concordem.packing.read_memoized in Python, or load it in YADE with \
         randomDensePack and write it with SpherePack.save",
    ),
    (b"\x89HDF\r\n", "an HDF5 file; give it the extension .h5"),
    (b"PK\x03\x04", "a ZIP archive, such as a spreadsheet (.xlsx, .ods); save the table as CSV"),
    (b"\xd0\xcf\x11\xe0", "a spreadsheet (.xls); save the table as CSV"),
    (b"\x1f\x8b", "compressed by gzip; unpack it with gunzip"),
    (b"BZh", "compressed by bzip2; unpack it with bunzip2"),
    (b"\x93NUMPY", "an array of NumPy; write it with numpy.savetxt"),
    (b"\xff\xfe", "text in UTF-16; save it as UTF-8"),
    (b"\xfe\xff", "text in UTF-16; save it as UTF-8"),
    (b"# vtk DataFile", "a VTK file; export the points as CSV, for example in ParaView (File, Save Data)"),
    (b"<", "an XML file, such as VTU; export the points as CSV, for example in ParaView (File, Save Data)"),
    (b"{", "a JSON file; write CSV with the columns x, y, z, radius"),
    (b"ply\n", "a PLY surface; a packing has one sphere per line: x y z r"),
    (b"solid ", "an STL surface; use it as `shape` of the packing or of a [[wall]]"),
];

/// Reads spheres in any known text format; `unit`: length of one unit of the file, m (1 if `None`).
///
/// # Errors
/// A file without spheres, a format without radii, and lines that cannot be read, each with its number.
pub fn import(mut reader: impl BufRead, unit: Option<f64>) -> Result<Packing, PackingError> {
    let mut bytes = Vec::new();
    reader
        .read_to_end(&mut bytes)
        .map_err(|source| PackingError::Io { action: "cannot read the packing".into(), source })?;
    if let Some((_, what)) = OTHERS.iter().find(|(start, _)| bytes.starts_with(start)) {
        return Err(foreign(format!("it is {what}")));
    }
    let bytes = plain_text(&bytes);
    let text = String::from_utf8_lossy(&bytes);
    let Read { mut packing, unit: given } = read(&text, &bytes)?;
    if packing.spheres.is_empty() {
        return Err(foreign("it has no spheres; a packing has one sphere per line: x y z r"));
    }
    let scale = match (given, unit) {
        (Some(_), Some(_)) => return Err(foreign("it gives the unit of its lengths, and so does `unit`; remove one")),
        (Some(given), None) => given,
        (None, unit) => unit.unwrap_or(1.0),
    };
    if scale != 1.0 {
        for sphere in &mut packing.spheres {
            sphere.position *= scale;
            sphere.radius *= scale;
        }
        packing.cell = packing.cell.map(|cell| Cell::new(cell.matrix * scale));
    }
    Ok(packing)
}

/// What a file gives.
struct Read {
    packing: Packing,
    /// Unit of its lengths, m, if it gives one.
    unit: Option<f64>,
}

/// Reads text by its format.
fn read(text: &str, bytes: &[u8]) -> Result<Read, PackingError> {
    let content = |line: &'_ str| line.split('#').next().unwrap_or("").trim().to_owned();
    let first = text.lines().map(content).find(|line| !line.is_empty()).unwrap_or_default();
    if first.starts_with("ITEM:") {
        return lammps::dump(text);
    }
    if lammps::is_data(text) {
        return lammps::data(text);
    }
    let separator = if first.contains(';') {
        Some(table::Separator::Semicolons)
    } else if first.contains(',') {
        Some(table::Separator::Commas)
    } else {
        let is_header = first.split_whitespace().any(|word| word.parse::<f64>().is_err() && split_name(word).is_some());
        is_header.then_some(table::Separator::Spaces)
    };
    let named = table::named_by_comment(text, separator.unwrap_or(table::Separator::Spaces))?;
    let plain = named.as_ref().is_none_or(table::Named::is_plain);
    let (None, true) = (separator, plain) else {
        let mut read = table::read(text, separator.unwrap_or(table::Separator::Spaces), named)?;
        // The cell of our own tables and of YADE is a comment.
        for line in text.lines().filter(|line| ["# cell ", "##PERIODIC::"].iter().any(|start| line.starts_with(start)))
        {
            read.packing.cell = import_text(line.as_bytes())?.cell;
        }
        return Ok(read);
    };
    // Reads the bytes again, to refuse those that are not UTF-8 with the number of their line.
    let packing = import_text(bytes)?;
    Ok(Read { packing, unit: named.and_then(|named| named.units).map(|_| 1.0) })
}

/// The text without a byte order mark, with lines that end with `\n`.
fn plain_text(bytes: &[u8]) -> Cow<'_, [u8]> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    if bytes.contains(&b'\n') || !bytes.contains(&b'\r') {
        return Cow::Borrowed(bytes);
    }
    bytes.iter().map(|byte| if *byte == b'\r' { b'\n' } else { *byte }).collect()
}

fn foreign(reason: impl Into<String>) -> PackingError {
    PackingError::Foreign { reason: reason.into() }
}

fn bad(number: usize, reason: impl Into<String>, line: &str) -> PackingError {
    PackingError::BadLine {
        line: number,
        reason: reason.into(),
        text: line.trim_end().chars().take(80).collect(),
        others: String::new(),
    }
}
