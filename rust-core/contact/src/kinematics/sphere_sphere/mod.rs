//! Contact of two spheres.
//!
//! Notation: branch vector `l = x_B + shift − x_A`, `d = |l|`, `n = l/d`; arms `a_A = R_A + gap/2`, `a_B = R_B + gap/2`
//! (their sum is `d`; for equal spheres both are `d/2`, Stránský 2018 (2.10)–(2.11)).
//!
//! **Finite** (default). This measure is exactly objective, and exactly work-conjugate to the trapezoidal rule of the
//! integrator. Let `R` be the rotation of the contact in the step (see
//! [`Turn::finite`](super::transport::Turn::finite)), `n_o`, `n` the old and new normal, `d_o`, `d` the lengths, `a_o`,
//! `a` the arms, and `s_p = sin φ_p e_p` the sine vector of the rotation of particle p. A shear force that rotates with
//! the contact and keeps its magnitude does the work `T·Δu_T` with
//! `Δu_T = (1 − n n)·½(R + 1)Δl − ½Σ_p (a_o,p R s_p + a_p s_p) × n`.
//! A rigid motion gives exactly zero. To first order the rate of `Δu_T` is (2.8) with corrected sign,
//! `v_B − v_A + n × (a_A ω_A + a_B ω_B)`, tangential part. The remainder of the work is of third order in the step, so that
//! the energy ledger closes.
//!
//! **First order**. `Δu_T = (1 − n n)[v_B − v_A + n × (a_A ω_A + a_B ω_B)] Δt`; the history rotates by
//! `e − e × (n_o × n) − e × ½Δt n_o·(ω_A+ω_B) n_o`.
//!
//! **YADE**. See [`YadeMeasure`].

mod finite;
mod yade;

pub use super::motion::{ImageShift, Motion};
pub use crate::geometry::initial_geometry;
pub use finite::FiniteMeasure;
pub use yade::{YadeMeasure, yade};

use super::{ContactInput, MotionMeasure, PointKinematics, Transport};
use crate::math::norm;

/// Measure a contact.
#[inline(always)]
pub fn measure(mode: MotionMeasure, input: &ContactInput<'_>) -> PointKinematics {
    match mode {
        MotionMeasure::Finite => finite::measure(input),
        MotionMeasure::FirstOrder => first_order(input),
        MotionMeasure::Yade => yade::measure::<false>(input),
        MotionMeasure::YadeRatcheting => yade::measure::<true>(input),
    }
}

#[inline(always)]
fn first_order(input: &ContactInput<'_>) -> PointKinematics {
    let ContactInput { a, b, image, geometry, previous, bonded, dt } = *input;
    let l = input.branch();
    let length = norm(&l);
    let normal = l / length;
    let gap = length - geometry.radius_a - geometry.radius_b;
    let arm_a = geometry.radius_a + 0.5 * gap;
    let arm_b = geometry.radius_b + 0.5 * gap;
    let velocity = b.velocity + image.velocity - a.velocity
        + normal.cross(&(a.angular_velocity * arm_a + b.angular_velocity * arm_b));
    let twist = 0.5 * dt * previous.normal.dot(&(a.angular_velocity + b.angular_velocity));
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: previous.length,
        elongation: length - geometry.reference_length,
        elongation_old: previous.length - geometry.reference_length,
        gap,
        normal,
        shear_increment: (velocity - normal * normal.dot(&velocity)) * dt,
        arm_a,
        arm_b,
        bonded,
        transport: Transport::FirstOrder { swing: previous.normal.cross(&normal), twist: previous.normal * twist },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::conformance::GEOMETRY;
    use crate::geometry::{ContactGeometry, PreviousGeometry};
    use crate::math::{Quat, Vec3, quaternion_of_rotation_vector, rotate};

    /// Across the border of a cell that deforms, what the particles slide is what their branch vector changes across itself: to first
    /// order in the step for the measures that use velocities (1e-3 of it). YADE takes the velocity of the border from the edges at the
    /// start of the step, the others from those at its end, and in a cell YADE's torque arms grow with the elongation, not with the gap.
    #[test]
    fn particles_slide_across_a_moving_border() {
        use crate::Cell;
        use crate::math::Mat3;

        let (dt, image) = (1e-3, [1, -1, 0]);
        let mut cell = Cell::new_box(Vec3::new(2.0, 3.0, 4.0));
        cell.velocity_gradient = Mat3::new(0.1, 0.5, 0.0, -0.2, 0.0, 0.3, 0.0, 0.0, -0.1);
        let (from, to) = (Vec3::new(1.9, 0.2, 1.0), Vec3::new(1.1, 3.0, 1.5));
        let before = initial_geometry(&from, &to, &cell.shift(image));
        let old_edges = cell.matrix;
        cell.matrix_change = cell.velocity_gradient * cell.matrix * dt;
        cell.matrix += cell.matrix_change;
        let (va, vb) = (Vec3::new(0.1, 0.0, 0.2), Vec3::new(-0.1, 0.1, 0.0));
        let moved = |position: Vec3, velocity: Vec3| Motion {
            position: position + velocity * dt,
            velocity,
            angular_velocity: Vec3::zeros(),
            rotation_increment: Quat::identity(),
            orientation: Quat::identity(),
        };
        let (a, b) = (moved(from, va), moved(to, vb));
        let geometry = ContactGeometry {
            reference_length: 1.4,
            area: 1.0,
            radius_a: 0.6,
            radius_b: 0.9,
            mass_a: 1.0,
            mass_b: 1.0,
        };
        for mode in [MotionMeasure::FirstOrder, MotionMeasure::Yade, MotionMeasure::YadeRatcheting] {
            let shift = ImageShift::of(&cell, image, mode);
            let is_yade = mode != MotionMeasure::FirstOrder;
            let edges = if is_yade { old_edges } else { cell.matrix };
            assert_eq!(shift.velocity, cell.velocity_gradient * (edges * Vec3::new(1.0, -1.0, 0.0)));
            let input =
                ContactInput { a: &a, b: &b, image: &shift, geometry: &geometry, previous: &before, bonded: true, dt };
            let k = measure(mode, &input);
            let change = input.branch() - before.normal * before.length;
            // The ratcheting correction stretches velocities to touching spheres.
            let factor = if mode == MotionMeasure::YadeRatcheting { 1.5 / k.length } else { 1.0 };
            let slide = (change - k.normal * k.normal.dot(&change)) * factor;
            let error = (k.shear_increment - slide).norm() / slide.norm();
            assert!(slide.norm() > 1e-4 && error < 2e-3, "{mode:?}: {error:e}");
            let arms = if is_yade { 0.5 * k.elongation } else { 0.5 * k.gap };
            assert!((k.arm_a - 0.6 - arms).abs() < 1e-15 && (k.arm_b - 0.9 - arms).abs() < 1e-15, "{mode:?}");
        }
    }

    /// Rigid rotation of a pair about an arbitrary axis by 2π in 100 steps: the shear increment is zero, and the transport of
    /// a tangential vector equals its rotation.
    /// Tolerance: 100 steps of a few roundings each, 100·8·2⁻⁵³ ≈ 1e-13.
    #[test]
    fn finite_measure_is_exact_under_rigid_rotation() {
        let axis = Vec3::new(0.3, -0.5, 0.81).normalize();
        let step = quaternion_of_rotation_vector(&(axis * (std::f64::consts::TAU / 100.0)));
        let geometry = ContactGeometry { reference_length: 2.1, ..GEOMETRY };
        let (mut xa, mut xb) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.4, 1.1, 1.7));
        let mut previous = initial_geometry(&xa, &xb, &Vec3::zeros());
        let mut carried = crate::math::any_perpendicular(&previous.normal);
        let mut expected = carried;
        for _ in 0..100 {
            xa = rotate(&step, &xa);
            xb = rotate(&step, &xb);
            expected = rotate(&step, &expected);
            let still = |position| Motion {
                position,
                velocity: Vec3::zeros(),
                angular_velocity: Vec3::zeros(),
                rotation_increment: step,
                orientation: Quat::identity(),
            };
            let (a, b) = (still(xa), still(xb));
            let image = ImageShift::default();
            let input = ContactInput {
                a: &a,
                b: &b,
                image: &image,
                geometry: &geometry,
                previous: &previous,
                bonded: true,
                dt: 1.0,
            };
            let k = measure(MotionMeasure::Finite, &input);
            assert!(k.shear_increment.norm() < 4e-15, "{}", k.shear_increment.norm());
            carried = k.transport.apply(&carried);
            previous = PreviousGeometry { normal: k.normal, length: k.length };
        }
        assert!((carried - expected).norm() < 1e-13, "{}", (carried - expected).norm());
    }
}
