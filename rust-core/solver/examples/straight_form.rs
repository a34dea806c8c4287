//! How much faster the straight form makes a law: the adhesive spheres of the tutorial "Write your own law", with it and without.
//!
//! A cubic lattice of 27,000 spheres that overlap a little and move at random; all contacts hold. Runs alternate, and the states of both laws
//! must be equal to the last bit. Without a straight form, the solver still measures the motion in columns; a run with the first-order measure,
//! which has no columns, shows what a contact costs that is stepped alone.
//!
//! Run: `cargo run --release -p concordem-solver --example straight_form [ROUNDS [RUN]]`. RUN, 0 to 3, is the only one then, whose instructions
//! valgrind counts.

use std::time::Instant;

use concordem_contact::kinematics::{MotionMeasure, PointKinematics};
use concordem_contact::law::{ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Response, Stiffness};
use concordem_contact::math::Vec3;
use concordem_solver::forces::LawLoops;
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver};

/// The law of the tutorial; with `STRAIGHT`, the solver may use its straight form.
#[derive(Debug, Clone, Copy)]
struct Adhesive<const STRAIGHT: bool> {
    /// N/m.
    stiffness: f64,
    /// N.
    pull_off: f64,
}

concordem_contact::law_state! {
    /// History of an [`Adhesive`] contact.
    pub struct AdhesiveState {
        /// 1 since the particles touched, 0 before.
        holding: f64, "1", Even;
    }
}

impl<const STRAIGHT: bool> ContactLaw for Adhesive<STRAIGHT> {
    type State = AdhesiveState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "adhesive";
    const COLUMNS: Option<ColumnUse> =
        if STRAIGHT { Some(ColumnUse { history: true, integration: true, ..ColumnUse::ELASTIC }) } else { None };

    #[inline(always)]
    fn respond(&self, kinematics: &PointKinematics, old: &AdhesiveState, dt: f64) -> Response<AdhesiveState> {
        let (response, holds) = self.straight(kinematics, old, &Given::NOTHING, dt);
        if holds {
            return response;
        }
        let PointKinematics { elongation: now, elongation_old: before, .. } = *kinematics;
        let (k, held) = (self.stiffness, old.holding == 1.0);
        let mut energy = EnergySplit::default();
        if held && before > 0.0 {
            energy.damage = 0.5 * k * before * before;
            energy.integration = 0.5 * k * before * (now - before);
        } else if held {
            energy.integration = 0.5 * k * before * now;
        }
        Response::opened(energy)
    }

    #[inline(always)]
    fn straight(
        &self,
        kinematics: &PointKinematics,
        old: &AdhesiveState,
        _given: &Given,
        _dt: f64,
    ) -> (Response<AdhesiveState>, bool) {
        let PointKinematics { elongation: now, elongation_old: before, normal, .. } = *kinematics;
        let (k, held) = (self.stiffness, old.holding == 1.0);
        let holds = if held { k * now < self.pull_off } else { now < 0.0 };
        let mut response = Response::of_force(normal * (k * now), AdhesiveState { holding: 1.0 });
        response.energy.stored_normal = 0.5 * k * now * now;
        response.energy.integration = if held { 0.0 } else { -0.5 * k * now * before };
        (response, holds)
    }

    fn stiffness(&self, _geometry: &ContactGeometry) -> Stiffness {
        Stiffness { normal: self.stiffness, ..Stiffness::default() }
    }
}

concordem_solver::compile_loops!(Adhesive<true>, Adhesive<false>);

/// Spheres along an edge.
const SIDE: u32 = 30;

/// A lattice of spheres with its solver.
struct Run {
    state: State,
    solver: Solver,
}

impl Run {
    fn new<const STRAIGHT: bool>(spacing: f64, mode: MotionMeasure) -> Self
    where
        Adhesive<STRAIGHT>: LawLoops,
    {
        let mut particles = Particles::default();
        for i in 0..SIDE * SIDE * SIDE {
            let place = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE].map(|k| spacing * f64::from(k));
            particles.push(Sphere { position: Vec3::from(place), radius: 1.0 }, 0, 1.0, 0.4);
        }
        let number = |k: usize| (k * 7919 % 1000) as f64 * 2e-6 - 1e-3;
        particles.velocity =
            (0..particles.len()).map(|p| Vec3::new(number(3 * p), number(3 * p + 1), number(3 * p + 2))).collect();
        let mut rows = PairCoefficients::new(1);
        rows.set(0, 0, 0);
        let law = Adhesive::<STRAIGHT> { stiffness: 1e4, pull_off: 2e3 };
        let mut state = State { particles, contacts: Some(Box::new(ContactBlock::new(vec![law]))), ..State::default() };
        state.clock.dt = 1e-4;
        let model = Model { mode, contact_rows: rows, ..Model::default() };
        let solver = Solver::new(model, &mut state).expect("a sound model");
        Self { state, solver }
    }

    /// Seconds per step without a sample, of `steps`.
    fn time(&mut self, steps: u32) -> f64 {
        let start = Instant::now();
        for _ in 0..steps {
            self.solver.step_with(&mut self.state, false).expect("a sound step");
        }
        start.elapsed().as_secs_f64() / f64::from(steps)
    }
}

fn main() {
    let number = |k: usize| std::env::args().nth(k).map(|word| word.parse::<usize>().expect("a number"));
    let (rounds, only) = (number(1).unwrap_or(20), number(2));
    // One thread, or else the measure would be that of memory and of other programs.
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    pool.install(|| {
        let finite = MotionMeasure::Finite;
        let mut runs = [
            Run::new::<true>(1.99, finite),
            Run::new::<false>(1.99, finite),
            Run::new::<false>(1.99, MotionMeasure::FirstOrder),
            // The same spheres far apart: what a step costs beside its contacts.
            Run::new::<true>(4.0, finite),
        ];
        if let Some(only) = only {
            runs[only].time(20 * u32::try_from(rounds).expect("few rounds"));
            return;
        }
        // Runs alternate, and the fastest round counts: what else the machine does only adds.
        let mut fastest = [f64::INFINITY; 4];
        for round in 0..=rounds {
            let times = runs.each_mut().map(|run| run.time(20));
            // The first steps make lists.
            if round > 0 {
                fastest = std::array::from_fn(|k| fastest[k].min(times[k]));
            }
        }
        assert!(runs[0].state.particles.position == runs[1].state.particles.position, "equal to the last bit");
        let [straight, measured, alone, rest] = fastest.map(|time| time * 1e3);
        println!("a step in ms: {straight:.3} with the straight form, {measured:.3} without it, {alone:.3} one by one, {rest:.3} without contacts");
        for (name, other) in [("without it", measured), ("one by one", alone)] {
            let (contacts, steps) = ((other - rest) / (straight - rest), other / straight);
            println!("{name}, contacts take {contacts:.2} times as long, whole steps {steps:.2} times");
        }
    });
}
