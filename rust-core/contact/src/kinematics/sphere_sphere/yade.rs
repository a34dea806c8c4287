//! YADE's measure: `Ig2_Sphere_Sphere_ScGeom` and `ScGeom::precompute`.

use super::super::{ContactInput, ImageShift, Motion, MotionSink, MotionSource, PointKinematics, Transport};
use crate::columns::{Arrays, BATCH, Columns, Formula, Item, places};
use crate::geometry::{ContactGeometry, PreviousGeometry, Reference};
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
        /// Geometry of the previous step.
        pub previous: PreviousGeometry,
        /// Radius of A, m.
        pub radius_a: f64,
        /// Radius of B, m.
        pub radius_b: f64,
        /// Unstrained geometry.
        pub reference: Reference,
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
            previous: *previous,
            radius_a: geometry.radius_a,
            radius_b: geometry.radius_b,
            reference: Reference { length: geometry.reference_length, area: geometry.area },
        }
    }

    /// Write the inputs of the first `count` contacts of a batch to columns.
    #[inline(always)]
    pub fn write<S: MotionSource>(arrays: &mut <Self as Item>::Arrays, count: usize, source: &S) {
        source.read_previous(count, &mut arrays.previous);
        source.read_references(count, &mut arrays.reference);
        for i in (0..count).step_by(4) {
            let (places, lanes) = (places(i, count), source.lanes());
            let [[a, b, c, d], on_b] = source.four_poses(places);
            arrays.position_a.set_four(i, [&a.position, &b.position, &c.position, &d.position], lanes);
            for (k, pose) in (i..).zip([a, b, c, d]) {
                arrays.radius_a.set(k, pose.radius);
            }
            let [a, b, c, d] = on_b;
            arrays.position_b.set_four(i, [&a.position, &b.position, &c.position, &d.position], lanes);
            for (k, pose) in (i..).zip([a, b, c, d]) {
                arrays.radius_b.set(k, pose.radius);
            }
            let [i0, i1, i2, i3] = places;
            let [a, b, c, d] =
                [source.velocities(i0), source.velocities(i1), source.velocities(i2), source.velocities(i3)];
            arrays.velocity_a.set_four(i, [a.0[0], b.0[0], c.0[0], d.0[0]], lanes);
            arrays.velocity_b.set_four(i, [a.0[1], b.0[1], c.0[1], d.0[1]], lanes);
            arrays.angular_velocity_a.set_four(i, [a.1[0], b.1[0], c.1[0], d.1[0]], lanes);
            arrays.angular_velocity_b.set_four(i, [a.1[1], b.1[1], c.1[1], d.1[1]], lanes);
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
        let (reference_length, normal_old) = (input.reference.length, input.previous.normal);
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
    YadeInput::write(columns.input::<YadeInput>(), count, batch);
    columns.apply(&Yade::<RATCHETING> { dt });
    for i in 0..count {
        let measure: YadeMeasure = columns.output::<YadeMeasure>().get(i);
        let (geometry, previous, bonded) = batch.constants(i);
        batch.evaluate(i, &measure.point(&geometry, &previous, bonded));
    }
}
