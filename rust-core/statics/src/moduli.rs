//! Elastic constants of a stiffness matrix, and its deviation from isotropy.

use nalgebra::{Matrix3, Matrix6};

use super::StaticsError;

/// Constants of a stiffness matrix (components 11, 22, 33, 23, 31, 12, engineering shear strains).
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticConstants {
    /// 3 in space; 2 for the plane 1, 2, where entries with direction 3 are zero.
    pub dimension: usize,
    /// Stiffness D, Pa, as found. Deformable particles with springs in shear have none that is symmetric.
    pub stiffness: Matrix6<f64>,
    /// Largest `|D_ij − D_ji|` over the largest `|D_ij|`. The constants are those of the symmetric part.
    pub asymmetry: f64,
    /// Compliance C = D⁻¹, 1/Pa.
    pub compliance: Matrix6<f64>,
    /// Young's moduli `E_i = 1/C_ii`, Pa. In the plane, these and all other constants are the two-dimensional ones
    /// (plane strain or plane stress, as for the discs), without conversion to a solid.
    pub young: [f64; 3],
    /// Poisson's ratios `ν_ij = −C_ji E_i`: contraction along j under tension along i; the diagonal is 0.
    pub poisson: [[f64; 3]; 3],
    /// Shear moduli `1/C_44`, `1/C_55`, `1/C_66` (23, 31, 12), Pa.
    pub shear: [f64; 3],
    /// Mean of the Young's moduli, Pa.
    pub mean_young: f64,
    /// Mean of the Poisson's ratios.
    pub mean_poisson: f64,
    /// Mean of the shear moduli, Pa.
    pub mean_shear: f64,
    /// Bulk modulus: mean stress over volume strain under uniform expansion, Pa; in the plane `½(σ₁₁+σ₂₂)` over the
    /// area strain, `E/2(1−ν)` if isotropic.
    pub bulk: f64,
}

/// Deviation from isotropy (Stránský 2018, (3.64)–(3.68)); all zero for an isotropic material.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize)]
pub struct Anisotropy {
    /// `max |E_i − E| / E`.
    pub young: f64,
    /// `max |ν_ij − ν|`, absolute.
    pub poisson: f64,
    /// `max |G_i − G₀| / G₀` with `G₀ = E/2(1+ν)`.
    pub shear: f64,
    /// `max |D_ij| / E` over the entries that vanish for an isotropic material.
    pub coupling: f64,
}

impl ElasticConstants {
    /// Constants of the stiffness `D`, Pa.
    ///
    /// # Errors
    /// [`StaticsError::Soft`] if D has no inverse.
    pub fn of(given: &Matrix6<f64>) -> Result<Self, StaticsError> {
        let stiffness = (given + given.transpose()) * 0.5;
        let size = stiffness.abs().max();
        if size.is_nan() || size <= 0.0 || (stiffness / size).symmetric_eigenvalues().min() < 1e-12 {
            return Err(StaticsError::Soft);
        }
        let compliance = (stiffness / size).try_inverse().ok_or(StaticsError::Soft)? / size;
        Ok(Self::of_both(&stiffness, &compliance, 3).with(given))
    }

    /// Constants of the plane 1, 2, from the components 11, 22, 12 of the stiffness `D`, Pa.
    ///
    /// # Errors
    /// [`StaticsError::Soft`] if that part of D has no inverse.
    pub fn of_plane(stiffness: &Matrix6<f64>) -> Result<Self, StaticsError> {
        const PLACES: [usize; 3] = [0, 1, 5];
        let part =
            Matrix3::from_fn(|i, j| 0.5 * (stiffness[(PLACES[i], PLACES[j])] + stiffness[(PLACES[j], PLACES[i])]));
        let size = part.abs().max();
        if size.is_nan() || size <= 0.0 || (part / size).symmetric_eigenvalues().min() < 1e-12 {
            return Err(StaticsError::Soft);
        }
        let inverse = (part / size).try_inverse().ok_or(StaticsError::Soft)? / size;
        let spread = |part: &Matrix3<f64>| {
            let mut whole = Matrix6::zeros();
            for (i, row) in PLACES.into_iter().enumerate() {
                for (j, column) in PLACES.into_iter().enumerate() {
                    whole[(row, column)] = part[(i, j)];
                }
            }
            whole
        };
        let given = Matrix3::from_fn(|i, j| stiffness[(PLACES[i], PLACES[j])]);
        Ok(Self::of_both(&spread(&part), &spread(&inverse), 2).with(&spread(&given)))
    }

    /// The constants with the stiffness as it was found.
    fn with(self, given: &Matrix6<f64>) -> Self {
        let asymmetry = (given - given.transpose()).abs().max() / given.abs().max();
        Self { stiffness: *given, asymmetry, ..self }
    }

    fn of_both(stiffness: &Matrix6<f64>, compliance: &Matrix6<f64>, dimension: usize) -> Self {
        let (mut young, mut poisson) = ([0.0; 3], [[0.0; 3]; 3]);
        for (i, (young, poisson)) in young.iter_mut().zip(&mut poisson).enumerate().take(dimension) {
            *young = 1.0 / compliance[(i, i)];
            for (j, poisson) in poisson.iter_mut().enumerate().take(dimension).filter(|(j, _)| *j != i) {
                *poisson = -compliance[(j, i)] * *young;
            }
        }
        let mut shear = [0.0; 3];
        for k in Self::shears(dimension) {
            shear[k - 3] = 1.0 / compliance[(k, k)];
        }
        let n = dimension as f64;
        Self {
            dimension,
            stiffness: *stiffness,
            asymmetry: 0.0,
            compliance: *compliance,
            young,
            poisson,
            shear,
            mean_young: young.iter().sum::<f64>() / n,
            mean_poisson: poisson.iter().flatten().sum::<f64>() / (n * (n - 1.0)),
            mean_shear: shear.iter().sum::<f64>() / Self::shears(dimension).count() as f64,
            bulk: stiffness.fixed_view::<3, 3>(0, 0).sum() / (n * n),
        }
    }

    /// Components of shear: 23, 31, 12, or 12 alone.
    fn shears(dimension: usize) -> std::ops::Range<usize> {
        if dimension == 2 { 5..6 } else { 3..6 }
    }

    /// Deviation from isotropy.
    pub fn anisotropy(&self) -> Anisotropy {
        let largest = |values: &mut dyn Iterator<Item = f64>| values.map(f64::abs).fold(0.0, f64::max);
        let (e, nu, n) = (self.mean_young, self.mean_poisson, self.dimension);
        let g = e / (2.0 * (1.0 + nu));
        let ratios = |i: usize, j: usize| if i == j { 0.0 } else { self.poisson[i][j] - nu };
        let vanishing = |i: usize, j: usize| i != j && (i >= 3 || j >= 3);
        Anisotropy {
            young: largest(&mut self.young[..n].iter().map(|x| x - e)) / e,
            poisson: largest(&mut (0..n * n).map(|k| ratios(k / n, k % n))),
            shear: largest(&mut Self::shears(n).map(|k| self.shear[k - 3] - g)) / g,
            coupling: largest(&mut (0..36).filter(|k| vanishing(k / 6, k % 6)).map(|k| self.stiffness[(k / 6, k % 6)]))
                / e,
        }
    }

    /// Derivatives of the mean Young's modulus (Pa per unit) and of the mean Poisson's ratio for a change `change` of D
    /// (Pa per unit), of which only the symmetric part is used: `dC = −C dD C`.
    pub fn derivatives(&self, change: &Matrix6<f64>) -> (f64, f64) {
        let change = (change + change.transpose()) * 0.5;
        let dc = -self.compliance * change * self.compliance;
        let n = self.dimension;
        let (mut young, mut poisson) = (0.0, 0.0);
        for i in 0..n {
            let e = self.young[i];
            let de = -dc[(i, i)] * e * e;
            young += de / n as f64;
            for j in (0..n).filter(|&j| j != i) {
                poisson -= (dc[(j, i)] * e + self.compliance[(j, i)] * de) / (n * (n - 1)) as f64;
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
        assert_eq!(found.asymmetry, 0.0);
        // A stiffness that is not symmetric stays what it is; the constants are those of its symmetric part.
        let mut skew = isotropic(e, nu);
        skew[(0, 1)] += 1e9;
        skew[(1, 0)] -= 1e9;
        let of_skew = ElasticConstants::of(&skew).unwrap();
        assert_eq!((of_skew.stiffness, of_skew.compliance), (skew, found.compliance));
        assert!((of_skew.asymmetry / (2e9 / skew.max()) - 1.0).abs() < 1e-14);
    }

    /// In the plane: E and ν of `D11 = E/(1−ν²)`, `D12 = νD11`; the rows of direction 3 do not matter.
    #[test]
    fn constants_of_the_plane() {
        let (e, nu) = (70e9, 0.35);
        let d11 = e / (1.0 - nu * nu);
        let mut matrix = Matrix6::zeros();
        (matrix[(0, 0)], matrix[(1, 1)], matrix[(0, 1)], matrix[(1, 0)]) = (d11, d11, nu * d11, nu * d11);
        (matrix[(5, 5)], matrix[(3, 3)]) = (e / (2.0 * (1.0 + nu)), 3e9);
        let found = ElasticConstants::of_plane(&matrix).unwrap();
        assert!((found.mean_young / e - 1.0).abs() < 1e-14 && (found.mean_poisson - nu).abs() < 1e-14, "{found:?}");
        assert!((found.bulk / (e / (2.0 * (1.0 - nu))) - 1.0).abs() < 1e-14, "{found:?}");
        assert!((found.mean_shear / (e / (2.0 * (1.0 + nu))) - 1.0).abs() < 1e-14, "{found:?}");
        let zero = found.anisotropy();
        assert!(zero.young + zero.poisson + zero.shear + zero.coupling < 1e-13, "{zero:?}");
        // E is proportional to D, ν does not change.
        let (young, poisson) = found.derivatives(&found.stiffness);
        assert!((young / e - 1.0).abs() < 1e-14 && poisson.abs() < 1e-14);
        assert_eq!(ElasticConstants::of_plane(&Matrix6::zeros()), Err(StaticsError::Soft));
    }

    /// Compared with central differences, whose error is h² plus rounding/h, 1e-9 at h = 1e-5.
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
