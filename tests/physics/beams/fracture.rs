//! Energy, determinism, and criteria of fracture.

use std::f64::consts::{FRAC_PI_2, PI};

use concordem::fracture::fragments::{count, fragments};
use concordem::fracture::virial::{HydrostaticStrength, mean_stress};
use concordem::law::{CohesiveBeam, ContactStiffness, Frictional, Section};
use concordem::math::Vec3;
use concordem::output::hash::state_hash;
use concordem::solver::integrate::Damping;
use concordem::solver::{Model, time_step};
use concordem::state::columns::ColumnStore;
use concordem::state::contacts::ContactBlock;
use concordem::state::{Constraint, Particles, Sphere, State};
use concordem_tests::{
    DENSITY, bonded, noise_vector, on_threads, one_material, particles, pull, random_packing, solver,
};

use super::{chain, pair};

/// A brittle specimen of beams pulled apart fast, with friction between fragments.
fn specimen(copies: usize, damping: Damping, hydrostatic: f64) -> (State, Model) {
    let beam = CohesiveBeam {
        strength: if hydrostatic.is_finite() { f64::INFINITY } else { 5e6 },
        ..CohesiveBeam::new(25e9, 0.3, Section::Ratio(0.7)).unwrap()
    };
    let mut state = bonded(particles(&random_packing(copies, 16e-3), DENSITY), None, beam, 1.1);
    let stiffness = ContactStiffness::Moduli { young_a: 25e9, young_b: 25e9, ratio: 0.3 };
    state.contacts = Some(Box::new(ContactBlock::new(vec![Frictional::new(stiffness, 0.5, 0.0).unwrap()])));
    state.clock.dt = 0.4 * damping.stability() * time_step::bounds(&state).spectral;
    pull(&mut state, 8.0);
    let thresholds = vec![hydrostatic];
    let model = Model {
        damping,
        contact_rows: one_material(),
        hydrostatic_strength: HydrostaticStrength { thresholds, planar: false },
        ..Model::default()
    };
    (state, model)
}

const DAMPING: Damping = Damping::TchamwaWielgosz { phi: 1.3 };

/// The ledger closes through fracture, with either criterion, damping by the integrator, and contacts between fragments. The
/// residual is of third order per step, mostly from bonds that rotate while their force drops. The tolerance of 1e-7 of the
/// boundary work is three times the measured residual (at half the step, a tenth of it remains).
#[test]
fn ledger_closes_through_beam_fracture() {
    on_threads(2, || {
        for (name, hydrostatic) in [("Rankine", f64::INFINITY), ("particles", 2e6)] {
            let (mut state, model) = specimen(1, DAMPING, hydrostatic);
            let bonds = state.bond_count();
            let mut solver = solver(model, &mut state);
            let mut worst = 0.0_f64;
            let mut broken = 0;
            for step in 0..600 {
                let report = solver.step_with(&mut state, step % 20 == 0).unwrap();
                broken += report.bond_events.iter().filter(|(_, bond_event)| bond_event.broke).count();
                for (_, bond_event) in &report.bond_events {
                    let total: f64 = bond_event.stored.iter().sum();
                    assert_eq!(
                        bond_event.energy, total,
                        "the released energy equals the stored energy, summed over modes"
                    );
                }
                if step % 20 == 0 && step > 0 {
                    worst = worst.max((state.ledger.residual() / state.ledger.boundary_work.get()).abs());
                }
            }
            let pieces = count(&fragments(&state));
            println!(
                "{name}: {broken} of {bonds} bonds broke, {pieces} fragments, residual {worst:.1e} of the work, released \
                 {:.2e}, damped {:.2e} of {:.2e} J",
                state.ledger.damage.get(),
                state.ledger.numerical_damping.get(),
                state.ledger.boundary_work.get()
            );
            assert!(broken > 50 && broken == bonds - state.bond_count() && pieces > 1);
            assert!(state.ledger.numerical_damping.get() > 0.0);
            assert!(worst < 1e-7, "{name}: {worst:e}");
        }
    });
}

/// Runs give the same bits on any number of threads and from any checkpoint, through fracture by either criterion.
#[test]
fn beams_give_the_same_bits_on_any_thread_and_restart() {
    let run = |threads: usize, interval: u64, hydrostatic: f64| {
        on_threads(threads, || {
            let (mut state, model) = specimen(2, DAMPING, hydrostatic);
            let mut solver_now = solver(model.clone(), &mut state);
            while state.clock.step < 250 {
                solver_now.step_with(&mut state, false).unwrap();
                if state.clock.step.is_multiple_of(interval) {
                    let mut columns = ColumnStore::of(&state).unwrap();
                    let (mut again, _) = specimen(2, DAMPING, hydrostatic);
                    again.read(&mut columns).unwrap();
                    state = again;
                    solver_now = solver(model.clone(), &mut state);
                }
            }
            state_hash(&state).unwrap()
        })
    };
    for hydrostatic in [f64::INFINITY, 2e6] {
        let reference = run(1, u64::MAX, hydrostatic);
        for (threads, interval) in [(2, u64::MAX), (3, 60), (1, 7)] {
            assert_eq!(reference, run(threads, interval, hydrostatic), "{threads} threads, restart every {interval}");
        }
    }
}

/// A bonded pair that rotates by 2π about any axis while it vibrates keeps its energy, whatever its orientation. Leapfrog
/// keeps `½m v⁻·v⁺ + U` to third order in the rotation per step.
#[test]
fn a_rotating_pair_keeps_its_energy() {
    on_threads(1, || {
        let beam = CohesiveBeam::new(1e6, 0.3, Section::Ratio(0.5)).unwrap();
        let run = |dt: f64| {
            let mut state = chain(3, 1.0, 1000.0, beam);
            state.particles.constraint[0] = Constraint::FREE;
            state.clock.dt = dt;
            let spin = Vec3::new(3.0, 1.0, 2.0);
            for p in 0..3 {
                let arm = state.particles.position[p] - Vec3::new(2.0, 0.0, 0.0);
                state.particles.velocity[p] = spin.cross(&arm) + noise_vector(p, 1);
                state.particles.angular_velocity[p] = spin + noise_vector(p, 2);
            }
            let mut solver = solver(Model::default(), &mut state);
            let mut worst = 0.0_f64;
            while state.clock.time() < 10.0 {
                solver.step(&mut state).unwrap();
                worst = worst.max((state.ledger.residual() / state.ledger.initial).abs());
            }
            worst
        };
        let (coarse, fine) = (run(2e-4), run(1e-4));
        println!("residual of 6 turns: {coarse:.2e}, at half the step {fine:.2e}");
        // Second order over a fixed time, down to rounding.
        assert!(fine < 1e-6 && coarse / fine > 3.0, "{coarse:e} {fine:e}");
    });
}

/// Mean stress of a particle in a simple cubic block under equal strain in all directions: with six bonds of axial force
/// `N`, `p = 6·½·N l/(3V)`. Particle-level failure breaks exactly the bonds of the particle above the threshold.
#[test]
fn particle_level_failure_breaks_all_bonds_of_the_particle() {
    on_threads(1, || {
        let mut particles = Particles::default();
        let place = |x: f64, y: f64, z: f64| Sphere { position: Vec3::new(x, y, z) * 2.0, radius: 1.0 };
        for sphere in [
            place(0.0, 0.0, 0.0),
            place(1.0, 0.0, 0.0),
            place(-1.0, 0.0, 0.0),
            place(0.0, 1.0, 0.0),
            place(0.0, -1.0, 0.0),
            place(0.0, 0.0, 1.0),
            place(0.0, 0.0, -1.0),
            place(2.0, 0.0, 0.0),
        ] {
            particles.push(sphere, 0, 1.0, 0.4);
        }
        let beam = CohesiveBeam::new(1e6, 0.3, Section::Ratio(0.5)).unwrap();
        let mut state = bonded(particles, None, beam, 1.01);
        state.clock.dt = 1e-9;
        for position in &mut state.particles.position {
            *position *= 1.001;
        }
        let model = |threshold: f64| Model {
            hydrostatic_strength: HydrostaticStrength { thresholds: vec![threshold], planar: false },
            ..Model::default()
        };
        let force = 1e6 * PI * 0.25 * 1e-3;
        let pressure = 6.0 * 0.5 * force * 2.002 / (4.0 * PI);
        let mut one = solver(model(pressure * 1.0001), &mut state);
        one.step(&mut state).unwrap();
        let stress = mean_stress(&state, false).unwrap();
        assert!((stress[0] / pressure - 1.0).abs() < 1e-9, "{} {pressure}", stress[0]);
        assert_eq!(state.bond_count(), 7);
        one.step(&mut state).unwrap();
        assert_eq!(state.bond_count(), 7, "below the threshold nothing breaks");
        let mut two = solver(model(pressure * 0.9999), &mut state);
        two.step(&mut state).unwrap();
        let report = two.step(&mut state).unwrap();
        assert_eq!(report.bond_events.len(), 6);
        assert_eq!(state.bond_count(), 1, "the bond between its neighbors stays");
        assert_eq!(count(&fragments(&state)), 7);
    });
}

/// A beam of unlimited strength, twisted or bent by a prescribed rotation of one end, holds up to 3 rad and then breaks with
/// an event: beyond π the moment would change its sign and the stored energy would be lost. The event releases the stored
/// energy, `½ k_t τ²` or that of bending.
#[test]
fn beams_break_before_half_a_turn() {
    on_threads(1, || {
        for axis in [0, 2] {
            let mut particles = pair();
            particles.constraint.fill(Constraint::ALL);
            let rate = 1e-3;
            particles.angular_velocity[1][axis] = rate;
            let beam = CohesiveBeam::new(1.0, 0.25, Section::Radius(0.5)).unwrap();
            let mut state = bonded(particles, None, beam, 1.01);
            state.clock.dt = 1.0;
            let mut solver = solver(Model::default(), &mut state);
            let (mut stored, mut events) = (0.0, Vec::new());
            for step in 0..4000 {
                let report = solver.step(&mut state).unwrap();
                if let Some((_, event)) = report.bond_events.first() {
                    events.push((step, event.energy));
                } else if events.is_empty() {
                    assert!(state.ledger.stored_total() > stored || step < 2, "step {step}");
                    stored = state.ledger.stored_total();
                }
            }
            let (step, energy) = events[0];
            println!("axis {axis}: broke at {} rad, released {energy:.6} of {stored:.6} J", f64::from(step) * rate);
            assert_eq!(events.len(), 1);
            // Within two steps of 3 rad: 1e-3 rad each, and twice their share of the energy.
            assert!((f64::from(step) * rate - 3.0).abs() < 2.5e-3, "{step}");
            assert!((energy / stored - 1.0).abs() < 2e-3, "{energy} {stored}");
            if axis == 0 {
                let twist = 0.5 * 1.0 / 2.5 * FRAC_PI_2 * 0.5_f64.powi(4) / 2.0 * 9.0;
                assert!((energy / twist - 1.0).abs() < 2e-3, "{energy} {twist}");
            }
        }
    });
}
