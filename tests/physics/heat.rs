//! Heat conduction and thermal stress of whole bodies against analytical solutions.

use std::f64::consts::PI;

use nalgebra::{DMatrix, DVector};

use concordem::math::Vec3;
use concordem::schedule::Simulation;
use concordem::solver::heat::HeatModel;
use concordem::solver::heat::pass::HeatPass;
use concordem::state::State;
use concordem_tests::on_threads;
use concordem_tests::runs::{built, finish, made, run, started};

fn temperature(state: &State) -> &[f64] {
    &state.heat.as_ref().unwrap().temperature
}

fn heat(simulation: &Simulation) -> &HeatModel {
    simulation.solver.model().heat.as_ref().unwrap()
}

/// Value at x of the straight line through the temperatures of the particles within `reach` of x.
fn fitted(state: &State, x: f64, reach: f64) -> f64 {
    let near: Vec<(f64, f64)> = state
        .particles
        .position
        .iter()
        .zip(temperature(state))
        .map(|(position, t)| (position.x - x, *t))
        .filter(|(distance, _)| distance.abs() <= reach)
        .collect();
    let count = near.len() as f64;
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| near.iter().map(of).sum::<f64>() / count;
    let (x, t) = (mean(&|p| p.0), mean(&|p| p.1));
    let slope = mean(&|p| (p.0 - x) * (p.1 - t)) / mean(&|p| (p.0 - x) * (p.0 - x));
    t - slope * x
}

/// Jebahi et al. 2015, (3.14), with its cosine measured from the insulated end: temperature at the fraction `x` of the length from the
/// hot face, at the time `t` in units of L²/α.
fn hot_plane(x: f64, t: f64) -> f64 {
    let term = |n: u32| {
        let odd = f64::from(2 * n + 1);
        let sign = if n.is_multiple_of(2) { 1.0 } else { -1.0 };
        sign / odd * (0.5 * odd * PI * (1.0 - x)).cos() * (-0.25 * odd * odd * PI * PI * t).exp()
    };
    798.0 - 4.0 * 500.0 / PI * (0..200).map(term).sum::<f64>()
}

/// A prism of a random packing (Z near 6.2) of the spheres of table 3.2, with one hot face, otherwise insulated: largest error of the
/// temperature, as a fraction of the jump of 500 K, over three times and four places, and the diffusivity over that of the
/// material for which the mean errors are smallest.
fn hot_plane_errors(network: &str) -> (f64, f64) {
    let assembly = made(&format!(
        "version = 1
        [packing]
        kind = \"random-dense\"
        count = 1000
        radii = {{ kind = \"uniform\", minimum = \"7.873 um\", maximum = \"10.123 um\" }}
        seed = 4
        shape = {{ kind = \"box\", size = [\"0.36 mm\", \"0.14 mm\", \"0.14 mm\"], center = [\"0.18 mm\", 0, 0] }}
        [[material]]
        name = \"aluminum\"
        density = 2790
        thermal = {{ specific_heat = \"880 J/kg/K\", conductivity = \"134 W/m/K\", bulk_density = 2790 }}
        [contacts]
        law = \"none\"
        [heat]
        {network}
        temperature = \"298 K\"
        motion = false
        [[heat.boundary]]
        face = \"x minimum\"
        temperature = \"798 K\"
        [stop]
        steps = 1000000"
    ));
    let mut simulation = started(assembly);
    let diffusivity = 134.0 / (880.0 * 2790.0);
    let unit = 0.36e-3 * 0.36e-3 / diffusivity;
    let mut found = Vec::new();
    // Times of 5, 20, and 80 ms for the length of 2.184 mm.
    for time in [0.0572, 0.2288, 0.9154] {
        while simulation.state.clock.time() < time * unit {
            simulation.advance().unwrap();
        }
        let time = simulation.state.clock.time() / unit;
        for x in [0.125, 0.25, 0.5, 0.75] {
            found.push((x, time, fitted(&simulation.state, x * 0.36e-3, 20e-6)));
        }
    }
    let errors =
        |factor: f64| found.iter().map(|(x, t, found)| (found - hot_plane(*x, factor * t)) / 500.0).collect::<Vec<_>>();
    let squares = |factor: f64| errors(factor).iter().map(|e| e * e).sum::<f64>();
    let best = (0..600).map(|k| 0.6 + 1e-3 * f64::from(k)).min_by(|a, b| squares(*a).total_cmp(&squares(*b))).unwrap();
    let worst = errors(1.0).iter().fold(0.0, |worst: f64, e| worst.max(e.abs()));
    println!(
        "{network}: {} particles, worst error {worst:.4}, diffusivity {best:.3}",
        simulation.state.particles.len()
    );
    (worst, best)
}

/// The analytical temperatures of the table for 2.184 mm, to its rounding.
#[test]
fn the_series_gives_the_table() {
    let unit = 2.184e-3 * 2.184e-3 / 5.4578e-5;
    for (time, x, expected) in
        [(0.005, 0.125, 653.87), (0.005, 0.5, 367.69), (0.02, 0.25, 658.27), (0.02, 1.0, 437.36), (0.08, 0.75, 736.54)]
    {
        let found = hot_plane(x, time / unit);
        assert!((found - expected).abs() < 0.02, "{time} {x} {found}");
    }
}

/// A body before a hot plane (Jebahi et al. 2015, 3.5.1): the power diagram within 1 % of the analytical temperatures. In the printed
/// method, spheres at an insulated surface have fewer neighbors, hence too much heat capacity, which adds to its bias in the bulk
/// (next test): in a prism of 15 radii it is this far off.
#[test]
fn a_hot_plane_heats_a_prism() {
    let (worst, diffusivity) = hot_plane_errors("model = \"power\"");
    assert!(worst < 0.01 && (diffusivity - 1.0).abs() < 0.01, "{worst} {diffusivity}");
    let (worst, diffusivity) = hot_plane_errors("model = \"disordered\"\ncontact_ratio = 1.001");
    assert!(worst < 0.13 && diffusivity > 0.6 && diffusivity < 1.0, "{worst} {diffusivity}");
}

/// Diffusivity of a periodic random packing over that of the material, from the decay of a wave of temperature as long as the cell, and
/// the number of links per particle.
fn bulk_diffusivity(network: &str) -> (f64, f64) {
    let mut simulation = started(made(&format!(
        "version = 1
        [packing]
        kind = \"random-dense\"
        count = 800
        radii = {{ kind = \"uniform\", minimum = \"7.873 um\", maximum = \"10.123 um\" }}
        seed = 5
        shape = {{ kind = \"periodic\" }}
        [[material]]
        name = \"aluminum\"
        density = 2790
        thermal = {{ specific_heat = \"880 J/kg/K\", conductivity = \"134 W/m/K\", bulk_density = 2790 }}
        [contacts]
        law = \"none\"
        [heat]
        {network}
        temperature = \"298 K\"
        motion = false
        [stop]
        steps = 1000000"
    )));
    let wave = 2.0 * PI / simulation.state.cell.unwrap().matrix[(0, 0)];
    let phase = |state: &State, p: usize| (wave * state.particles.position[p].x).sin();
    for p in 0..simulation.state.particles.len() {
        let warmer = 10.0 * phase(&simulation.state, p);
        simulation.state.heat.as_mut().unwrap().temperature[p] += warmer;
    }
    let unit = 1.0 / (134.0 / (880.0 * 2790.0) * wave * wave);
    let amplitude = |simulation: &mut Simulation, time: f64| {
        while simulation.state.clock.time() < time * unit {
            simulation.advance().unwrap();
        }
        let capacity = &heat(simulation).capacity;
        // Spheres without a neighbor take no part.
        let pass = simulation.solver.heat().unwrap();
        let sum: f64 = (0..capacity.len())
            .filter(|&p| pass.links(p).next().is_some())
            .map(|p| capacity[p] * phase(&simulation.state, p) * (temperature(&simulation.state)[p] - 298.0))
            .sum();
        (simulation.state.clock.time() / unit, sum)
    };
    let (early, late) = (amplitude(&mut simulation, 0.1), amplitude(&mut simulation, 0.6));
    let links = 2.0 * heat(&simulation).network.links.len() as f64 / simulation.state.particles.len() as f64;
    let found = (early.1 / late.1).ln() / (late.0 - early.0);
    println!("{network}: diffusivity {found:.4}, {links:.2} links per particle");
    (found, links)
}

/// In the bulk, the power diagram has the diffusivity of the material within 1 %. The printed method is too low at 6.2 contacts per sphere,
/// by some 10 % in this packing; its diffusivity rises with the number of contacts.
#[test]
fn the_bulk_diffuses_heat() {
    let (power, _) = bulk_diffusivity("model = \"power\"");
    assert!((power - 1.0).abs() < 0.01, "{power}");
    let (disordered, links) = bulk_diffusivity("model = \"disordered\"\ncontact_ratio = 1.001");
    assert!((disordered - 1.0).abs() < 0.12 && (links - 6.2).abs() < 0.4, "{disordered} {links}");
}

/// Steady temperatures from the whole matrix: Newton steps with Cholesky factors.
fn factored_steady_state(model: &HeatModel, state: &State) -> Vec<f64> {
    let particles = &state.particles;
    let n = particles.len();
    let mut heat = state.heat.clone().unwrap();
    let mut pass = HeatPass::new(model, state);
    for held in &model.supply.held {
        for &p in &held.particles {
            heat.temperature[p as usize] = held.temperature;
        }
    }
    for _ in 0..20 {
        let (rate, slope) = pass.rates(model, particles, &heat, 0.0);
        let mut load = DVector::from_column_slice(rate);
        let mut matrix = DMatrix::from_diagonal(&DVector::from_column_slice(slope));
        for p in 0..n {
            for (other, conductance) in pass.links(p) {
                matrix[(p, p)] += conductance;
                matrix[(p, other)] -= conductance;
            }
        }
        for p in (0..n).filter(|&p| pass.is_held(p)) {
            matrix.row_mut(p).fill(0.0);
            matrix.column_mut(p).fill(0.0);
            matrix[(p, p)] = 1.0;
            load[p] = 0.0;
        }
        let change = matrix.cholesky().unwrap().solve(&load);
        for (temperature, change) in heat.temperature.iter_mut().zip(&change) {
            *temperature += change;
        }
        if change.amax() < 1e-9 {
            return heat.temperature;
        }
    }
    panic!("the temperatures do not settle");
}

/// A body with a hot and a cold face, convection, radiation, and a source: the steady state that a run starts from agrees with the one
/// from a factor of the whole matrix, and a run from it does not change it.
#[test]
fn the_steady_state_is_that_of_a_factor() {
    let mut simulation = started(made(
        r#"version = 1
        [packing]
        kind = "random-dense"
        count = 300
        radius = "1 mm"
        shape = { kind = "cylinder", radius = "6 mm", height = "20 mm" }
        [[material]]
        name = "glass"
        density = 2500
        thermal = { specific_heat = "800 J/kg/K", conductivity = "1.1 W/m/K" }
        [contacts]
        law = "none"
        [heat]
        temperature = "300 K"
        steady = true
        motion = false
        [[heat.boundary]]
        face = "z minimum"
        temperature = "700 K"
        [[heat.boundary]]
        face = "z maximum"
        convection = { coefficient = "200 W/m^2/K", ambient = "300 K" }
        [[heat.boundary]]
        face = "side"
        radiation = { emissivity = 0.9, ambient = "300 K" }
        [[heat.source]]
        spot = { center = [0, 0, "4 mm"], radius = "2 mm" }
        power = "0.5 W"
        [stop]
        steps = 500"#,
    ));
    let start = temperature(&simulation.state).to_vec();
    let direct = factored_steady_state(heat(&simulation), &simulation.state);
    let distance = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // The iteration ends at a change of 1e-11 of the temperature.
    assert!(distance(&start, &direct) < 1e-7, "{:e}", distance(&start, &direct));
    assert!(start.iter().all(|t| *t > 300.0 && *t < 700.0));
    let spread =
        start.iter().fold(0.0, |most: f64, t| most.max(*t)) - start.iter().fold(1e9, |least: f64, t| least.min(*t));
    assert!(spread > 100.0, "{spread}");
    finish(&mut simulation);
    assert!(distance(&start, temperature(&simulation.state)) < 1e-7);
}

/// A strip of two metals of equal stiffness and thickness that differ in expansion by Δα bends to the curvature `3/2 Δα ΔT/h`
/// (Timoshenko 1925, (4) with m = n = 1). A lattice of r rows has `(r²−1)/r²` of the moment of inertia of the strip.
#[test]
fn a_bimetal_strip_bends() {
    let (rows, columns, radius) = (10, 66, 0.5e-3);
    let height = 3.0_f64.sqrt() * radius;
    let spheres: Vec<[f64; 4]> = (0..rows)
        .flat_map(|row| {
            let shift = if row % 2 == 0 { 0.0 } else { radius };
            (0..columns)
                .map(move |column| [2.0 * radius * f64::from(column) + shift, height * f64::from(row), 0.0, radius])
        })
        .collect();
    let simulation = run(&format!(
        "version = 1
        dimension = 2
        [packing]
        kind = \"spheres\"
        spheres = {spheres:?}
        [[material]]
        name = \"invar\"
        density = 8000
        linear_bond = {{ normal_stiffness = 1e8, shear_stiffness = 3e7 }}
        thermal = {{ specific_heat = 500, conductivity = 10 }}
        [[material]]
        name = \"brass\"
        density = 8000
        linear_bond = {{ normal_stiffness = 1e8, shear_stiffness = 3e7 }}
        thermal = {{ specific_heat = 500, conductivity = 10, expansion = \"2e-5 1/K\" }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [[set]]
        name = \"upper\"
        selection = {{ kind = \"layer\", axis = \"y\", end = \"maximum\", thickness = {} }}
        material = \"brass\"
        [heat]
        model = \"ordered\"
        temperature = \"393 K\"
        reference_temperature = \"293 K\"
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.2 }}
        [stop]
        unbalanced = 1e-5
        steps = 400000",
        4.5 * height + radius,
    ));
    // Curvature of the middle two thirds of a row in the middle, by a parabola through three mean positions.
    let state = &simulation.state;
    let mean = |low: u32, high: u32| -> Vec3 {
        let chosen: Vec<Vec3> = (0..state.particles.len())
            .filter(|&p| (4 * columns + low..4 * columns + high).contains(&state.particles.id[p]))
            .map(|p| state.particles.position[p])
            .collect();
        chosen.iter().sum::<Vec3>() / chosen.len() as f64
    };
    let (a, b, c) = (mean(11, 16), mean(30, 35), mean(49, 54));
    let (ab, bc, ac) = (b - a, c - b, c - a);
    // Curvature of the circle through three points.
    let curvature = 2.0 * (ab.x * bc.y - ab.y * bc.x) / (ab.norm() * bc.norm() * ac.norm());
    let thickness = height * f64::from(rows);
    let lattice = 1.0 - 1.0 / f64::from(rows * rows);
    let exact = -1.5 * 2e-5 * 100.0 / thickness;
    println!("curvature {:.4} of Timoshenko's after {} steps", curvature / exact, state.clock.step);
    assert!((curvature * lattice / exact - 1.0).abs() < 0.02, "{}", curvature / exact);
}

/// A plate of springs, hot at 293 K + ΔT, whose lower face is cooled to 293 K: bonds along the face are held at their length, so they
/// carry `k l α ΔT` at most. The plate survives a shock of 0.9 of the strength, and cracks from the face under twice the strength,
/// but not through: below the face it stays in compression.
#[test]
fn a_brittle_plate_cracks_under_a_shock() {
    let shock = |fraction: f64| {
        let change = fraction * 100.0;
        let mut simulation = started(made(&format!(
            "version = 1
            dimension = 2
            [packing]
            kind = \"lattice\"
            lattice = \"triangular\"
            radius = \"0.5 mm\"
            repeats = [30, 12, 1]
            [[material]]
            name = \"glass\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e8, shear_stiffness = 3e7, normal_strength = 100, shear_strength = 1e9, damping_ratio = 0.02 }}
            thermal = {{ specific_heat = 800, conductivity = 1, expansion = \"1e-5 1/K\" }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.01
            [contacts]
            law = \"none\"
            [heat]
            temperature = {}
            time_factor = 2e4
            [[heat.boundary]]
            face = \"y minimum\"
            temperature = 293
            [integration]
            damping = {{ kind = \"local\", coefficient = 0.3 }}
            [stop]
            steps = 12000",
            293.0 + change
        )));
        finish(&mut simulation);
        let state = simulation.state;
        let low = state.particles.position.iter().map(|x| x.y).fold(f64::INFINITY, f64::min);
        let depths: Vec<f64> =
            state.broken.iter().map(|bond| state.particles.position[bond.pair.a as usize].y - low).collect();
        let coldest = temperature(&state).iter().copied().fold(f64::INFINITY, f64::min);
        (depths, state.bond_count(), coldest)
    };
    // `φ_n = k l α ΔT`: 100 N = 1e8 × 1e-3 × 1e-5 × 100 K.
    let (depths, _, coldest) = shock(0.9);
    assert!(depths.is_empty() && coldest < 293.0 + 20.0, "{} {coldest}", depths.len());
    let (depths, bonds, _) = shock(2.0);
    println!("{} broken of {bonds}, deepest {:?}", depths.len(), depths.iter().copied().fold(0.0, f64::max));
    assert!(depths.len() > 3 && depths.len() < bonds / 4, "{}", depths.len());
    assert!(depths[0] < 1.1e-3, "{}", depths[0]);
}

/// The same bits on one and four threads and after a restart for a periodic cell of a concrete that is heated by a source.
#[test]
fn a_heated_periodic_cell_repeats() {
    let text = r#"version = 1
        [packing]
        kind = "lattice"
        lattice = "bcc"
        radius = "1 mm"
        repeats = [8, 8, 10]
        shape = { kind = "periodic" }
        [[material]]
        name = "concrete"
        density = 2400
        cpm = { young = "25 GPa", shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = 30, cohesion = "3 MPa", friction_coefficient = 0.8 }
        thermal = { specific_heat = 900, conductivity = 1.5, expansion = "1e-5 1/K", variation = { temperature = [293, 320], stiffness = [1, 0.6], strength = [1, 0.4] } }
        [bonds]
        law = "cpm"
        interaction_ratio = 1.2
        [contacts]
        law = "none"
        [heat]
        temperature = 293
        time_factor = 1e4
        [[set]]
        name = "core"
        selection = { kind = "sphere", center = ["9 mm", "9 mm", "11 mm"], radius = "5 mm" }
        [[heat.source]]
        set = "core"
        power = "2 kW"
        [[sample]]
        operator = "temperature"
        region = { kind = "cell" }
        [stop]
        steps = 120"#;
    let assembled = || built(text, std::path::Path::new("."));
    if let Err(error) = assembled() {
        panic!("{error}");
    }
    let bits = |threads: usize| {
        on_threads(threads, || {
            let mut simulation = started(made(text));
            let record = finish(&mut simulation).unwrap();
            let heat = simulation.state.heat.clone().unwrap();
            (record.to_row(), heat.temperature, simulation.state.particles.position)
        })
    };
    let one = bits(1);
    assert!(one == bits(4));
    let heated = one.1.iter().copied().fold(0.0, f64::max);
    assert!(heated > 294.0, "{heated}");
}

/// What only the assembled body reveals is refused with the key and a remedy: a spot outside the body at the start or at the end, a
/// face that no particle reaches, no contacts, a step beyond the bound, and an insulated body without a steady state.
#[test]
fn bad_heat_is_refused() {
    let text = |heat: &str, more: &str| {
        format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [[0, 0, 0, \"1 mm\"], [\"2 mm\", 0, 0, \"1 mm\"], [\"4.5 mm\", \"1 mm\", 0, \"0.5 mm\"]]
            [[material]]
            name = \"glass\"
            density = 2500
            thermal = {{ specific_heat = 800, conductivity = 1 }}
            [contacts]
            law = \"none\"
            [[set]]
            name = \"first\"
            selection = {{ kind = \"ids\", ids = [0] }}
            [heat]
            model = \"ordered\"
            motion = false
            temperature = 300
            {heat}
            {more}"
        )
    };
    let folder = std::path::Path::new(".");
    let end = "[stop]\ntime = 1";
    let spot = |center: &str, velocity: &str| {
        format!(
            "[[heat.source]]\npower = 1\nspot = {{ center = [{center}, 0, 0], radius = 1e-3, velocity = [{velocity}, 0, 0] }}"
        )
    };
    for (heat, key, words) in [
        (spot("0.1", "0"), "heat.source[0].spot.center", "the spot starts"),
        (spot("0", "1"), "heat.source[0].spot.center", "the spot ends"),
        ("[[heat.boundary]]\nface = \"y minimum\"\nset = \"first\"\nflux = 1\n".to_owned(), "", ""),
        (
            "[[heat.boundary]]\nface = \"x maximum\"\nset = \"first\"\nflux = 1\n".to_owned(),
            "heat.boundary[0]",
            "no particle reaches",
        ),
        (
            "steady = true\n[[heat.source]]\nset = \"first\"\npower = 1".to_owned(),
            "heat.steady",
            "prescribed temperature",
        ),
    ] {
        let result = built(&text(&heat, end), folder);
        if key.is_empty() {
            assert!(result.is_ok());
            continue;
        }
        let (found, message) = concordem_tests::runs::refusal(result);
        assert!(found == key && message.contains(words), "{found}: {message}");
    }
    let apart = text("", end).replace("\"2 mm\"", "\"2.5 mm\"");
    let (found, message) = concordem_tests::runs::refusal(built(&apart, folder));
    assert!(found == "heat.model" && message.contains("contact_ratio"), "{found}: {message}");
    let step = |step: f64| text("", &format!("{end}\n[integration]\ntime_step = {step:?}"));
    let message = match built(&step(1e3), folder) {
        Err(error) => error.to_string(),
        Ok(_) => panic!("accepted"),
    };
    assert!(
        message.contains("explicit heat conduction is stable only below") && message.contains("implicit"),
        "{message}"
    );
    assert!(built(&step(1e-3), folder).is_ok());
    let implicit = step(1e3).replace("motion = false", "motion = false\nscheme = \"implicit\"");
    assert!(built(&implicit, folder).is_ok());
}
