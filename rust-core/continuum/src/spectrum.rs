//! Mean, deviator, and principal directions of a stress.

use concordem_contact::math::{Mat3, Vec3};

/// Principal values closer than this fraction of the deviator's norm count as equal: eigenvectors of values closer than 1e-12 or
/// so have no correct digits.
const EQUAL: f64 = 1e-10;

/// A symmetric tensor `σ = σ_V 1 + ρ n` with a unit deviator `n`.
#[derive(Debug, Clone, Copy)]
pub struct Spectrum {
    /// Mean `σ_V = tr σ/3`.
    pub mean: f64,
    /// Norm of the deviator, `ρ`.
    pub deviator: f64,
    /// Unit deviator `n`; zero if the deviator is.
    pub unit: Mat3,
    /// Principal values of `n`, in descending order.
    pub unit_values: [f64; 3],
    /// Principal directions, in the same order.
    pub directions: [Vec3; 3],
    /// Cosine of the Lode angle θ, 0 ≤ θ ≤ 60°: `cos θ = √(3/2) n₁`. One in simple tension, one half in simple compression.
    pub cos_lode: f64,
}

impl Spectrum {
    /// Of the symmetric part of a tensor.
    pub fn of(tensor: &Mat3) -> Self {
        let symmetric = (tensor + tensor.transpose()) * 0.5;
        let mean = symmetric.trace() / 3.0;
        let deviator = symmetric - Mat3::identity() * mean;
        let norm = deviator.norm();
        // The deviator of a hydrostatic stress is what rounding leaves of it.
        if norm <= 4.0 * f64::EPSILON * mean.abs() || norm == 0.0 {
            let directions = [Vec3::x(), Vec3::y(), Vec3::z()];
            return Self { mean, deviator: 0.0, unit: Mat3::zeros(), unit_values: [0.0; 3], directions, cos_lode: 1.0 };
        }
        let unit = deviator / norm;
        let eigen = unit.symmetric_eigen();
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        Self {
            mean,
            deviator: norm,
            unit,
            unit_values: order.map(|k| eigen.eigenvalues[k]),
            directions: order.map(|k| eigen.eigenvectors.column(k).into_owned()),
            cos_lode: (1.5_f64.sqrt() * eigen.eigenvalues[order[0]]).clamp(0.5, 1.0),
        }
    }

    /// Derivative of `cos θ` with respect to `n`: `√(3/2) e₁⊗e₁`.
    ///
    /// In simple compression the largest principal value is double, and `cos θ` has a kink there. The mean of the derivatives on
    /// both sides has no effect on a unit deviator, so zero is returned.
    pub fn cos_lode_gradient(&self) -> Mat3 {
        if self.unit_values[0] - self.unit_values[1] < EQUAL {
            return Mat3::zeros();
        }
        self.directions[0] * self.directions[0].transpose() * 1.5_f64.sqrt()
    }
}
