//! What other commands of the hosts change behind the bonds: ids, boxes, lists of bonds, pairs of pair styles, restart files, forces. It is
//! followed, or rejected with a remedy before the next step.

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{self, Atom, Host, attempt_in, data_file_for, dump_for, frames, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const DT: f64 = 1e-6;
const LINEAR: &str = "linear_bond normal_stiffness 1e5 shear_stiffness 1e4";
const BEAM: &str = "young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 1e12";
const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

fn at(x: f64) -> Atom {
    Atom::resting(Vec3::new(x, 0.03, 0.03), 0.005)
}

/// A row of eight touching spheres along x in a periodic box of 0.1 m; LAMMPS also gets its bonds.
fn write_row(host: Host, folder: &Path) -> String {
    let mut atoms: Vec<Atom> = (0..8).map(|k| at(0.0105 + 0.01 * f64::from(k))).collect();
    for (k, atom) in atoms.iter_mut().enumerate() {
        atom.velocity.x = if k % 2 == 0 { 0.2 } else { -0.2 };
    }
    let bonds: Vec<[usize; 2]> = if host == Host::Lammps { (1..8).map(|k| [k, k + 1]).collect() } else { Vec::new() };
    data_file_for(host, &folder.join("row.data"), &atoms, &bonds, Vec3::zeros(), Vec3::repeat(0.1));
    head_for(host, "row.data", "p p p", 1e-3, DT) + "fix integrate all nve/sphere\n"
}

/// The script must fail on two processors with this message; LIGGGHTS also on one, where it ends by another function.
fn refused(host: Host, folder: &Path, script: &str, wanted: &str) {
    let numbers: &[usize] = if host == Host::Liggghts { &[1, 2] } else { &[2] };
    for &processors in numbers {
        let output = attempt_in(host, folder, script, processors);
        let printed = text(&output);
        assert!(
            !output.status.success() && printed.contains("ERROR") && printed.contains(wanted),
            "{host:?} on {processors}: `{wanted}` is not in\n{printed}\n{script}"
        );
    }
}

/// First part of a script that continues from the file `half`.
fn restart_head(host: Host) -> &'static str {
    match host {
        Host::Liggghts => {
            "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\n"
        }
        Host::Lammps => "comm_modify vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\n",
    }
}

fn fix_of(law: &str) -> String {
    format!("fix bonds all concordem/bond {law} bond distance 1.2\n")
}

#[test]
fn renumbered_atoms_are_rejected() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        // A free atom comes first, so that its deletion shifts the ids of all others.
        let atoms: Vec<Atom> = std::iter::once(Atom::resting(Vec3::repeat(0.08), 0.005))
            .chain((0..8).map(|k| at(0.0105 + 0.01 * f64::from(k))))
            .collect();
        data_file_for(host, &folder.path().join("row.data"), &atoms, &[], Vec3::zeros(), Vec3::repeat(0.1));
        let head = head_for(host, "row.data", "p p p", 1e-3, DT) + "fix integrate all nve/sphere\n";
        let script = format!("{head}{}thermo_style custom step f_bonds\nrun 1\ngroup one id 1\n", fix_of(LINEAR));
        let (renumbered, kept) = match host {
            Host::Liggghts => ("delete_atoms group one\nrun 1\n", "delete_atoms group one compress no\nrun 1\n"),
            Host::Lammps => ("delete_atoms group one\nreset_atoms id\nrun 1\n", "delete_atoms group one\nrun 1\n"),
        };
        refused(host, folder.path(), &(script.clone() + renumbered), "renumbered the atoms");
        let rows = thermo(&run_in(host, folder.path(), &(script + kept), 2));
        assert!(rows.len() == 4 && rows.iter().all(|row| row[1] == 7.0), "{rows:?}");
    }
    // The same with a bond style, whose bonds are in the atoms' lists: LAMMPS renumbers those, too, but not what we know of them.
    let folder = tempfile::tempdir().unwrap();
    let atoms: Vec<Atom> = std::iter::once(Atom::resting(Vec3::repeat(0.08), 0.005))
        .chain((0..8).map(|k| at(0.0105 + 0.01 * f64::from(k))))
        .collect();
    let bonds: Vec<[usize; 2]> = (2..9).map(|k| [k, k + 1]).collect();
    data_file_for(Host::Lammps, &folder.path().join("row.data"), &atoms, &bonds, Vec3::zeros(), Vec3::repeat(0.1));
    let script = head_for(Host::Lammps, "row.data", "p p p", 1e-3, DT)
        + "pair_style zero 0.015\npair_coeff * *\nspecial_bonds lj 0 1 1 coul 1 1 1\nbond_style concordem/cohesive_beam\n\
           bond_coeff * young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 2e5\nfix integrate all nve/sphere\n\
           thermo_style custom step f_concordem_bonds\nrun 1\ngroup one id 1\n";
    let renumbered = "delete_atoms group one\nreset_atoms id\nrun 1\n";
    refused(Host::Lammps, folder.path(), &(script.clone() + renumbered), "renumbered the atoms");
    let rows = thermo(&run_in(Host::Lammps, folder.path(), &(script + "delete_atoms group one\nrun 1\n"), 2));
    assert!(rows.len() == 4 && rows.iter().all(|row| row[1] == 7.0), "{rows:?}");
}

#[test]
fn changing_boxes_and_minimization_are_rejected() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let script = write_row(host, folder.path()) + &fix_of(LINEAR) + "thermo_style custom step f_bonds\n";
        let units = if host == Host::Liggghts { " units box" } else { "" };
        let mut cases = vec![
            ("fix other all deform 1 x erate 1\nrun 2\n".to_owned(), "but fix other (deform) changes it"),
            (
                format!("run 2\nchange_box all x scale 1.01 remap{units}\nrun 2\n"),
                "the periodic box changed from 0.1 m to 0.101 m along x",
            ),
            ("run 2\nminimize 0 1e-8 10 10\n".to_owned(), "does not support `minimize`"),
            ("change_box all triclinic\nrun 2\n".to_owned(), "does not support triclinic boxes"),
        ];
        // LIGGGHTS has no such fixes.
        if host == Host::Lammps {
            cases.extend([
                (
                    "fix other all press/berendsen iso 0 0 1\nrun 2\n".to_owned(),
                    "but fix other (press/berendsen) changes it",
                ),
                (
                    "unfix integrate\nfix other all nph/sphere iso 0 0 1\nrun 2\n".to_owned(),
                    "but fix other (nph/sphere) changes it",
                ),
            ]);
        }
        for (end, wanted) in &cases {
            refused(host, folder.path(), &(script.clone() + end), wanted);
        }
        // Before the bonds are created, the box may change.
        let before = script.replace("fix bonds", &format!("change_box all x scale 1.01 remap{units}\nfix bonds"));
        run_in(host, folder.path(), &(before + "run 2\n"), 1);
    }
}

/// Two bonded spheres are pulled apart until their bond breaks, and then thrown together: the pair style must repel them.
#[test]
fn a_pair_style_of_lammps_sees_the_pair_of_a_broken_bond() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = [at(-0.005), at(0.005)];
    data_file_for(
        Host::Lammps,
        &folder.path().join("two.data"),
        &atoms,
        &[[1, 2]],
        Vec3::repeat(-0.1),
        Vec3::repeat(0.1),
    );
    let head = head_for(Host::Lammps, "two.data", "f f f", 1e-3, DT);
    let granular = "pair_style granular\n\
                    pair_coeff * * hertz/material 5e8 0.5 0.2 tangential mindlin NULL 1.0 0.4 damping coeff_restitution\n";
    let script = |special: &str, pair: &str| {
        format!(
            "{head}{special}\n{pair}bond_style concordem/cohesive_beam\n\
             bond_coeff * young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 1e6\nfix integrate all nve/bpm/sphere\n\
             group b id 2\nvelocity b set 2 0 0\nvariable d equal x[2]-x[1]\nvariable v equal vx[2]-vx[1]\n\
             thermo_style custom step f_concordem_bonds v_d v_v\nthermo 10\nrun 200\nvelocity all set 0 0 0\nvelocity b set -2 0 0\n\
             run 600\n"
        )
    };
    for processors in [1, 2] {
        let rows = thermo(&run_in(
            Host::Lammps,
            folder.path(),
            &script("special_bonds lj 0 1 1 coul 1 1 1", granular),
            processors,
        ));
        assert!(rows[0][1] == 1.0 && rows.last().unwrap()[1] == 0.0, "{rows:?}");
        let nearest = rows.iter().map(|row| row[2]).fold(1.0, f64::min);
        // An impact at 2 m/s: they overlap by 4 % of the radius, and half of the speed returns (restitution 0.5, measured 0.4).
        assert!(
            nearest > 0.0097 && rows.last().unwrap()[3] > 0.5,
            "{processors}: nearest {nearest}, {:?}",
            rows.last()
        );
    }
    // With LAMMPS' default, and with lists of atoms two bonds away, it would not: the run ends when the bond breaks.
    for special in [
        "special_bonds lj 0 0 0 coul 0 0 0",
        "special_bonds lj 0 1 1 coul 0 1 1",
        "special_bonds lj 0 0.5 1 coul 1 1 1",
    ] {
        refused(Host::Lammps, folder.path(), &script(special, granular), "use `special_bonds lj 0 1 1 coul 1 1 1`");
    }
    let twice = script("special_bonds lj/coul 1 1 1", granular);
    refused(Host::Lammps, folder.path(), &twice, "both pair_style granular and this fix compute the forces");
    run_in(Host::Lammps, folder.path(), &script("", "pair_style zero 0.02\npair_coeff * *\n"), 1);
}

/// Three pairs of spheres that vibrate. Other commands remove the bond of the second and bond the third, between runs and in a run.
#[test]
fn bonds_of_other_commands_are_followed() {
    let folder = tempfile::tempdir().unwrap();
    let mut atoms = Vec::new();
    for y in [0.0, 0.03, 0.06] {
        for (x, v) in [(-0.005, 0.1), (0.0051, -0.1)] {
            let mut atom = Atom::resting(Vec3::new(x, y, 0.0), 0.005);
            atom.velocity.x = v;
            atoms.push(atom);
        }
    }
    data_file_for(
        Host::Lammps,
        &folder.path().join("six.data"),
        &atoms,
        &[[1, 2], [3, 4]],
        Vec3::repeat(-0.1),
        Vec3::repeat(0.1),
    );
    let head = head_for(Host::Lammps, "six.data", "f f f", 1e-3, DT)
        + "pair_style zero 0.015\npair_coeff * *\nspecial_bonds lj 0 1 1 coul 1 1 1\n";
    let bonds = format!("bond_style concordem/cohesive_beam\nbond_coeff * {BEAM}\n");
    let more = "fix integrate all nve/bpm/sphere\ngroup second id 3 4\nvariable a equal vx[1]\nvariable b equal vx[3]\n\
                variable c equal vx[5]\nthermo_style custom step f_concordem_bonds v_a v_b v_c ebond\nthermo 1\n\
                thermo_modify format float %20.15g\n";
    let between = "delete_bonds second bond 1 remove special\ncreate_bonds single/bond 1 5 6\n";
    for processors in [1, 2] {
        let script = format!("{head}{bonds}{more}run 20\n{between}run 40\n");
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, processors));
        let (before, after) = (&rows[20], &rows[21]);
        assert_eq!((before[0], after[0]), (20.0, 20.0));
        assert_eq!((before[1], after[1]), (2.0, 2.0), "one removed, one created");
        // The new bond is unstrained, so it vibrates about the present distance.
        let last = rows.last().unwrap();
        assert!(rows[30][3] == last[3], "the second pair is free: {rows:?}");
        assert!(rows[..21].iter().all(|row| row[4] == 0.1), "the third pair is free at first");
        let slowest = rows[21..].iter().map(|row| row[4]).fold(1.0, f64::min);
        assert!((-0.1..-0.09).contains(&slowest), "the third pair vibrates: {slowest}");
        // The first pair does not notice.
        let alone = thermo(&run_in(Host::Lammps, folder.path(), &format!("{head}{bonds}{more}run 60\n"), processors));
        let twice: Vec<f64> = rows.iter().enumerate().filter(|(k, _)| *k != 21).map(|(_, row)| row[2]).collect();
        assert_eq!(twice, alone.iter().map(|row| row[2]).collect::<Vec<f64>>());
    }
    // fix bond/break in a run: the two bonds, 10.1 mm long at first, vibrate by 1.3 µm and break when they are longer than 10.101 mm.
    for processors in [1, 2] {
        let script = format!("{head}{bonds}{more}fix break all bond/break 1 1 0.010101\nrun 60\n");
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, processors));
        assert!(rows[0][1] == 2.0 && rows.last().unwrap()[1] == 0.0, "{rows:?}");
        assert!(rows[rows.len() - 2][2] == rows.last().unwrap()[2], "free after the break");
    }
}

#[test]
fn a_restart_file_with_bonds_of_another_fix_is_rejected() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let first = write_row(host, folder.path()) + &fix_of(LINEAR) + "run 2\nwrite_restart half\n";
        run_in(host, folder.path(), &first, 2);
        let again = |fix: &str| format!("{}fix integrate all nve/sphere\n{fix}\nrun 1\n", restart_head(host));
        let renamed = fix_of(LINEAR).replace("bonds all", "links all");
        let none = renamed.replace("bond distance 1.2", "bond none");
        refused(
            host,
            folder.path(),
            &again(&none),
            "the restart file contains the bonds of fix bonds, which the script does not define",
        );
        let printed = run_in(host, folder.path(), &again(&renamed), 2);
        assert!(printed.contains("those of fix bonds in the restart file are lost"), "{printed}");
        // A second fix may start afresh.
        let two = none.clone() + &fix_of(LINEAR).replace("bond distance 1.2", "bond none");
        let printed = run_in(host, folder.path(), &again(&two), 2);
        assert!(printed.contains("`bond none` creates none, and there are none from a restart file"), "{printed}");
    }
}

#[test]
fn two_fixes_do_not_compute_the_same_contacts() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let head = write_row(host, folder.path()) + "group left id 1:4\ngroup right id 5:8\ngroup wide id 4:8\n";
        let contacts = "contact frictional contact.normal_stiffness 1e5 contact.shear_stiffness 1e4 contact.friction_coefficient 0.3";
        let two = |a: &str, b: &str| {
            let fix = |id: &str, group: &str| {
                format!("fix {id} {group} concordem/bond {LINEAR} bond distance 1.2 {contacts}\n")
            };
            format!("{head}{}{}run 2\n", fix("one", a), fix("two", b))
        };
        refused(host, folder.path(), &two("all", "left"), "its `contact` acts on atoms that also belong to fix two");
        run_in(host, folder.path(), &two("left", "right"), 2);
        // A single common atom makes no common pair.
        run_in(host, folder.path(), &two("left", "wide"), 2);
    }
}

/// A dashpot acts in the last step of a run. The pressure at the start of the next run, and after a restart, must contain its force.
#[test]
fn the_pressure_at_the_seam_of_two_runs_contains_dashpots() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let style =
            "compute t all temp\ncompute p all pressure t virial\nthermo_style custom step c_p f_bonds\nthermo 100\n";
        let format = "thermo_modify format float %20.15g\n";
        let head = write_row(host, folder.path());
        let damped = fix_of(&format!("{LINEAR} damping_ratio 0.5"));
        let script = format!("{head}{damped}{style}{format}run 20\nwrite_restart half\nrun 20\n");
        let rows = thermo(&run_in(host, folder.path(), &script, 2));
        let again = format!(
            "{}fix integrate all nve/sphere\n{}{style}{format}run 0\n",
            restart_head(host),
            damped.replace("bond distance 1.2", "bond none")
        );
        let restarted = thermo(&run_in(host, folder.path(), &again, 1));
        assert_eq!((rows[1][0], rows[2][0], restarted[0][0]), (20.0, 20.0, 20.0));
        for pressure in [rows[2][1], restarted[0][1]] {
            // Sums over processors in another order.
            assert!((pressure - rows[1][1]).abs() <= 1e-12 * rows[1][1].abs(), "{host:?}: {rows:?} {restarted:?}");
        }
    }
}

/// A bond is strained at first. Runs of no steps before the first step must not lose its force.
#[test]
fn runs_of_no_steps_change_nothing() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        data_file_for(
            host,
            &folder.path().join("two.data"),
            &[at(0.02), at(0.03)],
            &[],
            Vec3::zeros(),
            Vec3::repeat(0.1),
        );
        std::fs::write(folder.path().join("list.txt"), "1 2 0.0099\n").unwrap();
        let head = head_for(host, "two.data", "f f f", 1e-3, DT) + "fix integrate all nve/sphere\n";
        let bonds = format!("fix bonds all concordem/bond {LINEAR} bond list list.txt\n");
        let mut ends = Vec::new();
        for runs in ["run 10\n", "run 0\nrun 0\nrun 10\n"] {
            let script = format!("{head}{bonds}{}{runs}", dump_for(host, "out.dump", 10));
            run_in(host, folder.path(), &script, 1);
            ends.push(frames(&folder.path().join("out.dump")).pop().unwrap().1);
        }
        assert!(ends[0][0].velocity.x > 1e-6);
        assert_eq!(ends[0], ends[1], "{host:?}");
    }
}

#[test]
fn forces_set_to_zero_stay_zero_in_any_order() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let head = write_row(host, folder.path()) + "group held id 3:5\n";
        let (zero, bonds) = ("fix zero held setforce 0 0 0\n", fix_of(LINEAR));
        for order in [format!("{zero}{bonds}"), format!("{bonds}{zero}")] {
            let script = format!("{head}{order}velocity held set 0 0 0\n{}run 30\n", dump_for(host, "out.dump", 30));
            run_in(host, folder.path(), &script, 2);
            let (_, atoms) = frames(&folder.path().join("out.dump")).pop().unwrap();
            assert!(
                atoms[1].velocity.x != 0.2 && atoms[2..5].iter().all(|atom| atom.velocity == Vec3::zeros()),
                "{host:?} {order}"
            );
        }
    }
}

/// `radius_ratio` refers to the mean radius of the bonded atoms: a large sphere far away does not stiffen a beam.
#[test]
fn unbonded_atoms_do_not_change_the_radius_of_beams() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let mut results = Vec::new();
        for far in [false, true] {
            let mut atoms: Vec<Atom> =
                (0..6).map(|k| Atom::resting(Vec3::new(0.01 * f64::from(k), 0.0, 0.0), 0.005)).collect();
            atoms[5].velocity.y = 0.1;
            if far {
                atoms.push(Atom::resting(Vec3::repeat(0.3), 0.05));
            }
            let bonds: &[[usize; 2]] =
                if host == Host::Lammps { &[[1, 2], [2, 3], [3, 4], [4, 5], [5, 6]] } else { &[] };
            data_file_for(host, &folder.path().join("beam.data"), &atoms, bonds, Vec3::repeat(-0.2), Vec3::repeat(0.5));
            let mut script = head_for(host, "beam.data", "f f f", 1e-3, 1e-7);
            match host {
                Host::Liggghts => {
                    writeln!(script, "fix bonds all concordem/bond cohesive_beam {BEAM} bond distance 1.1")
                }
                Host::Lammps => writeln!(script, "bond_style concordem/cohesive_beam\nbond_coeff * {BEAM}"),
            }
            .unwrap();
            script.push_str("fix integrate all nve/sphere\n");
            script.push_str(&dump_for(host, "out.dump", 200));
            run_in(host, folder.path(), &(script + "run 200\n"), 2);
            let (_, mut atoms) = frames(&folder.path().join("out.dump")).pop().unwrap();
            atoms.truncate(6);
            results.push(atoms);
        }
        assert!(results[0][4].velocity.y.abs() > 1e-3);
        assert_eq!(results[0], results[1], "{host:?}");
    }
}

const PROPERTIES: &str = "fix m1 all property/global youngsModulus peratomtype 1e8\n\
                          fix m2 all property/global poissonsRatio peratomtype 0.2\n\
                          fix m3 all property/global coefficientRestitution peratomtypepair 1 0.5\n\
                          fix m4 all property/global coefficientFriction peratomtypepair 1 0.4\n";

/// `pair_style gran` beside bonds: LIGGGHTS' own models would add their forces to those of the fix; our models leave its pairs out.
#[test]
fn pair_styles_of_liggghts_do_not_act_on_pairs_of_the_fix() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    // Spheres that overlap, so that a pair style acts at once; an impactor outside the group hits them.
    let mut atoms: Vec<Atom> = (0..64)
        .map(|k| Atom::resting(Vec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)) * 0.0098, 0.005))
        .collect();
    atoms.push(Atom::resting(Vec3::new(0.0147, 0.0147, 0.0372), 0.005));
    atoms[64].velocity.z = -10.0;
    data_file_for(Host::Liggghts, &folder.join("cube.data"), &atoms, &[], Vec3::repeat(-0.03), Vec3::repeat(0.07));
    let head = head_for(Host::Liggghts, "cube.data", "f f f", 1e-3, DT)
        + PROPERTIES
        + "group cube id 1:64\nfix integrate all nve/sphere\n";
    let contact = "contact hertz_mindlin contact.young 1e8 contact.poisson 0.2 contact.friction_coefficient 0.4 contact.restitution 0.5";
    let fix = |group: &str, strength: &str, contact: &str| {
        format!(
            "fix bonds {group} concordem/bond cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength {strength} \
             bond distance 1.1 {contact}\n"
        )
    };
    let pair = |model: &str| format!("pair_style gran model {model}\npair_coeff * *\n");
    let exclude = "neigh_modify exclude group cube cube\n";
    let end = format!(
        "thermo_style custom step f_bonds f_bonds[2]\n{}run 100\nrun 100\n",
        dump_for(Host::Liggghts, "out.dump", 100)
    );
    let outcome = |script: &str, processors: usize| {
        let rows = thermo(&run_in(Host::Liggghts, folder, script, processors));
        (rows.last().unwrap().clone(), frames(&folder.join("out.dump")))
    };
    for contact in ["", contact] {
        let own = format!("{head}{}{}{end}", pair("hertz tangential history"), fix("cube", "1e12", contact));
        let ignore = if contact.is_empty() { "" } else { " exclude ignore" };
        refused(
            Host::Liggghts,
            folder,
            &own,
            "both pair_style gran and this fix compute the forces between them. Use a model of ConcorDEM",
        );
        // The recipe: the pairs of the fix are not in the neighbor lists, or our model leaves them out. Only the impactor interacts
        // through the pair style, as long as no bond breaks.
        let excluded = own.replace("fix integrate", &format!("{exclude}fix integrate"));
        if !contact.is_empty() {
            refused(Host::Liggghts, folder, &excluded, "names pairs of group cube, whose contacts this fix computes");
        }
        let recipe = outcome(&excluded.replace("bond distance 1.1", &format!("bond distance 1.1{ignore}")), 1);
        assert!(recipe.1.last().unwrap().1[64].velocity.z > -9.0, "the impactor was stopped");
        for processors in [1, 2] {
            let ours = outcome(&own.replace("model hertz", "model concordem/hertz"), processors);
            assert_eq!(ours.0, recipe.0);
            // LIGGGHTS' own formulas round differently, and the impact amplifies that.
            for ((_, a), (_, b)) in ours.1.iter().zip(&recipe.1) {
                let apart = a.iter().zip(b).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
                assert!(apart < 1e-14, "{processors}: {apart:e} m");
            }
        }
    }
    // Without a contact law, the pair style takes over the pairs of broken bonds: they do not pass through each other.
    let weak = |model: &str| format!("{head}{}{}{end}", pair(model), fix("all", "2e6", ""));
    let taken = outcome(&weak("concordem/hertz tangential history"), 1);
    assert!(taken.0[2] > 20.0, "bonds broke: {:?}", taken.0);
    let nearest = |atoms: &[harness::Dumped]| {
        let mut nearest = f64::INFINITY;
        for a in 0..atoms.len() {
            for b in 0..a {
                nearest = nearest.min((atoms[a].position - atoms[b].position).norm());
            }
        }
        nearest
    };
    assert!(nearest(&taken.1.last().unwrap().1) > 0.0085, "{}", nearest(&taken.1.last().unwrap().1));
    let two = outcome(&weak("concordem/hertz tangential history"), 2);
    assert_eq!(two.0, taken.0);
}

/// The same in `pair_style hybrid`: spheres 1 and 2 of type 1 are bonded and overlap, and so do the free spheres 3 and 4 of type 2.
#[test]
fn granular_sub_styles_of_hybrids_do_not_act_on_pairs_of_the_fix() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let atoms = [0.0, 0.0098, 0.05, 0.0598].map(|x| Atom { kind: if x < 0.03 { 1 } else { 2 }, ..at(x) });
    data_file_for(Host::Liggghts, &folder.join("pairs.data"), &atoms, &[], Vec3::repeat(-0.03), Vec3::repeat(0.13));
    let properties = PROPERTIES
        .replace("1e8", "1e8 1e8")
        .replace("0.2", "0.2 0.2")
        .replace("1 0.5", "2 0.5 0.5 0.5 0.5")
        .replace("1 0.4", "2 0.4 0.4 0.4 0.4");
    let head = head_for(Host::Liggghts, "pairs.data", "f f f", 1e-3, 1e-7) + &properties + "group ours type 1\n";
    let end = format!(
        "fix bonds ours concordem/bond {LINEAR} bond distance 1.2\nfix motion all nve/sphere\n{}run 100\n",
        dump_for(Host::Liggghts, "out.dump", 100)
    );
    let moved = |styles: &str, processors: usize| {
        run_in(Host::Liggghts, folder, &format!("{head}{styles}{end}"), processors);
        frames(&folder.join("out.dump")).pop().unwrap().1
    };
    let granular = "gran model hertz tangential history";
    for (styles, wanted) in [
        (
            format!("pair_style hybrid {granular}\npair_coeff * * gran\n"),
            "the sub-style gran of pair_style hybrid and this fix",
        ),
        (
            format!("pair_style hybrid/overlay {granular} soft 0.01\npair_coeff * * gran\npair_coeff * * soft 0.0\n"),
            "the sub-style gran of pair_style hybrid/overlay and this fix",
        ),
    ] {
        refused(Host::Liggghts, folder, &format!("{head}{styles}{end}"), &format!("atoms 1 and 2: both {wanted}"));
    }
    // LIGGGHTS never sets the histories in lists that leave types out.
    let rolling = "fix m5 all property/global coefficientRollingFriction peratomtypepair 2 0.1 0.1 0.1 0.1\n";
    for keeps in ["tangential history", "tangential off rolling_friction epsd2"] {
        let some = format!(
            "{rolling}pair_style hybrid gran model concordem/hertz {keeps} soft 0.01\npair_coeff 2 2 gran\n\
             pair_coeff 1 * soft 0.0\n"
        );
        refused(Host::Liggghts, folder, &format!("{head}{some}{end}"), "LIGGGHTS does not keep histories of contacts");
    }
    let alone = moved(&format!("pair_style {}\npair_coeff * *\n", granular.replace("hertz", "concordem/hertz")), 1);
    assert!(
        alone[0].velocity.norm() == 0.0 && alone[2].velocity.x < 0.0,
        "only the free pair is pressed apart: {alone:?}"
    );
    for processors in [1, 2] {
        // The remedies, and the style on other pairs only.
        for styles in [
            format!("pair_style hybrid {}\npair_coeff * * gran\n", granular.replace("hertz", "concordem/hertz")),
            format!(
                "neigh_modify exclude group ours ours\npair_style hybrid/overlay {granular} soft 0.01\npair_coeff * * gran\n\
                 pair_coeff * * soft 0.0\n"
            ),
            "pair_style hybrid gran model hertz tangential off soft 0.01\npair_coeff 2 2 gran\npair_coeff 1 * soft 0.0\n"
                .to_owned(),
            "pair_style hybrid gran model concordem/hertz tangential off soft 0.01\npair_coeff 2 2 gran\n\
             pair_coeff 1 * soft 0.0\n"
                .to_owned(),
        ] {
            let found = moved(&styles, processors);
            for (a, b) in found.iter().zip(&alone) {
                // LIGGGHTS' own formulas round differently.
                assert!((a.position - b.position).norm() < 1e-16, "{processors}: {a:?} {b:?}\n{styles}");
            }
        }
    }
}

/// The recipe of the reference page: a bonded cube falls on a mesh wall, whose histories the pair style stores.
#[test]
fn a_bonded_body_rebounds_from_a_mesh_wall() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(
        folder.join("wall.stl"),
        "solid wall\nfacet normal 0 0 1\nouter loop\nvertex -0.02 -0.02 0\nvertex 0.1 -0.02 0\nvertex 0.1 0.1 0\nendloop\nendfacet\n\
         facet normal 0 0 1\nouter loop\nvertex -0.02 -0.02 0\nvertex 0.1 0.1 0\nvertex -0.02 0.1 0\nendloop\nendfacet\n\
         endsolid wall\n",
    )
    .unwrap();
    let mut atoms: Vec<Atom> = (0..27)
        .map(|k| {
            Atom::resting(
                Vec3::new(f64::from(k % 3), f64::from(k / 3 % 3), f64::from(k / 9)) * 0.0098 + Vec3::repeat(0.0055),
                0.005,
            )
        })
        .collect();
    for atom in &mut atoms {
        atom.velocity.z = -1.0;
    }
    data_file_for(Host::Liggghts, &folder.join("cube.data"), &atoms, &[], Vec3::repeat(-0.03), Vec3::repeat(0.11));
    let head = head_for(Host::Liggghts, "cube.data", "f f f", 1e-3, DT) + PROPERTIES;
    let bonds = "fix bonds all concordem/bond cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 1e12 bond distance 1.1 \
                 contact hertz_mindlin contact.young 1e8 contact.poisson 0.2 contact.friction_coefficient 0.4 contact.restitution 0.5\n";
    let mut ends = Vec::new();
    for processors in [1, 2] {
        let script = format!(
            "{head}pair_style gran model concordem/hertz tangential history\npair_coeff * *\n\
             fix wall all mesh/surface file wall.stl type 1\n\
             fix walls all wall/gran model concordem/hertz tangential history mesh n_meshes 1 meshes wall\n{bonds}\
             fix integrate all nve/sphere\nthermo_style custom step f_bonds\n{}run 3000\n",
            dump_for(Host::Liggghts, "out.dump", 3000)
        );
        let rows = thermo(&run_in(Host::Liggghts, folder, &script, processors));
        let (first, last) = (&rows[0], rows.last().unwrap());
        assert!(first[1] == last[1] && first[1] == 54.0, "{rows:?}");
        let atoms = frames(&folder.join("out.dump")).pop().unwrap().1;
        let rise = atoms.iter().map(|atom| atom.velocity.z).sum::<f64>() / 27.0;
        // Restitution 0.5 of single spheres; the body also vibrates.
        assert!(rise > 0.2, "on {processors}: {rise} m/s");
        ends.push(atoms);
    }
    for (a, b) in ends[0].iter().zip(&ends[1]) {
        // The pair style has no force here, and the walls act on single atoms.
        assert_eq!(a, b);
    }
}
