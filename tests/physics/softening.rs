//! Bodies whose stiffness and strength depend on the temperature; heat through walls.

use concordem::schedule::Simulation;
use concordem_tests::runs::{finish, made, started};

/// A bar of eleven touching spheres, drawn at one end, at a temperature: its solver after each step until a bond breaks or `most` steps.
/// `bonds`: the table of the law; `softening`: factors at 300 K and 700 K.
fn drawn(law: &str, bonds: &str, softening: &str, temperature: f64, mut look: impl FnMut(&Simulation)) {
    let spheres: Vec<String> = (0..11).map(|k| format!("[{}e-3, 0, 0, 1e-3]", 2 * k)).collect();
    let mut simulation = started(made(&format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [{}]
        [[material]]
        name = \"glass\"
        density = 2500
        {law} = {{ {bonds} }}
        thermal = {{ specific_heat = 800, conductivity = 1, variation = {{ temperature = [300, 700], {softening} }} }}
        [bonds]
        law = \"{law}\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [heat]
        temperature = {temperature}
        [[set]]
        name = \"left\"
        selection = {{ kind = \"ids\", ids = [0] }}
        [[set]]
        name = \"right\"
        selection = {{ kind = \"ids\", ids = [10] }}
        [[prescribe]]
        set = \"left\"
        velocity = [0, 0, 0]
        [[prescribe]]
        set = \"right\"
        velocity = [1e-3, 0, 0]
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.5 }}
        [stop]
        steps = 1000000",
        spheres.join(", ")
    )));
    for _ in 0..40_000 {
        simulation.advance().unwrap();
        look(&simulation);
        if !simulation.state.broken.is_empty() {
            return;
        }
    }
    panic!("no bond broke in {} s", simulation.state.clock.time());
}

/// Stiffness of the bar at half of its strength, and its strength, at a temperature.
fn measured(law: &str, bonds: &str, temperature: f64) -> [f64; 2] {
    let [mut stiffness, mut strength] = [0.0; 2];
    drawn(law, bonds, "stiffness = [1, 0.4], strength = [1, 0.6]", temperature, |simulation| {
        let state = &simulation.state;
        let id = |wanted: u32| state.particles.id.iter().position(|id| *id == wanted).unwrap();
        let force = simulation.solver.forces()[id(0)].x;
        let length = state.particles.position[id(10)].x - state.particles.position[id(0)].x;
        strength = f64::max(strength, force);
        if force < 0.5 * 2.0 * 0.6 {
            stiffness = force / (length - 20e-3);
        }
    });
    [stiffness, strength]
}

/// A bar in tension has the stiffness and the strength of its temperature under every law of bonds: cold, between, and beyond the
/// table. Tolerance: waves in the bar, less than 1 % of the force, because it is drawn within some hundred of its periods.
#[test]
fn a_hot_bar_is_softer_and_weaker() {
    let area = std::f64::consts::PI * 1e-6;
    let concrete = format!(
        "young = {:?}, shear_ratio = 0.2, crack_onset_strain = 1e-3, relative_ductility = 1.5, damage_law = \"linear\", \
         cohesion = \"1 GPa\", friction_coefficient = 0.8",
        2e-3 * 1e6 / area
    );
    let beam = format!("young = {:?}, radius = 1e-3, tensile_strength = {:?}", 2e-3 * 1e6 / area, 2.0 / area);
    for (law, bonds) in [
        ("linear_bond", "normal_stiffness = 1e6, shear_stiffness = 3e5, normal_strength = 2"),
        ("cohesive_beam", &beam),
        ("cpm", &concrete),
    ] {
        for (temperature, softer, weaker) in [(300.0, 1.0, 1.0), (500.0, 0.7, 0.8), (900.0, 0.4, 0.6)] {
            let [stiffness, strength] = measured(law, bonds, temperature);
            println!("{law} at {temperature} K: {:.4} {:.4}", stiffness / 1e5, strength / 2.0);
            assert!((stiffness / (1e5 * softer) - 1.0).abs() < 0.01, "{law} {temperature} {stiffness:e}");
            assert!((strength / (2.0 * weaker) - 1.0).abs() < 0.01, "{law} {temperature} {strength}");
        }
    }
}

/// A column on a hot floor, from a scenario: conduction alone, from the steady state on, explicit and implicit. Without a load the
/// steady state has the temperature of the floor; a source at the top raises sphere k by `Q (1/G + k/(2Rλ))`, `G = 4R²/(1/h + R/λ)`.
#[test]
fn a_column_on_a_hot_floor() {
    for scheme in ["explicit", "implicit"] {
        let mut simulation = started(made(&format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = [[0, 0, 1e-3, 1e-3], [0, 0, 3e-3, 1e-3], [0, 0, 5e-3, 1e-3]]
            [[material]]
            name = \"glass\"
            density = 2500
            frictional = {{ normal_stiffness = 1e5, shear_stiffness = 3e4 }}
            thermal = {{ specific_heat = 800, conductivity = 2 }}
            [contacts]
            law = \"frictional\"
            [[wall]]
            name = \"floor\"
            material = \"glass\"
            shape = {{ kind = \"plane\", point = [0, 0, 1e-6], normal = [0, 0, 1] }}
            [[set]]
            name = \"top\"
            selection = {{ kind = \"box\", minimum = [-1, -1, 4e-3], maximum = [1, 1, 6e-3] }}
            [heat]
            model = \"ordered\"
            temperature = 300
            steady = true
            motion = false
            scheme = \"{scheme}\"
            [[heat.source]]
            set = \"top\"
            power = 0.1
            [[heat.boundary]]
            wall = \"floor\"
            convection = {{ coefficient = 4000, ambient = 500 }}
            [integration]
            time_step = 1e-3
            [stop]
            steps = 100"
        )));
        finish(&mut simulation);
        let state = &simulation.state;
        let temperature = &state.heat.as_ref().unwrap().temperature;
        let conductance = 4e-6 / (1.0 / 4000.0 + 1e-3 / 2.0);
        for (p, found) in temperature.iter().enumerate() {
            let height = ((state.particles.position[p].z - 1e-3) / 2e-3).round();
            let expected = 500.0 + 0.1 * (1.0 / conductance + height / (2e-3 * 2.0));
            assert!((found - expected).abs() < 1e-6, "{scheme} {height} {found} {expected}");
        }
    }
}
