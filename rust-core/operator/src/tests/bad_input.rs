//! Bad input that operators reject, and their messages.

use super::super::couple_stress::conjugate;
use super::super::strain::{Dimension, affine_fit, cell_strain};
use super::super::stress::{ParticleVolume, kinetic_stress, region_stress};
use super::super::tessellation::{Corner, Domain, Mesh, delaunay, power_diagram};
use super::*;

fn grid_in_a_plane() -> Vec<Vec3> {
    (0..9).map(|k| Vec3::new(f64::from(k % 3), f64::from(k / 3), 0.5 * f64::from(k % 3))).collect()
}

#[test]
fn flat_points() {
    let position = grid_in_a_plane();
    let whole = Region::All { volume: 1.0 };
    let fit = affine_fit(&position, &position, &[], &whole, None, Dimension::Three);
    assert!(matches!(fit, Err(OperatorError::Flat { points: 9, dimension: 3, needed: 4, .. })), "{fit:?}");
    let few = affine_fit(&position[..3], &position[..3], &[], &whole, None, Dimension::Three);
    assert!(matches!(few, Err(OperatorError::Flat { points: 3, .. })));
    let line: Vec<Vec3> = (0..5).map(|k| Vec3::new(f64::from(k), 2.0 * f64::from(k), 0.0)).collect();
    let fit = affine_fit(&line, &line, &[], &whole, None, Dimension::Two);
    assert!(matches!(fit, Err(OperatorError::Flat { dimension: 2, needed: 3, .. })));
    assert!(matches!(delaunay(&position, Dimension::Three, None), Err(OperatorError::Flat { .. })));
    assert!(matches!(delaunay(&line, Dimension::Two, None), Err(OperatorError::Flat { .. })));
    let message = delaunay(&position, Dimension::Three, None).unwrap_err().to_string();
    assert!(message.contains("at least 4 that do not lie in one plane"), "{message}");
}

#[test]
fn empty_regions_and_volumes() {
    let c = Cluster::random(1);
    let far = Region::Sphere { center: Vec3::repeat(100.0), radius: 1.0 };
    let fit = affine_fit(&c.position, &c.velocity, &[], &far, None, Dimension::Three);
    assert_eq!(fit, Err(OperatorError::EmptyRegion { what: "particle" }));
    assert_eq!(conjugate(&c.set(), &far, &Vec3::zeros(), None), Err(OperatorError::EmptyRegion { what: "contact" }));
    let mass = vec![1.0; c.position.len()];
    assert!(kinetic_stress(&c.position, &mass, &c.velocity, &far, None).is_err());
    // A region without contacts has zero stress. This is not an error, because a void carries no stress.
    let void = region_stress(&c.set(), &far, Truncation::BranchClipped, None).unwrap();
    assert_eq!((void.stress, void.full, void.partial), (Mat3::zeros(), 0.0, 0.0));
    for (region, words) in [
        (Region::All { volume: 0.0 }, "must be positive and finite"),
        (Region::All { volume: f64::NAN }, "must be positive and finite"),
        (Region::Sphere { center: Vec3::zeros(), radius: -1.0 }, "a sphere has radius = -1"),
        (Region::Box { low: Vec3::repeat(1.0), high: Vec3::new(2.0, 2.0, 0.0) }, "side along z = -1"),
        (
            Region::Cylinder { center: Vec3::zeros(), axis: Vec3::repeat(1.0), radius: 1.0, half_length: 1.0 },
            "it must be 1",
        ),
        (Region::Ellipsoid { center: Vec3::zeros(), axes: Mat3::zeros() }, "determinant of its axes = 0"),
    ] {
        let error = region_stress(&c.set(), &region, Truncation::BranchClipped, None).unwrap_err().to_string();
        assert!(error.contains(words), "{error}");
    }
    let list = Region::Particles { member: vec![true; c.position.len()], volume: 1.0 };
    let refused = region_stress(&c.set(), &list, Truncation::BranchClipped, None);
    assert_eq!(refused, Err(OperatorError::NoSurface));
    let all = region_stress(&c.set(), &list, Truncation::InternalOnly, None).unwrap();
    assert_eq!(all.full, c.pair.len() as f64);
    let none = Region::Particles { member: vec![false; c.position.len()], volume: 1.0 };
    assert!(region_stress(&c.set(), &none, Truncation::InternalOnly, None).is_err());
    assert!(ParticleVolume::Packing(0.0).of(&[1.0]).is_err());
    assert!(ParticleVolume::Sphere.of(&[1.0, -1.0]).is_err());
}

#[test]
fn slices_that_do_not_fit() {
    let c = Cluster::random(2);
    let short = ContactSet::new(&c.position, &c.pair, &c.branch[1..], &c.point, &c.force, None);
    assert!(matches!(short, Err(OperatorError::Length { name: "branch", .. })));
    let beyond = ContactSet::new(&c.position[..2], &c.pair, &c.branch, &c.point, &c.force, None);
    assert!(matches!(beyond, Err(OperatorError::Index { count: 2, .. })), "{beyond:?}");
    assert!(matches!(vectors("force", &[1.0; 7]), Err(OperatorError::Ragged { found: 7, .. })));
    assert_eq!(vectors("force", &[1.0, 2.0, 3.0]).unwrap(), [Vec3::new(1.0, 2.0, 3.0)]);
    assert_eq!(pairs("pair", &[1, 2, 3, 4]).unwrap(), [[1, 2], [3, 4]]);
    assert!(pairs("pair", &[1]).is_err());
}

#[test]
fn open_cells() {
    let corner = |point| Corner { point, image: [0; 3] };
    let position: Vec<Vec3> = vec![Vec3::zeros(), Vec3::x(), Vec3::y(), Vec3::z(), Vec3::repeat(1.0), -Vec3::z()];
    // A periodic mesh must have no hull.
    let cell = [0, 1, 2, 3].map(corner).to_vec();
    let open = Mesh::new(Dimension::Three, 4, true, cell.clone());
    assert!(matches!(open, Err(OperatorError::OpenFaces { .. })), "{open:?}");
    let mesh = Mesh::new(Dimension::Three, 4, false, cell.clone()).unwrap();
    assert_eq!(mesh.hull().count(), 4);
    assert!(cell_strain(&mesh, &position, &position, None).is_err());
    // Three cells share one face.
    let mut doubled = cell.clone();
    doubled.extend([0, 1, 2, 4].map(corner));
    doubled.extend([0, 2, 1, 5].map(corner));
    assert!(matches!(Mesh::new(Dimension::Three, 6, false, doubled), Err(OperatorError::OpenFaces { .. })));
    assert!(matches!(Mesh::new(Dimension::Three, 3, false, cell), Err(OperatorError::Index { .. })));
    // A domain that does not enclose its points, or has no end.
    let (position, radius) = packing(3, 0.3, false, 1);
    let small = Domain::Box { low: Vec3::zeros(), high: Vec3::repeat(0.5) };
    let found = power_diagram(&position, &radius, &small, Dimension::Three);
    assert!(matches!(found, Err(OperatorError::OpenCell { .. })));
    let endless = Domain::HalfSpaces(vec![HalfSpace { point: Vec3::repeat(2.0), normal: Vec3::x() }]);
    let found = power_diagram(&position, &radius, &endless, Dimension::Three);
    assert!(matches!(found, Err(OperatorError::OpenCell { .. })), "{found:?}");
}

#[test]
fn points_at_one_place() {
    let (mut position, radius) = packing(3, 0.3, false, 1);
    position[7] = position[2];
    let found = delaunay(&position, Dimension::Three, None);
    assert!(matches!(found, Err(OperatorError::Coincident { first: 2, second: 7 })), "{found:?}");
    let domain = Domain::Periodic(Mat3::identity());
    assert!(matches!(
        power_diagram(&position, &radius, &domain, Dimension::Three),
        Err(OperatorError::Coincident { .. })
    ));
    position[7].x = f64::NAN;
    assert!(matches!(delaunay(&position, Dimension::Two, None), Err(OperatorError::NotFinite { entry: 7, .. })));
    let flat = delaunay(&position[..7], Dimension::Three, Some(&Mat3::zeros()));
    assert!(matches!(flat, Err(OperatorError::Volume { .. })));
}
