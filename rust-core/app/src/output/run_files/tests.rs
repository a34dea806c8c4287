//! The files of a run under kill -9, full disks, and damage. A deterministic toy run with samples, events, and snapshots
//! replaces the solver; it commits every few steps.

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use super::*;
use crate::output::{ResultFile, csv};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::{Column, ColumnData, ColumnError, ColumnSink, ColumnSource};

const STEPS: u64 = 40;
const COMMIT_EVERY: u64 = 7;

/// Kills this process when it reaches the stage named by an environment variable for the n-th time.
pub(in crate::output) fn stage(name: &str) {
    static PASSED: AtomicU32 = AtomicU32::new(0);
    let Ok(wanted) = std::env::var("CONCORDEM_TEST_KILL") else { return };
    let (stage, count) = wanted.rsplit_once(':').unwrap();
    if stage == name && PASSED.fetch_add(1, Ordering::Relaxed) + 1 == count.parse::<u32>().unwrap() {
        Command::new("kill").args(["-9", &std::process::id().to_string()]).status().unwrap();
        // The signal may arrive with a delay.
        std::thread::sleep(Duration::from_secs(60));
    }
}

#[derive(Debug, PartialEq)]
struct Toy {
    step: u64,
    x: Vec<f64>,
}

impl WriteColumns for Toy {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.column("clock/step", Column::u64(&[self.step]))?;
        sink.column("x", Column::f64(&self.x, 1, "m"))
    }
}

impl Toy {
    fn new() -> Self {
        Self { step: 0, x: (0..12).map(|k| 0.1 + 0.05 * f64::from(k)).collect() }
    }

    fn read(source: &mut dyn ColumnSource) -> Self {
        Self { step: source.u64("clock/step").unwrap()[0], x: source.f64("x").unwrap() }
    }

    /// The logistic map: the last bit of the state determines all later values.
    fn advance(&mut self, growth: usize) {
        self.step += 1;
        self.x.iter_mut().for_each(|x| *x = 3.9 * *x * (1.0 - *x));
        let longer = self.x.len() + growth;
        self.x.resize(longer, 0.5);
    }

    fn record(&self, files: &mut RunFiles) {
        let time = self.step as f64 * 0.5;
        files.append_sample(&[time, self.x[0], self.x[1]]).unwrap();
        for (k, &x) in self.x.iter().take(12).enumerate() {
            if x > 0.9 {
                files.append_event(Event {
                    time,
                    step: self.step,
                    id_a: k as u32,
                    id_b: k as u32 + 1,
                    position: Vec3::new(x, 0.0, 1.0),
                    mode_shares: [x, 1.0 - x, 0.0, 0.0],
                    energy: x * x,
                    damage: x,
                });
            }
        }
        if self.step.is_multiple_of(10) {
            // As in the solver, the order of particles changes, but their ids do not.
            let turn = (self.step / 10) as usize;
            // Two particles are added for a while.
            let count = if turn == 2 || turn == 3 { 14 } else { 12 };
            let id: Vec<u32> = (0..count).map(|k| (k + turn as u32) % count).collect();
            let x = |k: u32| self.x[k as usize % 12];
            let position: Vec<Vec3> = id.iter().map(|&k| Vec3::new(x(k), f64::from(k), time)).collect();
            let radius: Vec<f64> = id.iter().map(|&k| 1.0 + f64::from(k)).collect();
            let column = |data| Column::f64(data, 1, "m");
            let damage: Vec<f64> = id.iter().map(|&k| x(k)).collect();
            let fields = vec![
                SnapshotField { name: "radius", description: "Radius.", column: column(&radius) },
                SnapshotField { name: "damage", description: "", column: Column::f64(&damage, 1, "1") },
            ];
            files.append_snapshot(&Snapshot { time, step: self.step, id: &id, position: &position, fields }).unwrap();
        }
    }
}

/// Tables at the end.
struct Tables<'a>(&'a Toy);

impl WriteColumns for Tables<'_> {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.described_column("contacts/toy/x", Column::f64(&self.0.x, 1, "m"), "History of the toy.")?;
        sink.column("particles/id", Column::u32(&[3, 4]))
    }
}

fn header() -> RunHeader {
    RunHeader {
        scenario: "version = 1\n# ± ünïcode\n".into(),
        provenance: vec![("threads".into(), "2".into()), ("empty".into(), String::new())],
        series: vec![
            SeriesColumn::new("time", "s", "Time."),
            SeriesColumn::new("strain", "1", ""),
            SeriesColumn::new("a stress", "Pa", "Not in alphabetical order."),
        ],
        operators: vec![],
    }
}

/// Makes the first commit of a toy run.
fn begin(mut files: RunFiles) -> Result<(RunFiles, Toy), OutputError> {
    let toy = Toy::new();
    toy.record(&mut files);
    files.commit(&toy)?;
    Ok((files, toy))
}

/// Runs or resumes a toy run to its end.
fn run_toy(path: &Path, growth: usize) -> Result<(), OutputError> {
    let begun = parts_folder(path).exists() || path.exists();
    let (mut files, mut toy) = if begun {
        match RunFiles::resume(path)? {
            Resumed::Finished => return Ok(()),
            Resumed::Continue { files, mut checkpoint, .. } => {
                assert_eq!(files.header().scenario, header().scenario);
                assert_eq!(files.header().series, header().series);
                (*files, Toy::read(&mut checkpoint.columns))
            }
            Resumed::Begin { files } => {
                assert_eq!(files.header().scenario, header().scenario);
                begin(*files)?
            }
        }
    } else {
        begin(RunFiles::create(path, header(), false)?)?
    };
    while toy.step < STEPS {
        toy.advance(growth);
        toy.record(&mut files);
        if toy.step.is_multiple_of(COMMIT_EVERY) {
            files.commit(&toy)?;
        }
    }
    files.note("wall_time", &format!("{:?}", std::time::SystemTime::now()));
    files.finish(&toy, &Tables(&toy))
}

/// Runs in the child processes; does nothing when run with the other tests.
#[test]
fn child() {
    let Ok(path) = std::env::var("CONCORDEM_TEST_RUN") else { return };
    let path = Path::new(&path);
    let growth = std::env::var("CONCORDEM_TEST_GROWTH").map_or(0, |growth| growth.parse().unwrap());
    if let Err(error) = run_toy(path, growth) {
        eprintln!("RUN FAILED: {error}");
        // After the failure this process must still be able to use the library, and the last commit must be intact.
        match RunFiles::resume(path) {
            Ok(Resumed::Continue { checkpoint, .. }) => eprintln!("AT {}", checkpoint.state_hash),
            other => eprintln!("CANNOT RESUME: {other:?}"),
        }
        std::process::exit(3);
    }
}

fn child_command(path: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().unwrap());
    command.args(["--exact", "output::run_files::tests::child", "--nocapture", "--test-threads=1"]);
    command.env("CONCORDEM_TEST_RUN", path).stdout(Stdio::null()).stderr(Stdio::piped());
    command
}

/// Every dataset of a file: its path, type, shape, and value or hash.
fn contents(path: &Path) -> BTreeMap<String, String> {
    fn walk(group: &hdf5::Group, prefix: &str, path: &Path, found: &mut BTreeMap<String, String>) {
        for name in group.member_names().unwrap() {
            let full = format!("{prefix}/{name}");
            if let Ok(inner) = group.group(&name) {
                walk(&inner, &full, path, found);
                continue;
            }
            let dataset = group.dataset(&name).unwrap();
            let kind = dataset.dtype().unwrap().to_descriptor().unwrap();
            let value = match kind {
                hdf5::types::TypeDescriptor::VarLenUnicode => hdf::read_text(group, &name, path).unwrap(),
                hdf5::types::TypeDescriptor::Integer(hdf5::types::IntSize::U8) => {
                    format!("{:?}", hdf::read_array::<i64>(group, &name, path).unwrap())
                }
                _ => {
                    let column = hdf::read_column(group, &name, path).unwrap();
                    blake3::hash(column.borrow().bytes()).to_string()
                }
            };
            found.insert(full, format!("{kind} {:?} {value}", dataset.shape()));
        }
    }
    let mut found = BTreeMap::new();
    walk(&sealed::open(path).unwrap(), "", path, &mut found);
    found
}

fn undisturbed(folder: &Path, growth: usize) -> BTreeMap<String, String> {
    let path = folder.join("undisturbed.h5");
    run_toy(&path, growth).unwrap();
    contents(&path)
}

#[test]
fn the_result_holds_everything_that_was_appended() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    run_toy(&path, 0).unwrap();
    assert!(!parts_folder(&path).exists());
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "only the result remains");

    let result = ResultFile::open(&path).unwrap();
    assert_eq!(result.series(), header().series, "units, descriptions, and order of the run");
    let mut toy = Toy::new();
    let mut expected = vec![toy.x[1]];
    let mut events = 0;
    let mut last_event = 0.0;
    for _ in 0..STEPS {
        toy.advance(0);
        expected.push(toy.x[1]);
        for &x in toy.x.iter().filter(|x| **x > 0.9) {
            events += 1;
            last_event = x;
        }
    }
    assert_eq!(result.samples("a stress").unwrap(), expected);
    let read = result.events().unwrap();
    assert_eq!(read.len(), events);
    assert!(events > 10, "the toy must produce events");
    let last = read.last().unwrap();
    assert_eq!((last.damage, last.energy, last.position.x), (last_event, last_event * last_event, last_event));
    assert_eq!(last.mode_shares, [last_event, 1.0 - last_event, 0.0, 0.0]);
    assert_eq!(result.state_hash().unwrap(), crate::output::hash::state_hash(&toy).unwrap());
    assert_eq!(result.scenario().unwrap(), header().scenario);
    let provenance: BTreeMap<_, _> = result.provenance().unwrap().into_iter().collect();
    assert_eq!((&provenance["threads"][..], &provenance["empty"][..]), ("2", ""));
    assert_eq!(provenance["program"], crate::provenance::PROGRAM);
    assert!(provenance.contains_key("wall_time"));
    assert_eq!(result.laws().unwrap(), ["toy"]);
    assert_eq!(result.table("contacts/toy").unwrap()[0].1.data, ColumnData::F64(toy.x.clone()));
    assert_eq!(result.snapshot_times().unwrap(), [0.0, 5.0, 10.0, 15.0, 20.0]);
    // Radii change only with the number of particles (12, 12, 14, 14, 12) and are written three times, sorted by id; damage
    // is written five times.
    let fields: BTreeMap<_, _> = result.table("VTKHDF/PointData").unwrap().into_iter().collect();
    let radii = |count| (0..count).map(|k| 1.0 + f64::from(k));
    assert_eq!(fields["radius"].data, ColumnData::F64(radii(12).chain(radii(14)).chain(radii(12)).collect()));
    assert_eq!(fields["damage"].borrow().len(), 12 + 12 + 14 + 14 + 12);

    let text = csv::text(&result).unwrap();
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("time [s],strain [1],a stress [Pa]"));
    assert_eq!(lines.clone().count() as u64, STEPS + 1);
    let stress: Vec<f64> = lines.map(|line| line.rsplit(',').next().unwrap().parse().unwrap()).collect();
    assert_eq!(stress, expected, "the text restores the same bits");
    let error = result.samples("stress").unwrap_err().to_string();
    assert!(error.ends_with("has no `samples/stress`. It has: time, strain, a stress."), "{error}");
}

#[test]
fn two_runs_give_the_same_file_except_for_attributes() {
    let folder = tempfile::tempdir().unwrap();
    let first = undisturbed(folder.path(), 0);
    let other = folder.path().join("other.h5");
    run_toy(&other, 0).unwrap();
    assert_eq!(first, contents(&other));
    assert!(first.len() > 25, "{first:#?}");
}

#[test]
fn a_run_killed_at_any_stage_gives_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let expected = undisturbed(folder.path(), 0);
    let path = folder.path().join("killed.h5");
    let mut kills = 0;
    for stage in [
        "before segment",
        "within segment",
        "after segment",
        "after checkpoint",
        "before merge",
        "within merge",
        "after merge",
    ] {
        for count in 1.. {
            let killed = child_command(&path).env("CONCORDEM_TEST_KILL", format!("{stage}:{count}")).output().unwrap();
            if killed.status.success() {
                fs::remove_file(&path).unwrap();
                break;
            }
            assert_eq!(std::os::unix::process::ExitStatusExt::signal(&killed.status), Some(9), "{killed:?}");
            kills += 1;
            if path.exists() {
                assert_eq!(stage, "after merge");
                assert_eq!(contents(&path), expected);
            }
            let again = child_command(&path).output().unwrap();
            assert!(again.status.success(), "{stage} {count}: {again:?}");
            assert_eq!(contents(&path), expected, "{stage} {count}");
            assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "{stage} {count}: leftover files");
            fs::remove_file(&path).unwrap();
        }
    }
    // 7 commits (the first, five during the run, the last) with three stages per segment and one per checkpoint, and
    // 1 + 7 + 1 stages of the merge.
    assert_eq!(kills, 3 * 7 + 7 + 1 + 7 + 1);
}

#[test]
fn a_run_killed_repeatedly_at_random_times_gives_the_same_result() {
    let folder = tempfile::tempdir().unwrap();
    let expected = undisturbed(folder.path(), 2000);
    let path = folder.path().join("killed.h5");
    let (mut kills, mut delay) = (0, 3);
    for attempt in 0.. {
        assert!(attempt < 2000, "no progress");
        let mut child = child_command(&path).env("CONCORDEM_TEST_GROWTH", "2000").spawn().unwrap();
        std::thread::sleep(Duration::from_millis(delay));
        // Growing delays let the run finish on any machine.
        delay = (delay * 7) % 41 + 3 + attempt;
        if child.try_wait().unwrap().is_none() {
            child.kill().unwrap();
            kills += 1;
        }
        let output = child.wait_with_output().unwrap();
        if output.status.success() {
            break;
        }
        let complaint = String::from_utf8_lossy(&output.stderr);
        assert!(!complaint.contains("RUN FAILED"), "{complaint}");
    }
    assert!(kills > 3, "only {kills} kills");
    assert_eq!(contents(&path), expected);
}

#[test]
fn a_full_disk_leaves_the_last_commit_intact() {
    let folder = tempfile::tempdir().unwrap();
    // The state grows by 16 kB per step and reaches the limit of 256 KiB per file.
    let expected = undisturbed(folder.path(), 2000);
    let path = folder.path().join("full.h5");
    let inner = child_command(&path);
    let mut command = Command::new("bash");
    // Without the trap, the signal would end the process before the write fails.
    command
        .args(["-c", "trap '' XFSZ; ulimit -f 256; exec \"$@\"", "bash"])
        .arg(inner.get_program())
        .args(inner.get_args());
    command.env("CONCORDEM_TEST_RUN", &path).env("CONCORDEM_TEST_GROWTH", "2000").stdout(Stdio::null());
    let output = command.output().unwrap();
    let complaint = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(3), "{complaint}");
    assert!(complaint.contains("no space for") && complaint.contains("checkpoint-000"), "{complaint}");
    assert!(complaint.contains("File too large"), "{complaint}");
    assert!(complaint.contains("AT "), "{complaint}");
    let left: Vec<_> = fs::read_dir(parts_folder(&path)).unwrap().map(|entry| entry.unwrap().file_name()).collect();
    assert!(left.iter().all(|name| !name.to_string_lossy().starts_with(".unfinished")), "{left:?}");
    let again = child_command(&path).env("CONCORDEM_TEST_GROWTH", "2000").output().unwrap();
    assert!(again.status.success(), "{again:?}");
    assert_eq!(contents(&path), expected);
}

/// A run that ends after `commits` commits.
fn unfinished(path: &Path, commits: u64) {
    let mut files = RunFiles::create(path, header(), false).unwrap();
    let mut toy = Toy::new();
    for _ in 0..commits {
        toy.advance(0);
        toy.record(&mut files);
        files.commit(&toy).unwrap();
    }
}

#[test]
fn two_checkpoints_are_kept_and_the_older_one_replaces_a_damaged_newer_one() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    unfinished(&path, 5);
    let parts = parts_folder(&path);
    let checkpoints = list_numbered(&parts, "checkpoint").unwrap();
    assert_eq!(checkpoints.keys().copied().collect::<Vec<_>>(), [3, 4]);
    let mut bytes = fs::read(&checkpoints[&4]).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&checkpoints[&4], bytes).unwrap();
    let Resumed::Continue { files, mut checkpoint, unusable } = RunFiles::resume(&path).unwrap() else { panic!() };
    assert_eq!(Toy::read(&mut checkpoint.columns).step, 4);
    assert_eq!(files.segments, 4);
    assert!(unusable[0].to_string().contains("checkpoint-0004.h5 is damaged"), "{unusable:?}");
    assert_eq!(list_numbered(&parts, "segment").unwrap().len(), 4);
    // A process locks its run.
    assert!(matches!(RunFiles::resume(&path), Err(OutputError::Busy { .. })));
    assert!(matches!(RunFiles::create(&path, header(), true), Err(OutputError::Busy { .. })));
    drop(files);
    // A segment before the remaining checkpoint is lost: the run cannot be resumed, and the error says why.
    fs::remove_file(parts.join("segment-0001.h5")).unwrap();
    let error = RunFiles::resume(&path).unwrap_err().to_string();
    assert!(error.contains("segment-0001.h5 does not exist"), "{error}");
}

#[test]
fn files_of_another_run_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let (path, other) = (folder.path().join("run.h5"), folder.path().join("other.h5"));
    unfinished(&path, 2);
    unfinished(&other, 2);
    fs::copy(parts_folder(&other).join("segment-0000.h5"), parts_folder(&path).join("segment-0000.h5")).unwrap();
    let error = RunFiles::resume(&path).unwrap_err().to_string();
    assert!(error.contains("segment-0000.h5 is damaged: it belongs to another run"), "{error}");
}

#[test]
fn existing_results_are_overwritten_only_on_request() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    unfinished(&path, 1);
    let error = RunFiles::create(&path, header(), false).unwrap_err();
    assert!(matches!(error, OutputError::Unfinished { .. }), "{error}");
    let error = ResultFile::open(&path).unwrap_err();
    assert!(matches!(error, OutputError::Unfinished { .. }), "{error}");
    fs::remove_dir_all(parts_folder(&path)).unwrap();
    run_toy(&path, 0).unwrap();
    let first = fs::read(&path).unwrap();
    let error = RunFiles::create(&path, header(), false).unwrap_err().to_string();
    assert!(error.contains("--force"), "{error}");
    // An overwriting run keeps the old result until the new one is complete, even if the run is killed.
    let mut files = RunFiles::create(&path, header(), true).unwrap();
    let toy = Toy::new();
    toy.record(&mut files);
    files.commit(&toy).unwrap();
    drop(files);
    assert_eq!(fs::read(&path).unwrap(), first);
    let Resumed::Continue { files, .. } = RunFiles::resume(&path).unwrap() else { panic!("the new run is not done") };
    files.finish(&toy, &Tables(&toy)).unwrap();
    assert_eq!(ResultFile::open(&path).unwrap().samples("time").unwrap(), [0.0]);
    assert!(matches!(RunFiles::resume(&path), Ok(Resumed::Finished)));
}

#[test]
fn impossible_paths_and_names_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let create = |path: &Path| RunFiles::create(path, header(), false).unwrap_err();
    let error = create(&folder.path().join("none/run.h5"));
    assert!(matches!(error, OutputError::NoFolder { .. }), "{error}");
    let file = folder.path().join("file");
    fs::write(&file, "x").unwrap();
    let error = create(&file.join("run.h5"));
    assert!(matches!(error, OutputError::NotWritable { .. }), "{error}");
    assert!(matches!(create(folder.path()), OutputError::Name { .. }));
    let locked = folder.path().join("locked");
    fs::create_dir(&locked).unwrap();
    fs::set_permissions(&locked, std::os::unix::fs::PermissionsExt::from_mode(0o555)).unwrap();
    // The superuser may write anywhere.
    if fs::write(locked.join("probe"), "").is_err() {
        let error = create(&locked.join("run.h5"));
        assert!(matches!(error, OutputError::NotWritable { .. }), "{error}");
    }
    for name in ["", "a/b", ".", "a\0"] {
        let mut header = header();
        header.series[0].name = name.into();
        let error = RunFiles::create(&folder.path().join("run.h5"), header, false).unwrap_err();
        assert!(matches!(error, OutputError::Name { .. }), "{name:?}: {error}");
    }
    let mut twice = header();
    twice.series[1].name = "time".into();
    let error = RunFiles::create(&folder.path().join("run.h5"), twice, false).unwrap_err().to_string();
    assert_eq!(error, "`time` cannot name a series: another has the same name.");
    let error = RunFiles::resume(&folder.path().join("never.h5")).unwrap_err();
    assert!(matches!(error, OutputError::Missing { .. }), "{error}");
}

struct Elsewhere;
impl WriteColumns for Elsewhere {
    fn write(&self, sink: &mut dyn ColumnSink) -> Result<(), ColumnError> {
        sink.column("VTKHDF/Points", Column::u8(&[1]))
    }
}

#[test]
fn wrong_rows_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mut files = RunFiles::create(&folder.path().join("run.h5"), header(), false).unwrap();
    let error = files.append_sample(&[1.0, 2.0]).unwrap_err().to_string();
    assert_eq!(error, "a sample has 2 values, but the run has 3 series");
    let position = [Vec3::zeros(), Vec3::x()];
    let snapshot = |name, data| Snapshot {
        time: 0.0,
        step: 5,
        id: &[1, 0],
        position: &position,
        fields: vec![SnapshotField { name, description: "", column: Column::f64(data, 1, "m") }],
    };
    let error = files.append_snapshot(&snapshot("radius", &[1.0])).unwrap_err().to_string();
    assert_eq!(error, "snapshot at step 5: the field `radius` has 1 rows for 2 particles");
    files.append_snapshot(&snapshot("radius", &[1.0, 2.0])).unwrap();
    let error = files.append_snapshot(&snapshot("size", &[1.0, 2.0])).unwrap_err().to_string();
    assert!(error.contains("size (1 f64); the first had"), "{error}");
    let error = files.append_snapshot(&snapshot("id", &[1.0, 2.0])).unwrap_err().to_string();
    assert_eq!(error, "snapshot at step 5: the field `id` appears twice");
    let toy = Toy::new();
    let error = files.finish(&toy, &Elsewhere).unwrap_err().to_string();
    assert!(error.contains("final columns must be below cell or contacts or particles"), "{error}");
}

/// Rows are read back for the right operator, although HDF5 lists `operator-1000` before `operator-101`. The same holds for
/// quantities, series, provenance, and snapshots.
#[test]
fn more_than_a_thousand_operators_keep_their_rows() {
    const COUNT: usize = 1203;
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("run.h5");
    let mut header = header();
    header.operators = (0..COUNT)
        .map(|k| OperatorTable {
            name: format!("probe {k}"),
            description: String::new(),
            quantities: vec![(SeriesColumn::new("value", "1", ""), 1)],
        })
        .collect();
    let rows = |files: &mut RunFiles, step: u64| {
        for k in 0..COUNT {
            files.append_operator(k, step as f64, step, &[(k as u64 + 10_000 * step) as f64]).unwrap();
        }
    };
    let toy = Toy::new();
    let mut files = RunFiles::create(&path, header.clone(), false).unwrap();
    rows(&mut files, 0);
    files.commit(&toy).unwrap();
    drop(files);
    let Resumed::Continue { mut files, .. } = RunFiles::resume(&path).unwrap() else { panic!() };
    assert_eq!(files.header().operators, header.operators, "the order of the run");
    rows(&mut files, 1);
    files.finish(&toy, &Tables(&toy)).unwrap();
    let result = ResultFile::open(&path).unwrap();
    for k in 0..COUNT {
        let table = result.table(&format!("samples/probe {k}")).unwrap();
        let (_, column) = table.iter().find(|(name, _)| name == "value").unwrap();
        assert_eq!(column.data, ColumnData::F64(vec![k as f64, (k + 10_000) as f64]), "operator {k}");
    }
}

/// A symbolic link to a result stays, and its target is replaced; devices, pipes, and other folders are refused.
#[test]
fn only_regular_files_and_own_folders_are_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let (link, real) = (folder.path().join("link.h5"), folder.path().join("real.h5"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink("real.h5", &link).unwrap();
    assert!(matches!(RunFiles::create(&link, header(), false), Err(OutputError::Exists { .. })));
    let toy = Toy::new();
    RunFiles::create(&link, header(), true).unwrap().finish(&toy, &Tables(&toy)).unwrap();
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert!(ResultFile::open(&real).is_ok() && ResultFile::open(&link).is_ok());
    let pipe = folder.path().join("pipe.h5");
    assert!(Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let error = RunFiles::create(&pipe, header(), true).unwrap_err();
    assert!(matches!(error, OutputError::NotReplaceable { .. }), "{error}");
    let error = RunFiles::create(Path::new("/dev/null"), header(), true).unwrap_err();
    assert!(matches!(error, OutputError::NotReplaceable { .. }), "{error}");
    let mine = parts_folder(&folder.path().join("other.h5"));
    fs::create_dir(&mine).unwrap();
    fs::write(mine.join("thesis.txt"), "precious").unwrap();
    let error = RunFiles::create(&folder.path().join("other.h5"), header(), true).unwrap_err();
    assert!(error.to_string().contains("thesis.txt"), "{error}");
    assert!(mine.join("thesis.txt").exists());
}

/// The next run removes files that a killed process left beside the result, but not files that a running process has locked.
#[test]
fn leftovers_of_killed_processes_are_removed() {
    let folder = tempfile::tempdir().unwrap();
    let old = std::time::SystemTime::now() - Duration::from_secs(3600);
    let age = |path: &Path| File::open(path).unwrap().set_modified(old).unwrap();
    let make = |name: &str| {
        let path = folder.path().join(name);
        fs::create_dir(&path).unwrap();
        fs::write(path.join("lock"), "").unwrap();
        age(&path);
        path
    };
    let (dead, alive) = (make(".unfinished-dead"), make(".unfinished-alive"));
    let held = lock(&alive).unwrap();
    age(&alive);
    let text = folder.path().join(".unfinished-text");
    fs::write(&text, "half").unwrap();
    age(&text);
    let young = folder.path().join(".unfinished-young");
    fs::write(&young, "now").unwrap();
    run_toy(&folder.path().join("run.h5"), 0).unwrap();
    assert!(!dead.exists() && !text.exists(), "leftovers are not removed");
    assert!(alive.exists() && young.exists(), "files in use are removed");
    drop(held);
}
