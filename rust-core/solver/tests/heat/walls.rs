//! Heat through contacts with walls.

use concordem_contact::law::Frictional;
use concordem_contact::law::frictional::ContactStiffness;
use concordem_contact::math::Vec3;
use concordem_solver::heat::implicit::to_steady_state;
use concordem_solver::heat::pass::HeatPass;
use concordem_solver::heat::{Exchange, HeatModel, Source, Spread, WallExchange};
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::surface::{Cylinder, Facets, Plane};
use concordem_solver::state::{Cell, Clump, Particles, State, Wall, WallShape};
use concordem_solver::{Model, PairCoefficients, Solver};

use super::{PLAIN, cubes, lattice, model, temperatures};

const FLOOR: f64 = 400.0;

fn plane(normal: Vec3, offset: f64) -> WallShape {
    WallShape::rigid(Plane { point: normal * offset, normal })
}

/// A square of two triangles at z = −0.45 below the origin.
fn facets() -> WallShape {
    let corner = |x: f64, y: f64| Vec3::new(x, y, -0.45);
    let triangles = vec![
        [corner(-5.0, -5.0), corner(5.0, -5.0), corner(5.0, 5.0)],
        [corner(-5.0, -5.0), corner(5.0, 5.0), corner(-5.0, 5.0)],
    ];
    WallShape::rigid(Facets { triangles })
}

/// Particles at 300 K above a wall.
fn standing(particles: Particles, shape: WallShape, exchange: Exchange) -> (State, Model) {
    let stiffness = ContactStiffness::Given { normal: 100.0, shear: 50.0 };
    let contact = Frictional::new(stiffness, 0.0, 0.0).unwrap();
    let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
    heat.supply.walls.push(WallExchange { wall: 0, exchange, planar: false });
    let started = heat.start(vec![300.0; particles.len()]);
    let mut state = State { particles, heat: Some(started), ..State::default() };
    state.walls.push(Wall::new("floor", shape, 0, Vec3::zeros()));
    state.contacts = Some(Box::new(ContactBlock::new(vec![contact])));
    state.wall_contacts = Some(Box::new(ContactBlock::new(vec![contact])));
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    state.clock.dt = 1e-2;
    (state, Model { heat: Some(heat), contact_rows: rows.clone(), wall_rows: rows, ..Model::default() })
}

fn heat_of(model: &Model) -> &HeatModel {
    model.heat.as_ref().unwrap()
}

/// Conductance between the particle and the wall: `4R²λ/R`, or with a coefficient h of the contact `4R²/(1/h + R/λ)`, with R = ½ and λ = 2.
const EXCHANGES: [(Exchange, f64); 2] = [
    (Exchange::Temperature(FLOOR), 4.0),
    (Exchange::Convection { coefficient: 3.0, ambient: FLOOR }, 1.0 / (1.0 / 3.0 + 0.25)),
];

/// One sphere on a wall: explicit steps give `T_w − (T_w − T₀)(1 − GΔt/C)^n`, implicit ones `(1 + GΔt/C)^−n`, to rounding; on a plane, in
/// the corner of two triangles, and in a vessel. All heat comes through the wall.
#[test]
fn a_sphere_on_a_wall_warms() {
    let vessel =
        WallShape::rigid(Cylinder { point: Vec3::new(0.0, 1.0, 0.0), axis: Vec3::x(), radius: 1.45, inside: true });
    for shape in [plane(Vec3::z(), -0.45), facets(), vessel] {
        for (exchange, conductance) in EXCHANGES {
            for implicit in [false, true] {
                let (mut state, mut model) = standing(cubes([1, 1, 1]), shape.clone(), exchange);
                model.heat.as_mut().unwrap().implicit = implicit;
                let ratio = conductance * 1e-2 / heat_of(&model).capacity[0];
                let mut solver = Solver::new(model.clone(), &mut state).unwrap();
                for _ in 0..100 {
                    solver.step(&mut state).unwrap();
                }
                let left = if implicit { (1.0 + ratio).powi(-100) } else { (1.0 - ratio).powi(100) };
                let expected = FLOOR - 100.0 * left;
                // Implicit steps are solved to 1e-12.
                assert!((temperatures(&state)[0] - expected).abs() < 1e-9, "{} {expected}", temperatures(&state)[0]);
                let found = state.heat.as_ref().unwrap();
                assert!(heat_of(&model).residual(found).abs() < 1e-10, "{:e}", heat_of(&model).residual(found));
                assert!(found.ledger.boundary.get() > 1.0);
            }
        }
    }
}

/// A column of four spheres, heated at its top with Q: in the steady state sphere k is at `T_w + Q (1/G + k/(λ·2R))`. Backward Euler
/// steps of 1e6 s end there, and so does the solution of the steady state.
#[test]
fn a_column_conducts_into_the_wall() {
    for (exchange, conductance) in EXCHANGES {
        let (mut state, mut model) = standing(cubes([1, 1, 4]), plane(Vec3::z(), -0.45), exchange);
        let heat = model.heat.as_mut().unwrap();
        heat.implicit = true;
        heat.supply.sources.push(Source { power: 10.0, spread: Spread::Shares(vec![(3, 1.0)]) });
        state.clock.dt = 1e6;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let mut steady = state.heat.clone().unwrap();
        let mut pass = HeatPass::new(heat_of(&model), &state);
        to_steady_state(heat_of(&model), &state.particles, &mut pass, &mut steady).unwrap();
        for _ in 0..10 {
            solver.step(&mut state).unwrap();
        }
        for k in 0..4 {
            let expected = FLOOR + 10.0 * (1.0 / conductance + k as f64 / 2.0);
            assert!((temperatures(&state)[k] - expected).abs() < 1e-7, "{k} {} {expected}", temperatures(&state)[k]);
            assert!((steady.temperature[k] - expected).abs() < 1e-7, "{k} {} {expected}", steady.temperature[k]);
        }
    }
}

/// The explicit bound is that of a particle that touches, also before it does.
#[test]
fn the_bound_includes_walls() {
    for offset in [-0.45, -20.0] {
        let (mut state, model) = standing(cubes([1, 1, 1]), plane(Vec3::z(), offset), EXCHANGES[0].0);
        let solver = Solver::new(model.clone(), &mut state).unwrap();
        let found = super::stable_step(&solver, &state);
        assert!((found / (heat_of(&model).capacity[0] / 4.0) - 1.0).abs() < 1e-12, "{found}");
    }
}

/// A sphere falls on a hot wall and bounces: it warms only while it touches, so that its temperature steps up once per impact. The same
/// bits after a restart during the first impact.
#[test]
fn a_sphere_warms_while_it_touches() {
    let bits = |restart: bool| {
        let (mut state, mut model) = standing(cubes([1, 1, 1]), plane(Vec3::z(), -0.8), EXCHANGES[0].0);
        model.heat.as_mut().unwrap().mechanics = true;
        model.gravity = Vec3::new(0.0, 0.0, -10.0);
        state.clock.dt = 1e-3;
        let mut solver = Solver::new(model.clone(), &mut state).unwrap();
        let mut warmed = 0;
        for step in 0..1000 {
            if restart && step == 270 {
                let mut columns = ColumnStore::default();
                state.write(&mut columns).unwrap();
                let mut other = standing(cubes([1, 1, 1]), plane(Vec3::z(), -0.8), EXCHANGES[0].0).0;
                other.read(&mut columns).unwrap();
                state = other;
                solver = Solver::new(model.clone(), &mut state).unwrap();
            }
            let (touches, before) = (state.particles.position[0].z < -0.3, temperatures(&state)[0]);
            solver.step(&mut state).unwrap();
            assert_eq!(temperatures(&state)[0] > before, touches, "{step}");
            warmed += u32::from(touches);
        }
        (temperatures(&state)[0], warmed, state.particles.position[0])
    };
    let whole = bits(false);
    assert!(whole.1 > 100 && whole.1 < 900, "{}", whole.1);
    assert!(whole == bits(true));
}

/// Discs have the area `2R` in place of `4R²`; spheres in a periodic cell, and the members of a clump, whose link carries nothing at equal
/// temperatures, warm like single spheres. Explicit steps, to rounding.
#[test]
fn discs_clumps_and_periodic_spheres_warm_on_a_wall() {
    let radius = 0.4;
    for (planar, periodic, clump) in [(true, false, false), (false, true, false), (false, false, true)] {
        let mut particles = cubes([2, 1, 1]);
        for (p, x) in [0.0, if clump { 0.5 } else { 1.0 }].into_iter().enumerate() {
            (particles.radius[p], particles.position[p].x) = (radius, x);
        }
        let (mut state, mut model) = standing(particles, plane(Vec3::z(), -0.35), EXCHANGES[0].0);
        if clump {
            state.particles.clump = vec![0; 2];
            state.clumps.push(Clump::new(vec![0, 1], &state.particles, None, None));
        }
        if periodic {
            state.cell = Some(Cell::new_box(Vec3::repeat(3.0)));
        }
        let heat = model.heat.as_mut().unwrap();
        heat.supply.walls[0].planar = planar;
        heat.network = lattice(&state.particles);
        let area = if planar { 2.0 * radius } else { 4.0 * radius * radius };
        let ratio = area * 2.0 / radius * 1e-2 / heat.capacity[0];
        let mut solver = Solver::new(model, &mut state).unwrap();
        for _ in 0..100 {
            solver.step(&mut state).unwrap();
        }
        let expected = FLOOR - 100.0 * (1.0 - ratio).powi(100);
        for found in temperatures(&state) {
            assert!((found - expected).abs() < 1e-9, "{planar} {periodic} {clump} {found} {expected}");
        }
    }
}
