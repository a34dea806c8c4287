//! Conformance suite for laws with moments ([`FrameKinematics`]). It shares findings and reports with the
//! [parent module](super).
//!
//! A pair moves through end rotations, twist, and elongation, on top of a rigid motion of both. The bodies have different
//! orientations at bonding. The checks are:
//!
//! * **action and reaction**: moments of both sides balance about any point;
//! * **exchange of A and B**: bit for bit by the law, to rounding by kinematics and law together;
//! * **objectivity** under finite rigid motion, a rotation by 2π included;
//! * **conservation**: force and both moments are the derivatives of the stored energy at finite rotations (central
//!   differences), and the trapezoidal work of closed paths vanishes with the square of the step;
//! * **brittleness**: a bond pulled to failure releases its stored energy;
//! * **determinism** and **extremes**.

use std::f64::consts::PI;

use super::driver::clear_void_parts;
use super::path::{random_motion, rotation_vector};
use super::{Finding, Native, Pose, Random, Report, RigidMotion, at_rest, largest};
use crate::geometry::{ContactGeometry, PreviousGeometry, initial_geometry};
use crate::kinematics::{ContactInput, FrameKinematics, ImageShift, Motion};
use crate::law::{ContactLaw, LawState, Response, Status};
use crate::math::{Quat, Vec3, normalized, quaternion_of_rotation_vector, rotate, sin_cos};

/// Program that evaluates a law with moments.
pub trait FrameHost {
    /// History of the bond.
    type State: LawState;

    /// Response of the law to a step.
    fn respond(&self, kinematics: &FrameKinematics, old: &Self::State, dt: f64) -> Response<Self::State>;

    /// [`ContactLaw::TRANSMITS_MOMENT`].
    fn transmits_moment(&self) -> bool {
        true
    }
}

impl<L: ContactLaw<Kinematics = FrameKinematics>> FrameHost for Native<L> {
    type State = L::State;

    fn respond(&self, kinematics: &FrameKinematics, old: &L::State, dt: f64) -> Response<L::State> {
        self.0.respond(kinematics, old, dt)
    }

    fn transmits_moment(&self) -> bool {
        L::TRANSMITS_MOMENT
    }
}

/// Deformation of a bond, in axes that move with its branch vector (x along it).
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct FrameStation {
    /// Elongation, m.
    pub elongation: f64,
    /// Rotation of the end at A about y and z, rad.
    pub a: [f64; 2],
    /// Rotation of the end at B about y and z, rad.
    pub b: [f64; 2],
    /// Twist of B relative to A, rad.
    pub twist: f64,
}

/// A law under test, its bond, and the range of deformations of the checks.
#[derive(Debug, Clone)]
pub struct FrameSubject<H> {
    /// Name for the report.
    pub name: &'static str,
    /// Evaluates the law.
    pub host: H,
    /// The bond.
    pub geometry: ContactGeometry,
    /// Largest absolute elongation, m.
    pub elongation: f64,
    /// Largest rotation of an end about one axis, rad.
    pub rotation: f64,
    /// Largest twist, rad.
    pub twist: f64,
    /// An elongation at which the bond is broken, m, if it breaks.
    pub failure: Option<f64>,
    /// Duration of a step, s.
    pub dt: f64,
}

/// One step of a driven bond.
#[derive(Debug, Clone, Copy)]
pub struct FrameRecord<S> {
    /// Input of the law.
    pub kinematics: FrameKinematics,
    /// History before the step.
    pub old: S,
    /// Response of the law, without its void parts if the bond broke.
    pub response: Response<S>,
    /// Sum of the stored energies that a broken bond released, J.
    pub released: f64,
    /// Force on A in the axes of the branch vector, N.
    pub force: Vec3,
    /// Moments on A and B about their centers in the axes of the branch vector, N·m.
    pub moments: [Vec3; 2],
    /// Trapezoidal work done on the bond in this step, J.
    pub work: f64,
}

/// Poses of both ends at a station in the axes of the branch vector, for bodies with the initial orientations `start`.
pub fn poses(geometry: &ContactGeometry, station: &FrameStation, start: &[Quat; 2]) -> [Pose; 2] {
    let length = geometry.reference_length + station.elongation;
    let swing = |[y, z]: [f64; 2]| quaternion_of_rotation_vector(&Vec3::new(0.0, y, z));
    let (qa, direct_b) = (swing(station.a), swing(station.b));
    let (ta, tb) = (rotate(&qa, &Vec3::x()), rotate(&direct_b, &Vec3::x()));
    let transport = normalized(&Quat::from_parts(1.0 + ta.dot(&tb), ta.cross(&tb)));
    let relative = quaternion_of_rotation_vector(&(tb * station.twist)) * transport;
    let pose = |x: f64, q: Quat| Pose { position: Vec3::new(x, 0.0, 0.0), orientation: normalized(&q) };
    [pose(0.0, qa * start[0]), pose(length, relative * qa * start[1])]
}

/// Measure a step between two pairs of poses.
fn measured(
    geometry: &ContactGeometry,
    previous: &PreviousGeometry,
    before: &[Pose; 2],
    now: &[Pose; 2],
    bonded: bool,
    dt: f64,
) -> FrameKinematics {
    let motion = |k: usize| {
        let turn = normalized(&(now[k].orientation * before[k].orientation.conjugate()));
        Motion {
            position: now[k].position,
            velocity: (now[k].position - before[k].position) / dt,
            angular_velocity: rotation_vector(&turn) / dt,
            rotation_increment: turn,
            orientation: now[k].orientation,
        }
    };
    let (a, b, image) = (motion(0), motion(1), ImageShift::default());
    FrameKinematics::new(&ContactInput { a: &a, b: &b, image: &image, geometry, previous, bonded, dt })
}

/// Moments on A and B about their centers, N·m, of a response with the solver's arms.
fn about_centers<S>(kinematics: &FrameKinematics, response: &Response<S>) -> [Vec3; 2] {
    let point = &kinematics.point;
    let torque_per_arm = point.normal.cross(&response.force);
    [torque_per_arm * point.arm_a + response.moment, torque_per_arm * point.arm_b - response.moment]
}

/// Move a bond through `stations`, on top of a rigid motion. The path ends where the bond breaks.
pub fn drive<H: FrameHost>(
    subject: &FrameSubject<H>,
    stations: &[FrameStation],
    rigid: RigidMotion<'_>,
    start: &[Quat; 2],
    exchanged: bool,
) -> Vec<FrameRecord<H::State>> {
    let mut geometry = subject.geometry;
    if exchanged {
        std::mem::swap(&mut geometry.radius_a, &mut geometry.radius_b);
        std::mem::swap(&mut geometry.mass_a, &mut geometry.mass_b);
    }
    let steps = stations.len().saturating_sub(1).max(1) as f64;
    let mut records: Vec<FrameRecord<H::State>> = Vec::with_capacity(stations.len());
    let mut state = H::State::default();
    let mut previous: Option<[Pose; 2]> = None;
    let mut old_wrenches = [Vec3::zeros(); 3];
    for (index, station) in stations.iter().enumerate() {
        let motion = rigid(index as f64 / steps);
        let moved = |pose: Pose| Pose {
            position: rotate(&motion.orientation, &pose.position) + motion.position,
            orientation: normalized(&(motion.orientation * pose.orientation)),
        };
        let mut now = poses(&subject.geometry, station, start).map(moved);
        if exchanged {
            now.reverse();
        }
        let before = previous.unwrap_or(now);
        let previous_geometry = initial_geometry(&before[0].position, &before[1].position, &Vec3::zeros());
        let kinematics = measured(&geometry, &previous_geometry, &before, &now, true, subject.dt);
        let mut response = subject.host.respond(&kinematics, &state, subject.dt);
        let released = clear_void_parts(&mut response);
        let moments = about_centers(&kinematics, &response);
        let wrenches = [response.force, moments[0], moments[1]];
        let work = 0.5
            * (kinematics.work(&wrenches[0], &wrenches[1], &wrenches[2])
                + kinematics.work(&old_wrenches[0], &old_wrenches[1], &old_wrenches[2]));
        let local = |v: &Vec3| rotate(&motion.orientation.conjugate(), v);
        records.push(FrameRecord {
            kinematics,
            old: state,
            response,
            released,
            force: local(&response.force),
            moments: moments.map(|m| local(&m)),
            work,
        });
        if response.status.is_broken() {
            break;
        }
        state = response.state;
        previous = Some(now);
        old_wrenches = wrenches;
    }
    records
}

/// Stations along straight legs between `knots`, `steps` per leg, with a cosine ramp in each leg.
pub fn legs(knots: &[FrameStation], steps: usize) -> Vec<FrameStation> {
    let mut stations: Vec<FrameStation> = knots.first().copied().into_iter().collect();
    for pair in knots.windows(2) {
        for k in 1..=steps {
            let share = 0.5 - 0.5 * sin_cos(PI * k as f64 / steps as f64).1;
            let mix = |from: f64, to: f64| if k == steps { to } else { from + (to - from) * share };
            let mix2 = |from: [f64; 2], to: [f64; 2]| [mix(from[0], to[0]), mix(from[1], to[1])];
            let (p, q) = (&pair[0], &pair[1]);
            stations.push(FrameStation {
                elongation: mix(p.elongation, q.elongation),
                a: mix2(p.a, q.a),
                b: mix2(p.b, q.b),
                twist: mix(p.twist, q.twist),
            });
        }
    }
    stations
}

const KNOTS: usize = 6;
const STEPS: usize = 40;
const SEEDS: u64 = 5;

/// Orientations at bonding, by seed: equal for the first, random for the others.
fn starts(seed: u64) -> [Quat; 2] {
    let mut random = Random::new(seed ^ 0x5eed);
    let mut turn = || {
        let axis = random.direction();
        quaternion_of_rotation_vector(&(axis * random.uniform(0.0, PI)))
    };
    if seed == 0 { [Quat::identity(); 2] } else { [turn(), turn()] }
}

impl<H: FrameHost> FrameSubject<H> {
    fn station(&self, random: &mut Random) -> FrameStation {
        let mut within = |size: f64| random.uniform(-size, size);
        FrameStation {
            elongation: within(self.elongation),
            a: [within(self.rotation), within(self.rotation)],
            b: [within(self.rotation), within(self.rotation)],
            twist: within(self.twist),
        }
    }

    /// A path that starts and ends undeformed.
    fn closed_path(&self, seed: u64, steps: usize) -> Vec<FrameStation> {
        let mut random = Random::new(seed);
        let mut knots = vec![FrameStation::default()];
        knots.extend((1..KNOTS).map(|_| self.station(&mut random)));
        knots.push(FrameStation::default());
        legs(&knots, steps)
    }

    /// Largest force (N) and moment (N·m): the scales of errors.
    fn sizes(&self, records: &[FrameRecord<H::State>]) -> (f64, f64) {
        let force = largest(records.iter().map(|r| r.force.norm()));
        let moment = largest(records.iter().map(|r| r.moments[0].norm().max(r.moments[1].norm())));
        (force, moment.max(force * self.geometry.reference_length))
    }
}

/// Run every check.
pub fn check<H: FrameHost>(subject: &FrameSubject<H>) -> Report {
    let mut findings = Vec::new();
    action_and_reaction(subject, &mut findings);
    exchange(subject, &mut findings);
    objectivity(subject, &mut findings);
    derivatives(subject, &mut findings);
    closed_paths(subject, &mut findings);
    brittleness(subject, &mut findings);
    determinism(subject, &mut findings);
    extremes(subject, &mut findings);
    Report { subject: subject.name.to_owned(), findings }
}

fn action_and_reaction<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let (mut worst, mut lost) = (0.0_f64, 0.0_f64);
    for seed in 0..SEEDS {
        let motion = random_motion(seed, subject.geometry.reference_length);
        let records = drive(subject, &subject.closed_path(seed, STEPS), &motion, &starts(seed), false);
        if !subject.host.transmits_moment() {
            lost = lost.max(largest(records.iter().map(|r| r.response.moment.norm())));
        }
        let (force, moment) = subject.sizes(&records);
        let point = Random::new(seed).direction() * subject.geometry.reference_length;
        for record in &records {
            let k = &record.kinematics.point;
            let [ma, mb] = about_centers(&record.kinematics, &record.response);
            let f = record.response.force;
            // A at the origin: f × arms about the point.
            let sum = ma + mb + (-point).cross(&f) + (k.normal * k.length - point).cross(&-f);
            worst = worst.max(sum.norm() / (moment + force * k.length));
        }
    }
    findings.push(Finding::at_most("moments balance about any point", worst, 4e-15, "a few roundings"));
    findings.push(Finding::at_most("moments without TRANSMITS_MOMENT, which the solver drops", lost, 0.0, "none"));
}

fn exchange<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let (mut different, mut worst) = (0_u32, 0.0_f64);
    for seed in 0..SEEDS {
        let motion = random_motion(seed, subject.geometry.reference_length);
        let stations = subject.closed_path(seed, STEPS);
        let records = drive(subject, &stations, &motion, &starts(seed), false);
        let (force, moment) = subject.sizes(&records);
        for record in &records {
            let k = &record.kinematics;
            let g = k.point.geometry;
            let mut other = *k;
            other.point.geometry =
                ContactGeometry { radius_a: g.radius_b, radius_b: g.radius_a, mass_a: g.mass_b, mass_b: g.mass_a, ..g };
            other.point.normal = -k.point.normal;
            (other.orientation_a, other.orientation_b) = (k.orientation_b, k.orientation_a);
            (other.turn_a, other.turn_b) = (k.turn_b, k.turn_a);
            other.displacement = -k.displacement;
            // Skip the first step: it computes the history from the motion, to rounding only.
            if record.old == H::State::default() {
                continue;
            }
            let mut mirrored = subject.host.respond(&other, &record.old.swapped(), subject.dt);
            clear_void_parts(&mut mirrored);
            let same = mirrored.force == -record.response.force
                && mirrored.moment == -record.response.moment
                && mirrored.energy == record.response.energy;
            different += u32::from(!same);
        }
        let swapped = drive(subject, &stations, &motion, &starts(seed), true);
        for (one, two) in records.iter().zip(&swapped) {
            worst = worst.max((one.force + two.force).norm() / force);
            worst = worst.max((one.moments[0] - two.moments[1]).norm() / moment);
        }
    }
    findings.push(Finding::at_most(
        "responses that change if A and B are exchanged",
        f64::from(different),
        0.0,
        "bits",
    ));
    findings.push(Finding::at_most("exchange, kinematics included", worst, 1e-13, "rounding of positions"));
}

fn objectivity<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let mut worst = 0.0_f64;
    for seed in 0..SEEDS {
        let stations = subject.closed_path(seed, STEPS);
        let still = drive(subject, &stations, &at_rest, &starts(seed), false);
        let motion = random_motion(seed, subject.geometry.reference_length);
        let moving = drive(subject, &stations, &motion, &starts(seed), false);
        let (force, moment) = subject.sizes(&still);
        for (one, two) in still.iter().zip(&moving) {
            worst = worst.max((one.force - two.force).norm() / force);
            for end in 0..2 {
                worst = worst.max((one.moments[end] - two.moments[end]).norm() / moment);
            }
        }
    }
    findings.push(Finding::at_most("change under a rigid motion with a turn by 2π", worst, 1e-13, "rounding"));
}

/// Force and moments against central differences of the stored energy, at random stations.
fn derivatives<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    /// Step of the central difference, rad, and as a fraction of the length. Its truncation error is about 1e-10 of the
    /// curvature of the energy, its rounding error 1e-16/1e-5.
    const STEP: f64 = 1e-5;
    let mut worst = 0.0_f64;
    let mut random = Random::new(17);
    for seed in 0..40_u64 {
        let start = starts(seed);
        let station = subject.station(&mut random);
        let origin = poses(&subject.geometry, &FrameStation::default(), &start);
        let here = poses(&subject.geometry, &station, &start);
        let previous_geometry = initial_geometry(&origin[0].position, &origin[1].position, &Vec3::zeros());
        let first = measured(&subject.geometry, &previous_geometry, &origin, &origin, true, subject.dt);
        let state = subject.host.respond(&first, &H::State::default(), subject.dt).state;
        let energy = |now: &[Pose; 2]| {
            let kinematics = measured(&subject.geometry, &previous_geometry, &origin, now, true, subject.dt);
            (subject.host.respond(&kinematics, &state, subject.dt), kinematics)
        };
        let (response, kinematics) = energy(&here);
        let [ma, mb] = about_centers(&kinematics, &response);
        let length = subject.geometry.reference_length;
        let scale = response.force.norm() * length + ma.norm() + mb.norm();
        if scale == 0.0 || response.status != Status::Lives {
            continue;
        }
        for axis in 0..3 {
            let mut unit = Vec3::zeros();
            unit[axis] = 1.0;
            let difference = |change: &dyn Fn(f64) -> [Pose; 2]| {
                let at = |x: f64| energy(&change(x)).0.energy.stored();
                (at(STEP) - at(-STEP)) / (2.0 * STEP)
            };
            let moved = |x: f64| {
                let mut poses = here;
                poses[1].position += unit * (x * length);
                poses
            };
            let turned = |end: usize, x: f64| {
                let mut poses = here;
                poses[end].orientation =
                    normalized(&(quaternion_of_rotation_vector(&(unit * x)) * poses[end].orientation));
                poses
            };
            let by_motion = difference(&moved);
            let by_turn = [difference(&|x| turned(0, x)), difference(&|x| turned(1, x))];
            worst = worst
                .max((by_motion - response.force[axis] * length).abs() / scale)
                .max((by_turn[0] + ma[axis]).abs() / scale)
                .max((by_turn[1] + mb[axis]).abs() / scale);
        }
    }
    findings.push(Finding::at_most("forces are derivatives of the energy", worst, 1e-8, "central differences, 1e-5"));
}

fn closed_paths<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let imbalance = |steps: usize| {
        largest((0..SEEDS).map(|seed| {
            let motion = random_motion(seed, subject.geometry.reference_length);
            let records = drive(subject, &subject.closed_path(seed, steps), &motion, &starts(seed), false);
            let net: f64 = records.iter().map(|r| r.work).sum();
            let peak = largest(records.iter().map(|r| r.response.energy.stored()));
            net.abs() / peak
        }))
    };
    let (coarse, fine) = (imbalance(STEPS), imbalance(4 * STEPS));
    findings.push(Finding::at_most("net work of closed paths, share of the peak energy", fine, 2e-3, "second order"));
    findings.push(Finding::at_least(
        "its reduction at a quarter of the step",
        coarse / fine,
        8.0,
        "16 for second order",
    ));
}

fn brittleness<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let Some(failure) = subject.failure else { return };
    let pulled = FrameStation { elongation: failure, ..FrameStation::default() };
    let stations = legs(&[FrameStation::default(), pulled], 400);
    let records = drive(subject, &stations, &at_rest, &starts(1), false);
    let Some(last) = records.last() else { return };
    let broke = f64::from(u8::from(last.response.status.is_broken()));
    findings.push(Finding::at_least("the bond breaks when pulled", broke, 1.0, "declared"));
    let damage = last.response.energy.damage;
    findings.push(Finding::at_most(
        "released energy differs from the stored one",
        (damage - last.released).abs() / damage,
        0.0,
        "the same sum",
    ));
    let work: f64 = records.iter().map(|r| r.work).sum();
    let unexplained = (work - damage - last.response.energy.integration).abs() / damage;
    findings.push(Finding::at_most("work of pulling minus released energy", unexplained, 1e-12, "linear: exact"));
}

fn determinism<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let run = || {
        let motion = random_motion(3, subject.geometry.reference_length);
        drive(subject, &subject.closed_path(3, STEPS), &motion, &starts(3), false)
    };
    let different = run()
        .iter()
        .zip(&run())
        .filter(|(a, b)| a.response.force != b.response.force || a.response.moment != b.response.moment)
        .count();
    findings.push(Finding::at_most("responses that differ in a second run", different as f64, 0.0, "bits"));
}

fn extremes<H: FrameHost>(subject: &FrameSubject<H>, findings: &mut Vec<Finding>) {
    let mut bad = 0_u32;
    for angle in [0.0, 1e-300, 1e-12, 1.0, PI - 1e-9, PI, 1.5 * PI] {
        for twist in [0.0, 1e-300, PI, 2.0 * PI] {
            for elongation in [-0.999, 0.0, 1e3] {
                let station = FrameStation {
                    elongation: elongation * subject.geometry.reference_length,
                    a: [angle, 0.0],
                    b: [0.0, -angle],
                    twist,
                };
                for record in drive(subject, &[FrameStation::default(), station], &at_rest, &starts(2), false) {
                    let r = &record.response;
                    let sum = r.force.sum() + r.moment.sum() + r.energy.stored() + r.energy.dissipated();
                    bad += u32::from(!sum.is_finite());
                }
            }
        }
    }
    findings.push(Finding::at_most(
        "responses at extremes that are not finite",
        f64::from(bad),
        0.0,
        "none is allowed",
    ));
}
