//! Parts of a sweep, which different computers compute, each into its own journal.

use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;

use super::Sweep;
use concordem_scenario::schema::{Scenario, ScenarioError};

/// One of several parts of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Part {
    /// Number of parts.
    pub of: usize,
    /// Number of this part, from 1.
    pub part: usize,
}

/// Largest number of parts.
pub const MOST_PARTS: usize = 100_000;

impl FromStr for Part {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let remedy = format!("write the part and the number of parts, such as 3/10; at most {MOST_PARTS} parts");
        let (part, of) = text.split_once('/').ok_or_else(|| remedy.clone())?;
        match (part.trim().parse(), of.trim().parse()) {
            (Ok(part), Ok(of)) if (1..=of).contains(&part) && of <= MOST_PARTS => Ok(Self { of, part }),
            _ => Err(remedy),
        }
    }
}

impl std::fmt::Display for Part {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "{}/{}", self.part, self.of)
    }
}

impl Part {
    /// The points of this part, by packing. All points in the order of their packings are cut into parts of equal size, so that points with
    /// the same packing stay together as far as the size of the parts allows.
    pub fn share(self, groups: &[Vec<usize>]) -> Vec<Vec<usize>> {
        let count: usize = groups.iter().map(Vec::len).sum();
        let [first, end] = [self.part - 1, self.part].map(|part| count * part / self.of);
        let mut start = 0;
        let mut share = Vec::new();
        for group in groups {
            let [from, to] = [first, end].map(|place| place.clamp(start, start + group.len()) - start);
            if from < to {
                share.push(group[from..to].to_vec());
            }
            start += group.len();
        }
        share
    }

    /// Path of the journal of this part of a result.
    pub fn path(self, result: &Path) -> PathBuf {
        let mut name = result.as_os_str().to_owned();
        name.push(format!(".part-{}-of-{}{ENDING}", self.part, self.of));
        PathBuf::from(name)
    }
}

const ENDING: &str = ".points";

/// The parts of a result that have a journal beside it.
///
/// # Errors
/// The folder cannot be read.
pub fn found(result: &Path) -> io::Result<BTreeSet<Part>> {
    let folder = result.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let (Some(name), mut parts) = (result.file_name(), BTreeSet::new()) else { return Ok(BTreeSet::new()) };
    for entry in std::fs::read_dir(folder)? {
        let file = entry?.file_name();
        let part = || {
            let rest = file.as_encoded_bytes().strip_prefix(name.as_encoded_bytes())?;
            let rest = std::str::from_utf8(rest).ok()?.strip_prefix(".part-")?.strip_suffix(ENDING)?;
            rest.replacen("-of-", "/", 1).parse::<Part>().ok()
        };
        // Other spellings of a number, such as 03, name no journal.
        parts.extend(part().filter(|part| part.path(result).file_name() == Some(&file)));
    }
    Ok(parts)
}

impl Sweep {
    /// All points, grouped by packing; the groups are in the order of their first points.
    ///
    /// # Errors
    /// The scenario of a point has problems.
    pub fn groups(&self) -> Result<Vec<Vec<usize>>, ScenarioError> {
        let mut groups: Vec<Vec<usize>> = Vec::new();
        let mut index: BTreeMap<String, usize> = BTreeMap::new();
        for point in 0..self.points() {
            let place = *index.entry(packing_key(&self.scenario(point)?)).or_insert_with(|| {
                groups.push(Vec::new());
                groups.len() - 1
            });
            groups[place].push(point);
        }
        Ok(groups)
    }
}

/// Scenarios with the same key have the same packing.
fn packing_key(scenario: &Scenario) -> String {
    format!("{} {:?}", scenario.dimension, scenario.packing)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_point_is_in_one_part_and_packings_stay_together() {
        let groups: Vec<Vec<usize>> = vec![vec![0, 2, 4, 6], vec![1, 3, 5, 7], vec![8], vec![9, 10]];
        for of in 1..=14 {
            let parts: Vec<Vec<Vec<usize>>> = (1..=of).map(|part| Part { of, part }.share(&groups)).collect();
            let all: Vec<usize> = parts.iter().flatten().flatten().copied().collect();
            assert_eq!(all, groups.concat(), "{of} parts");
            let sizes: Vec<usize> = parts.iter().map(|part| part.iter().map(Vec::len).sum()).collect();
            assert!(sizes.iter().max().unwrap() - sizes.iter().min().unwrap() <= 1, "{sizes:?}");
            // Beyond the first group of a part, only whole groups begin; so each cut splits at most one packing.
            let packings: usize = parts.iter().map(Vec::len).sum();
            assert!(packings < groups.len() + of, "{of} parts generate {packings} packings");
        }
    }

    #[test]
    fn parts_are_written_with_a_slash_and_found_beside_the_result() {
        assert_eq!("3/10".parse(), Ok(Part { of: 10, part: 3 }));
        for wrong in ["", "3", "0/3", "4/3", "a/b", "1/0", "-1/2", "1/100001", "1/2/3"] {
            assert!(wrong.parse::<Part>().unwrap_err().contains("such as 3/10"), "{wrong}");
        }
        let folder = tempfile::tempdir().unwrap();
        let result = folder.path().join("a b.h5");
        let (one, two) = (Part { of: 3, part: 1 }, Part { of: 12, part: 11 });
        for path in [one.path(&result), two.path(&result)] {
            std::fs::write(path, "").unwrap();
        }
        for name in
            ["a b.h5.points", "a b.h5.part-01-of-3.points", "a b.h5.part-4-of-3.points", "c.h5.part-1-of-3.points"]
        {
            std::fs::write(folder.path().join(name), "").unwrap();
        }
        assert_eq!(found(&result).unwrap().into_iter().collect::<Vec<_>>(), [one, two]);
    }
}
