//! A user-defined contact law, outside the library: a linear spring that pulls until it snaps off.
//!
//! ```text
//! f_n = k u                 while the particles hold each other: from the first touch (u = 0) until u = F_c/k
//! f_n = 0                   otherwise
//! ```
//!
//! `u` is the elongation (m, negative while the particles overlap), `k` the stiffness (N/m), `F_c` the pull-off force (N);
//! there is no friction. A pull-off force of `F_c` is the simplest form of adhesion, as in wet or sintered powders.
//!
//! The example checks the law with the conformance suite, then lets two spheres collide and pull each other, and
//! compares the largest tension with `F_c` and the speed after the collision with the value that follows from the
//! energy lost at pull-off, `½ m v² = ½ m v₀² − F_c²/2k` (m: reduced mass). The tutorial "Write your own law" makes it
//! a law of the library.
//!
//! Run: `cargo run --release -p concordem --example custom_law`

use concordem::conformance::{Native, Properties, Station, Subject, Window, check};
use concordem::kinematics::PointKinematics;
use concordem::law::{ColumnUse, ContactGeometry, ContactLaw, EnergySplit, Given, Response, Stiffness};
use concordem::math::Vec3;
use concordem::solver::{Model, PairCoefficients, Solver};
use concordem::state::contacts::ContactBlock;
use concordem::state::{Particles, Sphere, State};

/// Parameters: one value for each pair of materials.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Adhesive {
    /// Stiffness `k`, N/m.
    stiffness: f64,
    /// Pull-off force `F_c`, N.
    pull_off: f64,
}

concordem::law_state! {
    /// History of an [`Adhesive`] contact.
    pub struct AdhesiveState {
        /// 1 since the particles touched, 0 before.
        holding: f64, "1", Even;
    }
}

impl ContactLaw for Adhesive {
    type State = AdhesiveState;
    type Kinematics = PointKinematics;
    const NAME: &'static str = "adhesive";

    /// The straight form remembers, and integrates the step of the touch; it reads no masses and dissipates nothing.
    const COLUMNS: Option<ColumnUse> = Some(ColumnUse { history: true, integration: true, ..ColumnUse::ELASTIC });

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
            // What was stored is lost; the trapezoidal rule adds half of the work of the last step.
            energy.damage = 0.5 * k * before * before;
            energy.integration = 0.5 * k * before * (now - before);
        } else if held {
            energy.integration = 0.5 * k * before * now;
        }
        Response::opened(energy)
    }

    /// A contact that holds; see `respond`. Without branches, so that the solver evaluates 16 contacts at once.
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
        // Tension is positive: the force on A points to B.
        let mut response = Response::of_force(normal * (k * now), AdhesiveState { holding: 1.0 });
        response.energy.stored_normal = 0.5 * k * now * now;
        // The spring acts from the touch on, which lies within the step in which the contact begins.
        response.energy.integration = if held { 0.0 } else { -0.5 * k * now * before };
        (response, holds)
    }

    /// Stiffness for the time step bound.
    fn stiffness(&self, _geometry: &ContactGeometry) -> Stiffness {
        Stiffness { normal: self.stiffness, ..Stiffness::default() }
    }
}

/// Runs the conformance suite: action and reaction, objectivity, energy balance, extremes, and the claims of the law.
fn conformance(law: Adhesive) {
    let report = check(&Subject {
        name: "adhesive contact",
        host: Native(law),
        geometry: ContactGeometry {
            reference_length: 2.0,
            area: 1.0,
            radius_a: 0.8,
            radius_b: 1.2,
            mass_a: 1.0,
            mass_b: 2.0,
        },
        bonded: false,
        properties: Properties {
            conservative_normal: true,
            conservative_shear: true,
            dissipation_nonnegative: true,
            // The force jumps from F_c to 0; the suite checks that it does.
            continuous_failure: false,
            brittle: false,
        },
        elastic: Window { elongation: [-0.4, 0.0], shear: 0.5 },
        inelastic: Window { elongation: [-0.4, 0.4], shear: 0.5 },
        // No shear offset, because the law has no shear force.
        held: Station { elongation: -0.3, ..Station::default() },
        failure: 0.4,
        dt: 1e-3,
    });
    println!("{report}");
    assert!(report.passed(), "the law does not conform");
}

/// Lets two spheres of mass 1 and radius 1 collide at the speed `speed`; returns the largest tension between them (N)
/// and the speed at which they separate (m/s).
fn collide(law: Adhesive, speed: f64, dt: f64) -> (f64, f64) {
    let mut particles = Particles::default();
    for x in [-1.001, 1.001] {
        particles.push(Sphere { position: Vec3::new(x, 0.0, 0.0), radius: 1.0 }, 0, 1.0, 0.4);
    }
    particles.velocity = vec![Vec3::x() * (0.5 * speed), Vec3::x() * (-0.5 * speed)];
    // Row 0 of the coefficients is for material 0 with material 0.
    let mut rows = PairCoefficients::new(1);
    rows.set(0, 0, 0);
    let mut state = State { particles, contacts: Some(Box::new(ContactBlock::new(vec![law]))), ..State::default() };
    state.clock.dt = dt;
    let mut solver = Solver::new(Model { contact_rows: rows, ..Model::default() }, &mut state).expect("a sound model");
    let (mut tension, mut touched): (f64, bool) = (0.0, false);
    for _ in 0..10_000_000 {
        solver.step(&mut state).expect("a sound step");
        // The force on the left sphere points toward the right one when they pull each other.
        let force = solver.forces()[0].x;
        tension = tension.max(force);
        let apart = state.particles.position[1].x - state.particles.position[0].x - 2.0;
        touched |= apart < 0.0;
        if touched && apart > 0.0 && force == 0.0 {
            break;
        }
    }
    (tension, state.particles.velocity[1].x - state.particles.velocity[0].x)
}

// Compiles the solver's loops over contacts for this law. For registered laws, the registry does this.
concordem::solver::compile_loops!(Adhesive);

fn main() {
    let law = Adhesive { stiffness: 1e4, pull_off: 2e3 };
    conformance(law);

    let law = Adhesive { stiffness: 1e4, pull_off: 20.0 };
    let speed = 0.5;
    let (tension, parting) = collide(law, speed, 1e-6);
    // Reduced mass ½ kg: ½ m v² = ½ m v₀² − F_c²/2k.
    let expected = (speed * speed - law.pull_off * law.pull_off / law.stiffness / 0.5).sqrt();
    println!("largest tension {tension:.4} N, pull-off force {} N", law.pull_off);
    println!("speed after the collision {parting:.6} m/s, closed form {expected:.6} m/s");
    // The contact snaps off in the step in which the tension would exceed F_c. In a step of 1 µs the spheres separate by
    // at most 0.5 µm, so the tension grows by at most 0.005 N.
    assert!(tension <= law.pull_off && tension > law.pull_off - 5e-3, "{tension}");
    // Error of one step: an energy of F_c times 0.5 µm.
    assert!((parting - expected).abs() < 1e-4, "{parting} {expected}");
}
