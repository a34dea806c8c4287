//! `sweep`: interruption, templates, bad sweeps.

use std::time::Instant;

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::{CELL, spawn};

const SWEEP: &str = r#"
version = 1
title = "Bonds < of spheres"
scenario = "cell.toml"
[[axis]]
name = "k_t"
key = "material[0].linear_bond.shear_stiffness"
logarithmic = { from = 1e4, to = 1e9, count = 16 }
[[axis]]
key = "bonds.coordination"
values = [5.5, 12, 60]
[[axis]]
key = "packing.seed"
values = [1, 2, 3, 4]
average = true
"#;

/// A sweep killed after growing delays and continued with other numbers of threads gives a file with the same bytes.
#[test]
#[cfg(unix)]
fn killed_sweeps_give_the_file_of_an_uninterrupted_sweep() {
    let folder = TempDir::new().expect("a temporary folder");
    write(folder.path(), "cell.toml", CELL);
    let sweep = write(folder.path(), "sweep.toml", SWEEP);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let start = Instant::now();
    let given = concordem(["sweep", "--csv", "-o", text(&whole), text(&sweep)]);
    let duration = start.elapsed();
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("192 points; 4 packings"), "{}", given.err);
    // Sixty bonds per particle are impossible; the other points have values.
    assert!(given.err.contains("64 of 192 points failed"), "{}", given.err);
    let table = std::fs::read_to_string(folder.path().join("whole.csv")).expect("the table");
    assert_eq!(table.lines().count(), 193);
    let heads: Vec<&str> = table.lines().next().expect("heads").split(',').collect();
    let column = |name: &str| heads.iter().position(|head| head.trim_matches('"') == name).expect(name);
    let (young, affine, bonds) = (column("young"), column("affine_young"), column("bonds.coordination"));
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[bonds] == "60.0" {
            assert!(cells[young].is_empty() && line.contains("no interaction ratio"), "{line}");
        } else {
            let [young, affine] = [young, affine].map(|k| cells[k].parse::<f64>().expect("a modulus"));
            assert!(young > 0.0 && young < affine, "{line}");
        }
    }
    let page = std::fs::read_to_string(folder.path().join("whole.html")).expect("the page");
    for words in ["Bonds &lt; of spheres", "Over k_t", "Error of the closed form", "64 points failed"] {
        assert!(page.contains(words), "{words}");
    }
    let expected = std::fs::read(&whole).expect("the result");
    let (mut kills, mut delay) = (0, duration / 4);
    let points = folder.path().join("broken.h5.points");
    let mut finished = String::new();
    loop {
        let mut process = spawn(&["sweep", "-q", "-j", ["1", "2", "3"][kills % 3], "-o", text(&broken), text(&sweep)]);
        std::thread::sleep(delay);
        if let Some(status) = process.try_wait().expect("a child process") {
            assert_eq!(status.code(), Some(0), "after {kills} kills");
            break;
        }
        process.kill().expect("a child process can be killed");
        process.wait().expect("a child process");
        if let Ok(text) = std::fs::read_to_string(&points) {
            finished = text;
        }
        kills += 1;
        // Killed after its end, while the test program of the child ended.
        if broken.exists() && !points.exists() {
            break;
        }
        assert!(kills < 100, "the sweep makes no progress");
        delay += duration / 8;
    }
    assert!(kills >= 1, "no kill");
    assert!(std::fs::read(&broken).expect("the result") == expected, "after {kills} kills the file differs");
    assert!(!points.exists(), "the finished points are in the result");
    // If killed after the result was written and before the journal was removed, the same command completes the sweep.
    let fingerprint = finished.lines().next().expect("points of a killed sweep").to_owned() + "\n";
    std::fs::write(&points, fingerprint).expect("a file");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(std::fs::read(&broken).expect("the result") == expected && !points.exists());
    // A finished sweep is kept, and points of another sweep are refused.
    assert_eq!(concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]).code, exit::FILE);
    std::fs::write(&points, "concordem sweep 1 other\n").expect("a file");
    std::fs::remove_file(&broken).expect("the result");
    std::fs::remove_file(broken.with_extension("html")).expect("the page");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert!(given.code == exit::FILE && given.err.contains("--force discards"), "{}", given.err);
}

#[test]
fn a_sweep_template_runs_and_bad_sweeps_are_refused_with_position_and_remedy() {
    let folder = TempDir::new().expect("a temporary folder");
    let given = concordem(["init", "--template", "elastic-sweep", text(folder.path())]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(folder.path().join("cpm-periodic.toml").exists() && given.err.contains("concordem sweep"), "{}", given.err);
    // The template with packings small enough for a test.
    let template = std::fs::read_to_string(folder.path().join("elastic-sweep.toml")).expect("the template");
    let cell = std::fs::read_to_string(folder.path().join("cpm-periodic.toml")).expect("the scenario");
    write(folder.path(), "cpm-periodic.toml", &cell.replace("count = 1000", "count = 60"));
    let sweep = folder.path().join("elastic-sweep.toml");
    let given = concordem(["sweep", text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("99 points; 3 packings") && !given.err.contains("failed"), "{}", given.err);
    // The other template, with a smaller specimen and few steps.
    let given = concordem(["init", "--template", "concrete-ensemble", text(folder.path())]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let prism = std::fs::read_to_string(folder.path().join("cpm-small.toml")).expect("the scenario");
    write(folder.path(), "cpm-small.toml", &prism.replace("\"15 mm\", \"15 mm\", \"30 mm\"", "7e-3, 7e-3, 9e-3"));
    let ensemble = folder.path().join("concrete-ensemble.toml");
    let given = concordem(["sweep", "--set", "packing.count=60", "--set", "stop.steps=5", text(&ensemble)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("240 points; 4 packings") && !given.err.contains("failed"), "{}", given.err);
    for (old, new, words) in [
        ("values = [1, 2, 3]", "values = [1, -2]", "packing.seed"),
        ("\"cpm-periodic.toml\"", "\"gone.toml\"", "gone.toml cannot be read"),
        ("material[0]", "material[3]", "no `material.3`"),
    ] {
        let bad = write(folder.path(), "bad.toml", &template.replace(old, new));
        let given = concordem(["sweep", text(&bad)]);
        assert_eq!(given.code, exit::USAGE, "{}", given.err);
        assert!(given.err.contains(words) && given.err.contains("help: "), "{words}: {}", given.err);
        assert!(!folder.path().join("bad.h5.points").exists(), "a refused sweep leaves no files");
    }
}
