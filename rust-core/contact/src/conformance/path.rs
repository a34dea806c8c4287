//! Paths of two spheres: prescribed deformations on top of rigid motions.

use std::f64::consts::{PI, TAU};

use super::Station;
use crate::geometry::ContactGeometry;
use crate::math::{Quat, Vec3, atan2, normalized, quaternion_of_rotation_vector, rotate, sin_cos};

/// Position and orientation of a sphere.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pose {
    /// Center, m.
    pub position: Vec3,
    /// Orientation, body to world, unit.
    pub orientation: Quat,
}

/// A rigid motion as a function of the completed fraction of the path: rotation about the origin, then translation.
pub type RigidMotion<'a> = &'a dyn Fn(f64) -> Pose;

/// Path of two spheres, and the axes in which it is prescribed.
#[derive(Debug, Clone)]
pub struct Path {
    /// Poses of A and B at the ends of the steps.
    pub poses: Vec<[Pose; 2]>,
    /// Rotation from the path's own axes (normal = x, tangents y and z) to world axes, at the same instants.
    pub axes: Vec<Quat>,
}

/// The rigid motion of a path at rest.
pub fn at_rest(_share: f64) -> Pose {
    Pose { position: Vec3::zeros(), orientation: Quat::identity() }
}

impl Path {
    /// Move a pair through `stations`, on top of a rigid motion of both.
    ///
    /// In the moving axes the normal stays x, and the length is the reference length plus the elongation. Shear comes from
    /// rotations of both spheres about the same tangential axis, by an angle whose sine is the shear increment divided by
    /// the mean length of the step; the finite measure returns it exactly. Twist comes from opposite rotations, half of it
    /// each, about the normal.
    pub fn new(geometry: &ContactGeometry, stations: &[Station], rigid: RigidMotion<'_>) -> Self {
        let mut turned = [Quat::identity(); 2];
        let (mut poses, mut axes) = (Vec::new(), Vec::new());
        let steps = stations.len().saturating_sub(1).max(1) as f64;
        for (index, now) in stations.iter().enumerate() {
            let length = geometry.reference_length + now.elongation;
            if index > 0 {
                let before = &stations[index - 1];
                let mean_length = geometry.reference_length + 0.5 * (before.elongation + now.elongation);
                // Sine vectors: equal tangential parts, opposite normal parts, so the mean twist is zero.
                let y = (now.shear[1] - before.shear[1]) / mean_length;
                let z = (before.shear[0] - now.shear[0]) / mean_length;
                let twist = sin_cos(0.5 * (now.twist - before.twist)).0;
                for (orientation, normal) in turned.iter_mut().zip([-twist, twist]) {
                    *orientation = normalized(&(rotation_of_sine(&Vec3::new(normal, y, z)) * *orientation));
                }
            }
            let motion = rigid(index as f64 / steps);
            let place = |x: f64, orientation: Quat| Pose {
                position: rotate(&motion.orientation, &Vec3::new(x, 0.0, 0.0)) + motion.position,
                orientation: normalized(&(motion.orientation * orientation)),
            };
            poses.push([place(0.0, turned[0]), place(length, turned[1])]);
            axes.push(motion.orientation);
        }
        Self { poses, axes }
    }

    /// The same path with the two spheres exchanged.
    pub(super) fn exchanged(&self) -> Self {
        Self { poses: self.poses.iter().map(|&[a, b]| [b, a]).collect(), axes: self.axes.clone() }
    }
}

/// Stations along straight legs between `knots`, `steps` per leg, with a cosine ramp in each leg.
pub fn legs(knots: &[Station], steps: usize) -> Vec<Station> {
    let mut stations = Vec::with_capacity(knots.len() * steps + 1);
    stations.extend(knots.first());
    for pair in knots.windows(2) {
        for k in 1..=steps {
            let share = if k == steps { 1.0 } else { 0.5 - 0.5 * sin_cos(PI * k as f64 / steps as f64).1 };
            let mix = |from: f64, to: f64| if k == steps { to } else { from + (to - from) * share };
            stations.push(Station {
                elongation: mix(pair[0].elongation, pair[1].elongation),
                shear: [mix(pair[0].shear[0], pair[1].shear[0]), mix(pair[0].shear[1], pair[1].shear[1])],
                twist: mix(pair[0].twist, pair[1].twist),
            });
        }
    }
    stations
}

/// A random rigid motion: a rotation by 2π about one axis, a rotation about another, and a translation.
pub(super) fn random_motion(seed: u64, size: f64) -> impl Fn(f64) -> Pose {
    let mut random = Random::new(seed);
    let (axis, other, away) = (random.direction(), random.direction(), random.direction());
    move |share| Pose {
        position: away * (3.0 * size * share),
        orientation: normalized(
            &(quaternion_of_rotation_vector(&(axis * (TAU * share)))
                * quaternion_of_rotation_vector(&(other * (1.5 * share)))),
        ),
    }
}

/// Reproducible pseudorandom numbers (SplitMix64, Steele, Lea & Flood 2014).
#[derive(Debug, Clone)]
pub struct Random(u64);

impl Random {
    /// Generator with a seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// Uniform in `[from, to)`.
    pub fn uniform(&mut self, from: f64, to: f64) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        from + (to - from) * ((z >> 11) as f64 * (1.0 / (1_u64 << 53) as f64))
    }

    /// A random direction, uniform on the sphere.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let v = Vec3::new(self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0), self.uniform(-1.0, 1.0));
            let norm = v.norm();
            if norm > 0.1 && norm < 1.0 {
                return v / norm;
            }
        }
    }
}

/// Rotation vector of a unit quaternion, rad; the shorter way round.
pub(super) fn rotation_vector(q: &Quat) -> Vec3 {
    let (u, w) = if q.w < 0.0 { (-q.imag(), -q.w) } else { (q.imag(), q.w) };
    let sine = u.norm();
    if sine > 0.0 { u * (2.0 * atan2(sine, w) / sine) } else { u * 2.0 }
}

/// The rotation of less than a quarter turn whose axis times the sine of its angle is `sine`; a quarter turn if that vector
/// is longer than 1.
fn rotation_of_sine(sine: &Vec3) -> Quat {
    let size = sine.norm();
    if size == 0.0 {
        return Quat::identity();
    }
    let angle = atan2(size, ((1.0 - size) * (1.0 + size)).max(0.0).sqrt());
    quaternion_of_rotation_vector(&(sine * (angle / size)))
}
