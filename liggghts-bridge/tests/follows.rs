//! What other commands of the hosts do to atoms and pairs in a run, followed by bonds and contacts: bonds between atoms that touch, spheres
//! that grow, pairs without contacts, frozen and rigid atoms, atoms that leave the box.

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{Atom, Host, attempt_in, data_file_for, dump_for, frames, head_for, run_in, text, thermo};
use concordem_contact::law::restitution::{End, damping_of_restitution};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const BEAM: &str = "cohesive_beam young 1e8 poisson 0.3 radius 0.004 tensile_strength 1e9";
const YOUNG: f64 = 1e7;

/// Spheres of 10 mm at these places along x, of type 1, 2, ….
fn row(host: Host, folder: &Path, places: &[f64]) -> String {
    let at = |x: &f64| Atom::resting(Vec3::new(*x, 0.0, 0.0), 0.005);
    let atoms: Vec<Atom> = places.iter().map(at).collect();
    data_file_for(host, &folder.join("row.data"), &atoms, &[], Vec3::repeat(-0.05), Vec3::repeat(0.05));
    head_for(host, "row.data", "f f f", 2e-3, 1e-6)
}

/// The parameters of `hertz_mindlin`; `prefix` belongs to those of contacts beside bonds.
fn hertz(prefix: &str, restitution: f64) -> String {
    let parameters = [("young", YOUNG), ("poisson", 0.3), ("friction_coefficient", 0.4), ("restitution", restitution)];
    parameters.iter().fold(String::new(), |out, (key, value)| out + &format!(" {prefix}{key} {value:e}"))
}

fn contacts(restitution: f64) -> String {
    format!("fix touch all concordem/bond none contact hertz_mindlin{}\n", hertz("", restitution))
}

/// Force between spheres of these diameters and distance.
fn force(diameter: f64, distance: f64) -> f64 {
    let overlap = (diameter - distance).max(0.0);
    let young = YOUNG / (2.0 * (1.0 - 0.09));
    4.0 / 3.0 * young * (0.25 * diameter).sqrt() * overlap.powf(1.5)
}

const PUSH: &str = "compute push all reduce max fx\n";

/// Spheres that press on each other are bonded where they are: the bond is unstrained, and nothing of the contact stays. All ways to bond.
#[test]
fn a_bond_replaces_the_contact_of_its_atoms() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let head = row(host, folder.path(), &[0.0, 0.0098]) + "fix hold all nve/noforce\n" + PUSH;
        let by_fix = format!(
            "fix bonds all concordem/bond {BEAM} bond distance 1.05 at 4 contact hertz_mindlin{}\n\
             thermo_style custom step f_bonds f_bonds[3] c_push\nthermo 1\nrun 8\n",
            hertz("contact.", 1.0)
        );
        let mut scripts = vec![(by_fix, 4)];
        if host == Host::Lammps {
            let styles = format!(
                "special_bonds lj 0 1 1 coul 1 1 1\npair_style concordem/hertz_mindlin reach 0.015\npair_coeff * *{}\n\
                 bond_style concordem/cohesive_beam\nbond_coeff * {}\n\
                 thermo_style custom step f_concordem_bonds f_concordem_bonds[3] c_push\nthermo 1\n",
                hertz("", 1.0),
                BEAM.strip_prefix("cohesive_beam ").unwrap()
            );
            scripts.push((format!("{styles}run 4\ncreate_bonds single/bond 1 1 2\nrun 4\n"), 3));
            for create in ["bond/create", "bond/create/angle"] {
                scripts.push((format!("{styles}fix make all {create} 4 1 1 0.0105 1\nrun 8\n"), 4));
            }
        }
        for (script, last) in scripts {
            for processors in [1, 2] {
                let rows = thermo(&run_in(host, folder.path(), &format!("{head}{script}"), processors));
                let pressed = force(0.01, 0.0098);
                for row in &rows {
                    let [step, bonds, touching, push] = row[..] else { panic!("{rows:?}") };
                    // Digits of the output. The step that makes the bond shows the force at its end, and counts at its end.
                    if bonds == 0.0 {
                        assert!(touching == 1.0 && (push / pressed - 1.0).abs() < 1e-6, "{host:?}: {row:?} {script}");
                    } else if step > f64::from(last) + 1.0 {
                        assert!([bonds, touching, push] == [1.0, 0.0, 0.0], "{host:?}: {row:?} {script}");
                    }
                }
                assert!(rows[0][1] == 0.0 && rows.last().unwrap()[1] == 1.0, "{host:?}: {rows:?} {script}");
            }
        }
    }
}

/// Radii that `fix adapt` changes, the fixes in any order: Hertz' force with the present radii, on any number of processors; the list of
/// candidates and the ghosts keep up with the growth.
#[test]
fn growing_spheres_press_with_their_present_radii() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        // The border between two processors is at 0.
        let mut head = row(host, folder.path(), &[-0.0055, 0.005]);
        // LAMMPS' `bpm/sphere 1` ends with an error of MPI on two processors. With `sphere 1`: random decks.
        let mut numbers = vec![1, 2];
        if host == Host::Lammps {
            head = head.replace("bpm/sphere", "bpm/sphere 1");
            numbers.pop();
        }
        let grow = "variable d equal 0.01+0.004*step/400\nfix grow all adapt 10 atom diameter v_d\n";
        let output = format!("{PUSH}fix hold all nve/noforce\nthermo_style custom step v_d c_push\nthermo 10\n");
        let fixes = [grow.to_owned(), contacts(0.5)];
        for order in [[0, 1], [1, 0]] {
            for &processors in &numbers {
                let script = format!("{head}{}{}{output}run 400\n", fixes[order[0]], fixes[order[1]]);
                let rows = thermo(&run_in(host, folder.path(), &script, processors));
                assert_eq!(rows.len(), 41);
                for row in &rows[1..] {
                    let wanted = force(row[1], 0.0105);
                    // Digits of the output: those of the diameter are magnified near the first touch.
                    assert!(
                        (row[2] - wanted).abs() < 1e-3 * wanted + 1e-3,
                        "{host:?} {order:?} on {processors}: {row:?} {wanted}"
                    );
                }
            }
        }
        // A jump that no list covers.
        let jump = grow.replace("0.004*step/400", "0.003*step/10");
        let output =
            attempt_in(host, folder.path(), &format!("{head}{}{jump}{output}run 100\n", contacts(0.5)), numbers[0]);
        assert!(
            !output.status.success() && text(&output).contains("radii have grown by"),
            "{host:?}: {}",
            text(&output)
        );
    }
}

/// Free spheres that grow into each other are pushed apart as a fine integration says: radii, masses, and the dashpot's ratio are those of the
/// present step. The dashpot never pulls, so that they fly apart; with the pulling dashpots of LAMMPS the growth catches up with them.
#[test]
fn growing_spheres_push_each_other_apart() {
    const STEPS: usize = 6000;
    let dt = 1e-6;
    let diameter = |step: usize| 0.01 + 1.5e-7 * (step - step % 10) as f64;
    let ratio = damping_of_restitution(0.5, End::ForceSpent);
    let (mut distance, mut speed) = (0.0105, 0.0);
    for step in 0..STEPS {
        let overlap = diameter(step) - distance;
        let mass = 2500.0 * std::f64::consts::PI / 6.0 * diameter(step).powi(3);
        let spring = force(diameter(step), distance);
        // α√(m k) δ^¼, α = √5 ζ, k = F/δ^1.5.
        let dashpot = (5.0 * 0.5 * mass * spring / overlap).sqrt() * ratio;
        let push = if overlap > 0.0 { (spring - dashpot * speed).max(0.0) } else { 0.0 };
        speed += 2.0 * push / mass * dt;
        distance += speed * dt;
    }
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let mut head = row(host, folder.path(), &[0.0, 0.0105]);
        if host == Host::Lammps {
            head = head.replace("bpm/sphere", "bpm/sphere 1");
        }
        let script = format!(
            "{head}{}variable d equal 0.01+1.5e-7*step\nfix grow all adapt 10 atom diameter v_d\nfix integrate all nve/sphere\n{}run {STEPS}\n",
            contacts(0.5),
            dump_for(host, "out.dump", STEPS)
        );
        run_in(host, folder.path(), &script, 1);
        let last = frames(&folder.path().join("out.dump")).pop().unwrap().1;
        let (far, fast) = (last[1].position.x - last[0].position.x, last[1].velocity.x - last[0].velocity.x);
        // The same sums in another order. The ratio of pulling dashpots gives 4 % more speed.
        assert!(
            (far / distance - 1.0).abs() < 1e-9 && (fast / speed - 1.0).abs() < 1e-9 && speed > 0.2,
            "{host:?}: {far} {distance}, {fast} {speed}"
        );
    }
}

/// Pairs that the user takes out of the neighbor lists have no contact.
#[test]
fn excluded_pairs_have_no_contact() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let kinds = [1, 2, 2];
        let at =
            |(k, kind): (usize, &usize)| Atom { kind: *kind, ..Atom::resting(Vec3::x() * (0.0098 * k as f64), 0.005) };
        let atoms: Vec<Atom> = kinds.iter().enumerate().map(at).collect();
        data_file_for(host, &folder.path().join("row.data"), &atoms, &[], Vec3::repeat(-0.05), Vec3::repeat(0.05));
        let head =
            head_for(host, "row.data", "f f f", 2e-3, 1e-6) + "group a type 1\ngroup b type 2\ngroup last id 3\n";
        let mut styles = vec![contacts(0.5)];
        if host == Host::Lammps {
            styles.push(format!("pair_style concordem/hertz_mindlin\npair_coeff * *{}\n", hertz("", 0.5)));
        }
        let end = format!("fix hold all nve/noforce\n{}run 2\n", dump_for(host, "out.dump", 2));
        let one = force(0.01, 0.0098);
        let mut exclusions = vec![
            ("", [-one, 0.0, one]),
            ("neigh_modify exclude group a b\n", [0.0, -one, one]),
            ("neigh_modify exclude type 1 2\n", [0.0, -one, one]),
            ("neigh_modify exclude type 2 1\nneigh_modify exclude group last all\n", [0.0; 3]),
            ("neigh_modify exclude type 2 2\n", [-one, one, 0.0]),
        ];
        if host == Host::Lammps {
            exclusions.push(("neigh_modify exclude molecule/intra b\n", [-one, one, 0.0]));
            exclusions.push(("set atom 3 mol 2\nneigh_modify exclude molecule/inter all\n", [-one, one, 0.0]));
        }
        for style in &styles {
            for (exclusion, wanted) in &exclusions {
                run_in(host, folder.path(), &format!("{head}{exclusion}{style}{end}"), 2);
                let found = frames(&folder.path().join("out.dump")).pop().unwrap().1;
                for (atom, wanted) in found.iter().zip(wanted) {
                    // Rounding of the sums and of the positions.
                    assert!((atom.force.x - wanted).abs() < 1e-9, "{host:?}: {exclusion}{style}: {found:?} {wanted:?}");
                }
            }
        }
        // `exclude ignore`: the fix computes them nevertheless. Between runs, exclusions end what touches.
        let ignoring = styles[0].replace("young", "exclude ignore young");
        run_in(host, folder.path(), &format!("{head}neigh_modify exclude group all all\n{ignoring}{end}"), 1);
        assert!(frames(&folder.path().join("out.dump")).pop().unwrap().1[0].force.x < -1.0);
        run_in(host, folder.path(), &format!("{head}{}{end}neigh_modify exclude group a b\nrun 2\n", styles[0]), 1);
        assert_eq!(frames(&folder.path().join("out.dump")).pop().unwrap().1[0].force.x, 0.0);
    }
}

/// A sphere hits one of the same mass that is frozen, or an atom of a heavy rigid rod, with a restitution of 0.5.
#[test]
fn damping_knows_frozen_and_rigid_atoms() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let places: Vec<f64> = (0..5).map(|k| -0.01 * f64::from(k)).chain([0.0101]).collect();
        let head = row(host, folder.path(), &places) + "group free id 6\ngroup held id 1:5\nvelocity free set -1 0 0\n";
        let mut styles = vec![contacts(0.5)];
        if host == Host::Lammps {
            styles.push(format!("pair_style concordem/hertz_mindlin\npair_coeff * *{}\n", hertz("", 0.5)));
        }
        // LAMMPS' temperature does not know that one free atom has degrees of freedom.
        let end = format!("thermo_style custom step\ntimestep 5e-7\n{}run 3000\n", dump_for(host, "out.dump", 3000));
        for style in &styles {
            for (held, rod) in [
                ("fix integrate all nve/sphere\nfix still held freeze\n", 1e100),
                (
                    "fix integrate free nve/sphere\nfix rod held rigid single\nneigh_modify exclude group held held\n",
                    5.0,
                ),
            ] {
                for processors in [1, 2] {
                    run_in(host, folder.path(), &format!("{head}{style}{held}{end}"), processors);
                    let found = frames(&folder.path().join("out.dump")).pop().unwrap().1;
                    // The relative velocity is halved; momentum is shared by the masses.
                    let wanted = (rod * 0.5 - 1.0) / (rod + 1.0);
                    let velocity = found[5].velocity.x;
                    // Rounding of the law of damping, and steps of a collision of 1e-3 s.
                    assert!(
                        (velocity - wanted).abs() < 1e-3,
                        "{host:?} on {processors}: {velocity} {wanted} {held}{style}"
                    );
                }
            }
        }
    }
}

/// A row flies out of the box. Its bonds go with the atoms, and the run goes on; `delete_atoms` does the same.
#[test]
fn bonds_of_lost_atoms_are_gone() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let places: Vec<f64> = (0..6).map(|k| -0.04 + 0.01 * f64::from(k)).collect();
        let lost = if host == Host::Lammps {
            "thermo_modify lost ignore lost/bond ignore\n"
        } else {
            "thermo_modify lost ignore\n"
        };
        let at = |x: &f64| Atom { velocity: Vec3::x() * 100.0, ..Atom::resting(Vec3::new(*x, 0.0, 0.0), 0.005) };
        let atoms: Vec<Atom> = places.iter().map(at).collect();
        let file = folder.path().join("row.data");
        let bonds: Vec<[usize; 2]> =
            if host == Host::Lammps { (1..6).map(|k| [k, k + 1]).collect() } else { Vec::new() };
        data_file_for(host, &file, &atoms, &bonds, Vec3::repeat(-0.05), Vec3::repeat(0.05));
        let head = head_for(host, "row.data", "f f f", 2e-3, 1e-6) + "fix integrate all nve/sphere\n";
        let mut styles =
            vec![(format!("fix bonds all concordem/bond {BEAM} bond distance 1.05 contact none\n"), "f_bonds")];
        if host == Host::Lammps {
            let beam = BEAM.strip_prefix("cohesive_beam ").unwrap();
            let bond_style = format!(
                "special_bonds lj 0 1 1 coul 1 1 1\npair_style zero 0.015\npair_coeff * *\nbond_style concordem/cohesive_beam\nbond_coeff * {beam}\n"
            );
            styles.push((bond_style, "f_concordem_bonds"));
        }
        for (style, count) in &styles {
            for processors in [1, 2, 4] {
                let output = format!("thermo_style custom step atoms {count} {count}[2]\n{lost}thermo 100\n");
                let printed = run_in(host, folder.path(), &format!("{head}{style}{output}run 800\n"), processors);
                let rows = thermo(&printed);
                let end = &rows[8];
                // Atoms are lost when lists are rebuilt.
                assert!(
                    rows.len() == 9 && rows[0][1..] == [6.0, 5.0, 0.0] && end[1] <= 2.0 && end[2] == end[1] - 1.0,
                    "{printed}"
                );
                assert!(rows.iter().all(|row| row[2] <= row[1] - 1.0 && row[3] == 0.0), "{host:?}: {rows:?}");
                assert!(printed.contains("bonds of atoms that left the box or were deleted"), "{printed}");
            }
        }
        let deleted = if host == Host::Lammps {
            "delete_atoms group last bond yes\n"
        } else {
            "delete_atoms group last compress no\n"
        };
        for (style, count) in &styles {
            for processors in [1, 2] {
                let mut script =
                    format!("{head}{style}velocity all set 0 0 0\nthermo_style custom step atoms {count}\n");
                write!(script, "run 2\ngroup last id 3 6\n{deleted}run 2\n").unwrap();
                let rows = thermo(&run_in(host, folder.path(), &script, processors));
                assert_eq!(rows.last().unwrap()[1..], [4.0, 2.0], "{host:?} on {processors}: {rows:?}");
            }
        }
    }
}
