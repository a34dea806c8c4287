//! The time step bound is tight.
//!
//! A system started with small random velocities must keep them small at 0.99 of the bound and must blow up at 1.01. At
//! 1.01 of the limit 2/ω the amplitude of the fastest mode grows by a third in every step; at 0.99 it never exceeds
//! 1/√(1−0.99²) ≈ 7 times the amplitude at small steps.

use concordem::law::LinearBond;
use concordem::math::Vec3;
use concordem::packing::lattice::Lattice;
use concordem::solver::forces::LawLoops;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, time_step};
use concordem::state::{Clump, Constraint, Particles, Sphere, State};
use concordem_tests::{DENSITY, bonded, concrete, law, noise_vector, on_threads, particles, random_packing, solver};

/// Largest speed (m/s; angular velocity times radius counts as speed) after `steps` at the fraction `share` of the spectral
/// bound, divided by the largest initial speed; the run ends when this ratio exceeds 1e5.
fn growth(state: &State, share: f64, steps: usize) -> f64 {
    growth_under(Damping::None, state, share, steps)
}

/// The same with numerical damping, at a fraction of the damped bound.
fn growth_under(damping: Damping, state: &State, share: f64, steps: usize) -> f64 {
    let mut state = state.clone();
    state.clock.dt = share * time_step::bounds(&state).limit(&damping);
    let radius = state.particles.radius.iter().copied().fold(f64::INFINITY, f64::min);
    // The speed is so small that positions change by 1e-9 of a radius per step and the system stays linear.
    let speed = 1e-9 * radius / state.clock.dt;
    for p in 0..state.particles.len() {
        let free = |axis: usize, rotation: bool| {
            let c = state.particles.constraint[p];
            f64::from(u8::from(!(if rotation { c.rotation(axis) } else { c.translation(axis) })))
        };
        state.particles.velocity[p] = noise_vector(p, 1).component_mul(&Vec3::from_fn(|i, _| free(i, false))) * speed;
        state.particles.angular_velocity[p] =
            noise_vector(p, 2).component_mul(&Vec3::from_fn(|i, _| free(i, true))) * (speed / radius);
    }
    let size = |s: &State| {
        let linear = s.particles.velocity.iter().map(Vec3::norm).fold(0.0, f64::max);
        let turning = s.particles.angular_velocity.iter().map(Vec3::norm).fold(0.0, f64::max);
        linear.max(turning * radius) / speed
    };
    let start = size(&state);
    let mut solver = solver(Model { damping, ..Model::default() }, &mut state);
    let mut largest = 0.0_f64;
    for _ in 0..steps {
        if solver.step_with(&mut state, false).is_err() {
            return f64::INFINITY;
        }
        largest = largest.max(size(&state) / start);
        if largest > 1e5 {
            break;
        }
    }
    largest
}

fn brackets(name: &str, state: &State, steps: usize) {
    on_threads(1, || {
        let bounds = time_step::bounds(state);
        let (stable, unstable) = (growth(state, 0.99, steps), growth(state, 1.01, steps));
        println!(
            "{name}: spectral {:.6e} s (±{:.0e}, {} iterations), per particle {:.4} of it, growth {stable:.1} at 0.99, \
             {unstable:.1e} at 1.01",
            bounds.spectral,
            bounds.uncertainty,
            bounds.iterations,
            bounds.per_particle / bounds.spectral
        );
        // 7 for the fastest mode, plus a random sum of all others.
        assert!(stable < 50.0, "{name} grows by {stable} at 0.99 of the bound");
        assert!(unstable > 1e5, "{name} only grows by {unstable} at 1.01 of the bound");
        // Holds rigorously, up to rounding and the uncertainty of the spectral bound.
        assert!(bounds.per_particle <= bounds.spectral * (1.0 + bounds.uncertainty + 1e-12), "{name}: {bounds:?}");
        assert!(bounds.uncertainty <= 1e-4, "{name}: {bounds:?}");
    });
}

/// The bound holds for clumps, also for clumps with a hundredth of the mass and moments of their spheres, for which the
/// bound of the spheres would be ten times too large. For clumps the bound is conservative, because it treats members
/// as independent: only a clump of one sphere has the bound of that sphere.
#[test]
fn clumps_are_stable_below_the_bound() {
    let clumped = |members: &[u32], body: Option<(f64, Vec3)>| {
        let mut state = chain(0.0);
        let clump = Clump::new(members.to_vec(), &state.particles, body.map(|b| b.0), body.map(|b| b.1));
        for &m in members {
            state.particles.clump[m as usize] = 0;
        }
        state.clumps.push(clump);
        state
    };
    let (alone, free) = (time_step::bounds(&clumped(&[20], None)), time_step::bounds(&chain(0.0)));
    // Tolerance: rounding of a quotient.
    assert!((alone.spectral / free.spectral - 1.0).abs() < 1e-12, "{alone:?} {free:?}");
    // A hundredth of the values of three spheres of mass 1 and inertia 0.4 at distances of 2: mass 3, moments 1.2, 9.2, 9.2.
    let light = Some((0.03, Vec3::new(0.012, 0.092, 0.092)));
    on_threads(1, || {
        for (name, state) in
            [("as its spheres", clumped(&[20, 21, 22], None)), ("light", clumped(&[20, 21, 22], light))]
        {
            let stable = growth(&state, 0.99, 2000);
            println!(
                "clump {name}: spectral {:.4} of that without",
                time_step::bounds(&state).spectral / free.spectral
            );
            assert!(stable < 50.0, "{name}: grows by {stable} at 0.99 of the bound");
        }
    });
}

fn chain(damping_ratio: f64) -> State {
    let mut particles = Particles::default();
    for p in 0..40 {
        particles.push(Sphere { position: Vec3::new(2.0 * f64::from(p), 0.0, 0.0), radius: 1.0 }, 0, 1.0, 0.4);
    }
    let bond = LinearBond::new(1.0, 0.0, damping_ratio, f64::INFINITY, f64::INFINITY).unwrap();
    let mut state = bonded(particles, None, bond, 1.01);
    let only_x = Constraint::translation_along(1).with(Constraint::translation_along(2)).with(Constraint::ROTATION);
    state.particles.constraint.fill(only_x);
    state.particles.constraint[0] = Constraint::ALL;
    state
}

fn block<L: LawLoops>(lattice: Lattice, repeats: [u32; 3], law: L) -> State {
    let packing = lattice.periodic(1.0, repeats).unwrap();
    // A finite block, without the cell.
    let mut particles = Particles::default();
    for sphere in packing.spheres {
        particles.push(sphere, 0, 1.0, 0.4);
    }
    bonded(particles, None, law, 1.01)
}

/// The largest frequency of a chain of n free masses with one end fixed is `2√(k/m) sin((2n−1)π/(2(2n+1)))`.
#[test]
fn the_frequency_of_a_chain_agrees_with_its_closed_form() {
    let bounds = time_step::bounds(&chain(0.0));
    let n = 39.0;
    let exact = 2.0 * ((2.0 * n - 1.0) * std::f64::consts::PI / (2.0 * (2.0 * n + 1.0))).sin();
    println!("chain: {:.9} {exact:.9}", bounds.frequency);
    // The bound is the upper end of an interval whose half width is the residual.
    assert!(bounds.frequency >= exact * (1.0 - 1e-12), "{} {exact}", bounds.frequency);
    assert!(bounds.frequency <= exact * (1.0 + 2.0 * bounds.uncertainty + 1e-12), "{} {exact}", bounds.frequency);
}

#[test]
fn the_bound_of_a_chain_is_tight() {
    brackets("chain", &chain(0.0), 300);
}

/// With dashpots `C = βK` the bound is exact; beyond it, growth is slower.
#[test]
fn the_bound_of_a_damped_chain_is_tight() {
    brackets("damped chain", &chain(0.3), 3000);
}

/// Dashpots together with φ: `(2φ−1)(Ω² + 2D) < 4` is exact for `C = βK`. The product of the separate bounds is too large by
/// up to `√(2φ−1)`, 1.41 for φ = 1.5 and 1.73 for φ = 2: at 0.8 of the product the motion grows.
#[test]
fn dashpots_and_damping_by_the_integrator_share_a_bound() {
    on_threads(1, || {
        for (xi, phi) in [(0.0, 1.3), (0.2, 1.5), (1.0, 1.3), (1.0, 1.5), (1.0, 2.0), (5.0, 2.0)] {
            let (state, damping) = (chain(xi), Damping::TchamwaWielgosz { phi });
            let bounds = time_step::bounds(&state);
            let product = bounds.spectral * damping.stability() / bounds.limit(&damping);
            let (stable, unstable) =
                (growth_under(damping, &state, 0.99, 3000), growth_under(damping, &state, 1.01, 3000));
            println!("ξ = {xi}, φ = {phi}: product of the bounds {product:.3}, growth {stable:.1}, {unstable:.1e}");
            assert!(stable < 50.0, "ξ = {xi}, φ = {phi}: grows by {stable} at 0.99 of the bound");
            assert!(unstable > 1e5, "ξ = {xi}, φ = {phi}: only grows by {unstable} at 1.01 of the bound");
            assert!((1.0 - 1e-12..=(2.0 * phi - 1.0_f64).sqrt() + 1e-12).contains(&product), "{product}");
        }
    });
}

/// Local damping increases a force against the motion by the factor 1 + λ: with strong damping, the motion grows by
/// more than 1e5 near 0.8 of the undamped bound, and stays bounded below the damped bound.
#[test]
fn strong_local_damping_lowers_the_bound() {
    on_threads(1, || {
        for damping in [
            Damping::Local { translation: 0.8, rotation: 0.8 },
            Damping::NonViscous { translation: 0.8, rotation: 0.8 },
        ] {
            let state = chain(0.0);
            let undamped = 0.82 * time_step::bounds(&state).spectral / time_step::bounds(&state).limit(&damping);
            let (below, above) =
                (growth_under(damping, &state, 0.95, 3000), growth_under(damping, &state, undamped, 3000));
            println!("{damping:?}: growth {below:.1} at 0.95, {above:.1e} at 0.82 of the undamped bound");
            assert!(below < 50.0 && above > 1e5, "{damping:?}: {below} {above}");
        }
    });
}

#[test]
fn the_bound_of_a_simple_cubic_block_is_tight() {
    let law = LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    brackets("simple cubic", &block(Lattice::SimpleCubic, [5, 5, 5], law), 300);
}

#[test]
fn the_bound_of_a_hexagonal_block_is_tight() {
    let law = LinearBond::new(1.0, 0.4, 0.0, f64::INFINITY, f64::INFINITY).unwrap();
    brackets("hexagonal", &block(Lattice::HexagonalClosePacked, [5, 3, 3], law), 300);
}

/// Equal stiffnesses give equal β in both directions, for which the bound is exact.
#[test]
fn the_bound_of_a_damped_hexagonal_block_is_tight() {
    let law = LinearBond::new(1.0, 1.0, 0.2, f64::INFINITY, f64::INFINITY).unwrap();
    brackets("damped hexagonal", &block(Lattice::HexagonalClosePacked, [5, 3, 3], law), 3000);
}

/// The bound is tight for concrete on a random packing, whereas the customary rule min r√(ρ/E) is not a bound.
#[test]
fn the_bound_of_concrete_is_tight_and_the_customary_rule_is_not_a_bound() {
    let packing = random_packing(1, 12e-3);
    let state = bonded(particles(&packing, DENSITY), None, law(&concrete()), 1.5);
    brackets("concrete", &state, 300);
    let customary = time_step::p_wave(&state.particles, concrete().young);
    println!("customary rule: {:.3} of the spectral bound", customary / time_step::bounds(&state).spectral);
    let single = block(Lattice::SimpleCubic, [2, 1, 1], LinearBond::new(1.0, 0.4, 0.0, 1.0, 1.0).unwrap());
    let soft = time_step::p_wave(&single.particles, 1e-6);
    assert!(
        soft > time_step::bounds(&single).spectral,
        "with a modulus that is not that of the bonds, the rule exceeds the bound"
    );
}
