//! The file of `bond list FILE`: in each line two atom ids, and optionally the reference length (m).

use crate::atoms::{LARGEST_TAG, Tag};
use crate::options::OptionError;
use crate::pieces::{Entry, PieceReader};

/// A bond of the user's list.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct BondOfList {
    /// Ids of its atoms, the lower one first.
    pub ids: [i64; 2],
    /// Reference length, m; 0: the current distance.
    pub length: f64,
    /// Its line in the file.
    pub line: i64,
}

impl Entry for BondOfList {
    fn ids(&self) -> [Tag; 2] {
        self.ids
    }

    fn line(&self) -> i64 {
        self.line
    }
}

/// Read the next bonds of a list. Returns their number; fewer than there is room for: the file ends.
///
/// # Errors
/// The file cannot be read, or a line is wrong.
pub fn read_bonds(reader: &mut PieceReader, bonds: &mut [BondOfList]) -> Result<usize, OptionError> {
    reader.read(bonds, |text, line| {
        if text.is_empty() {
            return Ok(None);
        }
        let mut words = text.split_whitespace();
        let mut id = || words.next()?.parse().ok().filter(|tag: &Tag| (1..=LARGEST_TAG).contains(tag));
        let (a, b) = (id(), id());
        let length = words.next().map_or(Some(0.0), |word| word.parse().ok().filter(|l: &f64| *l > 0.0 && l.is_finite()));
        match (a, b, length, words.next()) {
            (Some(a), Some(b), Some(length), None) if a != b => {
                Ok(Some(BondOfList { ids: [a.min(b), a.max(b)], length, line }))
            }
            _ => Err(format!(
                "`{text}` is not a bond; write two different atom ids and optionally the reference length in meters (default: the \
                 current distance)"
            )),
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Read in pieces of `most`, up to the end.
    fn read(text: &str, most: usize) -> Result<Vec<BondOfList>, String> {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let mut reader = PieceReader::open(file.path().to_str().unwrap()).unwrap();
        let (mut all, mut piece) = (Vec::new(), vec![BondOfList::default(); most]);
        loop {
            let count = read_bonds(&mut reader, &mut piece).map_err(|error| error.to_string())?;
            all.extend_from_slice(&piece[..count]);
            if count < most {
                return Ok(all);
            }
        }
    }

    #[test]
    fn pieces_have_the_bonds_of_the_whole_file() {
        let text = "# list\r\n\n7 3 .25 # long\n  9007199254740992\t1\r\n3 2 1e-3";
        let bond = |ids, length, line| BondOfList { ids, length, line };
        let wanted = [bond([3, 7], 0.25, 3), bond([1, LARGEST_TAG], 0.0, 4), bond([2, 3], 1e-3, 5)];
        for most in 1..5 {
            assert_eq!(read(text, most).unwrap(), wanted, "pieces of {most}");
        }
        assert_eq!(read("# nothing", 2).unwrap(), []);
    }

    #[test]
    fn wrong_lines_are_named() {
        for line in ["1", "1 1", "1 two", "0 1", "-1 2", "1 9007199254740993", "1 2 0", "1 2 inf", "1 2 0.1 3"] {
            let error = read(&format!("1 2\n{line} # x\n3 4\n"), 3).unwrap_err();
            let wanted = format!("line 2: `{line}` is not a bond; write two different atom ids");
            assert!(error.contains(&wanted), "{error}");
        }
    }

    #[test]
    fn another_encoding_is_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), b"1 2\n3 4 # L\xe4nge\n").unwrap();
        let mut reader = PieceReader::open(file.path().to_str().unwrap()).unwrap();
        let error = read_bonds(&mut reader, &mut [BondOfList::default(); 3]).unwrap_err().to_string();
        assert!(error.contains("line 2: ") && error.contains("save the file as UTF-8"), "{error}");
    }
}
