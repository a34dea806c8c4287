//! Small systems whose first steps are known in closed form: damping, prescribed motion, cells, walls, bonds, tiles.

use std::f64::consts::PI;

use concordem_contact::kinematics::PreviousGeometry;
use concordem_contact::kinematics::deformable::{Condition, Deformable, Update};
use concordem_contact::law::{
    CohesiveBeam, ContactStiffness, Elastic, Frictional, HertzMindlin, LinearBond, Reference, Section,
};
use concordem_contact::math::{Mat3, Symmetric, Vec3};
use concordem_packing::bonding::bond;
use concordem_packing::lattice::Lattice;
use concordem_solver::collision::outgrown;
use concordem_solver::forces::LawLoops;
use concordem_solver::fracture::virial::mean_stress;
use concordem_solver::integrate::{Damping, KickSums};
use concordem_solver::state::columns::ColumnStore;
use concordem_solver::state::contacts::{ContactBlock, ContactFlags, Pair};
use concordem_solver::state::surface::{Facets, Plane};
use concordem_solver::state::{Cell, Clump, Constraint, Deformation, Particles, Sphere, State, Wall, WallShape};
use concordem_solver::{Excluded, Model, PairCoefficients, Solver, SolverError, StepReport, time_step};

/// Spheres of radius ½, mass 2, and moment of inertia 0.2.
fn spheres(places: &[[f64; 3]]) -> Particles {
    let mut particles = Particles::default();
    for place in places {
        particles.push(Sphere { position: Vec3::from(*place), radius: 0.5 }, 0, 2.0, 0.2);
    }
    particles
}

fn rows() -> PairCoefficients {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    rows
}

fn bonded<L: LawLoops>(particles: Particles, cell: Option<&Cell>, law: L) -> State {
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &rows(), &particles, cell, 1.2).unwrap();
    State { particles, cell: cell.copied(), bonds: vec![Box::new(bonds)], ..State::default() }
}

fn spring(shear: f64) -> LinearBond {
    LinearBond::new(100.0, shear, 0.0, f64::INFINITY, f64::INFINITY).unwrap()
}

fn contact(damping_ratio: f64) -> Frictional {
    Frictional::new(ContactStiffness::Given { normal: 100.0, shear: 0.0 }, 0.0, damping_ratio).unwrap()
}

fn wall(shape: WallShape) -> Wall {
    Wall::new("wall", shape, 0, Vec3::zeros())
}

/// Walls under the contact law, and a model for them.
fn with_walls(particles: Particles, walls: Vec<Wall>, damping_ratio: f64) -> (State, Model) {
    let wall_contacts: Option<Box<dyn concordem_solver::forces::EvaluatedContacts>> =
        Some(Box::new(ContactBlock::new(vec![contact(damping_ratio)])));
    let mut state = State { particles, walls, wall_contacts, ..State::default() };
    state.clock.dt = 1e-3;
    (state, Model { wall_rows: rows(), ..Model::default() })
}

/// Local damping opposes a force along the motion half a step on: a particle that moves against the force and turns round in the
/// step is slowed down. In a cell only the motion relative to it counts. Some roundings of numbers of order 1.
#[test]
fn local_damping_looks_half_a_step_ahead() {
    let model = |gravity: f64| Model {
        gravity: Vec3::x() * gravity,
        damping: Damping::Local { translation: 0.5, rotation: 0.0 },
        ..Model::default()
    };
    let mut state = State { particles: spheres(&[[0.0; 3]]), ..State::default() };
    state.clock.dt = 0.1;
    state.particles.velocity[0].x = -0.04;
    Solver::new(model(1.0), &mut state).unwrap().step(&mut state).unwrap();
    assert!((state.particles.velocity[0].x - 0.01).abs() < 1e-15, "{}", state.particles.velocity[0]);

    let mut cell = Cell::new_box(Vec3::repeat(4.0));
    cell.velocity_gradient[(0, 0)] = -1.0;
    let mut state = State { particles: spheres(&[[0.5, 0.0, 0.0]]), cell: Some(cell), ..State::default() };
    state.clock.dt = 0.1;
    state.particles.velocity[0].x = -0.5;
    Solver::new(model(1.0), &mut state).unwrap().step(&mut state).unwrap();
    assert!((state.particles.velocity[0].x + 0.45).abs() < 1e-15, "{}", state.particles.velocity[0]);
    let strongest = Damping::Local { translation: 0.2, rotation: 0.75 };
    assert_eq!(strongest.stiffening(), 1.75);
}

/// A prescribed velocity is one in space: it stays while the cell begins to move. Where it changes, the support does the work of the
/// change, `½mv²`, and the ledger closes.
#[test]
fn prescribed_velocities_do_work() {
    let mut state =
        State { particles: spheres(&[[1.0; 3]]), cell: Some(Cell::new_box(Vec3::repeat(4.0))), ..State::default() };
    state.clock.dt = 0.01;
    state.particles.constraint[0] = Constraint::translation_along(0);
    state.particles.velocity[0].x = 0.25;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    solver.set_velocity_gradient(&state.cell.unwrap(), Mat3::repeat(0.125));
    solver.step(&mut state).unwrap();
    assert_eq!(state.particles.velocity[0], Vec3::new(0.25, 0.375, 0.375));

    let mut state = State { particles: spheres(&[[1.0; 3]]), ..State::default() };
    state.clock.dt = 0.01;
    state.particles.constraint[0] = Constraint::ALL;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    solver.step(&mut state).unwrap();
    solver.targets_mut(&state.particles)[0] = (Vec3::new(0.5, 0.0, 0.0), Vec3::new(0.0, 2.0, 0.0));
    for _ in 0..3 {
        solver.step(&mut state).unwrap();
    }
    assert_eq!((state.particles.velocity[0].x, state.particles.angular_velocity[0].y), (0.5, 2.0));
    let work = 0.5 * 2.0 * 0.25 + 0.5 * 0.2 * 4.0;
    assert!((state.ledger.boundary_work.get() - work).abs() < 1e-15, "{:?}", state.ledger);
    assert!(state.ledger.residual().abs() < 1e-15);
}

/// The edges of a cell are its deformation gradient times those at the start, however far it deforms. Rounding of 200 products.
#[test]
fn edges_follow_the_deformation_gradient() {
    let edges = Mat3::new(2.0, 0.3, 0.0, 0.0, 2.0, 0.1, 0.0, 0.0, 3.0);
    let mut cell = Cell::new(edges);
    cell.velocity_gradient = Mat3::new(0.3, 0.5, 0.0, -0.2, 0.1, 0.4, 0.0, 0.0, -0.3);
    let mut state = State { particles: spheres(&[[0.0; 3]]), cell: Some(cell), ..State::default() };
    state.clock.dt = 0.01;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    for _ in 0..100 {
        solver.step(&mut state).unwrap();
    }
    let cell = state.cell.unwrap();
    assert!((cell.matrix - cell.deformation_gradient * edges).norm() < 1e-13, "{}", cell.matrix);
    assert!((cell.deformation_gradient - Mat3::identity()).norm() > 0.5);
}

/// The virial has the position first: a bond along x that is sheared along y has `l_x f_y` in row x. Exact but for roundings.
#[test]
fn the_virial_has_the_position_first() {
    let mut state =
        bonded(spheres(&[[0.0; 3], [1.0, 0.0, 0.0]]), Some(&Cell::new_box(Vec3::repeat(8.0))), spring(50.0));
    state.clock.dt = 1e-3;
    state.particles.velocity[1].y = 1.0;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    solver.step(&mut state).unwrap();
    let report = solver.step(&mut state).unwrap();
    // B has moved by 1 mm: the force on A is 50 N/m of that along y.
    assert!((report.virial[(0, 1)] - 50.0 * 1e-3).abs() < 1e-6, "{}", report.virial);
    assert!(report.virial[(1, 0)].abs() < 1e-3 * report.virial[(0, 1)], "{}", report.virial);
}

/// A cell that is sheared does the work that its bonds store: the ledger closes to the geometric error of the rule, 1e-6 of it here.
#[test]
fn a_sheared_cell_does_the_work_of_its_bonds() {
    let packing = Lattice::FaceCentered.periodic(0.5, [2; 3]).unwrap();
    let mut particles = Particles::default();
    packing.spheres.iter().for_each(|sphere| particles.push(*sphere, 0, 2.0, 0.2));
    let mut state = bonded(particles, packing.cell.as_ref(), spring(40.0));
    state.clock.dt = 0.1 * time_step::bounds(&state).spectral;
    let mut solver = Solver::new(Model::default(), &mut state).unwrap();
    let gradient = Mat3::new(0.0, 0.0, 1e-2, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0) / state.clock.dt * 1e-2;
    solver.set_velocity_gradient(&state.cell.unwrap(), gradient);
    for _ in 0..50 {
        solver.step(&mut state).unwrap();
    }
    let (work, residual) = (state.ledger.boundary_work.get(), state.ledger.residual());
    assert!(work > 0.0 && residual.abs() < 1e-4 * work, "{work} {residual}");
}

/// Forces and torques do not depend on the cut into tiles: 2,000 particles that move at random, in tiles of 1024 and in one. Rounding
/// of sums of twelve forces.
#[test]
fn tiles_do_not_matter() {
    let packing = Lattice::SimpleCubic.periodic(0.5, [20, 10, 10]).unwrap();
    let mut particles = Particles::default();
    packing.spheres.iter().for_each(|sphere| particles.push(*sphere, 0, 2.0, 0.2));
    for p in 0..particles.len() {
        let u = |k: usize| ((p * 7919 + k * 104_729) % 1009) as f64 / 504.0 - 1.0;
        particles.velocity[p] = Vec3::new(u(1), u(2), u(3));
        particles.angular_velocity[p] = Vec3::new(u(4), u(5), u(6));
    }
    let beam = CohesiveBeam::new(1e3, 0.3, Section::Radius(0.3)).unwrap();
    let run = |whole: bool| {
        let mut state = bonded(particles.clone(), None, beam);
        state.clock.dt = 1e-3;
        Solver::new(Model::default(), &mut state).unwrap().step(&mut state).unwrap();
        let mut solver = if whole {
            let owned = vec![true; state.particles.len()];
            Solver::for_subdomain(Model::default(), &mut state, owned, Excluded::default()).unwrap()
        } else {
            Solver::new(Model::default(), &mut state).unwrap()
        };
        solver.find_forces(&mut state, false).unwrap();
        (solver.forces().to_vec(), solver.torques().to_vec())
    };
    let ((forces, torques), (all_forces, all_torques)) = (run(false), run(true));
    let largest = |list: &[Vec3]| list.iter().map(Vec3::amax).fold(0.0, f64::max);
    for (found, expected) in [(&forces, &all_forces), (&torques, &all_torques)] {
        let worst = found.iter().zip(expected).map(|(a, b)| (a - b).amax()).fold(0.0, f64::max);
        assert!(largest(expected) > 0.0 && worst < 1e-13 * largest(expected), "{worst:e}");
    }
}

/// The step of a sphere at a wall has the frequency `√(k/m)`; a body with small moments of inertia that of the moments.
#[test]
fn walls_and_light_bodies_bound_the_step() {
    let plane = wall(WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() }));
    let (mut state, model) = with_walls(spheres(&[[0.0, 0.0, 0.5]]), vec![plane], 0.0);
    Solver::new(model, &mut state).unwrap();
    let bounds = time_step::bounds(&state);
    let exact = (100.0_f64 / 2.0).sqrt();
    assert!((bounds.frequency / exact - 1.0).abs() < 1e-9, "{bounds:?}");
    assert!((bounds.per_particle * exact / 2.0 - 1.0).abs() < 1e-9, "{bounds:?}");

    let particles = spheres(&[[0.0; 3], [0.5, 0.0, 0.0]]);
    let whole = Clump::new(vec![0, 1], &particles, None, None);
    let light = Clump::new(vec![0, 1], &particles, None, Some(whole.inertia * 0.25));
    assert!((whole.mass_fraction(&particles) - 1.0).abs() < 1e-14);
    assert!((light.mass_fraction(&particles) - 0.25).abs() < 1e-14);
}

/// A ridge of two triangles touches a sphere above it once, not once per triangle.
#[test]
fn a_ridge_acts_once() {
    let [low, high] = [Vec3::new(0.0, -1.0, 0.0), Vec3::new(0.0, 1.0, 0.0)];
    let triangles = vec![[low, high, Vec3::new(-1.0, 0.0, -1.0)], [high, low, Vec3::new(1.0, 0.0, -1.0)]];
    let (mut state, model) =
        with_walls(spheres(&[[0.0, 0.1, 0.45]]), vec![wall(WallShape::rigid(Facets { triangles }))], 0.0);
    let mut solver = Solver::new(model, &mut state).unwrap();
    let report = solver.step(&mut state).unwrap();
    assert_eq!(report.active[2], 1);
    assert!((solver.forces()[0] - Vec3::z() * 5.0).norm() < 1e-12, "{}", solver.forces()[0]);
}

/// Only particles near a large triangle are candidates, not all those within the ball around it.
#[test]
fn candidates_of_a_large_triangle_are_near_it() {
    let places: Vec<[f64; 3]> =
        (0..1000).map(|k| [k % 10, k / 10 % 10, k / 100].map(|n| 1.1 * f64::from(n) + 0.6)).collect();
    let triangle = [Vec3::zeros(), Vec3::x() * 12.0, Vec3::y() * 12.0];
    let (mut state, model) =
        with_walls(spheres(&places), vec![wall(WallShape::rigid(Facets { triangles: vec![triangle] }))], 0.0);
    let skin = model.skin * 0.5;
    Solver::new(model, &mut state).unwrap().step(&mut state).unwrap();
    // Of the lowest layer, those above the triangle or beside its long edge.
    let near =
        |p: &&[f64; 3]| p[2] < 1.0 && (p[0] + p[1] - 12.0).max(0.0).powi(2) / 2.0 + p[2] * p[2] < (0.5 + skin).powi(2);
    let expected = places.iter().filter(near).count();
    assert!(expected < 70, "{expected}");
    assert_eq!(state.wall_contacts.unwrap().contacts().len(), expected);
}

/// A sphere that leaves a floor and passes from one of its triangles to the next in the same step does the work that it does on a plane:
/// the distance is that from the floor, not from the edge of the triangle behind it. Some roundings of numbers of order 1.
#[test]
fn contacts_open_above_the_next_triangle() {
    let corner = |x: f64, y: f64| Vec3::new(x, y, 0.0);
    let [a, b, c, d] = [corner(-4.0, -4.0), corner(4.0, -4.0), corner(4.0, 4.0), corner(-4.0, 4.0)];
    let plane = WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() });
    let floor = WallShape::rigid(Facets { triangles: vec![[a, b, c], [a, c, d]] });
    let [on_plane, on_floor] = [plane, floor].map(|shape| {
        let (mut state, model) = with_walls(spheres(&[[0.1, 0.0, 0.499]]), vec![wall(shape)], 0.0);
        state.particles.velocity[0] = Vec3::new(-100.0, 100.0, 3.0);
        let mut solver = Solver::new(model, &mut state).unwrap();
        for _ in 0..3 {
            solver.step(&mut state).unwrap();
        }
        assert_eq!(solver.forces()[0], Vec3::zeros());
        state.ledger.integration.get()
    });
    // The sphere starts with an overlap of 1 mm at 100 N/m.
    assert!(on_plane.abs() > 1e-6 && (on_floor - on_plane).abs() < 1e-14, "{on_plane} {on_floor}");
}

/// A contact has its dashpot from its first step: with a wall, and with a particle that only the motion of the cell brings near.
#[test]
fn contacts_begin_with_a_rate() {
    // c = 2ξ√(mk), with the reduced mass between particles.
    let viscosity = |mass: f64| 2.0 * 0.1 * (mass * 100.0_f64).sqrt();
    let plane = wall(WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() }));
    let (mut state, model) = with_walls(spheres(&[[0.0, 0.0, 0.4995]]), vec![plane], 0.1);
    state.particles.velocity[0].z = -1.0;
    let mut solver = Solver::new(model, &mut state).unwrap();
    solver.step(&mut state).unwrap();
    let expected = 100.0 * 0.0005 + viscosity(2.0);
    assert!((solver.forces()[0].z / expected - 1.0).abs() < 1e-9, "{}", solver.forces()[0]);

    let mut cell = Cell::new_box(Vec3::new(4.0, 8.0, 8.0));
    cell.velocity_gradient[(0, 0)] = -0.25;
    let contacts: Option<Box<dyn concordem_solver::forces::EvaluatedContacts>> =
        Some(Box::new(ContactBlock::new(vec![contact(0.1)])));
    let mut state = State {
        particles: spheres(&[[0.2, 0.0, 0.0], [3.2005, 0.0, 0.0]]),
        cell: Some(cell),
        contacts,
        ..State::default()
    };
    state.clock.dt = 1e-3;
    let mut solver = Solver::new(Model { contact_rows: rows(), ..Model::default() }, &mut state).unwrap();
    solver.step(&mut state).unwrap();
    // The image of B approaches at 0.25/s of the edge of 4 m; the overlap is 0.5 mm.
    let expected = 100.0 * 0.0005 + viscosity(1.0) * 1.0;
    assert!((solver.forces()[0].x / expected - 1.0).abs() < 1e-6, "{} {expected}", solver.forces()[0]);
}

/// A bond of overlapping spheres is all there is between them, whatever law contacts have.
#[test]
fn bonded_spheres_have_no_other_contact() {
    let mut state = bonded(spheres(&[[0.0; 3], [0.9, 0.0, 0.0]]), None, spring(50.0));
    state.contacts = Some(Box::new(ContactBlock::new(vec![contact(0.0)])));
    state.clock.dt = 1e-3;
    let mut solver = Solver::new(Model { contact_rows: rows(), ..Model::default() }, &mut state).unwrap();
    let report = solver.step(&mut state).unwrap();
    assert_eq!((report.active, solver.forces()[0]), ([1, 0, 0], Vec3::zeros()));
}

/// The mean stress of a particle is `½lf` over its volume times the number of dimensions: two for discs, three for spheres.
#[test]
fn mean_stress_in_plane_and_space() {
    let beam = CohesiveBeam::new(1e3, 0.3, Section::Radius(0.25)).unwrap();
    let mut state = bonded(spheres(&[[0.0; 3], [1.0, 0.0, 0.0]]), None, beam);
    state.particles.position[1].x = 1.01;
    state.clock.dt = 1e-6;
    Solver::new(Model::default(), &mut state).unwrap().step(&mut state).unwrap();
    let half = 0.5 * 1.01 * (1e3 * PI * 0.0625 * 0.01);
    let disc = mean_stress(&state, true).unwrap()[0];
    let sphere = mean_stress(&state, false).unwrap()[0];
    assert!((disc / (half / (2.0 * PI * 0.25)) - 1.0).abs() < 1e-12, "{disc}");
    assert!((sphere / (half / (3.0 * 4.0 / 3.0 * PI * 0.125)) - 1.0).abs() < 1e-12, "{sphere}");
}

/// Out of balance: root mean square net force per body over that per contact, and the same for moments, whichever is larger.
#[test]
fn out_of_balance_in_force_and_moment() {
    let kick = KickSums {
        net_force_squared: 4.0 * 9.0,
        free_particles: 4,
        net_torque_squared: 2.0 * 16.0,
        free_rotations: 2,
        ..KickSums::default()
    };
    let report = StepReport { kick, active: [10, 0, 6], force_squared: 16.0 * 36.0, ..StepReport::default() };
    // 3/6, or 4/(r·6).
    assert_eq!((report.unbalanced(2.0), report.unbalanced(1.0)), (0.5, 4.0 / 6.0));
}

/// Deformable spheres of the material and radius used here.
fn soft(update: Update) -> Deformable {
    let elasticity = vec![Elastic { young: 1e3, poisson: 0.4 }];
    Deformable { elasticity, condition: Condition::Solid, update, dashpots: false }
}

/// A virial (N) after which the surface of these spheres has moved outwards by `along` (m) on the axis `axis`, because they are pressed
/// or pulled across it.
fn virial_across(axis: usize, along: f64) -> Symmetric {
    let mut virial = Symmetric([1.0, 1.0, 1.0, 0.0, 0.0, 0.0]);
    virial.0[axis] = 0.0;
    let moved = soft(Update::Lagged).compliance(0, 0.5).surface_displacement(&virial);
    virial * (along / moved.0[axis])
}

/// A sphere that is pressed sideways widens, and touches a wall that its radius does not reach: the force is that of the widening less
/// the gap. Some roundings of numbers of order 1.
#[test]
fn walls_touch_deformed_particles() {
    let plane = wall(WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() }));
    for (widening, force) in [(0.01, 100.0 * 0.004), (0.005, 0.0)] {
        let (mut state, model) = with_walls(spheres(&[[0.0, 0.0, 0.506]]), vec![plane.clone()], 0.0);
        let virial = virial_across(2, widening);
        state.particles.deformation = vec![Deformation { virial, used: virial, ..Deformation::default() }];
        let mut solver = Solver::new(Model { deformable: Some(soft(Update::Lagged)), ..model }, &mut state).unwrap();
        solver.step(&mut state).unwrap();
        assert!((solver.forces()[0] - Vec3::z() * force).norm() < 1e-12, "{}", solver.forces()[0]);
    }
}

/// The support of a held sphere bears the force of its bond and the load on the sphere, and strains it by both.
#[test]
fn supports_bear_loads_of_deformable_particles() {
    let mut state = bonded(spheres(&[[0.0; 3], [1.0, 0.0, 0.0]]), None, spring(0.0));
    state.particles.position[1].x = 1.01;
    state.particles.constraint[0] = Constraint::TRANSLATION;
    state.particles.add_load(0, Vec3::x() * 0.5, Vec3::zeros());
    state.clock.dt = 1e-6;
    let model = Model { deformable: Some(soft(Update::Lagged)), ..Model::default() };
    Solver::new(model, &mut state).unwrap().step(&mut state).unwrap();
    // 100 N/m · 0.01 m + 0.5 N, opposite to the bond.
    let reaction = state.particles.deformation[0].reaction;
    assert!((reaction.0[0] - 1.5).abs() < 1e-12 && reaction.0[1..] == [0.0; 5], "{reaction:?}");
}

/// A bond that breaks in one iteration of the strains stays broken, also if it would hold at the strains of the next one: here a sphere
/// was pulled sideways in the last step and is narrower by 1 mm in the first iteration only. Strength 1 N, at 0.95 N and 0.1 N.
#[test]
fn bonds_that_break_in_an_iteration_stay_broken() {
    let law = LinearBond::new(100.0, 0.0, 0.0, 1.0, 1.0).unwrap();
    let iterated = Update::Iterated { tolerance: 1e-9, maximum: 100, relaxation: 0.8 };
    for (narrowing, broken) in [(1e-3, true), (0.4e-3, false)] {
        let mut state = bonded(spheres(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 9.0, 0.0], [1.0, 9.0, 0.0]]), None, law);
        state.particles.position[1].x = 1.0095;
        // Another pair bears a force throughout, to which the change of an iteration is relative.
        state.particles.position[3].x = 1.005;
        let virial = virial_across(0, -narrowing);
        state.particles.deformation = vec![Deformation { virial, used: virial, ..Deformation::default() }];
        state.particles.deformation.resize(4, Deformation::default());
        state.clock.dt = 1e-6;
        let model = Model { deformable: Some(soft(iterated)), ..Model::default() };
        let mut solver = Solver::new(model, &mut state).unwrap();
        let before = ColumnStore::of(&state).unwrap();
        let recorded = solver.record(&mut state).unwrap().contacts;
        let after = ColumnStore::of(&state).unwrap();
        assert!(before == after, "a record changes the state");
        let report = solver.step(&mut state).unwrap();
        // A record has the forces of the last iteration, bit for bit: each particle has one bond at most.
        let mut sums = vec![Vec3::zeros(); 4];
        for (pair, force) in recorded.pair.iter().zip(&recorded.force) {
            sums[pair[0] as usize] += force;
            sums[pair[1] as usize] -= force;
        }
        assert_eq!(sums, solver.forces());
        assert_eq!(report.bond_events.len(), usize::from(broken));
        assert_eq!(state.bond_count(), 2 - usize::from(broken));
        assert_eq!(solver.forces()[0].x == 0.0, broken, "{}", solver.forces()[0]);
    }
}

/// The overlap that Hertzian spheres will reach has the energy of the present one and that of the approach: `½m*v² = (8/15)E*√R* δ^(5/2)`
/// for the latter.
#[test]
fn contacts_are_judged_by_the_overlap_to_come() {
    let glass = Elastic { young: 1e4, poisson: 0.3 };
    let law = HertzMindlin::new(glass, glass, 0.0, 1.0).unwrap();
    let mut contacts = ContactBlock::new(vec![law]);
    let touching = ContactFlags { bits: ContactFlags::ACTIVE, ..ContactFlags::default() };
    contacts.push(Pair { a: 0, b: 1 }, touching, Reference::default(), PreviousGeometry::default());
    let mut state = State {
        particles: spheres(&[[0.0; 3], [0.95, 0.0, 0.0]]),
        contacts: Some(Box::new(contacts)),
        ..State::default()
    };
    state.clock.dt = 1.0;
    for speed in [0.0, 2.0] {
        state.particles.velocity[1].x = -speed;
        let found = outgrown(&state, &Model { contact_rows: rows(), ..Model::default() }).unwrap();
        let of_speed = 15.0 * speed * speed / (16.0 * (1e4 / (2.0 * 0.91)) * 0.5);
        let expected = (0.05_f64.powf(2.5) + of_speed).powf(0.4);
        assert!((found.overlap / expected - 1.0).abs() < 1e-12, "{found:?} {expected}");
    }
}

/// Hertzian spheres that meet too fast for the step end the run in the step in which they meet, whenever the neighbor list was made: it
/// is made anew after a restart. They are 0.22 m apart and approach by 0.1 m per step.
#[test]
fn fast_contacts_end_the_run_when_they_begin() {
    let glass = Elastic { young: 1e4, poisson: 0.3 };
    let law = HertzMindlin::new(glass, glass, 0.0, 1.0).unwrap();
    let model = Model { contact_rows: rows(), watch_contacts: true, skin: 0.5, ..Model::default() };
    for restarted in [None, Some(1), Some(2)] {
        let mut state = State {
            particles: spheres(&[[0.0; 3], [1.22, 0.0, 0.0]]),
            contacts: Some(Box::new(ContactBlock::new(vec![law]))),
            ..State::default()
        };
        state.particles.velocity[1].x = -1.0;
        state.clock.dt = 0.1;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let error = loop {
            if restarted == Some(state.clock.step) {
                solver = Solver::new(model.clone(), &mut state).unwrap();
            }
            if let Err(error) = solver.step(&mut state) {
                break error;
            }
            assert!(state.clock.step < 10, "the run must end");
        };
        assert!(matches!(error, SolverError::ContactOutgrown { step: 3, .. }), "{restarted:?}: {error}");
    }
}

/// A sphere and a wall that approach each other with equal speeds may each use half of the skin: their contact, which no list had
/// before, begins when they touch. The skin is 0.1 m.
#[test]
fn wall_and_particle_share_the_skin() {
    let plane = wall(WallShape::rigid(Plane { point: Vec3::zeros(), normal: Vec3::z() }));
    let (mut state, model) = with_walls(spheres(&[[0.0, 0.0, 0.62]]), vec![plane], 0.0);
    state.particles.constraint[0] = Constraint::ALL;
    state.particles.velocity[0].z = -1.0;
    state.walls[0].velocity.z = 1.0;
    let mut solver = Solver::new(model, &mut state).unwrap();
    for _ in 0..80 {
        solver.step(&mut state).unwrap();
    }
    // Forces belong to the positions before the step.
    let overlap = 0.5 - (0.62 - 2.0 * 0.079);
    assert!((solver.forces()[0].z / (100.0 * overlap) - 1.0).abs() < 1e-9, "{}", solver.forces()[0]);
}
