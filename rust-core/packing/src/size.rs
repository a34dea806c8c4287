//! Radii of random packings.

use super::{PackingError, Random, positive};
use concordem_contact::math::{cbrt, ln};

/// How the radii of a packing are distributed.
#[derive(Debug, Clone, PartialEq)]
pub enum SizeDistribution {
    /// All equal, m.
    Single(f64),
    /// Uniform by number between two radii, m.
    Uniform {
        /// Smallest radius, m.
        low: f64,
        /// Largest radius, m.
        high: f64,
    },
    /// Radii (m), each with its fraction of the number of particles; the fractions are normalized to the sum 1.
    Discrete(Vec<(f64, f64)>),
    /// A sieve curve: diameters (m, ascending) with the mass fraction that passes (ascending from 0 to 1).
    ///
    /// Between two sieves the passing mass is linear in the logarithm of the diameter, so the number of particles per
    /// diameter falls with d⁻⁴ there: `n(d) ∝ (m_i / ln(d_{i+1}/d_i)) d⁻⁴`.
    Sieve(Vec<(f64, f64)>),
}

/// One interval of radii with its fraction of the number of particles; equal ends for a single radius.
#[derive(Debug, Clone, Copy)]
struct Class {
    low: f64,
    high: f64,
    fraction: f64,
}

impl SizeDistribution {
    /// `count` radii (m) in random order.
    ///
    /// The quantiles are stratified: one in each of `count` equal slices of the distribution, so that even small
    /// packings follow it closely.
    ///
    /// # Errors
    /// Radii, number fractions, or passing fractions that are not positive or not in order.
    pub fn radii(&self, count: usize, seed: u64) -> Result<Vec<f64>, PackingError> {
        let classes = self.classes()?;
        let power_law = matches!(self, Self::Sieve(_));
        let total: f64 = classes.iter().map(|class| class.fraction).sum();
        let mut random = Random::new(seed);
        let mut radii = Vec::with_capacity(count);
        let mut class = 0;
        let mut below = 0.0;
        for k in 0..count {
            let quantile = (k as f64 + random.uniform()) / count as f64 * total;
            while class + 1 < classes.len() && quantile >= below + classes[class].fraction {
                below += classes[class].fraction;
                class += 1;
            }
            let Class { low, high, fraction } = classes[class];
            let t = ((quantile - below) / fraction).clamp(0.0, 1.0);
            radii.push(if low == high {
                low
            } else if power_law {
                // Inverse of the number fraction below d, (d_low⁻³ − d⁻³)/(d_low⁻³ − d_high⁻³).
                let ratio = low / high;
                low / cbrt(1.0 - t * (1.0 - ratio * ratio * ratio))
            } else {
                low + t * (high - low)
            });
        }
        random.shuffle(&mut radii);
        Ok(radii)
    }

    /// Largest and smallest possible radius, m.
    ///
    /// # Errors
    /// As [`Self::radii`].
    pub fn bounds(&self) -> Result<(f64, f64), PackingError> {
        let classes = self.classes()?;
        let low = classes.iter().map(|class| class.low).fold(f64::INFINITY, f64::min);
        let high = classes.iter().map(|class| class.high).fold(0.0, f64::max);
        Ok((low, high))
    }

    fn classes(&self) -> Result<Vec<Class>, PackingError> {
        let bad = |reason: String| Err(PackingError::BadSizes { reason });
        match self {
            Self::Single(radius) => {
                let radius = positive("the radius", *radius)?;
                Ok(vec![Class { low: radius, high: radius, fraction: 1.0 }])
            }
            Self::Uniform { low, high } => {
                positive("the smallest radius", *low)?;
                positive("the largest radius", *high)?;
                if low > high {
                    return bad(format!("the smallest radius {low} m exceeds the largest {high} m"));
                }
                Ok(vec![Class { low: *low, high: *high, fraction: 1.0 }])
            }
            Self::Discrete(list) => {
                let mut classes = Vec::new();
                for &(radius, share) in list {
                    positive("a radius of the size distribution", radius)?;
                    if !(share >= 0.0 && share.is_finite()) {
                        return bad(format!("the share {share} of the radius {radius} m is negative or not finite"));
                    }
                    if share > 0.0 {
                        classes.push(Class { low: radius, high: radius, fraction: share });
                    }
                }
                if classes.is_empty() {
                    return bad("no radius has a positive share".into());
                }
                Ok(classes)
            }
            Self::Sieve(points) => {
                if points.len() < 2 {
                    return bad(format!("a sieve curve needs two points at least, not {}", points.len()));
                }
                for &(diameter, passing) in points {
                    positive("a diameter of the sieve curve", diameter)?;
                    super::within("a passing fraction of the sieve curve", passing, 0.0, 1.0)?;
                }
                if points[0].1 != 0.0 || points[points.len() - 1].1 != 1.0 {
                    return bad("a sieve curve starts with passing fraction 0 and ends with 1".into());
                }
                let mut classes = Vec::new();
                for pair in points.windows(2) {
                    let ((d_low, p_low), (d_high, p_high)) = (pair[0], pair[1]);
                    if d_low >= d_high || p_low > p_high {
                        return bad(format!(
                            "the sieve curve must rise: ({d_low} m, {p_low}) is followed by ({d_high} m, {p_high})"
                        ));
                    }
                    if p_high > p_low {
                        let (low, high) = (0.5 * d_low, 0.5 * d_high);
                        let fraction = (p_high - p_low) / ln(d_high / d_low)
                            * (1.0 / (low * low * low) - 1.0 / (high * high * high));
                        classes.push(Class { low, high, fraction });
                    }
                }
                Ok(classes)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sieve_curve_is_reproduced_by_mass() {
        let points = vec![(1.0e-3, 0.0), (2.0e-3, 0.3), (4.0e-3, 0.5), (5.0e-3, 0.5), (8.0e-3, 1.0)];
        let radii = SizeDistribution::Sieve(points.clone()).radii(200_000, 7).unwrap();
        let mass = |r: &f64| r * r * r;
        let total: f64 = radii.iter().map(mass).sum();
        for (diameter, passing) in points {
            let below: f64 = radii.iter().filter(|r| 2.0 * **r < diameter).map(mass).sum();
            // Stratified: the number below any size is exact to one particle, and its mass is a small part of the total.
            // 1e-3 is far above that and far below the steps of the curve.
            approx::assert_abs_diff_eq!(below / total, passing, epsilon = 1.0e-3);
        }
        // Half-way in the logarithm between two sieves, half the mass.
        let middle: f64 = radii.iter().filter(|r| 2.0 * **r < 2.0e-3_f64 * 2.0_f64.sqrt()).map(mass).sum();
        approx::assert_abs_diff_eq!(middle / total, 0.4, epsilon = 1.0e-3);
    }

    #[test]
    fn uniform_and_discrete_follow_their_fractions() {
        let radii = SizeDistribution::Uniform { low: 1.0, high: 3.0 }.radii(1000, 1).unwrap();
        assert_eq!(radii.iter().filter(|r| **r < 1.5).count(), 250);
        assert!(radii.windows(2).any(|w| w[0] > w[1]), "not shuffled");
        let radii = SizeDistribution::Discrete(vec![(1.0, 3.0), (2.0, 0.0), (0.5, 1.0)]).radii(1000, 1).unwrap();
        assert_eq!(radii.iter().filter(|r| **r == 1.0).count(), 750);
        assert_eq!(radii.iter().filter(|r| **r == 0.5).count(), 250);
    }

    #[test]
    fn seeds_decide() {
        let sizes = SizeDistribution::Uniform { low: 1.0, high: 3.0 };
        assert_eq!(sizes.radii(50, 3).unwrap(), sizes.radii(50, 3).unwrap());
        assert_ne!(sizes.radii(50, 3).unwrap(), sizes.radii(50, 4).unwrap());
    }

    /// Each slice has one quantile, and the quantile lies anywhere in its slice: the mean of its place squared, measured from
    /// the middle, is 1/12. A thousand of them scatter by 1/√(180·1000) = 2.4e-3; four times that are allowed. The places of two
    /// slices have nothing to do with each other, nor have those of two seeds.
    #[test]
    fn quantiles_lie_anywhere_in_their_slices() {
        let count = 1000;
        let places = |seed| {
            let mut radii = SizeDistribution::Uniform { low: 1.0, high: 3.0 }.radii(count, seed).unwrap();
            radii.sort_by(f64::total_cmp);
            let place = |(k, r): (usize, &f64)| 0.5 * (r - 1.0) * count as f64 - k as f64 - 0.5;
            radii.iter().enumerate().map(place).collect::<Vec<f64>>()
        };
        let mean_product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / a.len() as f64;
        let (one, other) = (places(3), places(4));
        assert!(one.iter().all(|place| place.abs() < 0.5 + 1e-9), "a slice without a quantile");
        approx::assert_abs_diff_eq!(mean_product(&one, &one), 1.0 / 12.0, epsilon = 0.01);
        // Products of independent places have the mean 0 and scatter by (1/12)/√1000 = 2.6e-3.
        approx::assert_abs_diff_eq!(mean_product(&one, &other), 0.0, epsilon = 0.011);
        approx::assert_abs_diff_eq!(mean_product(&one[1..], &one[..count - 1]), 0.0, epsilon = 0.011);
    }

    #[test]
    fn invalid_parameters_are_refused() {
        let bad = [
            SizeDistribution::Single(0.0),
            SizeDistribution::Single(f64::NAN),
            SizeDistribution::Uniform { low: 2.0, high: 1.0 },
            SizeDistribution::Discrete(vec![]),
            SizeDistribution::Discrete(vec![(1.0, -1.0)]),
            SizeDistribution::Sieve(vec![(1.0, 0.0)]),
            SizeDistribution::Sieve(vec![(1.0, 0.0), (2.0, 0.9)]),
            SizeDistribution::Sieve(vec![(1.0, 0.0), (2.0, 0.9), (1.5, 1.0)]),
            SizeDistribution::Sieve(vec![(1.0, 0.0), (2.0, 0.9), (3.0, 0.8), (4.0, 1.0)]),
        ];
        for sizes in bad {
            assert!(sizes.radii(10, 0).is_err(), "{sizes:?}");
        }
    }
}
