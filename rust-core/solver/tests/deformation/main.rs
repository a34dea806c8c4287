//! Deformable particles against the closed forms and tables of Madan 2019. "Reference values" are those of the tables,
//! recomputed with another program.

mod dynamics;
mod iteration;
mod restart;
mod statics;
mod time_steps;

use std::f64::consts::PI;

use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::{Elastic, LinearBond};
use concordem_contact::math::Vec3;
use concordem_packing::bonding::bond;
use concordem_packing::mass_of;
use concordem_solver::forces::LawLoops;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients};

const RADIUS: f64 = 1e-3;
const NORMAL: f64 = 7e10;

fn deformable(young: f64, poisson: f64) -> Deformable {
    let elasticity = vec![Elastic { young, poisson }];
    Deformable { elasticity, condition: Condition::PlaneStrain, update: Update::Lagged, dashpots: false }
}

fn model(deformable: &Deformable) -> Model {
    Model { deformable: Some(deformable.clone()), ..Model::default() }
}

/// Discs of density 2000 kg/m³ at the given positions (m).
fn discs(positions: &[(f64, f64)], radius: impl Fn(usize) -> f64) -> Particles {
    let mut particles = Particles::default();
    for (p, &(x, y)) in positions.iter().enumerate() {
        let (mass, inertia) = mass_of(radius(p), 2000.0, true);
        particles.push(Sphere { position: Vec3::new(x, y, 0.0), radius: radius(p) }, 0, mass, inertia);
        particles.constraint[p] = Constraint::OUT_OF_PLANE;
    }
    particles
}

/// One material that interacts with itself.
fn one_material() -> PairCoefficients {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    rows
}

fn bonded<L: LawLoops>(particles: Particles, law: L, ratio: f64) -> State {
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &one_material(), &particles, None, ratio).unwrap();
    State { particles, bonds: vec![Box::new(bonds)], ..State::default() }
}

fn spring(damping_ratio: f64, shear: f64) -> LinearBond {
    LinearBond::new(NORMAL, shear, damping_ratio, f64::INFINITY, f64::INFINITY).unwrap()
}

/// 9 columns and 20 rows, touching.
fn square() -> Vec<(f64, f64)> {
    (0..180).map(|k| (2.0 * RADIUS * f64::from(k % 9), 2.0 * RADIUS * f64::from(k / 9))).collect()
}

/// 17 rows of alternately 6 and 7 discs, touching; 110 discs.
fn triangular() -> Vec<(f64, f64)> {
    let mut positions = Vec::new();
    for row in 0..17 {
        let (count, shift) = if row % 2 == 0 { (6, 1.0) } else { (7, 0.0) };
        for k in 0..count {
            positions.push((RADIUS * (2.0 * f64::from(k) + shift), RADIUS * 3.0_f64.sqrt() * f64::from(row)));
        }
    }
    positions
}

/// Reproducible numbers between −1 and 1.
fn noise(index: usize, stream: usize) -> f64 {
    ((index * 7919 + stream * 104_729) % 1009) as f64 / 504.0 - 1.0
}

/// A lattice of discs of unlike size, bonded with shear springs and set in motion; `strength` (N) of the bonds.
fn disturbed(columns: usize, rows: usize, strength: Option<f64>) -> State {
    let positions: Vec<(f64, f64)> = (0..columns * rows)
        .map(|p| {
            let x = 2.0 * RADIUS * ((p % columns) as f64 + 0.5 * (p / columns % 2) as f64 + 0.02 * noise(p, 5));
            (x, 3.0_f64.sqrt() * RADIUS * ((p / columns) as f64 + 0.02 * noise(p, 6)))
        })
        .collect();
    let particles = discs(&positions, |p| RADIUS * (1.0 + 0.05 * noise(p, 7)));
    let strength = strength.unwrap_or(f64::INFINITY);
    let law = LinearBond::new(NORMAL, 0.5 * NORMAL, 0.05, strength, strength).unwrap();
    let mut state = bonded(particles, law, 1.1);
    for p in 0..columns * rows {
        state.particles.velocity[p] = Vec3::new(noise(p, 1), noise(p, 2), 0.0) * 0.5;
    }
    state.clock.dt = 5e-8;
    state
}

/// Stiffness of a disc in plane strain, (2.72).
fn disc_stiffness(young: f64, poisson: f64) -> f64 {
    PI * young / (2.0 * (1.0 - poisson * poisson))
}
