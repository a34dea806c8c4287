//! Meshes with moving vertices against closed forms: bodies on surfaces that move, rotate, and stretch; forces on the vertices.

use concordem_contact::law::{ContactStiffness, Frictional};
use concordem_contact::math::Vec3;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Cell, Constraint, Mesh, MeshError, Particles, Sphere, State, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Solver, SolverError};

const RADIUS: f64 = 0.5;
const MASS: f64 = 2.0;
const STIFFNESS: f64 = 2e5;
const GRAVITY: f64 = 10.0;
/// Overlap of a sphere that rests on a floor.
const REST: f64 = MASS * GRAVITY / STIFFNESS;

/// A floor of `2 n × 2 n` squares of size `edge` with two triangles each, around the origin.
fn floor(n: i32, edge: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let row = (2 * n + 1) as u32;
    let vertices = (-n..=n).flat_map(|j| (-n..=n).map(move |i| Vec3::new(f64::from(i), f64::from(j), 0.0) * edge));
    let mut triangles = Vec::new();
    for j in 0..row - 1 {
        for i in 0..row - 1 {
            let k = j * row + i;
            triangles.extend([[k, k + 1, k + row + 1], [k, k + row + 1, k + row]]);
        }
    }
    (vertices.collect(), triangles)
}

/// Solid spheres resting on the mesh, under gravity; friction `μ`.
fn scene(places: &[Vec3], shape: WallShape, friction: f64, dt: f64) -> (State, Model) {
    let mut particles = Particles::default();
    for position in places {
        let inertia = 0.4 * MASS * RADIUS * RADIUS;
        particles.push(Sphere { position: *position, radius: RADIUS }, 0, MASS, inertia);
    }
    let stiffness = ContactStiffness::Given { normal: STIFFNESS, shear: STIFFNESS };
    let contact = Frictional::new(stiffness, friction, 0.05).unwrap();
    let mut wall_rows = PairCoefficients::new(1);
    wall_rows.set(0, 0, 0);
    let mut state = State {
        particles,
        walls: vec![Wall::new("mesh", shape, 0, Vec3::zeros())],
        wall_contacts: Some(Box::new(ContactBlock::new(vec![contact]))),
        ..State::default()
    };
    state.clock.dt = dt;
    (state, Model { wall_rows, gravity: Vec3::new(0.0, 0.0, -GRAVITY), ..Model::default() })
}

fn mesh(state: &mut State) -> &mut Mesh {
    state.walls[0].mesh_mut().unwrap()
}

fn on_floor(x: f64, y: f64) -> Vec3 {
    Vec3::new(x, y, RADIUS - REST)
}

/// Runs to `time` with the vertices driven to `place(X, t)`, and checks the forces on them and the ledger.
fn run(state: &mut State, model: Model, time: f64, place: impl Fn(&Vec3, f64) -> Vec3) {
    let dt = state.clock.dt;
    let reference = mesh(state).position.clone();
    let velocity = |state: &mut State, t: f64| -> Vec<Vec3> {
        mesh(state).position.iter().zip(&reference).map(|(x, start)| (place(start, t + dt) - x) / dt).collect()
    };
    let first = velocity(state, 0.0);
    mesh(state).previous_velocity = first;
    let mut solver = Solver::new(model, state).unwrap();
    let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
    while state.clock.time() < time {
        let present = state.clock.time();
        let next = velocity(state, present);
        mesh(state).drive(&next).unwrap();
        let places = mesh(state).position.clone();
        let centers = state.particles.position.clone();
        solver.step(state).unwrap();
        // What the vertices have, the particles have with the opposite sign: force, and moment about any point.
        let about = Vec3::new(0.3, -2.0, 7.0);
        let on_vertices = mesh(state).force.clone();
        let sum = on_vertices.iter().sum::<Vec3>() + solver.forces().iter().sum::<Vec3>();
        let moment = on_vertices.iter().zip(&places).map(|(f, x)| (x - about).cross(f)).sum::<Vec3>()
            + solver.forces().iter().zip(&centers).map(|(f, x)| (x - about).cross(f)).sum::<Vec3>()
            + solver.torques().iter().sum::<Vec3>();
        // Roundings of forces of 20 N and arms of 10 m.
        assert!(sum.norm() < 1e-12 && moment.norm() < 1e-11, "{sum} {moment}");
        worst = worst.max(state.ledger.residual().abs());
        scale = scale.max(state.ledger.turnover());
    }
    println!("residual {worst:.1e} of {scale:.1e} J after {} searches", solver.neighbor_rebuilds());
    // The trapezoidal rule errs by (ωΔt)²/12 of the energy of an oscillation; rolling has ω² = 3.5 k/m and at most ωΔt = 0.12.
    assert!(worst < 1.2e-3 * scale, "{worst:e} {scale:e}");
}

/// A belt that moves under a sphere at rest: it slides, `v = μgt`, until it rolls with 2/7 of the speed of the belt. Against a wall that
/// stands (the velocity of the facets is not set) it would stay at rest.
#[test]
fn a_belt_carries_a_sphere() {
    let (speed, friction) = (1.4, 0.2);
    let (vertices, triangles) = floor(8, 0.4);
    let shape = WallShape::Mesh(Mesh::new(vertices, triangles).unwrap());
    let (mut state, model) = scene(&[on_floor(0.03, 0.05)], shape, friction, 1e-4);
    let slides = speed / (3.5 * friction * GRAVITY);
    run(&mut state, model.clone(), 0.5 * slides, |x, t| x + Vec3::x() * (speed * t));
    // The shear spring yields after `μmg/(k V)` = 1.4e-5 s; the velocity is that of half a step before.
    let expected = friction * GRAVITY * (0.5 * slides);
    assert!(
        (state.particles.velocity[0].x / expected - 1.0).abs() < 5e-3,
        "{} {expected}",
        state.particles.velocity[0]
    );
    let (vertices, triangles) = floor(8, 0.4);
    let shape = WallShape::Mesh(Mesh::new(vertices, triangles).unwrap());
    let (mut state, model) = scene(&[on_floor(0.03, 0.05)], shape, friction, 1e-4);
    run(&mut state, model, 3.0 * slides, |x, t| x + Vec3::x() * (speed * t));
    let (v, w) = (state.particles.velocity[0], state.particles.angular_velocity[0]);
    // The spring oscillates about rolling, with the shear dashpot.
    assert!((v.x - 2.0 / 7.0 * speed).abs() < 2e-3 * speed, "{v}");
    assert!((v.x - w.y * RADIUS * (1.0 - REST / RADIUS) - speed).abs() < 2e-3 * speed, "{v} {w}");
}

/// A ball that rolls on a turntable moves in a circle with 2/7 of its angular velocity (Weltner 1979), whatever its spin about the
/// vertical. It crosses edges and vertices all the way.
#[test]
fn a_ball_on_a_turntable_circles_with_two_sevenths() {
    for spin in [0.0, 3.0] {
        let (rate, start) = (0.7, Vec3::new(1.3, 0.0, RADIUS - REST));
        let (vertices, triangles) = floor(8, 0.4);
        let (mut state, model) = scene(&[start], WallShape::Mesh(Mesh::new(vertices, triangles).unwrap()), 2.0, 2e-4);
        state.particles.velocity[0] = Vec3::y() * (2.0 / 7.0 * rate * start.x);
        state.particles.angular_velocity[0] = Vec3::new(5.0 / 7.0 * rate * start.x / (RADIUS - REST), 0.0, spin);
        let turned = |x: &Vec3, angle: f64| {
            Vec3::new(x.x * angle.cos() - x.y * angle.sin(), x.x * angle.sin() + x.y * angle.cos(), x.z)
        };
        let time = 6.0;
        run(&mut state, model, time, |x, t| turned(x, rate * t));
        let expected = turned(&start, 2.0 / 7.0 * rate * time);
        let miss = (state.particles.position[0] - expected).xy().norm();
        println!("spin {spin}: {miss:.2e} of {:.2} m of path", 2.0 / 7.0 * rate * time * start.x);
        // The spring stretches by `F/k` = 1e-6 m; the arm R − δ differs from R by 2e-4 in the inertia of rolling.
        assert!(miss < 2e-3, "{miss:e} {} {expected}", state.particles.position[0]);
    }
}

/// On a sheet that stretches, `X(1 + εt)`, a rolling ball follows `x₀(7/5 s^(2/7) − 2/5 s)` with `s = 1 + εt`: its acceleration is 2/7 of
/// that of the material under it.
#[test]
fn a_ball_on_a_stretching_sheet() {
    let (rate, start) = (0.2, 1.1);
    let (vertices, triangles) = floor(8, 0.4);
    let shape = WallShape::Mesh(Mesh::new(vertices, triangles).unwrap());
    let (mut state, model) = scene(&[on_floor(start, 0.03)], shape, 2.0, 2e-4);
    state.particles.angular_velocity[0].y = -rate * start / (RADIUS - REST);
    let time = 5.0;
    run(&mut state, model, time, |x, t| Vec3::new(x.x * (1.0 + rate * t), x.y, x.z));
    let s: f64 = 1.0 + rate * time;
    let expected = start * (1.4 * s.powf(2.0 / 7.0) - 0.4 * s);
    let found = state.particles.position[0].x;
    println!("{found} {expected}");
    assert!((found - start).abs() > 0.01 && (found - expected).abs() < 2e-4, "{found} {expected}");
}

/// Steps of a prescribed ball on a mesh that move as one rigid body, after `loading` steps in which only the ball slides by `slide` along
/// x. Calls `check` with the angle and the force and torque on the ball at that angle.
fn rigid(axis: Vec3, dt: f64, loading: i32, slide: f64, check: impl Fn(i32, f64, Vec3, Vec3)) {
    let (vertices, triangles) = floor(3, 0.9);
    let (mut state, mut model) =
        scene(&[on_floor(0.1, 0.2)], WallShape::Mesh(Mesh::new(vertices, triangles).unwrap()), 2.0, dt);
    model.gravity = Vec3::zeros();
    state.particles.constraint[0] = Constraint::ALL;
    let rotated = |x: &Vec3, angle: f64| rotate(&axis, x, angle);
    let rate = 1.5;
    let reference = mesh(&mut state).position.clone();
    let mut start = state.particles.position[0];
    let mut solver = Solver::new(model, &mut state).unwrap();
    for step in 0..200 {
        let angle = rate * dt * f64::from(step + 1 - loading);
        let present = state.particles.position[0];
        let (place, spin) = if step < loading {
            start = present + Vec3::x() * (slide / f64::from(loading));
            (start, Vec3::zeros())
        } else {
            let next: Vec<Vec3> =
                mesh(&mut state).position.iter().zip(&reference).map(|(x, r)| (rotated(r, angle) - x) / dt).collect();
            mesh(&mut state).drive(&next).unwrap();
            (rotated(&start, angle), axis * rate)
        };
        solver.targets_mut(&state.particles)[0] = ((place - present) / dt, spin);
        solver.step(&mut state).unwrap();
        check(step, (angle - rate * dt).max(0.0), solver.forces()[0], solver.torques()[0]);
    }
}

fn rotate(axis: &Vec3, x: &Vec3, angle: f64) -> Vec3 {
    x * angle.cos() + axis.cross(x) * angle.sin() + axis * (axis.dot(x) * (1.0 - angle.cos()))
}

/// A ball that moves with a mesh as one rigid body feels the force of the overlap along the present normal, and no shear force, no
/// torque. Exactly so if the axis lies in the surface or across it; otherwise the measure errs in third order of the angle of a step.
#[test]
fn rigid_motion_makes_no_shear_force() {
    let oblique = Vec3::new(0.3, -0.5, 0.8).normalize();
    for (axis, dt) in [(Vec3::new(0.6, -0.8, 0.0), 1e-2), (Vec3::z(), 1e-2), (oblique, 1e-3)] {
        let angle: f64 = 1.5 * dt;
        // Rounding: 200 steps, each with a slip of 1e-16 m, times the stiffness.
        let tolerance = if axis == oblique { STIFFNESS * RADIUS * 200.0 * angle.powi(3) } else { 1e-8 };
        rigid(axis, dt, 1, 0.0, |step, angle, force, torque| {
            let expected = rotate(&axis, &Vec3::z(), angle) * (STIFFNESS * REST);
            assert!(
                (force - expected).norm() < tolerance && torque.norm() < tolerance,
                "{axis} {step} {force} {torque}"
            );
        });
    }
}

/// A shear force turns with the ball and the surface, if both turn about the normal: the history turns by the mean of their twists, not
/// by half that of the ball. In the tangential plane, after 190 steps of 0.015 rad.
#[test]
fn shear_force_turns_with_the_surface() {
    let slide = 1e-5;
    rigid(Vec3::z(), 1e-2, 10, slide, |step, angle, force, _| {
        if step >= 11 {
            let expected = rotate(&Vec3::z(), &Vec3::new(-STIFFNESS * slide, 0.0, 0.0), angle);
            let shear = Vec3::new(force.x, force.y, 0.0);
            // Rounding as above.
            assert!((shear - expected).norm() < 1e-8, "step {step}: {shear} {expected}");
        }
    });
}

/// A sphere with constant overlap moves over the edges and vertices of a flat floor, of folds, and of ridges. The force does not jump: over
/// a fold whose second face is there with an overlap at once, only the nearer face acts, so its size stays and its direction turns with
/// the normal; in a deep fold the second contact begins with no overlap. Nor do the forces on the vertices jump, but for the move of the
/// contact point in a fold.
#[test]
fn edges_and_vertices_are_crossed_without_a_jump() {
    let steps = 4000;
    let stride = 0.8 / f64::from(steps);
    let (shallow, deep) = (5.0 * REST, 0.05);
    // Slope, overlap, and whether the second face is there at once.
    let cases = [
        (0.0_f64, shallow, false),
        (0.1, shallow, true),
        (0.3, deep, true),
        (-0.1, shallow, false),
        (-0.5, deep, false),
        (0.5, shallow, false),
    ];
    for (slope, overlap, at_once) in cases {
        let (vertices, triangles) = floor(4, 0.5);
        let vertices = vertices.iter().map(|x| Vec3::new(x.x, x.y, slope * x.x.max(0.0))).collect();
        let shape = WallShape::Mesh(Mesh::new(vertices, triangles).unwrap());
        let (mut state, mut model) = scene(&[Vec3::zeros()], shape, 0.0, 1.0);
        model.gravity = Vec3::zeros();
        let h = RADIUS - overlap;
        let height = |x: f64| {
            let behind = h * slope.hypot(1.0) + slope * x;
            if slope > 0.0 {
                h.max(behind)
            } else if x < 0.0 || x * x > h * h {
                h
            } else if x < -slope / slope.hypot(1.0) * h {
                (h * h - x * x).sqrt()
            } else {
                behind
            }
        };
        let mut solver = Solver::new(model, &mut state).unwrap();
        let mut previous: Option<(Vec3, Vec<Vec3>)> = None;
        let (mut jump, mut size, mut on_vertices) = (0.0_f64, 0.0_f64, 0.0_f64);
        for k in 0..steps {
            // Through the vertex at the origin.
            let x = stride * (f64::from(k) - 0.5 * f64::from(steps));
            let place = Vec3::new(x, 0.3 * x, height(x));
            // With the steps of 1 s of the scene.
            state.particles.velocity[0] = if k == 0 { Vec3::zeros() } else { place - state.particles.position[0] };
            state.particles.position[0] = place;
            solver.find_forces(&mut state, false).unwrap();
            let (force, vertices) = (solver.forces()[0], mesh(&mut state).force.clone());
            if let Some((old, old_vertices)) = previous {
                jump = jump.max((force - old).norm() / old.norm());
                size = size.max((force.norm() - old.norm()).abs() / old.norm());
                let most = vertices.iter().zip(&old_vertices).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
                on_vertices = on_vertices.max(most / old.norm());
            }
            previous = Some((force, vertices));
        }
        println!("slope {slope}: jump {jump:.1e}, of the size {size:.1e}, on a vertex {on_vertices:.1e}");
        // The direction turns by the stride over the radius; the weights change by the stride over the edge of 0.5 m. The dashpot gives
        // `2ξ√(mk)` = 63 N s/m times the speed along the normal, of up to the stride per second at the bisector of a fold.
        let rate = 63.0 * stride / (STIFFNESS * overlap);
        let turn = 1.5 * stride / h;
        // In a deep fold, the second contact grows by a stride times the sine of 0.46 rad.
        let growth = if slope == 0.5 { stride * 0.5 / overlap } else { 0.0 };
        let (fold, moved) =
            if at_once { (slope.atan(), 2.0 * h * (0.5 * slope.atan()).tan() / 0.5) } else { (0.0, 0.0) };
        assert!(size <= rate + growth, "{size:e}");
        assert!(jump <= rate + turn + fold + growth, "{jump:e}");
        assert!(on_vertices <= rate + 2.0 * turn + fold + moved + growth, "{on_vertices:e}");
    }
}

/// The image of a mesh across the border of a periodic cell acts as the mesh does, and has its forces.
#[test]
fn meshes_have_images() {
    let (vertices, triangles) = floor(1, 0.6);
    let forces = |place: Vec3, cell: Option<Cell>| {
        let shape = WallShape::Mesh(Mesh::new(vertices.clone(), triangles.clone()).unwrap());
        let (mut state, model) = scene(&[place], shape, 0.5, 1e-3);
        state.cell = cell;
        let speeds: Vec<Vec3> = vertices.iter().map(|x| Vec3::new(0.1 * x.y, 0.2, 0.1 * x.x)).collect();
        mesh(&mut state).previous_velocity = speeds;
        let mut solver = Solver::new(model, &mut state).unwrap();
        solver.find_forces(&mut state, false).unwrap();
        (solver.forces()[0], mesh(&mut state).force.clone())
    };
    let place = Vec3::new(-0.2, 0.1, RADIUS - 3.0 * REST);
    let alone = forces(place, None);
    let imaged = forces(place + Vec3::new(4.0, 0.0, 0.0), Some(Cell::new_box(Vec3::repeat(4.0))));
    assert!(alone.0.norm() > 1.0);
    // Coordinates of 4 m round by 1e-15 m, times the stiffness.
    assert!((alone.0 - imaged.0).norm() < 1e-8, "{} {}", alone.0, imaged.0);
    assert!(alone.1.iter().zip(&imaged.1).all(|(a, b)| (a - b).norm() < 1e-8));
}

/// A moment goes to the vertices as forces without a sum; a force with its weights.
#[test]
fn a_moment_becomes_a_couple() {
    let corners = vec![Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.2, 0.1, 0.4), Vec3::new(0.3, 0.9, -0.2)];
    let mut mesh = Mesh::new(corners.clone(), vec![[0, 1, 2]]).unwrap();
    let (force, moment) = (Vec3::new(1.0, -2.0, 3.0), Vec3::new(-0.4, 0.5, 0.7));
    let weights = mesh.weights(0, &Vec3::new(0.5, 0.4, 1.0));
    mesh.add_force(0, &weights, &force, Some(&moment));
    let point: Vec3 = corners.iter().zip(&weights).map(|(x, w)| x * *w).sum();
    let total: Vec3 = mesh.force.iter().sum();
    let couple: Vec3 = mesh.force.iter().zip(&corners).map(|(f, x)| (x - point).cross(f)).sum();
    assert!((total - force).norm() < 1e-14 && (couple - moment).norm() < 1e-14, "{total} {couple}");
}

/// Triangles without area, vertices that are missing, not used, or no numbers; motions that lose the area, or are too fast.
#[test]
fn impossible_meshes_are_refused() {
    let corner = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let square = || vec![corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    let faces = || vec![[0, 1, 2], [0, 2, 3]];
    assert_eq!(Mesh::new(square(), vec![]), Err(MeshError::Empty));
    assert_eq!(Mesh::new(square(), vec![[0, 1, 2]]), Err(MeshError::Unused { vertex: 3 }));
    assert_eq!(
        Mesh::new(square(), vec![[0, 1, 2], [0, 2, 4]]),
        Err(MeshError::Index { triangle: 1, vertex: 4, count: 4 })
    );
    assert_eq!(Mesh::new(square(), vec![[0, 1, 2], [0, 3, 3]]), Err(MeshError::Degenerate { triangle: 1 }));
    let mut flat = square();
    flat[2] = corner(1.0 + 1e-12, 0.0);
    assert_eq!(Mesh::new(flat, faces()), Err(MeshError::Degenerate { triangle: 0 }));
    let mut unset = square();
    unset[3].z = f64::NAN;
    assert_eq!(Mesh::new(unset, faces()), Err(MeshError::NotFinite { what: "position", vertex: 3 }));
    let mut mesh = Mesh::new(square(), faces()).unwrap();
    assert_eq!(mesh.drive(&[Vec3::zeros()]), Err(MeshError::Count { what: "velocities", given: 1, count: 4 }));
    let mut folded = square();
    folded[1] = corner(0.5, 0.5);
    assert_eq!(mesh.place(&folded, &square(), 1.0), Err(MeshError::Degenerate { triangle: 0 }));
    assert_eq!(mesh.position, square());

    let (mut state, model) = scene(&[Vec3::z() * 3.0], WallShape::Mesh(mesh), 0.0, 1e-3);
    let mut solver = Solver::new(model, &mut state).unwrap();
    self::mesh(&mut state).drive(&[Vec3::z() * 600.0; 4]).unwrap();
    let Err(SolverError::Mesh { problem, .. }) = solver.step(&mut state) else { panic!("0.6 m in one step") };
    assert!(problem.contains("vertex 0 moves 6.000e-1 m in one step"), "{problem}");
    let mut speeds = [Vec3::zeros(); 4];
    speeds[1] = Vec3::new(-0.5, 0.5, 0.0) / 0.01;
    self::mesh(&mut state).drive(&speeds).unwrap();
    let outcome = (0..20).map(|_| solver.step(&mut state)).find_map(Result::err);
    let Some(SolverError::Mesh { problem, .. }) = outcome else { panic!("the triangle collapses after 10 steps") };
    assert!(problem.contains("triangle 0 has no area"), "{problem}");
}
