//! The conformance suite: what every contact law must show, through whichever host runs it.
//!
//! Two spheres are led along a prescribed path; [`crate::kinematics::sphere_sphere::measure`] measures each step in
//! one of its modes, a [`Host`] answers, and the answers are checked:
//!
//! * **action and reaction**: the arms of both sides add up to the branch, so that the moments balance about any point;
//! * **exchange of A and B**: bit for bit by the law, to rounding by kinematics and law together;
//! * **objectivity** under finite rigid motion, turns by 2π included: to rounding in the finite mode; in the
//!   first-order modes the error of a turn is measured and its order in the step shown;
//! * **declared properties** ([`Properties`]): each declared one is proven on random paths, each undeclared one
//!   is shown by a measured violation, so that a declaration cannot be too modest either;
//! * **energy**: the trapezoidal work of random paths equals the change of the stored energy, plus what is dissipated,
//!   plus the named integration term;
//! * **determinism**: same inputs, same bits;
//! * **extremes**: no NaN and no infinity at tiny and huge steps, zero overlap, huge strains;
//! * **atlas**: tension, compression, shear, twist, cyclic and mixed paths against closed forms ([`atlas`]).
//!
//! A law joins by describing itself as a [`Subject`]:
//!
//! ```
//! use concordem_contact::law::conformance::{Native, Properties, Station, Subject, Window, check};
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

use super::{ContactGeometry, ContactLaw, EnergySplit, LawState, Response, Status};
use crate::kinematics::sphere_sphere::{ImageShift, Motion, initial_geometry, measure};
use crate::kinematics::{MotionMeasure, PointKinematics, PreviousGeometry, Transport};
use crate::math::{Quat, Vec3, atan2, normalized, quaternion_of_rotation_vector, rotate, sin_cos};
use std::f64::consts::{PI, TAU};
use std::fmt;

/// Whoever runs a law: this library, or a host code behind its own interface.
pub trait Host {
    /// History of the contact.
    type State: LawState;

    /// The law's answer to a step.
    fn respond(&self, kinematics: &PointKinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// The answer for the pair seen with A and B exchanged: the same law, unless a parameter belongs to one particle.
    fn respond_exchanged(&self, kinematics: &PointKinematics, old: &Self::State, dt: f64) -> Response<Self::State> {
        self.respond(kinematics, old, dt)
    }
}

/// A law run by this library.
#[derive(Debug, Clone, Copy)]
pub struct Native<L>(pub L);

impl<L: ContactLaw<Kinematics = PointKinematics>> Host for Native<L> {
    type State = L::State;

    fn respond(&self, kinematics: &PointKinematics, old: &L::State, dt: f64) -> Response<L::State> {
        self.0.respond(kinematics, old, dt)
    }

    fn respond_exchanged(&self, kinematics: &PointKinematics, old: &L::State, dt: f64) -> Response<L::State> {
        self.0.exchanged().respond(kinematics, old, dt)
    }
}

/// What a law promises, with its parameters.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Properties {
    /// Closed paths of the length alone, within [`Subject::elastic`], dissipate nothing.
    pub conservative_normal: bool,
    /// Closed paths of length and shear, within [`Subject::elastic`], dissipate nothing.
    pub conservative_shear: bool,
    /// No step's damage, friction or viscous dissipation is negative.
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

/// Relative deformation of the pair at one instant of a path.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Station {
    /// Elongation `length − reference_length`, m.
    pub elongation: f64,
    /// Shear displacement of B relative to A in the two tangential directions, m.
    pub shear: [f64; 2],
    /// Rotation of B relative to A about the normal, rad.
    pub twist: f64,
}

/// A law, its contact, and what it promises.
#[derive(Debug, Clone)]
pub struct Subject<H> {
    /// Name for the report.
    pub name: &'static str,
    /// Who answers.
    pub host: H,
    /// The contact.
    pub geometry: ContactGeometry,
    /// Whether it is a bond.
    pub bonded: bool,
    /// What the law promises.
    pub properties: Properties,
    /// Deformations in which the declared properties hold.
    pub elastic: Window,
    /// Deformations that bring out all dissipation; undeclared properties are violated in it.
    pub inelastic: Window,
    /// A deformation, with shear, in which the contact can be held without sliding or breaking.
    pub held: Station,
    /// An elongation at which the contact has failed or opened, m.
    pub failure: f64,
    /// Duration of a step, s.
    pub dt: f64,
}

// ---------------------------------------------------------------------------------------------------------------
// Findings

/// One measured figure and its bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What was measured.
    pub check: String,
    /// The figure.
    pub measured: f64,
    /// What it must be.
    pub bound: Bound,
    /// Why the bound is what it is.
    pub reason: &'static str,
}

/// Bound of a [`Finding`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// At most.
    AtMost(f64),
    /// At least.
    AtLeast(f64),
}

impl Finding {
    pub(super) fn at_most(check: impl Into<String>, measured: f64, bound: f64, reason: &'static str) -> Self {
        Self { check: check.into(), measured, bound: Bound::AtMost(bound), reason }
    }

    pub(super) fn at_least(check: impl Into<String>, measured: f64, bound: f64, reason: &'static str) -> Self {
        Self { check: check.into(), measured, bound: Bound::AtLeast(bound), reason }
    }

    /// Whether the bound holds. NaN passes no bound.
    pub fn passed(&self) -> bool {
        match self.bound {
            Bound::AtMost(bound) => self.measured <= bound,
            Bound::AtLeast(bound) => self.measured >= bound,
        }
    }
}

/// All findings about a subject.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// Name of the subject.
    pub subject: String,
    /// The findings, in the order of the checks.
    pub findings: Vec<Finding>,
}

impl Report {
    /// Whether every bound holds.
    pub fn passed(&self) -> bool {
        self.findings.iter().all(Finding::passed)
    }

    /// The findings that fail.
    pub fn failures(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| !finding.passed())
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "conformance of {}", self.subject)?;
        for finding in &self.findings {
            let verdict = if finding.passed() { "ok  " } else { "FAIL" };
            let (sign, bound) = match finding.bound {
                Bound::AtMost(bound) => ("<=", bound),
                Bound::AtLeast(bound) => (">=", bound),
            };
            writeln!(
                f,
                "{verdict} {:<66} {:>10.2e} {sign} {bound:<8.2e} {}",
                finding.check, finding.measured, finding.reason
            )?;
        }
        Ok(())
    }
}

// ---------------------------------------------------------------------------------------------------------------
// Driver

/// Position and orientation of a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Centre, m.
    pub position: Vec3,
    /// Orientation, body → world, unit.
    pub orientation: Quat,
}

/// A rigid motion as a function of the share of the path done: rotation about the origin, then translation.
pub type RigidMotion<'a> = &'a dyn Fn(f64) -> Pose;

/// A path of two spheres, with the axes in which it was prescribed.
#[derive(Debug, Clone)]
pub struct Path {
    /// Poses of A and B at the ends of the steps.
    pub poses: Vec<[Pose; 2]>,
    /// Rotation from the path's own axes (normal = x, tangents y and z) to world axes, at the same instants.
    pub axes: Vec<Quat>,
}

/// No rigid motion.
pub fn at_rest(_share: f64) -> Pose {
    Pose { position: Vec3::zeros(), orientation: Quat::identity() }
}

impl Path {
    /// Lead a pair through `stations`, while a rigid motion carries both.
    ///
    /// Seen from the moving axes the normal stays x; the length is the reference length plus the elongation; shear is
    /// made by turning both spheres about the same tangential axis by an angle whose sine is the shear increment divided
    /// by the mean length of the step, which the finite measure reads back exactly; twist by turning them by opposite
    /// halves about the normal.
    pub fn new(geometry: &ContactGeometry, stations: &[Station], rigid: RigidMotion<'_>) -> Self {
        let mut turned = [Quat::identity(); 2];
        let (mut poses, mut axes) = (Vec::new(), Vec::new());
        let steps = stations.len().saturating_sub(1).max(1) as f64;
        for (index, now) in stations.iter().enumerate() {
            let length = geometry.reference_length + now.elongation;
            if index > 0 {
                let before = &stations[index - 1];
                let mean_length = geometry.reference_length + 0.5 * (before.elongation + now.elongation);
                // sine vectors: tangential parts alike, normal parts opposite, so that the mean twist is zero
                let y = (now.shear[1] - before.shear[1]) / mean_length;
                let z = (before.shear[0] - now.shear[0]) / mean_length;
                let twist = sin_cos(0.5 * (now.twist - before.twist)).0;
                for (orientation, normal) in turned.iter_mut().zip([-twist, twist]) {
                    *orientation = normalized(&(rotation_of_sine(&Vec3::new(normal, y, z)) * *orientation));
                }
            }
            let motion = rigid(index as f64 / steps);
            let place = |x: f64, orientation: Quat| Pose {
                position: rotate(&motion.orientation, &Vec3::new(x, 0.0, 0.0)) + motion.position,
                orientation: normalized(&(motion.orientation * orientation)),
            };
            poses.push([place(0.0, turned[0]), place(length, turned[1])]);
            axes.push(motion.orientation);
        }
        Self { poses, axes }
    }

    /// The same path with the two spheres exchanged.
    fn exchanged(&self) -> Self {
        Self { poses: self.poses.iter().map(|&[a, b]| [b, a]).collect(), axes: self.axes.clone() }
    }
}

/// One step of a driven path.
#[derive(Debug, Clone, Copy)]
pub struct Record<S> {
    /// What the law was told.
    pub kinematics: PointKinematics,
    /// History before the step.
    pub old: S,
    /// What it answered; with the force set to zero where the contact broke or opened, and the stored energies where it
    /// broke.
    pub response: Response<S>,
    /// Sum of the stored energies that a breaking law names as released, J.
    pub released: f64,
    /// Trapezoidal work done on the contact, `½(f_old + f_new)·Δu`, with the old force carried to the present, J.
    pub work: f64,
    /// Force on A in the path's own axes (normal, tangents), N.
    pub force: [f64; 3],
}

/// Lead the pair along `path`. The first record is a step at rest at the start. The driver stops when the bond breaks.
pub fn drive<H: Host>(subject: &Subject<H>, mode: MotionMeasure, path: &Path) -> Vec<Record<H::State>> {
    drive_with(subject, mode, path, subject.dt, false)
}

fn drive_with<H: Host>(
    subject: &Subject<H>,
    mode: MotionMeasure,
    path: &Path,
    dt: f64,
    exchanged: bool,
) -> Vec<Record<H::State>> {
    let mut geometry = subject.geometry;
    if exchanged {
        std::mem::swap(&mut geometry.radius_a, &mut geometry.radius_b);
        std::mem::swap(&mut geometry.mass_a, &mut geometry.mass_b);
    }
    let mut records: Vec<Record<H::State>> = Vec::with_capacity(path.poses.len());
    let Some(first) = path.poses.first() else { return records };
    let mut frame = initial_geometry(&first[0].position, &first[1].position, &Vec3::zeros());
    let mut state = H::State::default();
    let mut previous = *first;
    let mut force_old = Vec3::zeros();
    for (pose, axes) in path.poses.iter().zip(&path.axes) {
        let motion = |before: &Pose, now: &Pose| {
            let turn = normalized(&(now.orientation * before.orientation.conjugate()));
            Motion {
                position: now.position,
                velocity: (now.position - before.position) / dt,
                angular_velocity: rotation_vector(&turn) / dt,
                rotation_increment: turn,
                orientation: now.orientation,
            }
        };
        let (a, b) = (motion(&previous[0], &pose[0]), motion(&previous[1], &pose[1]));
        let kinematics = measure(mode, &a, &b, &ImageShift::default(), &geometry, &frame, subject.bonded, dt);
        let mut response = if exchanged {
            subject.host.respond_exchanged(&kinematics, &state, dt)
        } else {
            subject.host.respond(&kinematics, &state, dt)
        };
        let released = take_away_what_is_void(&mut response);
        let pull_old = force_old.dot(&frame.normal);
        let shear_old = kinematics.transport.apply(&(force_old - frame.normal * pull_old));
        let pull = response.force.dot(&kinematics.normal);
        let work = 0.5 * (pull_old + pull) * (kinematics.length - kinematics.length_old)
            + 0.5 * (shear_old + response.force).dot(&kinematics.shear_increment);
        let local = rotate(&axes.conjugate(), &response.force);
        let record = Record { kinematics, old: state, response, released, work, force: local.into() };
        records.push(record);
        if response.status == Status::Broke {
            break;
        }
        state = response.state;
        force_old = response.force;
        frame = PreviousGeometry { normal: kinematics.normal, length: kinematics.length };
        previous = *pose;
    }
    records
}

/// Rotation vector of a unit quaternion, rad; the shorter way round.
pub(super) fn rotation_vector(q: &Quat) -> Vec3 {
    let (u, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let sine = u.norm();
    if sine > 0.0 { u * (2.0 * atan2(sine, w) / sine) } else { u * 2.0 }
}

/// Clear what a law need not fill in: force and history of a contact that broke or opened, and the stored energies of
/// one that broke, which name how the released energy was stored. Returns their sum, J.
pub(super) fn take_away_what_is_void<S: LawState>(response: &mut Response<S>) -> f64 {
    if response.status != Status::Lives {
        response.force = Vec3::zeros();
        response.moment = Vec3::zeros();
        response.state = S::default();
    }
    if response.status != Status::Broke {
        return 0.0;
    }
    let released = response.energy.stored();
    let EnergySplit { damage, friction, viscous, integration, .. } = response.energy;
    response.energy = EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
    released
}

/// The rotation, by less than a quarter turn, whose axis times the sine of its angle is `sine`; a quarter turn where
/// that is longer than 1.
fn rotation_of_sine(sine: &Vec3) -> Quat {
    let size = sine.norm();
    if size == 0.0 {
        return Quat::identity();
    }
    let angle = atan2(size, ((1.0 - size) * (1.0 + size)).max(0.0).sqrt());
    quaternion_of_rotation_vector(&(sine * (angle / size)))
}

/// Reproducible random numbers (SplitMix64, Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// A sequence of its own for each seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[from, to)`.
    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        from + (to - from) * ((z >> 11) as f64 * (1.0 / (1_u64 << 53) as f64))
    }

    /// A direction, uniform on the sphere.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let norm = v.norm();
            if norm > 0.1 && norm < 1.0 {
                return v / norm;
            }
        }
    }
}

/// Stations from one to the next of `knots`, `steps` per leg, starting and stopping gently (cosine).
pub fn legs(knots: &[Station], steps: usize) -> Vec<Station> {
    let mut stations = Vec::with_capacity(knots.len() * steps + 1);
    stations.extend(knots.first());
    for pair in knots.windows(2) {
        for k in 1..=steps {
            let share = if k == steps { 1.0 } else { 0.5 - 0.5 * sin_cos(PI * k as f64 / steps as f64).1 };
            let mix = |from: f64, to: f64| if k == steps { to } else { from + (to - from) * share };
            stations.push(Station {
                elongation: mix(pair[0].elongation, pair[1].elongation),
                shear: [mix(pair[0].shear[0], pair[1].shear[0]), mix(pair[0].shear[1], pair[1].shear[1])],
                twist: mix(pair[0].twist, pair[1].twist),
            });
        }
    }
    stations
}

/// A random rigid motion that turns by 2π about one axis while turning about another and moving away.
pub(super) fn random_motion(seed: u64, size: f64) -> impl Fn(f64) -> Pose {
    let mut random = Random::new(seed);
    let (axis, other, away) = (random.direction(), random.direction(), random.direction());
    move |share| Pose {
        position: away * (3.0 * size * share),
        orientation: normalized(
            &(quaternion_of_rotation_vector(&(axis * (TAU * share)))
                * quaternion_of_rotation_vector(&(other * (1.5 * share)))),
        ),
    }
}

const KNOTS: usize = 8;
const STEPS: usize = 40;
const SEEDS: u64 = 5;
const PULL_STEPS: usize = 400;

pub(super) fn largest(values: impl Iterator<Item = f64>) -> f64 {
    // a NaN must not be lost, as it would be by f64::max
    values.fold(0.0, |found, value| if value > found || value.is_nan() { value } else { found })
}

fn norm(force: &[f64; 3]) -> f64 {
    Vec3::from(*force).norm()
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    (Vec3::from(*a) - Vec3::from(*b)).norm()
}

/// Sums over the steps of a path after the first record, which is at rest.
#[derive(Debug, Clone, Copy, Default)]
struct Ledger {
    work: f64,
    absolute_work: f64,
    stored_change: f64,
    dissipated: f64,
    integration: f64,
    absolute_integration: f64,
    /// Largest energy of a step that no term explains.
    unexplained: f64,
}

impl Ledger {
    fn of<S: Copy>(records: &[Record<S>]) -> Self {
        let mut sum = Self::default();
        let (Some(first), Some(last)) = (records.first(), records.last()) else { return sum };
        sum.stored_change = last.response.energy.stored() - first.response.energy.stored();
        for record in &records[1..] {
            sum.work += record.work;
            sum.absolute_work += record.work.abs();
            sum.dissipated += record.response.energy.dissipated();
            sum.integration += record.response.energy.integration;
            sum.absolute_integration += record.response.energy.integration.abs();
        }
        sum.unexplained = largest(records.windows(2).map(|pair| {
            let energy = &pair[1].response.energy;
            let change = energy.stored() - pair[0].response.energy.stored();
            (pair[1].work - change - energy.dissipated() - energy.integration).abs()
        }));
        sum
    }
}

impl<H: Host> Subject<H> {
    /// Share of a deformation that rounding of positions and orientations of the size of the pair can change in
    /// `steps` steps: a few roundings of the length per step, which add up like a random walk.
    fn rounding(&self, deformation: f64, steps: usize) -> f64 {
        let length = self.geometry.radius_a + self.geometry.radius_b + self.geometry.reference_length;
        4.0 * f64::EPSILON * length * (steps as f64).sqrt() / deformation
    }

    /// Random closed path within a window; with `sheared` off only the length changes.
    fn closed_path(&self, window: &Window, sheared: bool, seed: u64, steps: usize) -> Vec<Station> {
        let mut random = Random::new(seed);
        let shear = if sheared { window.shear } else { 0.0 };
        // twisted as far as the surfaces are sheared
        let twist = 2.0 * shear / self.geometry.reference_length;
        // starts and ends undeformed: shear is counted from the start
        let mut knots = vec![Station::default()];
        knots.extend((1..KNOTS).map(|_| Station {
            elongation: random.uniform(window.elongation[0], window.elongation[1]),
            shear: [random.uniform(-shear, shear), random.uniform(-shear, shear)],
            twist: random.uniform(-twist, twist),
        }));
        // both ends of the window are visited, whatever the chance
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

// ---------------------------------------------------------------------------------------------------------------
// Checks

const MODES: [MotionMeasure; 4] =
    [MotionMeasure::Finite, MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting];

/// Run every check but the atlas, which needs closed forms.
pub fn check<H: Host>(subject: &Subject<H>) -> Report {
    let mut findings = Vec::new();
    action_and_reaction(subject, &mut findings);
    exchange(subject, &mut findings);
    objectivity(subject, &mut findings);
    conservation(subject, &mut findings);
    dissipation(subject, &mut findings);
    failure(subject, &mut findings);
    energy_balance(subject, &mut findings);
    determinism(subject, &mut findings);
    extremes(subject, &mut findings);
    Report { subject: subject.name.to_owned(), findings }
}

fn action_and_reaction<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let (mut arms, mut moments) = (0.0_f64, 0.0_f64);
    for mode in MODES {
        for seed in 0..SEEDS {
            let path = subject.moving_path(&subject.closed_path(&subject.elastic, true, seed, STEPS), seed);
            let point = Random::new(seed).direction() * subject.geometry.reference_length;
            for (record, [a, b]) in drive(subject, mode, &path).iter().zip(&path.poses) {
                let k = &record.kinematics;
                let (force, moment) = (record.response.force, record.response.moment);
                arms = arms.max((k.arm_a + k.arm_b - k.length).abs() / k.length);
                let from_a = (a.position - point).cross(&force) + (k.normal * k.arm_a).cross(&force) + moment;
                let from_b = (b.position - point).cross(&-force) + (k.normal * -k.arm_b).cross(&-force) - moment;
                let size = force.norm() * ((a.position - point).norm() + (b.position - point).norm() + k.length);
                if size > 0.0 {
                    moments = moments.max((from_a + from_b).norm() / size);
                }
            }
        }
    }
    findings.push(Finding::at_most("arms of A and B add up to the branch, all modes", arms, 1e-15, "few roundings"));
    findings.push(Finding::at_most("moments balance about any point, all modes", moments, 2e-15, "few roundings"));
}

/// The kinematics of the same step with A and B exchanged, exactly.
fn exchanged(k: &PointKinematics) -> PointKinematics {
    let g = k.geometry;
    PointKinematics {
        geometry: ContactGeometry {
            radius_a: g.radius_b,
            radius_b: g.radius_a,
            mass_a: g.mass_b,
            mass_b: g.mass_a,
            ..g
        },
        normal: -k.normal,
        shear_increment: -k.shear_increment,
        arm_a: k.arm_b,
        arm_b: k.arm_a,
        transport: match k.transport {
            Transport::Finite { normal, bisector, cosine, sine } => {
                Transport::Finite { normal: -normal, bisector: -bisector, cosine, sine: -sine }
            }
            same @ Transport::FirstOrder { .. } => same,
        },
        ..*k
    }
}

fn exchange<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let mut different = 0_u32;
    for window in [&subject.elastic, &subject.inelastic] {
        for mode in MODES {
            for seed in 0..SEEDS {
                let path = subject.moving_path(&subject.closed_path(window, true, seed, STEPS), seed);
                for record in drive(subject, mode, &path) {
                    let k = exchanged(&record.kinematics);
                    let mut mirror = subject.host.respond_exchanged(&k, &record.old.swapped(), subject.dt);
                    take_away_what_is_void(&mut mirror);
                    let response = &record.response;
                    let same = mirror.status == response.status
                        && mirror.energy == response.energy
                        && mirror.force == -response.force
                        && mirror.moment == -response.moment
                        && mirror.state == response.state.swapped();
                    different += u32::from(!same);
                }
            }
        }
    }
    findings.push(Finding::at_most(
        "exchange of A and B by the law: steps that differ in any bit",
        f64::from(different),
        0.0,
        "a law has no preferred side",
    ));
    for mode in MODES {
        let mut error = 0.0_f64;
        for seed in 0..SEEDS {
            let path = subject.moving_path(&subject.closed_path(&subject.elastic, true, seed, STEPS), seed);
            let straight = drive(subject, mode, &path);
            let mirrored = drive_with(subject, mode, &path.exchanged(), subject.dt, true);
            let scale = largest(straight.iter().map(|r| norm(&r.force)));
            for (record, mirror) in straight.iter().zip(&mirrored) {
                error = error.max((record.response.force + mirror.response.force).norm() / scale);
            }
            error = error.max((straight.len() as f64 - mirrored.len() as f64).abs());
        }
        findings.push(Finding::at_most(
            format!("exchange of A and B by kinematics and law, {mode:?}"),
            error,
            subject.rounding(subject.elastic.smallest(), KNOTS * STEPS),
            "rounding of positions against the deformation",
        ));
    }
}

impl Window {
    /// The smaller of the largest elongation and the largest shear: the deformation that rounding competes with.
    fn smallest(&self) -> f64 {
        let elongation = self.elongation[0].abs().max(self.elongation[1].abs());
        if self.shear > 0.0 { elongation.min(self.shear) } else { elongation }
    }
}

/// Load to the held deformation, rest for two steps, then carry the pair through a rigid motion in `steps` steps;
/// the largest relative change of the force in the moving axes.
fn change_under<H: Host>(subject: &Subject<H>, mode: MotionMeasure, steps: usize, rigid: RigidMotion<'_>) -> f64 {
    let mut stations = legs(&[Station::default(), subject.held], STEPS);
    let loaded = stations.len() + 2;
    stations.resize(loaded + steps, subject.held);
    let last = (stations.len() - 1) as f64;
    let start = (loaded - 1) as f64;
    let path = Path::new(&subject.geometry, &stations, &|share: f64| {
        rigid(((share * last - start) / steps as f64).clamp(0.0, 1.0))
    });
    let records = drive(subject, mode, &path);
    if records.len() < stations.len() {
        return f64::NAN;
    }
    // the largest change on the way, not the last: after a whole turn everything is back where it was
    let before = &records[loaded - 1].force;
    largest(records[loaded..].iter().map(|record| distance(before, &record.force))) / norm(before)
}

fn turn(axis: Vec3) -> impl Fn(f64) -> Pose {
    move |share| Pose { position: Vec3::zeros(), orientation: quaternion_of_rotation_vector(&(axis * (TAU * share))) }
}

fn objectivity<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    const TURN_STEPS: usize = 100;
    let size = subject.geometry.reference_length;
    let held_shear = Vec3::new(0.0, subject.held.shear[0], subject.held.shear[1]).norm();
    let deformation =
        if held_shear > 0.0 { held_shear.min(subject.held.elongation.abs()) } else { subject.held.elongation.abs() };
    let bound = subject.rounding(deformation, TURN_STEPS).max(1e-12);
    let reason = "1e-12, or rounding of positions against the held deformation where that is larger";

    let shift = |share: f64| Pose { position: Vec3::new(1.0, -2.0, 0.5) * (size * share), ..at_rest(share) };
    findings.push(Finding::at_most(
        "held and translated: change of force, Finite",
        change_under(subject, MotionMeasure::Finite, TURN_STEPS, &shift),
        bound,
        reason,
    ));
    for (name, axis) in [
        ("about a tangent", Vec3::y()),
        ("about the normal", Vec3::x()),
        ("about a random axis", Random::new(7).direction()),
    ] {
        findings.push(Finding::at_most(
            format!("held and turned by 2π {name} in 100 steps: change of force, Finite"),
            change_under(subject, MotionMeasure::Finite, TURN_STEPS, &turn(axis)),
            bound,
            reason,
        ));
    }

    // Deformed while turned: the shear measure of the finite mode is objective to the order of the integrator.
    let difference = |steps: usize| {
        let mut error = 0.0_f64;
        for seed in 0..SEEDS {
            let stations = subject.closed_path(&subject.elastic, true, seed, steps);
            let still = drive(subject, MotionMeasure::Finite, &subject.path(&stations));
            let moving = drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed));
            let scale = largest(still.iter().map(|r| norm(&r.force)));
            let change = largest(still.iter().zip(&moving).map(|(s, m)| distance(&s.force, &m.force) / scale));
            error = largest([error, change, still.len().abs_diff(moving.len()) as f64].into_iter());
        }
        error
    };
    let (coarse, fine) = (difference(STEPS), difference(2 * STEPS));
    let rounding = subject.rounding(subject.elastic.smallest(), KNOTS * STEPS);
    findings.push(Finding::at_most(
        "deformed while turned by 2π in 320 steps: change of force, Finite",
        coarse,
        1e-3,
        "square of the rotation of a step, (2·2π/320)² = 1.5e-3",
    ));
    findings.push(Finding::at_least(
        "order of that change in the step",
        if coarse > 10.0 * rounding { libm::log2(coarse / fine) } else { 2.0 },
        1.8,
        "second order, as the integrator",
    ));

    if held_shear == 0.0 {
        return;
    }
    // First-order transport stretches a vector by √(1+θ²) per step, 2π²/N per turn; the first-order shear increment
    // of a rigid turn is L(θ − sin θ) per step, L(2π)³/(6N²) per turn.
    for mode in [MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting] {
        for (name, axis) in [("about a tangent", Vec3::y()), ("about the normal", Vec3::x())] {
            let [once, twice, four_times] =
                [1000, 2000, 4000].map(|steps| change_under(subject, mode, steps, &turn(axis)));
            let length = subject.geometry.reference_length + subject.held.elongation;
            let expected = TAU * TAU / 2000.0 + TAU * TAU * TAU / 6e6 * length / held_shear;
            findings.push(Finding::at_most(
                format!("held and turned by 2π {name} in 1000 steps, {mode:?}"),
                once,
                1.2 * expected,
                "2π²/N + (2π)³L/(6N² shear), and a fifth for higher orders",
            ));
            findings.push(Finding::at_least(
                format!("order of that error in the step {name}, {mode:?}"),
                libm::log2(twice / four_times),
                0.9,
                "first order",
            ));
        }
    }
}

fn conservation<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    const SMALLEST_VIOLATION: f64 = 1e-6;
    for (name, sheared, declared) in [
        ("length", false, subject.properties.conservative_normal),
        ("shear", true, subject.properties.conservative_shear),
    ] {
        if declared {
            let (mut loss, mut dissipated, mut change) = (0.0_f64, 0.0_f64, 0.0_f64);
            for seed in 0..SEEDS {
                let stations = subject.closed_path(&subject.elastic, sheared, seed, STEPS);
                let records = drive(subject, MotionMeasure::Finite, &subject.path(&stations));
                let ledger = Ledger::of(&records);
                loss = loss.max((ledger.work - ledger.integration).abs() / ledger.absolute_work);
                dissipated = dissipated.max(ledger.dissipated.abs() / ledger.absolute_work);
                let scale = largest(records.iter().map(|r| norm(&r.force)));
                if let (Some(first), Some(last)) = (records.first(), records.last()) {
                    change = change.max(distance(&first.force, &last.force) / scale);
                }
                change = change.max((records.len() as f64 - stations.len() as f64).abs());
            }
            let rounding = subject.rounding(subject.elastic.smallest(), KNOTS * STEPS);
            let reason = "rounding of positions against the deformation";
            findings.push(Finding::at_most(
                format!("conservative in {name}: net work of closed paths"),
                loss,
                rounding,
                reason,
            ));
            findings.push(Finding::at_most(
                format!("conservative in {name}: dissipation on closed paths"),
                dissipated,
                1e-15,
                "declared: none; rounding",
            ));
            findings.push(Finding::at_most(
                format!("conservative in {name}: force after closed paths"),
                change,
                rounding,
                reason,
            ));
        } else {
            let mut violation = 0.0_f64;
            for seed in 0..SEEDS {
                let mut stations = subject.closed_path(&subject.inelastic, sheared, seed, STEPS);
                if sheared {
                    // at constant length, so that what is lost is lost in shear
                    for station in &mut stations {
                        station.elongation = subject.held.elongation;
                    }
                }
                let ledger = Ledger::of(&drive(subject, MotionMeasure::Finite, &subject.path(&stations)));
                violation = violation.max(ledger.dissipated / ledger.absolute_work);
            }
            findings.push(Finding::at_least(
                format!("not conservative in {name}: share of work lost on closed paths"),
                violation,
                SMALLEST_VIOLATION,
                "an undeclared property must be seen violated",
            ));
        }
    }
}

fn dissipation<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let mut worst = 0.0_f64;
    for window in [&subject.elastic, &subject.inelastic] {
        for seed in 0..4 * SEEDS {
            // coarse paths, in which a step can turn everything round, and fine ones
            let steps = [1, 2, 5, STEPS][seed as usize % 4];
            let stations = subject.closed_path(window, true, seed, steps);
            let records = drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed));
            let scale = largest(records.iter().map(|r| r.response.energy.stored()));
            if scale > 0.0 {
                for record in &records {
                    let EnergySplit { damage, friction, viscous, .. } = record.response.energy;
                    for value in [damage, friction, viscous] {
                        worst = largest([worst, -value / scale].into_iter());
                    }
                }
            }
        }
    }
    let check = "most negative dissipation of a step, of the largest stored energy";
    findings.push(if subject.properties.dissipation_nonnegative {
        Finding::at_most(check, worst, 1e-15, "declared: none; rounding")
    } else {
        Finding::at_least(check, worst, 1e-12, "an undeclared property must be seen violated")
    });
}

/// What happens when the contact is pulled to failure.
struct Failure {
    /// Largest jump of the force from step to step, as a share of the peak.
    jump: f64,
    /// Force lost in the breaking step, as a share of the strength; 0 if there is none.
    loss: f64,
    /// Largest jump of the force in any other step, as a share of the strength.
    ordinary: f64,
    /// Energy dissipated as damage in the breaking step, J.
    damage: f64,
    /// Energy the law names as released, J.
    released: f64,
    /// Energy stored a step before, J.
    stored: f64,
}

fn pull<H: Host>(subject: &Subject<H>, steps: usize) -> Failure {
    let knots =
        [subject.elastic.elongation[0], subject.failure].map(|elongation| Station { elongation, ..Station::default() });
    // at the same speed whatever the step, so that dashpots answer alike
    let dt = subject.dt * PULL_STEPS as f64 / steps as f64;
    let records = drive_with(subject, MotionMeasure::Finite, &subject.path(&legs(&knots, steps)), dt, false);
    let jump = |pair: &[Record<H::State>]| distance(&pair[0].force, &pair[1].force);
    let steps_of = |records: &[Record<H::State>]| largest(records.windows(2).map(jump));
    let peak = largest(records.iter().map(|r| r.force[0].abs()));
    let strength = largest(records.iter().map(|r| r.force[0].max(0.0)));
    let mut out =
        Failure { jump: steps_of(&records) / peak, loss: 0.0, ordinary: 1.0, damage: 0.0, released: 0.0, stored: 0.0 };
    if let [before @ .., last] = records.as_slice()
        && last.response.status == Status::Broke
    {
        out.ordinary = steps_of(before) / strength;
        out.damage = last.response.energy.damage;
        out.released = last.released;
        if let Some(previous) = before.last() {
            out.loss = norm(&previous.force) / strength;
            out.stored = previous.response.energy.stored();
        }
    }
    out
}

fn failure<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let (coarse, fine) = (pull(subject, PULL_STEPS), pull(subject, 2 * PULL_STEPS));
    let ratio = fine.jump / coarse.jump;
    let check = "pulled to failure: jump of force at half the step / at full step";
    findings.push(if subject.properties.continuous_failure {
        Finding::at_most(check, ratio, 0.75, "0.5 for a continuous force, 0.71 with a square-root singularity")
    } else {
        Finding::at_least(check, ratio, 0.9, "undeclared: a jump that does not shrink with the step")
    });
    if subject.properties.brittle {
        findings.push(Finding::at_least(
            "brittle: share of the strength lost in the breaking step",
            fine.loss,
            0.01,
            "a break under load",
        ));
        let miss = |f: &Failure| (f.damage - f.stored).abs() / f.stored;
        findings.push(Finding::at_most(
            "brittle: energy of the break against the energy stored a step before",
            miss(&fine),
            0.1,
            "they differ by the work of one step",
        ));
        findings.push(Finding::at_most(
            "brittle: that difference at half the step / at full step",
            if miss(&coarse) > 0.0 { miss(&fine) / miss(&coarse) } else { 0.0 },
            0.6,
            "first order in the step",
        ));
        findings.push(Finding::at_most(
            "brittle: energy of the break not named by mode",
            (fine.damage - fine.released).abs() / fine.damage,
            0.1,
            "damage that the breaking step itself does is not released",
        ));
    } else {
        findings.push(Finding::at_most(
            "not brittle: force lost in the breaking step, in largest changes of other steps",
            fine.loss / fine.ordinary,
            2.0,
            "the last step is one among others, or there is none",
        ));
    }
}

fn energy_balance<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    for (name, window) in [("elastic", &subject.elastic), ("inelastic", &subject.inelastic)] {
        let (mut residual, mut step, mut coarse, mut fine, mut work) = (0.0, 0.0, 0.0, 0.0, 0.0);
        for seed in 0..SEEDS {
            let stations = subject.closed_path(window, true, seed, STEPS);
            let ledger = Ledger::of(&drive(subject, MotionMeasure::Finite, &subject.moving_path(&stations, seed)));
            let unexplained = ledger.work - ledger.stored_change - ledger.dissipated - ledger.integration;
            residual = largest([residual, unexplained.abs() / ledger.absolute_work].into_iter());
            step = largest([step, ledger.unexplained / ledger.absolute_work].into_iter());
            coarse += ledger.absolute_integration;
            work += ledger.absolute_work;
            let stations = subject.closed_path(window, true, seed, 2 * STEPS);
            let refined = drive_with(subject, MotionMeasure::Finite, &subject.path(&stations), 0.5 * subject.dt, false);
            fine += Ledger::of(&refined).absolute_integration;
        }
        findings.push(Finding::at_most(
            format!("energy balance of random moving paths, {name}"),
            residual,
            subject.rounding(window.smallest(), KNOTS * STEPS).max(1e-12),
            "roundings of 320 steps; a shear increment is tangential to a rounding of the length",
        ));
        findings.push(Finding::at_most(
            format!("energy balance of the worst step of these paths, {name}"),
            step,
            subject.rounding(window.smallest(), 1).max(1e-14),
            "roundings of one step; a shear increment is tangential to a rounding of the length",
        ));
        findings.push(Finding::at_most(
            format!("integration terms, share of the work, {name}"),
            coarse / work,
            0.05,
            "an error of the trapezoidal rule at 40 steps per leg",
        ));
        findings.push(Finding::at_most(
            format!("integration terms at half the step / at full step, {name}"),
            if coarse > 1e-12 * work { fine / coarse } else { 0.0 },
            0.75,
            "0.25 where the law is smooth, 0.5 with a break, and chance in where a kink falls within its step",
        ));
    }
}

fn determinism<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let bits = |records: &[Record<H::State>]| -> Vec<u64> {
        records
            .iter()
            .flat_map(|record| {
                let e = &record.response.energy;
                let energies = [e.stored_normal, e.stored_shear, e.damage, e.friction, e.viscous, e.integration];
                record
                    .response
                    .force
                    .iter()
                    .chain(record.response.moment.iter())
                    .chain(record.response.state.as_reals())
                    .copied()
                    .chain(energies)
                    .map(f64::to_bits)
                    .collect::<Vec<_>>()
            })
            .collect()
    };
    let mut different = 0;
    for mode in MODES {
        let path = |seed| subject.moving_path(&subject.closed_path(&subject.inelastic, true, seed, STEPS), seed);
        let once = bits(&drive(subject, mode, &path(3)));
        // another contact in between must leave no trace
        drive(subject, mode, &path(4));
        let again = bits(&drive(subject, mode, &path(3)));
        different += once.iter().zip(&again).filter(|(x, y)| x != y).count() + once.len().abs_diff(again.len());
    }
    findings.push(Finding::at_most("same inputs, other bits", different as f64, 0.0, "a law is a pure function"));
}

fn extremes<H: Host>(subject: &Subject<H>, findings: &mut Vec<Finding>) {
    let size = subject.geometry.reference_length;
    let loaded =
        drive(subject, MotionMeasure::Finite, &subject.path(&legs(&[Station::default(), subject.held], STEPS)));
    let mut states = vec![H::State::default()];
    states.extend(loaded.last().map(|record| record.response.state));
    let elongations = [0.0, 1e-300, -1e-300, 1e-16, -1e-16, 1e-6, -1e-6, -0.5, -0.999, 1.0, 1e6].map(|x| x * size);
    let mut bad = 0_u32;
    for elongation in elongations {
        for old_elongation in [elongation, 0.0, subject.held.elongation, -0.5 * size] {
            for shear in [0.0, 1e-300, 1e-16, 1e-3, 1e6].map(|x| x * size) {
                for dt in [1e-30, 1e-9, 1.0, 1e30] {
                    for state in &states {
                        let length = size + elongation;
                        let half_gap = 0.5 * (length - subject.geometry.radius_a - subject.geometry.radius_b);
                        let kinematics = PointKinematics {
                            geometry: subject.geometry,
                            length,
                            length_old: size + old_elongation,
                            elongation,
                            elongation_old: old_elongation,
                            gap: 2.0 * half_gap,
                            normal: Vec3::x(),
                            shear_increment: Vec3::new(0.0, 0.6 * shear, -0.8 * shear),
                            arm_a: subject.geometry.radius_a + half_gap,
                            arm_b: subject.geometry.radius_b + half_gap,
                            bonded: subject.bonded,
                            transport: Transport::identity(Vec3::x()),
                        };
                        let r = subject.host.respond(&kinematics, state, dt);
                        let finite = r.force.iter().chain(r.moment.iter()).all(|x| x.is_finite())
                            && r.state.as_reals().iter().all(|x| x.is_finite())
                            && r.energy.stored().is_finite()
                            && r.energy.dissipated().is_finite()
                            && r.energy.integration.is_finite();
                        bad += u32::from(!finite);
                    }
                }
            }
        }
    }
    findings.push(Finding::at_most("extremes: answers with NaN or infinity", f64::from(bad), 0.0, "none is allowed"));
}

// ---------------------------------------------------------------------------------------------------------------
// Atlas

/// One step of an atlas path as a closed form sees it.
#[derive(Debug, Clone, Copy)]
pub struct Observed {
    /// The deformation prescribed; the elongation is the one measured, so that rounding of positions is left out.
    pub station: Station,
    /// Measured gap `length − R_A − R_B`, m.
    pub gap: f64,
    /// Duration of the step, s.
    pub dt: f64,
    /// Number of the step; 0 is the step at rest at the start.
    pub step: usize,
}

/// The standard single-contact paths within `window`: tension, compression, shear at constant elongation, twist,
/// growing cycles, mixed loading. `steps` per leg.
pub fn atlas_paths(window: &Window, steps: usize) -> Vec<(&'static str, Vec<Station>)> {
    let [low, high] = window.elongation;
    let at = |elongation: f64, y: f64, z: f64| Station {
        elongation,
        shear: [y * window.shear, z * window.shear],
        twist: 0.0,
    };
    let twisted = |elongation: f64, twist: f64| Station { twist, ..at(elongation, 0.0, 0.0) };
    let zero = Station::default();
    vec![
        ("tension", legs(&[zero, at(high, 0.0, 0.0), zero], steps)),
        ("compression", legs(&[zero, at(low, 0.0, 0.0), zero], steps)),
        (
            "shear at constant compression",
            legs(&[zero, at(0.5 * low, 0.0, 0.0), at(0.5 * low, 1.0, 0.0), at(0.5 * low, -1.0, 0.0)], steps),
        ),
        (
            "shear at constant tension",
            legs(&[zero, at(0.2 * high, 0.0, 0.0), at(0.2 * high, 0.0, 1.0), at(0.2 * high, 0.0, -1.0)], steps),
        ),
        ("twist", legs(&[zero, at(0.2 * low, 0.0, 0.0), twisted(0.2 * low, 1.0), twisted(0.2 * low, -1.0)], steps)),
        (
            "cyclic",
            legs(
                &[0.2, -0.5, 0.4, -1.0, 0.6, 0.1, 1.0].map(|x| at(if x > 0.0 { x * high } else { -x * low }, 0.0, 0.0)),
                steps,
            ),
        ),
        (
            "mixed",
            legs(
                &[
                    zero,
                    at(0.3 * low, 0.4, 0.0),
                    at(0.9 * low, 0.4, 0.5),
                    at(0.2 * high, -0.3, 0.5),
                    at(0.6 * low, -1.0, -0.8),
                    at(high, 0.0, 0.0),
                ],
                steps,
            ),
        ),
    ]
}

/// Compare the forces along the atlas paths with closed forms.
///
/// `closed_form` makes, for each path, a function that is shown each step in order and gives the force on A as
/// `[normal, shear y, shear z]` (N), or `None` from the step on in which the bond is broken. The figure is the
/// largest difference as a share of the largest force of the path; `tolerance` and `reason` belong to the law.
pub fn atlas<H: Host, F: FnMut(&Observed) -> Option<[f64; 3]>>(
    subject: &Subject<H>,
    paths: &[(&'static str, Vec<Station>)],
    closed_form: impl Fn() -> F,
    tolerance: f64,
    reason: &'static str,
) -> Vec<Finding> {
    let mut findings = Vec::new();
    for (name, stations) in paths {
        let records = drive(subject, MotionMeasure::Finite, &subject.path(stations));
        let mut expected = closed_form();
        let (mut error, mut scale) = (0.0, 0.0_f64);
        for (step, station) in stations.iter().enumerate() {
            let Some(record) = records.get(step) else { break };
            let k = &record.kinematics;
            let station = Station { elongation: k.elongation, ..*station };
            let Some(force) = expected(&Observed { station, gap: k.gap, dt: subject.dt, step }) else {
                if record.response.status != Status::Broke {
                    error = f64::INFINITY;
                }
                break;
            };
            scale = scale.max(norm(&force));
            let broken = if record.response.status == Status::Broke { f64::INFINITY } else { 0.0 };
            error = largest([error, distance(&force, &record.force) + broken].into_iter());
        }
        // a path without any force must agree exactly
        let relative = if error == 0.0 { 0.0 } else { error / scale };
        findings.push(Finding::at_most(format!("atlas: {name}"), relative, tolerance, reason));
    }
    findings
}

#[cfg(test)]
mod tests {
    //! The suite is tested on laws that are wrong in one respect each: it must say so.

    use super::*;
    use crate::law::{LinearBond, LinearBondState};

    /// A linear bond with a defect.
    #[derive(Debug, Clone, Copy, PartialEq)]
    enum Defect {
        None,
        /// Shear history stays in the axes of the past.
        NoTransport,
        /// Stored shear energy is forgotten.
        ForgetsShear,
        /// Stiffness depends on which side A is.
        OneSided,
        /// The history keeps its sign under exchange although its parity is odd.
        WrongSign,
        /// Friction is booked with the wrong sign.
        NegativeFriction,
        /// Divides by the elongation.
        DividesByElongation,
        /// The normal force depends on the orientation in space.
        SpaceFixed,
    }

    #[derive(Debug, Clone, Copy)]
    struct Defective(LinearBond, Defect);

    impl Host for Defective {
        type State = LinearBondState;

        fn respond(&self, k: &PointKinematics, old: &LinearBondState, dt: f64) -> Response<LinearBondState> {
            let mut k = *k;
            let mut bond = self.0;
            match self.1 {
                Defect::NoTransport => k.transport = Transport::identity(k.normal),
                Defect::OneSided => bond.normal_stiffness *= k.geometry.radius_a,
                Defect::WrongSign => k.shear_increment += Vec3::new(1e-6, 0.0, 0.0),
                Defect::SpaceFixed => bond.normal_stiffness *= 1.0 + 1e-3 * k.normal.x,
                _ => {}
            }
            let mut answer = bond.respond(&k, old, dt);
            match self.1 {
                Defect::ForgetsShear => answer.energy.stored_shear = 0.0,
                Defect::NegativeFriction => {
                    answer.energy.friction -= 1e-3;
                    answer.energy.integration += 1e-3;
                }
                Defect::DividesByElongation => answer.force *= (2.0 * k.elongation) / k.elongation,
                _ => {}
            }
            answer
        }
    }

    fn subject(defect: Defect) -> Subject<Defective> {
        let window = Window { elongation: [-0.4, 0.6], shear: 0.5 };
        Subject {
            name: "defective bond",
            host: Defective(LinearBond::new(1e6, 4e5, 0.0, f64::INFINITY, f64::INFINITY).unwrap(), defect),
            geometry: ContactGeometry {
                reference_length: 2.0,
                area: 1.0,
                radius_a: 0.8,
                radius_b: 1.2,
                mass_a: 1.0,
                mass_b: 2.0,
            },
            bonded: true,
            properties: Properties {
                conservative_normal: true,
                conservative_shear: true,
                dissipation_nonnegative: true,
                continuous_failure: true,
                brittle: false,
            },
            elastic: window,
            inelastic: window,
            held: Station { elongation: 0.3, shear: [0.2, -0.3], twist: 0.0 },
            failure: 1.0,
            dt: 1e-3,
        }
    }

    #[test]
    fn every_defect_is_found() {
        assert!(check(&subject(Defect::None)).passed());
        for (defect, expected) in [
            (Defect::NoTransport, "held and turned"),
            (Defect::ForgetsShear, "energy balance"),
            (Defect::OneSided, "exchange of A and B"),
            (Defect::WrongSign, "exchange of A and B"),
            (Defect::NegativeFriction, "most negative dissipation"),
            (Defect::DividesByElongation, "extremes"),
            (Defect::SpaceFixed, "held and turned"),
        ] {
            let report = check(&subject(defect));
            assert!(report.failures().any(|finding| finding.check.contains(expected)), "{defect:?}: {report}");
        }
    }

    /// A law that promises less than it keeps is found out, property by property.
    #[test]
    fn modesty_is_found() {
        type Change = fn(&mut Properties);
        let changes: [(Change, &str); 5] = [
            (|p| p.conservative_normal = false, "not conservative in length"),
            (|p| p.conservative_shear = false, "not conservative in shear"),
            (|p| p.dissipation_nonnegative = false, "most negative dissipation"),
            (|p| p.continuous_failure = false, "pulled to failure"),
            (|p| p.brittle = true, "brittle"),
        ];
        for (change, expected) in changes {
            let mut subject = subject(Defect::None);
            change(&mut subject.properties);
            let report = check(&subject);
            let failures: Vec<_> = report.failures().collect();
            assert!(!failures.is_empty(), "{expected}");
            assert!(failures.iter().all(|finding| finding.check.contains(expected)), "{report}");
        }
    }

    /// The path builder makes the deformation it was asked for, and the measure reads it back. 2e-14: the random
    /// walk of 200 steps with roundings of orientations, 1e-16, times the length of 2 and a few.
    #[test]
    fn prescribed_deformation_is_measured() {
        let subject = subject(Defect::None);
        let stations = subject.closed_path(&subject.elastic, true, 11, 25);
        let mut shear = Vec3::zeros();
        for (record, station) in drive(&subject, MotionMeasure::Finite, &subject.path(&stations)).iter().zip(&stations)
        {
            shear += record.kinematics.shear_increment;
            assert!((record.kinematics.elongation - station.elongation).abs() < 4e-16 * 4.0);
            assert!((shear - Vec3::new(0.0, station.shear[0], station.shear[1])).norm() < 2e-14);
        }
    }

    /// The atlas sees a wrong closed form and a break at the wrong step.
    #[test]
    fn atlas_compares() {
        let subject = subject(Defect::None);
        let paths = atlas_paths(&subject.elastic, 20);
        let law = |stiffness: f64| {
            move |now: &Observed| {
                let s = now.station;
                Some([stiffness * s.elongation, 4e5 * s.shear[0], 4e5 * s.shear[1]])
            }
        };
        assert!(atlas(&subject, &paths, || law(1e6), 1e-13, "").iter().all(Finding::passed));
        assert!(atlas(&subject, &paths, || law(1.001e6), 1e-13, "").iter().all(|finding| !finding.passed()));
        assert!(atlas(&subject, &paths, || |_: &Observed| None, 1e-13, "").iter().all(|finding| !finding.passed()));
    }

    // -----------------------------------------------------------------------------------------------------------
    // The cohesive particle model, with the parameters of concrete: strains of 1e-4, so rounding of positions shows.

    use crate::law::cpm::{Cpm, CpmFormulation, CpmParameters, DamageLaw, contact_area};

    fn concrete() -> CpmParameters {
        CpmParameters::new(30e9, 0.2, 3e6, libm::atan(0.8), 1e-4, 30.0)
    }

    fn cpm(name: &'static str, parameters: &CpmParameters) -> Subject<Native<Cpm>> {
        Subject {
            name,
            host: Native(Cpm::new(parameters).expect("valid")),
            geometry: ContactGeometry {
                reference_length: 2.0,
                area: contact_area(0.8, 1.2),
                radius_a: 0.8,
                radius_b: 1.2,
                mass_a: 1.0,
                mass_b: 2.0,
            },
            bonded: true,
            properties: Properties {
                conservative_normal: true,
                conservative_shear: true,
                dissipation_nonnegative: true,
                continuous_failure: true,
                brittle: false,
            },
            // up to the limit strain, and to what is left of the shear strength there
            elastic: Window { elongation: [-4e-4, 1.9e-4], shear: 1e-4 },
            inelastic: Window { elongation: [-2e-3, 4e-3], shear: 4e-3 },
            held: Station { elongation: 1e-4, shear: [1e-4, -2e-4], twist: 0.0 },
            failure: 2e-2,
            dt: 1e-6,
        }
    }

    /// Every finding passes but the `known` ones, each of which is seen to fail.
    fn passes_but(report: &Report, known: &[&str]) {
        println!("{report}");
        for expected in known {
            assert!(
                report.failures().any(|finding| finding.check.starts_with(expected)),
                "{expected} passes: {report}"
            );
        }
        let surprise = report.failures().find(|finding| !known.iter().any(|known| finding.check.starts_with(known)));
        assert!(surprise.is_none(), "{surprise:?}: {report}");
    }

    /// Stránský 2018, (2.13)–(2.20), in plain numbers for two components of shear.
    fn cpm_closed_form(p: CpmParameters, area: f64) -> impl FnMut(&Observed) -> Option<[f64; 3]> {
        let (mut kappa, mut slip) = (0.0_f64, [0.0; 2]);
        let (young, shear_modulus) = (p.normal_modulus, p.normal_modulus * p.shear_ratio);
        let fracture_strain = p.limit_strain * p.relative_ductility;
        move |now| {
            let strain = now.station.elongation / 2.0;
            kappa = kappa.max(strain);
            let omega = if kappa <= p.limit_strain {
                0.0
            } else {
                match p.damage_law {
                    DamageLaw::Linear => {
                        ((1.0 - p.limit_strain / kappa) / (1.0 - p.limit_strain / fracture_strain)).min(1.0)
                    }
                    DamageLaw::Exponential => {
                        1.0 - p.limit_strain / kappa * crate::math::exp((p.limit_strain - kappa) / fracture_strain)
                    }
                }
            };
            let normal = if strain > 0.0 { (1.0 - omega) * young * strain } else { young * strain };
            let bound = (p.cohesion * (1.0 - omega) - normal * libm::tan(p.friction_angle)).max(0.0);
            let mut shear = [0, 1].map(|k| shear_modulus * (now.station.shear[k] / 2.0 - slip[k]));
            let size = (shear[0] * shear[0] + shear[1] * shear[1]).sqrt();
            if size > bound {
                for k in 0..2 {
                    slip[k] += shear[k] * (1.0 - bound / size) / shear_modulus;
                    shear[k] *= bound / size;
                }
            }
            (omega < 1.0 || strain <= 0.0).then_some([normal * area, shear[0] * area, shear[1] * area])
        }
    }

    /// Both damage laws.
    #[test]
    fn cpm_conforms() {
        for damage_law in [DamageLaw::Exponential, DamageLaw::Linear] {
            let parameters = CpmParameters { damage_law, ..concrete() };
            let subject = cpm("cpm", &parameters);
            let mut report = check(&subject);
            report.findings.extend(atlas(
                &subject,
                &atlas_paths(&subject.inelastic, 50),
                || cpm_closed_form(parameters, subject.geometry.area),
                1e-11,
                "rounding of orientations over 250 steps against strains of 1e-3",
            ));
            passes_but(&report, &[]);
        }
    }

    /// With a threshold the bond breaks under load.
    #[test]
    fn cpm_with_a_threshold_conforms() {
        let mut subject = cpm("cpm with omega threshold", &CpmParameters { omega_threshold: 0.97, ..concrete() });
        subject.properties.continuous_failure = false;
        subject.properties.brittle = true;
        passes_but(&check(&subject), &[]);
    }

    /// Unbonded.
    #[test]
    fn unbonded_cpm_conforms() {
        let mut subject = cpm("cpm, unbonded", &concrete());
        subject.bonded = false;
        subject.properties.conservative_shear = false;
        subject.elastic = Window { elongation: [-4e-4, 1e-4], shear: 1e-4 };
        subject.held = Station { elongation: -4e-4, shear: [1e-4, -2e-4], twist: 0.0 };
        passes_but(&check(&subject), &[]);
    }

    /// YADE's form. Known: its slip is not carried with the contact, so that a moving path that slips is not
    /// objective and not balanced.
    #[test]
    fn cpm_of_yade_shows_its_quirks() {
        let subject = cpm("cpm, yade-public", &CpmParameters { mode: CpmFormulation::YadePublic, ..concrete() });
        let known = [
            "energy balance of random moving paths, inelastic",
            "energy balance of the worst step of these paths, inelastic",
            "integration terms, share of the work, inelastic",
        ];
        passes_but(&check(&subject), &known);
    }

    /// Woo's form recovers slip in unloading: its friction can be negative.
    #[test]
    fn cpm_of_woo_conforms() {
        let mut subject = cpm("cpm, woo", &CpmParameters { mode: CpmFormulation::Woo, ..concrete() });
        subject.properties.dissipation_nonnegative = false;
        passes_but(&check(&subject), &[]);
    }
}
