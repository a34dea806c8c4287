//! The files of a run under kill -9, full disks, and damage. A deterministic toy run with samples, events, and snapshots
//! replaces the solver; it commits every few steps.

mod interruption;
mod refusals;
mod results;

use std::process::{Command, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use super::*;
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::{Column, ColumnError, ColumnSink, ColumnSource};

const STEPS: u64 = 40;
const COMMIT_EVERY: u64 = 7;

/// Kills this process when it reaches the stage named by an environment variable for the n-th time.
pub(super) fn stage(name: &str) {
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
                    in_shear: x < 0.5,
                    energy: x * x,
                    damage: x,
                    joint: (k % 2 == 1).then_some(k as u16),
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
            let snapshot = Snapshot { time, step: self.step, id: &id, position: &position, cell: None, fields };
            files.append_snapshot(Arc::new(StoredSnapshot::of(&snapshot).unwrap())).unwrap();
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
        earlier: [("strain".into(), vec![0.0, -0.0, 0.5]), ("a stress".into(), vec![1.0, 2.0, f64::NAN])].into(),
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
