//! Files that a run writes: result, table, report.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::state::columns::ColumnData;
use concordem_tests::commands::{concordem, text, write};

use crate::PRISM;

/// Broken bonds, which the solver removes from its lists, stay in the tables and count in the damage of particles and in the
/// damage tensor.
#[test]
fn broken_bonds_stay_in_the_tables() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let sampled = "[[sample]]\noperator = \"damage-tensor\"\nregion = { kind = \"sphere\", center = [0, 0, 0], radius = \"5 mm\" }\n";
    let text_of = PRISM.replace("STEPS", "1501").replace("sample_interval = 7", "sample_interval = 1500")
        + sampled
        + "interval = 1500\n";
    let scenario = write(folder.path(), "prism.toml", &text_of);
    let path = folder.path().join("prism.h5");
    let given = concordem(["run", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let result = ResultFile::open(&path).expect("a complete result");
    let column = |table: &str, name: &str| {
        let (_, column) =
            result.table(table).expect("a table").into_iter().find(|(found, _)| found == name).expect(name);
        column.data
    };
    let (ColumnData::U8(broken), ColumnData::F64(damage), ColumnData::U32(ids)) =
        (column("contacts/cpm", "broken"), column("contacts/cpm", "damage"), column("contacts/cpm", "ids"))
    else {
        panic!("types of columns")
    };
    let lost: usize = broken.iter().map(|&flag| usize::from(flag)).sum();
    let events = result.events().expect("events").iter().filter(|event| event.damage == 1.0).count();
    assert!(lost > 20 && lost == events, "{lost} rows, {events} events");
    assert!(broken.iter().zip(&damage).all(|(&flag, &damage)| flag == 0 || damage == 1.0));
    let (ColumnData::U32(particles), ColumnData::F64(mean)) =
        (column("particles", "id"), column("particles", "damage"))
    else {
        panic!("types of columns")
    };
    for (id, mean) in particles.iter().zip(&mean) {
        let of_it: Vec<f64> =
            ids.chunks_exact(2).zip(&damage).filter(|(pair, _)| pair.contains(id)).map(|(_, &damage)| damage).collect();
        let expected = of_it.iter().sum::<f64>() / of_it.len() as f64;
        // Tolerance: the order of the sum differs.
        assert!((mean - expected).abs() < 1e-14, "particle {id}: {mean} instead of {expected}");
    }
    // The particles hardly move in the last step: the tensor from the tables is that of the last sample, up to the
    // rotation of bonds.
    let region = r#"{ kind = "sphere", center = [0, 0, 0], radius = "5 mm" }"#;
    let given = concordem(["measure", text(&path), "--operator", "damage-tensor", "--region", region, "--csv"]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let measured: Vec<f64> =
        given.out.lines().nth(1).expect("a row").split(',').map(|x| x.parse().expect("a number")).collect();
    let ColumnData::F64(sampled) = column("samples/damage-tensor", "damage") else { panic!("not reals") };
    let size = sampled[9..18].iter().fold(0.0_f64, |size, x| size.max(x.abs()));
    println!("{} {measured:?} {sampled:?}", given.out);
    for (measured, sampled) in measured.iter().zip(&sampled[9..18]) {
        assert!((measured - sampled).abs() < 1e-3 * size, "{measured} instead of {sampled}");
    }
}

/// Results do not overwrite other files: result names need an HDF5 extension, and an existing table is overwritten only with
/// --force. `resume` writes a missing table.
#[test]
fn results_do_not_overwrite_other_files() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let with_table = PRISM.replace("STEPS", "20").replace("sample_interval = 7", "csv = true\nsample_interval = 7");
    let scenario = write(folder.path(), "prism.toml", &with_table);
    for command in ["run", "sweep"] {
        let given = concordem([command, "-q", text(&scenario), "-o", text(&folder.path().join("out.csv"))]);
        assert_eq!(given.code, exit::USAGE, "{}", given.err);
        if command == "run" {
            assert!(given.err.contains("out.csv") && given.err.contains("out.h5"), "{}", given.err);
        }
    }
    let table = write(folder.path(), "prism.csv", "mine\n");
    let given = concordem(["run", "-q", text(&scenario)]);
    assert!(given.code == exit::FILE && given.err.contains("prism.csv"), "{}: {}", given.code, given.err);
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), "mine\n");
    assert!(!folder.path().join("prism.h5").exists());
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    let written = std::fs::read_to_string(&table).expect("a table");
    assert!(written.lines().count() > 2);
    std::fs::remove_file(&table).expect("a table");
    assert_eq!(concordem(["resume", text(&scenario)]).code, exit::DONE);
    assert_eq!(std::fs::read_to_string(&table).expect("a table"), written);
}

/// For a run without loading, `info` reports no peak stress; the CSV table has the columns of operators and a last row for
/// the final state; and `measure` refuses an empty region.
#[test]
fn tables_of_a_run_without_loading_are_complete() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "rest.toml",
        "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [[0, 0, 0, 0.01], [0.02, 0, 0, 0.01]]\n[[material]]\n\
         name = \"m\"\ndensity = 2500\nlinear_bond = { normal_stiffness = 1e6, shear_stiffness = 5e5 }\n\
         frictional = { normal_stiffness = 1, shear_stiffness = 0, friction_coefficient = 0 }\n[bonds]\n\
         law = \"linear_bond\"\n[contacts]\nlaw = \"none\"\n[[set]]\nname = \"all\"\nselection = { kind = \"all\" }\n\
         [[force]]\nset = \"all\"\nforce = [1, 0, 0]\n[[sample]]\noperator = \"region-stress\"\nname = \"core\"\n\
         region = { kind = \"all\", volume = 1e-5 }\ninterval = 4\n[[sample]]\noperator = \"porosity\"\n\
         region = { kind = \"box\", minimum = [-1, -1, -1], maximum = [1, 1, 1] }\ngrid = [2, 1, 1]\ninterval = 10\n[stop]\n\
         steps = 15\n[output]\nsample_interval = 10\ncsv = true\n",
    );
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    // Warnings give position, key, and remedy.
    for words in [
        "rest.toml:9:1: material[0].frictional: neither bonds nor contacts use this law",
        "bonds.interaction_ratio: 1 of the 1 bonds are as long as the longest",
        "help: ",
    ] {
        assert!(given.err.contains(words), "{words}: {}", given.err);
    }
    let table = std::fs::read_to_string(folder.path().join("rest.csv")).expect("the table");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    let column = |name: &str| {
        let at = rows[0].iter().position(|head| *head == name).unwrap_or_else(|| panic!("{name}: {:?}", rows[0]));
        rows[1..].iter().map(|row| row[at]).collect::<Vec<_>>()
    };
    assert_eq!(column("step [1]"), ["0.0", "", "", "10.0", "", "15.0"]);
    let filled = |name: &str| column(name).iter().map(|field| !field.is_empty()).collect::<Vec<_>>();
    assert_eq!(filled("core stress_xx [Pa]"), [true, true, true, false, true, true]);
    assert_eq!(filled("core volume [m^3]"), [true, true, true, false, true, true]);
    assert_eq!(filled("porosity porosity_1 [1]"), [true, false, false, true, false, true]);
    let result = folder.path().join("rest.h5");
    let given = concordem(["info", text(&result)]);
    assert!(given.code == exit::DONE && !given.out.contains("stress"), "{}", given.out);
    assert!(given.out.contains("last step"), "{}", given.out);
    // The last row belongs to the final state in the result.
    let given = concordem([
        "measure",
        text(&result),
        "--operator",
        "region-stress",
        "--csv",
        "--region",
        "{ kind = \"all\", volume = 1e-5 }",
    ]);
    let measured: f64 =
        given.out.lines().nth(1).and_then(|row| row.split(',').next()).expect("a value").parse().expect("it");
    let sampled: f64 = column("core stress_xx [Pa]").last().expect("a row").parse().expect("a number");
    assert_eq!(measured.to_bits(), sampled.to_bits());
    for operator in ["region-stress", "porosity", "particle-stress", "fabric"] {
        let region = "{ kind = \"sphere\", center = [1, 0, 0], radius = \"5 mm\" }";
        let given = concordem(["measure", text(&result), "--operator", operator, "--region", region]);
        assert!(
            given.code == exit::USAGE && given.err.contains("no particle and no contact"),
            "{operator}: {}",
            given.err
        );
    }
}

/// The report of a plane run draws the particles behind the broken bonds.
#[test]
fn reports_of_plane_runs_draw_the_particles() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "bar.toml",
        "version = 1\ndimension = 2\n[packing]\nkind = \"lattice\"\nlattice = \"square\"\nradius = \"1 mm\"\n\
         repeats = [3, 8, 1]\n[[material]]\nname = \"disc\"\ndensity = 2000\n\
         linear_bond = { normal_stiffness = 7e10, shear_stiffness = 1e10, damping_ratio = 0.1, normal_strength = 14000 }\n\
         [bonds]\nlaw = \"linear_bond\"\ninteraction_ratio = 1.1\n[contacts]\nlaw = \"none\"\n[loading]\n\
         kind = \"uniaxial\"\naxis = \"y\"\nstrain_rate = 1\nlayer_thickness = \"3 mm\"\n[stop]\ndrop_to = 0.2\nstrain = 1e-3\n",
    );
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let result = folder.path().join("bar.h5");
    assert_eq!(concordem(["report", text(&result)]).code, exit::DONE);
    let page = std::fs::read_to_string(folder.path().join("bar.html")).expect("the page");
    let (_, rest) = page.split_once("discs: \"").expect("particles of a plane run");
    let (discs, _) = rest.split_once('"').expect("their end");
    // Six bytes for each of 24 discs, in base 64.
    assert_eq!(discs.len(), 24 * 6 * 4 / 3);
}

/// A specimen that is held has no stress but rounding errors. The program says so in place of a modulus, a strength, and a curve.
#[test]
fn rounding_errors_have_no_modulus() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = write(
        folder.path(),
        "held.toml",
        "version = 1\n[packing]\nkind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\n\
         shape = { kind = \"box\", size = [\"9 mm\", \"9 mm\", \"16 mm\"] }\n[[material]]\nname = \"concrete\"\ndensity = 4800\n\
         cpm = { young = \"25 GPa\", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, cohesion = \"3 MPa\", \
         friction_coefficient = 0.8 }\n[bonds]\nlaw = \"cpm\"\ninteraction_ratio = 1.5\n[contacts]\nlaw = \"cpm\"\n[integration]\n\
         damping = { kind = \"local\", coefficient = 0.3 }\n[loading]\nkind = \"uniaxial\"\nstrain_rate = \"20 1/s\"\n\
         [[stage]]\nname = \"hold\"\nrate = 0\nstop = { steps = 100 }\n[output]\nsample_interval = 5\n",
    );
    let run = concordem(["run", text(&path)]);
    assert_eq!(run.code, exit::DONE, "{}", run.err);
    let result = folder.path().join("held.h5");
    let info = concordem(["info", text(&result)]);
    let report = concordem(["report", text(&result), "-o", text(&folder.path().join("held.html"))]);
    assert_eq!(report.code, exit::DONE, "{}", report.err);
    let page = std::fs::read_to_string(folder.path().join("held.html")).expect("a page");
    for shown in [&run.err, &info.out, &page] {
        assert!(shown.contains("are rounding errors: no modulus, no strength"), "{shown}");
        assert!(
            ![" GPa,", "Young’s", "f_t", "f_c", "f<sub>", "<h2>Stress and strain"]
                .iter()
                .any(|word| shown.contains(word)),
            "{shown}"
        );
    }
}
