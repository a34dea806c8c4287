//! Heat conduction and thermal expansion against closed forms, stencils, and balances.

mod conduction;
mod contacts;
mod curves;
mod dissipation;
mod expansion;
mod hosts;
mod softening;
mod walls;

use concordem_contact::math::Vec3;
use concordem_operator::HalfSpace;
use concordem_packing::Random;
use concordem_solver::heat::network::{self, Network, Plane};
use concordem_solver::heat::{Curves, HeatModel, Supply, ThermalMaterial, capacities};
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, Solver};

/// A material with capacity and conductivity of order 1, and without expansion.
const PLAIN: ThermalMaterial = ThermalMaterial { specific_heat: 3.0, conductivity: 2.0, expansion: 0.0 };

/// A simple cubic lattice of spheres of radius ½ and mass 1 with centers at whole numbers.
fn cubes(counts: [usize; 3]) -> Particles {
    let mut particles = Particles::default();
    for z in 0..counts[2] {
        for y in 0..counts[1] {
            for x in 0..counts[0] {
                let position = Vec3::new(x as f64, y as f64, z as f64);
                particles.push(Sphere { position, radius: 0.5 }, 0, 1.0, 0.1);
            }
        }
    }
    particles
}

/// Points at random in the unit cube, no two nearer than 0.4 of the mean distance, as spheres of different radii.
fn scattered(count: usize, seed: u64) -> Particles {
    let mut random = Random::new(seed);
    let mut particles = Particles::default();
    let spacing = (1.0 / count as f64).cbrt();
    while particles.len() < count {
        let position = Vec3::from_fn(|_, _| random.uniform());
        if particles.position.iter().all(|x| (x - position).norm() > 0.4 * spacing) {
            let radius = spacing * (0.3 + 0.2 * random.uniform());
            particles.push(Sphere { position, radius }, 0, 1.0, 0.1);
        }
    }
    particles
}

/// Faces 0 to 5: x at 0 and 1, y, z.
fn unit_cube() -> Vec<Plane> {
    let plane = |face: u32| {
        let (axis, high) = (face as usize / 2, face % 2 == 1);
        let normal = Vec3::ith(axis, if high { 1.0 } else { -1.0 });
        Plane { inside: HalfSpace { point: if high { Vec3::repeat(1.0) } else { Vec3::zeros() }, normal }, face }
    };
    (0..6).map(plane).collect()
}

fn model(network: Network, particles: &Particles, materials: &[ThermalMaterial]) -> HeatModel {
    let none = vec![None; materials.len()];
    HeatModel {
        capacity: capacities(&network, particles, materials, &none),
        materials: materials.to_vec(),
        curves: Curves::default(),
        network,
        supply: Supply::default(),
        reference_temperature: 300.0,
        time_factor: 1.0,
        implicit: false,
        mechanics: false,
        dissipation: false,
        crack_resistance: f64::INFINITY,
        contact: None,
    }
}

/// The ordered network of touching spheres.
fn lattice(particles: &Particles) -> Network {
    let pairs = network::touching(particles, None, 1.0).unwrap();
    network::ordered(particles, &pairs, &[], false)
}

/// A state at the given temperatures with a solver.
fn run(heat: HeatModel, particles: Particles, temperature: Vec<f64>, dt: f64) -> (State, Solver) {
    let mut state = State { heat: Some(heat.start(temperature)), particles, ..State::default() };
    state.clock.dt = dt;
    let solver = Solver::new(Model { heat: Some(heat), ..Model::default() }, &mut state).unwrap();
    (state, solver)
}

fn temperatures(state: &State) -> &[f64] {
    &state.heat.as_ref().unwrap().temperature
}

/// Largest stable step of a model, s.
fn stable_step(solver: &Solver, state: &State) -> f64 {
    let heat = solver.model().heat.as_ref().unwrap();
    solver.heat().unwrap().stable_step(heat, &state.particles, state.heat.as_ref().unwrap())
}
