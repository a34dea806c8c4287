//! Heat along the bonds of particles that a host moves.

use concordem_yade::assembly::{Assembly, BodyState};

/// A scenario of three bonded spheres, the first one heated.
fn heated(more: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 1e-3], [2e-3, 0, 0, 1e-3], [4e-3, 0, 0, 1e-3]]
        [[material]]
        name = \"glass\"
        density = 2500
        linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 1e5 }}
        thermal = {{ specific_heat = 800, conductivity = 1, expansion = 1e-5 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [stop]
        steps = 10
        {more}"
    )
}

const SOURCE: &str = "[[heat.source]]\nset = \"first\"\npower = 0.1\n";
const FIRST: &str = "[[set]]\nname = \"first\"\nselection = { kind = \"ids\", ids = [0] }\n";
const RISING: &str = "[[history]]\nname = \"rising\"\nshape = { kind = \"table\", points = [[0, 0], [1, 1]] }\n";
const HEAT: &str = "[heat]\nmodel = \"ordered\"\ntemperature = 300\ntime_factor = 1e4\n";

/// Heat flows along the bonds of particles that a host holds in place, as a chain of three cells; the heated end pushes: its bond is
/// compressed by the mean of both thermal strains.
#[test]
fn bonds_conduct_and_expand_in_a_host() {
    let text = heated(&format!("{FIRST}{HEAT}{SOURCE}"));
    let mass = 2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-9;
    let mut assembly = Assembly::of_text(&text, &[0, 1, 2], &[mass; 3], &[4e-12; 3], 1e-6).expect("a sound scenario");
    let places = assembly.state.particles.position.clone();
    let still = |k: usize| BodyState { position: places[k], orientation: [0.0, 0.0, 0.0, 1.0], ..BodyState::default() };
    // Bulk density: the mass of all spheres over the volume of their cubes, so each has the heat capacity of its mass.
    let (capacity, conductance) = (mass * 800.0, 4e-6 / 2e-3);
    let mut expected = [300.0_f64; 3];
    for _ in 0..500 {
        assembly.take_motions(1e-6, |k, _| Ok(still(k))).expect("finite");
        assembly.find_forces(1e-6, None, false).expect("a step");
        let [a, b] = [0, 1].map(|k| conductance * (expected[k + 1] - expected[k]));
        let rates = [a + 0.1, b - a, -b];
        for (t, rate) in expected.iter_mut().zip(rates) {
            *t += rate * 1e-2 / capacity;
        }
    }
    let at = |body: u32| assembly.state.particles.id.iter().position(|id| *id == body).expect("it is there");
    let found = assembly.temperatures().expect("heat");
    for body in 0..3 {
        // 500 roundings of 300 K.
        let [found, expected] = [found[at(body)], expected[body as usize]];
        assert!((found - expected).abs() < 1e-10, "{body}: {found} {expected}");
    }
    assert!(expected[0] > expected[1] + 5.0 && expected[1] > expected[2] + 1.0, "{expected:?}");
    // The force of the last step has the temperatures before it: it is off by the last change, 1e-3 of all.
    let force = 1e6 * 2e-3 * 1e-5 * 0.5 * (expected[0] + expected[1] - 600.0);
    let pushed = -assembly.solver.forces()[at(0)].x;
    assert!((pushed / force - 1.0).abs() < 5e-3, "{pushed} {force}");
}

/// What a host cannot do for heat is refused.
#[test]
fn heat_that_a_host_does_not_give_is_refused() {
    let refused = |more: &str, dt: f64| {
        Assembly::of_text(&heated(more), &[0, 1, 2], &[1e-5; 3], &[4e-12; 3], dt).err().expect("it is refused")
    };
    let source = format!("{FIRST}{RISING}{HEAT}{SOURCE}history = \"rising\"");
    assert!(refused(&source, 1e-6).contains("history"));
    let quick = HEAT.replace("1e4", "1e8");
    assert!(refused(&quick, 1e-6).contains("stable heat conduction"), "{}", refused(&quick, 1e-6));
    let still = HEAT.replace("[heat]", "[heat]\nmotion = false");
    let still = heated(&still).replace(", expansion = 1e-5", "");
    let message = Assembly::of_text(&still, &[0, 1, 2], &[1e-5; 3], &[4e-12; 3], 1e-6).err().expect("it is refused");
    assert!(message.contains("motion"), "{message}");
    let mut fine = Assembly::of_text(&heated(HEAT), &[0, 1, 2], &[1e-5; 3], &[4e-12; 3], 1e-6).expect("sound");
    assert!(fine.find_forces(1e-2, None, false).expect_err("too large").contains("stable heat conduction"));
}
