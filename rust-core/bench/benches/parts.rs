//! Speed of single parts: the concrete law, its kinematics, the neighbor search, and a whole step. Times of whole steps are
//! processor times summed over threads; run with `RAYON_NUM_THREADS=1`.

mod measurement;

use criterion::{BatchSize, BenchmarkGroup, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use concordem::kinematics::deformable::{Condition, Deformable, Update};
use concordem::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry, measure};
use concordem::kinematics::{ContactInput, MotionMeasure, PreviousGeometry};
use concordem::law::cpm::CpmFormulation;
use concordem::law::{
    CohesiveBeam, ContactGeometry, ContactLaw, Cpm, CpmParameters, CpmState, Elastic, LinearBond, Section,
};
use concordem::math::{Quat, Vec3};
use concordem::neighbor::{candidate_pairs, spatial_order};
use concordem::packing::bonding::bond;
use concordem::packing::mass_of;
use concordem::solver::forces::LawLoops;
use concordem::solver::{Model, PairCoefficients, Solver};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Particles, Sphere, State};
use measurement::ProcessorTime;

fn law() -> Cpm {
    Cpm::new(&CpmParameters::new(25e9, 0.2, 3e6, 0.8, 1e-4, 30.0)).expect("valid parameters")
}

/// A jittered cubic block of `n³` spheres of radius 1 mm, ordered along a space-filling curve.
fn block(n: usize) -> Particles {
    let radius = 1e-3;
    let (mass, inertia) = mass_of(radius, 4800.0, false);
    let mut particles = Particles::default();
    for k in 0..n * n * n {
        let jitter = |s: usize| ((k * 7919 + s * 104_729) % 1000) as f64 / 1000.0 - 0.5;
        let at = Vec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64);
        let position = (at + Vec3::new(jitter(1), jitter(2), jitter(3)) * 0.3) * (2.0 * radius);
        particles.push(Sphere { position, radius }, 0, mass, inertia);
    }
    let order = spatial_order(&particles.position, None);
    particles.permuted(&order)
}

fn single_contact(c: &mut Criterion) {
    let law = law();
    let geometry = ContactGeometry {
        reference_length: 2e-3,
        area: 3e-6,
        radius_a: 1e-3,
        radius_b: 1e-3,
        mass_a: 2e-5,
        mass_b: 2e-5,
    };
    let still = |position| Motion {
        position,
        velocity: Vec3::zeros(),
        angular_velocity: Vec3::zeros(),
        rotation_increment: Quat::identity(),
        orientation: Quat::identity(),
    };
    let (a, b) = (still(Vec3::zeros()), still(Vec3::new(2.0001e-3, 1e-7, 0.0)));
    let frame: PreviousGeometry = initial_geometry(&a.position, &Vec3::new(2e-3, 0.0, 0.0), &Vec3::zeros());
    let none = ImageShift::default();
    let input =
        ContactInput { a: &a, b: &b, image: &none, geometry: &geometry, previous: &frame, bonded: true, dt: 1e-7 };
    c.bench_function("kinematics, finite", |bench| {
        bench.iter(|| measure(MotionMeasure::Finite, black_box(&input)));
    });
    let kinematics = measure(MotionMeasure::Finite, &input);
    c.bench_function("law, cpm", |bench| {
        bench.iter(|| law.respond(black_box(&kinematics), black_box(&CpmState::default()), 1e-7));
    });
}

fn neighbor_search(c: &mut Criterion) {
    let mut group = c.benchmark_group("neighbor search");
    group.sample_size(10);
    for n in [22, 47] {
        let particles = block(n);
        let reach = vec![1.1e-3; particles.len()];
        group.throughput(Throughput::Elements(particles.len() as u64));
        group.bench_with_input(BenchmarkId::from_parameter(particles.len()), &n, |bench, _| {
            bench.iter(|| candidate_pairs(&particles.position, &reach, None));
        });
    }
    group.finish();
}

/// Measures the time per bond and step of particles that one law bonds at an interaction ratio of 1.5.
fn bonded_step<L: LawLoops>(
    group: &mut BenchmarkGroup<'_, ProcessorTime>,
    name: &str,
    particles: &Particles,
    law: L,
    model: &Model,
) {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    let count = bond(&mut bonds, &rows, particles, None, 1.5).expect("finite positions").bonds;
    let mut state = State { particles: particles.clone(), bonds: vec![Box::new(bonds)], ..State::default() };
    state.clock.dt = 2.4787e-7;
    group.throughput(Throughput::Elements(10 * count as u64));
    group.bench_function(BenchmarkId::new(name, format!("{count} bonds")), |bench| {
        bench.iter_batched_ref(
            || {
                let mut state = state.clone();
                let mut solver = Solver::new(model.clone(), &mut state).expect("a sound state");
                // The first step of bonds differs from later ones.
                solver.step_with(&mut state, false).expect("stable");
                (state, solver)
            },
            |(state, solver)| {
                for _ in 0..10 {
                    solver.step_with(state, false).expect("stable");
                }
            },
            BatchSize::PerIteration,
        );
    });
}

/// Ten steps of bonded particles; the throughput is in bond-steps. The pass over deformable particles must cost at most
/// half as much as a step of the same bonds without it.
fn whole_step(c: &mut Criterion<ProcessorTime>) {
    let mut group = c.benchmark_group("ten steps");
    group.sample_size(10);
    let plain = Model::default();
    bonded_step(&mut group, "cpm", &block(47), law(), &plain);
    let particles = block(30);
    bonded_step(&mut group, "cpm", &particles, law(), &plain);
    let yade = Model { mode: MotionMeasure::YadeRatcheting, ..Model::default() };
    bonded_step(&mut group, "cpm, kinematics of YADE", &particles, law(), &yade);
    let parameters = CpmParameters { mode: CpmFormulation::YadePublic, ..*law().parameters() };
    let of_yade = Cpm::new(&parameters).expect("valid parameters");
    bonded_step(&mut group, "cpm, law and kinematics of YADE", &particles, of_yade, &yade);
    let beam = CohesiveBeam::new(25e9, 0.2, Section::Ratio(0.7)).expect("valid parameters");
    let breakable = CohesiveBeam { strength: 1e12, ..beam };
    bonded_step(&mut group, "cohesive_beam", &particles, breakable, &plain);
    let linear = LinearBond::new(1e7, 5e6, 0.0, f64::INFINITY, f64::INFINITY).expect("valid stiffness");
    bonded_step(&mut group, "linear_bond", &particles, linear, &plain);
    let deformable = Deformable {
        elasticity: vec![Elastic { young: 1e12, poisson: 0.3 }],
        condition: Condition::Solid,
        update: Update::Lagged,
        dashpots: false,
    };
    let deformable = Model { deformable: Some(deformable), ..Model::default() };
    bonded_step(&mut group, "linear_bond, deformable particles", &particles, linear, &deformable);
    group.finish();
}

criterion_group!(parts, single_contact, neighbor_search);
criterion_group! {
    name = steps;
    config = Criterion::default().with_measurement(ProcessorTime);
    targets = whole_step
}
criterion_main!(parts, steps);
