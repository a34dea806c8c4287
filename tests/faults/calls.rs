//! Each call of the system that writes fails once: then a command says so and nothing is lost, or its files are the same.
//!
//! `inject.c`, loaded into the process of a command, lets a chosen call fail. Every command writes a short result first without a fault,
//! which counts its calls, and then once for each chosen call and error. After a failure, the command that the program names is given,
//! without a fault; then the files must be those of the first time.
//!
//! The tests try a few calls. With `CONCORDEM_ALL_CALLS=N` every N-th call of every command fails (`make faults`: N = 1, each one). That study
//! goes on where it was interrupted, and writes `result.json`.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use concordem_tests::commands::{concordem, text, write};
use concordem_tests::datasets::datasets;
use concordem_tests::study::{Journal, path_of};
use serde_json::json;
use tempfile::TempDir;

use crate::BLOCK;

/// Tells the child process what to run.
const CHILD: &str = "CONCORDEM_TEST_ARGUMENTS";
/// Every how many calls one fails: 1 for each call. If it is not set, a few calls fail: minutes instead of hours.
const ALL: &str = "CONCORDEM_ALL_CALLS";
/// The last long study.
const RECORD: &str = "tests/faults/result.json";
/// Longer than any of the commands takes.
const LONGEST: Duration = Duration::from_secs(120);

/// Not a test: the process of a command.
#[test]
#[ignore = "run by other tests in a separate process, in which calls fail"]
fn child() {
    let Ok(arguments) = std::env::var(CHILD) else { return };
    let given = concordem(arguments.split('\n'));
    eprint!("{}", given.err);
    std::process::exit(i32::from(given.code));
}

/// A command and its files.
struct Case {
    name: &'static str,
    /// Arguments; names of files are relative to the folder.
    arguments: &'static [&'static str],
    /// Files that are there before.
    given: &'static [(&'static str, &'static str)],
    /// Commands that are given before.
    before: &'static [&'static [&'static str]],
    /// What continues after a failure, if not the same command.
    again: Option<&'static [&'static str]>,
    /// Files that it writes.
    written: &'static [&'static str],
}

impl Case {
    /// Whether the command takes less than a second.
    fn short(&self) -> bool {
        !matches!(self.name, "characterise" | "calibrate concrete")
    }
}

/// What fails, and how.
#[derive(Debug, Clone, Copy)]
struct Fault {
    call: &'static str,
    /// From 1.
    number: usize,
    /// Number of the error; 0: a part is written; -1: the process is killed.
    error: i32,
    /// Whether all later calls fail.
    lasting: bool,
}

/// Numbers of errors, of Linux.
const INTERRUPTED: i32 = 4;
const INPUT_OUTPUT: i32 = 5;
const NO_SPACE: i32 = 28;
const PART: i32 = 0;
const KILL: i32 = -1;

const SWEEP: &str = r#"
version = 1
scenario = "cell.toml"
[[axis]]
key = "bonds.interaction_ratio"
values = [1.1, 1.5]
"#;

const CELL: &str = r#"
version = 1
[packing]
kind = "lattice"
lattice = "fcc"
radius = "1 mm"
repeats = [2, 2, 2]
shape = { kind = "periodic" }
[[material]]
name = "m"
density = 2000
linear_bond = { normal_stiffness = 1e7, shear_stiffness = 2e6 }
[bonds]
law = "linear_bond"
interaction_ratio = 1.1
[contacts]
law = "none"
[stop]
steps = 1
"#;

/// A table of strengths is written after each measurement.
const CONCRETE: &str = r#"
version = 1
[packing]
kind = "random-dense"
count = 60
radius = "1 mm"
shape = { kind = "box", size = ["7 mm", "7 mm", "12 mm"] }
[[material]]
name = "c"
density = 4800
[material.cpm]
young = "25 GPa"
shear_ratio = 0.2
crack_onset_strain = 1e-4
relative_ductility = 30
cohesion = "3 MPa"
friction_coefficient = 0.8
[bonds]
law = "cpm"
interaction_ratio = 1.5
[contacts]
law = "cpm"
[loading]
kind = "uniaxial"
strain_rate = "4 1/s"
[stop]
drop_to = 0.5
steps = 3000
"#;

/// A block whose bonds break, with everything that a run may write.
fn block() -> String {
    let strong = "shear_stiffness = 2e5 }";
    assert!(BLOCK.contains(strong));
    BLOCK.replace(strong, "shear_stiffness = 2e5, normal_strength = 0.2, shear_strength = 1 }")
        + "csv = true\nsnapshot_interval = 25\nbond_snapshots = true\ncheckpoint_interval = 40\n\
           [[sample]]\noperator = \"region-stress\"\nregion = { kind = \"all\", volume = \"1 cm^3\" }\n"
}

const RUN: &[&str] = &["run", "-q", "-j", "1", "block.toml"];

const CASES: &[Case] = &[
    Case {
        name: "run",
        arguments: RUN,
        given: &[],
        before: &[],
        again: Some(&["resume", "-q", "-j", "1", "block.h5"]),
        written: &["block.h5", "block.csv"],
    },
    Case {
        name: "sweep",
        arguments: &["sweep", "-q", "-j", "1", "--csv", "sweep.toml"],
        given: &[("sweep.toml", SWEEP), ("cell.toml", CELL)],
        before: &[],
        again: None,
        written: &["sweep.h5", "sweep.html", "sweep.csv"],
    },
    Case {
        name: "pack",
        arguments: &["pack", "-q", "-j", "1", "block.toml", "-o", "pack.h5"],
        given: &[],
        before: &[],
        again: None,
        written: &["pack.h5"],
    },
    Case {
        name: "pack as text",
        arguments: &["pack", "-q", "-j", "1", "block.toml", "-o", "pack.txt"],
        given: &[],
        before: &[],
        again: None,
        written: &["pack.txt"],
    },
    Case {
        name: "calibrate",
        arguments: &[
            "calibrate",
            "elastic",
            "-q",
            "-j",
            "1",
            "cell.toml",
            "--young",
            "30 GPa",
            "--poisson",
            "0.2",
            "-o",
            "found.toml",
        ],
        given: &[("cell.toml", CELL)],
        before: &[],
        again: None,
        written: &["found.toml"],
    },
    Case {
        name: "export",
        arguments: &["export", "block.h5"],
        given: &[],
        before: &[RUN],
        again: Some(&["export", "--force", "block.h5"]),
        written: &["block.particles.vtkhdf", "block.bonds.vtkhdf", "block.paraview.py"],
    },
    Case {
        name: "export for LAMMPS",
        arguments: &["export", "--format", "lammps", "block.h5"],
        given: &[],
        before: &[RUN],
        again: Some(&["export", "--force", "--format", "lammps", "block.h5"]),
        written: &["block.data", "block.dump", "block.bonds.dump", "block.ovito.py"],
    },
    Case {
        name: "export of cracks",
        arguments: &["export", "--format", "cracks", "block.h5"],
        given: &[],
        before: &[RUN],
        again: None,
        written: &["block.cracks.vtp"],
    },
    Case {
        name: "report",
        arguments: &["report", "block.h5"],
        given: &[],
        before: &[RUN],
        again: None,
        written: &["block.html"],
    },
    Case {
        name: "characterise",
        arguments: &["characterise", "-q", "-j", "1", "block.toml", "-o", "made.html"],
        given: &[],
        before: &[],
        again: Some(&["characterise", "-q", "-j", "1", "--force", "block.toml", "-o", "made.html"]),
        written: &["made.json", "made.html"],
    },
    Case {
        name: "init",
        arguments: &["init", "--template", "cpm-small", "new.toml"],
        given: &[],
        before: &[],
        again: None,
        written: &["new.toml"],
    },
];

/// The library that lets calls fail.
fn injector(folder: &Path) -> PathBuf {
    let library = folder.join("inject.so");
    let source = concat!(env!("CARGO_MANIFEST_DIR"), "/faults/inject.c");
    let options = ["-Wall", "-Werror", "-O1", "-shared", "-fPIC", source, "-o", text(&library), "-ldl"];
    let compiled = Command::new("cc").args(options).status().expect("a C compiler, which the HDF5 library needs, too");
    assert!(compiled.success(), "{source} cannot be compiled");
    library
}

/// End of a command.
struct End {
    /// Exit code; `None` after a signal.
    code: Option<i32>,
    err: String,
}

/// Runs a command in a process of its own, in `folder`.
fn command(folder: &Path, arguments: &[&str], environment: &[(&str, String)]) -> End {
    let list: Vec<&str> = std::iter::once("concordem").chain(arguments.iter().copied()).skip(1).collect();
    let err = std::fs::File::create(folder.join("err.log")).expect("a log");
    let mut process = Command::new(std::env::current_exe().expect("this test has a file"))
        .args(["--exact", "calls::child", "--ignored", "--nocapture"])
        .current_dir(folder)
        .env(CHILD, list.join("\n"))
        .envs(environment.iter().map(|(name, value)| (name, value)))
        .stdout(Stdio::null())
        .stderr(Stdio::from(err))
        .spawn()
        .expect("the test can start itself");
    let begun = Instant::now();
    let code = loop {
        if let Some(status) = process.try_wait().expect("a child process") {
            break status.code();
        }
        if begun.elapsed() > LONGEST {
            let _ = process.kill();
            panic!("{arguments:?} with {environment:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(1));
    };
    let log = folder.join("err.log");
    let err = std::fs::read_to_string(&log).expect("a log");
    std::fs::remove_file(log).expect("a log");
    End { code, err }
}

/// What a file holds.
#[derive(PartialEq)]
enum Content {
    Text(Vec<u8>),
    Data(concordem_tests::datasets::Contents),
}

fn contents(folder: &Path, case: &Case) -> BTreeMap<&'static str, Content> {
    let read = |name: &&'static str| {
        let path = folder.join(name);
        let is_data = [".h5", ".vtkhdf"].iter().any(|end| name.ends_with(end));
        if is_data {
            concordem::output::sealed::verify(&path).unwrap_or_else(|error| panic!("{error}"));
        }
        let content = if is_data {
            Content::Data(datasets(&path))
        } else {
            Content::Text(std::fs::read(&path).unwrap_or_else(|error| panic!("{name}: {error}")))
        };
        (*name, content)
    };
    case.written.iter().map(read).collect()
}

/// A case without faults: its folder before the command, its contents, and how often it calls the system.
struct Prepared {
    before: TempDir,
    contents: BTreeMap<&'static str, Content>,
    counts: BTreeMap<String, usize>,
}

fn prepare(case: &Case, library: &Path) -> Prepared {
    let before = TempDir::new().expect("a folder");
    write(before.path(), "block.toml", &block());
    for (name, text) in case.given {
        write(before.path(), name, text);
    }
    for arguments in case.before {
        let end = command(before.path(), arguments, &[]);
        assert_eq!(end.code, Some(0), "{}: {}", case.name, end.err);
    }
    let after = copy(before.path());
    let counts = after.path().join("counts");
    let environment = [("LD_PRELOAD", text(library).to_owned()), ("FAULT_COUNTS", text(&counts).to_owned())];
    let end = command(after.path(), case.arguments, &environment);
    assert_eq!(end.code, Some(0), "{}: {}", case.name, end.err);
    let counts = std::fs::read_to_string(counts).expect("the numbers of calls");
    let line =
        |line: &str| line.split_once(' ').map(|(name, count)| (name.to_owned(), count.parse().expect("a number")));
    Prepared { contents: contents(after.path(), case), counts: counts.lines().filter_map(line).collect(), before }
}

/// A copy of the files of a folder.
fn copy(folder: &Path) -> TempDir {
    let to = TempDir::new().expect("a folder");
    for entry in std::fs::read_dir(folder).expect("a folder").flatten() {
        std::fs::copy(entry.path(), to.path().join(entry.file_name())).expect("a copy");
    }
    to
}

/// Runs a case with a fault, and continues; `Err` says what is wrong.
fn suffer(case: &Case, prepared: &Prepared, library: &Path, fault: Fault) -> Result<(), String> {
    let folder = copy(prepared.before.path());
    let mut environment = vec![
        ("LD_PRELOAD", text(library).to_owned()),
        ("FAULT_CALL", fault.call.to_owned()),
        ("FAULT_NUMBER", fault.number.to_string()),
        ("FAULT_ERROR", fault.error.to_string()),
    ];
    if fault.lasting {
        environment.push(("FAULT_LASTING", "1".to_owned()));
    }
    let first = command(folder.path(), case.arguments, &environment);
    match first.code {
        Some(0) => {}
        None if fault.error == KILL => {}
        // A file cannot be read or written.
        Some(code) if code == i32::from(concordem::program::exit::FILE) && first.err.contains("error: ") => {}
        code => return Err(format!("ends with {code:?}: {}", first.err)),
    }
    let mut last = first;
    for _ in 0..3 {
        if last.code == Some(0) {
            break;
        }
        let begun =
            case.name != "run" || ["block.h5.parts", "block.h5"].iter().any(|name| folder.path().join(name).exists());
        let exists = last.err.contains("already exists");
        let mut arguments = if begun { case.again.unwrap_or(case.arguments) } else { case.arguments }.to_vec();
        if exists {
            arguments.push("--force");
        }
        last = command(folder.path(), &arguments, &[]);
    }
    if last.code != Some(0) {
        return Err(format!("cannot be continued: {}", last.err));
    }
    let found = contents(folder.path(), case);
    let differ: Vec<_> =
        found.iter().filter(|(name, content)| prepared.contents[*name] != **content).map(|(name, _)| name).collect();
    if !differ.is_empty() {
        return Err(format!("{differ:?} differ"));
    }
    let expected = |name: &str| prepared.before.path().join(name).exists() || case.written.contains(&name);
    let names = std::fs::read_dir(folder.path()).expect("a folder").flatten().map(|entry| entry.file_name());
    let mut left: Vec<_> = names.filter(|name| !expected(&name.to_string_lossy())).collect();
    if fault.error == KILL || fault.call == "unlink" {
        // The next command that writes to this folder removes what has content, and what is a minute old.
        write(folder.path(), "other.toml", &block());
        let end = command(folder.path(), &["run", "-q", "other.toml"], &[]);
        assert_eq!(end.code, Some(0), "{}", end.err);
        left.retain(|name| {
            let path = folder.path().join(name);
            let is_empty = std::fs::read_dir(&path).map_or_else(
                |_| path.metadata().is_ok_and(|data| data.len() == 0),
                |mut entries| entries.all(|entry| entry.is_ok_and(|entry| entry.file_name() == "lock")),
            );
            path.exists() && !(is_empty && name.to_string_lossy().starts_with(".unfinished-"))
        });
    }
    if left.is_empty() { Ok(()) } else { Err(format!("{left:?} stay")) }
}

/// Every how many calls one fails; `None`: a few.
fn every() -> Option<usize> {
    let every = std::env::var(ALL).ok()?;
    Some(every.parse().ok().filter(|every| *every > 0).unwrap_or_else(|| panic!("{ALL} is no number: {every}")))
}

/// The faults of a case: all, or a few of each kind, which differ from case to case.
fn faults(case: usize, counts: &BTreeMap<String, usize>) -> Vec<Fault> {
    let mut faults = Vec::new();
    let kinds = ["write", "sync", "rename", "close", "truncate", "open", "unlink", "folder"];
    for (kind, call) in kinds.into_iter().enumerate() {
        let count = counts[call];
        let errors: &[i32] = match call {
            "write" => &[NO_SPACE, INPUT_OUTPUT, INTERRUPTED, PART, KILL],
            _ => &[NO_SPACE, INPUT_OUTPUT, INTERRUPTED, KILL],
        };
        for (e, &error) in errors.iter().enumerate() {
            // Numbers that have no common measure with the structure of the files.
            let few = |k: usize| (1 + (case * 7 + e * 13 + kind * 5 + k * 61) % count.max(1), 1);
            let numbers: Vec<usize> = match (every(), call, error) {
                (Some(every), ..) => (1 + e % every..=count).step_by(every).collect(),
                (None, "write", NO_SPACE) if case == 0 => (0..6).map(|k| few(k).0).collect(),
                (None, "write", INPUT_OUTPUT) => (0..2).map(|k| few(k).0).collect(),
                (None, "write", KILL) | (None, "sync" | "rename", NO_SPACE) => vec![few(0).0],
                (None, "write", _) if case == 0 => vec![few(0).0],
                (None, "close" | "truncate" | "open" | "unlink" | "folder", INPUT_OUTPUT) => vec![few(1).0],
                _ => Vec::new(),
            };
            let numbers = numbers.into_iter().filter(|number| *number <= count);
            faults.extend(numbers.map(|number| Fault { call, number, error, lasting: false }));
            if matches!((call, error), ("write" | "sync", NO_SPACE)) {
                let step = every().map_or((count / 2).max(1), |every| 4 * every);
                let lasting = (1..=count).step_by(step).skip(usize::from(every().is_none()));
                faults.extend(lasting.map(|number| Fault { call, number, error, lasting: true }));
            }
        }
    }
    faults
}

/// A command that needs seconds, and is only in the long study.
const LONG: Case = Case {
    name: "calibrate concrete",
    arguments: &[
        "calibrate",
        "concrete",
        "-q",
        "-j",
        "1",
        "concrete.toml",
        "--young",
        "30 GPa",
        "--poisson",
        "0.2",
        "--tensile-strength",
        "3 MPa",
        "--compressive-strength",
        "30 MPa",
        "-o",
        "found.toml",
    ],
    given: &[("concrete.toml", CONCRETE)],
    before: &[],
    again: None,
    written: &["found.toml", "concrete.strengths.json"],
};

#[test]
fn a_call_that_fails_loses_nothing() {
    let tools = TempDir::new().expect("a folder");
    let library = injector(tools.path());
    let mut journal = every().map(|_| Journal::open("faults"));
    let (mut wrong, mut cases, mut tried) = (Vec::new(), BTreeMap::new(), 0);
    // Measuring structures and strengths takes seconds each time.
    let chosen = CASES.iter().chain([&LONG]).filter(|case| every().is_some() || case.short());
    for (k, case) in chosen.enumerate() {
        let prepared = prepare(case, &library);
        let begun = Instant::now();
        let faults = faults(k, &prepared.counts);
        let before = wrong.len();
        for (n, &fault) in faults.iter().enumerate() {
            let suffer = || suffer(case, &prepared, &library, fault).err();
            let problem = match &mut journal {
                Some(journal) => {
                    let found = journal.part(&format!("{}, {fault:?}", case.name), || json!(suffer()));
                    found.as_str().map(str::to_owned)
                }
                None => suffer(),
            };
            if let Some(problem) = problem {
                println!("{}, {fault:?}: {problem}", case.name);
                wrong.push(format!("{}, {fault:?}: {problem}", case.name));
            }
            if every().is_some() && n % 100 == 99 {
                println!("{}: {} of {} faults in {:.0?}", case.name, n + 1, faults.len(), begun.elapsed());
            }
        }
        tried += faults.len();
        println!("{}: {} faults in {:.1?}, of {:?}", case.name, faults.len(), begun.elapsed(), prepared.counts);
        let figures = json!({ "calls": prepared.counts, "faults": faults.len(), "failed": wrong.len() - before });
        cases.insert(case.name, figures);
        // After each command, so that a study that is not finished has a record, too.
        if let (Some(journal), Some(every)) = (&journal, every()) {
            let figures = json!({ "every_call_of": every, "faults": tried, "failed": wrong.len(), "commands": cases });
            std::fs::write(path_of(RECORD), journal.record(figures)).expect("a record");
        }
    }
    assert!(wrong.is_empty(), "{} of {tried}:\n{}", wrong.len(), wrong.join("\n"));
    // Without the library in the processes, or with other cases, the test would show nothing.
    assert!(tried > 80, "{tried} faults");
}

/// The time of day may jump while a run goes on; only the running time counts.
#[test]
fn the_clock_may_jump() {
    let tools = TempDir::new().expect("a folder");
    let library = injector(tools.path());
    let case = &CASES[0];
    let prepared = prepare(case, &library);
    let folder = copy(prepared.before.path());
    let environment = [("LD_PRELOAD", text(&library).to_owned()), ("FAULT_CLOCK", "1".to_owned())];
    let end = command(folder.path(), case.arguments, &environment);
    assert_eq!(end.code, Some(0), "{}", end.err);
    assert!(contents(folder.path(), case) == prepared.contents);
}
