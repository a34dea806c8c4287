//! Runs the stock LIGGGHTS and LAMMPS with our libraries and reads their output.

pub mod decks;
pub mod lammps;
pub mod record;
pub mod spheres;

use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};
use std::sync::LazyLock;

use concordem_contact::math::Vec3;

/// Seconds after which a run counts as hanging: ten times the duration on four processors on two busy cores.
const LIMIT: &str = "900";

/// The host program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Host {
    /// The Debian program, through our launcher.
    Liggghts,
    /// The program in `.venv-lammps`, with our plugin and its own MPI; or, see `lammps()`, another one.
    Lammps,
}

/// LAMMPS on `processors` processors with our plugin. `CONCORDEM_LAMMPS` names another program than the one of `.venv-lammps`, for which
/// `liggghts-bridge/lammps/build PROGRAM HEADERS` built the plugin; `CONCORDEM_MPIRUN` names its launcher (default `mpirun`).
fn lammps(processors: usize) -> Command {
    let plugin = |folder| {
        let plugin = built(&format!("{folder}/concordemplugin.so"), "liggghts-bridge/lammps/build");
        plugin.parent().unwrap().to_owned()
    };
    let mut command = limited();
    if let Some(program) = std::env::var_os("CONCORDEM_LAMMPS") {
        let program = PathBuf::from(program);
        assert!(program.is_absolute(), "CONCORDEM_LAMMPS={}: give an absolute path", program.display());
        let launcher = PathBuf::from(std::env::var_os("CONCORDEM_MPIRUN").unwrap_or_else(|| "mpirun".into()));
        // A name without a folder is looked up in PATH.
        assert!(
            launcher.is_absolute() || launcher.components().count() == 1,
            "CONCORDEM_MPIRUN={}: give an absolute path",
            launcher.display()
        );
        launched(&mut command, &launcher, processors).arg(program).env("LAMMPS_PLUGIN_PATH", plugin("lammps-own"));
        return command;
    }
    let venv = Path::new(env!("CARGO_MANIFEST_DIR")).join("../.venv-lammps");
    let libraries = venv.join("lib");
    // Its script `lmp` starts Python, which takes half of the time of a short run, and then this program.
    let versions = std::fs::read_dir(&libraries).into_iter().flatten().flatten();
    let program = versions.map(|version| version.path().join("site-packages/lammps/lmp")).find(|path| path.exists());
    let program = program.unwrap_or_else(|| panic!("{} has no LAMMPS: run .ci/setup lammps first", venv.display()));
    launched(&mut command, &venv.join("bin/mpirun"), processors)
        .arg(program)
        .envs([("LAMMPS_PLUGIN_PATH", plugin("lammps")), ("LD_LIBRARY_PATH", libraries)]);
    command
}

/// Lets a launcher start the program that is added to the command, unless it is to run on one processor.
fn launched<'a>(command: &'a mut Command, launcher: &Path, processors: usize) -> &'a mut Command {
    if processors > 1 {
        command.arg(launcher).args(["-np", &processors.to_string()]).env("LD_PRELOAD", &*SLEEP);
    }
    command
}

/// A library in which a process of MPI that waits for a message sleeps. Else it polls and yields: on a busy machine, each process that waits then
/// takes a share of a processor from the one that works. 2,000 steps of 216 spheres on two busy processors (load 12 to 20): 2 to 7 instead of 14 to 42 s
/// on two processes, 3 instead of 48 to 64 s on four.
static SLEEP: LazyLock<PathBuf> = LazyLock::new(|| {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/harness/sleep.c");
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR"));
    let (library, own) = (folder.join("sleep.so"), folder.join(format!("sleep-{}.so", std::process::id())));
    let compiled = Command::new("mpicc").args(["-O2", "-shared", "-fPIC", "-o"]).arg(&own).arg(&source).status();
    assert!(compiled.expect("mpicc (Debian package libopenmpi-dev) is needed").success(), "{}", source.display());
    // Tests at the same time write the same.
    std::fs::rename(own, &library).unwrap();
    library
});

/// Path of a file that build script `script` creates. Panics if it is missing.
pub fn built(name: &str, script: &str) -> PathBuf {
    let target = std::env::var_os("CARGO_TARGET_DIR")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target"), PathBuf::from);
    let file = target.join(name);
    assert!(file.exists(), "{} is missing: run {script} first", file.display());
    file.canonicalize().unwrap()
}

/// The start of a command that is ended, with code 124 or 137, when it hangs.
fn limited() -> Command {
    let mut command = Command::new("timeout");
    command.args(["-k", "5", LIMIT]);
    command
}

/// Debian's MPI, which starts the program that is added to this command on `processors` processors; on one, the program starts alone, as
/// the launcher takes longer than a short run.
pub fn open_mpi(processors: usize) -> Command {
    let mut command = limited();
    if processors > 1 {
        // Other tests run at the same time: two processes, too, find no two idle processors.
        command
            .args(["mpirun", "--oversubscribe", "--bind-to", "none", "--mca", "mpi_yield_when_idle", "1", "-np"])
            .arg(processors.to_string())
            .env("LD_PRELOAD", &*SLEEP);
    }
    command.envs([
        // Open MPI looks for no network, and waits for no second before it kills the processes that are left when one has failed: a
        // refusal takes 0.5 instead of 1.5 s, any other start half as long.
        ("OMPI_MCA_pml", "ob1"),
        ("OMPI_MCA_btl", "self,vader"),
        ("OMPI_MCA_odls_base_sigkill_timeout", "0"),
        // A program that starts alone starts no other one to watch over it.
        ("OMPI_MCA_ess_singleton_isolated", "1"),
    ]);
    command
}

/// Run a LIGGGHTS script in `folder` on `processors` processors; it may fail. Panics if it hangs.
pub fn attempt(folder: &Path, script: &str, processors: usize) -> Output {
    attempt_in(Host::Liggghts, folder, script, processors)
}

/// Run a script in `folder` on `processors` processors; it may fail. Panics if it hangs.
pub fn attempt_in(host: Host, folder: &Path, script: &str, processors: usize) -> Output {
    let path = folder.join(format!("script.{processors}.in"));
    std::fs::write(&path, script).unwrap();
    let mut command = match host {
        Host::Liggghts => {
            let mut command = open_mpi(processors);
            command.arg(built("liggghts/concordem-liggghts", "liggghts-bridge/build")).arg(&path);
            command
        }
        Host::Lammps => {
            let mut command = lammps(processors);
            command
                .arg("-in")
                .arg(&path)
                // MPICH polls without end while it waits. With more processes than idle processors each message then costs a time slice: ten
                // times the wall time of four processes on two processors.
                .env("MPIR_CVAR_CH4_PROGRESS_THROTTLE", "1")
                .env("MPIR_CVAR_CH4_PROGRESS_THROTTLE_NO_PROGRESS_COUNT", "1");
            command
        }
    };
    command
        .args(["-log", "none"])
        // More processes than processors, also with an Open MPI 4 or 5 of the user's LAMMPS.
        .env("OMPI_MCA_rmaps_base_oversubscribe", "1")
        .env("PRTE_MCA_rmaps_default_mapping_policy", ":oversubscribe")
        .current_dir(folder)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        // Open MPI 4 fails if two runs create or remove its common folder below /tmp at the same time.
        .env("OMPI_MCA_orte_tmpdir_base", folder)
        // Memory that a program reads before it writes it has the same content in each run: negative integers, huge numbers.
        .env("MALLOC_PERTURB_", "1");
    let mut once = || command.output().expect("timeout and mpirun (Debian packages coreutils, openmpi-bin) are needed");
    let mut output = once();
    // On a busy machine a launcher may lose the last words of a process that ends the others. They say why.
    let is_mute =
        |output: &Output| processors > 1 && output.status.code() == Some(1) && !text(output).contains("ERROR");
    for _ in 0..2 {
        if is_mute(&output) {
            output = once();
        }
    }
    assert!(!matches!(output.status.code(), Some(124 | 137)), "hangs on {processors} processors: {script}");
    output
}

/// What the program says about itself: its styles.
pub fn help(host: Host) -> String {
    let mut command = match host {
        Host::Liggghts => {
            let mut command = open_mpi(1);
            command.arg(std::env::var_os("LIGGGHTS").unwrap_or_else(|| "liggghts".into()));
            command
        }
        Host::Lammps => lammps(1),
    };
    command.arg("-help").env("OMPI_ALLOW_RUN_AS_ROOT", "1").env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1");
    text(&command.output().expect("timeout (Debian package coreutils) is needed"))
}

/// Change the version in the head of our fix in a restart file. The head starts with the version, whether bonds were created (an
/// `int` each), the bond law, and the contact law (32 bytes each).
pub fn set_restart_version(file: &Path, law: &str, version: i32) {
    let mut bytes = std::fs::read(file).unwrap();
    let mut name = [0; 32];
    name[..law.len()].copy_from_slice(law.as_bytes());
    let is_head = |at: &usize| bytes[at - 8..].starts_with(&7_i32.to_le_bytes()) && bytes[*at..].starts_with(&name);
    let places: Vec<usize> = (8..bytes.len() - name.len()).filter(is_head).collect();
    let [at] = places[..] else { panic!("{places:?} look like heads of the present version") };
    bytes[at - 8..at - 4].copy_from_slice(&version.to_le_bytes());
    std::fs::write(file, bytes).unwrap();
}

/// Standard output and standard error of a run.
pub fn text(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr)
}

/// Run a LIGGGHTS script that must succeed, and return its output.
pub fn run(folder: &Path, script: &str, processors: usize) -> String {
    run_in(Host::Liggghts, folder, script, processors)
}

/// Run a script that must succeed, and return its output.
pub fn run_in(host: Host, folder: &Path, script: &str, processors: usize) -> String {
    let output = attempt_in(host, folder, script, processors);
    let printed = text(&output);
    assert!(output.status.success() && !printed.contains("ERROR"), "on {processors} processors:\n{printed}\n{script}");
    printed
}

/// Run scripts that must succeed one after the other in one start of the program, which takes longer than short scripts; returns the output.
pub fn run_together(host: Host, folder: &Path, scripts: &[String], processors: usize) -> String {
    let output = attempt_in(host, folder, &(scripts.join("clear\n") + "\n"), processors);
    let printed = text(&output);
    let end = printed.find("ERROR").unwrap_or(printed.len());
    assert!(
        output.status.success() && end == printed.len(),
        "on {processors} processes:\n{}",
        &printed[printed[..end].len().saturating_sub(1500)..(end + 400).min(printed.len())]
    );
    printed
}

/// Run each script on two processors, where a refusal could also hang; it must fail, and print the text beside it. Two scripts run at a
/// time, each half in a folder of its own, in which `prepare` writes the files that they read.
pub fn refused_in(host: Host, cases: &[(String, &str)], prepare: impl Fn(&Path) + Sync) {
    std::thread::scope(|scope| {
        for half in 0..2 {
            let prepare = &prepare;
            scope.spawn(move || {
                let folder = tempfile::tempdir().unwrap();
                prepare(folder.path());
                for (script, wanted) in cases.iter().skip(half).step_by(2) {
                    let output = attempt_in(host, folder.path(), script, 2);
                    let printed = text(&output);
                    assert!(
                        !output.status.success() && printed.contains("ERROR") && printed.contains(wanted),
                        "`{wanted}` is not in\n{printed}\n{script}"
                    );
                }
            });
        }
    });
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

/// Write a LIGGGHTS data file; ids are 1, 2, … in order.
pub fn data_file(path: &Path, atoms: &[Atom], low: Vec3, high: Vec3) {
    data_file_for(Host::Liggghts, path, atoms, &[], low, high);
}

/// Write a data file for `host`; ids are 1, 2, … in order. LAMMPS atoms have style bpm/sphere and may have `bonds`.
pub fn data_file_for(host: Host, path: &Path, atoms: &[Atom], bonds: &[[usize; 2]], low: Vec3, high: Vec3) {
    let kinds = atoms.iter().map(|a| a.kind).max().unwrap_or(1);
    let mut out = format!("atoms\n\n{} atoms\n{kinds} atom types\n", atoms.len());
    if host == Host::Lammps {
        writeln!(out, "{} bonds\n1 bond types\n20 extra bond per atom", bonds.len()).unwrap();
        writeln!(out, "20 extra special per atom").unwrap();
    }
    out.push('\n');
    for (axis, k) in ["x", "y", "z"].iter().zip(0..) {
        writeln!(out, "{:e} {:e} {axis}lo {axis}hi", low[k], high[k]).unwrap();
    }
    out.push_str("\nAtoms\n\n");
    for (i, a) in atoms.iter().enumerate() {
        let x = a.position;
        let molecule = if host == Host::Lammps { "1 " } else { "" };
        let (id, diameter) = (i + 1, 2.0 * a.radius);
        writeln!(out, "{id} {molecule}{} {diameter:e} {:e} {:e} {:e} {:e}", a.kind, a.density, x.x, x.y, x.z).unwrap();
    }
    out.push_str("\nVelocities\n\n");
    for (i, a) in atoms.iter().enumerate() {
        let (v, w) = (a.velocity, a.spin);
        writeln!(out, "{} {:e} {:e} {:e} {:e} {:e} {:e}", i + 1, v.x, v.y, v.z, w.x, w.y, w.z).unwrap();
    }
    if !bonds.is_empty() {
        out.push_str("\nBonds\n\n");
        for (k, [a, b]) in bonds.iter().enumerate() {
            writeln!(out, "{} 1 {a} {b}", k + 1).unwrap();
        }
    }
    std::fs::write(path, out).unwrap();
}

/// [`head`] for `host`.
pub fn head_for(host: Host, data: &str, boundary: &str, skin: f64, dt: f64) -> String {
    match host {
        Host::Liggghts => head(data, boundary, skin, dt),
        Host::Lammps => format!(
            "units si\natom_style bpm/sphere\natom_modify sort 0 0\nboundary {boundary}\nnewton off\n\
             comm_modify vel yes\nspecial_bonds lj 0 1 1 coul 0 1 1\nread_data {data}\nneighbor {skin:e} bin\nneigh_modify every 1 delay 0\n\
             timestep {dt:e}\n"
        ),
    }
}

/// First part of a script, up to the neighbor lists; it reads `data`. `skin` in m, `dt` in s.
pub fn head(data: &str, boundary: &str, skin: f64, dt: f64) -> String {
    format!(
        "units si\natom_style sphere\natom_modify sort 0 0\nboundary {boundary}\nnewton off\n\
         communicate single vel yes\nread_data {data}\nneighbor {skin:e} bin\nneigh_modify delay 0\ntimestep {dt:e}\n"
    )
}

/// Dump positions, velocities, angular velocities, forces, and torques with all digits, sorted by id, every `every` steps.
pub fn dump(file: &str, every: usize) -> String {
    dump_for(Host::Liggghts, file, every)
}

/// [`dump`] for `host`.
pub fn dump_for(host: Host, file: &str, every: usize) -> String {
    let format = match host {
        Host::Liggghts => format!("format \"%d{}\"", " %.17g".repeat(15)),
        Host::Lammps => "format float %.17g".to_owned(),
    };
    format!(
        "dump d all custom {every} {file} id x y z vx vy vz omegax omegay omegaz fx fy fz tqx tqy tqz\n\
         dump_modify d sort id {format}\n"
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

/// The frames of a dump: step, and atoms sorted by id.
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

/// The rows of any dump: step, and numbers.
pub fn tables(path: &Path) -> Vec<(u64, Vec<Vec<f64>>)> {
    let content = std::fs::read_to_string(path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
    let is_header = |line: &&str| line.starts_with("ITEM: ATOMS") || line.starts_with("ITEM: ENTRIES");
    let numbers = |row: &str| row.split_whitespace().map(|word| word.parse().unwrap()).collect();
    let part = |part: &str| {
        let step = part.lines().next().unwrap().trim().parse().unwrap();
        (step, part.lines().skip_while(|line| !is_header(line)).skip(1).map(numbers).collect())
    };
    content.split("ITEM: TIMESTEP\n").skip(1).map(part).collect()
}

/// The largest difference of two lists of atoms, without ids: columns in threes, each relative to the largest magnitude; those at `spin`, if any,
/// and their torques (six columns on) also relative to the motion of a surface at `radius` (m). Infinite if the atoms or the columns are others.
pub fn apart(a: &[Vec<f64>], b: &[Vec<f64>], spin: Option<usize>, radius: f64) -> f64 {
    if a.len() != b.len() || a.iter().zip(b).any(|(a, b)| a[0] != b[0] || a.len() != b.len()) {
        return f64::INFINITY;
    }
    let largest =
        |at: usize| b.iter().flat_map(|row| row.iter().skip(at).take(3)).fold(0.0f64, |most, x| most.max(x.abs()));
    let mut worst = 0.0f64;
    for at in (1..b.first().map_or(1, Vec::len)).step_by(3) {
        let size = match spin {
            Some(spin) if at == spin => largest(at).max(largest(at - 3) / radius),
            Some(spin) if at == spin + 6 => largest(at).max(largest(at - 3) * radius),
            _ => largest(at),
        };
        let pairs = a.iter().zip(b).flat_map(|(a, b)| a.iter().zip(b).skip(at).take(3));
        let far = pairs.fold(0.0f64, |most, (a, b)| if a == b { most } else { most.max((a - b).abs()) });
        if far != 0.0 {
            worst = worst.max(far / size);
        }
    }
    worst
}

/// Rows of thermo output: the numbers of all lines that begin with a step.
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

/// Reproducible random numbers in [0, 1).
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

/// Atoms of [`bar`] are bonded if they are closer than this times the sum of their radii.
pub const FACTOR: f64 = 1.5;

/// A perturbed bar of 5 × 5 × 16 spheres that is torn apart along z, and its bonds (ids from 1).
pub fn bar() -> (Vec<Atom>, Vec<[usize; 2]>) {
    let mut dice = Dice(11);
    let mut atoms: Vec<Atom> = (0..5 * 5 * 16_usize)
        .map(|k| {
            let place = Vec3::new((k % 5) as f64, (k / 5 % 5) as f64, (k / 25) as f64) * 0.0098;
            let mut atom = Atom::resting(place + dice.vector() * 3e-4, 0.005);
            atom.velocity = Vec3::new(0.0, 0.0, 120.0 * (place.z - 0.0735)) + dice.vector() * 0.05;
            atom.spin = dice.vector() * 5.0;
            atom
        })
        .collect();
    // Shuffle ids, so that they are unrelated to positions.
    for k in 0..atoms.len() {
        let other = (dice.roll() * atoms.len() as f64) as usize;
        atoms.swap(k, other);
    }
    let mut bonds = Vec::new();
    for b in 0..atoms.len() {
        for a in 0..b {
            if (atoms[a].position - atoms[b].position).norm() < FACTOR * 0.01 {
                bonds.push([a + 1, b + 1]);
            }
        }
    }
    (atoms, bonds)
}
