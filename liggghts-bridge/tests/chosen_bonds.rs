//! Bonds by distance that the script restricts: `limit` per atom, `between` types, `at` a step; and what follows from files.

use std::fmt::Write as _;
use std::path::Path;

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, head_for, run_in, tables};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const FIX: &str = "fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4";
const FACTOR: f64 = 1.3;

/// Spheres of two types and of many sizes in a periodic box, or of one size in a lattice.
fn atoms(lattice: bool) -> Vec<Atom> {
    let mut dice = Dice(8);
    let atom = |k: i32| {
        let place = [k % 6, k / 6 % 6, k / 36].map(|n| 0.01 * f64::from(n) + 0.005);
        let scatter = if lattice { 0.0 } else { 2e-3 };
        let radius = 0.005 * if lattice { 1.0 } else { 0.8 + 0.2 * dice.roll() };
        let mut atom = Atom::resting(Vec3::from(place) + dice.vector() * scatter, radius);
        atom.kind = 1 + usize::from(dice.roll() < 0.5);
        atom.velocity = dice.vector() * 0.5;
        atom
    };
    let mut atoms: Vec<Atom> = (0..216).map(atom).collect();
    // Ids are unrelated to positions.
    for k in 0..atoms.len() {
        let other = (dice.roll() * atoms.len() as f64) as usize;
        atoms.swap(k, other);
    }
    (atoms[0].kind, atoms[1].kind) = (1, 2);
    atoms
}

const EDGE: f64 = 0.06;

/// Pairs closer than [`FACTOR`] times the sum of their radii, with the ratio, except pairs of two atoms of type 2.
fn pairs(atoms: &[Atom]) -> Vec<(f64, [usize; 2])> {
    let mut pairs = Vec::new();
    for b in 0..atoms.len() {
        for a in 0..b {
            let between = atoms[b].position - atoms[a].position;
            let nearest = between.map(|x| x - EDGE * (x / EDGE).round());
            let ratio = nearest.norm() / (atoms[a].radius + atoms[b].radius);
            if ratio < FACTOR && atoms[a].kind.min(atoms[b].kind) == 1 {
                pairs.push((ratio, [a + 1, b + 1]));
            }
        }
    }
    pairs
}

fn write(host: Host, folder: &Path, atoms: &[Atom]) {
    data_file_for(host, &folder.join("body.data"), atoms, &[], Vec3::zeros(), Vec3::repeat(EDGE));
}

fn output(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("out.dump")).unwrap()
}

/// Run with these bonds; the bytes of the last state.
fn run(host: Host, folder: &Path, creation: &str, processes: usize) -> String {
    let head = head_for(host, "body.data", "p p p", 1e-3, 1e-6);
    let script = format!(
        "{head}fix move all nve/sphere\n{FIX} bond {creation}\ncompute b all concordem/bond/local bonds\n\
         dump b all local 20 bonds.dump c_b[1] c_b[2]\n{}run 20\n",
        dump_for(host, "out.dump", 20)
    );
    run_in(host, folder, &script, processes);
    output(folder)
}

/// Limits of two types: the bonds are those of a list of all pairs in ascending order, without those of full atoms.
#[test]
fn limited_bonds_are_the_nearest_ones_first_on_any_number_of_processes() {
    let atoms = atoms(false);
    let mut ordered = pairs(&atoms);
    ordered.sort_by(|a, b| a.partial_cmp(b).unwrap());
    let limit = |atom: usize| if atoms[atom - 1].kind == 1 { 3 } else { 1 };
    let (mut held, mut list, mut left_out) = (vec![0; atoms.len() + 1], String::new(), 0);
    for (_, [a, b]) in ordered {
        if held[a] < limit(a) && held[b] < limit(b) {
            held[a] += 1;
            held[b] += 1;
            writeln!(list, "{a} {b}").unwrap();
        } else {
            left_out += 1;
        }
    }
    assert!(list.lines().count() > 100 && left_out > 100, "{left_out} {list}");
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write(host, folder, &atoms);
        std::fs::write(folder.join("list.txt"), &list).unwrap();
        let wanted = run(host, folder, "list list.txt", 1);
        for processes in [1, 2, 4] {
            let again = run(host, folder, &format!("distance {FACTOR} between 1-1,1-2 limit 3,1"), processes);
            assert!(again == wanted, "{host:?} on {processes}");
        }
        assert!(run(host, folder, &format!("distance {FACTOR} between 1-1,1-2"), 1) != wanted, "{host:?}: no limit");
    }
}

/// In a lattice most distances are equal, but for rounding. No atom has more bonds than the limit, and no two neighbors could have another one.
#[test]
fn limited_bonds_of_a_lattice_leave_no_pair_that_could_be_bonded() {
    let atoms = atoms(true);
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write(host, folder, &atoms);
        let creation = format!("distance {FACTOR} between 1-1,1-2 limit 2");
        let wanted = run(host, folder, &creation, 1);
        let bonds = tables(&folder.join("bonds.dump")).swap_remove(0).1;
        let mut held = vec![0; atoms.len() + 1];
        for end in bonds.iter().flatten() {
            held[*end as usize] += 1;
        }
        assert!(held.iter().all(|number| *number <= 2), "{host:?}: {held:?}");
        let bonded = |[a, b]: [usize; 2]| bonds.iter().any(|bond| bond[..] == [a as f64, b as f64]);
        let missing = pairs(&atoms).into_iter().find(|(_, [a, b])| held[*a] < 2 && held[*b] < 2 && !bonded([*a, *b]));
        assert!(missing.is_none(), "{host:?}: {missing:?}");
        for processes in [2, 4] {
            assert!(run(host, folder, &creation, processes) == wanted, "{host:?} on {processes}");
        }
    }
}

/// Bonds between types that are made at step 20 of 60: a restart file before and after that, and a data file after it, go on with the same bits.
#[test]
fn bonds_made_at_a_step_between_types_go_on_from_files() {
    let atoms = atoms(false);
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write(host, folder, &atoms);
        let fix = |creation: &str| {
            format!(
                "{FIX} {creation} contact frictional contact.normal_stiffness 1e5 contact.shear_stiffness 1e4 \
                 contact.friction_coefficient 0.3\nfix move all nve/sphere\n"
            )
        };
        let creation = format!("bond distance {FACTOR} between 1-1,1-2 limit 4 at 20");
        let head = head_for(host, "body.data", "p p p", 1e-3, 1e-6);
        let whole = format!(
            "{head}{}{}run 10\nwrite_restart early\nrun 30\nwrite_restart late\nwrite_data late.data\nrun 20\n",
            fix(&creation),
            dump_for(host, "out.dump", 60)
        );
        let last = || {
            let text = output(folder);
            let at = text.rfind("ITEM: ATOMS").unwrap();
            text[at..].to_owned()
        };
        run_in(host, folder, &whole, 1);
        let wanted = last();
        let again = match host {
            Host::Liggghts => "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\n",
            Host::Lammps => "comm_modify vel yes\n",
        };
        let goes_on = |from: &str, creation: &str, steps: usize| {
            format!(
                "{again}read_restart {from}\nneighbor 1e-3 bin\nneigh_modify every 1 delay 0\ntimestep 1e-6\n{}{}run {steps}\n",
                fix(creation),
                dump_for(host, "out.dump", 60)
            )
        };
        let of_data = format!(
            "{}{}{}run 20\n",
            head_for(host, "late.data", "p p p", 1e-3, 1e-6),
            fix("state late.data"),
            dump_for(host, "out.dump", 20)
        );
        for processes in [1, 2] {
            for (what, script) in [
                ("before the bonds", goes_on("early", &creation, 50)),
                ("after them", goes_on("late", "bond none", 20)),
                ("with the same command", goes_on("late", &creation, 20)),
                ("data", of_data.clone()),
            ] {
                run_in(host, folder, &script, processes);
                assert!(last() == wanted, "{host:?} {what} on {processes}");
            }
        }
    }
}

/// Where all atoms are held, `fix bond/create` of LAMMPS makes, step by step, the same bonds.
#[test]
fn limited_bonds_are_those_that_lammps_makes_in_many_steps() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let mut atoms = atoms(false);
    for atom in &mut atoms {
        // LAMMPS compares distances, not their ratio to the radii.
        (atom.radius, atom.kind, atom.velocity) = (0.005, 1, Vec3::zeros());
    }
    write(Host::Lammps, folder, &atoms);
    let sorted = |file: &str| {
        let mut pairs = tables(&folder.join(file)).pop().unwrap().1;
        for pair in &mut pairs {
            pair.sort_by(f64::total_cmp);
        }
        pairs.sort_by(|a, b| a.partial_cmp(b).unwrap());
        pairs
    };
    let head = head_for(Host::Lammps, "body.data", "p p p", 4e-3, 1e-6);
    let ours = format!(
        "{head}{FIX} bond distance {FACTOR} limit 2\ncompute b all concordem/bond/local bonds\n\
         dump b all local 1 ours.dump c_b[1] c_b[2]\nrun 0\n"
    );
    run_in(Host::Lammps, folder, &ours, 2);
    let stock = format!(
        "{head}pair_style zero 0.014\npair_coeff * *\nbond_style zero\nbond_coeff *\nfix b all bond/create 1 1 1 {} 1 iparam 2 1 jparam 2 1\n\
         compute b all property/local batom1 batom2\ndump b all local 100 stock.dump c_b[1] c_b[2]\nrun 100\n",
        FACTOR * 0.01
    );
    run_in(Host::Lammps, folder, &stock, 1);
    let (ours, stock) = (sorted("ours.dump"), sorted("stock.dump"));
    assert!(ours.len() > 100 && ours == stock, "{} and {} bonds", ours.len(), stock.len());
}
