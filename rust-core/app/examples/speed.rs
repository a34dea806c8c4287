//! Speed of a bond law on a given packing, to compare with other programs: `tests/peers/yade_cpm_speed.py` (concrete),
//! `liggghts-bridge/lammps/compare_speed.py` (beams).
//!
//! ```sh
//! RAYON_NUM_THREADS=1 cargo run --release --example speed -- packing.txt 1.5 500 [finite|yade-ratcheting [LAW]]
//! ```
//! LAW: `cpm`, `cohesive_beam`, `linear_bond`, or `deformable` (`linear_bond` between deformable particles).
//! Prints one JSON object: nanoseconds per bond and step (whole steps; best and median of ten parts of the run), share
//! of the neighbor search, and bytes per bond and per particle.

use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use concordem::kinematics::MotionMeasure;
use concordem::kinematics::deformable::{Condition, Deformable, Update};
use concordem::law::{
    CohesiveBeam, ContactStiffness, Cpm, CpmParameters, Elastic, Frictional, LinearBond, ParameterError, Section,
};
use concordem::neighbor::spatial_order;
use concordem::packing::bonding::bond;
use concordem::packing::import_text;
use concordem::packing::mass_of;
use concordem::solver::forces::LawLoops;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, PairCoefficients, Solver};
use concordem::state::contacts::{ContactBlock, Contacts};
use concordem::state::{Constraint, Particles, State};

const PARTS: usize = 10;
/// Steps between samples of energies.
const SAMPLED_EVERY: usize = 100;

type Outcome = Result<(), Box<dyn std::error::Error + Send + Sync>>;

fn main() -> Outcome {
    // As in the program: run inside the pool, because a thread outside would wait for the pool several times per step.
    rayon::ThreadPoolBuilder::new().build()?.install(measure)
}

fn measure() -> Outcome {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let path = arguments.first().ok_or("give a packing file: x y z r per line, in m")?;
    let ratio: f64 = arguments.get(1).map_or(Ok(1.5), |a| a.parse())?;
    let steps: usize = arguments.get(2).map_or(Ok(500), |a| a.parse())?;
    let mode = match arguments.get(3).map(String::as_str) {
        Some("yade-ratcheting") => MotionMeasure::YadeRatcheting,
        _ => MotionMeasure::Finite,
    };
    let mut model = Model { mode, damping: Damping::Local { translation: 0.3, rotation: 0.3 }, ..Model::default() };
    match arguments.get(4).map_or("cpm", String::as_str) {
        "cpm" => {
            let law = Cpm::new(&CpmParameters::new(25e9, 0.2, 3e6, libm::atan(0.8), 1e-4, 30.0))?;
            run(path, ratio, steps, law, law, model)
        }
        "cohesive_beam" => {
            // With a strength that the stresses never reach.
            let beam = CohesiveBeam::new(25e9, 0.2, Section::Ratio(0.5))?;
            run(path, ratio, steps, CohesiveBeam { strength: 1e12, ..beam }, touching()?, model)
        }
        "linear_bond" => run(path, ratio, steps, linear()?, touching()?, model),
        "deformable" => {
            model.deformable = Some(Deformable {
                elasticity: vec![Elastic { young: 25e9, poisson: 0.2 }],
                condition: Condition::Solid,
                update: Update::Lagged,
                dashpots: false,
            });
            run(path, ratio, steps, linear()?, touching()?, model)
        }
        other => Err(format!("{other} is not one of the laws listed at the top of this example").into()),
    }
}

fn linear() -> Result<LinearBond, ParameterError> {
    LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY)
}

/// Law of contacts without a bond.
fn touching() -> Result<Frictional, ParameterError> {
    Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.5, 0.0)
}

fn run<L: LawLoops, C: LawLoops>(
    path: &str,
    ratio: f64,
    steps: usize,
    law: L,
    contact_law: C,
    model: Model,
) -> Outcome {
    let packing = import_text(BufReader::new(File::open(path)?))?;
    let mut particles = Particles::default();
    for sphere in &packing.spheres {
        let (mass, inertia) = mass_of(sphere.radius, 4800.0, false);
        particles.push(*sphere, 0, mass, inertia);
    }
    let order = spatial_order(&particles.position, None);
    let mut particles = particles.permuted(&order);
    let (low, high) =
        particles.position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x.z), h.max(x.z)));
    let largest = particles.radius.iter().copied().fold(0.0, f64::max);
    let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let rate = 0.05;
    for p in 0..particles.len() {
        let along = particles.position[p].z - low;
        particles.velocity[p].z = rate * (along - 0.5 * (high - low));
        if along < 2.0 * largest || high - low - along < 2.0 * largest {
            particles.velocity[p].z = (0.5 * rate * (high - low)).copysign(particles.velocity[p].z);
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
        }
    }
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    let count = bond(&mut bonds, &rows, &particles, None, ratio)?.bonds;
    let bytes_per_bond = bonds.bytes_per_contact();
    let contacts = ContactBlock::new(vec![contact_law]);
    let mut state =
        State { particles, bonds: vec![Box::new(bonds)], contacts: Some(Box::new(contacts)), ..State::default() };
    state.clock.dt = 0.5 * smallest * (4800.0_f64 / 25e9).sqrt();
    let mode = model.mode;
    let model = Model { contact_rows: rows, ..model };
    let mut solver = Solver::new(model, &mut state)?;
    for _ in 0..20 {
        solver.step_with(&mut state, false)?;
    }
    let per_part = (steps / PARTS).max(1);
    let mut parts = Vec::with_capacity(PARTS);
    for part in 0..PARTS {
        let start = Instant::now();
        for k in part * per_part..(part + 1) * per_part {
            solver.step_with(&mut state, k % SAMPLED_EVERY == 0)?;
        }
        parts.push(start.elapsed().as_secs_f64() * 1e9 / (per_part * count) as f64);
    }
    parts.sort_unstable_by(f64::total_cmp);
    let scratch = solver.scratch_bytes();
    println!(
        "{{\"code\": \"concordem\", \"law\": \"{}\", \"threads\": {}, \"mode\": \"{mode:?}\", \"particles\": {}, \"bonds\": {count}, \
         \"steps\": {}, \"ns_per_bond_step_best\": {:.2}, \"ns_per_bond_step_median\": {:.2}, \
         \"neighbour_searches\": {}, \"bytes_per_bond\": {bytes_per_bond}, \"scratch_bytes_per_bond\": {:.1}}}",
        L::NAME,
        rayon::current_num_threads(),
        state.particles.len(),
        per_part * PARTS,
        parts[0],
        parts[PARTS / 2],
        solver.neighbor_rebuilds(),
        scratch as f64 / count as f64,
    );
    Ok(())
}
