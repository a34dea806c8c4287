//! The file of `heat_network` in pieces, of which each process keeps a share.

use std::fmt::Write as _;

use super::{BOTH, CAPACITY, GLASS, LINEAR, R, lattice, output, start, temperatures};
use crate::harness::{Host, attempt_in, data_file_for, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const TABLE: &str = "[heat]\nmodel = \"disordered\"\npairs = \"bonds\"\ntemperature = 300\ntime_factor = 1e4\n";

/// A number from 0 to 1 that depends on two ids.
fn scatter(a: usize, b: usize) -> f64 {
    ((a * 7919 + b * 104_729) % 1000) as f64 / 1000.0
}

/// Heat capacity and volume of an atom.
fn of_atom(id: usize) -> [f64; 2] {
    [CAPACITY * (1.0 + scatter(id, 0)), 8.0 * R * R * R * (1.0 + scatter(id, 1))]
}

/// The process that keeps the lines of an atom, as directory.h says.
fn keeper(id: usize, processes: usize) -> usize {
    ((id as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) >> 33) as usize % processes
}

/// Area of a bond, and the distances of its atoms.
fn of_bond([a, b]: [usize; 2]) -> [f64; 3] {
    [4.0 * R * R * (0.5 + scatter(a, b)), R * (0.9 + 0.2 * scatter(a, b + 1)), R * (0.9 + 0.2 * scatter(a, b + 2))]
}

/// The file, with bonds before atoms.
fn file(atoms: usize, bonds: &[[usize; 2]]) -> String {
    let mut text = "model disordered\n".to_owned();
    for &[a, b] in bonds {
        let [area, of_a, of_b] = of_bond([a, b]);
        // Every second one from the other end.
        let (ends, lengths) = if a % 2 == 0 { ([a, b], [of_a, of_b]) } else { ([b, a], [of_b, of_a]) };
        writeln!(text, "bond {} {} {area:e} {:e} {:e}", ends[0], ends[1], lengths[0], lengths[1]).unwrap();
    }
    for id in 1..=atoms {
        let [capacity, volume] = of_atom(id);
        writeln!(text, "atom {id} {capacity:e} {volume:e}").unwrap();
    }
    text
}

/// Ids of the atoms of the bonds of [`lattice`], the lower one first.
fn bonds_of(counts: [usize; 3]) -> Vec<[usize; 2]> {
    let [nx, ny, nz] = counts;
    let id = |[x, y, z]: [usize; 3]| 1 + x + nx * (y + ny * z);
    let mut bonds = Vec::new();
    for z in 0..nz {
        for y in 0..ny {
            for x in 0..nx {
                for next in [[x + 1, y, z], [x, y + 1, z], [x, y, z + 1]] {
                    if (0..3).all(|axis| next[axis] < counts[axis]) {
                        bonds.push([id([x, y, z]), id(next)]);
                    }
                }
            }
        }
    }
    bonds
}

/// Temperatures after some explicit steps of 10 ms in which atoms rest, with a source of `power` (W) in the atoms up to `hot`.
fn expected(atoms: usize, bonds: &[[usize; 2]], hot: usize, power: f64, steps: usize) -> Vec<f64> {
    let mut temperature: Vec<f64> = (1..=atoms).map(|id| if id <= hot { 400.0 } else { 300.0 }).collect();
    let volume: f64 = (1..=hot).map(|id| of_atom(id)[1]).sum();
    for _ in 0..steps {
        let mut heat: Vec<f64> =
            (1..=atoms).map(|id| if id <= hot { power * of_atom(id)[1] / volume } else { 0.0 }).collect();
        for &[a, b] in bonds {
            let [area, of_a, of_b] = of_bond([a, b]);
            let flow = area * 1.1 / (of_a + of_b) * (temperature[a - 1] - temperature[b - 1]);
            heat[a - 1] -= flow;
            heat[b - 1] += flow;
        }
        for (k, watts) in heat.into_iter().enumerate() {
            temperature[k] += 1e-2 * watts / of_atom(k + 1)[0];
        }
    }
    temperature
}

/// A file that travels in two pieces: each process keeps its share, every atom and bond gets its numbers, and bytes are equal on 1, 2, and 4
/// processes.
#[test]
fn each_process_keeps_a_share_of_the_file() {
    let counts = [24, 12, 20];
    let (hot, steps) = (1000, 5);
    let atoms = lattice(counts, 0.0);
    let bonds = bonds_of(counts);
    let lines = atoms.len() + bonds.len();
    // share_file() sends 2^14 lines at once.
    assert!(lines > 1 << 14 && bonds.len() < 1 << 14, "{lines} {}", bonds.len());
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(
            folder.join("heat.toml"),
            format!("{TABLE}[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n[[heat.source]]\nset = \"hot\"\npower = 20\n"),
        )
        .unwrap();
        std::fs::write(folder.join("network.txt"), file(atoms.len(), &bonds)).unwrap();
        let script = format!(
            "{}group hot id <= {hot}\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt \
             bond distance 1.01\n{}run {steps}\n",
            start(host, folder, &atoms, 1e-6),
            output(host, steps)
        );
        let mut first: Option<Vec<u8>> = None;
        for processes in [1, 2, 4] {
            let printed = run_in(host, folder, &script, processes);
            let share = |process: usize| {
                let keeps = |id: &usize| keeper(*id, processes) == process;
                (1..=atoms.len()).filter(keeps).count() + bonds.iter().filter(|bond| keeps(&bond[0])).count()
            };
            let largest = (0..processes).map(share).max().unwrap();
            // Ids are scrambled, and the bonds of the last planes are fewer: nearly even.
            assert!(largest * 100 < lines * 102 / processes, "{largest} of {lines} on {processes}");
            let wanted = format!(
                "fix bonds concordem/bond: the file of `heat_network` has {} atoms and {} bonds; a process keeps at most {largest} of them",
                atoms.len(),
                bonds.len()
            );
            assert!(printed.contains(&wanted), "{host:?}: `{wanted}` is not in\n{printed}");
            let dump = std::fs::read(folder.join("out.dump")).unwrap();
            assert!(*first.get_or_insert_with(|| dump.clone()) == dump, "{host:?}: {processes} processes differ");
        }
        let found = temperatures(folder);
        let wanted = expected(atoms.len(), &bonds, hot, 20.0, steps);
        for (k, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
            // 300 K are rounded at 6e-14 in each step.
            assert!((found - wanted).abs() < 1e-11, "{host:?}: atom {}: {found} {wanted}", k + 1);
        }
        assert!(found[0] > 400.05 && found[hot] > 301.0, "heat enters and flows: {} {}", found[0], found[hot]);
    }
}

/// Ids that are multiples of the number of processes are shared as evenly as others.
#[test]
fn ids_with_a_stride_are_shared_evenly() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("heat.toml"), TABLE).unwrap();
    let mut text = "model disordered\natom 1 1 1\natom 2 1 1\n".to_owned();
    (1..=4000).for_each(|k| writeln!(text, "atom {} 1 1", 16 * k).unwrap());
    std::fs::write(folder.join("network.txt"), text).unwrap();
    let script = format!(
        "{}fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt bond none\nrun 0\n",
        start(Host::Liggghts, folder, &lattice([2, 1, 1], 0.0), 1e-6)
    );
    let printed = run_in(Host::Liggghts, folder, &script, 4);
    let most: usize =
        printed.split("a process keeps at most ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!((1000..1050).contains(&most), "{most} of 4002");
}

/// Bonds that the fix creates after some steps find their numbers.
#[test]
fn bonds_at_a_step_get_their_numbers() {
    let counts = [4, 2, 1];
    let (atoms, bonds) = (lattice(counts, 0.0), bonds_of(counts));
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(
            folder.join("heat.toml"),
            format!("{TABLE}[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"),
        )
        .unwrap();
        std::fs::write(folder.join("network.txt"), file(atoms.len(), &bonds)).unwrap();
        for processes in [1, 2] {
            let script = format!(
                "{}group hot id <= 3\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt \
                 bond distance 1.01 at 4\n{}run 4\nrun 3\n",
                start(host, folder, &atoms, 1e-6),
                output(host, 7)
            );
            run_in(host, folder, &script, processes);
            for (found, wanted) in temperatures(folder).iter().zip(&expected(atoms.len(), &bonds, 3, 0.0, 3)) {
                // 300 K are rounded at 6e-14 in each step.
                assert!((found - wanted).abs() < 1e-11, "{host:?}, {processes}: {found} {wanted}");
            }
        }
    }
}

/// An atom that joins the group after a restart has its numbers before the first step: what `fix_modify` brings to it counts. (Both hosts
/// refuse `create_atoms` there.)
#[test]
fn atoms_that_join_after_a_restart_get_their_numbers() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("heat.toml"), TABLE).unwrap();
        std::fs::write(folder.join("network.txt"), file(3, &[])).unwrap();
        let fix = format!(
            "fix bonds body concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt bond none\n"
        );
        let first = start(host, folder, &lattice([3, 1, 1], 0.0), 1e-6);
        let output = output(host, 1);
        let first = format!("{first}group body id 1 2\n{fix}{output}run 1\nwrite_restart half\n");
        run_in(host, folder, &first, 1);
        let read = match host {
            Host::Liggghts => {
                "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n"
            }
            Host::Lammps => "comm_modify vel yes\nread_restart half\n",
        };
        let script = format!(
            "{read}neighbor 2e-4 bin\nneigh_modify delay 0\ntimestep 1e-6\n{fix}{output}group body id 3\ngroup late id 3\n\
             fix_modify bonds temperature late 350\nrun 1\n"
        );
        for processes in [1, 2] {
            let rows = thermo(&run_in(host, folder, &script, processes));
            let boundary = rows.last().unwrap()[5];
            // A few roundings.
            assert!((boundary / (50.0 * of_atom(3)[0]) - 1.0).abs() < 1e-13, "{host:?}, {processes}: {boundary}");
        }
    }
}

/// Atoms that are created between two runs ask for their numbers: by the volumes of a source, by a change of temperature, and by their warming.
#[test]
fn atoms_that_come_later_get_their_numbers() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("heat.toml"), format!("{TABLE}[[heat.source]]\nset = \"hot\"\npower = 0.5\n"))
            .unwrap();
        std::fs::write(folder.join("network.txt"), file(4, &[])).unwrap();
        // Without bonds of the script, the file may have more atoms than exist.
        let script = |create: &str| {
            format!(
                "{}group hot id 1\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt bond none\n\
                 {}run 1\n{create}set group all diameter {:e}\nset group all density 2500\ngroup hot id 1 3 4\n\
                 fix_modify bonds temperature late 350\nrun 1\n",
                start(host, folder, &lattice([2, 1, 1], 0.0), 1e-6),
                output(host, 1),
                2.0 * R
            )
        };
        // At both ends of the box, which are on different processes.
        let create =
            "create_atoms 1 single -0.008 0 0 units box\ncreate_atoms 1 single 0.01 0 0 units box\ngroup late id 3 4\n";
        for processes in [1, 2] {
            let printed = run_in(host, folder, &script(create), processes);
            let rows = thermo(&printed);
            let [c1, c3, c4] = [1, 3, 4].map(|id| of_atom(id)[0]);
            let whole: f64 = [1, 3, 4].map(|id| of_atom(id)[1]).iter().sum();
            // 0.5 W for 10 ms: in the first run for atom 1 alone.
            let rise = |id: usize, capacity: f64| 0.5 * of_atom(id)[1] / whole * 1e-2 / capacity;
            let wanted = [300.0 + 0.5e-2 / c1 + rise(1, c1), 300.0, 350.0 + rise(3, c3), 350.0 + rise(4, c4)];
            for (found, wanted) in temperatures(folder).iter().zip(wanted) {
                // 300 K are rounded at 6e-14.
                assert!((found - wanted).abs() < 1e-12, "{host:?}, {processes}: {found} {wanted}");
            }
            // What fix_modify brings counts, from 300 to 350 K. A few roundings.
            let boundary = rows.last().unwrap()[5];
            assert!((boundary / (50.0 * (c3 + c4)) - 1.0).abs() < 1e-13, "{host:?}, {processes}: {boundary}");
        }
        std::fs::write(folder.join("network.txt"), file(3, &[])).unwrap();
        let printed = text(&attempt_in(host, folder, &script(create), 2)).replace('\n', " ");
        assert!(printed.contains("atom 4 has no heat capacity in network.txt; add a line"), "{host:?}: {printed}");
    }
}

/// A bond of LAMMPS' lists that is turned off and on again is new, and gets its numbers again.
#[test]
fn bonds_that_come_later_get_their_numbers() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("heat.toml"), format!("{TABLE}[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n"))
        .unwrap();
    let (atoms, bonds) = (lattice([4, 1, 1], 0.0), [[1, 2], [2, 3], [3, 4]]);
    std::fs::write(folder.join("network.txt"), file(4, &bonds)).unwrap();
    data_file_for(Host::Lammps, &folder.join("atoms.data"), &atoms, &bonds, Vec3::repeat(-0.01), Vec3::repeat(0.02));
    let parameters = LINEAR.split_once(' ').unwrap().1;
    let script = |between: &str| {
        format!(
            "{}pair_style zero 0.003\npair_coeff * *\ngroup hot id <= 2\ngroup middle id 2 3\n\
             bond_style concordem/linear_bond heat heat.toml heat_network network.txt\nbond_coeff * {parameters} {GLASS}\n{}\
             run 3\n{between}run 3\n",
            head_for(Host::Lammps, "atoms.data", "f f f", 2e-4, 1e-6),
            output(Host::Lammps, 3).replace("f_bonds", "f_concordem_bonds")
        )
    };
    for processes in [1, 2] {
        run_in(
            Host::Lammps,
            folder,
            &script("delete_bonds middle bond 1\nrun 3\ndelete_bonds middle bond 1 undo\nrun 0\n"),
            processes,
        );
        let found = temperatures(folder);
        let mut wanted: Vec<f64> = expected(4, &bonds, 2, 0.0, 3);
        // Three steps without the bond in the middle, three with it.
        for with in [false, true] {
            for _ in 0..3 {
                let before = wanted.clone();
                for &[a, b] in bonds.iter().filter(|bond| with || bond[0] != 2) {
                    let [area, of_a, of_b] = of_bond([a, b]);
                    let heat = 1e-2 * area * 1.1 / (of_a + of_b) * (before[a - 1] - before[b - 1]);
                    wanted[a - 1] -= heat / of_atom(a)[0];
                    wanted[b - 1] += heat / of_atom(b)[0];
                }
            }
        }
        for (found, wanted) in found.iter().zip(&wanted) {
            // 300 K are rounded at 6e-14 in each step.
            assert!((found - wanted).abs() < 1e-11, "{processes}: {found} {wanted}");
        }
        // The first three steps alone leave 99.55 K.
        assert!(wanted[1] - wanted[2] < 99.2, "heat flows: {wanted:?}");
    }
}

/// One process finds the mistake; all stop, and the message appears once, whatever their number.
#[test]
fn mistakes_are_told_once() {
    let bonds = [[1, 2], [2, 3], [3, 4]];
    let good = file(4, &bonds);
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        std::fs::write(folder.join("heat.toml"), TABLE).unwrap();
        let script = format!(
            "{}fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt bond distance 1.01\nrun 1\n",
            start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6)
        );
        for (network, wanted) in [
            (
                format!("{good}atom 2 1 1\natom 3 1 1\n"),
                "line 9: atom 2 is given twice, for the first time in line 6; remove one line",
            ),
            (
                format!("{good}bond 3 2 1 1 1\n"),
                "line 9: the bond of atoms 2 and 3 is given twice, for the first time in line 3; remove one line",
            ),
            (format!("{good}atom 5 0 1\n"), "line 9: `atom 5 0 1` is wrong; write `atom ID CAPACITY VOLUME`"),
            (
                good.replace("disordered", "power"),
                "line 2: `heat.model = \"disordered\"`: the file of `heat_network` has the model power",
            ),
            (format!("{good}atom 5 1 1\n"), "the file of `heat_network` has 5 atoms, but 4 exist"),
            (format!("{good}bond 1 3 1 1 1\n"), "the file of `heat_network` has 4 bonds, but 3 exist"),
        ] {
            std::fs::write(folder.join("network.txt"), network).unwrap();
            for processes in [1, 3] {
                let output = attempt_in(host, folder, &script, processes);
                let printed = text(&output).replace('\n', " ");
                assert!(!output.status.success() || printed.contains("ERROR"), "{host:?}: no error: {printed}");
                assert_eq!(printed.matches(wanted).count(), 1, "{host:?}, {processes}: `{wanted}`: {printed}");
            }
        }
        std::fs::remove_file(folder.join("network.txt")).unwrap();
        let printed = text(&attempt_in(host, folder, &script, 2)).replace('\n', " ");
        assert_eq!(printed.matches("cannot read network.txt: No such file").count(), 1, "{host:?}: {printed}");
    }
}
