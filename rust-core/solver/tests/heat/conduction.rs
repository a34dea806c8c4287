use concordem_contact::law::LinearBond;
use concordem_contact::math::Vec3;
use concordem_operator::HalfSpace;
use concordem_packing::Random;
use concordem_solver::heat::implicit::to_steady_state;
use concordem_solver::heat::network::{self, Exposure, Plane};
use concordem_solver::heat::supply::{Factors, STEFAN_BOLTZMANN};
use concordem_solver::heat::{Exchange, HeatModel, Held, Source, Spread, SurfaceExchange, ThermalMaterial};
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Excluded, Model, PairCoefficients, Solver};

use super::{PLAIN, cubes, lattice, model, run, scattered, stable_step, temperatures, unit_cube};

/// (3.10): the ordered network of a simple cubic lattice is the 7-point stencil. Both sum six terms of order 1, so they differ by a
/// few roundings of the temperatures per step.
#[test]
fn a_cubic_lattice_is_the_seven_point_stencil() {
    let counts = [7, 6, 5];
    let particles = cubes(counts);
    let heat = model(lattice(&particles), &particles, &[PLAIN]);
    // Mass 1 in the volume 1: c ρ V = 3. Diffusivity 2/3, spacing 1.
    let (diffusivity, dt) = (2.0 / 3.0, 0.2);
    assert!(heat.capacity.iter().all(|c| (c - 3.0).abs() < 1e-14));
    let mut random = Random::new(3);
    let mut expected: Vec<f64> = (0..particles.len()).map(|_| random.uniform()).collect();
    let (mut state, mut solver) = run(heat, particles, expected.clone(), dt);
    let strides = [1, counts[0], counts[0] * counts[1]];
    for _ in 0..50 {
        solver.step(&mut state).unwrap();
        let old = expected.clone();
        for (p, now) in expected.iter_mut().enumerate() {
            for k in 0..3 {
                let at = p / strides[k] % counts[k];
                for q in [(at > 0).then(|| p - strides[k]), (at + 1 < counts[k]).then(|| p + strides[k])] {
                    *now += q.map_or(0.0, |q| diffusivity * dt * (old[q] - old[p]));
                }
            }
        }
    }
    let worst = expected.iter().zip(temperatures(&state)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 50.0 * 2.0 * f64::EPSILON, "{worst:e}");
}

/// A linear field is steady in the network of a power diagram, up to the surface, where only the hot and the cold face exchange heat.
/// Rounding of the areas, relative to the flow through a single face.
#[test]
fn a_linear_field_is_steady_in_a_power_diagram() {
    let particles = scattered(300, 5);
    let gradient = Vec3::new(40.0, 0.0, 0.0);
    let field = |x: &Vec3| 300.0 + gradient.dot(x);
    let mut heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN]);
    // The cells fill the cube, and its faces bound it.
    assert!((heat.network.volume.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    for (plane, temperature) in [(0, 300.0), (1, 340.0)] {
        let exposures: Vec<Exposure> =
            heat.network.exposures.iter().filter(|exposure| exposure.face == plane).copied().collect();
        assert!((exposures.iter().map(|exposure| exposure.area).sum::<f64>() - 1.0).abs() < 1e-12);
        heat.supply.surfaces.push(SurfaceExchange { exposures, exchange: Exchange::Temperature(temperature) });
    }
    let start: Vec<f64> = particles.position.iter().map(field).collect();
    let (mut state, mut solver) = run(heat.clone(), particles.clone(), start.clone(), 1.0);
    state.clock.dt = 0.5 * stable_step(&solver, &state);
    for _ in 0..100 {
        solver.step(&mut state).unwrap();
    }
    let worst = start.iter().zip(temperatures(&state)).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-11, "{worst:e}");
    // As much flows in as out: λ times the gradient through the unit cross-section.
    let mut found = state.heat.clone().unwrap();
    let mut pass = solver.heat().unwrap().clone();
    found.temperature.fill(310.0);
    to_steady_state(&heat, &particles, &mut pass, &mut found).unwrap();
    let worst = start.iter().zip(&found.temperature).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(worst < 1e-8, "{worst:e}");
}

/// The mean flux of the linear field is `−λ ∇T` along the gradient. The sum over links and the ways to the faces fills the cube: rounding.
#[test]
fn the_flux_of_a_linear_field_is_exact() {
    let particles = scattered(300, 5);
    let mut heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN]);
    for (plane, temperature) in [(0, 300.0), (1, 340.0)] {
        let exposures = heat.network.exposures.iter().filter(|exposure| exposure.face == plane).copied().collect();
        heat.supply.surfaces.push(SurfaceExchange { exposures, exchange: Exchange::Temperature(temperature) });
    }
    let start = particles.position.iter().map(|x| 300.0 + 40.0 * x.x).collect();
    let (state, solver) = run(heat.clone(), particles.clone(), start, 1.0);
    let flows = solver.heat().unwrap().flows(&heat, &particles, None, state.heat.as_ref().unwrap());
    let flux: Vec3 = flows.branch.iter().zip(&flows.flow).map(|(branch, flow)| branch * *flow).sum();
    assert!((flux.x / (-2.0 * 40.0) - 1.0).abs() < 1e-12, "{flux}");
}

/// Heat runs around a periodic row without a mean flux, wherever its particles are wrapped to: a link across the border is as long as
/// the others. In a row without a border between the ends, the mean flux is that between the ends.
#[test]
fn links_across_the_border_have_their_image() {
    let cell = concordem_solver::state::Cell::new_box(Vec3::new(4.0, 9.0, 9.0));
    let flux = |cell: Option<&concordem_solver::state::Cell>, wrapped: bool| {
        let mut particles = cubes([4, 1, 1]);
        let pairs = network::touching(&particles, cell, 1.0).unwrap();
        let heat = model(network::ordered(&particles, &pairs, &[], false), &particles, &[PLAIN]);
        if wrapped {
            particles.position[3].x -= 4.0;
        }
        let (state, solver) = run(heat.clone(), particles.clone(), vec![1.0, 0.0, 0.0, 0.5], 1.0);
        let flows = solver.heat().unwrap().flows(&heat, &particles, cell, state.heat.as_ref().unwrap());
        flows.branch.iter().zip(&flows.flow).map(|(branch, flow)| branch * *flow).sum::<Vec3>()
    };
    assert_eq!([flux(Some(&cell), false), flux(Some(&cell), true)], [Vec3::zeros(); 2]);
    // Conductivity 2, area and spacing 1.
    assert_eq!(flux(None, false), Vec3::new(1.0, 0.0, 0.0));
}

/// Without exchange with the outside, the heat content stays to 1e-14 of itself over 10⁵ steps, also near the end where the changes
/// of single temperatures fall below their rounding. Disordered network, explicit and implicit.
#[test]
fn heat_is_conserved() {
    for (implicit, steps) in [(false, 100_000), (true, 2_000)] {
        let particles = scattered(120, 7);
        let pairs = network::touching(&particles, None, 1.1).unwrap();
        let mut heat = model(network::disordered(&particles, &pairs, &[]), &particles, &[PLAIN]);
        heat.implicit = implicit;
        let mut random = Random::new(1);
        let start: Vec<f64> = (0..120).map(|_| 400.0 + 300.0 * random.uniform()).collect();
        let (mut state, mut solver) = run(heat.clone(), particles, start, 1.0);
        state.clock.dt = stable_step(&solver, &state) * if implicit { 30.0 } else { 0.9 };
        let content = heat.content(state.heat.as_ref().unwrap());
        for _ in 0..steps {
            solver.step(&mut state).unwrap();
        }
        let error = heat.content(state.heat.as_ref().unwrap()) / content - 1.0;
        assert!(error.abs() < 1e-14, "{implicit} {error:e}");
        assert_eq!(heat.residual(state.heat.as_ref().unwrap()).abs() / content, error.abs());
    }
}

/// The explicit step keeps all temperatures within those of the start up to its bound, and diverges beyond twice the bound, where the
/// largest eigenvalue lies at most (Gershgorin); on a bipartite lattice without border it lies there.
#[test]
fn explicit_steps_are_stable_up_to_the_bound() {
    let cell = concordem_solver::state::Cell::new_box(Vec3::repeat(4.0));
    let particles = cubes([4, 4, 4]);
    let pairs = network::touching(&particles, Some(&cell), 1.0).unwrap();
    let heat = model(network::ordered(&particles, &pairs, &[], false), &particles, &[PLAIN]);
    for (fraction, stable) in [(0.999, true), (1.01, false)] {
        let start: Vec<f64> = particles
            .position
            .iter()
            .map(|x| if ((x.x + x.y + x.z) as usize).is_multiple_of(2) { 1.0 } else { 0.0 })
            .collect();
        let (mut state, mut solver) = run(heat.clone(), particles.clone(), start, 1.0);
        // `Δt ≤ h²/(6 a)` of the lattice.
        let bound = stable_step(&solver, &state);
        assert!((bound * 2.0 / 3.0 * 6.0 - 1.0).abs() < 1e-14, "{bound}");
        state.clock.dt = fraction * bound;
        for _ in 0..1000 {
            solver.step(&mut state).unwrap();
        }
        let most = temperatures(&state).iter().fold(0.0, |most: f64, t| most.max((t - 0.5).abs()));
        assert_eq!(most <= 0.5, stable, "{fraction} {most}");
    }
}

/// Backward Euler converges to the explicit solution with the first order of its step, and takes steps far beyond the explicit bound.
#[test]
fn implicit_steps_agree_with_explicit_ones() {
    let particles = scattered(200, 11);
    let mut heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN]);
    let exposures = heat.network.exposures.iter().filter(|e| e.face == 0).copied().collect();
    heat.supply.surfaces.push(SurfaceExchange { exposures, exchange: Exchange::Temperature(400.0) });
    let at_end = |implicit: bool, dt: f64, steps: usize| {
        let heat = HeatModel { implicit, ..heat.clone() };
        let (mut state, mut solver) = run(heat, particles.clone(), vec![300.0; 200], dt);
        for _ in 0..steps {
            solver.step(&mut state).unwrap();
        }
        assert!(solver.model().heat.as_ref().unwrap().residual(state.heat.as_ref().unwrap()).abs() < 1e-9);
        temperatures(&state).to_vec()
    };
    let (state, solver) = run(heat.clone(), particles.clone(), vec![300.0; 200], 1.0);
    let bound = stable_step(&solver, &state);
    let count = 6400;
    let fine = at_end(false, 0.25 * bound, 4 * count);
    let distance = |other: &[f64]| fine.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let errors = [25, 50, 100, 200].map(|steps| distance(&at_end(true, bound * (count / steps) as f64, steps)));
    // The step of the first one is 256 times the bound.
    assert!(errors[0] < 2.0, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 2.0).abs() < 0.2, "{errors:?}");
    }
}

/// One particle with an area of 3 m² exchanges heat with an ambient at 400 K.
fn lumped(exchange: Exchange, implicit: bool, dt: f64, steps: usize) -> (f64, f64) {
    let mut particles = Particles::default();
    particles.push(Sphere { position: Vec3::zeros(), radius: 0.5 }, 0, 2.0, 0.1);
    let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
    heat.implicit = implicit;
    let exposures = vec![Exposure { particle: 0, face: 0, area: 3.0, distance: 0.25, normal: Vec3::x() }];
    heat.supply.surfaces.push(SurfaceExchange { exposures, exchange });
    let (mut state, mut solver) = run(heat.clone(), particles, vec![300.0], dt);
    for _ in 0..steps {
        solver.step(&mut state).unwrap();
    }
    (state.heat.as_ref().unwrap().temperature[0], heat.residual(state.heat.as_ref().unwrap()))
}

/// A particle of capacity `C = 6 J/K` follows `(1 − GΔt/C)ⁿ` in explicit and `(1 + GΔt/C)⁻ⁿ` in implicit steps toward the temperature
/// outside. Rounding over 50 steps.
#[test]
fn a_single_particle_follows_its_surface() {
    for (exchange, conductance) in [
        (Exchange::Temperature(400.0), 3.0 * 2.0 / 0.25),
        (Exchange::Convection { coefficient: 8.0, ambient: 400.0 }, 3.0 / (1.0 / 8.0 + 0.25 / 2.0)),
    ] {
        let ratio = 0.01 * conductance / 6.0;
        for (implicit, decay) in [(false, 1.0_f64 - ratio), (true, 1.0 / (1.0 + ratio))] {
            let (found, residual) = lumped(exchange, implicit, 0.01, 50);
            let expected = 400.0 - 100.0 * decay.powi(50);
            assert!((found - expected).abs() < 1e-11 && residual.abs() < 1e-11, "{exchange:?} {found} {expected}");
        }
    }
    let (found, _) = lumped(Exchange::Flux(5.0), false, 0.01, 50);
    assert!((found - (300.0 + 3.0 * 5.0 * 0.5 / 6.0)).abs() < 1e-11, "{found}");
    // The first step by radiation, and its end: the temperature outside.
    let black = Exchange::Radiation { emissivity: 0.5, ambient: 400.0 };
    let (found, _) = lumped(black, false, 0.01, 1);
    let flow = 3.0 * 0.5 * STEFAN_BOLTZMANN * (400f64.powi(4) - 300f64.powi(4));
    assert!((found - (300.0 + flow * 0.01 / 6.0)).abs() < 1e-12, "{found}");
    for implicit in [false, true] {
        let (found, residual) = lumped(black, implicit, 0.5, 400);
        assert!((found - 400.0).abs() < 1e-9 && residual.abs() < 1e-10, "{found}");
    }
}

/// A body with a source, a moving spot, a held end, and radiation: the balance of heat closes, and an implicit, an explicit, and the
/// steady solution agree at the end.
#[test]
fn the_balance_closes_and_the_steady_state_is_found() {
    let particles = scattered(250, 13);
    let mut heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN]);
    let hot: Vec<u32> = (0..250).filter(|&p| particles.position[p as usize].x < 0.2).collect();
    heat.supply.held.push(Held { particles: hot.clone(), temperature: 350.0 });
    let shares = (0..250).filter(|&p| particles.position[p as usize].y > 0.8).collect::<Vec<u32>>();
    let share = 1.0 / shares.len() as f64;
    heat.supply
        .sources
        .push(Source { power: 40.0, spread: Spread::Shares(shares.into_iter().map(|p| (p, share)).collect()) });
    let spread = Spread::Gaussian { center: Vec3::repeat(0.5), velocity: Vec3::zeros(), radius: 0.1 };
    heat.supply.sources.push(Source { power: 20.0, spread });
    let exposures = heat.network.exposures.iter().filter(|e| e.face == 1).copied().collect();
    let exchange = Exchange::Radiation { emissivity: 0.9, ambient: 290.0 };
    heat.supply.surfaces.push(SurfaceExchange { exposures, exchange });
    let mut ends = Vec::new();
    for implicit in [false, true] {
        let heat = HeatModel { implicit, ..heat.clone() };
        let (mut state, mut solver) = run(heat.clone(), particles.clone(), vec![300.0; 250], 1.0);
        state.clock.dt = stable_step(&solver, &state) * if implicit { 500.0 } else { 0.9 };
        let steps = if implicit { 100 } else { 40_000 };
        for _ in 0..steps {
            solver.step(&mut state).unwrap();
        }
        let end = state.heat.as_ref().unwrap();
        let power = end.ledger.sources.get() / state.clock.time();
        assert!((power / 60.0 - 1.0).abs() < 1e-12, "{power}");
        let residual = heat.residual(end);
        assert!(residual.abs() < 1e-13 * end.ledger.sources.get(), "{residual:e}");
        assert!(hot.iter().all(|&p| end.temperature[p as usize] == 350.0));
        ends.push(end.temperature.clone());
        let mut steady = heat.start(vec![300.0; 250]);
        let mut pass = solver.heat().unwrap().clone();
        for p in &hot {
            steady.temperature[*p as usize] = 350.0;
        }
        to_steady_state(&heat, &particles, &mut pass, &mut steady).unwrap();
        ends.push(steady.temperature);
    }
    for end in &ends[1..] {
        let worst = ends[0].iter().zip(end).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        // What is left of the slowest mode of the explicit run.
        assert!(worst < 1e-6, "{worst:e}");
    }
    // An insulated body with a source has no steady state.
    let mut heat = HeatModel { supply: heat.supply.clone(), ..heat };
    heat.supply.held.clear();
    heat.supply.surfaces.clear();
    let (state, solver) = run(heat.clone(), particles.clone(), vec![300.0; 250], 1.0);
    let (mut pass, mut steady) = (solver.heat().unwrap().clone(), state.heat.unwrap());
    assert!(to_steady_state(&heat, &particles, &mut pass, &mut steady).is_err());
}

/// Factors of histories multiply power, temperatures, and fluxes; a moving spot heats where it is.
#[test]
fn factors_and_moving_spots() {
    let particles = cubes([10, 1, 1]);
    let mut heat = model(lattice(&particles), &particles, &[ThermalMaterial { conductivity: 0.0, ..PLAIN }]);
    let spread = Spread::Gaussian { center: Vec3::new(2.0, 0.0, 0.0), velocity: Vec3::new(0.5, 0.0, 0.0), radius: 0.1 };
    heat.supply.sources.push(Source { power: 3.0, spread });
    heat.supply.held.push(Held { particles: vec![9], temperature: 100.0 });
    let (mut state, mut solver) = run(heat.clone(), particles, vec![300.0; 10], 1e-6);
    state.clock.dt = 2.0;
    for expected in [2, 3, 4] {
        let factors = Factors { sources: vec![2.0], held: vec![f64::from(expected)], ..Factors::default() };
        solver.set_heat_factors(factors);
        let before = temperatures(&state).to_vec();
        // The spot is half a spacing on in the middle of the step; both neighbors share its heat.
        solver.step(&mut state).unwrap();
        let warmed: Vec<f64> = temperatures(&state).iter().zip(&before).map(|(a, b)| a - b).collect();
        let share = 2.0 * 3.0 * 2.0 / 3.0 / 2.0;
        let at = expected as usize;
        assert!((warmed[at] - share).abs() < 1e-12 && (warmed[at + 1] - share).abs() < 1e-12, "{warmed:?}");
        assert_eq!(temperatures(&state)[9], 100.0 * f64::from(expected));
    }
    assert!(heat.residual(state.heat.as_ref().unwrap()).abs() < 1e-10);
}

/// Planes at the border of a lattice expose the faces of its cubes, 8 R² from the centers at R; a plane counts as a neighbor in the
/// disordered network.
#[test]
fn planes_expose_the_particles_at_them() {
    let particles = cubes([3, 3, 3]);
    let inside = HalfSpace { point: Vec3::new(-0.5, 0.0, 0.0), normal: Vec3::new(-2.0, 0.0, 0.0) };
    let planes = [Plane { inside, face: 0 }];
    let pairs = network::touching(&particles, None, 1.0).unwrap();
    for (found, area) in [
        (network::ordered(&particles, &pairs, &planes, false), 1.0),
        // The middle of the face has five neighbors and the plane.
        (network::disordered(&particles, &pairs, &planes), 1.0),
    ] {
        assert_eq!(found.exposures.len(), 9);
        let middle = found.exposures.iter().find(|e| e.particle == 12).unwrap();
        assert_eq!((middle.face, middle.area, middle.distance), (0, area, 0.5));
    }
}

/// Links of two materials lie in series, in proportion to the distances of the centers from the face.
#[test]
fn materials_conduct_in_series() {
    let mut particles = cubes([2, 1, 1]);
    particles.material[1] = 1;
    let other = ThermalMaterial { conductivity: 6.0, ..PLAIN };
    let (mut state, mut solver) =
        run(model(lattice(&particles), &particles, &[PLAIN, other]), particles, vec![300.0, 301.0], 1e-3);
    solver.step(&mut state).unwrap();
    let flow = 1.0 / (0.5 / 2.0 + 0.5 / 6.0);
    let warmed = temperatures(&state)[0] - 300.0;
    assert!((warmed - flow * 1e-3 / 3.0).abs() < 1e-12, "{warmed}");
}

/// The face between unequal spheres in a power diagram lies at x with `(x − a)² − r_a² = (x − b)² − r_b²`: 0.43 here, and the nearer sphere
/// has less of the resistance.
#[test]
fn unequal_halves_have_their_own_material() {
    let mut particles = Particles::default();
    for (x, radius, material) in [(0.3, 0.2, 0), (0.8, 0.4, 1)] {
        particles.push(Sphere { position: Vec3::new(x, 0.5, 0.5), radius }, material, 1.0, 0.1);
    }
    let other = ThermalMaterial { conductivity: 6.0, ..PLAIN };
    let heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN, other]);
    let capacity = heat.capacity[0];
    let (mut state, mut solver) = run(heat, particles, vec![300.0, 301.0], 1e-3);
    solver.step(&mut state).unwrap();
    let flow = 1.0 / (0.13 / 2.0 + 0.37 / 6.0);
    let warmed = temperatures(&state)[0] - 300.0;
    // Roundings of a temperature of 300 K.
    assert!((warmed - flow * 1e-3 / capacity).abs() < 1e-12, "{warmed}");
}

fn bonded(particles: Particles, strength: f64) -> State {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let law = LinearBond::new(100.0, 50.0, 0.0, strength, f64::INFINITY).unwrap();
    let mut bonds = concordem_solver::state::contacts::ContactBlock::new(vec![law]);
    concordem_packing::bonding::bond(&mut bonds, &rows, &particles, None, 1.01).unwrap();
    State { particles, bonds: vec![Box::new(bonds)], ..State::default() }
}

/// Where a bond breaks, its link gets the resistance of the crack in series; a diagonal face is cut with the last path of two bonds
/// around it.
#[test]
fn cracks_resist() {
    for (resistance, expected) in [(f64::INFINITY, 0.0), (1.5, 1.0 / (1.0 / 2.0 + 1.5))] {
        let mut state = bonded(cubes([2, 2, 1]), 1.0);
        let pairs = network::touching(&state.particles, None, 1.5).unwrap();
        assert_eq!(pairs.len(), 6);
        let mut heat = model(network::ordered(&state.particles, &pairs, &[], false), &state.particles, &[PLAIN]);
        heat.mechanics = true;
        heat.crack_resistance = resistance;
        state.heat = Some(heat.start(vec![300.0; 4]));
        state.clock.dt = 1e-3;
        // The right column moves away from the left one.
        for p in [1, 3] {
            state.particles.velocity[p].x = 40.0;
        }
        let mut solver = Solver::new(Model { heat: Some(heat.clone()), ..Model::default() }, &mut state).unwrap();
        let conductance = |solver: &Solver, p: usize, q: usize| {
            solver.heat().unwrap().links(p).find(|(other, _)| *other == q).unwrap().1
        };
        let before = conductance(&solver, 0, 3);
        solver.step(&mut state).unwrap();
        assert_eq!((conductance(&solver, 0, 1), conductance(&solver, 0, 3)), (2.0, before));
        solver.step(&mut state).unwrap();
        assert_eq!(state.broken.len(), 2);
        let diagonal = if resistance.is_finite() { 1.0 / (1.0 / before + 1.5) } else { 0.0 };
        assert!((conductance(&solver, 0, 1) - expected).abs() < 1e-15);
        assert!((conductance(&solver, 3, 0) - diagonal).abs() < 1e-15);
        assert_eq!(conductance(&solver, 0, 2), 2.0);
        // A solver that starts with the cracked state knows the cracks.
        let again = Solver::new(Model { heat: Some(heat), ..Model::default() }, &mut state).unwrap();
        assert_eq!(
            again.heat().unwrap().links(0).collect::<Vec<_>>(),
            solver.heat().unwrap().links(0).collect::<Vec<_>>()
        );
    }
}

/// The same bits for one and four threads, and after a restart from the columns of a state; explicit and implicit, with more than two
/// tiles of particles.
#[test]
fn the_same_bits_for_any_number_of_threads_and_after_a_restart() {
    let particles = cubes([16, 16, 12]);
    let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
    heat.supply.sources.push(Source {
        power: 5.0,
        spread: Spread::Gaussian { center: Vec3::repeat(4.0), velocity: Vec3::repeat(0.1), radius: 2.0 },
    });
    for implicit in [false, true] {
        heat.implicit = implicit;
        let mut random = Random::new(2);
        let start: Vec<f64> = (0..particles.len()).map(|_| 300.0 + random.uniform()).collect();
        let bits = |threads: usize, restart: bool| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| {
                let (mut state, mut solver) = run(heat.clone(), particles.clone(), start.clone(), 0.2);
                for step in 0..12 {
                    if restart && step == 5 {
                        let mut columns = ColumnStore::default();
                        state.write(&mut columns).unwrap();
                        let (mut other, _) = run(heat.clone(), particles.clone(), vec![0.0; particles.len()], 0.2);
                        other.read(&mut columns).unwrap();
                        state = other;
                        solver = Solver::new(solver.model().clone(), &mut state).unwrap();
                    }
                    solver.step(&mut state).unwrap();
                }
                let end = state.heat.unwrap();
                (end.temperature, end.correction, end.warming, end.ledger.to_reals())
            })
        };
        let one = bits(1, false);
        assert!(one == bits(4, false));
        assert!(one == bits(3, true));
    }
}

/// Subdomains, hosts that move particles of a model at rest, and states without temperatures are refused.
#[test]
fn what_is_not_supported_is_refused() {
    let particles = cubes([3, 1, 1]);
    let heat = model(lattice(&particles), &particles, &[PLAIN]);
    let (mut state, mut solver) = run(heat.clone(), particles, vec![300.0; 3], 1e-3);
    let message = solver.find_forces(&mut state, true).unwrap_err().to_string();
    assert!(message.contains("heat.motion = true"), "{message}");
    let with_heat = || Model { heat: Some(heat.clone()), ..Model::default() };
    let message =
        Solver::for_subdomain(with_heat(), &mut state, vec![true; 3], Excluded::default()).err().unwrap().to_string();
    assert!(message.contains("subdomains"), "{message}");
    state.heat = None;
    let message = Solver::new(with_heat(), &mut state).err().unwrap().to_string();
    assert!(message.contains("temperatures of all particles"), "{message}");
}
