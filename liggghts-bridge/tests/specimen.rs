//! A specimen of more than 5,000 particles in tension and compression, in LIGGGHTS and in our solver.

use std::fmt::Write as _;

use crate::harness::{Atom, Dice, data_file, dump, frames, head, run, thermo};
use concordem_contact::law::{Cpm, CpmParameters};
use concordem_contact::math::Vec3;
use concordem_packing::bonding;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Scheme, Solver};

const DT: f64 = 8e-7;
/// Steps between compared states.
const EVERY: usize = 100;
/// Number of steps in which both must agree up to rounding.
const WINDOW: usize = 200;

/// Atoms of the specimen; each end moves outward with velocity `pull` (m/s).
fn atoms(pull: f64) -> Vec<Atom> {
    let mut dice = Dice(7);
    let (nx, ny, nz) = (12_usize, 12, 36_usize);
    let mut atoms = Vec::new();
    for k in 0..nx * ny * nz {
        let place = Vec3::new((k % nx) as f64, (k / nx % ny) as f64, (k / (nx * ny)) as f64) * 0.0098;
        let mut atom = Atom::resting(place + dice.vector() * 3e-4, 0.005);
        // Uniform stretching from the start, to avoid shock waves.
        atom.velocity = Vec3::new(0.0, 0.0, pull * (2.0 * place.z / (0.0098 * (nz - 1) as f64) - 1.0));
        atoms.push(atom);
    }
    atoms
}

/// Macroscopic results, in the host and in our solver.
struct Macro {
    /// Modulus at the first compared state, Pa.
    young: [f64; 2],
    /// Largest stress, Pa, and its step.
    strength: [f64; 2],
    at: [u64; 2],
    /// Bonds broken.
    broken: [f64; 2],
}

#[test]
fn a_specimen_in_tension_breaks_as_in_our_solver() {
    let found = compare(0.15, 500, &[1, 2, 4], [4.5e6, 0.8, 1.5e-4]);
    assert!(found.broken[0] > 100.0, "nothing broke");
    assert_eq!(found.at[0], found.at[1]);
    for pair in [found.young, found.strength] {
        assert!((pair[0] / pair[1] - 1.0).abs() < 1e-9, "{pair:?}");
    }
    // Rounding differences affect cracks only late, so both break almost the same bonds.
    assert!((found.broken[0] - found.broken[1]).abs() <= 0.01 * found.broken[1] + 1.0, "{:?}", found.broken);
}

/// In fast compression, inertia confines the lattice and there is no peak; compare the stress.
#[test]
fn a_specimen_in_compression_breaks_as_in_our_solver() {
    let found = compare(-0.3, 500, &[2], [1e6, 0.1, 5e-5]);
    assert!(found.broken[0] > 1000.0, "nothing broke");
    assert_eq!(found.at[0], found.at[1]);
    for pair in [found.young, found.strength] {
        assert!((pair[0] / pair[1] - 1.0).abs() < 1e-9, "{pair:?}");
    }
}

/// Run the specimen in LIGGGHTS on several numbers of processors, which must give equal results, and in our solver. `material`:
/// cohesion (Pa), coefficient of friction, crack onset strain.
#[expect(clippy::too_many_lines, reason = "one comparison, step by step")]
fn compare(pull: f64, steps: usize, numbers: &[usize], material: [f64; 3]) -> Macro {
    let [cohesion, friction, onset] = material;
    let folder = tempfile::tempdir().unwrap();
    let mut atoms = atoms(pull);
    assert!(atoms.len() > 5000);
    let ends: Vec<bool> = atoms.iter().map(|a| !(0.012..=0.331).contains(&a.position.z)).collect();
    for (atom, end) in atoms.iter_mut().zip(&ends) {
        if *end {
            atom.velocity.z = pull.abs().copysign(atom.velocity.z);
        }
    }
    data_file(&folder.path().join("specimen.data"), &atoms, Vec3::repeat(-0.02), Vec3::new(0.13, 0.13, 0.37));

    let mut results = Vec::new();
    for &processors in numbers {
        let mut script = head("specimen.data", "f f f", 5e-4, DT);
        writeln!(
            script,
            "region low block INF INF INF INF INF 0.012 units box\nregion high block INF INF INF INF 0.331 INF units box\n\
             group low region low\ngroup high region high\ngroup free subtract all low high\n\
             fix integrate free nve/sphere\n\
             fix low low move linear 0 0 {} units box\nfix high high move linear 0 0 {pull} units box\n\
             fix bonds all concordem/bond cpm young 30e9 shear_ratio 0.2 cohesion {cohesion:e} friction_coefficient {friction} \
             crack_onset_strain {onset:e} relative_ductility 4 omega_threshold 0.99 bond distance 1.5 contact cpm\n\
             thermo_style custom step f_bonds f_bonds[2] f_bonds[4] f_bonds[5] f_bonds[8] f_bonds[9]\n\
             thermo_modify format float %20.15g\nthermo {EVERY}",
            -pull
        )
        .unwrap();
        script.push_str(&dump(&format!("out.{processors}"), EVERY));
        writeln!(script, "run {steps}").unwrap();
        let printed = run(folder.path(), &script, processors);
        let dumped = std::fs::read(folder.path().join(format!("out.{processors}"))).unwrap();
        results.push((thermo(&printed), dumped));
    }
    for (k, (rows, dumped)) in results.iter().enumerate() {
        assert!(*dumped == results[0].1, "result {k} differs from that on one processor");
        // Energies are summed over processors, with different rounding.
        for (row, one) in rows.iter().zip(&results[0].0) {
            assert!(row[1..3] == one[1..3]);
            for (a, b) in row.iter().zip(one) {
                assert!((a - b).abs() <= 1e-12 * b.abs(), "{row:?} {one:?}");
            }
        }
    }

    // The same with our solver.
    let mut parameters = CpmParameters::new(30e9, 0.2, cohesion, friction, onset, 4.0);
    parameters.omega_threshold = 0.99;
    let law = Cpm::new(&parameters).unwrap();
    let mut particles = Particles::default();
    for (atom, end) in atoms.iter().zip(&ends) {
        let r = atom.radius;
        let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * atom.density;
        particles.push(Sphere { position: atom.position, radius: r }, 0, mass, 0.4 * mass * (r * r));
        *particles.velocity.last_mut().unwrap() = atom.velocity;
        if *end {
            *particles.constraint.last_mut().unwrap() = Constraint::ALL;
        }
    }
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    bonding::bond(&mut bonds, &rows, &particles, None, 1.5).unwrap();
    let contacts = ContactBlock::new(vec![law]);
    let mut state =
        State { particles, bonds: vec![Box::new(bonds)], contacts: Some(Box::new(contacts)), ..State::default() };
    state.clock.dt = DT;
    let start = state.bond_count();
    let model = Model { scheme: Scheme::VelocityVerlet, contact_rows: rows, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    let found = frames(&folder.path().join(format!("out.{}", numbers[0])));
    assert_eq!(results[0].0[0][1], start as f64);
    let (mut at, mut strength, mut young) = ([0; 2], [0.0f64; 2], [0.0; 2]);
    let area = 0.1176 * 0.1176;
    for (step, dumped) in &found {
        while state.clock.step < *step {
            solver.step(&mut state).unwrap();
        }
        let worst = dumped
            .iter()
            .zip(&state.particles.position)
            .map(|(atom, position)| (atom.position - position).norm())
            .fold(0.0, f64::max);
        // Mean stress over the cut through the lower end, from the force that moves it.
        let (mut here, mut there) = (0.0, 0.0);
        let forces = solver.record(&mut state).unwrap();
        for (pair, force) in forces.contacts.pair.iter().zip(&forces.contacts.force) {
            let sides = pair.map(|p| atoms[p as usize].position.z < 0.012);
            if sides[0] != sides[1] {
                here += if sides[0] { force.z } else { -force.z };
            }
        }
        for (atom, _) in dumped.iter().zip(&atoms).filter(|(_, a)| a.position.z < 0.012) {
            there += atom.force.z;
        }
        let stress = [here / area, there / area];
        println!("step {step}: positions differ by {worst:.2e} m, stress {:.6e} and {:.6e} Pa", stress[0], stress[1]);
        if *step as usize <= WINDOW {
            // Coordinates are below 0.4 m, rounded to 6e-17; each of 200 steps adds a few rounding errors, which a stiff network does
            // not amplify.
            assert!(worst <= 1e-15 * (*step as f64 + 1.0), "step {step}: {worst:e}");
        }
        if *step as usize == EVERY {
            let strain = 2.0 * pull * DT * EVERY as f64 / (0.0098 * 35.0);
            young = stress.map(|stress| stress / strain);
        }
        for k in 0..2 {
            if stress[k] * pull.signum() > strength[k] {
                strength[k] = stress[k] * pull.signum();
                at[k] = *step;
            }
        }
    }
    let broken = [results[0].0.last().unwrap()[2], (start - state.bond_count()) as f64];
    println!(
        "{start} bonds, broken {broken:?}; modulus {young:?}, strength {strength:?} at {at:?}: LIGGGHTS and the solver"
    );
    Macro { young, strength, at, broken }
}
