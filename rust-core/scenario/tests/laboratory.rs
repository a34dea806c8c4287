//! Standard laboratory tests in the elastic range, on a triangular lattice of discs with central springs: Young's modulus `2k/√3` and
//! Poisson's ratio 1/3 per unit depth.

use std::path::Path;

use concordem_contact::math::{Mat3, Vec3};
use concordem_scenario::assembly::assemble;
use concordem_scenario::sampling::Record;
use concordem_scenario::schedule::Simulation;
use concordem_scenario::schema::Scenario;

const STIFFNESS: f64 = 1e7;
const RADIUS: f64 = 0.5e-3;

/// Young's modulus per unit depth, Pa.
fn young() -> f64 {
    2.0 * STIFFNESS / 3_f64.sqrt()
}

/// Discs of a triangular lattice in a shape.
fn lattice(shape: &str, loading: &str) -> String {
    format!(
        "version = 1
        dimension = 2
        [packing]
        kind = \"lattice\"
        lattice = \"triangular\"
        radius = {RADIUS}
        shape = {{ {shape} }}
        [[material]]
        name = \"m\"
        density = 2500
        linear_bond = {{ normal_stiffness = {STIFFNESS}, shear_stiffness = 0 }}
        frictional = {{ normal_stiffness = {STIFFNESS}, shear_stiffness = {STIFFNESS}, friction_coefficient = 0 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"frictional\"
        [integration]
        damping = {{ kind = \"local\", coefficient = 0.7 }}
        [output]
        sample_interval = 100
        {loading}"
    )
}

/// The last record, and the rows of the last evaluation of all operators.
fn run(text: &str) -> (Record, Vec<Vec<f64>>, Simulation) {
    let scenario = Scenario::parse("test.toml", text).unwrap_or_else(|error| panic!("{error}"));
    let assembly = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap_or_else(|error| panic!("{error}"));
    let mut run = Simulation::new(assembly.state, assembly.model, assembly.schedule).unwrap();
    loop {
        let advance = run.advance().unwrap_or_else(|error| panic!("{error}"));
        if advance.stopped.is_some() {
            let mut rows = vec![Vec::new(); run.schedule.operators.len()];
            advance.operators.into_iter().for_each(|row| rows[row.operator] = row.values);
            return (advance.last.unwrap(), rows, run);
        }
    }
}

/// Three- and four-point bending: stress over strain is Young's modulus, reduced by the shear deflection of a Timoshenko beam.
///
/// Deflection under the rollers with `a` between support and roller, span `l`, force `P` on both rollers:
/// `P a²(3l − 4a)/(12 E I)` from bending and `P a/(2 κ G b h)` from shear, with `κ = 5/6` and `E/G = 8/3`. Tolerance 4 %: the
/// rollers sink into the beam, which adds some 3 % to the deflection of three-point bending.
#[test]
fn beams_bend_on_supports() {
    let (length, height) = (0.110, 0.0125);
    for (inner, strips) in [(0.0, false), (0.0, true), (0.030, false), (0.030, true)] {
        let span: f64 = 0.100;
        let bearings = if strips { "strip_width = 1.001e-3" } else { "roller_radius = 0.003\nmaterial = \"m\"" };
        let text = lattice(
            &format!("kind = \"box\", size = [{length}, {height}, 1]"),
            &format!(
                "[loading]
                kind = \"flexure\"
                span = {span}
                inner_span = {inner}
                {bearings}
                closing_velocity = 0.2
                [[stage]]
                name = \"load\"
                stop = {{ strain = 2e-5 }}
                [[stage]]
                name = \"hold\"
                rate = 0
                stop = {{ unbalanced = 1e-7 }}"
            ),
        );
        let (record, _, simulation) = run(&text);
        let a = 0.5 * (span - inner);
        // Whole discs in the box, with a row in its middle.
        let rows = 1 + 2 * ((0.5 * height - RADIUS) / (3_f64.sqrt() * RADIUS)) as usize;
        // Each row carries the bonds along it and half of those to its neighbors.
        let real = rows as f64 * 3_f64.sqrt() * RADIUS;
        let bending = a * a * (3.0 * span - 4.0 * a) / (12.0 * real.powi(3) / 12.0);
        let shear = a / (2.0 * 5.0 / 6.0 * real) * (8.0 / 3.0);
        let expected = young() * bending / (bending + shear) * (real / height).powi(3);
        let found = record.stress / record.strain;
        assert!(
            (found / expected - 1.0).abs() < 0.04,
            "inner span {inner}, strips {strips}: {found:e}, expected {expected:e}, {rows} rows"
        );
        if strips {
            continue;
        }
        // The force of the rollers is that of the supports.
        let force = |walls: &[usize]| walls.iter().map(|&w| simulation.state.walls[w].force.y).sum::<f64>();
        let rollers: &[usize] = if inner > 0.0 { &[2, 3] } else { &[2] };
        assert!((force(rollers) / force(&[0, 1]) + 1.0).abs() < 1e-2, "{} {}", force(rollers), force(&[0, 1]));
        let moment = 0.5 * force(rollers) * a;
        assert!((record.stress / (6.0 * moment / (height * height)) - 1.0).abs() < 1e-2, "{}", record.stress);
    }
}

/// Mean stress in a circle around the middle of a disc of radius `radius` under two opposite forces along x, divided by `P/(π R)`: the
/// fields of two forces on half-planes, and a tension on all sides (Hertz).
fn split_disc(radius: f64, circle: f64) -> Mat3 {
    let (rings, rays) = (200, 200);
    let mut sum = Mat3::zeros();
    for k in 0..rings * rays {
        // Rings of equal area.
        let r = circle * ((f64::from(k / rays) + 0.5) / f64::from(rings)).sqrt();
        let angle = 2.0 * std::f64::consts::PI * (f64::from(k % rays) + 0.5) / f64::from(rays);
        let x = Vec3::new(r * angle.cos(), r * angle.sin(), 0.0);
        sum += Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0));
        for side in [-1.0, 1.0] {
            let d = x - Vec3::new(side * radius, 0.0, 0.0);
            let along = -side * d.x / d.norm();
            sum -= d * d.transpose() * (2.0 * radius * along / d.norm().powi(3));
        }
    }
    sum / f64::from(rings * rays)
}

/// Radius of the disc that splits: on either side a single disc of the lattice is outermost, so that plates touch no flat row.
const SPLIT_RADIUS: f64 = 0.01955;

/// A disc that splits between plates or strips.
fn split(by: &str) -> String {
    lattice(
        &format!("kind = \"cylinder\", radius = {SPLIT_RADIUS}, height = 1, axis = \"z\""),
        &format!(
            "[loading]
        kind = \"platens\"
        axis = \"x\"
        closing_velocity = 0.1
        {by}
        area = \"splitting\"
        [[stage]]
        name = \"load\"
        stop = {{ steps = 100 }}
        [[stage]]
        name = \"hold\"
        rate = 0
        stop = {{ unbalanced = 1e-7 }}
        [[sample]]
        operator = \"region-stress\"
        region = {{ kind = \"sphere\", center = [0, 0, 0], radius = 5e-3 }}"
        ),
    )
}

/// The mean stress in a circle of 5 mm is that of two forces on a disc which reaches to the outermost centers, where plates and strips bring in
/// their force. Tolerance 1 % of the larger stress: the circle cuts through bonds at some 60 places.
fn assert_split(record: &Record, stress: &Mat3, outermost: f64) {
    let expected = split_disc(outermost, 5e-3) * (record.stress * SPLIT_RADIUS / outermost);
    for i in [0, 1] {
        assert!((stress - expected)[(i, i)].abs() < 0.01 * expected[(0, 0)].abs(), "{stress} {expected}");
    }
}

/// Centers of a disc at the start: the largest coordinate along the load.
fn outermost(text: &str) -> f64 {
    let scenario = Scenario::parse("test.toml", text).unwrap();
    let state = assemble(&scenario, Path::new(""), &mut |_, _| ()).unwrap().state;
    state.particles.position.iter().map(|x| x.x).fold(0.0, f64::max)
}

/// Splitting of a disc: in its middle the stress across the load is `2P/(πDL)`, the stress of the result; that along it is minus three times as much.
#[test]
fn the_middle_of_a_split_disc_is_pulled_apart() {
    let text = split("material = \"m\"");
    let (record, rows, simulation) = run(&text);
    let force = simulation.state.walls[1].force.x;
    let tension = 2.0 * force / (std::f64::consts::PI * 2.0 * SPLIT_RADIUS);
    assert!((record.stress / tension - 1.0).abs() < 1e-2, "{} {tension}", record.stress);
    let middle = split_disc(SPLIT_RADIUS, 1e-9);
    assert!((middle[(0, 0)] + 3.0).abs() < 1e-6 && (middle[(1, 1)] - 1.0).abs() < 1e-6, "{middle}");
    assert_split(&record, &Mat3::from_row_slice(&rows[0][..9]), outermost(&text));
}

/// Strips of particles split a disc as plates do. Nothing holds the strips across the load. Strips of 5 mm hold three discs on a row half a spacing
/// below the outermost one, 1.7 mm apart: their width lowers the tension by 0.3 % (Hondros 1959).
#[test]
fn strips_split_a_disc_as_plates_do() {
    let text = split("strip_width = 0.005");
    let (record, rows, simulation) = run(&text);
    assert!(simulation.state.walls.is_empty());
    assert_split(&record, &Mat3::from_row_slice(&rows[0][..9]), outermost(&text));
    // The upper strip has moved towards the lower one for 100 steps; the strain refers to the diameter from surface to surface of the discs.
    let strain = -0.1 * 100.0 * (record.time / record.step) / (2.0 * (outermost(&text) + RADIUS));
    assert!((record.strain / strain - 1.0).abs() < 1e-9, "{} {strain}", record.strain);
}

/// What cannot be is refused, with the place.
#[test]
fn impossible_tests_are_refused() {
    let rollers = |shape: &str, more: &str| {
        lattice(
            shape,
            &format!(
                "[stop]\nsteps = 1\n[loading]\nkind = \"flexure\"\nroller_radius = 0.003\nclosing_velocity = 0.2\n\
                 material = \"m\"\n{more}"
            ),
        )
    };
    let beam = "kind = \"box\", size = [0.110, 0.01, 1]";
    let disc = "kind = \"cylinder\", radius = 0.01, height = 1";
    let plates = "[stop]\nsteps = 1\n[loading]\nkind = \"platens\"\naxis = \"y\"\nclosing_velocity = 1\nmaterial = \"m\"\n\
                  area = \"splitting\"";
    let strips = plates.replace("material = \"m\"", "strip_width = 1e-3");
    for (text, words) in [
        (rollers(beam, "span = 0.1\nstrip_width = 1"), "gives both"),
        (rollers(beam, "span = 0.2"), "is longer than the beam"),
        (rollers(beam, "span = 0.1\ninner_span = 0.1"), "is not shorter than"),
        (rollers(beam, "span = 0.1\nacross = \"x\""), "is the axis of the beam"),
        (rollers(beam, "span = 0.1\nacross = \"z\""), "points out of the plane"),
        (rollers(disc, "span = 0.01"), "bending needs a beam"),
        (lattice(beam, plates), "needs a cylinder"),
        (lattice(disc, &plates.replace("material = \"m\"", "")), "plates need a material"),
        (lattice(disc, &format!("{plates}\nstrip_width = 1e-3")), "strips of particles have no material"),
        (lattice(disc, &strips.replace("area = \"splitting\"", "")), "strips press on a cylinder that splits"),
        (lattice(disc, &strips.replace("1e-3", "1.1e-2")), "is more than half of the diameter"),
    ] {
        let message = Scenario::parse("test.toml", &text).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}
