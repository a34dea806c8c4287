//! What long runs of random and public decks found: `validation/results/host-decks.json`, written by `make host-decks`.

use std::ops::Range;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};

/// Random scripts of one kind, which the seeds from `first` on draw.
#[derive(Serialize, Deserialize, Default)]
pub struct Random {
    first: u64,
    wanted: u64,
    /// How many seeds are done, all of them passed.
    drawn: u64,
    /// Those of them that the host itself takes.
    ran: u64,
    seconds: f64,
    /// That of the last one.
    commit: String,
    machine: String,
    processors: usize,
}

/// Run `some` for the seeds from `first` on, `at_once` at a time, until `wanted` are done; it returns how many scripts the host takes, and panics if
/// something is wrong. The record goes on where an interrupted run of the same seeds has ended. Returns how many the host takes of how many.
pub fn random(
    kind: &str,
    first: u64,
    wanted: u64,
    at_once: u64,
    mut some: impl FnMut(Range<u64>) -> usize,
) -> [u64; 2] {
    let keys = ["random", kind];
    let before = get(&keys).and_then(|found| Random::deserialize(found).ok());
    let mut random = before
        .filter(|before| before.first == first && before.wanted == wanted && before.drawn < wanted)
        .unwrap_or_else(|| Random { first, wanted, ..Random::default() });
    while random.drawn < wanted {
        let start = Instant::now();
        let done = wanted.min(random.drawn + at_once);
        random.ran += some(first + random.drawn..first + done) as u64;
        random.drawn = done;
        random.seconds += start.elapsed().as_secs_f64().round();
        random.commit = commit();
        std::env::consts::ARCH.clone_into(&mut random.machine);
        random.processors = std::thread::available_parallelism().map_or(0, usize::from);
        put(&keys, &random);
    }
    [random.ran, random.drawn]
}

fn commit() -> String {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let output = Command::new("git").args(["rev-parse", "HEAD"]).current_dir(folder).output();
    output.map_or_else(|_| String::new(), |output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

fn file() -> Option<PathBuf> {
    std::env::var_os("CONCORDEM_HOST_RECORD").map(PathBuf::from)
}

fn read(file: &Path) -> Value {
    let text = std::fs::read_to_string(file).unwrap_or_else(|_| "{}".to_owned());
    serde_json::from_str(&text).unwrap_or_else(|error| panic!("{}: {error}", file.display()))
}

/// What the record has at `keys`.
fn get(keys: &[&str]) -> Option<Value> {
    keys.iter().try_fold(read(&file()?), |at, key| at.get(key).cloned())
}

/// Put `value` at `keys` of the file that `CONCORDEM_HOST_RECORD` names; without it, nothing is recorded.
pub fn put(keys: &[&str], value: impl Serialize) {
    let Some(file) = file() else { return };
    let mut all = read(&file);
    let mut at = &mut all;
    for key in keys {
        if !at.is_object() {
            *at = Value::Object(Map::new());
        }
        at = &mut at[*key];
    }
    *at = serde_json::to_value(value).unwrap();
    std::fs::write(&file, serde_json::to_string_pretty(&all).unwrap() + "\n").unwrap();
}
