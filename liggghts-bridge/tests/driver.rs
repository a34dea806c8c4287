//! LIGGGHTS as a library of a Rust program. Each test runs in separate processes, because LIGGGHTS ends the process on errors and MPI
//! can be initialized only once.

use std::path::Path;
use std::process::Output;

use concordem_contact::math::Vec3;
use concordem_liggghts::driver::{DriverError, Liggghts};
use concordem_liggghts::records::ascending;

use crate::harness;

const SCRIPT: &str = "units si\natom_style sphere\natom_modify sort 0 0\nboundary f f f\nnewton off   # of bonds\n\
    communicate single vel yes\nregion box block -0.02 0.06 -0.02 0.06 -0.02 0.06 units box\ncreate_box 1 box\n\
    lattice sc 0.0099\nregion block block 0 0.038 0 0.038 0 0.038 units box\ncreate_atoms 1 region block\n\
    set group all diameter 0.01 density 2500\nneighbor 0.001 bin\nneigh_modify delay 0\ntimestep 1e-7\n\
    fix integrate all nve/sphere\nfix bonds all concordem/bond cpm young 30e9 shear_ratio 0.2 &\n\
    cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1e-4 relative_ductility 10 bond distance 1.2\n";
const LIBRARY: &str = "CONCORDEM_TEST_LIBRARY";

/// Run part `part` of [`child`] in `processors` new processes of this test program.
fn start(part: &str, processors: usize) -> Output {
    let folder = tempfile::tempdir().unwrap();
    let library = harness::built("liggghts/libconcordem-liggghts.so", "liggghts-bridge/build");
    harness::open_mpi(processors)
        .arg(std::env::current_exe().unwrap())
        .args(["--ignored", "--exact", "inside_hosts::driver::child", "--nocapture", "--test-threads", "1"])
        .env(LIBRARY, library)
        .env("CONCORDEM_TEST_PART", part)
        .env("OMPI_ALLOW_RUN_AS_ROOT", "1")
        .env("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
        // As in `harness`.
        .env("OMPI_MCA_orte_tmpdir_base", folder.path())
        .output()
        .expect("timeout and mpirun (Debian packages coreutils, openmpi-bin) are needed")
}

#[test]
fn a_simulation_runs_and_its_results_can_be_read() {
    for processors in [1, 2] {
        let output = start("scenario", processors);
        let printed = harness::text(&output);
        assert!(output.status.success(), "{printed}");
        assert_eq!(printed.matches("the scenario was as it should be").count(), processors, "{printed}");
    }
}

#[test]
fn errors_of_liggghts_end_the_process_with_its_message() {
    let output = start("wrong command", 2);
    let printed = harness::text(&output);
    assert!(!output.status.success());
    assert!(printed.contains("missing field `young`"), "{printed}");
    assert!(!printed.contains("went on"), "{printed}");
}

#[test]
fn scripts_are_read_as_liggghts_reads_files() {
    let output = start("quotes", 1);
    let printed = harness::text(&output);
    assert!(output.status.success(), "{printed}");
    assert!(printed.contains("left # right\n") && printed.contains("joined here\n"), "{printed}");
    assert!(!printed.contains("comment"), "{printed}");
}

#[test]
fn a_process_that_panics_ends_the_others() {
    let output = start("panic", 2);
    let printed = harness::text(&output);
    assert_ne!(output.status.code(), Some(124), "the other process waits: {printed}");
    assert!(!output.status.success() && printed.contains("a panic on purpose"), "{printed}");
    assert!(!printed.contains("went on"), "{printed}");
}

#[test]
fn a_missing_library_is_named() {
    let error = Liggghts::open("/no/such/library.so".as_ref(), &[]).err().unwrap().to_string();
    assert!(error.contains("/no/such/library.so") && error.contains("make liggghts"), "{error}");
}

#[test]
#[ignore = "started by the other tests in separate processes"]
fn child() {
    let library = std::env::var_os(LIBRARY).expect("started by the other tests only");
    let part = std::env::var("CONCORDEM_TEST_PART").unwrap();
    // LIGGGHTS prints messages to its screen, which the other parts check.
    let arguments: &[&str] =
        if part == "scenario" { &["-screen", "/dev/null", "-log", "none"] } else { &["-log", "none"] };
    let mut host = Liggghts::open(Path::new(&library), arguments).unwrap();
    if part == "scenario" {
        scenario(&mut host);
        assert!(matches!(Liggghts::open(Path::new(&library), arguments), Err(DriverError::Open)));
        // A second instance after the first.
        drop(host);
        let mut host = Liggghts::open(Path::new(&library), arguments).unwrap();
        assert!(host.positions().unwrap().is_empty());
        assert!(matches!(host.radii(), Err(DriverError::NoProperty("radius"))));
        host.commands(SCRIPT).unwrap();
        host.run(1).unwrap();
        assert_eq!(host.count(), 64);
        drop(host);
        println!("the scenario was as it should be");
    } else if part == "quotes" {
        host.commands("print \"left # right\" # a comment\nprint \"joined &\nhere\"\n").unwrap();
    } else if part == "panic" {
        host.commands(SCRIPT).unwrap();
        assert!(std::env::var("OMPI_COMM_WORLD_RANK").unwrap() == "0", "a panic on purpose");
        // Would wait for the other process.
        host.run(10).unwrap();
        println!("went on");
    } else {
        host.commands(&SCRIPT.replace("young 30e9", "")).unwrap();
        println!("went on");
    }
}

/// The forces in LIGGGHTS' arrays are the sums of the bond forces, and writing to a view moves atoms.
fn scenario(host: &mut Liggghts) {
    host.commands(SCRIPT).unwrap();
    host.run(0).unwrap();
    assert_eq!((host.count(), host.fix("bonds", None).unwrap()), (64, 144.0));
    assert_eq!(host.fix("bonds", Some(2)).unwrap(), 0.0);
    assert!(host.radii().unwrap().iter().all(|r| *r == 0.005) && host.types().unwrap().iter().all(|t| *t == 1));
    let ids = host.ids().unwrap().to_vec();
    let before = host.positions().unwrap().to_vec();
    assert_eq!(ids.len(), host.owned());
    for (velocity, id) in host.velocities_mut().unwrap().iter_mut().zip(&ids) {
        *velocity = [0.1 * f64::from(id % 7), -0.05 * f64::from(id % 3), 0.02 * f64::from(id % 5)];
    }
    host.run(50).unwrap();
    let moved = before.iter().zip(host.positions().unwrap()).filter(|(a, b)| a != b).count();
    assert_eq!((moved, host.ids().unwrap()), (ids.len(), &ids[..]));

    let bonds = host.bonds("bonds").unwrap();
    let histories = host.histories("bonds").unwrap();
    assert_eq!(bonds.len(), histories.len());
    let owned = host.owned();
    if owned == host.count() {
        // On one process: the bond forces add up to those of the atoms.
        assert_eq!(bonds.len(), 144);
        let mut sums = vec![Vec3::zeros(); owned];
        for bond in &bonds {
            for (id, sign) in bond.ids.iter().zip([1.0, -1.0]) {
                sums[ids.iter().position(|i| i64::from(*i) == *id).unwrap()] += Vec3::from(bond.force) * sign;
            }
        }
        let largest = sums.iter().map(Vec3::norm).fold(0.0, f64::max);
        assert!(largest > 1.0, "{largest} N");
        for (sum, force) in sums.iter().zip(host.forces().unwrap()) {
            // Tolerance: up to six terms are summed in another order.
            assert!((sum - Vec3::from(*force)).norm() < 1e-13 * largest, "{sum} {force:?}");
        }
    }
    for (bond, record) in bonds.iter().zip(&histories) {
        // Records belong to the same bonds at the same positions.
        assert_eq!(bond.ids, ascending(record.tags));
        assert!(bond.bonded && (bond.length - record.frame.length).abs() < 1e-15, "{bond:?} {record:?}");
        assert!(record.history.iter().any(|real| *real != 0.0), "{record:?}");
    }
    assert!(matches!(host.bonds("nobody"), Err(DriverError::NoBonds(_))));
    assert!(matches!(host.histories("nobody"), Err(DriverError::NoBonds(_))));
    assert!(matches!(host.fix("nobody", None), Err(DriverError::NoFix(_))));
    assert!(matches!(host.fix("nobody", Some(1)), Err(DriverError::NoFix(_))));
    assert!(host.fix("bonds", Some(12)).unwrap() > 0.0099);
    for index in [0, 17, usize::MAX] {
        let error = host.fix("bonds", Some(index)).unwrap_err().to_string();
        assert!(error.contains(&format!("has no output {index}: its vector has 16 elements")), "{error}");
    }
    assert!(matches!(host.fix("integrate", Some(1)), Err(DriverError::NoNumber { length: 0, .. })));
    assert!(matches!(host.commands("run 0 &\n"), Err(DriverError::Unfinished)));
    assert!(matches!(host.command("print \0"), Err(DriverError::ZeroByte(_))));
}
