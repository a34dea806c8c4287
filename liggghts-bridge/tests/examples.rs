//! Runs the example scripts of the documentation.

use std::path::Path;

use crate::harness::{self, Host, run_in, thermo};

/// Run an example script that the page `page` of the book includes, and return its output.
fn printed_on(processors: usize, host: Host, script: &str, page: &str, folder: &Path) -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(root.join("examples").join(script)).unwrap();
    let page = std::fs::read_to_string(root.join("../docs/book").join(page)).unwrap();
    assert!(page.contains(&format!("examples/{script}")), "the book does not include examples/{script}");
    run_in(host, folder, &text, processors)
}

/// A map with an entry per id takes 4 bytes per atom of the whole run on every process.
#[test]
fn no_script_asks_for_a_map_with_an_entry_per_id() {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let scripts = std::fs::read_dir(examples).unwrap().map(|entry| entry.unwrap().path());
    let scripts: Vec<_> = scripts.filter(|path| path.extension().is_some_and(|end| end == "in")).collect();
    assert!(scripts.len() > 8, "{scripts:?}");
    for path in scripts {
        let text = std::fs::read_to_string(&path).unwrap();
        let words: Vec<_> = text.split_whitespace().collect();
        assert!(!words.windows(2).any(|pair| pair == ["map", "array"]), "{path:?}");
    }
}

/// The same on two processors, for the scripts of the tutorial.
fn printed(host: Host, script: &str, folder: &Path) -> String {
    printed_on(2, host, script, "tutorials/in-liggghts-lammps.md", folder)
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
    assert!(folder.path().join("bonds.1000.vtp").exists());
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
    assert!(folder.path().join("bonds.1000.vtp").exists());
}

#[test]
fn a_bonded_block_rebounds_from_a_mesh() {
    let folder = tempfile::tempdir().unwrap();
    let floor = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/floor.stl");
    std::fs::copy(floor, folder.path().join("floor.stl")).unwrap();
    let rows = thermo(&printed_on(2, Host::Liggghts, "mesh-walls.in", "reference/liggghts/recipes.md", folder.path()));
    let (first, last) = (&rows[0], rows.last().unwrap());
    // Step, kinetic energy, bonds, broken bonds, height of the lowest atom. The floor is at 0; atoms have a radius of 5 mm.
    assert!(last[3] > 10.0 && first[2] == last[2] + last[3], "{first:?} {last:?}");
    assert!(rows.iter().all(|row| row[4] > 0.0), "through the floor: {rows:?}");
    assert!(last[4] > first[4] && rows.iter().any(|row| row[1] < 0.1 * first[1]), "no rebound: {rows:?}");
}

#[test]
fn an_impactor_breaks_a_plate_whose_edges_are_held() {
    let folder = tempfile::tempdir().unwrap();
    let rows = thermo(&printed_on(2, Host::Liggghts, "impact.in", "reference/liggghts/recipes.md", folder.path()));
    let last = rows.last().unwrap();
    // Step, velocity of the impactor, of the held atoms, bonds, broken bonds.
    assert!(rows[0][1] == -10.0 && last[1] > -9.0 && last[4] > 10.0, "{rows:?}");
    assert!(rows.iter().all(|row| row[2] == 0.0), "the held atoms moved: {rows:?}");
}

#[test]
fn runs_continue_on_another_number_of_processors() {
    for (host, of_host, page) in [
        (Host::Liggghts, "", "reference/liggghts/recipes.md"),
        (Host::Lammps, "-lammps", "reference/lammps/recipes.md"),
    ] {
        let folder = tempfile::tempdir().unwrap();
        printed_on(2, host, &format!("restart{of_host}.in"), page, folder.path());
        let dumps = [("continue", 1), ("continue", 4), ("continue-data", 2)].map(|(script, processors)| {
            printed_on(processors, host, &format!("{script}{of_host}.in"), page, folder.path());
            let text = std::fs::read_to_string(folder.path().join("end.dump")).unwrap();
            assert!(text.contains("ITEM: TIMESTEP\n300\n"), "{text}");
            text
        });
        assert!(dumps[0] == dumps[1] && dumps[0] == dumps[2], "{host:?}: the dumps differ");
    }
}

#[test]
fn the_documented_figures_match_the_results_files() {
    for name in ["compare_speed.py", "measure_scale.py", "lammps/compare_speed.py"] {
        let program = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let output =
            std::process::Command::new("python3").arg(program).arg("--check").output().expect("python3 is needed");
        assert!(output.status.success(), "{}", harness::text(&output));
    }
}
