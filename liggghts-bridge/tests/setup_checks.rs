//! What is said, allowed, or refused when a run is set up: time steps beyond the bound, unbonded atoms without a law, two dimensions, units,
//! special bonds, messages.

use std::path::Path;
use std::process::Command;

use crate::harness::{Atom, Host, attempt_in, built, data_file_for, dump_for, frames, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

/// Spheres along x, the distances in m.
fn row(host: Host, folder: &Path, count: usize, distance: f64, bonded: bool) {
    let at = |k| Atom::resting(Vec3::new(distance * k as f64, 0.0, 0.0), 0.005);
    let atoms: Vec<Atom> = (0..count).map(at).collect();
    let bonds: Vec<[usize; 2]> = if bonded { (1..count).map(|k| [k, k + 1]).collect() } else { Vec::new() };
    data_file_for(host, &folder.join("row.data"), &atoms, &bonds, Vec3::repeat(-0.05), Vec3::repeat(0.1));
}

/// Six beams with a step of twice their bound, which is 1.5e-5 s.
#[test]
fn a_step_beyond_the_bound_is_named() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        row(host, folder.path(), 6, 0.01, false);
        let script = |dt: f64| {
            head_for(host, "row.data", "f f f", 2e-3, dt)
                + "fix integrate all nve/sphere\nfix bonds all concordem/bond cohesive_beam young 1e9 poisson 0.3 radius 0.004 \
                   tensile_strength 1e7 bond distance 1.05 contact none\nthermo_style custom step f_bonds[16]\nrun 1\n"
        };
        let (mut bounds, steps) = (Vec::new(), [3e-5, 1.6e-5, 1.4e-5, 1e-6]);
        for dt in steps {
            for processors in [1, 2] {
                let printed = run_in(host, folder.path(), &script(dt), processors);
                let bound = thermo(&printed).last().unwrap()[1];
                assert_eq!(
                    printed.matches("is unstable with `timestep").count(),
                    usize::from(dt > bound),
                    "{host:?}: {printed}"
                );
                bounds.push(bound);
            }
        }
        // The largest stable step, if the present one is not much smaller; each of two processors knows its own bonds.
        assert!(bounds[..4].iter().all(|bound| (1.4e-5..1.6e-5).contains(bound)), "{host:?}: {bounds:?}");
        assert!(bounds[6..].iter().all(|bound| (1e-6..1.6e-5).contains(bound)), "{host:?}: {bounds:?}");
    }
}

/// The bound of the first run suffices; then a command changes the step, the masses, or the radii, between runs or in one.
#[test]
fn steps_masses_and_radii_that_change_later_are_compared_again() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        row(host, folder.path(), 6, 0.01, false);
        // `sphere 1`: LAMMPS sends radii that change. Its atoms have no molecules.
        let head = if host == Host::Lammps {
            data_file_for(
                Host::Liggghts,
                &folder.path().join("row.data"),
                &(0..6).map(|k| Atom::resting(Vec3::x() * (0.01 * f64::from(k)), 0.005)).collect::<Vec<_>>(),
                &[],
                Vec3::repeat(-0.05),
                Vec3::repeat(0.1),
            );
            head_for(host, "row.data", "f f f", 2e-3, 1e-5)
                .replace("bpm/sphere", "sphere 1")
                .replace("special_bonds lj 0 1 1 coul 0 1 1\n", "")
        } else {
            head_for(host, "row.data", "f f f", 2e-3, 1e-5)
        };
        let mass = if host == Host::Lammps { " mass yes" } else { "" };
        let shrink = format!("variable d equal 0.01-0.0001*step\nfix shrink all adapt 1 atom diameter v_d{mass}\n");
        let longer = "fix longer all dt/reset 5 1e-5 3e-5 1.0 units box\n";
        let first = "fix integrate all nve/sphere\nfix bonds all concordem/bond cohesive_beam young 1e9 poisson 0.3 radius 0.004 \
                     tensile_strength 1e7 bond distance 1.05 contact none\nthermo_style custom step f_bonds[16]\nthermo 1\nrun 2\n";
        for (change, warnings) in
            [("", 0), ("timestep 3e-5\n", 1), ("set group all density 100\n", 1), (longer, 1), (shrink.as_str(), 1)]
        {
            for processors in [1, 2] {
                let script = format!("{head}{first}neigh_modify every 1 delay 0 check no\n{change}run 60\n");
                let printed = run_in(host, folder.path(), &script, processors);
                assert_eq!(
                    printed.matches("is unstable with `timestep").count(),
                    warnings,
                    "{host:?} on {processors}: {change}{printed}"
                );
            }
        }
    }
}

/// Two held spheres that touch are as good as infinitely heavy, and so is their dashpot: they set no bound.
#[test]
fn contacts_of_held_atoms_set_no_bound_of_the_step() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        row(host, folder.path(), 3, 0.00999, false);
        let bound = |fixes: &str| {
            let script = head_for(host, "row.data", "f f f", 2e-3, 1e-6)
                + "fix c all concordem/bond none contact linear_bond normal_stiffness 1e5 shear_stiffness 0 friction_coefficient 0 damping_ratio 0.2\n\
                   fix move all nve/sphere\nthermo_style custom step f_c[16]\n"
                + fixes
                + "run 1\n";
            let printed = run_in(host, folder.path(), &script, 1);
            assert!(!printed.contains("is unstable"), "{printed}");
            thermo(&printed).last().unwrap()[1]
        };
        let [free, held] = ["", "group two id 1 2\nfix hold two freeze\n"].map(bound);
        // The free sphere alone: mass 1.3e-3 kg, 2/omega = 2.3e-4 s, less by damping.
        assert!((1e-5..2.3e-4).contains(&free) && (1e-5..2.3e-4).contains(&held), "{host:?}: {free} {held}");
    }
}

#[test]
fn unbonded_atoms_without_a_law_are_warned_about() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        row(host, folder.path(), 3, 0.01, false);
        let head = head_for(host, "row.data", "f f f", 2e-3, 1e-7) + "fix integrate all nve/sphere\n";
        let fix =
            "fix bonds all concordem/bond linear_bond normal_stiffness 1e4 shear_stiffness 1e4 bond distance 1.05";
        let zero = if host == Host::Lammps { "pair_style zero 0.01\npair_coeff * *\n" } else { "" };
        for (styles, contact, wanted) in [
            ("", "", 1),
            ("", " contact none", 0),
            ("", " contact linear_bond", 0),
            (zero, "", usize::from(zero.is_empty())),
        ] {
            let printed = run_in(host, folder.path(), &format!("{head}{styles}{fix}{contact}\nrun 1\nrun 1\n"), 2);
            // One per run.
            assert_eq!(
                printed.matches("unbonded atoms pass through each other").count(),
                2 * wanted,
                "{host:?}: {printed}"
            );
        }
    }
}

/// In two dimensions the box is periodic along z, but has no images there, however thin it is.
#[test]
fn boxes_of_two_dimensions_may_be_thin() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let mut ends = Vec::new();
        for depth in [0.005, 0.05] {
            let at = |k: i32| Atom {
                velocity: Vec3::y() * (0.1 * f64::from(k)),
                ..Atom::resting(Vec3::x() * (0.01 * f64::from(k)), 0.005)
            };
            let atoms: Vec<Atom> = (0..6).map(at).collect();
            let (low, high) = (Vec3::new(-0.05, -0.05, -depth), Vec3::new(0.1, 0.05, depth));
            data_file_for(host, &folder.path().join("row.data"), &atoms, &[], low, high);
            let head = head_for(host, "row.data", "p f p", 2e-3, 1e-6).replace("boundary", "dimension 2\nboundary");
            let script = head
                + "fix integrate all nve/sphere\nfix flat all enforce2d\n\
                   fix bonds all concordem/bond linear_bond normal_stiffness 1e4 shear_stiffness 1e4 bond distance 1.05 contact none\n"
                + &dump_for(host, "out.dump", 100)
                + "run 100\n";
            for processors in [1, 2] {
                run_in(host, folder.path(), &script, processors);
                ends.push(frames(&folder.path().join("out.dump")).pop().unwrap().1);
            }
        }
        assert!(ends[0][0].velocity.x != 0.0 && ends.iter().all(|end| *end == ends[0]), "{host:?}: {ends:?}");
    }
}

/// Units without factors: the same numbers. Values with units, and heat, need SI.
#[test]
fn consistent_units_give_the_same_numbers() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        row(host, folder.path(), 3, 0.01, false);
        let fix = "fix bonds all concordem/bond cohesive_beam young 1e8 poisson 0.3 radius 0.004 tensile_strength 1e9 bond distance 1.05 \
                   contact none\n";
        let script = |units: &str, fix: &str| {
            head_for(host, "row.data", "f f f", 2e-3, 1e-6).replace("units si", &format!("units {units}"))
                + "fix integrate all nve/sphere\n"
                + fix
                + "velocity all set 0.1 0 0\ngroup one id 1\nvelocity one set 0 0.2 0\n"
                + &dump_for(host, "out.dump", 50)
                + "run 50\n"
        };
        let mut ends = Vec::new();
        for units in ["si", "lj", "cgs", "micro", "nano"] {
            run_in(host, folder.path(), &script(units, fix), 1);
            ends.push(frames(&folder.path().join("out.dump")).pop().unwrap().1);
        }
        assert!(ends[0][1].velocity.y > 0.0 && ends.iter().all(|end| *end == ends[0]), "{host:?}: {ends:?}");
        std::fs::write(
            folder.path().join("m.toml"),
            "[[material]]\nname = \"a\"\ndensity = \"1 kg/m^3\"\nlinear_bond = { normal_stiffness = 1e4, shear_stiffness = 1e4 }\n",
        )
        .unwrap();
        std::fs::write(folder.path().join("heat.toml"), "[heat]\n").unwrap();
        let cases = [
            (
                "lj",
                fix.replace("young 1e8", "young \"0.1 GPa\""),
                "`young = 0.1 GPa`: the script does not use `units si`",
            ),
            (
                "lj",
                "fix bonds all concordem/bond linear_bond materials m.toml bond distance 1.05\n".into(),
                "`density = 1 kg/m^3`: the script does not use `units si`",
            ),
            ("cgs", fix.replace("contact", "heat heat.toml contact"), "`heat` needs `units si`"),
            ("real", fix.into(), "a force is not mass times acceleration"),
        ];
        for (units, fix, wanted) in cases {
            let output = attempt_in(host, folder.path(), &script(units, &fix), 1);
            let printed = text(&output);
            assert!(!output.status.success() && printed.contains(wanted), "{host:?}: {printed}");
        }
    }
}

/// A wire of overlapping spheres, whose second neighbors must not repel each other. That is right as long as no bond breaks.
#[test]
fn special_bonds_are_followed_as_long_as_no_bond_breaks() {
    let folder = tempfile::tempdir().unwrap();
    row(Host::Lammps, folder.path(), 8, 0.004, true);
    let head = head_for(Host::Lammps, "row.data", "f f f", 2e-3, 1e-7) + "fix integrate all nve/sphere\n";
    let granular = "pair_style granular\npair_coeff * * hertz/material 1e7 0.5 0.3 tangential mindlin NULL 1.0 0.4 damping coeff_restitution\n";
    let ours = "pair_style concordem/hertz_mindlin\npair_coeff * * young 1e7 poisson 0.3 friction_coefficient 0.4 restitution 0.5\n";
    let bonds = |strength: &str| {
        format!(
            "bond_style concordem/cohesive_beam\nbond_coeff * young 1e8 poisson 0.3 radius 0.002 tensile_strength {strength}\n\
             thermo_style custom step f_concordem_bonds\ncompute push all reduce max fx\nthermo_style custom step f_concordem_bonds c_push\n"
        )
    };
    for pair in [granular, ours] {
        // Nothing is strained, and nothing touches.
        for special in ["lj 0 0 0 coul 1 1 1", "lj 0 0 0 coul 0 0 0"] {
            let script = format!("{head}special_bonds {special}\n{pair}{}run 10\n", bonds("1e30"));
            let printed = run_in(Host::Lammps, folder.path(), &script, 2);
            let last = thermo(&printed).pop().unwrap();
            // Rounding of the positions times the stiffness of a beam.
            assert!(
                last[1] == 7.0 && last[2].abs() < 1e-9 && printed.contains("ends the run when a bond breaks"),
                "{printed}"
            );
        }
        let script = format!(
            "{head}special_bonds lj 0 0 0 coul 1 1 1\n{pair}{}group end id 1\nvelocity end set -100 0 0\nrun 100\n",
            bonds("1e6")
        );
        let output = attempt_in(Host::Lammps, folder.path(), &script, 2);
        let printed = text(&output);
        assert!(
            !output.status.success() && printed.contains("the bond of atoms 1 and 2 broke; with pair_style"),
            "{printed}"
        );
    }
    // Second neighbors touch, or do not, as asked for.
    let apart = |special: &str| {
        let script = format!("{head}special_bonds {special}\n{ours}{}run 2\n", bonds("1e30"));
        thermo(&run_in(Host::Lammps, folder.path(), &script, 1)).pop().unwrap()[2]
    };
    assert!(apart("lj 0 1 1 coul 1 1 1") > 1.0 && apart("lj 0 0 1 coul 1 1 1").abs() < 1e-9);
    for (special, wanted) in [
        ("lj 0 0.5 1 coul 1 1 1", "no weights between 0 and 1"),
        ("lj 1 1 1 coul 1 1 1", "bonded atoms have no contact beside their bond"),
    ] {
        let output = attempt_in(
            Host::Lammps,
            folder.path(),
            &format!("{head}special_bonds {special}\n{ours}{}run 2\n", bonds("1e30")),
            1,
        );
        assert!(!output.status.success() && text(&output).contains(wanted), "{}", text(&output));
    }
}

/// LIGGGHTS picks its tip of the day by `rand()`; 0 picks one.
#[test]
fn messages_are_complete_and_end_without_a_tip() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("rand.c"), "int rand(void) { return 0; }\n").unwrap();
    let compiler =
        Command::new("cc").args(["-shared", "-fPIC", "-o", "rand.so", "rand.c"]).current_dir(folder).status().unwrap();
    assert!(compiler.success());
    row(Host::Liggghts, folder, 3, 0.01, false);
    let name = "deep/".repeat(120) + "missing.toml";
    let head = head_for(Host::Liggghts, "row.data", "f f f", 2e-3, 1e-7);
    let tail = format!("materials {name} contact cpm bond distance 1.05\n");
    for (command, wanted) in [
        (format!("fix bonds all concordem/bond linear_bond {tail}"), format!("cannot read {name}: ")),
        (
            "compute stress all concordem/stress/atom\n".to_owned(),
            "the id of a fix concordem/bond is missing".to_owned(),
        ),
        ("pair_style gran model concordem/hertz nonsense on\n".to_owned(), "nonsense".to_owned()),
    ] {
        let script = folder.join("script.in");
        std::fs::write(&script, format!("{head}{command}run 1\n")).unwrap();
        let output = Command::new(built("liggghts/concordem-liggghts", "liggghts-bridge/build"))
            .arg(&script)
            .args(["-log", "none"])
            .env("LD_PRELOAD", folder.join("rand.so"))
            .current_dir(folder)
            .output()
            .unwrap();
        let printed = text(&output);
        let ending = printed.split("ERROR: ").nth(1).unwrap_or_else(|| panic!("{printed}"));
        assert!(
            !output.status.success() && ending.contains(&wanted) && ending.trim_end().lines().count() == 1,
            "{printed}"
        );
    }
}
