//! Heat where a host moves the particles.

use concordem_contact::law::LinearBond;
use concordem_contact::math::Vec3;
use concordem_solver::heat::expansion;
use concordem_solver::heat::{Source, Spread, ThermalMaterial, network};
use concordem_solver::integrate::{self, Damping, KickContext, NetForces};
use concordem_solver::state::State;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::{Model, PairCoefficients, Solver};

use super::{PLAIN, cubes, model, temperatures};

/// A block of bonded spheres that expand, one of them heated, fly apart as their bonds break; cracks insulate, and dissipation heats.
fn heated() -> (State, Solver) {
    let particles = cubes([4, 3, 3]);
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let bond = LinearBond::new(1000.0, 400.0, 0.1, 2.0, 2.0).unwrap();
    let mut bonds = ContactBlock::new(vec![bond]);
    concordem_packing::bonding::bond(&mut bonds, &rows, &particles, None, 1.01).unwrap();
    let pairs = network::touching(&particles, None, 1.0).unwrap();
    let material = ThermalMaterial { expansion: 1e-3, ..PLAIN };
    let mut heat = model(network::ordered(&particles, &pairs, &[], false), &particles, &[material]);
    heat.mechanics = true;
    heat.dissipation = true;
    heat.supply.sources.push(Source { power: 1000.0, spread: Spread::Shares(vec![(5, 1.0)]) });
    let started = heat.start(vec![300.0; particles.len()]);
    let mut state = State { particles, bonds: vec![Box::new(bonds)], heat: Some(started), ..State::default() };
    for (p, velocity) in state.particles.velocity.iter_mut().enumerate() {
        *velocity = Vec3::from_fn(|axis, _| (((p * 7919 + axis * 104_729) % 1000) as f64 / 500.0 - 1.0) * 0.3);
    }
    expansion::start(&heat, &mut state);
    state.clock.dt = 2e-3;
    let solver = Solver::new(Model { heat: Some(heat), ..Model::default() }, &mut state).unwrap();
    (state, solver)
}

/// A host that moves the particles by the forces of [`Solver::find_forces`] gets the temperatures, motions, and reference lengths of
/// our own steps, bit for bit.
#[test]
fn a_host_gets_the_same_temperatures() {
    let ((mut own, mut solver), (mut hosted, mut force)) = (heated(), heated());
    for _ in 0..300 {
        solver.step_with(&mut own, false).unwrap();
        force.find_forces(&mut hosted, false).unwrap();
        hosted.clock.step += 1;
        let kick = KickContext {
            dt: hosted.clock.dt,
            fraction: 1.0,
            gravity: Vec3::zeros(),
            damping: Damping::None,
            cell: None,
            gradient_change: None,
            convective: false,
            targets: None,
        };
        integrate::kick_and_drift(
            &kick,
            &mut hosted.particles,
            NetForces { force: force.forces(), torque: force.torques() },
        );
    }
    assert!(own.broken.len() > 5, "{}", own.broken.len());
    assert!(temperatures(&own)[5] > 310.0 && own.heat.as_ref().unwrap().ledger.dissipation.get() > 0.0);
    assert!(own.heat == hosted.heat);
    assert!(own.particles == hosted.particles);
    let lengths = |state: &State| -> Vec<f64> {
        (0..state.bonds[0].len()).map(|k| state.bonds[0].view(k).reference.length).collect()
    };
    assert_eq!(lengths(&own), lengths(&hosted));
}
