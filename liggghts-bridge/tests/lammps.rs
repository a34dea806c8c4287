//! Features of the LAMMPS plugin only: bonds of the atoms' lists, virials, energies, restart.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::path::Path;

use crate::harness::lammps::{BEAM, DT, LAW, LINEAR, write_bar};
use crate::harness::{
    Atom, Dice, FACTOR, Host, attempt_in, bar, data_file_for, dump_for, frames, head_for, run_in, set_restart_version,
    tables, text, thermo,
};
use concordem_contact::math::Vec3;
use concordem_liggghts::options::{Options, Units};
use concordem_solver::laws::contact_block;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, Scheme, Solver};

/// The styles that compute the forces.
#[derive(Debug, Clone, Copy, PartialEq)]
enum By {
    /// A fix that creates its bonds.
    Fix,
    /// A bond style with the bonds of the atoms' lists.
    BondStyle,
    /// A bond style, and a pair style for the contacts.
    BondAndPairStyle,
    /// A pair style without bonds.
    PairStyle,
}

/// Script lines, and the id of the fix.
fn bonds_by(by: By, law: &str) -> (String, &'static str) {
    let (name, parameters) = law.split_once(' ').unwrap();
    let (contact, of_contact): (_, &[&str]) = match name {
        "cpm" => ("cpm", &[]),
        _ => ("hertz_mindlin", &["young 1e9", "poisson 0.2", "friction_coefficient 0.4", "restitution 0.7"]),
    };
    let prefixed = of_contact.iter().fold(String::new(), |all, parameter| all + " contact." + parameter);
    match by {
        By::Fix => {
            let text =
                format!("fix bonds all concordem/bond {law} bond distance {FACTOR} contact {contact}{prefixed}\n");
            (text, "bonds")
        }
        By::BondStyle => {
            let text = format!("bond_style concordem/{name} contact {contact}{prefixed}\nbond_coeff * {parameters}\n");
            (text, "concordem_bonds")
        }
        By::BondAndPairStyle => {
            let text = format!(
                "pair_style concordem/{contact}\npair_coeff * * {}\nbond_style concordem/{name}\nbond_coeff * {parameters}\n",
                of_contact.join(" ")
            );
            (text, "concordem_bonds")
        }
        By::PairStyle => {
            let text = format!("pair_style concordem/{contact}\npair_coeff * * {}\n", of_contact.join(" "));
            (text, "concordem_contacts")
        }
    }
}

#[test]
fn the_styles_and_the_fix_give_equal_results_on_one_two_and_four_processors() {
    let folder = tempfile::tempdir().unwrap();
    let count = write_bar(folder.path()) as f64;
    for law in [LAW, BEAM] {
        let mut dumps = Vec::new();
        let mut broken = Vec::new();
        for (by, processors) in [
            (By::Fix, 1),
            (By::Fix, 2),
            (By::BondStyle, 1),
            (By::BondStyle, 2),
            (By::BondAndPairStyle, 1),
            (By::BondAndPairStyle, 2),
            (By::BondAndPairStyle, 4),
        ] {
            let style = by != By::Fix;
            let data = if style { "bonded.data" } else { "bar.data" };
            let (bonds, fix) = bonds_by(by, law);
            let mut script = head_for(Host::Lammps, data, "f f f", 5e-4, DT);
            script.push_str(&bonds);
            // Broken bonds are removed from the atoms' lists.
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
                assert_eq!(row[1] + row[2], count, "bonds lost or duplicated");
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
    // A long box; the bar is at one end.
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.6));
    data_file_for(Host::Lammps, &folder.path().join("bonded.data"), &atoms, &bonds, low, high);
    let (bonds, _) = bonds_by(By::BondStyle, BEAM);
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
            // f_balance[1]: largest number of atoms on a processor.
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
                "bonds lost or duplicated: {rows:?}"
            );
        }
        dumps.push(frames(&folder.path().join("out.dump")));
    }
    for dump in &dumps[1..] {
        for ((step, atoms), (_, same)) in dump.iter().zip(&dumps[0]) {
            let apart = atoms.iter().zip(same).map(|(a, b)| (a.position - b.position).norm()).fold(0.0, f64::max);
            // LAMMPS rounds the coordinates (below 0.2 m, to 3e-17) whenever borders move, thirty times here; the difference grows
            // to 6e-16 (measured).
            assert!(apart < 1e-14, "step {step}: {apart:e} m");
        }
    }
}

#[test]
fn virials_are_sums_over_the_bond_forces() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    for (by, processors) in [(By::Fix, 1), (By::BondStyle, 1), (By::BondStyle, 2), (By::BondAndPairStyle, 2)] {
        let data = if by == By::Fix { "bar.data" } else { "bonded.data" };
        let (bonds, fix) = bonds_by(by, BEAM);
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
                // Tolerance: some thousand terms are summed in another order.
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
fn a_restarted_run_equals_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    for by in [By::BondStyle, By::BondAndPairStyle, By::PairStyle] {
        restart(folder.path(), by);
    }
}

fn restart(folder: &Path, by: By) {
    let (bonds, fix) = bonds_by(by, BEAM);
    let rest = format!("fix integrate all nve/bpm/sphere\n{}", dump_for(Host::Lammps, "out.dump", 200));
    let data = if by == By::PairStyle { "bar.data" } else { "bonded.data" };
    let head = head_for(Host::Lammps, data, "f f f", 5e-4, DT);
    let first = format!(
        "{head}{bonds}{rest}thermo_style custom step f_{fix} f_{fix}[3]\nrun 100\nwrite_restart half\nrun 100\n"
    );
    let rows = thermo(&run_in(Host::Lammps, folder, &first, 1));
    // There must be contacts with history at step 100.
    let half = rows.iter().find(|row| row[0] == 100.0).unwrap();
    assert!(half[1] + half[2] > 100.0, "{by:?}: {half:?}");
    let last = |folder: &Path| {
        let all = std::fs::read_to_string(folder.join("out.dump")).unwrap();
        all[all.rfind("ITEM: TIMESTEP").unwrap()..].to_owned()
    };
    let once = last(folder);
    for processors in [1, 2] {
        // The restart file contains the bond style with its parameters; the data of the fix are checked against them.
        let again = format!(
            "read_restart half\ncomm_modify vel yes\nneighbor 5e-4 bin\nneigh_modify every 1 delay 0\ntimestep {DT:e}\n{rest}run 100\n"
        );
        run_in(Host::Lammps, folder, &again, processors);
        assert!(once == last(folder), "{by:?}, {processors} processors");
    }
    let law = if by == By::PairStyle { "none" } else { "cohesive_beam" };
    set_restart_version(&folder.join("half"), law, 1);
    let again = format!("read_restart half\ncomm_modify vel yes\n{rest}run 1\n");
    let refused = attempt_in(Host::Lammps, folder, &again, 1);
    assert!(!refused.status.success() && text(&refused).contains("another version of ConcorDEM"), "{}", text(&refused));
}

/// The pair style's own fix stores the contact histories; defining a bond style later deletes that fix, with a warning.
#[test]
fn a_bond_style_after_a_run_warns_about_lost_histories() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    let head = head_for(Host::Lammps, "bonded.data", "f f f", 5e-4, DT) + "fix integrate all nve/bpm/sphere\n";
    let pair = format!("pair_style concordem/frictional\npair_coeff * * {LINEAR}\n");
    let bonds = format!("bond_style concordem/cohesive_beam\nbond_coeff * {}\n", BEAM.split_once(' ').unwrap().1);
    let warning = "contacts lose their history";
    // At first, the atoms of the lists touch.
    let without = format!(
        "{head}special_bonds lj 1 1 1 coul 1 1 1\n{pair}run 10\nspecial_bonds lj 0 1 1 coul 1 1 1\n{bonds}run 10\n"
    );
    for processors in [1, 2] {
        let after = run_in(Host::Lammps, folder.path(), &without, processors);
        assert_eq!(after.matches(warning).count(), 1, "{after}");
        // Repeating the same parameters changes nothing.
        let again = format!("{head}{pair}{bonds}run 10\npair_coeff * * {LINEAR}\nrun 10\n");
        let before = run_in(Host::Lammps, folder.path(), &again, processors);
        assert!(!before.contains(warning), "{before}");
    }
}

/// Spheres of two types and unequal sizes thrown together, without bonds, by the pair style.
#[test]
#[expect(clippy::too_many_lines, reason = "one comparison, step by step")]
fn contacts_of_the_pair_style_equal_those_of_our_solver() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut dice = Dice(5);
    let atoms: Vec<Atom> = (0..216_usize)
        .map(|k| {
            let place = Vec3::new((k % 6) as f64, (k / 6 % 6) as f64, (k / 36) as f64) * 0.0112;
            let mut atom = Atom::resting(place + dice.vector() * 3e-4, 0.005 * (0.9 + 0.1 * dice.roll()));
            atom.kind = 1 + k % 2;
            atom.velocity = (Vec3::repeat(0.028) - place) * 250.0 + dice.vector();
            atom.spin = dice.vector() * 200.0;
            atom
        })
        .collect();
    data_file_for(Host::Lammps, &folder.join("cloud.data"), &atoms, &[], Vec3::repeat(-0.03), Vec3::repeat(0.09));
    let mut materials = String::new();
    for (k, (young, poisson, restitution, friction)) in
        [(5e6, 0.3, 0.9, 0.4), (2e7, 0.2, 0.5, 0.2)].into_iter().enumerate()
    {
        writeln!(
            materials,
            "[[material]]\nname = \"{k}\"\ndensity = 2500\n[material.hertz_mindlin]\nyoung = {young:e}\npoisson = {poisson}\n\
             restitution = {restitution}\nfriction_coefficient = {friction}\n[material.frictional]\nnormal_stiffness = {}\n\
             shear_stiffness = {}\nfriction_coefficient = {friction}\ndamping_ratio = 0.1",
            young / 100.0,
            young / 200.0
        )
        .unwrap();
    }
    let file = folder.join("materials.toml");
    std::fs::write(&file, materials).unwrap();
    for law in ["hertz_mindlin", "frictional"] {
        let script = |end: &str| {
            let mut script = head_for(Host::Lammps, "cloud.data", "f f f", 1e-3, 2e-6);
            writeln!(script, "pair_style concordem/{law} materials materials.toml\npair_coeff * *").unwrap();
            writeln!(
                script,
                "fix integrate all nve/sphere\ncompute rows all concordem/bond/local concordem_contacts\n\
                 compute p all pressure NULL virial\ndump rows all local 100 rows.dump c_rows[1] c_rows[2] c_rows[3] c_rows[4] c_rows[5]\n\
                 dump_modify rows format float %.17g\nthermo_style custom step f_concordem_contacts[3] evdwl f_concordem_contacts[4] \
                 f_concordem_contacts[5] c_p[1] c_p[2] c_p[3] c_p[4] c_p[5] c_p[6]\nthermo 100\n\
                 thermo_modify format float %20.15g"
            )
            .unwrap();
            script.push_str(&dump_for(Host::Lammps, "out.dump", 100));
            script + end
        };
        let mut dumps = Vec::new();
        for (end, processors) in [("run 300\n", 1), ("run 150\nrun 150\n", 2), ("run 300\n", 4)] {
            let rows = thermo(&run_in(Host::Lammps, folder, &script(end), processors));
            dumps.push(std::fs::read(folder.join("out.dump")).unwrap());
            let atoms: HashMap<u64, _> = frames(&folder.join("out.dump")).into_iter().collect();
            let forces: HashMap<u64, _> = tables(&folder.join("rows.dump")).into_iter().collect();
            let mut touched = 0.0;
            for row in rows.iter().filter(|row| (row[0] as u64).is_multiple_of(100)) {
                touched += row[1];
                let stored = row[3] + row[4];
                assert!((row[2] - stored).abs() <= 1e-12 * stored, "pair energy {} {stored}", row[2]);
                let (mut expected, mut size) = ([0.0; 6], 1e-300);
                for n in &forces[&(row[0] as u64)] {
                    let of = |id: f64| atoms[&(row[0] as u64)][id as usize - 1].position;
                    let branch = of(n[1]) - of(n[0]);
                    for (sum, (i, j)) in expected.iter_mut().zip([(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)]) {
                        *sum -= branch[i] * n[2 + j];
                        size += (branch[i] * n[2 + j]).abs();
                    }
                }
                for k in 0..6 {
                    // Tolerance: some hundred terms are summed in another order.
                    let virial = row[5 + k] * 0.12 * 0.12 * 0.12;
                    assert!((virial - expected[k]).abs() <= 1e-13 * size, "{k}: {virial} {expected:?}");
                }
            }
            assert!(touched > 100.0, "{touched} contacts only");
        }
        assert!(dumps[1..].iter().all(|dump| *dump == dumps[0]), "{law}: runs differ");

        // The same with our solver.
        let words = ["none", "contact", law, "materials", file.to_str().unwrap()].map(str::to_owned);
        let options = Options::parse(&words, 2, Units::Si).unwrap();
        let (block, rows) = contact_block(options.contact, &options.materials, &options.interfaces).unwrap().unwrap();
        let mut particles = Particles::default();
        for atom in &atoms {
            let r = atom.radius;
            let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * atom.density;
            particles.push(
                Sphere { position: atom.position, radius: r },
                (atom.kind - 1) as u16,
                mass,
                0.4 * mass * (r * r),
            );
            *particles.velocity.last_mut().unwrap() = atom.velocity;
            *particles.angular_velocity.last_mut().unwrap() = atom.spin;
        }
        let mut state = State { particles, contacts: Some(block), ..State::default() };
        state.clock.dt = 2e-6;
        let model = Model { scheme: Scheme::VelocityVerlet, contact_rows: rows, ..Model::default() };
        let mut solver = Solver::new(model, &mut state).unwrap();
        for (step, atoms) in frames(&folder.join("out.dump")) {
            while state.clock.step < step {
                solver.step(&mut state).unwrap();
            }
            let apart =
                atoms.iter().zip(&state.particles.position).map(|(a, x)| (a.position - x).norm()).fold(0.0, f64::max);
            println!("{law}, step {step}: {apart:.1e} m apart");
            // Rounding of coordinates below 0.1 m, amplified by collisions (measured 1.4e-17).
            assert!(apart < 1e-15, "{law}, step {step}: {apart:e}");
        }
    }
}

/// The remedies for `pair_style hybrid` and `bond_style hybrid`: a style of LAMMPS for one pair of spheres, our fix for another pair far
/// away. Each pair moves with the same bits as if the other did not exist, because nothing acts between them.
#[test]
fn our_fix_beside_a_style_of_lammps_equals_each_alone() {
    let folder = tempfile::tempdir().unwrap();
    let atoms = [0.0, 0.0099, 0.05, 0.0599].map(|x| Atom {
        kind: if x < 0.03 { 1 } else { 2 },
        velocity: Vec3::new(if x > 0.0 && x < 0.03 { 0.5 } else { 0.0 }, 0.0, 0.0),
        ..Atom::resting(Vec3::new(x, 0.0, 0.0), 0.005)
    });
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.13, 0.08, 0.08));
    data_file_for(Host::Lammps, &folder.path().join("pairs.data"), &atoms, &[[3, 4]], low, high);
    let head = head_for(Host::Lammps, "pairs.data", "f f f", 5e-4, 1e-7)
        + "special_bonds lj 0 1 1 coul 1 1 1\ngroup ours type 1\nfix motion all nve/sphere\n";
    let granular = "pair_style granular\npair_coeff * * hertz/material 5e8 0.5 0.2 tangential mindlin NULL 1.0 0.4 damping \
                    coeff_restitution\nneigh_modify exclude group ours ours\nspecial_bonds lj/coul 1 1 1\n";
    let contacts = "fix ours ours concordem/bond none contact hertz_mindlin exclude ignore young 1e9 poisson 0.2 friction_coefficient 0.4 \
                    restitution 0.7\n";
    let harmonic = "bond_style harmonic\nbond_coeff 1 1e5 0.0098\n";
    let zero = "bond_style zero\nbond_coeff *\n";
    let bonds = format!("fix ours ours concordem/bond {BEAM} bond distance 1.2\n");
    let no_pairs = "pair_style zero 0.012\npair_coeff * *\n";
    for (host, without, ours) in [
        (format!("{zero}{granular}"), format!("{zero}{no_pairs}"), contacts),
        (format!("{no_pairs}{harmonic}"), format!("{no_pairs}{zero}"), bonds.as_str()),
    ] {
        let forces = |styles: &str, processors: usize| -> Vec<String> {
            let script = format!(
                "{head}{styles}run 50\nwrite_dump all custom end.dump id x vx fx modify sort id format float %.17g\n"
            );
            run_in(Host::Lammps, folder.path(), &script, processors);
            let dump = std::fs::read_to_string(folder.path().join("end.dump")).unwrap();
            dump.lines().skip(9).map(ToOwned::to_owned).collect()
        };
        let (host_alone, ours_alone) = (forces(&host, 1), forces(&format!("{without}{ours}"), 1));
        let force = |row: &String| row.split_whitespace().last().unwrap().parse::<f64>().unwrap().abs();
        assert!(force(&host_alone[2]) > 0.1 && force(&ours_alone[0]) > 0.1, "{host_alone:?}\n{ours_alone:?}");
        for processors in [1, 2] {
            let both = forces(&format!("{host}{ours}"), processors);
            assert_eq!(both[..2], ours_alone[..2], "ours, {processors} processors, {host}{ours}");
            assert_eq!(both[2..], host_alone[2..], "LAMMPS', {processors} processors, {host}{ours}");
        }
    }
}
