//! Clumps that LIGGGHTS inserts, bonded.

use std::path::Path;

use crate::harness::{attempt, run, tables, text, thermo};

/// Chains of three spheres, and single ones, that rain on a plane.
const HEAD: &str = "\
units si
atom_style sphere
atom_modify map array sort 0 0
boundary f f f
newton off
communicate single vel yes
region box block -0.03 0.03 -0.03 0.03 -0.001 0.06 units box
create_box 1 box
neighbor 1e-3 bin
neigh_modify delay 0
timestep 2e-6
fix m1 all property/global youngsModulus peratomtype 1e7
fix m2 all property/global poissonsRatio peratomtype 0.3
fix m3 all property/global coefficientRestitution peratomtypepair 1 0.3
fix m4 all property/global coefficientFriction peratomtypepair 1 0.5
pair_style gran model concordem/hertz tangential history
pair_coeff * *
fix chain all particletemplate/multiplespheres 15485863 atom_type 1 density constant 2500 nspheres 3 ntry 100000 spheres file chain.txt scale 1.0 BONDED
fix single all particletemplate/sphere 86028121 atom_type 1 density constant 2500 radius constant 0.0025
fix mix all particledistribution/discrete 32452843 2 chain 0.6 single 0.4
region up block -0.02 0.02 -0.02 0.02 0.012 0.026 units box
fix insert all insert/pack seed 49979687 distributiontemplate mix vel constant 0 0 -4 insert_every 500 overlapcheck yes all_in yes particles_in_region 20 region up ntry_mc 10000
fix floor all wall/gran model concordem/hertz tangential history primitive type 1 zplane 0
fix down all gravity 9.81 vector 0 0 -1
fix integrate all nve/sphere
fix bonds all concordem/bond cohesive_beam young 1e8 poisson 0.3 radius 0.0015 BOND
thermo_style custom step atoms f_bonds[1] f_bonds[2]
";

fn script(bonded: &str, bond: &str) -> String {
    HEAD.replace("BONDED", bonded).replace("BOND", bond)
}

fn write_chain(folder: &Path) {
    std::fs::write(folder.join("chain.txt"), "-0.004 0 0 0.002\n0 0 0 0.002\n0.004 0 0 0.002\n").unwrap();
}

/// Two bonds per chain that has come, and none between bodies that touch; chains keep their length.
fn check(folder: &Path, printed: &str, largest: f64) {
    let rows = thermo(printed);
    let bonds = rows.last().unwrap()[2];
    assert!(rows.windows(2).filter(|pair| pair[1][2] > pair[0][2]).count() > 1, "bonds come more than once: {rows:?}");
    let atoms = tables(&folder.join("out.dump")).pop().unwrap().1;
    let small = atoms.iter().filter(|row| row[4] == 0.002).count() as f64;
    assert!(small > 0.0 && small < atoms.len() as f64 && bonds == small / 3.0 * 2.0, "{bonds} bonds, {small} spheres");
    assert!(rows.iter().all(|row| row[3] == 0.0), "none breaks: {rows:?}");
    let lines = tables(&folder.join("bonds.dump")).pop().unwrap().1;
    let of_bonds: Vec<_> = lines.iter().filter(|row| row[3] == 1.0).collect();
    assert_eq!(of_bonds.len() as f64, bonds);
    for bond in of_bonds {
        // Spheres of a chain have successive ids.
        assert!(bond[1] - bond[0] == 1.0 && (bond[2] / 0.004 - 1.0).abs() < largest, "{bond:?}");
    }
}

#[test]
fn inserted_clumps_come_bonded_on_any_number_of_processors_and_after_a_restart() {
    let output = "dump atoms all custom 1000 out.dump id x y z radius\ndump_modify atoms sort id format \"%d %.17g %.17g %.17g %.17g\"\n\
                  compute rows all concordem/bond/local bonds\n\
                  dump rows all local 1000 bonds.dump c_rows[1] c_rows[2] c_rows[12] c_rows[15]\nthermo 500\n";
    // Clumps of 4 m/s stretch beams of 100 MPa, in which waves have 185 m/s, by 2 % at most.
    let stretch = 0.022;
    for (processors, others) in [(1, 2), (2, 4), (4, 1)] {
        let folder = tempfile::tempdir().unwrap();
        let folder = folder.path();
        write_chain(folder);
        let script = script("bonded yes", "bond clumps 1.05") + output + "run 3000\n";
        check(folder, &run(folder, &(script.clone() + "write_restart half\n"), processors), stretch);
        let (_, rest) = script.split_once("neighbor").unwrap();
        let again = "units si\natom_modify map array sort 0 0\nnewton off\ncommunicate single vel yes\nread_restart half\nneighbor";
        check(folder, &run(folder, &(again.to_owned() + rest), others), stretch);
    }
}

#[test]
fn clumps_that_nothing_bonds_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_chain(folder.path());
    for (bonded, bond, wanted) in [
        ("", "bond clumps 1.05", "but there is no such template; define one, or use `bond distance`"),
        ("bonded yes", "bond distance 1.05", "a template has `bonded yes`, but no fix concordem/bond bonds its clumps"),
        ("bonded yes", "bond clumps 1.05 at 100", "`bond clumps` bonds each clump when it is inserted; remove `at`"),
        ("bonded yes", "bond clumps", "`bond` needs a value: a factor on the sum of the radii"),
    ] {
        let printed = text(&attempt(folder.path(), &(script(bonded, bond) + "run 1\n"), 2));
        assert!(printed.contains("ERROR") && printed.contains(wanted), "{printed}");
    }
}
