//! Strengths of bonds as a random field of the place.
//!
//! Behind the field of factors lies one of normal numbers, a sum of waves (Shinozuka and Deodatis 1991):
//!
//! ```text
//! g(x) = √(2/N) Σ cos(k·x + φ)
//! ```
//!
//! with wave vectors `k` whose components are normal numbers of the deviation `√2/ℓ`, and phases `φ` uniform between 0 and 2π. Numbers at the
//! distance `r` correlate by `exp(−(r/ℓ)²)`. The factor at `x` is the value of the distribution ([`Distribution::of_normal`]) that as many
//! others stay below as normal numbers below `g(x)`. In a periodic cell, wave vectors are rounded to those of the cell's lattice.

use core::f64::consts::TAU;

use crate::math::{Mat3, Vec3, sin_cos};
use crate::scatter::{Distribution, StrengthScatter, normal, uniform};

/// Waves of a field: its values are normal numbers up to a kurtosis of −1.5/N.
const WAVES: usize = 256;

/// A random field of factors on the strengths of bonds.
///
/// ```
/// use concordem_contact::field::StrengthField;
/// use concordem_contact::math::Vec3;
/// use concordem_contact::scatter::Distribution;
///
/// let field = StrengthField::new(Distribution::log_normal(0.2), 0.02, 7, None);
/// let at = |x: f64| field.factor(&Vec3::new(x, 0.0, 0.0));
/// assert!((at(0.0) - at(1e-4)).abs() < 1e-2 * at(0.0), "near places are alike");
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct StrengthField {
    distribution: Distribution,
    /// Wave vectors, rad/m, and phases, rad.
    waves: Vec<(Vec3, f64)>,
}

impl StrengthField {
    /// The field of a table, in a periodic cell with these edges (columns, m) if there is one; `None` if each bond has a factor of its own,
    /// or the table has faults.
    pub fn of(table: &StrengthScatter, cell: Option<&Mat3>) -> Option<Self> {
        Some(Self::new(table.distribution()?, table.correlation_length?.si(), table.seed, cell))
    }

    /// The field with this distribution, correlation length (m), and seed, in a periodic cell with these edges (columns, m) if there is
    /// one.
    pub fn new(distribution: Distribution, length: f64, seed: u64, cell: Option<&Mat3>) -> Self {
        let deviation = core::f64::consts::SQRT_2 / length;
        // Per wave three normal numbers of two uniform ones each, and a phase.
        let number = |wave: usize, stream: u64| uniform(seed, wave as u64, stream);
        let wave = |wave: usize| {
            let component = |axis: u64| deviation * normal(number(wave, 2 * axis), number(wave, 2 * axis + 1));
            let vector = Vec3::new(component(0), component(1), component(2));
            let vector = cell.map_or(vector, |edges| of_lattice(&vector, edges));
            (vector, TAU * number(wave, 6))
        };
        Self { distribution, waves: (0..WAVES).map(wave).collect() }
    }

    /// The factor at a place.
    pub fn factor(&self, place: &Vec3) -> f64 {
        self.distribution.of_normal(self.normal(place))
    }

    /// The normal number at a place.
    fn normal(&self, place: &Vec3) -> f64 {
        let sum: f64 = self.waves.iter().map(|(vector, phase)| sin_cos(vector.dot(place) + phase).1).sum();
        (2.0 / WAVES as f64).sqrt() * sum
    }
}

/// The wave vector nearest to this one that has the same phase in all images of the cell.
fn of_lattice(vector: &Vec3, edges: &Mat3) -> Vec3 {
    let cycles = (edges.transpose() * vector / TAU).map(f64::round);
    edges.transpose().try_inverse().map_or(*vector, |inverse| inverse * cycles * TAU)
}

#[cfg(test)]
mod tests {
    use super::*;

    const SEEDS: u64 = 4000;

    /// Over the seeds, the numbers at two places are normal and correlate by exp(−(r/ℓ)²): deviations within four standard errors.
    #[test]
    fn numbers_correlate_over_the_length() {
        for r in [0.0, 0.5, 1.0, 2.0] {
            let [a, b] = [Vec3::new(3.0, -1.0, 0.5), Vec3::new(3.0, -1.0 + 0.6 * r, 0.5 + 0.8 * r)];
            let sums = (0..SEEDS).fold([0.0; 4], |sums, seed| {
                let field = StrengthField::new(Distribution::log_normal(0.2), 1.0, seed, None);
                let (x, y) = (field.normal(&a), field.normal(&b));
                [sums[0] + x, sums[1] + x * x, sums[2] + x * y, sums[3] + x.powi(4)]
            });
            let [mean, variance, product, fourth] = sums.map(|sum| sum / SEEDS as f64);
            let wanted = (-r * r).exp();
            println!(
                "r {r}: mean {mean:.3}, variance {variance:.3}, product {product:.3} ({wanted:.3}), fourth {fourth:.3}"
            );
            let error = 4.0 / (SEEDS as f64).sqrt();
            assert!(mean.abs() < error, "{mean}");
            assert!((variance - 1.0).abs() < error * 2_f64.sqrt(), "{variance}");
            assert!((product - wanted).abs() < error * (1.0 + wanted * wanted).sqrt(), "{product}");
            assert!((fourth - 3.0).abs() < error * 96_f64.sqrt(), "{fourth}");
        }
    }

    /// Factors have the distribution: their logarithms, for Weibull's of modulus m, the variance π²/6m²; the mean is 1.
    #[test]
    fn factors_have_the_distribution() {
        let place = Vec3::new(0.2, 0.1, -4.0);
        let modulus = 6.0;
        let factors: Vec<f64> = (0..SEEDS)
            .map(|seed| StrengthField::new(Distribution::weibull(modulus, None), 1.0, seed, None).factor(&place))
            .collect();
        let mean = |of: &dyn Fn(f64) -> f64| factors.iter().map(|f| of(*f)).sum::<f64>() / SEEDS as f64;
        let logs = mean(&f64::ln);
        let variance = mean(&|f: f64| (f.ln() - logs).powi(2)) * modulus * modulus;
        println!("mean {:.4}, variance of the logarithm {variance:.3}", mean(&|f| f));
        // Deviation of the mean: 0.19/√n; of the variance: its kurtosis is 5.4.
        assert!((mean(&|f| f) - 1.0).abs() < 4.0 * 0.195 / (SEEDS as f64).sqrt());
        assert!((variance / (core::f64::consts::PI.powi(2) / 6.0) - 1.0).abs() < 4.0 * (4.4 / SEEDS as f64).sqrt());
    }

    #[test]
    fn images_of_a_cell_are_alike_and_seeds_differ() {
        let edges = Mat3::new(2.0, 0.3, 0.0, 0.0, 1.5, 0.1, 0.0, 0.0, 3.0);
        let of = |seed| StrengthField::new(Distribution::weibull(4.0, None), 0.4, seed, Some(&edges));
        let (field, other) = (of(1), of(2));
        let place = Vec3::new(0.3, 0.7, 1.1);
        let image = place + edges * Vec3::new(1.0, -2.0, 3.0);
        assert!((field.factor(&place) / field.factor(&image) - 1.0).abs() < 1e-12);
        assert_ne!(field.factor(&place), other.factor(&place));
        let away = place + Vec3::new(0.4, 0.0, 0.0);
        assert!((field.factor(&place) / field.factor(&away) - 1.0).abs() > 1e-3);
    }
}
