//! The example `bpm/impact` of LAMMPS with our beams, beside LAMMPS' own bonds.

use std::path::Path;

use crate::harness::{Host, run_in, thermo};

/// Rows of the example's output after `steps` steps.
fn rows(bonds: &str, processors: usize) -> Vec<Vec<f64>> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/bpm-impact-lammps.in");
    let text = std::fs::read_to_string(path).unwrap();
    let settings =
        format!("variable steps index 700\nvariable bonds index {bonds}\nthermo_modify format float %20.15g\n");
    let (settings, format) = settings.split_at(settings.find("thermo_modify").unwrap());
    let folder = tempfile::tempdir().unwrap();
    let script = format!("{settings}{}", text.replace("run             ${steps}", &format!("{format}run ${{steps}}")));
    thermo(&run_in(Host::Lammps, folder.path(), &script, processors))
}

#[test]
fn a_ball_hits_a_plate_as_with_the_bonds_of_lammps() {
    let (ours, bpm) = (rows("concordem", 1), rows("bpm", 1));
    let last = |rows: &[Vec<f64>]| rows.last().unwrap().clone();
    // Step, kinetic and potential energy, pressures, bond ends, velocity of the ball (m/s).
    let (first, end, theirs) = (&ours[0], last(&ours), last(&bpm));
    assert_eq!((end[0], theirs[0]), (700.0, 700.0));
    assert_eq!((first[6], first[7]), (bpm[0][6], bpm[0][7]), "the same bonds and velocity at first");
    // Until step 600, 1 in 10,000 bonds breaks. Stiffnesses of our beams vary with the length of the bond (0.9 to 1.5 times the nominal one),
    // those of BPM do not, and only BPM has dashpots: measured 9 % of the lost speed at step 500, 5 % at 600.
    for step in [5, 6] {
        let lost = |rows: &[Vec<f64>]| rows[step][7] - rows[0][7];
        let ratio = lost(&ours) / lost(&bpm);
        assert!((ratio - 1.0).abs() < 0.15, "step {}: {ratio}", ours[step][0]);
        assert!(lost(&ours) > 1e-4, "the ball has arrived");
    }
    // The plate breaks in both.
    assert!(end[6] < first[6] && theirs[6] < bpm[0][6], "{end:?} {theirs:?}");
    // On two processors, LAMMPS adds the forces of its pair style in another order; the impact amplifies the rounding.
    let two = last(&rows("concordem", 2));
    assert!((two[7] / end[7] - 1.0).abs() < 1e-9, "{two:?} {end:?}");
    assert_eq!(two[6], end[6]);
}
