//! Stiffness and strength that depend on the temperature.

use concordem_contact::law::frictional::ContactStiffness;
use concordem_contact::law::{CohesiveBeam, Cpm, CpmParameters, Frictional, LinearBond, Section};
use concordem_contact::math::Vec3;
use concordem_solver::forces::LawLoops;
use concordem_solver::heat::supply::Factors;
use concordem_solver::heat::{Curve, Curves, HeatModel, Held, MaterialCurves};
use concordem_solver::integrate::Damping;
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, State};
use concordem_solver::{Model, PairCoefficients, Solver, time_step};

use super::expansion::{bonded, solver};
use super::{PLAIN, cubes, lattice, model};

/// Area of a bond of the concrete law, and of the beams here, between spheres of radius ½, m².
const AREA: f64 = std::f64::consts::PI * 0.25;

fn springs(damping_ratio: f64, strength: f64) -> LinearBond {
    LinearBond::new(100.0, 50.0, damping_ratio, strength, strength).unwrap()
}

fn beams(strength: f64) -> CohesiveBeam {
    CohesiveBeam { strength, ..CohesiveBeam::new(100.0, 0.3, Section::Radius(0.5)).unwrap() }
}

fn concrete() -> Cpm {
    Cpm::new(&CpmParameters::new(100.0, 0.2, 2.0, 0.8, 0.02, 5.0)).unwrap()
}

/// Stiffness 1 at 300 K, 0.4 at 500 K; strength 1 and 0.5.
fn soften(heat: &mut HeatModel, particles: usize) {
    let curve = |end: f64| Some(Curve::new(vec![300.0, 500.0], vec![1.0, end]));
    let curves = MaterialCurves { stiffness: curve(0.4), strength: curve(0.5), ..MaterialCurves::default() };
    heat.curves = Curves { materials: vec![curves], of: vec![0; particles] };
    heat.supply.held.push(Held { particles: (0..particles as u32).collect(), temperature: 1.0 });
}

/// Two bonded particles at prescribed temperatures.
fn pair<L: LawLoops>(law: L, temperature: f64) -> (State, HeatModel) {
    let (mut state, mut heat) = bonded(cubes([2, 1, 1]), law, vec![300.0; 2]);
    heat.materials = vec![PLAIN];
    soften(&mut heat, 2);
    state.heat = Some(heat.start(vec![temperature; 2]));
    (state, heat)
}

/// One step, at the end of which all particles have this temperature (K).
fn step_to(solver: &mut Solver, state: &mut State, temperature: f64) {
    solver.set_heat_factors(Factors { held: vec![temperature], ..Factors::default() });
    solver.step(state).unwrap();
}

/// A bond of stiffness `k` that is held at an elongation and warmed from 300 K to 400 K: force `0.7 k u`; the change of the stiffness takes
/// out `0.3 · ½ k u²`. Rounding of the elongation.
fn held_bond<L: LawLoops>(law: L, k: f64) {
    let (mut state, heat) = pair(law, 300.0);
    state.particles.constraint.fill(Constraint::ALL);
    state.particles.position[1].x += 1e-3;
    let mut solver = solver(&heat, &mut state, Damping::None);
    step_to(&mut solver, &mut state, 300.0);
    let cold = solver.forces()[0].x;
    assert!((cold / (k * 1e-3) - 1.0).abs() < 1e-12, "{cold}");
    for step in 1..=50 {
        step_to(&mut solver, &mut state, 300.0 + 2.0 * f64::from(step));
    }
    step_to(&mut solver, &mut state, 400.0);
    let hot = solver.forces()[0].x;
    assert!((hot / (0.7 * k * 1e-3) - 1.0).abs() < 1e-12, "{hot}");
    let recorded = solver.record(&mut state).unwrap().contacts.force[0].x;
    assert_eq!((recorded, solver.last_forces(&state).contacts.force[0].x), (hot, hot));
    let (work, stored) = (state.ledger.stiffness_work.get(), 0.5 * k * 1e-6);
    assert!((work / stored + 0.3).abs() < 1e-12, "{work} {stored}");
    assert!(state.ledger.residual().abs() < 1e-13 * stored, "{:e}", state.ledger.residual());
}

#[test]
fn forces_follow_the_stiffness() {
    held_bond(springs(0.0, f64::INFINITY), 100.0);
    held_bond(beams(f64::INFINITY), 100.0 * AREA);
    held_bond(concrete(), 100.0 * AREA);
}

/// Largest force of a bond that is drawn apart at a temperature.
fn peak<L: LawLoops>(law: L, temperature: f64) -> f64 {
    let (mut state, heat) = pair(law, temperature);
    state.particles.constraint.fill(Constraint::ALL);
    state.particles.velocity[1].x = 1e-2;
    let mut solver = solver(&heat, &mut state, Damping::None);
    let mut most: f64 = 0.0;
    for _ in 0..5000 {
        step_to(&mut solver, &mut state, temperature);
        most = most.max(solver.forces()[0].x);
    }
    most
}

/// A bond carries its strength: at 300 K, at 400 K, and beyond the end of the curve. A step draws it by 1e-5 m, less than 0.1 % of the
/// elongation at failure.
#[test]
fn bonds_fail_at_the_strength_of_their_temperature() {
    for (temperature, factor) in [(300.0, 1.0), (400.0, 0.75), (700.0, 0.5)] {
        let near = |found: f64, strength: f64| {
            assert!(
                found <= strength * factor * (1.0 + 1e-12) && found > 0.998 * strength * factor,
                "{found} {factor}"
            );
        };
        near(peak(springs(0.0, 2.0), temperature), 2.0);
        near(peak(beams(2.0 / AREA), temperature), 2.0);
        near(peak(concrete(), temperature), 2.0 * AREA);
    }
}

/// Two free particles that fly apart, with temperatures that rise and fall. The ledger closes to the rounding of 400 steps: while the bond
/// vibrates, damages, and breaks.
fn closes<L: LawLoops>(law: L, speed: f64, breaks: bool) {
    let (mut state, heat) = pair(law, 300.0);
    state.particles.velocity = vec![Vec3::new(-speed, 0.0, 0.0), Vec3::new(speed, 0.0, 0.0)];
    state.clock.dt = 5e-3;
    let mut solver = solver(&heat, &mut state, Damping::None);
    for step in 0..400 {
        let temperature = 400.0 - 100.0 * (f64::from(step) * 0.05).cos();
        step_to(&mut solver, &mut state, temperature);
        let (ledger, scale) = (&state.ledger, state.ledger.turnover());
        assert!(ledger.residual().abs() < 1e-12 * scale, "{step}: {:e} of {scale}", ledger.residual());
    }
    assert_eq!(state.broken.len(), usize::from(breaks));
    let ledger = &state.ledger;
    assert!(ledger.stiffness_work.get().abs() > 1e-4 * ledger.turnover(), "{ledger:?}");
}

#[test]
fn the_work_of_softening_closes_the_ledger() {
    closes(springs(0.0, f64::INFINITY), 0.1, false);
    closes(springs(0.05, f64::INFINITY), 0.1, false);
    closes(springs(0.05, 1.0), 0.15, true);
    closes(beams(f64::INFINITY), 0.1, false);
    closes(beams(1.0), 0.15, true);
    closes(concrete(), 0.1, false);
    let linear =
        CpmParameters { damage_law: concordem_contact::law::cpm::DamageLaw::Linear, ..*concrete().parameters() };
    closes(Cpm::new(&linear).unwrap(), 1.5, true);
    let hardening = CpmParameters {
        soft_strain: -0.005,
        relative_soft_stiffness: 0.3,
        shear_contribution: 0.5,
        ..*concrete().parameters()
    };
    closes(Cpm::new(&hardening).unwrap(), 0.1, false);
}

/// The same with shear: B moves sideways, and the concrete bond slips. Normals turn within a step, an error of the third
/// order in the motion. Beams bend.
#[test]
fn the_work_of_softening_closes_the_ledger_in_shear() {
    fn error<L: LawLoops>(law: L, amplitude: f64) -> f64 {
        let (mut state, heat) = pair(law, 300.0);
        state.particles.constraint.fill(Constraint::ALL);
        state.particles.velocity[1].y = amplitude / 0.6;
        let mut solver = solver(&heat, &mut state, Damping::None);
        let mut stored: f64 = 0.0;
        for step in 0..600 {
            step_to(&mut solver, &mut state, 400.0 - 100.0 * (f64::from(step) * 0.05).cos());
            stored = stored.max(state.ledger.stored_total());
        }
        let work = state.ledger.stiffness_work.get().abs();
        assert!(work > 0.01 * stored, "{work} {stored}");
        state.ledger.residual().abs() / stored
    }
    let weak = CpmParameters { cohesion: 0.002, ..*concrete().parameters() };
    for (name, found) in [
        ("springs", error(springs(0.0, f64::INFINITY), 1e-3)),
        ("beams", error(beams(f64::INFINITY), 1e-3)),
        ("concrete", error(Cpm::new(&weak).unwrap(), 1e-3)),
    ] {
        assert!(found < 1e-9, "{name}: {found:e}");
    }
}

/// Two spheres press on each other and separate while they warm: contacts without a bond soften, too.
#[test]
fn contacts_soften() {
    let particles = cubes([2, 1, 1]);
    let stiffness = ContactStiffness::Given { normal: 100.0, shear: 50.0 };
    let contact = Frictional::new(stiffness, 0.3, 0.02).unwrap();
    let mut heat = model(lattice(&particles), &particles, &[PLAIN]);
    heat.mechanics = true;
    soften(&mut heat, 2);
    let mut state = State { particles, heat: Some(heat.start(vec![300.0; 2])), ..State::default() };
    state.contacts = Some(Box::new(ContactBlock::new(vec![contact])));
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    state.clock.dt = 5e-3;
    state.particles.position[1].x += 0.01;
    state.particles.velocity = vec![Vec3::new(0.2, 0.0, 0.0), Vec3::new(-0.2, 0.0, 0.0)];
    let model = Model { heat: Some(heat), contact_rows: rows, ..Model::default() };
    let mut solver = Solver::new(model, &mut state).unwrap();
    let mut most: f64 = 0.0;
    for step in 0..100 {
        step_to(&mut solver, &mut state, 300.0 + 2.0 * f64::from(step));
        let ledger = &state.ledger;
        assert!(ledger.residual().abs() < 1e-13 * ledger.turnover(), "{step}: {:e}", ledger.residual());
        most = most.max(ledger.stored_total());
    }
    assert!(state.ledger.stored_total() == 0.0 && most > 0.01, "{most}");
    assert!(state.ledger.stiffness_work.get() < -1e-2 * most, "{}", state.ledger.stiffness_work.get());
}

/// Warming alone changes no damage, in either direction: ω is a function of κ over the onset strain of its temperature.
#[test]
fn warming_changes_no_damage() {
    let (mut state, mut heat) = pair(concrete(), 300.0);
    heat.curves.materials[0].strength = Some(Curve::new(vec![300.0, 500.0], vec![1.0, 0.1]));
    state.particles.constraint.fill(Constraint::ALL);
    state.particles.velocity[1].x = 1.0;
    let mut solver = solver(&heat, &mut state, Damping::None);
    for _ in 0..40 {
        step_to(&mut solver, &mut state, 300.0);
    }
    // Unload, so that no temperature here begins new damage.
    state.particles.velocity[1].x = -1.0;
    for _ in 0..35 {
        step_to(&mut solver, &mut state, 300.0);
    }
    state.particles.velocity[1].x = 0.0;
    step_to(&mut solver, &mut state, 300.0);
    let damage = state.bonds[0].damage(0);
    assert!(damage > 0.3 && damage < 0.9, "{damage}");
    for step in 0..100 {
        step_to(&mut solver, &mut state, 350.0 - 50.0 * (f64::from(step) * 0.2).cos());
        assert_eq!(state.bonds[0].damage(0), damage);
    }
}

/// The bound of the time step is that of the largest stiffness of the curve, here at 500 K: four times the stiffness, half the step.
#[test]
fn the_bound_takes_the_largest_stiffness() {
    let (mut state, mut heat) = pair(springs(0.1, f64::INFINITY), 300.0);
    let bound = |state: &State| time_step::bounds(state).spectral;
    let cold = bound(&state);
    heat.curves.materials[0].stiffness = Some(Curve::new(vec![300.0, 500.0, 700.0], vec![1.0, 4.0, 2.0]));
    state.bonds[0].contacts_mut().set_largest_factor(&heat.largest_stiffness_factors());
    let hot = bound(&state);
    assert!((hot / cold - 0.5).abs() < 1e-12, "{hot} {cold}");
}

/// The same bits after a restart in the middle, with moving, expanding, softening, and breaking bonds.
#[test]
fn softening_continues_after_a_restart() {
    let start = || {
        let mut temperature = vec![300.0; 64];
        temperature[21] = 900.0;
        let (mut state, mut heat) = bonded(cubes([4, 4, 4]), springs(0.05, 0.8), temperature);
        soften(&mut heat, 64);
        heat.supply.held.clear();
        state.clock.dt = 0.02;
        (state, heat)
    };
    let bits = |restart: bool| {
        let (mut state, heat) = start();
        let mut solver = solver(&heat, &mut state, Damping::None);
        for step in 0..400 {
            if restart && step == 150 {
                let mut columns = ColumnStore::default();
                state.write(&mut columns).unwrap();
                let mut other = start().0;
                other.read(&mut columns).unwrap();
                state = other;
                solver = Solver::new(solver.model().clone(), &mut state).unwrap();
            }
            solver.step(&mut state).unwrap();
        }
        let ledger = (state.ledger.to_reals(), state.ledger.expansion_reals(), state.ledger.stiffness_work);
        (state.particles.position, state.heat, ledger, state.broken.len())
    };
    let whole = bits(false);
    assert!(whole.3 > 0 && whole.3 < 100 && whole.2.2.get() != 0.0, "{} {:?}", whole.3, whole.2.2);
    assert!(whole == bits(true));
}
