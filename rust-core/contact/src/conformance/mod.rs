//! Conformance suite: properties that every contact law must have, in every host that runs it.
//!
//! Two spheres move along a prescribed path. [`sphere_sphere::measure`](crate::kinematics::sphere_sphere::measure) measures
//! each step in one of its modes, a [`Host`] evaluates the law, and the suite checks the responses:
//!
//! * **action and reaction**: the arms of both sides add up to the branch vector, so moments balance about any point;
//! * **exchange of A and B**: bit for bit by the law, to rounding by kinematics and law together;
//! * **objectivity** under finite rigid motion, rotations by 2π included: to rounding in the finite mode; for the
//!   first-order modes the suite measures the error of a rotation and its order in the step;
//! * **declared properties** ([`Properties`]): random paths prove each declared property, and a measured violation shows
//!   each undeclared one, so declarations are neither too strong nor too weak;
//! * **energy**: the trapezoidal work of random paths equals the change of the stored energy, plus the dissipation, plus the
//!   integration term;
//! * **determinism**: same inputs, same bits;
//! * **straight form**: where [`ContactLaw::straight`] is certain, it has the bits of the response;
//! * **extremes**: no NaN and no infinity at tiny and huge steps, zero overlap, huge strains;
//! * **atlas**: tension, compression, shear, twist, cyclic and mixed paths against closed forms ([`atlas`]).
//!
//! [`frame`] is the suite for laws with moments. A test describes its law as a [`Subject`]:
//!
//! ```
//! use concordem_contact::conformance::{Native, Properties, Station, Subject, Window, check};
//! use concordem_contact::law::{ContactGeometry, LinearBond};
//!
//! let report = check(&Subject {
//!     name: "unbreakable bond",
//!     host: Native(LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap()),
//!     geometry: ContactGeometry {
//!         reference_length: 2.0, area: 1.0, radius_a: 0.8, radius_b: 1.2, mass_a: 1.0, mass_b: 2.0,
//!     },
//!     bonded: true,
//!     properties: Properties { conservative_normal: true, conservative_shear: true,
//!         dissipation_nonnegative: true, continuous_failure: true, brittle: false },
//!     elastic: Window { elongation: [-0.4, 0.6], shear: 0.5 },
//!     inelastic: Window { elongation: [-0.4, 0.6], shear: 0.5 },
//!     held: Station { elongation: 0.3, shear: [0.2, -0.3], twist: 0.0 },
//!     failure: 1.0,
//!     dt: 1e-3,
//! });
//! assert!(report.passed(), "{report}");
//! ```

mod atlas;
mod driver;
mod energy;
mod exchange;
mod failure;
pub mod frame;
mod objectivity;
mod path;
mod report;
mod robustness;
mod straight;
#[cfg(test)]
mod tests;

pub use atlas::{Observed, atlas, atlas_paths};
pub use driver::{Record, drive};
pub use path::{Path, Pose, Random, RigidMotion, at_rest, legs};
pub use report::{Bound, Finding, Report};
pub use straight::Outcome;
#[cfg(test)]
pub(crate) use tests::GEOMETRY;

use crate::geometry::ContactGeometry;
use crate::kinematics::{MotionMeasure, PointKinematics};
use crate::law::{ContactLaw, LawState, Response};
use crate::math::Vec3;
use driver::{Ledger, clear_void_parts, drive_with};
use path::random_motion;

/// Program that evaluates a law: this library, or a host code behind its own interface.
pub trait Host {
    /// History of the contact.
    type State: LawState;

    /// Response of the law to a step.
    fn respond(&self, kinematics: &PointKinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// [`ContactLaw::TRANSMITS_MOMENT`].
    fn transmits_moment(&self) -> bool {
        true
    }

    /// What the solver does with this step in columns ([`ContactLaw::straight`]); `None` without columns.
    fn straight(
        &self,
        measure: MotionMeasure,
        kinematics: &PointKinematics,
        old: &Self::State,
        dt: f64,
    ) -> Option<Outcome<Self::State>> {
        let _ = (measure, kinematics, old, dt);
        None
    }

    /// Response for the pair with A and B exchanged: the same law, unless a parameter belongs to one particle.
    fn respond_exchanged(&self, kinematics: &PointKinematics, old: &Self::State, dt: f64) -> Response<Self::State> {
        self.respond(kinematics, old, dt)
    }
}

/// A law evaluated by this library.
#[derive(Debug, Clone, Copy)]
pub struct Native<L>(pub L);

impl<L: ContactLaw<Kinematics = PointKinematics>> Host for Native<L> {
    type State = L::State;

    fn respond(&self, kinematics: &PointKinematics, old: &L::State, dt: f64) -> Response<L::State> {
        self.0.respond(kinematics, old, dt)
    }

    fn transmits_moment(&self) -> bool {
        L::TRANSMITS_MOMENT
    }

    fn straight(
        &self,
        measure: MotionMeasure,
        kinematics: &PointKinematics,
        old: &L::State,
        dt: f64,
    ) -> Option<Outcome<L::State>> {
        straight::outcome(&self.0, measure, kinematics, old, dt)
    }

    fn respond_exchanged(&self, kinematics: &PointKinematics, old: &L::State, dt: f64) -> Response<L::State> {
        self.0.exchanged().respond(kinematics, old, dt)
    }
}

/// Properties of a law with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Properties {
    /// Closed paths of the length alone, within [`Subject::elastic`], dissipate nothing.
    pub conservative_normal: bool,
    /// Closed paths of length and shear, within [`Subject::elastic`], dissipate nothing.
    pub conservative_shear: bool,
    /// Damage, friction, and viscous dissipation of every step are not negative.
    pub dissipation_nonnegative: bool,
    /// Pulled to failure, the force is a continuous function of the elongation.
    pub continuous_failure: bool,
    /// Pulled to failure, the bond breaks in one step and releases its stored energy as damage.
    pub brittle: bool,
}

/// Range of deformations.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Window {
    /// Elongation `length − reference_length`, from and to, m.
    pub elongation: [f64; 2],
    /// Largest shear displacement in each of the two tangential directions, m.
    pub shear: f64,
}

/// Relative deformation of the pair at one point of a path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Station {
    /// Elongation `length − reference_length`, m.
    pub elongation: f64,
    /// Shear displacement of B relative to A in the two tangential directions, m.
    pub shear: [f64; 2],
    /// Rotation of B relative to A about the normal, rad.
    pub twist: f64,
}

/// A law under test: its contact, its declared properties, and deformations for the checks.
#[derive(Debug, Clone)]
pub struct Subject<H> {
    /// Name for the report.
    pub name: &'static str,
    /// Evaluates the law.
    pub host: H,
    /// The contact.
    pub geometry: ContactGeometry,
    /// Whether it is a bond.
    pub bonded: bool,
    /// Declared properties.
    pub properties: Properties,
    /// Deformations in which the declared properties hold.
    pub elastic: Window,
    /// Deformations with all kinds of dissipation, in which the law violates every undeclared property.
    pub inelastic: Window,
    /// A deformation, with shear, in which the contact can be held without sliding or breaking.
    pub held: Station,
    /// An elongation at which the contact has failed or opened, m.
    pub failure: f64,
    /// Duration of a step, s.
    pub dt: f64,
}

const KNOTS: usize = 8;
const STEPS: usize = 40;
const SEEDS: u64 = 5;
const PULL_STEPS: usize = 400;

const MODES: [MotionMeasure; 4] =
    [MotionMeasure::Finite, MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting];

/// Run all checks except the atlas, which needs closed forms.
pub fn check<H: Host>(subject: &Subject<H>) -> Report {
    let mut findings = Vec::new();
    exchange::action_and_reaction(subject, &mut findings);
    exchange::exchange(subject, &mut findings);
    objectivity::objectivity(subject, &mut findings);
    energy::conservation(subject, &mut findings);
    energy::dissipation(subject, &mut findings);
    failure::failure(subject, &mut findings);
    energy::energy_balance(subject, &mut findings);
    robustness::determinism(subject, &mut findings);
    straight::straight(subject, &mut findings);
    robustness::extremes(subject, &mut findings);
    Report { subject: subject.name.to_owned(), findings }
}

impl<H: Host> Subject<H> {
    /// Relative change of a deformation by rounding of positions and orientations in `steps` steps: a few roundings of
    /// the length per step, which add up like a random walk.
    fn rounding(&self, deformation: f64, steps: usize) -> f64 {
        let length = self.geometry.radius_a + self.geometry.radius_b + self.geometry.reference_length;
        4.0 * f64::EPSILON * length * (steps as f64).sqrt() / deformation
    }

    /// Random closed path within a window; with `sheared` off only the length changes.
    fn closed_path(&self, window: &Window, sheared: bool, seed: u64, steps: usize) -> Vec<Station> {
        let mut random = Random::new(seed);
        let shear = if sheared { window.shear } else { 0.0 };
        // Twist up to the angle whose displacement at the surface equals the largest shear.
        let twist = 2.0 * shear / self.geometry.reference_length;
        // Start and end undeformed, because shear counts from the start.
        let mut knots = vec![Station::default()];
        knots.extend((1..KNOTS).map(|_| Station {
            elongation: random.uniform(window.elongation[0], window.elongation[1]),
            shear: [random.uniform(-shear, shear), random.uniform(-shear, shear)],
            twist: random.uniform(-twist, twist),
        }));
        // Visit both ends of the window in every path.
        knots[1].elongation = window.elongation[0];
        knots[2].elongation = window.elongation[1];
        knots.push(Station::default());
        legs(&knots, steps)
    }

    fn path(&self, stations: &[Station]) -> Path {
        Path::new(&self.geometry, stations, &at_rest)
    }

    fn moving_path(&self, stations: &[Station], seed: u64) -> Path {
        Path::new(&self.geometry, stations, &random_motion(seed, self.geometry.reference_length))
    }
}

impl Window {
    /// The smaller one of the largest elongation and the largest shear, m: the scale of rounding errors.
    fn smallest(&self) -> f64 {
        let elongation = self.elongation[0].abs().max(self.elongation[1].abs());
        if self.shear > 0.0 { elongation.min(self.shear) } else { elongation }
    }
}

fn largest(values: impl Iterator<Item = f64>) -> f64 {
    // Keep NaN, which f64::max would drop.
    values.fold(0.0, |found, value| if value > found || value.is_nan() { value } else { found })
}

fn norm(force: &[f64; 3]) -> f64 {
    Vec3::from(*force).norm()
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (Vec3::from(*a) - Vec3::from(*b)).norm()
}
