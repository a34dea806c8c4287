//! Reads surfaces in STL format, text or binary.
//!
//! Text has any number of solids, keywords in any case, and any white space between words; names of solids are optional. Coordinates
//! have single precision, as in the binary format. Files of other formats are refused by their name.

use std::collections::BTreeMap;

use super::PackingError;
use concordem_contact::math::Vec3;

/// Bytes before the first triangle of a binary file: a comment and the number of triangles.
const HEADER: usize = 84;
/// Bytes of a triangle in a binary file: normal, three corners, two further bytes.
const RECORD: usize = 50;
/// Begin of files of other formats, and what they are.
const OTHERS: [(&[u8], &str); 9] = [
    (b"ply", "a PLY file"),
    (b"OFF", "an OFF file"),
    (b"PK\x03\x04", "a ZIP archive, such as 3MF"),
    (b"\x1f\x8b", "compressed by gzip"),
    (b"ISO-10303-21", "a STEP file"),
    (b"# vtk", "a VTK file"),
    (b"glTF", "a glTF file"),
    (b"\x89HDF\r\n", "an HDF5 file"),
    (b"<", "an XML or HTML file"),
];

/// Triangles with common corners.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Surface {
    /// Corners, m, in the order of their first appearance in the file. Corners with equal coordinates are one.
    pub vertices: Vec<Vec3>,
    /// Indices of the corners of each triangle.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// What is wrong with a surface that particles touch from both sides if triangles have the corners of others; `None` if none have.
    pub fn repeated(&self) -> Option<String> {
        let with_area = self.triangles.iter().filter(|[a, b, c]| a != b && b != c && c != a);
        let mut sorted: Vec<[u32; 3]> = with_area.copied().collect();
        for triangle in &mut sorted {
            triangle.sort_unstable();
        }
        sorted.sort_unstable();
        let count = sorted.windows(2).filter(|pair| pair[0] == pair[1]).count();
        let all = self.triangles.len();
        (count > 0)
            .then(|| format!("{count} of its {all} triangles stand there before, so that both would push; remove them"))
    }

    /// Corners of the triangles that have an area. Others have no surface; their edges belong to their neighbors.
    pub fn triangles_with_area(&self) -> Vec<[Vec3; 3]> {
        let corners = |triangle: &[u32; 3]| triangle.map(|vertex| self.vertices[vertex as usize]);
        let mut triangles: Vec<[Vec3; 3]> = self.triangles.iter().map(corners).collect();
        triangles.retain(|[a, b, c]| (b - a).cross(&(c - a)).norm() > 0.0);
        triangles
    }
}

/// Reads a surface; `unit`: length of one unit of the file, m.
///
/// # Errors
/// What is not STL, with the line or the triangle; a file without triangles or with bytes after the last one.
pub fn read_stl(bytes: &[u8], unit: f64) -> Result<Surface, PackingError> {
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut welded = Welded { unit, ..Welded::default() };
    // Some programs begin binary files with the keyword of the text format; their length tells them apart.
    let is_binary = count_of_binary(bytes).is_some_and(|count| bytes.len() as u64 == length_of_binary(count));
    let start = bytes.trim_ascii_start();
    let is_text = !is_binary && !bytes.contains(&0);
    if is_text && start.get(..5).is_some_and(|word| word.eq_ignore_ascii_case(b"solid")) {
        text(bytes, &mut welded)?;
    } else if let Some(other) = other_format(bytes).filter(|_| !is_binary) {
        return foreign(format!("it is {other}, not STL; save the surface as STL, with the program that made it"));
    } else {
        binary(bytes, &mut welded)?;
    }
    if welded.surface.triangles.is_empty() {
        return foreign("it has no triangles; save the surface as STL anew".to_owned());
    }
    Ok(welded.surface)
}

fn foreign<T>(reason: String) -> Result<T, PackingError> {
    Err(PackingError::Foreign { reason })
}

/// What a file is instead, by its first bytes.
fn other_format(bytes: &[u8]) -> Option<&'static str> {
    if bytes.starts_with(b"\xff\xfe") || bytes.starts_with(b"\xfe\xff") {
        return Some("text in UTF-16");
    }
    let found = OTHERS.iter().find(|(start, _)| bytes.starts_with(start)).map(|(_, what)| *what);
    // A line `v x y z` begins the list of vertices, after comments and names.
    let is_vertex = |line: &[u8]| line.starts_with(b"v ") || line.starts_with(b"v\t");
    found.or_else(|| bytes.split(|byte| *byte == b'\n').take(100).any(is_vertex).then_some("an OBJ file"))
}

fn count_of_binary(bytes: &[u8]) -> Option<u32> {
    let count = bytes.get(HEADER - 4..HEADER)?;
    Some(u32::from_le_bytes([count[0], count[1], count[2], count[3]]))
}

fn length_of_binary(count: u32) -> u64 {
    HEADER as u64 + RECORD as u64 * u64::from(count)
}

fn binary(bytes: &[u8], welded: &mut Welded) -> Result<(), PackingError> {
    let Some(count) = count_of_binary(bytes) else {
        return foreign(
            "it is not STL: a text begins with `solid`, and a binary file has at least 84 bytes; save the surface as STL anew"
                .to_owned(),
        );
    };
    let (length, expected) = (bytes.len() as u64, length_of_binary(count));
    if length < expected {
        return foreign(format!(
            "as binary STL it counts {count} triangles ({expected} bytes), but it has {length} bytes; it is cut off, or not STL"
        ));
    }
    // Some programs fill the last block of a file with zeros.
    if bytes[expected as usize..].iter().any(|byte| *byte != 0) {
        return foreign(format!(
            "as binary STL it counts {count} triangles ({expected} bytes), but it has {length} bytes; a binary file holds one list \
             of triangles: save all solids as one surface"
        ));
    }
    for (number, record) in bytes[HEADER..expected as usize].chunks_exact(RECORD).enumerate() {
        let value = |at: usize| f32::from_le_bytes([record[at], record[at + 1], record[at + 2], record[at + 3]]);
        let corner = |first: usize| [value(first), value(first + 4), value(first + 8)];
        let corners = [corner(12), corner(24), corner(36)];
        if !corners.iter().flatten().all(|value| value.is_finite()) {
            return foreign(format!("triangle {number} has the corners {corners:?}; coordinates must be finite"));
        }
        welded.add(corners);
    }
    Ok(())
}

/// Corners with equal coordinates become one.
#[derive(Default)]
struct Welded {
    unit: f64,
    surface: Surface,
    numbers: BTreeMap<[u32; 3], u32>,
}

impl Welded {
    fn add(&mut self, corners: [[f32; 3]; 3]) {
        let triangle = corners.map(|corner| {
            // Adding 0 makes −0 and 0 the same.
            let key = corner.map(|value| (value + 0.0).to_bits());
            *self.numbers.entry(key).or_insert_with(|| {
                self.surface.vertices.push(Vec3::from(corner.map(f64::from)) * self.unit);
                self.surface.vertices.len() as u32 - 1
            })
        });
        self.surface.triangles.push(triangle);
    }
}

/// Words of a text with the numbers of their lines.
struct Words<'a> {
    /// Rest of the current line.
    line: &'a str,
    /// The current line, whole, and its number, from 1.
    whole: &'a str,
    number: usize,
    lines: std::str::Split<'a, char>,
}

impl<'a> Words<'a> {
    fn new(text: &'a str) -> Self {
        // Lines end with \n, \r\n, or \r alone.
        let end = if text.contains('\n') { '\n' } else { '\r' };
        Self { line: "", whole: "", number: 0, lines: text.split(end) }
    }

    fn word(&mut self) -> Option<&'a str> {
        loop {
            let rest = self.line.trim_start();
            if !rest.is_empty() {
                let end = rest.find(char::is_whitespace).unwrap_or(rest.len());
                let (word, line) = rest.split_at(end);
                self.line = line;
                return Some(word);
            }
            self.whole = self.lines.next()?;
            self.line = self.whole;
            self.number += 1;
        }
    }

    fn bad(&self, reason: String) -> PackingError {
        PackingError::BadLine {
            line: self.number,
            reason,
            text: self.whole.trim().chars().take(80).collect(),
            others: String::new(),
        }
    }

    fn expect(&mut self, words: &[&str]) -> Result<(), PackingError> {
        for word in words {
            match self.word() {
                Some(found) if found.eq_ignore_ascii_case(word) => {}
                Some(found) => return Err(self.bad(format!("expected `{word}`, found {found:?}"))),
                None => return Err(self.cut()),
            }
        }
        Ok(())
    }

    fn cut(&self) -> PackingError {
        self.bad("the file ends before `endsolid`; it is cut off".to_owned())
    }

    /// Three finite numbers.
    fn vector(&mut self) -> Result<[f32; 3], PackingError> {
        let mut values = [0.0; 3];
        for value in &mut values {
            let word = self.word().ok_or_else(|| self.cut())?;
            *value = match word.parse::<f32>() {
                Ok(number) if number.is_finite() => number,
                Ok(number) => return Err(self.bad(format!("{number} is not finite"))),
                Err(_) => return Err(self.bad(format!("{word:?} is not a number, such as 0.5 or 1e-3"))),
            };
        }
        Ok(values)
    }
}

fn text(bytes: &[u8], welded: &mut Welded) -> Result<(), PackingError> {
    // Names of solids are the only place for other characters.
    let text = String::from_utf8_lossy(bytes);
    let mut words = Words::new(&text);
    let mut is_open = false;
    while let Some(word) = words.word() {
        match word.to_ascii_lowercase().as_str() {
            // The rest of the line is the name.
            "solid" if !is_open => (is_open, words.line) = (true, ""),
            "endsolid" | "end" if is_open => (is_open, words.line) = (false, ""),
            "facet" if is_open => {
                words.expect(&["normal"])?;
                // Its place is the order of the corners; a normal may be zero or not a number.
                for _ in 0..3 {
                    words.word();
                }
                words.expect(&["outer", "loop"])?;
                let mut corners = [[0.0; 3]; 3];
                for corner in &mut corners {
                    words.expect(&["vertex"])?;
                    *corner = words.vector()?;
                }
                words.expect(&["endloop", "endfacet"])?;
                welded.add(corners);
            }
            _ => {
                let expected = if is_open { "`facet` or `endsolid`" } else { "`solid`" };
                return Err(words.bad(format!("expected {expected}, found {word:?}")));
            }
        }
    }
    if is_open { Err(words.cut()) } else { Ok(()) }
}
