//! Samples of a sweep: points of the unit cube, for the axes without a count.

use concordem_packing::random::Random;
use serde::Deserialize;

/// Largest number of samples: that of the Sobol sequence.
pub(super) const MOST_SAMPLES: usize = 1 << 16;

/// How the numbers of a range are spaced.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// Equal differences.
    Linear,
    /// Equal ratios.
    Logarithmic,
}

impl Scale {
    /// Name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
            Self::Logarithmic => "logarithmic",
        }
    }
}

/// The range of a sampled axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// One end.
    pub from: f64,
    /// The other end.
    pub to: f64,
    /// Scale.
    pub scale: Scale,
}

impl Sampled {
    /// The number at a share of the range, from 0 to 1. Twelve digits avoid rounding noise in tables.
    pub(super) fn at(&self, share: f64) -> f64 {
        let Self { from, to, scale } = *self;
        let number = match scale {
            Scale::Linear => from + (to - from) * share,
            Scale::Logarithmic => {
                let (low, high) = (libm::log(from), libm::log(to));
                libm::exp(low + (high - low) * share)
            }
        };
        let rounded: f64 = format!("{number:.11e}").parse().unwrap_or(f64::NAN);
        rounded.clamp(from.min(to), from.max(to))
    }
}

/// How points are sampled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(super) enum Method {
    /// Sobol sequence with the direction numbers of Joe and Kuo (2008), scrambled as Owen does.
    Sobol,
    /// Each of `count` equal parts of each axis has one sample.
    LatinHypercube,
    /// Independent samples.
    Random,
}

/// The table `[sampling]`.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Sampling {
    method: Method,
    count: usize,
    #[serde(default = "first")]
    seed: u32,
}

fn first() -> u32 {
    1
}

/// A problem of the table: key, message, and remedy.
pub(super) type SamplingProblem = (&'static str, String, &'static str);

impl Sampling {
    /// What is wrong for this number of sampled axes.
    pub(super) fn problem(&self, axes: usize) -> Option<SamplingProblem> {
        let most = sobol_burley::NUM_DIMENSIONS as usize;
        if !(1..=MOST_SAMPLES).contains(&self.count) {
            let message = format!("{} samples are not possible", self.count);
            return Some(("sampling.count", message, "give a count from 1 to 65536; a power of two suits \"sobol\""));
        }
        if axes == 0 {
            let message = "has no effect: no axis is sampled".to_owned();
            return Some((
                "sampling",
                message,
                "write linear = { from = 1, to = 2 }, without count, in an axis; or remove the table",
            ));
        }
        if self.method == Method::Sobol && axes > most {
            let message = format!("{axes} axes are sampled; the Sobol sequence has {most} dimensions");
            return Some(("sampling.method", message, "write method = \"latin-hypercube\", or sample fewer axes"));
        }
        None
    }

    /// Numbers in [0, 1): a list of `count` of them for each axis. They depend only on the table and the place of the axis.
    pub(super) fn samples(&self, axes: usize) -> Vec<Vec<f64>> {
        let mut random = Random::new(self.seed.into());
        let axis = |axis: usize| -> Vec<f64> {
            match self.method {
                Method::Sobol => {
                    let sample = |k: usize| sobol_burley::sample(k as u32, axis as u32, self.seed);
                    (0..self.count).map(|k| f64::from(sample(k))).collect()
                }
                Method::LatinHypercube => {
                    let mut parts: Vec<usize> = (0..self.count).collect();
                    random.shuffle(&mut parts);
                    parts.into_iter().map(|part| (part as f64 + random.uniform()) / self.count as f64).collect()
                }
                Method::Random => (0..self.count).map(|_| random.uniform()).collect(),
            }
        };
        (0..axes).map(axis).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn samples(method: Method, count: usize, seed: u32, axes: usize) -> Vec<Vec<f64>> {
        Sampling { method, count, seed }.samples(axes)
    }

    /// Whether each of as many equal parts as there are numbers has one of them.
    fn is_stratified(numbers: &[f64]) -> bool {
        let count = numbers.len();
        let mut parts: Vec<usize> = numbers.iter().map(|number| (number * count as f64) as usize).collect();
        parts.sort_unstable();
        parts.into_iter().eq(0..count)
    }

    #[test]
    fn every_part_of_an_axis_has_one_sample() {
        for (axes, count, seed) in [(1, 1, 1), (3, 7, 2), (20, 100, 1), (2, 4096, 9)] {
            assert!(samples(Method::LatinHypercube, count, seed, axes).iter().all(|axis| is_stratified(axis)));
        }
        for (axes, count, seed) in [(256, 64, 1), (5, 1024, 7), (2, MOST_SAMPLES, 1)] {
            assert!(samples(Method::Sobol, count, seed, axes).iter().all(|axis| is_stratified(axis)));
        }
    }

    /// Every elementary box of the first two axes has one of sixteen points, whatever its shape.
    #[test]
    fn two_axes_of_a_sobol_sequence_fill_all_boxes() {
        for seed in 1..20 {
            let [x, y] = &samples(Method::Sobol, 16, seed, 2)[..] else { panic!() };
            for (wide, high) in [(1, 16), (2, 8), (4, 4), (8, 2), (16, 1)] {
                let mut boxes: Vec<usize> = x
                    .iter()
                    .zip(y)
                    .map(|(x, y)| (x * f64::from(wide)) as usize * high + (y * high as f64) as usize)
                    .collect();
                boxes.sort_unstable();
                assert!(boxes.into_iter().eq(0..16), "seed {seed}, {wide} by {high}");
            }
        }
    }

    /// The first points of the sequence of Joe and Kuo (new-joe-kuo-6.21201), times 8, in its first eight dimensions.
    #[test]
    fn direction_numbers_are_the_published_ones() {
        use sobol_burley::parts::sobol_rev;
        let point = |k: u32| -> [u32; 8] {
            std::array::from_fn(|d| sobol_rev(k.reverse_bits(), d as u32).reverse_bits() >> 29)
        };
        assert_eq!([0, 1, 2, 3, 4, 5, 6, 7].map(point), PUBLISHED);
    }

    const PUBLISHED: [[u32; 8]; 8] = [
        [0, 0, 0, 0, 0, 0, 0, 0],
        [4, 4, 4, 4, 4, 4, 4, 4],
        [2, 6, 6, 6, 2, 2, 6, 2],
        [6, 2, 2, 2, 6, 6, 2, 6],
        [1, 5, 3, 1, 1, 3, 5, 5],
        [5, 1, 7, 5, 5, 7, 1, 1],
        [3, 3, 5, 7, 3, 1, 3, 7],
        [7, 7, 1, 3, 7, 5, 7, 3],
    ];

    /// Samples must not change with a dependency: results of old sweeps could not be continued or compared.
    #[test]
    fn samples_are_pinned() {
        let bits = |method| -> Vec<u64> { samples(method, 3, 1, 2).concat().into_iter().map(f64::to_bits).collect() };
        assert_eq!(
            bits(Method::Sobol),
            [
                0x3fdb_81ef_0000_0000,
                0x3fef_5217_0000_0000,
                0x3fc6_55f9_0000_0000,
                0x3fe7_fa8d_c000_0000,
                0x3fb4_9b7e_0000_0000,
                0x3fd7_44da_0000_0000,
            ]
        );
        assert_eq!(
            bits(Method::LatinHypercube),
            [
                0x3feb_b257_2022_404b,
                0x3fb2_b737_f421_02ad,
                0x3fdb_62a9_86fc_6cfb,
                0x3fd8_9705_458f_25c5,
                0x3fd2_a978_9796_3973,
                0x3fec_dee3_5cac_8559,
            ]
        );
        assert_eq!(
            bits(Method::Random),
            [
                0x3fd9_c253_3aa3_2902,
                0x3fb4_9406_d8fc_0e88,
                0x3fe3_1705_6066_c0e0,
                0x3fcc_12d3_ee31_8404,
                0x3fd2_27fc_94f5_46f2,
                0x3fe6_bd51_a6dd_3c44,
            ]
        );
        assert_ne!(samples(Method::Sobol, 3, 1, 2), samples(Method::Sobol, 3, 2, 2));
    }
}
