//! Does a run give the same bits on any number of threads, twice, and from any checkpoint?

use concordem::output::hash::state_hash;
use concordem::solver::Model;
use concordem::solver::integrate::Damping;
use concordem::state::State;
use concordem::state::columns::ColumnStore;
use concordem::state::contacts::{ContactBlock, Link};
use concordem_tests::{
    DENSITY, TIME_STEP, bonded, concrete, law, on_threads, one_material, particles, pull, random_packing, solver,
};

const STEPS: u64 = 300;

const REFERENCE: &str = "37b6c6d09b7d1712484f0bc45d0693ca2cb12d5355264f3ba436433743cad255";

/// A specimen that is torn fast: damage, broken bonds, unbonded contacts.
fn specimen(copies: usize, height: f64) -> (State, Model) {
    let parameters = concordem::law::CpmParameters { omega_threshold: 0.9, ..concrete() };
    let mut state = bonded(particles(&random_packing(copies, height), DENSITY), None, law(&parameters), 1.5);
    state.contacts = Some(Box::new(ContactBlock::new(vec![law(&parameters)])));
    state.clock.dt = TIME_STEP;
    pull(&mut state, 20.0);
    // Something to close gaps, so that contacts begin.
    for p in 0..state.particles.len() {
        state.particles.velocity[p] += concordem_tests::noise_vector(p, 1) * 0.3;
    }
    let damping = Damping::Local { translation: 0.3, rotation: 0.3 };
    (state, Model { damping, contact_rows: one_material(), ..Model::default() })
}

fn active(state: &State) -> usize {
    let block = state.contacts.as_ref().unwrap().contacts();
    (0..block.len()).filter(|&k| block.view(k).link.has(Link::ACTIVE)).count()
}

/// Hash at the end; at each of the steps in `restarts` the state goes through columns into a new solver.
fn run(copies: usize, height: f64, restarts: &[u64]) -> String {
    let (mut state, model) = specimen(copies, height);
    let bonds = state.bond_count();
    let mut solver_now = solver(model.clone(), &mut state);
    while state.clock.step < STEPS {
        // Samples at some steps only: they must leave no trace.
        let sample = state.clock.step % 7 == 0 || state.clock.step + 1 == STEPS;
        solver_now.step_with(&mut state, sample).unwrap();
        if restarts.contains(&state.clock.step) {
            let mut columns = ColumnStore::of(&state).unwrap();
            let (mut again, _) = specimen(copies, height);
            again.read(&mut columns).unwrap();
            assert_eq!(state_hash(&again).unwrap(), state_hash(&state).unwrap(), "step {}", state.clock.step);
            state = again;
            solver_now = solver(model.clone(), &mut state);
        }
    }
    println!(
        "{} particles, {} of {bonds} bonds left, {} unbonded contacts, {} searches",
        state.particles.len(),
        state.bond_count(),
        active(&state),
        solver_now.searches()
    );
    assert!(state.bond_count() < bonds && active(&state) > 0, "the test must reach failure and unbonded contacts");
    state_hash(&state).unwrap()
}

#[test]
fn threads_and_restarts_leave_no_trace() {
    let reference = on_threads(1, || run(3, 1.0, &[]));
    for threads in [1, 2, 3, 8] {
        assert_eq!(reference, on_threads(threads, || run(3, 1.0, &[])), "{threads} threads");
    }
    assert_eq!(reference, on_threads(2, || run(3, 1.0, &[1, 37, 120, 121, 211])), "restarts");
}

/// The hash of a small run, so that no change of the numbers goes unseen. All arithmetic is IEEE 754 and elementary
/// functions are the library's own, so that it is the same on every machine. A change of it must be deliberate and
/// explained in the change log.
#[test]
fn reference_run_keeps_its_hash() {
    assert_eq!(on_threads(2, || run(1, 16e-3, &[])), REFERENCE);
}
