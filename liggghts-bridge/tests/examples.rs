//! Runs the example scripts of the documentation.

mod harness;

use std::path::Path;

use harness::{Host, run_in, thermo};

/// Run an example script that the book includes on two processors and return its output.
fn printed(host: Host, script: &str, folder: &Path) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("examples").join(script)).unwrap();
    let page = std::fs::read_to_string(root.join("../docs/book/tutorials/in-liggghts-lammps.md")).unwrap();
    assert!(page.contains(&format!("examples/{script}")), "the book does not include examples/{script}");
    run_in(host, folder, &text, 2)
}

#[test]
fn the_script_for_lammps_runs() {
    let folder = tempfile::tempdir().unwrap();
    let printed = printed(Host::Lammps, "tension-lammps.in", folder.path());
    let rows = thermo(&printed);
    let (first, last) = (&rows[0], rows.last().unwrap());
    assert!(first[3] > 1000.0 && last[4] > 10.0, "{first:?} {last:?}");
    assert_eq!(first[3], last[3] + last[4]);
    // Tension is a negative pressure; breaking bonds dissipate energy.
    assert!(rows.iter().any(|row| row[2] < -1e5) && last[5] > 0.0, "{rows:?}");
    let bonds = std::fs::read_to_string(folder.path().join("bonds.0.txt")).unwrap();
    let rows = bonds.lines().skip_while(|line| !line.starts_with("ITEM: ENTRIES")).skip(1).count();
    assert_eq!(rows, first[3] as usize, "rows of dump local");
}

#[test]
fn the_script_of_the_documentation_runs() {
    let folder = tempfile::tempdir().unwrap();
    let printed = printed(Host::Liggghts, "tension.in", folder.path());
    let rows = thermo(&printed);
    let (first, last) = (&rows[0], rows.last().unwrap());
    assert!(first[1] > 1000.0 && last[2] > 10.0, "{first:?} {last:?}");
    assert_eq!(first[1], last[1] + last[2]);
    // Stored energy rises and is released; breaking bonds dissipate energy.
    let most = rows.iter().map(|row| row[3]).fold(0.0, f64::max);
    assert!(most > 0.0 && last[4] > 0.0 && last[3] < most, "{rows:?}");
    let bonds = std::fs::read_to_string(folder.path().join("bonds.0.txt")).unwrap();
    assert_eq!(
        bonds.lines().filter(|line| !line.contains("ITEM")).count(),
        5 + first[1] as usize,
        "rows of dump local"
    );
}

#[test]
fn the_documented_figures_match_the_results_files() {
    for name in ["compare_speed.py", "measure_scale.py"] {
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let output =
            std::process::Command::new("python3").arg(program).arg("--check").output().expect("python3 is needed");
        assert!(output.status.success(), "{}", harness::text(&output));
    }
}
