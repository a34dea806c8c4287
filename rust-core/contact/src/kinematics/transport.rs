//! Rotation of tangential history vectors with the contact.

#[cfg(not(feature = "std"))]
use crate::math::Real as _;
use crate::math::{Quat, Vec3};

/// Rotation of the contact axes in one step: swing of the normal, then twist about it.
#[derive(Debug, Clone, Copy)]
pub enum Transport {
    /// Exact finite rotation.
    Finite {
        /// Normal now.
        normal: Vec3,
        /// `(n_old + n)/(1 + n_old·n)`.
        bisector: Vec3,
        /// Cosine of the mean twist angle.
        cosine: f64,
        /// Sine of the mean twist angle.
        sine: f64,
    },
    /// First order: two successive `v ← v − v × axis` (Stránský 2018 as implemented in YADE's `ScGeom::rotate`).
    FirstOrder {
        /// `n_old × n`.
        swing: Vec3,
        /// `½Δt n_old·(ω_A + ω_B) n_old`.
        twist: Vec3,
    },
}

impl Transport {
    /// No rotation.
    pub fn identity(normal: Vec3) -> Self {
        Self::Finite { normal, bisector: normal, cosine: 1.0, sine: 0.0 }
    }

    /// Normal of the previous step; `normal`: now.
    pub fn normal_before(&self, normal: &Vec3) -> Vec3 {
        match self {
            Self::Finite { bisector, .. } => bisector * (2.0 / bisector.norm_squared()) - normal,
            // n × (n_o × n) = n_o − (n_o·n) n
            Self::FirstOrder { swing, .. } => {
                normal * (1.0 - swing.norm_squared()).max(0.0).sqrt() + normal.cross(swing)
            }
        }
    }

    /// Rotate the vector `v`, which is perpendicular to the old normal, to the present axes.
    #[inline(always)]
    pub fn apply(&self, v: &Vec3) -> Vec3 {
        match self {
            Self::Finite { normal, bisector, cosine, sine } => {
                let swung = v - bisector * v.dot(normal);
                swung * *cosine + normal.cross(&swung) * *sine
            }
            Self::FirstOrder { swing, twist } => {
                let swung = v - v.cross(swing);
                swung - swung.cross(twist)
            }
        }
    }
}

/// Rotation of a contact in a step; see [`Transport::Finite`].
#[derive(Debug, Clone, Copy)]
pub struct Turn {
    /// `(n_old + n)/(1 + n_old·n)`.
    pub bisector: Vec3,
    /// Cosine of the mean twist angle.
    pub cosine: f64,
    /// Sine of the mean twist angle.
    pub sine: f64,
}

impl Turn {
    /// Exact transport: the smallest rotation from `normal_old` to `normal`, then the mean twist of the two particles about
    /// `normal`. `rotation_sum` is the sum of the unit quaternions of both particles' rotations in the step;
    /// `swing_axis = normal_old × normal`.
    ///
    /// With `c = n_old·n` and `m = n_old×n`, the twist of a rotation `(u, w)` relative to the swing has the half-angle
    /// tangent `u·(n_old+n) / ((1+c) w + m·u)`. The sum of the (numerator, denominator) pairs of both particles, as complex
    /// numbers, gives the mean angle without trigonometric functions. It is exact for a rigid rotation of the pair.
    #[inline(always)]
    pub fn finite(normal_old: &Vec3, normal: &Vec3, swing_axis: &Vec3, rotation_sum: &Quat) -> Self {
        let c = normal_old.dot(normal);
        let sum = normal_old + normal;
        let u = rotation_sum.imag();
        let real = (1.0 + c) * rotation_sum.w + swing_axis.dot(&u);
        let imaginary = u.dot(&sum);
        let inverse = 1.0 / ((real * real + imaginary * imaginary) * (1.0 + c));
        let by_modulus = inverse * (1.0 + c);
        let by_cosine = inverse * (real * real + imaginary * imaginary);
        Self {
            bisector: sum * by_cosine,
            cosine: (real * real - imaginary * imaginary) * by_modulus,
            sine: 2.0 * real * imaginary * by_modulus,
        }
    }

    /// Rotate the vector `v`, which is perpendicular to the present `normal`, by the twist alone.
    #[inline(always)]
    pub fn twist(&self, normal: &Vec3, v: &Vec3) -> Vec3 {
        v * self.cosine + normal.cross(v) * self.sine
    }

    /// As the transport of a contact with normal `normal`.
    #[inline(always)]
    pub fn transport(self, normal: Vec3) -> Transport {
        let Self { bisector, cosine, sine } = self;
        Transport::Finite { normal, bisector, cosine, sine }
    }
}
