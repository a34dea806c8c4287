//! Random places.

use super::bodies::perram_wertheim;
use crate::aggregates::{Field, Form, Grading, Inclusion, Placement, Polyhedron, Region, Request, apart, place, sizes};
use crate::{PackingError, Random, Shape};
use concordem_contact::math::{Mat3, Vec3};
use concordem_solver::state::Cell;
use std::sync::Arc;

const EDGE: f64 = 0.05;

fn cube(planar: bool) -> Region {
    Region::mould(Shape::new_box(Vec3::zeros(), Vec3::repeat(EDGE)).unwrap(), planar).unwrap()
}

fn cell(planar: bool) -> Region {
    let depth = if planar { 1.0 } else { EDGE };
    let matrix = Mat3::new(EDGE, 0.2 * EDGE, 0.0, 0.0, EDGE, 0.0, 0.0, 0.0, depth);
    Region::periodic(Vec3::new(-0.01, 0.0, 0.003), &Cell::new(matrix), planar).unwrap()
}

fn fill(region: Region, fraction: f64, form: &mut dyn FnMut() -> Form, placement: &Placement, seed: u64) -> Field {
    let grading = Grading::fuller(4e-3, 12e-3, 0.5).unwrap();
    let dimension = if region.is_planar() { 2 } else { 3 };
    let bodies = sizes::descending(&grading, fraction * region.volume(), dimension, form).unwrap();
    let requests = bodies.into_iter().map(|(form, size)| Request { form, size, group: 0 }).collect();
    place(region, requests, &[], placement, &mut Random::new(seed)).unwrap()
}

/// All shifts by up to one cell, or none.
fn images(field: &Field) -> Vec<Vec3> {
    let mut all = field.images();
    let back: Vec<Vec3> = all.iter().map(|shift| -shift).collect();
    all.extend(back);
    all.push(Vec3::zeros());
    all
}

/// Every pair, and every image in a cell, is apart: by the distance of spheres, and by Perram and Wertheim's function of
/// ellipsoids, without the grid.
#[test]
fn placed_bodies_do_not_overlap() {
    let placement = Placement::default();
    for planar in [false, true] {
        for region in [cube(planar), cell(planar)] {
            let flatness = if planar { 1.0 } else { 0.7 };
            let shapes = [Form::Sphere, Form::Ellipsoid { elongation: 1.5, flatness }];
            for form in shapes {
                let field = fill(region.clone(), 0.35, &mut || form.clone(), &placement, 3);
                let bodies = field.inclusions();
                let least = bodies.iter().map(|one| one.measure(planar)).fold(f64::INFINITY, f64::min);
                // Half of the smallest body: 0.1 % of the aggregates in space, 1 % in the plane.
                assert!((field.volume() - 0.35 * field.region().volume()).abs() <= 0.5001 * least);
                assert!(planar || (field.volume() / field.region().volume() / 0.35 - 1.0).abs() < 5e-3);
                for (k, a) in bodies.iter().enumerate() {
                    for b in &bodies[k..] {
                        for shift in images(&field) {
                            if std::ptr::eq(a, b) && shift == Vec3::zeros() {
                                continue;
                            }
                            let gap = 0.05 * 0.5 * (a.size + b.size);
                            if form == Form::Sphere {
                                let distance = (b.center + shift - a.center).norm() - 0.5 * (a.size + b.size);
                                // Rounding of coordinates of 0.1 m.
                                assert!(distance >= gap - 1e-15, "{distance} {gap}");
                            } else {
                                assert!(perram_wertheim(a, b, &shift) > 1.0);
                            }
                        }
                    }
                }
            }
        }
    }
}

/// All bodies lie in their mould, wherever one looks on their surface.
#[test]
fn bodies_keep_their_distance_from_the_mould() {
    let axis = Vec3::new(0.01, 0.02, 0.05);
    let shapes = [
        Shape::new_box(Vec3::zeros(), Vec3::repeat(EDGE)).unwrap(),
        Shape::new_cylinder(Vec3::zeros(), axis, 0.02).unwrap(),
        Shape::new_hyperboloid(Vec3::zeros(), axis, 0.025, 0.02).unwrap(),
        Shape::new_sphere(Vec3::zeros(), 0.025).unwrap(),
    ];
    let placement = Placement { wall_gap: 0.5e-3, ..Placement::default() };
    for shape in shapes {
        let mut random = Random::new(2);
        let mut body = || {
            if random.uniform() < 0.5 {
                Form::Polyhedron(Arc::new(Polyhedron::random(10, 1.2, 0.8, &mut random).unwrap()))
            } else {
                Form::Ellipsoid { elongation: 1.5, flatness: 0.7 }
            }
        };
        let region = Region::mould(shape.clone(), false).unwrap();
        let field = fill(region, 0.15, &mut body, &placement, 5);
        for inclusion in field.inclusions() {
            for i in 0..20 {
                for j in 0..10 {
                    let (u, v) = (0.314 * f64::from(i), 0.314 * f64::from(j));
                    let direction = Vec3::new(v.sin() * u.cos(), v.sin() * u.sin(), v.cos());
                    // 1e-12: rounding of the points.
                    assert!(shape.contains(&inclusion.support(&direction), 0.5e-3 - 1e-12), "{shape:?} {inclusion:?}");
                }
            }
        }
    }
}

/// Few spheres in a mould: their centers are uniform between planes one radius from the walls, so their mean is the middle, their
/// variance (L − d)²/12. Near a wall there is less aggregate than in the middle (wall effect); in a cell there is not.
#[test]
fn centers_are_uniform_up_to_the_walls() {
    let size = 4e-3;
    let mut coordinates = Vec::new();
    for seed in 0..40 {
        let requests = vec![Request { form: Form::Sphere, size, group: 0 }; 25];
        let field = place(cube(false), requests, &[], &Placement::default(), &mut Random::new(seed)).unwrap();
        coordinates.extend(field.inclusions().iter().flat_map(|one| one.center.iter().copied().collect::<Vec<_>>()));
    }
    let count = coordinates.len() as f64;
    let free = EDGE - size;
    let mean = coordinates.iter().sum::<f64>() / count;
    let variance = coordinates.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / count;
    // 3000 coordinates: the mean scatters by √(1/12/n), the variance by √(4/5/n) of itself; four of each. 0.7 % of solid
    // correlate the places by less.
    assert!((mean - 0.5 * EDGE).abs() < 4.0 * free * (1.0 / 12.0 / count).sqrt(), "{mean}");
    assert!((variance * 12.0 / (free * free) - 1.0).abs() < 4.0 * (0.8 / count).sqrt(), "{variance}");
    let share_near_wall = |region: fn(bool) -> Region| {
        let mut near = (0, 0);
        for seed in 0..4 {
            let field = fill(region(false), 0.3, &mut || Form::Sphere, &Placement::default(), seed);
            let mut random = Random::new(seed + 100);
            for _ in 0..20_000 {
                // A layer of 1 mm at the lower wall.
                let relative = random.uniform_vector().component_mul(&Vec3::new(1.0, 1.0, 1e-3 / EDGE));
                let point = field.region().origin + field.region().edges * relative;
                near.0 += u32::from(field.at(&point, &|_| 0.0).is_some());
                near.1 += 1;
            }
        }
        f64::from(near.0) / f64::from(near.1)
    };
    let (mould, periodic) = (share_near_wall(cube), share_near_wall(cell));
    // Measured: 0.07 and 0.30. 80,000 points in four fields with some twenty sections of aggregates each scatter by 0.03.
    assert!(mould < 0.15 && (periodic - 0.3).abs() < 0.1, "{mould} {periodic}");
}

/// Points inside by the grid, and by a look at all bodies; their fraction is the volume fraction.
#[test]
fn points_are_found_in_their_bodies() {
    for planar in [false, true] {
        for region in [cube(planar), cell(planar)] {
            let field =
                fill(region, 0.3, &mut || Form::Ellipsoid { elongation: 1.4, flatness: 1.0 }, &Placement::default(), 1);
            let shifts = images(&field);
            let mut random = Random::new(9);
            let mut inside = 0;
            let count = 20_000;
            for _ in 0..count {
                let mut point = field.region().origin + field.region().edges * random.uniform_vector();
                if planar {
                    point.z = 0.0;
                }
                let found = field.at(&point, &|_| 1e-4);
                let expected = field
                    .inclusions()
                    .iter()
                    .position(|one| shifts.iter().any(|shift| one.contains(&(point - shift), 1e-4)));
                assert_eq!(found, expected);
                inside += u32::from(field.at(&point, &|_| 0.0).is_some());
            }
            // The standard deviation of the fraction is √(0.3·0.7/n) = 3.2e-3; four of them.
            assert!((f64::from(inside) / f64::from(count) - 0.3).abs() < 0.013, "{inside}");
        }
    }
}

#[test]
fn seeds_decide_about_places() {
    let one = fill(cube(false), 0.3, &mut || Form::Sphere, &Placement::default(), 1);
    let same = fill(cube(false), 0.3, &mut || Form::Sphere, &Placement::default(), 1);
    let other = fill(cube(false), 0.3, &mut || Form::Sphere, &Placement::default(), 2);
    assert_eq!(one.inclusions(), same.inclusions());
    assert_ne!(one.inclusions(), other.inclusions());
}

#[test]
fn full_moulds_say_how_far_they_got() {
    let requests = vec![Request { form: Form::Sphere, size: 10e-3, group: 0 }; 150];
    let placement = Placement { attempts: 500, ..Placement::default() };
    let full = place(cube(false), requests, &[], &placement, &mut Random::new(1));
    let Err(PackingError::NoPlace { number, count: 150, reached, wanted, .. }) = full else { panic!("{full:?}") };
    // 150 spheres would fill 0.628, more than the 0.38 at which random addition of spheres jams (Cooper 1988).
    assert!((wanted - 0.6283).abs() < 1e-4 && reached < 0.38 && reached > 0.15, "{reached} {wanted}");
    assert!((reached / wanted - number as f64 / 150.0).abs() < 1e-12);
    let requests = vec![Request { form: Form::Sphere, size: 60e-3, group: 0 }];
    assert!(place(cube(false), requests, &[], &placement, &mut Random::new(1)).is_err());
    let negative = Placement { gap: -1.0, ..placement };
    assert!(place(cube(false), Vec::new(), &[], &negative, &mut Random::new(1)).is_err());
}

/// Fixed bodies stay where they are, also outside of the mould, and the others keep away from them.
#[test]
fn fixed_bodies_are_in_the_way() {
    let fixed = Inclusion {
        form: Form::Sphere,
        size: 30e-3,
        center: Vec3::new(0.025, 0.025, 0.045),
        rotation: Mat3::identity(),
        group: 1,
    };
    let requests = vec![Request { form: Form::Sphere, size: 5e-3, group: 0 }; 60];
    let field =
        place(cube(false), requests, std::slice::from_ref(&fixed), &Placement::default(), &mut Random::new(1)).unwrap();
    assert_eq!(field.inclusions()[0], fixed);
    assert!(field.inclusions()[1..].iter().all(|one| apart(one, &fixed, &Vec3::zeros(), 0.0)));
    assert_eq!(field.at(&Vec3::new(0.025, 0.025, 0.055), &|_| 0.0), Some(0));
}

/// A hundred thousand aggregates; run it alone for its time, `cargo test --release -p concordem-packing -- --ignored --nocapture`.
#[test]
#[ignore = "a measurement of time"]
fn a_hundred_thousand_aggregates() {
    for (what, form) in [("spheres", Form::Sphere), ("ellipsoids", Form::Ellipsoid { elongation: 1.4, flatness: 0.7 })]
    {
        let grading = Grading::fuller(4e-3, 16e-3, 0.5).unwrap();
        let shape = Shape::new_box(Vec3::zeros(), Vec3::repeat(0.355)).unwrap();
        let region = Region::mould(shape, false).unwrap();
        let start = std::time::Instant::now();
        let bodies = sizes::descending(&grading, 0.4 * region.volume(), 3, &mut || form.clone()).unwrap();
        let count = bodies.len();
        let requests = bodies.into_iter().map(|(form, size)| Request { form, size, group: 0 }).collect();
        let field = place(region, requests, &[], &Placement::default(), &mut Random::new(1)).unwrap();
        let fraction = field.volume() / field.region().volume();
        println!("{count} {what}, fraction {fraction:.4}: {:.1} s", start.elapsed().as_secs_f64());
        assert!(count > 100_000);
    }
}
