//! A history without a value ends the run at once, whatever it moves, loads, or heats.

mod shared;

use concordem_scenario::assembly::restart;
use concordem_scenario::schedule::simulation::RunError;
use concordem_solver::SolverError;
use concordem_solver::state::columns::ColumnStore;

use shared::{SPRING, assembled, bonded, read, set, simulation, spheres};

/// Three bonded spheres, of which the last is free; a formula that has no value after 10 µs; then what follows it.
fn scenario(packing: &str, more: &str) -> String {
    let material = format!(
        "{SPRING}\nfrictional = {{ normal_stiffness = 1e6, shear_stiffness = 1e5, friction_coefficient = 0.3 }}"
    );
    let start = bonded(packing, "linear_bond", &material).replace("law = \"none\"", "law = \"frictional\"");
    let sets = set("first", &[0]) + &set("last", &[2]);
    format!(
        "{start}{sets}
        [integration]
        time_step = 1e-6
        [output]
        sample_interval = 1000
        [stop]
        steps = 200
        [[history]]
        name = \"fade\"
        shape = {{ kind = \"expression\", expression = \"sqrt(1 - t/1e-5)\", until = 1e-5 }}
        {more}"
    )
}

/// A case: its name, its packing, and what follows it.
type Case = (&'static str, String, String);

/// Three spheres in a row.
fn line() -> String {
    spheres(&[[0.0, 0.0, 0.0, 0.01], [0.02, 0.0, 0.0, 0.01], [0.04, 0.0, 0.0, 0.01]])
}

/// The same in a periodic cell.
fn cell() -> String {
    format!("{}\ncell = [0.06, 0.1, 0.1]", line())
}

/// Motions, forces, and walls.
fn motions() -> Vec<Case> {
    let held = "[[prescribe]]\nset = \"first\"\nvelocity = [0, 0, 0]\nangular_velocity = [0, 0, 0]\n";
    // Far from the particles, so that nothing but the wall itself can tell.
    let plane = "shape = { kind = \"plane\", point = [0, 0, -1], normal = [0, 0, 1] }";
    let mesh =
        "shape = { kind = \"mesh\", vertices = [[-1, -1, -1], [1, -1, -1], [0, 1, -1]], triangles = [[0, 1, 2]] }";
    vec![
        ("velocity", line(), "[[prescribe]]\nset = \"first\"\nvelocity = [1, 0, 0]\nhistory = \"fade\"".to_owned()),
        (
            "displacement",
            line(),
            "[[prescribe]]\nset = \"first\"\ndisplacement = [1e-6, 0, 0]\nhistory = \"fade\"".to_owned(),
        ),
        ("spin", line(), "[[prescribe]]\nset = \"first\"\nangular_velocity = [1, 0, 0]\nhistory = \"fade\"".to_owned()),
        ("force", line(), "[[force]]\nset = \"last\"\nforce = [1, 0, 0]\nhistory = \"fade\"".to_owned()),
        (
            "force on a held particle",
            line(),
            format!("{held}[[force]]\nset = \"first\"\nforce = [1, 0, 0]\nhistory = \"fade\""),
        ),
        (
            "wall",
            line(),
            format!("[[wall]]\nname = \"w\"\nmaterial = \"m\"\n{plane}\nvelocity = [0, 0, 1]\nhistory = \"fade\""),
        ),
        (
            "turning wall",
            line(),
            format!(
                "[[wall]]\nname = \"w\"\nmaterial = \"m\"\n{plane}\nrotation = {{ angular_velocity = 1, history = \"fade\" }}"
            ),
        ),
        (
            "mesh",
            line(),
            format!(
                "[[wall]]\nname = \"w\"\nmaterial = \"m\"\n{mesh}\nmotion = {{ displacement = [0, 0, 1e-6], history = \"fade\" }}"
            ),
        ),
    ]
}

/// Heat and loadings.
fn heat_and_loadings() -> Vec<Case> {
    let heat = "[heat]\nmodel = \"ordered\"\npairs = \"bonds\"\ntemperature = 293\n";
    let staged = |loading: &str| {
        format!("[loading]\n{loading}\n[[stage]]\nname = \"s\"\nhistory = \"fade\"\nstop = {{ steps = 200 }}")
    };
    vec![
        ("heat source", line(), format!("{heat}[[heat.source]]\nset = \"first\"\npower = 1\nhistory = \"fade\"")),
        (
            "prescribed heat",
            line(),
            format!("{heat}[[heat.boundary]]\nset = \"first\"\ntemperature = 300\nhistory = \"fade\""),
        ),
        (
            "heat without motion",
            line(),
            format!("{heat}motion = false\n[[heat.source]]\nset = \"first\"\npower = 1\nhistory = \"fade\""),
        ),
        (
            "implicit heat",
            line(),
            format!("{heat}scheme = \"implicit\"\n[[heat.source]]\nset = \"first\"\npower = 1\nhistory = \"fade\""),
        ),
        (
            "cell-strain",
            cell(),
            staged("kind = \"cell-strain\"\nvelocity_gradient = [[1, 0, 0], [0, 0, 0], [0, 0, 0]]"),
        ),
        (
            "cell-stress",
            cell(),
            staged(
                "kind = \"cell-stress\"\nmaximum_strain_rate = 1\nstress = [[-1e3, 0, 0], [0, -1e3, 0], [0, 0, -1e3]]",
            ),
        ),
        (
            "uniaxial",
            line(),
            staged("kind = \"uniaxial\"\naxis = \"x\"\nstrain_rate = 1\nlayer_thickness = 0.015\narea = 1e-4"),
        ),
        (
            "platens",
            line(),
            staged("kind = \"platens\"\naxis = \"x\"\nclosing_velocity = 1\nmaterial = \"m\"\narea = 1e-4"),
        ),
    ]
}

#[test]
fn a_history_without_a_value_ends_the_run() {
    for (case, packing, more) in motions().into_iter().chain(heat_and_loadings()) {
        let mut text = scenario(&packing, &more);
        if more.contains("[heat]") {
            text =
                text.replace("density = 2500", "density = 2500\nthermal = { specific_heat = 800, conductivity = 1 }");
        }
        let mut run = simulation(&text);
        let error = loop {
            match run.advance() {
                Ok(advance) => assert!(advance.stopped.is_none(), "{case}: the run goes on to its end"),
                Err(error) => break error,
            }
        };
        let step = run.state.clock.step;
        // The factor is not a number from 10 µs on; some read it in the middle or at the end of a step.
        assert!((9..=13).contains(&step), "{case}: step {step}: {error}");
        // Conjugate gradients stop at once at a power that is not a number.
        let unsolved = matches!(&error, RunError::Solver(SolverError::HeatNotConverged { .. }));
        let known = matches!(
            &error,
            RunError::Solver(SolverError::NotFinite { .. } | SolverError::NoNumber { .. } | SolverError::Mesh { .. })
        );
        assert!(if case == "implicit heat" { unsolved } else { known }, "{case}: {error:?}");
        assert!(unsolved || error.to_string().contains("finite"), "{case}: {error}");
    }
}

/// A stored state with a number of steps whose successor does not exist is refused; the largest number that a run may have is not.
#[test]
fn a_clock_that_would_wrap_is_refused() {
    let text = scenario(&line(), "").replace("steps = 200", "time = 1");
    let resumed = |step: u64| {
        let mut stored = assembled(&text).state;
        stored.clock.step = step;
        let mut columns = ColumnStore::of(&stored).unwrap();
        restart::apply(&mut assembled(&text), &mut columns, &read(&text), &[], false)
    };
    assert!(resumed(1 << 62).is_ok());
    for step in [(1 << 62) + 1, u64::MAX] {
        let error = resumed(step).expect_err("a refusal").to_string();
        assert!(error.contains("clock/step") && error.contains(&format!("{step} steps")), "{error}");
    }
}
