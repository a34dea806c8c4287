//! Results depend neither on the number of threads nor on interruptions.

use std::process::{Child, Command, ExitStatus};
use std::time::{Duration, Instant};

use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::contents::{contents, same};
use crate::{CELL, large_prism, prism, spawn};

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
fn wait(mut process: Child) -> ExitStatus {
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
    let page = folder.path().join("page.html");
    let given = concordem(["report", "-o", text(&page), text(&broken)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.err.contains("broken.h5: not finished: the run goes on, and this is its newest checkpoint, step "));
    let killed = Command::new("kill").args(["-TERM", &process.id().to_string()]).status().expect("kill");
    assert!(killed.success());
    assert_eq!(wait(process).code(), Some(i32::from(exit::INTERRUPTED)));
    assert!(!broken.exists());
    so_far_is_as_if_it_had_ended_there(folder.path(), &scenario, &broken);
    let given = concordem(["info", text(&broken)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(given.out.contains("interrupted; continue with `concordem resume`"), "{}", given.out);
    let given = concordem(["resume", "-j", "3", text(&broken)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    same(&contents(&broken), &contents(&whole), "the resumed run");
}

/// Commands that read results show an interrupted run as if it had ended at its newest checkpoint, and leave it as it is.
fn so_far_is_as_if_it_had_ended_there(folder: &std::path::Path, scenario: &std::path::Path, broken: &std::path::Path) {
    let files = || {
        let names = std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").file_name());
        names.collect::<std::collections::BTreeSet<_>>()
    };
    let before = files();
    let measured = concordem(["measure", text(broken)]);
    assert_eq!(measured.code, exit::DONE, "{}", measured.err);
    assert_eq!(files(), before, "nothing is left behind");
    let (_, step) =
        measured.err.split_once("the run was stopped, and this is its newest checkpoint, step ").expect("a note");
    let step: String = step.chars().take_while(|c| *c != ',').filter(char::is_ascii_digit).collect();
    let ended = folder.join("ended.h5");
    let end = format!("stop.steps={step}");
    let given = concordem(["run", "-q", "-o", text(&ended), "--set", &end, text(scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert_eq!(measured.out.replace("broken", "ended"), concordem(["measure", text(&ended)]).out);
    let page = folder.join("page.html");
    for command in [
        vec!["report", "--force", "-o", text(&page), text(broken)],
        vec!["plot", "-o", "CURVE", text(broken)],
        vec!["render", "-o", "PICTURE", text(broken)],
        vec!["export", "-o", "EXPORT", text(broken)],
        vec!["events", text(broken)],
        vec!["fragments", text(broken)],
    ] {
        let path = |name: &str| folder.join(name).display().to_string();
        let command = command.into_iter().map(|word| match word {
            "CURVE" => path("curve.svg"),
            "PICTURE" => path("picture.png"),
            "EXPORT" => path("export"),
            word => word.to_owned(),
        });
        let given = concordem(command);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    let page = std::fs::read_to_string(page).expect("a page");
    assert!(page.contains("<b>broken.h5</b> is not finished: the run was stopped"), "the page tells it");
}

/// Commands that take long end at once with Ctrl-C and with SIGTERM, in every phase: while spheres are placed and compacted, constants are
/// computed, or numbers are written. What they have not finished, they do not leave behind.
#[test]
#[cfg(unix)]
fn signals_end_every_command() {
    let folder = TempDir::new().expect("a temporary folder");
    let cell = |count: &str| CELL.replace("count = 60", &format!("count = {count}"));
    let cell = write(folder.path(), "cell.toml", &cell("30000"));
    let sweep = "version = 1\nscenario = \"cell.toml\"\n[[axis]]\nkey = \"packing.seed\"\nvalues = [1, 2]\n";
    let sweep = write(folder.path(), "sweep.toml", sweep);
    let runs = "version = 1\nscenario = \"cell.toml\"\nstudy = \"run\"\nresults = [\"max stress\"]\n[[axis]]\nkey = \"packing.seed\"\nvalues = [1]\n";
    let runs = write(folder.path(), "runs.toml", runs);
    // A quarter of a million spheres.
    let lattice = cell_of_a_lattice(folder.path(), 40);
    let result = folder.path().join("lattice.h5");
    assert_eq!(concordem(["run", "-q", "-o", text(&result), text(&lattice)]).code, exit::DONE);
    let (structure, exported, tables) =
        (folder.path().join("made.html"), folder.path().join("exported"), folder.path().join("found.toml"));
    let commands: [&[&str]; 9] = [
        &["check", "-j", "1", text(&cell)],
        &["pack", "-j", "1", text(&cell)],
        &["elastic", "-j", "1", text(&cell)],
        &["calibrate", "elastic", "-j", "1", text(&cell), "--young", "30 GPa", "--poisson", "0.2", "-o", text(&tables)],
        &["characterise", "-j", "1", text(&lattice), "-o", text(&structure)],
        &["measure", text(&result), "--operator", "cell-strain"],
        &["export", "-o", text(&exported), text(&result)],
        &["sweep", "-j", "2", text(&sweep)],
        &["sweep", "-j", "2", text(&runs)],
    ];
    for command in commands {
        for signal in ["-INT", "-TERM"] {
            // Only sweeps have a handler, which must be there.
            let longest = if command[0] == "sweep" { 2000 } else { 500 };
            // On a fast machine some end before.
            let mut delays = [1, 2, 4, 8].map(|part| Duration::from_millis(longest / part)).into_iter();
            let process = delays.find_map(|delay| {
                let mut process = spawn(command);
                std::thread::sleep(delay);
                process.try_wait().expect("a child process").is_none().then_some(process)
            });
            let process = process.unwrap_or_else(|| panic!("{command:?} is too short for this test"));
            let killed = Command::new("kill").args([signal, &process.id().to_string()]).status().expect("kill");
            assert!(killed.success());
            let start = Instant::now();
            let status = wait(process);
            // Some of that is the load of the machine.
            assert!(start.elapsed() < Duration::from_secs(2), "{command:?} {signal}: {:?}", start.elapsed());
            let code = if command[0] == "sweep" { Some(i32::from(exit::INTERRUPTED)) } else { None };
            assert_eq!(status.code(), code, "{command:?} {signal}");
        }
    }
    let left = [structure, tables, folder.path().join("cell.h5"), folder.path().join("sweep.h5")];
    assert!(left.iter().all(|path| !path.exists()));
}

/// A periodic lattice of `4 count³` spheres.
fn cell_of_a_lattice(folder: &std::path::Path, count: usize) -> std::path::PathBuf {
    let random = "kind = \"random-dense\"\ncount = 60\nradius = \"1 mm\"\nseed = 1";
    assert!(CELL.contains(random));
    let lattice = format!("kind = \"lattice\"\nlattice = \"fcc\"\nradius = \"1 mm\"\nrepeats = {:?}", [count; 3]);
    write(
        folder,
        "lattice.toml",
        &CELL.replace(random, &lattice).replace("coordination = 8", "interaction_ratio = 1.01"),
    )
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

/// A large run has no checkpoint until it has lasted five seconds. Killed before, it begins again.
#[test]
#[cfg(unix)]
fn a_large_run_killed_before_its_first_checkpoint_begins_again() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = large_prism(folder.path(), 200);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    let given = concordem(["run", "-q", "-o", text(&whole), text(&scenario)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let expected = contents(&whole);
    assert!(expected["contacts/cpm/ids"].2.len() / 2 + expected["particles/id"].2.len() > 200_000, "the run is large");
    let mut process = spawn(&["run", "-o", text(&broken), text(&scenario)]);
    let parts = broken.with_extension("h5.parts");
    let start = Instant::now();
    while !parts.exists() {
        assert!(start.elapsed() < Duration::from_secs(120), "the run does not begin");
        std::thread::sleep(Duration::from_millis(2));
    }
    // A checkpoint at the start would exist by then, and there are steps.
    std::thread::sleep(Duration::from_millis(700));
    assert!(process.try_wait().expect("a child process").is_none(), "the run is too short for this test");
    process.kill().expect("a child process can be killed");
    process.wait().expect("a child process");
    assert!(parts.join("header.h5").exists(), "the run has begun");
    assert!(!parts.join("checkpoint-0000.h5").exists(), "a large run begins without a checkpoint");

    let given = concordem(["report", text(&broken)]);
    assert_eq!(given.code, exit::USAGE);
    assert!(given.err.contains("is not finished, and has no checkpoint yet: wait some seconds"), "{}", given.err);
    let given = concordem(["resume", "-q", text(&broken)]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    same(&contents(&broken), &expected, "the run that began again");
}
