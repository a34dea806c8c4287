//! Atoms with breaking bonds cross the borders of processors and of periodic boxes: results are bitwise equal for any number of
//! processors and after a restart, and no bond is lost or duplicated.

use std::fmt::Write as _;
use std::ops::Range;
use std::path::Path;

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, head_for, run, run_in, thermo};
use concordem_contact::math::Vec3;

const SEEDS: Range<u64> = 0..102;
/// Seeds for LAMMPS.
const LAMMPS_SEEDS: Range<u64> = 0..24;
/// Seeds on four processes, for each host. Few, because they are slow on two cores: in LAMMPS, one for each law, with many breaks.
const FEW_SEEDS: [Range<u64>; 2] = [0..24, 3..6];

/// A random case.
struct Case {
    boundary: String,
    fix: String,
    settings: String,
    steps: usize,
}

/// A cluster of 64 atoms on a perturbed lattice that flies across a small box and falls apart, with a few loose atoms.
fn case(host: Host, seed: u64, folder: &Path) -> Case {
    let mut dice = Dice(seed);
    let radius = 0.005;
    let drift = dice.vector() * 15.0;
    let mut atoms = Vec::new();
    for k in 0..64_usize {
        let place = Vec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64) * 0.0101;
        let mut atom =
            Atom::resting(place + dice.vector() * 4e-4 + Vec3::repeat(0.012), radius * (0.9 + 0.2 * dice.roll()));
        atom.velocity = drift + dice.vector() * 2.0;
        atom.spin = dice.vector() * 300.0;
        atoms.push(atom);
    }
    // Shuffle ids, so that they are unrelated to positions.
    for k in 0..atoms.len() {
        let other = (dice.roll() * atoms.len() as f64) as usize;
        atoms.swap(k, other);
    }
    let periodic = dice.roll() < 0.6;
    // Leave room to fly if borders are not periodic.
    let (low, high) =
        if periodic { (Vec3::zeros(), Vec3::repeat(0.0605)) } else { (Vec3::repeat(-0.02), Vec3::repeat(0.08)) };
    data_file_for(host, &folder.join(format!("data.{seed}")), &atoms, &[], low, high);
    let fix = match seed % 3 {
        0 => {
            "linear_bond normal_stiffness 1e5 shear_stiffness 5e4 damping_ratio 0.1 normal_strength 20 shear_strength 20 \
              friction_coefficient 0.3 bond distance 1.45 contact linear_bond"
        }
        1 => {
            "cpm young 1e8 shear_ratio 0.2 cohesion 3e5 friction_coefficient 0.8 crack_onset_strain 2e-3 relative_ductility 4 \
              omega_threshold 0.95 bond distance 1.5 contact cpm"
        }
        _ => {
            "cohesive_beam young 5e8 poisson 0.25 radius_ratio 0.5 tensile_strength 5e6 bond distance 1.3 \
              contact hertz_mindlin contact.young 1e7 contact.poisson 0.3 contact.friction_coefficient 0.4 \
              contact.restitution 0.7"
        }
    };
    let settings = match (dice.roll() * 3.0) as u32 {
        0 => "neigh_modify every 1 delay 0 check no\n".to_owned(),
        1 => "processors * * 1\n".to_owned(),
        _ => String::new(),
    };
    Case {
        boundary: if periodic { if dice.roll() < 0.5 { "p p p" } else { "p f p" } } else { "f f f" }.to_owned(),
        fix: fix.to_owned(),
        settings,
        steps: 250,
    }
}

/// Script of a case without the `run` commands.
fn script_of(host: Host, seed: u64, case: &Case, out: &str) -> String {
    let (before, after) = if case.settings.starts_with("processors") {
        (case.settings.as_str(), "")
    } else {
        ("", case.settings.as_str())
    };
    // In a `p f p` box, loose atoms may leave.
    let mut script = head_for(host, &format!("data.{seed}"), &case.boundary, 2e-4, 2e-6);
    script = script.replacen("newton off\n", &format!("newton off\n{before}"), 1);
    writeln!(script, "{after}fix integrate all nve/sphere\nfix bonds all concordem/bond {}", case.fix).unwrap();
    writeln!(script, "thermo_style custom step atoms ke f_bonds f_bonds[2]\nthermo {}", case.steps).unwrap();
    script.push_str("thermo_modify lost ignore\n");
    script.push_str(&dump_for(host, out, case.steps));
    script
}

#[test]
fn nothing_depends_on_the_number_of_processors() {
    compare_processors(Host::Liggghts, SEEDS, &[1, 2]);
}

#[test]
fn nothing_depends_on_four_processors() {
    compare_processors(Host::Liggghts, FEW_SEEDS[0].clone(), &[1, 4]);
}

#[test]
fn nothing_depends_on_the_number_of_processors_in_lammps() {
    compare_processors(Host::Lammps, LAMMPS_SEEDS, &[1, 2]);
}

#[test]
fn nothing_depends_on_four_processors_in_lammps() {
    compare_processors(Host::Lammps, FEW_SEEDS[1].clone(), &[1, 4]);
}

fn compare_processors(host: Host, seeds: Range<u64>, numbers: &[usize]) {
    let folder = tempfile::tempdir().unwrap();
    let cases: Vec<(u64, Case)> = seeds.map(|seed| (seed, case(host, seed, folder.path()))).collect();
    let mut results = Vec::new();
    for &processors in numbers {
        let mut script = String::new();
        for (seed, case) in &cases {
            script.push_str(&script_of(host, *seed, case, &format!("out.{seed}.{processors}")));
            writeln!(script, "run {}\nclear", case.steps).unwrap();
        }
        let printed = run_in(host, folder.path(), &script, processors);
        // `clear` registers the styles of plugins again, by the names that LAMMPS still points to.
        let foreign = |line: &&str| line.contains("Overriding built-in") && !line.contains(" style concordem/");
        assert_eq!(printed.lines().find(foreign), None);
        results.push((processors, thermo(&printed)));
    }
    let (mut broke, mut held) = (0.0, 0.0);
    for (k, (seed, case)) in cases.iter().enumerate() {
        let of = |processors: usize| std::fs::read(folder.path().join(format!("out.{seed}.{processors}"))).unwrap();
        let one = of(1);
        for &processors in &numbers[1..] {
            assert!(
                one == of(processors),
                "seed {seed}, {processors} processors: {} {} {}",
                case.boundary,
                case.fix,
                case.settings
            );
        }
        for (processors, rows) in &results {
            let [first, last] = [&rows[2 * k], &rows[2 * k + 1]];
            assert!(first[1] == 64.0 && last[1] == 64.0, "seed {seed}: atoms were lost");
            assert!(first[3] > 60.0, "seed {seed}: {first:?}");
            assert_eq!(first[3], last[3] + last[4], "seed {seed}, {processors} processors: bonds lost or duplicated");
            // Counts are exact, unlike the kinetic energy, which LIGGGHTS sums per processor.
            assert_eq!(last[3], results[0].1[2 * k + 1][3]);
            broke += last[4];
            held += last[3];
        }
    }
    println!("{host:?}: {broke} bonds broke and {held} held in {} cases on {numbers:?} processors", cases.len());
    let enough = 8.0 * cases.len() as f64;
    assert!(broke > enough && held > enough, "{broke} {held}");
}

#[test]
fn a_restarted_run_equals_an_uninterrupted_one() {
    let folder = tempfile::tempdir().unwrap();
    for seed in [0, 1, 2, 4, 5] {
        let case = case(Host::Liggghts, seed, folder.path());
        let once = script_of(Host::Liggghts, seed, &case, "once.dump") + &format!("run {}\n", case.steps);
        run(folder.path(), &once, 2);
        let half = case.steps / 2;
        // A continued run that writes a restart file halfway.
        let written = script_of(Host::Liggghts, seed, &case, "twice.dump")
            + &format!("run {half}\nwrite_restart half.restart\nrun {}\n", case.steps - half);
        let printed = run(folder.path(), &written, 1);
        let last = |name: &str| {
            let all = std::fs::read_to_string(folder.path().join(name)).unwrap();
            all[all.rfind("ITEM: TIMESTEP").unwrap()..].to_owned()
        };
        assert_eq!(last("once.dump"), last("twice.dump"), "seed {seed}");
        // A run restarted on other numbers of processors.
        let whole = script_of(Host::Liggghts, seed, &case, "restarted.dump");
        let (setup, rest) = whole.split_once(&format!("read_data data.{seed}\n")).unwrap();
        let setup: String = setup
            .lines()
            .filter(|line| !line.starts_with("atom_") && !line.starts_with("boundary"))
            .fold(String::new(), |all, line| all + line + "\n");
        // Written on one processor, so either number is another one.
        let processors = if seed % 2 == 0 { 2 } else { 4 };
        let restarted =
            format!("{setup}read_restart half.restart\natom_modify sort 0 0\n{rest}run {}\n", case.steps - half);
        let again = run(folder.path(), &restarted, processors);
        assert_eq!(last("once.dump"), last("restarted.dump"), "seed {seed}, {processors} processors");
        // Counts continue.
        let (all, part) = (thermo(&printed), thermo(&again));
        assert_eq!(all.last().unwrap()[3..5], part.last().unwrap()[3..5], "seed {seed}");
    }
}
