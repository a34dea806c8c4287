//! Dashpots of beams: every mode of a pair decays by its damping ratio.

use concordem::law::{BeamDamping, BeamModel, CohesiveBeam, ContactGeometry, ContactLaw as _, DampedBeam, Section};
use concordem::math::Vec3;
use concordem::solver::{Model, time_step};
use concordem::state::State;
use concordem_tests::{bonded, on_threads, solver};

use super::pair;

const DAMPING: BeamDamping = BeamDamping { normal: 0.02, shear: 0.05, bending: 0.08, twist: 0.11 };
const SPEED: f64 = 1e-6;

fn law(model: BeamModel) -> DampedBeam {
    let beam = CohesiveBeam::new(3.0, 0.3, Section::Radius(0.8)).unwrap();
    DampedBeam { beam: CohesiveBeam { model, ..beam }, damping: DAMPING }
}

/// A mode of the pair: its name, damping ratio, squared frequency (1/s²), the start, and its coordinate.
struct Mode {
    name: &'static str,
    ratio: f64,
    squared_frequency: f64,
    start: fn(&mut State),
    coordinate: fn(&State) -> f64,
}

/// The modes of two spheres of mass and radius 1, with moments of inertia of 0.4, at a distance of 2.
fn modes(law: &DampedBeam) -> [Mode; 4] {
    let area = law.bonded_area(1.0, 1.0, 1.0);
    let geometry =
        ContactGeometry { reference_length: 2.0, area, radius_a: 1.0, radius_b: 1.0, mass_a: 1.0, mass_b: 1.0 };
    let k = law.beam.stiffnesses(&geometry);
    [
        Mode {
            name: "normal",
            ratio: DAMPING.normal,
            squared_frequency: k.normal * 2.0,
            start: |s| s.particles.velocity[1].x = SPEED,
            coordinate: |s| s.particles.position[1].x - s.particles.position[0].x - 2.0,
        },
        Mode {
            name: "shear",
            ratio: DAMPING.shear,
            // 1/m_r = 2, (½l₀)²/I_r = 5
            squared_frequency: k.shear * 7.0,
            // Without angular momentum: 2·0.4 ω + 2·1 v = 0.
            start: |s| {
                for (p, sign) in [(0, 1.0), (1, -1.0)] {
                    s.particles.angular_velocity[p].z = SPEED;
                    s.particles.velocity[p] = Vec3::y() * (0.4 * SPEED * sign);
                }
            },
            coordinate: |s| {
                let q = &s.particles.orientation;
                let x = &s.particles.position;
                2.0 * (q[0].k + q[1].k) - (x[1].y - x[0].y)
            },
        },
        Mode {
            name: "bending",
            ratio: DAMPING.bending,
            squared_frequency: k.bending * 5.0,
            start: |s| (s.particles.angular_velocity[0].z, s.particles.angular_velocity[1].z) = (-SPEED, SPEED),
            coordinate: |s| 2.0 * (s.particles.orientation[1].k - s.particles.orientation[0].k),
        },
        Mode {
            name: "twist",
            ratio: DAMPING.twist,
            squared_frequency: k.twist * 5.0,
            start: |s| (s.particles.angular_velocity[0].x, s.particles.angular_velocity[1].x) = (-SPEED, SPEED),
            coordinate: |s| 2.0 * (s.particles.orientation[1].i - s.particles.orientation[0].i),
        },
    ]
}

/// With `h = Δt`, leapfrog and a dashpot that acts by the last mean rate move a coordinate by `x'' − T x' + D x = 0`, with
/// `T = 2 − 2ξωh − ω²h²` and `D = 1 − 2ξωh`. The form `x² − T x y + D y²` of two successive values then shrinks by exactly `D` in a
/// step, and `D` tells ξ. Tolerance: rounding of lengths of 2 beside amplitudes of 1e-6, after 200 steps.
#[test]
fn every_mode_decays_by_its_damping_ratio() {
    on_threads(1, || {
        for model in [BeamModel::EulerBernoulli, BeamModel::Timoshenko { shear_coefficient: 0.9 }] {
            let law = law(model);
            for Mode { name, ratio, squared_frequency, start, coordinate } in modes(&law) {
                let mut state = bonded(pair(), None, law, 1.01);
                let omega = squared_frequency.sqrt();
                let h = 0.2 / omega;
                assert!(h < time_step::bounds(&state).spectral);
                state.clock.dt = h;
                start(&mut state);
                let mut solver = solver(Model::default(), &mut state);
                let (trace, det) =
                    (2.0 - 2.0 * ratio * omega * h - omega * omega * h * h, 1.0 - 2.0 * ratio * omega * h);
                let form = |x: f64, y: f64| x * x - trace * x * y + det * y * y;
                let mut values = Vec::new();
                for _ in 0..202 {
                    solver.step_with(&mut state, false).unwrap();
                    values.push(coordinate(&state));
                }
                let (first, last) = (form(values[1], values[0]), form(values[201], values[200]));
                let found = (1.0 - (last / first).powf(1.0 / 200.0)) / (2.0 * omega * h);
                println!("{name}: damping ratio {found:.9}, set {ratio}");
                assert!((found - ratio).abs() < 1e-7, "{name}: {found} {ratio}");
            }
        }
    });
}

/// A strongly damped pair is stable at the step that the solver computes, and not far above it.
#[test]
fn the_time_step_knows_the_dashpots() {
    on_threads(1, || {
        for (ratio, factor, stable) in [(0.5, 1.0, true), (0.5, 3.0, false), (2.0, 1.0, true)] {
            let beam = law(BeamModel::EulerBernoulli).beam;
            let law = DampedBeam::new(beam, ratio).unwrap();
            let mut state = bonded(pair(), None, law, 1.01);
            state.clock.dt = factor * time_step::bounds(&state).spectral;
            for (p, sign) in [(0, -1.0), (1, 1.0)] {
                state.particles.velocity[p] = Vec3::new(1e-9, 0.5e-9, 0.2e-9) * sign;
                state.particles.angular_velocity[p] = Vec3::new(2e-9, -1e-9, 3e-9) * sign;
            }
            let mut solver = solver(Model::default(), &mut state);
            for _ in 0..300 {
                if solver.step_with(&mut state, false).is_err() {
                    break;
                }
            }
            let fastest = state.particles.velocity.iter().map(Vec3::norm).fold(0.0, f64::max);
            assert_eq!(fastest < 1e-8, stable, "{ratio} {factor}: {fastest:e}");
        }
    });
}
