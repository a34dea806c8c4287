//! Long studies: what their records say of their origin, and journals with which they go on after an interruption.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde_json::{Value, json};

/// A path of the sources, relative to their folder.
pub fn path_of(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(name)
}

/// What a program prints.
fn output(program: &str, arguments: &[&str]) -> String {
    let output = std::process::Command::new(program).args(arguments).output().ok();
    output.map_or_else(String::new, |o| String::from_utf8_lossy(&o.stdout).trim().to_owned())
}

/// The present commit of the sources.
pub fn commit() -> String {
    output("git", &["rev-parse", "--short", "HEAD"])
}

/// A record: commit, date, machine, and duration of a study, and its figures.
pub fn record(commit: &str, minutes: f64, figures: Value) -> String {
    let processors = std::fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = processors.lines().find_map(|line| line.strip_prefix("model name")?.split(": ").nth(1));
    let mut record = json!({
        "commit": commit,
        "date": output("date", &["+%F"]),
        "machine": {
            "processor": processor,
            "cores": std::thread::available_parallelism().map_or(1, usize::from),
            "system": std::env::consts::OS,
        },
        "minutes": (minutes * 10.0).round() / 10.0,
    });
    if let (Value::Object(record), Value::Object(figures)) = (&mut record, figures) {
        record.extend(figures);
    }
    format!("{record:#}\n")
}

/// What a study has found so far, one line for each part, in a file that survives its process. Another build begins anew.
pub struct Journal {
    file: File,
    /// The commit at which it began.
    commit: String,
    known: BTreeMap<String, Value>,
    /// Duration of all parts, s.
    seconds: f64,
    last: Instant,
}

impl Journal {
    /// The journal of the study `name`.
    ///
    /// # Panics
    /// It cannot be written.
    pub fn open(name: &str) -> Self {
        let path = path_of("target/studies").join(name).with_extension("jsonl");
        let program = std::env::current_exe().and_then(std::fs::read).expect("this program has a file");
        Self::at(&path, &blake3::hash(&program).to_hex())
    }

    fn at(path: &Path, build: &str) -> Self {
        let text = std::fs::read_to_string(path).unwrap_or_default();
        let mut lines = text.lines().map_while(|line| serde_json::from_str::<Value>(line).ok());
        let (head, known) = match lines.next() {
            Some(head) if head["build"] == build => (head, lines.collect()),
            _ => (json!({ "build": build, "commit": commit() }), Vec::<Value>::new()),
        };
        std::fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        let mut file = File::create(path).expect("a journal");
        // Without a line that was cut off.
        for line in std::iter::once(&head).chain(&known) {
            writeln!(file, "{line}").expect("a journal");
        }
        let entry = |line: &Value| Some((line["part"].as_str()?.to_owned(), line["found"].clone()));
        Self {
            file,
            commit: head["commit"].as_str().unwrap_or_default().to_owned(),
            seconds: known.iter().filter_map(|line| line["seconds"].as_f64()).sum(),
            known: known.iter().filter_map(entry).collect(),
            last: Instant::now(),
        }
    }

    /// What was found in a part: what is known, or what `find` finds now.
    ///
    /// # Panics
    /// The journal cannot be written.
    pub fn part(&mut self, part: &str, find: impl FnOnce() -> Value) -> Value {
        if let Some(known) = self.known.get(part) {
            return known.clone();
        }
        let found = find();
        let seconds = self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
        self.seconds += seconds;
        writeln!(self.file, "{}", json!({ "part": part, "found": found, "seconds": seconds })).expect("a journal");
        self.known.insert(part.to_owned(), found.clone());
        found
    }

    /// The record of the study.
    pub fn record(&self, figures: Value) -> String {
        record(&self.commit, self.seconds / 60.0, figures)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_journal_goes_on_where_it_was_interrupted() {
        let folder = std::env::temp_dir().join(format!("concordem-journal-{}", std::process::id()));
        let path = folder.join("study.jsonl");
        let mut journal = Journal::at(&path, "first");
        assert_eq!(journal.part("a", || json!(1)), json!(1));
        assert_eq!(journal.part("b", || json!({ "wrong": null })), json!({ "wrong": null }));
        // A kill cuts a line off.
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, &text[..text.len() - 3]).unwrap();
        let mut journal = Journal::at(&path, "first");
        assert_eq!(journal.part("a", || panic!("it is known")), json!(1));
        assert_eq!(journal.part("b", || json!(2)), json!(2));
        let mut journal = Journal::at(&path, "first");
        assert_eq!(journal.part("b", || panic!("it is known")), json!(2));
        let mut journal = Journal::at(&path, "second");
        assert_eq!(journal.part("a", || json!(3)), json!(3));
        std::fs::remove_dir_all(folder).unwrap();
    }
}
