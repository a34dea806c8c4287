//! Periodic flows can run indefinitely, however far particles drift or the cell is sheared.

use concordem::assembly::Assembly;
use concordem::math::Vec3;
use concordem::output::hash::state_hash;
use concordem::schedule::{Simulation, StopReason};
use concordem::state::columns::ColumnStore;
use concordem_tests::on_threads;
use concordem_tests::runs::{finish, made, started};

const GRAINS: &str = "
[[material]]
name = \"g\"
density = 2500
frictional = { young = 1e7, stiffness_ratio = 0.3, friction_coefficient = 0.5, damping_ratio = 0.2 }
[contacts]
law = \"frictional\"
";

/// 27 particles sheared to γ = 1000: without wrapping, the cell would be a thousand times as long as thick, and particles of
/// neighboring layers up to 3000 cells apart. The run ends by its strain with edges like those at the start, and the ledger
/// closes: boundary work equals dissipation, up to the error of the trapezoidal rule with rotations up to 0.01 rad per step
/// (1e-4).
#[test]
fn a_cell_can_be_sheared_to_a_thousand() {
    let text = format!(
        "version = 1
        [packing]
        kind = \"lattice\"
        lattice = \"sc\"
        radius = \"1 mm\"
        repeats = [3, 3, 3]
        shape = {{ kind = \"periodic\" }}
        {GRAINS}
        [loading]
        kind = \"cell-strain\"
        velocity_gradient = [[0, \"500 1/s\", 0], [0, 0, 0], [0, 0, 0]]
        [stop]
        strain = 1000
        [output]
        sample_interval = 100"
    );
    on_threads(1, || {
        let mut simulation = started(made(&text));
        // Random velocities, without which layers would slide past each other undisturbed.
        for (p, v) in simulation.state.particles.velocity.iter_mut().enumerate() {
            *v += concordem_tests::noise_vector(p, 1) * 0.1;
        }
        finish(&mut simulation);
        let (state, ledger) = (&simulation.state, &simulation.state.ledger);
        assert_eq!(simulation.stopped(), Some(StopReason::Strain));
        let cell = state.cell.unwrap();
        let strain = cell.deformation_gradient[(0, 1)];
        let edges = cell.matrix * 1e3;
        println!(
            "γ = {strain:.3} after {} steps, edges (mm) {edges:.3}, residual {:.1e} of the work {:.3e} J",
            state.clock.step,
            ledger.residual() / ledger.boundary_work.get(),
            ledger.boundary_work.get()
        );
        assert!(strain >= 1000.0 && edges.abs().max() < 7.0, "{edges}");
        assert!((cell.volume() / 216e-9 - 1.0).abs() < 1e-9, "{}", cell.volume());
        assert!((ledger.residual() / ledger.boundary_work.get()).abs() < 1e-4, "{ledger:?}");
        // Particles have moved as far as their layers, a few hundred cells, which unwrapped positions show.
        let way = state.unwrapped_positions().iter().map(|x| x.x.abs()).fold(0.0, f64::max);
        assert!(state.particles.position.iter().all(|x| x.amax() < 33.0 * 7e-3) && way > 1.0, "{way}");
    });
}

/// Scenario of particles in two rows that pass each other at 50 m/s, one cell of 10 mm in 200 µs.
fn passing(more: &str) -> String {
    format!(
        "version = 1
        [packing]
        kind = \"spheres\"
        spheres = [[0, 0, 0, 1e-3], [4e-3, 1.999e-3, 0, 1e-3], [6e-3, 0.1e-3, 2.05e-3, 1e-3], [2e-3, -2.2e-3, 0, 1e-3]]
        cell = [10e-3, 10e-3, 10e-3]
        {GRAINS}
        [[set]]
        name = \"fast\"
        selection = {{ kind = \"ids\", ids = [1, 2] }}
        [[initial]]
        set = \"fast\"
        velocity = [50, 0, 0]
        [integration]
        time_step = \"2 us\"
        {more}"
    )
}

/// Touching particles drift 450 cells apart (runs used to fail at 127). Momentum is conserved to rounding, and the sum
/// of the displacements since the start, weighted by mass, is the time integral of the momentum.
#[test]
fn particles_can_drift_apart_by_hundreds_of_cells() {
    on_threads(1, || {
        let mut simulation = started(made(&passing("[stop]\ntime = 0.2")));
        let start = simulation.state.unwrapped_positions();
        let momentum = |s: &Simulation| {
            let p = &s.state.particles;
            p.velocity.iter().zip(&p.mass).map(|(v, m)| v * *m).sum::<Vec3>()
        };
        let before = momentum(&simulation);
        finish(&mut simulation);
        let state = &simulation.state;
        let way: Vec3 = state
            .unwrapped_positions()
            .iter()
            .zip(&start)
            .zip(&state.particles.mass)
            .map(|((now, then), m)| (now - then) * *m)
            .sum();
        let expected = before * state.clock.time();
        println!("cells passed: {:?}", state.particles.image);
        assert!(state.particles.image.iter().flatten().any(|cells| cells.abs() > 127));
        // Tolerance: rounding errors in 1e5 steps of numbers of the size of the result.
        assert!((momentum(&simulation) - before).norm() < 1e-10 * before.norm());
        assert!((way - expected).norm() < 1e-10 * expected.norm(), "{way} {expected}");
        assert!(state.particles.position.iter().all(|x| x.amax() < 0.4));
    });
}

/// A run that is interrupted between two wrappings and resumed gives the same bits.
#[test]
fn a_resumed_flow_has_the_same_bits() {
    on_threads(1, || {
        let text = passing("[stop]\nsteps = 6000");
        let mut whole = started(made(&text));
        let mut saved = None;
        while whole.advance().unwrap().stopped.is_none() {
            if whole.state.clock.step == 4700 {
                saved = Some(ColumnStore::of(&whole.state).unwrap());
            }
        }
        let Assembly { mut state, model, schedule, .. } = made(&text);
        state.read(&mut saved.unwrap()).unwrap();
        assert!(state.particles.image.iter().flatten().any(|cells| *cells != 0), "no particle was wrapped before");
        let mut resumed = Simulation::new(state, model, schedule).unwrap();
        finish(&mut resumed);
        assert_eq!(state_hash(&whole.state).unwrap(), state_hash(&resumed.state).unwrap());
    });
}

/// Particles that start two hundred cells away interact as if they started inside the cell.
#[test]
fn particles_that_start_far_away_are_wrapped_into_the_cell() {
    on_threads(1, || {
        let text = |x: f64| {
            format!(
                "version = 1\n[packing]\nkind = \"spheres\"\nspheres = [[0, 0, 0, 1e-3], [{x:?}, 0, 0, 1e-3]]\n\
                 cell = [10e-3, 10e-3, 10e-3]\n{GRAINS}\n[stop]\nsteps = 200\n\
                 [[set]]\nname = \"b\"\nselection = {{ kind = \"ids\", ids = [1] }}\n\
                 [[initial]]\nset = \"b\"\nvelocity = [-1, 0, 0]\n"
            )
        };
        let speed = |x: f64| {
            let mut simulation = started(made(&text(x)));
            finish(&mut simulation);
            simulation.state.particles.velocity[1].x
        };
        let (home, far) = (speed(2.002e-3), speed(2.002002));
        // The distance of the far particles is known to 4e-16 m, at an overlap of 1e-5 m.
        assert!(home > -0.99 && (far - home).abs() < 1e-9, "{home} {far}");
    });
}
