//! The finite measure; see the [parent module](super) for the equations.

use super::super::transport::Turn;
use super::super::{ContactInput, MotionSink, MotionSource, PointKinematics, Pose};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, places};
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::math::{Quat, Vec3, norm};

crate::columns! {
    /// Input of the finite measure.
    pub struct FiniteInput {
        /// A with its rotation in the step.
        pub a: Pose,
        /// B with its rotation in the step.
        pub b: Pose,
        /// Displacement of B's image, m.
        pub shift: Vec3,
        /// Geometry of the previous step.
        pub previous: PreviousGeometry,
    }

    /// Output of the finite measure.
    pub struct FiniteMeasure {
        length: f64,
        gap: f64,
        normal: Vec3,
        shear_increment: Vec3,
        turn: Turn,
    }
}

impl FiniteInput {
    /// Write the inputs of the first `count` contacts of a batch to columns.
    #[inline(always)]
    pub fn write<S: MotionSource>(arrays: &mut <Self as Item>::Arrays, count: usize, source: &S) {
        arrays.shift = bytemuck::Zeroable::zeroed();
        source.read_previous(count, &mut arrays.previous);
        let lanes = source.lanes();
        for i in (0..count).step_by(4) {
            let [a, b] = source.four_poses(places(i, count));
            arrays.a.set_four(i, a, lanes);
            arrays.b.set_four(i, b, lanes);
        }
        if S::PERIODIC && source.may_cross_border() {
            for i in 0..count {
                if let Some(shift) = source.shift(i) {
                    arrays.shift.set(i, shift);
                }
            }
        }
        if source.has_rotations() {
            for i in 0..count {
                if let Some([a, b]) = source.rotations(i) {
                    arrays.a.rotation.set(i, a);
                    arrays.b.rotation.set(i, b);
                }
            }
        }
    }

    /// Measure the contact.
    #[inline(always)]
    pub fn measure(&self) -> FiniteMeasure {
        let Self { a, b, shift, previous } = *self;
        let (rotation_a, rotation_b, radius_a, radius_b) = (a.rotation, b.rotation, a.radius, b.radius);
        let branch = b.position + shift - a.position;
        let length = norm(&branch);
        let normal = branch * (1.0 / length);
        let gap = length - radius_a - radius_b;
        let rotation_sum = Quat::from(rotation_a.coords + rotation_b.coords);
        let swing_axis = previous.normal.cross(&normal);
        let turn = Turn::finite(&previous.normal, &normal, &swing_axis, &rotation_sum);
        let mean_length = 0.5 * (length + previous.length);
        let mean_half_gap = 0.5 * (mean_length - radius_a - radius_b);
        // 2 w u is the sine vector of a rotation (u, w).
        let turn_a = 2.0 * rotation_a.w * (radius_a + mean_half_gap);
        let turn_b = 2.0 * rotation_b.w * (radius_b + mean_half_gap);
        let turned = rotation_a.imag() * turn_a + rotation_b.imag() * turn_b;
        let c = previous.normal.dot(&normal);
        let late = (previous.normal - normal * c) * mean_length + turned.cross(&normal);
        let along = (turned.dot(&previous.normal) + turned.dot(&normal)) / (1.0 + c);
        let early = late - swing_axis * along;
        let shear_increment = (turn.twist(&normal, &early) + late) * -0.5;
        FiniteMeasure { length, gap, normal, shear_increment, turn }
    }
}

impl FiniteMeasure {
    /// The measure as the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, previous: &PreviousGeometry, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: previous.length,
            elongation: self.length - geometry.reference_length,
            elongation_old: previous.length - geometry.reference_length,
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

#[inline(always)]
pub(super) fn measure(input: &ContactInput<'_>) -> PointKinematics {
    let ContactInput { a, b, geometry, previous, bonded, .. } = *input;
    let input = FiniteInput {
        a: Pose { position: a.position, rotation: a.rotation_increment, radius: geometry.radius_a },
        b: Pose { position: b.position, rotation: b.rotation_increment, radius: geometry.radius_b },
        shift: input.image.displacement,
        previous: *previous,
    };
    input.measure().point(geometry, previous, bonded)
}

/// The finite measure in columns.
struct Finite;

impl Formula for Finite {
    type Input = FiniteInput;
    type Output = FiniteMeasure;

    #[inline(always)]
    fn apply(&self, input: FiniteInput) -> FiniteMeasure {
        input.measure()
    }
}

/// Measure the first `count` contacts of a batch with the finite measure, and evaluate each. The bits are those of
/// [`measure`](super::measure) with [`Finite`](crate::kinematics::MotionMeasure::Finite).
#[inline(always)]
pub fn finite_batch<B: MotionSink<PointKinematics>>(count: usize, batch: &mut B, columns: &mut Columns) {
    let count = count.min(BATCH);
    FiniteInput::write(columns.input::<FiniteInput>(), count, batch);
    columns.apply(&Finite);
    for i in 0..count {
        let measure: FiniteMeasure = columns.output::<FiniteMeasure>().get(i);
        let (geometry, previous, bonded) = batch.constants(i);
        batch.evaluate(i, &measure.point(&geometry, &previous, bonded));
    }
}
