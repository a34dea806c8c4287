//! Evaluation of a law along a path, and its energy ledger.

use super::path::{Path, Pose, rotation_vector};
use super::{Host, Subject, largest};
use crate::geometry::{PreviousGeometry, initial_geometry};
use crate::kinematics::sphere_sphere::measure;
use crate::kinematics::{ContactInput, ImageShift, Motion, MotionMeasure, PointKinematics};
use crate::law::{EnergySplit, LawState, Response, Status};
use crate::math::{Vec3, normalized, rotate};

/// One step along a path.
#[derive(Debug, Clone, Copy)]
pub struct Record<S> {
    /// Input of the law.
    pub kinematics: PointKinematics,
    /// History before the step.
    pub old: S,
    /// Response of the law, with zero force if the contact broke or opened, and zero stored energies if it broke.
    pub response: Response<S>,
    /// Sum of the stored energies that a broken bond released, J.
    pub released: f64,
    /// Trapezoidal work done on the contact, `½(f_old + f_new)·Δu`, with the old force rotated to the present axes, J.
    pub work: f64,
    /// Force on A in the path's own axes (normal, tangents), N.
    pub force: [f64; 3],
}

/// Move the pair along `path`. The first record is a step at rest at the start. The path ends where the bond breaks.
pub fn drive<H: Host>(subject: &Subject<H>, mode: MotionMeasure, path: &Path) -> Vec<Record<H::State>> {
    drive_with(subject, mode, path, subject.dt, false)
}

pub(super) fn drive_with<H: Host>(
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
    let mut previous = initial_geometry(&first[0].position, &first[1].position, &Vec3::zeros());
    let mut state = H::State::default();
    let mut pose_old = *first;
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
        let (a, b) = (motion(&pose_old[0], &pose[0]), motion(&pose_old[1], &pose[1]));
        let image = ImageShift::default();
        let input = ContactInput {
            a: &a,
            b: &b,
            image: &image,
            geometry: &geometry,
            previous: &previous,
            bonded: subject.bonded,
            dt,
        };
        let kinematics = measure(mode, &input);
        let mut response = if exchanged {
            subject.host.respond_exchanged(&kinematics, &state, dt)
        } else {
            subject.host.respond(&kinematics, &state, dt)
        };
        let released = clear_void_parts(&mut response);
        let pull_old = force_old.dot(&previous.normal);
        let shear_old = kinematics.transport.apply(&(force_old - previous.normal * pull_old));
        let pull = response.force.dot(&kinematics.normal);
        let work = 0.5 * (pull_old + pull) * (kinematics.length - kinematics.length_old)
            + 0.5 * (shear_old + response.force).dot(&kinematics.shear_increment);
        let local = rotate(&axes.conjugate(), &response.force);
        let record = Record { kinematics, old: state, response, released, work, force: local.into() };
        records.push(record);
        if response.status.is_broken() {
            break;
        }
        state = response.state;
        force_old = response.force;
        previous = PreviousGeometry { normal: kinematics.normal, length: kinematics.length };
        pose_old = *pose;
    }
    records
}

/// Clear the void parts of a response: force and history of a contact that broke or opened, and the stored energies of a
/// broken bond, which are the modes of the released energy. Returns their sum, J.
pub(super) fn clear_void_parts<S: LawState>(response: &mut Response<S>) -> f64 {
    if response.status != Status::Lives {
        response.force = Vec3::zeros();
        response.moment = Vec3::zeros();
        response.state = S::default();
    }
    if !response.status.is_broken() {
        return 0.0;
    }
    let released = response.energy.stored();
    let EnergySplit { damage, friction, viscous, integration, .. } = response.energy;
    response.energy = EnergySplit { damage, friction, viscous, integration, ..EnergySplit::default() };
    released
}

/// Sums over the steps of a path after the first record, which is at rest.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Ledger {
    pub(super) work: f64,
    pub(super) absolute_work: f64,
    pub(super) stored_change: f64,
    pub(super) dissipated: f64,
    pub(super) integration: f64,
    pub(super) absolute_integration: f64,
    /// Largest residual of the energy balance of a step.
    pub(super) unexplained: f64,
}

impl Ledger {
    pub(super) fn of<S: Copy>(records: &[Record<S>]) -> Self {
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
