//! Ids above 2^32: the same bits in a LAMMPS built with `bigbig` (`make test-bigbig`), refused by LAMMPS itself in any other.

use std::path::Path;

use crate::harness::lammps::{DT, LAW};
use crate::harness::{Dumped, Host, attempt_in, bar, data_file_for, dump_for, frames, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

/// The ids begin after this one.
const FIRST: u64 = 1 << 41;

/// Distance of two ids. Cut to 32 bits, they would be in the opposite order.
const APART: u64 = (1 << 32) - 7;

/// The id of the atom with number `number`, from 1.
fn large(number: u64) -> u64 {
    FIRST + APART * number
}

/// Write the bar with bonds in the atoms' lists, once with ids from 1 (`small.data`) and once with large ones (`large.data`).
fn write_bar(folder: &Path) {
    let (atoms, bonds) = bar();
    let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.08, 0.08, 0.18));
    data_file_for(Host::Lammps, &folder.join("small.data"), &atoms, &bonds, low, high);
    let mut section = "";
    let lines = std::fs::read_to_string(folder.join("small.data")).unwrap();
    let with_large_ids = lines.lines().map(|line| {
        section = ["Atoms", "Velocities", "Bonds"].into_iter().find(|name| line == *name).unwrap_or(section);
        // An atom and a velocity begin with the id; a bond ends with two.
        let ids = match section {
            "Atoms" | "Velocities" => 0..1,
            "Bonds" => 2..4,
            _ => return line.to_owned(),
        };
        let words = line.split_whitespace().enumerate();
        let words = words.map(|(k, word)| match word.parse() {
            Ok(id) if ids.contains(&k) => large(id).to_string(),
            _ => word.to_owned(),
        });
        words.collect::<Vec<_>>().join(" ")
    });
    let text = with_large_ids.collect::<Vec<_>>().join("\n") + "\n";
    std::fs::write(folder.join("large.data"), text).unwrap();
}

/// The script up to the run, with the atoms of `read`.
fn head(read: &str) -> String {
    let head = head_for(Host::Lammps, "DATA", "f f f", 5e-4, DT)
        .replace("atom_modify sort 0 0", "atom_modify map hash sort 0 0")
        .replace("read_data DATA", read);
    head + "pair_style zero 0.012\npair_coeff * *\nspecial_bonds lj 0 1 1 coul 1 1 1\nbond_style concordem/cpm contact cpm\n"
        + &format!("bond_coeff * {}\n", LAW.trim_start_matches("cpm "))
        + "fix integrate all nve/sphere\nthermo_style custom step f_concordem_bonds f_concordem_bonds[2]\n"
}

/// The bar until it is torn apart, on 1 and 2 processors, and from a restart file and a data file on another number of them: the same bits of
/// every atom with small and large ids.
#[test]
fn ids_above_32_bits_give_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    write_bar(folder.path());
    let whole = |name: &str| head(&format!("read_data {name}.data")) + &dump_for(Host::Lammps, "out", 600);
    let run = |script: &str, processors: usize| -> (Vec<f64>, Vec<Dumped>) {
        let rows = thermo(&run_in(Host::Lammps, folder.path(), script, processors));
        (rows.last().unwrap().clone(), frames(&folder.path().join("out")).pop().unwrap().1)
    };
    let first = attempt_in(Host::Lammps, folder.path(), &(whole("large") + "run 0\n"), 1);
    let printed = text(&first);
    if !first.status.success() {
        let wanted = format!("Integer {} in input script or data file is out of range", large(1));
        assert!(printed.contains(&wanted), "{printed}");
        return;
    }
    let wanted = run(&(whole("small") + "run 600\n"), 1);
    let [_, held, broken] = wanted.0[..] else { panic!("{wanted:?}") };
    assert!(held > 10.0 && broken > 10.0, "{:?}", wanted.0);
    for processors in [1, 2] {
        let written = "run 300\nwrite_restart half\nwrite_data half.data nocoeff\nrun 300\n";
        let found = run(&(whole("large") + written), processors);
        assert!(found == wanted, "{processors} processors: {:?}, not {:?}", found.0, wanted.0);
        let rest = head("read_restart half") + &dump_for(Host::Lammps, "out", 600) + "run 300\n";
        let found = run(&rest, 3 - processors);
        assert!(found == wanted, "restarted on {}: {:?}, not {:?}", 3 - processors, found.0, wanted.0);
        let rest = head("read_data half.data")
            .replace("contact cpm\n", "contact cpm state half.data\nreset_timestep 300\n")
            + &dump_for(Host::Lammps, "out", 600)
            + "run 300\n";
        let found = run(&rest, 3 - processors);
        assert!(found == wanted, "from a data file on {}: {:?}, not {:?}", 3 - processors, found.0, wanted.0);
    }
}
