//! Restart and data files hold each bond once: no bond is lost without a word when its atoms go or change their processor.

use std::path::Path;

use crate::harness::{Atom, Host, attempt_in, data_file_for, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];

/// A row of eight touching spheres along x, bonded in a first run of one step; the border between two processors is at 0.05 m.
/// `velocity` in m/s.
fn row(host: Host, folder: &Path, velocity: f64) -> String {
    let atoms: Vec<Atom> = (0..8)
        .map(|k| {
            let mut atom = Atom::resting(Vec3::new(0.0102 + 0.01 * f64::from(k), 0.03, 0.03), 0.005);
            atom.velocity.x = velocity;
            atom
        })
        .collect();
    data_file_for(host, &folder.join("row.data"), &atoms, &[], Vec3::zeros(), Vec3::repeat(0.1));
    head_for(host, "row.data", "p p p", 1e-3, 1e-6).replacen("newton off\n", "newton off\nprocessors 2 1 1\n", 1)
        + "fix integrate all nve/sphere\n\
           fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond distance 1.2\n\
           thermo_style custom step f_bonds\nrun 1\n"
}

/// First part of a script that continues from the file `half`.
fn continued(host: Host) -> &'static str {
    match host {
        Host::Liggghts => {
            "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\n\
             fix integrate all nve/sphere\n"
        }
        Host::Lammps => {
            "comm_modify vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\nfix integrate all nve/sphere\n"
        }
    }
}

const FIX: &str = "fix bonds all concordem/bond linear_bond normal_stiffness 1e5 shear_stiffness 1e4 bond none\n\
                   thermo_style custom step f_bonds\nrun 1\n";

fn refused(host: Host, folder: &Path, script: &str, wanted: &str) {
    let output = attempt_in(host, folder, script, 2);
    let printed = text(&output);
    assert!(
        !output.status.success() && printed.contains(wanted),
        "{host:?}: `{wanted}` is not in\n{printed}\n{script}"
    );
}

/// Bonds are stored with their atoms, so those of an atom that is gone could vanish.
#[test]
fn files_are_not_written_without_a_bonded_atom() {
    for host in BOTH {
        for gone in [1, 8] {
            let folder = tempfile::tempdir().unwrap();
            let delete =
                row(host, folder.path(), 0.0) + &format!("group gone id {gone}\ndelete_atoms group gone compress no\n");
            for write in ["write_restart half\n", "write_data half\n"] {
                refused(host, folder.path(), &(delete.clone() + write), "a bonded atom is gone since the last step");
            }
        }
    }
}

/// A restart file whose atoms are deleted before the fix exists: the records that came with them are missing. LIGGGHTS itself does not
/// delete atoms before the first run. Of the first atoms, LAMMPS would give the data of others to those that stay, which is rejected, too.
#[test]
fn records_that_went_with_their_atoms_are_missed() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        run_in(host, folder.path(), &(row(host, folder.path(), 0.0) + "write_restart half\n"), 2);
        let rows = thermo(&run_in(host, folder.path(), &(continued(host).to_owned() + FIX), 2));
        assert_eq!(rows.last().unwrap()[1], 7.0);
        if host == Host::Liggghts {
            continue;
        }
        let script = format!("{}group gone id 7 8\ndelete_atoms group gone compress no\n{FIX}", continued(host));
        refused(host, folder.path(), &script, "of the 7 bonds and contacts in the restart file, 6 came with its atoms");
    }
}

/// Atoms cross the border between two processors when the file is written: the last rebuild was that of the first step.
#[test]
fn atoms_may_change_their_processor_when_a_file_is_written() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        // 0.3 mm, beyond the border at 50 mm, and less than half the skin, at which lists are rebuilt.
        let moved = row(host, folder.path(), -1.0).replace("run 1\n", "run 300\n");
        run_in(host, folder.path(), &(moved + "write_restart half\nwrite_data half.data\n"), 2);
        for processors in [1, 2, 3] {
            let rows = thermo(&run_in(host, folder.path(), &(continued(host).to_owned() + FIX), processors));
            assert_eq!(rows.last().unwrap()[1], 7.0, "{host:?} on {processors}");
        }
    }
}
