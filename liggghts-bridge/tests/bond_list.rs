//! The file of `bond list FILE`: one process reads it in pieces, and each keeps a share until the bonds are created.

use std::fmt::Write as _;

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, head_for, refused_in, run_in};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const FIX: &str = "fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond";

/// The process that keeps the lines of an atom, as directory.h says.
fn keeper(id: usize, processes: usize) -> usize {
    ((id as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33) as usize % processes
}

/// Bonds of a list in any order give the bytes of `bond distance` on 1, 2, and 4 processes, although the list travels in two pieces.
#[test]
fn a_list_gives_the_bonds_of_the_distance() {
    let counts = [42, 12, 12];
    let mut dice = Dice(7);
    let mut atoms = Vec::new();
    for k in 0..counts.iter().product::<usize>() {
        let place = [k % counts[0], k / counts[0] % counts[1], k / (counts[0] * counts[1])];
        let mut atom = Atom::resting(Vec3::from(place.map(|n| 0.01 * n as f64)), 0.005);
        atom.velocity = dice.vector() * 0.1;
        atoms.push(atom);
    }
    let steps = [1, counts[0], counts[0] * counts[1]];
    let mut bonds = Vec::new();
    for k in 0..atoms.len() {
        for (axis, step) in steps.into_iter().enumerate() {
            if k / step % counts[axis] + 1 < counts[axis] {
                bonds.push([k + 1, k + 1 + step]);
            }
        }
    }
    // share_file() sends 2^14 lines at once.
    assert!(bonds.len() > 1 << 14 && bonds.len() < 1 << 15, "{}", bonds.len());
    for k in 0..bonds.len() {
        bonds.swap(k, (dice.roll() * (k + 1) as f64) as usize);
        if dice.roll() < 0.5 {
            bonds[k].reverse();
        }
    }
    let mut list = "# ids\n\n".to_owned();
    for [a, b] in &bonds {
        writeln!(list, "{a} {b}").unwrap();
    }
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("list.txt"), &list).unwrap();
        data_file_for(host, &folder.join("body.data"), &atoms, &[], Vec3::repeat(-0.01), Vec3::new(0.43, 0.13, 0.13));
        let run = |creation: &str, processes: usize| {
            let head = head_for(host, "body.data", "f f f", 1e-3, 1e-6);
            let script =
                format!("{head}fix move all nve/sphere\n{FIX} {creation}\n{}run 5\n", dump_for(host, "out.dump", 5));
            let printed = run_in(host, folder, &script, processes);
            if creation.starts_with("list") {
                let share = |process: usize| {
                    bonds.iter().filter(|bond| keeper(bond[0].min(bond[1]), processes) == process).count()
                };
                let largest = (0..processes).map(share).max().unwrap();
                // Atoms of the last planes have fewer bonds.
                assert!(largest * processes * 100 < bonds.len() * 103, "{largest} on {processes}");
                let wanted = format!("has {} bonds; a process keeps at most {largest} of them", bonds.len());
                assert!(printed.contains(&wanted), "{host:?} on {processes}, `{wanted}`: {printed}");
            }
            assert!(printed.contains(&format!("{} bonds of law linear_bond", bonds.len())), "{host:?}: {printed}");
            std::fs::read(folder.join("out.dump")).unwrap()
        };
        let wanted = run("distance 1.01", 1);
        for processes in [1, 2, 4] {
            assert!(run("list list.txt", processes) == wanted, "{host:?}: {processes} processes differ");
        }
    }
}

/// All processes end with the message, whichever of them finds out.
#[test]
fn wrong_lists_are_refused_with_line_and_remedy() {
    let prepare = |host: Host, folder: &std::path::Path| {
        let atoms: Vec<Atom> =
            (0..8).map(|k| Atom::resting(Vec3::new(0.01 * f64::from(k), 0.03, 0.03), 0.005)).collect();
        data_file_for(host, &folder.join("row.data"), &atoms, &[], Vec3::repeat(-0.01), Vec3::new(0.09, 0.07, 0.07));
        for (name, lines) in [
            ("foreign.txt", "1 2\n2 99\n"),
            ("wrong.txt", "1 2\n3 three # x\n"),
            // Process 1 keeps the bond of 7 and 8, process 0 that of 3 and 4.
            ("twice.txt", "1 2\n4 3\n7 8\n# again\n8 7\n3 4 0.01\n"),
        ] {
            std::fs::write(folder.join(name), lines).unwrap();
        }
    };
    for host in BOTH {
        let with = |list: &str| {
            let head = head_for(host, "row.data", "f f f", 1e-3, 1e-6);
            format!("{head}fix move all nve/sphere\n{FIX} list {list}\nrun 1\n")
        };
        let cases = [
            (with("missing.txt"), "cannot read missing.txt: "),
            (with("foreign.txt"), "the list of bonds contains atom 99, which is not in group all; remove the bond, or"),
            (with("wrong.txt"), "cannot read wrong.txt: line 2: `3 three` is not a bond; write two different atom ids"),
            (
                with("twice.txt"),
                "cannot read twice.txt: line 5: the bond of atoms 7 and 8 is given twice, for the first time in line 3; remove one line",
            ),
        ];
        refused_in(host, &cases, |folder| prepare(host, folder));
    }
}

/// `between` bonds the pairs of the chosen types and no others, also across borders of processors: the bytes of a list of these pairs.
#[test]
fn bonds_between_types_are_those_of_a_list() {
    let mut dice = Dice(5);
    let edge = 4;
    let mut atoms = Vec::new();
    for k in 0..edge * edge * edge {
        let place = [k % edge, k / edge % edge, k / (edge * edge)].map(|n| 0.01 * f64::from(n));
        let mut atom = Atom::resting(Vec3::from(place), 0.005);
        atom.velocity = dice.vector() * 0.1;
        atom.kind = 1 + usize::from(dice.roll() < 0.5);
        atoms.push(atom);
    }
    let mut list = String::new();
    let mut left_out = 0;
    for (b, second) in atoms.iter().enumerate() {
        for (a, first) in atoms[..b].iter().enumerate() {
            if (first.position - second.position).norm() < 0.0105 {
                if first.kind == 2 && second.kind == 2 {
                    left_out += 1;
                } else {
                    writeln!(list, "{} {}", a + 1, b + 1).unwrap();
                }
            }
        }
    }
    assert!(left_out > 20 && list.lines().count() > 60, "{left_out} {list}");
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("list.txt"), &list).unwrap();
        data_file_for(host, &folder.join("body.data"), &atoms, &[], Vec3::repeat(-0.01), Vec3::repeat(0.05));
        let run = |creation: &str, processes: usize| {
            let head = head_for(host, "body.data", "f f f", 1e-3, 1e-6);
            let dump = dump_for(host, "out.dump", 20);
            run_in(
                host,
                folder,
                &format!("{head}fix move all nve/sphere\n{FIX} {creation}\n{dump}run 20\n"),
                processes,
            );
            std::fs::read_to_string(folder.join("out.dump")).unwrap()
        };
        let wanted = run("list list.txt", 1);
        for processes in [1, 2] {
            assert!(run("distance 1.05 between 1-1,2-1", processes) == wanted, "{host:?} on {processes}");
        }
        assert!(run("distance 1.05", 1) != wanted, "{host:?}: all pairs");
    }
}
