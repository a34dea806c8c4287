//! Integration tests of ConcorDEM; one file per topic, fixtures in `scenarios/` and `golden/`.
//!
//! This library contains what several tests share: materials, specimens, commands of the program, runs of scenarios, and the
//! reader of gold files.

pub mod commands;
pub mod datasets;
pub mod deformable;
pub mod gold;
pub mod pairs;
pub mod random;
pub mod runs;
pub mod study;

use concordem::law::cpm::{Cpm, CpmParameters};
use concordem::math::Vec3;
use concordem::packing::Packing;
use concordem::packing::bonding::bond;
use concordem::packing::file::import_text;
use concordem::solver::forces::LawLoops;
use concordem::solver::{Model, PairCoefficients, Solver};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Cell, Constraint, Particles, State};

/// Density of the particles of the reference specimen, kg/m³ (Stránský 2018, §2.5.3, with YADE's default).
pub const DENSITY: f64 = 4800.0;
/// Time step of the reference specimen, s.
pub const TIME_STEP: f64 = 2.4787e-7;

/// Material of the reference specimen: Ē = 25 GPa, Ḡ/Ē = 0.2, c₀ = 3 MPa, tan φ = 0.8, ε₀ = 1e-4, ε_f/ε₀ = 30.
pub fn concrete() -> CpmParameters {
    CpmParameters::new(25e9, 0.2, 3e6, 0.8, 1e-4, 30.0)
}

/// The concrete law with valid parameters.
pub fn law(parameters: &CpmParameters) -> Cpm {
    Cpm::new(parameters).expect("parameters of a test are valid")
}

/// Solid spheres of the given density (kg/m³), at rest and free.
pub fn particles(packing: &Packing, density: f64) -> Particles {
    let mut particles = Particles::default();
    for sphere in &packing.spheres {
        let r = sphere.radius;
        let mass = density * (4.0 / 3.0 * std::f64::consts::PI * (r * r * r));
        particles.push(*sphere, 0, mass, 0.4 * mass * (r * r));
    }
    particles
}

/// One material that interacts with itself.
pub fn one_material() -> PairCoefficients {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    rows
}

/// A state in which all pairs closer than `interaction_ratio` times the sum of their radii are bonded.
pub fn bonded<L: LawLoops>(particles: Particles, cell: Option<Cell>, law: L, interaction_ratio: f64) -> State {
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &one_material(), &particles, cell.as_ref(), interaction_ratio).expect("a sound packing");
    State { particles, cell, bonds: vec![Box::new(bonds)], ..State::default() }
}

/// `copies` of the random dense packing of `golden/yade` (22 mm × 22 mm × 42 mm, spheres of 1.2 mm ± 20 %) side by side
/// along x, cut off above `height` (m).
pub fn random_packing(copies: usize, height: f64) -> Packing {
    let one = import_text(include_bytes!("golden/yade/packing.txt").as_slice()).expect("the packing of the gold files");
    let mut packing = Packing::default();
    for copy in 0..copies {
        for sphere in one.spheres.iter().filter(|sphere| sphere.position.z < height) {
            let mut sphere = *sphere;
            sphere.position.x += 22e-3 * copy as f64;
            packing.spheres.push(sphere);
        }
    }
    packing
}

/// Prescribes velocities of the two end layers (4 mm) along z at the strain rate `rate` (1/s); all other particles
/// start with the linear velocity field, as in Stránský 2018, §2.5.3. The ends move freely across z and rotate freely.
pub fn pull(state: &mut State, rate: f64) {
    let particles = &mut state.particles;
    let heights = || particles.position.iter().map(|x| x.z);
    let (low, high) = (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let middle = 0.5 * (low + high);
    for p in 0..particles.len() {
        let z = particles.position[p].z;
        let mut place = z;
        if z < low + 4e-3 {
            place = low;
        } else if z > high - 4e-3 {
            place = high;
        }
        if place != z {
            particles.constraint[p] = Constraint::translation_along(2);
        }
        particles.velocity[p] = Vec3::new(0.0, 0.0, rate * (place - middle));
    }
}

/// Runs `work` on a pool of `threads` threads.
pub fn on_threads<R: Send>(threads: usize, work: impl FnOnce() -> R + Send) -> R {
    rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads").install(work)
}

/// A solver for the state.
pub fn solver(model: Model, state: &mut State) -> Solver {
    Solver::new(model, state).expect("a sound state")
}

/// Reproducible numbers between −1 and 1.
pub fn noise(index: usize, stream: usize) -> f64 {
    ((index * 7919 + stream * 104_729) % 1009) as f64 / 504.0 - 1.0
}

/// A reproducible vector with components between −1 and 1.
pub fn noise_vector(index: usize, stream: usize) -> Vec3 {
    Vec3::new(noise(index, 3 * stream), noise(index, 3 * stream + 1), noise(index, 3 * stream + 2))
}
