//! Walls with servos: force and pressure reached, closed forms of the positions, energy, restart.

mod shared;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{Sharpness, assemble_cached, restart};
use concordem_scenario::schedule::{Advance, Aim, Simulation, StopReason};
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::{assembled, read, simulation};

fn run(simulation: &mut Simulation) -> Vec<Advance> {
    let mut all = Vec::new();
    while all.last().is_none_or(|advance: &Advance| advance.stopped.is_none()) {
        all.push(simulation.advance().unwrap());
    }
    all
}

/// Stiffness of a contact of two spheres, N/m; that of a sphere and a wall, springs in series, is the same.
const STIFFNESS: f64 = 1e6;
const RADIUS: f64 = 0.01;

/// Touching spheres on a cubic lattice of `counts` with springs of [`STIFFNESS`] and local damping; the first one in the origin.
fn lattice(counts: [usize; 3], contacts: &str, more: &str) -> String {
    let mut spheres = Vec::new();
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                let x = [i, j, k].map(|n| 2.0 * RADIUS * n as f64);
                spheres.push(format!("[{}, {}, {}, {RADIUS}]", x[0], x[1], x[2]));
            }
        }
    }
    format!(
        "version = 1
        dimension = {}
        [packing]
        kind = \"spheres\"
        spheres = [{}]
        [[material]]
        name = \"m\"
        density = 2500
        {contacts}
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        {more}",
        if counts[2] == 0 { 2 } else { 3 },
        spheres.join(", ")
    )
}

const LINEAR: &str = "frictional = { normal_stiffness = 1e6, shear_stiffness = 0 }
        [contacts]
        law = \"frictional\"";

/// `concordem run` does not need the spectral bound of a given step that is stable by the bound per particle, and neither do the gains of servos.
#[test]
fn a_sufficient_bound_changes_neither_the_step_nor_servos() {
    let wall = |servo: &str| {
        format!(
            "time_step = 1e-6
            [stop]\nsteps = 10
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }}
            {servo}"
        )
    };
    for servo in ["", "servo = { force = \"10 N\", maximum_speed = 1 }"] {
        let scenario = Scenario::parse("test.toml", &lattice([2, 2, 2], LINEAR, &wall(servo))).unwrap();
        let [sharp, sufficient] = [Sharpness::Sharp, Sharpness::Sufficient].map(|sharpness| {
            assemble_cached(&scenario, std::path::Path::new("."), None, sharpness, &mut |_, _| ()).unwrap()
        });
        assert_eq!(sufficient.schedule.servos, sharp.schedule.servos);
        assert_eq!(sufficient.state.clock.dt, 1e-6);
        assert!(sharp.summary.bounds.iterations > 0);
        assert_eq!(sufficient.summary.bounds.iterations, 0, "{servo}");
        assert!(sufficient.summary.bounds.spectral <= sharp.summary.bounds.spectral);
    }
}

/// A piston presses a column of three spheres on a floor. Four contacts in series shorten it by `F/k` each. Tolerance 1e-6: the
/// servo halves its error every few hundred of the 20,000 steps.
#[test]
fn a_piston_reaches_its_force() {
    let text = lattice(
        [1, 1, 3],
        "hertz_mindlin = { young = 1e9, poisson = 0.2 }\n[contacts]\nlaw = \"hertz_mindlin\"",
        "[stop]\nsteps = 40000
        [output]\nsample_interval = 100
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, 0.0501], normal = [0, 0, -2] }
        servo = { force = 10, maximum_speed = 0.1 }",
    );
    let mut simulation = simulation(&text);
    let steps = run(&mut simulation);
    let [floor, piston] = [0, 1].map(|wall| simulation.state.walls[wall].force.z);
    assert!((piston / 10.0 - 1.0).abs() < 1e-6 && (floor / -10.0 - 1.0).abs() < 1e-6, "{piston} {floor}");
    // Hertz: F = 4/3 E* √R* δ^1.5, E* = E/2(1−ν²), R* = R/2 between spheres and R at walls.
    let modulus = 1e9 / (2.0 * (1.0 - 0.04));
    let overlap = |radius: f64| (10.0 / (4.0 / 3.0 * modulus * radius.sqrt())).powf(2.0 / 3.0);
    let expected = -0.0001 - 2.0 * overlap(RADIUS) - 2.0 * overlap(0.5 * RADIUS);
    let moved = simulation.state.walls[1].displacement.z;
    assert!((moved / expected - 1.0).abs() < 1e-6, "{moved} {expected}");
    // The work of the wall is stored or dissipated, to the rounding of 40,000 sums, although its velocity changes in every step.
    let last = steps.last().and_then(|advance| advance.last).unwrap();
    assert!(last.residual.abs() < 1e-12 * last.boundary_work, "{} of {}", last.residual, last.boundary_work);
}

/// Six faces press on a cubic lattice: each column of contacts carries the pressure on its share of the present face, whatever the
/// other dimensions. Tolerance 1e-4 of the force.
#[test]
fn a_box_reaches_its_pressure() {
    for counts in [[3, 4, 5], [4, 3, 0]] {
        let planar = counts[2] == 0;
        let size: Vec<f64> = counts.iter().map(|n| 2.0 * RADIUS * *n as f64 - RADIUS).collect();
        let walls = format!(
            "[stop]\nsteps = 60000
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"box\", minimum = [-0.01, -0.01, -0.01], maximum = [{}, {}, {}] }}
            servo = {{ pressure = 2e5, maximum_speed = 0.05 }}",
            size[0],
            size[1],
            if planar { RADIUS } else { size[2] }
        );
        let counts = if planar { [counts[0], counts[1], 1] } else { counts };
        let mut text = lattice(counts, LINEAR, &walls);
        if planar {
            text = text.replace("dimension = 3", "dimension = 2");
        }
        let mut simulation = simulation(&text);
        run(&mut simulation);
        let walls = &simulation.state.walls;
        let moved = |axis: usize| walls[2 * axis].displacement[axis] - walls[2 * axis + 1].displacement[axis];
        let axes = if planar { 0..2 } else { 0..3 };
        for axis in axes.clone() {
            let area: f64 = axes
                .clone()
                .filter(|other| *other != axis)
                .map(|i| 2.0 * RADIUS * counts[i] as f64 - moved(i))
                .product();
            for (wall, sign) in [(2 * axis, -1.0), (2 * axis + 1, 1.0)] {
                let force = walls[wall].force[axis] * sign;
                assert!((force / (2e5 * area) - 1.0).abs() < 1e-4, "{counts:?} wall {wall}: {force} {}", 2e5 * area);
            }
            // n + 1 contacts in series, and as many columns as particles in a face.
            let columns: f64 = axes.clone().filter(|other| *other != axis).map(|i| counts[i] as f64).product();
            let expected = (counts[axis] + 1) as f64 * 2e5 * area / columns / STIFFNESS;
            assert!((moved(axis) / expected - 1.0).abs() < 1e-3, "{counts:?} axis {axis}: {} {expected}", moved(axis));
        }
    }
}

/// A piston above one sphere on a floor, with more lines of the scenario.
fn piston(height: f64, more: &str) -> String {
    let plane = format!("{{ kind = \"plane\", point = [0, 0, {height}], normal = [0, 0, -1] }}");
    piston_of(&plane, "", more)
}

/// The same with a piston of this shape, and more keys of its servo.
fn piston_of(shape: &str, keys: &str, more: &str) -> String {
    lattice(
        [1, 1, 1],
        LINEAR,
        &format!(
            "gravity = [0, 0, -9.81]
            [output]\nsample_interval = 10
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }}
            [[wall]]
            material = \"m\"
            shape = {shape}
            servo = {{ force = 20, maximum_speed = 0.2{keys} }}
            {more}"
        ),
    )
}

/// A free piston moves at its full speed until it touches: contacts that it does not have cannot slow it down. Its force then rises without
/// overshoot: it meets the first particle as slowly as particles that it presses on.
#[test]
fn a_free_piston_moves_at_full_speed() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("piston.stl");
    // A square far wider than the sphere: the balls around its triangles contain it from the start.
    let corners = [[-0.1, -0.1], [0.1, -0.1], [0.1, 0.1], [-0.1, 0.1]].map(|[x, y]| format!("vertex {x} {y} 0.06\n"));
    let facet = |a: usize, b: usize, c: usize| {
        let [a, b, c] = [a, b, c].map(|k| corners[k].as_str());
        format!("facet normal 0 0 -1\nouter loop\n{a}{b}{c}endloop\nendfacet\n")
    };
    std::fs::write(&path, format!("solid s\n{}{}endsolid s\n", facet(0, 2, 1), facet(0, 3, 2))).unwrap();
    let facets = format!("{{ kind = \"facets\", path = \"{}\" }}", path.display());
    let end = "[stop]\ntime = 0.3";
    moves_at_full_speed(simulation(&piston(0.06, end)));
    moves_at_full_speed(simulation(&piston_of(&facets, ", direction = [0, 0, -1]", end)));
}

fn moves_at_full_speed(mut simulation: Simulation) {
    let (mut free, mut largest) = (0.0, 0.0_f64);
    while simulation.stopped().is_none() {
        simulation.advance().unwrap();
        let wall = &simulation.state.walls[1];
        if wall.force.z == 0.0 {
            free = simulation.state.clock.time();
        }
        largest = largest.max(wall.force.z);
    }
    // 50 mm at 0.2 m/s; the last two steps of the way are slow.
    assert!((free / 0.25 - 1.0).abs() < 0.02, "{free}");
    assert!(largest < 1.1 * 20.0, "{largest}");
    assert!((simulation.state.walls[1].force.z / 20.0 - 1.0).abs() < 1e-3);
}

/// The sphere is at rest long before the piston comes. Equilibrium waits for the piston.
#[test]
fn equilibrium_waits_for_servos() {
    let mut simulation = simulation(&piston(0.03, "[stop]\nunbalanced = 1e-3\ntime = 1"));
    let steps = run(&mut simulation);
    assert_eq!(steps.last().and_then(|advance| advance.stopped), Some(StopReason::Equilibrium));
    let force = simulation.state.walls[1].force.z;
    assert!((force / 20.0 - 1.0).abs() < 0.01, "{force}");
    assert!(simulation.unmet().is_empty());
}

/// A run that ends before says what is missing.
#[test]
fn a_run_says_what_its_servos_have_not_reached() {
    let mut simulation = simulation(&piston(0.06, "[stop]\ntime = 0.1"));
    run(&mut simulation);
    assert_eq!(simulation.unmet(), ["the servo of wall `wall 1` has 0.0000e0 of 2.0000e1 N"]);
}

/// With a hundred times the gain that contacts allow, the servo swings; the run ends, and says so.
#[test]
fn a_servo_that_swings_ends_the_run() {
    let mut simulation = simulation(&piston(0.0101, "[stop]\ntime = 1"));
    for servo in &mut simulation.schedule.servos {
        if let Aim::Force { gain, .. } = &mut servo.aim {
            (gain.free, gain.on_layer) = (100.0 * gain.free, 100.0 * gain.on_layer);
        }
    }
    let error = loop {
        match simulation.advance() {
            Ok(advance) => assert_eq!(advance.stopped, None),
            Err(error) => break error.to_string(),
        }
    };
    assert!(error.contains("the servo of wall `wall 1` swings") && error.contains("servo.maximum_speed"), "{error}");
    assert!(simulation.state.clock.step < 5000);
}

/// The target follows a history: up, constant, and down to a fifth, on a roller that moves as a whole. Within 1 % while it is
/// constant and while it changes slowly.
#[test]
fn targets_follow_histories() {
    let text = lattice(
        [1, 1, 1],
        LINEAR,
        "time_step = 2e-6
        [stop]\nsteps = 60000
        [[history]]
        name = \"up and down\"
        shape = { kind = \"table\", points = [[0, 0], [0.03, 1], [0.06, 1], [0.1, 0.2]] }
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }
        [[wall]]
        material = \"m\"
        shape = { kind = \"cylinder\", center = [0, 0, 0.02], axis = \"y\", radius = 0.01, side = \"outside\" }
        servo = { force = 50, direction = [0, 0, -1], maximum_speed = 0.2 }
        history = \"up and down\"",
    );
    let mut simulation = simulation(&text);
    let factor = |time: f64| match time {
        t if t < 0.03 => t / 0.03,
        t if t < 0.06 => 1.0,
        t if t < 0.1 => 1.0 - 0.8 * (t - 0.06) / 0.04,
        _ => 0.2,
    };
    while simulation.stopped().is_none() {
        let time = simulation.state.clock.time();
        simulation.advance().unwrap();
        let force = simulation.state.walls[1].force;
        assert!(time < 2e-3 || (force.z - 50.0 * factor(time)).abs() < 0.5, "{time}: {force}");
        assert_eq!(simulation.state.walls[1].displacement.x, 0.0);
    }
}

/// The run continues with the same bits after a restart.
#[test]
fn a_servo_survives_a_restart() {
    let text = lattice(
        [2, 2, 2],
        "hertz_mindlin = { young = 1e9, poisson = 0.2, friction_coefficient = 0.3 }\n[contacts]\nlaw = \"hertz_mindlin\"",
        "[stop]\nsteps = 2000
        [[wall]]
        material = \"m\"
        shape = { kind = \"box\", minimum = [-0.0101, -0.0102, -0.01], maximum = [0.031, 0.032, 0.0301] }
        servo = { pressure = 1e5, maximum_speed = 0.1 }",
    );
    let mut whole = simulation(&text);
    run(&mut whole);
    let mut first = simulation(&text);
    for _ in 0..777 {
        first.advance().unwrap();
    }
    let (scenario, mut assembly) = (read(&text), assembled(&text));
    let mut columns = ColumnStore::of(&first.state).unwrap();
    restart::apply(&mut assembly, &mut columns, &scenario, &[], false).unwrap();
    let mut second = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    run(&mut second);
    let bits = |v: &Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
    for (a, b) in whole.state.walls.iter().zip(&second.state.walls) {
        assert_eq!([bits(&a.displacement), bits(&a.force)], [bits(&b.displacement), bits(&b.force)]);
    }
    for (a, b) in whole.state.particles.position.iter().zip(&second.state.particles.position) {
        assert_eq!(bits(a), bits(b));
    }
}

/// What cannot be is refused, with the place.
#[test]
fn impossible_servos_are_refused() {
    for (wall, words) in [
        (
            "shape = { kind = \"plane\", point = [0, 0, 0.02], normal = [0, 0, -1] }\nservo = { maximum_speed = 1 }",
            "neither `force` nor",
        ),
        (
            "shape = { kind = \"plane\", point = [0, 0, 0.02], normal = [0, 0, -1] }\nservo = { pressure = 1, maximum_speed = 1 }",
            "needs an area",
        ),
        (
            "shape = { kind = \"box\", minimum = [-1, -1, -1], maximum = [1, 1, 1] }\nservo = { force = 1, maximum_speed = 1 }",
            "six faces",
        ),
        (
            "shape = { kind = \"cylinder\", center = [0, 0, 0], radius = 1 }\nservo = { force = 1, maximum_speed = 1 }",
            "needs a direction",
        ),
        (
            "shape = { kind = \"plane\", point = [0, 0, 0.02], normal = [0, 0, -1] }\nvelocity = [0, 0, 1]\n\
             servo = { force = 1, maximum_speed = 1 }",
            "the wall has a servo",
        ),
    ] {
        let text = lattice([1, 1, 1], LINEAR, &format!("[stop]\nsteps = 1\n[[wall]]\nmaterial = \"m\"\n{wall}"));
        let message = Scenario::parse("test.toml", &text).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
