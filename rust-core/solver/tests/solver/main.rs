//! The solver against closed forms, and against itself.

mod columns;
mod memoryless;

use concordem_contact::kinematics::{MotionMeasure, sphere_sphere};
use concordem_contact::law::{
    CohesiveBeam, ContactStiffness, Cpm, CpmParameters, Frictional, LinearBond, Reference, Section,
};
use concordem_contact::math::{Mat3, Symmetric, Vec3, quaternion_of_rotation_vector};
use concordem_packing::random::Random;
use concordem_solver::forces::LawLoops;
use concordem_solver::integrate::{Damping, KickContext, NetForces};
use concordem_solver::neighbor::candidate_pairs;
use concordem_solver::state::State;
use concordem_solver::state::columns::ColumnStore;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::{Cell, Constraint, Load, Particles, Sphere};
use concordem_solver::*;

/// A cubic block of `n³` touching unit spheres of mass 1 with bonds to all neighbors within 1.5 diameters.
fn block(n: usize, bond: LinearBond) -> State {
    block_of(n, vec![bond], false)
}

/// [`block`] for any law, with several pair coefficients in turn; optionally as a periodic cell.
fn block_of<L: LawLoops>(n: usize, rows: Vec<L>, periodic: bool) -> State {
    let mut particles = Particles::default();
    for k in 0..n * n * n {
        let position = Vec3::new((k % n) as f64, (k / n % n) as f64, (k / (n * n)) as f64) * 2.0;
        particles.push(Sphere { position, radius: 1.0 }, 0, 1.0, 0.4);
    }
    let cell = periodic.then(|| Cell::new_box(Vec3::repeat(2.0 * n as f64)));
    let row_count = rows.len();
    let mut bonds = ContactBlock::new(rows);
    for pair in candidate_pairs(&particles.position, &vec![1.5; particles.len()], cell.as_ref()).unwrap() {
        let (a, b) = (pair.a as usize, pair.b as usize);
        let shift = cell.map_or(Vec3::zeros(), |cell| cell.shift(pair.image));
        let previous = sphere_sphere::initial_geometry(&particles.position[a], &particles.position[b], &shift);
        // Runs of the same pair coefficients, and contacts at which they change.
        let row = (bonds.len() / 100 % row_count) as u16;
        let flags =
            ContactFlags { row, bits: ContactFlags::BONDED | ContactFlags::ACTIVE, image: pair.image, padding: 0 };
        bonds.push(Pair { a: pair.a, b: pair.b }, flags, Reference { length: previous.length, area: 1.0 }, previous);
    }
    State { particles, bonds: vec![Box::new(bonds)], cell, ..State::default() }
}

/// Worst relative residual of the ledger, and the drifts of momentum and angular momentum, of a free undamped block
/// that starts with velocities and angular velocities of the given size and runs for `time`.
fn free_run(amplitude: f64, share: f64, time: f64) -> (f64, f64, f64) {
    let mut state = block(5, LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap());
    let n = state.particles.len();
    for p in 0..n {
        let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
        state.particles.velocity[p] = Vec3::new(u(1), u(2), u(3)) * amplitude;
        state.particles.angular_velocity[p] = Vec3::new(u(4), u(5), u(6)) * amplitude;
    }
    state.clock.dt = share * time_step::bounds(&state).spectral;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    let momentum = |s: &State| s.particles.velocity.iter().sum::<Vec3>();
    let spin = |s: &State| {
        // Positions at the half step, when the velocities are known.
        let p = &s.particles;
        (0..n)
            .map(|i| {
                let x = p.position[i] - p.velocity[i] * (0.5 * s.clock.dt);
                x.cross(&p.velocity[i]) + p.angular_velocity[i] * 0.4
            })
            .sum::<Vec3>()
    };
    let (p0, l0) = (momentum(&state), spin(&state));
    let mut worst: f64 = 0.0;
    while state.clock.time() < time {
        solver.step(&mut state).unwrap();
        worst = worst.max((state.ledger.residual() / state.ledger.initial).abs());
    }
    (worst, (momentum(&state) - p0).norm() / amplitude, (spin(&state) - l0).norm() / amplitude)
}

/// An undamped block conserves momentum and angular momentum to rounding (125 particles at distances up to 14, so some
/// 1e3 roundings of numbers up to 14). Its energy ledger closes up to the geometric error of the trapezoidal rule,
/// which is proportional to the strain and to the square of the step: measured 1.5e-6 at strain 1e-2 and a tenth of the
/// largest stable step, 2.6e-10 at 1e-5 and a twentieth (where rounding begins to show).
#[test]
fn free_block_conserves() {
    let (small, _, _) = free_run(1e-5, 0.05, 100.0);
    assert!(small < 1e-9, "{small:e}");
    let (coarse, p, l) = free_run(1e-3, 0.1, 100.0);
    let (fine, _, _) = free_run(1e-3, 0.05, 100.0);
    println!("small {small:.2e}, coarse {coarse:.2e}, fine {fine:.2e}, momentum {p:.1e}, angular momentum {l:.1e}");
    assert!(coarse > 3.5 * fine, "{coarse:e} {fine:e}");
    assert!(p < 1e-12 && l < 1e-12, "{p:e} {l:e}");
}

/// Pulling a block apart with damping: the ledger closes, also through brittle failure, and one, two, three, and eight
/// threads give the same bits.
#[test]
fn pulled_block_closes_its_ledger_on_any_threads() {
    let run = |threads: usize| {
        rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
            let mut state = block(12, LinearBond::new(1.0, 0.4, 0.0, 5e-5, 5e-5).unwrap());
            for p in 0..state.particles.len() {
                let z = state.particles.position[p].z;
                state.particles.velocity[p] = Vec3::new(0.0, 0.0, 2e-5 * (z / 11.0 - 1.0));
                if !(1.0..=21.0).contains(&z) {
                    state.particles.constraint[p] = Constraint::translation_along(2);
                }
            }
            state.clock.dt = 0.1 * time_step::bounds(&state).spectral;
            let model = Model { damping: Damping::Local { translation: 0.3, rotation: 0.3 }, ..Model::default() };
            let mut solver = Solver::new(model, &mut state).unwrap();
            let before = state.bond_count();
            for _ in 0..1500 {
                solver.step(&mut state).unwrap();
            }
            assert!(state.bond_count() < before, "nothing broke");
            println!(
                "{} of {before} left, residual {:.2e} of {:.2e}",
                state.bond_count(),
                state.ledger.residual(),
                state.ledger.boundary_work.get()
            );
            // A particle moves 8e-7 per step at coordinates up to 22, whose rounding is 1.8e-15: 2e-9 of each step's
            // work is rounding.
            assert!(state.ledger.residual().abs() < 1e-8 * state.ledger.boundary_work.get());
            ColumnStore::of(&state).unwrap()
        })
    };
    let one = run(1);
    for threads in [2, 3, 8] {
        assert!(one == run(threads), "{threads} threads");
    }
}

/// A host that moves the particles by the same rule gets the same bits as the solver's own steps: positions,
/// velocities, and histories (some bonds break on the way, so unbonded contacts take part).
#[test]
fn a_host_that_moves_the_particles_gets_the_same_bits() {
    let start = || {
        let mut state = block(4, LinearBond::new(1.0, 0.4, 0.0, 0.005, 0.005).unwrap());
        for p in 0..state.particles.len() {
            let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
            state.particles.velocity[p] = Vec3::new(u(1), u(2), u(3)) * 0.02;
            state.particles.angular_velocity[p] = Vec3::new(u(4), u(5), u(6)) * 0.02;
        }
        let contact = LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
        state.contacts = Some(Box::new(ContactBlock::new(vec![contact])));
        state.clock.dt = 0.2;
        let mut contact_rows = PairCoefficients::new(1);
        contact_rows.set(0, 0, 0);
        let model = Model { contact_rows, ..Model::default() };
        let solver = Solver::new(model, &mut state).unwrap();
        (state, solver)
    };
    let (mut own, mut solver) = start();
    let (mut hosted, mut force) = start();
    let mut broken = 0;
    for _ in 0..200 {
        let report = solver.step_with(&mut own, false).unwrap();
        broken += report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke).count();
        let hosts = force.find_forces(&mut hosted, false).unwrap();
        hosted.clock.step += 1;
        assert_eq!(hosts.bond_events, report.bond_events);
        let kick = KickContext {
            dt: hosted.clock.dt,
            fraction: 1.0,
            gravity: Vec3::zeros(),
            damping: Damping::None,
            cell: None,
            gradient_change: None,
            convective: false,
            targets: None,
        };
        let net = NetForces { force: force.forces(), torque: force.torques() };
        integrate::kick_and_drift(&kick, &mut hosted.particles, net);
    }
    assert!(broken > 10, "only {broken} bonds broke: too few for this test");
    assert!(own.particles == hosted.particles);
    assert_eq!(own.clock.step, hosted.clock.step);
    let width: usize = own.bonds[0].history_fields().iter().map(|field| field.components).sum();
    assert!((0..width).all(|n| own.bonds[0].history_column(n) == hosted.bonds[0].history_column(n)));
}

/// Two solvers, one of which searches anew in every step, take the same steps.
fn compare<B: LawLoops, C: LawLoops>(bond: B, contact: C, periodic: bool, size: f64) {
    let mut contact_rows = PairCoefficients::new(1);
    contact_rows.set(0, 0, 0);
    let model = Model { contact_rows, ..Model::default() };
    let start = || {
        let mut state = block_of(11, vec![bond], periodic);
        for p in 0..state.particles.len() {
            let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
            state.particles.velocity[p] = Vec3::new(u(1), u(2), u(3)) * size;
        }
        state.contacts = Some(Box::new(ContactBlock::new(vec![contact])));
        state.clock.dt = 0.02;
        state
    };
    let (mut kept, mut anew) = (start(), start());
    let mut solver = Solver::new(model.clone(), &mut kept).unwrap();
    let (mut breaking, mut broken) = (0, 0);
    for _ in 0..150 {
        let report = solver.step_with(&mut kept, false).unwrap();
        let here = report.bond_events.iter().filter(|(_, event)| event.broke).count();
        (breaking, broken) = (breaking + u64::from(here > 0), broken + here);
        Solver::new(model.clone(), &mut anew).unwrap().step_with(&mut anew, false).unwrap();
    }
    assert!(ColumnStore::of(&kept).unwrap() == ColumnStore::of(&anew).unwrap(), "{}, periodic {periodic}", B::NAME);
    let searches = solver.neighbor_rebuilds();
    println!("{}: {broken} bonds broke in {breaking} steps, {searches} searches", B::NAME);
    assert!(breaking > 10 && searches < breaking, "{searches} searches, bonds broke in {breaking} steps");
}

/// A bond that breaks adds its pair to the neighbor list without a search, with the bits of a solver that searches anew in every step:
/// pairs continue as contacts with and without a kept reference, also across a periodic border.
#[test]
fn a_broken_bond_needs_no_search() {
    let bond = LinearBond::new(1.0, 0.4, 0.1, 0.02, 0.02).unwrap();
    let friction = Frictional::new(ContactStiffness::Given { normal: 1.0, shear: 0.4 }, 0.5, 0.1).unwrap();
    let concrete = CpmParameters { omega_threshold: 0.9, ..CpmParameters::new(2.0, 0.4, 0.03, 0.6, 0.002, 1.5) };
    let concrete = Cpm::new(&concrete).unwrap();
    for periodic in [false, true] {
        compare(bond, friction, periodic, 0.05);
        compare(concrete, concrete, periodic, 0.1);
    }
}

/// Free particles are moved in batches; a load anywhere, here a zero load, selects the scalar path. Both give the same
/// bits, with large rotations, rest, prescribed components, and a number of particles that is not a multiple of the
/// batch.
#[test]
fn batched_particles_move_as_on_the_scalar_path() {
    let (mut block, n) = (Particles::default(), 203);
    let mut random = Random::new(7);
    let mut vector = |size: f64| Vec3::from_fn(|_, _| size * (2.0 * random.uniform() - 1.0));
    let (mut force, mut torque) = (Vec::new(), Vec::new());
    for p in 0..n {
        block.push(Sphere { position: vector(1.0), radius: 0.5 }, 0, 1.0 + vector(0.5).x, 0.1 + vector(0.05).x);
        let still = if p % 7 == 0 { 0.0 } else { 1.0 };
        block.velocity[p] = vector(still);
        block.angular_velocity[p] = vector(if p % 11 == 0 { 30.0 } else { 0.5 * still });
        block.orientation[p] = quaternion_of_rotation_vector(&vector(3.0));
        force.push(vector(if p % 13 == 0 { 0.0 } else { 5.0 }));
        torque.push(vector(if p % 14 == 0 { 0.0 } else { 1.0 }));
    }
    block.constraint[70] = Constraint(0b10_0001);
    block.constraint[96..130].fill(Constraint::ROTATION);
    let mut scalar = block.clone();
    scalar.loads.push(Load { particle: 3, force: Vec3::zeros(), moment: Vec3::zeros(), virial: Symmetric::default() });
    let mut sheared = Cell::new_box(Vec3::repeat(4.0));
    sheared.velocity_gradient = Mat3::new(0.1, 0.5, 0.0, -0.2, 0.0, 0.3, 0.0, 0.0, -0.1);
    let damped = Damping::Local { translation: 0.3, rotation: 0.2 };
    for (damping, cell, convective) in [
        (Damping::None, None, false),
        (damped, None, false),
        // YADE's kinematics: without a cell, nothing is carried along.
        (damped, None, true),
        (Damping::None, Some(&sheared), false),
        (damped, Some(&sheared), false),
    ] {
        let kick = KickContext {
            dt: 0.01,
            fraction: 0.5,
            gravity: Vec3::new(0.0, 0.0, -9.81),
            damping,
            cell,
            gradient_change: None,
            convective,
            targets: None,
        };
        let net = NetForces { force: &force, torque: &torque };
        let sums = integrate::kick_and_drift(&kick, &mut block, net);
        let others = integrate::kick_and_drift(&kick, &mut scalar, net);
        assert_eq!(sums, others);
        let loads = std::mem::take(&mut scalar.loads);
        let bits = |p: &Particles| format!("{p:?}");
        assert!(bits(&block) == bits(&scalar), "{damping:?}, {cell:?}");
        scalar.loads = loads;
    }
}

/// A block that flies apart, computed as a whole and in two subdomains that each contain the contacts of half of the
/// particles: net forces have the same bits, and the energies counted in the subdomains add up to those of the whole
/// (rounding of sums of some thousand terms). Bonds break and their pairs continue as unbonded contacts in both
/// subdomains alike.
#[test]
fn subdomains_find_the_forces_of_the_whole() {
    let bond = LinearBond::new(1.0, 0.4, 0.1, 1e-3, 1e-3).unwrap();
    let friction =
        Frictional::new(ContactStiffness::Given { normal: 1.0, shear: 0.4 }, 0.5, 0.1).expect("valid parameters");
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let model = Model { contact_rows: rows, ..Model::default() };
    let dt = 0.1;
    let subdomain = |owned: Vec<bool>| {
        let mut state = block(6, bond);
        let bonds = state.bonds[0].contacts();
        let mut kept = ContactBlock::new(vec![bond]);
        for k in 0..bonds.len() {
            let mut view = bonds.view(k);
            let (a, b) = (owned[view.pair.a as usize], owned[view.pair.b as usize]);
            if !a {
                view.flags.bits |= ContactFlags::NOT_OWNED;
            }
            if a || b {
                kept.push(view.pair, view.flags, view.reference, view.previous);
            }
        }
        state.bonds = vec![Box::new(kept)];
        state.contacts = Some(Box::new(ContactBlock::new(vec![friction])));
        state.clock.dt = dt;
        let solver = Solver::for_subdomain(model.clone(), &mut state, owned, Excluded::default()).unwrap();
        (state, solver)
    };
    let n = 216;
    let left: Vec<bool> = (0..n).map(|p| p * 7919 % 10 < 4).collect();
    let mut parts = [subdomain(vec![true; n]), subdomain(left.clone()), subdomain(left.iter().map(|l| !l).collect())];
    let (mut velocity, mut spin) = (vec![Vec3::zeros(); n], vec![Vec3::zeros(); n]);
    for p in 0..n {
        let u = |m: usize| ((p * 7919 + m * 104_729) % 1000) as f64 / 500.0 - 1.0;
        velocity[p] = Vec3::new(u(1), u(2), u(3)) * 4e-3;
        spin[p] = Vec3::new(u(4), u(5), u(6)) * 4e-3;
    }
    let mut broken = 0;
    for _ in 0..400 {
        let mut sums = Vec::new();
        for (state, solver) in &mut parts {
            let particles = &mut state.particles;
            for p in 0..n {
                particles.velocity[p] = velocity[p];
                particles.angular_velocity[p] = spin[p];
                particles.position[p] += velocity[p] * dt;
                particles.rotation_increment[p] = quaternion_of_rotation_vector(&(spin[p] * dt));
            }
            sums.push(solver.find_forces(state, true).unwrap());
        }
        broken += sums[0].bond_events.len();
        let total = |sum: &StepReport| sum.energy.stored() + sum.energy.dissipated();
        let (whole, shared) = (total(&sums[0]), total(&sums[1]) + total(&sums[2]));
        assert!((whole - shared).abs() <= 1e-13 * whole, "{whole:e} {shared:e}");
        assert_eq!(sums[0].active[0], sums[1].active[0] + sums[2].active[0]);
        assert_eq!(sums[0].active[1], sums[1].active[1] + sums[2].active[1]);
        for p in 0..n {
            let of_subdomain = &parts[if left[p] { 1 } else { 2 }].1;
            let whole = &parts[0].1;
            assert_eq!(whole.forces()[p], of_subdomain.forces()[p]);
            assert_eq!(whole.torques()[p], of_subdomain.torques()[p]);
            velocity[p] += whole.forces()[p] * dt;
            spin[p] += whole.torques()[p] * (dt / 0.4);
        }
    }
    let contacts = parts[0].0.contacts.as_ref().unwrap().contacts();
    let touching = (0..contacts.len()).filter(|&k| contacts.view(k).flags.has(ContactFlags::ACTIVE)).count();
    assert!(broken > 100 && touching > 10, "{broken} {touching}");
}

/// YADE 2023.02a: a sphere without contacts in a cell that stretches at 0.5/s along z, Δt = 1 ms, started at rest at z
/// = 0.5 m. Velocities and positions after each of the first four steps equal YADE's output, up to rounding of a
/// handful of operations on numbers below 1.
#[test]
fn yade_modes_move_particles_with_the_cell_like_yade() {
    let mut particles = Particles::default();
    particles.push(Sphere { position: Vec3::new(0.2, 0.3, 0.5), radius: 0.05 }, 0, 1.0, 1.0);
    let cell = Cell::new_box(Vec3::repeat(1.0));
    let mut state = State { particles, cell: Some(cell), ..State::default() };
    state.clock.dt = 1e-3;
    let model = Model { mode: MotionMeasure::YadeRatcheting, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    solver.set_velocity_gradient(&cell, Mat3::from_diagonal(&Vec3::new(0.0, 0.0, 0.5)));
    let yade = [
        (0.25, 0.50025),
        (0.250125, 0.500500125),
        (0.2502500625, 0.5007503750625),
        (0.25037518753125, 0.5010007502500312),
    ];
    for (velocity, place) in yade {
        solver.step(&mut state).unwrap();
        assert!((state.particles.velocity[0].z - velocity).abs() < 1e-15, "{:?}", state.particles.velocity);
        assert!((state.particles.position[0].z - place).abs() < 1e-15, "{:?}", state.particles.position);
    }
}

/// Beams and linear bonds in one model, each between their own particles, give the bits of separate models. Beams read
/// orientations; the others read rotations of the step.
#[test]
fn beams_and_other_bonds_share_a_model() {
    let linear = LinearBond::new(1.0, 0.4, 0.1, f64::INFINITY, f64::INFINITY).unwrap();
    let beam = CohesiveBeam::new(1.0, 0.2, Section::Ratio(0.5)).unwrap();
    let n = 64;
    let moving = |state: &mut State, away: Vec3| {
        let mut random = Random::new(3);
        let mut vector = |size: f64| Vec3::from_fn(|_, _| (random.uniform() - 0.5) * size);
        for p in 0..n {
            state.particles.position[p] += away;
            state.particles.velocity[p] = vector(0.1);
            state.particles.angular_velocity[p] = vector(0.1);
        }
        state.clock.dt = 0.1;
    };
    let run = |mut state: State| {
        let mut solver = Solver::new(Model::default(), &mut state).unwrap();
        for _ in 0..60 {
            solver.step_with(&mut state, false).unwrap();
        }
        state.particles
    };
    let (mut springs, mut beams) = (block_of(4, vec![linear], false), block_of(4, vec![beam], false));
    moving(&mut springs, Vec3::zeros());
    moving(&mut beams, Vec3::new(100.0, 0.0, 0.0));
    let mut both = springs.clone();
    for p in 0..n {
        let Particles { position, velocity, angular_velocity, .. } = &beams.particles;
        both.particles.push(Sphere { position: position[p], radius: 1.0 }, 0, 1.0, 0.4);
        both.particles.velocity[n + p] = velocity[p];
        both.particles.angular_velocity[n + p] = angular_velocity[p];
    }
    let mut bonds = ContactBlock::new(vec![beam]);
    for k in 0..beams.bonds[0].len() {
        let view = beams.bonds[0].view(k);
        let pair = Pair { a: view.pair.a + n as u32, b: view.pair.b + n as u32 };
        bonds.push(pair, view.flags, view.reference, view.previous);
    }
    both.bonds.push(Box::new(bonds));
    let (both, springs, beams) = (run(both), run(springs), run(beams));
    assert_ne!(springs.orientation[0], beams.orientation[0]);
    for (alone, first) in [(springs, 0), (beams, n)] {
        assert_eq!(both.position[first..first + n], alone.position[..]);
        assert_eq!(both.orientation[first..first + n], alone.orientation[..]);
        assert_eq!(both.angular_velocity[first..first + n], alone.angular_velocity[..]);
    }
}
