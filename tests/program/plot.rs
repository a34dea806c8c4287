//! Figures of results.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{Given, concordem, text, write};
use tempfile::TempDir;

use crate::PRISM;

/// Places of the curves of a drawing, without grid, axes, and legend.
fn curves(svg: &str) -> Vec<Vec<[f64; 2]>> {
    let lines = svg.split("<polyline points=\"").skip(1).filter(|line| line.contains("stroke-width=\"1.2\""));
    let places = lines.map(|line| {
        let list = line.split('"').next().expect("places");
        list.split(' ').map(|pair| {
            let (x, y) = pair.split_once(',').expect("a pair");
            [x.parse().expect("a number"), y.parse().expect("a number")]
        })
    });
    places.map(Iterator::collect).filter(|curve: &Vec<_>| curve.len() > 2).collect()
}

/// A figure has the curve of the file; several results have one each, repeated ones a mean in a band; PDF has what SVG has.
#[test]
fn figures_have_the_curves_of_the_files() {
    let folder = TempDir::new().expect("a temporary folder");
    let mut files = Vec::new();
    for (name, rate) in [("a", "20 1/s"), ("b", "25 1/s"), ("c", "30 1/s")] {
        let scenario = PRISM.replace("STEPS", "400").replace("20 1/s", rate);
        let path = write(folder.path(), &format!("{name}.toml"), &scenario);
        assert_eq!(concordem(["run", "-q", text(&path)]).code, exit::DONE);
        files.push(path.with_extension("h5"));
    }
    let path = folder.path().join("figure.svg");
    let plotted = |options: &[&str]| -> Given {
        let all = files.iter().map(|file| text(file));
        concordem(["plot"].into_iter().chain(all).chain(["--force", "-o", text(&path)]).chain(options.iter().copied()))
    };
    let drawn = |options: &[&str]| {
        let given = plotted(options);
        assert_eq!(given.code, exit::DONE, "{options:?}: {}", given.err);
        std::fs::read_to_string(&path).expect("a figure")
    };
    let svg = drawn(&[]);
    let found = curves(&svg);
    assert_eq!((found.len(), svg.contains(">strain, ‰<"), svg.contains(">stress, MPa<")), (3, true, true));
    for (curve, file) in found.iter().zip(&files) {
        let result = ResultFile::open(file).expect("a result");
        let (strain, stress) =
            (result.samples("strain").expect("strains"), result.samples("stress").expect("stresses"));
        assert_eq!(curve.len(), strain.len());
        // Places are straight functions of the values, with two decimals: of the first, the last, and the highest point they are known.
        let peak = (0..stress.len()).max_by(|a, b| stress[*a].total_cmp(&stress[*b])).expect("stresses");
        let (first, last) = (curve[0], curve[curve.len() - 1]);
        let (start, end) = (strain[0], strain[strain.len() - 1]);
        for (place, strain) in curve.iter().zip(&strain) {
            let share = (strain - start) / (end - start);
            assert!((place[0] - first[0] - share * (last[0] - first[0])).abs() < 0.011, "{place:?}");
        }
        assert!((0..curve.len()).all(|k| curve[k][1] >= curve[peak][1]), "the peak is the highest point");
        for (place, stress_there) in curve.iter().zip(&stress) {
            let share = (stress_there - stress[0]) / (stress[peak] - stress[0]);
            assert!((place[1] - first[1] - share * (curve[peak][1] - first[1])).abs() < 0.011, "{place:?}");
        }
    }
    assert_eq!(svg, drawn(&[]), "equal bytes");
    let mean = drawn(&["--mean"]);
    assert_eq!((curves(&mean).len(), mean.matches("<polygon").count()), (1, 1));
    let energy = drawn(&["--x", "time", "--y", "kinetic"]);
    assert!(energy.contains("time, µs") && energy.contains("kinetic, "));
    let compression = drawn(&["--compression"]);
    assert!(compression.contains("compressive stress, MPa"));
    let pdf = path.with_extension("pdf");
    let given = concordem(["plot", text(&files[0]), "-o", text(&pdf)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let bytes = std::fs::read(&pdf).expect("a figure");
    assert!(bytes.starts_with(b"%PDF") && String::from_utf8_lossy(&bytes).contains("(stress, MPa)"));
    let given = concordem(["plot", text(&files[0]), "-o", "figure.png"]);
    assert!(given.code == exit::USAGE && given.err.contains(".svg or .pdf"), "{}", given.err);
    for (options, reason) in [
        (&["--y", "nothing"][..], "nothing"),
        (&["--compression", "--x", "time", "--y", "kinetic"], "strain or a stress"),
        (&["--mean", "--x", "stress", "--y", "time"], "only rise or only fall"),
        (&["--size", "10 mm,60 mm"], "40 mm to 1 m"),
    ] {
        let given = plotted(options);
        assert_ne!(given.code, exit::DONE, "{options:?}");
        assert!(given.err.contains(reason), "{options:?}: {}", given.err);
    }
}
