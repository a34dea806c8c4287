//! Numbers of the tables of heat: sources and boundaries against closed forms, and `heat_network`.

use std::fmt::Write as _;

use super::{BOTH, CAPACITY, GLASS, LINEAR, ORDERED, R, lattice, output, start, temperatures};
use crate::harness::{Host, attempt_in, run_in, text};

/// One step of one atom, for each kind of heat from outside and of heat capacity.
#[test]
fn heat_from_outside_has_its_closed_form() {
    const STEFAN_BOLTZMANN: f64 = 5.670_374_419e-8;
    let (area, cell) = (4.0 * R * R, 8.0 * R * R * R);
    let convection = area / (1.0 / 100.0 + R / 1.1) * (290.0 - 300.0);
    let radiation = 0.8 * STEFAN_BOLTZMANN * area * (290.0_f64.powi(4) - 300.0_f64.powi(4));
    let bulk = 1500.0 * 800.0 * cell;
    for (table, constants, watts, capacity) in [
        ("boundary]]\nset = \"one\"\nconvection = { coefficient = 100, ambient = 290 }", "", convection, CAPACITY),
        ("boundary]]\nset = \"one\"\nradiation = { emissivity = 0.8, ambient = 290 }", "", radiation, CAPACITY),
        ("boundary]]\nset = \"one\"\nflux = 1000", "", 1000.0 * area, CAPACITY),
        ("source]]\nset = \"one\"\ndensity = 1e6", "", 1e6 * cell, CAPACITY),
        ("source]]\nset = \"one\"\npower = 1e-3", "thermal.bulk_density 1500", 1e-3, bulk),
    ] {
        for host in BOTH {
            let folder = tempfile::tempdir().unwrap();
            let file = format!("{ORDERED}temperature = 300\ntime_factor = 1e4\n[[heat.{table}\n");
            std::fs::write(folder.path().join("heat.toml"), file).unwrap();
            let head = start(host, folder.path(), &lattice([2, 1, 1], 0.0), 1e-6);
            // A short distance leaves the atoms without a bond.
            let fix =
                format!("fix bonds all concordem/bond {LINEAR} {GLASS} {constants} heat heat.toml bond distance 0.9");
            let script = format!("{head}group one id 1\n{fix}\n{}run 1\n", output(host, 1));
            run_in(host, folder.path(), &script, 1);
            let rise = temperatures(folder.path())[0] - 300.0;
            let expected = watts * 1e-2 / capacity;
            // 300 K are rounded at 6e-14.
            assert!((rise - expected).abs() < 1e-13 + 1e-12 * expected.abs(), "{host:?}: {table}: {rise} {expected}");
        }
    }
}

/// The same numbers from a file have the same bits, on two processors.
#[test]
fn a_file_gives_capacities_and_areas() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let head = start(host, folder, &lattice([5, 1, 1], 0.0), 1e-4);
        let initial = "pairs = \"bonds\"\ntemperature = 300\n[[heat.initial]]\nset = \"hot\"\ntemperature = 400\n";
        let write = |model: &str| {
            std::fs::write(folder.join("heat.toml"), format!("[heat]\nmodel = \"{model}\"\n{initial}")).unwrap();
        };
        let run = |more: &str| {
            format!(
                "{head}group hot id 1\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml {more} bond distance 1.01\n{}run 300\n",
                output(host, 300)
            )
        };
        write("ordered");
        run_in(host, folder, &run(""), 1);
        let computed = temperatures(folder);
        let mut file = "model disordered # by hand\n".to_owned();
        for id in 1..=5 {
            writeln!(file, "atom {id} {:e} {:e}", CAPACITY, 8.0 * R * R * R).unwrap();
        }
        let line = |a: usize, b: usize, times: f64| format!("bond {a} {b} {:e} {:e} {:e}\n", times * 4.0 * R * R, R, R);
        std::fs::write(
            folder.join("network.txt"),
            file.clone() + &(1..5).map(|a| line(a + 1, a, 1.0)).collect::<String>(),
        )
        .unwrap();
        write("disordered");
        run_in(host, folder, &run("heat_network network.txt"), 2);
        for (a, b) in temperatures(folder).iter().zip(&computed) {
            // The host's masses are rounded in another order.
            assert!((a - b).abs() < 1e-11, "{host:?}: {a} {b}");
        }
        // A restart takes the numbers with it, and compares them with the file.
        run_in(host, folder, &format!("{}write_restart half\n", run("heat_network network.txt")), 1);
        let read = match host {
            Host::Liggghts => {
                "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n"
            }
            Host::Lammps => "comm_modify vel yes\nread_restart half\n",
        };
        let fix =
            format!("fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml heat_network network.txt bond none");
        let again = format!("{read}group hot id 1\n{fix}\nrun 1\n");
        run_in(host, folder, &again, 2);
        let network = std::fs::read_to_string(folder.join("network.txt")).unwrap();
        for (line, wanted) in [(1, "atom 1 has other numbers"), (6, "the bond of atoms 1 and 2 has other numbers")] {
            let mut lines: Vec<String> = network.lines().map(str::to_owned).collect();
            let words: Vec<&str> = network.lines().nth(line).unwrap().split(' ').collect();
            let number = if line == 1 { 2 } else { 3 };
            lines[line] = [&words[..number], &["7"], &words[number + 1..]].concat().join(" ");
            std::fs::write(folder.join("network.txt"), lines.join("\n") + "\n").unwrap();
            for processors in [1, 2] {
                let printed = text(&attempt_in(host, folder, &again, processors)).replace('\n', " ");
                assert!(printed.contains(wanted), "{host:?}, {processors}: {printed}");
            }
        }
        // An area of zero insulates.
        let cut: String = (1..5).map(|a| line(a, a + 1, if a == 2 { 0.0 } else { 1.0 })).collect();
        std::fs::write(folder.join("network.txt"), file.clone() + &cut).unwrap();
        run_in(host, folder, &run("heat_network network.txt"), 2);
        assert_eq!(temperatures(folder)[2..], [300.0; 3]);
        for (lines, wanted) in [
            (line(1, 2, 1.0), "has no area in network.txt"),
            ((1..5).map(|a| line(a, a + 1, 1.0)).collect::<String>() + &line(1, 5, 1.0), "has 5 bonds, but 4 exist"),
            ("bond 1 1 1 1 1\n".to_owned(), "line 7: `bond 1 1 1 1 1` is wrong; write `bond ID ID AREA LENGTH LENGTH`"),
            ("atom 5 1 1\n".to_owned(), "given twice"),
        ] {
            std::fs::write(folder.join("network.txt"), file.clone() + &lines).unwrap();
            let printed = text(&attempt_in(host, folder, &run("heat_network network.txt"), 2));
            assert!(printed.replace('\n', " ").contains(wanted), "{host:?}: {wanted}: {printed}");
        }
    }
}
