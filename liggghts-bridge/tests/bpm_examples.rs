//! LAMMPS' examples of bonded particles (folder `examples/bpm`) with our bonds, longer than `public_decks.rs`, which compares them with LAMMPS' own bonds: what
//! they are about happens, and also on two processors. `impact` (rotational) has a test of its own. Not here: `plasticity` (no plastic bonds) and `peri`
//! (peridynamics).

use std::path::Path;

use crate::harness::decks::{deck, write_files};
use crate::harness::{Host, run_in, thermo};

/// The deck `name` with our styles; `longer`: its runs, and those that replace them.
fn script(folder: &Path, name: &str, longer: [&str; 2]) -> String {
    write_files(folder);
    let script = deck(Host::Lammps, name).ours();
    assert!(script.contains(longer[0]), "{name}: no `{}`", longer[0]);
    script.replace(longer[0], longer[1])
}

fn rows(folder: &Path, script: &str, processors: usize) -> Vec<Vec<f64>> {
    thermo(&run_in(Host::Lammps, folder, script, processors))
}

/// Panics if a number differs by more than `tolerance` of the largest one in its column.
fn assert_near(found: &[Vec<f64>], wanted: &[Vec<f64>], tolerance: f64) {
    assert!(found.len() > 3 && found.len() == wanted.len(), "{} and {} rows", found.len(), wanted.len());
    for column in 0..found[0].len() {
        let largest = wanted.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        for (a, b) in found.iter().zip(wanted) {
            assert!((a[column] - b[column]).abs() <= tolerance * largest, "column {column}: {a:?} {b:?}");
        }
    }
}

#[test]
fn brittle_springs_of_an_impact_break_the_plate_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let script = script(folder.path(), "impact, springs", ["run 300\n", "run 600\n"]);
    let one = rows(folder.path(), &script, 1);
    let [first, last] = [&one[0], one.last().unwrap()];
    // Ends of bonds, and the speed of the ball.
    assert!(last[2] < 0.99 * first[2] && last[3] > 0.8 * first[3], "the plate breaks and slows the ball: {one:?}");
    // The pair style is LAMMPS', whose sums depend on the number of processors.
    assert_near(&rows(folder.path(), &script, 2), &one, 1e-6);
}

/// One of central springs, whose Poisson's ratio is large, and one with shear springs, which resist the widening.
#[test]
fn pillars_widen_as_their_springs_allow() {
    let folder = tempfile::tempdir().unwrap();
    let all = rows(folder.path(), &script(folder.path(), "pillars", ["run 500\n", "run 2000\n"]), 1);
    let pressed: Vec<_> = all.iter().filter(|row| row.len() == 9).collect();
    let [first, last] = [pressed[0], pressed.last().unwrap()];
    let [left, right] = [last[4] - first[4], last[5] - first[5]];
    assert!(right > 0.0 && right < 0.6 * left, "{left} {right}");
}

#[test]
fn wires_are_twisted_and_spring_back_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let script = script(folder.path(), "wires", ["run 400\n", "run 1500\n"]);
    let one = rows(folder.path(), &script, 1);
    // The ends do work until they are released at step 1,500; then the viscous force takes energy away.
    let energy: Vec<f64> = one.iter().map(|row| row[1] + row[2]).collect();
    assert!(energy[1..4].iter().all(|held| *held > 10.0 * energy[0]), "{energy:?}");
    assert!(energy[4..].windows(2).all(|pair| pair[1] < pair[0]), "{energy:?}");
    // Neighbors of neighbors touch with LAMMPS' pair style, whose sums depend on the number of processors: 4e-7 when the ends are released.
    assert_near(&rows(folder.path(), &script, 2)[..4], &one[..4], 1e-5);
}

#[test]
fn a_field_bends_rods_with_magnets_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let script = script(folder.path(), "metamaterial", ["run 300\n", "run 1000\n"]);
    let one = rows(folder.path(), &script, 1);
    let last = one.last().unwrap();
    // The moments lift one arm and lower the opposite one by as much.
    assert!(last[4] > 0.5 && (last[4] + last[5]).abs() < 1e-9, "{one:?}");
    assert!(last[2] > 0.0 && (last[2] - last[3]).abs() < 1e-15, "all potential energy is in the bonds: {last:?}");
    // The order of LAMMPS' sums over atoms.
    assert_near(&rows(folder.path(), &script, 2), &one, 1e-9);
}

#[test]
fn bonded_molecules_are_poured_and_break_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let script = script(folder.path(), "pour of molecules", ["run 1500\n", "run 5000\n"]);
    let one = rows(folder.path(), &script, 1);
    let last = one.last().unwrap();
    // 12 molecules of 4 atoms, with 6 ends of bonds each, some of which have broken.
    assert!(last[1] == 48.0 && last[2] > 0.0 && last[2] < 72.0, "{one:?}");
    // The pair style is LAMMPS', whose sums depend on the number of processors; collisions amplify the rounding.
    assert_near(&rows(folder.path(), &script, 2), &one, 1e-6);
}
