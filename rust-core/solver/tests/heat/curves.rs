//! Thermal constants that vary with the temperature.

use concordem_packing::Random;
use concordem_solver::Solver;
use concordem_solver::heat::implicit::to_steady_state;
use concordem_solver::heat::network;
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::heat::{Curve, Curves, HeatModel, Held, MaterialCurves, Source, Spread, ThermalMaterial};
use concordem_solver::state::{Particles, State};

use super::{PLAIN, cubes, lattice, model, run, scattered, stable_step, temperatures, unit_cube};

/// Factors that rise from 1 at 300 K to `capacity` and `conductivity` at 500 K; the expansion doubles.
fn rising(particles: &Particles, capacity: f64, conductivity: f64) -> Curves {
    let of = |factor: f64| Some(Curve::new(vec![300.0, 500.0], vec![1.0, factor]));
    let material = MaterialCurves {
        specific_heat: of(capacity),
        conductivity: of(conductivity),
        expansion: of(2.0),
        ..MaterialCurves::default()
    };
    Curves { materials: vec![material], of: particles.material.clone() }
}

/// Heat at constant power into a particle whose capacity rises linearly: `C (θ + ½ a θ²) = P t` with `θ = T − 300 K`, beyond the table with
/// the last capacity. Explicit and implicit, whatever the step.
#[test]
fn a_particle_takes_up_the_heat_under_its_curve() {
    for implicit in [false, true] {
        let particles = cubes([1, 1, 1]);
        let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
        heat.curves = rising(&particles, 3.0, 1.0);
        heat.implicit = implicit;
        heat.supply.sources.push(Source { power: 60.0, spread: Spread::Shares(vec![(0, 1.0)]) });
        let (mut state, mut solver) = run(heat.clone(), particles, vec![300.0], 0.5);
        let slope = 2.0 / 200.0;
        for step in 1..=100 {
            solver.step(&mut state).unwrap();
            // Heat over the capacity of 3 J/K; 400 K up to the end of the table.
            let rise = 60.0 * 0.5 * f64::from(step) / 3.0;
            let expected = if rise < 400.0 {
                ((1.0 + 2.0 * slope * rise).sqrt() - 1.0) / slope
            } else {
                200.0 + (rise - 400.0) / 3.0
            };
            // Some roundings of the temperature per step.
            assert!((temperatures(&state)[0] - 300.0 - expected).abs() < 1e-11, "{implicit} {step}");
        }
        assert!(temperatures(&state)[0] > 500.0);
        let found = state.heat.as_ref().unwrap();
        assert!(heat.residual(found).abs() < 1e-14 * heat.content(found));
    }
}

/// Heat stays to 1e-14 of the content with capacities and conductivities that vary; a step at the bound of `check` keeps all
/// temperatures within those around them.
#[test]
fn heat_is_conserved_under_curves() {
    for (implicit, steps) in [(false, 20_000), (true, 300)] {
        let particles = scattered(120, 7);
        let mut heat = model(network::power(&particles, None, &unit_cube(), false).unwrap(), &particles, &[PLAIN]);
        heat.curves = rising(&particles, 4.0, 3.0);
        heat.implicit = implicit;
        let mut random = Random::new(1);
        let start: Vec<f64> = (0..120).map(|_| 250.0 + 350.0 * random.uniform()).collect();
        let (mut state, mut solver) = run(heat.clone(), particles, start, 1.0);
        state.clock.dt = stable_step(&solver, &state) * if implicit { 30.0 } else { 1.0 };
        // The heat relative to 300 K may nearly vanish; that relative to 0 K does not.
        let scale = heat.capacity.iter().sum::<f64>() * 300.0;
        let content = heat.content(state.heat.as_ref().unwrap());
        let range = |state: &State| {
            let values = temperatures(state);
            let low = values.iter().copied().fold(f64::INFINITY, f64::min);
            [low, values.iter().copied().fold(0.0, f64::max)]
        };
        let mut before = range(&state);
        for _ in 0..steps {
            solver.step(&mut state).unwrap();
            let [low, high] = range(&state);
            // One rounding.
            assert!(low >= before[0] - 1e-13 * low && high <= before[1] + 1e-13 * high, "{implicit}");
            before = [low, high];
        }
        let error = (heat.content(state.heat.as_ref().unwrap()) - content) / scale;
        assert!(error.abs() < 1e-14, "{implicit} {error:e}");
        assert_eq!(heat.residual(state.heat.as_ref().unwrap()).abs(), (error * scale).abs());
    }
}

/// Steady bar between 300 and 500 K whose conductivity triples: `∫λ dT` is linear along it (Kirchhoff). Links take the conductivities of
/// both ends in series, so the error falls with the square of the spacing.
#[test]
fn a_steady_bar_follows_kirchhoff() {
    let error = |count: usize| {
        let particles = cubes([count, 1, 1]);
        let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
        heat.curves = rising(&particles, 1.0, 3.0);
        for (p, temperature) in [(0, 300.0), (count as u32 - 1, 500.0)] {
            heat.supply.held.push(Held { particles: vec![p], temperature });
        }
        let mut found = heat.start(vec![300.0; count]);
        let state = State { particles: particles.clone(), heat: Some(found.clone()), ..State::default() };
        let mut pass = HeatPass::new(&heat, &state);
        to_steady_state(&heat, &particles, &mut pass, &mut found).unwrap();
        let at = |p: usize| {
            // θ + ½ a θ² = 400 x with a = 2/200.
            let x = p as f64 / (count - 1) as f64;
            300.0 + 100.0 * ((1.0 + 0.02 * 400.0 * x).sqrt() - 1.0)
        };
        (0..count).map(|p| (found.temperature[p] - at(p)).abs()).fold(0.0, f64::max)
    };
    let [coarse, fine] = [error(11), error(21)];
    // Half a percent of the difference.
    assert!(coarse < 1.0, "{coarse}");
    assert!((3.5..4.5).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// With curves, backward Euler converges to the explicit solution in proportion to its step.
#[test]
fn implicit_steps_agree_with_explicit_ones_under_curves() {
    let particles = cubes([12, 1, 1]);
    let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
    heat.curves = rising(&particles, 3.0, 2.0);
    heat.supply.held.push(Held { particles: vec![0], temperature: 500.0 });
    let at_end = |implicit: bool, steps: usize| {
        let heat = HeatModel { implicit, ..heat.clone() };
        let (mut state, mut solver): (State, Solver) =
            run(heat, particles.clone(), vec![300.0; 12], 40.0 / steps as f64);
        for _ in 0..steps {
            solver.step(&mut state).unwrap();
        }
        temperatures(&state).to_vec()
    };
    let exact = at_end(false, 20_000);
    let error = |steps: usize| at_end(true, steps).iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    let [coarse, fine] = [error(100), error(200)];
    assert!((1.8..2.2).contains(&(coarse / fine)), "{coarse} {fine}");
}

/// The thermal strain is the area under the curve of the expansion, `α (θ + ½ θ²/200 K)` here.
#[test]
fn strains_are_areas_under_the_curve() {
    let particles = cubes([2, 1, 1]);
    let material = ThermalMaterial { expansion: 1e-5, ..PLAIN };
    let mut heat = model(lattice(&particles), &particles, &[material]);
    heat.curves = rising(&particles, 1.0, 1.0);
    for (temperature, area) in [(400.0, 125.0), (500.0, 300.0), (600.0, 500.0), (200.0, -100.0)] {
        // Some roundings.
        assert!((heat.strain(0, temperature) / (1e-5 * area) - 1.0).abs() < 1e-15 * 8.0, "{temperature}");
        let gained = heat.strain_of(0, 350.0, temperature - 350.0) + heat.strain(0, 350.0);
        assert!((gained / heat.strain(0, temperature) - 1.0).abs() < 1e-14, "{temperature}");
    }
}
