//! Sieve curve of fragments, and the laws of Rosin and Rammler and of Gaudin and Schuhmann with the errors of their parameters.
//!
//! Both laws describe the share `P` of the mass below the size `x` (ISO 9276-3:2008):
//!
//! * Rosin and Rammler (1933): `P = 1 − exp(−(x/x′)ⁿ)`
//! * Gaudin (1926) and Schuhmann (1940): `P = (x/k)ᵐ` up to the largest size `k`
//!
//! **Fit.** By maximum likelihood with the mass as weight. Points of a sieve curve are sums over the same fragments, so a regression through them
//! finds too small an error. Debris, single particles that cannot break, counts as mass somewhere below its own size.
//!
//! **Errors.** Sums of the squared changes when one fragment is left out (jackknife, Miller 1974): few heavy fragments determine little. The largest
//! of fragments with the law of Gaudin and Schuhmann lies below `k` by `k s/m` in
//! the mean, if `s` is its share of the mass; `k` is larger than it by this, which is also its error.

use super::positive;
use crate::error::{OperatorError, check_length};

/// Shares of the mass below sizes.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct SieveCurve {
    /// Sizes of the fragments, smallest first, m.
    pub size: Vec<f64>,
    /// Share of the mass of fragments that are not larger, 0 to 1.
    pub passing: Vec<f64>,
}

impl SieveCurve {
    /// The curve of fragments of these sizes (m) and masses (kg).
    ///
    /// ```
    /// use concordem_operator::fragments::sieve::SieveCurve;
    ///
    /// let curve = SieveCurve::new(&[2e-3, 1e-3, 4e-3], &[2.0, 1.0, 1.0]).unwrap();
    /// assert_eq!((curve.passing_at(2e-3), curve.passing_at(3.9e-3), curve.size_at(0.5)), (0.75, 0.75, Some(2e-3)));
    /// ```
    ///
    /// # Errors
    /// Different lengths; sizes or masses that are not positive and finite.
    pub fn new(size: &[f64], mass: &[f64]) -> Result<Self, OperatorError> {
        let weighed = sorted(size, mass, &vec![false; size.len()])?;
        let mut curve = Self::default();
        let mut below = 0.0;
        for one in &weighed {
            below += one.share;
            if curve.size.last() == Some(&one.size) {
                curve.size.pop();
                curve.passing.pop();
            }
            curve.size.push(one.size);
            curve.passing.push(below);
        }
        // Whatever the rounding of the sum.
        if let Some(last) = curve.passing.last_mut() {
            *last = 1.0;
        }
        Ok(curve)
    }

    /// Share of the mass that passes an opening (m).
    pub fn passing_at(&self, opening: f64) -> f64 {
        let below = self.size.partition_point(|size| *size <= opening);
        if below == 0 { 0.0 } else { self.passing[below - 1] }
    }

    /// Smallest size (m) of a fragment that at least this share of the mass passes; `None` without fragments or for a share above 1 or no number.
    pub fn size_at(&self, share: f64) -> Option<f64> {
        if share.is_nan() {
            return None;
        }
        self.size.get(self.passing.partition_point(|passing| *passing < share)).copied()
    }
}

/// A parameter with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
    /// Its value.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

/// A law that was fitted to fragments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fit {
    /// The size `x′` or `k`, m.
    pub size: Estimate,
    /// The exponent `n` or `m`.
    pub exponent: Estimate,
    /// Largest difference of the law and the sieve curve beyond the debris, as a share of the mass.
    pub deviation: f64,
    /// Number of fragments of equal mass that would say as much: `(Σm)²/Σm²` without debris.
    pub equal: f64,
}

/// Fewest fragments of equal mass to which a law is fitted.
const FEWEST: f64 = 10.0;

/// The law of Rosin and Rammler for fragments of these sizes (m) and masses (kg). `debris`: fragments that cannot break. `None` if fewer than ten
/// fragments of equal mass would say as much, or all sizes are equal.
///
/// # Errors
/// Different lengths; sizes or masses that are not positive and finite.
pub fn rosin_rammler(size: &[f64], mass: &[f64], debris: &[bool]) -> Result<Option<Fit>, OperatorError> {
    let weighed = sorted(size, mass, debris)?;
    let Some(number) = effective(&weighed) else { return Ok(None) };
    let mean = weighed.iter().map(|one| one.share * libm::log(one.size)).sum::<f64>();
    let terms: Vec<Term> = weighed
        .iter()
        .map(|one| Term { log: libm::log(one.size) - mean, share: one.share, is_bound: one.is_debris })
        .collect();
    let spread = terms.iter().map(|term| term.share * term.log * term.log).sum::<f64>().sqrt();
    if spread < LEAST_SPREAD {
        return Ok(None);
    }
    let Some(([n, b], [[v_nn, v_nb], [_, v_bb]])) = most_likely(&terms, spread) else { return Ok(None) };
    let size = libm::exp(mean - b / n);
    let [by_n, by_b] = [b / (n * n), -1.0 / n];
    let variance = by_n * by_n * v_nn + 2.0 * by_n * by_b * v_nb + by_b * by_b * v_bb;
    let law = |x: f64| 1.0 - libm::exp(-libm::pow(x / size, n));
    Ok(Some(Fit {
        size: Estimate { value: size, error: size * variance.max(0.0).sqrt() },
        exponent: Estimate { value: n, error: v_nn.max(0.0).sqrt() },
        deviation: deviation(&weighed, law),
        equal: number,
    }))
}

/// Standard deviation of the logarithms of sizes below which all are equal.
const LEAST_SPREAD: f64 = 1e-9;

/// The law of Gaudin and Schuhmann; see [`rosin_rammler`].
///
/// # Errors
/// Different lengths; sizes or masses that are not positive and finite.
pub fn gaudin_schuhmann(size: &[f64], mass: &[f64], debris: &[bool]) -> Result<Option<Fit>, OperatorError> {
    let weighed = sorted(size, mass, debris)?;
    let Some(number) = effective(&weighed) else { return Ok(None) };
    let Some(&Weighed { size: largest, share, is_debris: false }) = weighed.last() else { return Ok(None) };
    let below = |one: &Weighed| libm::log(largest / one.size);
    let whole: f64 = weighed.iter().filter(|one| !one.is_debris).map(|one| one.share).sum();
    let sum: f64 = weighed.iter().map(|one| one.share * below(one)).sum();
    if sum < LEAST_SPREAD {
        return Ok(None);
    }
    let m = whole / sum;
    let without = |one: &Weighed| {
        let own = if one.is_debris { 0.0 } else { one.share };
        (whole - own) / (sum - one.share * below(one))
    };
    let variance = weighed.iter().map(|one| (without(one) - m).powi(2)).sum::<f64>();
    let gap = largest * share / m;
    let size = largest + gap;
    Ok(Some(Fit {
        size: Estimate { value: size, error: gap },
        exponent: Estimate { value: m, error: variance.sqrt() },
        deviation: deviation(&weighed, |x| libm::pow(x / size, m).min(1.0)),
        equal: number,
    }))
}

/// A fragment with its share of the mass.
#[derive(Debug, Clone, Copy)]
struct Weighed {
    size: f64,
    share: f64,
    is_debris: bool,
}

/// The fragments by size; equal sizes by mass, so that sums do not depend on the numbering.
fn sorted(size: &[f64], mass: &[f64], debris: &[bool]) -> Result<Vec<Weighed>, OperatorError> {
    check_length("mass", mass.len(), size.len(), "fragment")?;
    check_length("debris", debris.len(), size.len(), "fragment")?;
    positive("size", size)?;
    positive("mass", mass)?;
    let mut weighed: Vec<Weighed> = size
        .iter()
        .zip(mass)
        .zip(debris)
        .map(|((&size, &share), &is_debris)| Weighed { size, share, is_debris })
        .collect();
    weighed.sort_by(|one, other| {
        one.size
            .total_cmp(&other.size)
            .then(one.share.total_cmp(&other.share))
            .then(one.is_debris.cmp(&other.is_debris))
    });
    let total: f64 = weighed.iter().map(|one| one.share).sum();
    for one in &mut weighed {
        one.share /= total;
    }
    Ok(weighed)
}

/// `(Σm)²/Σm²` without debris; `None` if it is too small.
fn effective(weighed: &[Weighed]) -> Option<f64> {
    let shares = || weighed.iter().filter(|one| !one.is_debris).map(|one| one.share);
    let number = shares().sum::<f64>().powi(2) / shares().map(|share| share * share).sum::<f64>();
    (number >= FEWEST).then_some(number)
}

/// Largest difference of a law and the steps of the curve from the largest debris on.
fn deviation(weighed: &[Weighed], law: impl Fn(f64) -> f64) -> f64 {
    let debris = weighed.iter().rposition(|one| one.is_debris).map_or(0, |last| last + 1);
    let mut below: f64 = weighed[..debris].iter().map(|one| one.share).sum();
    let mut most: f64 = 0.0;
    for one in &weighed[debris..] {
        let at = law(one.size);
        most = most.max((at - below).abs());
        below += one.share;
        most = most.max((at - below).abs());
    }
    most
}

/// A fragment in the likelihood of Rosin and Rammler's law.
struct Term {
    /// Logarithm of the size over the mean size.
    log: f64,
    share: f64,
    /// Whether only `size ≤ …` is known.
    is_bound: bool,
}

impl Term {
    /// Logarithm of the likelihood as a function of `z = n ln x + b` without `ln n`, and its first and second derivative.
    fn likelihood(&self, z: f64) -> [f64; 3] {
        let y = libm::exp(z);
        if !self.is_bound {
            return [z - y, 1.0 - y, -y];
        }
        let q = if y < SMALL { 1.0 - 0.5 * y } else { y / libm::expm1(y) };
        let [value, second] =
            if y < SMALL { [z - 0.5 * y, -0.5 * y] } else { [libm::log(-libm::expm1(-y)), q * (1.0 - y - q)] };
        [value, q, second]
    }
}

/// Below it series of two terms are exact to rounding.
const SMALL: f64 = 1e-7;

/// Most steps of Newton's method; a dozen are usual.
const MOST_STEPS: usize = 200;

/// The most likely `n` and `b` in `P = 1 − exp(−exp(n ln x + b))` with their covariance. The logarithm of the likelihood is concave in both, so
/// Newton's method with shortened steps finds its only maximum. `None` without one.
fn most_likely(terms: &[Term], spread: f64) -> Option<([f64; 2], [[f64; 2]; 2])> {
    let value = |n: f64, b: f64| {
        let each = |term: &Term| {
            let own = if term.is_bound { 0.0 } else { libm::log(n) };
            term.share * (own + term.likelihood(n * term.log + b)[0])
        };
        terms.iter().map(each).sum::<f64>()
    };
    // Moments of the logarithms of the law: deviation π/√6/n, mean of n ln x + b minus Euler's constant.
    let [mut n, mut b] = [std::f64::consts::PI / 6.0_f64.sqrt() / spread, -0.577_215_664_901_532_9];
    let mut last = value(n, b);
    for _ in 0..MOST_STEPS {
        let (gradient, curvature) = derivatives(terms, n, b);
        let inverse = inverse(curvature)?;
        let step = [0, 1].map(|i| inverse[i][0] * gradient[0] + inverse[i][1] * gradient[1]);
        let mut part = 1.0;
        let next = loop {
            let [n, b] = [n + part * step[0], b + part * step[1]];
            let next = if n > 0.0 { value(n, b) } else { f64::NEG_INFINITY };
            // A step of rounding errors may lower the likelihood by one.
            if next >= last - 1e-14 * last.abs() {
                break Some([n, b, next]);
            }
            part *= 0.5;
            if part < 1e-12 {
                break None;
            }
        };
        let [next_n, next_b, next] = next?;
        let moved = (next_n - n).abs() / n + (next_b - b).abs();
        [n, b, last] = [next_n, next_b, next];
        if moved < 1e-11 {
            let (_, curvature) = derivatives(terms, n, b);
            return Some(([n, b], covariance(terms, n, b, curvature)?));
        }
    }
    None
}

/// A vector and a symmetric matrix of `n` and `b`.
type Derivatives = ([f64; 2], [[f64; 2]; 2]);

/// Contribution of a fragment to the gradient and the negative curvature.
fn contribution(term: &Term, n: f64, b: f64) -> Derivatives {
    let [_, first, second] = term.likelihood(n * term.log + b);
    let own = if term.is_bound { 0.0 } else { 1.0 / n };
    let gradient = [first * term.log + own, first].map(|by| term.share * by);
    let curvature = [[own * own - second * term.log * term.log, -second * term.log], [-second * term.log, -second]];
    (gradient, curvature.map(|row| row.map(|value| term.share * value)))
}

/// Gradient and negative curvature of the logarithm of the likelihood.
fn derivatives(terms: &[Term], n: f64, b: f64) -> Derivatives {
    terms.iter().fold(Derivatives::default(), |(gradient, curvature), term| {
        let (own_gradient, own_curvature) = contribution(term, n, b);
        let row = |i: usize| [0, 1].map(|j| curvature[i][j] + own_curvature[i][j]);
        ([0, 1].map(|i| gradient[i] + own_gradient[i]), [row(0), row(1)])
    })
}

/// Sum of the squared changes when one fragment is left out, by one step of Newton's method each.
fn covariance(terms: &[Term], n: f64, b: f64, curvature: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let mut found = [[0.0; 2]; 2];
    for term in terms {
        let (gradient, own) = contribution(term, n, b);
        let row = |i: usize| [0, 1].map(|j| curvature[i][j] - own[i][j]);
        let inverse = inverse([row(0), row(1)])?;
        let moved = [0, 1].map(|i| inverse[i][0] * gradient[0] + inverse[i][1] * gradient[1]);
        for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            found[i][j] += moved[i] * moved[j];
        }
    }
    Some(found)
}

fn inverse([[a, b], [c, d]]: [[f64; 2]; 2]) -> Option<[[f64; 2]; 2]> {
    let determinant = a * d - b * c;
    (determinant > 0.0).then(|| [[d / determinant, -b / determinant], [-c / determinant, a / determinant]])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pseudorandom numbers between 0 and 1 (Knuth's multiplier).
    struct Numbers(u64);

    impl Numbers {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
        }
    }

    /// Fragments whose mass follows a law: sizes, masses `x³`, and which are debris.
    type Set = (Vec<f64>, Vec<f64>, Vec<bool>);

    /// `count` fragments beyond `least`, drawn by number, so that their mass follows `law` with the density `f`: the density of numbers is `f/x³`,
    /// largest at `least`. All mass below is debris of the size `least`.
    fn broken(numbers: &mut Numbers, count: usize, [least, most]: [f64; 2], f: impl Fn(f64) -> f64, below: f64) -> Set {
        let cells = 20_000;
        let at = |k: usize| least * (most / least).powf(k as f64 / cells as f64);
        let mut sums = vec![0.0];
        let mut mass = 0.0;
        for k in 0..cells {
            let (x, width) = (0.5 * (at(k) + at(k + 1)), at(k + 1) - at(k));
            sums.push(sums[k] + f(x) / (x * x * x) * width);
            mass += f(x) * width;
        }
        let total = sums[cells];
        let (mut size, mut debris) = (Vec::new(), Vec::new());
        for _ in 0..count {
            let wanted = numbers.next() * total;
            let k = sums.partition_point(|sum| *sum <= wanted) - 1;
            let share = (wanted - sums[k]) / (sums[k + 1] - sums[k]);
            size.push(at(k) + share * (at(k + 1) - at(k)));
            debris.push(false);
        }
        // Mass expected of the fragments over that of all, 1 - below.
        let expected = count as f64 * mass / total;
        let dust = (expected * below / (1.0 - below) / least.powi(3)).round() as usize;
        size.extend(std::iter::repeat_n(least, dust));
        debris.extend(std::iter::repeat_n(true, dust));
        let masses = size.iter().map(|x| x * x * x).collect();
        (size, masses, debris)
    }

    /// Squared deviations of many sets from the truth over their squared standard errors, both in the mean, for size and exponent. (The mean of
    /// the ratios says less: a set without the largest fragments has a small parameter's error, and a large deviation.)
    fn over_errors(truth: [f64; 2], fits: &[Fit]) -> [f64; 2] {
        let ratio = |of: &dyn Fn(&Fit) -> Estimate, truth: f64| {
            let deviations = fits.iter().map(|fit| (of(fit).value - truth).powi(2)).sum::<f64>();
            deviations / fits.iter().map(|fit| of(fit).error.powi(2)).sum::<f64>()
        };
        [ratio(&|fit| fit.size, truth[0]), ratio(&|fit| fit.exponent, truth[1])]
    }

    /// Sets of fragments with known parameters give them back within their errors, whose size is right: the ratio of 60 sets has the error
    /// √(2/60) = 0.18 for normal deviations, and skewed ones scatter more.
    #[test]
    fn parameters_of_rosin_and_rammler_are_recovered() {
        let numbers = &mut Numbers(5);
        for (x, n) in [(3.0_f64, 1.2_f64), (5.0, 2.0)] {
            let density = |s: f64| n / x * (s / x).powf(n - 1.0) * (-(s / x).powf(n)).exp();
            let below = 1.0 - (-(1.0 / x).powf(n)).exp();
            let fits: Vec<Fit> = (0..60)
                .map(|_| {
                    let (size, mass, debris) = broken(numbers, 4000, [1.0, 12.0 * x], density, below);
                    rosin_rammler(&size, &mass, &debris).unwrap().unwrap()
                })
                .collect();
            let errors = over_errors([x, n], &fits);
            println!("x' = {x}, n = {n}: {:?}, {errors:?}", fits[0]);
            assert!(errors.iter().all(|ratio| (0.5..1.8).contains(ratio)), "{errors:?}");
            // A law that explains nothing would be off by half of the mass.
            assert!(fits.iter().all(|fit| fit.deviation < 0.25));
        }
    }

    #[test]
    fn parameters_of_gaudin_and_schuhmann_are_recovered() {
        let numbers = &mut Numbers(9);
        for (k, m) in [(20.0_f64, 0.8_f64), (10.0, 1.5)] {
            let density = |s: f64| m / k * (s / k).powf(m - 1.0);
            let fits: Vec<Fit> = (0..60)
                .map(|_| {
                    let (size, mass, debris) = broken(numbers, 4000, [1.0, k], density, (1.0 / k).powf(m));
                    gaudin_schuhmann(&size, &mass, &debris).unwrap().unwrap()
                })
                .collect();
            let errors = over_errors([k, m], &fits);
            println!("k = {k}, m = {m}: {:?}, {errors:?}", fits[0]);
            assert!(errors.iter().all(|ratio| (0.5..1.8).contains(ratio)), "{errors:?}");
            // A law that explains nothing would be off by half of the mass.
            assert!(fits.iter().all(|fit| fit.deviation < 0.25));
        }
    }

    /// Fragments of equal mass at the quantiles of a law: its parameters, and the errors of textbooks. Of Weibull's law by maximum likelihood they
    /// are `√(6/π²)` of n and `√(1 + 6(1 − γ)²/π²)/n` of ln x′, over `√N`; of a power law `m/√N`.
    #[test]
    fn equal_masses_have_the_errors_of_textbooks() {
        let count = 20_000;
        let share = |k: usize| (k as f64 + 0.5) / count as f64;
        let (mass, debris) = (vec![2.0; count], vec![false; count]);
        let sizes: Vec<f64> = (0..count).map(|k| 5.0 * (-(1.0 - share(k)).ln()).powf(1.0 / 1.7)).collect();
        let fit = rosin_rammler(&sizes, &mass, &debris).unwrap().unwrap();
        // Quantiles at the middles of 20,000 steps miss the ends of the law: 1/count times its logarithm.
        assert!((fit.size.value / 5.0 - 1.0).abs() < 1e-3 && (fit.exponent.value / 1.7 - 1.0).abs() < 1e-3, "{fit:?}");
        let root = (count as f64).sqrt();
        let pi2 = std::f64::consts::PI.powi(2);
        let euler = 0.577_215_664_901_532_9;
        let error = 1.7 * (6.0 / pi2).sqrt() / root;
        assert!((fit.exponent.error / error - 1.0).abs() < 5e-3, "{fit:?} {error}");
        let error = 5.0 / 1.7 * (1.0 + 6.0 * (1.0_f64 - euler).powi(2) / pi2).sqrt() / root;
        assert!((fit.size.error / error - 1.0).abs() < 5e-3, "{fit:?} {error}");
        assert!((fit.equal / count as f64 - 1.0).abs() < 1e-10 && fit.deviation < 1e-3);
        let sizes: Vec<f64> = (0..count).map(|k| 8.0 * share(k).powf(1.0 / 0.6)).collect();
        let fit = gaudin_schuhmann(&sizes, &mass, &debris).unwrap().unwrap();
        assert!((fit.size.value / 8.0 - 1.0).abs() < 1e-3 && (fit.exponent.value / 0.6 - 1.0).abs() < 1e-3, "{fit:?}");
        assert!((fit.exponent.error / (0.6 / root) - 1.0).abs() < 5e-3, "{fit:?}");
        assert!((fit.size.error / (8.0 / (0.6 * count as f64)) - 1.0).abs() < 1e-3, "{fit:?}");
    }

    /// Debris says only that its mass lies below a size: with the lower half of the quantiles as debris at the median, the law stays the same.
    #[test]
    fn debris_does_not_bend_the_law() {
        let count = 20_000;
        let share = |k: usize| (k as f64 + 0.5) / count as f64;
        let debris: Vec<bool> = (0..count).map(|k| 2 * k < count).collect();
        let mass = vec![1.0; count];
        let half: f64 = 0.5;
        let law = |share: f64| 5.0 * (-(1.0 - share).ln()).powf(1.0 / 1.7);
        let sizes: Vec<f64> = (0..count).map(|k| law(share(k).max(half))).collect();
        let fit = rosin_rammler(&sizes, &mass, &debris).unwrap().unwrap();
        assert!((fit.size.value / 5.0 - 1.0).abs() < 1e-3 && (fit.exponent.value / 1.7 - 1.0).abs() < 2e-3, "{fit:?}");
        let law = |share: f64| 8.0 * share.powf(1.0 / 0.6);
        let sizes: Vec<f64> = (0..count).map(|k| law(share(k).max(half))).collect();
        let fit = gaudin_schuhmann(&sizes, &mass, &debris).unwrap().unwrap();
        assert!((fit.size.value / 8.0 - 1.0).abs() < 1e-3 && (fit.exponent.value / 0.6 - 1.0).abs() < 2e-3, "{fit:?}");
        // Taken as fragments of this size they would bend it.
        let naive = gaudin_schuhmann(&sizes, &mass, &vec![false; count]).unwrap().unwrap();
        assert!(naive.exponent.value > 0.9, "{naive:?}");
    }

    /// The order of the fragments does not change a bit, and units only the size.
    #[test]
    fn numbering_and_units_do_not_matter() {
        let numbers = &mut Numbers(1);
        let density = |s: f64| 0.5 * (-s / 2.0).exp();
        let (size, mass, debris) = broken(numbers, 500, [1.0, 30.0], density, 0.4);
        let turned = |values: &[f64]| values.iter().rev().copied().collect::<Vec<f64>>();
        let reversed: Vec<bool> = debris.iter().rev().copied().collect();
        for fit in [rosin_rammler, gaudin_schuhmann] {
            let one = fit(&size, &mass, &debris).unwrap().unwrap();
            assert_eq!(fit(&turned(&size), &turned(&mass), &reversed).unwrap().unwrap(), one);
            let small: Vec<f64> = size.iter().map(|x| x * 1e-3).collect();
            let other = fit(&small, &mass, &debris).unwrap().unwrap();
            assert!((other.size.value / one.size.value / 1e-3 - 1.0).abs() < 1e-9);
            assert!((other.exponent.value / one.exponent.value - 1.0).abs() < 1e-9);
        }
        assert_eq!(SieveCurve::new(&turned(&size), &turned(&mass)).unwrap(), SieveCurve::new(&size, &mass).unwrap());
    }

    #[test]
    fn curves_are_sums_of_masses() {
        let curve = SieveCurve::new(&[1.0, 4.0, 2.0, 2.0], &[1.0, 4.0, 2.0, 1.0]).unwrap();
        assert_eq!((curve.size.as_slice(), curve.passing.as_slice()), (&[1.0, 2.0, 4.0][..], &[0.125, 0.5, 1.0][..]));
        assert_eq!([0.5, 1.0, 3.0, 9.0].map(|opening| curve.passing_at(opening)), [0.0, 0.125, 0.5, 1.0]);
        assert_eq!([0.0, 0.2, 0.5, 0.51, 1.0].map(|share| curve.size_at(share).unwrap()), [1.0, 2.0, 2.0, 4.0, 4.0]);
        assert_eq!((curve.size_at(1.5), curve.size_at(f64::NAN)), (None, None));
        assert_eq!(SieveCurve::new(&[], &[]).unwrap().size_at(0.5), None);
    }

    #[test]
    fn few_fragments_have_no_law_and_bad_ones_are_refused() {
        let even = [1.0; 40];
        for fit in [rosin_rammler, gaudin_schuhmann] {
            let whole = [false; 40];
            assert_eq!(fit(&even, &even, &whole), Ok(None), "all sizes are equal");
            let sizes: Vec<f64> = (1..=40).map(f64::from).collect();
            assert!(fit(&sizes, &even, &whole).unwrap().is_some());
            assert_eq!(fit(&sizes, &even, &[true; 40]), Ok(None), "debris alone");
            assert_eq!(fit(&sizes[..9], &even[..9], &whole[..9]), Ok(None));
            assert_eq!(fit(&[], &[], &[]), Ok(None));
            let mut heavy = even;
            heavy[39] = 1e3;
            assert_eq!(fit(&sizes, &heavy, &whole), Ok(None), "one fragment has all the mass");
            for bad in [f64::NAN, f64::INFINITY, 0.0, -1.0] {
                let mut values = even;
                values[3] = bad;
                assert!(fit(&values, &even, &whole).is_err() && fit(&even, &values, &whole).is_err());
                assert!(SieveCurve::new(&values, &even).is_err() && SieveCurve::new(&even, &values).is_err());
            }
            assert!(fit(&even, &even[..9], &whole).is_err() && fit(&even, &even, &whole[..9]).is_err());
        }
    }
}
