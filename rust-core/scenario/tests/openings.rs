//! Loadings and walls that follow the opening of a gauge: elastic closed forms, snap-back, restart, energy, refusals.

mod shared;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{Assembly, restart};
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::{assembled, read, simulation};

/// A record, with the elongation of the first gauge at the same moment.
#[derive(Clone, Copy)]
struct Row {
    record: Record,
    elongation: f64,
}

/// Records of a run whose gauges and records have the same interval.
fn run(simulation: &mut Simulation) -> Vec<Row> {
    let mut rows = Vec::new();
    loop {
        let advance = simulation.advance().unwrap_or_else(|error| panic!("{error}"));
        let gauge = advance.operators.iter().find(|row| row.operator == 0).map(|row| row.values[1]);
        if let (Some(record), Some(elongation)) = (advance.sample, gauge) {
            rows.push(Row { record, elongation });
        }
        if advance.stopped.is_some() {
            return rows;
        }
    }
}

/// A beam of one layer of concrete spheres of 1 mm on a square lattice, 60 × 11, notched in the middle of its lower side to a third of
/// its height. Bonds reach the diagonal neighbors. `ductility`: softening strain over crack onset strain; `loading`: keys of the loading
/// and further tables.
fn beam(ductility: f64, loading: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = 1e-3
        shape = {{ kind = \"box\", size = [0.12, 0.002, 0.022] }}
        [[material]]
        name = \"m\"
        density = 4800
        cpm = {{ young = 25e9, shear_ratio = 0.2, crack_onset_strain = 1e-4, relative_ductility = {ductility}, cohesion = 3e6, \
         friction_coefficient = 0.8 }}
        [bonds]
        law = \"cpm\"
        interaction_ratio = 1.45
        [contacts]
        law = \"cpm\"
        [[cut]]
        shape = {{ kind = \"parallelogram\", corner = [0, -0.01, -0.012], edges = [[0, 0.02, 0], [0, 0, 0.0089]] }}
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [[set]]
        name = \"left\"
        selection = {{ kind = \"box\", minimum = [-3.5e-3, -1, -0.0105], maximum = [-0.5e-3, 1, -0.0075] }}
        [[set]]
        name = \"right\"
        selection = {{ kind = \"box\", minimum = [0.5e-3, -1, -0.0105], maximum = [3.5e-3, 1, -0.0075] }}
        [[sample]]
        name = \"mouth\"
        operator = \"gauge\"
        sets = [\"left\", \"right\"]
        [output]
        sample_interval = 20
        [loading]
        kind = \"flexure\"
        span = 0.1
        strip_width = 4.1e-3
        closing_velocity = 0.2
        {loading}"
    )
}

/// Rate of the opening, m/s, in most tests.
const RATE: f64 = 2e-3;

/// The keys that make the mouth open at [`RATE`].
fn opening() -> String {
    format!("opening = {{ gauge = \"mouth\", rate = {RATE}, response_time = 3e-5 }}\n")
}

/// In the elastic range it does not matter which of the two is given: opening and deflection of a run that follows the gauge are those
/// of a run that moves its rollers, under the same stress. Both rest at the end. Tolerance 1e-4: what the residual forces of 1e-5 of
/// the contact forces leave. The opening itself is within 1 % of its target, as the integral part still works on the rest.
#[test]
fn an_elastic_beam_is_bent_by_its_opening() {
    let target = 4e-8;
    let rest = "[[stage]]\nname = \"hold\"\nrate = 0\nstop = { unbalanced = 1e-5 }";
    let by_opening = format!(
        "{}[[stage]]\nname = \"load\"\nrate = 0.05\nstop = {{ time = {} }}\n{rest}",
        opening(),
        target / (0.05 * RATE)
    );
    let last = |text: &str| *run(&mut simulation(text)).last().unwrap();
    let controlled = last(&beam(30.0, &by_opening));
    assert!((controlled.elongation / target - 1.0).abs() < 1e-2, "{}", controlled.elongation);
    let strain = controlled.record.strain;
    let moved = format!("[[stage]]\nname = \"load\"\nrate = 0.002\nstop = {{ strain = {strain} }}\n{rest}");
    let moved = last(&beam(30.0, &moved));
    for (what, one, other) in [
        ("stiffness", controlled.record.stress / strain, moved.record.stress / moved.record.strain),
        ("opening", controlled.elongation / strain, moved.elongation / moved.record.strain),
    ] {
        assert!((one / other - 1.0).abs() < 1e-4, "{what}: {one:e} {other:e}");
    }
}

/// Elongation over its target minus 1, at the records from a target (m) on.
fn errors(rows: &[Row], rate: f64, from: f64) -> impl Iterator<Item = f64> {
    let after = rows.iter().filter(move |row| rate * row.record.time > from);
    after.map(move |row| row.elongation / (rate * row.record.time) - 1.0)
}

/// The crack grows under control until the beam carries half of its strength: the opening is within 1 % of its target from the middle of
/// the run on, within 3 % from a tenth on, while the beam swings. The ledger is closed.
#[test]
fn a_crack_opens_at_its_rate() {
    let end = 2e-5;
    let rows = run(&mut simulation(&beam(4.0, &format!("{}[stop]\ntime = {}", opening(), end / RATE))));
    let worst = |from: f64| errors(&rows, RATE, from).fold(0.0, |worst: f64, error| worst.max(error.abs()));
    assert!(worst(0.5 * end) < 0.01 && worst(0.1 * end) < 0.03, "{} {}", worst(0.5 * end), worst(0.1 * end));
    let strongest = rows.iter().map(|row| row.record.stress).fold(0.0, f64::max);
    let last = rows.last().unwrap().record;
    assert!(last.stress < 0.55 * strongest, "{} of {strongest}", last.stress);
    assert!(last.residual.abs() < 1e-8 * last.boundary_work, "{} {}", last.residual, last.boundary_work);
}

/// A slender beam of a more brittle material stores so much energy that it snaps back: the crack jumps ahead of its target, the rollers
/// turn back by more than a fifth of their way, and wait until the target has caught up; then it is followed again. Tolerance 2 %:
/// the beam still swings.
#[test]
fn rollers_turn_back_where_a_beam_snaps_back() {
    let (rate, end) = (1e-3, 1.1e-5);
    let control = format!(
        "opening = {{ gauge = \"mouth\", rate = {rate}, response_time = 1e-4 }}\n[stop]\ntime = {}",
        end / rate
    );
    let text = beam(2.0, &control);
    let text = text
        .replace("size = [0.12,", "size = [0.2,")
        .replace("span = 0.1", "span = 0.19")
        .replace("0.0089]", "0.0049]");
    let rows = run(&mut simulation(&text));
    let middle = rows.iter().position(|row| row.record.time > 0.3 * end / rate).unwrap();
    let (before, after) = rows.split_at(middle);
    let peak = before.iter().map(|row| row.record.strain).fold(0.0, f64::max);
    let back = after.iter().map(|row| row.record.strain).fold(f64::INFINITY, f64::min);
    assert!(back < 0.8 * peak, "{back} of {peak}");
    let worst = errors(&rows, rate, 0.9 * end).fold(0.0, |worst: f64, error| worst.max(error.abs()));
    assert!(worst < 0.02, "{worst}");
    let last = rows.last().unwrap().record;
    assert!(last.residual.abs() < 1e-8 * last.boundary_work, "{} {}", last.residual, last.boundary_work);
}

/// The run continues with the same bits after a restart, also within a stage that unloads.
#[test]
fn a_controlled_run_survives_a_restart() {
    let stages = "[[stage]]\nname = \"load\"\nstop = { steps = 900 }\n[[stage]]\nname = \"unload\"\nrate = -0.5\nstop = { steps = 600 }";
    let text = beam(10.0, &format!("{}{stages}", opening()));
    let mut whole = simulation(&text);
    run(&mut whole);
    for step in [333, 1222] {
        let mut first = simulation(&text);
        for _ in 0..step {
            first.advance().unwrap();
        }
        let (scenario, mut assembly) = (read(&text), assembled(&text));
        let mut columns = ColumnStore::of(&first.state).unwrap();
        restart::apply(&mut assembly, &mut columns, &scenario, &[], false).unwrap();
        let mut second = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
        run(&mut second);
        let bits = |v: &Vec3| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()];
        let particles = |run: &Simulation| run.state.particles.position.iter().map(bits).collect::<Vec<_>>();
        assert!(particles(&whole) == particles(&second), "restart at {step}");
    }
}

/// Two end layers follow the gauge between the third and the third last sphere of a chain, in tension and in compression. The springs
/// are in series, so that the ends move 7/4 times as far. Plates press a chain by the same rule. Tolerance 1e-3: the integral
/// part of the servo needs more of its response times for the rest.
#[test]
fn ends_and_plates_follow_a_gauge() {
    for (kind, sign) in [("uniaxial", 1.0), ("uniaxial", -1.0), ("platens", -1.0)] {
        let spheres: Vec<[f64; 4]> = (0..8).map(|k| [0.0, 0.0, 0.02 * f64::from(k), 0.01]).collect();
        let rate = if kind == "uniaxial" {
            format!("strain_rate = {sign}\nlayer_thickness = 0.01")
        } else {
            "closing_velocity = 0.2\nmaterial = \"m\"".to_owned()
        };
        let text = format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = {spheres:?}
            [[material]]
            name = \"m\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            frictional = {{ normal_stiffness = 1e6, shear_stiffness = 0 }}
            [bonds]
            law = \"linear_bond\"
            interaction_ratio = 1.01
            [contacts]
            law = \"frictional\"
            [integration]
            damping = {{ kind = \"local\", coefficient = 0.5 }}
            [[set]]
            name = \"low\"
            selection = {{ kind = \"ids\", ids = [2] }}
            [[set]]
            name = \"high\"
            selection = {{ kind = \"ids\", ids = [5] }}
            [[sample]]
            operator = \"gauge\"
            sets = [\"low\", \"high\"]
            [output]
            sample_interval = 100
            [loading]
            kind = \"{kind}\"
            {rate}
            opening = {{ gauge = \"gauge\", rate = {}, response_time = 4e-4 }}
            [[stage]]
            name = \"load\"
            stop = {{ steps = 280 }}
            [[stage]]
            name = \"hold\"
            rate = 0
            stop = {{ steps = 300 }}",
            sign * 5e-4
        );
        let mut simulation = simulation(&text);
        let last = *run(&mut simulation).last().unwrap();
        let target = sign * 5e-4 * 280.0 * simulation.state.clock.dt;
        assert!((last.elongation / target - 1.0).abs() < 1e-3, "{kind} {sign}: {}", last.elongation);
        let x = &simulation.state.particles.position;
        let whole = x[7].z - x[0].z - 0.14;
        assert!((whole / (target * 7.0 / 3.0) - 1.0).abs() < 1e-3, "{kind} {sign}: {whole}");
    }
}

/// A piston shortens the gauge of a column: the force is that of its springs. A round wedge between two bonded spheres, which stay at
/// its height, spreads them: with the tension `k e` of the bond and the angle of the contacts, the force on the wedge is
/// `2 k e tan φ`. Tolerances 1e-4 and 1e-3: what is left after fifty response times.
#[test]
fn walls_follow_a_gauge() {
    let scenario = |spheres: &str, gauge: [usize; 2], more: &str| {
        format!(
            "version = 1
            [packing]
            kind = \"spheres\"
            spheres = {spheres}
            [[material]]
            name = \"m\"
            density = 2500
            linear_bond = {{ normal_stiffness = 1e6, shear_stiffness = 5e5 }}
            frictional = {{ normal_stiffness = 1e6, shear_stiffness = 0 }}
            [contacts]
            law = \"frictional\"
            [integration]
            damping = {{ kind = \"local\", coefficient = 0.5 }}
            [[set]]
            name = \"first\"
            selection = {{ kind = \"ids\", ids = [{}] }}
            [[set]]
            name = \"second\"
            selection = {{ kind = \"ids\", ids = [{}] }}
            [[sample]]
            name = \"mouth\"
            operator = \"gauge\"
            sets = [\"first\", \"second\"]
            [stop]
            time = 0.04
            [[history]]
            name = \"ramp\"
            shape = {{ kind = \"table\", points = [[0, 0], [0.02, 1]], smooth = true }}
            {more}",
            gauge[0], gauge[1]
        )
    };
    let column = scenario(
        "[[0, 0, 0, 0.01], [0, 0, 0.02, 0.01], [0, 0, 0.04, 0.01], [0, 0, 0.06, 0.01]]",
        [0, 3],
        "[[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, -0.01], normal = [0, 0, 1] }
        [[wall]]
        material = \"m\"
        shape = { kind = \"plane\", point = [0, 0, 0.07], normal = [0, 0, -1] }
        history = \"ramp\"
        servo = { opening = -3e-5, gauge = \"mouth\", response_time = 4e-4, maximum_speed = 0.1 }",
    );
    let mut column = simulation(&column);
    let last = *run(&mut column).last().unwrap();
    assert!((last.elongation / -3e-5 - 1.0).abs() < 1e-4, "{}", last.elongation);
    let force = column.state.walls[1].force.z;
    assert!((force / (1e6 * 1e-5) - 1.0).abs() < 1e-4, "{force}");
    let wedge = scenario(
        "[[-0.01, 0, 0, 0.01], [0.01, 0, 0, 0.01]]",
        [0, 1],
        "[bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [[set]]
        name = \"both\"
        selection = { kind = \"all\" }
        [[prescribe]]
        set = \"both\"
        velocity = [\"free\", 0, 0]
        angular_velocity = [0, 0, 0]
        [[wall]]
        material = \"m\"
        shape = { kind = \"cylinder\", center = [0, 0, 0.0174], axis = \"y\", radius = 0.01, side = \"outside\" }
        history = \"ramp\"
        servo = { opening = 2e-5, gauge = \"mouth\", response_time = 4e-4, maximum_speed = 0.1, direction = [0, 0, -1] }",
    );
    let mut wedge = simulation(&wedge);
    let last = *run(&mut wedge).last().unwrap();
    assert!((last.elongation / 2e-5 - 1.0).abs() < 1e-3, "{}", last.elongation);
    let wall = &wedge.state.walls[0];
    let x = wedge.state.particles.position[1];
    let slope = (0.0174 + wall.displacement.z) / x.x;
    let expected = 2.0 * 1e6 * last.elongation * slope;
    // The force of the last step belongs to the positions before it.
    assert!((wall.force.z / expected - 1.0).abs() < 1e-3, "{} {expected}", wall.force.z);
}

/// What cannot be is refused, with the place; so is a restart with another opening.
#[test]
fn impossible_openings_are_refused() {
    let stop = "[stop]\nsteps = 10";
    let text = beam(30.0, &format!("{}{stop}", opening()));
    for (old, new, words) in [
        ("gauge = \"mouth\"", "gauge = \"mouse\"", "did you mean \"mouth\"?"),
        ("rate = 0.002", "rate = 0", "must not be zero"),
        (
            "operator = \"gauge\"\n        sets = [\"left\", \"right\"]",
            "operator = \"set-motion\"\n        set = \"left\"",
            "has no gauge",
        ),
        (", response_time = 3e-5", "", "response_time"),
    ] {
        assert!(text.contains(old), "{old}");
        let message = Scenario::parse("test.toml", &text.replace(old, new)).expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    }
    let wall = |servo: &str| {
        text.replace(&opening(), "")
            + &format!(
                "\n[[wall]]\nmaterial = \"m\"\nshape = {{ kind = \"plane\", point = [0, 0, 1], normal = [0, 0, -1] }}\nservo = {{ {servo} }}"
            )
    };
    for (servo, words) in [
        ("maximum_speed = 1, opening = 1e-5, gauge = \"mouth\"", "needs a `response_time`"),
        ("maximum_speed = 1, opening = 1e-5, response_time = 1", "needs a `gauge`"),
        ("maximum_speed = 1, opening = 0, gauge = \"mouth\", response_time = 1", "must not be zero"),
        (
            "maximum_speed = 1, opening = 1, gauge = \"mouth\", response_time = 1, force = 1",
            "gives both `force` and `opening`",
        ),
        ("maximum_speed = 1, force = 1, gain = 1", "only a servo with `opening`"),
        (
            "maximum_speed = 1, opening = 1, gauge = \"mouth\", response_time = 1, area = 1",
            "only a pressure needs an area",
        ),
    ] {
        let message = Scenario::parse("test.toml", &wall(servo)).expect_err(words).to_string();
        assert!(message.contains(words), "{message}");
    }
    let before = Scenario::parse("test.toml", &text).unwrap();
    for (old, new) in [("rate = 0.002", "rate = 0.005"), (&opening()[..], "")] {
        let after = Scenario::parse("test.toml", &text.replace(old, new)).unwrap();
        let message =
            restart::check(&before, &after, restart::Continuation::NewResult).expect_err("opening").to_string();
        assert!(message.contains("loading.opening"), "{message}");
    }
}

/// A bar of 12 × 3 bonded spheres or discs that is pulled along x until its gauge has its target, and then rests. `material`: further keys
/// of the material, `more`: further tables, `dimension`: that of the scenario.
fn bar(dimension: usize, material: &str, more: &str) -> String {
    let at = |k: usize| format!("[{:?}, {:?}, 0, 1e-3]", 2e-3 * (k / 3) as f64, 2e-3 * (k % 3) as f64);
    let spheres: Vec<String> = (0..36).map(at).collect();
    // Discs of 1 m depth with the mass of the spheres, so that the response time fits them, too.
    let density = if dimension == 2 { 2500.0 * 4.0 / 3.0 * 1e-3 } else { 2500.0 };
    format!(
        "version = 1
        dimension = {dimension}
        [packing]
        kind = \"spheres\"
        spheres = [{}]
        [[material]]
        name = \"m\"
        density = {density}
        linear_bond = {{ normal_stiffness = 1e7, shear_stiffness = 4e6, damping_ratio = 0.1 }}
        {material}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"none\"
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.3 }}
        [[set]]
        name = \"left\"
        selection = {{ kind = \"ids\", ids = [9, 10, 11] }}
        [[set]]
        name = \"right\"
        selection = {{ kind = \"ids\", ids = [24, 25, 26] }}
        [[sample]]
        name = \"gauge\"
        operator = \"gauge\"
        sets = [\"left\", \"right\"]
        [output]
        sample_interval = 20
        [loading]
        kind = \"uniaxial\"
        axis = \"x\"
        strain_rate = 2
        opening = {{ gauge = \"gauge\", rate = 1e-2, response_time = 2e-5 }}
        [[stage]]
        name = \"pull\"
        stop = {{ time = 1e-3 }}
        [[stage]]
        name = \"rest\"
        rate = 0
        stop = {{ time = 1e-3 }}
        {more}",
        spheres.join(", ")
    )
}

/// The opening reaches its target of 10 µm in the plane, with a rigid body in the gauge, with deformable particles, and with heat that
/// expands the bar meanwhile; also after a restart from half-way, to the bit. 1 %: the limit that the control must keep.
#[test]
fn an_opening_is_followed_whatever_the_bar_is_made_of() {
    let clump =
        "[[set]]\nname = \"pair\"\nselection = { kind = \"ids\", ids = [15, 16, 18, 19] }\n[[clump]]\nset = \"pair\"\n";
    let hot = "[heat]\nmodel = \"disordered\"\ntemperature = 293\n[[heat.source]]\nset = \"left\"\npower = 10\n";
    let expands = "thermal = { specific_heat = 800, conductivity = 1, expansion = 1e-5 }";
    let deforms = "deformable = { young = 60e9, poisson = 0.2 }";
    for (what, dimension, material, more) in [
        ("spheres", 3, "", ""),
        ("plane", 2, "", ""),
        ("clump", 3, "", clump),
        ("deformable", 3, deforms, ""),
        ("heat", 3, expands, hot),
    ] {
        let text = bar(dimension, material, more);
        let mut whole = simulation(&text);
        let last = *run(&mut whole).last().unwrap();
        assert!((last.elongation / 1e-5 - 1.0).abs() < 0.01, "{what}: {:e}", last.elongation);
        let mut half = simulation(&text);
        while half.state.clock.time() < 1e-3 {
            half.advance().unwrap();
        }
        let Assembly { model, schedule, .. } = assembled(&text);
        let mut resumed = Simulation::new(half.state.clone(), model, schedule).unwrap();
        run(&mut resumed);
        assert_eq!(ColumnStore::of(&whole.state).unwrap(), ColumnStore::of(&resumed.state).unwrap(), "{what}");
    }
}
