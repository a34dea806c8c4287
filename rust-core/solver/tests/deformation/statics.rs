//! Specimens at rest under loads, and single particles between plates.

use std::f64::consts::PI;

use concordem_contact::kinematics::deformable::{Condition, Deformable};
use concordem_contact::law::{ContactStiffness, Elastic, Frictional, HertzMindlin};
use concordem_contact::math::Vec3;
use concordem_solver::forces::EvaluatedContacts;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::surface::Plane;
use concordem_solver::state::{Constraint, PointOfAction, State, Wall, WallShape};
use concordem_solver::{Model, Solver};

use crate::{NORMAL, RADIUS, bonded, deformable, disc_stiffness, discs, model, one_material, spring, square};

const FORCE: f64 = 1e4;

struct Pressed {
    shortening: f64,
    surface_displacement: f64,
    state: State,
}

/// The square specimen at rest under 10 kN on each end disc.
fn pressed(deformable: Option<&Deformable>) -> Pressed {
    let mut state = bonded(discs(&square(), |_| RADIUS), spring(0.7, 0.0), 1.01);
    let corner = |x: usize, y: usize| y * 9 + x;
    for x in 0..9 {
        let down = Vec3::new(0.0, -FORCE, 0.0);
        state.particles.add_load_at(corner(x, 0) as u32, -down, Vec3::zeros(), PointOfAction::Push);
        state.particles.add_load_at(corner(x, 19) as u32, down, Vec3::zeros(), PointOfAction::Push);
    }
    for y in 0..20 {
        let column = &mut state.particles.constraint[corner(4, y)];
        *column = column.with(Constraint::translation_along(0));
    }
    state.clock.dt = 2e-8;
    let model = Model { deformable: deformable.cloned(), ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    // The slowest mode decays as exp(−ζωt), ζ = 0.077, ω = 4e5 1/s: to 1e-9 in 0.7 ms.
    for step in 0..35_000 {
        solver.step_with(&mut state, step % 1000 == 999).unwrap();
    }
    solver.step(&mut state).unwrap();
    let x = |p: usize| state.particles.position[p];
    Pressed {
        shortening: 38e-3 - (x(corner(4, 19)).y - x(corner(4, 0)).y),
        surface_displacement: x(corner(8, 10)).x - x(corner(0, 10)).x - 16e-3,
        state,
    }
}

/// Tables 4.2 and 4.3 of the source: shortening, Poisson's ratio, modulus, energies. Closed forms to 1e-5 (decay to
/// 1e-9, and differences of 3e-6 m between positions of 4e-2 m: 3e-12), printed digits to half a unit. Also the balance
/// of energy with the work of the end loads on the outer halves of the end discs, and the ledger of the whole run.
#[test]
fn square_specimen_meets_the_tables() {
    let poisson = 0.35;
    let rigid = pressed(None);
    assert!((rigid.shortening / 2.7143e-6 - 1.0).abs() < 2e-5, "{:e}", rigid.shortening);
    for (young, digits) in [
        (8e11, [2.9796e-6, 0.048, 63.77, 0.911, 0.1341, 0.0126, 0.1347]),
        (4e11, [3.2450e-6, 0.088, 58.55, 0.836, 0.1460, 0.0251, 0.1472]),
        (2e11, [3.7757e-6, 0.151, 50.32, 0.719, 0.1699, 0.0503, 0.1724]),
    ] {
        let deformable = deformable(young, poisson);
        let Pressed { shortening, surface_displacement, state } = pressed(Some(&deformable));
        let disc = disc_stiffness(young, poisson);
        let stiffness = NORMAL / (1.0 + 2.0 * NORMAL / disc);
        let expected = 19.0 * FORCE / stiffness;
        let ratio = (surface_displacement / 16e-3) / (shortening / 38e-3);
        let expected_ratio =
            4.0 * poisson * (1.0 + poisson) * NORMAL / (4.0 * (1.0 - poisson * poisson) * NORMAL + PI * young);
        // Stress 90 kN over 18 mm, gauge length between the centers of the end rows.
        let modulus = 90e3 / 18e-3 / (shortening / 38e-3);
        let ledger = &state.ledger;
        let work = 0.5 * 90e3 * shortening;
        let (contacts, particles) = (ledger.stored[0], ledger.deformation);
        println!(
            "E_p {young:.1e}: ΔH {shortening:.6e} ({:.1e}), ν {ratio:.5} ({:.1e}), E {:.4} GPa; W {work:.4}, contacts \
             {contacts:.4}, particles {particles:.4}, ledger {:.1e} of {:.1e}",
            shortening / expected - 1.0,
            ratio / expected_ratio - 1.0,
            modulus * 1e-9,
            ledger.residual(),
            ledger.external_work.get(),
        );
        println!("lag {:e}, other {:e}", ledger.deformation_lag.get(), ledger.deformation_other.get());
        assert!((shortening / expected - 1.0).abs() < 1e-5);
        assert!((ratio / expected_ratio - 1.0).abs() < 1e-5);
        assert!((modulus / stiffness - 1.0).abs() < 1e-5);
        assert!((shortening - digits[0]).abs() < 0.5e-10);
        assert!((ratio - digits[1]).abs() < 0.5e-3);
        assert!((modulus * 1e-9 - digits[2]).abs() < 0.5e-2);
        assert!((modulus / (38e-3 * 5e6 / rigid.shortening) - digits[3]).abs() < 0.5e-3);
        assert!((work - digits[4]).abs() < 0.5e-4);
        assert!((contacts - 0.1221).abs() < 0.5e-4);
        assert!((particles - digits[5]).abs() < 0.5e-4);
        // The table prints the sum of the two rounded terms.
        assert!((contacts + particles - digits[6]).abs() < 1e-4);
        // The printed sums differ from the printed work by the outer halves of the end discs.
        let outer = 9.0 * FORCE * FORCE / disc;
        assert!(((contacts + particles) / (work + outer) - 1.0).abs() < 1e-5);
        // 36,000 steps of rounding, in energies of 0.3 J from forces at coordinates near 4e-2 m: the change of length
        // per step, at most 1e-9 m, is known to 7e-18 m.
        assert!(ledger.residual().abs() < 1e-8 * ledger.external_work.get());
        // No shear except from rounding of directions.
        assert!(ledger.deformation_other.get().abs() < 1e-12 * work);
    }
}

/// End loads that act on the body instead of the surface give the reference values for that case (3.7), to their
/// digits.
#[test]
fn end_loads_on_body_and_surface_differ() {
    let mut state = bonded(discs(&square(), |_| RADIUS), spring(0.7, 0.0), 1.01);
    for x in 0..9 {
        state.particles.add_load(x, Vec3::new(0.0, FORCE, 0.0), Vec3::zeros());
        state.particles.add_load(171 + x, Vec3::new(0.0, -FORCE, 0.0), Vec3::zeros());
    }
    state.clock.dt = 2e-8;
    let mut solver = Solver::new(model(&deformable(2e11, 0.35)), &mut state).unwrap();
    for _ in 0..35_000 {
        solver.step_with(&mut state, false).unwrap();
    }
    let shortening = 38e-3 - (state.particles.position[175].y - state.particles.position[4].y);
    assert!((shortening - 3.7478e-6).abs() < 1e-10, "{shortening:e}");
}

/// A disc and a sphere between two plates, under each law of unbonded contacts: the force satisfies
/// `gap = f/k(f) + f/k_p` with lagged strains at rest. 1e-9: the plates stand still and the iteration has decayed to
/// rounding, 1e-16 of the radius over an overlap of 1e-3 of it; `powf` of the test.
#[test]
fn between_plates() {
    let squeeze = 1e-3 * RADIUS;
    let plate = |x: f64, normal: f64| {
        let (point, normal) = (Vec3::new(x, 0.0, 0.0), Vec3::new(normal, 0.0, 0.0));
        Wall::new("plate", WallShape::rigid(Plane { point, normal }), 0, Vec3::zeros())
    };
    let run = |walls: Box<dyn EvaluatedContacts>, deformable: &Deformable| {
        let mut particles = discs(&[(0.0, 0.0)], |_| RADIUS);
        particles.constraint[0] = Constraint(0);
        let mut state = State { particles, wall_contacts: Some(walls), ..State::default() };
        state.walls = vec![plate(-RADIUS + squeeze, 1.0), plate(RADIUS - squeeze, -1.0)];
        state.clock.dt = 1e-9;
        let model = Model { wall_rows: one_material(), ..model(deformable) };
        let mut solver = Solver::new(model, &mut state).unwrap();
        for _ in 0..200 {
            solver.step(&mut state).unwrap();
        }
        -state.walls[0].force.x
    };
    let planar = deformable(2e11, 0.35);
    let stiffness = ContactStiffness::Given { normal: NORMAL, shear: 0.0 };
    let linear = Frictional::new(stiffness, 0.5, 0.0).unwrap();
    let force = run(Box::new(ContactBlock::new(vec![linear])), &planar);
    let expected = squeeze / (1.0 / NORMAL + 1.0 / disc_stiffness(2e11, 0.35));
    assert!((force / expected - 1.0).abs() < 1e-9, "{force} {expected}");

    let elastic = Elastic { young: 2e11, poisson: 0.35 };
    let solid = Deformable { condition: Condition::Solid, ..planar };
    let hertz = HertzMindlin::new(elastic, Elastic::RIGID, 0.5, 1.0).unwrap();
    let force = run(Box::new(ContactBlock::new(vec![hertz])), &solid);
    let coefficient = 4.0 / 3.0 * hertz.effective_young * RADIUS.sqrt();
    let sphere = 2.0 * PI * RADIUS * 2e11 / 3.0;
    let closure = (force / coefficient).powf(2.0 / 3.0) + force / sphere;
    assert!((closure / squeeze - 1.0).abs() < 1e-9, "{closure:e} {squeeze:e}");
    assert!(force / sphere > 0.01 * squeeze, "the sphere hardly deforms");
}

/// Two discs apart by more than the skin, which loads along y widen until they overlap along x: they are found, and push each
/// other with `k_n(gap − W_A − W_B)`, `W = ν(1+ν)2F/πE` (2.48). A difference of lengths of 2 mm against 6 µm: 1e-13, and some more.
#[test]
fn discs_that_widen_meet() {
    let (young, poisson, widening, gap) = (2e11, 0.35, 5e-3 * RADIUS, 4e-3 * RADIUS);
    let load = widening * PI * young / (2.0 * poisson * (1.0 + poisson));
    let mut particles = discs(&[(0.0, 0.0), (2.0 * RADIUS + gap, 0.0)], |_| RADIUS);
    for p in 0..2 {
        for force in [load, -load] {
            particles.add_load_at(p, Vec3::new(0.0, force, 0.0), Vec3::zeros(), PointOfAction::Push);
        }
    }
    let contact = Frictional::new(ContactStiffness::Given { normal: NORMAL, shear: 0.0 }, 0.0, 0.0).unwrap();
    let contacts = Box::new(ContactBlock::new(vec![contact]));
    let mut state = State { particles, contacts: Some(contacts), ..State::default() };
    state.clock.dt = 1e-9;
    let model = Model { contact_rows: one_material(), skin: 1e-3, ..model(&deformable(young, poisson)) };
    let mut solver = Solver::new(model, &mut state).unwrap();
    // The strains of a step are those of the forces of the step before.
    assert_eq!(solver.step(&mut state).unwrap().active, [0; 3]);
    let report = solver.step(&mut state).unwrap();
    let expected = NORMAL * (gap - 2.0 * widening);
    let found = solver.forces()[0].x;
    assert!(report.rebuilt && report.active == [0, 1, 0], "{report:?}");
    assert!((found / expected - 1.0).abs() < 1e-12, "{found} {expected}");
}
