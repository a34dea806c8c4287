//! What a page draws is what is in the file: names by the kind of loading, shares that add up, pictures of the whole body.

use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::scenario::template;
use concordem_tests::commands::{concordem, text, write};

/// The page about a run of a few steps.
fn page_of(folder: &Path, name: &str, scenario: &str) -> String {
    let file = write(folder, &format!("{name}.toml"), scenario);
    let given = concordem(["run", "-q", text(&file), "--set", "output.sample_interval=1"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let given = concordem(["report", text(&file.with_extension("h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    std::fs::read_to_string(file.with_extension("html")).expect("a page")
}

/// Page and result of a prism of two materials that softens.
pub fn page_of_prism(folder: &Path) -> (String, ResultFile) {
    let page = page_of(folder, "prism", &crate::PRISM.replace("STEPS", "700"));
    (page, ResultFile::open(&folder.join("prism.h5")).expect("a result"))
}

/// A template with other keys.
fn changed(name: &str, changes: &[(&str, &str)]) -> String {
    let mut scenario = template(name).expect("a template").text.to_owned();
    for (from, to) in changes {
        assert!(scenario.contains(from), "{name}: {from}");
        scenario = scenario.replacen(from, to, 1);
    }
    scenario
}

/// Slope and largest stress have the names that they have in this kind of loading.
#[test]
fn names_follow_the_kind_of_loading() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lattice = (
        "kind = \"random-dense\"\ncount = 1000\nradius = \"1 mm\"\nseed = 1",
        "kind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nrepeats = [3, 3, 3]",
    );
    let short = ("[stop]\nstrain = 1e-3", "[stop]\nsteps = 60\nstrain = 1e-3");
    let cell =
        page_of(folder.path(), "cell", &changed("cpm-periodic", &[lattice, short, ("[0, 0, 0.4]", "[0, 0, 40]")]));
    assert!(cell.contains("oedometric modulus") && cell.contains("M = "), "{}", &cell[..4000]);
    let bar = crate::PRISM.replace("steps = STEPS", "steps = 60");
    let bar = page_of(folder.path(), "bar", &bar);
    assert!(bar.contains("Young’s modulus") && bar.contains("layers that hold the ends") && bar.contains("E = "));
    let sentences = ["Young’s modulus", "compressive strength", "tensile strength", "layers that hold the ends"];
    for sentence in sentences {
        assert!(!cell.contains(sentence), "{sentence}");
    }
}

/// The shares of all energies add up to that of the work, also for deformable particles.
#[test]
fn shares_of_the_energies_add_up() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let discs = changed(
        "deformable-discs",
        &[("repeats = [9, 20, 1]", "repeats = [5, 8, 1]"), ("time = \"0.6 ms\"", "steps = 200")],
    );
    let page = page_of(folder.path(), "discs", &discs);
    let rows =
        page.split("<th>at the end</th>").nth(1).and_then(|rest| rest.split("</table>").next()).expect("a table");
    assert!(rows.contains("stored in deformable particles"), "{rows}");
    let share = |row: &str| -> Option<f64> {
        let share = row.rsplit("<td class=\"number\">").next()?.split(" %").next()?;
        share.replace('−', "-").parse().ok()
    };
    let shares: Vec<f64> = rows.split("</tr>").filter_map(share).collect();
    let (total, terms) = shares.split_last().expect("rows");
    // Each share is rounded to one decimal; the residual of the balance is below 1e-9.
    let sum: f64 = terms.iter().sum();
    assert!(terms.len() >= 3 && *total == 100.0 && (sum - total).abs() <= 0.05 * terms.len() as f64, "{shares:?}");
}

/// A plate of more discs than a picture shows: the picture has the bounding box of the plate, and each quarter its part of the particles.
#[test]
fn the_slice_of_a_plane_body_shows_all_of_it() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plate = changed(
        "deformable-discs",
        &[
            ("repeats = [9, 20, 1]", "repeats = [40, 40, 1]"),
            ("deformable = { young = \"200 GPa\", poisson = 0.35 }", ""),
            ("[deformable]\ncondition = \"plane-strain\"", "#"),
            ("update = \"lagged\"", "#"),
            ("acts = \"push\"", "#"),
            ("acts = \"push\"", "#"),
            ("time = \"0.6 ms\"", "steps = 2"),
            ("csv = true", "snapshot_interval = 1"),
        ],
    );
    page_of(folder.path(), "plate", &plate);
    let result = ResultFile::open(&folder.path().join("plate.h5")).expect("a result");
    let slice = result.slice(400, 16).expect("readable").expect("snapshots");
    assert_eq!((slice.axes, slice.count, slice.cut), ([0, 1], 400, 1600));
    let coordinates = |axis: usize| slice.points.iter().skip(axis).step_by(2).copied();
    for axis in 0..2 {
        let ends = coordinates(axis).zip(&slice.radius);
        let drawn =
            ends.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (x, r)| [low.min(x - r), high.max(x + r)]);
        assert_eq!(drawn, [slice.bounds[0][axis], slice.bounds[1][axis]]);
    }
    let middle = |axis: usize| 0.5 * (slice.bounds[0][axis] + slice.bounds[1][axis]);
    for (right, upper) in [(false, false), (false, true), (true, false), (true, true)] {
        let quarter = coordinates(0).zip(coordinates(1));
        let count = quarter.filter(|(x, y)| (*x > middle(0)) == right && (*y > middle(1)) == upper).count();
        // Binomial with a standard deviation of √(400·3/16) = 9.
        assert!(count.abs_diff(100) < 45, "{count}");
    }
}
