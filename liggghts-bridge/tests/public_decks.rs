//! Decks that others have published for LIGGGHTS and LAMMPS, rebuilt small, on our styles: how many lines change, what differs from the host's own
//! styles, and what differs on other numbers of processes. `public_decks/HOST/` has them as data, and `validation/results/host-decks.json` what was found,
//! of which the book prints a table. Keys: see [`Deck`].

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::harness::decks::{Deck, decks, write_files};
use crate::harness::{self, Host, apart, run_together, tables};
use serde::{Deserialize, Serialize};

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

/// Hundreds of steps of collisions amplify the rounding of another order of sums. The largest difference found is 4.4e-7 of the largest force.
const TOLERANCE: f64 = 1e-5;

/// What was found.
#[derive(Deserialize)]
struct Record {
    /// By host.
    public: BTreeMap<String, Vec<Found>>,
}

#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
struct Found {
    deck: String,
    source: String,
    says: String,
    /// Lines of our script that the script of the host does not have, or the reverse, whichever are more.
    changed_lines: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    misses: Option<String>,
    /// How the comparison with the host's own styles is made, or why there is none.
    compared: String,
    /// What is said of other numbers of processes.
    #[serde(skip_serializing_if = "Option::is_none")]
    over_processes: Option<String>,
    runs: Vec<Run>,
}

#[derive(Serialize, Deserialize, Clone, PartialEq, Debug)]
struct Run {
    processes: usize,
    /// Largest difference from the host's styles, relative to the largest magnitude.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_stock: Option<f64>,
    /// Largest difference from our styles on one process; 0: the same bits.
    #[serde(skip_serializing_if = "Option::is_none")]
    from_one: Option<f64>,
}

fn name(host: Host) -> &'static str {
    if host == Host::Liggghts { "LIGGGHTS" } else { "LAMMPS" }
}

fn record_file() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../validation/results/host-decks.json")
}

/// Which script of a deck.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    /// With our styles.
    Ours,
    /// With our styles, as it is compared.
    OursAlike,
    /// With styles of the host, as it is compared.
    StockAlike,
}

impl Kind {
    fn script(self, deck: &Deck) -> String {
        match self {
            Self::Ours => deck.ours(),
            Self::OursAlike => deck.ours_alike(),
            Self::StockAlike => deck.stock_alike(),
        }
    }
}

/// Run a script of each deck, all in one start of the program; the rows of atoms at the end of each.
fn run_all(host: Host, folder: &Path, decks: &[&Deck], kind: Kind, processes: usize) -> Vec<Vec<Vec<f64>>> {
    let dump = |k: usize| format!("{k}.dump");
    let script = |(k, deck): (usize, &&Deck)| {
        let columns = deck.columns();
        let format = match host {
            Host::Liggghts => format!("format \"%d{}\"", " %.17g".repeat(columns.split(' ').count() - 1)),
            Host::Lammps => "format float %.17g".to_owned(),
        };
        format!("{}write_dump all custom {} {columns} modify sort id {format}\n", kind.script(deck), dump(k))
    };
    let scripts: Vec<String> = decks.iter().enumerate().map(script).collect();
    run_together(host, folder, &scripts, processes);
    let rows = |k: usize| tables(&folder.join(dump(k))).pop().unwrap_or_else(|| panic!("{} is empty", decks[k].name)).1;
    (0..decks.len()).map(rows).collect()
}

/// Rows without ids, in the order of their bits, for decks whose ids depend on the number of processes.
fn unnumbered(mut rows: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    for row in &mut rows {
        row[0] = 0.0;
    }
    rows.sort_by(|a, b| a.partial_cmp(b).unwrap());
    rows
}

/// Pairs of atoms that touch; the last column is the radius.
fn touching(rows: &[Vec<f64>]) -> usize {
    let near = |a: &[f64], b: &[f64]| {
        let square: f64 = (1..4).map(|k| (a[k] - b[k]).powi(2)).sum();
        square.sqrt() < a.last().unwrap() + b.last().unwrap()
    };
    (0..rows.len()).map(|b| (0..b).filter(|&a| near(&rows[a], &rows[b])).count()).sum()
}

/// Run `decks` on these numbers of processes, the first of which is 1.
fn find(host: Host, decks: &[&Deck], numbers: &[usize]) -> Vec<Found> {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    write_files(folder);
    let alike: Vec<&Deck> = decks.iter().copied().filter(|deck| deck.unlike.is_none()).collect();
    // A deck without `alike` is compared as it is.
    let differs: Vec<&Deck> = alike.iter().copied().filter(|deck| deck.alike.is_some()).collect();
    let mut runs: BTreeMap<&str, Vec<Run>> = BTreeMap::new();
    let mut one: Vec<Vec<Vec<f64>>> = Vec::new();
    for &processes in numbers {
        let ours = run_all(host, folder, decks, Kind::Ours, processes);
        let as_compared = run_all(host, folder, &differs, Kind::OursAlike, processes);
        let stock = run_all(host, folder, &alike, Kind::StockAlike, processes);
        if processes == 1 {
            one.clone_from(&ours);
        }
        for (k, deck) in decks.iter().enumerate() {
            let place = |of: &[&Deck]| of.iter().position(|other| other.name == deck.name);
            let from_stock = place(&alike).map(|at| {
                let mine = place(&differs).map_or(&ours[k], |at| &as_compared[at]);
                assert!(deck.points || touching(mine) > 0, "{}: nothing touches", deck.name);
                apart(mine, &stock[at], deck.spin(), deck.radius(mine))
            });
            let from_one = (processes > 1 && deck.over_processes.is_none()).then(|| {
                let [mine, first] = [&ours[k], &one[k]]
                    .map(|rows| if deck.unnumbered { unnumbered(rows.clone()) } else { rows.clone() });
                apart(&mine, &first, deck.spin(), deck.radius(&first))
            });
            runs.entry(&deck.name).or_default().push(Run { processes, from_stock, from_one });
        }
    }
    let found = |deck: &&Deck| Found {
        deck: deck.name.clone(),
        source: deck.source.clone(),
        says: deck.says.clone(),
        changed_lines: deck.changed_lines(),
        misses: deck.misses.clone(),
        compared: deck.compared(),
        over_processes: deck.of_processes(),
        runs: runs.remove(deck.name.as_str()).unwrap(),
    };
    decks.iter().map(found).collect()
}

/// Panics if a deck differs from stock by more than amplified rounding, or on other numbers of processes by more than it says.
fn check(found: &[Found], decks: &[&Deck]) {
    let mut wrong = String::new();
    for (found, deck) in found.iter().zip(decks) {
        for run in &found.runs {
            let mut say = |what: &str, far: f64| {
                writeln!(wrong, "{} on {}: {far:.1e} from {what}", found.deck, run.processes).unwrap();
            };
            if let Some(far) = run.from_stock.filter(|far| *far > TOLERANCE) {
                say("stock", far);
            }
            if let Some(far) = run.from_one.filter(|far| *far > deck.rounds.as_ref().map_or(0.0, |rounds| rounds.by)) {
                say("one process", far);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong}");
}

/// Decks that run in every test, one of each kind.
fn few(all: &[Deck]) -> Vec<&Deck> {
    all.iter().filter(|deck| deck.always).collect()
}

#[test]
fn public_decks_run_with_few_changed_lines() {
    for host in BOTH {
        let all = decks(host);
        let decks = few(&all);
        assert!(decks.len() > 3, "{host:?}");
        check(&find(host, &decks, &[1, 2]), &decks);
    }
}

fn record_all(host: Host) {
    let all = decks(host);
    let decks: Vec<&Deck> = all.iter().collect();
    let found = find(host, &decks, &[1, 2, 4, 8]);
    harness::record::put(&["public", name(host)], &found);
    check(&found, &decks);
}

/// Minutes. Writes the record.
#[test]
#[ignore = "run by `make host-decks`"]
fn all_public_decks_of_liggghts_on_up_to_eight_processes() {
    record_all(Host::Liggghts);
}

/// Minutes. Writes the record.
#[test]
#[ignore = "run by `make host-decks`"]
fn all_public_decks_of_lammps_on_up_to_eight_processes() {
    record_all(Host::Lammps);
}

/// A host that is not in the record has not been run yet.
#[test]
fn the_record_has_the_public_decks() {
    let text = std::fs::read_to_string(record_file()).unwrap();
    let record: Record = serde_json::from_str(&text).unwrap();
    assert!(BOTH.iter().map(|host| decks(*host).len()).sum::<usize>() >= 30);
    assert!(!record.public.is_empty());
    for host in BOTH {
        let Some(found) = record.public.get(name(host)) else { continue };
        let all = decks(host);
        assert_eq!(found.len(), all.len(), "run `make host-decks`");
        for (found, deck) in found.iter().zip(&all) {
            let wanted = Found {
                deck: deck.name.clone(),
                source: deck.source.clone(),
                says: deck.says.clone(),
                changed_lines: deck.changed_lines(),
                misses: deck.misses.clone(),
                compared: deck.compared(),
                over_processes: deck.of_processes(),
                ..found.clone()
            };
            assert_eq!(*found, wanted, "run `make host-decks`");
            assert_eq!(found.runs.iter().map(|run| run.processes).collect::<Vec<_>>(), [1, 2, 4, 8]);
        }
    }
}
