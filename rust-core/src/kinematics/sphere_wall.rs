//! Contact of a sphere with a wall: B is the surface point nearest to the sphere's centre, with infinite mass.
//!
//! The normal points from the centre to the wall, the contact point is on the surface, so `arm_a` is the distance and
//! `arm_b` is zero. History turns with the normal (exactly) and with half the sphere's twist; call that rotation `R`. With
//! the relative displacement `d = (v_wall − v)Δt`, the sine vector `s` of the sphere's rotation, and the arms `a_o`, `a` and
//! normals `n_o`, `n` at the start and end of the step, the tangential displacement is
//! `(1 − n n)·½[R(d − a_o s × n_o) + (d − a s × n)]`,
//! which is work-conjugate to a shear force that keeps its size in the step under the trapezoidal rule (an arm taken at
//! the end alone would leave an error of first order in the step in the energy ledger).

use super::sphere_sphere::Motion;
use super::transport::Turn;
use super::{Frame, PointKinematics};
use crate::law::ContactGeometry;
use crate::math::{Quat, Vec3};
use crate::state::walls::Foot;

/// Measure a contact of sphere `a` with a wall moving at `wall_velocity` (m/s).
pub fn measure(
    a: &Motion,
    foot: &Foot,
    wall_velocity: &Vec3,
    geometry: &ContactGeometry,
    frame: &Frame,
    dt: f64,
) -> PointKinematics {
    let normal = foot.normal;
    let length = foot.distance;
    let displacement = (wall_velocity - a.velocity) * dt;
    let turn = a.rotation_increment.imag() * (2.0 * a.rotation_increment.w);
    let spin_sum = Quat::from(a.rotation_increment.coords + Quat::identity().coords);
    let transport = Turn::finite(&frame.normal, &normal, &frame.normal.cross(&normal), &spin_sum).transport(normal);
    let tangential = |displacement: Vec3, normal: &Vec3| displacement - normal * normal.dot(&displacement);
    let early = tangential(displacement - turn.cross(&frame.normal) * frame.length, &frame.normal);
    let late = tangential(displacement - turn.cross(&normal) * length, &normal);
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: frame.length,
        elongation: length - geometry.reference_length,
        elongation_old: frame.length - geometry.reference_length,
        gap: length - geometry.radius_a,
        normal,
        shear_increment: (transport.apply(&early) + late) * 0.5,
        arm_a: length,
        arm_b: 0.0,
        bonded: false,
        transport,
    }
}
