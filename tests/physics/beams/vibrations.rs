//! Periods of clamped chains (Jebahi et al. 2015, [2.27]-[2.32]), and the speed of waves.

use std::f64::consts::{PI, TAU};

use concordem::calibration::cohesive_beam::{CylinderLoad, CylinderRecipe, CylinderSpecimen, elastic, impact};
use concordem::law::{CohesiveBeam, ContactGeometry, ContactLaw as _, Section};
use concordem::solver::{Model, Scheme, time_step};
use concordem::state::State;
use concordem_tests::{on_threads, solver};
use nalgebra::{DMatrix, SymmetricEigen};

use super::chain;

/// Lowest circular frequency, and its mode, of a clamped-free chain of `n` spheres of radius 1, mass `mass`, and the
/// stiffness of `beam`: in tension, bending (displacement and rotation of each sphere), and torsion.
fn first_modes(n: usize, mass: f64, beam: &CohesiveBeam) -> [(f64, Vec<f64>); 3] {
    let geometry = ContactGeometry {
        reference_length: 2.0,
        area: beam.bonded_area(1.0, 1.0, 1.0),
        radius_a: 1.0,
        radius_b: 1.0,
        mass_a: mass,
        mass_b: mass,
    };
    let k = beam.stiffnesses(&geometry);
    let inertia = 0.4 * mass;
    let lowest = |matrix: DMatrix<f64>| {
        let eigen = SymmetricEigen::new(matrix);
        let at = eigen.eigenvalues.imin();
        (eigen.eigenvalues[at].sqrt(), eigen.eigenvectors.column(at).iter().copied().collect::<Vec<_>>())
    };
    let free = n - 1;
    let line = |stiffness: f64, mass: f64| {
        lowest(DMatrix::from_fn(free, free, |i, j| {
            let value = if i == j {
                if i + 1 == free { 1.0 } else { 2.0 }
            } else if i.abs_diff(j) == 1 {
                -1.0
            } else {
                0.0
            };
            value * stiffness / mass
        }))
    };
    let mut bending = DMatrix::zeros(2 * free, 2 * free);
    // Each bond: slip v_B − v_A − (θ_A+θ_B)l/2 (l/2 = 1) with k_s, relative rotation θ_B − θ_A with k_b.
    for bond in 0..free {
        let rows = [([-1.0, -1.0, 1.0, -1.0], k.shear), ([0.0, -1.0, 0.0, 1.0], k.bending)];
        for (row, stiffness) in rows {
            for p in 0..4 {
                for q in 0..4 {
                    let place = |c: usize| (2 * (bond + c / 2) + c % 2).checked_sub(2);
                    if let (Some(i), Some(j)) = (place(p), place(q)) {
                        let m = |c: usize| if c.is_multiple_of(2) { mass.sqrt() } else { inertia.sqrt() };
                        bending[(i, j)] += row[p] * row[q] * stiffness / (m(p) * m(q));
                    }
                }
            }
        }
    }
    let (omega, shape) = lowest(bending);
    let unscaled =
        shape.iter().enumerate().map(|(c, x)| x / if c.is_multiple_of(2) { mass.sqrt() } else { inertia.sqrt() });
    [line(k.normal, mass), (omega, unscaled.collect()), line(k.twist, inertia)]
}

/// Ratios of first periods to those of a continuous bar, clamped-free, length `2R(N−1)`, mass shared by the spheres, agree
/// with values computed independently from the beam matrices of Jebahi et al. 2015, section 2.1 (corrected), within half a
/// unit of the fourth decimal. Torsion tends to √(12/15) = 0.8944, because spheres have less inertia than the cylinder.
#[test]
fn first_periods_of_chains_agree_with_the_table() {
    let young = 3.0;
    let poisson = 0.3;
    let beam = CohesiveBeam::new(young, poisson, Section::Ratio(1.0)).unwrap();
    for (n, table) in [
        (2, [1.1107, 1.5981, 0.9935]),
        (5, [1.0114, 1.1322, 0.9046]),
        (10, [1.0025, 1.0571, 0.8967]),
        (20, [1.0006, 1.0267, 0.8950]),
        (200, [1.0000, 1.0025, 0.8944]),
    ] {
        let length = 2.0 * (n as f64 - 1.0);
        let density = 1.0;
        let mass = density * PI * length / n as f64;
        let shear_modulus = young / (2.0 * (1.0 + poisson));
        let theory = [
            4.0 * length * (density / young).sqrt(),
            // 2π/1.875104068711961² L²√(ρS/EI), S/I = 4/R²
            TAU / 1.875_104_068_711_961_f64.powi(2) * length * length * (4.0 * density / young).sqrt(),
            4.0 * length * (density / shear_modulus).sqrt(),
        ];
        let modes = first_modes(n, mass, &beam);
        let ratio: Vec<f64> = modes.iter().zip(theory).map(|((omega, _), t)| TAU / omega / t).collect();
        println!("N = {n}: tension {:.6}, bending {:.6}, torsion {:.6}", ratio[0], ratio[1], ratio[2]);
        for k in 0..3 {
            assert!((ratio[k] - table[k]).abs() < 0.5001e-4, "N = {n}: {ratio:?} {table:?}");
        }
    }
}

/// A chain vibrates with the period of its matrices: ten spheres started in each first mode with a small velocity pass the
/// rest position after half a period. Leapfrog shortens the period by `(ωΔt)²/24`, which is taken into account; the
/// remaining error, from the curvature of the motion between steps, is 1e-7.
#[test]
fn a_chain_vibrates_with_the_period_of_its_matrices() {
    on_threads(1, || {
        let (n, density) = (10, 1.0);
        let beam = CohesiveBeam::new(3.0, 0.3, Section::Ratio(1.0)).unwrap();
        let mass = density * 4.0 / 3.0 * PI;
        for (kind, (omega, shape)) in first_modes(n, mass, &beam).into_iter().enumerate() {
            let mut state = chain(n, 1.0, density, beam);
            state.clock.dt = 0.5 * time_step::bounds(&state).spectral;
            let largest = shape.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
            for p in 1..n {
                let scaled = |c: usize| 1e-6 * omega * shape[c] / largest;
                match kind {
                    0 => state.particles.velocity[p].x = scaled(p - 1),
                    1 => {
                        state.particles.velocity[p].y = scaled(2 * (p - 1));
                        state.particles.angular_velocity[p].z = scaled(2 * (p - 1) + 1);
                    }
                    _ => state.particles.angular_velocity[p].x = scaled(p - 1),
                }
            }
            let dt = state.clock.dt;
            let tip = |s: &State| match kind {
                0 => s.particles.position[n - 1].x - 2.0 * (n as f64 - 1.0),
                1 => s.particles.position[n - 1].y,
                _ => 2.0 * s.particles.orientation[n - 1].i,
            };
            let model = Model { scheme: Scheme::VelocityVerlet, ..Model::default() };
            let mut solver = solver(model, &mut state);
            let (mut before, mut crossings, mut time) = (0.0, 0, 0.0);
            while crossings < 4 {
                solver.step_with(&mut state, false).unwrap();
                let now = tip(&state);
                if before * now < 0.0 {
                    crossings += 1;
                    time = state.clock.time() - dt * now / (now - before);
                }
                before = now;
            }
            let period = time / 2.0;
            let expected = PI * dt / (0.5 * omega * dt).asin();
            println!("mode {kind}: period {period:.9}, expected {expected:.9}");
            assert!((period / expected - 1.0).abs() < 1e-6, "mode {kind}: {period} {expected}");
        }
    });
}

/// A pulse through a slender cylinder of a thousand spheres travels at `√(E/ρ)` with `E` and `ρ` of the cylinder: the case
/// "impact" of `examples/beam_study.rs` for one seed. Longer pulses come closer to this speed, as in a bar, but need not
/// reach it: the middle half has 500 spheres, whose mass and stiffness scatter by some percent, so the four seeds of the
/// study lie within 2 % of 0.98. The tolerance of 5 % detects a wrong factor in mass or stiffness, the speed of shear waves
/// (35 % less), and in most cases the speed in an unbounded body with the ν of 0.18 of this specimen (4 % more).
#[test]
fn a_pulse_travels_at_the_wave_speed_of_a_bar() {
    let density = 2200.0;
    let sample =
        CylinderSpecimen::new(&CylinderRecipe { slenderness: 10.0, ..CylinderRecipe::book(1000, 1) }, &mut |_| {})
            .unwrap();
    let beam = CohesiveBeam::new(295.5e9, 0.3, Section::Ratio(0.68)).unwrap();
    let tension = elastic(&sample, &beam, CylinderLoad::Tension).unwrap();
    let bar = (tension.modulus / density).sqrt();
    let speed = |radii: f64| {
        let found = impact(&sample, &beam, sample.sphere_density(density), radii * sample.radius, bar).unwrap();
        println!("struck over {radii} radii: {:.4} of {bar:.0} m/s", found.wave_speed / bar);
        found.wave_speed / bar
    };
    let (short, long) = (speed(1.0), speed(4.0));
    assert!((long - 1.0).abs() < 0.05, "{long}");
    assert!(short < long, "{short} {long}");
}
