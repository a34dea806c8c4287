//! The finished points of a sweep that is under way: a text file to which a line is added for each.
//!
//! A line holds the point's number, its values bit by bit, what went wrong if anything did, and a hash of all that. A line
//! that was cut off by a crash does not fit its hash and is left out; the point is computed again.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

use super::point::Outcome;

const MAGIC: &str = "concordem sweep 1";

/// Where the finished points of a sweep are kept until all are.
#[derive(Debug)]
pub struct Journal {
    file: File,
}

/// Why a journal cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum JournalError {
    /// It belongs to another sweep, scenario, file that one reads, or version of the program.
    #[error(
        "{} holds points of another sweep, scenario, or packing file, or of another version of the program; --force discards them",
        path.display()
    )]
    Other {
        /// The file.
        path: PathBuf,
    },
    /// The system refused.
    #[error("cannot {action} {}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system says.
        source: io::Error,
    },
}

/// The place of the journal of a result.
pub fn path_of(result: &Path) -> PathBuf {
    let mut name = result.as_os_str().to_owned();
    name.push(".points");
    PathBuf::from(name)
}

impl Journal {
    /// Go on with a journal, or begin one; what it holds.
    ///
    /// # Errors
    /// A journal of another sweep; the system's.
    pub fn open(path: &Path, fingerprint: &str) -> Result<(Self, BTreeMap<usize, Outcome>), JournalError> {
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
        if bytes.is_empty() {
            writeln!(file, "{head}").and_then(|()| file.sync_all()).map_err(failed("write"))?;
        } else if lines.next() != Some(&head) {
            return Err(JournalError::Other { path: path.to_owned() });
        } else {
            known.extend(lines.filter_map(read_line));
            // After a line that was cut off, begin a new one.
            if bytes.last() != Some(&b'\n') {
                file.write_all(b"\n").map_err(failed("write"))?;
            }
        }
        Ok((Self { file }, known))
    }

    /// Note a finished point.
    ///
    /// # Errors
    /// The system's.
    pub fn add(&mut self, point: usize, outcome: &Outcome) -> io::Result<()> {
        let line = content(point, outcome);
        writeln!(self.file, "{line} {}", mark(&line)).and_then(|()| self.file.sync_data())
    }
}

fn mark(line: &str) -> String {
    blake3::hash(line.as_bytes()).to_hex()[..16].to_owned()
}

fn content(point: usize, outcome: &Outcome) -> String {
    let mut line = point.to_string();
    for value in &outcome.values {
        let _ = write!(line, " {:016x}", value.to_bits());
    }
    // As JSON, so that it stays in the line.
    let _ = write!(line, " {}", serde_json::Value::from(outcome.problem.clone()));
    line
}

fn read_line(line: &str) -> Option<(usize, Outcome)> {
    let (line, found) = line.rsplit_once(' ')?;
    if mark(line) != found {
        return None;
    }
    let values = super::point::columns().len();
    let mut parts = line.splitn(values + 2, ' ');
    let point = parts.next()?.parse().ok()?;
    let mut outcome = Outcome::default();
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
    fn what_was_noted_comes_back_and_torn_lines_do_not() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.points");
        let mut outcome = Outcome::default();
        outcome.values[3] = 0.1 + 0.2;
        outcome.values[4] = f64::NAN;
        let bad = Outcome { problem: Some("two words\nand a line".into()), ..Outcome::default() };
        let (mut journal, known) = Journal::open(&path, "f").unwrap();
        assert!(known.is_empty());
        journal.add(7, &outcome).unwrap();
        journal.add(2, &bad).unwrap();
        drop(journal);
        let whole = std::fs::read(&path).unwrap();
        let (_, known) = Journal::open(&path, "f").unwrap();
        assert_eq!(known.keys().copied().collect::<Vec<_>>(), [2, 7]);
        assert_eq!(known[&7].values[3].to_bits(), (0.1 + 0.2_f64).to_bits());
        assert!(known[&7].values[4].is_nan());
        assert_eq!(known[&2].problem, bad.problem);
        // Cut off anywhere, no point comes back with other numbers, and the next line is whole.
        for length in (whole.len() / 2)..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            let (mut journal, known) = Journal::open(&path, "f").unwrap();
            assert!(known.len() <= 2 && known.get(&7).is_none_or(|k| k.values[3] == 0.1 + 0.2));
            journal.add(9, &outcome).unwrap();
            drop(journal);
            assert!(Journal::open(&path, "f").unwrap().1.contains_key(&9), "cut at {length}");
        }
        assert!(matches!(Journal::open(&path, "g"), Err(JournalError::Other { .. })));
    }
}
