//! Links: coordination, lengths, directions, fabric.

use super::{Body, CharacteriseError};
use concordem_contact::math::Mat3;
use concordem_operator::structure::{Coordination, Geode, Orientations, coordination};
use nalgebra::SymmetricEigen;

/// Classes of the histogram of lengths.
const CLASSES: usize = 40;

/// Measures of the links. Lengths, directions, and fabric are those of links between two spheres inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Network {
    /// Number of all links.
    pub links: usize,
    /// Coordination numbers.
    pub coordination: Coordination,
    /// Mean length over the sum of the radii, its standard deviation, and the smallest and the largest value; `None` without links
    /// inside.
    pub length: Option<[f64; 4]>,
    /// Middle of each class of lengths over the sum of radii, and number of links in it.
    pub lengths: Vec<(f64, u64)>,
    /// Mean and largest overlap of the pairs that touch over the sum of radii.
    pub overlap: [f64; 2],
    /// Fabric tensor `(1/N) Σ n⊗n`, and its eigenvalues in ascending order; `None` without links inside.
    pub fabric: Option<(Mat3, [f64; 3])>,
    /// Directions on the geode.
    pub orientations: Orientations,
}

impl Network {
    pub(super) fn of(body: &Body, outer: &[bool]) -> Result<Self, CharacteriseError> {
        let coordination = coordination(&body.pairs, outer)?;
        let relative = |k: usize| {
            let sum: f64 = body.pairs[k].iter().map(|p| body.packing.spheres[*p as usize].radius).sum();
            body.branches[k].norm() / sum
        };
        let overlaps: Vec<f64> = (0..body.pairs.len()).map(|k| 1.0 - relative(k)).filter(|o| *o >= 0.0).collect();
        let mean_overlap = overlaps.iter().sum::<f64>() / overlaps.len().max(1) as f64;
        let overlap = [mean_overlap, overlaps.iter().copied().fold(0.0, f64::max)];
        let inside: Vec<usize> =
            (0..body.pairs.len()).filter(|k| body.pairs[*k].iter().all(|p| !outer[*p as usize])).collect();
        let branches: Vec<_> = inside.iter().map(|k| body.branches[*k]).collect();
        let orientations = Geode::new().orientations(&branches)?;
        let lengths: Vec<f64> = inside.iter().map(|k| relative(*k)).collect();
        let count = lengths.len() as f64;
        let (low, high) = lengths.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), v| (l.min(*v), h.max(*v)));
        let mean = lengths.iter().sum::<f64>() / count;
        let variance = lengths.iter().map(|l| (l - mean) * (l - mean)).sum::<f64>() / count;
        let length = (!lengths.is_empty()).then_some([mean, variance.sqrt(), low, high]);
        let fabric = (!branches.is_empty()).then(|| {
            let tensor: Mat3 = branches.iter().map(|l| l.normalize() * l.normalize().transpose()).sum::<Mat3>() / count;
            let mut values: [f64; 3] = SymmetricEigen::new(tensor).eigenvalues.into();
            values.sort_by(f64::total_cmp);
            (tensor, values)
        });
        Ok(Self {
            links: body.pairs.len(),
            coordination,
            length,
            lengths: histogram(&lengths, low, high),
            overlap,
            fabric,
            orientations,
        })
    }
}

/// Middle and count of classes of equal width.
fn histogram(values: &[f64], low: f64, high: f64) -> Vec<(f64, u64)> {
    let width = (high - low) / CLASSES as f64;
    if values.is_empty() || width <= 0.0 {
        return values.first().map(|value| (*value, values.len() as u64)).into_iter().collect();
    }
    let mut counts = vec![0_u64; CLASSES];
    for value in values {
        counts[(((value - low) / width) as usize).min(CLASSES - 1)] += 1;
    }
    counts.iter().enumerate().map(|(k, n)| (low + (k as f64 + 0.5) * width, *n)).collect()
}
