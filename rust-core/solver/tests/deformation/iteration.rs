//! Lagged and iterated strains converge to the same forces; the spectral radius says whether they do.

use std::f64::consts::PI;

use concordem_contact::kinematics::deformable::Update;
use concordem_contact::law::LinearBond;
use concordem_solver::coupling::convergence;
use concordem_solver::state::Constraint;
use concordem_solver::{Solver, SolverError};

use crate::{NORMAL, RADIUS, bonded, deformable, disc_stiffness, discs, model, spring, square, triangular};

/// Two discs with prescribed positions, whose reactions replace their outer neighbors. The forces of successive steps
/// of the lagged scheme are `f*(1 − (−r)^k)`, `r = 2k_n/k_p` (3.18)–(3.27), to 1e-12 of f*, and those of Table 3.1 as
/// far as it goes (it was computed with π = 3.14: 0.06 %). The spectral radius is `r`: power iteration with reactions,
/// 1e-8.
#[test]
fn row_of_two_follows_its_sequence() {
    let (poisson, overlap) = (0.35, 1e-5);
    for (young, table) in
        [(5e11, 605.3), (4e11, 585.5), (3e11, 555.2), (2e11, 503.1), (1e11, 392.7), (8e10, 353.9), (7.5e10, 0.0)]
    {
        let mut particles = discs(&[(0.0, 0.0), (2.0 * RADIUS, 0.0)], |_| RADIUS);
        particles.constraint.fill(Constraint::ALL);
        let mut state = bonded(particles, spring(0.0, 0.0), 1.01);
        state.particles.position[1].x -= overlap;
        state.clock.dt = 1e-9;
        let deformable = deformable(young, poisson);
        let ratio = 2.0 * NORMAL / disc_stiffness(young, poisson);
        let limit = -NORMAL * overlap / (1.0 + ratio);
        assert!((convergence(&state, &deformable).spectral_radius / ratio - 1.0).abs() < 1e-8);
        let mut solver = Solver::new(model(&deformable), &mut state).unwrap();
        // The overlap as the solver computes it, a rounded difference.
        let seen = 2.0 * RADIUS - (state.particles.position[1].x - state.particles.position[0].x);
        let limit = limit * seen / overlap;
        let mut power = 1.0;
        for k in 1..=40 {
            solver.step(&mut state).unwrap();
            power *= -ratio;
            let expected = limit * (1.0 - power);
            let force = solver.forces()[0].x;
            assert!(
                (force - expected).abs() < 1e-12 * limit.abs() * power.abs().max(1.0),
                "{young:e} {k}: {force} {expected}"
            );
        }
        if table > 0.0 {
            assert!((-limit * 1e-3 / table - 1.0).abs() < 6e-4, "{limit} {table}");
        }
        // Diverges only above the limit.
        assert_eq!(power.abs() > 1.0, ratio > 1.0);
    }
}

/// Iterated strains reach the limit in one step, to the tolerance of the iteration, 1e-13 (times 1/(1 − |growth|) <
/// 10). With a relaxation below 2/(1+ρ) they also do so beyond the limit of the plain iteration. A larger relaxation,
/// or too few iterations, is an error.
#[test]
fn iterated_row_settles_in_one_step() {
    let (poisson, overlap) = (0.35, 1e-5);
    let run = |young: f64, relaxation: f64, maximum: u32| {
        let mut particles = discs(&[(0.0, 0.0), (2.0 * RADIUS, 0.0)], |_| RADIUS);
        particles.constraint.fill(Constraint::ALL);
        let mut state = bonded(particles, spring(0.0, 0.0), 1.01);
        state.particles.position[1].x -= overlap;
        state.clock.dt = 1e-9;
        let mut deformable = deformable(young, poisson);
        deformable.update = Update::Iterated { tolerance: 1e-13, maximum, relaxation };
        let mut solver = Solver::new(model(&deformable), &mut state).unwrap();
        let report = solver.step(&mut state)?;
        let seen = 2.0 * RADIUS - (state.particles.position[1].x - state.particles.position[0].x);
        let limit = -NORMAL * seen / (1.0 + 2.0 * NORMAL / disc_stiffness(young, poisson));
        Ok::<_, SolverError>((solver.forces()[0].x / limit - 1.0, report.evaluations))
    };
    for (young, relaxation) in [(2e11, 1.0), (1e11, 1.0), (5e10, 0.5), (1e10, 0.2)] {
        let (error, evaluations) = run(young, relaxation, 200).unwrap();
        println!("E_p {young:.1e}, relaxation {relaxation}: {error:.1e} after {evaluations} evaluations");
        assert!(error.abs() < 1e-12, "{young:e}: {error:e}");
    }
    assert!(matches!(run(5e10, 1.0, 200), Err(SolverError::NotConverged { .. })));
    assert!(matches!(run(1e11, 1.0, 5), Err(SolverError::NotConverged { iterations: 5, .. })));
}

/// The only bond breaks in an iteration with a relaxation below 1: no force is left, the guess is halved in every
/// iteration, and the strains end at zero to the tolerance, relative to those at the start of the step.
#[test]
fn iteration_ends_if_the_only_bond_breaks() {
    let mut particles = discs(&[(0.0, 0.0), (2.0 * RADIUS, 0.0)], |_| RADIUS);
    particles.constraint.fill(Constraint::ALL);
    // At an opening of 1e-6 m the rigid discs would have 70 kN.
    let law = LinearBond::new(NORMAL, 0.0, 0.0, 100e3, f64::INFINITY).unwrap();
    let mut state = bonded(particles, law, 1.01);
    state.clock.dt = 1e-9;
    let mut deformable = deformable(2e11, 0.35);
    deformable.update = Update::Iterated { tolerance: 1e-10, maximum: 60, relaxation: 0.5 };
    let mut solver = Solver::new(model(&deformable), &mut state).unwrap();
    state.particles.position[1].x += 1e-6;
    solver.step(&mut state).unwrap();
    assert!(solver.forces()[0].x > 0.0);
    state.particles.position[1].x += 10e-6;
    let report = solver.step(&mut state).unwrap();
    assert_eq!((report.bond_events.iter().filter(|(_, event)| event.broke).count(), solver.forces()[0].x), (1, 0.0));
    // 0.5^34 < 1e-10.
    assert!((30..40).contains(&report.evaluations), "{}", report.evaluations);
}

/// Spectral radii of the finite specimens: the limits of E_p equal the reference values (power iteration by another
/// program, 4 to 5 digits: half a unit of the last), and those of k_n/E_p equal Tables 3.2 and 3.3 within the source's
/// grid of E_p. The sufficient bound is that of the infinite lattices, (3.42) and (3.78), up to roundings.
#[test]
fn spectral_radii_of_the_specimens() {
    let square_state = bonded(discs(&square(), |_| RADIUS), spring(0.0, 0.0), 1.01);
    let triangular_state = bonded(discs(&triangular(), |_| RADIUS), spring(0.0, 0.0), 1.01);
    assert_eq!((square_state.bond_count(), triangular_state.bond_count()), (331, 285));
    let of_square = [
        (0.05, 0.7608, 9.201e10),
        (0.10, 0.7268, 9.632e10),
        (0.15, 0.6953, 1.0067e11),
        (0.20, 0.6665, 1.0503e11),
        (0.25, 0.6398, 1.0940e11),
        (0.30, 0.6153, 1.1377e11),
        (0.35, 0.5925, 1.1814e11),
        (0.40, 0.5714, 1.2252e11),
        (0.45, 0.5517, 1.2689e11),
    ];
    for (poisson, ratio, young) in of_square {
        let c = convergence(&square_state, &deformable(1e11, poisson));
        let limit = 1e11 * c.spectral_radius;
        // Tabulated to 0.01 GPa.
        let digit = 0.5e7;
        println!("square ν {poisson}: E_p {limit:.5e} ± {:.0e}, {} iterations", 1e11 * c.uncertainty, c.iterations);
        assert!((limit - young).abs() < digit, "{poisson}: {limit:e}");
        assert!((NORMAL / limit - ratio).abs() < 0.5e-4, "{poisson}: {}", NORMAL / limit);
        let bound = 4.0 * NORMAL * (1.0 + poisson) / (PI * 1e11);
        assert!((c.bound / bound - 1.0).abs() < 1e-13, "{} {bound}", c.bound);
    }
    let of_triangular = [
        (0.05, 1.220e11),
        (0.10, 1.136e11),
        (0.15, 1.040e11),
        (0.20, 9.314e10),
        (0.22, 8.851e10),
        (0.25, 8.234e10),
        (0.30, 8.507e10),
        (0.35, 8.829e10),
        (0.40, 9.153e10),
        (0.45, 9.479e10),
    ];
    for (poisson, young) in of_triangular {
        let c = convergence(&triangular_state, &deformable(1e11, poisson));
        let limit = 1e11 * c.spectral_radius;
        println!("triangular ν {poisson}: E_p {limit:.5e} ± {:.0e}, {} iterations", 1e11 * c.uncertainty, c.iterations);
        let digit = if young < 1e11 { 0.5e7 } else { 0.5e8 };
        assert!((limit - young).abs() < digit, "{poisson}: {limit:e}");
        let deviatoric = 3.0 * NORMAL * (1.0 + poisson) / (PI * 1e11);
        let isotropic = 2.0 * deviatoric * (1.0 - 2.0 * poisson);
        assert!((c.bound / deviatoric.max(isotropic) - 1.0).abs() < 1e-13, "{} {deviatoric} {isotropic}", c.bound);
    }
}
