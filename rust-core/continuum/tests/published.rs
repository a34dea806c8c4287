//! The sequential study of Stránský 2018 (sections 6.2 and 6.3): his curve of the damage-plastic model, Table 6.1, his hand-overs.

mod shared;

use concordem_continuum::{HandOver, LinkDamage};
use nalgebra::{Matrix3, Rotation3, Vector3};
use shared::{Point, Random, thesis};

/// Element size of the study, m.
const SIZE: f64 = 2.0;

/// His element: one tetrahedron, driven to −7e-3 in 198 steps. Values are read to 0.1 MPa.
#[test]
fn simple_compression_follows_the_published_curve() {
    let law = thesis();
    let mut point = Point::new(&law, SIZE);
    let curve: Vec<(f64, f64)> = (1..=198)
        .map(|k| {
            let strain = -7e-3 * f64::from(k) / 198.0;
            (strain, point.simple(strain).stress[(0, 0)])
        })
        .collect();
    let at = |strain: f64| {
        let k = curve.iter().position(|entry| entry.0 <= strain).unwrap();
        let ((a, f), (b, g)) = (curve[k - 1], curve[k]);
        f + (g - f) * (strain - a) / (b - a)
    };
    // Up to the peak within the digits given; after it, the curve falls by 0.03 MPa per 1e-6, and a peak one step of 3.5e-5 later
    // shifts it by 1 MPa.
    for (strain, stress, tolerance) in [
        (-0.5e-3, -16.2e6, 0.15e6),
        (-1.0e-3, -30.0e6, 0.15e6),
        (-1.5e-3, -37.6e6, 0.15e6),
        (-2.0e-3, -39.9e6, 0.15e6),
        (-2.5e-3, -25.2e6, 1.0e6),
        (-3.0e-3, -11.2e6, 1.0e6),
    ] {
        assert!((at(strain) - stress).abs() < tolerance, "{strain:e}: {:e} for {stress:e}", at(strain));
    }
    let peak = curve.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)).unwrap();
    assert!((peak.1 + 40.0e6).abs() < 0.05e6 && (peak.0 + 2.275e-3).abs() < 3.6e-5, "{peak:?}");
}

/// Table 6.1: three links along the axes. The least-squares tensor returns each damage.
#[test]
fn damage_tensors_of_table_6_1() {
    let normals = [Vector3::x(), Vector3::y(), Vector3::z()];
    for (damages, wanted) in [
        ([0.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
        ([1.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
        ([0.5, 0.5, 0.5], [0.5, 0.5, 0.5]),
        ([1.0, 1.0, 0.0], [1.5, 1.5, -1.0]),
        ([0.5, 0.5, 0.0], [0.75, 0.75, -0.5]),
        ([1.0, 0.0, 0.0], [2.0, -0.5, -0.5]),
        ([0.5, 0.0, 0.0], [1.0, -0.25, -0.25]),
    ] {
        let links = LinkDamage::of(&normals, &damages).unwrap();
        let tensor = HandOver::Printed.tensor(&links);
        let difference = tensor - Matrix3::from_diagonal(&wanted.into());
        // Three products and three sums of numbers up to 2.5.
        assert!(difference.norm() < 1e-14, "{damages:?}: {tensor}");
        let mean: f64 = damages.iter().sum::<f64>() / 3.0;
        assert!((tensor.trace() - 3.0 * mean).abs() < 1e-14);
    }
}

/// Links with `ω̂ = n·Ω·n` in 10,000 random directions return Ω; the scatter of a mean of 10,000 is 1e-2 of its terms.
#[test]
fn damage_tensor_of_many_links_is_the_one_that_they_follow() {
    let turn = Rotation3::from_euler_angles(0.3, -0.7, 1.1).into_inner();
    let tensor = turn * Matrix3::from_diagonal(&[0.7, 0.4, 0.1].into()) * turn.transpose();
    let mut random = Random(11);
    let (mut normals, mut damages) = (Vec::new(), Vec::new());
    while normals.len() < 10_000 {
        let v = Vector3::new(random.next(), random.next(), random.next());
        if v.norm() < 1.0 && v.norm() > 0.1 {
            let n = v.normalize();
            damages.push(n.dot(&(tensor * n)));
            normals.push(n);
        }
    }
    let links = LinkDamage::of(&normals, &damages).unwrap();
    let found = HandOver::Printed.tensor(&links);
    assert!((found - tensor).norm() < 0.06, "{found}");
    // The coded tensor of the same links: Ω = 1.25 Ω' + 0.25 tr Ω'.
    let coded = HandOver::Coded.tensor(&links);
    let converted = coded * 1.25 + Matrix3::identity() * (0.25 * coded.trace());
    assert!((converted - found).norm() < 1e-13);
}

/// A hand-over of section 6.3: number, CPM stress, principal values of the coded tensor, damage, hardening, DPM stress at the start and at its
/// peak.
type Row = (u32, f64, [f64; 2], f64, Option<f64>, f64, f64);
const ROWS: [Row; 10] = [
    (0, -14.27e6, [0.0023, -0.0018], 0.0, Some(0.30), -14.21e6, -40.0e6),
    (1, -25.87e6, [0.0360, -0.0317], 0.0, Some(0.301), -25.75e6, -40.0e6),
    (2, -34.42e6, [0.1084, -0.0878], 0.0, Some(0.489), -34.30e6, -40.0e6),
    (3, -39.33e6, [0.2200, -0.1581], 0.006_39, None, -39.18e6, -39.18e6),
    (5, -22.55e6, [0.5090, -0.2249], 0.4253, None, -22.32e6, -22.32e6),
    (6, -12.22e6, [0.5561, -0.1897], 0.7056, None, -10.66e6, -10.66e6),
    (7, -10.88e6, [0.1097, -0.0886], 0.0, Some(0.501), -10.85e6, -40.0e6),
    (9, -6.16e6, [0.4720, -0.1938], 0.3069, None, -6.16e6, -27.6e6),
    (10, -3.35e6, [0.5388, -0.1381], 0.6546, None, -3.31e6, -13.5e6),
    (11, -2.11e6, [0.5559, -0.1173], 0.7888, None, -2.08e6, -8.2e6),
];

#[test]
fn hand_overs_give_the_published_damage_hardening_start_stress_and_peak() {
    let law = thesis();
    for (row, stress, [first, third], wanted, hardening, start, peak) in ROWS {
        let tensor = Matrix3::from_diagonal(&[first, 0.5 * (first + third), third].into());
        let damage = HandOver::Coded.damage(&tensor);
        // The tensor has four digits after the point; the power 4.7 of the smallest argument multiplies its relative error.
        let tolerance = 1e-4 + 4.7 * 1e-4 / (0.85 * first + 0.15 * third).abs().max(0.05) * wanted;
        let shown = if hardening.is_some() { 0.0 } else { damage };
        assert!((shown - wanted).abs() < tolerance, "row {row}: {damage} for {wanted}");
        let uniaxial = Matrix3::from_diagonal(&[stress, 0.0, 0.0].into());
        let state = HandOver::state(&law, &uniaxial, damage, SIZE).unwrap();
        if let Some(hardening) = hardening {
            // 900 times the error of a damage that is 2e-4 at most.
            assert!((state.hardening - hardening).abs() < 0.006, "row {row}: {}", state.hardening);
            assert_eq!(state.damage, 0.0);
        } else {
            assert_eq!(state.hardening, 1.0 + state.damage);
            assert!((law.damage(state.damage, SIZE).unwrap() - damage).abs() < 1e-13, "row {row}");
        }
        let mut point = Point::new(&law, SIZE);
        point.state = state;
        let found = point.simple(0.0).stress[(0, 0)];
        if row == 6 {
            // The effective stress −12.22/(1−0.7056) = −41.5 MPa lies outside the surface and returns at once, which adds damage: ours
            // starts with −11.04 MPa, his with −10.66. The damage has four digits, and his lateral stresses are not published.
            assert!((found - start).abs() < 0.05 * start.abs(), "row {row}: {found:e}");
            assert!(found > 0.92 * stress, "row {row}: {found:e}");
        } else {
            // Our point starts with the stress of the packing itself; his element with a stress up to 1.5 % less.
            assert!((found - stress).abs() < 1e-12 * stress.abs(), "row {row}: {found:e}");
            assert!((found - start).abs() < 0.015 * start.abs(), "row {row}: {found:e}");
        }
        // His steps, from the hand-over on.
        let highest =
            (1..=100).map(|k| point.simple(-7e-3 * f64::from(k) / 198.0).stress[(0, 0)]).fold(found, f64::min);
        // Where the surface is reached again, its peak is that of the virgin material. Elsewhere the error of the start stress remains, and
        // the peaks have two or three digits: 2.1 % at most. In row 6 the start differs, as above.
        let tolerance = if peak == -40.0e6 {
            1e-4
        } else if row == 6 {
            0.05
        } else {
            0.025
        };
        assert!((highest - peak).abs() < tolerance * peak.abs(), "row {row}: {highest:e} for {peak:e}");
    }
}

/// The printed pair gives damages like those of the coded pair: 0.64 and 0.71 for row 6.
#[test]
fn both_pairs_of_formulas_give_similar_damage() {
    let coded = Matrix3::from_diagonal(&[0.5561, 0.5561, -0.1897].into());
    let printed = coded * 1.25 + Matrix3::identity() * (0.25 * coded.trace());
    let (a, b) = (HandOver::Coded.damage(&coded), HandOver::Printed.damage(&printed));
    assert!((a - 0.7056).abs() < 1e-3 && (0.5..0.8).contains(&b), "{a} {b}");
    assert_eq!(HandOver::Printed.damage(&Matrix3::from_diagonal(&[-0.1, -0.2, -0.3].into())), 0.0);
    assert_eq!(HandOver::Coded.damage(&Matrix3::from_diagonal(&[1.0, 1.0, 1.0].into())), 1.0);
}

#[test]
fn hand_over_of_full_damage_or_of_no_links_is_refused() {
    let law = thesis();
    let stress = Matrix3::identity();
    assert!(HandOver::state(&law, &stress, 1.0, SIZE).unwrap_err().to_string().contains("less than 1"));
    assert!(HandOver::state(&law, &stress.map(|_| f64::NAN), 0.1, SIZE).is_err());
    assert!(LinkDamage::of(&[], &[]).is_err());
    assert!(LinkDamage::of(&[Vector3::x()], &[]).is_err());
    assert!(LinkDamage::of(&[Vector3::x()], &[f64::NAN]).is_err());
}
