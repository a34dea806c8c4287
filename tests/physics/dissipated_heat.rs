//! Heat of friction, and the flux of heat, of whole scenarios.

use concordem_tests::runs::{finish, made, run, started};

/// A sphere that slides at the speed `v` while it is pressed into a floor at the speed `w`: friction heats it by
/// `∫ μ F v dt = μ v (4/3) E* √R w^1.5 t^2.5/2.5` with `E* = E/(2(1 − ν²))`, and the ledger of energy names the same heat.
#[test]
fn friction_heats_a_sliding_sphere() {
    let simulation = run(r#"version = 1
        [packing]
        kind = "spheres"
        spheres = [[0, 0, "1 mm", "1 mm"]]
        [[material]]
        name = "glass"
        density = 2500
        hertz_mindlin = { young = 5e10, poisson = 0.2, friction_coefficient = 0.3, restitution = 1 }
        thermal = { specific_heat = 800, conductivity = 1 }
        [contacts]
        law = "hertz_mindlin"
        [[wall]]
        name = "floor"
        material = "glass"
        shape = { kind = "plane", point = [0, 0, 0], normal = [0, 0, 1] }
        [[set]]
        name = "all"
        selection = { kind = "ids", ids = [0] }
        [[prescribe]]
        set = "all"
        velocity = [0.1, 0, -0.001]
        angular_velocity = [0, 0, 0]
        [heat]
        model = "ordered"
        temperature = 300
        dissipation = true
        [integration]
        time_step = 1e-7
        [stop]
        steps = 20001"#);
    let (state, time) = (&simulation.state, 2e-3_f64);
    let heat = state.heat.as_ref().unwrap();
    let heated = heat.ledger.dissipation.get();
    let stiffness = 4.0 / 3.0 * 5e10 / (2.0 * (1.0 - 0.04)) * 1e-3_f64.sqrt();
    let expected = 0.3 * 0.1 * stiffness * 0.001_f64.powf(1.5) * time.powf(2.5) / 2.5;
    // The contact stores a part of the work in shear before it slides: some μ w/v = 0.3 %.
    assert!((heated / expected - 1.0).abs() < 0.01, "{heated:e} {expected:e}");
    // Rounding of the sums.
    let ledger = state.ledger.friction.get() + state.ledger.viscous.get() + state.ledger.damage.get();
    assert!((heated / ledger - 1.0).abs() < 1e-13, "{heated:e} {ledger:e}");
    // All of it is in the sphere, or waits for the next step. Rounding of a temperature of 300 K.
    let model = simulation.solver.model().heat.as_ref().unwrap();
    assert!(model.residual(heat).abs() < 1e-13 * model.capacity[0] * 300.0, "{:e}", model.residual(heat));
    let warmed = (heat.temperature[0] - 300.0) * model.capacity[0];
    assert!((warmed / heated - 1.0).abs() < 1e-3, "{warmed:e} {heated:e}");
}

/// Fourier's law for a cubic lattice between a hot and a cold face, in the steady state: the flux `λ ΔT/L` in the whole body, and in boxes
/// across it that cut its links anywhere. Two-dimensional as well.
#[test]
fn the_flux_between_two_faces_is_that_of_fourier() {
    for (dimension, lattice, repeats, axis, area) in
        [(3, "sc", "[4, 4, 8]", "z", 8e-3 * 8e-3), (2, "square", "[4, 8, 1]", "y", 8e-3)]
    {
        let (low, high) =
            if dimension == 3 { ("-1, -1, 0.0037", "1, 1, 0.0109") } else { ("-1, 0.0037, -1", "1, 0.0109, 1") };
        let volume = area * 16e-3;
        let text = format!(
            "version = 1
            dimension = {dimension}
            [packing]
            kind = \"lattice\"
            lattice = \"{lattice}\"
            radius = \"1 mm\"
            repeats = {repeats}
            [[material]]
            name = \"glass\"
            density = 2500
            thermal = {{ specific_heat = 800, conductivity = 1.5 }}
            [contacts]
            law = \"none\"
            [heat]
            model = \"ordered\"
            temperature = 300
            motion = false
            steady = true
            [[heat.boundary]]
            face = \"{axis} minimum\"
            temperature = 400
            [[heat.boundary]]
            face = \"{axis} maximum\"
            temperature = 300
            [[sample]]
            name = \"body\"
            operator = \"heat-flux\"
            region = {{ kind = \"all\", volume = {volume:e} }}
            [[sample]]
            name = \"slice\"
            operator = \"heat-flux\"
            region = {{ kind = \"box\", minimum = [{low}], maximum = [{high}] }}
            [stop]
            steps = 2"
        );
        let mut simulation = started(made(&text));
        let rows = simulation.advance().unwrap().operators;
        finish(&mut simulation);
        let along = dimension - 1;
        let fourier = 1.5 * 100.0 / 16e-3;
        // The steady state is solved to 1e-11 of the temperatures.
        assert!((rows[0].values[along] / fourier - 1.0).abs() < 1e-8, "{:?}", rows[0].values);
        // The box is wider than the body: its flux counts for the cross-section of the body only.
        let width = if dimension == 3 { 4.0 } else { 2.0 };
        assert!((rows[1].values[along] * width / area / fourier - 1.0).abs() < 1e-8, "{:?}", rows[1].values);
        for row in &rows {
            assert!((0..3).all(|k| k == along || row.values[k].abs() < 1e-9 * fourier), "{:?}", row.values);
        }
    }
}
