//! Bonds that LAMMPS adds to the atoms' lists after the first run, in which there were none.

use std::path::Path;

use crate::harness::{Atom, Host, attempt_in, data_file_for, dump_for, head_for, run_in, text, thermo};
use concordem_contact::math::Vec3;

const DT: f64 = 1e-6;
const STYLES: &str = "pair_style zero 0.015\npair_coeff * *\n";
const BONDS: &str = "bond_style concordem/cohesive_beam\n\
                     bond_coeff * young 5e9 poisson 0.2 radius_ratio 0.6 tensile_strength 1e6\n";
const MOTION: &str = "fix motion all nve/sphere\n";
const MAKE: &str = "create_bonds many all all 1 0.0 0.0105\n";
/// The pairs part along their bonds, because a beam takes its rest direction when it is first evaluated, a step after a bond that was there
/// from the start. It breaks within ten steps: at a strain of 2e-4, 1.9 µm.
const PULL: &str = "group right id 2 4\nvelocity right set 0.4 0 0\n";

/// Two pairs of touching spheres across the border between two processors, and a larger sphere that stays free. All rest, so that the
/// geometry is the same whenever bonds are made.
fn write_pairs(folder: &Path) -> String {
    let at = |x: f64, y: f64, radius: f64| Atom::resting(Vec3::new(x, y, 0.0), radius);
    let atoms = [
        at(-0.005, 0.0, 0.005),
        at(0.0045, 0.0, 0.0045),
        at(-0.005, 0.03, 0.0048),
        at(0.0045, 0.03, 0.0047),
        at(0.0, -0.05, 0.006),
    ];
    data_file_for(Host::Lammps, &folder.join("pairs.data"), &atoms, &[], Vec3::repeat(-0.1), Vec3::repeat(0.1));
    head_for(Host::Lammps, "pairs.data", "f f f", 1e-3, DT)
}

/// First part of a script that continues from the file `half`.
fn restart_head() -> String {
    format!(
        "read_restart half\ncomm_modify vel yes\nneighbor 1e-3 bin\nneigh_modify every 1 delay 0\ntimestep {DT:e}\n{MOTION}"
    )
}

/// Beams with `radius_ratio`, whose sections follow from the mean radius of the bonded atoms. If there are none in the first run, they
/// are those of the bonds that come later, so that the bits are those of bonds that were there from the start.
#[test]
fn the_first_bonds_after_a_run_without_bonds_have_the_sections_of_bonds_from_the_start() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let head = write_pairs(folder);
    let dump = dump_for(Host::Lammps, "out.dump", 2);
    let thermo_style = "thermo_style custom step f_concordem_bonds f_concordem_bonds[2] ebond\nthermo 2\n";
    let pull = format!("{PULL}{dump}run 30\n");
    let frames_of = |script: &str, processors: usize| {
        let printed = run_in(Host::Lammps, folder, script, processors);
        (printed, std::fs::read_to_string(folder.join("out.dump")).unwrap())
    };
    let start = format!("{head}{STYLES}{MOTION}");
    let (printed, wanted) = frames_of(&format!("{start}{BONDS}{thermo_style}{MAKE}run 1\n{pull}"), 1);
    let rows = thermo(&printed);
    let (most, last) = (rows.iter().map(|row| row[3]).fold(0.0, f64::max), rows.last().unwrap());
    assert!(
        most > 0.0 && rows[0][1..3] == [2.0, 0.0] && last[1..3] == [0.0, 2.0],
        "both beams carry and break: {rows:?}"
    );
    let react = "fix make all bond/create 1 1 1 0.0105 1\nrun 1\nunfix make\n";
    for processors in [1, 2] {
        for made in [format!("run 1\n{MAKE}"), react.to_owned()] {
            let (printed, found) = frames_of(&format!("{start}{BONDS}{thermo_style}{made}{pull}"), processors);
            assert!(found == wanted, "on {processors}: {made}{printed}");
        }
        // The same across a restart, before which there are no bonds, or bonds that came later.
        for (before, after) in [(String::new(), MAKE), (format!("{MAKE}run 0\n"), "")] {
            let first = format!("{start}{BONDS}run 1\n{before}write_restart half\n");
            run_in(Host::Lammps, folder, &first, processors);
            let (printed, found) = frames_of(&format!("{}{after}{pull}", restart_head()), 3 - processors);
            assert!(found == wanted, "restart from {processors}: {before}{after}{printed}");
        }
    }
}

/// `delete_bonds` without `remove` only turns bonds off; `undo` turns them on. They are new bonds then: unstrained at the present distance.
#[test]
fn a_bond_that_was_turned_off_and_on_is_new() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let head = write_pairs(folder);
    let strong = BONDS.replace("tensile_strength 1e6", "tensile_strength 1e12");
    let start = format!(
        "{head}{STYLES}{strong}{MOTION}{MAKE}group two id 3 4\nthermo_style custom step f_concordem_bonds f_concordem_bonds[2] ebond\n\
         thermo_modify format float %20.15g\nthermo 20\n{PULL}run 20\n"
    );
    for processors in [1, 2] {
        // Turned off and on between two runs, before anything looks at the lists, the bond is the same.
        let script = format!("{start}delete_bonds two bond 1\ndelete_bonds two bond 1 undo\nrun 20\n");
        let kept = thermo(&run_in(Host::Lammps, folder, &script, processors));
        let script = format!("{start}delete_bonds two bond 1\nrun 20\ndelete_bonds two bond 1 undo\nrun 0\nrun 20\n");
        let rows = thermo(&run_in(Host::Lammps, folder, &script, processors));
        let [_, before, off, later, on, again, last] = &rows[..] else { panic!("{rows:?}") };
        // Bonds held, and broken: none broke.
        assert_eq!(
            [before, off, later, on, last].map(|row| [row[1], row[2]]),
            [[2.0, 0.0], [1.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 0.0]]
        );
        // At step 40 the new bond has no energy: that of the first pair alone.
        assert!(on[3] == later[3] && again[3] == later[3] && on[3] > 0.0, "{rows:?}");
        // A bond that had stayed would be stretched by twice as much in the end.
        let end = kept.last().unwrap();
        assert!(end[1] == 2.0 && end[3] > 1.5 * on[3], "{kept:?} {rows:?}");
    }
}

/// A template reaction of LAMMPS bonds both pairs; another one gives the bonds a new type.
#[test]
fn reactions_create_bonds_and_may_not_change_their_type() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let head = write_pairs(folder).replace("pairs.data", "pairs.data extra/bond/types 1");
    let template = |bond: &str| format!("two spheres\n\n2 atoms\n{bond}\nTypes\n\n1 1\n2 1\n");
    let bonded = |kind: usize| template("1 bonds\n") + &format!("\nBonds\n\n1 {kind} 1 2\n");
    std::fs::write(folder.join("free.txt"), template("")).unwrap();
    std::fs::write(folder.join("bonded.txt"), bonded(1)).unwrap();
    std::fs::write(folder.join("other.txt"), bonded(2)).unwrap();
    std::fs::write(
        folder.join("map.txt"),
        "map\n\n2 equivalences\n\nInitiatorIDs\n\n1\n2\n\nEquivalences\n\n1 1\n2 2\n",
    )
    .unwrap();
    let react = |before: &str, after: &str| {
        format!(
            "molecule before {before}.txt\nmolecule after {after}.txt\n\
             fix rx all bond/react stabilization no reset_mol_ids no react one all 1 0.0 0.0105 before after map.txt\n"
        )
    };
    let dump = dump_for(Host::Lammps, "out.dump", 2);
    let by_type = |strength: &str| {
        let of = |young: &str| format!("young {young} poisson 0.2 radius_ratio 0.6 tensile_strength {strength}\n");
        format!("bond_style concordem/cohesive_beam\nbond_coeff 1 {}bond_coeff 2 {}", of("5e9"), of("1e9"))
    };
    let start = format!("{head}{STYLES}{MOTION}{}", by_type("1e6"));
    let frames_of = |script: &str, processors: usize| {
        let printed = run_in(Host::Lammps, folder, script, processors);
        (printed, std::fs::read_to_string(folder.join("out.dump")).unwrap())
    };
    let (_, wanted) = frames_of(&format!("{start}{MAKE}run 1\n{PULL}{dump}run 30\n"), 1);
    for processors in [1, 2] {
        let script = format!("{start}{}run 1\nunfix rx\n{PULL}{dump}run 30\n", react("free", "bonded"));
        let (printed, found) = frames_of(&script, processors);
        assert!(found == wanted, "on {processors}: {printed}\n{script}");
        let script = format!("{start}{MAKE}run 1\n{}run 10\n", react("bonded", "other"));
        let output = attempt_in(Host::Lammps, folder, &script, processors);
        let printed = text(&output);
        let message = "changed from 1 to 2, but a bond keeps its parameters";
        assert!(!output.status.success() && printed.contains(message), "on {processors}: {printed}\n{script}");
    }
}
