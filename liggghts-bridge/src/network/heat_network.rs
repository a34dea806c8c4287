//! The file of `heat_network` in a distributed host. One processor reads it in pieces, and each keeps the atoms and bonds that the host
//! gives it. What an atom or a bond needs, its processor asks for: all processors ask at once, before the rebuild that needs it.

use super::{Network, NetworkError};
use crate::atoms::{Atoms, Tag};
use crate::heat_network::{HeatEntries, HeatEntry, HeatNetworkReader};
use crate::options::OptionError;
use crate::pieces::check_once;
use crate::records::ascending;

/// What a processor asks for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Asked {
    /// The numbers of owned atoms that have none.
    NewAtoms,
    /// Those of all owned atoms, also to compare them with what a restart file brought.
    Atoms,
    /// Those of bonds that the next rebuild creates.
    NewBonds,
    /// Those of the bonds that this processor counts, to compare them with what a restart file brought.
    Bonds,
}

/// The file on one processor.
pub(super) struct NetworkFile {
    path: String,
    /// While this processor reads the file.
    reader: Option<HeatNetworkReader>,
    /// What this processor keeps.
    share: HeatEntries,
    /// What it asked for.
    answers: HeatEntries,
}

impl NetworkFile {
    pub(super) fn new(path: String) -> Self {
        Self { path, reader: None, share: HeatEntries::default(), answers: HeatEntries::default() }
    }

    /// Area (m²) of a bond, and the distances of A and B from it (m).
    pub(super) fn bond(&self, tags: [Tag; 2]) -> Result<[f64; 3], NetworkError> {
        let Some(found) = self.answers.get(ascending(tags)) else {
            let [a, b] = tags;
            return Err(NetworkError::NoHeatBond { a, b, path: self.path.clone() });
        };
        let [area, of_lower, of_higher] = found.reals;
        Ok(if tags[0] < tags[1] { [area, of_lower, of_higher] } else { [area, of_higher, of_lower] })
    }

    /// The rebuild has used the answers.
    pub(super) fn forget_answers(&mut self) {
        self.answers = HeatEntries::default();
    }

    fn other(&self, of: String) -> NetworkError {
        NetworkError::OtherHeatNetwork { of, path: self.path.clone() }
    }
}

impl Network {
    fn file(&self) -> Option<&NetworkFile> {
        self.thermal.as_ref()?.file.as_ref()
    }

    fn file_mut(&mut self) -> Option<&mut NetworkFile> {
        self.thermal.as_mut()?.file.as_mut()
    }

    /// Read the next atoms and bonds of the file, on one processor. Returns their number; 0: it has ended.
    ///
    /// # Errors
    /// It cannot be read, a line is wrong, or it belongs to another model.
    pub fn read_heat_network(&mut self, entries: &mut [HeatEntry]) -> Result<usize, OptionError> {
        let Some(thermal) = &mut self.thermal else { return Ok(0) };
        let Some(file) = &mut thermal.file else { return Ok(0) };
        let reader = match &mut file.reader {
            Some(reader) => reader,
            none => none.insert(HeatNetworkReader::open(&file.path)?),
        };
        let count = reader.read(entries)?;
        // Before the rest of a large file is read.
        if let Some(model) = reader.model() {
            thermal.tables.check_model_of_network(model)?;
        }
        if count == 0 {
            reader.end()?;
            file.reader = None;
        }
        Ok(count)
    }

    /// Keep atoms and bonds of the file on this processor.
    pub fn keep_heat_entries(&mut self, entries: &[HeatEntry]) {
        if let Some(file) = self.file_mut() {
            file.share.add(entries);
        }
    }

    /// All that this processor keeps is here.
    ///
    /// # Errors
    /// Two lines have the same atom or bond: the lowest second one, and the message.
    pub fn sort_heat_entries(&mut self) -> Result<(), (i64, OptionError)> {
        let Some(file) = self.file_mut() else { return Ok(()) };
        file.share.sort();
        check_once(file.share.twice(), &file.path)
    }

    /// An atom or bond that this processor keeps, for the one that asks for it; with line 0 if the file does not have it.
    pub fn heat_entry(&self, ids: [Tag; 2]) -> HeatEntry {
        let none = HeatEntry { ids, ..HeatEntry::default() };
        self.file().and_then(|file| file.share.get(ids)).copied().unwrap_or(none)
    }

    /// Drop the bonds that this processor keeps, if none will be created any more.
    pub fn drop_heat_bonds(&mut self) {
        if let Some(file) = self.file_mut() {
            file.share.drop_bonds();
        }
    }

    /// Numbers of the atoms and bonds of the file that this processor keeps, and of the atoms and bonds that it counts.
    pub fn heat_network_counts(&self) -> [usize; 4] {
        let Some(file) = self.file() else { return [0; 4] };
        let [atoms, bonds] = file.share.counts();
        [atoms, bonds, self.owned.iter().filter(|owned| **owned).count(), self.counted_bonds().count()]
    }

    /// Ids of the bonds that this processor counts, since the last rebuild.
    fn counted_bonds(&self) -> impl Iterator<Item = [Tag; 2]> + '_ {
        let owns = |tag: Tag| self.particle(tag).is_some_and(|p| self.owned[p]);
        let bonds = self.thermal.iter().flat_map(|thermal| &thermal.bonds);
        bonds.map(|bond| bond.tags).filter(move |tags| owns(tags[0]))
    }

    /// What this processor asks for, as [`HeatEntry::ids`].
    pub fn asked_heat_entries(&self, atoms: &Atoms<'_>, asked: Asked) -> Vec<[Tag; 2]> {
        let of_atoms = |all: bool| {
            let wants = |i: usize| all || self.heat_of_atom(atoms, i).is_some_and(|[capacity, _]| capacity == 0.0);
            let members = (0..atoms.owned).filter(|&i| atoms.mask[i] & atoms.group != 0);
            members.filter(|&i| wants(i)).map(|i| [atoms.tag.get(i), 0]).collect()
        };
        match asked {
            Asked::NewAtoms => of_atoms(false),
            Asked::Atoms => of_atoms(true),
            Asked::NewBonds => {
                let mut tags: Vec<[Tag; 2]> = self.fresh.iter().map(|bond| bond.tags).collect();
                tags.sort_unstable();
                tags.dedup();
                tags
            }
            Asked::Bonds => self.counted_bonds().map(ascending).collect(),
        }
    }

    /// Take answers of other processors.
    pub fn take_heat_entries(&mut self, entries: &[HeatEntry]) {
        if let Some(file) = self.file_mut() {
            for entry in entries.iter().filter(|entry| entry.line > 0) {
                file.answers.add(std::slice::from_ref(entry));
            }
        }
    }

    /// All answers are here. Give atoms their numbers, or compare them; those of new bonds wait for the rebuild, which finds out what the
    /// file does not have.
    ///
    /// # Errors
    /// A restart file brought other numbers.
    pub fn use_heat_entries(&mut self, atoms: &mut Atoms<'_>, asked: Asked) -> Result<(), NetworkError> {
        let Some(file) = self.file_mut() else { return Ok(()) };
        file.answers.sort();
        if asked == Asked::NewBonds {
            return Ok(());
        }
        let answers = std::mem::take(&mut file.answers);
        let Some((thermal, file)) = self.thermal.as_ref().and_then(|thermal| Some((thermal, thermal.file.as_ref()?)))
        else {
            return Ok(());
        };
        if asked == Asked::Bonds {
            for tags in self.counted_bonds().map(ascending) {
                let same = thermal.bond(tags).zip(answers.get(tags)).is_some_and(|(bond, found)| {
                    let [of_a, of_b] = bond.lengths;
                    let lengths = if bond.tags == tags { [of_a, of_b] } else { [of_b, of_a] };
                    found.reals == [bond.area, lengths[0], lengths[1]]
                });
                if !same {
                    return Err(file.other(format!("the bond of atoms {} and {}", tags[0], tags[1])));
                }
            }
            return Ok(());
        }
        for i in (0..atoms.owned).filter(|&i| atoms.mask[i] & atoms.group != 0) {
            let tag = atoms.tag.get(i);
            let found = answers.get([tag, 0]).map(|found| [found.reals[0], found.reals[1]]);
            let Some(stored) = self.layout.heat_of_file_mut(&mut atoms.memory[i * self.layout.width..]) else { break };
            if stored[0] == 0.0 {
                stored.copy_from_slice(&found.unwrap_or_default());
            } else if asked == Asked::Atoms && found.is_none_or(|found| found != *stored) {
                return Err(file.other(format!("atom {tag}")));
            }
        }
        Ok(())
    }

    /// Heat capacity (J/K) and volume (m³) of a file that atom `i` has; zeros: it has none yet.
    fn heat_of_atom(&self, atoms: &Atoms<'_>, i: usize) -> Option<[f64; 2]> {
        self.layout.heat_of_file(&atoms.memory[i * self.layout.width..])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::options::{Options, Units};

    /// Networks of as many processors, which share a file.
    fn shared(text: &str, processors: usize) -> Result<Vec<Network>, String> {
        let folder = tempfile::tempdir().unwrap();
        let (heat, network) = (folder.path().join("heat.toml"), folder.path().join("network.txt"));
        std::fs::write(&heat, "[heat]\nmodel = \"disordered\"\npairs = \"bonds\"\ntemperature = 300\n").unwrap();
        std::fs::write(&network, text).unwrap();
        let words = format!(
            "linear_bond normal_stiffness 1 shear_stiffness 1 bond distance 1.1 thermal.specific_heat 800 thermal.conductivity 1 \
             heat {} heat_network {}",
            heat.display(),
            network.display()
        );
        let words: Vec<String> = words.split_whitespace().map(str::to_owned).collect();
        let mut all: Vec<Network> =
            (0..processors).map(|_| Network::new(Options::parse(&words, 1, Units::Si).unwrap()).unwrap()).collect();
        let mut piece = [HeatEntry::default(); 3];
        loop {
            let count = all[0].read_heat_network(&mut piece).map_err(|error| error.to_string())?;
            if count == 0 {
                break;
            }
            for entry in &piece[..count] {
                all[entry.ids[0] as usize % processors].keep_heat_entries(&[*entry]);
            }
        }
        let twice: Vec<_> = all.iter_mut().filter_map(|network| network.sort_heat_entries().err()).collect();
        match twice.into_iter().min_by_key(|(line, _)| *line) {
            Some((_, error)) => Err(error.to_string()),
            None => Ok(all),
        }
    }

    /// A ring of atoms.
    fn ring(atoms: usize) -> String {
        let lines = (1..=atoms).map(|a| format!("atom {a} {a} 1\nbond {a} {} 1 1 1\n", a % atoms + 1));
        format!("model disordered\n{}", lines.collect::<String>())
    }

    #[test]
    fn processors_keep_equal_shares() {
        for processors in [1, 2, 4] {
            let mut all = shared(&ring(100), processors).unwrap();
            let each = 100 / processors;
            for network in &mut all {
                let [atoms, bonds, ..] = network.heat_network_counts();
                assert_eq!(atoms, each);
                // The last atom's bond has the lower id 1.
                assert!(bonds.abs_diff(each) <= 1, "{bonds} of {each}");
            }
            let keeper = |id: usize| id % processors;
            assert_eq!(all[keeper(7)].heat_entry([7, 0]).reals, [7.0, 1.0, 0.0]);
            assert_eq!(all[keeper(1)].heat_entry([1, 100]).line, 201);
            assert_eq!(all[keeper(7)].heat_entry([7, 9]).line, 0);
            all[0].drop_heat_bonds();
            assert_eq!(all[0].heat_network_counts()[..2], [each, 0]);
        }
    }

    /// The message does not depend on the processors.
    #[test]
    fn what_is_given_twice_is_found() {
        for processors in [1, 2, 4] {
            let error = |more: &str| shared(&format!("{}{more}", ring(100)), processors).err().unwrap();
            let found = error("atom 5 1 1\nbond 2 1 1 1 1\natom 4 1 1\n");
            assert!(
                found.contains("line 202: atom 5 is given twice, for the first time in line 10; remove"),
                "{found}"
            );
            let found = error("bond 2 1 1 1 1\natom 4 1 1\n");
            assert!(
                found.contains(
                    "line 202: the bond of atoms 1 and 2 is given twice, for the first time in line 3; remove"
                ),
                "{found}"
            );
            assert!(error("atom 101 x 1\n").contains("line 202: `atom 101 x 1` is wrong"));
        }
        let found = shared("model power\natom 1 1 1\n", 2).err().unwrap();
        assert!(
            found.contains(
                "line 2: `heat.model = \"disordered\"`: the file of `heat_network` has the model power; give"
            ),
            "{found}"
        );
        let found = shared("atom 1 1 1\n", 2).err().unwrap();
        assert!(found.contains("the line `model NAME` is missing"), "{found}");
    }
}
