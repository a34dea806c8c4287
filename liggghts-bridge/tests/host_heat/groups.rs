//! Groups of heat in the hosts that are empty, change, or reach beyond the fix; the reference of a restart.

use super::{BOTH, CAPACITY, GLASS, LINEAR, ORDERED, lattice, output, start};
use crate::harness::{Host, attempt_in, run_in, text, thermo};

const FIX: &str = "bond distance 1.01\nfix integrate all nve/sphere\n";

/// A new group takes the bit of a deleted one, so the fix must not go on with the bit.
#[test]
fn a_deleted_group_is_not_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let table = "[[heat.source]]\nset = \"hot\"\npower = 1";
    std::fs::write(folder.join("heat.toml"), format!("{ORDERED}temperature = 300\n{table}\n")).unwrap();
    for host in BOTH {
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6);
        let bonds = format!("fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\nrun 2\n");
        let script = format!("{head}group hot id 1\n{bonds}group hot delete\ngroup other id 2\nrun 2\n");
        let printed = text(&attempt_in(host, folder, &script, 1)).replace('\n', " ");
        let wanted = "the group hot of the file of `heat` was deleted";
        assert!(printed.contains(wanted), "{host:?}: {printed}");
    }
}

/// Only atoms of the fix have temperatures: three of four atoms, warmed from 300 to 500 K.
#[test]
fn atoms_outside_the_fix_do_not_count() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("heat.toml"), format!("{ORDERED}temperature = 300\n")).unwrap();
    for host in BOTH {
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6);
        let fix = format!("group body id <= 3\nfix bonds body concordem/bond {LINEAR} {GLASS} heat heat.toml {FIX}");
        let script = format!("{head}{fix}{}run 2\nfix_modify bonds temperature all 500\nrun 2\n", output(host, 2));
        let rows = thermo(&run_in(host, folder, &script, 1));
        let last = rows.last().unwrap();
        // A few roundings.
        for (sum, name) in [(last[3], "content"), (last[5], "boundary")] {
            assert!((sum / (3.0 * CAPACITY * 200.0) - 1.0).abs() < 1e-14, "{host:?}: {name} {sum}");
        }
        assert!((last[3] / last[5] - 1.0).abs() < 1e-13, "{host:?}: {last:?}");
    }
}

/// A group gets its power, also when atoms join it during the run: 2 W for 2,000 steps of 1e-6 s.
#[test]
fn inserted_atoms_share_the_power_of_their_group() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let host = Host::Liggghts;
    let table = "temperature = 300\n[[heat.source]]\nset = \"hot\"\npower = 2";
    std::fs::write(folder.join("heat.toml"), format!("{ORDERED}{table}\n")).unwrap();
    let head = start(host, folder, &lattice([4, 4, 4], 0.0), 1e-6);
    let script = format!(
        "{head}group hot id <= 32\nfix m1 all property/global youngsModulus peratomtype 1e7\n\
         fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml {FIX}\
         region up block -0.005 0.01 -0.005 0.01 0.009 0.015 units box\n\
         fix one hot particletemplate/sphere 15485863 atom_type 1 density constant 2500 radius constant 1e-3\n\
         fix all hot particledistribution/discrete 15485867 1 one 1.0\n\
         fix insert hot insert/pack seed 32452843 distributiontemplate all insert_every 500 overlapcheck yes all_in yes \
         maxattempt 200 vel constant 0. 0. 0. region up particles_in_region 20\n\
         thermo_style custom step atoms f_bonds[14]\nthermo 500\nthermo_modify format float %25.17g\nrun 2000\n"
    );
    let rows = thermo(&run_in(host, folder, &script, 1));
    let [first, last] = [&rows[0], rows.last().unwrap()];
    assert!(last[1] >= 64.0 + 10.0, "atoms are inserted: {first:?} {last:?}");
    // Sums of 2,000 steps, rounded.
    assert!((last[2] - first[2] - 2.0 * 2e-3).abs() < 1e-15, "{first:?} {last:?}");
}

/// Lengths of bonds and the heat content refer to the reference temperature, which must not change in a restart.
#[test]
fn a_restart_keeps_the_reference_temperature() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    for (host, expansion) in BOTH.into_iter().flat_map(|host| ["", "thermal.expansion 1e-5"].map(|more| (host, more))) {
        let heat = |table: &str| std::fs::write(folder.join("heat.toml"), format!("{ORDERED}{table}\n")).unwrap();
        let fix = format!("fix bonds all concordem/bond {LINEAR} {GLASS} {expansion} heat heat.toml bond");
        heat("temperature = 293.15");
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6);
        run_in(host, folder, &format!("{head}{fix} distance 1.01\nrun 1\nwrite_restart half\n"), 1);
        let read = match host {
            Host::Liggghts => {
                "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n"
            }
            Host::Lammps => "comm_modify vel yes\nread_restart half\n",
        };
        let again = format!("{read}{fix} none\nrun 1\n");
        heat("temperature = 300");
        let printed = text(&attempt_in(host, folder, &again, 1)).replace('\n', " ");
        let remedy = printed.split("add `reference_temperature = ").nth(1).and_then(|rest| rest.split('`').next());
        let kelvin = remedy.unwrap_or_else(|| panic!("{host:?}: {printed}"));
        heat(&format!("temperature = 300\nreference_temperature = {kelvin}"));
        run_in(host, folder, &again, 1);
    }
}

#[test]
fn a_group_without_atoms_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let table = "temperature = 300\n[[heat.boundary]]\nset = \"empty\"\nflux = 1";
    std::fs::write(folder.join("heat.toml"), format!("{ORDERED}{table}\n")).unwrap();
    for host in BOTH {
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6);
        let fix = format!("group empty id 99\nfix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml {FIX}");
        let printed = run_in(host, folder, &format!("{head}{fix}run 1\n"), 1);
        assert!(printed.contains("the group empty of the file of `heat` has no atoms yet"), "{host:?}: {printed}");
    }
}
