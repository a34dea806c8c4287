//! Rotations of the two ends of a bond that transmits moments, relative to its branch vector.
//!
//! At bonding each particle gets a copy of the bond's direction, fixed in its body. With `X` the unit branch vector now (from
//! A to B), `t_A`, `t_B` the copies now, and `D` the rotation of B relative to A since bonding (`D t_A = t_B`):
//!
//! * end rotations `θ_p = (α/sin α) X × t_p`, `sin α = |X × t_p|`, `cos α = X·t_p`: the rotation vector from the branch
//!   vector to the end's own direction (rad, perpendicular to `X`). It equals `θ_y Y + θ_z Z` of the source, but needs
//!   no axes `Y`, `Z`, which are undefined at rest (Jebahi et al. 2015, below [2.9]);
//! * twist `τ`: the part of `D` beyond the smallest rotation from `t_A` to `t_B`,
//!   `tan ½τ = u·(t_A+t_B) / ((1 + t_A·t_B) w + (t_A×t_B)·u)` with `D = (u, w)`; `θ_Bx − θ_Ax` for small rotations.
//!
//! They are exact for rigid motions of any size and do not depend on the step, so all motion measures share them. Their
//! derivatives, which make forces conservative, are [`EndRotations::end_moment`] and [`EndRotations::twist_axis`].

use super::{ContactInput, Kinematics, MotionMeasure, PointKinematics, Transport, WallInput};
use crate::geometry::{ContactGeometry, PreviousGeometry};
#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Quat, Vec3, atan2, is_zero, norm, rotate};
use crate::wrench::torques;

/// Motion of a bond with two ends.
#[derive(Debug, Clone, Copy)]
pub struct FrameKinematics {
    /// Branch vector as a point contact in the middle of the bond: both arms are half the length, so that the moment of a
    /// response is that of the middle section. Shear increment and transport are unused and empty.
    pub point: PointKinematics,
    /// Orientation of A, body to world, unit.
    pub orientation_a: Quat,
    /// Orientation of B, body to world, unit.
    pub orientation_b: Quat,
    /// Displacement of B relative to A in the step, m.
    pub displacement: Vec3,
    /// Rotation of A in the step (vector of its sine), rad.
    pub turn_a: Vec3,
    /// Rotation of B in the step, rad.
    pub turn_b: Vec3,
}

/// Unloaded state of a bond. The bodies may have different orientations in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RestFrame {
    /// Direction from A to B in the axes half way between those of the two bodies, unit.
    pub direction: Vec3,
    /// Vector part of the unit quaternion `h` (real part not negative) for which `q_B h = q_A h⁻¹` are these axes.
    pub rotation: Vec3,
}

/// Rotations of the ends of a bond relative to its branch vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndRotations {
    /// Rotation vector of the end at A, rad; perpendicular to the branch vector.
    pub a: Vec3,
    /// Rotation vector of the end at B, rad; perpendicular to the branch vector.
    pub b: Vec3,
    /// Twist of B relative to A, rad.
    pub twist: f64,
    branch: Vec3,
    /// Unit branch vector × end direction.
    sine: [Vec3; 2],
    /// Unit branch vector · end direction.
    cosine: [f64; 2],
    /// α/sin α and (1 − α cos α/sin α)/sin² α.
    factor: [[f64; 2]; 2],
    /// `(t_A + t_B)/(1 + t_A·t_B)`.
    twist_axis: Vec3,
}

/// Forces of a bond on its two particles.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EndLoads {
    /// Force on A, N; B gets the opposite.
    pub force: Vec3,
    /// Moment on A about its center, N·m.
    pub moment_a: Vec3,
    /// Moment on B about its center, N·m.
    pub moment_b: Vec3,
}

impl EndLoads {
    /// Moment of the middle section, which laws return, N·m.
    #[inline(always)]
    pub fn moment(&self) -> Vec3 {
        (self.moment_a - self.moment_b) * 0.5
    }

    /// Size of its part that bends a bond of this unit branch vector, N·m.
    #[inline(always)]
    pub fn bending(&self, branch: &Vec3) -> f64 {
        0.5 * norm(&across(branch, self.moment_a - self.moment_b))
    }
}

/// Part of a moment perpendicular to the branch vector.
#[inline(always)]
pub(crate) fn across(branch: &Vec3, moment: Vec3) -> Vec3 {
    moment - branch * branch.dot(&moment)
}

/// Largest twist, and largest rotation of an end, that a bond endures, rad. Less than π by far more than a step turns.
const LARGEST_ROTATION: f64 = 3.0;

/// Below this squared sine (5.7°) a series replaces the arc tangent; its error after eight terms is 1e-17.
const SERIES: f64 = 1.0e-2;

/// Angles from sines and cosines.
trait Arcs {
    /// `α/sin α` and `(1 − α cot α)/sin² α` from `sin² α` and `cos α`.
    fn factors(sine_squared: f64, cosine: f64) -> [f64; 2];
    /// Angle whose half has the tangent `imaginary/real`, in (−π, π].
    fn twice(imaginary: f64, real: f64) -> f64;
}

/// Angles of any size.
struct AnyAngles;

/// Small angles, computed from series without branches; see [`RotationSines::are_small`].
struct SmallAngles;

impl Arcs for AnyAngles {
    #[inline(always)]
    fn factors(sine_squared: f64, cosine: f64) -> [f64; 2] {
        if sine_squared < SERIES && cosine > 0.0 {
            return SmallAngles::factors(sine_squared, cosine);
        }
        let sine = sine_squared.sqrt();
        if sine == 0.0 {
            // Half a turn: the direction of the rotation is undefined.
            return [1.0, 0.0];
        }
        let arc = atan2(sine, cosine) / sine;
        [arc, (1.0 - arc * cosine) / sine_squared]
    }

    #[inline(always)]
    fn twice(imaginary: f64, real: f64) -> f64 {
        if imaginary * imaginary < SERIES * (real * real) {
            return SmallAngles::twice(imaginary, real);
        }
        // The quaternion −D is the same rotation.
        let (i, r) = if real < 0.0 { (-imaginary, -real) } else { (imaginary, real) };
        2.0 * atan2(i, r)
    }
}

impl Arcs for SmallAngles {
    #[inline(always)]
    fn factors(sine_squared: f64, _cosine: f64) -> [f64; 2] {
        let y = sine_squared;
        let arc = 1.0
            + y * (1.0 / 6.0
                + y * (3.0 / 40.0
                    + y * (5.0 / 112.0
                        + y * (35.0 / 1152.0
                            + y * (63.0 / 2816.0 + y * (231.0 / 13_312.0 + y * (143.0 / 10_240.0)))))));
        let rest = 1.0 / 3.0
            + y * (2.0 / 15.0
                + y * (8.0 / 105.0
                    + y * (16.0 / 315.0
                        + y * (128.0 / 3465.0
                            + y * (256.0 / 9009.0 + y * (1024.0 / 45_045.0 + y * (2048.0 / 109_395.0)))))));
        [arc, rest]
    }

    #[inline(always)]
    fn twice(imaginary: f64, real: f64) -> f64 {
        let ratio = imaginary / real;
        let y = ratio * ratio;
        let series = 1.0
            - y * (1.0 / 3.0
                - y * (1.0 / 5.0 - y * (1.0 / 7.0 - y * (1.0 / 9.0 - y * (1.0 / 11.0 - y * (1.0 / 13.0 - y / 15.0))))));
        2.0 * ratio * series
    }
}

impl RestFrame {
    /// Rest frame of a bond that is unloaded now: unit branch vector `normal`, orientations of the bodies (body to
    /// world).
    pub fn new(normal: &Vec3, orientation_a: &Quat, orientation_b: &Quat) -> Self {
        let relative = orientation_b.conjugate() * orientation_a;
        // Square root of a unit quaternion: half the angle, by the shorter way round.
        let relative = if relative.w < 0.0 { -relative } else { relative };
        let real = (0.5 * (1.0 + relative.w)).sqrt();
        let rotation = relative.imag() / (2.0 * real);
        let middle = orientation_b * Quat::from_parts(real, rotation);
        Self { direction: rotate(&middle.conjugate(), normal), rotation }
    }

    /// Orientations of A and B, each rotated to the axes half way between them at bonding.
    #[inline(always)]
    fn halved(&self, [qa, qb]: [Quat; 2]) -> [Quat; 2] {
        let half = Quat::from_parts((1.0 - self.rotation.norm_squared()).max(0.0).sqrt(), self.rotation);
        [qa * half.conjugate(), qb * half]
    }
}

/// Line from the center of A to that of B.
#[derive(Debug, Clone, Copy)]
pub struct BranchVector {
    /// Length, m.
    pub length: f64,
    /// Direction, unit.
    pub normal: Vec3,
}

impl BranchVector {
    /// Length and direction of the vector `branch`, m.
    #[inline(always)]
    pub fn of(branch: &Vec3) -> Self {
        let length = norm(branch);
        Self { length, normal: branch * (1.0 / length) }
    }

    /// Rotations of the ends since the state `rest`, computed without branches, and whether they are small. Only then
    /// they are valid, and they equal [`FrameKinematics::rotations`] bit for bit. `turned`: whether the orientations of
    /// the bodies may have differed at bonding.
    #[inline(always)]
    pub fn small_rotations(&self, orientations: [Quat; 2], rest: &RestFrame, turned: bool) -> (EndRotations, bool) {
        let orientations = if turned {
            // Bitwise operators, because `&&` would branch.
            let r = rest.rotation;
            #[allow(clippy::needless_bitwise_bool)]
            let alike = (r.x == 0.0) & (r.y == 0.0) & (r.z == 0.0);
            let halved = rest.halved(orientations);
            let choose = |i: usize| {
                let (whole, half) = (orientations[i].coords, halved[i].coords);
                Quat::from(whole.zip_map(&half, |whole, half| if alike { whole } else { half }))
            };
            [choose(0), choose(1)]
        } else {
            orientations
        };
        let sines = RotationSines::between(&self.normal, &orientations, &rest.direction);
        (sines.angles::<SmallAngles>(), sines.are_small())
    }

    /// The bond as a point contact at its middle.
    #[inline(always)]
    pub fn point(&self, geometry: &ContactGeometry, previous: &PreviousGeometry, bonded: bool) -> PointKinematics {
        let Self { length, normal } = *self;
        PointKinematics {
            geometry: *geometry,
            length,
            length_old: previous.length,
            elongation: length - geometry.reference_length,
            elongation_old: previous.length - geometry.reference_length,
            gap: length - geometry.radius_a - geometry.radius_b,
            normal,
            shear_increment: Vec3::zeros(),
            arm_a: 0.5 * length,
            arm_b: 0.5 * length,
            bonded,
            transport: Transport::identity(normal),
        }
    }
}

/// Sines and cosines of the rotations of a bond's ends.
#[derive(Clone, Copy)]
struct RotationSines {
    branch: Vec3,
    /// Unit branch vector × end direction.
    sine: [Vec3; 2],
    /// Its square.
    sine_squared: [f64; 2],
    /// Unit branch vector · end direction.
    cosine: [f64; 2],
    /// Imaginary and real part of the twist quaternion, up to a common factor.
    twist: [f64; 2],
    /// `(t_A + t_B)/(1 + t_A·t_B)`.
    twist_axis: Vec3,
}

impl RotationSines {
    /// Sines and cosines for bodies with the orientations `qa` and `qb`; `direction` is the direction of the bond in
    /// the axes of either body at bonding.
    #[inline(always)]
    fn between(branch: &Vec3, [qa, qb]: &[Quat; 2], direction: &Vec3) -> Self {
        let (ta, tb) = (rotate(qa, direction), rotate(qb, direction));
        // q_B q_A*, written so that exchanging A and B changes its sign exactly.
        let (ua, ub) = (qa.imag(), qb.imag());
        let u = (ub * qa.w - ua * qb.w) + ua.cross(&ub);
        let w = qa.w * qb.w + ua.dot(&ub);
        let (sine_a, sine_b) = (branch.cross(&ta), branch.cross(&tb));
        let sum = ta + tb;
        // Ends that point in opposite directions have no twist; the floor avoids a division by zero.
        let one_and_cosine = (1.0 + ta.dot(&tb)).max(f64::MIN_POSITIVE);
        Self {
            branch: *branch,
            sine: [sine_a, sine_b],
            sine_squared: [sine_a.norm_squared(), sine_b.norm_squared()],
            cosine: [branch.dot(&ta), branch.dot(&tb)],
            twist: [u.dot(&sum), one_and_cosine * w + ta.cross(&tb).dot(&u)],
            twist_axis: sum / one_and_cosine,
        }
    }

    /// Whether all angles are small enough for their series. Uses bitwise operators, because `&&` would branch.
    #[inline(always)]
    #[allow(clippy::needless_bitwise_bool)]
    fn are_small(&self) -> bool {
        let [imaginary, real] = self.twist;
        (self.sine_squared[0] < SERIES)
            & (self.sine_squared[1] < SERIES)
            & (self.cosine[0] > 0.0)
            & (self.cosine[1] > 0.0)
            & (imaginary * imaginary < SERIES * (real * real))
    }

    #[inline(always)]
    fn angles<A: Arcs>(&self) -> EndRotations {
        let factor =
            [A::factors(self.sine_squared[0], self.cosine[0]), A::factors(self.sine_squared[1], self.cosine[1])];
        EndRotations {
            a: self.sine[0] * factor[0][0],
            b: self.sine[1] * factor[1][0],
            twist: A::twice(self.twist[0], self.twist[1]),
            branch: self.branch,
            sine: self.sine,
            cosine: self.cosine,
            factor,
            twist_axis: self.twist_axis,
        }
    }
}

impl FrameKinematics {
    /// Measure a bond.
    #[inline(always)]
    pub fn new(input: &ContactInput<'_>) -> Self {
        let ContactInput { a, b, image, geometry, previous, bonded, dt } = *input;
        let branch = BranchVector::of(&input.branch());
        let sine = |q: &Quat| q.imag() * (2.0 * q.w);
        Self {
            point: branch.point(geometry, previous, bonded),
            orientation_a: a.orientation,
            orientation_b: b.orientation,
            displacement: (b.velocity + image.velocity - a.velocity) * dt,
            turn_a: sine(&a.rotation_increment),
            turn_b: sine(&b.rotation_increment),
        }
    }

    /// Rest frame of a bond that is unloaded in this state.
    pub fn rest(&self) -> RestFrame {
        RestFrame::new(&self.point.normal, &self.orientation_a, &self.orientation_b)
    }

    /// Rotations of the ends since the state `rest`.
    #[inline(always)]
    pub fn rotations(&self, rest: &RestFrame) -> EndRotations {
        let mut orientations = [self.orientation_a, self.orientation_b];
        if !is_zero(&rest.rotation) {
            orientations = rest.halved(orientations);
        }
        RotationSines::between(&self.point.normal, &orientations, &rest.direction).angles::<AnyAngles>()
    }

    /// Work of constant forces on the bond in the step, J: `force` and `moment_a` act on A, `−force` and `moment_b` on B;
    /// moments about the centers.
    #[inline(always)]
    pub fn work(&self, force: &Vec3, moment_a: &Vec3, moment_b: &Vec3) -> f64 {
        force.dot(&self.displacement) - moment_a.dot(&self.turn_a) - moment_b.dot(&self.turn_b)
    }
}

impl EndRotations {
    /// Moment on the body of end `end` (0: A, 1: B) about its center, N·m, of an energy whose derivative with respect to
    /// the end's rotation vector is `derivative` (N·m, perpendicular to the branch vector).
    ///
    /// With `w` the derivative, `s = X × t`, `c = X·t`, `g = α/sin α`, and `h = (1 − g c)/sin² α`, a rotation `δω` of the
    /// body changes the energy by `w·δθ = δω·[g c w − g (t·w) X + h (w·s) s]`. In plane bending the bracket is `w`.
    #[inline(always)]
    pub fn end_moment(&self, end: usize, derivative: &Vec3) -> Vec3 {
        let (s, c, [g, h]) = (self.sine[end], self.cosine[end], self.factor[end]);
        // t = c X + s × X, and w ⟂ X.
        let along = s.cross(&self.branch).dot(derivative);
        -(derivative * (g * c) - self.branch * (g * along) + s * (h * derivative.dot(&s)))
    }

    /// Force and moments of a stored energy, from its derivatives with respect to the elongation (`axial`, N), the rotation
    /// vectors of both ends (`by_ends`, N·m, perpendicular to the branch vector), and the twist (`by_twist`, N·m), at the
    /// center distance `length` (m). They conserve this energy, and balance about any point.
    #[inline(always)]
    pub fn loads(&self, length: f64, axial: f64, by_ends: [Vec3; 2], by_twist: f64) -> EndLoads {
        let torsion = self.twist_axis() * by_twist;
        let moment_a = self.end_moment(0, &by_ends[0]) + torsion;
        let moment_b = self.end_moment(1, &by_ends[1]) - torsion;
        let force = self.branch * axial - self.branch.cross(&(moment_a + moment_b)) * (1.0 / length);
        EndLoads { force, moment_a, moment_b }
    }

    /// Whether an end or the twist has turned so far that the bond must break: orientations tell turns apart up to half a turn,
    /// beyond which a moment would change its sign.
    #[inline(always)]
    pub fn turned_too_far(&self) -> bool {
        let largest_end = self.a.norm_squared().max(self.b.norm_squared());
        self.twist.abs() > LARGEST_ROTATION || largest_end > LARGEST_ROTATION * LARGEST_ROTATION
    }

    /// Derivative of the twist with respect to a rotation of B: `(t_A+t_B)/(1+t_A·t_B)`. For A it has the opposite sign. It
    /// equals the unit branch vector while the ends point along it.
    #[inline(always)]
    pub fn twist_axis(&self) -> Vec3 {
        self.twist_axis
    }
}

impl Kinematics for FrameKinematics {
    const ONE_MODE: bool = true;
    const READS_ORIENTATIONS: bool = true;

    #[inline(always)]
    fn measure(_mode: MotionMeasure, input: &ContactInput<'_>) -> Self {
        Self::new(input)
    }

    fn measure_wall(_mode: MotionMeasure, _input: &WallInput<'_>) -> Option<Self> {
        None
    }

    #[inline(always)]
    fn point(&self) -> &PointKinematics {
        &self.point
    }
    fn bond_work(&self, force: &Vec3, moment: &Vec3) -> f64 {
        let PointKinematics { normal, elongation, elongation_old, arm_a, arm_b, .. } = &self.point;
        let [torque_a, torque_b] = torques(normal, force, [*arm_a, *arm_b]);
        let expansion = normal.dot(&self.displacement) - (elongation - elongation_old);
        self.work(force, &(torque_a + moment), &(torque_b - moment)) - force.dot(normal) * expansion
    }
    fn with_surface_displacement(&self, now: f64, before: f64) -> Self {
        Self { point: self.point.with_surface_displacement(now, before), ..*self }
    }
    fn arms(_geometry: &ContactGeometry, length: f64) -> (f64, f64) {
        (0.5 * length, 0.5 * length)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Series and arc tangent agree where they meet. Tolerance: the second factor is a difference of numbers near 1,
    /// divided by 1e-2. At large angles the factors equal their definitions.
    #[test]
    fn arc_factors_are_continuous_and_right() {
        let at = |sine: f64| AnyAngles::factors(sine * sine, (1.0 - sine * sine).sqrt());
        let below = at(0.1 * (1.0 - 1e-12));
        let above = at(0.1 * (1.0 + 1e-12));
        for k in 0..2 {
            assert!((below[k] - above[k]).abs() < 4e-14, "{below:?} {above:?}");
        }
        let angle = 2.5_f64;
        let [g, h] = AnyAngles::factors(angle.sin().powi(2), angle.cos());
        assert!((g - angle / angle.sin()).abs() < 4e-15 * g, "{g}");
        assert!((h - (1.0 - angle / angle.tan()) / angle.sin().powi(2)).abs() < 4e-14 * h, "{h}");
        for angle in [1e-9_f64, 1e-3, 0.19, 0.21, 1.0, 3.1, -0.7] {
            let (s, c) = (0.5 * angle).sin_cos();
            assert!((AnyAngles::twice(s, c) - angle).abs() <= 1e-15 * angle.abs().max(1.0), "{angle}");
            assert!((AnyAngles::twice(-s, -c) - angle).abs() <= 1e-15 * angle.abs().max(1.0), "{angle}");
        }
    }

    /// What the ends of a bond across the border of a sheared cell move relative to each other in a step is the change of the
    /// branch vector, to first order in the rotation of the cell (1e-6): half of it comes from the border here.
    #[test]
    fn displacement_is_the_change_of_the_branch_vector() {
        use crate::Cell;
        use crate::kinematics::{ImageShift, Motion};
        use crate::math::Mat3;

        let dt = 1e-3;
        let mut cell = Cell::new_box(Vec3::new(2.0, 3.0, 4.0));
        cell.velocity_gradient = Mat3::new(1e-3, 5e-4, 0.0, -2e-4, 0.0, 3e-4, 0.0, 0.0, -1e-3);
        let motion = |position: Vec3, velocity: Vec3| Motion {
            position,
            velocity,
            angular_velocity: Vec3::zeros(),
            rotation_increment: Quat::identity(),
            orientation: Quat::identity(),
        };
        let image = [1, -1, 0];
        let (a, b) = (Vec3::new(1.9, 0.2, 1.0), Vec3::new(0.3, 2.9, 1.5));
        let (va, vb) = (Vec3::new(1e-3, 0.0, 2e-3), Vec3::new(-1e-3, 1e-3, 0.0));
        let before = b + cell.shift(image) - a;
        cell.matrix += cell.velocity_gradient * cell.matrix * dt;
        let (a, b) = (motion(a + va * dt, va), motion(b + vb * dt, vb));
        let geometry = ContactGeometry {
            reference_length: 1.0,
            area: 1.0,
            radius_a: 0.5,
            radius_b: 0.5,
            mass_a: 1.0,
            mass_b: 1.0,
        };
        let previous = PreviousGeometry { normal: before.normalize(), length: before.norm() };
        let shift = ImageShift::of(&cell, image, MotionMeasure::Finite);
        let input =
            ContactInput { a: &a, b: &b, image: &shift, geometry: &geometry, previous: &previous, bonded: true, dt };
        let change = input.branch() - before;
        let found = FrameKinematics::new(&input).displacement;
        assert!(change.norm() > 1e-6 && (found - change).norm() < 1e-5 * change.norm(), "{found} {change}");
    }
}
