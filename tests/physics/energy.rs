//! Energy is conserved in conservative systems, and otherwise the ledger accounts for all of it.

use concordem::kinematics::MotionMeasure;
use concordem::law::LinearBond;
use concordem::law::cpm::CpmParameters;
use concordem::math::{Mat3, Vec3};
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, time_step};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Cell, Constraint, Particles, Sphere, State};
use concordem_tests::{
    DENSITY, TIME_STEP, bonded, concrete, law, on_threads, one_material, particles, pull, random_packing, solver,
};

const COUNT: usize = 16;

/// A free bar of touching unit spheres of mass 1 along x.
fn bar() -> State {
    let mut particles = Particles::default();
    for p in 0..COUNT {
        particles.push(Sphere { position: Vec3::new(2.0 * p as f64, 0.0, 0.0), radius: 1.0 }, 0, 1.0, 0.4);
    }
    bonded(particles, None, LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap(), 1.01)
}

/// Frequency of the first longitudinal mode of the free bar, `2√(k/m) sin(π/2n)`.
fn frequency() -> f64 {
    2.0 * (std::f64::consts::FRAC_PI_2 / COUNT as f64).sin()
}

/// Range of the total energy `½m|½(v⁻+v⁺)|² + stored` relative to its mean, and relative change between the means over the
/// first and the last tenth of the run, for `steps` steps of the size `dt` in the first longitudinal mode.
fn first_mode(dt: f64, steps: usize) -> (f64, f64) {
    let mut state = bar();
    state.clock.dt = dt;
    for p in 0..COUNT {
        let phase = std::f64::consts::PI * (p as f64 + 0.5) / COUNT as f64;
        state.particles.velocity[p].x = 1e-4 * frequency() * phase.cos();
    }
    let mut solver = solver(Model::default(), &mut state);
    let mut energies = Vec::with_capacity(steps);
    for _ in 0..steps {
        let before = state.particles.velocity.clone();
        solver.step(&mut state).unwrap();
        let kinetic: f64 =
            before.iter().zip(&state.particles.velocity).map(|(a, b)| 0.125 * (a + b).norm_squared()).sum();
        energies.push(kinetic + state.ledger.stored_total());
    }
    // A smooth window, so that the oscillation does not affect the mean.
    let mean = |part: &[f64]| {
        let weight = |k: usize| 1.0 - (std::f64::consts::TAU * (k as f64 + 0.5) / part.len() as f64).cos();
        part.iter().enumerate().map(|(k, e)| weight(k) * e).sum::<f64>() / part.len() as f64
    };
    let all = mean(&energies);
    let range = energies.iter().fold(0.0_f64, |w, e| w.max((e - all).abs()));
    let tenth = steps / 10;
    (range / all, (mean(&energies[steps - tenth..]) - mean(&energies[..tenth])) / all)
}

/// Leapfrog conserves `½m v⁻·v⁺ + stored` of a linear system exactly. The total energy with the mean velocity differs
/// from it by `⅛ Δt² F²/m`, so it oscillates by up to `¼(ωΔt)²` = 2.5e-7 at ωΔt = 1e-3, and by a quarter of that at
/// half the step (within 10 %: rounding of lengths of 2 against elongations of 1e-5 adds noise of 1e-10). The required
/// bound is 1e-6.
#[test]
fn a_vibrating_bar_keeps_its_energy() {
    on_threads(1, || {
        let (range, drift) = first_mode(1e-3 / frequency(), 100_000);
        println!("ωΔt = 1e-3, 1e5 steps: energy within {range:.3e}, drift {drift:.1e}");
        assert!(range < 1e-6, "{range:e}");
        let (coarse, _) = first_mode(4e-2 / frequency(), 2_000);
        let (fine, _) = first_mode(2e-2 / frequency(), 4_000);
        println!("ωΔt = 4e-2: {coarse:.4e}, 2e-2: {fine:.4e}, ratio {:.3}", coarse / fine);
        assert!((coarse / fine - 4.0).abs() < 0.4, "{coarse:e} {fine:e}");
    });
}

/// At 0.8 of the largest stable step the energy does not drift either: rounding errors of 1e-16 in lengths up to 30, against
/// elongations of 1e-5, accumulate over 1e5 steps to a random walk of about 1e-11·√1e5 = 3e-9; the tolerance is 1e-8.
#[test]
fn energy_does_not_drift_near_the_stability_limit() {
    on_threads(1, || {
        let dt = 0.8 * time_step::bounds(&bar()).spectral;
        let (range, drift) = first_mode(dt, 100_000);
        println!("0.8 of the bound: energy within {range:.3e}, drift {drift:.1e}");
        assert!(drift.abs() < 1e-8, "{drift:e}");
    });
}

/// A rotating and vibrating bar keeps its angular momentum (including the rotation of particles): rounding errors of
/// 1e-16 in each of 1e5 steps give a random walk of 3e-14; the tolerance of 1e-12 allows for the sum over particles.
#[test]
fn a_rotating_bar_keeps_its_angular_momentum() {
    on_threads(1, || {
        let mut state = bar();
        state.clock.dt = 0.1 * time_step::bounds(&state).spectral;
        let spin = Vec3::new(0.3e-3, 1e-3, 2e-3);
        let centre = Vec3::new(COUNT as f64 - 1.0, 0.0, 0.0);
        for p in 0..COUNT {
            let arm = state.particles.position[p] - centre;
            state.particles.velocity[p] = spin.cross(&arm) + Vec3::new(1e-4 * arm.x, 0.0, 0.0);
            state.particles.angular_velocity[p] = spin;
        }
        let dt = state.clock.dt;
        let momentum = |s: &State| {
            let p = &s.particles;
            (0..COUNT)
                .map(|i| {
                    // Positions at the time of the velocities; the displacement is along the velocity, so its error has
                    // no moment.
                    let x = p.position[i] - p.velocity[i] * (0.5 * dt) - centre;
                    x.cross(&p.velocity[i]) + p.angular_velocity[i] * 0.4
                })
                .sum::<Vec3>()
        };
        let before = momentum(&state);
        let mut solver = solver(Model::default(), &mut state);
        for _ in 0..100_000 {
            solver.step_with(&mut state, false).unwrap();
        }
        let change = (momentum(&state) - before).norm() / before.norm();
        println!("angular momentum after 1e5 steps: {change:.1e}");
        assert!(change < 1e-12, "{change:e}");
    });
}

/// Pulls a damped concrete specimen through failure at the strain rate `rate` (1/s) up to the strain 1.2e-3 with the time
/// step `dt`; bonds break at the damage `threshold`. Returns the final state, the number of broken bonds, and the largest
/// residual of the ledger relative to the boundary work.
fn tear(rate: f64, dt: f64, threshold: f64) -> (State, usize, f64) {
    let parameters = CpmParameters { omega_threshold: threshold, ..concrete() };
    let mut state = bonded(particles(&random_packing(1, 23e-3), DENSITY), None, law(&parameters), 1.5);
    state.contacts = Some(Box::new(ContactBlock::new(vec![law(&parameters)])));
    state.clock.dt = dt;
    pull(&mut state, rate);
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    let model = Model { damping, contact_rows: one_material(), ..Model::default() };
    let mut solver = solver(model, &mut state);
    let bonds = state.bond_count();
    let mut worst = 0.0_f64;
    let steps = (1.2e-3 / (rate * dt)) as usize;
    for step in 0..steps {
        let sample = step % 100 == 99 || step + 1 == steps;
        solver.step_with(&mut state, sample).unwrap();
        if sample {
            worst = worst.max((state.ledger.residual() / state.ledger.boundary_work.get()).abs());
        }
    }
    let broken = bonds - state.bond_count();
    println!(
        "rate {rate}/s, Δt = {dt:.3e} s, {steps} steps, threshold {threshold}: {broken} of {bonds} bonds broke, residual \
         {worst:.2e} of the work {:.3e} J",
        state.ledger.boundary_work.get()
    );
    (state, broken, worst)
}

/// The ledger closes through failure within 1e-9 of the boundary work at a quarter of the reference time step, and would not
/// close without any one of its terms.
///
/// At the reference time step the residual is 4.2e-9 (1.3e-9 if no bond breaks): the measured normal and shear displacements
/// are work-conjugate to a force of constant magnitude in a step. A force that drops from N_o to N while the bond rotates by
/// θ in the step leaves `¼θ²d(N_o − N)`, always of the same sign. The residual is of second order in the step (measured
/// 4.2e-9, 1.4e-9, 5.4e-10 at Δt, Δt/2, Δt/4), until rounding dominates: particles move 1e-9 m per step at positions of
/// 2e-2 m, known to 3e-18 m.
#[test]
fn the_ledger_closes_through_failure() {
    on_threads(2, || {
        let (_, _, coarse) = tear(2.0, TIME_STEP, 0.97);
        let (state, broken, fine) = tear(2.0, 0.25 * TIME_STEP, 0.97);
        assert!(broken > 0, "the specimen must break");
        assert!(fine < 1e-9 && coarse < 1e-8, "{fine:e} {coarse:e}");
        assert!(coarse > 4.0 * fine, "of second order: {coarse:e} {fine:e}");
        let l = &state.ledger;
        let work = l.boundary_work.get();
        for (term, value) in [
            ("initial", l.initial),
            ("boundary work", work),
            ("kinetic", l.kinetic),
            ("stored, normal", l.stored[0]),
            ("stored, shear", l.stored[1]),
            ("damage", l.damage.get()),
            ("friction", l.friction.get()),
            ("integration", l.integration.get()),
            ("numerical damping", l.numerical_damping.get()),
        ] {
            // Without this term, the residual would change by its value, which exceeds the bound.
            println!("without {term}: residual {:.1e} of the work", (value.abs() - l.residual().abs()) / work);
            assert!(value.abs() - l.residual().abs() > 1e-8 * work, "{term} = {value:e} is too small to matter");
        }
    });
}

/// A periodic lattice of 64 unit spheres of mass 1, each bonded to the nearest 18. The motion of two is prescribed: one is
/// fixed, one moves along x. Ids are indices of the lattice, because the particles are not sorted.
fn prescribed_in_a_cell() -> (State, [usize; 2]) {
    let mut particles = Particles::default();
    for k in 0..64 {
        let position = Vec3::new(f64::from(k % 4), f64::from(k / 4 % 4), f64::from(k / 16)) * 2.0;
        particles.push(Sphere { position, radius: 1.0 }, 0, 1.0, 0.4);
    }
    let (held, moved) = (21, 42);
    particles.constraint[held] = Constraint::TRANSLATION;
    particles.constraint[moved] = Constraint::translation_along(0);
    particles.velocity[moved].x = 2e-4;
    let bond = LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    (bonded(particles, Some(Cell::new_box(Vec3::repeat(8.0))), bond, 1.45), [held, moved])
}

/// The velocity gradient (1/s) of a cell that is driven back and forth.
fn driven(time: f64) -> Mat3 {
    Mat3::new(1.0, 0.3, 0.0, 0.0, -0.5, 0.2, 0.1, 0.0, 0.4) * (2e-4 * (0.2 * time).sin())
}

/// Prescribed velocities are velocities in space, however the cell moves: the fixed particle keeps its position and the
/// moving one its velocity to the last bit; the position of the latter is the sum of up to 8000 steps of 2e-6 m at 4 m,
/// each rounded to 4e-16 m. The ledger includes the reactions: its residual is the error of the trapezoidal rule, of at
/// least second order in the step (measured 2.5e-10 of the work at Δt = 0.02 s, 4.1e-11 at half of it). Counting the
/// work of the cell twice would leave a far larger residual.
#[test]
fn prescribed_motion_in_a_driven_cell_is_motion_in_space() {
    on_threads(1, || {
        let run = |dt: f64| {
            let (mut state, [held, moved]) = prescribed_in_a_cell();
            let before = state.particles.position.clone();
            state.clock.dt = dt;
            let mut solver = solver(Model::default(), &mut state);
            let steps = (80.0 / dt).round() as usize;
            for step in 0..steps {
                solver.set_velocity_gradient(&state.cell.unwrap(), driven((step as f64 + 0.5) * dt));
                solver.step(&mut state).unwrap();
                assert_eq!((state.particles.velocity[held], state.particles.velocity[moved].x), (Vec3::zeros(), 2e-4));
            }
            assert_eq!(state.particles.position[held], before[held]);
            let way = state.particles.position[moved].x - before[moved].x;
            assert!((way - 2e-4 * steps as f64 * dt).abs() < 4e-16 * steps as f64, "{way}");
            // The other particles followed the cell.
            assert!((state.particles.position[63] - before[63]).norm() > 1e-3);
            let (residual, work) = (state.ledger.residual(), state.ledger.boundary_work.get());
            println!("Δt = {dt}: residual {residual:.3e} J of the work {work:.3e} J");
            (residual / work).abs()
        };
        let (coarse, fine) = (run(0.02), run(0.01));
        assert!(coarse < 1e-9 && coarse > 3.0 * fine, "{coarse:e} {fine:e}");
    });
}

/// With YADE's kinematics the cell carries prescribed particles along, as in YADE: `v' = v + L v Δt + ΔL x`, to rounding.
#[test]
fn the_cell_of_yade_carries_prescribed_motion() {
    on_threads(1, || {
        let (mut state, [held, _]) = prescribed_in_a_cell();
        state.clock.dt = 0.02;
        let mut solver = solver(Model { mode: MotionMeasure::Yade, ..Model::default() }, &mut state);
        let mut expected = Vec3::zeros();
        for time in [1.0, 2.0, 3.0] {
            let cell = state.cell.unwrap();
            let change = driven(time) - cell.velocity_gradient;
            expected += cell.velocity_gradient * expected * 0.02 + change * state.particles.position[held];
            solver.set_velocity_gradient(&cell, driven(time));
            solver.step(&mut state).unwrap();
            let error = (state.particles.velocity[held] - expected).norm() / expected.norm();
            assert!(expected.norm() > 1e-5 && error < 1e-15, "{error:e}");
        }
    });
}
