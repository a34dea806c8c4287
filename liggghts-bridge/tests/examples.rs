//! The scripts of the documentation run.

mod harness;

use std::path::Path;

use harness::{run, thermo};

#[test]
fn the_script_of_the_documentation_runs() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let script = std::fs::read_to_string(root.join("examples/tension.in")).unwrap();
    let chapter = std::fs::read_to_string(root.join("../docs/liggghts.md")).unwrap();
    assert!(chapter.contains(&script), "docs/liggghts.md shows another script than examples/tension.in");
    let folder = tempfile::tempdir().unwrap();
    let printed = run(folder.path(), &script, 2);
    let rows = thermo(&printed);
    let (first, last) = (&rows[0], rows.last().unwrap());
    assert!(first[1] > 1000.0 && last[2] > 10.0, "{first:?} {last:?}");
    assert_eq!(first[1], last[1] + last[2]);
    // Stored energy rises and is released, the energy of broken bonds is booked.
    let most = rows.iter().map(|row| row[3]).fold(0.0, f64::max);
    assert!(most > 0.0 && last[4] > 0.0 && last[3] < most, "{rows:?}");
    let bonds = std::fs::read_to_string(folder.path().join("bonds.0.txt")).unwrap();
    assert_eq!(
        bonds.lines().filter(|line| !line.contains("ITEM")).count(),
        5 + first[1] as usize,
        "rows of dump local"
    );
}
