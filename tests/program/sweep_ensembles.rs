//! Ensembles: sampled parameters, curves of runs, parts of a sweep on several computers.

use std::path::{Path, PathBuf};

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::PRISM;

const ENSEMBLE: &str = "version = 1\nscenario = \"prism.toml\"\nstudy = \"run\"\nresults = [\"E\", \"max stress\"]\n\
    [sampling]\nmethod = \"sobol\"\ncount = 12\n\
    [[axis]]\nname = \"modulus\"\nkey = \"material[0].cpm.young\"\nlinear = { from = 2e10, to = 4e10 }\n\
    [[axis]]\nkey = \"packing.radius\"\nvalues = [1e-3, 1.2e-3]\naverage = true\n\
    [[axis]]\nname = \"onset\"\nkey = \"material[0].cpm.crack_onset_strain\"\nlogarithmic = { from = 5e-5, to = 2e-4 }\n\
    [[curve]]\nname = \"stress-strain\"\nx = \"strain\"\ny = \"stress\"\nfrom = 0\nto = 4e-3\ncount = 41\n\
    [[curve]]\nx = \"time\"\ny = \"region-stress stress_zz\"\nfrom = 1e-5\nto = 0\ncount = 5\n";

fn files(folder: &Path) -> PathBuf {
    // Long enough to break bonds of the weaker samples.
    write(folder, "prism.toml", &PRISM.replace("STEPS", "240"));
    write(folder, "s.toml", ENSEMBLE)
}

/// Numbers and shape of a dataset.
fn numbers(file: &hdf5::File, name: &str) -> (Vec<f64>, Vec<usize>) {
    let dataset = file.dataset(name).expect(name);
    (dataset.read_raw().expect(name), dataset.shape())
}

/// The whole sweep: its folder and the bytes of its result.
fn whole(threads: &str) -> (TempDir, Vec<u8>) {
    let folder = TempDir::new().expect("a temporary folder");
    let given = concordem(["sweep", "-q", "--csv", "-j", threads, text(&files(folder.path()))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let bytes = std::fs::read(folder.path().join("s.h5")).expect("the result");
    (folder, bytes)
}

/// Curves are those of the run of the same scenario, interpolated where the run first passes each abscissa.
#[test]
fn curves_are_those_of_runs_and_samples_are_in_the_result() {
    let (folder, _) = whole("2");
    let file = hdf5::File::open(folder.path().join("s.h5")).expect("the result");
    let (modulus, _) = numbers(&file, "axes/0 modulus");
    let (onset, _) = numbers(&file, "axes/2 onset");
    let axis = file.dataset("axes/2 onset").expect("an axis");
    let number = |name: &str| axis.attr(name).and_then(|attribute| attribute.read_scalar::<f64>()).expect(name);
    assert_eq!((number("from"), number("to"), number("sampled")), (5e-5, 2e-4, 1.0));
    let word = |dataset: &hdf5::Dataset, name: &str| -> String {
        let attribute = dataset.attr(name).expect(name);
        attribute.read_scalar::<hdf5::types::VarLenUnicode>().expect(name).as_str().to_owned()
    };
    assert_eq!(word(&axis, "scale"), "logarithmic");
    assert!(file.dataset("axes/1 packing.radius").expect("an axis").attr("sampled").is_err());
    let index =
        |k: usize| -> Vec<u32> { file.dataset(&format!("points/axis_{k}")).expect("an axis").read_raw().expect("") };
    assert_eq!(index(0), (0..24).map(|point| point / 2).collect::<Vec<u32>>());
    assert_eq!(index(0), index(2));
    let (x, _) = numbers(&file, "curves/stress-strain/x");
    let (y, shape) = numbers(&file, "curves/stress-strain/y");
    assert_eq!((x.len(), shape), (41, vec![24, 41]));
    let dataset = file.dataset("curves/stress-strain/y").expect("a curve");
    assert_eq!((word(&dataset, "name"), word(&dataset, "unit")), ("stress".into(), "Pa".into()));
    let (times, _) = numbers(&file, "curves/region-stress stress_zz over time/x");
    assert_eq!((times[0], times[4]), (1e-5, 0.0));
    let (of_region, shape) = numbers(&file, "curves/region-stress stress_zz over time/y");
    assert!(shape == [24, 5] && of_region.iter().all(|value| value.is_finite()), "{of_region:?}");
    // The third sample with the second radius.
    let point = 2 * 2 + 1;
    let (scenario, result) = (folder.path().join("prism.toml"), folder.path().join("one.h5"));
    let settings = [
        format!("material[0].cpm.young={:?}", modulus[2]),
        format!("material[0].cpm.crack_onset_strain={:?}", onset[2]),
        "packing.radius=1.2e-3".to_owned(),
    ];
    let [young, crack, radius] = &settings;
    let run = ["run", "-q", text(&scenario), "-o", text(&result), "--set", young, "--set", crack, "--set", radius];
    assert_eq!(concordem(run).code, exit::DONE);
    let one = ResultFile::open(&result).expect("a result");
    let [strain, stress] = ["strain", "stress"].map(|name| one.samples(name).expect(name));
    let (mut finite, mut missing) = (0, 0);
    for (at, found) in x.iter().zip(&y[point * 41..]) {
        let Some(k) = (1..strain.len()).find(|&k| strain[k] >= *at) else {
            assert!(found.is_nan());
            missing += 1;
            continue;
        };
        let share = (at - strain[k - 1]) / (strain[k] - strain[k - 1]);
        let expected = stress[k - 1] + share * (stress[k] - stress[k - 1]);
        assert!((found - expected).abs() <= 1e-9 * stress[k].abs().max(1.0), "{at}: {found}, not {expected}");
        finite += 1;
    }
    assert!(finite > 5 && missing > 0, "{finite} ordinates, {missing} missing; the run ends at {:?}", strain.last());
    // The page draws dots over samples, and curves; the table has one row per sample.
    let page = std::fs::read_to_string(folder.path().join("s.html")).expect("the page");
    for words in
        ["One dot per sample.", "<h2>Curves</h2>", "stress-strain", "Over onset", "dashed: smallest and largest"]
    {
        assert!(page.contains(words), "{words}");
    }
    assert_eq!(page.matches("<tr>").count(), 13);
    let table = std::fs::read_to_string(folder.path().join("s.csv")).expect("the table");
    assert_eq!(table.lines().count(), 25);
}

/// A sweep with samples and curves that is killed again and again gives the file of an uninterrupted one.
#[test]
#[cfg(unix)]
fn killed_ensembles_give_the_file_of_an_uninterrupted_one() {
    let (_, expected) = whole("3");
    let folder = TempDir::new().expect("a temporary folder");
    let sweep = files(folder.path());
    let (result, journal) = (folder.path().join("s.h5"), folder.path().join("s.h5.points"));
    let lines = || std::fs::read_to_string(&journal).map_or(0, |text| text.lines().count());
    let mut kills = 0;
    while !result.exists() {
        let before = lines();
        let mut child = crate::spawn(&["sweep", "-q", "-j", ["1", "2"][kills % 2], text(&sweep)]);
        // Killed with its next point, in the middle of another one.
        for _ in 0..20_000 {
            if lines() > before.max(1) || child.try_wait().expect("a child").is_some() {
                break;
            }
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
        child.kill().expect("a child");
        child.wait().expect("it ends");
        kills += 1;
        assert!(kills < 200, "the sweep makes no progress");
    }
    assert!(kills > 8, "{kills} kills");
    let given = concordem(["sweep", "-q", text(&sweep)]);
    assert!(given.code == exit::DONE || given.err.contains("exists"), "{}", given.err);
    assert!(std::fs::read(&result).expect("the result") == expected, "after {kills} kills the file differs");
    assert!(!journal.exists());
}

/// Parts, computed in any order and merged, give the file of the whole sweep; missing parts are named.
#[test]
fn merged_parts_give_the_file_of_the_whole_sweep() {
    let (_, expected) = whole("1");
    let folder = TempDir::new().expect("a temporary folder");
    let sweep = files(folder.path());
    let part = |part: &str| concordem(["sweep", "-j", "2", text(&sweep), "--part", part]);
    let merge = || concordem(["sweep", "-q", text(&sweep), "--merge"]);
    let given = merge();
    assert!(given.code == exit::USAGE && given.err.contains("no part of the sweep"), "{}", given.err);
    for k in [5, 1, 2, 4] {
        let given = part(&format!("{k}/5"));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        // Two packings: only the part in the middle needs both.
        assert!(given.err.contains("; 1 packings"), "{}", given.err);
        assert!(given.out.contains(&format!("s.h5.part-{k}-of-5.points")), "{}", given.out);
    }
    assert!(!folder.path().join("s.h5").exists());
    let given = merge();
    assert!(given.err.contains("5 of 24 points are missing"), "{}", given.err);
    assert!(given.err.contains("not finished: 3/5;") && given.err.contains("--part 3/5"), "{}", given.err);
    // A part of another sweep is refused, and a part of another number of parts counts.
    let foreign = folder.path().join("s.h5.part-3-of-5.points");
    std::fs::write(&foreign, "concordem sweep 1 other\n").expect("a file");
    let given = merge();
    assert!(given.err.contains("points of another sweep") && given.err.contains("--force"), "{}", given.err);
    let given = part("3/5");
    assert!(given.code == exit::FILE && given.err.contains("--force discards"), "{}", given.err);
    std::fs::remove_file(&foreign).expect("a file");
    assert_eq!(part("2/4").code, exit::DONE);
    let given = part("3/4");
    assert!(given.err.contains("2 packings") || given.err.contains("1 packings"), "{}", given.err);
    let given = merge();
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    assert!(std::fs::read(folder.path().join("s.h5")).expect("the result") == expected);
    let left = std::fs::read_dir(folder.path()).expect("a folder").flatten();
    assert!(left.into_iter().all(|file| !file.file_name().to_string_lossy().contains(".points")));
    // A finished result is kept.
    for given in [part("1/5"), merge()] {
        assert!(given.code == exit::FILE && given.err.contains("exists"), "{}", given.err);
    }
    for (arguments, words) in [
        (&["--part", "0/5"][..], "such as 3/10"),
        (&["--part", "25/25", "--force"], "at most 24 parts"),
        (&["--part", "1/5", "--merge"], "cannot be used with"),
        (&["--slurm", "array.sh"], "--parts"),
    ] {
        let given = concordem(["sweep", text(&sweep)].iter().chain(arguments).copied());
        assert!(given.code == exit::USAGE && given.err.contains(words), "{}", given.err);
    }
}

/// The script for SLURM, run by a shell for each part as SLURM does, gives the file of the whole sweep, whatever the names are.
#[test]
#[cfg(unix)]
fn a_script_for_slurm_computes_all_parts() {
    use std::os::unix::fs::PermissionsExt as _;
    use std::process::{Command, Stdio};
    let (_, expected) = whole("1");
    let folder = TempDir::new().expect("a temporary folder");
    files(folder.path());
    let name = "it's $(touch x); \"two\" words.toml";
    std::fs::rename(folder.path().join("s.toml"), folder.path().join(name)).expect("a file");
    let path = folder.path().join("array $1.sh");
    let sweep = folder.path().join(name);
    let command =
        ["sweep", text(&sweep), "-j", "2", "--csv", "--set", "title=a 'b'", "--slurm", text(&path), "--parts", "3"];
    let given = concordem(command);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let script = std::fs::read_to_string(&path).expect("the script");
    let quoted = format!("'{}'", text(&path));
    let submit = format!("#   job=$(sbatch --parsable {quoted})");
    for line in ["#SBATCH --array=1-3", "#SBATCH --cpus-per-task=2", &submit] {
        assert!(script.lines().any(|found| found == line), "{script}");
    }
    assert_eq!(concordem(command).code, exit::FILE, "an existing script is kept");
    // The program, in the search path.
    let programs = folder.path().join("programs");
    std::fs::create_dir(&programs).expect("a folder");
    let test = std::env::current_exe().expect("this test has a file");
    let stand_in = format!(
        "#!/bin/bash\nIFS=$'\\n'\nexport {}=\"$*\"\nexec '{}' --exact child --ignored --nocapture\n",
        crate::CHILD,
        text(&test)
    );
    let program = write(&programs, "concordem", &stand_in);
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("a file");
    let search = format!("{}:{}", text(&programs), std::env::var("PATH").unwrap_or_default());
    let run = |task: &str, arguments: &[&str]| {
        let mut command = Command::new("bash");
        command.arg(&path).args(arguments).env("PATH", &search).env("SLURM_ARRAY_TASK_ID", task);
        let output = command.current_dir(folder.path()).stdout(Stdio::null()).output().expect("a shell");
        (output.status.success(), String::from_utf8_lossy(&output.stderr).into_owned())
    };
    assert!(run("3", &[]).0);
    let (done, told) = run("1", &["merge"]);
    assert!(!done && told.contains("1/3, 2/3"), "{told}");
    for task in ["1", "2"] {
        assert!(run(task, &[]).0);
    }
    let (done, told) = run("1", &["merge"]);
    assert!(done, "{told}");
    let found = std::fs::read(sweep.with_extension("h5")).expect("the result");
    // The setting is the only difference.
    let plain =
        concordem(["sweep", "-q", text(&sweep), "--set", "title=a 'b'", "-o", text(&folder.path().join("p.h5"))]);
    assert_eq!(plain.code, exit::DONE, "{}", plain.err);
    assert!(found == std::fs::read(folder.path().join("p.h5")).expect("the result") && found != expected);
    assert!(sweep.with_extension("csv").exists() && !folder.path().join("x").exists());
}
