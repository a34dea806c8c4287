//! YADE's measure: `Ig2_Sphere_Sphere_ScGeom` and `ScGeom::precompute`.

use super::super::{ContactInput, ImageShift, Motion, MotionSink, MotionSource, PointKinematics, Transport};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item};
use crate::geometry::{ContactGeometry, PreviousGeometry};
use crate::math::Vec3;
use crate::math::yade_order::{cross, dot, norm};

crate::columns! {
    /// Input of YADE's measure, without the image of B.
    pub struct YadeInput {
        position_a: Vec3,
        position_b: Vec3,
        velocity_a: Vec3,
        velocity_b: Vec3,
        angular_velocity_a: Vec3,
        angular_velocity_b: Vec3,
        /// Normal of the previous step.
        pub normal_old: Vec3,
        /// Radius of A, m.
        pub radius_a: f64,
        /// Radius of B, m.
        pub radius_b: f64,
        /// Center distance of the unstrained contact, m.
        pub reference_length: f64,
    }

    /// Output of YADE's measure.
    pub struct YadeMeasure {
        length: f64,
        penetration: f64,
        elongation: f64,
        arm_a: f64,
        arm_b: f64,
        normal: Vec3,
        shear_increment: Vec3,
        swing: Vec3,
        twist: Vec3,
    }
}

impl YadeInput {
    /// Input from the motions of A and B, the constants of their contact, and its geometry of the previous step.
    #[inline(always)]
    pub fn new(a: &Motion, b: &Motion, geometry: &ContactGeometry, previous: &PreviousGeometry) -> Self {
        Self {
            position_a: a.position,
            position_b: b.position,
            velocity_a: a.velocity,
            velocity_b: b.velocity,
            angular_velocity_a: a.angular_velocity,
            angular_velocity_b: b.angular_velocity,
            normal_old: previous.normal,
            radius_a: geometry.radius_a,
            radius_b: geometry.radius_b,
            reference_length: geometry.reference_length,
        }
    }
}

/// YADE's measure with or without its correction of ratcheting (`avoidGranularRatcheting`).
///
/// The order of floating point operations is YADE's (sums of three as `x + (y + z)`, no fused operations), so that the
/// result equals a trace of YADE bit for bit. The correction is a type parameter: each form compiles without the other.
#[derive(Debug, Clone, Copy)]
pub struct Yade<const RATCHETING: bool> {
    /// Time step, s.
    pub dt: f64,
}

impl<const RATCHETING: bool> Yade<RATCHETING> {
    /// Measure a contact.
    #[inline(always)]
    pub fn measure(&self, input: &YadeInput, image: &ImageShift) -> YadeMeasure {
        let YadeInput { position_a, position_b, velocity_a, velocity_b, .. } = *input;
        let YadeInput { angular_velocity_a, angular_velocity_b, radius_a, radius_b, .. } = *input;
        let YadeInput { reference_length, normal_old, .. } = *input;
        let (shift, shift_velocity) = (image.displacement, image.velocity);
        let l = position_b + shift - position_a;
        let length = norm(&l);
        let normal = l / length;
        let penetration = radius_a + radius_b - length;
        let reference_penetration = radius_a + radius_b - reference_length;
        let relative_velocity = if RATCHETING {
            let alpha = (radius_a + radius_b) / (radius_a + radius_b - penetration);
            (velocity_b - velocity_a) * alpha + cross(&angular_velocity_b, &(normal * -radius_b))
                - cross(&angular_velocity_a, &(normal * radius_a))
                + shift_velocity * alpha
        } else {
            let contact_point = position_a + normal * (radius_a - 0.5 * penetration);
            let arm_a = contact_point - position_a;
            let arm_b = contact_point - position_b - shift;
            (velocity_b + cross(&angular_velocity_b, &arm_b)) - (velocity_a + cross(&angular_velocity_a, &arm_a))
                + shift_velocity
        };
        let tangential = relative_velocity - normal * dot(&normal, &relative_velocity);
        let twist = self.dt * 0.5 * dot(&normal_old, &(angular_velocity_a + angular_velocity_b));
        let periodic_arm = 0.5 * (reference_penetration - penetration);
        let (arm_a, arm_b) = if image.periodic {
            (radius_a + periodic_arm, radius_b + periodic_arm)
        } else {
            (radius_a - 0.5 * penetration, radius_b - 0.5 * penetration)
        };
        YadeMeasure {
            length,
            penetration,
            elongation: reference_penetration - penetration,
            arm_a,
            arm_b,
            normal,
            shear_increment: tangential * self.dt,
            swing: cross(&normal_old, &normal),
            twist: normal_old * twist,
        }
    }
}

impl YadeMeasure {
    /// The measure as the input of a law.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, previous: &PreviousGeometry, bonded: bool) -> PointKinematics {
        PointKinematics {
            geometry: *geometry,
            length: self.length,
            length_old: previous.length,
            elongation: self.elongation,
            elongation_old: previous.length - geometry.reference_length,
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

#[inline(always)]
pub(super) fn measure<const RATCHETING: bool>(input: &ContactInput<'_>) -> PointKinematics {
    let ContactInput { a, b, image, geometry, previous, bonded, dt } = *input;
    let measure = Yade::<RATCHETING> { dt }.measure(&YadeInput::new(a, b, geometry, previous), image);
    measure.point(geometry, previous, bonded)
}

/// Contacts without a periodic cell.
impl<const RATCHETING: bool> Formula for Yade<RATCHETING> {
    type Input = YadeInput;
    type Output = YadeMeasure;

    #[inline(always)]
    fn apply(&self, input: YadeInput) -> YadeMeasure {
        self.measure(&input, &ImageShift::default())
    }
}

/// Write the input of contact `i` of a batch field by field, which keeps registers free. Returns the constants of the
/// contact, its geometry of the previous step, and whether it is a bond.
#[inline(always)]
pub fn write_yade_input<S: MotionSource>(
    arrays: &mut <YadeInput as Item>::Arrays,
    i: usize,
    source: &S,
) -> (ContactGeometry, PreviousGeometry, bool) {
    let ([a, b], _) = source.motions(i);
    let (geometry, previous, bonded) = source.constants(i);
    arrays.position_a.set(i, a.position);
    arrays.position_b.set(i, b.position);
    arrays.velocity_a.set(i, a.velocity);
    arrays.velocity_b.set(i, b.velocity);
    arrays.angular_velocity_a.set(i, a.angular_velocity);
    arrays.angular_velocity_b.set(i, b.angular_velocity);
    arrays.normal_old.set(i, previous.normal);
    arrays.radius_a.set(i, geometry.radius_a);
    arrays.radius_b.set(i, geometry.radius_b);
    arrays.reference_length.set(i, geometry.reference_length);
    (geometry, previous, bonded)
}

/// Measure the first `count` contacts of a batch without periodic images in YADE's form, and evaluate each. The bits
/// are those of [`measure`](super::measure). `dt` is the time step, s.
#[inline(always)]
pub fn yade_batch<const RATCHETING: bool, B: MotionSink<PointKinematics>>(
    count: usize,
    dt: f64,
    batch: &mut B,
    columns: &mut Columns,
) {
    let count = count.min(BATCH);
    for i in 0..count {
        write_yade_input(columns.input::<YadeInput>(), i, batch);
    }
    columns.apply(&Yade::<RATCHETING> { dt });
    for i in 0..count {
        let measure: YadeMeasure = columns.output::<YadeMeasure>().get(i);
        let (geometry, previous, bonded) = batch.constants(i);
        batch.evaluate(i, &measure.point(&geometry, &previous, bonded));
    }
}
