//! Peak and modulus of a stress–strain curve.

use concordem_scenario::sampling::Record;

/// What a loading up to failure shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Peak {
    /// Slope of stress over strain up to 30 % of the peak, Pa.
    pub young: f64,
    /// Stress of largest magnitude, Pa; positive in tension.
    pub stress: f64,
    /// Strain at this stress.
    pub strain: f64,
}

impl Peak {
    /// That of a run's records, of which there is at least one.
    pub fn of(samples: &[Record]) -> Self {
        let mut peak = 0;
        for (k, sample) in samples.iter().enumerate() {
            if sample.stress.abs() > samples[peak].stress.abs() {
                peak = k;
            }
        }
        let Record { stress, strain, .. } = samples[peak];
        let rising = samples[..peak].iter().filter(|sample| sample.stress.abs() <= 0.3 * stress.abs());
        let points: Vec<[f64; 2]> = rising.map(|sample| [sample.strain, sample.stress]).collect();
        let count = points.len().max(1) as f64;
        let mean = points.iter().fold([0.0; 2], |m, p| [m[0] + p[0] / count, m[1] + p[1] / count]);
        let (mut xy, mut xx) = (0.0, 0.0);
        for [x, y] in points {
            xy += (x - mean[0]) * (y - mean[1]);
            xx += (x - mean[0]) * (x - mean[0]);
        }
        let young = if xx > 0.0 { xy / xx } else { stress / strain };
        Self { young, stress, strain }
    }
}
