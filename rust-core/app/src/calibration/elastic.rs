//! Bond stiffnesses for target elastic constants, on a given packing.
//!
//! Poisson's ratio of a network depends only on `P = k_T/k_N`; Young's modulus is proportional to all stiffnesses. The
//! search finds `P` for ν; the stiffnesses then follow from E. For links without moments, `P` is a free parameter; for beams
//! `P ∝ k_B/k_N ∝ k_W/k_N ∝ r²` with the radius ratio r (Jebahi et al. 2015, [2.9]–[2.12]). The ratio of the modulus of
//! deformable particles to `k_N` is kept.
//!
//! The first guess is the closed form (Stránský 2018, (3.38)) solved for P. Newton steps follow, with the exact
//! derivative of the static network ([`CellStiffness::derivatives`]), kept inside a bracket. With deformable particles
//! a derivative costs as much as a solution, so false position (Illinois method) is used.

use concordem_statics::{
    Accuracy, CellStiffness, Derivatives, ElasticConstants, LinkNetwork, StaticsError, cell_stiffness, closed_form,
};

/// Range of k_T/k_N; outside it, ν changes only in the fourth digit.
pub const SHEAR_RATIOS: (f64, f64) = (1e-4, 1e3);

/// Range of k_T/k_N for beams; `k_T/k_N = 3r²/L²` is 3/4 for beams as thick as the spheres.
pub const BEAM_RATIOS: (f64, f64) = (1e-4, 1.0);

/// Error of the search.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ElasticCalibrationError {
    /// The static problem has no solution.
    #[error("{0}")]
    Statics(#[from] StaticsError),
    /// The links carry moments but no shear.
    #[error("the bonds carry moments but no shear force; use cohesive beams, whose radius can be calibrated")]
    Moments,
    /// Invalid modulus.
    #[error("Young's modulus is {young:e} Pa; it must be positive and finite")]
    Young {
        /// Target modulus, Pa.
        young: f64,
    },
    /// Poisson's ratio out of reach of this packing.
    #[error(
        "Poisson's ratio {wanted} is out of reach: this packing and interaction ratio give {least:.4} (k_T/k_N = \
         {least_at:.1e}) to {most:.4} (k_T/k_N = {most_at:.1e}); a smaller interaction ratio or a looser packing raises the \
         upper limit; deformable particles with another Poisson's ratio shift both limits"
    )]
    OutOfReach {
        /// Target Poisson's ratio.
        wanted: f64,
        /// Least Poisson's ratio.
        least: f64,
        /// k_T/k_N at which it occurs.
        least_at: f64,
        /// Largest Poisson's ratio.
        most: f64,
        /// k_T/k_N at which it occurs.
        most_at: f64,
    },
}

/// Result: stiffnesses that give the target constants.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticFit {
    /// k_T/k_N of the links (for beams, the mean).
    pub shear_ratio: f64,
    /// Factor to apply to k_N of the given network, and to the modulus of deformable particles.
    pub normal_factor: f64,
    /// Factors to apply to the radius and the modulus of beams; they follow from the two values above.
    pub beam_factors: Option<(f64, f64)>,
    /// Constants of the network with these stiffnesses.
    pub achieved: ElasticConstants,
    /// Static solution.
    pub cell: CellStiffness,
    /// Least and largest Poisson's ratio within [`SHEAR_RATIOS`] or [`BEAM_RATIOS`].
    pub reach: (f64, f64),
    /// Prediction of the closed form: k_T/k_N for the target ν, and E at the found parameters over the target E.
    pub prior: Option<(f64, f64)>,
    /// Number of static solutions.
    pub solutions: usize,
}

/// Finds k_T/k_N and the factor of k_N for which the network has these constants, Poisson's ratio within 1e-9. `young` in
/// Pa; `progress` receives the number of static solutions.
///
/// # Errors
/// Constants out of reach (the error gives the reach); links with moments but no shear; no static solution.
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
    let mut search = Search { network, beams, given, accuracy, solutions: 0, progress };
    let Bracket { left, right, least, most } = search.bracket(poisson)?;
    let prior_ratio = (1.0 - 4.0 * poisson) / (1.0 + poisson);
    let prior_ratio = if network.planar { (1.0 - 3.0 * poisson) / (1.0 + poisson) } else { prior_ratio };
    let (ratio, found) = search.refine(left, right, prior_ratio, poisson)?;
    let normal_factor = young / found.0.mean_young;
    let mut cell = found.1;
    cell.relaxed *= normal_factor;
    cell.affine *= normal_factor;
    cell.derivatives = cell.derivatives.map(|derivatives| derivatives.scaled(normal_factor));
    let achieved = cell.constants()?;
    let rigid = network.compliance.is_empty();
    let prior = closed_form(&search.with_ratio(ratio).scaled(normal_factor, 1.0))
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
        solutions: search.solutions,
    })
}

/// Stiffness ratio k_T/k_N and Poisson's ratio.
type Trial = (f64, f64);

/// Neighboring trials that bracket the target Poisson's ratio, and the extremes of all trials.
struct Bracket {
    left: Trial,
    right: Trial,
    least: Trial,
    most: Trial,
}

/// Static solutions of a network with varied k_T/k_N.
struct Search<'a> {
    network: &'a LinkNetwork,
    /// Whether links carry moments.
    beams: bool,
    /// k_T/k_N of the network.
    given: f64,
    accuracy: Accuracy,
    solutions: usize,
    progress: &'a mut dyn FnMut(usize),
}

impl Search<'_> {
    fn with_ratio(&self, ratio: f64) -> LinkNetwork {
        let mut network = self.network.clone();
        for link in &mut network.links {
            let k = &mut link.stiffness;
            if self.beams {
                k.shear *= ratio / self.given;
                k.bending *= ratio / self.given;
                k.twist *= ratio / self.given;
            } else {
                k.shear = ratio * k.normal;
            }
        }
        network
    }

    fn solve(&mut self, ratio: f64) -> Result<(ElasticConstants, CellStiffness), StaticsError> {
        let cell = cell_stiffness(&self.with_ratio(ratio), self.accuracy)?;
        self.solutions += 1;
        (self.progress)(self.solutions);
        Ok((cell.constants()?, cell))
    }

    /// Scans the range of k_T/k_N by decades.
    fn bracket(&mut self, poisson: f64) -> Result<Bracket, ElasticCalibrationError> {
        let (low, high) = if self.beams { BEAM_RATIOS } else { SHEAR_RATIOS };
        // ν decreases with P, but has a maximum near P = 0 if particles have few links; the scan finds it.
        let mut scan: Vec<Trial> = Vec::new();
        let decades = (high / low).log10().round() as i32;
        for k in 0..=decades {
            let ratio = low * 10.0_f64.powi(k);
            scan.push((ratio, self.solve(ratio)?.0.mean_poisson));
        }
        let by_value = |a: &&Trial, b: &&Trial| a.1.total_cmp(&b.1);
        let (Some(&least), Some(&most)) = (scan.iter().min_by(by_value), scan.iter().max_by(by_value)) else {
            return Err(StaticsError::Soft.into());
        };
        let bracket = scan.windows(2).rfind(|pair| pair[0].1 >= poisson && pair[1].1 <= poisson);
        match bracket {
            Some(&[left, right]) => Ok(Bracket { left, right, least, most }),
            _ => Err(ElasticCalibrationError::OutOfReach {
                wanted: poisson,
                least: least.1,
                least_at: least.0,
                most: most.1,
                most_at: most.0,
            }),
        }
    }

    /// Newton steps, or false position without a derivative, inside the bracket: the ratio, and its solution.
    fn refine(
        &mut self,
        (mut left, above): Trial,
        (mut right, below): Trial,
        prior: f64,
        poisson: f64,
    ) -> Result<(f64, (ElasticConstants, CellStiffness)), StaticsError> {
        let mut ratio = if prior > left && prior < right { prior } else { (left * right).sqrt() };
        let (mut error_left, mut error_right) = (above - poisson, below - poisson);
        let mut found = self.solve(ratio)?;
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
                // All stiffnesses that are proportional to P contribute to dν/d ln P.
                let slope = found.0.derivatives(&(shear + bending + twist)).1;
                ratio * (-error / slope).exp()
            } else {
                let (low, high) = (left.ln(), right.ln());
                ((low * error_right - high * error_left) / (error_right - error_left)).exp()
            };
            ratio = if next > left && next < right { next } else { (left * right).sqrt() };
            found = self.solve(ratio)?;
        }
        Ok((ratio, found))
    }
}
