//! The kernels, called in a loop, give the bits of the solver.

use std::fs::File;
use std::io::BufReader;

use concordem_contact::kinematics::Motion;
use concordem_contact::law::cpm::CpmParameters;
use concordem_contact::law::{CohesiveBeam, Cpm, LinearBond, Section};
use concordem_contact::leapfrog::{Body, Drifted, Kick};
use concordem_contact::math::{Mat3, Vec3};
use concordem_gpu::bond::{self, Bond, End, Evaluated, Loads};
use concordem_gpu::{Incidence, particle};
use concordem_packing::bonding::bond as bond_all;
use concordem_packing::{import_text, mass_of};
use concordem_solver::forces::{LawLoops, TILE};
use concordem_solver::integrate::Damping;
use concordem_solver::neighbor::spatial_order;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, Particles, State};
use concordem_solver::{Model, PairCoefficients, Solver};

const GRAVITY: Vec3 = Vec3::new(1.0, -2.0, 3.0);
const DAMPING: [f64; 2] = [0.3, 0.2];
const DENSITY: f64 = 4800.0;
const YOUNG: f64 = 25e9;
const STEPS: usize = 60;

/// 1,160 spheres in two tiles. Both ends along z move apart and keep their velocity; some spheres spin.
fn specimen(rate: f64) -> Particles {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tests/golden/yade/packing.txt");
    let packing = import_text(BufReader::new(File::open(path).unwrap())).unwrap();
    let mut particles = Particles::default();
    for sphere in &packing.spheres {
        let (mass, inertia) = mass_of(sphere.radius, DENSITY, false);
        particles.push(*sphere, 0, mass, inertia);
    }
    let order = spatial_order(&particles.position, None);
    let mut particles = particles.permuted(&order);
    assert!(particles.len() > TILE, "one tile tests little");
    let along = |particles: &Particles, p: usize| particles.position[p].z;
    let (low, high) = (0..particles.len())
        .map(|p| along(&particles, p))
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    for p in 0..particles.len() {
        let share = (along(&particles, p) - low) / (high - low);
        particles.velocity[p].z = rate * (high - low) * (share - 0.5);
        particles.angular_velocity[p] = Vec3::new(1.0, -0.5, 0.3) * f64::from(u8::from(p % 5 == 0));
        if !(0.1..=0.9).contains(&share) {
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
        }
    }
    particles
}

/// The kernels of a step for all bonds and all particles, one after the other.
fn step<L: LawLoops>(
    particles: &mut Particles,
    bonds: &mut ContactBlock<L>,
    incidence: &Incidence,
    loads: &mut [Loads],
    dt: f64,
) {
    let end = |p: u32| {
        let p = p as usize;
        let motion = Motion {
            position: particles.position[p],
            velocity: particles.velocity[p],
            angular_velocity: particles.angular_velocity[p],
            rotation_increment: particles.rotation_increment[p],
            orientation: particles.orientation[p],
        };
        End { motion, radius: particles.radius[p], mass: particles.mass[p] }
    };
    // Backwards: the order of the threads does not matter.
    for k in (0..bonds.len()).rev() {
        let before = Bond { reference: bonds.reference[k], previous: bonds.previous[k], history: bonds.history[k] };
        let ends = [end(bonds.pair[k].a), end(bonds.pair[k].b)];
        let law = &bonds.rows[bonds.flags[k].row as usize];
        let Evaluated { loads: of_bond, previous, history, broke } =
            bond::evaluate(law, &before, [&ends[0], &ends[1]], dt);
        assert!(!broke);
        (bonds.previous[k], bonds.history[k], loads[k]) = (previous, history, of_bond);
    }
    let kick = Kick { dt, step: dt, gravity: GRAVITY, damping: DAMPING, gradient: Mat3::zeros() };
    for p in (0..particles.len()).rev() {
        let body = Body {
            force: Vec3::zeros(),
            torque: Vec3::zeros(),
            velocity: particles.velocity[p],
            angular_velocity: particles.angular_velocity[p],
            orientation: particles.orientation[p],
            position: particles.position[p],
            mass: particles.mass[p],
            inertia: particles.inertia[p],
        };
        let advanced = particle::advance(&kick, true, &body, particles.constraint[p].0, incidence.of(p), |k| loads[k]);
        let Drifted { position, increment, orientation } = advanced.drifted;
        particles.velocity[p] = advanced.velocity;
        particles.angular_velocity[p] = advanced.angular_velocity;
        particles.position[p] = position;
        particles.rotation_increment[p] = increment;
        particles.orientation[p] = orientation;
    }
}

/// Solver and kernels move the particles alike, to the last bit.
fn compare<L: LawLoops>(law: L, rate: f64) -> ContactBlock<L> {
    let mut particles = specimen(rate);
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    bond_all(&mut bonds, &rows, &particles, None, 1.5).unwrap();
    let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let dt = 0.5 * smallest * (DENSITY / YOUNG).sqrt();

    let mut state = State { particles: particles.clone(), ..State::default() };
    state.bonds.push(Box::new(bonds.clone()));
    state.clock.dt = dt;
    let damping = Damping::Local { translation: DAMPING[0], rotation: DAMPING[1] };
    let mut solver = Solver::new(Model { damping, gravity: GRAVITY, ..Model::default() }, &mut state).unwrap();
    for _ in 0..STEPS {
        assert!(!solver.step_with(&mut state, false).unwrap().bonds_broke());
    }

    let pairs: Vec<[u32; 2]> = bonds.pair.iter().map(|pair| [pair.a, pair.b]).collect();
    let incidence = Incidence::new(&pairs, particles.len(), TILE);
    let mut loads = vec![Loads::default(); bonds.len()];
    for _ in 0..STEPS {
        step(&mut particles, &mut bonds, &incidence, &mut loads, dt);
    }
    let bits = |p: &Particles| {
        format!("{:?}", (&p.position, &p.velocity, &p.angular_velocity, &p.orientation, &p.rotation_increment))
    };
    assert!(bits(&particles) == bits(&state.particles), "{}", L::NAME);
    let forced = loads.iter().filter(|of_bond| of_bond.force.norm() > 0.0).count();
    assert!(forced > bonds.len() / 2, "{forced} of {} bonds have a force", bonds.len());
    bonds
}

#[test]
fn elastic_concrete_has_the_bits_of_the_solver() {
    compare(Cpm::new(&CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 30.0)).unwrap(), 0.05);
}

/// Damage grows in some bonds and not in others, so both formulas of the law's columns meet the scalar one.
#[test]
fn damaged_concrete_has_the_bits_of_the_solver() {
    let bonds = compare(Cpm::new(&CpmParameters::new(YOUNG, 0.2, 3e6, 0.6, 1e-4, 30.0)).unwrap(), 40.0);
    let damaged = bonds.history.iter().filter(|history| history.omega > 0.0).count();
    assert!((bonds.len() / 100..bonds.len()).contains(&damaged), "{damaged} of {} bonds are damaged", bonds.len());
}

#[test]
fn beams_have_the_bits_of_the_solver() {
    compare(CohesiveBeam::new(YOUNG, 0.2, Section::Ratio(0.5)).unwrap(), 0.05);
}

#[test]
fn linear_bonds_have_the_bits_of_the_solver() {
    compare(LinearBond::new(1e6, 4e5, 0.1, f64::INFINITY, f64::INFINITY).unwrap(), 0.05);
}
