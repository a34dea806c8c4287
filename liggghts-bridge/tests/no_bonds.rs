//! Warnings of runs that have no bonds, although the script asks for some: once each, on any number of processors.

use crate::harness::{Atom, Host, data_file_for, head_for, run_in};
use concordem_contact::math::Vec3;

const LINEAR: &str = "linear_bond normal_stiffness 1e5 shear_stiffness 1e4";
const BOTH: [Host; 2] = [Host::Liggghts, Host::Lammps];
const PROCESSORS: [usize; 2] = [1, 2];

/// The texts of all warnings about bonds.
fn warnings(printed: &str) -> Vec<String> {
    let is_ours = |line: &&str| line.contains("WARNING") && line.contains("bonds");
    printed.lines().filter(is_ours).map(str::to_owned).collect()
}

/// The output of a script on `processors` processors has one warning with this text, or none if it is empty.
fn warns(host: Host, folder: &std::path::Path, script: &str, processors: usize, wanted: &str) {
    let printed = run_in(host, folder, script, processors);
    let found = warnings(&printed);
    let as_wanted = match &found[..] {
        [] => wanted.is_empty(),
        [one] => !wanted.is_empty() && one.contains(wanted),
        _ => false,
    };
    assert!(as_wanted, "{host:?} on {processors}, wanted `{wanted}`: {found:?}\n{printed}\n{script}");
}

/// First part of a script that continues from the file `half`.
fn restart_head(host: Host) -> &'static str {
    match host {
        Host::Liggghts => {
            "units si\natom_modify sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\n"
        }
        Host::Lammps => "comm_modify vel yes\nread_restart half\nneighbor 1e-3 bin\ntimestep 1e-6\n",
    }
}

/// Write a row of eight spheres along x that touch and fly apart; returns the first part of a script that reads it.
fn write_row(host: Host, folder: &std::path::Path, bonds: &[[usize; 2]]) -> String {
    let mut atoms: Vec<Atom> =
        (0..8).map(|k| Atom::resting(Vec3::new(0.0105 + 0.01 * f64::from(k), 0.03, 0.03), 0.005)).collect();
    for (k, atom) in (0..).zip(&mut atoms) {
        atom.velocity.x = f64::from(k) - 3.5;
    }
    data_file_for(host, &folder.join("row.data"), &atoms, bonds, Vec3::zeros(), Vec3::repeat(0.1));
    head_for(host, "row.data", "f f f", 1e-3, 1e-6) + "fix motion all nve/sphere\n"
}

#[test]
fn a_fix_without_bonds_warns() {
    for host in BOTH {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        let head = write_row(host, folder, &[]);
        let fix = |bonds: &str| format!("fix links all concordem/bond {LINEAR} bond {bonds} contact none\n");
        let again =
            |bonds: &str| format!("{}fix motion all nve/sphere\n{}run 1\nrun 1\n", restart_head(host), fix(bonds));
        for processors in PROCESSORS {
            let first = |bonds: &str| format!("{head}{}run 1\nrun 1\nwrite_restart half\n", fix(bonds));
            // The distance factor is too small.
            let none = "created no bonds; check the distance factor and the group";
            warns(host, folder, &first("distance 0.9"), processors, none);
            for bonds in ["none", "distance 1.2"] {
                let wanted = "has no bonds: the restart file has none, and bonds are created only once";
                warns(host, folder, &again(bonds), 3 - processors, wanted);
            }
            let never = "has no bonds: `bond none` creates none, and there are none from a restart file";
            warns(host, folder, &first("none"), processors, never);
            // Bonds are there, or have been.
            warns(host, folder, &first("distance 1.2"), processors, "");
            warns(host, folder, &again("none"), processors, "");
            // At strains of 1e-4 per step, each beam breaks in the first one.
            let beams = "cohesive_beam young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 1e5";
            warns(host, folder, &first("distance 1.2").replace(LINEAR, beams), processors, "");
            warns(host, folder, &again("none").replace(LINEAR, beams), processors, "");
        }
    }
}

/// A bond style of LAMMPS takes its bonds from the atoms, also when it continues from a restart file or a data file.
#[test]
fn a_bond_style_without_bonds_warns() {
    let host = Host::Lammps;
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let head = write_row(host, folder, &[]);
    let wanted = "has no bonds: the atoms' bond lists are empty";
    let style = |state: &str| {
        format!(
            "pair_style zero 0.015\npair_coeff * *\nbond_style concordem/linear_bond{state}\nbond_coeff * {}\n",
            &LINEAR[12..]
        )
    };
    for processors in PROCESSORS {
        let first = format!("{head}{}run 1\nrun 1\nwrite_restart half\nwrite_data half.data nocoeff\n", style(""));
        warns(host, folder, &first, processors, wanted);
        let restarted = format!("{}fix motion all nve/sphere\n", restart_head(host));
        warns(host, folder, &format!("{restarted}run 1\nrun 1\n"), 3 - processors, wanted);
        let make = "create_bonds many all all 1 0.0 0.0105\n";
        warns(host, folder, &format!("{restarted}{make}run 1\n"), 3 - processors, "");
        let continued = head.replace("row.data", "half.data extra/bond/per/atom 4 extra/special/per/atom 4")
            + &style(" state half.data");
        warns(host, folder, &format!("{continued}run 1\nrun 1\n"), 3 - processors, wanted);
        warns(host, folder, &format!("{continued}{make}run 1\n"), 3 - processors, "");
    }
}
