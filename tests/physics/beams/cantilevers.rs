//! Cantilevers under their weight, and under an end moment.

use std::f64::consts::{PI, TAU};

use concordem::law::{BeamModel, CohesiveBeam, Section};
use concordem::math::Vec3;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, time_step};
use concordem_tests::{on_threads, solver};

use super::chain;

/// Deflection of the tip of a cantilever of ten spheres (R = 1 mm) under its own weight, at rest.
fn deflection_under_weight(model: BeamModel) -> f64 {
    let beam = CohesiveBeam { model, ..CohesiveBeam::new(1e9, 0.25, Section::Radius(1e-3)).unwrap() };
    let mut state = chain(10, 1e-3, 2500.0, beam);
    state.clock.dt = 0.8 * time_step::bounds(&state).spectral;
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    let mut solver = solver(Model { damping, gravity: Vec3::new(0.0, -9.81, 0.0), ..Model::default() }, &mut state);
    let mut last = 0.0;
    loop {
        for _ in 0..2000 {
            solver.step_with(&mut state, false).unwrap();
        }
        let tip = state.particles.position[9].y;
        if (tip - last).abs() < 1e-11 * tip.abs() {
            return -tip;
        }
        last = tip;
    }
}

/// Deflections of cantilevers agree with the closed form of a chain with forces at the nodes: `Σ P x²(3L−x)/6EI`, with shear
/// `+ Σ P x/κGS`. Tolerance 1e-6: finite rotations (1e-4 rad) change the deflection by their square.
#[test]
fn cantilevers_agree_with_the_closed_form_of_a_chain() {
    on_threads(1, || {
        let (radius, young, density): (f64, f64, f64) = (1e-3, 1e9, 2500.0);
        let weight = density * 4.0 / 3.0 * PI * radius.powi(3) * 9.81;
        let (inertia, area) = (PI * radius.powi(4) / 4.0, PI * radius * radius);
        let (shear_modulus, length) = (young / 2.5, 18.0 * radius);
        let places = || (1..10).map(|p| 2.0 * radius * f64::from(p));
        let bending: f64 = places().map(|x| weight * x * x * (3.0 * length - x) / (6.0 * young * inertia)).sum();
        let shear: f64 = places().map(|x| weight * x / (shear_modulus * area)).sum();
        for (name, model, exact, digits) in [
            ("Euler-Bernoulli", BeamModel::EulerBernoulli, bending, 9.8885e-7),
            ("κ = 1", BeamModel::Timoshenko { shear_coefficient: 1.0 }, bending + shear, 9.9621e-7),
            ("κ = 0.9", BeamModel::Timoshenko { shear_coefficient: 0.9 }, bending + shear / 0.9, 9.9702e-7),
        ] {
            // Published values, to their last digit.
            assert!((exact - digits).abs() < 0.5001e-11, "{name}: {exact:e} {digits:e}");
            let deflection = deflection_under_weight(model);
            println!("{name}: {deflection:.9e} m, exact {exact:.9e} m, relative {:.1e}", deflection / exact - 1.0);
            assert!((deflection / exact - 1.0).abs() < 1e-6, "{name}: {deflection:e} {exact:e}");
        }
    });
}

/// An end moment bends a chain to a full circle, with finite rotations up to 2π along the chain. Every bond has the same
/// curvature, `M/EI`, so the bonds are chords of a circle and the tip returns to the first sphere. Tolerance: the motion
/// that damping leaves, 1e-6 of the length.
#[test]
fn an_end_moment_bends_a_chain_to_a_full_circle() {
    on_threads(1, || {
        let n = 13;
        let beam = CohesiveBeam::new(1e6, 0.25, Section::Ratio(0.2)).unwrap();
        let mut state = chain(n, 1.0, 1000.0, beam);
        state.clock.dt = 0.5 * time_step::bounds(&state).spectral;
        // The first and the last sphere are rotated by 0 and 2π: M = k_b·2π/(n−1).
        let area = PI * 0.04;
        let bending = 1e6 * area * area / (4.0 * PI) / 2.0;
        let moment = bending * TAU / (n - 1) as f64;
        state.particles.add_load(n as u32 - 1, Vec3::zeros(), Vec3::new(0.0, 0.0, moment));
        let damping = Damping::Local { translation: 0.2, rotation: 0.2 };
        let mut solver = solver(Model { damping, ..Model::default() }, &mut state);
        let mut last = Vec3::zeros();
        for round in 0.. {
            for _ in 0..5000 {
                solver.step_with(&mut state, false).unwrap();
            }
            let tip = state.particles.position[n - 1];
            if (tip - last).norm() < 1e-10 {
                break;
            }
            assert!(round < 2000, "does not come to rest: {tip}");
            last = tip;
        }
        let tip = state.particles.position[n - 1];
        println!("tip at {tip} after {} steps", state.clock.step);
        assert!(tip.norm() < 1e-6 * 2.0 * (n - 1) as f64, "{tip}");
    });
}
