//! What LAMMPS adds: bonds of the atoms' own lists, virials, energies, restart.

mod harness;

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use concordem::math::Vec3;
use harness::{Atom, Dice, Host, attempt_in, data_file_for, dump_for, frames, head_for, run_in, tables, text, thermo};

const DT: f64 = 5e-7;
const FACTOR: f64 = 1.5;
const LAW: &str = "cpm young 30e9 shear_ratio 0.2 cohesion 4.5e6 friction_coefficient 0.8 crack_onset_strain 1.5e-4 \
                   relative_ductility 4 omega_threshold 0.99";
const BEAM: &str = "cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 5e6";

/// A crooked bar of 5 × 5 × 16 spheres that is torn apart along z, and its bonds (ids from 1).
fn bar() -> (Vec<Atom>, Vec<[usize; 2]>) {
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
    // Ids that do not follow space.
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

fn write_bar(folder: &Path) -> usize {
    let (atoms, bonds) = bar();
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.18));
    data_file_for(Host::Lammps, &folder.join("bar.data"), &atoms, &[], low, high);
    data_file_for(Host::Lammps, &folder.join("bonded.data"), &atoms, &bonds, low, high);
    bonds.len()
}

/// With the fix of the host's own bond making, or with the bond style.
fn bonds_by(style: bool, law: &str) -> (String, &'static str) {
    let (name, parameters) = law.split_once(' ').unwrap();
    if style {
        let text = format!("bond_style concordem/{name} contact cpm\nbond_coeff * {parameters}\n");
        (text.replace("contact cpm", contact_of(name)), "concordem_bonds")
    } else {
        (format!("fix bonds all concordem/bond {law} bond distance {FACTOR} {}\n", contact_of(name)), "bonds")
    }
}

fn contact_of(law: &str) -> &'static str {
    if law == "cpm" {
        "contact cpm"
    } else {
        "contact hertz_mindlin contact.young 1e9 contact.poisson 0.2 contact.friction_coefficient 0.4 contact.restitution 0.7"
    }
}

#[test]
fn bond_style_and_fix_make_the_same_run_on_one_and_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let count = write_bar(folder.path()) as f64;
    for law in [LAW, BEAM] {
        let mut dumps = Vec::new();
        let mut broken = Vec::new();
        for (style, processors) in [(false, 1), (false, 2), (true, 1), (true, 2)] {
            let data = if style { "bonded.data" } else { "bar.data" };
            let (bonds, fix) = bonds_by(style, law);
            let mut script = head_for(Host::Lammps, data, "f f f", 5e-4, DT);
            script.push_str(&bonds);
            // The atoms' own lists lose what breaks.
            let listed = if style { "c_listed" } else { "c_none" };
            writeln!(
                script,
                "fix integrate all nve/bpm/sphere\ncompute ends all nbond/atom\ncompute listed all reduce sum c_ends\n\
                 compute none all reduce sum x\nthermo_style custom step f_{fix} f_{fix}[2] {listed} ebond f_{fix}[4] f_{fix}[5] \
                 f_{fix}[6] f_{fix}[7]\nthermo 50\nthermo_modify format float %20.15g"
            )
            .unwrap();
            script.push_str(&dump_for(Host::Lammps, "out.dump", 50));
            script.push_str("run 150\nrun 150\n");
            let printed = run_in(Host::Lammps, folder.path(), &script, processors);
            let rows = thermo(&printed);
            assert_eq!(rows[0][1], count);
            for row in &rows {
                assert_eq!(row[1] + row[2], count, "bonds lost or doubled");
                if style {
                    assert_eq!(row[3], 2.0 * row[1], "the atoms' lists: {row:?}");
                    let stored: f64 = row[5..9].iter().sum();
                    assert!((row[4] - stored).abs() <= 1e-12 * stored, "bond energy {} {stored}", row[4]);
                }
            }
            broken.push(rows.last().unwrap()[2]);
            dumps.push(std::fs::read(folder.path().join("out.dump")).unwrap());
        }
        println!("{count} bonds, broken: {broken:?}");
        assert!(broken[0] > 50.0 && broken.iter().all(|b| *b == broken[0]), "{broken:?}");
        assert!(dumps[1..].iter().all(|dump| *dump == dumps[0]), "runs differ");
    }
}

#[test]
fn load_balancing_loses_no_bond() {
    let folder = tempfile::tempdir().unwrap();
    let (atoms, bonds) = bar();
    let count = bonds.len() as f64;
    // A long box, of which the bar fills one end.
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.6));
    data_file_for(Host::Lammps, &folder.path().join("bonded.data"), &atoms, &bonds, low, high);
    let (bonds, _) = bonds_by(true, BEAM);
    let mut dumps = Vec::new();
    for (balance, processors) in [
        ("", 1),
        ("fix balance all balance 10 1.0 shift z 20 1.01", 2),
        ("comm_style tiled\nfix balance all balance 20 1.0 rcb", 2),
    ] {
        let mut script = head_for(Host::Lammps, "bonded.data", "f f f", 5e-4, DT);
        script.push_str(&bonds);
        writeln!(script, "{balance}\nfix integrate all nve/bpm/sphere\nthermo 100").unwrap();
        if !balance.is_empty() {
            // Largest number of atoms of a processor.
            script.push_str("thermo_style custom step f_balance[1] f_concordem_bonds f_concordem_bonds[2]\n");
        }
        script.push_str(&dump_for(Host::Lammps, "out.dump", 100));
        script.push_str("run 300\n");
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, processors));
        if !balance.is_empty() {
            let end = rows.last().unwrap();
            assert!(end[1] < 0.6 * atoms.len() as f64, "{balance}: a processor has {} atoms", end[1]);
            assert!(
                end[3] > 50.0 && rows.iter().all(|row| row[2] + row[3] == count),
                "bonds lost or doubled: {rows:?}"
            );
        }
        dumps.push(frames(&folder.path().join("out.dump")));
    }
    for dump in &dumps[1..] {
        for ((step, atoms), (_, same)) in dump.iter().zip(&dumps[0]) {
            let apart = atoms.iter().zip(same).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
            // LAMMPS rounds the coordinates (below 0.2 m, to 3e-17) whenever borders move, thirty times here; the network does
            // not make much more of it (measured 6e-16).
            assert!(apart < 1e-14, "step {step}: {apart:e} m");
        }
    }
}

#[test]
fn virials_are_those_of_the_bond_forces() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    for (style, processors) in [(false, 1), (true, 1), (true, 2)] {
        let data = if style { "bonded.data" } else { "bar.data" };
        let (bonds, fix) = bonds_by(style, BEAM);
        let mut script = head_for(Host::Lammps, data, "f f f", 5e-4, DT);
        script.push_str(&bonds);
        writeln!(
            script,
            "fix integrate all nve/bpm/sphere\ncompute rows all concordem/bond/local {fix}\ncompute p all pressure NULL virial\n\
             compute s all stress/atom NULL virial\ncompute t all reduce sum c_s[1] c_s[2] c_s[3] c_s[4] c_s[5] c_s[6]\n\
             dump rows all local 20 rows.dump c_rows[1] c_rows[2] c_rows[3] c_rows[4] c_rows[5]\n\
             dump_modify rows format float %.17g\n\
             thermo_style custom step c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6] c_t[1] c_t[2] c_t[3] c_t[4] c_t[5] c_t[6]\n\
             thermo 20\nthermo_modify format float %20.15g"
        )
        .unwrap();
        script.push_str(&dump_for(Host::Lammps, "out.dump", 20));
        script.push_str("run 40\n");
        let rows = thermo(&run_in(Host::Lammps, folder.path(), &script, processors));
        let atoms: HashMap<u64, _> = frames(&folder.path().join("out.dump")).into_iter().collect();
        let forces: HashMap<u64, _> = tables(&folder.path().join("rows.dump")).into_iter().collect();
        let volume = 0.11 * 0.11 * 0.21;
        for row in rows.iter().filter(|row| row[0] > 0.0) {
            let step = row[0] as u64;
            let mut expected = [0.0; 6];
            let mut size = 0.0;
            for n in &forces[&step] {
                let of = |id: f64| atoms[&step][id as usize - 1].position;
                let branch = of(n[1]) - of(n[0]);
                for (sum, (i, j)) in expected.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
                    *sum -= branch[i] * n[2 + j];
                    size += (branch[i] * n[2 + j]).abs();
                }
            }
            assert!(size > 0.0);
            for k in 0..6 {
                // A sum of some thousand terms, in another order.
                assert!(
                    (row[1 + k] * volume - expected[k]).abs() <= 1e-13 * size,
                    "step {step}, {k}: {row:?} {expected:?}"
                );
                // LAMMPS' stress/atom has the opposite sign of its pressure.
                assert!((-row[7 + k] - expected[k]).abs() <= 1e-13 * size, "step {step}, {k}: {row:?} {expected:?}");
            }
        }
    }
}

#[test]
fn a_restarted_run_goes_on_as_if_nothing_had_happened() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    let (bonds, _) = bonds_by(true, BEAM);
    let rest = format!("fix integrate all nve/bpm/sphere\n{}", dump_for(Host::Lammps, "out.dump", 200));
    let head = head_for(Host::Lammps, "bonded.data", "f f f", 5e-4, DT);
    run_in(Host::Lammps, folder.path(), &format!("{head}{bonds}{rest}run 100\nwrite_restart half\nrun 100\n"), 1);
    let last = |folder: &Path| {
        let all = std::fs::read_to_string(folder.join("out.dump")).unwrap();
        all[all.rfind("ITEM: TIMESTEP").unwrap()..].to_owned()
    };
    let once = last(folder.path());
    for processors in [1, 2] {
        // The bond style comes from the restart file with its parameters; what the fix says is checked against them.
        let again = format!(
            "read_restart half\ncomm_modify vel yes\nneighbor 5e-4 bin\nneigh_modify every 1 delay 0\ntimestep {DT:e}\n{rest}run 100\n"
        );
        run_in(Host::Lammps, folder.path(), &again, processors);
        assert!(once == last(folder.path()), "{processors} processors");
    }
}

#[test]
fn misuse_is_named_with_its_remedy() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    let head = head_for(Host::Lammps, "bonded.data", "f f f", 5e-4, DT);
    let with = |from: &str, to: &str| head.replace(from, to);
    let coeff = format!("bond_coeff * {}\n", BEAM.split_once(' ').unwrap().1);
    for (script, wanted) in [
        (format!("{head}bond_style concordem/cpm\nbond_coeff 1 young 30e9\nrun 0\n"), "missing field"),
        (
            format!("{head}fix b all concordem/bond glue bond none\n"),
            "laws of bonds are linear_bond, cpm, cohesive_beam",
        ),
        (
            format!("{}bond_style concordem/cohesive_beam\n{coeff}run 0\n", with("newton off", "newton on")),
            "newton on off",
        ),
        (
            format!("{}bond_style concordem/cohesive_beam\n{coeff}run 0\n", with("comm_modify vel yes\n", "")),
            "comm_modify vel yes",
        ),
        (format!("{head}bond_style concordem/cohesive_beam bond distance 1.5\n"), "remove `bond`"),
        (format!("{head}bond_style concordem/cohesive_beam\n{coeff}{coeff}"), "parameters are given once"),
        (
            format!("{head}bond_style concordem/cohesive_beam\n{coeff}run 0\ndelete_bonds all bond 1 remove\nrun 0\n"),
            "bonds cannot be added or removed",
        ),
        (
            format!("{head}compute c all concordem/bond/local nothing\nbond_style zero\nbond_coeff *\nrun 0\n"),
            "there is no fix",
        ),
        (format!("{}fix b all concordem/bond {BEAM} bond none\n", with("units si", "units lj")), "use `units si`"),
    ] {
        for processors in [1, 2] {
            let output = attempt_in(Host::Lammps, folder.path(), &script, processors);
            let printed = text(&output);
            assert!(!output.status.success() && printed.contains(wanted), "`{wanted}` is not in\n{printed}\n{script}");
        }
    }
}
