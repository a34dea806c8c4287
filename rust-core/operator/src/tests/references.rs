//! Printed tables (Stránský 2018, Tables 4.1, 6.1, A.1), discs of Madan 2019, particle strains, and moduli.

use super::super::affine_stiffness::{affine_forces, voigt_plane};
use super::super::couple_stress::external;
use super::super::damage::{damage_tensor, damage_tensor_exact, strength_damage, strength_damage_exponential};
use super::super::strain::{ElasticConstants, ElasticState, cosserat};
use super::super::stress::{Partition, boundary_stress, particle_stress, symmetric};
use super::*;

/// A load of Table 4.1: position, force, couple.
type Load = ([f64; 3], [f64; 3], [f64; 3]);

/// Stress and couple stress of loads on a body of unit volume with its centroid at the origin.
fn of_loads(loads: &[Load]) -> (Mat3, Mat3) {
    let place: Vec<Vec3> = loads.iter().map(|l| Vec3::from(l.0)).collect();
    let force: Vec<Vec3> = loads.iter().map(|l| Vec3::from(l.1)).collect();
    let couple: Vec<Vec3> = loads.iter().map(|l| Vec3::from(l.2)).collect();
    let particle: Vec<u32> = (0..loads.len() as u32).collect();
    let set = LoadSet::new(loads.len(), &particle, &place, &force, Some(&couple)).unwrap();
    (boundary_stress(&set, 1.0).unwrap(), external(&place, &set, 1.0, &Vec3::zeros()).unwrap())
}

/// All eight rows. The figures are lost, so the loads are reconstructed from the numbers: unit loads, V = 1. Exact in
/// doubles.
#[test]
fn table_4_1() {
    const O: [f64; 3] = [0.0; 3];
    let entry = |i: usize, j: usize, value: f64| {
        let mut m = Mat3::zeros();
        m[(i, j)] = value;
        m
    };
    let x = |x: f64| [x, 0.0, 0.0];
    let y = |y: f64| [0.0, y, 0.0];
    let z = |z: f64| [0.0, 0.0, z];
    let none = Mat3::zeros();
    let rows: [(&[Load], Mat3, Mat3); 8] = [
        (&[], none, none),
        (&[(x(1.0), x(1.0), O), (x(-1.0), x(-1.0), O)], entry(0, 0, 2.0), none),
        (&[(x(0.5), x(1.0), O), (x(-0.5), x(-1.0), O)], entry(0, 0, 1.0), none),
        (
            &[(x(1.0), y(1.0), O), (x(-1.0), y(-1.0), O), (y(1.0), x(1.0), O), (y(-1.0), x(-1.0), O)],
            entry(0, 1, 2.0) + entry(1, 0, 2.0),
            none,
        ),
        (&[(x(1.0), O, z(1.0)), (x(-1.0), O, z(-1.0))], none, entry(0, 2, 2.0)),
        (&[(x(0.5), O, z(1.0)), (x(-0.5), O, z(-1.0))], none, entry(0, 2, 1.0)),
        (&[(x(1.0), y(1.0), z(-1.0)), (x(-1.0), y(-1.0), z(-1.0))], entry(0, 1, 2.0), none),
        (&[(y(0.5), x(1.0), z(0.5)), (y(-0.5), x(-1.0), z(0.5))], entry(1, 0, 1.0), none),
    ];
    for (k, (loads, stress, couple)) in rows.into_iter().enumerate() {
        let found = of_loads(loads);
        assert_eq!(found, (stress, couple), "row {}", k + 1);
        // 1×Vσ = −Σc holds for each row, so the loads are balanced.
        let couples: Vec3 = loads.iter().map(|l| Vec3::from(l.2)).sum();
        assert_eq!(stress::axial(&found.0), -couples, "row {}", k + 1);
    }
}

/// Table A.1: Cosserat strain of simple modes. Exact in doubles.
#[test]
fn table_a_1() {
    let nu = 0.25;
    let plane = |a: f64, b: f64, c: f64, d: f64| Mat3::new(a, b, 0.0, c, d, 0.0, 0.0, 0.0, 0.0);
    let z = |z: f64| Vec3::new(0.0, 0.0, z);
    // U = ∂_i u_j, micro-rotation φ_m → γ; φ = φ_M + φ_m.
    let gamma = |u: Mat3, micro: f64| {
        let gradient = u.transpose();
        let rotation = cosserat::macro_rotation(&gradient) + z(micro);
        (cosserat::strain(&gradient, &rotation), cosserat::macro_rotation(&gradient).z)
    };
    let shear = plane(0.0, 0.0, 2.0 * nu, 0.0);
    assert_eq!(gamma(shear, 0.0).0, plane(0.0, nu, nu, 0.0), "simple shear");
    assert_eq!(gamma(shear, nu).0, plane(0.0, 0.0, 2.0 * nu, 0.0), "simple shear, particles do not turn");
    assert_eq!(gamma(plane(0.0, -nu, nu, 0.0), 0.0), (Mat3::zeros(), -nu), "rotation of all");
    assert_eq!(gamma(Mat3::zeros(), nu).0, plane(0.0, -nu, nu, 0.0), "rotation of particles");
}

/// Table 6.1: damage tensors of three links along the axes. Their damages are lost with the figures; these reproduce
/// all rows. Exact in doubles except for the order of additions.
#[test]
fn table_6_1() {
    let axes = [Vec3::x(), Vec3::y(), Vec3::z()];
    for (damage, expected) in [
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
        ([1.0, 1.0, 0.0], [1.5, 1.5, -1.0]),
        ([0.5, 0.5, 0.0], [0.75, 0.75, -0.5]),
        ([1.0, 0.0, 0.0], [2.0, -0.5, -0.5]),
        ([0.5, 0.0, 0.0], [1.0, -0.25, -0.25]),
    ] {
        let tensor = damage_tensor(&axes, &damage).unwrap();
        close(&tensor, &Mat3::from_diagonal(&Vec3::from(expected)), 3.0);
    }
    // Three axes do not determine the shear components.
    assert!(matches!(damage_tensor_exact(&axes, &[1.0, 1.0, 1.0]), Err(OperatorError::Singular { .. })));
}

/// 10 000 random directions with damages from a known tensor: the exact solve is correct to 1e-12 (its matrix has
/// condition 5/2), least squares within the sampling error: the fourth moments of N directions scatter by about 0.3/√N,
/// times 15/2.
#[test]
fn directions() {
    let mut r = Random::new(2);
    let planted = symmetric(&r.matrix()) * 0.3 + Mat3::identity() * 0.4;
    let normal: Vec<Vec3> = (0..10_000).map(|_| r.direction()).collect();
    let damage: Vec<f64> = normal.iter().map(|n| n.dot(&(planted * n))).collect();
    let exact = (damage_tensor_exact(&normal, &damage).unwrap() - planted).abs().max();
    let fitted = (damage_tensor(&normal, &damage).unwrap() - planted).abs().max();
    println!("10 000 directions: least squares within {fitted:.2e}, 6×6 solve within {exact:.1e}");
    assert!(exact < 1e-12, "{exact:e}");
    assert!(fitted < 7.5 * 0.3 * 3.0 / 100.0 && fitted > 1e-6, "{fitted:e}");
    // The trace is three times the mean damage, exactly.
    let trace = damage_tensor(&normal, &damage).unwrap().trace();
    assert!((trace - 3.0 * damage.iter().sum::<f64>() / 1e4).abs() < 1e-10);
}

/// (6.5)–(6.6): the two forms agree for exponential softening `(1−ω)κ = ε₀ exp(−(κ−ε₀)/ε_f)`, and clamp below the onset.
#[test]
fn strength_damage_is_clamped() {
    let (onset, softening) = (1e-4, 1.5e-4);
    for kappa in [0.0, 0.5e-4, 1e-4, 1.1e-4, 2e-4, 3e-4, 1e-2] {
        let intact = if kappa <= onset { 0.0 } else { 1.0 - onset / kappa * libm::exp(-(kappa - onset) / softening) };
        let direct = strength_damage(intact, kappa, onset).unwrap();
        let closed = strength_damage_exponential(kappa, onset, softening).unwrap();
        assert!((direct - closed).abs() < 1e-14, "{kappa}: {direct} {closed}");
        assert_eq!(direct == 0.0, kappa <= onset);
    }
    assert!(strength_damage(0.0, 1.0, 0.0).is_err());
}

/// Discs of Madan 2019: simple cubic −2f/(πRl), hexagonal −(1/πRl) diag(2f₁+f₂, 3f₂), row 2f/(πRl) (p. of (2.41)).
#[test]
fn discs_of_madan() {
    use std::f64::consts::PI;
    let radius = 0.4;
    let volume = [PI * radius * radius];
    let position = [Vec3::zeros()];
    let contacts = ContactSet::new(&position, &[], &[], &[], &[], None).unwrap();
    let stress = |list: &[(f64, f64)]| {
        let direction = |angle: f64| Vec3::new(libm::cos(angle), libm::sin(angle), 0.0);
        let point: Vec<Vec3> = list.iter().map(|(angle, _)| direction(*angle) * radius).collect();
        let force: Vec<Vec3> = list.iter().map(|(angle, f)| -direction(*angle) * *f).collect();
        let particle = vec![0; list.len()];
        let loads = LoadSet::new(1, &particle, &point, &force, None).unwrap();
        particle_stress(&contacts, &loads, Partition::ContactPoint, &volume).unwrap()[0]
    };
    let quarter = 0.5 * PI;
    let f = 1.7;
    let square = stress(&[(0.0, f), (quarter, f), (2.0 * quarter, f), (3.0 * quarter, f)]);
    close(&square, &Mat3::from_diagonal(&Vec3::new(-2.0 * f / (PI * radius), -2.0 * f / (PI * radius), 0.0)), 10.0);
    let (f1, f2) = (1.1, 0.6);
    let third = PI / 3.0;
    let hexagon: Vec<(f64, f64)> = (0..6).map(|k| (third * f64::from(k), if k % 3 == 0 { f1 } else { f2 })).collect();
    let expected = Vec3::new(-(2.0 * f1 + f2), -3.0 * f2, 0.0) / (PI * radius);
    close(&stress(&hexagon), &Mat3::from_diagonal(&expected), 10.0);
    let row = stress(&[(0.0, -f), (2.0 * quarter, -f)]);
    assert!((row[(0, 0)] - 2.0 * f / (PI * radius)).abs() < 1e-14);
}

/// A particle's elastic strain inverts Hooke's law in each state.
#[test]
fn particle_strain() {
    let (e, nu) = (3.0, 0.3);
    let stress = Mat3::new(1.0, 0.4, 0.0, 0.2, -2.0, 0.0, 0.0, 0.0, 0.0);
    let plane_stress = ElasticConstants::new(e, nu, ElasticState::PlaneStress).unwrap().strain(&stress);
    let solid = ElasticConstants::new(e, nu, ElasticState::Solid).unwrap();
    // Plane stress is the solid without its third direction; plane strain is the solid with the stress that prevents
    // the strain across the plane.
    let mut expected = solid.strain(&stress);
    expected[(2, 2)] = 0.0;
    close(&plane_stress, &expected, 1.0);
    let mut held = stress;
    held[(2, 2)] = nu * (stress[(0, 0)] + stress[(1, 1)]);
    let plane_strain = ElasticConstants::new(e, nu, ElasticState::PlaneStrain).unwrap().strain(&stress);
    close(&plane_strain, &solid.strain(&held), 1.0);
    assert!((plane_stress[(0, 1)] - 0.3 * (1.0 + nu) / e).abs() < 1e-15);
    assert!(ElasticConstants::new(e, 0.6, ElasticState::Solid).is_err());
}

/// End loads of a beam transported to its middle: balanced ends give opposite moments there, and region sums do not
/// depend on the point.
#[test]
fn beam_end_loads() {
    let mut r = Random::new(8);
    let (xa, xb) = (r.vector(), r.vector());
    let (force, moment_a) = (r.vector(), r.vector());
    // Equilibrium of the beam gives the moment at its other end.
    let moment_b = -moment_a - (xb - xa).cross(&(-force));
    let mut all = Vec::new();
    for share in [0.5, 0.1] {
        let point = xa + (xb - xa) * share;
        let m_a = moment_about_contact_point(&(point - xa), &force, &moment_a);
        let m_b = moment_about_contact_point(&(point - xb), &-force, &moment_b);
        // Beam and contact exert their moments on the particles.
        close_vector(&(m_a + m_b), &Vec3::zeros(), 10.0);
        let set = (vec![xa, xb], vec![[0_u32, 1]], vec![xb - xa], vec![point], vec![force], vec![m_a]);
        let contacts = ContactSet::new(&set.0, &set.1, &set.2, &set.3, &set.4, Some(&set.5)).unwrap();
        all.push(couple_stress::internal(&contacts, 1.0, &Vec3::zeros()).unwrap());
    }
    close(&all[0], &all[1], 10.0);
}

/// Voigt's moduli of the plane are what contacts in even directions answer to expansion and to shear, `σ = 2Kε` and `σ = 2Gε`: (4.15) to
/// (4.18). The sums over the directions are exact but for rounding.
#[test]
fn voigt_moduli_are_those_of_even_directions() {
    let (count, radius, area, normal, tangential) = (12, 0.4, 3.0, 2.0, 0.7);
    let branch: Vec<Vec3> = (0..count)
        .map(|k| {
            let (sin, cos) = (std::f64::consts::PI * f64::from(k) / f64::from(count)).sin_cos();
            Vec3::new(cos, sin, 0.0) * (2.0 * radius)
        })
        .collect();
    let stress = |strain: Mat3| {
        let force = affine_forces(&branch, &vec![(normal, tangential); branch.len()], &strain).unwrap();
        branch.iter().zip(&force).map(|(l, f)| l * f.transpose()).sum::<Mat3>() / area
    };
    let (bulk, shear) = voigt_plane(f64::from(count), radius, area, normal, tangential).unwrap();
    let expansion = Mat3::from_diagonal(&Vec3::new(1.0, 1.0, 0.0));
    close(&stress(expansion), &(expansion * (2.0 * bulk)), 10.0);
    let shearing = Mat3::new(0.0, 1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 0.0);
    close(&stress(shearing), &(shearing * (2.0 * shear)), 10.0);
}
