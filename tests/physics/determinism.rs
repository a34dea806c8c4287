//! A run gives the same bits on any number of threads, when repeated, and from any checkpoint.

use std::path::Path;

use concordem::law::hertz_mindlin::Elastic;
use concordem::law::{CpmParameters, HertzMindlin};
use concordem::math::Vec3;
use concordem::output::hash::state_hash;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, PairCoefficients};
use concordem::state::columns::ColumnStore;
use concordem::state::contacts::{ContactBlock, ContactFlags};
use concordem::state::surface::{Facets, Plane};
use concordem::state::{Clock, Clump, Mesh, Particles, Sphere, State, Wall, WallShape};
use concordem_tests::{
    DENSITY, TIME_STEP, bonded, concrete, law, noise, noise_vector, on_threads, one_material, particles, pull,
    random_packing, runs, solver,
};

const STEPS: u64 = 300;

const REFERENCE: &str = "87a5a0940e10e2f2babcdd14303f81b7c75bebcb4f8e1f872ed76dc48377445a";

/// Digest of the motion alone, [`motion`]: a change of what the ledger books leaves it as it is.
const REFERENCE_MOTION: u64 = 0x1f5b_c230_d666_ba3c;

/// A specimen pulled apart fast: damage, broken bonds, unbonded contacts.
fn specimen(copies: usize, height: f64) -> (State, Model) {
    let parameters = CpmParameters { omega_threshold: 0.9, ..concrete() };
    let mut state = bonded(particles(&random_packing(copies, height), DENSITY), None, law(&parameters), 1.5);
    state.contacts = Some(Box::new(ContactBlock::new(vec![law(&parameters)])));
    state.clock.dt = TIME_STEP;
    pull(&mut state, 20.0);
    // Random velocities close gaps, so that contacts form.
    for p in 0..state.particles.len() {
        state.particles.velocity[p] += noise_vector(p, 1) * 0.3;
    }
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    (state, Model { damping, contact_rows: one_material(), ..Model::default() })
}

fn active(state: &State) -> usize {
    let block = state.contacts.as_ref().unwrap().contacts();
    (0..block.len()).filter(|&k| block.view(k).flags.has(ContactFlags::ACTIVE)).count()
}

/// Digest of positions, velocities, and angular velocities.
fn motion(state: &State) -> u64 {
    let particles = &state.particles;
    let all = particles.position.iter().chain(&particles.velocity).chain(&particles.angular_velocity);
    all.flat_map(|v| v.iter().map(|c| c.to_bits()).collect::<Vec<_>>())
        .fold(0, |digest: u64, bits| digest.wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(7) ^ bits)
}

/// Hash and [`motion`] of the final state; at each step in `restarts` the state is written, read, and passed to a new solver.
fn run(copies: usize, height: f64, restarts: &[u64]) -> (String, u64) {
    let (mut state, model) = specimen(copies, height);
    let bonds = state.bond_count();
    let mut solver_now = solver(model.clone(), &mut state);
    while state.clock.step < STEPS {
        // Record only some steps, because recording must not change the state.
        let sample = state.clock.step % 7 == 0 || state.clock.step + 1 == STEPS;
        solver_now.step_with(&mut state, sample).unwrap();
        if restarts.contains(&state.clock.step) {
            let mut columns = ColumnStore::of(&state).unwrap();
            let (mut again, _) = specimen(copies, height);
            again.read(&mut columns).unwrap();
            assert_eq!(state_hash(&again).unwrap(), state_hash(&state).unwrap(), "step {}", state.clock.step);
            state = again;
            solver_now = solver(model.clone(), &mut state);
        }
    }
    println!(
        "{} particles, {} of {bonds} bonds left, {} unbonded contacts, {} searches",
        state.particles.len(),
        state.bond_count(),
        active(&state),
        solver_now.neighbor_rebuilds()
    );
    assert!(state.bond_count() < bonds && active(&state) > 0, "the test must reach failure and unbonded contacts");
    (state_hash(&state).unwrap(), motion(&state))
}

#[test]
fn threads_and_restarts_do_not_change_any_bit() {
    let reference = on_threads(1, || run(3, 1.0, &[]));
    for threads in [1, 2, 3, 8] {
        assert_eq!(reference, on_threads(threads, || run(3, 1.0, &[])), "{threads} threads");
    }
    assert_eq!(reference, on_threads(2, || run(3, 1.0, &[1, 37, 120, 121, 211])), "restarts");
}

/// The hash of a small run is fixed, so that no change of the numbers goes unnoticed. All arithmetic is IEEE 754, and
/// elementary functions come from our libraries, so the hash is the same on every machine. A change of the hash must be
/// deliberate and explained in the change log.
#[test]
fn the_reference_run_keeps_its_hash() {
    let (hash, motion) = on_threads(2, || run(1, 16e-3, &[]));
    assert_eq!(motion, REFERENCE_MOTION, "{motion:x}");
    assert_eq!(hash, REFERENCE);
}

/// Bouncing elastic spheres with dashpots and friction, two of them joined in a clump, on a floor and beside a wall of two
/// triangles: contacts form and open all the time.
fn bouncing() -> (State, Model) {
    let mut particles = Particles::default();
    for p in 0..60_usize {
        let place = Vec3::new((p % 4) as f64, (p / 4 % 4) as f64, (p / 16) as f64) * 0.9;
        let radius = 0.4 + 0.08 * noise(p, 7);
        let mass = radius * radius * radius;
        let position = place + noise_vector(p, 1) * 0.02 + Vec3::new(0.6, 0.6, 0.6);
        particles.push(Sphere { position, radius }, 0, mass, 0.4 * mass * radius * radius);
        particles.velocity[p] = noise_vector(p, 2) * 2.0;
        particles.angular_velocity[p] = noise_vector(p, 3);
    }
    let mut clump = Clump::new(vec![20, 21], &particles, None, None);
    clump.angular_momentum = Vec3::new(0.1, -0.2, 0.1);
    particles.clump[20] = 0;
    particles.clump[21] = 0;
    let elastic = Elastic { young: 1e5, poisson: 0.2 };
    let contact = HertzMindlin::new(elastic, elastic, 0.4, 0.6).unwrap();
    let wall = |name: &str, shape: WallShape| Wall::new(name, shape, 1, Vec3::zeros());
    let corner = |y: f64, z: f64| Vec3::new(0.0, y, z);
    let triangles = vec![
        [corner(-5.0, -1.0), corner(9.0, -1.0), corner(9.0, 9.0)],
        [corner(-5.0, -1.0), corner(9.0, 9.0), corner(-5.0, 9.0)],
    ];
    // A lid that sinks, tilts, and stretches: its vertices move on their own.
    let lid = [(-1.0, -1.0), (5.0, -1.0), (5.0, 5.0), (-1.0, 5.0), (2.0, 2.1)];
    let lid = lid.map(|(x, y)| Vec3::new(x, y, 4.6)).to_vec();
    let mut lid = Mesh::new(lid, vec![[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4]]).unwrap();
    for (k, velocity) in lid.velocity.iter_mut().enumerate() {
        *velocity = noise_vector(k, 4) * 0.3 - Vec3::z() * 1.2;
    }
    lid.previous_velocity.clone_from(&lid.velocity);
    let state = State {
        particles,
        clumps: vec![clump],
        contacts: Some(Box::new(ContactBlock::new(vec![contact]))),
        walls: vec![
            wall("floor", WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() })),
            wall("side", WallShape::rigid(Facets { triangles })),
            wall("lid", WallShape::Mesh(lid)),
        ],
        wall_contacts: Some(Box::new(ContactBlock::new(vec![contact]))),
        clock: Clock { step: 0, dt: 5e-4 },
        ..State::default()
    };
    let (mut contact_rows, mut wall_rows) = (PairCoefficients::new(2), PairCoefficients::new(2));
    contact_rows.set(0, 0, 0);
    wall_rows.set(0, 1, 0);
    let model = Model { contact_rows, wall_rows, gravity: Vec3::new(-3.0, 0.0, -9.81), ..Model::default() };
    (state, model)
}

/// A checkpoint contains the complete history of contacts: a run that is restarted every few steps ends with the same bits,
/// although contacts form, open, and pass from triangle to triangle.
#[test]
fn bouncing_spheres_restart_bit_for_bit_from_any_step() {
    let run = |interval: u64| {
        let (mut state, model) = bouncing();
        let mut solver_now = solver(model.clone(), &mut state);
        let (mut began, mut before) = (0, [0; 3]);
        while state.clock.step < 2000 {
            let report = solver_now.step_with(&mut state, true).unwrap();
            began += u64::from(report.active[1] > before[1]) + u64::from(report.active[2] > before[2]);
            before = report.active;
            if state.clock.step % interval == 0 {
                let mut columns = ColumnStore::of(&state).unwrap();
                let (mut again, _) = bouncing();
                again.read(&mut columns).unwrap();
                state = again;
                solver_now = solver(model.clone(), &mut state);
            }
        }
        let lid = state.walls[2].mesh().expect("the lid");
        // It pushes in some of the last steps, and has done work.
        assert!(
            state.ledger.boundary_work.get().abs() > 1e-3 && lid.position[4].z < 4.0,
            "the lid must push in this test"
        );
        let residual = state.ledger.residual() / state.ledger.initial;
        println!(
            "{began} steps with new contacts, {} searches, residual {residual:.1e}",
            solver_now.neighbor_rebuilds()
        );
        assert!(began > 50, "contacts must form in this test");
        (state_hash(&state).unwrap(), state)
    };
    on_threads(1, || {
        let (reference, plain) = run(u64::MAX);
        for interval in [1, 7, 100] {
            let (hash, state) = run(interval);
            assert_eq!(plain.particles.position, state.particles.position, "positions, every {interval} steps");
            assert_eq!(reference, hash, "restarts every {interval} steps");
        }
    });
}

/// Concrete with aggregates and fibers: their places, and a run in which bonds of both blocks are loaded.
#[test]
fn fibers_do_not_depend_on_threads() {
    let folder = Path::new("scenarios/good");
    let text = std::fs::read_to_string(folder.join("fibers.toml")).expect("the scenario");
    let digest = |threads| {
        on_threads(threads, || {
            let mut simulation = runs::started(runs::sound(runs::built(&text, folder)));
            runs::finish(&mut simulation);
            let blocks = &simulation.state.bonds;
            assert!(blocks.len() == 2 && blocks[0].len() > 5000 && blocks[1].len() > 100);
            state_hash(&simulation.state)
        })
    };
    let one = digest(1);
    assert_eq!(digest(2), one);
    assert_eq!(digest(3), one);
}

/// Concrete with aggregates of all shapes: the packing, the places, the phases, and the run.
#[test]
fn aggregates_do_not_depend_on_threads() {
    let folder = Path::new("scenarios/good");
    let text = std::fs::read_to_string(folder.join("aggregates.toml")).expect("the scenario");
    let digest = |threads| {
        on_threads(threads, || {
            let mut simulation = runs::started(runs::sound(runs::built(&text, folder)));
            runs::finish(&mut simulation);
            let particles = &simulation.state.particles;
            assert!(particles.len() > 2048 && particles.aggregate.iter().filter(|number| **number > 0).count() > 100);
            state_hash(&simulation.state)
        })
    };
    let one = digest(1);
    assert_eq!(digest(2), one);
    assert_eq!(digest(3), one);
}
