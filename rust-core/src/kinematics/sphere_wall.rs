//! Contact of a sphere with a wall: B is the surface point nearest to the sphere's centre, with infinite mass.
//!
//! The normal points from the centre to the wall, the contact point is on the surface, so `arm_a` is the distance and
//! `arm_b` is zero. The tangential displacement is the relative velocity of the two surfaces times the step; history
//! turns with the normal (exactly) and with half the sphere's twist.

use super::sphere_sphere::Motion;
use super::{Frame, PointKinematics, Transport};
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
    let surface_velocity = a.velocity + a.angular_velocity.cross(&(normal * length));
    let relative = wall_velocity - surface_velocity;
    let spin_sum = Quat::from(a.rotation_increment.coords + Quat::identity().coords);
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: frame.length,
        elongation: length - geometry.reference_length,
        gap: length - geometry.radius_a,
        normal,
        shear_increment: (relative - normal * normal.dot(&relative)) * dt,
        arm_a: length,
        arm_b: 0.0,
        bonded: false,
        transport: Transport::finite(&frame.normal, &normal, &frame.normal.cross(&normal), &spin_sum),
    }
}
