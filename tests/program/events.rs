//! Cracks and acoustic emissions of a finished run.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use concordem_tests::pairs::PulledPairs;
use tempfile::TempDir;

const PAIRS: usize = 40;

/// Pairs that are pulled apart, joined by beams whose strengths scatter.
const BEAMS: PulledPairs<'_> = PulledPairs {
    count: PAIRS,
    law: "cohesive_beam",
    material: "cohesive_beam = { young = 1e9, radius_ratio = 1, tensile_strength = 1e6 }
        strength_scatter = { weibull_modulus = 4, seed = 2 }",
    time_step: 1e-6,
    steps: 5000,
};

/// Numbers of a column of comma-separated values.
fn column(csv: &str, name: &str) -> Vec<f64> {
    let at = csv.lines().next().expect("a header").split(',').position(|title| title == name).expect("a column");
    csv.lines().skip(1).map(|line| line.split(',').nth(at).expect("a cell").parse().expect("a number")).collect()
}

/// Pairs far apart are emissions of one break each, with the energy ½ E A (fσ/E)² l of a beam; with a long distance and duration all breaks
/// are one. A step is at least 1/800 of the elongation at which a bond breaks: 3e-3 of the energy.
#[test]
fn breaks_are_counted_by_mode_and_grouped() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(folder.path(), "pairs.toml", &BEAMS.scenario());
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let path = folder.path().join("pairs.h5");
    let given = concordem(["events", text(&path)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    println!("{}", given.out);
    for (name, value) in [("broken bonds", "40"), ("in tension and bending", "40"), ("in shear and twist", "0")] {
        let line = given.out.lines().find(|line| line.contains(name)).expect(name);
        assert_eq!(line.split_whitespace().last(), Some(value), "{line}");
    }
    assert!(given.out.contains("emissions") && given.out.contains("40, of breaks within 2.000e-3 m and 3.2 µs"));
    let csv = concordem(["events", text(&path), "--csv"]).out;
    let energies = column(&csv, "energy [J]");
    assert_eq!((energies.len(), column(&csv, "breaks")), (PAIRS, vec![1.0; PAIRS]));
    // The strengths of the result file give the energies.
    let result = ResultFile::open(&path).expect("a result");
    let rows = result.rows("contacts/cohesive_beam").expect("bonds");
    let of = |name: &str| {
        let (_, column) = rows.iter().find(|(column, _)| column == name).expect("a column");
        let concordem::state::columns::ColumnData::F64(values) = &column.data else { panic!("not reals") };
        values.clone()
    };
    let (factors, areas) = (of("strength_factor"), of("area"));
    let mut wanted: Vec<f64> =
        factors.iter().zip(&areas).map(|(factor, area)| 0.5 * 1e9 * area * (factor * 1e-3).powi(2) * 2e-3).collect();
    wanted.sort_by(f64::total_cmp);
    // Weaker bonds break earlier.
    for (energy, wanted) in energies.iter().zip(&wanted) {
        assert!(energy / wanted > 1.0 - 1e-9 && energy / wanted < 1.003, "{energy} {wanted}");
    }
    for (energy, magnitude) in energies.iter().zip(column(&csv, "magnitude")) {
        assert!((magnitude - (2.0 / 3.0 * energy.log10() - 3.2)).abs() < 1e-12);
    }
    let all = concordem(["events", text(&path), "--distance", "1 m", "--duration", "1 s", "--csv"]).out;
    let together: f64 = energies.iter().sum();
    assert_eq!(column(&all, "breaks"), [PAIRS as f64]);
    assert!((column(&all, "energy [J]")[0] / together - 1.0).abs() < 1e-14);
    // A tenth as many emissions count from a great magnitude on.
    let few = concordem(["events", text(&path), "--completeness", "0"]);
    assert!(few.out.contains("too few"), "{}", few.out);
    for (option, value) in [
        ("--distance", "0 mm"),
        ("--distance", "1 s"),
        ("--duration", "soon"),
        ("--completeness", "x"),
        ("--completeness", "nan"),
    ] {
        let given = concordem(["events", text(&path), option, value]);
        assert_eq!(given.code, exit::USAGE, "{option} {value}: {}", given.out);
        assert!(given.err.contains(option), "{}", given.err);
    }
    assert_eq!(concordem(["events", text(&scenario)]).code, exit::FILE);
}

/// Bonds without a modulus need a duration; a run without cracks says so.
#[test]
fn a_duration_is_asked_for_where_none_follows() {
    let folder = TempDir::new().expect("a temporary folder");
    let material = "linear_bond = { normal_stiffness = 1e6, shear_stiffness = 1e6 }";
    let scenario = PulledPairs { law: "linear_bond", material, steps: 10, ..BEAMS }.scenario();
    let scenario = write(folder.path(), "springs.toml", &scenario);
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let path = folder.path().join("springs.h5");
    let given = concordem(["events", text(&path)]);
    assert_eq!(given.code, exit::USAGE);
    assert!(given.err.contains("--duration"), "{}", given.err);
    let given = concordem(["events", text(&path), "--duration", "1 us"]);
    assert_eq!(given.code, exit::DONE);
    assert!(given.out.contains("broken bonds") && !given.out.contains("emissions"), "{}", given.out);
}
