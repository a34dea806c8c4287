//! Distribution of radii.

use crate::error::OperatorError;

/// Distribution of radii, by number of particles.
#[derive(Debug, Clone, PartialEq)]
pub struct Sizes {
    /// Smallest radius, m.
    pub smallest: f64,
    /// Largest radius, m.
    pub largest: f64,
    /// Mean radius `R̄`, m.
    pub mean: f64,
    /// Standard deviation, m.
    pub deviation: f64,
    /// Dispersion `κ = (R_max − R_min)/R̄` (Jebahi et al. 2015, \[2.7\]).
    pub dispersion: f64,
    /// Numbers of particles in classes of equal width from the smallest to the largest radius; one class if all are equal.
    pub counts: Vec<u64>,
}

/// Distribution of `radius` (m) in `classes` classes.
///
/// # Errors
/// No radius, or one that is not positive and finite.
///
/// ```
/// use concordem_operator::structure::sizes;
///
/// assert!(sizes(&[1e-3, 2e-3, 2e-3], 2).is_ok());
/// assert!(sizes(&[], 2).is_err());
/// ```
pub fn sizes(radius: &[f64], classes: usize) -> Result<Sizes, OperatorError> {
    if radius.is_empty() {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    if let Some(&value) = radius.iter().find(|r| !(**r > 0.0 && r.is_finite())) {
        return Err(OperatorError::Constant { name: "radius", value, demand: "radii must be positive and finite" });
    }
    let count = radius.len() as f64;
    let smallest = radius.iter().copied().fold(f64::INFINITY, f64::min);
    let largest = radius.iter().copied().fold(0.0, f64::max);
    let mean = radius.iter().sum::<f64>() / count;
    let variance = radius.iter().map(|r| (r - mean) * (r - mean)).sum::<f64>() / count;
    // Radii that differ only by rounding are equal.
    let equal = largest - smallest <= 1e-12 * largest;
    let classes = if equal { 1 } else { classes.max(1) };
    let mut counts = vec![0; classes];
    for r in radius {
        let place = if equal { 0.0 } else { (r - smallest) / (largest - smallest) * classes as f64 };
        counts[(place as usize).min(classes - 1)] += 1;
    }
    Ok(Sizes { smallest, largest, mean, deviation: variance.sqrt(), dispersion: (largest - smallest) / mean, counts })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Radii 1, 2, 3, 4: mean 2.5, deviation √1.25, dispersion 3/2.5.
    #[test]
    fn four_radii() {
        let found = sizes(&[4.0, 1.0, 2.0, 3.0], 3).unwrap();
        assert_eq!((found.smallest, found.largest, found.mean, found.dispersion), (1.0, 4.0, 2.5, 1.2));
        assert_eq!(found.deviation, 1.25_f64.sqrt());
        assert_eq!(found.counts, [1, 1, 2]);
        assert_eq!(sizes(&[2.0; 5], 10).unwrap().counts, [5]);
        assert!(sizes(&[], 3).is_err() && sizes(&[1.0, 0.0], 3).is_err() && sizes(&[f64::NAN], 3).is_err());
    }
}
