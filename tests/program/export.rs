//! Exports for ParaView, OVITO, and LAMMPS, and snapshots of bonds.

use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::prism;

/// The numbers of a dataset.
pub(crate) fn reals(file: &hdf5::File, path: &str) -> Vec<f64> {
    file.dataset(path).and_then(|data| data.read_raw::<f64>()).unwrap_or_else(|error| panic!("{path}: {error}"))
}

/// The number after `ITEM: NUMBER OF …` of every snapshot of a dump.
fn counts(text: &str) -> Vec<usize> {
    let lines: Vec<&str> = text.lines().collect();
    let is_head = |line: &&str| line.starts_with("ITEM: NUMBER OF");
    (0..lines.len()).filter(|&k| is_head(&lines[k])).map(|k| lines[k + 1].parse().expect("a number")).collect()
}

/// A bar whose weak middle breaks: bonds at every snapshot, with the damage and the forces of the tables of the final state.
#[test]
fn bonds_are_lines_with_values_at_every_snapshot() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "prism.toml",
        &crate::PRISM.replace("steps = STEPS", "strain = 5e-3\ndrop_to = 0.1").replace("20 1/s", "60 1/s"),
    );
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let path = folder.path().join("prism.h5");
    let result = ResultFile::open(&path).expect("a result");
    let snapshots = result.snapshot_times().expect("snapshots").len();
    let table = result.rows("contacts/cpm").expect("a table");
    let bonds = table.iter().find(|(name, _)| name == "damage").expect("damage").1.borrow().len();
    let given = concordem(["export", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert_eq!(concordem(["export", text(&path)]).code, exit::FILE, "files are kept without --force");
    let file = hdf5::File::open(folder.path().join("prism.bonds.vtkhdf")).expect("an HDF5 file");
    let times = reals(&file, "VTKHDF/Steps/Values");
    assert_eq!(times.len(), snapshots);
    let last = |name: &str| {
        let offsets = file.dataset(&format!("VTKHDF/Steps/CellDataOffsets/{name}")).expect("offsets");
        let first = *offsets.read_raw::<i64>().expect("offsets").last().expect("an offset") as usize;
        reals(&file, &format!("VTKHDF/CellData/{name}"))[first..first + bonds].to_vec()
    };
    // The same bonds in another order: equal sums, to rounding.
    let of_table = |name: &str| match &table.iter().find(|(other, _)| other == name).expect("a column").1.data {
        concordem::state::columns::ColumnData::F64(values) => values.clone(),
        other => panic!("{other:?}"),
    };
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let (damage, expected) = (last("damage"), of_table("damage"));
    assert!((sum(&damage) - sum(&expected)).abs() < 1e-9 * sum(&expected), "{} {}", sum(&damage), sum(&expected));
    let magnitude = |normal: &[f64], shear: &[f64]| normal.iter().zip(shear).map(|(n, s)| n * n + s * s).sum::<f64>();
    let force = of_table("force").iter().map(|f| f * f).sum::<f64>();
    let found = magnitude(&last("normal_force"), &last("shear_force"));
    assert!((found - force).abs() < 1e-9 * force, "{found} {force}");
    // The opening is the length less the reference length.
    let opening: f64 = of_table("branch")
        .chunks(3)
        .zip(of_table("reference_length"))
        .map(|(l, reference)| (l[0] * l[0] + l[1] * l[1] + l[2] * l[2]).sqrt() - reference)
        .sum();
    assert!((sum(&last("opening")) - opening).abs() < 1e-9 * opening.abs().max(1e-9), "{opening}");
    // Lines end at the centers of their particles: the first line of the last snapshot.
    let points = reals(&file, "VTKHDF/Points");
    let length: f64 = points[points.len() - 6 * bonds..]
        .chunks(6)
        .map(|p| (0..3).map(|i| (p[i + 3] - p[i]).powi(2)).sum::<f64>().sqrt())
        .sum();
    let lengths: f64 = of_table("branch").chunks(3).map(|l| (l[0] * l[0] + l[1] * l[1] + l[2] * l[2]).sqrt()).sum();
    assert!((length - lengths).abs() < 1e-9 * lengths, "{length} {lengths}");
    lammps(folder.path(), snapshots, bonds);
}

fn lammps(folder: &Path, snapshots: usize, bonds: usize) {
    let given = concordem(["export", text(&folder.join("prism.h5")), "--format", "lammps"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).expect("a file");
    let counts_of_bonds = counts(&read("prism.bonds.dump"));
    assert!(
        counts_of_bonds.len() == snapshots && counts_of_bonds.iter().all(|count| *count == bonds),
        "{counts_of_bonds:?}"
    );
    let particles = counts(&read("prism.dump"));
    assert_eq!(particles.len(), snapshots);
    assert!(read("prism.data").contains(&format!("{bonds} bonds")));
    // Our own reader takes the data file without its bonds, which a packing cannot hold, and the dump: the same particles.
    let data = read("prism.data");
    let (spheres, _) = data.split_once("\nBonds").expect("bonds");
    write(folder, "spheres.data", spheres);
    for (name, code) in [("prism.data", exit::USAGE), ("spheres.data", exit::DONE), ("prism.dump", exit::DONE)] {
        let scenario = crate::PRISM.replace("STEPS", "1").replace(
            "kind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nshape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }",
            &format!("kind = \"file\"\npath = \"{name}\""),
        );
        let scenario = write(folder, "again.toml", &scenario);
        let given = concordem(["pack", "--force", text(&scenario)]);
        assert_eq!(given.code, code, "{}", given.err);
        if code == exit::USAGE {
            assert!(given.err.contains("the section `Bonds` is not read"), "{}", given.err);
            continue;
        }
        assert!(given.out.contains("spheres  ") && given.out.contains(&particles[0].to_string()), "{}", given.out);
    }
}

/// Without bonds in the snapshots, those of the final state are exported, and the message says so.
#[test]
fn without_snapshots_of_bonds_the_final_ones_are_exported() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 100);
    let given = concordem(["run", "-q", text(&scenario), "--set", "output.bond_snapshots=false"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let given = concordem(["export", text(&folder.path().join("prism.h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("bond_snapshots = true"), "{}", given.err);
    let file = hdf5::File::open(folder.path().join("prism.bonds.vtkhdf")).expect("an HDF5 file");
    assert_eq!(reals(&file, "VTKHDF/Steps/Values").len(), 1);
}

/// An unfinished run has a state, a share, and its last sample; its result does not exist yet.
#[test]
fn info_shows_unfinished_runs() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 1_000_000);
    let mut child = crate::spawn(&["run", "-q", text(&scenario)]);
    let result = folder.path().join("prism.h5");
    let mut shown = String::new();
    for _ in 0..600 {
        let given = concordem(["info", text(&result)]);
        // The folder may appear between two looks.
        if given.code == exit::DONE && given.out.contains("strain") {
            shown = given.out;
            break;
        }
        std::thread::sleep(std::time::Duration::from_millis(50));
    }
    child.kill().expect("the child runs");
    child.wait().expect("it ends");
    for part in ["unfinished run", "running", "strain", "done", "last written"] {
        assert!(shown.contains(part), "{part} is missing: {shown}");
    }
    let given = concordem(["info", text(&result)]);
    assert!(given.out.contains("interrupted; continue with `concordem resume`"), "{}", given.out);
    assert_eq!(concordem(["info", "--scenario", text(&result)]).out, std::fs::read_to_string(&scenario).expect("it"));
}
