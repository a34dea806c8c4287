//! Pulses in lattice bars against one-dimensional theory: speed, amplitude, and duration; reflection and transmission where the impedance
//! changes, and through a soft joint.

mod shared;

use concordem_scenario::schedule::Simulation;
use shared::simulation;

const STIFFNESS: f64 = 1e7;
const RADIUS: f64 = 1e-3;
/// Spheres of the bar, and of the striker at its start.
const COUNT: usize = 401;
const STRIKER: usize = 60;
/// Velocity of the striker, m/s.
const SPEED: f64 = 2.0;
/// Densities of the spheres, kg/m³.
const DENSITY: f64 = 2500.0;

fn mass(density: f64) -> f64 {
    density * 4.0 / 3.0 * std::f64::consts::PI * RADIUS.powi(3)
}

/// Impedance of a bar, force over velocity, kg/s: `√(k m)`.
fn impedance(density: f64) -> f64 {
    (STIFFNESS * mass(density)).sqrt()
}

/// Time that a wave needs from one sphere of the first material to the next, s.
fn step() -> f64 {
    (mass(DENSITY) / STIFFNESS).sqrt()
}

/// Nine rows of spheres along x, in contact with a striker. Spheres from the number `second` on have another density, and `joint` is the
/// stiffness of the bond before them, N/m. Gauges record the stress at two numbers.
fn bar(second: usize, density: f64, joint: f64, gauges: [usize; 2], time: f64) -> String {
    let at = |sphere: usize| 2.0 * RADIUS * (sphere as f64 - 0.5 * COUNT as f64);
    let side = 3.0 * RADIUS;
    let layer = |name: &str, first: usize, last: usize, material: &str| {
        format!(
            "[[set]]\nname = \"{name}\"\nselection = {{ kind = \"box\", minimum = [{}, -1, -1], maximum = [{}, 1, 1] }}\n{material}\n",
            at(first),
            at(last)
        )
    };
    let gauge = |name: &str, sphere: usize| {
        format!(
            "[[sample]]\nname = \"{name}\"\noperator = \"region-stress\"\nregion = {{ kind = \"box\", minimum = [{}, -{side}, -{side}], \
             maximum = [{}, {side}, {side}] }}\n",
            at(sphere) - RADIUS,
            at(sphere) + RADIUS
        )
    };
    let table = |name: &str, density: f64| {
        format!(
            "[[material]]\nname = \"{name}\"\ndensity = {density}\nlinear_bond = {{ normal_stiffness = {STIFFNESS}, shear_stiffness = 0 }}\n\
             frictional = {{ normal_stiffness = {STIFFNESS}, shear_stiffness = 0 }}\n"
        )
    };
    format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = {RADIUS}
        shape = {{ kind = \"box\", size = [{}, {}, {}] }}
        {}{}
        [[interface]]
        between = [\"bar\", \"other\"]
        linear_bond = {{ normal_stiffness = {joint}, shear_stiffness = 0 }}
        [bonds]
        law = \"linear_bond\"
        interaction_ratio = 1.01
        [contacts]
        law = \"frictional\"
        [integration]
        safety = 0.4
        {}{}
        [[cut]]
        shape = {{ kind = \"parallelogram\", corner = [{}, -1, -1], edges = [[0, 2, 0], [0, 0, 2]] }}
        [[initial]]
        set = \"striker\"
        velocity = [{SPEED}, 0, 0]
        {}{}
        [stop]
        time = {time}
        [output]
        sample_interval = 5",
        (2.0 * COUNT as f64 + 0.2) * RADIUS,
        6.2 * RADIUS,
        6.2 * RADIUS,
        table("bar", DENSITY),
        table("other", density),
        layer("striker", 0, STRIKER, ""),
        layer("second", second, COUNT, "material = \"other\""),
        at(STRIKER),
        gauge("first gauge", gauges[0]),
        gauge("second gauge", gauges[1]),
    )
}

/// Time (s) and force per row (N, compression positive) of both gauges.
fn forces(simulation: &mut Simulation) -> [Vec<[f64; 2]>; 2] {
    assert_eq!(simulation.state.particles.len(), 9 * COUNT);
    let mut all = [Vec::new(), Vec::new()];
    while simulation.stopped().is_none() {
        for row in simulation.advance().unwrap_or_else(|error| panic!("{error}")).operators {
            all[row.operator].push([row.time, -row.values[0] * 4.0 * RADIUS * RADIUS]);
        }
    }
    all
}

/// Mean force from one time (s) to another.
fn mean(rows: &[[f64; 2]], from: f64, to: f64) -> f64 {
    let inside: Vec<f64> = rows.iter().filter(|row| row[0] >= from && row[0] <= to).map(|row| row[1]).collect();
    assert!(inside.len() > 20, "{from} {to}");
    inside.iter().sum::<f64>() / inside.len() as f64
}

/// Time at which the force passes a value, s.
fn passing(rows: &[[f64; 2]], value: f64) -> f64 {
    let k = rows.iter().position(|row| row[1] > value).unwrap();
    let [a, b] = [rows[k - 1], rows[k]];
    a[0] + (b[0] - a[0]) * (value - a[1]) / (b[1] - a[1])
}

/// A striker gives a pulse of the force `Z V/2` and the duration `2 l/c`, with `c = d √(k/m)`. Tolerances: 1 % of the mean over the
/// plateau, on which the lattice lets waves of its own run behind the front; 0.5 % of the speed between gauges; 1.5 % of the duration,
/// half a sphere of sixty at either end.
#[test]
fn a_striker_gives_a_pulse_of_known_force_and_length() {
    let mut run = simulation(&bar(350, DENSITY, STIFFNESS, [150, 270], 400.0 * step()));
    let [first, second] = forces(&mut run);
    let expected = 0.5 * impedance(DENSITY) * SPEED;
    let arrival = passing(&first, 0.5 * expected);
    let plateau = mean(&first, arrival + 20.0 * step(), arrival + 100.0 * step());
    assert!((plateau / expected - 1.0).abs() < 0.01, "{plateau} {expected}");
    let speed = 120.0 / (passing(&second, 0.5 * expected) - arrival) * step();
    assert!((speed - 1.0).abs() < 0.005, "{speed}");
    let impulse: f64 = first.windows(2).map(|pair| 0.5 * (pair[0][1] + pair[1][1]) * (pair[1][0] - pair[0][0])).sum();
    let duration = impulse / expected / step();
    assert!((duration / (2.0 * STRIKER as f64) - 1.0).abs() < 0.015, "{duration}");
}

/// Where the density is four times as large, the impedance doubles: a third of the pulse returns with the same sign, and four thirds go
/// on. Where it is a quarter, a third returns with the other sign, and two thirds go on. The gauges lie so that no pulses overlap at
/// them in the windows of the means. Tolerance 2 % of the incident pulse: waves of the lattice behind two fronts.
#[test]
fn pulses_return_where_the_impedance_changes() {
    for density in [4.0 * DENSITY, 0.25 * DENSITY] {
        let (one, two) = (impedance(DENSITY), impedance(density));
        // Spheres that a wave passes in the second material, while it passes one in the first.
        let pace = one / two;
        let mut run = simulation(&bar(300, density, STIFFNESS, [220, 320], 480.0 * step()));
        let [first, second] = forces(&mut run);
        let incident = 0.5 * one * SPEED;
        let arrival = passing(&first, 0.5 * incident);
        let at = |rows: &[[f64; 2]], from: f64, to: f64| {
            mean(rows, arrival + from * step(), arrival + to * step()) / incident
        };
        let reflection = (two - one) / (two + one);
        let behind = 80.0 + 20.0 / pace;
        // Until the wave from the free end arrives.
        let end = (behind + 160.0 / pace).min(behind + 110.0);
        for (what, found, expected) in [
            ("incident", at(&first, 20.0, 100.0), 1.0),
            ("reflected", at(&first, 180.0, 250.0), reflection),
            ("transmitted", at(&second, behind + 15.0, end - 10.0), 1.0 + reflection),
        ] {
            assert!((found - expected).abs() < 0.02, "{what} pulse at the density {density}: {found} {expected}");
        }
    }
}

/// A joint of the stiffness κ between two bars passes on the force `F (1 − exp(−2 κ t/Z))`. Tolerance 2 % of F: the fronts are spread
/// over some spheres, and the force changes by 1 % per sphere.
#[test]
fn a_soft_joint_passes_the_pulse_on() {
    let joint = 0.005 * STIFFNESS;
    let mut run = simulation(&bar(200, DENSITY, joint, [150, 270], 400.0 * step()));
    let [_, second] = forces(&mut run);
    let incident = 0.5 * impedance(DENSITY) * SPEED;
    let start = (270 - STRIKER) as f64 * step();
    let rate = 2.0 * joint / impedance(DENSITY);
    let mut worst: f64 = 0.0;
    for row in second.iter().filter(|row| row[0] > start + 20.0 * step() && row[0] < start + 110.0 * step()) {
        let expected = 1.0 - (-rate * (row[0] - start)).exp();
        worst = worst.max((row[1] / incident - expected).abs());
    }
    assert!(worst > 0.0 && worst < 0.02, "{worst}");
}
