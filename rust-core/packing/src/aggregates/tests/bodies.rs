//! Shapes, and whether two of them are apart.

use crate::Random;
use crate::aggregates::{Form, Inclusion, MeshForm, Polyhedron, apart};
use crate::shape::Mesh;
use concordem_contact::math::{Mat3, Vec3};
use std::sync::Arc;

fn rotation(random: &mut Random) -> Mat3 {
    let axis = random.uniform_vector() * 2.0 - Vec3::repeat(1.0);
    rotation_about(&axis.normalize(), 6.3 * random.uniform())
}

/// Rodrigues' formula.
fn rotation_about(axis: &Vec3, angle: f64) -> Mat3 {
    let cross = Mat3::new(0.0, -axis.z, axis.y, axis.z, 0.0, -axis.x, -axis.y, axis.x, 0.0);
    Mat3::identity() + cross * angle.sin() + cross * cross * (1.0 - angle.cos())
}

fn inclusion(form: Form, size: f64, center: Vec3, rotation: Mat3) -> Inclusion {
    Inclusion { form, size, center, rotation, group: 0 }
}

/// The contact function of Perram and Wertheim (1985, J. Comput. Phys. 58, 409, equation 2.3) of two ellipsoids: above 1 if they
/// are apart, below 1 if they overlap.
pub(super) fn perram_wertheim(a: &Inclusion, b: &Inclusion, shift: &Vec3) -> f64 {
    let matrix = |one: &Inclusion| {
        let axes = match one.form {
            Form::Sphere => Vec3::repeat(0.5),
            Form::Ellipsoid { elongation, flatness } => Vec3::new(0.5 * elongation, 0.5, 0.5 * flatness),
            _ => panic!("not an ellipsoid"),
        } * one.size;
        one.rotation * Mat3::from_diagonal(&axes.component_mul(&axes)) * one.rotation.transpose()
    };
    let (first, second, offset) = (matrix(a), matrix(b), b.center + shift - a.center);
    let value = |t: f64| {
        let inverse = (first * (1.0 - t) + second * t).try_inverse().unwrap();
        t * (1.0 - t) * offset.dot(&(inverse * offset))
    };
    // The function is concave in t: golden section would do; thirds are simpler.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let (p, q) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
        if value(p) < value(q) { low = p } else { high = q }
    }
    value(0.5 * (low + high))
}

/// Whether two convex polyhedra are apart by the separating axis theorem: normals of faces, and cross products of edges.
fn separated(a: (&Polyhedron, &Inclusion), b: (&Polyhedron, &Inclusion), gap: f64) -> bool {
    let corners = |(body, place): (&Polyhedron, &Inclusion)| -> Vec<Vec3> {
        body.vertices().iter().map(|v| place.center + place.rotation * v * place.size).collect()
    };
    let edges = |(body, place): (&Polyhedron, &Inclusion)| -> Vec<Vec3> {
        let of = |t: &[u32; 3]| [(t[0], t[1]), (t[1], t[2]), (t[2], t[0])];
        let vertices = body.vertices();
        let all = body.triangles().iter().flat_map(of);
        all.map(|(u, v)| place.rotation * (vertices[v as usize] - vertices[u as usize])).collect()
    };
    let (points, others) = (corners(a), corners(b));
    let (ones, twos) = (edges(a), edges(b));
    let normals = |edges: &[Vec3]| edges.chunks(3).map(|e| e[0].cross(&e[1])).collect::<Vec<_>>();
    let mut axes = [normals(&ones), normals(&twos)].concat();
    axes.extend(ones.iter().flat_map(|u| twos.iter().map(move |v| u.cross(v))));
    axes.iter().filter(|axis| axis.norm() > 1e-9).any(|axis| {
        let axis = axis.normalize();
        let span = |points: &[Vec3]| {
            let along = points.iter().map(|x| x.dot(&axis));
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
        };
        let ((low, high), (from, to)) = (span(&points), span(&others));
        (from - high).max(low - to) > gap
    })
}

#[test]
fn ellipsoids_agree_with_perram_and_wertheim() {
    let mut random = Random::new(4);
    let mut counts = [0, 0];
    for _ in 0..20_000 {
        let mut body = |center: Vec3| {
            let form =
                Form::Ellipsoid { elongation: 1.0 + 2.0 * random.uniform(), flatness: 0.2 + 0.8 * random.uniform() };
            inclusion(form, 0.5 + random.uniform(), center, rotation(&mut random))
        };
        let (a, mut b) = (body(Vec3::zeros()), body(Vec3::zeros()));
        b.center = (random.uniform_vector() * 2.0 - Vec3::repeat(1.0)) * 2.0;
        let expected = perram_wertheim(&a, &b, &Vec3::zeros());
        let found = apart(&a, &b, &Vec3::zeros(), 0.0);
        // Both are iterative: skip the pairs that touch up to 1e-6.
        if (expected - 1.0).abs() > 1e-6 {
            assert_eq!(found, expected > 1.0, "{expected} {a:?} {b:?}");
            counts[usize::from(found)] += 1;
        }
        assert_eq!(found, apart(&b, &a, &Vec3::zeros(), 0.0));
    }
    assert!(counts.iter().all(|count| *count > 2000), "{counts:?}");
}

#[test]
fn polyhedra_agree_with_the_separating_axis_theorem() {
    let mut random = Random::new(5);
    let mut counts = [0, 0];
    for k in 0..2000 {
        let mut body = || Arc::new(Polyhedron::random(8, 1.5, 0.7, &mut random).unwrap());
        let (one, two) = (body(), body());
        let a = inclusion(Form::Polyhedron(one.clone()), 1.0, Vec3::zeros(), rotation(&mut random));
        let center = (random.uniform_vector() * 2.0 - Vec3::repeat(1.0)) * 1.2;
        let b = inclusion(Form::Polyhedron(two.clone()), 0.8, center, rotation(&mut random));
        let gap = if k % 2 == 0 { 0.0 } else { 0.1 };
        // A gap along an axis of the theorem is a gap; without a gap both are exact.
        let (found, expected) = (apart(&a, &b, &Vec3::zeros(), gap), separated((&one, &a), (&two, &b), gap));
        if gap == 0.0 {
            assert_eq!(found, expected);
        } else {
            assert!(found || !expected, "{a:?} {b:?}");
        }
        counts[usize::from(found)] += 1;
    }
    assert!(counts.iter().all(|count| *count > 300), "{counts:?}");
}

/// Spheres written as ellipsoids have a distance that is known, so the gap is exact.
#[test]
fn gaps_are_distances() {
    let mut random = Random::new(6);
    let round = Form::Ellipsoid { elongation: 1.0, flatness: 1.0 };
    for _ in 0..2000 {
        let a = inclusion(round.clone(), 1.0, random.uniform_vector(), rotation(&mut random));
        let center = random.uniform_vector() * 3.0;
        let b = inclusion(round.clone(), 0.6, center, rotation(&mut random));
        let distance = (a.center - b.center).norm() - 0.8;
        if distance > 1e-3 {
            assert!(apart(&a, &b, &Vec3::zeros(), distance * (1.0 - 1e-6)));
            assert!(!apart(&a, &b, &Vec3::zeros(), distance * (1.0 + 1e-6)));
        }
    }
}

/// A point is inside an ellipsoid by the least distance of points of its surface.
#[test]
fn depth_below_an_ellipsoid() {
    let mut random = Random::new(7);
    let form = Form::Ellipsoid { elongation: 1.8, flatness: 0.6 };
    let turn = rotation(&mut random);
    let body = inclusion(form, 2.0, Vec3::new(0.3, 0.2, 0.1), turn);
    let axes = Vec3::new(1.8, 1.0, 0.6);
    let mut surface = Vec::new();
    for i in 0..200 {
        for j in 0..100 {
            let (u, v) = (0.0314159265 * f64::from(i), 0.0314159265 * f64::from(j));
            let point = Vec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos());
            surface.push(body.center + turn * point.component_mul(&axes));
        }
    }
    let mut inside = 0;
    for k in 0..300 {
        let point = match k {
            // On the planes of symmetry, and the center.
            0 => body.center,
            k if k < 40 => body.center + turn.column(k % 3) * (1.8 * random.uniform() - 0.9),
            _ => body.center + (random.uniform_vector() * 2.0 - Vec3::repeat(1.0)) * 1.8,
        };
        let depth = surface.iter().map(|x| (x - point).norm()).fold(f64::INFINITY, f64::min);
        if body.contains(&point, 0.0) {
            inside += 1;
            // Points of the surface are 0.06 apart: the nearest one is at most 0.04 from the foot of the perpendicular.
            assert!(body.contains(&point, depth * 0.999 - 0.01), "{point:?} {depth}");
            assert!(!body.contains(&point, depth + 1e-9), "{point:?} {depth}");
        } else {
            assert!(!body.contains(&point, 0.01));
        }
    }
    assert!(inside > 50, "{inside}");
}

/// The volume of random polyhedra by counting points, and their size.
#[test]
fn polyhedra_have_their_volume_and_size() {
    let mut random = Random::new(8);
    for _ in 0..20 {
        let body = Polyhedron::random(14, 1.4, 0.7, &mut random).unwrap();
        let mut hits = 0;
        for _ in 0..40_000 {
            let point = (random.uniform_vector() - Vec3::repeat(0.5)) * 3.0;
            hits += u32::from(body.contains(&point, 0.0));
        }
        let counted = 27.0 * f64::from(hits) / 40_000.0;
        // The standard deviation of the count is 1/√hits; five of them.
        assert!((counted / body.volume() - 1.0).abs() < 5.0 / f64::from(hits).sqrt(), "{counted} {}", body.volume());
        let vertices = body.vertices();
        let mut widths: Vec<f64> = (0..3)
            .map(|i| {
                let along = vertices.iter().map(|v| v[i]);
                along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
            })
            .collect();
        widths.sort_by(f64::total_cmp);
        assert!((widths[1] - 1.0).abs() < 1e-12);
        // The centroid is the origin: moments of the tetrahedra over it vanish, up to rounding.
        let moment: Vec3 = body
            .triangles()
            .iter()
            .map(|t| {
                let [a, b, c] = t.map(|k| vertices[k as usize]);
                (a + b + c) * (a.cross(&b).dot(&c) / 24.0)
            })
            .sum();
        assert!(moment.norm() < 1e-14, "{moment}");
    }
    assert!(Polyhedron::hull(&[Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::new(1.0, 1.0, 0.0)]).is_err());
    assert!(Polyhedron::random(3, 1.0, 1.0, &mut random).is_err());
}

/// A cube as a mesh: unit size, volume, and inside.
#[test]
fn meshes_are_scaled_to_unit_size() {
    let vertices =
        (0..8).map(|k| Vec3::new(f64::from(k & 1) * 3.0, f64::from(k >> 1 & 1) * 2.0, f64::from(k >> 2 & 1)));
    let triangles = vec![
        [0, 2, 1],
        [1, 2, 3],
        [4, 5, 6],
        [5, 7, 6],
        [0, 1, 4],
        [1, 5, 4],
        [2, 6, 3],
        [3, 6, 7],
        [0, 4, 2],
        [2, 4, 6],
        [1, 3, 5],
        [3, 7, 5],
    ];
    let mut turned = triangles.clone();
    turned[4] = [0, 4, 1];
    let mesh = Mesh::new(vertices.clone().collect(), triangles).unwrap();
    assert!((mesh.volume().unwrap() - 6.0).abs() < 1e-14);
    let form = Form::Mesh(Arc::new(MeshForm::new(&mesh).unwrap()));
    // Edges 1.5, 1, 0.5 of the middle one.
    assert!((form.measure(false) - 0.75).abs() < 1e-14);
    let body = inclusion(form, 2e-3, Vec3::repeat(1.0), Mat3::identity());
    assert!(body.contains(&(body.center + Vec3::new(1.4e-3, 0.9e-3, 0.4e-3)), 0.9e-4));
    assert!(!body.contains(&(body.center + Vec3::new(1.4e-3, 0.9e-3, 0.4e-3)), 1.1e-4));
    assert!((body.reach() - Vec3::new(1.5e-3, 1e-3, 0.5e-3).norm()).abs() < 1e-15);
    assert!(MeshForm::new(&Mesh::new(vertices.collect(), turned).unwrap()).is_err());
}
