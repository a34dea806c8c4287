//! Benchmark tests 6 and 8 of Chung & Ooi 2011 (Granular Matter 13:643) as scenarios, and an impact with zero restitution.
//!
//! A sphere of aluminum alloy hits a rigid plane (6), or a far larger, heavier, and stiffer sphere (8), at 0.2 m/s with
//! different spins; e = 0.5, μ = 0.4. Published curves, digitized in Kratos Multiphysics (`benchmark6_graph1.dat`,
//! `benchmark6_graph2.dat`, `benchmark8_graph1.dat`, `benchmark8_graph2.dat`): the tangential restitution `β =
//! −v_s'/v_s` of the contact patch over `3.5 μ(1+e) v_n/v_s`, and the tangent of its recoil angle over that of
//! incidence. The measure `Σ|Δ|/Σ|reference|`, the points (where the contact slides), and the tolerance of 3 % are
//! those of the Kratos tests.

use std::fmt::Write as _;

use concordem::law::restitution::{End, damping_of_restitution};
use concordem_tests::runs::run;

const RADIUS: f64 = 0.1;
const SPEED: f64 = 0.2;
const FRICTION: f64 = 0.4;
const RESTITUTION: f64 = 0.5;

/// `3.5 μ(1+e) v_n/v_s` and β of tests 6 and 8.
const BETA: [[[f64; 2]; 6]; 2] = [
    [
        [0.176_211, -0.820_027],
        [0.352_423, -0.633_471],
        [0.550_661, -0.444_719],
        [0.770_925, -0.242_798],
        [0.969_163, -0.027_709],
        [1.189_427, 0.097_394],
    ],
    [
        [0.187_166, -0.815_223],
        [0.358_289, -0.626_247],
        [0.550_802, -0.439_370],
        [0.764_706, -0.237_795],
        [0.978_610, -0.017_323],
        [1.213_904, 0.096_063],
    ],
];

/// Tangents of the angles of incidence and recoil.
const RECOIL: [[[f64; 2]; 4]; 2] = [
    [[2.148_804, 0.052_311], [2.747_110, 1.271_662], [3.732_928, 3.241_419], [5.677_371, 7.127_333]],
    [[2.143_701, 0.095_498], [2.750_000, 1.306_958], [3.721_457, 3.271_487], [5.664_370, 7.151_432]],
];

/// Velocity of the contact patch along x divided by that before the impact, and velocity along z after the impact, of
/// spheres with these tangents of the angle of incidence.
fn impacts(test: usize, tangents: &[f64], shear_damping_ratio: f64) -> Vec<(f64, f64)> {
    let parameters = format!(
        "restitution = {RESTITUTION}, friction_coefficient = {FRICTION}, poisson = 0.33, \
         shear_damping_ratio = {shear_damping_ratio}"
    );
    let mut text = format!(
        "version = 1\n[contacts]\nlaw = \"hertz_mindlin\"\n\
         [integration]\ncontact_safety = 0.002\n[stop]\ntime = 2.5e-3\n\
         [[material]]\nname = \"alloy\"\ndensity = 2700\nhertz_mindlin = {{ young = 70e9, {parameters} }}\n\
         [[material]]\nname = \"target\"\ndensity = 2.7e6\nhertz_mindlin = {{ young = {:e}, {parameters} }}\n",
        if test == 6 { 7e19 } else { 7e13 }
    );
    let mut spheres: Vec<[f64; 4]> =
        (0..tangents.len()).map(|k| [2.0 * k as f64, 0.0, RADIUS + 1e-6, RADIUS]).collect();
    for (k, tangent) in tangents.iter().enumerate() {
        // The patch is at −R z from the center: ω × r = −ω R x for a rotation about y.
        let _ = write!(
            text,
            "[[set]]\nname = \"s{k}\"\nselection = {{ kind = \"ids\", ids = [{k}] }}\n\
             [[initial]]\nset = \"s{k}\"\nvelocity = [0, 0, {:?}]\nangular_velocity = [0, {:?}, 0]\n",
            -SPEED,
            -tangent * SPEED / RADIUS
        );
    }
    if test == 6 {
        text +=
            "[[wall]]\nmaterial = \"target\"\nshape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }\n";
    } else {
        let targets: Vec<usize> = (tangents.len()..2 * tangents.len()).collect();
        spheres.extend((0..tangents.len()).map(|k| [2.0 * k as f64, 0.0, -0.5, 0.5]));
        let _ = write!(
            text,
            "[[set]]\nname = \"targets\"\nselection = {{ kind = \"ids\", ids = {targets:?} }}\nmaterial = \"target\"\n"
        );
    }
    let simulation = run(&format!("{text}[packing]\nkind = \"spheres\"\nspheres = {spheres:?}\n"));
    let particles = &simulation.state.particles;
    tangents
        .iter()
        .enumerate()
        .map(|(k, tangent)| {
            let p = particles.id.iter().position(|id| *id == k as u32).unwrap();
            let (v, w) = (particles.velocity[p], particles.angular_velocity[p]);
            assert!(v.z > 0.0, "sphere {k} did not rebound: {v:?}");
            ((v.x - w.y * RADIUS) / (tangent * SPEED), v.z)
        })
        .collect()
}

/// `Σ|found − reference|/Σ|reference|`.
fn deviation<'a>(pairs: impl Iterator<Item = (f64, &'a [f64; 2])>) -> f64 {
    let (error, size) = pairs.fold((0.0, 0.0), |(e, s), (found, row)| (e + (found - row[1]).abs(), s + row[1].abs()));
    error / size
}

/// With equal shear and normal dashpots the results agree with the curves within 3 %; without shear dashpot β differs
/// by 4.9 % (test 6).
#[test]
fn tangential_restitution_of_a_spinning_sphere_agrees_with_the_benchmark() {
    let damping = damping_of_restitution(RESTITUTION, End::ForceSpent);
    for (at, test) in [6, 8].into_iter().enumerate() {
        let (beta, recoil) = (&BETA[at], &RECOIL[at]);
        let of_beta: Vec<f64> = beta.iter().map(|row| 3.5 * FRICTION * (1.0 + RESTITUTION) / row[0]).collect();
        let of_recoil: Vec<f64> = recoil.iter().map(|row| row[0]).collect();
        let of = |ratio: f64| {
            let found = impacts(test, &of_beta, ratio);
            deviation(found.iter().map(|(patch, _)| -patch).zip(beta))
        };
        let found = impacts(test, &of_recoil, damping);
        let tangents = found.iter().zip(&of_recoil).map(|((patch, v), tangent)| patch * tangent * SPEED / v);
        let (with, without, angle) = (of(damping), of(0.0), deviation(tangents.zip(recoil)));
        println!(
            "test {test}: β within {with:.4} with a shear dashpot, {without:.4} without; recoil within {angle:.4}"
        );
        assert!(with < 0.03 && angle < 0.03, "test {test}: {with} {angle}");
        assert!(without > 0.04, "test {test}: {without}");
    }
}

/// With restitution 0 the sphere stays on the plane. Without tensile forces, a critically damped contact would rebound with
/// `exp(−2)` of the speed; here the speed decays below 1 % within ten durations of an elastic impact (0.73 ms).
#[test]
fn a_sphere_with_zero_restitution_stays_on_the_plane() {
    let simulation = run("version = 1\n[contacts]\nlaw = \"hertz_mindlin\"\n[stop]\ntime = 8e-3\n\
         [packing]\nkind = \"spheres\"\nspheres = [[0, 0, 0.1000001, 0.1]]\n\
         [[material]]\nname = \"alloy\"\ndensity = 2700\nhertz_mindlin = { young = 70e9, poisson = 0.3, restitution = 0 }\n\
         [[set]]\nname = \"all\"\nselection = { kind = \"all\" }\n[[initial]]\nset = \"all\"\nvelocity = [0, 0, -0.2]\n\
         [[wall]]\nmaterial = \"alloy\"\nshape = { kind = \"plane\", point = [0, 0, 0], normal = [0, 0, 1] }\n");
    let speed = simulation.state.particles.velocity[0].z;
    println!("speed afterwards {speed:.3e} m/s");
    assert!(speed.abs() < 0.01 * SPEED, "{speed}");
    assert!(simulation.state.particles.position[0].z < 0.1, "still in contact");
}
