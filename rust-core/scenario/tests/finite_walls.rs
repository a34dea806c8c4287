//! Plates, rods, and tubes: closest points against a dense sampling, forces at edges, rolling off an edge, periodic images.

use std::sync::Arc;

use concordem_contact::law::{ContactStiffness, Frictional};
use concordem_contact::math::{Vec3, quaternion_of_rotation_vector, rotate};
use concordem_scenario::walls::cylinder::{Rod, Tube};
use concordem_scenario::walls::plate::{Disc, Rectangle};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::surface::{Cylinder, Plane};
use concordem_solver::state::{Cell, Particles, Sphere, State, Surface, Turning, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Solver};

const RADIUS: f64 = 0.5;
const MASS: f64 = 2.0;
const STIFFNESS: f64 = 2e5;
const GRAVITY: f64 = 10.0;
/// Overlap of a sphere that rests on a face.
const REST: f64 = MASS * GRAVITY / STIFFNESS;

/// Center of the [`shapes`].
const CENTER: Vec3 = Vec3::new(0.2, -0.1, 0.3);

type Finite = Arc<dyn Surface>;

fn finite(surface: impl Surface + 'static) -> Finite {
    Arc::new(surface)
}

/// A solid sphere at a wall; the normal dashpot has 0.3 of the critical damping.
fn scene(position: Vec3, shape: Finite, friction: f64) -> (State, Model) {
    let mut particles = Particles::default();
    particles.push(Sphere { position, radius: RADIUS }, 0, MASS, 0.4 * MASS * RADIUS * RADIUS);
    let stiffness = ContactStiffness::Given { normal: STIFFNESS, shear: STIFFNESS };
    let contact = Frictional::new(stiffness, friction, 0.3).unwrap();
    let mut wall_rows = PairCoefficients::new(1);
    wall_rows.set(0, 0, 0);
    let mut state = State {
        particles,
        walls: vec![Wall::new("wall", WallShape::Rigid(shape), 0, Vec3::zeros())],
        wall_contacts: Some(Box::new(ContactBlock::new(vec![contact]))),
        ..State::default()
    };
    state.clock.dt = 1e-4;
    (state, Model { wall_rows, ..Model::default() })
}

fn rectangle() -> Finite {
    finite(Rectangle { center: Vec3::zeros(), normal: Vec3::z(), half_edges: [Vec3::x() * 2.0, Vec3::y()] })
}

fn rod() -> Finite {
    finite(Rod { center: Vec3::zeros(), axis: Vec3::z(), radius: 2.0, half_length: 3.0 })
}

fn tube() -> Finite {
    finite(Tube { center: Vec3::zeros(), axis: Vec3::z(), radius: 2.0, half_length: 3.0 })
}

/// Point of a surface, from two numbers between 0 and 1.
type SurfacePoint = Box<dyn Fn(f64, f64) -> Vec3>;

/// Shapes around an axis, which hollow ones return, with points of their surfaces for two parameters between 0 and 1.
fn shapes() -> Vec<(Finite, SurfacePoint, Option<Vec3>)> {
    let turn = quaternion_of_rotation_vector(&Vec3::new(0.3, -0.7, 0.4));
    let [u, v, e] = [Vec3::x(), Vec3::y(), Vec3::z()].map(|axis| rotate(&turn, &axis));
    let center = CENTER;
    let (radius, half_length) = (0.7, 0.9);
    let around = move |angle: f64| u * angle.cos() + v * angle.sin();
    let circle = 2.0 * std::f64::consts::PI;
    let mantle = move |a: f64, b: f64| center + around(a * circle) * radius + e * (half_length * (2.0 * b - 1.0));
    // The mantle, and half of the parameter for the two ends.
    let rod = move |a: f64, b: f64| match b {
        b if b < 0.25 => center + around(a * circle) * (radius * 4.0 * b) + e * half_length,
        b if b < 0.5 => center + around(a * circle) * (radius * (4.0 * b - 1.0)) - e * half_length,
        b => mantle(a, 2.0 * b - 1.0),
    };
    let half_edges = [u * 0.8, v * 0.5];
    vec![
        (
            finite(Rectangle { center, normal: e, half_edges }),
            Box::new(move |a, b| center + half_edges[0] * (2.0 * a - 1.0) + half_edges[1] * (2.0 * b - 1.0)),
            None,
        ),
        (
            finite(Disc { center, normal: e, radius }),
            Box::new(move |a, b| center + around(a * circle) * (radius * b)),
            None,
        ),
        (finite(Rod { center, axis: e, radius, half_length }), Box::new(rod), None),
        (finite(Tube { center, axis: e, radius, half_length }), Box::new(mantle), Some(e)),
    ]
}

/// The closest point lies on the surface, and no point of a dense sampling is closer; up to the spacing of the samples.
#[test]
fn closest_point_is_that_of_a_dense_sampling() {
    let n = 400;
    for (shape, surface, _) in shapes() {
        let samples: Vec<Vec3> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (f64::from(i) / f64::from(n), f64::from(j) / f64::from(n))))
            .map(|(a, b)| surface(a, b))
            .collect();
        for k in 0..60 {
            let coordinate = |m: u32| f64::from((k * 7919 + m * 104_729) % 1000) / 250.0 - 2.0;
            let x = Vec3::new(coordinate(1), coordinate(2), coordinate(3));
            let found = shape.closest_point(0, &x).unwrap();
            let point = x + found.normal * found.distance;
            let nearest = |to: &Vec3| samples.iter().map(|p| (p - to).norm()).fold(f64::INFINITY, f64::min);
            // Samples are at most 2π·0.7/400 = 0.011 apart, and lie on the surface.
            assert!(nearest(&point) < 0.011, "{shape:?} {x}: not on the surface");
            let (best, exact) = (nearest(&x), found.distance.abs());
            assert!(exact < best + 1e-12, "{shape:?} {x}: {exact} {best}");
            // 0.011²/(2·distance) in general; at most the spacing.
            assert!(best - exact < 0.011, "{shape:?} {x}: {exact} {best}");
            assert!((found.normal.norm() - 1.0).abs() < 1e-15 * 4.0);
            let [low, high] = shape.span(&Vec3::x()).unwrap();
            assert!(point.x >= low - 1e-14 && point.x <= high + 1e-14, "{shape:?}");
        }
        // The extent is reached: samples are dense, and the largest coordinate is stationary or at a corner of the parameters.
        let reached = samples.iter().map(|p| p.x - CENTER.x).fold(0.0, f64::max);
        let [low, high] = shape.span(&Vec3::x()).unwrap();
        assert!((reached / (high - CENTER.x) - 1.0).abs() < 1e-3, "{shape:?}");
        assert!((high + low - 2.0 * CENTER.x).abs() < 1e-14, "{shape:?}");
    }
}

/// Outside, the distance changes by no more than the point moves, and the direction by no more than that over the distance: neither
/// jumps at an edge, a corner, or a rim. Inside a tube the distance from the axis takes its place.
#[test]
fn no_jump_over_edges() {
    let step = 1e-6;
    for (shape, _, hollow) in shapes() {
        let mut edges = 0;
        // Circles in several planes around the shape.
        for tilt in 0..7 {
            let turn = quaternion_of_rotation_vector(&(Vec3::new(0.1, 1.0, -0.3) * f64::from(tilt)));
            let place = |angle: f64| CENTER + rotate(&turn, &Vec3::new(angle.cos(), angle.sin(), 0.0)) * 1.3;
            let mut before = shape.closest_point(0, &place(0.0)).unwrap();
            for k in 1..=2000 {
                let angle = f64::from(k) * 3.14e-3;
                let here = shape.closest_point(0, &place(angle)).unwrap();
                let there = shape.closest_point(0, &place(angle + step)).unwrap();
                // A tube is hollow: at its axis the closest point changes sides.
                let r = place(angle) - CENTER;
                let from_axis = hollow.map_or(f64::INFINITY, |axis| (r - axis * r.dot(&axis)).norm());
                if from_axis < 0.05 {
                    before = here;
                    continue;
                }
                let moved = (place(angle + step) - place(angle)).norm();
                assert!((there.distance - here.distance).abs() <= moved * (1.0 + 1e-6), "{shape:?} {angle}");
                let bound = 2.0 * moved / here.distance.min(from_axis) + 1e-12;
                assert!((there.normal - here.normal).norm() <= bound, "{shape:?} {angle}");
                // Also over the whole distance from the last place, 1.3 × 3.14e-3.
                let bound = 2.0 * 4.1e-3 / here.distance.min(before.distance).min(from_axis - 4.1e-3);
                assert!((here.normal - before.normal).norm() <= bound, "{shape:?} {angle}");
                edges += usize::from(here.interior != before.interior);
                before = here;
            }
        }
        assert!(edges > 10, "{shape:?}: crossed {edges} edges");
    }
}

/// The force is `k (R - d)` away from the closest point, at the distance `d`: at faces, edges, corners, mantles, rims, and ends.
#[test]
fn force_of_the_overlap() {
    let disc = finite(Disc { center: Vec3::zeros(), normal: Vec3::z(), radius: 2.0 });
    // Shape, center of the sphere, closest point.
    let cases = [
        (rectangle(), [0.3, 0.2, 0.4], [0.3, 0.2, 0.0]),
        (rectangle(), [0.3, 0.2, -0.4], [0.3, 0.2, 0.0]),
        (rectangle(), [2.3, 0.2, 0.3], [2.0, 0.2, 0.0]),
        (rectangle(), [0.3, -1.3, -0.2], [0.3, -1.0, 0.0]),
        (rectangle(), [-2.2, 1.1, 0.3], [-2.0, 1.0, 0.0]),
        (disc.clone(), [1.0, 1.0, 0.4], [1.0, 1.0, 0.0]),
        (disc, [1.5, 2.0, 0.0], [1.2, 1.6, 0.0]),
        (rod(), [1.44, 1.92, 1.0], [1.2, 1.6, 1.0]),
        (rod(), [1.0, 0.0, -3.4], [1.0, 0.0, -3.0]),
        (rod(), [0.0, 0.0, 3.4], [0.0, 0.0, 3.0]),
        (rod(), [1.38, 1.84, 3.3], [1.2, 1.6, 3.0]),
        (tube(), [0.96, 1.28, 1.0], [1.2, 1.6, 1.0]),
        (tube(), [1.38, 1.84, 1.0], [1.2, 1.6, 1.0]),
        (tube(), [1.02, 1.36, -3.3], [1.2, 1.6, -3.0]),
    ];
    // Inside the rod the nearer surface pushes out.
    let inside = [(rod(), [0.0, 0.0, 2.9], [0.0, 0.0, 3.0]), (rod(), [0.0, 1.95, 2.5], [0.0, 2.0, 2.5])];
    let cases = cases.into_iter().map(|case| (case, false)).chain(inside.into_iter().map(|case| (case, true)));
    for ((shape, place, closest), within) in cases {
        let [place, closest] = [place, closest].map(Vec3::from);
        let away = place - closest;
        let expected = if within {
            -away * (STIFFNESS * (RADIUS + away.norm()) / away.norm())
        } else {
            away * (STIFFNESS * (RADIUS - away.norm()) / away.norm())
        };
        let (mut state, model) = scene(place, shape.clone(), 0.0);
        let mut solver = Solver::new(model, &mut state).unwrap();
        solver.step(&mut state).unwrap();
        // Rounding of coordinates of order 4.
        let error = (solver.forces()[0] - expected).norm();
        assert!(error < STIFFNESS * 4e-15, "{shape:?} {place} {expected} {}", solver.forces()[0]);
        assert!((state.walls[0].force + expected).norm() < STIFFNESS * 4e-15);
    }
    // Nothing touches in the opening of the tube, or beside a plate.
    for (shape, place) in [(tube(), [0.0, 0.0, 3.2]), (tube(), [1.0, 0.0, 0.0]), (rectangle(), [2.4, 1.4, 0.3])] {
        let (mut state, model) = scene(Vec3::from(place), shape, 0.0);
        let mut solver = Solver::new(model, &mut state).unwrap();
        solver.step(&mut state).unwrap();
        assert_eq!(solver.forces()[0], Vec3::zeros());
    }
}

/// A ball that comes to the edge with the velocity `v` and goes over it leaves where `m v²/R = m g cos θ`. If it slides without friction,
/// `cos θ = (v²/(gR) + 2)/3`; if it rolls, `cos θ = (0.7 v²/(gR) + 1)/1.7`. It keeps its energy.
#[test]
fn rolling_off_an_edge() {
    let start = 0.4 * GRAVITY * RADIUS;
    let shapes = [
        rectangle(),
        finite(Disc { center: Vec3::zeros(), normal: Vec3::z(), radius: 2.0 }),
        finite(Rod { center: Vec3::z() * -3.0, axis: Vec3::z(), radius: 2.0, half_length: 3.0 }),
    ];
    for shape in shapes {
        // With the largest friction the ball does not slip until the normal force vanishes.
        for (friction, cosine) in [(0.0, 0.8), (100.0, 1.28 / 1.7)] {
            let height = RADIUS - REST;
            let (mut state, mut model) = scene(Vec3::new(1.8, 0.0, height), shape.clone(), friction);
            model.gravity = Vec3::z() * -GRAVITY;
            state.particles.velocity[0].x = start.sqrt();
            if friction > 0.0 {
                state.particles.angular_velocity[0].y = start.sqrt() / height;
            }
            let energy = |state: &State| {
                let particles = &state.particles;
                let (v, w) = (particles.velocity[0], particles.angular_velocity[0]);
                let kinetic = 0.5 * (MASS * v.norm_squared() + particles.inertia[0] * w.norm_squared());
                kinetic + MASS * GRAVITY * particles.position[0].z
            };
            let before = energy(&state);
            let mut solver = Solver::new(model, &mut state).unwrap();
            let mut left = None;
            while state.particles.position[0].z > -1.0 {
                solver.step(&mut state).unwrap();
                let place = state.particles.position[0];
                if left.is_none() && place.x > 2.0 && solver.forces()[0] == Vec3::zeros() {
                    left = Some(place.z / (place - Vec3::x() * 2.0).norm());
                }
            }
            let left = left.unwrap();
            // The force swings by up to 0.4 mg about the wanted one as the edge is met, for 1/(ξω) = 10 ms of the 190 ms until the ball
            // leaves. The radius is less than R by the overlap, 2e-4; the last force of the spring is that of one step before, 4e-4 rad.
            assert!((left - cosine).abs() < 3e-3, "{shape:?} {friction}: {left} {cosine}");
            // The dashpot consumes the energy of this swing, (0.4 mg)²/(2k) = 1.6e-4 J; the spring had 1e-3 J at the start. The leapfrog's
            // velocity is that of half a step before, which counts m g v Δt/2 = 5e-3 J of the fall.
            let after = energy(&state);
            assert!((after - before).abs() < 7e-3 && before > 10.0, "{shape:?} {friction}: {after} {before}");
        }
    }
}

/// In a periodic cell a plate as long as the cell is a floor without seams, and a shorter one leaves a gap whose two edges both act. The
/// force does not depend on the image in which the particle is listed. A longer one is refused.
#[test]
fn images_of_plates() {
    let plate = |edge: f64| {
        finite(Rectangle {
            center: Vec3::new(1.0, 1.5, 0.5),
            normal: Vec3::z(),
            half_edges: [Vec3::x() * (0.5 * edge), Vec3::y() * 1.5],
        })
    };
    let cell = Cell::new_box(Vec3::new(4.0, 3.0, 5.0));
    let force = |edge: f64, place: Vec3| {
        let (mut state, model) = scene(place, plate(edge), 0.0);
        state.cell = Some(cell);
        assert!(state.walls[0].repeats_with(&cell).is_ok());
        let mut solver = Solver::new(model, &mut state).unwrap();
        solver.step(&mut state).unwrap();
        solver.forces()[0]
    };
    for shift in [[0.0; 3], [4.0, 0.0, 0.0], [-8.0, 3.0, -5.0], [4.0, -6.0, 10.0]] {
        let shift = Vec3::from(shift);
        for x in [1.0, 2.9, 3.0, 3.1, 3.0 - 1e-7] {
            // The seam lies at x = 3.
            let found = force(4.0, Vec3::new(x, 0.3, 0.9) + shift);
            assert!((found - Vec3::z() * (0.1 * STIFFNESS)).norm() < STIFFNESS * 1e-13, "{x} {shift} {found}");
        }
        // A gap from 2.7 to 3.3: two edges at the distance √(0.3² + 0.2²), each with its share along z.
        let found = force(3.4, Vec3::new(3.0, 0.3, 0.7) + shift);
        let distance = 0.13_f64.sqrt();
        let expected = Vec3::z() * (2.0 * STIFFNESS * (RADIUS - distance) * 0.2 / distance);
        assert!((found - expected).norm() < STIFFNESS * 1e-13, "{shift} {found} {expected}");
    }
    let long = Wall::new("long", WallShape::Rigid(plate(4.1)), 0, Vec3::zeros());
    assert!(long.repeats_with(&cell).is_err());
    // A rod and a tube as long as the cell are infinite cylinders.
    let (axis, radius) = (Vec3::y(), 1.0);
    let of = |shape: WallShape, place: Vec3| {
        let (mut state, model) = scene(place, rectangle(), 0.0);
        state.cell = Some(cell);
        state.walls = vec![Wall::new("w", shape, 0, Vec3::zeros())];
        assert!(state.walls[0].repeats_with(&cell).is_ok());
        let mut solver = Solver::new(model, &mut state).unwrap();
        solver.step(&mut state).unwrap();
        solver.forces()[0]
    };
    let center = Vec3::new(2.0, 1.5, 2.5);
    for y in [0.0, 0.4, 1.5, 2.999, 7.3] {
        for (finite, inside, rho) in [
            (finite(Rod { center, axis, radius, half_length: 1.5 }), false, 1.4),
            (finite(Tube { center, axis, radius, half_length: 1.5 }), true, 0.6),
        ] {
            let place = Vec3::new(2.0 + 0.6 * rho, y, 2.5 + 0.8 * rho);
            let infinite = WallShape::rigid(Cylinder { point: center, axis, radius, inside });
            let [found, expected] = [WallShape::Rigid(finite.clone()), infinite].map(|shape| of(shape, place));
            assert!(expected.norm() > 0.05 * STIFFNESS, "{finite:?} {y}");
            assert!((found - expected).norm() < STIFFNESS * 1e-13, "{finite:?} {y} {found} {expected}");
        }
    }
}

/// Where the closest point has no direction, there is a distance all the same: on a plate, and on the axes of a rod and a tube, also beyond
/// the tube's ends.
#[test]
fn distance_without_direction() {
    let disc = finite(Disc { center: Vec3::zeros(), normal: Vec3::z(), radius: 2.0 });
    let cell = Cell::new_box(Vec3::new(20.0, 20.0, 20.0));
    for (shape, place, distance) in [
        (rectangle(), [0.3, 0.2, 0.0], 0.0),
        (disc, [0.3, 0.2, 0.0], 0.0),
        (rod(), [0.0, 0.0, 0.5], -2.0),
        (tube(), [0.0, 0.0, 0.5], 2.0),
        (tube(), [0.0, 0.0, 6.0], 13.0_f64.sqrt()),
    ] {
        let place = Vec3::from(place);
        assert!(shape.closest_point(0, &place).is_none(), "{shape:?}");
        // A particle there is a neighbor of the wall, in a periodic cell, too.
        let wall = Wall::new("w", WallShape::Rigid(shape), 0, Vec3::zeros());
        assert_eq!(wall.distance(0, &place), distance);
        assert_eq!(wall.images_near(&place, distance + 0.1, &cell), [[0; 3]]);
        assert!(wall.images_near(&place, distance - 0.1, &cell).is_empty() || distance < 0.1);
    }
}

/// A ball on a turning disc moves as on a turning plane; turning rods and tubes act as infinite cylinders that turn.
#[test]
fn turning_walls() {
    let turning = Turning { center: Vec3::zeros(), angular_velocity: Vec3::z() * 3.0, previous: Vec3::z() * 3.0 };
    let run = |shape: WallShape, place: Vec3, push: Vec3| {
        let (mut state, mut model) = scene(place, rectangle(), 0.4);
        let mut wall = Wall::new("w", shape, 0, Vec3::zeros());
        wall.turning = Some(turning);
        state.walls = vec![wall];
        model.gravity = push * GRAVITY;
        let mut solver = Solver::new(model, &mut state).unwrap();
        for _ in 0..500 {
            solver.step(&mut state).unwrap();
        }
        (state.particles.position[0], state.particles.angular_velocity[0], state.walls[0].torque)
    };
    let (zero, axis, radius, half_length) = (Vec3::zeros(), Vec3::z(), 2.0, 3.0);
    let cylinder = |inside: bool| WallShape::rigid(Cylinder { point: zero, axis, radius, inside });
    let cases = [
        (
            finite(Disc { center: zero, normal: axis, radius }),
            WallShape::rigid(Plane { point: zero, normal: axis }),
            [1.0, 0.0, 0.4999],
            -axis,
        ),
        (finite(Rod { center: zero, axis, radius, half_length }), cylinder(false), [2.4999, 0.0, 0.0], -Vec3::x()),
        (finite(Tube { center: zero, axis, radius, half_length }), cylinder(true), [1.5001, 0.0, 0.0], Vec3::x()),
    ];
    for (finite, infinite, place, push) in cases {
        let [found, expected] =
            [WallShape::Rigid(finite.clone()), infinite].map(|shape| run(shape, Vec3::from(place), push));
        // It has been dragged along.
        assert!(
            (expected.0 - Vec3::from(place)).norm() > 1e-4 && expected.1.norm() > 0.01 && expected.2.norm() > 1e-3,
            "{finite:?} {expected:?}"
        );
        // Rounding of 500 steps.
        assert!(
            (found.0 - expected.0).norm() < 1e-12 && (found.1 - expected.1).norm() < 1e-10,
            "{finite:?} {found:?} {expected:?}"
        );
        assert!((found.2 - expected.2).norm() < 1e-9 * expected.2.norm(), "{finite:?} {found:?} {expected:?}");
    }
}

/// A ball that starts exactly on the axis of a tube meets its mantle as one that starts beside the axis.
#[test]
fn start_on_the_axis_of_a_tube() {
    let shape = finite(Tube { center: Vec3::zeros(), axis: Vec3::z(), radius: RADIUS * 1.001, half_length: 3.0 });
    let turned = |x: f64| {
        let (mut state, model) = scene(Vec3::new(x, 0.0, 0.0), shape.clone(), 0.0);
        state.particles.velocity[0] = Vec3::x();
        let mut solver = Solver::new(model, &mut state).unwrap();
        (0..5000_u32).find(|_| {
            solver.step(&mut state).unwrap();
            state.particles.velocity[0].x < 0.0
        })
    };
    let (on, beside) = (turned(0.0).expect("it meets the mantle"), turned(1e-9).expect("it meets the mantle"));
    assert!(on.abs_diff(beside) <= 1, "{on} {beside}");
}
