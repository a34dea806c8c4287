//! Contact of a sphere with a wall: B is the point of the surface closest to the sphere's center, with infinite mass.
//!
//! The normal points from the center to the wall. The contact point lies on the surface, so in all modes `arm_a` is the
//! distance of the center from the wall, and `arm_b` is zero.
//!
//! **Finite**. The history rotates with the normal (exactly) and with the mean twist of sphere and wall; call that rotation `R`. With
//! the relative displacement `d = (v_wall − v)Δt`, the sine vector `s` of the sphere's rotation, and the arms `a_o`, `a` and
//! normals `n_o`, `n` at the start and end of the step, the tangential displacement is
//! `(1 − n n)·½[R(d − a_o s × n_o) + (d − a s × n)]`.
//! It is work-conjugate, under the trapezoidal rule, to a shear force of constant magnitude in the step. The arm at the end
//! of the step alone would leave an error of first order in the step in the energy ledger.
//!
//! **First order**, and **YADE** (`Ig2_Wall_Sphere_ScGeom` with `noRatch=False`): `(1 − n n)[v_wall − v − a ω × n]Δt`; the
//! history rotates by `e − e × (n_o × n) − e × ½Δt (n_o·(ω + ω_wall)) n_o`. The two differ in the order of operations only.
//!
//! **YADE, ratcheting** (`noRatch=True`, YADE's default): `(1 − n n)[α(v_wall − v) − R ω × n]Δt`, `α = 2R/(2R − δ)` for
//! the overlap δ: the wall is treated as a sphere of the same radius.

use super::transport::Turn;
use super::{MotionMeasure, PointKinematics, Transport, WallInput};
use crate::math::{Quat, Vec3, yade_order};

/// Measure a contact of a sphere with a wall.
pub fn measure(mode: MotionMeasure, input: &WallInput<'_>) -> PointKinematics {
    let WallInput { geometry, previous, .. } = *input;
    let (normal, length) = (input.closest_point.normal, input.closest_point.distance);
    let (shear_increment, transport) = match mode {
        MotionMeasure::Finite => finite(input),
        MotionMeasure::FirstOrder => first_order(input),
        MotionMeasure::Yade => yade::<false>(input),
        MotionMeasure::YadeRatcheting => yade::<true>(input),
    };
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: previous.length,
        elongation: length - geometry.reference_length,
        elongation_old: previous.length - geometry.reference_length,
        gap: length - geometry.radius_a,
        normal,
        shear_increment,
        arm_a: length,
        arm_b: 0.0,
        bonded: false,
        transport,
    }
}

fn finite(input: &WallInput<'_>) -> (Vec3, Transport) {
    let WallInput { a, closest_point, wall_velocity, wall_rotation, previous, dt, .. } = *input;
    let normal = closest_point.normal;
    let displacement = (wall_velocity - a.velocity) * dt;
    let turn = a.rotation_increment.imag() * (2.0 * a.rotation_increment.w);
    let rotation_sum = Quat::from(a.rotation_increment.coords + wall_rotation.coords);
    let swing_axis = previous.normal.cross(&normal);
    let transport = Turn::finite(&previous.normal, &normal, &swing_axis, &rotation_sum).transport(normal);
    let tangential = |displacement: Vec3, normal: &Vec3| displacement - normal * normal.dot(&displacement);
    let early = tangential(displacement - turn.cross(&previous.normal) * previous.length, &previous.normal);
    let late = tangential(displacement - turn.cross(&normal) * closest_point.distance, &normal);
    ((transport.apply(&early) + late) * 0.5, transport)
}

fn first_order(input: &WallInput<'_>) -> (Vec3, Transport) {
    let WallInput { a, closest_point, wall_velocity, wall_rotation, previous, dt, .. } = *input;
    let (normal, length) = (closest_point.normal, closest_point.distance);
    let velocity = wall_velocity - a.velocity + normal.cross(&a.angular_velocity) * length;
    let twists = 0.5 * dt * previous.normal.dot(&a.angular_velocity) + previous.normal.dot(&wall_rotation.imag());
    let twist = previous.normal * twists;
    let transport = Transport::FirstOrder { swing: previous.normal.cross(&normal), twist };
    ((velocity - normal * normal.dot(&velocity)) * dt, transport)
}

/// `Ig2_Wall_Sphere_ScGeom` and `ScGeom::precompute` in their order of operations, seen from the sphere. (YADE's first body
/// is the wall: all signs are opposite, which changes no bit.)
fn yade<const RATCHETING: bool>(input: &WallInput<'_>) -> (Vec3, Transport) {
    use yade_order::{cross, dot};
    let WallInput { a, closest_point, wall_velocity, wall_rotation, geometry, previous, dt } = *input;
    let (normal, radius) = (closest_point.normal, geometry.radius_a);
    let relative_velocity = if RATCHETING {
        let alpha = (radius + radius) / (radius + radius - (radius - closest_point.distance));
        (wall_velocity - a.velocity) * alpha - cross(&a.angular_velocity, &(normal * radius))
    } else {
        wall_velocity - (a.velocity + cross(&a.angular_velocity, &(normal * closest_point.distance)))
    };
    let tangential = relative_velocity - normal * dot(&normal, &relative_velocity);
    let twist = dt * 0.5 * dot(&previous.normal, &a.angular_velocity) + dot(&previous.normal, &wall_rotation.imag());
    let transport = Transport::FirstOrder { swing: cross(&previous.normal, &normal), twist: previous.normal * twist };
    (tangential * dt, transport)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{ContactGeometry, PreviousGeometry};
    use crate::kinematics::Motion;
    use crate::math::quaternion_of_rotation_vector;
    use crate::wall::ClosestPoint;

    const RADIUS: f64 = 0.8;
    const DISTANCE: f64 = 0.75;
    const DT: f64 = 1e-3;

    fn measured(
        mode: MotionMeasure,
        velocity: Vec3,
        angular_velocity: Vec3,
        old_normal: Vec3,
        old_length: f64,
    ) -> PointKinematics {
        let geometry = ContactGeometry {
            reference_length: RADIUS,
            area: 1.0,
            radius_a: RADIUS,
            radius_b: 0.0,
            mass_a: 1.0,
            mass_b: f64::INFINITY,
        };
        let motion = Motion {
            position: Vec3::new(0.0, 0.0, DISTANCE),
            velocity,
            angular_velocity,
            rotation_increment: quaternion_of_rotation_vector(&(angular_velocity * DT)),
            orientation: Quat::identity(),
        };
        let closest_point = ClosestPoint { normal: -Vec3::z(), distance: DISTANCE, interior: true };
        let previous = PreviousGeometry { normal: old_normal, length: old_length };
        let input = WallInput {
            a: &motion,
            closest_point: &closest_point,
            wall_velocity: &Vec3::new(0.1, 0.0, 0.02),
            wall_rotation: &Quat::identity(),
            geometry: &geometry,
            previous: &previous,
            dt: DT,
        };
        measure(mode, &input)
    }

    /// Sliding at 0.3 m/s and rolling at 20 rad/s on a floor: closed forms of the four modes. Finite uses the sine of
    /// the step's rotation; first order and YADE use the rotation; ratcheting uses the radius as arm.
    #[test]
    fn each_mode_has_its_own_arm() {
        let (slide, roll) = (0.3, 20.0);
        let along = |mode| {
            let k = measured(mode, Vec3::x() * slide, Vec3::y() * roll, -Vec3::z(), DISTANCE);
            assert_eq!((k.arm_a, k.arm_b, k.length, k.bonded), (DISTANCE, 0.0, DISTANCE, false));
            assert!(k.shear_increment.y == 0.0 && k.shear_increment.z == 0.0);
            k.shear_increment.x
        };
        // ω × (−a z) = −a ω x for an angular velocity about y: rolling reduces the sliding.
        let drift = 0.1 - slide;
        let alpha = 2.0 * RADIUS / (RADIUS + DISTANCE);
        for (mode, expected) in [
            (MotionMeasure::Finite, drift * DT + DISTANCE * (roll * DT).sin()),
            (MotionMeasure::FirstOrder, (drift + DISTANCE * roll) * DT),
            (MotionMeasure::Yade, (drift + DISTANCE * roll) * DT),
            (MotionMeasure::YadeRatcheting, (alpha * drift + RADIUS * roll) * DT),
        ] {
            // Some ten roundings of numbers of the size of the result.
            assert!((along(mode) - expected).abs() < 2e-15 * expected.abs(), "{mode:?} {} {expected}", along(mode));
        }
    }

    /// A sphere that rolls while it approaches the wall by 0.2 m in the step: the increment has the mean of the arms at both ends
    /// of the step, so that a shear force of constant size does exactly the work of its torque under the trapezoidal rule,
    /// `½(a_o + a) f sin φ`. The arm at one end would be wrong in first order.
    #[test]
    fn rolling_has_the_mean_of_both_arms() {
        let (old_length, roll) = (DISTANCE + 0.2, 20.0);
        let k = measured(MotionMeasure::Finite, Vec3::zeros(), Vec3::y() * roll, -Vec3::z(), old_length);
        let expected = 0.1 * DT + 0.5 * (old_length + DISTANCE) * (roll * DT).sin();
        // Some ten roundings of numbers of the size of the result.
        assert!((k.shear_increment.x - expected).abs() < 2e-15 * expected, "{} {expected}", k.shear_increment.x);
    }

    /// Where the normal rotates (at the edge of a mesh) and the sphere rotates about it, all modes agree to second
    /// order in the step: rotations of 1e-3 and 0.02 rad differ at most by their squares.
    #[test]
    fn modes_rotate_history_alike_to_first_order() {
        let old = Vec3::new(1e-3, -5e-4, -1.0).normalize();
        let step = |mode| {
            let k = measured(mode, Vec3::new(0.3, 0.2, 0.1), Vec3::new(1.0, 2.0, 20.0), old, DISTANCE - 1e-4);
            assert!(k.shear_increment.dot(&k.normal).abs() < 1e-18);
            (k.transport.apply(&Vec3::new(1.0, 0.0, 1e-3).normalize()), k.shear_increment)
        };
        let (finite, shear) = step(MotionMeasure::Finite);
        // Half the sphere's twist, 10 rad/s · 1 ms about +z
        assert!((finite.y - 0.01).abs() < 1e-5, "{finite}");
        for mode in [MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting] {
            let (turned, increment) = step(mode);
            assert!((turned - finite).norm() < 1e-4, "{mode:?} {turned} {finite}");
            let from_arm = if mode == MotionMeasure::YadeRatcheting { (RADIUS - DISTANCE) * 3.0 } else { 0.0 };
            assert!((increment - shear).norm() < (from_arm + 5e-3) * DT, "{mode:?} {increment} {shear}");
        }
        let (first, yade) = (step(MotionMeasure::FirstOrder), step(MotionMeasure::Yade));
        assert!((first.0 - yade.0).norm() < 1e-15 && (first.1 - yade.1).norm() < 1e-18);
    }
}
