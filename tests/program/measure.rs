//! Operators on a running simulation and on its result.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::state::columns::ColumnData;
use concordem_tests::commands::{concordem, text};
use tempfile::TempDir;

use crate::{PRISM, prism};

/// The samples of a run equal the same operators on its result at the last step, because forces and positions in the tables
/// are the final ones. The order of contacts differs, so sums of some hundred terms differ by rounding.
#[test]
fn operators_are_measured_during_and_after_a_run() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 90);
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let path = folder.path().join("prism.h5");
    let result = ResultFile::open(&path).expect("a result");
    assert_eq!(result.operators().expect("operators"), ["affine-strain", "region-stress"]);
    let table = result.table("samples/region-stress").expect("rows");
    let column = |name: &str| &table.iter().find(|(column, _)| column == name).expect("a column").1;
    assert_eq!(column("stress").components, 9);
    assert_eq!(format!("{:?}", column("step").data), "U64([0, 30, 60, 90])");
    // A run that ends at step 60 has the same state there as the longer run.
    let shorter = folder.path().join("shorter.toml");
    std::fs::write(&shorter, PRISM.replace("STEPS", "60")).expect("a scenario");
    assert_eq!(concordem(["run", "-q", text(&shorter)]).code, exit::DONE);
    let shorter = folder.path().join("shorter.h5");
    let given = concordem(["measure", text(&shorter), "--csv"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let line: Vec<f64> =
        given.out.lines().nth(1).expect("a row").split(',').map(|x| x.parse().expect("a number")).collect();
    let ColumnData::F64(sampled) = &column("stress").data else { panic!("not reals") };
    let size = sampled[18..27].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    assert!(size > 1e4, "the specimen carries {size} Pa");
    for (measured, sampled) in line.iter().zip(&sampled[18..27]) {
        assert!((measured - sampled).abs() < 1e-12 * size, "{measured} {sampled}");
    }
    // Any region, and a grid.
    let region =
        "{ kind = \"box\", minimum = [\"-4 mm\", \"-4 mm\", \"-4 mm\"], maximum = [\"4 mm\", \"4 mm\", \"4 mm\"] }";
    let all = [
        "region-stress",
        "particle-stress",
        "couple-stress",
        "affine-strain",
        "affine-rate",
        "cell-strain",
        "cell-rate",
        "fabric",
        "porosity",
        "damage-tensor",
    ];
    for operator in all {
        let given = concordem(["measure", text(&shorter), "--operator", operator, "--region", region]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert!(given.out.starts_with(operator) && !given.out.contains("NaN"), "{}", given.out);
    }
    let given = concordem(["measure", text(&shorter), "--operator", "fabric", "--region", region, "--grid", "2,3,1"]);
    assert_eq!((given.code, given.out.lines().count()), (exit::DONE, 7), "{}{}", given.out, given.err);
    // Operators that accept only special regions.
    let whole = "{ kind = \"all\", volume = \"1.296 cm^3\" }";
    let sphere = "{ kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }";
    for (operator, region) in [("boundary-stress", whole), ("power", whole), ("coarse-grain", sphere)] {
        let given = concordem(["measure", text(&shorter), "--operator", operator, "--region", region]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert!(given.out.starts_with(operator) && !given.out.contains("NaN"), "{}", given.out);
    }
    let table = result.table("particles").expect("particles");
    let (_, id) = table.iter().find(|(column, _)| column == "id").expect("ids");
    let ColumnData::U32(ids) = &id.data else { panic!("no ids") };
    let particles = ids.len();
    let given = concordem(["measure", text(&shorter), "--operator", "particle-stress", "--region", whole, "--each"]);
    assert_eq!((given.code, given.out.lines().count() - 1), (exit::DONE, particles));
    // Arguments that are refused.
    for (arguments, words) in [
        (vec!["--operator", "boundary-stress", "--region", region], "needs the whole body"),
        (vec!["--operator", "wall-traction"], "needs a wall"),
        (vec!["--operator", "wall-traction", "--wall", "floor", "--area", "1 cm^2"], "no wall is called \"floor\""),
        (vec!["--operator", "fabric", "--region", region, "--area", "1 cm"], "--area"),
        (vec!["--operator", "fabric", "--region", region, "--each"], "--each is for"),
        (vec!["--operator", "porosity", "--region", region, "--truncation", "internal-only"], "does not use this key"),
        (vec!["--operator", "stress"], "choose one of"),
        (vec!["--operator", "fabric"], "no periodic cell"),
        (vec!["--operator", "fabric", "--region", "{ kind = \"ball\" }"], "--region is not a valid region"),
        (
            vec!["--operator", "fabric", "--region", "{ kind = \"all\", volume = 1 }", "--grid", "2,2,2"],
            "only a box can be divided",
        ),
    ] {
        let given = concordem([vec!["measure", text(&shorter)], arguments].concat());
        assert_eq!(given.code, exit::USAGE);
        assert!(given.err.contains(words), "{}", given.err);
    }
}
