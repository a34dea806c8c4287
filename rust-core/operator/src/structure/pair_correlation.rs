//! Pair correlation function.

use crate::error::OperatorError;

/// Pair correlation function `g(r)`.
#[derive(Debug, Clone, PartialEq)]
pub struct PairCorrelation {
    /// Middle of each interval of distances, m.
    pub distance: Vec<f64>,
    /// `g`: number of centers at this distance from a center, over the number in a packing of the same mean density without any order.
    pub g: Vec<f64>,
    /// Centers from which distances were measured.
    pub centers: usize,
}

/// `g(r)` up to `reach` (m) in `bins` intervals, from the distances (m) of pairs of particles.
///
/// `pairs` yields all pairs nearer than `reach`, each once; `central`: whether distances are measured from a particle, which must be
/// deeper than `reach` in a bounded body; `density`: number of particles per volume in which they are found, 1/m³.
///
/// ```math
/// g(r) = n(r) / (N 4π/3 (r_+³ − r_-³) ρ)
/// ```
///
/// # Errors
/// A pair that names a particle that does not exist, or whose distance is not finite; a reach, density, or number of intervals that is not positive; no central particle.
pub fn pair_correlation(
    pairs: &[([u32; 2], f64)],
    central: &[bool],
    density: f64,
    reach: f64,
    bins: usize,
) -> Result<PairCorrelation, OperatorError> {
    let demand = "must be positive and finite";
    for (name, value) in [("reach", reach), ("number density", density), ("number of intervals", bins as f64)] {
        if !(value > 0.0 && value.is_finite()) {
            return Err(OperatorError::Constant { name, value, demand });
        }
    }
    let centers = central.iter().filter(|c| **c).count();
    if centers == 0 {
        return Err(OperatorError::EmptyRegion { what: "particle" });
    }
    let mut counts = vec![0_u64; bins];
    for (entry, (pair, distance)) in pairs.iter().enumerate() {
        if let Some(&index) = pair.iter().find(|p| **p as usize >= central.len()) {
            return Err(OperatorError::Index { name: "pairs", entry, index, count: central.len() });
        }
        if !distance.is_finite() {
            return Err(OperatorError::NotFinite { name: "pairs", entry });
        }
        let bin = (distance / reach * bins as f64) as usize;
        if bin < bins {
            counts[bin] += pair.iter().map(|p| u64::from(central[*p as usize])).sum::<u64>();
        }
    }
    let width = reach / bins as f64;
    let shell = |k: usize| {
        let (low, high) = (k as f64 * width, (k as f64 + 1.0) * width);
        4.0 / 3.0 * std::f64::consts::PI * (high * high * high - low * low * low)
    };
    let g = |(k, n): (usize, &u64)| *n as f64 / (centers as f64 * shell(k) * density);
    Ok(PairCorrelation {
        distance: (0..bins).map(|k| (k as f64 + 0.5) * width).collect(),
        g: counts.iter().enumerate().map(g).collect(),
        centers,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A periodic simple cubic lattice of edge 1 seen from one site: 6 neighbors at 1 and 12 at √2, density 1.
    #[test]
    fn neighbors_of_a_lattice_site() {
        let mut pairs = vec![([0, 1], 1.0); 3];
        pairs.extend(vec![([0, 1], 2.0_f64.sqrt()); 6]);
        let found = pair_correlation(&pairs, &[true, true], 1.0, 2.0, 4).unwrap();
        let shell = |low: f64, high: f64| 4.0 / 3.0 * std::f64::consts::PI * (high * high * high - low * low * low);
        assert_eq!((found.g[0], found.g[1], found.g[3]), (0.0, 0.0, 0.0));
        // Nine pairs in the third interval, seen from both ends by two centers.
        approx::assert_relative_eq!(found.g[2], 9.0 / shell(1.0, 1.5), max_relative = 1e-14);
        let half = pair_correlation(&pairs, &[true, false], 1.0, 2.0, 4).unwrap();
        assert_eq!((half.centers, half.g[2]), (1, found.g[2]));
        assert!(pair_correlation(&pairs, &[false, false], 1.0, 2.0, 4).is_err());
        assert!(pair_correlation(&pairs, &[true], 1.0, 2.0, 4).is_err());
        assert!(pair_correlation(&pairs, &[true, true], 0.0, 2.0, 4).is_err());
    }
}
