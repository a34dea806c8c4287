//! The program does what its help says: commands, exit codes, interruption, resumption, bitwise reproducible results.

use std::collections::{BTreeMap, BTreeSet};
use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use concordem::output::ResultFile;
use concordem::program::{Console, exit, run};
use concordem::scenario::TEMPLATES;
use tempfile::TempDir;

/// Output of a command: exit code, standard output, standard error.
struct Given {
    code: u8,
    out: String,
    err: String,
}

/// Runs a command within this process.
fn concordem<S: Into<OsString>>(arguments: impl IntoIterator<Item = S>) -> Given {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let arguments = std::iter::once(OsString::from("concordem")).chain(arguments.into_iter().map(Into::into));
    let mut console = Console { out: &mut out, err: &mut err, interactive: false, out_interactive: false };
    let code = run(arguments, &mut console);
    let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
    Given { code, out: text(out), err: text(err) }
}

/// Environment variable with which a test tells a child process what to run.
const CHILD: &str = "CONCORDEM_TEST_ARGUMENTS";

/// Not a test: the child process of the tests below.
#[test]
#[ignore = "run by other tests in a separate process, so that it can be killed"]
fn child() {
    let Ok(arguments) = std::env::var(CHILD) else { return };
    let given = concordem(arguments.split('\n'));
    eprint!("{}", given.err);
    std::process::exit(i32::from(given.code));
}

/// Starts a command in a separate process.
fn spawn(arguments: &[&str]) -> std::process::Child {
    Command::new(std::env::current_exe().expect("this test has a file"))
        .args(["--exact", "child", "--ignored", "--nocapture"])
        .env(CHILD, arguments.join("\n"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("the test can start itself")
}

/// A prism of concrete on a lattice, pulled until its bonds soften; small enough to run a hundred times.
const PRISM: &str = r#"
version = 1
title = "Prism"
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
shape = { kind = "box", size = ["9 mm", "9 mm", "16 mm"] }
[[material]]
name = "concrete"
density = 4800
cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 5, cohesion = "3 MPa", friction_coefficient = 0.8, omega_threshold = 0.9 }
[[material]]
name = "weak"
density = 4800
cpm = { young = "20 GPa", shear_ratio = 0.2, crack_onset_strain = 8e-5, relative_ductility = 5, cohesion = "2 MPa", friction_coefficient = 0.8, omega_threshold = 0.9 }
[[set]]
name = "flaw"
material = "weak"
selection = { kind = "box", minimum = [0, "-5 mm", "-2 mm"], maximum = ["5 mm", "5 mm", "2 mm"] }
[bonds]
law = "cpm"
interaction_ratio = 1.5
[contacts]
law = "cpm"
[integration]
damping = { kind = "local", coefficient = 0.3 }
[loading]
kind = "uniaxial"
strain_rate = "20 1/s"
[stop]
steps = STEPS
[output]
sample_interval = 7
snapshot_interval = 100
checkpoint_interval = 50
events_damage = 0.5
[[sample]]
operator = "region-stress"
region = { kind = "box", minimum = ["-3 mm", "-3 mm", "-3 mm"], maximum = ["3 mm", "3 mm", "3 mm"] }
interval = 30
[[sample]]
operator = "affine-strain"
region = { kind = "sphere", center = [0, 0, 0], radius = "5 mm" }
interval = 45
"#;

fn write(folder: &Path, name: &str, text: &str) -> PathBuf {
    let path = folder.join(name);
    std::fs::write(&path, text).expect("a temporary folder can be written to");
    path
}

fn prism(folder: &Path, steps: u32) -> PathBuf {
    write(folder, "prism.toml", &PRISM.replace("STEPS", &steps.to_string()))
}

fn text(path: &Path) -> &str {
    path.to_str().expect("temporary folders have plain names")
}

/// Contents of a result without attributes (which say when and how it was made): type, shape, and bits of every dataset, by
/// path.
type Contents = BTreeMap<String, (String, Vec<usize>, Vec<u64>)>;

fn contents(path: &Path) -> Contents {
    // Opening a result verifies its seal.
    let hash = ResultFile::open(path).and_then(|result| result.state_hash()).expect("a complete result");
    let mut all = BTreeMap::from([("state_hash".to_owned(), (hash, Vec::new(), Vec::new()))]);
    collect(&hdf5::File::open(path).expect("an HDF5 file"), "", &mut all);
    for name in
        ["samples/stress", "events/step", "particles/velocity", "contacts/cpm/force", "samples/region-stress/stress"]
    {
        assert!(all.contains_key(name), "{name} is not among {:?}", all.keys());
    }
    // The particles must move: if all snapshots were equal, the comparison would say little.
    let (_, shape, _) = &all["VTKHDF/Points"];
    let (_, _, times) = &all["VTKHDF/Steps/Values"];
    assert!(times.len() > 2 && shape[0] == times.len() * all["particles/id"].2.len(), "{shape:?} at {times:?}");
    all
}

fn collect(group: &hdf5::Group, prefix: &str, all: &mut Contents) {
    use hdf5::types::{FloatSize, TypeDescriptor, VarLenUnicode};
    for name in group.member_names().expect("a readable group") {
        let path = format!("{prefix}{name}");
        if let Ok(inner) = group.group(&name) {
            collect(&inner, &format!("{path}/"), all);
            continue;
        }
        let data = group.dataset(&name).expect("a group or a dataset");
        let kind = data.dtype().and_then(|kind| kind.to_descriptor()).expect("a type");
        let bits = match &kind {
            // The library fails to read an empty dataset.
            _ if data.size() == 0 => Vec::new(),
            TypeDescriptor::Float(FloatSize::U8) => {
                data.read_raw::<f64>().expect("reals").into_iter().map(f64::to_bits).collect()
            }
            TypeDescriptor::Unsigned(_) => data.read_raw::<u64>().expect("numbers"),
            TypeDescriptor::Integer(_) => {
                data.read_raw::<i64>().expect("numbers").into_iter().map(i64::cast_unsigned).collect()
            }
            TypeDescriptor::VarLenUnicode => {
                let text: VarLenUnicode = data.read_scalar().expect("a text");
                text.bytes().map(u64::from).collect()
            }
            other => panic!("{path} holds {other}, which is not compared yet"),
        };
        all.insert(path, (kind.to_string(), data.shape(), bits));
    }
}

/// Fails with the names of the datasets that differ.
fn same(found: &Contents, expected: &Contents, what: &str) {
    let names: BTreeSet<&String> = found.keys().chain(expected.keys()).collect();
    let differ: Vec<_> = names.into_iter().filter(|&name| found.get(name) != expected.get(name)).collect();
    assert!(differ.is_empty(), "{what}: {differ:?} differ");
}

/// The comparison of results detects a single changed bit of a snapshot.
#[test]
fn a_bit_of_a_snapshot_is_a_difference() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 300);
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let all = contents(&result);
    for name in ["VTKHDF/Points", "VTKHDF/PointData/velocity"] {
        let mut other = all.clone();
        let (_, _, bits) = other.get_mut(name).expect("a dataset of the snapshots");
        let middle = bits.len() / 2;
        bits[middle] ^= 1;
        let found = std::panic::catch_unwind(|| same(&other, &all, "one bit"));
        assert!(found.is_err(), "a changed bit of {name} is not detected");
    }
    same(&all, &all, "nothing");
}

/// Broken bonds, which the solver removes from its lists, stay in the tables and count in the damage of particles and in the
/// damage tensor.
#[test]
fn broken_bonds_stay_in_the_tables() {
    use concordem::state::columns::ColumnData;
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

#[test]
fn the_help_lists_commands_examples_and_exit_codes() {
    let given = concordem(["--help"]);
    assert_eq!(given.code, exit::DONE);
    for word in [
        "init",
        "check",
        "run",
        "resume",
        "info",
        "measure",
        "report",
        "pack",
        "schema",
        "Examples:",
        "Exit codes:",
        "130",
    ] {
        assert!(given.out.contains(word), "the help does not mention {word}:\n{}", given.out);
    }
    let listed = concordem(["init"]).out;
    assert!(TEMPLATES.iter().all(|template| listed.contains(template.name)), "{listed}");
}

#[test]
fn the_schema_is_json_with_descriptions() {
    let given = concordem(["schema"]);
    assert_eq!(given.code, exit::DONE);
    for word in ["\"$schema\"", "additionalProperties", "Normal modulus of a bond, Pa", "x-units"] {
        assert!(given.out.contains(word), "{word} is missing");
    }
}

#[test]
fn templates_are_valid_and_do_not_overwrite_existing_files() {
    let folder = TempDir::new().expect("a temporary folder");
    for template in TEMPLATES {
        let path = folder.path().join(template.name).with_extension("toml");
        let given = concordem(["init", "--template", template.name, text(folder.path())]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        assert_eq!(std::fs::read_to_string(&path).expect("the template"), template.text);
        let given = concordem(["check", "--no-build", text(&path)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    let path = write(folder.path(), "mine.toml", "precious");
    let given = concordem(["init", "--template", "cpm-small", text(&path)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("--force"), "{}", given.err);
    assert_eq!(std::fs::read_to_string(&path).expect("the file"), "precious");
    assert_eq!(concordem(["init", "--template", "cpm-small", "--force", text(&path)]).code, exit::DONE);
}

#[test]
fn wrong_arguments_and_bad_files_give_the_documented_exit_codes() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 10);
    assert_eq!(concordem(["walk"]).code, exit::USAGE);
    assert_eq!(concordem(["init", "--template", "no-such"]).code, exit::USAGE);
    let missing = folder.path().join("missing");
    for command in ["check", "run", "info", "report", "resume"] {
        let given = concordem([command, text(&missing)]);
        assert_eq!(given.code, exit::FILE, "{command}: {}", given.err);
        assert!(given.err.contains("missing"), "{command} does not name the file: {}", given.err);
    }
    let binary = folder.path().join("binary.toml");
    std::fs::write(&binary, [b'a', b'\n', 0xff, 0xfe]).expect("a file");
    let given = concordem(["check", text(&binary)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("line 2"), "{}", given.err);
    // A file of another program, and a path that cannot be written to, because its parent is a file.
    let given = concordem(["info", text(&scenario)]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    let given = concordem(["run", text(&scenario), "-o", text(&scenario.join("result.h5"))]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    // An existing result is kept.
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("--force"), "{}", given.err);
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    // A result that is cut off is refused.
    let bytes = std::fs::read(&result).expect("the result");
    for part in [1, 2, 3] {
        std::fs::write(&result, &bytes[..bytes.len() * part / 4]).expect("a file");
        for command in ["info", "report"] {
            let given = concordem([command, text(&result)]);
            assert_eq!(given.code, exit::FILE, "{}", given.err);
        }
    }
}

#[test]
fn bad_scenarios_are_shown_with_their_text() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "prism.toml",
        &PRISM.replace("STEPS", "10").replace("radius = \"1 mm\"", "radius = \"1 GPa\"").replace("bonds", "bond"),
    );
    for command in ["check", "run", "pack"] {
        let given = concordem([command, text(&scenario)]);
        assert_eq!(given.code, exit::USAGE);
        let shown = given.err.replace(text(folder.path()), "FOLDER");
        insta::assert_snapshot!("two_problems", shown);
    }
}

#[test]
fn unstable_steps_are_refused_with_both_numbers_unless_allowed() {
    let folder = TempDir::new().expect("a temporary folder");
    let unstable = PRISM.replace("STEPS", "5").replace("[integration]", "[integration]\ntime_step = \"1 ms\"");
    let scenario = write(folder.path(), "unstable.toml", &unstable);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::PHYSICS);
    for word in ["1.00000e-3 s", "stability bound of", "allow_unstable", "time_step = \"1 ms\""] {
        assert!(given.err.contains(word), "{word} is missing: {}", given.err);
    }
    assert!(!folder.path().join("unstable.h5.parts").exists(), "a refused run leaves no files");
    let allowed = unstable.replace("[integration]", "[integration]\nallow_unstable = true");
    // Unbreakable bonds, so that the energy grows without limit.
    let allowed =
        allowed.replace("omega_threshold = 0.9", "never_damage = true").replace("steps = 5", "steps = 100000");
    let scenario = write(folder.path(), "allowed.toml", &allowed);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::PHYSICS, "an unstable run ends with this exit code: {}", given.err);
    assert!(given.err.contains("no longer finite"), "{}", given.err);
    assert!(!folder.path().join("allowed.h5").exists(), "a failed run leaves no complete result");
}

#[test]
fn check_pack_run_info_and_report_work_together() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 300);
    let given = concordem(["check", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    for word in ["particles", "bonds", "memory", "time step", "estimated time"] {
        assert!(given.out.contains(word), "{word} is missing: {}", given.out);
    }
    let given = concordem(["pack", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let packed = std::fs::read_to_string(folder.path().join("prism.spheres.txt")).expect("the packing");
    let spheres = packed.lines().filter(|line| !line.starts_with('#')).count();
    assert!(spheres > 100, "{spheres} spheres");
    let result = folder.path().join("prism.h5");
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("the given number of steps was reached"), "{}", given.err);
    let file = ResultFile::open(&result).expect("the result");
    assert_eq!(file.table("particles").expect("particles")[0].1.borrow().len() % spheres, 0);
    // One record every 7 steps, and one for the final state.
    assert_eq!(file.samples("step").expect("steps").len(), 300_usize.div_ceil(7) + 1);
    assert_eq!(file.snapshot_times().expect("snapshots").len(), 4);
    let given = concordem(["info", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let hash = concordem(["info", "--hash", text(&result)]).out;
    assert!(hash.len() == 65 && given.out.contains(hash.trim()), "{hash}");
    assert_eq!(concordem(["info", "--scenario", text(&result)]).out, std::fs::read_to_string(&scenario).expect("it"));
    let given = concordem(["report", text(&result)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let page = std::fs::read_to_string(folder.path().join("prism.html")).expect("the page");
    assert!(page.contains("Prism") && page.contains("</html>"));
    assert_eq!(concordem(["report", text(&result)]).code, exit::FILE, "the page already exists");
    assert_eq!(concordem(["report", "--force", text(&result)]).code, exit::DONE);
    let given = concordem(["resume", text(&result)]);
    assert_eq!(given.code, exit::DONE);
    assert!(given.err.contains("is finished"), "{}", given.err);
}

#[test]
fn results_do_not_depend_on_the_number_of_threads() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 400);
    let run = |threads: &str| {
        let result = folder.path().join(format!("{threads}.h5"));
        let given = concordem(["run", "-q", "-j", threads, "-o", text(&result), text(&scenario)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        contents(&result)
    };
    let one = run("1");
    assert!(one["samples/stress"].2.iter().all(|bits| f64::from_bits(*bits).is_finite()), "the run is sound");
    for threads in ["2", "3", "8"] {
        same(&run(threads), &one, &format!("{threads} threads"));
    }
}

/// Waits for a process, with a time limit.
fn wait(mut process: std::process::Child) -> ExitStatus {
    let start = Instant::now();
    loop {
        if let Some(status) = process.try_wait().expect("a child process") {
            return status;
        }
        if start.elapsed() > Duration::from_secs(300) {
            let _ = process.kill();
            panic!("the program does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

#[test]
#[cfg(unix)]
fn sigterm_writes_a_checkpoint_from_which_resume_continues() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 1500);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    assert_eq!(concordem(["run", "-q", "-o", text(&whole), text(&scenario)]).code, exit::DONE);
    let process = spawn(&["run", "-o", text(&broken), text(&scenario)]);
    // Wait for the first checkpoint: by then the signal handlers are installed.
    let parts = broken.with_extension("h5.parts");
    let start = Instant::now();
    while !parts.join("checkpoint-0001.h5").exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "no checkpoint appears");
        std::thread::sleep(Duration::from_millis(2));
    }
    let killed = Command::new("kill").args(["-TERM", &process.id().to_string()]).status().expect("kill");
    assert!(killed.success());
    assert_eq!(wait(process).code(), Some(i32::from(exit::INTERRUPTED)));
    assert!(!broken.exists());
    let given = concordem(["info", text(&broken)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("concordem resume"), "{}", given.err);
    let given = concordem(["resume", "-j", "3", text(&broken)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    same(&contents(&broken), &contents(&whole), "the resumed run");
}

#[test]
#[cfg(unix)]
fn killed_runs_give_the_result_of_an_uninterrupted_run() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 600);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let start = Instant::now();
    let given = concordem(["run", "-q", "-o", text(&whole), text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let duration = start.elapsed();
    let expected = contents(&whole);
    // Kill after growing delays until a process reaches the end, to hit all phases of a run, including the last ones.
    let mut delay = duration / 40;
    let mut kills = 0;
    let mut command = "run";
    loop {
        let target = if command == "run" { text(&scenario) } else { text(&broken) };
        let arguments = if command == "run" { vec!["run", "-o", text(&broken), target] } else { vec![command, target] };
        let mut process = spawn(&arguments);
        std::thread::sleep(delay);
        let ended = process.try_wait().expect("a child process");
        if let Some(status) = ended {
            assert_eq!(status.code(), Some(0), "{command} fails after {kills} kills");
            if broken.exists() {
                break;
            }
        }
        process.kill().expect("a child process can be killed");
        process.wait().expect("a child process");
        kills += 1;
        assert!(kills < 400, "the run makes no progress");
        // A run that was killed before its first checkpoint must be started again.
        let begun = broken.with_extension("h5.parts").join("checkpoint-0000.h5").exists();
        command = if begun || broken.exists() { "resume" } else { "run" };
        if !begun {
            let _ = std::fs::remove_dir_all(broken.with_extension("h5.parts"));
        }
        delay += duration / 40;
    }
    assert!(kills >= 3, "only {kills} kills");
    same(&contents(&broken), &expected, &format!("after {kills} kills"));
    assert!(!broken.with_extension("h5.parts").exists(), "the working folder is removed");
}

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
    let concordem::state::columns::ColumnData::F64(sampled) = &column("stress").data else { panic!("not reals") };
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
    let concordem::state::columns::ColumnData::U32(ids) = &id.data else { panic!("no ids") };
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

/// `calibrate elastic` inverts `elastic`: from the constants of a cell with Ē = 25 GPa, Ḡ/Ē = 0.2 it recovers these
/// parameters. Poisson's ratio is found to 1e-9 and its slope over the stiffness ratio is 0.3, so the ratio is found to
/// 1e-8.
#[test]
fn calibrate_elastic_recovers_the_parameters_of_elastic_constants() {
    let folder = TempDir::new().expect("a temporary folder");
    let template = TEMPLATES.iter().find(|t| t.name == "cpm-periodic").expect("the template");
    let scenario = write(folder.path(), "cell.toml", &template.text.replace("count = 1000", "count = 120"));
    let shown = concordem(["elastic", text(&scenario)]);
    assert_eq!(shown.code, exit::DONE, "{}", shown.err);
    for row in ["closed form", "affine sum", "static network", "relaxed dynamics", "Sensitivities"] {
        assert!(shown.out.contains(row), "{row}:\n{}", shown.out);
    }
    let given = concordem(["elastic", "--json", text(&scenario)]);
    let found: serde_json::Value = serde_json::from_str(&given.out).expect("JSON");
    let (young, poisson) = (&found["static"]["young_pa"], &found["static"]["poisson"]);
    let gap = found["relaxed_dynamics"]["young_pa"].as_f64().expect("E") / young.as_f64().expect("E") - 1.0;
    assert!(gap.abs() < 2e-6, "statics and dynamics differ by {gap:e}");
    // Start from other stiffnesses, and recover the first ones.
    let other = template.text.replace("count = 1000", "count = 120").replace("\"25 GPa\"", "\"7 GPa\"");
    let other = write(folder.path(), "other.toml", &other.replace("shear_ratio = 0.2", "shear_ratio = 0.9"));
    let wanted = folder.path().join("wanted.toml");
    let (young, poisson) = (young.to_string(), poisson.to_string());
    let arguments =
        ["calibrate", "elastic", text(&other), "--young", &young, "--poisson", &poisson, "-o", text(&wanted)];
    let calibrated = concordem(arguments);
    assert_eq!(calibrated.code, exit::DONE, "{}", calibrated.err);
    let written = std::fs::read_to_string(&wanted).expect("the scenario");
    let value = |key: &str| -> f64 {
        let line = written.lines().find(|line| line.starts_with(key)).expect("the key");
        line.split('=').nth(1).and_then(|value| value.trim().parse().ok()).expect("a number")
    };
    assert!((value("young") / 25e9 - 1.0).abs() < 1e-7 && (value("shear_ratio") / 0.2 - 1.0).abs() < 1e-7, "{written}");
    assert_eq!(concordem(arguments).code, exit::FILE, "it does not overwrite");
    let far = concordem(["calibrate", "elastic", text(&other), "--young", "30 GPa", "--poisson", "0.45"]);
    assert!(far.code == exit::PHYSICS && far.err.contains("out of reach"), "{}", far.err);
}

/// For each law and deformable particles: the constants E and ν of planted parameters are given as targets with the scenario
/// of another law, on the same bonds, and the calibration recovers the parameters. Poisson's ratio is found to 1e-9 and its
/// slope over the stiffnesses is at least 0.1; the tolerance is 1e-6 (required: 1e-3). The written scenario has the target
/// constants.
#[test]
fn parameters_of_each_law_are_found_from_a_scenario_of_another() {
    let folder = TempDir::new().expect("a temporary folder");
    let plain = write(folder.path(), "plain.toml", CELL);
    let of = |law: &str, table: &str| {
        let text = CELL.replace("linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }", table);
        text.replace("law = \"linear_bond\"", &format!("law = \"{law}\""))
    };
    let constants = |path: &Path| -> [f64; 2] {
        let given = concordem(["elastic", "--json", "--no-dynamics", text(path)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let found: serde_json::Value = serde_json::from_str(&given.out).expect("JSON");
        ["young_pa", "poisson"].map(|key| found["static"][key].as_f64().expect("a number"))
    };
    let cpm = "cpm = { young = 20e9, shear_ratio = 0.3, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, \
               friction_coefficient = 0.8 }";
    let beam = "cohesive_beam = { young = 300e9, poisson = 0.3, radius_ratio = 0.6 }";
    let bond = "linear_bond = { normal_stiffness = 3e7, shear_stiffness = 9e6 }";
    // k_n/(R E_p) = 3e7/(1e-3·1.2e11) = 0.25.
    let deformable = "linear_bond = { normal_stiffness = 3e7, shear_stiffness = 9e6 }\ndeformable = { young = 1.2e11, poisson = 0.4 }";
    let other = write(folder.path(), "other.toml", &of("cpm", cpm));
    let cases = [
        ("cpm", cpm, &plain, &[][..], &["young", "shear_ratio"][..]),
        ("cohesive_beam", beam, &plain, &[], &["young", "radius_ratio"]),
        ("linear_bond", bond, &other, &[], &["normal_stiffness", "shear_stiffness"]),
        (
            "linear_bond",
            deformable,
            &other,
            &["--deformable", "--particle-poisson", "0.4", "--particle-softness", "0.25"],
            &["normal_stiffness", "shear_stiffness", "young"],
        ),
    ];
    for (number, (law, table, start, options, keys)) in cases.into_iter().enumerate() {
        let planted = of(law, table);
        let wanted = constants(&write(folder.path(), "planted.toml", &planted));
        let output = folder.path().join(format!("found-{number}.toml"));
        let [young, poisson] = wanted.map(|value| value.to_string());
        let arguments = ["calibrate", "elastic", text(start), "--law", law, "--young", &young, "--poisson", &poisson];
        let given = concordem(arguments.iter().chain(options).chain(&["-o", text(&output)]));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let written = std::fs::read_to_string(&output).expect("the scenario");
        for key in keys {
            let after = |text: &str| -> f64 {
                let mut places =
                    text.split(|c: char| c.is_whitespace() || "{},".contains(c)).filter(|word| !word.is_empty());
                places.find(|word| word == key).expect("the key");
                places.nth(1).and_then(|word| word.parse().ok()).expect("a number")
            };
            // The first key of this name is the right one in both texts, for beams and for deformable particles.
            let error = after(&written) / after(&planted) - 1.0;
            println!("{law} {key}: {error:+.1e}");
            assert!(error.abs() < 1e-6, "{law} {key}: {error:e}\n{written}");
        }
        assert!(!written.contains(if law == "linear_bond" { "cpm" } else { "linear_bond" }), "{written}");
        let again = constants(&output);
        assert!(
            (again[0] / wanted[0] - 1.0).abs() < 1e-7 && (again[1] - wanted[1]).abs() < 1e-7,
            "{again:?} {wanted:?}"
        );
        assert_eq!(concordem(["check", text(&output)]).code, exit::DONE, "{written}");
    }
    // Without bonds in the scenario, or without a scenario, bonds are made.
    let bare = CELL.replace("[bonds]\nlaw = \"linear_bond\"\ncoordination = 8\n", "");
    let bare = write(folder.path(), "bare.toml", &bare);
    let output = folder.path().join("made.toml");
    for start in [&[text(&bare)][..], &[]] {
        let asked = ["--young", "30 GPa", "--poisson", "0.2", "--law", "cpm", "--force", "-o", text(&output)];
        let given = concordem(["calibrate", "elastic"].iter().chain(start).chain(&asked));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let [young, poisson] = constants(&output);
        assert!((young / 30e9 - 1.0).abs() < 1e-7 && (poisson - 0.2).abs() < 1e-7, "{young:e} {poisson}");
    }
}

/// Requests that do not fit the law are refused with a remedy.
#[test]
fn laws_that_do_not_fit_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let bond = "linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }";
    let plain = write(folder.path(), "plain.toml", CELL);
    let soft = CELL.replace(bond, &format!("{bond}\ndeformable = {{ young = 5e10, poisson = 0.3 }}"));
    let soft = write(folder.path(), "soft.toml", &soft);
    let bare = CELL.replace("[bonds]\nlaw = \"linear_bond\"\ncoordination = 8\n", "");
    let bare = write(folder.path(), "bare.toml", &bare);
    let sheared = "cohesive_beam = { young = 1e9, radius_ratio = 0.5, model = \"timoshenko\" }";
    let sheared = write(folder.path(), "sheared.toml", &CELL.replace(bond, &format!("{bond}\n{sheared}")));
    let mut all = String::new();
    let cases: [(&[&str], u8); 8] = [
        (&[], exit::USAGE),
        (&[text(&bare)], exit::USAGE),
        (&[text(&plain), "--law", "cpm", "--deformable"], exit::USAGE),
        (&[text(&soft), "--law", "cpm"], exit::USAGE),
        (&[text(&sheared), "--law", "cohesive_beam"], exit::USAGE),
        (&[text(&plain), "--deformable", "--particle-poisson", "0.7"], exit::USAGE),
        (&[text(&plain), "--deformable", "--particle-softness", "9"], exit::PHYSICS),
        (&[text(&plain), "--law", "cohesive_beam", "--poisson", "-0.3"], exit::PHYSICS),
    ];
    for (case, code) in cases {
        let poisson: &[&str] = if case.contains(&"--poisson") { &[] } else { &["--poisson", "0.2"] };
        let given = concordem(["calibrate", "elastic", "--young", "30 GPa"].iter().chain(poisson).chain(case));
        let shown = case.join(" ").replace(text(folder.path()), "FOLDER");
        writeln!(all, "$ {shown}\n{}", given.err.replace(text(folder.path()), "FOLDER")).expect("text");
        assert_eq!(given.code, code, "{all}");
    }
    insta::assert_snapshot!("elastic_laws_that_do_not_fit", all);
}

const CELL: &str = r#"
version = 1
[packing]
kind = "random-dense"
count = 60
radius = "1 mm"
seed = 1
[packing.shape]
kind = "periodic"
[[material]]
name = "m"
density = 2000
linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }
[bonds]
law = "linear_bond"
coordination = 8
[contacts]
law = "none"
[stop]
steps = 1
"#;

const SWEEP: &str = r#"
version = 1
title = "Bonds < of spheres"
scenario = "cell.toml"
[[axis]]
name = "k_t"
key = "material[0].linear_bond.shear_stiffness"
logarithmic = { from = 1e4, to = 1e9, count = 16 }
[[axis]]
key = "bonds.coordination"
values = [5.5, 12, 60]
[[axis]]
key = "packing.seed"
values = [1, 2, 3, 4]
average = true
"#;

/// A sweep killed after growing delays and continued with other numbers of threads gives a file with the same bytes.
#[test]
#[cfg(unix)]
fn killed_sweeps_give_the_file_of_an_uninterrupted_sweep() {
    let folder = TempDir::new().expect("a temporary folder");
    write(folder.path(), "cell.toml", CELL);
    let sweep = write(folder.path(), "sweep.toml", SWEEP);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let start = Instant::now();
    let given = concordem(["sweep", "--csv", "-o", text(&whole), text(&sweep)]);
    let duration = start.elapsed();
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("192 points; 4 packings"), "{}", given.err);
    // Sixty bonds per particle are impossible; the other points have values.
    assert!(given.err.contains("64 of 192 points failed"), "{}", given.err);
    let table = std::fs::read_to_string(folder.path().join("whole.csv")).expect("the table");
    assert_eq!(table.lines().count(), 193);
    let heads: Vec<&str> = table.lines().next().expect("heads").split(',').collect();
    let column = |name: &str| heads.iter().position(|head| head.trim_matches('"') == name).expect(name);
    let (young, affine, bonds) = (column("young"), column("affine_young"), column("bonds.coordination"));
    for line in table.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[bonds] == "60.0" {
            assert!(cells[young].is_empty() && line.contains("no interaction ratio"), "{line}");
        } else {
            let [young, affine] = [young, affine].map(|k| cells[k].parse::<f64>().expect("a modulus"));
            assert!(young > 0.0 && young < affine, "{line}");
        }
    }
    let page = std::fs::read_to_string(folder.path().join("whole.html")).expect("the page");
    for words in ["Bonds &lt; of spheres", "Over k_t", "Error of the closed form", "64 points failed"] {
        assert!(page.contains(words), "{words}");
    }
    let expected = std::fs::read(&whole).expect("the result");
    let (mut kills, mut delay) = (0, duration / 4);
    let points = folder.path().join("broken.h5.points");
    let mut finished = String::new();
    loop {
        let mut process = spawn(&["sweep", "-q", "-j", ["1", "2", "3"][kills % 3], "-o", text(&broken), text(&sweep)]);
        std::thread::sleep(delay);
        if let Some(status) = process.try_wait().expect("a child process") {
            assert_eq!(status.code(), Some(0), "after {kills} kills");
            break;
        }
        process.kill().expect("a child process can be killed");
        process.wait().expect("a child process");
        if let Ok(text) = std::fs::read_to_string(&points) {
            finished = text;
        }
        kills += 1;
        assert!(kills < 100, "the sweep makes no progress");
        delay += duration / 8;
    }
    assert!(kills >= 1, "no kill");
    assert!(std::fs::read(&broken).expect("the result") == expected, "after {kills} kills the file differs");
    assert!(!points.exists(), "the finished points are in the result");
    // If killed after the result was written and before the journal was removed, the same command completes the sweep.
    let fingerprint = finished.lines().next().expect("points of a killed sweep").to_owned() + "\n";
    std::fs::write(&points, fingerprint).expect("a file");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(std::fs::read(&broken).expect("the result") == expected && !points.exists());
    // A finished sweep is kept, and points of another sweep are refused.
    assert_eq!(concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]).code, exit::FILE);
    std::fs::write(&points, "concordem sweep 1 other\n").expect("a file");
    std::fs::remove_file(&broken).expect("the result");
    std::fs::remove_file(broken.with_extension("html")).expect("the page");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert!(given.code == exit::FILE && given.err.contains("--force discards"), "{}", given.err);
}

#[test]
fn a_sweep_template_runs_and_bad_sweeps_are_refused_with_position_and_remedy() {
    let folder = TempDir::new().expect("a temporary folder");
    let given = concordem(["init", "--template", "elastic-sweep", text(folder.path())]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(folder.path().join("cpm-periodic.toml").exists() && given.err.contains("concordem sweep"), "{}", given.err);
    // The template with packings small enough for a test.
    let template = std::fs::read_to_string(folder.path().join("elastic-sweep.toml")).expect("the template");
    let cell = std::fs::read_to_string(folder.path().join("cpm-periodic.toml")).expect("the scenario");
    write(folder.path(), "cpm-periodic.toml", &cell.replace("count = 1000", "count = 60"));
    let sweep = folder.path().join("elastic-sweep.toml");
    let given = concordem(["sweep", text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("99 points; 3 packings") && !given.err.contains("failed"), "{}", given.err);
    for (old, new, words) in [
        ("values = [1, 2, 3]", "values = [1, -2]", "packing.seed"),
        ("\"cpm-periodic.toml\"", "\"gone.toml\"", "gone.toml cannot be read"),
        ("material[0]", "material[3]", "no `material.3`"),
    ] {
        let bad = write(folder.path(), "bad.toml", &template.replace(old, new));
        let given = concordem(["sweep", text(&bad)]);
        assert_eq!(given.code, exit::USAGE, "{}", given.err);
        assert!(given.err.contains(words) && given.err.contains("help: "), "{words}: {}", given.err);
        assert!(!folder.path().join("bad.h5.points").exists(), "a refused sweep leaves no files");
    }
}

/// For discs in a plane cell, `pack` and `check` report the solid fraction of the scenario.
#[test]
fn pack_and_check_agree_on_discs() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let scenario = write(
        folder.path(),
        "discs.toml",
        "version = 1\ndimension = 2\n[packing]\nkind = \"random-discs\"\ncount = 40\n\
         radii = { kind = \"uniform\", minimum = \"0.8 mm\", maximum = \"1.2 mm\" }\nsolid_fraction = 0.9\nseed = 1\n\
         shape = { kind = \"periodic\" }\n[[material]]\nname = \"disc\"\ndensity = 2000\n\
         linear_bond = { normal_stiffness = 7e10, shear_stiffness = 0 }\n[bonds]\nlaw = \"linear_bond\"\n\
         coordination = 5\n[contacts]\nlaw = \"none\"\n[stop]\nsteps = 1\n",
    );
    let fraction = |given: &Given| {
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        let line = given.out.lines().find(|line| line.contains("solid fraction")).expect("a solid fraction");
        line.split_whitespace().last().expect("a number").to_owned()
    };
    assert_eq!(fraction(&concordem(["check", text(&scenario)])), "0.9000");
    let packed = concordem(["pack", text(&scenario)]);
    assert_eq!(fraction(&packed), "0.9000");
    // Bonds at the interaction ratio that gives the target coordination number.
    assert!(
        packed.out.lines().any(|line| line.contains("bonds per sphere") && line.ends_with("5.000")),
        "{}",
        packed.out
    );
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
