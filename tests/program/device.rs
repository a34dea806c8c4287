//! `--device`: results of runs with steps on the emulated device, and refusals.

use std::path::Path;

use concordem::output::ResultFile;
use concordem::program::exit;
use concordem_tests::commands::{concordem, text, write};
use tempfile::TempDir;

use crate::contents::{contents, same};
use crate::{CELL, prism, spawn};

/// An entry of the provenance of a result.
fn provenance(result: &Path, name: &str) -> String {
    let entries = ResultFile::open(result).and_then(|result| result.provenance()).expect("a complete result");
    entries.into_iter().find_map(|(other, value)| (other == name).then_some(value)).expect("an entry of this name")
}

/// The prism softens and breaks. Records (of the device and of the solver), operators, snapshots, and checkpoints are the same, and the
/// device takes many steps.
#[test]
fn results_do_not_depend_on_the_device() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 400);
    let run = |name: &str, more: &[&str]| {
        let result = folder.path().join(name);
        let arguments = ["run", "-q", "-o", text(&result), text(&scenario)];
        let given = concordem(arguments.iter().chain(more));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        result
    };
    let alone = run("alone.h5", &[]);
    let on_device = run("device.h5", &["--device", "emulated"]);
    same(&contents(&on_device), &contents(&alone), "the device");
    assert_eq!(provenance(&on_device, "device"), "emulated");
    let steps: u64 = provenance(&on_device, "steps_on_device").parse().expect("a number");
    assert!((50..400).contains(&steps), "{steps} steps on the device");
}

/// Discs in a plane have prescribed components everywhere.
#[test]
fn discs_move_on_a_device() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = r#"
version = 1
dimension = 2
packing = { kind = "lattice", lattice = "square", radius = "1 mm", repeats = [5, 8, 1] }
material = [{ name = "m", density = 2000, linear_bond = { normal_stiffness = 7e10, shear_stiffness = 7e9, damping_ratio = 0.1 } }]
bonds = { law = "linear_bond", interaction_ratio = 1.1 }
contacts = { law = "none" }
integration = { gravity = [1, 2, 0] }
loading = { kind = "uniaxial", axis = "y", strain_rate = "0.2 1/s" }
stop = { steps = 700 }
output = { sample_interval = 300 }
"#;
    let scenario = write(folder.path(), "discs.toml", scenario);
    let run = |name: &str, more: &[&str]| {
        let result = folder.path().join(name);
        let arguments = ["run", "-q", "-o", text(&result), text(&scenario)];
        let given = concordem(arguments.iter().chain(more));
        assert_eq!(given.code, exit::DONE, "{}", given.err);
        result
    };
    let (alone, on_device) = (run("alone.h5", &[]), run("device.h5", &["--device", "emulated"]));
    let hash = |path: &Path| concordem(["info", "--hash", text(path)]).out;
    assert_eq!(hash(&on_device), hash(&alone));
    // All steps but the first: records at 300 and 600, and the guard's checks at 256 and 512, are the device's, too.
    assert_eq!(provenance(&on_device, "steps_on_device"), "699");
    // The first step of velocity Verlet differs, and is the solver's.
    let verlet = ["--force", "--set", "integration.scheme=velocity-verlet"];
    let (alone, on_device) =
        (run("alone.h5", &verlet), run("device.h5", &[&verlet[..], &["--device", "emulated"]].concat()));
    assert_eq!(hash(&on_device), hash(&alone));
    assert_eq!(provenance(&on_device, "steps_on_device"), "699");
}

/// Each template with the default kinematics is refused at a key, or the device takes many steps and the hash is that of the run without it:
/// aggregates, fibers, cuts, impacts. Templates of specimens have the features of the smaller ones.
#[test]
fn templates_are_refused_or_have_the_bits_of_the_solver() {
    let folder = TempDir::new().expect("a temporary folder");
    let templates = concat!(env!("CARGO_MANIFEST_DIR"), "/../rust-core/scenario/src/schema/templates");
    let mut taken = Vec::new();
    for entry in std::fs::read_dir(templates).expect("the templates") {
        let template = entry.expect("a template").path();
        let name = template.file_stem().and_then(|name| name.to_str()).expect("a name").to_owned();
        if name.contains("specimen") || ["elastic-sweep", "concrete-ensemble"].contains(&name.as_str()) {
            continue;
        }
        let run = |device: &[&str]| {
            let result = folder.path().join(format!("{name}-{}.h5", device.len()));
            let set = ["--set", "kinematics=finite", "--set", "stop.steps=60"];
            let arguments = ["run", "-q", "-o", text(&result), text(&template)];
            (concordem(arguments.iter().chain(&set).chain(device)), result)
        };
        let (on_device, result) = run(&["--device", "emulated"]);
        if on_device.code == exit::USAGE {
            assert!(on_device.err.contains("run without --device"), "{name}: {}", on_device.err);
            continue;
        }
        assert_eq!(on_device.code, exit::DONE, "{name}: {}", on_device.err);
        let (alone, expected) = run(&[]);
        assert_eq!(alone.code, exit::DONE, "{name}: {}", alone.err);
        let hash = |path: &Path| concordem(["info", "--hash", text(path)]).out;
        assert_eq!(hash(&result), hash(&expected), "{name}");
        // Bonds break in some, so the device does not take all steps.
        let steps: u64 = provenance(&result, "steps_on_device").parse().expect("a number");
        assert!(steps >= 20, "{name}: {steps} of 60 steps on the device");
        taken.push(name);
    }
    taken.sort();
    let expected = ["beam-impact", "concrete-fibers", "concrete-hopkinson", "concrete-mesoscale", "cpm-small"];
    assert_eq!(taken, [&expected[..], &["hertz-impact", "linear-bond-bar"]].concat());
}

/// A record of the device ends a run: at a strain, and where the stress has dropped.
#[test]
fn records_of_a_device_end_a_run() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 4000);
    for stop in ["strain=3e-4", "drop_to=0.9"] {
        let run = |name: &str, more: &[&str]| {
            let result = folder.path().join(name);
            let set = format!("stop.{stop}");
            let free = ["output.snapshot_interval=20", "output.checkpoint_interval=5000", "output.sample_interval=3"];
            let sets = free.iter().copied().chain([set.as_str()]).flat_map(|set| ["--set", set]);
            let arguments = ["run", "-q", "--force", "-o", text(&result), text(&scenario)];
            let given = concordem(arguments.into_iter().chain(sets).chain(more.iter().copied()));
            assert_eq!(given.code, exit::DONE, "{}", given.err);
            result
        };
        let (alone, on_device) = (run("alone.h5", &[]), run("device.h5", &["--device", "emulated"]));
        same(&contents(&on_device), &contents(&alone), stop);
        let steps: u64 = provenance(&on_device, "steps_on_device").parse().expect("a number");
        assert!(steps > 20, "{stop}: {steps} steps on the device");
    }
}

/// A run that is killed and resumed on a device gives the result of one that is not.
#[test]
#[cfg(unix)]
fn runs_resume_on_a_device() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 300);
    let (whole, broken) = (folder.path().join("whole.h5"), folder.path().join("broken.h5"));
    assert_eq!(concordem(["run", "-q", "-o", text(&whole), text(&scenario)]).code, exit::DONE);
    let mut process = spawn(&["run", "--device", "emulated", "-o", text(&broken), text(&scenario)]);
    let parts = broken.with_extension("h5.parts");
    while !parts.join("checkpoint-0001.h5").exists() && process.try_wait().is_ok_and(|status| status.is_none()) {
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let _ = process.kill();
    let _ = process.wait();
    if !broken.exists() {
        let given = concordem(["resume", "-q", "--device", "emulated", text(&broken)]);
        assert_eq!(given.code, exit::DONE, "{}", given.err);
    }
    same(&contents(&broken), &contents(&whole), "the device");
}

/// Everything that no device supports is refused before the run, at its key.
#[test]
fn scenarios_that_a_device_does_not_support_are_refused() {
    let folder = TempDir::new().expect("a temporary folder");
    let refused = |name: &str, scenario: &str, keys: &[&str]| {
        let path = write(folder.path(), &format!("{name}.toml"), scenario);
        let given = concordem(["run", "-q", "--device", "emulated", text(&path)]);
        assert_eq!(given.code, exit::USAGE, "{name}: {}", given.err);
        for key in keys {
            assert!(given.err.contains(key), "{name}: {key} is missing in: {}", given.err);
        }
        assert!(given.err.contains("run without --device"), "{name}: {}", given.err);
        assert!(!path.with_extension("h5").exists());
    };
    refused("cell", CELL, &["packing.shape.kind", "periodic cells"]);
    let all = r#"
version = 1
kinematics = "yade"
packing = { kind = "lattice", lattice = "sc", radius = "5 mm", repeats = [3, 3, 3] }
material = [{ name = "m", density = 2500, deformable = { young = "1 GPa", poisson = 0.2 }, frictional = { normal_stiffness = 1e5, shear_stiffness = 3e4 } }]
contacts = { law = "frictional" }
integration = { damping = { kind = "nonviscous", coefficient = 0.2 } }
wall = [{ material = "m", shape = { kind = "plane", point = [0, 0, "-5 mm"], normal = [0, 0, 1] } }]
set = [{ name = "first", selection = { kind = "ids", ids = [0] } }]
force = [{ set = "first", force = [1, 0, 0] }]
history = [{ name = "h", shape = { kind = "table", points = [[0, 0], [1, 1]] } }]
prescribe = [{ set = "first", velocity = [1, "free", "free"], history = "h" }]
stop = { steps = 10 }
"#;
    let keys = ["kinematics", "material[0].deformable", "integration.damping.kind", "wall[0]", "force[0]"];
    refused("all", all, &keys);
    refused("history", all, &["prescribe[0].history"]);
}

/// A program without support says how to get it. (With support but without a driver: the test of `concordem-gpu`.)
#[test]
fn a_program_without_support_says_so() {
    let folder = TempDir::new().expect("a temporary folder");
    let scenario = prism(folder.path(), 10);
    let given = concordem(["run", "-q", "--device", "gpu", text(&scenario)]);
    assert_eq!(given.code, exit::USAGE, "{}", given.err);
    assert!(given.err.contains("--features gpu"), "{}", given.err);
}
