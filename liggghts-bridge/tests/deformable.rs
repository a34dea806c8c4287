//! Deformable particles in LIGGGHTS and LAMMPS: bitwise equal results on any number of processors, and the trajectory of our solver.

use std::fmt::Write as _;

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, frames, head_for, run_in};
use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::{Elastic, LinearBond};
use concordem_contact::math::Vec3;
use concordem_packing::bonding;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Scheme, Solver};

#[test]
fn a_lattice_of_deformable_particles_moves_as_in_our_solver() {
    compare(Host::Liggghts, &[1, 2, 4]);
}

#[test]
fn a_lattice_of_deformable_particles_moves_as_in_our_solver_in_lammps() {
    compare(Host::Lammps, &[1, 2]);
}

fn compare(host: Host, numbers: &[usize]) {
    const DT: f64 = 1e-6;
    let folder = tempfile::tempdir().unwrap();
    let mut dice = Dice(3);
    let atoms: Vec<Atom> = (0..8_usize * 8 * 8)
        .map(|k| {
            let place = Vec3::new((k % 8) as f64, (k / 8 % 8) as f64, (k / 64) as f64) * 0.01;
            let mut atom = Atom::resting(place, 0.005);
            // A stretch along z, and some noise.
            atom.velocity = Vec3::new(0.0, 0.0, 10.0 * (place.z - 0.035)) + dice.vector() * 0.02;
            atom
        })
        .collect();
    let (low, high) = (Vec3::repeat(-0.02), Vec3::repeat(0.09));
    data_file_for(host, &folder.path().join("lattice.data"), &atoms, &[], low, high);
    let mut dumps = Vec::new();
    for (deformable, processors) in numbers.iter().map(|&n| (true, n)).chain([(false, 1)]) {
        let mut script = head_for(host, "lattice.data", "f f f", 5e-4, DT);
        let pass = if deformable { "deformable solid deformable.young 4e9 deformable.poisson 0.3" } else { "" };
        writeln!(
            script,
            "fix integrate all nve/sphere\nfix bonds all concordem/bond linear_bond normal_stiffness 1e7 shear_stiffness 3e6 \
             bond distance 1.1 {pass}\nthermo 100"
        )
        .unwrap();
        script.push_str(&dump_for(host, "out.dump", 50));
        // Two runs, to check that the strains carry over.
        script.push_str("run 150\nrun 50\n");
        run_in(host, folder.path(), &script, processors);
        dumps.push(std::fs::read(folder.path().join("out.dump")).unwrap());
        if deformable {
            std::fs::copy(folder.path().join("out.dump"), folder.path().join("deformable.dump")).unwrap();
        }
    }
    let rigid = dumps.pop().unwrap();
    assert!(dumps.iter().all(|dump| *dump == dumps[0]), "the result depends on the number of processors");
    assert!(dumps[0] != rigid, "the particles do not deform");

    let mut particles = Particles::default();
    for atom in &atoms {
        let r = atom.radius;
        let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * atom.density;
        particles.push(Sphere { position: atom.position, radius: r }, 0, mass, 0.4 * mass * (r * r));
        *particles.velocity.last_mut().unwrap() = atom.velocity;
    }
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![LinearBond::new(1e7, 3e6, 0.0, f64::INFINITY, f64::INFINITY).unwrap()]);
    bonding::bond(&mut bonds, &rows, &particles, None, 1.1).unwrap();
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    state.clock.dt = DT;
    let deformable = Deformable {
        elasticity: vec![Elastic { young: 4e9, poisson: 0.3 }],
        condition: Condition::Solid,
        update: Update::Lagged,
        dashpots: false,
    };
    let model = Model { scheme: Scheme::VelocityVerlet, deformable: Some(deformable), ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    for (step, dumped) in frames(&folder.path().join("deformable.dump")) {
        while state.clock.step < step {
            solver.step(&mut state).unwrap();
        }
        let worst = dumped
            .iter()
            .zip(&state.particles.position)
            .map(|(atom, position)| (atom.position - position).norm())
            .fold(0.0, f64::max);
        println!("step {step}: positions differ by {worst:.2e} m");
        // Coordinates below 0.1 m are rounded to 1.4e-17; the lattice hardly amplifies differences.
        assert!(worst <= 1e-15, "step {step}: {worst:e}");
    }
}
