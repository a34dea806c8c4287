//! Does the program do what its help says: commands, exit codes, interruption, resumption, the same bits every time?

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

/// What a command gave: exit code, standard output, standard error.
struct Given {
    code: u8,
    out: String,
    err: String,
}

/// Run a command within this process.
fn concordem<S: Into<OsString>>(arguments: impl IntoIterator<Item = S>) -> Given {
    let (mut out, mut err) = (Vec::new(), Vec::new());
    let arguments = std::iter::once(OsString::from("concordem")).chain(arguments.into_iter().map(Into::into));
    let mut console = Console { out: &mut out, err: &mut err, interactive: false, out_interactive: false };
    let code = run(arguments, &mut console);
    let text = |bytes| String::from_utf8(bytes).expect("the program writes UTF-8");
    Given { code, out: text(out), err: text(err) }
}

/// Variable by which a test tells a copy of itself what to run.
const CHILD: &str = "CONCORDEM_TEST_ARGUMENTS";

/// Not a test: what a child process of the tests below does.
#[test]
#[ignore = "run by other tests in a process of its own, so that it can be killed"]
fn child() {
    let Ok(arguments) = std::env::var(CHILD) else { return };
    let given = concordem(arguments.split('\n'));
    eprint!("{}", given.err);
    std::process::exit(i32::from(given.code));
}

/// Start a command in a process of its own.
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

/// All that a result holds, apart from attributes, which tell when and by whom it was made: type, shape, and bits of every dataset, by
/// its path.
type Contents = BTreeMap<String, (String, Vec<usize>, Vec<u64>)>;

fn contents(path: &Path) -> Contents {
    // Opening it compares its seal.
    let hash = ResultFile::open(path).and_then(|result| result.state_hash()).expect("a whole result");
    let mut all = BTreeMap::from([("state_hash".to_owned(), (hash, Vec::new(), Vec::new()))]);
    collect(&hdf5::File::open(path).expect("an HDF5 file"), "", &mut all);
    for name in
        ["samples/stress", "events/step", "particles/velocity", "contacts/cpm/force", "samples/region-stress/stress"]
    {
        assert!(all.contains_key(name), "{name} is not among {:?}", all.keys());
    }
    // The particles move: with one picture for all times the comparison would say little.
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
            // The library complains when asked for nothing.
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

/// The comparison sees one bit of one picture.
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
        assert!(found.is_err(), "a bit of {name} is not seen");
    }
    same(&all, &all, "nothing");
}

/// What broke is in no list of the solver any more; it stays in the tables, and the damage of particles and the damage tensor
/// count it.
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
    let result = ResultFile::open(&path).expect("a whole result");
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
        // The sum's order differs.
        assert!((mean - expected).abs() < 1e-14, "particle {id}: {mean} instead of {expected}");
    }
    // Almost nothing moves in the last step: the tensor from the tables is that of the last sample, within what the bonds turn.
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

/// No file is lost to a name: results have names of HDF5 files, a table that is there is not written over without being told,
/// and one that is missing is written by `resume`.
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
fn help_tells_commands_examples_and_exit_codes() {
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
fn schema_is_json_with_descriptions() {
    let given = concordem(["schema"]);
    assert_eq!(given.code, exit::DONE);
    for word in ["\"$schema\"", "additionalProperties", "Normal modulus of a link, Pa", "x-units"] {
        assert!(given.out.contains(word), "{word} is missing");
    }
}

#[test]
fn templates_are_written_and_checked_but_not_over_existing_files() {
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
fn wrong_arguments_and_files_have_their_exit_codes() {
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
    // A foreign file, and a place that cannot be written to: below a file.
    let given = concordem(["info", text(&scenario)]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    let given = concordem(["run", text(&scenario), "-o", text(&scenario.join("result.h5"))]);
    assert_eq!(given.code, exit::FILE, "{}", given.err);
    // A result that exists is kept.
    let result = folder.path().join("prism.h5");
    assert_eq!(concordem(["run", "-q", text(&scenario)]).code, exit::DONE);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::FILE);
    assert!(given.err.contains("--force"), "{}", given.err);
    assert_eq!(concordem(["run", "-q", "--force", text(&scenario)]).code, exit::DONE);
    // A result cut off anywhere is no result.
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
    assert!(!folder.path().join("unstable.h5.parts").exists(), "a refused run leaves nothing behind");
    let allowed = unstable.replace("[integration]", "[integration]\nallow_unstable = true");
    // Unbreakable bonds, so that the energy grows without end.
    let allowed =
        allowed.replace("omega_threshold = 0.9", "never_damage = true").replace("steps = 5", "steps = 100000");
    let scenario = write(folder.path(), "allowed.toml", &allowed);
    let given = concordem(["run", text(&scenario)]);
    assert_eq!(given.code, exit::PHYSICS, "a run that explodes ends so: {}", given.err);
    assert!(given.err.contains("no longer finite"), "{}", given.err);
    assert!(!folder.path().join("allowed.h5").exists(), "a run that failed leaves no result that looks whole");
}

#[test]
fn a_run_can_be_checked_packed_informed_and_reported() {
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
    // And one for the final state.
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
    assert_eq!(concordem(["report", text(&result)]).code, exit::FILE, "the page is there already");
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

/// Wait for a process, but not for ever.
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
fn sigterm_leaves_a_checkpoint_and_resume_goes_on() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 1500);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    assert_eq!(concordem(["run", "-q", "-o", text(&whole), text(&scenario)]).code, exit::DONE);
    let process = spawn(&["run", "-o", text(&broken), text(&scenario)]);
    // Wait for the first checkpoint: from then on the handlers are in place.
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
fn killed_runs_give_the_result_of_an_undisturbed_one() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 600);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let start = Instant::now();
    let given = concordem(["run", "-q", "-o", text(&whole), text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let duration = start.elapsed();
    let expected = contents(&whole);
    // Kill after growing delays, until a process gets to the end: places in all phases of a run, the last ones too.
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
        // A run that was killed before its first checkpoint has to be begun again.
        let begun = broken.with_extension("h5.parts").join("checkpoint-0000.h5").exists();
        command = if begun || broken.exists() { "resume" } else { "run" };
        if !begun {
            let _ = std::fs::remove_dir_all(broken.with_extension("h5.parts"));
        }
        delay += duration / 40;
    }
    assert!(kills >= 3, "only {kills} kills");
    same(&contents(&broken), &expected, &format!("after {kills} kills"));
    assert!(!broken.with_extension("h5.parts").exists(), "the working folder is gone");
}

/// A run's samples, and the same operators on its result: equal at the last step, because forces and positions in the
/// tables are those of the end; the contacts' order differs, hence rounding of sums of some hundred terms.
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
    // A run that ends at step 60 has the state that the longer one has there.
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
    // Any region, and a map.
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
    // Operators that have regions of their own; a run that is pulled at its ends.
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
    // What cannot be.
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

/// The inverse of a reported result returns its inputs: constants of a cell with Ē = 25 GPa, Ḡ/Ē = 0.2 lead back to these.
/// Poisson's ratio is found to 1e-9 and its slope by the ratio is 0.3, so that the ratio is good to 1e-8.
#[test]
fn elastic_constants_are_told_and_lead_back_to_the_links() {
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
    // From other stiffnesses back to the first ones.
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

/// Parameters of one law lead to E and ν, and these, asked for on the scenario of another law, back to the parameters: for each law
/// and deformable particles, with the bonds left as they are. Poisson's ratio is found to 1e-9 and its slope by the
/// stiffnesses is 0.1 or more; 1e-6 leaves room (asked: 1e-3). What is written says the same of itself.
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
            // Of the particles' modulus and the beams' alike: the first key of the name is the one in both texts.
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
    // Without bonds and without a scenario, bonds are made.
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

/// What cannot be asked for, each with its remedy.
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

/// Killed at growing delays and gone on with, on other numbers of threads: the file has the same bytes.
#[test]
#[cfg(unix)]
fn killed_sweeps_give_the_file_of_an_undisturbed_one() {
    let folder = TempDir::new().expect("a temporary folder");
    write(folder.path(), "cell.toml", CELL);
    let sweep = write(folder.path(), "sweep.toml", SWEEP);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let start = Instant::now();
    let given = concordem(["sweep", "--csv", "-o", text(&whole), text(&sweep)]);
    let duration = start.elapsed();
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("192 points; 4 packings"), "{}", given.err);
    // Sixty bonds are not to be had; the other points have their numbers.
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
    assert!(std::fs::read(&broken).expect("the result") == expected, "after {kills} kills the file is another one");
    assert!(!points.exists(), "the finished points are in the result");
    // Killed after the result was written and before its points were removed: the same command comes to the same end.
    let fingerprint = finished.lines().next().expect("points of a killed sweep").to_owned() + "\n";
    std::fs::write(&points, fingerprint).expect("a file");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(std::fs::read(&broken).expect("the result") == expected && !points.exists());
    // A finished sweep is kept, points of another one are not taken.
    assert_eq!(concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]).code, exit::FILE);
    std::fs::write(&points, "concordem sweep 1 other\n").expect("a file");
    std::fs::remove_file(&broken).expect("the result");
    std::fs::remove_file(broken.with_extension("html")).expect("the page");
    let given = concordem(["sweep", "-q", "-o", text(&broken), text(&sweep)]);
    assert!(given.code == exit::FILE && given.err.contains("--force discards"), "{}", given.err);
}

#[test]
fn sweeps_are_begun_from_a_template_and_refused_with_place_and_remedy() {
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
        assert!(!folder.path().join("bad.h5.points").exists(), "a refused sweep leaves nothing behind");
    }
}

/// Discs in a plane cell: `pack` and `check` find the same solid fraction, that of the scenario.
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
    // Links at the ratio that gives the wanted coordination.
    assert!(
        packed.out.lines().any(|line| line.contains("bonds per sphere") && line.ends_with("5.000")),
        "{}",
        packed.out
    );
}

/// A run without loading has no peak stress; its table has the columns of operators and a last row for the final state, and
/// what nothing is in is not measured.
#[test]
fn tables_are_complete_and_say_nothing_that_is_not() {
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
    // Warnings name place, key, and remedy.
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
    // The last row is that of the state in the file.
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

/// The report of a plane run draws its particles below the broken bonds.
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
