//! Materials and aggregates.

use super::Body;

/// A material of a packing.
#[derive(Debug, Clone, PartialEq)]
pub struct PhaseShare {
    /// Name of the material.
    pub name: String,
    /// Number of its spheres.
    pub particles: usize,
    /// Its share of the solid volume.
    pub share: f64,
    /// Number of its aggregates.
    pub aggregates: usize,
    /// Mean number of links of its spheres, those at the boundary included.
    pub links: f64,
}

/// The materials that spheres have.
pub(super) fn shares(body: &Body) -> Vec<PhaseShare> {
    let (material, names) = &body.materials;
    let mut links = vec![0_u64; body.packing.spheres.len()];
    for p in body.pairs.iter().flatten() {
        links[*p as usize] += 1;
    }
    let solid = |p: usize| body.packing.spheres[p].radius.powi(3);
    let total: f64 = (0..material.len()).map(solid).sum();
    let kinds = material.iter().copied().max().map_or(0, |last| last + 1);
    let share = |kind: u16| {
        let own: Vec<usize> = (0..material.len()).filter(|p| material[*p] == kind).collect();
        let mut numbers: Vec<u32> =
            own.iter().filter_map(|p| body.aggregates.get(*p).copied()).filter(|n| *n > 0).collect();
        numbers.sort_unstable();
        numbers.dedup();
        (!own.is_empty()).then(|| PhaseShare {
            name: names.get(usize::from(kind)).cloned().unwrap_or_else(|| format!("material {kind}")),
            particles: own.len(),
            share: own.iter().map(|p| solid(*p)).sum::<f64>() / total,
            aggregates: numbers.len(),
            links: own.iter().map(|p| links[*p]).sum::<u64>() as f64 / own.len() as f64,
        })
    };
    (0..kinds).filter_map(share).collect()
}

/// Links within the mortar, within aggregates, between mortar and aggregates, and between two aggregates.
pub(super) fn links(body: &Body) -> Option<[usize; 4]> {
    if body.aggregates.is_empty() {
        return None;
    }
    let mut counts = [0; 4];
    for [a, b] in &body.pairs {
        let class = match (body.aggregates[*a as usize], body.aggregates[*b as usize]) {
            (0, 0) => 0,
            (one, other) if one == other => 1,
            (0, _) | (_, 0) => 2,
            _ => 3,
        };
        counts[class] += 1;
    }
    Some(counts)
}
