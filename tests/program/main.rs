//! The program does what its help says: commands, exit codes, interruption, resumption, bitwise reproducible results.

mod characterise;
mod charts;
mod charts_of_studies;
mod command_line;
mod contents;
mod cracks;
mod device;
mod drawing;
mod elastic;
mod events;
mod export;
mod heat_network;
mod hostile;
mod interruption;
mod matrix;
mod measure;
mod mistakes;
mod pages;
mod pictures;
mod plot;
mod progress;
mod render;
mod results;
mod rock;
mod settings;
mod sweep;
mod sweep_ensembles;
mod sweep_runs;
mod watch;

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use concordem_tests::commands::{concordem, write};

/// Environment variable with which a test tells a child process what to run.
const CHILD: &str = "CONCORDEM_TEST_ARGUMENTS";

/// Not a test: the child process of other tests.
#[test]
#[ignore = "run by other tests in a separate process, so that it can be killed"]
fn child() {
    let Ok(arguments) = std::env::var(CHILD) else { return };
    let given = concordem(arguments.split('\n'));
    eprint!("{}", given.err);
    std::process::exit(i32::from(given.code));
}

/// Starts a command in a separate process.
fn spawn(arguments: &[&str]) -> Child {
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
bond_snapshots = true
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

/// Writes the scenario of the prism with this number of steps.
fn prism(folder: &Path, steps: u32) -> PathBuf {
    write(folder, "prism.toml", &PRISM.replace("STEPS", &steps.to_string()))
}

/// Writes the scenario of a prism with 25,000 spheres and 9 bonds each, without checkpoints at given steps.
fn large_prism(folder: &Path, steps: u32) -> PathBuf {
    let text = PRISM.replace("STEPS", &steps.to_string()).replace("checkpoint_interval = 50\n", "");
    write(folder, "large.toml", &text.replace(r#""9 mm", "9 mm", "16 mm""#, r#""44 mm", "44 mm", "75 mm""#))
}

/// A periodic cell of sixty bonded spheres.
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
