//! Random combinations of features: each scenario is refused with a remedy, or runs and passes oracles.
//!
//! `CONCORDEM_COMBINATIONS` is the number of scenarios (default 100; a night: 2,000 and more), `CONCORDEM_COMBINATIONS_SEED` that
//! of the random numbers (default 1), `CONCORDEM_COMBINATIONS_ONLY` the number of a single scenario. Scenarios that fail are kept
//! in `target/combinations`. `CONCORDEM_COMBINATIONS_RESULT` is a file for the counts; `result.json` here is the last long run. It has run
//! every feature and every oracle at least once.

mod balance;
mod case;
mod compare;
mod features;
mod fibers;
mod finite_walls;
mod generator;
mod heat;
mod in_time;
mod oracles;
mod report;
mod run;
mod slaves;
mod twins;

use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};

use concordem_tests::on_threads;
use report::Report;

/// Scenarios of a long run, in which every feature and every oracle must occur.
const LONG: u64 = 2000;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|text| text.parse().unwrap_or_else(|_| panic!("{name} is no number: {text}")))
}

#[test]
fn combinations_run_or_are_refused() {
    let seed = number("CONCORDEM_COMBINATIONS_SEED").unwrap_or(1);
    let count = number("CONCORDEM_COMBINATIONS").unwrap_or(100);
    let only = number("CONCORDEM_COMBINATIONS_ONLY");
    let range = only.map_or(0..count, |only| only..only + 1);
    let kept = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../target/combinations");
    std::fs::create_dir_all(&kept).expect("a folder");
    // Panics are findings; their messages go to the report. That of a single scenario shows its place, too.
    if only.is_none() {
        std::panic::set_hook(Box::new(|_| {}));
    }
    let start = std::time::Instant::now();
    let (next, report) = (AtomicU64::new(range.start), Mutex::new(Report::default()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                let folder = tempfile::tempdir().expect("a folder");
                on_threads(1, || work(seed, &range, &next, folder.path(), &kept, &report));
            });
        }
    });
    let _ = std::panic::take_hook();
    let report = report.into_inner().expect("no panic");
    println!("{report}");
    if let Some(path) = std::env::var_os("CONCORDEM_COMBINATIONS_RESULT") {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("..").join(path);
        std::fs::write(path, report.json(seed, start.elapsed().as_secs_f64() / 60.0)).expect("a file");
    }
    let never = report.never();
    assert!(range.end - range.start < LONG || never.is_empty(), "in no scenario that ran: {}", never.join(", "));
    assert!(report.passed(), "{} of {} scenarios failed; see above", report.failed(), range.end - range.start);
}

/// Judges scenarios until none is left.
fn work(seed: u64, range: &std::ops::Range<u64>, next: &AtomicU64, folder: &Path, kept: &Path, report: &Mutex<Report>) {
    loop {
        let number = next.fetch_add(1, Ordering::Relaxed);
        if number >= range.end {
            return;
        }
        let case = generator::case(seed, number);
        let (verdict, judged) = oracles::judge(&case, folder);
        if !judged.findings.is_empty() || range.end - range.start == 1 {
            let text = case.text(&|name, bytes| {
                let name = format!("{seed}-{number}-{name}");
                std::fs::write(kept.join(&name), bytes).expect("a file");
                name
            });
            std::fs::write(kept.join(format!("{seed}-{number}.toml")), text).expect("a file");
        }
        report.lock().expect("no panic").add(number, &case, &verdict, judged);
    }
}

/// The record is that of a long run, and in it every feature was in a scenario that ran, and every oracle compared something.
#[test]
fn the_record_has_every_feature_and_every_oracle() {
    let record: serde_json::Value = serde_json::from_str(include_str!("result.json")).expect("JSON");
    assert!(record["scenarios"].as_u64().expect("a number") >= LONG);
    let features = features::FEATURES.iter().map(|feature| ("features", feature.name));
    for (table, name) in features.chain(oracles::ORACLES.iter().map(|oracle| ("oracles", *oracle))) {
        assert!(
            record[table][name].as_u64().is_some_and(|count| count > 0),
            "{table}: {name} is not in the record; run it anew"
        );
    }
}
