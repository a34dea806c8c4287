//! Sweeps of whole runs: any scenario, any scalar result, in parallel, resumable.

use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::PRISM;

const SWEEP: &str = "version = 1\nscenario = \"prism.toml\"\nstudy = \"run\"\n\
    results = [\"E\", \"max stress\", \"last broken\", \"mean region-stress stress_zz\", \"boundary_work\"]\n\
    [[axis]]\nkey = \"material[0].cpm.young\"\nvalues = [\"25 GPa\", \"30 GPa\"]\n\
    [[axis]]\nkey = \"loading.strain_rate\"\nvalues = [2, -2]\n";

fn files(folder: &Path) {
    write(folder, "prism.toml", &PRISM.replace("STEPS", "900"));
    write(folder, "s.toml", SWEEP);
}

/// The numbers of every point are those of the run of the same scenario.
#[test]
fn points_have_the_numbers_of_runs() {
    let folder = TempDir::new().expect("a temporary folder");
    files(folder.path());
    let given = concordem(["sweep", "--csv", text(&folder.path().join("s.toml"))]);
    assert_eq!(given.code, exit::DONE, "{}", given.err);
    let table = std::fs::read_to_string(folder.path().join("s.csv")).expect("a table");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), 5, "{table}");
    assert_eq!(&rows[0][2..7], ["E", "max stress", "last broken", "mean region-stress stress_zz", "boundary_work"]);
    for row in &rows[1..] {
        let young = format!("material[0].cpm.young={}", row[0].trim_matches('"'));
        let rate = format!("loading.strain_rate={}", row[1]);
        let (scenario, result) = (folder.path().join("prism.toml"), folder.path().join("one.h5"));
        let run = ["run", "-q", "--force", text(&scenario), "-o", text(&result), "--set", &young, "--set", &rate];
        assert_eq!(concordem(run).code, exit::DONE);
        let file = ResultFile::open(&result).expect("a result");
        let stress = file.samples("stress").expect("stresses").into_iter().fold(f64::NEG_INFINITY, f64::max);
        let work = *file.samples("boundary_work").expect("work").last().expect("a record");
        let number = |k: usize| -> f64 { row[k].parse().expect("a number") };
        assert_eq!((number(3).to_bits(), number(6).to_bits()), (stress.to_bits(), work.to_bits()), "{row:?}");
        let zz = file.rows("samples/region-stress").expect("a table");
        let zz = match &zz.iter().find(|(name, _)| name == "stress").expect("stresses").1.data {
            concordem::state::columns::ColumnData::F64(data) => {
                data.iter().skip(8).step_by(9).copied().collect::<Vec<_>>()
            }
            other => panic!("{other:?}"),
        };
        let mean = zz.iter().sum::<f64>() / zz.len() as f64;
        assert!((number(5) - mean).abs() <= 1e-12 * mean.abs(), "{row:?} {mean}");
        let young: f64 = number(2);
        assert!(young > 1e9 && young < 1e11, "{row:?}");
    }
}

/// Any number of threads, and an interruption that left half of the points, give the same bytes.
#[test]
fn threads_and_interruptions_do_not_change_the_table() {
    let table = |threads: &str, keep: Option<usize>| {
        let folder = TempDir::new().expect("a temporary folder");
        files(folder.path());
        let sweep = folder.path().join("s.toml");
        let run = || concordem(["sweep", "--csv", "-q", "-j", threads, text(&sweep)]);
        if let Some(points) = keep {
            // The journal of a killed sweep: take that of a whole one, and cut it.
            let mut child = crate::spawn(&["sweep", "--csv", "-q", "-j", "1", text(&sweep)]);
            let journal = folder.path().join("s.h5.points");
            for _ in 0..2000 {
                if std::fs::read_to_string(&journal).is_ok_and(|text| text.lines().count() > points) {
                    break;
                }
                std::thread::sleep(std::time::Duration::from_millis(5));
            }
            child.kill().expect("a child");
            child.wait().expect("it ends");
        }
        let given = run();
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        std::fs::read_to_string(folder.path().join("s.csv")).expect("a table")
    };
    let one = table("1", None);
    assert_eq!(table("3", None), one);
    assert_eq!(table("2", Some(2)), one);
}

/// Unknown results are refused with those that exist; `results` needs runs.
#[test]
fn unknown_results_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    files(folder.path());
    let refuse = |from: &str, to: &str, message: &str| {
        let path = write(folder.path(), "wrong.toml", &SWEEP.replace(from, to));
        let given = concordem(["sweep", text(&path)]);
        assert_eq!(given.code, exit::USAGE, "{}", given.err);
        assert!(given.err.replace("\n  | ", " ").contains(message), "{message}: {}", given.err);
    };
    refuse("\"max stress\"", "\"max stres\"", "no result `max stres`");
    refuse("study = \"run\"\n", "", "only the study \"run\" records results");
    refuse(
        "study = \"run\"\n",
        "study = \"run\"\ndynamics = true\n",
        "only the study \"elastic\" computes a stiffness",
    );
}
