//! Stiffnesses of links for wanted elastic constants, on the user's own packing.
//!
//! Poisson's ratio of a network depends on `P = k_T/k_N` alone, Young's modulus is in proportion to all stiffnesses. So `P`
//! is sought for ν, then the rest follows. Point links have a `P` of their own; beams have `P ∝ k_B/k_N ∝ k_W/k_N ∝ r²` by
//! their radius (Jebahi et al. 2015, [2.9]–[2.12]); deformable particles keep the ratio of their modulus to `k_N`.
//!
//! First guess: the closed form (Stránský 2018, (3.38)) solved for P; then Newton steps with the exact derivative of the
//! static network ([`CellStiffness::derivatives`]), kept inside a bracket. With deformable particles, where a derivative costs as
//! much as a solution, false position (Illinois).

use concordem_statics::{
    Accuracy, CellStiffness, Derivatives, ElasticConstants, LinkNetwork, StaticsError, cell_stiffness, closed_form,
};

/// Smallest and largest ratio k_T/k_N looked at: beyond, ν changes in the fourth digit only.
pub const SHEAR_RATIOS: (f64, f64) = (1e-4, 1e3);

/// The same for beams: `k_T/k_N = 3r²/L²` is 3/4 for beams as thick as the spheres.
pub const BEAM_RATIOS: (f64, f64) = (1e-4, 1.0);

/// Why there are no such parameters.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ElasticCalibrationError {
    /// The network has no answer.
    #[error("{0}")]
    Statics(#[from] StaticsError),
    /// Beams without shear stiffness.
    #[error("the bonds carry moments but no shear; that is no beam whose radius could be sought")]
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
         upper end, deformable particles with another Poisson's ratio shift both"
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
    /// k_T/k_N of the links (of beams, the mean).
    pub shear_ratio: f64,
    /// What k_N of the given network is to be multiplied by, and the modulus of deformable particles.
    pub normal_factor: f64,
    /// What the radius of beams is to be multiplied by, and their modulus; both follow from the two above.
    pub beam_factors: Option<(f64, f64)>,
    /// Constants of the network with these stiffnesses.
    pub achieved: ElasticConstants,
    /// Particles that links do not hold, and the rest of the static solution.
    pub cell: CellStiffness,
    /// Least and largest Poisson's ratio within [`SHEAR_RATIOS`] or [`BEAM_RATIOS`].
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
    let beams = network.links.iter().any(|l| l.stiffness.bending != 0.0 || l.stiffness.twist != 0.0);
    let given = {
        let (normal, shear) = network.moduli_sums();
        shear / normal
    };
    if beams && (given.is_nan() || given <= 0.0) {
        return Err(ElasticCalibrationError::Moments);
    }
    let with_ratio = |ratio: f64| {
        let mut network = network.clone();
        for link in &mut network.links {
            let k = &mut link.stiffness;
            if beams {
                k.shear *= ratio / given;
                k.bending *= ratio / given;
                k.twist *= ratio / given;
            } else {
                k.shear = ratio * k.normal;
            }
        }
        network
    };
    let mut solutions = 0;
    let mut at = |ratio: f64| -> Result<(ElasticConstants, CellStiffness), StaticsError> {
        let cell = cell_stiffness(&with_ratio(ratio), accuracy)?;
        solutions += 1;
        progress(solutions);
        Ok((cell.constants()?, cell))
    };
    let (low, high) = if beams { BEAM_RATIOS } else { SHEAR_RATIOS };
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
    let Some(&[(mut left, above), (mut right, below)]) =
        bracket.and_then(|pair| <&[(f64, f64); 2]>::try_from(pair).ok())
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
    let prior_ratio = if network.planar { (1.0 - 3.0 * poisson) / (1.0 + poisson) } else { prior_ratio };
    let mut ratio = if prior_ratio > left && prior_ratio < right { prior_ratio } else { (left * right).sqrt() };
    let (mut error_left, mut error_right) = (above - poisson, below - poisson);
    let mut found = at(ratio)?;
    let mut last_side = 0.0;
    for _ in 0..60 {
        let error = found.0.mean_poisson - poisson;
        if error.abs() < 1e-9 {
            break;
        }
        let side = error.signum();
        if error > 0.0 {
            (left, error_left) = (ratio, error);
            if side == last_side {
                error_right *= 0.5;
            }
        } else {
            (right, error_right) = (ratio, error);
            if side == last_side {
                error_left *= 0.5;
            }
        }
        last_side = side;
        let next = if let Some(Derivatives { links: [_, shear, bending, twist], .. }) = &found.1.derivatives {
            // dν/d ln P is the share of all that is in proportion to P.
            let slope = found.0.derivatives(&(shear + bending + twist)).1;
            ratio * (-error / slope).exp()
        } else {
            let (low, high) = (left.ln(), right.ln());
            ((low * error_right - high * error_left) / (error_right - error_left)).exp()
        };
        ratio = if next > left && next < right { next } else { (left * right).sqrt() };
        found = at(ratio)?;
    }
    let normal_factor = young / found.0.mean_young;
    let mut cell = found.1;
    cell.relaxed *= normal_factor;
    cell.affine *= normal_factor;
    cell.derivatives = cell.derivatives.map(|derivatives| derivatives.scaled(normal_factor));
    let achieved = cell.constants()?;
    let rigid = network.compliance.is_empty();
    let prior = closed_form(&with_ratio(ratio).scaled(normal_factor, 1.0))
        .filter(|_| prior_ratio > 0.0 && !beams && rigid)
        .map(|closed| (prior_ratio, closed.young / young));
    let beam_factors = beams.then(|| (ratio / given).sqrt()).map(|radius| (radius, normal_factor / (radius * radius)));
    Ok(ElasticFit {
        shear_ratio: ratio,
        normal_factor,
        beam_factors,
        achieved,
        cell,
        reach: (least.1, most.1),
        prior,
        solutions,
    })
}
