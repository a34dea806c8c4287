//! Doubling stiffness, cohesion, and density doubles all forces.
//!
//! With Ē, c₀, and ρ doubled at the same ε₀, ε_f, time step, and rates, all accelerations and motions are the same, and
//! every force, energy, and mass doubles. The factor 2 is exact in binary, so the solver must give the same bits. The
//! test would detect any dimensional constant hidden in the program.

use concordem::law::Cpm;
use concordem::law::cpm::CpmParameters;
use concordem::solver::Model;
use concordem::solver::integrate::Damping;
use concordem::state::State;
use concordem::state::contacts::ContactBlock;
use concordem_tests::{
    DENSITY, TIME_STEP, bonded, concrete, law, one_material, particles, pull, random_packing, solver,
};

fn specimen(factor: f64, density: f64) -> (State, Model) {
    // A threshold lets bonds break, so that unbonded contacts take part.
    let base = concrete();
    let parameters =
        CpmParameters { young: factor * base.young, cohesion: factor * base.cohesion, omega_threshold: 0.9, ..base };
    let mut state = bonded(particles(&random_packing(1, 23e-3), density), None, law(&parameters), 1.5);
    state.contacts = Some(Box::new(ContactBlock::new(vec![law(&parameters)])));
    state.clock.dt = TIME_STEP;
    pull(&mut state, 20.0);
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    (state, Model { damping, contact_rows: one_material(), ..Model::default() })
}

#[test]
fn a_doubled_specimen_gives_doubled_forces_bit_for_bit() {
    let (mut one, model) = specimen(1.0, DENSITY);
    let (mut two, _) = specimen(2.0, 2.0 * DENSITY);
    let before = one.bond_count();
    let mut solvers = (solver(model.clone(), &mut one), solver(model, &mut two));
    let mut largest = 0.0_f64;
    for step in 0..300 {
        let report = solvers.0.step(&mut one).unwrap();
        let doubled = solvers.1.step(&mut two).unwrap();
        for (p, (f, g)) in solvers.0.forces().iter().zip(solvers.1.forces()).enumerate() {
            assert_eq!(f * 2.0, *g, "force on particle {p} at step {step}");
            largest = largest.max(f.norm());
        }
        assert_eq!(one.particles.position, two.particles.position, "step {step}");
        assert_eq!(2.0 * report.energy.damage, doubled.energy.damage, "step {step}");
        assert_eq!(2.0 * one.ledger.stored_total(), two.ledger.stored_total(), "step {step}");
    }
    println!("{} of {before} bonds left, forces up to {largest:.3e} N", one.bond_count());
    assert!(one.bond_count() < before && largest > 0.0, "the test must reach failure");
    let slipped = |state: &State| {
        let block = state.bonds[0].contacts().as_any().downcast_ref::<ContactBlock<Cpm>>().unwrap();
        (0..block.len()).filter(|&k| block.history.get(k).plastic_shear_strain.norm() > 0.0).count()
    };
    assert!(slipped(&one) > 0, "the test must reach slip");
}

/// If the density is not doubled, inertia changes the motion, and the test above would fail.
#[test]
fn without_doubled_density_forces_do_not_double() {
    let (mut one, model) = specimen(1.0, DENSITY);
    let (mut two, _) = specimen(2.0, DENSITY);
    let mut solvers = (solver(model.clone(), &mut one), solver(model, &mut two));
    for _ in 0..50 {
        solvers.0.step(&mut one).unwrap();
        solvers.1.step(&mut two).unwrap();
    }
    assert!(solvers.0.forces().iter().zip(solvers.1.forces()).any(|(f, g)| f * 2.0 != *g));
}
