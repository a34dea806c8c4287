//! Text files of the script commands, read in pieces by one processor. Each processor keeps a share of their lines.

use std::fs::File;
use std::io::{BufRead, BufReader};

use crate::atoms::Tag;
use crate::options::OptionError;

/// An atom or a bond of a file.
pub trait Entry {
    /// Ids of the atoms of a bond, the lower one first; of an atom its id and 0.
    fn ids(&self) -> [Tag; 2];
    /// Its line in the file.
    fn line(&self) -> i64;
}

/// Sort entries by ids, and those with the same ids by line.
pub fn sort_entries<E: Entry>(entries: &mut [E]) {
    entries.sort_unstable_by_key(|entry| (entry.ids(), entry.line()));
}

/// The lowest line with an atom or bond of an earlier line, and that line; of sorted entries.
pub fn given_twice<E: Entry + Copy>(sorted: &[E]) -> Option<[E; 2]> {
    let same = sorted.windows(2).filter(|pair| pair[0].ids() == pair[1].ids());
    same.min_by_key(|pair| pair[1].line()).map(|pair| [pair[1], pair[0]])
}

/// Check that no atom or bond is given twice, of what a processor keeps of a file.
///
/// # Errors
/// Two lines have the same atom or bond: the lowest second one, and the message.
pub fn check_once<E: Entry + Copy>(twice: Option<[E; 2]>, path: &str) -> Result<(), (i64, OptionError)> {
    let Some([second, first]) = twice else { return Ok(()) };
    let what = match second.ids() {
        [atom, 0] => format!("atom {atom}"),
        [a, b] => format!("the bond of atoms {a} and {b}"),
    };
    let message = format!(
        "line {}: {what} is given twice, for the first time in line {}; remove one line",
        second.line(),
        first.line()
    );
    Err((second.line(), OptionError::File { path: path.to_owned(), message }))
}

/// Reads a file in pieces. `#` begins a comment.
#[derive(Debug)]
pub struct PieceReader {
    path: String,
    file: BufReader<File>,
    line: String,
    /// Number of the line.
    number: i64,
}

impl PieceReader {
    /// Open a file.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(path: &str) -> Result<Self, OptionError> {
        let failed = |error: std::io::Error| OptionError::File { path: path.to_owned(), message: error.to_string() };
        let file = BufReader::new(File::open(path).map_err(failed)?);
        Ok(Self { path: path.to_owned(), file, line: String::new(), number: 0 })
    }

    /// Read the next entries. `entry` makes one of the text of a line, without its comment, and of its number; or none, or says what is wrong.
    /// Returns their number; fewer than there is room for: the file ends.
    ///
    /// # Errors
    /// The file cannot be read, or a line is wrong.
    pub fn read<E>(
        &mut self,
        entries: &mut [E],
        mut entry: impl FnMut(&str, i64) -> Result<Option<E>, String>,
    ) -> Result<usize, OptionError> {
        let mut count = 0;
        while count < entries.len() {
            self.line.clear();
            let read = self.file.read_line(&mut self.line);
            self.number += 1;
            if read.map_err(|error| self.wrong(format!("line {}: {error}; save the file as UTF-8", self.number)))? == 0
            {
                break;
            }
            let text = self.line.split('#').next().unwrap_or_default().trim();
            let made = entry(text, self.number);
            if let Some(made) = made.map_err(|message| self.wrong(format!("line {}: {message}", self.number)))? {
                entries[count] = made;
                count += 1;
            }
        }
        Ok(count)
    }

    /// The file is wrong.
    pub fn wrong(&self, message: String) -> OptionError {
        OptionError::File { path: self.path.clone(), message }
    }
}
