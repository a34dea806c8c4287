//! The file of `heat_network FILE`: heat capacities of atoms, and areas of their bonds, as `concordem export --format heat-network`
//! writes them.
//!
//! ```text
//! model disordered
//! atom ID CAPACITY VOLUME                # J/K, m³
//! bond ID ID AREA LENGTH LENGTH          # m², m; the lengths from the center of each atom to the area
//! ```
//!
//! `#` begins a comment. Ids are those of the host. A file may be larger than the memory of a processor, so one processor reads it in
//! pieces, and each keeps a share of it.

use concordem_contact::heat::HeatNetwork;

use crate::atoms::{LARGEST_TAG, Tag};
use crate::options::{OptionError, named};
use crate::pieces::{Entry, PieceReader, given_twice, sort_entries};

/// An atom or a bond of the file.
#[repr(C)]
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(test, derive(type_layout::TypeLayout))]
pub struct HeatEntry {
    /// Ids of the atoms of a bond, the lower one first; of an atom its id and 0.
    pub ids: [i64; 2],
    /// Heat capacity (J/K) and volume (m³) of an atom, and 0; area (m²) of a bond, and the distances (m) of the atoms with the lower and
    /// the higher id from it.
    pub reals: [f64; 3],
    /// Its line in the file; 0: the file has no such atom or bond.
    pub line: i64,
}

impl HeatEntry {
    /// Whether it is a bond.
    pub fn is_bond(&self) -> bool {
        self.ids[1] != 0
    }
}

impl Entry for HeatEntry {
    fn ids(&self) -> [Tag; 2] {
        self.ids
    }

    fn line(&self) -> i64 {
        self.line
    }
}

/// Reads a file in pieces.
#[derive(Debug)]
pub struct HeatNetworkReader {
    lines: PieceReader,
    model: Option<HeatNetwork>,
}

impl HeatNetworkReader {
    /// Open a file.
    ///
    /// # Errors
    /// It cannot be opened.
    pub fn open(path: &str) -> Result<Self, OptionError> {
        Ok(Self { lines: PieceReader::open(path)?, model: None })
    }

    /// Read the next atoms and bonds. Returns their number; fewer than there is room for: the file ends.
    ///
    /// # Errors
    /// The file cannot be read, or a line is wrong.
    pub fn read(&mut self, entries: &mut [HeatEntry]) -> Result<usize, OptionError> {
        let Self { lines, model } = self;
        lines.read(entries, |text, line| entry(text, line, model))
    }

    /// The model that gave the numbers, as far as its line was read: it may be anywhere.
    pub fn model(&self) -> Option<HeatNetwork> {
        self.model
    }

    /// The file has ended.
    ///
    /// # Errors
    /// There was no line with the model.
    pub fn end(&self) -> Result<(), OptionError> {
        let missing = "the line `model NAME` is missing; add `model disordered`, for example";
        self.model.map(|_| ()).ok_or_else(|| self.lines.wrong(missing.to_owned()))
    }
}

/// The atom or bond of a line, or what is wrong. `model`: that of earlier lines, or of this one.
fn entry(text: &str, line: i64, model: &mut Option<HeatNetwork>) -> Result<Option<HeatEntry>, String> {
    // One more than a line may have.
    let mut words = [""; 7];
    let mut count = 0;
    for (to, word) in words.iter_mut().zip(text.split_whitespace()) {
        *to = word;
        count += 1;
    }
    let wrong = |wanted: &str| format!("`{text}` is wrong; write `{wanted}`");
    let tag = |k: usize| words[k].parse::<Tag>().ok().filter(|tag| (1..=LARGEST_TAG).contains(tag));
    let real = |k: usize, least: f64| words[k].parse::<f64>().ok().filter(|x| x.is_finite() && *x >= least);
    let (ids, reals) = match (words[0], count) {
        ("", _) => return Ok(None),
        ("model", 2) => {
            // The model "contacts" has no areas.
            let known = named(words[1]).filter(|known| *known != HeatNetwork::Contacts);
            let known = known.ok_or_else(|| wrong("model power|disordered|ordered"))?;
            if model.replace(known).is_some() {
                return Err("`model` is given twice; remove one line".to_owned());
            }
            return Ok(None);
        }
        ("atom", 4) => {
            let (Some(id), Some(capacity), Some(volume)) =
                (tag(1), real(2, f64::MIN_POSITIVE), real(3, f64::MIN_POSITIVE))
            else {
                return Err(wrong("atom ID CAPACITY VOLUME"));
            };
            ([id, 0], [capacity, volume, 0.0])
        }
        ("bond", 6) => {
            let wanted = "bond ID ID AREA LENGTH LENGTH";
            let (Some(a), Some(b), Some(area), Some(of_a), Some(of_b)) =
                (tag(1), tag(2), real(3, 0.0), real(4, 0.0), real(5, 0.0))
            else {
                return Err(wrong(wanted));
            };
            if a == b || of_a + of_b <= 0.0 {
                return Err(wrong(wanted));
            }
            if a < b { ([a, b], [area, of_a, of_b]) } else { ([b, a], [area, of_b, of_a]) }
        }
        _ => return Err(wrong("model NAME`, `atom ID CAPACITY VOLUME`, or `bond ID ID AREA LENGTH LENGTH")),
    };
    Ok(Some(HeatEntry { ids, reals, line }))
}

/// Atoms and bonds of the file by their ids.
#[derive(Debug, Default)]
pub struct HeatEntries {
    entries: Vec<HeatEntry>,
    sorted: bool,
}

impl HeatEntries {
    /// Add some.
    pub fn add(&mut self, more: &[HeatEntry]) {
        self.entries.extend_from_slice(more);
        self.sorted = false;
    }

    /// Sort by ids, so that [`Self::get`] finds them.
    pub fn sort(&mut self) {
        if !self.sorted {
            // No more will come soon.
            self.entries.shrink_to_fit();
            sort_entries(&mut self.entries);
            self.sorted = true;
        }
    }

    /// The lowest line with an atom or bond of an earlier line, and that line.
    pub fn twice(&self) -> Option<[HeatEntry; 2]> {
        given_twice(&self.entries)
    }

    /// The atom or bond with these ids. Sort before.
    pub fn get(&self, ids: [Tag; 2]) -> Option<&HeatEntry> {
        debug_assert!(self.sorted || self.entries.is_empty());
        let at = self.entries.binary_search_by_key(&ids, |entry| entry.ids).ok()?;
        Some(&self.entries[at])
    }

    /// Numbers of atoms and bonds.
    pub fn counts(&self) -> [usize; 2] {
        let bonds = self.entries.iter().filter(|entry| entry.is_bond()).count();
        [self.entries.len() - bonds, bonds]
    }

    /// Drop the bonds, and give their memory back.
    pub fn drop_bonds(&mut self) {
        self.entries.retain(|entry| !entry.is_bond());
        self.entries.shrink_to_fit();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn file(text: &str) -> (tempfile::NamedTempFile, HeatNetworkReader) {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let reader = HeatNetworkReader::open(file.path().to_str().unwrap()).unwrap();
        (file, reader)
    }

    /// Read in pieces of `most`, up to the end, and ask for the model.
    fn read(text: &str, most: usize) -> Result<(Vec<HeatEntry>, HeatNetwork), String> {
        let (_file, mut reader) = file(text);
        let mut all = Vec::new();
        let mut piece = vec![HeatEntry::default(); most];
        loop {
            let count = reader.read(&mut piece).map_err(|error| error.to_string())?;
            all.extend_from_slice(&piece[..count]);
            if count < most {
                reader.end().map_err(|error| error.to_string())?;
                return Ok((all, reader.model().unwrap()));
            }
        }
    }

    const GOOD: &str =
        "# comment\r\n\natom 7 1.5 2e-9 # seven\natom 3 1 1\n  bond 7 3 1e-6 .25 0.5\nmodel ordered\nbond 3 9 0 0 1\n";

    #[test]
    fn pieces_have_the_entries_of_the_whole_file() {
        let entry = |ids, reals, line| HeatEntry { ids, reals, line };
        let wanted = vec![
            entry([7, 0], [1.5, 2e-9, 0.0], 3),
            entry([3, 0], [1.0, 1.0, 0.0], 4),
            // Given from the atom with the higher id.
            entry([3, 7], [1e-6, 0.5, 0.25], 5),
            entry([3, 9], [0.0, 0.0, 1.0], 7),
        ];
        for most in 1..6 {
            assert_eq!(read(GOOD, most).unwrap(), (wanted.clone(), HeatNetwork::Ordered), "pieces of {most}");
        }
    }

    #[test]
    fn wrong_lines_are_named() {
        for (line, wanted) in [
            ("atom 0 1 1", "line 8: `atom 0 1 1` is wrong; write `atom ID CAPACITY VOLUME`"),
            ("atom 1 0 1", "write `atom ID CAPACITY VOLUME`"),
            ("atom 1 1 -1", "write `atom ID CAPACITY VOLUME`"),
            ("atom 9007199254740993 1 1", "write `atom ID CAPACITY VOLUME`"),
            ("bond 4 4 1 1 1", "line 8: `bond 4 4 1 1 1` is wrong; write `bond ID ID AREA LENGTH LENGTH`"),
            ("bond 4 5 1 0 0", "write `bond ID ID AREA LENGTH LENGTH`"),
            ("bond 4 5 nan 1 1", "write `bond ID ID AREA LENGTH LENGTH`"),
            ("bond 4 5 1 1", "write `model NAME`, `atom ID CAPACITY VOLUME`, or `bond ID ID AREA LENGTH LENGTH`"),
            ("bond 4 5 1 1 1 1", "write `model NAME`, `atom ID CAPACITY VOLUME`, or `bond"),
            ("bond 4 5 1 1 1 1 1 1", "write `model NAME`, `atom ID CAPACITY VOLUME`, or `bond"),
            ("angle 1 2 3 # x", "line 8: `angle 1 2 3` is wrong"),
            ("model contacts", "write `model power|disordered|ordered`"),
            ("model power", "line 8: `model` is given twice; remove one line"),
        ] {
            let error = read(&format!("{GOOD}{line}\natom 1 1 1\n"), 3).unwrap_err();
            assert!(error.contains(wanted), "{line}: {error}");
        }
        let error = read("atom 1 1 1\n", 1).unwrap_err();
        assert!(error.contains("the line `model NAME` is missing; add `model disordered`"), "{error}");
        let error = HeatNetworkReader::open("/no/such/file").unwrap_err().to_string();
        assert!(error.contains("cannot read /no/such/file"), "{error}");
    }

    #[test]
    fn entries_are_found_and_counted() {
        let (all, _) = read(GOOD, 9).unwrap();
        let mut entries = HeatEntries::default();
        entries.add(&all[2..]);
        entries.add(&all[..2]);
        entries.sort();
        assert_eq!((entries.counts(), entries.twice()), ([2, 2], None));
        for entry in &all {
            assert_eq!(entries.get(entry.ids), Some(entry));
        }
        assert_eq!(entries.get([7, 9]), None);
        // Lines 11 and 12 have what an earlier line has.
        let again = |line: &HeatEntry, number: i64| HeatEntry { line: number, ..*line };
        entries.add(&[again(&all[0], 12), again(&all[3], 11)]);
        entries.sort();
        assert_eq!(entries.twice(), Some([again(&all[3], 11), all[3]]));
        entries.drop_bonds();
        assert_eq!(entries.counts(), [3, 0]);
        assert_eq!((entries.get([3, 7]), entries.get([3, 0])), (None, Some(&all[1])));
    }
}
