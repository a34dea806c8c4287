//! Public decks, as the files of `public_decks/` describe them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use super::Host;

/// A deck that somebody has published, rebuilt small.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Deck {
    pub name: String,
    /// Project and file.
    pub source: String,
    /// What happens.
    pub says: String,
    /// What the rebuilt deck leaves out.
    pub misses: Option<String>,
    /// With styles of the host.
    pub script: String,
    /// Lines of the script and what stands for them with our styles, possibly nothing.
    pub change: BTreeMap<String, String>,
    /// Parts of both scripts that are replaced for the comparison, where the host has no equal style else.
    pub alike: Option<Alike>,
    /// Why it is not compared with the host.
    pub unlike: Option<String>,
    /// Why other numbers of processes are not compared.
    pub over_processes: Option<String>,
    /// Largest difference from one process, if not 0, with the reason.
    pub rounds: Option<Rounds>,
    /// Ids of atoms depend on the number of processes.
    #[serde(default)]
    pub unnumbered: bool,
    /// The host's atoms are points without radius and spin.
    #[serde(default)]
    pub points: bool,
    /// Further columns of dumps to compare.
    #[serde(default)]
    pub also: String,
    /// Runs in every test, not only in `make host-decks`.
    #[serde(default)]
    pub always: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alike {
    pub says: String,
    pub stock: BTreeMap<String, String>,
    pub ours: BTreeMap<String, String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rounds {
    pub says: String,
    pub by: f64,
}

fn replaced(deck: &str, mut script: String, parts: &BTreeMap<String, String>) -> String {
    for (from, to) in parts {
        assert!(script.contains(from.as_str()), "{deck}: `{from}` is not in the script");
        script = script.replace(from.as_str(), to);
    }
    script
}

impl Deck {
    /// The script with our styles.
    pub fn ours(&self) -> String {
        let mut lines: Vec<&str> = self.script.lines().collect();
        for (from, to) in &self.change {
            let places: Vec<usize> = (0..lines.len()).filter(|&k| lines[k] == from).collect();
            let [at] = places[..] else { panic!("{}: `{from}` is in {} lines", self.name, places.len()) };
            lines[at] = to;
        }
        lines.join("\n") + "\n"
    }

    /// [`Self::ours`] as it is compared.
    pub fn ours_alike(&self) -> String {
        self.alike.as_ref().map_or_else(|| self.ours(), |alike| replaced(&self.name, self.ours(), &alike.ours))
    }

    /// The script of the host as it is compared.
    pub fn stock_alike(&self) -> String {
        let script = self.script.clone();
        match &self.alike {
            Some(alike) => replaced(&self.name, script, &alike.stock),
            None => script,
        }
    }

    /// Lines that differ between the script of the host and ours.
    pub fn changed_lines(&self) -> usize {
        self.change.values().map(|to| to.lines().count().max(1)).sum()
    }

    /// How it is compared with the host.
    pub fn compared(&self) -> String {
        match (&self.unlike, &self.alike) {
            (Some(unlike), _) => format!("not compared: {unlike}"),
            (None, Some(alike)) => alike.says.clone(),
            (None, None) => "as it is".to_owned(),
        }
    }

    /// Why other numbers of processes are not compared, or differ.
    pub fn of_processes(&self) -> Option<String> {
        self.over_processes.clone().or_else(|| self.rounds.as_ref().map(|rounds| rounds.says.clone()))
    }

    /// The column of angular velocities.
    pub fn spin(&self) -> Option<usize> {
        (!self.points).then_some(7)
    }

    /// The largest radius of these atoms; 1 for points.
    pub fn radius(&self, rows: &[Vec<f64>]) -> f64 {
        if self.points { 1.0 } else { rows.iter().filter_map(|row| row.last().copied()).fold(0.0, f64::max) }
    }

    /// Columns of its dump, three of each kind; the last one is the radius, where atoms have one.
    pub fn columns(&self) -> String {
        let Self { also, .. } = self;
        if self.points {
            return "id x y z vx vy vz fx fy fz".to_owned();
        }
        let also = if also.is_empty() { String::new() } else { format!("{also} {also} {also} ") };
        format!("id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz {also}radius")
    }
}

/// The decks of `host`, by file name and order in the file.
pub fn decks(host: Host) -> Vec<Deck> {
    #[derive(Deserialize)]
    #[serde(deny_unknown_fields)]
    struct File {
        deck: Vec<Deck>,
    }
    let name = if host == Host::Liggghts { "liggghts" } else { "lammps" };
    let folder = folder().join(name);
    let mut files: Vec<PathBuf> = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.sort();
    let of_file = |file: &PathBuf| {
        let text = std::fs::read_to_string(file).unwrap();
        let file: File = toml::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
        file.deck
    };
    files.iter().flat_map(of_file).collect()
}

/// The deck of this name.
pub fn deck(host: Host, name: &str) -> Deck {
    decks(host).into_iter().find(|deck| deck.name == name).unwrap_or_else(|| panic!("no deck `{name}`"))
}

/// Meshes, molecules, and data that decks read.
pub fn write_files(to: &Path) {
    for entry in std::fs::read_dir(folder().join("files")).unwrap() {
        let file = entry.unwrap().path();
        std::fs::copy(&file, to.join(file.file_name().unwrap())).unwrap();
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/public_decks")
}
