//! Speed of a law on a given packing, to compare with other programs (`validation/speed.py`) and to count instructions
//! (`validation/instructions.py`).
//!
//! ```sh
//! RAYON_NUM_THREADS=1 cargo run --release --example speed -- packing.txt cpm --steps 500
//! cargo run --release --example speed -- memory      # bandwidth of the memory on one core
//! ```
//! The packing is a text file, `x y z r` per line in m, with an optional cell; or `sc:N` or `fcc:N`, a lattice of touching spheres of
//! radius 5 mm with `N` spheres along each edge (fcc: every second place of `N³`). [`arguments`] has the laws and options.
//!
//! Two layers of spheres at both ends along z are grips that move apart; all other spheres start with the linear velocity
//! field. With `--shake V` there are no grips and no damping, and sphere `k` starts with velocities that follow from `k`.
//!
//! Prints one JSON object: nanoseconds per contact and step, of whole steps and of each stage; bytes per bond; the largest memory of the
//! process; steps with and without a bond that breaks; and the state at the end, to compare with that of another program.

mod arguments;
mod machine;

use std::fs::File;
use std::io::BufReader;
use std::time::Instant;

use concordem::kinematics::deformable::{Condition, Deformable, Update};
use concordem::law::cpm::{CpmFormulation, friction_of_yade};
use concordem::law::{
    CohesiveBeam, ContactStiffness, Cpm, CpmParameters, Elastic, Frictional, HertzMindlin, LinearBond, ParameterError,
    Section,
};
use concordem::math::Vec3;
use concordem::neighbor::spatial_order;
use concordem::packing::bonding::bond;
use concordem::packing::{Packing, import_text, mass_of};
use concordem::solver::forces::{EvaluatedContacts, LawLoops};
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, PairCoefficients, Solver, StageTimes};
use concordem::state::contacts::{ContactBlock, ReadContacts};
use concordem::state::{Constraint, Particles, Sphere, State};

use arguments::Arguments;

const PARTS: usize = 10;
/// Steps between samples of energies.
const SAMPLED_EVERY: usize = 100;

type Failure = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Failure> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    if words.first().is_some_and(|word| word == "memory") {
        println!("{}", machine::measure());
        return Ok(());
    }
    let arguments = Arguments::parse(&words)?;
    // As in the program: run inside the pool, because a thread outside would wait for the pool several times per step.
    rayon::ThreadPoolBuilder::new().build()?.install(|| with_law(&arguments))
}

/// Run the law that the arguments name.
fn with_law(arguments: &Arguments) -> Result<(), Failure> {
    let Arguments { young, kinematics, .. } = *arguments;
    let damping =
        if arguments.shake.is_some() { Damping::None } else { Damping::Local { translation: 0.3, rotation: 0.3 } };
    let mut model = Model { mode: kinematics, scheme: arguments.scheme(), damping, ..Model::default() };
    match arguments.law.as_str() {
        "cpm" | "cpm-yade" => {
            let mut parameters = CpmParameters::new(young, 0.2, 3e6, 0.8, 1e-4, arguments.ductility);
            if arguments.law == "cpm-yade" {
                parameters.mode = CpmFormulation::YadePublic;
                parameters.friction_coefficient = friction_of_yade(libm::atan(0.8))?;
            }
            if let Some(threshold) = arguments.break_at {
                parameters.omega_threshold = threshold;
            }
            let law = Cpm::new(&parameters)?;
            run(arguments, Some(law), law, model)
        }
        "cohesive_beam" => {
            // With a strength that the stresses never reach.
            let beam = CohesiveBeam::new(young, 0.2, Section::Ratio(0.5))?;
            run(arguments, Some(CohesiveBeam { strength: 1e12, ..beam }), touching()?, model)
        }
        "linear_bond" => run(arguments, Some(linear()?), touching()?, model),
        "deformable" => {
            model.deformable = Some(Deformable {
                elasticity: vec![Elastic { young, poisson: 0.2 }],
                condition: Condition::Solid,
                update: Update::Lagged,
                dashpots: false,
            });
            run(arguments, Some(linear()?), touching()?, model)
        }
        "hertz_mindlin" => {
            let grain = Elastic { young, poisson: 0.3 };
            run(arguments, None::<LinearBond>, HertzMindlin::new(grain, grain, 0.4, 0.9)?, model)
        }
        other => Err(format!("{other} is not one of the laws: {}", arguments::LAWS.join(", ")).into()),
    }
}

fn linear() -> Result<LinearBond, ParameterError> {
    LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY)
}

/// Law of contacts without a bond.
fn touching() -> Result<Frictional, ParameterError> {
    Frictional::new(ContactStiffness::Given { normal: 1e6, shear: 4e5 }, 0.5, 0.0)
}

/// The packing of a file or a lattice.
fn spheres(name: &str) -> Result<Packing, Failure> {
    let radius = 0.005;
    let (spacing, step, edge) = match name.split_once(':') {
        Some(("sc", edge)) => (2.0 * radius, 1, edge.parse::<usize>()?),
        Some(("fcc", edge)) => (std::f64::consts::SQRT_2 * radius, 2, edge.parse::<usize>()?),
        _ => return Ok(import_text(BufReader::new(File::open(name)?))?),
    };
    let mut spheres = Vec::with_capacity(edge.pow(3) / step + 1);
    for k in 0..edge.pow(3) {
        let place = [k % edge, k / edge % edge, k / (edge * edge)];
        if place.iter().sum::<usize>() % step == 0 {
            spheres.push(Sphere { position: Vec3::from(place.map(|i| i as f64 * spacing)), radius });
        }
    }
    Ok(Packing { spheres, cell: None })
}

/// Build the state, time its steps, and print the figures.
fn run<L: LawLoops, C: LawLoops>(
    arguments: &Arguments,
    law: Option<L>,
    contact_law: C,
    model: Model,
) -> Result<(), Failure> {
    let packing = spheres(&arguments.packing)?;
    let mut particles = Particles::default();
    for sphere in &packing.spheres {
        let (mass, inertia) = mass_of(sphere.radius, arguments.density, false);
        particles.push(*sphere, 0, mass, inertia);
    }
    let cell = packing.cell;
    drop(packing.spheres);
    let order = spatial_order(&particles.position, cell.as_ref());
    let mut particles = particles.permuted(&order);
    let smallest = particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    let grip = match arguments.shake {
        Some(speed) => shake(&mut particles, speed),
        None => stretch(&mut particles, arguments.rate),
    };
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut state = State { cell, ..State::default() };
    let (mut bonds, mut bytes_per_bond) = (0, 0);
    if let Some(law) = law {
        let mut block = ContactBlock::new(vec![law]);
        bonds = bond(&mut block, &rows, &particles, state.cell.as_ref(), arguments.ratio)?.bonds;
        bytes_per_bond = block.bytes_per_contact();
        state.bonds.push(Box::new(block) as Box<dyn EvaluatedContacts>);
    }
    let contacts = ContactBlock::new(vec![contact_law]);
    if bonds == 0 {
        bytes_per_bond = contacts.bytes_per_contact();
    }
    state.contacts = Some(Box::new(contacts));
    state.particles = particles;
    let start = state.particles.position.clone();
    state.clock.dt = arguments.time_step.unwrap_or(0.5 * smallest * (arguments.density / arguments.young).sqrt());
    let mut solver = Solver::new(Model { contact_rows: rows, ..model }, &mut state)?;
    let mut active = [0; 3];
    for _ in 0..arguments.warmup {
        active = solver.step_with(&mut state, false)?.active;
    }
    // Bonds that break meanwhile count on as contacts of their particles.
    let count = active.iter().sum::<u64>().max(1);
    let before = *solver.stage_times();
    let mut times = Times::default();
    let processor = machine::processor_time();
    let steps = (arguments.steps / PARTS).max(1) * PARTS;
    for k in 0..steps {
        let began = Instant::now();
        let report = solver.step_with(&mut state, k % SAMPLED_EVERY == 0)?;
        let nanoseconds = began.elapsed().as_secs_f64() * 1e9;
        times.add(nanoseconds, report.bonds_broke(), report.rebuilt);
    }
    let processor = machine::processor_time() - processor;
    let (best, median) = times.parts(count as f64);
    let figures = [
        "\"code\": \"concordem\"".to_string(),
        format!("\"law\": \"{}\"", arguments.law),
        format!("\"threads\": {}", rayon::current_num_threads()),
        format!("\"kinematics\": \"{:?}\"", arguments.kinematics),
        format!("\"particles\": {}, \"bonds\": {bonds}, \"contacts\": {count}, \"steps\": {steps}", start.len()),
        format!("\"ns_per_bond_step_best\": {best:.2}, \"ns_per_bond_step_median\": {median:.2}"),
        format!("\"loop_s\": {:.6}, \"processor_s\": {processor:.6}", times.all.iter().sum::<f64>() * 1e-9),
        format!("\"stages_ns\": {}", stages(&before, solver.stage_times(), (steps as u64 * count) as f64)),
        format!("\"neighbor_searches\": {}", solver.neighbor_rebuilds()),
        format!("\"breaking\": {}, \"quiet\": {}", summary(&times.breaking), summary(&times.quiet)),
        format!("\"bytes_per_bond\": {bytes_per_bond}"),
        format!("\"peak_bytes_per_particle\": {:.0}", machine::peak_memory() / start.len() as f64),
        format!("\"scratch_bytes_per_bond\": {:.1}", solver.scratch_bytes() as f64 / count as f64),
        format!("\"state\": {}", end_state(&state, &solver, &start, &grip)),
    ];
    println!("{{{}}}", figures.join(", "));
    Ok(())
}

/// Give all particles the linear velocity field of the strain rate `rate` (1/s) along z and fix the ends. Returns the
/// particles of the upper grip.
fn stretch(particles: &mut Particles, rate: f64) -> Vec<usize> {
    let (low, high) =
        particles.position.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), x| (l.min(x.z), h.max(x.z)));
    let layer = 2.0 * particles.radius.iter().copied().fold(0.0, f64::max);
    let mut upper = Vec::new();
    for p in 0..particles.len() {
        let along = particles.position[p].z - low;
        particles.velocity[p].z = rate * (along - 0.5 * (high - low));
        if along < layer || high - low - along < layer {
            particles.velocity[p].z = (0.5 * rate * (high - low)).copysign(particles.velocity[p].z);
            particles.constraint[p] = Constraint::translation_along(2).with(Constraint::ROTATION);
            if particles.velocity[p].z > 0.0 {
                upper.push(p);
            }
        }
    }
    upper
}

/// Velocities that look random and follow from the number of the sphere in the file, between ±`speed` (m/s).
fn shake(particles: &mut Particles, speed: f64) -> Vec<usize> {
    for p in 0..particles.len() {
        let id = u64::from(particles.id[p]);
        let along = |factor: u64| ((id * factor) % 1009) as f64 / 1009.0 - 0.5;
        particles.velocity[p] = Vec3::new(along(7919), along(104_729), along(1_299_709)) * (2.0 * speed);
    }
    Vec::new()
}

/// Times of steps, ns.
#[derive(Default)]
struct Times {
    all: Vec<f64>,
    /// Steps in which bonds broke, without a neighbor search.
    breaking: Vec<f64>,
    /// Steps without a broken bond and without a search, in the same stretch of the run.
    quiet: Vec<f64>,
}

impl Times {
    fn add(&mut self, nanoseconds: f64, broke: bool, searched: bool) {
        self.all.push(nanoseconds);
        match (broke, searched) {
            (_, true) => {}
            (true, false) => self.breaking.push(nanoseconds),
            (false, false) => self.quiet.push(nanoseconds),
        }
    }

    /// Best and median time of the parts of the run, per contact and step.
    fn parts(&self, contacts: f64) -> (f64, f64) {
        let length = self.all.len() / PARTS;
        let of_part = |part: &[f64]| part.iter().sum::<f64>() / (length as f64 * contacts);
        let mut parts: Vec<f64> = self.all.chunks(length).map(of_part).collect();
        parts.sort_unstable_by(f64::total_cmp);
        (parts[0], 0.5 * (parts[(PARTS - 1) / 2] + parts[PARTS / 2]))
    }
}

/// Number of steps and their median time, ns.
fn summary(times: &[f64]) -> String {
    let mut sorted = times.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let median = sorted.get(sorted.len() / 2).map_or("null".to_string(), |time| format!("{time:.0}"));
    format!("{{\"steps\": {}, \"median_ns\": {median}}}", times.len())
}

/// Nanoseconds per contact and step of each stage.
fn stages(before: &StageTimes, after: &StageTimes, contact_steps: f64) -> String {
    let spent = before.named().into_iter().zip(after.named());
    let each: Vec<String> = spent
        .map(|((name, before), (_, after))| {
            format!("\"{name}\": {:.3}", after.saturating_sub(before).as_secs_f64() * 1e9 / contact_steps)
        })
        .collect();
    format!("{{{}}}", each.join(", "))
}

/// What other programs can tell of their state, too.
fn end_state(state: &State, solver: &Solver, start: &[Vec3], grip: &[usize]) -> String {
    let moved: f64 = state.particles.position.iter().zip(start).map(|(now, then)| (now - then).norm_squared()).sum();
    let moved = (moved / start.len() as f64).sqrt();
    let force: f64 = grip.iter().map(|&p| solver.forces()[p].z).sum();
    let left: usize = state.bonds.iter().map(|block| block.len()).sum();
    format!("{{\"rms_displacement\": {moved:e}, \"grip_force\": {force:e}, \"bonds\": {left}}}")
}
