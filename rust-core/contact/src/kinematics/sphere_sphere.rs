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

use super::batch::{BATCH, Batch, Columns, Formula};
use super::transport::Turn;
use super::{MotionMeasure, PointKinematics, PreviousGeometry, Transport};
use crate::Cell;
use crate::law::{ContactGeometry, ContactLaw};
use crate::math::{Quat, Vec3};

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
    pub fn of(cell: &Cell, image: [i8; 3], mode: MotionMeasure) -> Self {
        let displacement = cell.shift(image);
        let from = match mode {
            MotionMeasure::Finite | MotionMeasure::FirstOrder => displacement,
            MotionMeasure::Yade | MotionMeasure::YadeRatcheting => {
                displacement - cell.matrix_change * Vec3::from(image.map(f64::from))
            }
        };
        Self { displacement, velocity: cell.velocity_gradient * from, periodic: true }
    }
}

/// Measure a contact in the given mode. `frame` is the contact's memory of the last step.
#[inline(always)]
pub fn measure(
    mode: MotionMeasure,
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &PreviousGeometry,
    bonded: bool,
    dt: f64,
) -> PointKinematics {
    match mode {
        MotionMeasure::Finite => finite(a, b, image, geometry, frame, bonded),
        MotionMeasure::FirstOrder => first_order(a, b, image, geometry, frame, bonded, dt),
        MotionMeasure::Yade => yade(a, b, image, geometry, frame, bonded, dt, false),
        MotionMeasure::YadeRatcheting => yade(a, b, image, geometry, frame, bonded, dt, true),
    }
}

/// Frame of a contact whose history starts now.
#[inline]
pub fn initial_geometry(a: &Vec3, b: &Vec3, shift: &Vec3) -> PreviousGeometry {
    let l = b + shift - a;
    let length = l.norm();
    PreviousGeometry { normal: l / length, length }
}

#[inline(always)]
fn finite(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &PreviousGeometry,
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

/// What the finite measure reads.
#[derive(Clone, Copy)]
struct FiniteInput {
    branch: Vec3,
    rotation_a: Quat,
    rotation_b: Quat,
    radius_a: f64,
    radius_b: f64,
    frame: PreviousGeometry,
}

/// What the finite measure finds.
#[derive(Clone, Copy)]
pub struct FiniteMeasure {
    length: f64,
    gap: f64,
    normal: Vec3,
    shear_increment: Vec3,
    turn: Turn,
}

/// Numbers that the finite measure reads of a contact.
pub const FINITE_INPUT: usize = 17;

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
    /// Write the first [`FINITE_INPUT`] numbers of contact `i` of a batch.
    #[inline(always)]
    pub fn set<L: ContactLaw, B: Batch<L>>(columns: &mut Columns, i: usize, batch: &B) {
        let ([a, b], shift) = batch.poses(i);
        let (l, p, q) = (b.position + shift - a.position, a.rotation, b.rotation);
        let PreviousGeometry { normal: n, length } = batch.frame(i);
        let row = [l.x, l.y, l.z, p.i, p.j, p.k, p.w, q.i, q.j, q.k, q.w, a.radius, b.radius, n.x, n.y, n.z, length];
        columns.set(i, row);
    }

    /// The measure of numbers that [`Self::set`] wrote.
    #[inline(always)]
    pub fn of(input: [f64; FINITE_INPUT]) -> Self {
        let [lx, ly, lz, pi, pj, pk, pw, qi, qj, qk, qw, radius_a, radius_b, nx, ny, nz, length] = input;
        finite_measure(&FiniteInput {
            branch: Vec3::new(lx, ly, lz),
            rotation_a: Quat::new(pw, pi, pj, pk),
            rotation_b: Quat::new(qw, qi, qj, qk),
            radius_a,
            radius_b,
            frame: PreviousGeometry { normal: Vec3::new(nx, ny, nz), length },
        })
    }

    /// Length (m), gap (m), and normal of a measure whose answer is known, so that its increments are of no matter.
    #[inline(always)]
    pub fn place(length: f64, gap: f64, normal: Vec3) -> Self {
        let turn = Turn { bisector: normal, cosine: 1.0, sine: 0.0 };
        Self { length, gap, normal, shear_increment: Vec3::zeros(), turn }
    }

    /// As the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, frame: &PreviousGeometry, bonded: bool) -> PointKinematics {
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

/// The finite measure of many contacts.
struct Finite;

impl Formula<FINITE_INPUT, 13> for Finite {
    #[inline(always)]
    fn apply(&self, input: [f64; FINITE_INPUT]) -> [f64; 13] {
        let FiniteMeasure { length, gap, normal: n, shear_increment: s, turn } = FiniteMeasure::of(input);
        let b = turn.bisector;
        [length, gap, n.x, n.y, n.z, s.x, s.y, s.z, b.x, b.y, b.z, turn.cosine, turn.sine]
    }
}

/// [`measure`] in the mode [`MotionMeasure::Finite`] of the first `count` contacts of a batch, with the same bits, and the law's
/// answers.
#[inline(always)]
pub fn finite_batch<L: ContactLaw<Kinematics = PointKinematics>, B: Batch<L>>(
    count: usize,
    batch: &mut B,
    columns: &mut Columns,
) {
    let count = count.min(BATCH);
    for i in 0..count {
        FiniteMeasure::set(columns, i, batch);
    }
    columns.apply(&Finite);
    for i in 0..count {
        let [length, gap, nx, ny, nz, sx, sy, sz, bx, by, bz, cosine, sine] = columns.get(i);
        let measure = FiniteMeasure {
            length,
            gap,
            normal: Vec3::new(nx, ny, nz),
            shear_increment: Vec3::new(sx, sy, sz),
            turn: Turn { bisector: Vec3::new(bx, by, bz), cosine, sine },
        };
        let (geometry, frame, bonded) = batch.constants(i);
        batch.evaluate(i, &measure.point(&geometry, &frame, bonded));
    }
}

#[inline(always)]
fn first_order(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &PreviousGeometry,
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

#[inline(always)]
fn yade(
    a: &Motion,
    b: &Motion,
    image: &ImageShift,
    geometry: &ContactGeometry,
    frame: &PreviousGeometry,
    bonded: bool,
    dt: f64,
    ratcheting_correction: bool,
) -> PointKinematics {
    let input = YadeInput::of(a, b, image, geometry, frame);
    yade_measure(&input, image.periodic, dt, ratcheting_correction).point(geometry, frame, bonded)
}

/// What YADE's measure reads.
#[derive(Clone, Copy)]
struct YadeInput {
    position_a: Vec3,
    position_b: Vec3,
    shift: Vec3,
    velocity_a: Vec3,
    velocity_b: Vec3,
    shift_velocity: Vec3,
    spin_a: Vec3,
    spin_b: Vec3,
    radius_a: f64,
    radius_b: f64,
    reference_length: f64,
    normal_old: Vec3,
}

/// What YADE's measure finds.
#[derive(Clone, Copy)]
pub struct YadeMeasure {
    length: f64,
    normal: Vec3,
    penetration: f64,
    elongation: f64,
    shear_increment: Vec3,
    arm_a: f64,
    arm_b: f64,
    swing: Vec3,
    twist: Vec3,
}

impl YadeInput {
    #[inline(always)]
    fn of(a: &Motion, b: &Motion, image: &ImageShift, geometry: &ContactGeometry, frame: &PreviousGeometry) -> Self {
        Self {
            position_a: a.position,
            position_b: b.position,
            shift: image.displacement,
            velocity_a: a.velocity,
            velocity_b: b.velocity,
            shift_velocity: image.velocity,
            spin_a: a.angular_velocity,
            spin_b: b.angular_velocity,
            radius_a: geometry.radius_a,
            radius_b: geometry.radius_b,
            reference_length: geometry.reference_length,
            normal_old: frame.normal,
        }
    }
}

/// YADE's `Ig2_Sphere_Sphere_ScGeom` and `ScGeom::precompute`, with its order of floating point operations
/// (sums of three as `x + (y + z)`, no fused operations), so that a trace of YADE is met bit for bit.
#[inline(always)]
fn yade_measure(input: &YadeInput, periodic: bool, dt: f64, ratcheting_correction: bool) -> YadeMeasure {
    use crate::math::yade_order::{cross, dot, norm};
    let YadeInput { position_a, position_b, shift, velocity_a, velocity_b, shift_velocity, spin_a, spin_b, .. } =
        *input;
    let YadeInput { radius_a, radius_b, reference_length, normal_old, .. } = *input;
    let l = position_b + shift - position_a;
    let length = norm(&l);
    let normal = l / length;
    let penetration = radius_a + radius_b - length;
    let reference_penetration = radius_a + radius_b - reference_length;
    let bond_event = if ratcheting_correction {
        let alpha = (radius_a + radius_b) / (radius_a + radius_b - penetration);
        (velocity_b - velocity_a) * alpha + cross(&spin_b, &(normal * -radius_b)) - cross(&spin_a, &(normal * radius_a))
            + shift_velocity * alpha
    } else {
        let contact_point = position_a + normal * (radius_a - 0.5 * penetration);
        let arm_a = contact_point - position_a;
        let arm_b = contact_point - position_b - shift;
        (velocity_b + cross(&spin_b, &arm_b)) - (velocity_a + cross(&spin_a, &arm_a)) + shift_velocity
    };
    let tangential = bond_event - normal * dot(&normal, &bond_event);
    let twist = dt * 0.5 * dot(&normal_old, &(spin_a + spin_b));
    let periodic_arm = 0.5 * (reference_penetration - penetration);
    let (arm_a, arm_b) = if periodic {
        (radius_a + periodic_arm, radius_b + periodic_arm)
    } else {
        (radius_a - 0.5 * penetration, radius_b - 0.5 * penetration)
    };
    YadeMeasure {
        length,
        normal,
        penetration,
        elongation: reference_penetration - penetration,
        shear_increment: tangential * dt,
        arm_a,
        arm_b,
        swing: cross(&normal_old, &normal),
        twist: normal_old * twist,
    }
}

impl YadeMeasure {
    /// As a row of columns.
    #[inline(always)]
    pub fn row(&self) -> [f64; YADE_OUTPUT] {
        let Self { length, normal: n, penetration, elongation, shear_increment: s, arm_a, arm_b, swing: w, twist: t } =
            *self;
        [length, penetration, elongation, arm_a, arm_b, n.x, n.y, n.z, s.x, s.y, s.z, w.x, w.y, w.z, t.x, t.y, t.z]
    }

    /// The measure of a [`Self::row`].
    #[inline(always)]
    pub fn of_row(row: [f64; YADE_OUTPUT]) -> Self {
        let at = |i: usize| Vec3::new(row[i], row[i + 1], row[i + 2]);
        let [length, penetration, elongation, arm_a, arm_b, ..] = row;
        let (normal, shear_increment, swing, twist) = (at(5), at(8), at(11), at(14));
        Self { length, normal, penetration, elongation, shear_increment, arm_a, arm_b, swing, twist }
    }

    /// As the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, frame: &PreviousGeometry, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: frame.length,
            elongation: self.elongation,
            elongation_old: frame.length - geometry.reference_length,
            gap: -self.penetration,
            normal: self.normal,
            shear_increment: self.shear_increment,
            arm_a: self.arm_a,
            arm_b: self.arm_b,
            bonded,
            transport: Transport::FirstOrder { swing: self.swing, twist: self.twist },
        }
    }
}

/// Numbers that YADE's measure reads of a contact without image.
pub const YADE_INPUT: usize = 24;
/// Numbers that it finds.
pub const YADE_OUTPUT: usize = 17;

/// YADE's measure of many contacts without a periodic cell.
#[derive(Clone, Copy)]
pub struct Yade {
    /// Time step, s.
    pub dt: f64,
    /// YADE's `avoidGranularRatcheting`.
    pub ratcheting_correction: bool,
}

impl Yade {
    /// Write the input of contact `i`.
    #[inline(always)]
    pub fn set(
        columns: &mut Columns,
        i: usize,
        a: &Motion,
        b: &Motion,
        geometry: &ContactGeometry,
        frame: &PreviousGeometry,
    ) {
        let ContactGeometry { radius_a, radius_b, reference_length, .. } = *geometry;
        columns.set_from(0, i, [a.position.x, a.position.y, a.position.z]);
        columns.set_from(3, i, [b.position.x, b.position.y, b.position.z]);
        columns.set_from(6, i, [a.velocity.x, a.velocity.y, a.velocity.z]);
        columns.set_from(9, i, [b.velocity.x, b.velocity.y, b.velocity.z]);
        columns.set_from(12, i, [a.angular_velocity.x, a.angular_velocity.y, a.angular_velocity.z]);
        columns.set_from(15, i, [b.angular_velocity.x, b.angular_velocity.y, b.angular_velocity.z]);
        columns.set_from(18, i, [frame.normal.x, frame.normal.y, frame.normal.z]);
        columns.set_from(21, i, [radius_a, radius_b, reference_length]);
    }

    /// What is found for such an input.
    #[inline(always)]
    pub fn measure(&self, input: [f64; YADE_INPUT]) -> YadeMeasure {
        let at = |i: usize| Vec3::new(input[i], input[i + 1], input[i + 2]);
        let input = YadeInput {
            position_a: at(0),
            position_b: at(3),
            shift: Vec3::zeros(),
            velocity_a: at(6),
            velocity_b: at(9),
            shift_velocity: Vec3::zeros(),
            spin_a: at(12),
            spin_b: at(15),
            normal_old: at(18),
            radius_a: input[21],
            radius_b: input[22],
            reference_length: input[23],
        };
        yade_measure(&input, false, self.dt, self.ratcheting_correction)
    }
}

impl Formula<YADE_INPUT, YADE_OUTPUT> for Yade {
    #[inline(always)]
    fn apply(&self, input: [f64; YADE_INPUT]) -> [f64; YADE_OUTPUT] {
        self.measure(input).row()
    }
}

/// [`measure`] in YADE's modes of the first `count` contacts of a batch without images, with the same bits, and the law's
/// answers.
#[inline(always)]
pub fn yade_batch<L: ContactLaw<Kinematics = PointKinematics>, B: Batch<L>>(
    count: usize,
    dt: f64,
    ratcheting_correction: bool,
    batch: &mut B,
    columns: &mut Columns,
) {
    let count = count.min(BATCH);
    for i in 0..count {
        let ([a, b], _) = batch.motions(i);
        let (geometry, frame, _) = batch.constants(i);
        Yade::set(columns, i, &a, &b, &geometry, &frame);
    }
    if ratcheting_correction {
        columns.apply(&Yade { dt, ratcheting_correction: true });
    } else {
        columns.apply(&Yade { dt, ratcheting_correction: false });
    }
    for i in 0..count {
        let measure = YadeMeasure::of_row(columns.get(i));
        let (geometry, frame, bonded) = batch.constants(i);
        batch.evaluate(i, &measure.point(&geometry, &frame, bonded));
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
        let mut frame = initial_geometry(&xa, &xb, &Vec3::zeros());
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
            let k = measure(
                MotionMeasure::Finite,
                &still(xa),
                &still(xb),
                &ImageShift::default(),
                &geometry,
                &frame,
                true,
                1.0,
            );
            assert!(k.shear_increment.norm() < 4e-15, "{}", k.shear_increment.norm());
            carried = k.transport.apply(&carried);
            frame = PreviousGeometry { normal: k.normal, length: k.length };
        }
        assert!((carried - expected).norm() < 1e-13, "{}", (carried - expected).norm());
    }
}
