//! Damage of contacts as damage of the material: scalar conversion and damage tensor (operator O23).

use super::error::{OperatorError, check_length, check_not_negative, check_positive, check_share};
use super::sum::{sum_tiles, sums};
use concordem_contact::math::{Mat3, Vec3, exp};
use nalgebra::{Matrix6, Vector6};

/// Damage of strength `ω̂ = 1 − (1−ω)κ/ε₀` from the damage of stiffness `ω` at the largest strain `κ` so far, with the
/// crack onset strain `ε₀` (Stránský 2018, (6.5)–(6.6)): the fraction of the strength that is lost.
///
/// Zero for `κ < ε₀`, where the formula alone would give `1 − κ/ε₀` for an undamaged contact.
///
/// ```
/// use concordem_operator::damage::strength_damage;
///
/// // At twice the onset strain a bond with the damage 0.8 carries 0.2 · 2 of its strength.
/// assert!((strength_damage(0.8, 2e-4, 1e-4).unwrap() - 0.6).abs() < 1e-12);
/// ```
pub fn strength_damage(stiffness_damage: f64, largest_strain: f64, onset_strain: f64) -> Result<f64, OperatorError> {
    check_share("damage of the stiffness", stiffness_damage)?;
    check_strains(largest_strain, onset_strain)?;
    if largest_strain <= onset_strain {
        return Ok(0.0);
    }
    Ok((1.0 - (1.0 - stiffness_damage) * largest_strain / onset_strain).clamp(0.0, 1.0))
}

/// [`strength_damage`] for exponential softening, where it depends only on `κ`: `1 − exp(−(κ−ε₀)/ε_f)`.
pub fn strength_damage_exponential(
    largest_strain: f64,
    onset_strain: f64,
    softening_strain: f64,
) -> Result<f64, OperatorError> {
    check_strains(largest_strain, onset_strain)?;
    check_positive("softening strain", softening_strain)?;
    Ok(if largest_strain <= onset_strain {
        0.0
    } else {
        1.0 - exp(-(largest_strain - onset_strain) / softening_strain)
    })
}

fn check_strains(largest: f64, onset: f64) -> Result<(), OperatorError> {
    check_positive("crack onset strain", onset)?;
    check_not_negative("largest strain", [largest])
}

/// Damage tensor from the damages `ω̂` of links with directions `n`, by least squares for uniformly distributed
/// directions (Stránský 2018, (6.13) with the identity that the print lacks): `Ω = −(3/2N)(Σω̂) 1 + (15/2N) Σ ω̂ n⊗n`.
///
/// Then `nᵀΩn` is the damage in direction n. For uniformly distributed directions its trace is three times the mean
/// damage. Principal values may leave [0, 1]. (The version in YADE's repository adds the matrix nine times.)
///
/// ```
/// use concordem_contact::math::Vec3;
/// use concordem_operator::damage::damage_tensor;
///
/// // Bonds along the axes, all with the damage ½: the tensor is isotropic.
/// let tensor = damage_tensor(&[Vec3::x(), Vec3::y(), Vec3::z()], &[0.5; 3]).unwrap();
/// assert!((tensor[(0, 0)] - 0.5).abs() < 1e-15 && tensor[(0, 1)] == 0.0);
/// ```
pub fn damage_tensor(normal: &[Vec3], damage: &[f64]) -> Result<Mat3, OperatorError> {
    let sums = moments(normal, damage)?;
    let n = normal.len() as f64;
    Ok(Mat3::identity() * (-1.5 * sums.scalar / n) + sums.tensor * (7.5 / n))
}

/// Damage tensor by least squares for the actual directions (Stránský 2018,
/// (6.7)–(6.8)): solves `Ω : Σ n⊗n⊗n⊗n = Σ ω̂ n⊗n`, six equations for the six components.
///
/// # Errors
/// Directions that do not determine all six components.
pub fn damage_tensor_exact(normal: &[Vec3], damage: &[f64]) -> Result<Mat3, OperatorError> {
    let sums = moments(normal, damage)?;
    // In the components 11, 22, 33, √2·23, √2·31, √2·12 a symmetric tensor is a vector of the same norm.
    let right = mandel(&sums.tensor);
    let scale = sums.fourth.trace();
    let eigen = nalgebra::SymmetricEigen::new(sums.fourth);
    // Directions known to 1e-16 determine a component if its weight exceeds that; 1e-12 leaves four digits.
    if !(scale > 0.0 && eigen.eigenvalues.min() > 1e-12 * scale) {
        return Err(OperatorError::Singular {
            what: "the damage tensor",
            reason: "the directions of the links do not determine its six components",
        });
    }
    let solution = sums
        .fourth
        .cholesky()
        .map(|c| c.solve(&right))
        .ok_or(OperatorError::Singular { what: "the damage tensor", reason: "its matrix is not positive definite" })?;
    let s = std::f64::consts::FRAC_1_SQRT_2;
    let v = |i: usize| solution[i];
    Ok(Mat3::new(v(0), s * v(5), s * v(4), s * v(5), v(1), s * v(3), s * v(4), s * v(3), v(2)))
}

sums!(Moments { scalar: f64, tensor: Mat3, fourth: Matrix6<f64> });

fn mandel(t: &Mat3) -> Vector6<f64> {
    let s = std::f64::consts::SQRT_2;
    Vector6::new(t[(0, 0)], t[(1, 1)], t[(2, 2)], s * t[(1, 2)], s * t[(2, 0)], s * t[(0, 1)])
}

fn moments(normal: &[Vec3], damage: &[f64]) -> Result<Moments, OperatorError> {
    check_length("damage", damage.len(), normal.len(), "link")?;
    if normal.is_empty() {
        return Err(OperatorError::EmptyRegion { what: "link" });
    }
    Ok(sum_tiles(normal.len(), |range| {
        let mut sum = Moments::default();
        for k in range {
            let nn = normal[k] * normal[k].transpose();
            let m = mandel(&nn);
            sum += Moments { scalar: damage[k], tensor: nn * damage[k], fourth: m * m.transpose() };
        }
        sum
    }))
}
