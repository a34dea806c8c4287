//! Velocity fields, turning walls, and formulas of the time: closed forms, energy, restart, refusals.

mod shared;

use std::path::Path;

use concordem_contact::math::Vec3;
use concordem_scenario::assembly::{assemble, restart};
use concordem_scenario::sampling::Operator;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;
use concordem_solver::state::columns::ColumnStore;
use shared::{SPRING, bonded, place, set, simulation, spheres};

/// Runs to the end; returns the last record.
fn run(simulation: &mut Simulation) -> concordem_scenario::sampling::Record {
    loop {
        if let Some(last) = simulation.advance().unwrap().last {
            return last;
        }
    }
}

/// The bits of positions, velocities, and angular velocities of all particles, and of the forces on all walls.
fn bits(simulation: &Simulation) -> Vec<u64> {
    let particles = &simulation.state.particles;
    let walls = simulation.state.walls.iter().flat_map(|wall| [wall.force, wall.torque]);
    let all = particles.position.iter().chain(&particles.velocity).chain(&particles.angular_velocity).copied();
    all.chain(walls).flat_map(|v| [v.x.to_bits(), v.y.to_bits(), v.z.to_bits()]).collect()
}

/// Asserts that a run that restarts at `step` ends with the same bits as one without interruption.
fn assert_restarts(text: &str, step: usize) {
    let mut whole = simulation(text);
    run(&mut whole);
    let mut first = simulation(text);
    for _ in 0..step {
        first.advance().unwrap();
    }
    let scenario = Scenario::parse("test.toml", text).unwrap();
    let mut assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap();
    restart::apply(&mut assembly, &mut ColumnStore::of(&first.state).unwrap(), &scenario, &[], false).unwrap();
    let mut second = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    run(&mut second);
    assert!(bits(&whole) == bits(&second));
}

/// Shear stiffness of [`SPRING`], N/m.
const SHEAR: f64 = 5e5;

/// Two layers of a cubic lattice, cut by a circle of radius `size` spacings; all neighbors are bonded. Diameters of 1 m.
fn disc_of_two_layers(size: f64) -> (String, Vec<[f64; 4]>) {
    let mut list = Vec::new();
    let n = size as i32;
    for z in [0.0, 1.0] {
        for (i, j) in (-n..=n).flat_map(|i| (-n..=n).map(move |j| (f64::from(i), f64::from(j)))) {
            if i * i + j * j <= size * size {
                list.push([i, j, z, 0.5]);
            }
        }
    }
    let mut text = bonded(&spheres(&list), "linear_bond", SPRING);
    for (layer, half) in [("bottom", 0), ("top", 1)] {
        let ids: Vec<usize> = (half * list.len() / 2..(half + 1) * list.len() / 2).collect();
        text += &set(layer, &ids);
    }
    (text, list)
}

/// Torsion: one layer turns, the other one rests. Torque `G J/L θ` with `G = k_t/a`, `L = a`, and `J = a² Σ r²`, the discrete polar
/// moment, because bonds within a layer stay unstrained. The lattice cuts the edge of the circle, whose `J` differs by 3.8 %.
/// Tolerance: the bonds incline, by `rθ = 1e-3`, so that cosines differ from 1 by 5e-7. The angle follows a formula.
#[test]
fn a_turning_layer_twists_a_cylinder() {
    let (text, list) = disc_of_two_layers(10.2);
    let text = text
        + "[[history]]
        name = \"ramp\"
        shape = { kind = \"expression\", expression = \"1 - cos(2*pi*t/0.01)\" }
        [[prescribe]]
        set = \"bottom\"
        field = { kind = \"rotation\", point = [0, 0, 0], axis = [0, 0, 2], angular_velocity = 0 }
        [[prescribe]]
        set = \"top\"
        field = { kind = \"rotation\", point = [0, 0, 5], axis = [0, 0, 2], angular_velocity = 0.01 }
        history = \"ramp\"
        [integration]
        time_step = 1e-5
        [stop]
        time = 0.01";
    let mut simulation = simulation(&text);
    let last = run(&mut simulation);
    // ∫ 0.01 (1 − cos) dt; the midpoint rule is exact over a period of equal steps.
    let angle = 1e-4;
    let squares: f64 = list[list.len() / 2..].iter().map(|s| s[0] * s[0] + s[1] * s[1]).sum();
    let expected = SHEAR * squares * angle;
    let particles = &simulation.state.particles;
    let torque: f64 = (0..list.len())
        .filter(|&p| particles.position[p].z > 0.5)
        .map(|p| (particles.position[p].cross(&simulation.solver.forces()[p]) + simulation.solver.torques()[p]).z)
        .sum();
    assert!((torque / -expected - 1.0).abs() < 1e-6, "{torque} {expected}");
    let circle = 0.5 * std::f64::consts::PI * 10.2_f64.powi(4);
    assert!((squares / circle - 1.0).abs() < 0.04, "{squares} {circle}");
    // The particles are on their circles, and have turned with the layer. One step more than a period adds 5e-13 to the angle.
    for p in (0..list.len()).filter(|&p| particles.position[p].z > 0.5) {
        let [x, y, z, _] = list[particles.id[p] as usize];
        let place = Vec3::new(x * angle.cos() - y * angle.sin(), x * angle.sin() + y * angle.cos(), z);
        assert!((particles.position[p] - place).norm() < 1e-11, "{p}");
        assert!((2.0 * particles.orientation[p].k - angle).abs() < 1e-12);
    }
    // Work of the layers: ½ T θ. Rounding of 1,000 sums.
    let stored = 0.5 * expected * angle;
    assert!((last.boundary_work / stored - 1.0).abs() < 1e-6, "{} {stored}", last.boundary_work);
    assert!(last.residual.abs() < 1e-11 * stored, "{}", last.residual);
}

/// A block of `n³` spheres of diameter 1 m in pure shear `ε̇ = 1 1/s` between x and y.
fn sheared(n: usize, more: &str) -> (String, usize) {
    let places = (0..n * n * n).map(|k| [k % n, k / n % n, k / (n * n)]);
    let list: Vec<[f64; 4]> = places.clone().map(|x| [x[0] as f64, x[1] as f64, x[2] as f64, 0.5]).collect();
    let inside = |x: &[usize; 3]| x.iter().all(|&i| i > 0 && i + 1 < n);
    let surface: Vec<usize> = places.enumerate().filter(|(_, x)| !inside(x)).map(|(k, _)| k).collect();
    let text = bonded(&spheres(&list), "linear_bond", SPRING) + &set("surface", &surface) + more;
    (text, 2 * n * n * (n - 1))
}

const PURE_SHEAR: &str = "
    [[prescribe]]
    set = \"surface\"
    angular_velocity = [0, 0, 0]
    field = { kind = \"linear\", point = [1, 2, 0], velocity_gradient = [[0, 1, 0], [1, 0, 0], [0, 0, 0]] }
    history = \"ramp\"
    [[history]]
    name = \"ramp\"
    shape = { kind = \"table\", points = [[0, 0], [\"0.5 s\", 2e-4], [1, 0]] }
";

/// Pure shear by `ε = 1e-4` of the surface: the free particles inside follow, and each bond across x or y stores `½ k_t (ε a)²`.
/// Tolerance: terms of the order ε, and 1e-4 for the rest of the waves after the ramp with local damping.
#[test]
fn a_sheared_surface_shears_the_block() {
    let more = format!(
        "{PURE_SHEAR}[integration]\ndamping = {{ kind = \"local\", coefficient = 0.3 }}\ntime_step = 5e-4\n[stop]\ntime = 1.5\n"
    );
    let (text, bonds) = sheared(5, &more);
    let mut simulation = simulation(&text);
    let last = run(&mut simulation);
    let stored = bonds as f64 * 0.5 * SHEAR * 1e-8;
    let found = simulation.state.ledger.stored_total();
    assert!((found / stored - 1.0).abs() < 3e-4, "{found} {stored}");
    let balance = last.boundary_work - last.numerical_damping - last.viscous;
    assert!((balance / stored - 1.0).abs() < 3e-4, "{balance} {stored}");
    assert!(last.residual.abs() < 1e-11 * stored, "{}", last.residual);
    // exp(L t) moves the corner at the origin, from the fixed point (1, 2, 0).
    let corner = simulation.state.particles.id.iter().position(|&id| id == 0).unwrap();
    let (c, s) = (1e-4_f64.cosh(), 1e-4_f64.sinh());
    let place = Vec3::new(1.0 - c - 2.0 * s, 2.0 - s - 2.0 * c, 0.0);
    assert!((simulation.state.particles.position[corner] - place).norm() < 1e-12);
    assert_restarts(&sheared(3, &more).0, 400);
}

/// Components named in `free` follow the forces: a sphere on a circle about z falls.
#[test]
fn free_components_follow_the_forces() {
    let text = bonded(&spheres(&[[1.0, 0.0, 0.0, 0.1]]), "linear_bond", SPRING)
        + &set("all", &[0])
        + "[[prescribe]]
        set = \"all\"
        field = { kind = \"rotation\", point = [0, 0, 0], axis = [0, 0, 1], angular_velocity = 1, free = [\"z\"] }
        [integration]
        gravity = [0, 0, -10]
        time_step = 1e-3
        [stop]
        time = 1";
    let mut simulation = simulation(&text);
    run(&mut simulation);
    let x = simulation.state.particles.position[0];
    // Leapfrog falls by ½ g t (t + Δt).
    let t = simulation.state.clock.time();
    let place = Vec3::new(t.cos(), t.sin(), -5.0 * t * (t + 1e-3));
    assert!((x - place).norm() < 1e-11, "{x}");
}

/// A scenario of one sphere of radius 0.01 m and of linear friction, with a wall.
fn on_a_wall(friction: f64, sphere: &str, more: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [{sphere}]
        [[material]]
        name = \"m\"
        density = 2500
        frictional = {{ normal_stiffness = 1e5, shear_stiffness = 1e5, friction_coefficient = {friction} }}
        [contacts]
        law = \"frictional\"
        [[set]]
        name = \"sphere\"
        selection = {{ kind = \"all\" }}
        {more}"
    )
}

/// Mass of that sphere, kg.
fn mass() -> f64 {
    2500.0 * 4.0 / 3.0 * std::f64::consts::PI * 1e-6
}

/// A held sphere slides on a turning plane. Force `μ N` against the surface velocity `v`, moment `μ N r`, dissipation `μ N ω r t` less
/// the slip that the spring stores. The center of the rotation is not the point of the plane. The spring turns with the mean twist of
/// sphere and wall, so that its direction lags by `½ ω μ N/(k_t v) = 5e-5`, for which 1e-3 N are allowed.
#[test]
fn a_held_sphere_slides_on_a_turning_plane() {
    let text = on_a_wall(
        0.5,
        "[0.3, 0, 0.0099, 0.01]",
        "[[prescribe]]
        set = \"sphere\"
        velocity = [0, 0, 0]
        angular_velocity = [0, 0, 0]
        [[wall]]
        name = \"table\"
        material = \"m\"
        shape = { kind = \"plane\", point = [9, 0, 0], normal = [0, 0, 3] }
        rotation = { point = [0, 0.4, 0], angular_velocity = 2 }
        [integration]
        time_step = 1e-5
        [[sample]]
        operator = \"wall-moment\"
        wall = \"table\"
        [stop]
        time = 0.1",
    );
    let mut sim = simulation(&text);
    let mut rows = Vec::new();
    let last = loop {
        let advance = sim.advance().unwrap();
        rows.extend(advance.operators);
        if let Some(last) = advance.last {
            break last;
        }
    };
    // Overlap 1e-4 m: N = 10 N. At the arm (0.3, −0.4) the surface moves along (0.4, 0.3)/0.5 at 1 m/s.
    let wall = &sim.state.walls[0];
    let force = Vec3::new(-4.0, -3.0, -10.0);
    assert!((wall.force - force).norm() < 1e-3, "{}", wall.force);
    assert!((wall.force.xy().norm() - 5.0).abs() < 1e-9, "{}", wall.force);
    let sample = &sim.schedule.operators[0];
    assert_eq!(sample.operator, Operator::WallMoment);
    let moment = &rows.last().unwrap().values[place(sample, "moment")];
    // (0.3, −0.4, 0) × F
    let expected = Vec3::new(0.3, -0.4, 0.0).cross(&force);
    assert!((Vec3::from_row_slice(moment) - expected).norm() < 1e-3, "{moment:?} {expected}");
    // The spring is stretched by 5e-5 m at the limit of friction, and by the slip of one step at the start.
    let work = 5.0 * sim.state.clock.time() - 0.5e5 * 4e-5_f64.powi(2);
    assert!((last.boundary_work / work - 1.0).abs() < 1e-5, "{} {work}", last.boundary_work);
    assert!(last.residual.abs() < 1e-10 * work, "{}", last.residual);
}

/// A sphere that rolls on a turntable without slip runs on a circle with 2/7 of the angular velocity of the table (Milne 1948),
/// here three quarters of it. Tolerance: the sphere of finite stiffness slips by 1e-6 of its path; measured 3e-5.
#[test]
fn a_sphere_rolls_on_a_turntable() {
    let (speed, turn) = (0.05, 20.0);
    let overlap = mass() * 9.81 / 1e5;
    let arm = 0.01 - overlap;
    // No slip: v + ω × (−arm z) = Ω × x at x = (0.02, 0), v = (0, speed).
    let spin = (turn * 0.02 - speed) / arm;
    let period = std::f64::consts::TAU / (2.0 / 7.0 * turn);
    let text = on_a_wall(
        2.0,
        &format!("[0.02, 0, {arm}, 0.01]"),
        &format!(
            "[[initial]]
            set = \"sphere\"
            velocity = [0, {speed}, 0]
            angular_velocity = [{spin}, 0, 0]
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }}
            rotation = {{ angular_velocity = {turn} }}
            [integration]
            gravity = [0, 0, -9.81]
            time_step = 2e-5
            [stop]
            time = {}",
            0.75 * period
        ),
    );
    let mut simulation = simulation(&text);
    let last = run(&mut simulation);
    let radius = speed * 7.0 / (2.0 * turn);
    let x = simulation.state.particles.position[0];
    // Three quarters of a circle that starts at its largest x, with the time of the last step.
    let angle = std::f64::consts::TAU * simulation.state.clock.time() / period;
    let place = Vec3::new(0.02 - radius + radius * angle.cos(), radius * angle.sin(), arm);
    assert!((x - place).norm() < 1e-3 * radius, "{x} {place} {radius}");
    let energy = 0.5 * mass() * speed * speed;
    assert!(last.residual.abs() < 1e-6 * energy, "{} {energy}", last.residual);
    let short = text.replace(&format!("time = {}", 0.75 * period), "time = 0.02");
    assert_restarts(&short, 500);
}

/// A sphere, or a disc, with a fixed center is driven by a turning cylinder: friction `μ N` spins it up with `α = μ N R/I` until the
/// surfaces have the same speed. Its spin then oscillates on the spring of the contact about that of a gear: the mean is within 1e-3. The
/// angular velocity of the cylinder follows a table; friction grows with its angle `½ ω t²/T` and is fully mobilized after 6.3e-5 s,
/// so that a third of this time counts. Tolerance 1 %.
#[test]
fn a_cylinder_drives_a_sphere_as_a_gear() {
    for (dimension, side) in [(3, "outside"), (3, "inside"), (2, "outside"), (2, "inside")] {
        let (rod, normal_force) = (0.05, 1.0);
        let overlap = normal_force / 1e5;
        let radius = 0.01;
        let center = if side == "outside" { rod + radius - overlap } else { rod - radius + overlap };
        let text = on_a_wall(
            0.4,
            &format!("[{center}, 0, 0, {radius}]"),
            &format!(
                "[[prescribe]]
                set = \"sphere\"
                velocity = [0, 0, 0]
                [[history]]
                name = \"start\"
                shape = {{ kind = \"table\", points = [[0, 0], [1e-4, 1]] }}
                [[wall]]
                material = \"m\"
                shape = {{ kind = \"cylinder\", center = [0, 0, 0], radius = {rod}, side = \"{side}\" }}
                rotation = {{ angular_velocity = 4, history = \"start\" }}
                [integration]
                time_step = 1e-6
                [output]
                sample_interval = 1000
                [stop]
                time = 0.1"
            ),
        )
        .replace("version = 1", &format!("version = 1\ndimension = {dimension}"));
        let mut simulation = simulation(&text);
        // Half of m r² or two fifths; a disc is 1 m deep.
        let inertia = if dimension == 3 {
            0.4 * mass() * radius * radius
        } else {
            0.5 * 2500.0 * std::f64::consts::PI * radius.powi(4)
        };
        let arm = radius - overlap;
        let acceleration = 0.4 * normal_force * arm / inertia;
        let gear = if side == "outside" { -1.0 } else { 1.0 } * 4.0 * rod / arm;
        let time = if dimension == 3 { 0.0015 } else { 0.02 };
        while simulation.state.clock.time() < time {
            simulation.advance().unwrap();
        }
        let spin = simulation.state.particles.angular_velocity[0];
        let delay = 2.0 / 3.0 * 6.3e-5;
        let expected = acceleration * (time - delay) * gear.signum();
        assert!((spin.z / expected - 1.0).abs() < 0.01, "{dimension} {side}: {spin} {expected}");
        assert!(spin.x == 0.0 && spin.y == 0.0);
        let mut spins = Vec::new();
        let last = loop {
            let advance = simulation.advance().unwrap();
            if simulation.state.clock.time() > 0.02 {
                spins.push(simulation.state.particles.angular_velocity[0].z);
            }
            if let Some(last) = advance.last {
                break last;
            }
        };
        if dimension == 3 {
            let mean = spins.iter().sum::<f64>() / spins.len() as f64;
            assert!((mean / gear - 1.0).abs() < 1e-3, "{side}: {mean} {gear}");
        }
        assert!(last.residual.abs() < 1e-5 * last.boundary_work, "{side}: {} {}", last.residual, last.boundary_work);
    }
}

/// Clumps and deformable particles on a turning plane, below a turning plate that a servo presses: the energy balance closes, to
/// the order of the rotations per step squared that clumps are known for, and a restart continues with the same bits.
#[test]
fn clumps_and_deformable_particles_ride_on_turning_walls() {
    for (material, clump) in
        [("", "[[clump]]\nset = \"sphere\"\n"), ("deformable = { young = 1e8, poisson = 0.3 }\n", "")]
    {
        let more = format!(
            "[[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }}
            rotation = {{ angular_velocity = 5 }}
            [[wall]]
            material = \"m\"
            shape = {{ kind = \"plane\", point = [0, 0, 0.02], normal = [0, 0, -1] }}
            rotation = {{ angular_velocity = 3, history = \"swing\" }}
            servo = {{ force = 2, maximum_speed = 0.01 }}
            [[history]]
            name = \"swing\"
            shape = {{ kind = \"expression\", expression = \"sin(2*pi*100*t)\" }}
            {clump}
            [integration]
            time_step = 2e-6
            damping = {{ kind = \"local\", coefficient = 0.1 }}
            [stop]
            time = 0.02"
        );
        let text = on_a_wall(0.5, "[0.02, 0, 0.01, 0.01], [0.04, 0, 0.01, 0.01]", &more)
            .replace("density = 2500", &format!("density = 2500\n{material}"));
        let mut simulation = simulation(&text);
        let last = run(&mut simulation);
        assert!(last.boundary_work > 1e-4, "{}", last.boundary_work);
        assert!(last.residual.abs() < 1e-3 * last.boundary_work, "{} {}", last.residual, last.boundary_work);
        assert_restarts(&text.replace("time = 0.02", "time = 0.002"), 321);
    }
}

/// What cannot be is refused, with the place and the remedy.
#[test]
fn impossible_motions_are_refused() {
    let wall = |shape: &str, rotation: &str| {
        format!("[[wall]]\nmaterial = \"m\"\nshape = {shape}\nrotation = {{ angular_velocity = 1{rotation} }}\n")
    };
    let history = |shape: &str| {
        format!(
            "[[history]]\nname = \"h\"\nshape = {shape}\n[[force]]\nset = \"sphere\"\nforce = [1, 0, 0]\nhistory = \"h\"\n"
        )
    };
    let field = |keys: &str, field: &str| format!("[[prescribe]]\nset = \"sphere\"\n{keys}\nfield = {{ {field} }}\n");
    let turn = "kind = \"rotation\", point = [0, 0, 0], axis = [0, 0, 1], angular_velocity = 1";
    for (more, words) in [
        (wall("{ kind = \"box\", minimum = [-1, -1, -1], maximum = [1, 1, 1] }", ""), "does not stay in its place"),
        (wall("{ kind = \"cylinder\", center = [0, 0, 0], radius = 1 }", ", point = [0, 0, 0]"), "about its own axis"),
        (wall("{ kind = \"cylinder\", center = [0, 0, 0], radius = 1 }", ", history = \"none\""), "no history"),
        (field("velocity = [0, \"free\", \"free\"]", turn), "the field prescribes the velocity"),
        (field("angular_velocity = [0, 0, 0]", turn), "the field prescribes the angular velocity"),
        (field("", &turn.replace("[0, 0, 1]", "[0, 0, 0]")), "must not be zero"),
        (field("", &format!("{turn}, free = [\"x\", \"y\", \"z\"]")), "prescribes no component"),
        (field("", &format!("{turn}, free = [\"x\", \"x\"]")), "names an axis twice"),
        (
            history("{ kind = \"expression\", expression = \"2*sinus(t)\" }"),
            "test.toml:16:48: history[0].shape.expression",
        ),
        (history("{ kind = \"expression\", expression = \"2*sinus(t)\" }"), "`sinus` is no function"),
        (history("{ kind = \"expression\", expression = \"1/(t - 0.005)\" }"), "is inf at t = 0.005 s"),
    ] {
        let text = on_a_wall(0.5, "[0, 0, 0, 0.01]", &format!("{more}[stop]\ntime = 0.01"));
        let message = Scenario::parse("test.toml", &text).expect_err(words).to_string();
        assert!(message.contains(words) && message.contains("help:"), "{message}");
    }
    let unbounded = on_a_wall(0.5, "[0, 0, 0, 0.01]", &history("{ kind = \"expression\", expression = \"t\" }"));
    let message = Scenario::parse("test.toml", &format!("{unbounded}[stop]\nsteps = 10")).unwrap_err().to_string();
    assert!(message.contains("need an end of their search"), "{message}");
    let turning = wall("{ kind = \"plane\", point = [0, 0, 0], normal = [0, 1, 0] }", "");
    let plane = on_a_wall(0.5, "[0, 0.02, 0, 0.01]", &format!("{turning}[stop]\ntime = 1"));
    let flat = plane.replace("version = 1", "version = 1\ndimension = 2");
    let message = Scenario::parse("test.toml", &flat).unwrap_err().to_string();
    assert!(message.contains("leaves two dimensions"), "{message}");
    let cell = plane.replace("kind = \"spheres\"", "kind = \"spheres\"\ncell = [0.1, 0.1, 0.1]");
    let moved = format!("{}{}", cell, field("", turn).replace("[[prescribe]]", "\n[[prescribe]]"));
    let message = Scenario::parse("test.toml", &moved).unwrap_err().to_string();
    assert!(message.contains("images of a turning wall") && message.contains("a particle and its image"), "{message}");
    let out = on_a_wall(
        0.5,
        "[0, 0, 0, 0.01]",
        &format!("{}[stop]\ntime = 1", field("", &turn.replace("[0, 0, 1]", "[0, 1, 1]"))),
    );
    let message = Scenario::parse("test.toml", &out.replace("version = 1", "version = 1\ndimension = 2")).unwrap_err();
    assert!(message.to_string().contains("points out of the plane"), "{message}");
    // Two fields that move the same particle.
    let twice = format!("{}{}[integration]\ntime_step = 1e-3\n[stop]\ntime = 1", field("", turn), field("", turn));
    let scenario = Scenario::parse("test.toml", &on_a_wall(0.5, "[0, 0, 0, 0.01]", &twice)).unwrap();
    let error = assemble(&scenario, Path::new(""), &mut |_, _| ()).err().expect("two motions");
    assert!(error.to_string().contains("another prescribed motion"), "{error}");
}
