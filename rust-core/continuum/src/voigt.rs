//! Symmetric tensors as six components, in the order 11, 22, 33, 23, 31, 12.

use concordem_contact::math::Mat3;
use nalgebra::{Matrix6, Vector6};

/// The components of a symmetric tensor, as a stress has them: no factor 2.
pub fn components(t: &Mat3) -> Vector6<f64> {
    let shear = |i: usize, j: usize| 0.5 * (t[(i, j)] + t[(j, i)]);
    Vector6::new(t[(0, 0)], t[(1, 1)], t[(2, 2)], shear(1, 2), shear(2, 0), shear(0, 1))
}

/// The symmetric tensor with these components.
pub fn tensor(c: &Vector6<f64>) -> Mat3 {
    Mat3::new(c[0], c[5], c[4], c[5], c[1], c[3], c[4], c[3], c[2])
}

/// `A : B` of two symmetric tensors.
pub fn contract(a: &Vector6<f64>, b: &Vector6<f64>) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2] + 2.0 * (a[3] * b[3] + a[4] * b[4] + a[5] * b[5])
}

/// The row `A : M`, where the columns of `M` are stress components.
pub fn contract_matrix(a: &Vector6<f64>, m: &Matrix6<f64>) -> Vector6<f64> {
    let weighted = Vector6::new(a[0], a[1], a[2], 2.0 * a[3], 2.0 * a[4], 2.0 * a[5]);
    m.transpose() * weighted
}

/// The identity tensor.
pub fn identity() -> Vector6<f64> {
    Vector6::new(1.0, 1.0, 1.0, 0.0, 0.0, 0.0)
}

/// The projection of a strain with engineering shears on the components of its deviator.
pub fn deviatoric() -> Matrix6<f64> {
    let third = 1.0 / 3.0;
    Matrix6::from_fn(|i, j| match (i == j, i < 3 && j < 3) {
        (true, true) => 1.0 - third,
        (false, true) => -third,
        (true, false) => 0.5,
        (false, false) => 0.0,
    })
}
