//! Symmetric 3×3 matrices.

use super::{Mat3, Vec3};

/// Symmetric 3×3 matrix by its components xx, yy, zz, yz, xz, xy.
#[derive(Debug, Clone, Copy, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Symmetric(pub [f64; 6]);

impl Symmetric {
    /// `½(a⊗b + b⊗a)`.
    #[inline(always)]
    pub fn product(a: &Vec3, b: &Vec3) -> Self {
        Self([
            a.x * b.x,
            a.y * b.y,
            a.z * b.z,
            0.5 * (a.y * b.z + a.z * b.y),
            0.5 * (a.x * b.z + a.z * b.x),
            0.5 * (a.x * b.y + a.y * b.x),
        ])
    }

    /// `a⊗a`.
    #[inline(always)]
    pub fn square(a: &Vec3) -> Self {
        Self([a.x * a.x, a.y * a.y, a.z * a.z, a.y * a.z, a.x * a.z, a.x * a.y])
    }

    /// `n·A·n`.
    #[inline(always)]
    pub fn quadratic(&self, n: &Vec3) -> f64 {
        let [xx, yy, zz, yz, xz, xy] = self.0;
        xx * (n.x * n.x)
            + yy * (n.y * n.y)
            + zz * (n.z * n.z)
            + 2.0 * (yz * (n.y * n.z) + xz * (n.x * n.z) + xy * (n.x * n.y))
    }

    /// `A·v`.
    #[inline(always)]
    pub fn times(&self, v: &Vec3) -> Vec3 {
        let [xx, yy, zz, yz, xz, xy] = self.0;
        Vec3::new(xx * v.x + xy * v.y + xz * v.z, xy * v.x + yy * v.y + yz * v.z, xz * v.x + yz * v.y + zz * v.z)
    }

    /// Trace `A_ii`.
    #[inline(always)]
    pub fn trace(&self) -> f64 {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// `A : B = Σ A_ij B_ij`.
    #[inline(always)]
    pub fn contract(&self, other: &Self) -> f64 {
        let (a, b) = (&self.0, &other.0);
        a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
    }

    /// As a full matrix.
    pub fn matrix(&self) -> Mat3 {
        let [xx, yy, zz, yz, xz, xy] = self.0;
        Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz)
    }
}

impl core::ops::Add for Symmetric {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl core::ops::Sub for Symmetric {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        Self(core::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl core::ops::Mul<f64> for Symmetric {
    type Output = Self;
    #[inline(always)]
    fn mul(self, factor: f64) -> Self {
        Self(self.0.map(|x| x * factor))
    }
}

impl core::ops::AddAssign for Symmetric {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Compared with full matrices. Tolerance: a handful of roundings of numbers of order 1.
    #[test]
    fn agrees_with_full_matrices() {
        let (a, b) = (Vec3::new(0.3, -0.7, 1.1), Vec3::new(-0.2, 0.5, 0.9));
        let s = Symmetric::product(&a, &b);
        let full = (a * b.transpose() + b * a.transpose()) * 0.5;
        assert!((s.matrix() - full).norm() < 1e-15);
        assert!((s.times(&a) - full * a).norm() < 1e-15);
        assert!((s.quadratic(&b) - b.dot(&(full * b))).abs() < 1e-15);
        assert!((s.trace() - full.trace()).abs() < 1e-15);
        let t = Symmetric::product(&a, &a);
        assert!((s.contract(&t) - full.component_mul(&t.matrix()).sum()).abs() < 1e-15);
    }
}
