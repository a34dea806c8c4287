//! Elastic constants of a stiffness matrix, and how far it is from isotropic.

use nalgebra::Matrix6;

use super::StaticsError;

/// Constants of a stiffness matrix (components 11, 22, 33, 23, 31, 12, engineering shear strains).
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticConstants {
    /// Stiffness D, Pa.
    pub stiffness: Matrix6<f64>,
    /// Compliance C = D⁻¹, 1/Pa.
    pub compliance: Matrix6<f64>,
    /// Young's moduli `E_i = 1/C_ii`, Pa.
    pub young: [f64; 3],
    /// Poisson's ratios `ν_ij = −C_ji E_i`: contraction along j under tension along i; the diagonal is empty (0).
    pub poisson: [[f64; 3]; 3],
    /// Shear moduli `1/C_44`, `1/C_55`, `1/C_66` (23, 31, 12), Pa.
    pub shear: [f64; 3],
    /// Mean of the three Young's moduli, Pa.
    pub mean_young: f64,
    /// Mean of the six Poisson's ratios.
    pub mean_poisson: f64,
    /// Mean of the three shear moduli, Pa.
    pub mean_shear: f64,
    /// Bulk modulus: mean stress over volume strain under uniform expansion, Pa.
    pub bulk: f64,
}

/// Distance from isotropy (Stránský 2018, (3.64)–(3.68)); all zero for an isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Anisotropy {
    /// `max |E_i − E| / E`.
    pub young: f64,
    /// `max |ν_ij − ν|`, absolute.
    pub poisson: f64,
    /// `max |G_i − G₀| / G₀` with `G₀ = E/2(1+ν)`.
    pub shear: f64,
    /// `max |D_ij| / E` of the entries that vanish for an isotropic material.
    pub coupling: f64,
}

impl ElasticConstants {
    /// Constants of the stiffness `D`, Pa.
    ///
    /// # Errors
    /// [`StaticsError::Soft`] when D has no inverse.
    pub fn of(stiffness: &Matrix6<f64>) -> Result<Self, StaticsError> {
        let stiffness = (stiffness + stiffness.transpose()) * 0.5;
        let size = stiffness.abs().max();
        if size.is_nan() || size <= 0.0 || (stiffness / size).symmetric_eigenvalues().min() < 1e-12 {
            return Err(StaticsError::Soft);
        }
        let compliance = (stiffness / size).try_inverse().ok_or(StaticsError::Soft)? / size;
        let young: [f64; 3] = std::array::from_fn(|i| 1.0 / compliance[(i, i)]);
        let mut poisson = [[0.0; 3]; 3];
        for (i, row) in poisson.iter_mut().enumerate() {
            for (j, value) in row.iter_mut().enumerate() {
                if i != j {
                    *value = -compliance[(j, i)] * young[i];
                }
            }
        }
        let shear: [f64; 3] = std::array::from_fn(|i| 1.0 / compliance[(i + 3, i + 3)]);
        Ok(Self {
            stiffness,
            compliance,
            young,
            poisson,
            shear,
            mean_young: young.iter().sum::<f64>() / 3.0,
            mean_poisson: poisson.iter().flatten().sum::<f64>() / 6.0,
            mean_shear: shear.iter().sum::<f64>() / 3.0,
            bulk: stiffness.fixed_view::<3, 3>(0, 0).sum() / 9.0,
        })
    }

    /// The four measures.
    pub fn anisotropy(&self) -> Anisotropy {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
        let (e, nu) = (self.mean_young, self.mean_poisson);
        let g = e / (2.0 * (1.0 + nu));
        let ratios = |i: usize, j: usize| if i == j { 0.0 } else { self.poisson[i][j] - nu };
        let vanishing = |i: usize, j: usize| i != j && (i >= 3 || j >= 3);
        Anisotropy {
            young: largest(&mut self.young.iter().map(|x| x - e)) / e,
            poisson: largest(&mut (0..9).map(|k| ratios(k / 3, k % 3))),
            shear: largest(&mut self.shear.iter().map(|x| x - g)) / g,
            coupling: largest(&mut (0..36).filter(|k| vanishing(k / 6, k % 6)).map(|k| self.stiffness[(k / 6, k % 6)]))
                / e,
        }
    }

    /// Derivatives of the mean Young's modulus (Pa per unit) and of the mean Poisson's ratio when D changes by `change`
    /// (Pa per unit): `dC = −C dD C`.
    pub fn derivatives(&self, change: &Matrix6<f64>) -> (f64, f64) {
        let dc = -self.compliance * change * self.compliance;
        let (mut young, mut poisson) = (0.0, 0.0);
        for i in 0..3 {
            let e = self.young[i];
            let de = -dc[(i, i)] * e * e;
            young += de / 3.0;
            for j in (0..3).filter(|&j| j != i) {
                poisson -= (dc[(j, i)] * e + self.compliance[(j, i)] * de) / 6.0;
            }
        }
        (young, poisson)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn isotropic(e: f64, nu: f64) -> Matrix6<f64> {
        let (lambda, g) = (e * nu / ((1.0 + nu) * (1.0 - 2.0 * nu)), e / (2.0 * (1.0 + nu)));
        Matrix6::from_fn(|i, j| match (i, j) {
            _ if i == j && i < 3 => lambda + 2.0 * g,
            _ if i == j => g,
            _ if i < 3 && j < 3 => lambda,
            _ => 0.0,
        })
    }

    /// Tolerances: an inverse with condition number below 10, 1e-14.
    #[test]
    fn isotropic_constants_come_back() {
        let (e, nu) = (30e9, 0.22);
        let found = ElasticConstants::of(&isotropic(e, nu)).unwrap();
        assert!((found.mean_young / e - 1.0).abs() < 1e-14 && (found.mean_poisson - nu).abs() < 1e-14, "{found:?}");
        assert!((found.bulk / (e / (3.0 * (1.0 - 2.0 * nu))) - 1.0).abs() < 1e-14);
        let zero = found.anisotropy();
        assert!(zero.young + zero.poisson + zero.shear + zero.coupling < 1e-13, "{zero:?}");
        assert_eq!(ElasticConstants::of(&Matrix6::zeros()), Err(StaticsError::Soft));
    }

    /// Against central differences: their own error is h² and rounding/h, 1e-9 at h = 1e-5.
    #[test]
    fn derivatives_are_those_of_the_constants() {
        let base = isotropic(2.0, 0.3) + Matrix6::from_fn(|i, j| 0.01 * ((i * j) as f64).sin());
        let base = (base + base.transpose()) * 0.5;
        let change = Matrix6::from_fn(|i, j| 0.1 * ((i + j) as f64).cos());
        let at = |h: f64| ElasticConstants::of(&(base + change * h)).unwrap();
        let (young, poisson) = at(0.0).derivatives(&change);
        let h = 1e-5;
        let (up, down) = (at(h), at(-h));
        assert!(((up.mean_young - down.mean_young) / (2.0 * h) - young).abs() < 1e-8);
        assert!(((up.mean_poisson - down.mean_poisson) / (2.0 * h) - poisson).abs() < 1e-8);
    }
}
