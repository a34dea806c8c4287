//! Continuing a state with a changed scenario: allowed changes are applied, others are refused with their key.

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem::state::columns::ColumnData;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::BLOCK;

fn hash(path: &std::path::Path) -> String {
    ResultFile::open(path).and_then(|result| result.state_hash()).expect("a result")
}

/// Velocity of the outermost particle along z: half of strain rate times length.
fn fastest(path: &std::path::Path) -> f64 {
    let table = ResultFile::open(path).expect("a result").table("particles").expect("particles");
    let (_, column) = table.iter().find(|(name, _)| name == "velocity").expect("velocities");
    let ColumnData::F64(v) = &column.data else { panic!("not reals") };
    v.chunks_exact(3).map(|v| v[2]).fold(0.0, f64::max)
}

/// An extended run ends in the same state, bit for bit, as a run of the same total length.
#[test]
fn an_extension_equals_a_longer_run() {
    let folder = TempDir::new().expect("a folder");
    let short = write(folder.path(), "short.toml", BLOCK);
    let long = write(folder.path(), "long.toml", &BLOCK.replace("steps = 100", "steps = 250"));
    assert_eq!(concordem(["run", "-q", text(&short)]).code, exit::DONE);
    let whole = folder.path().join("whole.h5");
    assert_eq!(concordem(["run", "-q", text(&long), "-o", text(&whole)]).code, exit::DONE);
    let (first, second) = (folder.path().join("short.h5"), folder.path().join("second.h5"));
    let given = concordem(["run", "-q", text(&long), "--from", text(&first), "-o", text(&second)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    // The stop reason is part of the state; both runs ended by `steps`.
    assert_eq!(hash(&second), hash(&whole));
    let result = ResultFile::open(&second).expect("a result");
    assert_eq!(result.samples("step").expect("steps")[0], 100.0);
    assert!(result.snapshot_times().expect("snapshots").len() >= 2, "the first and the last state");
    let provenance: std::collections::BTreeMap<_, _> = result.provenance().expect("provenance").into_iter().collect();
    assert_eq!(provenance["changed_keys"], "stop.steps: 100 -> 250");
    assert_eq!(provenance["continued_state_hash"], hash(&first));
    // A state beyond the end of the scenario cannot be continued.
    let given =
        concordem(["run", "-q", text(&short), "--from", text(&whole), "-o", text(&folder.path().join("no.h5"))]);
    assert!(given.code == exit::USAGE && given.err.contains("is already at step 250"), "{}", given.err);
}

/// A changed strain rate is applied to the ends.
#[test]
fn a_changed_strain_rate_is_applied() {
    let folder = TempDir::new().expect("a folder");
    let first = write(folder.path(), "first.toml", BLOCK);
    assert_eq!(concordem(["run", "-q", text(&first)]).code, exit::DONE);
    let slow = BLOCK.replace("\"1 1/s\"", "\"-0.25 1/s\"").replace("steps = 100", "steps = 101");
    let second = write(folder.path(), "second.toml", &slow);
    let given = concordem(["run", "-q", text(&second), "--from", text(&folder.path().join("first.h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let table = |name: &str| {
        let table =
            ResultFile::open(&folder.path().join(name)).expect("a result").table("particles").expect("particles");
        let column = |wanted: &str| table.iter().find(|(name, _)| name == wanted).expect("a column").1.data.clone();
        let (ColumnData::F64(v), ColumnData::U8(prescribed)) = (column("velocity"), column("prescribed")) else {
            panic!()
        };
        let moved = |(v, p): (&[f64], &u8)| (p & 4 != 0).then_some(v[2]);
        v.chunks_exact(3).zip(&prescribed).filter_map(moved).collect::<Vec<f64>>()
    };
    let (before, after) = (table("first.h5"), table("second.h5"));
    assert!(before.len() > 10 && before.len() == after.len());
    for (before, after) in before.iter().zip(&after) {
        // Both velocities are half of a rate times the same length.
        assert!((after / before + 0.25).abs() < 1e-12, "{before} {after}");
    }
    assert!(fastest(&folder.path().join("first.h5")) > 0.0);
}

/// Changes of keys that define the specimen are refused, each with its position, and nothing is written.
#[test]
fn changes_of_the_specimen_are_refused_with_their_key() {
    let folder = TempDir::new().expect("a folder");
    let first = write(folder.path(), "first.toml", BLOCK);
    assert_eq!(concordem(["run", "-q", text(&first)]).code, exit::DONE);
    let longer = BLOCK.replace("steps = 100", "steps = 200");
    let mut all = String::new();
    for (old, new, key) in [
        ("repeats = [5, 3, 5]", "repeats = [5, 3, 6]", "packing.repeats[2]"),
        ("density = 2500", "density = 2600", "material[0].density"),
        ("interaction_ratio = 1.05", "interaction_ratio = 1.5", "bonds.interaction_ratio"),
        ("[integration]", "[integration]\ntime_step = \"1 us\"", "integration.time_step"),
        ("[integration]", "[integration]\nscheme = \"velocity-verlet\"", "integration.scheme"),
    ] {
        let other = write(folder.path(), "other.toml", &longer.replace(old, new));
        let given = concordem(["run", "-q", text(&other), "--from", text(&folder.path().join("first.h5"))]);
        assert_eq!(given.code, exit::USAGE, "{}", given.err);
        assert!(given.err.contains(key) && given.err.contains("other.toml"), "{key}: {}", given.err);
        assert!(!folder.path().join("other.h5").exists() && !folder.path().join("other.h5.parts").exists());
        all.push_str(&given.err);
    }
    assert!(all.contains("a restart cannot change this key"), "{all}");
    // Parameters of laws may change.
    let softer =
        write(folder.path(), "softer.toml", &longer.replace("normal_stiffness = 1e6", "normal_stiffness = 5e5"));
    let given = concordem(["run", "-q", text(&softer), "--from", text(&folder.path().join("first.h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    // The stored energy has halved without work, so the energy balance starts again. It closes as well as in a run without
    // restart, 3.5e-9: the ends move 1e-9 m in a step, and coordinates of 1e-2 m are rounded to 2e-18 m.
    let result = ResultFile::open(&folder.path().join("softer.h5")).expect("a result");
    let last = |name: &str| *result.samples(name).expect("a column").last().expect("a row");
    let (residual, work) = (last("residual"), last("boundary_work"));
    assert!(residual.abs() < 1e-8 * work.abs(), "{residual} {work}");
    // Stiffer bonds make the time step unstable, because it cannot change.
    let stiffer =
        write(folder.path(), "stiffer.toml", &longer.replace("normal_stiffness = 1e6", "normal_stiffness = 5e7"));
    let given = concordem(["run", "-q", text(&stiffer), "--from", text(&folder.path().join("first.h5"))]);
    assert_eq!(given.code, exit::PHYSICS, "{}", given.err);
}

/// `resume` applies an edited scenario to an unfinished run, and says how to continue a finished one.
#[test]
fn resume_applies_an_edited_scenario() {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", BLOCK);
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let result = folder.path().join("run.h5");
    write(folder.path(), "run.toml", &BLOCK.replace("steps = 100", "steps = 250"));
    let given = concordem(["resume", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::USAGE, "{}", given.err);
    assert!(given.err.contains("stop.steps: 100 -> 250") && given.err.contains("--from"), "{}", given.err);
    // The working folder of an unfinished run with a header but no checkpoint.
    let whole = folder.path().join("whole.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario), "-o", text(&whole)]).code, exit::DONE);
    std::fs::remove_file(&result).expect("the result");
    begun(&scenario, &result, BLOCK);
    let given = concordem(["resume", "-q", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("stop.steps: 100 -> 250"), "{}", given.err);
    assert_eq!(hash(&result), hash(&whole), "250 steps");
    // Samples are columns of the result, so they cannot change within it.
    std::fs::remove_file(&result).expect("the result");
    begun(&scenario, &result, BLOCK);
    let sampled = "[[sample]]\noperator = \"fabric\"\nregion = { kind = \"all\", volume = 1 }\n";
    write(folder.path(), "run.toml", &format!("{BLOCK}{sampled}"));
    let given = concordem(["resume", "-q", text(&scenario)]);
    assert!(given.code == exit::USAGE && given.err.contains("sample"), "{}", given.err);
}

/// Creates the files of a run that was killed before its first checkpoint.
fn begun(scenario: &std::path::Path, result: &std::path::Path, source: &str) {
    let provenance = vec![("scenario_file".to_owned(), scenario.display().to_string())];
    begun_with(result, source, provenance);
}

/// The same, with the entries of its provenance.
fn begun_with(result: &std::path::Path, source: &str, provenance: Vec<(String, String)>) {
    use concordem::output::{RunFiles, RunHeader, SeriesColumn};
    use concordem::sampling::Record;
    let series = Record::COLUMNS.iter().map(|c| SeriesColumn::new(c.name, c.unit, c.description)).collect();
    let header = RunHeader {
        scenario: source.to_owned(),
        provenance,
        series,
        operators: Vec::new(),
        earlier: std::collections::BTreeMap::new(),
    };
    drop(RunFiles::create(result, header, false).expect("the files of a run"));
}

/// A run killed before its first checkpoint starts again from its header, even if the scenario file no longer exists.
#[test]
fn a_run_killed_before_its_first_checkpoint_starts_again() {
    let folder = TempDir::new().expect("a folder");
    let scenario = write(folder.path(), "run.toml", BLOCK);
    let (whole, result) = (folder.path().join("whole.h5"), folder.path().join("run.h5"));
    assert_eq!(concordem(["run", "-q", text(&scenario), "-o", text(&whole)]).code, exit::DONE);
    begun(&scenario, &result, BLOCK);
    std::fs::remove_file(&scenario).expect("the scenario");
    let given = concordem(["resume", "-q", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert_eq!(hash(&result), hash(&whole));
    let (a, b) = (ResultFile::open(&result).expect("a result"), ResultFile::open(&whole).expect("a result"));
    assert_eq!(a.samples("stress").expect("stress"), b.samples("stress").expect("stress"));
}

/// In a second stage of loading, a periodic cell takes the new velocity gradient, and the particles follow the change.
#[test]
fn a_cell_takes_the_new_velocity_gradient() {
    let folder = TempDir::new().expect("a folder");
    let cell = BLOCK.replace("repeats = [5, 3, 5]", "repeats = [5, 3, 5]\nshape = { kind = \"periodic\" }").replace(
        "kind = \"uniaxial\"\nstrain_rate = \"1 1/s\"",
        "kind = \"cell-strain\"\nvelocity_gradient = GRADIENT",
    );
    let stretch = write(folder.path(), "a.toml", &cell.replace("GRADIENT", "[[0, 0, 0], [0, 0, 0], [0, 0, 1]]"));
    let shear = cell.replace("GRADIENT", "[[0, 0, 2], [0, 0, 0], [0, 0, 0]]").replace("steps = 100", "steps = 200");
    let shear = write(folder.path(), "b.toml", &shear);
    assert_eq!(concordem(["run", "-q", text(&stretch)]).code, exit::DONE);
    let given = concordem(["run", "-q", text(&shear), "--from", text(&folder.path().join("a.h5"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let table = |name: &str, column: &str| {
        let table = ResultFile::open(&folder.path().join(name)).expect("a result").table("cell").expect("the cell");
        let ColumnData::F64(m) = &table.iter().find(|(name, _)| name == column).expect("a column").1.data else {
            panic!()
        };
        m.clone()
    };
    assert_eq!(table("b.h5", "velocity_gradient"), [0.0, 0.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    let (before, after) = (table("a.h5", "deformation_gradient"), table("b.h5", "deformation_gradient"));
    // The stretch stays as it was at the end of the first stage.
    assert_eq!(before[8], after[8]);
    assert!(before[8] > 1.0 && before[2] == 0.0 && after[2] > 0.0, "{before:?} {after:?}");
    let result = ResultFile::open(&folder.path().join("b.h5")).expect("a result");
    let residual = result.samples("residual").expect("residual");
    let work = result.samples("boundary_work").expect("work");
    let size = work.iter().fold(0.0_f64, |size, w| size.max(w.abs()));
    // The residual of the ledger is of third order in the step; 1e-6 of the work is far above that.
    assert!(residual.iter().all(|r| r.abs() < 1e-6 * size), "{residual:?} of {size}");
}

/// A file that the scenario names and that is not in the state: the motion of slaves. Changed, it would give half of one run and half of
/// another.
#[test]
fn resume_refuses_changed_files() {
    let folder = TempDir::new().expect("a folder");
    let source = r#"
version = 1
[packing]
kind = "spheres"
spheres = [[0, 0, 0, "1 mm"], ["2 mm", 0, 0, "1 mm"]]
[[material]]
name = "m"
density = 2500
linear_bond = { normal_stiffness = 1e5, shear_stiffness = 1e4 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.01
[contacts]
law = "none"
[[set]]
name = "end"
selection = { kind = "ids", ids = [0] }
[[prescribe]]
set = "end"
velocity = [0, 0, 0]
angular_velocity = [0, 0, 0]
[[slave]]
set = "end"
path = "motion.npy"
[integration]
time_step = 1e-6
[stop]
steps = 20
"#;
    let motion = |speed: f64| {
        let mut head = "{'descr': '<f8', 'fortran_order': False, 'shape': (21, 1, 6), }".to_owned();
        head += &" ".repeat(117 - head.len());
        head.push('\n');
        let mut bytes = b"\x93NUMPY\x01\x00v\x00".to_vec();
        bytes.extend(head.bytes());
        (0..21 * 6).for_each(|k| bytes.extend((if k % 6 == 0 { speed } else { 0.0 }).to_le_bytes()));
        std::fs::write(folder.path().join("motion.npy"), bytes).expect("a file");
    };
    motion(0.1);
    let scenario = write(folder.path(), "run.toml", source);
    let result = folder.path().join("run.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let (whole, header) = (hash(&result), ResultFile::open(&result).expect("a result").provenance().expect("entries"));
    assert!(header.iter().any(|(name, _)| name == "input_slave[0].path"), "{header:?}");
    std::fs::remove_file(&result).expect("the result");
    begun_with(&result, source, header);
    motion(0.2);
    let given = concordem(["resume", "-q", text(&result)]);
    assert_eq!(given.code, exit::USAGE, "{}", given.err);
    for words in ["motion.npy", "slave[0].path", "has changed since the start", "--force"] {
        assert!(given.err.contains(words), "{words}: {}", given.err);
    }
    motion(0.1);
    let given = concordem(["resume", "-q", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert_eq!(hash(&result), whole);
}

/// Figures of a test that goes through several results are those of one run: of a specimen that softens, extended before and after its peak.
#[test]
fn figures_of_an_extended_run_cover_the_whole_test() {
    let folder = TempDir::new().expect("a folder");
    let source = BLOCK
        .replace("shear_stiffness = 2e5 }", "shear_stiffness = 2e5, normal_strength = 0.2, shear_strength = 1 }")
        .replace("\"1 1/s\"", "\"0.4 1/s\"")
        .replace("sample_interval = 10", "sample_interval = 1");
    let run = |name: &str, steps: usize, from: Option<&str>| {
        let text_of = source.replace("steps = 100", &format!("steps = {steps}"));
        let scenario = write(folder.path(), &format!("{name}.toml"), &text_of);
        let mut arguments = vec!["run".to_owned(), text(&scenario).to_owned()];
        arguments.extend(
            from.into_iter().flat_map(|from| ["--from".to_owned(), folder.path().join(from).display().to_string()]),
        );
        let given = concordem(arguments);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        given.err
    };
    let figures = |name: &str| {
        let result = ResultFile::open(&folder.path().join(name)).expect("a result");
        let found = concordem::report::summary(&result).expect("a summary");
        let page = concordem::report::page(&[result], &concordem::report::ReferenceFigures::default()).expect("a page");
        let found: Vec<_> = found.into_iter().map(|property| (property.symbol, property.value)).collect();
        (found, page)
    };
    run("whole", 2000, None);
    let (whole, _) = figures("whole.h5");
    let symbols: Vec<&str> = whole.iter().map(|(symbol, _)| &symbol[..]).collect();
    assert_eq!(symbols, ["E", "E", "f_t", "G_F"], "{whole:?}");
    let peak = {
        let stress = ResultFile::open(&folder.path().join("whole.h5"))
            .and_then(|result| result.samples("stress"))
            .expect("stress");
        (0..stress.len()).max_by(|&a, &b| stress[a].total_cmp(&stress[b])).expect("a peak")
    };
    assert!((60..1900).contains(&peak), "{peak}");
    for cut in [peak - 40, peak + 40] {
        run("first", cut, None);
        run("second", cut + 20, Some("first.h5"));
        run("third", 2000, Some("second.h5"));
        let (found, page) = figures("third.h5");
        assert_eq!(found, whole, "cut at step {cut}");
        assert!(!page.contains("Records of"));
        for name in ["first.h5", "second.h5", "third.h5"] {
            std::fs::remove_file(folder.path().join(name)).expect("a result");
        }
    }
    // A checkpoint has no records; a result that begins with one says so, and gives no strength.
    run("first", peak + 40, None);
    let state = concordem::output::checkpoint::read(&folder.path().join("first.h5")).expect("a state");
    let bare = folder.path().join("bare.h5");
    concordem::output::checkpoint::write(&bare, &state.columns, &state.provenance).expect("a checkpoint");
    let said = run("fourth", 2000, Some("bare.h5"));
    assert!(said.contains("from the restart on, since a checkpoint has none"), "{said}");
    let (found, page) = figures("fourth.h5");
    assert!(found.len() == 1 && found[0].0 == "records", "{found:?}");
    assert!(page.contains("Records of fourth.h5: from the restart on") && !page.contains("ε(f<sub>t</sub>)"));
}
