//! Crack surfaces as polygons for VTK.

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

/// A bar of spheres whose bonds break between its two halves.
const BAR: &str = r#"version = 1
[packing]
kind = "lattice"
lattice = "LATTICE"
radius = "1 mm"
SHAPE
[[material]]
name = "lower"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 4e5, normal_strength = "40 N", shear_strength = "40 N" }
[[material]]
name = "upper"
density = 2500
linear_bond = { normal_stiffness = 1e6, shear_stiffness = 4e5, normal_strength = "40 N", shear_strength = "40 N" }
[[interface]]
between = ["lower", "upper"]
of = "lower"
factors = { strength = 0.4 }
[[set]]
name = "top"
material = "upper"
selection = { kind = "box", minimum = [-1, -1, "MIDDLE mm"], maximum = [1, 1, 1] }
[bonds]
law = "linear_bond"
interaction_ratio = 1.01
[contacts]
law = "none"
LOADING
[integration]
damping = { kind = "local", coefficient = 0.3 }
[output]
snapshot_interval = 200
"#;

/// The numbers of an array of a file of VTK.
fn array(page: &str, name: &str) -> Vec<f64> {
    let at = page.find(&format!("Name=\"{name}\"")).unwrap_or_else(|| panic!("no {name}"));
    let from = at + page[at..].find('>').expect("a tag") + 1;
    let to = from + page[from..].find('<').expect("an end");
    page[from..to].split_whitespace().map(|word| word.parse().expect("a number")).collect()
}

/// Area of the polygons of a file, m², by their corners alone.
fn area_of_polygons(page: &str) -> f64 {
    let points = array(page, "Points");
    let point = |k: usize| [points[3 * k], points[3 * k + 1], points[3 * k + 2]];
    let mut first = 0;
    let mut area = 0.0;
    for end in array(page, "offsets") {
        let end = end as usize;
        let mut sum = [0.0; 3];
        for k in first + 1..end - 1 {
            let side = |j: usize| std::array::from_fn::<f64, 3, _>(|i| point(j)[i] - point(first)[i]);
            let (u, v) = (side(k), side(k + 1));
            for i in 0..3 {
                sum[i] += 0.5 * (u[(i + 1) % 3] * v[(i + 2) % 3] - u[(i + 2) % 3] * v[(i + 1) % 3]);
            }
        }
        area += sum.iter().map(|x| x * x).sum::<f64>().sqrt();
        first = end;
    }
    area
}

/// The faces of a straight crack through a bar, and of one through a periodic cell, have together the area of the section, open by the way
/// that the ends have gone, and broke in tension.
#[test]
fn a_straight_crack_has_the_area_of_the_section() {
    let stop = "[stop]\ntime = 1e-3\n";
    let pull = format!("[loading]\nkind = \"uniaxial\"\nstrain_rate = 20\ninitial_velocity_field = true\n{stop}");
    let shape = "shape = { kind = \"box\", size = [8e-3, 10e-3, 16e-3] }";
    let bar = BAR.replace("LATTICE", "sc").replace("SHAPE", shape).replace("LOADING", &pull).replace("MIDDLE", "1");
    // Faces of face-centered cells are tilted: the crack has teeth, whose projections add up to the section.
    let stretch =
        format!("[loading]\nkind = \"cell-strain\"\nvelocity_gradient = [[0, 0, 0], [0, 0, 0], [0, 0, 20]]\n{stop}");
    let cell = BAR
        .replace("LATTICE", "fcc")
        .replace("SHAPE", "repeats = [3, 3, 4]\nshape = { kind = \"periodic\" }")
        .replace("LOADING", &stretch);
    let edge = 3.0 * 8f64.sqrt() * 1e-3;
    // The halves of a cell meet in the middle and at the border.
    let cases = [(bar, 80e-6), (cell.replace("MIDDLE", "5"), 2.0 * edge * edge)];
    for (scenario, section) in cases {
        let folder = TempDir::new().expect("a temporary folder");
        let path = write(folder.path(), "bar.toml", &scenario);
        let given = concordem(["run", "-q", text(&path)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let given = concordem(["export", "--format", "cracks", text(&folder.path().join("bar.h5"))]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert!(given.err.contains("faces of bonds that broke or were damaged, with an area of"), "{}", given.err);
        let again = concordem(["export", "--format", "cracks", text(&folder.path().join("bar.h5"))]);
        assert_eq!(again.code, exit::FILE, "files are kept without --force");
        let page = std::fs::read_to_string(folder.path().join("bar.cracks.vtp")).expect("the file");
        let (area, normal) = (array(&page, "area"), array(&page, "normal"));
        let whole = area_of_polygons(&page);
        // Rounding of coordinates, and faces of the body that lie 2e-9 radii farther out.
        assert!((whole / area.iter().sum::<f64>() - 1.0).abs() < 1e-12);
        let along: f64 = area.iter().zip(normal.chunks(3)).map(|(area, n)| area * n[2].abs()).sum();
        assert!((along / section - 1.0).abs() < 1e-8, "{along} {section}");
        // The halves part along the axis: a tilted face opens by the cosine of its angle, and slips by the sine.
        let (opening, slip) = (array(&page, "opening"), array(&page, "slip"));
        for ((o, s), n) in opening.iter().zip(&slip).zip(normal.chunks(3)) {
            assert!(*o > 2e-6, "{o}");
            // Halves turn and vibrate by a small part of the way.
            let across = n[0].hypot(n[1]);
            assert!((s / o - across / n[2].abs()).abs() < 0.05, "{o} {s} {n:?}");
        }
        assert!(array(&page, "mode").iter().all(|&mode| mode == 0.0));
        assert!(array(&page, "time").iter().all(|&time| time > 1e-6 && time <= 1e-3));
        assert!(array(&page, "materials").chunks(2).all(|pair| pair[0] != pair[1]));
    }
}

/// Without broken bonds the file has no faces.
#[test]
fn a_sound_body_has_no_cracks() {
    let folder = TempDir::new().expect("a temporary folder");
    let shape = "shape = { kind = \"box\", size = [8e-3, 8e-3, 16e-3] }";
    let scenario = BAR.replace("LATTICE", "sc").replace("SHAPE", shape).replace("MIDDLE", "1");
    let path = write(folder.path(), "bar.toml", &scenario.replace("LOADING", "[stop]\nsteps = 10\n"));
    assert_eq!(concordem(["run", "-q", text(&path)]).code, exit::DONE);
    let given = concordem(["export", "--format", "cracks", text(&folder.path().join("bar.h5"))]);
    assert!(given.code == exit::DONE && given.err.contains("0 faces"), "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("bar.cracks.vtp")).expect("the file");
    assert!(page.contains("NumberOfPolys=\"0\"") && array(&page, "area").is_empty());
}
