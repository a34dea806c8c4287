//! A slice of particles through the middle of a specimen, at several snapshots.

use super::error::OutputError;
use super::frames::{Frame, Frames};
use super::result::ResultFile;
use concordem_solver::state::columns::ColumnData;

/// Distances from the middle that differ by less than this part of a radius are those of one layer.
const LAYER: f64 = 1e-6;

/// A number that looks random (finalizer of SplitMix64, Steele et al. 2014).
fn scattered(p: usize) -> u64 {
    let mut z = (p as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A slice.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceFrame {
    /// The axes of the picture, 0 to 2.
    pub axes: [usize; 2],
    /// Number of particles.
    pub count: usize,
    /// Number of particles that the slice cuts, of which these are drawn.
    pub cut: usize,
    /// Lowest and highest coordinates of the spheres in the first snapshot, m.
    pub bounds: [[f64; 2]; 2],
    /// Coordinates in the first snapshot, m, two per particle.
    pub points: Vec<f64>,
    /// Radii, m.
    pub radius: Vec<f64>,
    /// The snapshots.
    pub frames: Vec<SliceAt>,
}

/// A slice at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct SliceAt {
    /// Time, s.
    pub time: f64,
    /// Displacements since the first snapshot in the plane of the slice, m, two per particle.
    pub displacement: Vec<f64>,
    /// Damage of the particles.
    pub damage: Vec<f64>,
}

impl ResultFile {
    /// A slice through the middle, as thick as a particle or thinner, so that it has at most `most` particles, at up to `snapshots`
    /// snapshots. Of particles at the same distance from the middle, as in a plane body, it has a sample all over the picture and
    /// the outermost ones. The picture shows the longest edge of the specimen. `None` without snapshots.
    ///
    /// # Errors
    /// The snapshots cannot be read.
    pub fn slice(&self, most: usize, snapshots: usize) -> Result<Option<SliceFrame>, OutputError> {
        if self.snapshot_times()?.is_empty() {
            return Ok(None);
        }
        let frames = Frames::of_particles(self.root(), self.path())?;
        let first = frames.read(0)?;
        let (points, _) = first.points.as_chunks::<3>();
        let radius = reals(&first, "radius");
        if points.is_empty() || radius.len() != points.len() {
            return Ok(None);
        }
        let range = |axis: usize| {
            points.iter().zip(radius).fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], (point, radius)| {
                [low.min(point[axis] - radius), high.max(point[axis] + radius)]
            })
        };
        let ranges = [range(0), range(1), range(2)];
        let length = |axis: usize| ranges[axis][1] - ranges[axis][0];
        // A plane specimen is seen from above; a body from its side: its last axis points up, the shorter of the others away.
        let normal = if length(2) <= 2.01 * radius.iter().copied().fold(0.0, f64::max) {
            2
        } else {
            usize::from(length(0) >= length(1))
        };
        let axes = match normal {
            0 => [1, 2],
            1 => [0, 2],
            _ => [0, 1],
        };
        let middle = 0.5 * (ranges[normal][0] + ranges[normal][1]);
        let mut chosen: Vec<usize> =
            (0..points.len()).filter(|&p| (points[p][normal] - middle).abs() <= radius[p]).collect();
        let cut = chosen.len();
        let outermost: Vec<usize> = axes
            .iter()
            .flat_map(|&axis| {
                let least = chosen
                    .iter()
                    .min_by(|p, q| (points[**p][axis] - radius[**p]).total_cmp(&(points[**q][axis] - radius[**q])));
                let most = chosen
                    .iter()
                    .max_by(|p, q| (points[**p][axis] + radius[**p]).total_cmp(&(points[**q][axis] + radius[**q])));
                [least, most]
            })
            .flatten()
            .copied()
            .collect();
        // The outermost, then the nearest to the middle. Distances of one layer differ by rounding; in a layer, any order but that of
        // the file, which runs through the body from one side to the other.
        let rank = |p: usize| {
            let layer = ((points[p][normal] - middle).abs() / (LAYER * radius[p])).round();
            (!outermost.contains(&p), layer as u64, scattered(p))
        };
        chosen.sort_by_cached_key(|&p| rank(p));
        chosen.truncate(most);
        chosen.sort_unstable();
        let pick =
            |values: &[f64]| -> Vec<f64> { chosen.iter().map(|&p| values.get(p).copied().unwrap_or(0.0)).collect() };
        let count = frames.len();
        let wanted = snapshots.min(count);
        let mut at: Vec<usize> = (0..wanted).map(|k| k * (count - 1) / wanted.saturating_sub(1).max(1)).collect();
        at.dedup();
        let mut slices = Vec::new();
        for k in at {
            let frame = frames.read(k)?;
            if frame.points.len() != first.points.len() {
                continue;
            }
            let moved = |p: usize, axis: usize| frame.points[3 * p + axis] - points[p][axis];
            let displacement: Vec<f64> = chosen.iter().flat_map(|&p| axes.map(|axis| moved(p, axis))).collect();
            if displacement.iter().all(|d| d.is_finite()) {
                slices.push(SliceAt { time: frame.time, displacement, damage: pick(reals(&frame, "damage")) });
            }
        }
        Ok(Some(SliceFrame {
            axes,
            count: chosen.len(),
            cut,
            bounds: [[ranges[axes[0]][0], ranges[axes[1]][0]], [ranges[axes[0]][1], ranges[axes[1]][1]]],
            points: chosen.iter().flat_map(|&p| axes.map(|axis| points[p][axis])).collect(),
            radius: pick(radius),
            frames: slices,
        }))
    }
}

fn reals<'a>(frame: &'a Frame, name: &str) -> &'a [f64] {
    match frame.field(name) {
        Some(ColumnData::F64(values)) => values,
        _ => &[],
    }
}
