//! Damping by the integrator.

use concordem::law::LinearBond;
use concordem::solver::Model;
use concordem::solver::integrate::Damping;
use concordem::state::{Constraint, State};
use concordem_tests::{bonded, on_threads, solver};

use super::pair;

/// One mass on a spring, both 1, which starts with the given speed.
fn oscillator(speed: f64, dt: f64) -> State {
    let mut particles = pair();
    particles.constraint[0] = Constraint::ALL;
    particles.velocity[1].x = speed;
    let spring = LinearBond::new(1.0, 0.0, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    let mut state = bonded(particles, None, spring, 1.01);
    state.clock.dt = dt;
    state
}

/// Decay of the amplitude of the oscillator per step, from `steps` steps with `ωΔt = omega_dt`.
fn decay(damping: Damping, omega_dt: f64, steps: u32) -> f64 {
    let mut state = oscillator(1e-3, omega_dt);
    let mut solver = solver(Model { damping, ..Model::default() }, &mut state);
    // The envelope follows from two successive states, which determine the ellipse of the recursion.
    let envelope = |s: &State| {
        let (x, v) = (s.particles.position[1].x - 2.0, s.particles.velocity[1].x * omega_dt);
        let y = x - v;
        (x * x, x * y, y * y)
    };
    let quadratic = |(xx, xy, yy): (f64, f64, f64), trace: f64, det: f64| xx - trace * xy + det * yy;
    let h = omega_dt * omega_dt;
    // x'' − T x' + D x = 0 with D = 1 − (φ−1)h, T = 2 − φh
    let phi = if let Damping::TchamwaWielgosz { phi } = damping { phi } else { 1.0 };
    let (trace, det) = (2.0 - phi * h, 1.0 - (phi - 1.0) * h);
    solver.step_with(&mut state, false).unwrap();
    let first = quadratic(envelope(&state), trace, det);
    for _ in 0..steps {
        solver.step_with(&mut state, false).unwrap();
    }
    (quadratic(envelope(&state), trace, det) / first).powf(0.5 / f64::from(steps))
}

/// Damping by the integrator has its theoretical spectral radius at ωΔt = 1, φ = 1.3 (0.837, 0.922): the quadratic form
/// `x² − T x y + D y²` of two successive displacements shrinks by exactly the determinant in every step. Rounding of lengths
/// of 2 against displacements of 1e-5 at the end: 1e-10.
#[test]
fn damping_has_its_spectral_radius() {
    on_threads(1, || {
        for (damping, radius, quoted) in [
            (Damping::TchamwaWielgosz { phi: 1.3 }, 0.7_f64.sqrt(), 0.837),
            (Damping::position_term(1.3), 0.85_f64.sqrt(), 0.922),
        ] {
            let measured = decay(damping, 1.0, 20);
            println!("{damping:?}: {measured:.6}");
            assert!((measured - radius).abs() < 1e-9, "{measured} {radius}");
            assert!((measured - quoted).abs() < 0.5e-3, "{measured} {quoted}");
        }
    });
}

/// The recursion printed in the book, with φ on the velocity, diverges (1.072 per step), whereas both implemented forms
/// decay. Scalar oscillator, ωΔt = 1, φ = 1.3.
#[test]
fn printed_damping_diverges() {
    let phi = 1.3;
    let run = |step: &dyn Fn(f64, f64) -> (f64, f64)| {
        let (mut x, mut v) = (0.0_f64, 1.0_f64);
        for _ in 0..200 {
            (x, v) = step(x, v);
        }
        (x * x + v * v).sqrt().powf(1.0 / 200.0)
    };
    let printed = run(&|x, v| {
        let a = -x;
        let x = x + v + 0.5 * a;
        (x, v + phi * 0.5 * (a - x))
    });
    let position_term = run(&|x, v| {
        let a = -x;
        let x = x + v + phi * 0.5 * a;
        (x, v + 0.5 * (a - x))
    });
    let tchamwa = run(&|x, v| (x + v - phi * x, v - x));
    println!("printed {printed:.4}, position term {position_term:.4}, Tchamwa-Wielgosz {tchamwa:.4}");
    // The phase at the end changes the 200th root by at most a percent.
    assert!(printed > 1.06 && (position_term - 0.922).abs() < 0.01 && (tchamwa - 0.837).abs() < 0.01);
}

/// With damping by the integrator, motion is stable at 0.99 of `2/√(2φ−1)` and grows at 1.01.
#[test]
fn damping_by_the_integrator_lowers_the_stability_bound() {
    on_threads(1, || {
        let damping = Damping::TchamwaWielgosz { phi: 1.3 };
        let limit = 2.0 * damping.stability();
        assert!((limit - 1.581).abs() < 0.5e-3, "{limit}");
        let amplitude = |share: f64| {
            let mut state = oscillator(1e-9, share * limit);
            let mut solver = solver(Model { damping, ..Model::default() }, &mut state);
            for _ in 0..300 {
                if solver.step_with(&mut state, false).is_err() {
                    return f64::INFINITY;
                }
            }
            (state.particles.position[1].x - 2.0).abs()
        };
        let (below, above) = (amplitude(0.99), amplitude(1.01));
        println!("{below:e} {above:e}");
        assert!(below < 1e-9 && above > 1e-6, "{below:e} {above:e}");
    });
}
