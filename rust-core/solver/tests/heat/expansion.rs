use concordem_contact::law::{CohesiveBeam, Cpm, CpmParameters, LinearBond, Section};
use concordem_packing::bonding::bond;
use concordem_solver::forces::LawLoops;
use concordem_solver::heat::{HeatModel, Held, ThermalMaterial, expansion};
use concordem_solver::integrate::Damping;
use concordem_solver::state::columns::{ColumnStore, WriteColumns};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Constraint, Particles, State};
use concordem_solver::{Model, PairCoefficients, Solver};

use super::{cubes, lattice, model};

const STEEL: ThermalMaterial = ThermalMaterial { specific_heat: 3.0, conductivity: 2.0, expansion: 1e-4 };

/// Particles bonded with their neighbors at 300 K, which now have the given temperatures, and their heat model.
pub(super) fn bonded<L: LawLoops>(particles: Particles, law: L, temperature: Vec<f64>) -> (State, HeatModel) {
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut bonds = ContactBlock::new(vec![law]);
    bond(&mut bonds, &rows, &particles, None, 1.5).unwrap();
    let mut heat = model(lattice(&particles), &particles, &[STEEL]);
    heat.mechanics = true;
    let mut state = State { particles, bonds: vec![Box::new(bonds)], ..State::default() };
    state.heat = Some(heat.start(temperature));
    expansion::start(&heat, &mut state);
    state.clock.dt = 1e-3;
    (state, heat)
}

pub(super) fn solver(heat: &HeatModel, state: &mut State, damping: Damping) -> Solver {
    Solver::new(Model { heat: Some(heat.clone()), damping, ..Model::default() }, state).unwrap()
}

fn springs(shear: f64) -> LinearBond {
    LinearBond::new(100.0, shear, 0.0, f64::INFINITY, f64::INFINITY).unwrap()
}

fn beams() -> CohesiveBeam {
    CohesiveBeam::new(200.0, 0.3, Section::Ratio(0.5)).unwrap()
}

fn concrete(young: f64) -> Cpm {
    Cpm::new(&CpmParameters::new(young, 0.2, 30.0, 0.8, 10.0, 2.0)).unwrap()
}

/// A lattice that is 100 K hotter and 1 % larger than at bonding carries no force: what is left is rounding of the lengths. The same
/// lattice at its first size carries `E A α ΔT` in each bond.
fn expands_freely<L: LawLoops>(law: L) {
    let (mut state, heat) = bonded(cubes([3, 3, 3]), law, vec![400.0; 27]);
    let mut clamped = state.clone();
    let strain = 1e-4 * 100.0;
    for x in &mut state.particles.position {
        *x *= 1.0 + strain;
    }
    let force = |state: &mut State| {
        let mut solver = solver(&heat, state, Damping::None);
        let forces = solver.record(state).unwrap();
        forces.contacts.force.iter().map(concordem_contact::math::Vec3::norm).fold(0.0, f64::max)
    };
    let (free, held) = (force(&mut state), force(&mut clamped));
    let stiffness = clamped.bonds[0].stiffness(0, &clamped.particles, false).normal;
    assert!(held > 0.5 * stiffness * strain, "{held} {stiffness}");
    assert!(free < 8.0 * f64::EPSILON * stiffness * 3.0, "{free:e} of {held}");
}

#[test]
fn free_expansion_is_without_stress_under_every_law_of_bonds() {
    expands_freely(springs(50.0));
    expands_freely(beams());
    expands_freely(concrete(100.0));
}

/// A bar of touching particles between fixed ends carries `F = −E A α ΔT` while it warms from 300 K to 400 K, and the expansion does the
/// work that the bonds store: `½ n k (l α ΔT)²`. Springs: rounding. Beams, whose stiffness `ES/l₀` follows the length: to the order of the
/// strain.
fn clamped_bar<L: LawLoops>(law: L, stiffness: f64, tolerance: f64) {
    let mut particles = cubes([8, 1, 1]);
    particles.constraint.fill(Constraint::ALL);
    let (mut state, mut heat) = bonded(particles, law, vec![300.0; 8]);
    heat.supply.held.push(Held { particles: (0..8).collect(), temperature: 1.0 });
    let mut solver = solver(&heat, &mut state, Damping::None);
    for step in 0..=101 {
        let held = vec![300.0 + f64::from((step + 1).min(100))];
        solver.set_heat_factors(concordem_solver::heat::supply::Factors { held, ..Default::default() });
        solver.step(&mut state).unwrap();
    }
    let shortened = 1e-4 * 100.0;
    let force = solver.forces()[0].x;
    assert!((force / (stiffness * shortened) + 1.0).abs() < tolerance, "{force}");
    let stored = 7.0 * 0.5 * stiffness * shortened * shortened;
    let work = state.ledger.expansion_work.get();
    assert!((work / stored - 1.0).abs() < tolerance, "{work} {stored}");
    assert!(state.ledger.residual().abs() < tolerance * stored, "{:e}", state.ledger.residual());
}

#[test]
fn a_clamped_bar_is_compressed() {
    clamped_bar(springs(0.0), 100.0, 1e-12);
    let section = std::f64::consts::PI * 0.25 * 0.25;
    clamped_bar(beams(), 200.0 * section, 0.02);
}

/// While a hot spot spreads in a free lattice and sets it in motion, the work of the expansion closes the balance of energy, without
/// and with dashpots. The laws measure with the normals of the middle of a step, which turn: an error of the third order in the
/// motion, so that its fraction of the energy falls with the heat of the spot. Without the work of the expansion, all energy
/// would be missing.
#[test]
fn the_work_of_expansion_closes_the_ledger() {
    for damping_ratio in [0.0, 0.05] {
        let error = |spot: f64| {
            let law = LinearBond::new(100.0, 50.0, damping_ratio, f64::INFINITY, f64::INFINITY).unwrap();
            let mut temperature = vec![300.0; 64];
            temperature[21] += spot;
            let (mut state, heat) = bonded(cubes([4, 4, 4]), law, temperature);
            state.clock.dt = 0.02;
            let mut solver = solver(&heat, &mut state, Damping::None);
            for _ in 0..2000 {
                solver.step(&mut state).unwrap();
            }
            let ledger = &state.ledger;
            assert!(ledger.expansion_work.get().abs() > 0.1 * ledger.turnover(), "{ledger:?}");
            ledger.residual().abs() / ledger.turnover()
        };
        let (small, large) = (error(0.1), error(100.0));
        assert!(small < 1e-7 && large < 1e-4 && large > 500.0 * small, "{small:e} {large:e}");
    }
}

/// The same bits after a restart in the middle, with moving, expanding, and breaking bonds.
#[test]
fn expansion_continues_after_a_restart() {
    let law = LinearBond::new(100.0, 50.0, 0.05, 0.8, f64::INFINITY).unwrap();
    let start = || {
        let mut temperature = vec![300.0; 64];
        temperature[21] = 900.0;
        let (mut state, heat) = bonded(cubes([4, 4, 4]), law, temperature);
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
        let ledger = (state.ledger.to_reals(), state.ledger.expansion_reals());
        (state.particles.position, state.heat, ledger, state.broken.len())
    };
    let whole = bits(false);
    assert!(whole.3 > 0 && whole.3 < 100, "{}", whole.3);
    assert!(whole == bits(true));
}
