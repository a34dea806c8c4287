//! Distributions of radii.

use crate::schema;
use concordem_packing::SizeDistribution;

/// Distribution of the radii of a packing.
pub(super) fn sizes(radius: Option<f64>, radii: Option<&schema::Radii>) -> SizeDistribution {
    match (radius, radii) {
        (Some(radius), _) => SizeDistribution::Single(radius),
        (None, Some(schema::Radii::Uniform { minimum, maximum })) => {
            SizeDistribution::Uniform { low: minimum.si(), high: maximum.si() }
        }
        (None, Some(schema::Radii::Table { radii, shares })) => {
            SizeDistribution::Discrete(radii.iter().zip(shares).map(|(r, s)| (r.si(), s.si())).collect())
        }
        (None, Some(schema::Radii::LogNormal { median, deviation, minimum, maximum })) => {
            // A thousand classes of equal width in ln r, weighted by the normal density of ln r.
            const CLASSES: u32 = 1000;
            let (low, high) = (concordem_contact::math::ln(minimum.si()), concordem_contact::math::ln(maximum.si()));
            let middle = concordem_contact::math::ln(median.si());
            let class = |k: u32| {
                let x = low + (high - low) * (f64::from(k) + 0.5) / f64::from(CLASSES);
                let z = (x - middle) / deviation.si();
                (concordem_contact::math::exp(x), concordem_contact::math::exp(-0.5 * z * z))
            };
            SizeDistribution::Discrete((0..CLASSES).map(class).collect())
        }
        // The checks of the scenario guarantee one of the two.
        (None, None) => SizeDistribution::Discrete(Vec::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Log-normal radii between three deviations on either side of the median: the logarithm has the mean of the normal
    /// distribution and, cut off there, 0.9733 of its variance. 20,000 radii, one in each slice of a thousand classes, know both to
    /// 1e-4.
    #[test]
    fn log_normal_radii_have_their_deviation() {
        let deviation = 0.2;
        let (low, high) = (1e-3 * (-0.6_f64).exp(), 1e-3 * 0.6_f64.exp());
        let text = format!(
            "kind = \"log-normal\"\nmedian = 1e-3\ndeviation = {deviation}\nminimum = {low:e}\nmaximum = {high:e}"
        );
        let table: schema::Radii = toml::from_str(&text).unwrap();
        let radii = sizes(None, Some(&table)).radii(20_000, 1).unwrap();
        let logarithms: Vec<f64> = radii.iter().map(|r| (r / 1e-3).ln() / deviation).collect();
        let mean = logarithms.iter().sum::<f64>() / 20_000.0;
        let variance = logarithms.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / 20_000.0;
        assert!(mean.abs() < 1e-3 && (variance - 0.9733).abs() < 1e-3, "{mean} {variance}");
    }
}
