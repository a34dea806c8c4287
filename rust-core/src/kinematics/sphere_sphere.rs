//! Contact of two spheres.
//!
//! Notation: `l = x_B + shift − x_A`, `d = |l|`, `n = l/d`; arms `a_A = R_A + gap/2`, `a_B = R_B + gap/2` (their sum is
//! `d`; for equal spheres both are `d/2`, Stránský 2018 (2.10)–(2.11)).
//!
//! **Finite** (default). The measure that is exactly work-conjugate to the trapezoidal rule of the integrator and
//! exactly objective. Let `R` be the rotation of the contact in the step (see [`Turn::finite`]), `n_o`, `n` the old
//! and new normal, `d_o`, `d` the lengths, `a_o`, `a` the arms, and `s_p = sin φ_p e_p` the sine vector of the rotation
//! of particle p. A shear force that keeps its value while it turns with the contact does the work `T·Δu_T` with
//! `Δu_T = (1 − n n)·½(R + 1)Δl − ½Σ_p (a_o,p R s_p + a_p s_p) × n`.
//! A rigid motion gives exactly zero; to first order the rate of `Δu_T` is (2.8) with corrected sign,
//! `v_B − v_A + n × (a_A ω_A + a_B ω_B)`, tangential part. What remains of the work is of third order in the step,
//! which is what lets the energy ledger close.
//!
//! **First order**. `Δu_T = (1 − n n)[v_B − v_A + n × (a_A ω_A + a_B ω_B)] Δt`, and history rotated by
//! `e − e × (n_o × n) − e × ½Δt n_o·(ω_A+ω_B) n_o`.

use super::transport::Turn;
use super::{BATCH, Batch, Frame, Mode, PointKinematics, Transport};
use crate::law::ContactGeometry;
use crate::math::{Quat, Vec3};
use crate::state::Cell;

/// Motion of one particle during a step: position at its end, velocities of the half step, rotation of the step.
#[derive(Debug, Clone, Copy)]
pub struct Motion {
    /// Centre at the end of the step, m.
    pub position: Vec3,
    /// Velocity of the step, m/s.
    pub velocity: Vec3,
    /// Angular velocity of the step, rad/s.
    pub angular_velocity: Vec3,
    /// Rotation of the step.
    pub rotation_increment: Quat,
    /// Orientation at the end of the step, body to world.
    pub orientation: Quat,
}

/// Displacement of the image of B seen by A, and its rate.
#[derive(Debug, Clone, Copy, Default)]
pub struct ImageShift {
    /// `H·image`, m.
    pub displacement: Vec3,
    /// `L·H·image`, m/s.
    pub velocity: Vec3,
    /// Whether the scene is periodic (YADE's torque arm differs then).
    pub periodic: bool,
}

impl ImageShift {
    /// The image with the given indices in a cell. In YADE's modes its velocity is that of the edges at the step's beginning,
    /// `L·(H − ΔH)·image` (YADE's `intrShiftVel`).
    #[inline(always)]
    pub fn of(cell: &Cell, image: [i8; 3], mode: Mode) -> Self {
        let displacement = cell.shift(image);
        let from = match mode {
            Mode::Finite | Mode::FirstOrder => displacement,
            Mode::Yade | Mode::YadeRatcheting => displacement - cell.matrix_change * Vec3::from(image.map(f64::from)),
        };
        Self { displacement, velocity: cell.velocity_gradient * from, periodic: true }
    }
}

/// Measure a contact in the given mode. `frame` is the contact's memory of the last step.
#[inline(always)]
pub fn measure(
    mode: Mode,
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &Frame,
    bonded: bool,
    dt: f64,
) -> PointKinematics {
    match mode {
        Mode::Finite => finite(a, b, image, geometry, frame, bonded),
        Mode::FirstOrder => first_order(a, b, image, geometry, frame, bonded, dt),
        Mode::Yade => yade(a, b, image, geometry, frame, bonded, dt, false),
        Mode::YadeRatcheting => yade(a, b, image, geometry, frame, bonded, dt, true),
    }
}

/// Frame of a contact whose history starts now.
#[inline]
pub fn fresh_frame(a: &Vec3, b: &Vec3, shift: &Vec3) -> Frame {
    let l = b + shift - a;
    let length = l.norm();
    Frame { normal: l / length, length }
}

#[inline(always)]
fn finite(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &Frame,
    bonded: bool,
) -> PointKinematics {
    let measure = finite_measure(&FiniteInput {
        branch: b.position + image.displacement - a.position,
        rotation_a: a.rotation_increment,
        rotation_b: b.rotation_increment,
        radius_a: geometry.radius_a,
        radius_b: geometry.radius_b,
        frame: *frame,
    });
    measure.point(geometry, frame, bonded)
}

/// Arrays of a batch, one per component, kept from batch to batch.
#[derive(Debug, Clone)]
pub struct Columns {
    input: [[f64; BATCH]; 17],
    output: [[f64; BATCH]; 13],
}

impl Default for Columns {
    fn default() -> Self {
        Self { input: [[0.0; BATCH]; 17], output: [[0.0; BATCH]; 13] }
    }
}

/// What the finite measure reads.
#[derive(Clone, Copy)]
struct FiniteInput {
    branch: Vec3,
    rotation_a: Quat,
    rotation_b: Quat,
    radius_a: f64,
    radius_b: f64,
    frame: Frame,
}

/// What the finite measure finds.
#[derive(Clone, Copy)]
struct FiniteMeasure {
    length: f64,
    gap: f64,
    normal: Vec3,
    shear_increment: Vec3,
    turn: Turn,
}

#[inline(always)]
fn finite_measure(input: &FiniteInput) -> FiniteMeasure {
    let FiniteInput { branch, rotation_a, rotation_b, radius_a, radius_b, frame } = *input;
    let length = branch.norm();
    let normal = branch * (1.0 / length);
    let gap = length - radius_a - radius_b;
    let spin_sum = Quat::from(rotation_a.coords + rotation_b.coords);
    let swing_axis = frame.normal.cross(&normal);
    let turn = Turn::finite(&frame.normal, &normal, &swing_axis, &spin_sum);
    let mean_length = 0.5 * (length + frame.length);
    let mean_half_gap = 0.5 * (mean_length - radius_a - radius_b);
    // 2 w u is the sine vector of a rotation (u, w).
    let turn_a = 2.0 * rotation_a.w * (radius_a + mean_half_gap);
    let turn_b = 2.0 * rotation_b.w * (radius_b + mean_half_gap);
    let turned = rotation_a.imag() * turn_a + rotation_b.imag() * turn_b;
    let c = frame.normal.dot(&normal);
    let late = (frame.normal - normal * c) * mean_length + turned.cross(&normal);
    let along = (turned.dot(&frame.normal) + turned.dot(&normal)) / (1.0 + c);
    let early = late - swing_axis * along;
    let shear_increment = (turn.twist(&normal, &early) + late) * -0.5;
    FiniteMeasure { length, gap, normal, shear_increment, turn }
}

impl FiniteMeasure {
    #[inline(always)]
    fn point(&self, geometry: &ContactGeometry, frame: &Frame, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: frame.length,
            elongation: self.length - geometry.reference_length,
            elongation_old: frame.length - geometry.reference_length,
            gap: self.gap,
            normal: self.normal,
            shear_increment: self.shear_increment,
            arm_a: geometry.radius_a + 0.5 * self.gap,
            arm_b: geometry.radius_b + 0.5 * self.gap,
            bonded,
            transport: self.turn.transport(self.normal),
        }
    }
}

/// [`measure`] in the mode [`Mode::Finite`] of a batch of contacts, with the same bits: the formulas run over arrays,
/// one per component, where the compiler uses the wide registers of the processor.
#[inline(always)]
pub fn finite_batch<B: Batch<PointKinematics>>(count: usize, batch: &mut B, columns: &mut Columns) {
    // Rows beyond `count` are computed from what is there, and never read.
    let Columns { input, output } = columns;
    let count = count.min(BATCH);
    for i in 0..count {
        let ([a, b], shift) = batch.poses(i);
        let (l, p, q) = (b.position + shift - a.position, a.rotation_increment, b.rotation_increment);
        let (_, Frame { normal: n, length }, _) = batch.constants(i);
        let row = [l.x, l.y, l.z, p.i, p.j, p.k, p.w, q.i, q.j, q.k, q.w, a.radius, b.radius, n.x, n.y, n.z, length];
        for (column, value) in input.iter_mut().zip(row) {
            column[i] = value;
        }
    }
    measure_columns(input, output);
    #[allow(clippy::needless_range_loop)] // over the rows of all columns
    for i in 0..count {
        let at = |column: usize| output[column][i];
        let measure = FiniteMeasure {
            length: at(0),
            gap: at(1),
            normal: Vec3::new(at(2), at(3), at(4)),
            shear_increment: Vec3::new(at(5), at(6), at(7)),
            turn: Turn { bisector: Vec3::new(at(8), at(9), at(10)), cosine: at(11), sine: at(12) },
        };
        let (geometry, frame, bonded) = batch.constants(i);
        batch.answer(i, &measure.point(&geometry, &frame, bonded));
    }
}

#[inline(always)]
fn measure_columns(input: &[[f64; BATCH]; 17], output: &mut [[f64; BATCH]; 13]) {
    for i in 0..BATCH {
        let at = |column: usize| input[column][i];
        let measure = finite_measure(&FiniteInput {
            branch: Vec3::new(at(0), at(1), at(2)),
            rotation_a: Quat::new(at(6), at(3), at(4), at(5)),
            rotation_b: Quat::new(at(10), at(7), at(8), at(9)),
            radius_a: at(11),
            radius_b: at(12),
            frame: Frame { normal: Vec3::new(at(13), at(14), at(15)), length: at(16) },
        });
        let FiniteMeasure { length, gap, normal: n, shear_increment: s, turn } = measure;
        let b = turn.bisector;
        output[0][i] = length;
        output[1][i] = gap;
        output[2][i] = n.x;
        output[3][i] = n.y;
        output[4][i] = n.z;
        output[5][i] = s.x;
        output[6][i] = s.y;
        output[7][i] = s.z;
        output[8][i] = b.x;
        output[9][i] = b.y;
        output[10][i] = b.z;
        output[11][i] = turn.cosine;
        output[12][i] = turn.sine;
    }
}

#[inline(always)]
fn first_order(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &Frame,
    bonded: bool,
    dt: f64,
) -> PointKinematics {
    let l = b.position + image.displacement - a.position;
    let length = l.norm();
    let normal = l / length;
    let gap = length - geometry.radius_a - geometry.radius_b;
    let arm_a = geometry.radius_a + 0.5 * gap;
    let arm_b = geometry.radius_b + 0.5 * gap;
    let velocity = b.velocity + image.velocity - a.velocity
        + normal.cross(&(a.angular_velocity * arm_a + b.angular_velocity * arm_b));
    let twist = 0.5 * dt * frame.normal.dot(&(a.angular_velocity + b.angular_velocity));
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: frame.length,
        elongation: length - geometry.reference_length,
        elongation_old: frame.length - geometry.reference_length,
        gap,
        normal,
        shear_increment: (velocity - normal * normal.dot(&velocity)) * dt,
        arm_a,
        arm_b,
        bonded,
        transport: Transport::FirstOrder { swing: frame.normal.cross(&normal), twist: frame.normal * twist },
    }
}

/// YADE's `Ig2_Sphere_Sphere_ScGeom` and `ScGeom::precompute`, with its order of floating point operations
/// (sums of three as `x + (y + z)`, no fused operations), so that a trace of YADE is met bit for bit.
#[inline(always)]
fn yade(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &Frame,
    bonded: bool,
    dt: f64,
    ratcheting_correction: bool,
) -> PointKinematics {
    use crate::math::yade_order::{cross, dot, norm};
    let (radius_a, radius_b) = (geometry.radius_a, geometry.radius_b);
    let l = b.position + image.displacement - a.position;
    let length = norm(&l);
    let normal = l / length;
    let penetration = radius_a + radius_b - length;
    let reference_penetration = radius_a + radius_b - geometry.reference_length;
    let contact_point = a.position + normal * (radius_a - 0.5 * penetration);
    let incident = if ratcheting_correction {
        let alpha = (radius_a + radius_b) / (radius_a + radius_b - penetration);
        (b.velocity - a.velocity) * alpha + cross(&b.angular_velocity, &(normal * -radius_b))
            - cross(&a.angular_velocity, &(normal * radius_a))
            + image.velocity * alpha
    } else {
        let arm_a = contact_point - a.position;
        let arm_b = contact_point - b.position - image.displacement;
        (b.velocity + cross(&b.angular_velocity, &arm_b)) - (a.velocity + cross(&a.angular_velocity, &arm_a))
            + image.velocity
    };
    let tangential = incident - normal * dot(&normal, &incident);
    let twist = dt * 0.5 * dot(&frame.normal, &(a.angular_velocity + b.angular_velocity));
    let periodic_arm = 0.5 * (reference_penetration - penetration);
    let (arm_a, arm_b) = if image.periodic {
        (radius_a + periodic_arm, radius_b + periodic_arm)
    } else {
        (radius_a - 0.5 * penetration, radius_b - 0.5 * penetration)
    };
    PointKinematics {
        geometry: *geometry,
        length,
        length_old: frame.length,
        elongation: reference_penetration - penetration,
        elongation_old: frame.length - geometry.reference_length,
        gap: -penetration,
        normal,
        shear_increment: tangential * dt,
        arm_a,
        arm_b,
        bonded,
        transport: Transport::FirstOrder { swing: cross(&frame.normal, &normal), twist: frame.normal * twist },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{quaternion_of_rotation_vector, rotate};

    /// Rigid rotation of a pair about an arbitrary axis by 2π in 100 steps: no shear increment, and a tangential
    /// vector attached to the pair is transported to where the rotation takes it.
    /// Tolerance: 100 steps of a few roundings each, 100·8·2⁻⁵³ ≈ 1e-13.
    #[test]
    fn finite_measure_is_exact_under_rigid_rotation() {
        let axis = Vec3::new(0.3, -0.5, 0.81).normalize();
        let step = quaternion_of_rotation_vector(&(axis * (std::f64::consts::TAU / 100.0)));
        let geometry = ContactGeometry {
            reference_length: 2.1,
            area: 1.0,
            radius_a: 0.8,
            radius_b: 1.2,
            mass_a: 1.0,
            mass_b: 2.0,
        };
        let (mut xa, mut xb) = (Vec3::new(0.1, 0.2, 0.3), Vec3::new(1.4, 1.1, 1.7));
        let mut frame = fresh_frame(&xa, &xb, &Vec3::zeros());
        let mut carried = crate::math::any_perpendicular(&frame.normal);
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
            let k = measure(Mode::Finite, &still(xa), &still(xb), &ImageShift::default(), &geometry, &frame, true, 1.0);
            assert!(k.shear_increment.norm() < 4e-15, "{}", k.shear_increment.norm());
            carried = k.transport.apply(&carried);
            frame = Frame { normal: k.normal, length: k.length };
        }
        assert!((carried - expected).norm() < 1e-13, "{}", (carried - expected).norm());
    }
}
