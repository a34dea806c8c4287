//! Export of the heat network for LIGGGHTS and LAMMPS.

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

const BLOCK: &str = "version = 1
[packing]
kind = \"spheres\"
spheres = [[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3], [4e-3, 0, 0, 1e-3], [0, 2e-3, 0, 1e-3]]
[[material]]
name = \"glass\"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 1e5 }
thermal = { specific_heat = 800, conductivity = 1 }
[bonds]
law = \"linear_bond\"
interaction_ratio = 1.01
[contacts]
law = \"none\"
[heat]
MODEL
temperature = 300
[stop]
steps = 1
";

fn exported(model: &str) -> (concordem_tests::commands::Given, Option<String>) {
    let folder = TempDir::new().expect("a temporary folder");
    let path = write(folder.path(), "block.toml", &BLOCK.replace("MODEL", model));
    let given = concordem(["run", "-q", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let result = folder.path().join("block.h5");
    let given = concordem(["export", "--format", "heat-network", text(&result)]);
    let file = std::fs::read_to_string(folder.path().join("block.heat.txt")).ok();
    if file.is_some() {
        let again = concordem(["export", "--format", "heat-network", text(&result)]);
        assert_eq!(again.code, exit::FILE, "files are kept without --force");
    }
    (given, file)
}

/// A lattice has the areas and volumes of its cubes, and the heat capacity of its mass; ids count from 1.
#[test]
fn a_heat_network_has_capacities_and_areas() {
    let (given, file) = exported("model = \"ordered\"\npairs = \"bonds\"");
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let file = file.expect("a file");
    assert!(file.lines().any(|line| line == "model ordered"), "{file}");
    let rows = |kind: &str| -> Vec<Vec<f64>> {
        let words = file.lines().filter_map(|line| line.strip_prefix(kind));
        words.map(|line| line.split_whitespace().map(|word| word.parse().expect("a number")).collect()).collect()
    };
    let mut atoms = rows("atom ");
    atoms.sort_by(|a, b| a[0].total_cmp(&b[0]));
    assert_eq!(atoms.iter().map(|row| row[0]).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0]);
    let capacity = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-9 * 800.0;
    for row in atoms {
        assert!((row[1] / capacity - 1.0).abs() < 1e-14 && (row[2] / 8e-9 - 1.0).abs() < 1e-14, "{row:?}");
    }
    let mut bonds = rows("bond ");
    let pair = |row: &[f64]| [row[0].min(row[1]), row[0].max(row[1])];
    bonds.sort_by(|a, b| pair(a).partial_cmp(&pair(b)).expect("numbers"));
    assert_eq!(bonds.iter().map(|row| pair(row)).collect::<Vec<_>>(), [[1.0, 2.0], [1.0, 4.0], [2.0, 3.0]]);
    for row in bonds {
        for (found, expected) in row[2..].iter().zip([4e-6, 1e-3, 1e-3]) {
            assert!((found / expected - 1.0).abs() < 1e-14, "{row:?}");
        }
    }
}

/// The body is made again, so its files must not have changed.
#[test]
fn a_body_whose_files_changed_is_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let packing = "kind = \"file\"\npath = \"spheres.txt\"";
    let from = BLOCK.find("kind = ").expect("a kind");
    let to = BLOCK.find("[[material]]").expect("a material");
    let block = format!("{}{packing}\n{}", &BLOCK[..from], &BLOCK[to..]);
    let path = write(folder.path(), "block.toml", &block.replace("MODEL", "model = \"ordered\"\npairs = \"bonds\""));
    write(folder.path(), "spheres.txt", "0 0 0 1e-3\n2e-3 0 0 1e-3\n");
    let given = concordem(["run", "-q", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let result = folder.path().join("block.h5");
    write(folder.path(), "spheres.txt", "0 0 0 1e-3\n2e-3 0 0 1e-3\n4e-3 0 0 1e-3\n");
    let given = concordem(["export", "--format", "heat-network", text(&result)]);
    assert!(given.code != exit::DONE && !folder.path().join("block.heat.txt").exists());
    assert!(given.err.contains("cannot be exported as a heat network"), "{}", given.err);
}

#[test]
fn networks_that_the_hosts_cannot_have_are_refused() {
    // In a power diagram, the spheres beside the corner have a common face, but no bond.
    let (given, file) = exported("model = \"power\"");
    assert!(given.code != exit::DONE && file.is_none());
    assert!(given.err.contains("links without a bond of their own"), "{}", given.err);
}
