//! Runs the stock LIGGGHTS with our library and reads what it writes.
#![allow(dead_code)] // each test uses a part

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use concordem::math::Vec3;

/// Seconds after which a run counts as hanging.
const LIMIT: &str = "300";

/// The launcher; tests fail, not skip, without it.
fn launcher() -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
    let launcher = target.join("liggghts/concordem-liggghts");
    assert!(launcher.exists(), "{} is missing: run liggghts-bridge/build first", launcher.display());
    launcher
}

/// Run a script in `folder` on `processors`; the output whatever the outcome. Fails on a hang.
pub fn attempt(folder: &Path, script: &str, processors: usize) -> Output {
    let path = folder.join(format!("script.{processors}.in"));
    std::fs::write(&path, script).unwrap();
    let output = Command::new("timeout")
        .args(["-k", "5", LIMIT, "mpirun", "--oversubscribe", "--mca", "mpi_yield_when_idle", "1", "-np"])
        .arg(processors.to_string())
        .arg(launcher())
        .arg(&path)
        .args(["-log", "none"])
        .current_dir(folder)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        .output()
        .expect("timeout and mpirun (Debian packages coreutils, openmpi-bin) are needed");
    assert!(!matches!(output.status.code(), Some(124 | 137)), "hangs on {processors} processors: {script}");
    output
}

/// What a run printed.
pub fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Run a script that must succeed; what it printed.
pub fn run(folder: &Path, script: &str, processors: usize) -> String {
    let output = attempt(folder, script, processors);
    let printed = text(&output);
    assert!(output.status.success() && !printed.contains("ERROR"), "on {processors} processors:\n{printed}\n{script}");
    printed
}

/// An atom of a data file.
#[derive(Clone, Copy)]
pub struct Atom {
    pub kind: usize,
    pub position: Vec3,
    pub velocity: Vec3,
    pub spin: Vec3,
    pub radius: f64,
    pub density: f64,
}

impl Atom {
    pub fn resting(position: Vec3, radius: f64) -> Self {
        Self { kind: 1, position, velocity: Vec3::zeros(), spin: Vec3::zeros(), radius, density: 2500.0 }
    }
}

/// A LIGGGHTS data file; ids are 1, 2, … in order.
pub fn data_file(path: &Path, atoms: &[Atom], low: Vec3, high: Vec3) {
    let kinds = atoms.iter().map(|a| a.kind).max().unwrap_or(1);
    let mut out = format!("atoms\n\n{} atoms\n{kinds} atom types\n\n", atoms.len());
    for (axis, k) in ["x", "y", "z"].iter().zip(0..) {
        writeln!(out, "{:e} {:e} {axis}lo {axis}hi", low[k], high[k]).unwrap();
    }
    out.push_str("\nAtoms\n\n");
    for (i, a) in atoms.iter().enumerate() {
        let x = a.position;
        writeln!(out, "{} {} {:e} {:e} {:e} {:e} {:e}", i + 1, a.kind, 2.0 * a.radius, a.density, x.x, x.y, x.z)
            .unwrap();
    }
    out.push_str("\nVelocities\n\n");
    for (i, a) in atoms.iter().enumerate() {
        let (v, w) = (a.velocity, a.spin);
        writeln!(out, "{} {:e} {:e} {:e} {:e} {:e} {:e}", i + 1, v.x, v.y, v.z, w.x, w.y, w.z).unwrap();
    }
    std::fs::write(path, out).unwrap();
}

/// The beginning of a script that reads `data`, up to the neighbour lists; `skin` in m.
pub fn head(data: &str, boundary: &str, skin: f64, dt: f64) -> String {
    format!(
        "units si\natom_style sphere\natom_modify map array sort 0 0\nboundary {boundary}\nnewton off\n\
         communicate single vel yes\nread_data {data}\nneighbor {skin:e} bin\nneigh_modify delay 0\ntimestep {dt:e}\n"
    )
}

/// A dump of positions, velocities, spins, forces, and torques with all digits, sorted by id, every `every` steps.
pub fn dump(file: &str, every: usize) -> String {
    format!(
        "dump d all custom {every} {file} id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz\n\
         dump_modify d sort id format \"%d{}\"\n",
        " %.17g".repeat(15)
    )
}

/// One atom of a dump.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dumped {
    pub position: Vec3,
    pub velocity: Vec3,
    pub spin: Vec3,
    pub force: Vec3,
    pub torque: Vec3,
}

/// The frames of a dump: step and atoms by id.
pub fn frames(path: &Path) -> Vec<(u64, Vec<Dumped>)> {
    let content = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let mut frames: Vec<(u64, Vec<Dumped>)> = Vec::new();
    let mut lines = content.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("ITEM: TIMESTEP") {
            frames.push((lines.next().unwrap().trim().parse().unwrap(), Vec::new()));
        } else if line.starts_with("ITEM") && !line.starts_with("ITEM: ATOMS") {
            let skip = if line.contains("NUMBER") { 1 } else { 3 };
            for _ in 0..skip {
                lines.next();
            }
        } else if !line.starts_with("ITEM") {
            let n: Vec<f64> = line.split_whitespace().map(|w| w.parse().unwrap()).collect();
            let v = |k: usize| Vec3::new(n[k], n[k + 1], n[k + 2]);
            let atom = Dumped { position: v(1), velocity: v(4), spin: v(7), force: v(10), torque: v(13) };
            frames.last_mut().unwrap().1.push(atom);
        }
    }
    frames
}

/// Rows of thermo output: numbers of all lines that begin with a step, in order.
pub fn thermo(printed: &str) -> Vec<Vec<f64>> {
    let mut rows = Vec::new();
    let mut columns = 0;
    for line in printed.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        if words.first() == Some(&"Step") {
            columns = words.len();
        } else if columns > 0 && words.len() == columns {
            let numbers: Vec<f64> = words.iter().filter_map(|w| w.parse().ok()).collect();
            if numbers.len() == columns {
                rows.push(numbers);
            }
        }
    }
    rows
}

/// Numbers in [0, 1) that are the same everywhere.
pub struct Dice(pub u64);

impl Dice {
    pub fn roll(&mut self) -> f64 {
        // splitmix64
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
    /// A vector with components between −1 and 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::from_fn(|_, _| 2.0 * self.roll() - 1.0)
    }
}
