//! Solid fractions, layers, and pair correlation.

use super::{Body, CharacteriseError};
use concordem_contact::math::Vec3;
use concordem_operator::strain::Dimension;
use concordem_operator::structure::{Hull, Layers, PairCorrelation, layers, pair_correlation};
use concordem_operator::tessellation::{Domain, power_diagram};
use concordem_packing::Shape;
use concordem_solver::neighbor::candidate_pairs;

/// Thickness of a layer in mean radii.
const LAYER: f64 = 0.25;
/// Number of layers: down to eight mean radii.
const LAYERS: usize = 32;
/// Reach of the pair correlation in mean radii, and its intervals per mean radius.
const REACH: f64 = 10.0;
const INTERVALS: f64 = 20.0;
/// Reach of the pair correlation of large packings: a sphere has some 170 others within six radii, and 800 within ten.
const SHORT_REACH: f64 = 6.0;
const LARGE: usize = 50_000;
/// Smallest reach that shows the second peak, and smallest number of spheres to measure from.
const LEAST_REACH: f64 = 4.5;
const LEAST_CENTERS: usize = 30;
/// Classes of the histogram of solid fractions of cells.
const CLASSES: usize = 40;

/// The surface of a body.
pub(super) enum Surface {
    /// None: the packing is periodic.
    Periodic,
    Shape(Shape),
    Hull(Hull),
}

impl Surface {
    pub(super) fn of(body: &Body) -> Result<Self, CharacteriseError> {
        if body.packing.cell.is_some() {
            return Ok(Self::Periodic);
        }
        if let Some(shape) = &body.shape {
            return Ok(Self::Shape(shape.clone()));
        }
        Ok(Self::Hull(hull(body)?))
    }

    /// Whether a point is outside or less than `depth` (m) inside.
    pub(super) fn is_nearer(&self, x: &Vec3, depth: f64) -> bool {
        match self {
            Self::Periodic => false,
            Self::Shape(shape) => !shape.contains(x, depth),
            Self::Hull(hull) => hull.depth(x) < depth,
        }
    }

    /// Layer of a point, if it is inside; at most `count`.
    fn layer(&self, x: &Vec3, thickness: f64, count: usize) -> Option<usize> {
        let shape = match self {
            Self::Periodic => return None,
            Self::Hull(hull) => {
                let depth = hull.depth(x);
                return (depth >= 0.0).then(|| ((depth / thickness) as usize).min(count));
            }
            Self::Shape(shape) => shape,
        };
        if !shape.contains(x, 0.0) {
            return None;
        }
        // Depth is known only as a comparison; the largest layer whose upper surface lies above the point.
        let (mut low, mut high) = (0, count);
        while low < high {
            let middle = (low + high).div_ceil(2);
            if shape.contains(x, middle as f64 * thickness) {
                low = middle;
            } else {
                high = middle - 1;
            }
        }
        Some(low)
    }

    fn bounds(&self) -> Option<(Vec3, Vec3)> {
        match self {
            Self::Periodic => None,
            Self::Shape(shape) => Some(shape.bounds()),
            Self::Hull(hull) => Some(hull.bounds()),
        }
    }
}

fn hull(body: &Body) -> Result<Hull, CharacteriseError> {
    let radius: Vec<f64> = body.packing.spheres.iter().map(|sphere| sphere.radius).collect();
    Ok(Hull::of_spheres(&body.packing.positions(), &radius)?)
}

/// Cells of the power diagram of the spheres inside.
#[derive(Debug, Clone, PartialEq)]
pub struct Cells {
    /// Number of cells.
    pub count: usize,
    /// Volume of all of them, m³.
    pub volume: f64,
    /// Mean and standard deviation of the solid fraction of a cell.
    pub fraction: [f64; 2],
    /// Middle of each class of solid fractions, and number of cells in it.
    pub histogram: Vec<(f64, u64)>,
}

/// Solid fractions. Overlaps count twice, except in layers.
#[derive(Debug, Clone, PartialEq)]
pub struct Density {
    /// Volume of all spheres, m³.
    pub solid: f64,
    /// Volume of the periodic cell, m³, and solid volume over it.
    pub cell: Option<[f64; 2]>,
    /// Volume of the smallest convex hull, m³, and solid volume over it; `None` for a periodic packing.
    pub hull: Option<[f64; 2]>,
    /// Volume of the given shape, m³, and solid volume over it.
    pub shape: Option<[f64; 2]>,
    /// Effective: volume of the spheres inside over the volume of their cells of the power diagram; `None` if none is inside.
    pub effective: Option<f64>,
    /// Cells of the power diagram of the spheres inside.
    pub cells: Option<Cells>,
}

impl Density {
    pub(super) fn of(body: &Body, surface: &Surface, outer: &[bool]) -> Result<Self, CharacteriseError> {
        let solid = body.packing.solid_volume();
        let over = |volume: f64| [volume, solid / volume];
        let hull_volume = match surface {
            Surface::Periodic => None,
            Surface::Hull(hull) => Some(hull.volume()),
            Surface::Shape(_) => Some(hull(body)?.volume()),
        };
        let cells = cells(body, outer)?;
        let volume_of = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
        let inside = body.packing.spheres.iter().zip(outer).filter(|(_, outer)| !**outer);
        let solid_inside: f64 = inside.map(|(sphere, _)| volume_of(sphere.radius)).sum();
        Ok(Self {
            solid,
            cell: body.packing.cell.map(|cell| over(cell.volume())),
            hull: hull_volume.map(over),
            shape: body.shape.as_ref().map(|shape| shape.volume().map(over)).transpose()?,
            effective: cells.as_ref().map(|cells| solid_inside / cells.volume),
            cells,
        })
    }
}

/// Cells of the spheres inside. The domain is a box around the spheres: cells at the boundary reach to it and do not count.
fn cells(body: &Body, outer: &[bool]) -> Result<Option<Cells>, CharacteriseError> {
    if outer.iter().all(|outer| *outer) {
        return Ok(None);
    }
    let position = body.packing.positions();
    let radius: Vec<f64> = body.packing.spheres.iter().map(|sphere| sphere.radius).collect();
    let domain = if let Some(cell) = &body.packing.cell {
        Domain::Periodic(cell.matrix)
    } else {
        let largest = radius.iter().copied().fold(0.0, f64::max);
        let low = position.iter().fold(Vec3::repeat(f64::INFINITY), |low, x| low.inf(x));
        let high = position.iter().fold(Vec3::repeat(f64::NEG_INFINITY), |high, x| high.sup(x));
        Domain::Box { low: low.add_scalar(-largest), high: high.add_scalar(largest) }
    };
    let diagram = power_diagram(&position, &radius, &domain, Dimension::Three)?;
    let inside = || (0..radius.len()).filter(|p| !outer[*p]);
    let volume_of = |r: f64| 4.0 / 3.0 * std::f64::consts::PI * r * r * r;
    let fractions: Vec<f64> = inside().map(|p| volume_of(radius[p]) / diagram.volumes[p]).collect();
    let count = fractions.len() as f64;
    let mean = fractions.iter().sum::<f64>() / count;
    let variance = fractions.iter().map(|f| (f - mean) * (f - mean)).sum::<f64>() / count;
    let mut histogram: Vec<(f64, u64)> = (0..CLASSES).map(|k| ((k as f64 + 0.5) / CLASSES as f64, 0)).collect();
    for fraction in &fractions {
        histogram[((fraction * CLASSES as f64) as usize).min(CLASSES - 1)].1 += 1;
    }
    let volume = inside().map(|p| diagram.volumes[p]).sum();
    Ok(Some(Cells { count: fractions.len(), volume, fraction: [mean, variance.sqrt()], histogram }))
}

/// Layers of a body with a surface.
pub(super) fn layers_of(body: &Body, surface: &Surface, mean: f64) -> Result<Option<Layers>, CharacteriseError> {
    let Some(bounds) = surface.bounds() else { return Ok(None) };
    let mut links = vec![0_u32; body.packing.spheres.len()];
    for p in body.pairs.iter().flatten() {
        links[*p as usize] += 1;
    }
    let radius: Vec<f64> = body.packing.spheres.iter().map(|sphere| sphere.radius).collect();
    let thickness = LAYER * mean;
    let layer = |x: &Vec3| surface.layer(x, thickness, LAYERS);
    Ok(Some(layers(&body.packing.positions(), &radius, &links, &layer, bounds, thickness, LAYERS)?))
}

/// Pair correlation, measured from spheres that are deeper than its reach.
pub(super) fn correlation_of(
    body: &Body,
    surface: &Surface,
    density: &Density,
    mean: f64,
) -> Result<Option<PairCorrelation>, CharacteriseError> {
    let Some(cells) = &density.cells else { return Ok(None) };
    let spheres = &body.packing.spheres;
    let mut reach = if spheres.len() > LARGE { SHORT_REACH } else { REACH };
    let central = loop {
        let central: Vec<bool> =
            spheres.iter().map(|sphere| !surface.is_nearer(&sphere.position, reach * mean)).collect();
        if central.iter().filter(|c| **c).count() >= LEAST_CENTERS {
            break central;
        }
        reach -= 0.5;
        if reach < LEAST_REACH {
            return Ok(None);
        }
    };
    let half = vec![0.5 * reach * mean; spheres.len()];
    let cell = body.packing.cell.as_ref();
    let candidates = candidate_pairs(&body.packing.positions(), &half, cell)?;
    let distance = |pair: &concordem_solver::neighbor::CandidatePair| {
        let shift = cell.map_or_else(Vec3::zeros, |cell| cell.shift(pair.image));
        (spheres[pair.b as usize].position + shift - spheres[pair.a as usize].position).norm()
    };
    let pairs: Vec<([u32; 2], f64)> = candidates.iter().map(|pair| ([pair.a, pair.b], distance(pair))).collect();
    let number_density = cells.count as f64 / cells.volume;
    let bins = (reach * INTERVALS).round() as usize;
    Ok(Some(pair_correlation(&pairs, &central, number_density, reach * mean, bins)?))
}
