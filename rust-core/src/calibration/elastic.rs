//! Stiffnesses of point links for wanted elastic constants, on the user's own packing.
//!
//! Poisson's ratio of a network depends on `P = k_T/k_N` alone, Young's modulus is in proportion to `k_N`. So `P` is sought
//! for ν, then `k_N` follows. First guess: the closed form (Stránský 2018, (3.38)) solved for P; then Newton steps with the
//! exact derivative of the static network ([`CellStiffness::share`]), kept inside a bracket.

use crate::operator::affine_stiffness::isotropic_moduli;
use crate::statics::{Accuracy, CellStiffness, ElasticConstants, LinkNetwork, StaticsError, cell_stiffness};

/// Smallest and largest ratio k_T/k_N looked at: beyond, ν changes in the fourth digit only.
pub const SHEAR_RATIOS: (f64, f64) = (1e-4, 1e3);

/// Why there are no such parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ElasticCalibrationError {
    /// The network has no answer.
    #[error("{0}")]
    Statics(#[from] StaticsError),
    /// The links carry moments.
    #[error("the bonds carry moments; their constants follow from radius and material of the beams")]
    Moments,
    /// A modulus that no material has.
    #[error("a Young's modulus of {young:e} Pa; it must be positive and finite")]
    Young {
        /// Wanted, Pa.
        young: f64,
    },
    /// Out of reach on this packing.
    #[error(
        "Poisson's ratio {wanted} is out of reach: this packing and interaction ratio give {least:.4} (k_T/k_N = \
         {least_at:.1e}) to {most:.4} (k_T/k_N = {most_at:.1e}); a smaller interaction ratio or a looser packing raises the \
         upper end"
    )]
    OutOfReach {
        /// Wanted.
        wanted: f64,
        /// Least and most, and where.
        least: f64,
        /// k_T/k_N there.
        least_at: f64,
        /// Largest.
        most: f64,
        /// k_T/k_N there.
        most_at: f64,
    },
}

/// Stiffnesses that give wanted constants.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticFit {
    /// k_T/k_N of the links.
    pub shear_ratio: f64,
    /// What k_N of the given network is to be multiplied by.
    pub normal_factor: f64,
    /// Constants of the network with these stiffnesses.
    pub achieved: ElasticConstants,
    /// Particles that links do not hold, and the rest of the static solution.
    pub cell: CellStiffness,
    /// Least and largest Poisson's ratio within [`SHEAR_RATIOS`].
    pub reach: (f64, f64),
    /// The closed form's answer to the same question: k_T/k_N, and E over the wanted one at the found parameters.
    pub prior: Option<(f64, f64)>,
    /// Static solutions computed.
    pub solutions: usize,
}

/// Find k_T/k_N and the factor of k_N for which the network has these constants, Poisson's ratio within 1e-9.
///
/// # Errors
/// Targets out of reach, with the reach; links with moments; no static solution.
pub fn fit(
    network: &LinkNetwork,
    young: f64,
    poisson: f64,
    accuracy: Accuracy,
    progress: &mut dyn FnMut(usize),
) -> Result<ElasticFit, ElasticCalibrationError> {
    if !(young > 0.0 && young.is_finite()) {
        return Err(ElasticCalibrationError::Young { young });
    }
    if network.links.iter().any(|l| l.stiffness.bending != 0.0 || l.stiffness.twist != 0.0) {
        return Err(ElasticCalibrationError::Moments);
    }
    let mut solutions = 0;
    let mut at = |shear_ratio: f64| -> Result<(ElasticConstants, CellStiffness), StaticsError> {
        let mut network = network.clone();
        for link in &mut network.links {
            link.stiffness.shear = shear_ratio * link.stiffness.normal;
        }
        let cell = cell_stiffness(&network, accuracy)?;
        solutions += 1;
        progress(solutions);
        Ok((ElasticConstants::of(&cell.relaxed)?, cell))
    };
    let (low, high) = SHEAR_RATIOS;
    // ν falls with P; where the particles hang by few links it has a summit near P = 0, so the coarse scan looks for one.
    let mut scan = Vec::new();
    let decades = (high / low).log10().round() as i32;
    for k in 0..=decades {
        let ratio = low * 10.0_f64.powi(k);
        scan.push((ratio, at(ratio)?.0.mean_poisson));
    }
    let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
    let (Some(&least), Some(&most)) = (scan.iter().min_by(by_value), scan.iter().max_by(by_value)) else {
        return Err(StaticsError::Soft.into());
    };
    let bracket = scan.windows(2).rfind(|pair| pair[0].1 >= poisson && pair[1].1 <= poisson);
    let Some(&[(mut left, _), (mut right, _)]) = bracket.and_then(|pair| <&[(f64, f64); 2]>::try_from(pair).ok())
    else {
        return Err(ElasticCalibrationError::OutOfReach {
            wanted: poisson,
            least: least.1,
            least_at: least.0,
            most: most.1,
            most_at: most.0,
        });
    };
    let prior_ratio = (1.0 - 4.0 * poisson) / (1.0 + poisson);
    let mut ratio = if prior_ratio > left && prior_ratio < right { prior_ratio } else { (left * right).sqrt() };
    let mut found = at(ratio)?;
    for _ in 0..60 {
        let error = found.0.mean_poisson - poisson;
        if error.abs() < 1e-9 {
            break;
        }
        if error > 0.0 {
            left = ratio;
        } else {
            right = ratio;
        }
        // dν/d ln P is the share of the shear stiffness.
        let slope = found.0.derivatives(&found.1.share[1]).1;
        let newton = ratio * (-error / slope).exp();
        ratio = if newton > left && newton < right { newton } else { (left * right).sqrt() };
        found = at(ratio)?;
    }
    let normal_factor = young / found.0.mean_young;
    let (mut achieved, mut cell) = found;
    achieved = ElasticConstants::of(&(achieved.stiffness * normal_factor))?;
    cell.relaxed *= normal_factor;
    cell.affine *= normal_factor;
    for share in &mut cell.share {
        *share *= normal_factor;
    }
    let prior = network.volume.filter(|_| prior_ratio > 0.0).and_then(|volume| {
        let sum = network.moduli_sums().0 * normal_factor;
        Some((prior_ratio, isotropic_moduli(sum, volume, 1.0, ratio).ok()?.0 / young))
    });
    Ok(ElasticFit { shear_ratio: ratio, normal_factor, achieved, cell, reach: (least.1, most.1), prior, solutions })
}
