//! Journal of the finished points of a sweep: a text file with one line per point.
//!
//! A line holds the number of the point, the bits of its values, its problem, and a hash of the line. A line cut off by a
//! crash does not match its hash and is ignored; the point is computed again.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::outcome::Outcome;

const MAGIC: &str = "concordem sweep 1";

/// The journal of a running sweep.
#[derive(Debug)]
pub struct Journal {
    file: File,
}

/// Error of a journal.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// The journal belongs to another sweep, scenario, input file, or version of the program.
    #[error(
        "{} has points of another sweep, scenario, or packing file, or of another version of the program; --force discards them",
        path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
    },
    /// Error of the operating system.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Attempted action.
        action: &'static str,
        /// Error of the operating system.
        source: io::Error,
    },
}

/// Path of the journal of a result.
pub fn path_of(result: &Path) -> PathBuf {
    let mut name = result.as_os_str().to_owned();
    name.push(".points");
    PathBuf::from(name)
}

impl Journal {
    /// Opens or creates a journal of points with this many numbers; returns the points in it.
    ///
    /// # Errors
    /// The journal belongs to another sweep, or the operating system reports an error.
    pub fn open(
        path: &Path,
        fingerprint: &str,
        numbers: usize,
    ) -> Result<(Self, BTreeMap<usize, Outcome>), JournalError> {
        let failed = |action| move |source| JournalError::Io { path: path.to_owned(), action, source };
        let mut options = File::options();
        options.read(true).append(true).create(true);
        let mut file = options.open(path).map_err(failed("open"))?;
        let mut bytes = Vec::new();
        file.read_to_end(&mut bytes).map_err(failed("read"))?;
        let text = String::from_utf8_lossy(&bytes);
        let head = format!("{MAGIC} {fingerprint}");
        let mut lines = text.split('\n');
        let mut known = BTreeMap::new();
        if !text.contains('\n') && head.starts_with(&*text) {
            // New, or cut off while its first line was written.
            file.set_len(0).map_err(failed("write"))?;
            file.write_all(format!("{head}\n").as_bytes()).and_then(|()| file.sync_all()).map_err(failed("write"))?;
            let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
            concordem_files::paths::sync_folder(folder).map_err(failed("write"))?;
        } else if lines.next() != Some(&head) {
            return Err(JournalError::Other { path: path.to_owned() });
        } else {
            known.extend(lines.filter_map(|line| read_line(line, numbers)));
            // Start a new line after an incomplete one.
            if bytes.last() != Some(&b'\n') {
                file.write_all(b"\n").map_err(failed("write"))?;
            }
        }
        Ok((Self { file }, known))
    }

    /// Appends a finished point.
    ///
    /// # Errors
    /// The operating system reports an error.
    pub fn add(&mut self, point: usize, outcome: &Outcome) -> io::Result<()> {
        self.add_all([(point, outcome)])
    }

    /// Appends finished points.
    ///
    /// # Errors
    /// The operating system reports an error.
    pub fn add_all<'a>(&mut self, points: impl IntoIterator<Item = (usize, &'a Outcome)>) -> io::Result<()> {
        for (point, outcome) in points {
            let line = content(point, outcome);
            self.file.write_all(format!("{line} {}\n", mark(&line)).as_bytes())?;
        }
        self.file.sync_data()
    }
}

/// The points of a journal that is only read; none if it has no complete first line yet.
///
/// # Errors
/// The journal belongs to another sweep, or cannot be read.
pub fn read(path: &Path, fingerprint: &str, numbers: usize) -> Result<BTreeMap<usize, Outcome>, JournalError> {
    let bytes =
        std::fs::read(path).map_err(|source| JournalError::Io { path: path.to_owned(), action: "read", source })?;
    let text = String::from_utf8_lossy(&bytes);
    let Some((head, lines)) = text.split_once('\n') else { return Ok(BTreeMap::new()) };
    if head != format!("{MAGIC} {fingerprint}") {
        return Err(JournalError::Other { path: path.to_owned() });
    }
    Ok(lines.split('\n').filter_map(|line| read_line(line, numbers)).collect())
}

fn mark(line: &str) -> String {
    blake3::hash(line.as_bytes()).to_hex()[..16].to_owned()
}

fn content(point: usize, outcome: &Outcome) -> String {
    let mut line = point.to_string();
    for value in &outcome.values {
        let _ = write!(line, " {:016x}", value.to_bits());
    }
    // JSON has no line breaks.
    let _ = write!(line, " {}", serde_json::Value::from(outcome.problem.clone()));
    line
}

fn read_line(line: &str, numbers: usize) -> Option<(usize, Outcome)> {
    let (line, found) = line.rsplit_once(' ')?;
    if mark(line) != found {
        return None;
    }
    let mut outcome = Outcome::new(numbers);
    let mut parts = line.splitn(numbers + 2, ' ');
    let point = parts.next()?.parse().ok()?;
    for value in &mut outcome.values {
        *value = f64::from_bits(u64::from_str_radix(parts.next()?, 16).ok()?);
    }
    outcome.problem = serde_json::from_str(parts.next()?).ok()?;
    Some((point, outcome))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn finished_points_are_read_back_and_incomplete_lines_are_ignored() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.points");
        let mut outcome = Outcome::new(7);
        outcome.values[3] = 0.1 + 0.2;
        outcome.values[4] = f64::NAN;
        let bad = Outcome::failed(7, "two words\nand a line".into());
        let (mut journal, known) = Journal::open(&path, "f", 7).unwrap();
        assert!(known.is_empty());
        journal.add(7, &outcome).unwrap();
        journal.add(2, &bad).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let (_, known) = Journal::open(&path, "f", 7).unwrap();
        assert_eq!(known.keys().copied().collect::<Vec<_>>(), [2, 7]);
        assert_eq!(known[&7].values[3].to_bits(), (0.1 + 0.2_f64).to_bits());
        assert!(known[&7].values[4].is_nan());
        assert_eq!(known[&2].problem, bad.problem);
        // If the file is cut off anywhere, no point is read back with other numbers, and the next line is complete.
        for length in (whole.len() / 2)..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (mut journal, known) = Journal::open(&path, "f", 7).unwrap();
            assert!(known.len() <= 2 && known.get(&7).is_none_or(|k| k.values[3] == 0.1 + 0.2));
            journal.add(9, &outcome).unwrap();
            drop(journal);
            assert!(Journal::open(&path, "f", 7).unwrap().1.contains_key(&9), "cut at {length}");
        }
        // A journal that is only read has the same points; points with another number of values are none.
        let points = read(&path, "f", 7).unwrap();
        assert!(points.keys().eq(Journal::open(&path, "f", 7).unwrap().1.keys()));
        assert_eq!(points[&7].values[3].to_bits(), (0.1 + 0.2_f64).to_bits());
        assert!(read(&path, "f", 8).unwrap().is_empty() && read(&path, "g", 7).is_err());
        assert!(matches!(Journal::open(&path, "g", 7), Err(JournalError::Other { .. })));
        // The first line is written again if it was cut off.
        for length in 0..MAGIC.len() + 2 {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (mut journal, known) = Journal::open(&path, "f", 7).unwrap();
            assert!(known.is_empty(), "cut at {length}");
            journal.add(9, &outcome).unwrap();
            assert!(Journal::open(&path, "f", 7).unwrap().1.contains_key(&9), "cut at {length}");
        }
    }
}
