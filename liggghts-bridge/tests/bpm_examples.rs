//! LAMMPS' examples of bonded particles (folder `examples/bpm`) with our bonds, rebuilt small, beside LAMMPS' own bonds and on several processors.
//! `impact` (rotational) has a test of its own. Not here: `plasticity` (no plastic bonds) and `peri` (peridynamics).

mod harness;

use std::fmt::Write as _;
use std::path::Path;

use harness::{Host, run_in, thermo};

/// What differs between LAMMPS' bonds and ours: the bond style, its coefficients by bond type, and the integrator.
struct Bonds {
    style: &'static str,
    coefficients: [&'static str; 2],
    integrate: &'static str,
}

/// Our beams, of one bond type.
fn beams(coefficients: &'static str) -> Bonds {
    Bonds { style: "concordem/cohesive_beam", coefficients: [coefficients, ""], integrate: "nve/sphere" }
}

fn with(script: &str, bonds: &Bonds) -> String {
    script
        .replace("BONDS", bonds.style)
        .replace("FIRST", bonds.coefficients[0])
        .replace("SECOND", bonds.coefficients[1])
        .replace("INTEGRATE", bonds.integrate)
        .replace("THERMO", "thermo_modify format float %.16g lost ignore lost/bond ignore\nthermo")
}

fn rows(folder: &Path, script: &str, bonds: &Bonds, processors: usize) -> Vec<Vec<f64>> {
    thermo(&run_in(Host::Lammps, folder, &with(script, bonds), processors))
}

/// Panics if a number differs by more than `tolerance` of the largest one in its column.
fn assert_near(ours: &[Vec<f64>], theirs: &[Vec<f64>], tolerance: f64, what: &str) {
    assert!(ours.len() > 3 && ours.len() == theirs.len(), "{what}: {} and {} rows", ours.len(), theirs.len());
    for column in 0..ours[0].len() {
        let largest = theirs.iter().map(|row| row[column].abs()).fold(0.0, f64::max);
        for (a, b) in ours.iter().zip(theirs) {
            assert!((a[column] - b[column]).abs() <= tolerance * largest, "{what}, column {column}: {a:?} {b:?}");
        }
    }
}

/// A frictionless ball hits a plate of central springs.
const SPRING_IMPACT: &str = "\
units lj
boundary f f f
atom_style bpm/sphere
special_bonds lj 0 1 1 coul 0 1 1
newton on off
comm_modify vel yes cutoff 2.6
lattice fcc 1.0
region box block -12 8 -10 10 -10 10
create_box 1 box bond/types 2 extra/bond/per/atom 20 extra/special/per/atom 50
region disk cylinder x 0 0 8 -0.5 0.5
create_atoms 1 region disk
group plate region disk
region ball sphere 4.5 0 0 3
create_atoms 1 region ball
group projectile region ball
displace_atoms all random 0.1 0.1 0.1 134598738
set group all mass 1
neighbor 1.0 bin
pair_style bpm/spring
pair_coeff 1 1 1 1 1
create_bonds many plate plate 1 0.0 1.5
create_bonds many projectile projectile 2 0.0 1.5
neighbor 0.3 bin
special_bonds lj 0 1 1 coul 1 1 1
bond_style BONDS
bond_coeff 1 FIRST
bond_coeff 2 SECOND
fix 1 all INTEGRATE
velocity projectile set -0.05 0 0
compute nbond all nbond/atom
compute ends all reduce sum c_nbond
variable speed equal vcm(projectile,x)
timestep 0.1
thermo_style custom step ke c_ends v_speed pxx
THERMO 50
run STEPS
";

#[test]
fn springs_of_an_impact_equal_lammps_and_brittle_ones_break_the_plate() {
    let folder = tempfile::tempdir().unwrap();
    let script = |steps| SPRING_IMPACT.replace("STEPS", steps);
    let unbroken = Bonds {
        style: "concordem/linear_bond",
        coefficients: ["normal_stiffness 1 shear_stiffness 0"; 2],
        integrate: "nve/sphere",
    };
    let stock = Bonds { style: "bpm/spring smooth no break no", coefficients: ["1 0 0"; 2], integrate: "nve/sphere" };
    let (ours, theirs) =
        (rows(folder.path(), &script("500"), &unbroken, 1), rows(folder.path(), &script("500"), &stock, 1));
    // The same springs, none of which breaks, in another order of sums: 500 steps of some 10,000 bonds amplify the rounding to less than this.
    assert_near(&ours, &theirs, 1e-9, "unbroken");
    assert!(ours.last().unwrap()[3] > 0.8 * ours[0][3], "the ball slows down: {ours:?}");

    // Force at the strain at which LAMMPS' springs break, for the mean length of a bond: 0.04 (ball 0.2) of 1.12.
    let brittle = Bonds {
        coefficients: [
            "normal_stiffness 1 shear_stiffness 0 normal_strength 0.045",
            "normal_stiffness 1 shear_stiffness 0 normal_strength 0.224",
        ],
        ..unbroken
    };
    let one = rows(folder.path(), &script("600"), &brittle, 1);
    assert!(one.last().unwrap()[2] < 0.99 * one[0][2], "the plate breaks: {one:?}");
    // The pair style is LAMMPS', whose sums depend on the number of processors.
    assert_near(&rows(folder.path(), &script("600"), &brittle, 2), &one, 1e-6, "on processors");
}

/// Two pillars are compressed: one of central springs, whose Poisson's ratio is large, and one with shear springs.
const PILLARS: &str = "\
units lj
boundary p p s
atom_style bpm/sphere
special_bonds lj 0 1 1 coul 0 1 1
newton on off
comm_modify vel yes cutoff 2.6
lattice fcc 1.41
region box block 0 12 -6 6 -1 11 units box
create_box 2 box bond/types 2 extra/bond/per/atom 20 extra/special/per/atom 50
region pillar cylinder z 6 0 4 0 10 units box
region around cylinder z 6 0 5 -1 11 units box
create_atoms 1 region pillar
set group all mass 1
velocity all create 0.1 345910 loop geom
pair_style bpm/spring
pair_coeff * * 1 1 1
fix 1 all INTEGRATE
fix wall all wall/region around harmonic 1 1 1
timestep 0.1
run 2000
unfix wall
replicate 2 1 1
region left block 0 12 EDGE EDGE EDGE EDGE units box
region right block 12 24 EDGE EDGE EDGE EDGE units box
group left region left
group right region right
set group right type 2
velocity all set 0 0 0
neighbor 1.0 bin
create_bonds many left left 1 0.0 1.5
create_bonds many right right 2 0.0 1.5
neighbor 0.3 bin
special_bonds lj 0 1 1 coul 1 1 1
bond_style BONDS
bond_coeff 1 FIRST
bond_coeff 2 SECOND
region low block EDGE EDGE EDGE EDGE -1 2 units box
region high block EDGE EDGE EDGE EDGE 8 11 units box
group bottom region low
group top region high
velocity top set 0 0 -0.0025
fix 2 bottom setforce 0 0 0
fix 3 top setforce 0 0 0
variable left equal bound(left,xmax)-bound(left,xmin)
variable right equal bound(right,xmax)-bound(right,xmin)
thermo_style custom step ke pe pzz v_left v_right ylo yhi zhi
THERMO 250
run 2000
";

#[test]
fn pillars_widen_as_with_the_bonds_of_lammps() {
    let folder = tempfile::tempdir().unwrap();
    let central = "normal_stiffness 1 shear_stiffness 0";
    let ours =
        |second| Bonds { style: "concordem/linear_bond", coefficients: [central, second], integrate: "nve/sphere" };
    let stock = Bonds { style: "bpm/spring break no smooth no", coefficients: ["1 0 0"; 2], integrate: "nve/sphere" };
    let after_replication = |rows: Vec<Vec<f64>>| rows.into_iter().filter(|row| row.len() == 9).collect::<Vec<_>>();
    let same = after_replication(rows(folder.path(), PILLARS, &ours(central), 1));
    let theirs = after_replication(rows(folder.path(), PILLARS, &stock, 1));
    // Steps begin after the same run of LAMMPS alone; then 2,000 steps amplify the rounding to less than this.
    assert_near(&same, &theirs, 1e-7, "central springs");
    // Shear springs resist the widening.
    let sheared = after_replication(rows(folder.path(), PILLARS, &ours("normal_stiffness 1 shear_stiffness 0.4"), 1));
    let [first, last] = [&sheared[0], sheared.last().unwrap()];
    let [left, right] = [last[4] - first[4], last[5] - first[5]];
    assert!(right > 0.0 && right < 0.6 * left, "{left} {right}");
}

/// A straight wire is twisted and compressed, a coil is compressed; then their ends are released. Instead of `fix settorque/atom`, which came
/// after this LAMMPS, `fix freeze` holds the other ends.
const WIRES: &str = "\
units lj
boundary m m m
atom_style hybrid bpm/sphere dipole
special_bonds lj 0 1 1 coul 0 1 1
newton on off
comm_modify vel yes cutoff 2.6
region box block -10 60 -10 30 -10 10
create_box 1 box bond/types 1 extra/bond/per/atom 2 extra/special/per/atom 10
create_atoms 1 random 60 54435234 box group straight
variable x atom id*0.25
set group straight x v_x y 0.0 z 0.0
create_atoms 1 random 144 54435234 box group coil
variable x atom (id-60)*0.1
variable y atom 2*sin((id-60)*0.25)+20
variable z atom 2*cos((id-60)*0.25)
set group coil x v_x y v_y z v_z
group end1 id 60
group end2 id 204
group frozen_ends id 1 61
velocity all create 1e-7 1349832
velocity frozen_ends set 0 0 0
pair_style granular
pair_coeff 1 1 hooke 10 0.5 tangential linear_history 5 0.5 0.1
neighbor 0.3 bin
create_bonds many straight straight 1 0.0 0.3
create_bonds many coil coil 1 0.0 0.9
special_bonds lj 0 0 0 coul 1 1 1
bond_style BONDS
bond_coeff 1 FIRST
group free subtract all end1 end2
fix 1 free INTEGRATE
fix 2 frozen_ends freeze
fix 3 end1 move transrot -0.001 0 0 0 0 0 1 0 0 1600
fix 4 end2 move linear -0.001 0 0
fix 5 all viscous 5e-5
timestep 0.1
compute width coil reduce max y
compute ends all reduce sum x
thermo_style custom step ke ebond pxx c_width c_ends
THERMO 500
run 1500
unfix 1
unfix 3
unfix 4
fix 1 all INTEGRATE
run 1500
";

#[test]
fn wires_are_twisted_and_spring_back_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let bonds = beams("young 1 poisson 0 radius 0.2");
    let one = rows(folder.path(), WIRES, &bonds, 1);
    // The ends do work until they are released at step 1,500; then the viscous force takes energy away.
    let energy: Vec<f64> = one.iter().map(|row| row[1] + row[2]).collect();
    assert!(energy[1..4].iter().all(|held| *held > 10.0 * energy[0]), "{energy:?}");
    assert!(energy[4..].windows(2).all(|pair| pair[1] < pair[0]), "{energy:?}");
    // Neighbors of neighbors touch with LAMMPS' pair style, whose sums depend on the number of processors: 4e-7 when the ends are released.
    assert_near(&rows(folder.path(), WIRES, &bonds, 2)[..4], &one[..4], 1e-5, "on processors");
}

/// Rods with magnets at their ends in a field that grows.
const METAMATERIAL: &str = "\
units lj
boundary m m m
atom_style hybrid bpm/sphere dipole
atom_modify map yes
newton on off
comm_modify vel yes cutoff 3.0
special_bonds lj 0 1 1 coul 1 1 1
read_data cross.data
group magnets type 2
set group all density 1
set group magnets density 10
pair_style zero 2.0
pair_coeff * *
bond_style BONDS
bond_coeff 1 FIRST
timestep 1e-2
compute top all reduce max z
compute low all reduce min z
thermo_style custom step ke pe ebond c_top c_low
THERMO 200
fix 1 all INTEGRATE update dipole
variable field equal 0.25*ramp(0,1)
fix 2 magnets efield 0 0 v_field
run 1000
variable field equal 0.25
fix 2 magnets efield 0 0 v_field
fix 3 all viscous 0.1
fix 4 all viscous/sphere 0.1
run 1000
";

/// Four arms of five atoms around one, each with a magnet at its end that points along x.
fn cross(file: &Path) {
    let (mut atoms, mut bonds) = ("1 1 0 0 0 1 1 1 0 0 0 0\n".to_owned(), String::new());
    for (arm, [x, y]) in [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().enumerate() {
        for k in 1..=5 {
            let id = 5 * arm + k + 1;
            let (kind, dipole) = if k == 5 { (2, 1) } else { (1, 0) };
            let [x, y] = [x, y].map(|e: i32| e * k as i32);
            writeln!(atoms, "{id} {kind} {x} {y} 0 1 1 1 0 {dipole} 0 0").unwrap();
            writeln!(bonds, "{} 1 {} {id}", id - 1, if k == 1 { 1 } else { id - 1 }).unwrap();
        }
    }
    let text = format!(
        "cross\n\n21 atoms\n2 atom types\n20 bonds\n1 bond types\n4 extra bond per atom\n20 extra special per atom\n\
         -10 10 xlo xhi\n-10 10 ylo yhi\n-10 10 zlo zhi\n\nAtoms # hybrid\n\n{atoms}\nBonds\n\n{bonds}"
    );
    std::fs::write(file, text).unwrap();
}

#[test]
fn a_field_bends_rods_with_magnets_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    cross(&folder.path().join("cross.data"));
    let bonds = beams("young 1 poisson 0 radius 0.4");
    let one = rows(folder.path(), METAMATERIAL, &bonds, 1);
    let last = one.last().unwrap();
    // The moments lift one arm and lower the opposite one by as much.
    assert!(last[4] > 0.5 && (last[4] + last[5]).abs() < 1e-9, "{one:?}");
    assert!(last[2] > 0.0 && (last[2] - last[3]).abs() < 1e-15, "all potential energy is in the bonds: {last:?}");
    // The order of LAMMPS' sums over atoms.
    assert_near(&rows(folder.path(), METAMATERIAL, &bonds, 2), &one, 1e-9, "on processors");
}

/// Molecules of bonded atoms fall into a cylinder.
const POUR: &str = "\
units lj
boundary m m m
atom_style bpm/sphere
special_bonds lj 0 1 1 coul 1 1 1
newton on off
comm_modify vel yes cutoff 3.3
region box block -8 8 -8 8 0 30
create_box 1 box bond/types 1 extra/bond/per/atom 15 extra/special/per/atom 50
molecule stick stick.txt
region cylinder cylinder z 0 0 6 EDGE EDGE side in
region above cylinder z 0 0 6 20 26 side in
pair_style gran/hertz/history 1 NULL 0.5 NULL 0.1 1
bond_style BONDS
pair_coeff 1 1
bond_coeff 1 FIRST
compute nbond all nbond/atom
compute ends all reduce sum c_nbond
compute_modify thermo_temp dynamic/dof yes
fix 1 all wall/gran hertz/history 1 NULL 0.5 NULL 0.1 1 zplane 0 NULL
fix 2 all wall/gran/region hertz/history 1 NULL 0.5 NULL 0.1 1 region cylinder
fix 3 all gravity 1e-3 vector 0 0 -1
fix 4 all deposit 12 0 150 712511343 mol stick region above near 1.0 vz -0.05 -0.05
fix 5 all INTEGRATE
timestep 0.05
thermo_style custom step atoms c_ends ke pe
THERMO 500
run 5000
";

#[test]
fn bonded_molecules_are_poured_and_break_on_two_processors() {
    let folder = tempfile::tempdir().unwrap();
    let per_atom = |title: &str, value: &dyn Fn(i32) -> String| {
        (1..=4).fold(format!("\n{title}\n\n"), |out, k| out + &format!("{k} {}\n", value(k)))
    };
    let molecule = "four spheres in a row\n\n4 atoms\n3 bonds\n".to_owned()
        + &per_atom("Coords", &|k| format!("{} 0 0", f64::from(k) - 2.5))
        + &per_atom("Types", &|_| "1".to_owned())
        + &per_atom("Diameters", &|_| "1".to_owned())
        + &per_atom("Masses", &|_| "0.5236".to_owned())
        + "\nBonds\n\n1 1 1 2\n2 1 2 3\n3 1 3 4\n";
    std::fs::write(folder.path().join("stick.txt"), molecule).unwrap();
    let bonds = beams("young 4.466 poisson 0 radius 0.2828 tensile_strength 0.5");
    let one = rows(folder.path(), POUR, &bonds, 1);
    let last = one.last().unwrap();
    // 12 molecules of 4 atoms, with 6 ends of bonds each, some of which have broken.
    assert!(last[1] == 48.0 && last[2] > 0.0 && last[2] < 72.0, "{one:?}");
    // The pair style is LAMMPS', whose sums depend on the number of processors; collisions amplify the rounding.
    assert_near(&rows(folder.path(), POUR, &bonds, 2), &one, 1e-6, "on processors");
}
