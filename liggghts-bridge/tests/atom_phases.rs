//! Phases of concrete as atom types: bonds have the parameters of their pair of phases, as in a scenario.

use crate::harness::{Atom, Dice, Host, data_file_for, dump_for, frames, head_for, run_in};
use concordem_contact::law::LawName;
use concordem_contact::material::{Interface, Material};
use concordem_contact::math::Vec3;
use concordem_packing::bonding::bond;
use concordem_solver::laws::block;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, Scheme, Solver};

const DT: f64 = 5e-7;
/// The materials file: tables as in scenarios, one material per atom type, and the interface of the two phases.
const PHASES: &str = r#"
[[material]]
name = "mortar"
density = 2500
cpm = { young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = 3e6, friction_coefficient = 0.8 }

[[material]]
name = "stone"
density = 2500
cpm = { young = 62.5e9, shear_ratio = 0.2, crack_onset_strain = 2e-4, relative_ductility = 30, cohesion = 15e6, friction_coefficient = 0.8 }

[[interface]]
between = ["mortar", "stone"]
of = "mortar"
factors = { stiffness = 0.5, strength = 0.4, ductility = 0.1 }
"#;

#[derive(serde::Deserialize)]
struct Tables {
    material: Vec<Material>,
    interface: Vec<Interface>,
}

/// A bar with a stone in its middle that is torn along z.
fn bar() -> Vec<Atom> {
    let mut dice = Dice(3);
    (0..4 * 4 * 8_usize)
        .map(|k| {
            let cell = Vec3::new((k % 4) as f64, (k / 4 % 4) as f64, (k / 16) as f64);
            let mut atom = Atom::resting(cell * 0.0098 + dice.vector() * 2e-4, 0.005);
            atom.velocity = Vec3::new(0.0, 0.0, 60.0 * (atom.position.z - 0.0343)) + dice.vector() * 0.02;
            atom.kind = if (cell - Vec3::new(1.5, 1.5, 3.5)).norm() < 1.8 { 2 } else { 1 };
            atom
        })
        .collect()
}

/// LIGGGHTS and LAMMPS, and our own solver with the same materials: the same motion while bonds of mortar and of the interface
/// crack and those of the stone stay elastic, on one and two processes.
#[test]
fn bonds_have_the_parameters_of_their_phases() {
    let atoms = bar();
    let tables: Tables = toml::from_str(PHASES).unwrap();
    let (mut bonds, rows) = block(LawName::Cpm, &tables.material, &tables.interface).unwrap();
    let mut particles = Particles::default();
    for atom in &atoms {
        let r = atom.radius;
        let mass = 4.0 * std::f64::consts::PI / 3.0 * r * r * r * atom.density;
        particles.push(
            Sphere { position: atom.position, radius: r },
            (atom.kind - 1) as u16,
            mass,
            0.4 * mass * (r * r),
        );
        *particles.velocity.last_mut().unwrap() = atom.velocity;
    }
    let count = bond(bonds.contacts_mut(), &rows, &particles, None, 1.5).unwrap().bonds;
    assert!(count > 700, "{count}");
    let mut state = State { particles, bonds: vec![bonds], ..State::default() };
    state.clock.dt = DT;
    let start = state.clone();
    let model = Model { scheme: Scheme::VelocityVerlet, contact_rows: rows, ..Model::default() };
    let mut solver = Solver::new(model.clone(), &mut state).unwrap();
    let mut own = Vec::new();
    for _ in 0..=3 {
        own.push(state.particles.position.clone());
        (0..50).for_each(|_| drop(solver.step(&mut state).unwrap()));
    }
    // Intact and cracked bonds of mortar, of the interface, and of the stone.
    let mut kinds = [[0; 2]; 3];
    let contacts = state.bonds[0].contacts();
    for k in 0..contacts.len() {
        let pair = contacts.view(k).pair;
        let kind = [pair.a, pair.b].iter().map(|&p| usize::from(state.particles.material[p as usize])).sum::<usize>();
        kinds[kind][usize::from(contacts.damage(k) > 0.0)] += 1;
    }
    let [[_, mortar], [_, interface], [stone, _]] = kinds;
    assert!([mortar, interface, stone].iter().all(|&count| count > 10), "{kinds:?}");
    // Without the interface, the motion is another one by far more than the tolerance below.
    let (mut mean, mean_rows) = block(LawName::Cpm, &tables.material, &[]).unwrap();
    bond(mean.contacts_mut(), &mean_rows, &start.particles, None, 1.5).unwrap();
    let mut other = State { bonds: vec![mean], ..start };
    let mut solver = Solver::new(Model { contact_rows: mean_rows, ..model }, &mut other).unwrap();
    (0..150).for_each(|_| drop(solver.step(&mut other).unwrap()));
    let apart = |a: &[Vec3], b: &[Vec3]| a.iter().zip(b).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    assert!(apart(&other.particles.position, &own[3]) > 1e-7);

    for host in [Host::Liggghts, Host::Lammps] {
        for processes in [1, 2] {
            let folder = tempfile::tempdir().unwrap();
            let (low, high) = (Vec3::repeat(-0.03), Vec3::new(0.07, 0.07, 0.12));
            data_file_for(host, &folder.path().join("bar.data"), &atoms, &[], low, high);
            std::fs::write(folder.path().join("phases.toml"), PHASES).unwrap();
            let integrate = if host == Host::Lammps { "nve/bpm/sphere" } else { "nve/sphere" };
            let script = head_for(host, "bar.data", "f f f", 5e-4, DT)
                + "fix bonds all concordem/bond cpm materials phases.toml bond distance 1.5 contact cpm\n"
                + &format!("fix integrate all {integrate}\n")
                + &dump_for(host, "out.dump", 50)
                + "run 150\n";
            run_in(host, folder.path(), &script, processes);
            let found = frames(&folder.path().join("out.dump"));
            assert_eq!(found.len(), 4);
            for (step, atoms) in found {
                let positions: Vec<Vec3> = atoms.iter().map(|atom| atom.position).collect();
                let apart = apart(&positions, &own[step as usize / 50]);
                // Rounding of coordinates below 0.1 m, summed over 150 steps of cracking bonds.
                assert!(apart < 1e-14, "{host:?}, {processes}, step {step}: {apart:e}");
            }
        }
    }
}
