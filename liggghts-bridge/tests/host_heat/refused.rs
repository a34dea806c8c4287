//! Heat that the hosts reject.

use std::path::Path;

use super::{BOTH, CAPACITY, CONDUCTANCE, GLASS, LINEAR, ORDERED, lattice, start};
use crate::harness::{Host, attempt_in, run_in, text};

/// Only a host knows its groups and its time step; the unit tests of the arguments have the other mistakes.
#[test]
fn unknown_groups_and_large_steps_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let plain = format!("{ORDERED}temperature = 300\n");
    for (table, wanted) in [
        ("[[heat.initial]]\nset = \"nobody\"\ntemperature = 1", "the set nobody, but there is no such group"),
        ("[[heat.source]]\nset = \"empty\"\npower = 1", "a source of heat has no atoms: group empty"),
        (
            "steady = true",
            "heat.toml, line 5: `heat.steady = true`: the steady state needs all processors at once; give",
        ),
    ] {
        std::fs::write(folder.join("heat.toml"), format!("{plain}{table}\n")).unwrap();
        rejected(folder, 1e-6, wanted);
    }
    std::fs::write(folder.join("heat.toml"), &plain).unwrap();
    // The middle atoms have two bonds.
    let bound = CAPACITY / (2.0 * CONDUCTANCE);
    rejected(folder, 1.01 * bound, &format!("but must be at most {bound:.4e} s for stable heat conduction"));
}

/// The fix stops both hosts.
fn rejected(folder: &Path, dt: f64, wanted: &str) {
    for host in BOTH {
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), dt);
        let groups = "group hot id 1\ngroup empty id 99\n";
        let script = format!(
            "{head}{groups}fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\nrun 2\n"
        );
        let output = attempt_in(host, folder, &script, 1);
        let printed = text(&output).replace('\n', " ");
        assert!(!output.status.success() || printed.contains("ERROR"), "{host:?}: {wanted}: no error: {printed}");
        assert!(printed.contains(wanted), "{host:?}: {wanted}: {printed}");
    }
}

#[test]
fn other_mistakes_are_rejected() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    std::fs::write(folder.join("heat.toml"), format!("{ORDERED}temperature = 300\n")).unwrap();
    for host in BOTH {
        let head = start(host, folder, &lattice([4, 1, 1], 0.0), 1e-6);
        let fix = format!("{head}fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond distance 1.01\n");
        for (script, wanted) in [
            (fix.replace(" heat heat.toml", ""), "have no effect without heat conduction; add `heat FILE`"),
            (fix.replace(GLASS, ""), "needs the thermal constants of every material"),
            (fix.replace("specific_heat 800", "specific_heat 0"), "`thermal.specific_heat`: must be greater than 0"),
            (format!("{fix}fix_modify bonds temperature nobody 300\n"), "there is no such group"),
            (format!("{fix}fix_modify bonds temperature all cold\n"), "the absolute temperature in K, without a unit"),
            // Masses of LIGGGHTS are those of discs there.
            (
                fix.replace("units si\n", "units si\ndimension 2\n").replace("f f f", "f f p"),
                "`heat` needs `dimension 3`",
            ),
            (
                format!(
                    "{}fix_modify bonds temperature all 300\n",
                    fix.replace(GLASS, "").replace(" heat heat.toml", "")
                ),
                "has no temperatures; add `heat FILE`",
            ),
        ] {
            let printed = text(&attempt_in(host, folder, &format!("{script}run 1\n"), 1)).replace('\n', " ");
            assert!(printed.contains("ERROR") && printed.contains(wanted), "{host:?}: {wanted}: {printed}");
        }
        // A restart file without heat.
        run_in(
            host,
            folder,
            &format!("{}run 1\nwrite_restart half\n", fix.replace(GLASS, "").replace(" heat heat.toml", "")),
            1,
        );
        let read = match host {
            Host::Liggghts => {
                "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\n"
            }
            Host::Lammps => "comm_modify vel yes\nread_restart half\n",
        };
        let again = format!("{read}fix bonds all concordem/bond {LINEAR} {GLASS} heat heat.toml bond none\nrun 1\n");
        let printed = text(&attempt_in(host, folder, &again, 1)).replace('\n', " ");
        assert!(printed.contains("has other data per atom or bond"), "{host:?}: {printed}");
    }
}
