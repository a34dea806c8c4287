//! Vibrations of deformable discs, and the limit of rigid ones.

use std::f64::consts::PI;

use concordem_contact::kinematics::deformable::Deformable;
use concordem_solver::state::State;
use concordem_solver::{Model, Scheme, Solver};

use crate::{NORMAL, RADIUS, bonded, deformable, disc_stiffness, discs, disturbed, spring};

/// Frequency and damping ratio of the first mode of a free column of 20 discs in the lagged scheme, from its
/// oscillation over about 12 periods.
fn oscillation(deformable: Option<&Deformable>, dt: f64) -> (f64, f64) {
    let n = 20;
    let positions: Vec<(f64, f64)> = (0..n).map(|k| (0.0, 2.0 * RADIUS * f64::from(k))).collect();
    let mut state = bonded(discs(&positions, |_| RADIUS), spring(0.0, 0.0), 1.01);
    let shape: Vec<f64> = (0..n).map(|k| libm::cos(PI * (f64::from(k) + 0.5) / f64::from(n))).collect();
    for (v, s) in state.particles.velocity.iter_mut().zip(&shape) {
        v.y = 1e-3 * s;
    }
    state.clock.dt = dt;
    let model = Model { deformable: deformable.cloned(), scheme: Scheme::VelocityVerlet, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    let project =
        |s: &State| -> f64 { (0..n as usize).map(|k| shape[k] * (s.particles.position[k].y - positions[k].1)).sum() };
    // Peaks from parabolas through three values; zero crossings from lines.
    let (mut last, mut now) = (0.0, 0.0);
    let (mut crossings, mut peaks) = (Vec::new(), Vec::new());
    for _ in 0..(1.8e-4 / dt) as usize {
        solver.step_with(&mut state, false).unwrap();
        let next = project(&state);
        if now * next < 0.0 {
            crossings.push(state.clock.time() - dt * next / (next - now));
        }
        if (now - last) * (next - now) < 0.0 {
            let (slope, curve) = (0.5 * (next - last), next - 2.0 * now + last);
            peaks.push((now - 0.5 * slope * slope / curve).abs());
        }
        (last, now) = (now, next);
    }
    let half_periods = (crossings.len() - 1) as f64;
    let omega = PI * half_periods / (crossings[crossings.len() - 1] - crossings[0]);
    // Omit the first oscillation, in which the modes of rigid and deformable discs differ.
    let kept = &peaks[2..];
    let decrement = (kept[0] / kept[kept.len() - 1]).ln() / (kept.len() - 1) as f64;
    (omega, decrement / PI)
}

/// The reference values: ω falls from 5.2376e5 to 4.4448e5 1/s, ζ = 0.01246, 0.00622, 0.00124 at three time steps; and
/// the formula `ζ = ω₀Δt ρ/(2(1+ρ)^{3/2})`; 1 %.
#[test]
fn column_oscillates_slower_and_the_lag_damps_it() {
    let (young, poisson) = (2e11, 0.35);
    let deformable = deformable(young, poisson);
    let (rigid, none) = oscillation(None, 1e-7);
    println!("rigid: ω {rigid:.5e}, ζ {none:.1e}");
    assert!((rigid / 5.2376e5 - 1.0).abs() < 0.01);
    assert!(none.abs() < 1e-5);
    let ratio = 2.0 * NORMAL / disc_stiffness(young, poisson);
    for (dt, expected) in [(2e-7, 0.01246), (1e-7, 0.00622), (2e-8, 0.00124)] {
        let (omega, zeta) = oscillation(Some(&deformable), dt);
        let wave = libm::cos(PI / 40.0);
        let rho = ratio * wave * wave;
        let formula = 5.2376e5 * dt * rho / (2.0 * (1.0 + rho).powf(1.5));
        println!("Δt {dt:.0e}: ω {omega:.5e}, ζ {zeta:.5} (reference {expected}, formula {formula:.5})");
        assert!((omega / 4.4448e5 - 1.0).abs() < 0.01, "{omega:e}");
        assert!((zeta / expected - 1.0).abs() < 0.01, "{zeta} {expected}");
    }
}

/// A disturbed lattice of discs of unlike size with shear springs, in motion: positions after 300 steps with discs of
/// 1e30 Pa equal those with rigid discs to 1e-14 of the radius, and with infinite modulus bit for bit.
#[test]
fn stiff_discs_are_rigid_discs() {
    let run = |deformable: Option<Deformable>| {
        let mut state = disturbed(12, 9, None);
        let mut solver = Solver::new(Model { deformable, ..Model::default() }, &mut state).unwrap();
        for _ in 0..300 {
            solver.step_with(&mut state, false).unwrap();
        }
        state.particles.position
    };
    let rigid = run(None);
    assert_eq!(rigid, run(Some(deformable(f64::INFINITY, 0.0))));
    let stiff = run(Some(deformable(1e30, 0.35)));
    let worst = rigid.iter().zip(&stiff).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
    println!("worst {worst:e} m");
    assert!(worst < 1e-14 * RADIUS, "{worst:e}");
    let soft = run(Some(deformable(2e11, 0.35)));
    assert!(rigid.iter().zip(&soft).any(|(a, b)| (a - b).norm() > 1e-6 * RADIUS), "no disc deforms");
}
