//! A law without memory: it has no columns.

use concordem_contact::kinematics::PointKinematics;
use concordem_contact::law::{ContactGeometry, ContactLaw, EnergySplit, Response, Status, Stiffness};
use concordem_contact::math::Vec3;
use concordem_solver::state::columns::ColumnStore;
use concordem_solver::{Model, Solver, compile_loops};

use super::block_of;

/// A spring along the normal, without shear force and without memory.
#[derive(Debug, Clone, Copy)]
struct Spring {
    /// N/m.
    stiffness: f64,
}

concordem_contact::law_state! {
    /// History of a [`Spring`].
    pub struct NoMemory {}
}

impl ContactLaw for Spring {
    type State = NoMemory;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "spring";

    fn respond(&self, kinematics: &PointKinematics, _: &NoMemory, _: f64) -> Response<NoMemory> {
        let force = self.stiffness * kinematics.elongation;
        Response {
            force: kinematics.normal * force,
            moment: Vec3::zeros(),
            state: NoMemory {},
            status: Status::Lives,
            energy: EnergySplit { stored_normal: 0.5 * force * kinematics.elongation, ..EnergySplit::default() },
        }
    }

    fn stiffness(&self, _: &ContactGeometry) -> Stiffness {
        Stiffness { normal: self.stiffness, ..Stiffness::default() }
    }
}

compile_loops!(Spring);

/// A law without memory has no numbers in its columns: bits do not depend on threads, a stored state continues, and energy is conserved.
#[test]
fn a_law_without_memory_runs_and_continues() {
    for periodic in [false, true] {
        let build = || {
            let mut state = block_of(6, vec![Spring { stiffness: 1.0 }], periodic);
            for (p, velocity) in state.particles.velocity.iter_mut().enumerate() {
                *velocity = Vec3::from_fn(|axis, _| ((p * 7919 + axis * 104_729) % 1000) as f64 * 1e-8 - 5e-6);
            }
            state.clock.dt = 0.05;
            state
        };
        let run = |threads: usize, restart: bool| {
            rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap().install(|| {
                let mut state = build();
                let mut solver = Solver::new(Model::default(), &mut state).unwrap();
                for step in 0..400 {
                    if restart && step == 200 {
                        let mut store = ColumnStore::of(&state).unwrap();
                        state = build();
                        state.read(&mut store).unwrap();
                        solver = Solver::new(Model::default(), &mut state).unwrap();
                    }
                    solver.step_with(&mut state, step % 7 == 0).unwrap();
                }
                solver.step(&mut state).unwrap();
                (ColumnStore::of(&state).unwrap(), state.ledger.residual() / state.ledger.initial)
            })
        };
        let (one, residual) = run(1, false);
        // Strains of 1e-5 in steps of a twentieth of the shortest period: the geometric error is below both, as in
        // `free_block_conserves`.
        assert!(residual.abs() < 1e-7, "periodic {periodic}: {residual:e}");
        for (threads, restart) in [(2, false), (3, true)] {
            assert!(one == run(threads, restart).0, "periodic {periodic}, {threads} threads, restart {restart}");
        }
    }
}
