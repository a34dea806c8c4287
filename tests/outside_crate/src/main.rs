//! A law outside the library: a linear spring that pushes, with a viscous dashpot. It remembers its largest overlap.
//!
//! Two spheres collide in a loop of this program and in the solver. Both give the same bits, and the restitution of the closed form.

#![forbid(unsafe_code)]

use concordem_contact::kinematics::PointKinematics;
use concordem_contact::law::{ContactGeometry, ContactLaw, EnergySplit, Response, Stiffness};
use concordem_contact::math::Vec3;
use concordem_contact::own_loop::{PairContact, Particle};
use concordem_solver::state::contacts::ContactBlock;
use concordem_solver::state::{Particles, Sphere, State};
use concordem_solver::{Model, PairCoefficients, Solver};

/// Stiffness `k` (N/m) and viscosity `c` (N·s/m).
#[derive(Debug, Clone, Copy, PartialEq)]
struct Dashpot {
    k: f64,
    c: f64,
}

concordem_contact::law_state! {
    /// History of a [`Dashpot`].
    pub struct DashpotState {
        /// Largest overlap since the touch.
        largest_overlap: f64, "m", Even;
        /// Force of the last step.
        force: concordem_contact::math::Vec3, "N", Odd;
    }
}

impl ContactLaw for Dashpot {
    type State = DashpotState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "dashpot";

    fn respond(&self, kinematics: &PointKinematics, old: &DashpotState, dt: f64) -> Response<DashpotState> {
        let PointKinematics { elongation: now, elongation_old: before, normal, .. } = *kinematics;
        if now >= 0.0 {
            return Response::opened(EnergySplit::default());
        }
        let force = normal * (self.k * now + self.c * (now - before) / dt);
        Response::of_force(force, DashpotState { largest_overlap: old.largest_overlap.max(-now), force })
    }

    fn stiffness(&self, _geometry: &ContactGeometry) -> Stiffness {
        Stiffness { normal: self.k, ..Stiffness::default() }
    }
}

concordem_solver::compile_loops!(Dashpot);

const RADIUS: f64 = 0.01;
const MASS: f64 = 0.01;
const DT: f64 = 1e-6;
const STEPS: usize = 4_000;
const START: [f64; 2] = [0.0, 2.0 * RADIUS + 1e-5];

/// Velocities after the collision, and the largest overlap, in a loop of this program.
fn in_own_loop(law: Dashpot) -> ([Vec3; 2], f64) {
    let mut position = START.map(|x| Vec3::x() * x);
    let mut velocity = [Vec3::x(), Vec3::zeros()];
    let (mut contact, mut largest) = (PairContact::default(), 0.0_f64);
    for _ in 0..STEPS {
        let particle = |k: usize| Particle::new(position[k], velocity[k], RADIUS, MASS);
        let on = contact.respond(&law, &particle(0), &particle(1), DT);
        largest = largest.max(contact.history().largest_overlap);
        for (k, force) in [on.a.force, on.b.force].into_iter().enumerate() {
            velocity[k] += force * (DT / MASS);
            position[k] += velocity[k] * DT;
        }
    }
    assert!(!contact.is_active() && !contact.is_broken());
    (velocity, largest)
}

/// Velocities after the collision in the solver.
fn in_the_solver(law: Dashpot) -> [Vec3; 2] {
    let mut particles = Particles::default();
    for x in START {
        particles.push(Sphere { position: Vec3::x() * x, radius: RADIUS }, 0, MASS, 0.4 * MASS * RADIUS * RADIUS);
    }
    particles.velocity[0] = Vec3::x();
    let mut state = State { particles, contacts: Some(Box::new(ContactBlock::new(vec![law]))), ..State::default() };
    state.clock.dt = DT;
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut solver = Solver::new(Model { contact_rows: rows, ..Model::default() }, &mut state).unwrap();
    for _ in 0..STEPS {
        solver.step(&mut state).unwrap();
    }
    [state.particles.velocity[0], state.particles.velocity[1]]
}

fn main() {
    let law = Dashpot { k: 1e5, c: 3.0 };
    let ([a, b], largest) = in_own_loop(law);
    let solver = in_the_solver(law);
    // A dashpot pulls at the end; the contact ends at zero overlap: e = exp(−π ζ/√(1−ζ²)), ζ = c/(2 √(k m)), m = MASS/2.
    let ratio = law.c / (2.0 * (law.k * MASS / 2.0).sqrt());
    let restitution = (-std::f64::consts::PI * ratio / (1.0 - ratio * ratio).sqrt()).exp();
    println!("restitution {:.6}, closed form {restitution:.6}, largest overlap {largest:.3e} m", b.x - a.x);
    println!("in the solver {:.6}", solver[1].x - solver[0].x);
    // A collision takes some 700 steps, over which the touch and the parting are rounded to one.
    assert!((b.x - a.x - restitution).abs() < 2e-3);
    assert_eq!([a, b], solver);
}
