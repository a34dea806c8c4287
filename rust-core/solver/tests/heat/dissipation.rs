//! Heat from damage, friction, and dashpots.

use concordem_contact::law::LinearBond;
use concordem_contact::math::Vec3;
use concordem_solver::Solver;
use concordem_solver::heat::HeatModel;
use concordem_solver::integrate::Damping;
use concordem_solver::state::State;
use concordem_solver::state::columns::{ColumnStore, WriteColumns};

use super::expansion::{bonded, solver};
use super::{cubes, temperatures};

/// Two particles fly apart and tear their bond with a dashpot, with a conductivity of zero between them.
fn torn() -> (State, HeatModel) {
    let law = LinearBond::new(100.0, 50.0, 0.01, 0.5, f64::INFINITY).unwrap();
    let (mut state, mut heat) = bonded(cubes([2, 1, 1]), law, vec![300.0; 2]);
    heat.dissipation = true;
    heat.materials[0].expansion = 0.0;
    state.heat = Some(heat.start(vec![300.0; 2]));
    state.particles.velocity[0] = Vec3::new(-0.1, 0.0, 0.0);
    state.particles.velocity[1] = Vec3::new(0.1, 0.0, 0.0);
    state.clock.dt = 1e-3;
    (state, heat)
}

/// Adiabatic tearing: what bond and dashpot dissipate warms both particles equally, `C (ΔT₁ + ΔT₂) = E`, and the ledgers of energy and heat
/// name the same amount. Explicit and implicit.
#[test]
fn a_torn_bond_heats_both_ends() {
    for implicit in [false, true] {
        let (mut state, mut heat) = torn();
        heat.implicit = implicit;
        let mut solver = solver(&heat, &mut state, Damping::None);
        for _ in 0..200 {
            solver.step(&mut state).unwrap();
        }
        assert_eq!(state.broken.len(), 1);
        let found = state.heat.as_ref().unwrap();
        let (damage, viscous) = (state.ledger.damage.get(), state.ledger.viscous.get());
        // Spring and dashpot, `2 ζ √(k m*)` at 0.2 m/s, break at 0.5 N together: ½ F²/k of the spring. The motion of one step is 4 % of the
        // elongation, and the energy at the break lies between the ends of the step.
        let spring: f64 = 0.5 - 0.02 * 50.0_f64.sqrt() * 0.2;
        assert!((damage / (0.5 * spring * spring / 100.0) - 1.0).abs() < 0.08, "{damage}");
        assert!(viscous > 0.01 * damage, "{viscous}");
        let heated = found.ledger.dissipation.get();
        // Rounding of two sums.
        assert!((heated / (damage + viscous) - 1.0).abs() < 1e-14, "{heated}");
        for temperature in temperatures(&state) {
            // Rounding of temperatures of 300 K.
            let warmed = (temperature - 300.0) * heat.capacity[0];
            assert!((warmed - 0.5 * heated).abs() < 1e-12, "{implicit} {warmed} {heated}");
        }
        assert!(heat.residual(found).abs() < 1e-12, "{:e}", heat.residual(found));
    }
}

/// The same bits after a restart while the dashpot heats.
#[test]
fn dissipation_continues_after_a_restart() {
    let bits = |restart: bool| {
        let (mut state, heat) = torn();
        let mut solver = solver(&heat, &mut state, Damping::None);
        for step in 0..60 {
            if restart && step == 10 {
                let mut columns = ColumnStore::default();
                state.write(&mut columns).unwrap();
                let mut other = torn().0;
                other.read(&mut columns).unwrap();
                state = other;
                solver = Solver::new(solver.model().clone(), &mut state).unwrap();
            }
            solver.step(&mut state).unwrap();
        }
        state.heat.unwrap()
    };
    let whole = bits(false);
    assert!(whole.ledger.dissipation.get() > 0.0);
    assert!(whole == bits(true));
}
