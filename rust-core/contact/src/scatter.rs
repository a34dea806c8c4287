//! Strengths of bonds that differ by chance.
//!
//! The factor on the strength of a bond is a pure function of a seed and the ids of its two particles. So it needs no memory, and it is the
//! same for any number of threads and after a restart. Two bonds of the same two particles, through different images of a small periodic
//! cell, have the same factor.
//!
//! With `u`, uniform between 0 and 1, the factors have the mean 1:
//!
//! | distribution | factor |
//! |---|---|
//! | Weibull, modulus `m` | `(−ln u)^(1/m) / Γ(1+1/m)` |
//! | log-normal, coefficient of variation `v` | `exp(σz − ½σ²)`, `σ² = ln(1+v²)`, `z` standard normal |
//!
//! A Weibull factor may depend on the cross-section `A` of the bond by the weakest link (Weibull 1939): times `(A₀/A)^(1/m)`.
//!
//! With a correlation length the factors follow from a random field instead: [`crate::field`].

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::law::Fault;
use crate::math::{exp, ln, pow, sin_cos};
use crate::quantity::{Area, Length, Number};

/// Strengths of the bonds of a material that differ by chance: factors on all stresses or forces at which a bond fails or slips, with the
/// mean 1. A bond between two materials has the mean of both factors.
/// Example: `strength_scatter = { weibull_modulus = 8, seed = 1 }`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StrengthScatter {
    /// Modulus of a Weibull distribution; or give `log_normal_variation`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub weibull_modulus: Option<Number>,
    /// Cross-section of a bond whose mean factor is 1, m²: larger bonds are weaker, by the weakest link; default: the cross-section has no
    /// influence; only with `weibull_modulus`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub reference_area: Option<Area>,
    /// Standard deviation over mean of a log-normal distribution; or give `weibull_modulus`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub log_normal_variation: Option<Number>,
    /// Distance over which strengths are alike, m: the factors are a random field of the place of the particles at the start, and a bond has
    /// the mean of its two particles. The normal numbers behind them correlate by `exp(−(r/ℓ)²)` (Eliáš et al. 2015). Not in hosts. Default:
    /// each bond has a factor of its own. Example: `correlation_length = "20 mm"`.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub correlation_length: Option<Length>,
    /// Seed; another one gives other strengths. Default: 0.
    #[serde(default)]
    pub seed: u64,
}

impl StrengthScatter {
    /// Faults that the range of a single key does not show.
    pub fn faults(&self) -> Vec<Fault> {
        let help = "keep one of `weibull_modulus` and `log_normal_variation`";
        let mut faults = Vec::new();
        match (self.weibull_modulus.is_some(), self.log_normal_variation.is_some()) {
            (true, true) => faults.push(Fault::conflict("log_normal_variation", "two distributions are given", help)),
            (false, false) => {
                faults.push(Fault::missing(
                    "",
                    "the distribution is missing",
                    "add `weibull_modulus` or `log_normal_variation`",
                ));
            }
            (true, false) | (false, true) => {}
        }
        if self.reference_area.is_some() && self.weibull_modulus.is_none() {
            let help = "give `weibull_modulus`, or remove the key";
            faults.push(Fault::conflict("reference_area", "has no effect without `weibull_modulus`", help));
        }
        if self.reference_area.is_some() && self.correlation_length.is_some() {
            let help = "keep one of the two: a field has no bonds whose size could count";
            faults.push(Fault::conflict("correlation_length", "not with `reference_area`", help));
        }
        faults
    }

    /// The factor of each bond; `None` if they are a field, or the table has faults.
    pub fn scatter(&self) -> Option<Scatter> {
        let distribution = self.correlation_length.is_none().then(|| self.distribution())??;
        Some(Scatter { seed: self.seed, distribution })
    }

    /// The distribution of the factors; `None` if the table has faults.
    pub(crate) fn distribution(&self) -> Option<Distribution> {
        match (self.weibull_modulus, self.log_normal_variation) {
            (Some(modulus), None) => Some(Distribution::weibull(modulus.si(), self.reference_area.map(Area::si))),
            (None, Some(variation)) => Some(Distribution::log_normal(variation.si())),
            _ => None,
        }
    }
}

/// Distribution of a factor with the mean 1.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Distribution {
    /// Of a weakest link.
    Weibull {
        /// `1/m`.
        exponent: f64,
        /// `1/Γ(1+1/m)`.
        scale: f64,
        /// Cross-section of which the mean is 1, m²; `None`: the cross-section has no influence.
        reference_area: Option<f64>,
    },
    /// Its logarithm is normal.
    LogNormal {
        /// Standard deviation of the logarithm.
        deviation: f64,
    },
}

impl Distribution {
    /// Weibull's, with the modulus `m` and the cross-section (m²) of which the mean is 1, if it matters.
    pub fn weibull(modulus: f64, reference_area: Option<f64>) -> Self {
        let exponent = 1.0 / modulus;
        Self::Weibull { exponent, scale: 1.0 / libm::tgamma(1.0 + exponent), reference_area }
    }

    /// The log-normal one, with this coefficient of variation.
    pub fn log_normal(variation: f64) -> Self {
        Self::LogNormal { deviation: libm::log1p(variation * variation).sqrt() }
    }

    /// The factor that as many others stay below as normal numbers below `z`; the cross-section counts as that of the mean 1.
    pub fn of_normal(&self, z: f64) -> f64 {
        match *self {
            Self::Weibull { exponent, scale, .. } => {
                // The share of normal numbers above z.
                let above = 0.5 * libm::erfc(z * core::f64::consts::FRAC_1_SQRT_2);
                scale * pow(-ln(above), exponent)
            }
            Self::LogNormal { deviation } => exp(deviation * z - 0.5 * deviation * deviation),
        }
    }
}

/// Factors on the strengths of bonds.
///
/// ```
/// use concordem_contact::scatter::{Distribution, Scatter};
///
/// let scatter = Scatter { seed: 7, distribution: Distribution::weibull(5.0, None) };
/// assert_eq!(scatter.factor([3, 8], 1e-6), scatter.factor([8, 3], 1e-6));
/// let mean = (0..10_000).map(|id| scatter.factor([id, id + 1], 1e-6)).sum::<f64>() / 10_000.0;
/// assert!((mean - 1.0).abs() < 0.01);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Scatter {
    /// Seed.
    pub seed: u64,
    /// Distribution.
    pub distribution: Distribution,
}

impl Scatter {
    /// Factor on the strength of a bond of the particles with these ids and with the cross-section `area` (m²).
    pub fn factor(&self, ids: [u32; 2], area: f64) -> f64 {
        match self.distribution {
            Distribution::Weibull { exponent, scale, reference_area } => {
                let by_chance = scale * pow(-ln(self.uniform(ids, 0)), exponent);
                match reference_area {
                    Some(reference) => by_chance * pow(reference / area, exponent),
                    None => by_chance,
                }
            }
            Distribution::LogNormal { .. } => {
                self.distribution.of_normal(normal(self.uniform(ids, 0), self.uniform(ids, 1)))
            }
        }
    }

    fn uniform(&self, [a, b]: [u32; 2], stream: u64) -> f64 {
        uniform(self.seed, u64::from(a.min(b)) << 32 | u64::from(a.max(b)), stream)
    }
}

/// A number between 0 and 1, both excluded.
pub(crate) fn uniform(seed: u64, item: u64, stream: u64) -> f64 {
    let bits = mixed(mixed(mixed(seed) ^ item) ^ stream) >> 11;
    (bits as f64 + 0.5) * (1.0 / (1_u64 << 53) as f64)
}

/// A normal number of two uniform ones (Box and Muller 1958).
pub(crate) fn normal(first: f64, second: f64) -> f64 {
    let (_, cosine) = sin_cos(core::f64::consts::TAU * second);
    (-2.0 * ln(first)).sqrt() * cosine
}

/// The output function of SplitMix64 (Steele, Lea, and Flood 2014) after one step of its counter.
fn mixed(state: u64) -> u64 {
    let z = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Factors of the bonds of a square of particles, in ascending order.
    fn factors(scatter: &Scatter) -> Vec<f64> {
        let mut all: Vec<f64> =
            (0..300).flat_map(|a| (a + 1..300).map(move |b| [a, b])).map(|ids| scatter.factor(ids, 1.0)).collect();
        all.sort_by(f64::total_cmp);
        all
    }

    /// Largest distance of the distribution of `values` from `cumulative` (Kolmogorov and Smirnov).
    fn distance(values: &[f64], cumulative: impl Fn(f64) -> f64) -> f64 {
        let count = values.len() as f64;
        let at = |(k, value): (usize, &f64)| {
            let wanted = cumulative(*value);
            (wanted - k as f64 / count).abs().max((wanted - (k + 1) as f64 / count).abs())
        };
        values.iter().enumerate().map(at).fold(0.0, f64::max)
    }

    /// Distributions are the stated ones. At 44,850 independent numbers the distance exceeds 1.63/√n = 0.0077 once in a hundred seeds;
    /// the means lie within four standard errors.
    #[test]
    fn factors_have_the_distributions() {
        for modulus in [0.8, 3.0, 12.0] {
            let scatter = Scatter { seed: 5, distribution: Distribution::weibull(modulus, None) };
            let found = factors(&scatter);
            let gamma = libm::tgamma(1.0 + 1.0 / modulus);
            let far = distance(&found, |x| 1.0 - (-(x * gamma).powf(modulus)).exp());
            let variance = libm::tgamma(1.0 + 2.0 / modulus) / (gamma * gamma) - 1.0;
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            println!("Weibull {modulus}: distance {far:.4}, mean {mean:.4}");
            assert!(far < 0.0077, "{far}");
            assert!((mean - 1.0).abs() < 4.0 * (variance / found.len() as f64).sqrt(), "{mean}");
        }
        for variation in [0.1, 0.5] {
            let scatter = Scatter { seed: 5, distribution: Distribution::log_normal(variation) };
            let found = factors(&scatter);
            let sigma = (1.0 + variation * variation).ln().sqrt();
            let normal = |z: f64| 0.5 * libm::erfc(-z / std::f64::consts::SQRT_2);
            let far = distance(&found, |x| normal((x.ln() + 0.5 * sigma * sigma) / sigma));
            let mean = found.iter().sum::<f64>() / found.len() as f64;
            println!("log-normal {variation}: distance {far:.4}, mean {mean:.4}");
            assert!(far < 0.0077, "{far}");
            assert!((mean - 1.0).abs() < 4.0 * variation / (found.len() as f64).sqrt(), "{mean}");
        }
    }

    /// The weakest of `n` bonds of section `A` is distributed as one bond of section `n A`.
    #[test]
    fn a_large_bond_is_the_weakest_of_small_ones() {
        let scatter = Scatter { seed: 3, distribution: Distribution::weibull(4.0, Some(2.0)) };
        let weakest =
            |group: u32| (0..10).map(|k| scatter.factor([10 * group + k, 1_000_000], 2.0)).fold(f64::MAX, f64::min);
        let mut groups: Vec<f64> = (0..4000).map(weakest).collect();
        groups.sort_by(f64::total_cmp);
        let gamma = libm::tgamma(1.25);
        // One bond of ten times the reference area: its scale is 10^(−1/4)/Γ.
        let far = distance(&groups, |x| 1.0 - (-10.0 * (x * gamma).powi(4)).exp());
        println!("distance {far:.4}");
        assert!(far < 1.63 / 4000_f64.sqrt(), "{far}");
        let ratio = scatter.factor([1, 2], 20.0) / scatter.factor([1, 2], 2.0);
        assert!((ratio - 10_f64.powf(-0.25)).abs() < 1e-15, "{ratio}");
    }

    #[test]
    fn seeds_and_bonds_differ_and_sides_do_not() {
        let of = |seed, ids| Scatter { seed, distribution: Distribution::weibull(4.0, None) }.factor(ids, 1.0);
        assert_eq!(of(1, [4, 9]), of(1, [9, 4]));
        assert_ne!(of(1, [4, 9]), of(2, [4, 9]));
        assert_ne!(of(1, [4, 9]), of(1, [4, 10]));
        assert!((0..100_000).map(|k| of(1, [k, k])).all(|factor| factor > 0.0 && factor.is_finite()));
    }
}
