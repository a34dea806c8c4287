//! Small vectors, quaternions and processor-independent elementary functions.
//!
//! All transcendental functions of the solver come from [`libm`] (pure Rust), so that results do not depend on the C
//! library or processor. `sqrt` is correctly rounded on every machine, so the code calls it directly.

mod symmetric;

pub use symmetric::Symmetric;

use nalgebra::{Matrix3, Quaternion, Vector3};

/// Vector of three reals, in the SI unit of the quantity.
pub type Vec3 = Vector3<f64>;
/// 3×3 matrix of reals.
pub type Mat3 = Matrix3<f64>;
/// Quaternion (unit where it is an orientation; maps body to world). Storage order i, j, k, w.
pub type Quat = Quaternion<f64>;

/// Functions of `f64` from the standard library, for builds without it.
#[cfg(not(feature = "std"))]
pub(crate) trait Real {
    /// `√x`, correctly rounded.
    fn sqrt(self) -> Self;
    /// Largest integer that is not larger.
    fn floor(self) -> Self;
    /// `tan x`, `x` in rad.
    fn tan(self) -> Self;
    /// `exp x`.
    fn exp(self) -> Self;
}

#[cfg(not(feature = "std"))]
impl Real for f64 {
    #[inline(always)]
    fn sqrt(self) -> Self {
        // An instruction of the GPU; libm would compute it in integers.
        #[cfg(target_arch = "nvptx64")]
        return core::f64::math::sqrt(self);
        #[cfg(not(target_arch = "nvptx64"))]
        libm::sqrt(self)
    }
    #[inline]
    fn floor(self) -> Self {
        libm::floor(self)
    }
    #[inline]
    fn tan(self) -> Self {
        libm::tan(self)
    }
    #[inline]
    fn exp(self) -> Self {
        libm::exp(self)
    }
}

/// Whether all components are zero. The comparison of two vectors is a loop, which puts them into memory on a GPU.
#[inline(always)]
pub fn is_zero(v: &Vec3) -> bool {
    v.x == 0.0 && v.y == 0.0 && v.z == 0.0
}

/// Length `‖v‖` with the bits of `v.norm()`, which is slow on a GPU.
#[inline(always)]
pub fn norm(v: &Vec3) -> f64 {
    v.norm_squared().sqrt()
}

/// `exp(x)` in pure Rust, the same bits on every processor.
#[inline]
pub fn exp(x: f64) -> f64 {
    libm::exp(x)
}

/// `ln(x)` in pure Rust, the same bits on every processor.
#[inline]
pub fn ln(x: f64) -> f64 {
    libm::log(x)
}

/// `(sin x, cos x)` in pure Rust, the same bits on every processor. `x` in rad.
#[inline]
pub fn sin_cos(x: f64) -> (f64, f64) {
    libm::sincos(x)
}

/// `atan2(y, x)` in rad, in pure Rust.
#[inline]
pub fn atan2(y: f64, x: f64) -> f64 {
    libm::atan2(y, x)
}

/// `x` to the power `y` in pure Rust.
#[inline]
pub fn pow(x: f64, y: f64) -> f64 {
    libm::pow(x, y)
}

/// Cube root `x^(1/3)` in pure Rust.
#[inline]
pub fn cbrt(x: f64) -> f64 {
    libm::cbrt(x)
}

/// Unit quaternion of the rotation vector `theta` (rad): `q = (θ/|θ| sin(|θ|/2), cos(|θ|/2))`.
///
/// For `|θ| < 1e-2` it uses the series in `|θ|²` up to `θ⁸`, which keeps small angles exact: the truncation error is below
/// 1e-22.
#[inline]
pub fn quaternion_of_rotation_vector(theta: &Vec3) -> Quat {
    let t2 = theta.norm_squared();
    if t2 < SMALL_ANGLE_SQUARED {
        return quaternion_of_small_rotation_vector(theta);
    }
    let t = t2.sqrt();
    let (s, c) = sin_cos(0.5 * t);
    Quat::from_parts(c, theta * (s / t))
}

/// Squared angle (rad²) below which [`quaternion_of_small_rotation_vector`] is accurate.
pub const SMALL_ANGLE_SQUARED: f64 = 1.0e-4;

/// [`quaternion_of_rotation_vector`] without a branch, for `|θ|²` below [`SMALL_ANGLE_SQUARED`].
#[inline(always)]
pub fn quaternion_of_small_rotation_vector(theta: &Vec3) -> Quat {
    let t2 = theta.norm_squared();
    let imaginary = 0.5 - t2 * (1.0 / 48.0 - t2 * (1.0 / 3840.0 - t2 / 645_120.0));
    let real = 1.0 - t2 * (1.0 / 8.0 - t2 * (1.0 / 384.0 - t2 * (1.0 / 46_080.0 - t2 / 10_321_920.0)));
    Quat::from_parts(real, theta * imaginary)
}

/// Rotate `v` by the unit quaternion `q`: `v + 2w(u×v) + 2u×(u×v)` with `q = (u, w)`.
#[inline]
pub fn rotate(q: &Quat, v: &Vec3) -> Vec3 {
    let u = q.imag();
    let t = 2.0 * u.cross(v);
    v + q.w * t + u.cross(&t)
}

/// Scale a quaternion to unit length.
#[inline(always)]
pub fn normalized(q: &Quat) -> Quat {
    Quat::from(q.coords / q.coords.norm_squared().sqrt())
}

/// A unit vector perpendicular to the unit vector `n`.
#[inline]
pub fn any_perpendicular(n: &Vec3) -> Vec3 {
    let other = if n.x.abs() < 0.6 { Vec3::x() } else { Vec3::y() };
    let t = n.cross(&other);
    t / norm(&t)
}

/// Vector products in the operation order of Eigen 3.4 without vectorization, as compiled into Debian's YADE.
pub mod yade_order {
    #[cfg(not(feature = "std"))]
    use super::Real as _;
    use super::Vec3;

    /// `x₀y₀ + (x₁y₁ + x₂y₂)`.
    #[inline(always)]
    pub fn dot(x: &Vec3, y: &Vec3) -> f64 {
        x.x * y.x + (x.y * y.y + x.z * y.z)
    }

    /// `√(x₀² + (x₁² + x₂²))`.
    #[inline(always)]
    pub fn norm(x: &Vec3) -> f64 {
        dot(x, x).sqrt()
    }

    /// `(x₁y₂−x₂y₁, x₂y₀−x₀y₂, x₀y₁−x₁y₀)`.
    #[inline(always)]
    pub fn cross(x: &Vec3, y: &Vec3) -> Vec3 {
        Vec3::new(x.y * y.z - x.z * y.y, x.z * y.x - x.x * y.z, x.x * y.y - x.y * y.x)
    }
}
