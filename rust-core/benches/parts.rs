//! Speed of the parts: the concrete law alone, its kinematics, the neighbour search, a whole step.

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use std::hint::black_box;

use concordem::assembly::bonding::bond;
use concordem::assembly::mass_of;
use concordem::kinematics::deformable::{Condition, Deformable, Update};
use concordem::kinematics::sphere_sphere::{ImageShift, Motion, fresh_frame, measure};
use concordem::kinematics::{Frame, Mode};
use concordem::law::{ContactGeometry, ContactLaw, Cpm, CpmParameters, CpmState, Elastic, LinearBond};
use concordem::math::{Quat, Vec3};
use concordem::neighbor::{candidate_pairs, spatial_order};
use concordem::solver::{MaterialRows, Model, Solver};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Particles, Sphere, State};

fn law() -> Cpm {
    Cpm::new(&CpmParameters::new(25e9, 0.2, 3e6, libm::atan(0.8), 1e-4, 30.0)).expect("valid parameters")
}

/// A jittered cubic block of `n³` spheres of radius 1 mm along the space-filling curve.
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
    let frame: Frame = fresh_frame(&a.position, &Vec3::new(2e-3, 0.0, 0.0), &Vec3::zeros());
    let none = ImageShift::default();
    c.bench_function("kinematics, finite", |bench| {
        bench.iter(|| measure(Mode::Finite, black_box(&a), black_box(&b), &none, &geometry, &frame, true, 1e-7));
    });
    let kinematics = measure(Mode::Finite, &a, &b, &none, &geometry, &frame, true, 1e-7);
    c.bench_function("law, cpm", |bench| {
        bench.iter(|| law.respond(black_box(&kinematics), black_box(&CpmState::default()), 1e-7));
    });
}

fn neighbour_search(c: &mut Criterion) {
    let mut group = c.benchmark_group("neighbour search");
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

fn whole_step(c: &mut Criterion) {
    let mut group = c.benchmark_group("step per bond");
    group.sample_size(10);
    for n in [22, 47] {
        let particles = block(n);
        let mut rows = MaterialRows::new(1);
        rows.set(0, 0, 0);
        let mut bonds = ContactBlock::new(vec![law()]);
        let count = bond(&mut bonds, &rows, &particles, None, 1.5).expect("finite positions");
        let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
        state.clock.dt = 2.4787e-7;
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(BenchmarkId::from_parameter(format!("{count} bonds")), |bench| {
            bench.iter_batched_ref(
                || {
                    let mut state = state.clone();
                    let solver = Solver::new(Model::default(), &mut state).expect("a sound state");
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
    group.finish();
}

/// A bonded step with and without the pass over deformable particles, which must not cost more than half as much again.
fn deformable_step(c: &mut Criterion) {
    let mut group = c.benchmark_group("bonded step, linear bond");
    group.sample_size(10);
    let particles = block(30);
    let mut rows = MaterialRows::new(1);
    rows.set(0, 0, 0);
    let linear = LinearBond::new(1e7, 5e6, 0.0, f64::INFINITY, f64::INFINITY).expect("valid stiffness");
    let mut bonds = ContactBlock::new(vec![linear]);
    let count = bond(&mut bonds, &rows, &particles, None, 1.5).expect("finite positions");
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    state.clock.dt = 2.4787e-7;
    let deformable = Deformable {
        elasticity: vec![Elastic { young: 1e12, poisson: 0.3 }],
        condition: Condition::Solid,
        update: Update::Lagged,
        dashpots: false,
    };
    for (name, deformable) in [("rigid", None), ("deformable", Some(deformable))] {
        group.throughput(Throughput::Elements(count as u64));
        group.bench_function(name, |bench| {
            bench.iter_batched_ref(
                || {
                    let mut state = state.clone();
                    let model = Model { deformable: deformable.clone(), ..Model::default() };
                    let solver = Solver::new(model, &mut state).expect("a sound state");
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
    group.finish();
}

criterion_group!(parts, single_contact, neighbour_search, whole_step, deformable_step);
criterion_main!(parts);
