//! Candidate pairs by a hierarchy of sparse grids.
//!
//! Particles are split into levels by reach; each level has half the reach of the one before. A level has its own grid,
//! whose boxes are as wide as twice the level's largest reach. A particle looks for partners in its own level and in
//! all coarser ones, where the search distance never exceeds one box. So the cost is linear in the number of particles
//! for any mixture of sizes (Ogarko & Luding 2012, Comput. Phys. Commun. 183, 931).
//!
//! A grid stores no empty boxes: it is the list of its particles, sorted by box number with x running fastest. So the
//! boxes of one row are adjacent in memory, and a row is located by a search from where the last one ended.

use rayon::prelude::*;

use super::{Lattice, NeighborError, first_position_not_finite, typical_bounds};
use crate::state::Cell;
use concordem_contact::math::Vec3;
use concordem_operator::interruption::Watch;

/// Two particles whose center distance is within their reaches.
///
/// A sees B at `x_B + H·image` with the cell matrix H; `a < b`, or `a == b` for a particle that sees its own periodic
/// image (then the first non-zero component of `image` is positive, so that each such pair occurs once).
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CandidatePair {
    /// Index of the first particle.
    pub a: u32,
    /// Index of the second particle.
    pub b: u32,
    /// Cell index of the image of B that A sees.
    pub image: [i8; 3],
}

/// Bits of a box number per axis.
const AXIS_BITS: u32 = 21;
const BOXES_PER_AXIS: i64 = 1 << AXIS_BITS;
/// Number of size classes; the last one contains all smaller particles. A factor of 2¹⁵ lies between the first and the
/// last.
const LEVELS: usize = 16;
/// Largest bound of rounding errors, as a fraction of the reach: overlaps of 1e-3 of the radius keep three digits.
const LARGEST_SLACK: f64 = 0.01;
/// Queries per parallel task: long enough to amortize the first search of each row.
const CHUNK: usize = 2048;

/// All pairs with center distance `|x_B + H·image − x_A| ≤ reach_A + reach_B`, each once, sorted by (a, b, image).
///
/// Positions (m) may lie outside the periodic cell; the cell may be triclinic, and smaller than the reach: then a pair
/// occurs with several images, and a particle with its own. The result does not depend on the number of threads.
///
/// # Errors
/// Positions or reaches that are not finite, a cell without volume, and images beyond ±127 cells.
pub fn candidate_pairs(
    positions: &[Vec3],
    reach: &[f64],
    cell: Option<&Cell>,
) -> Result<Vec<CandidatePair>, NeighborError> {
    Search::checked(positions, reach, positions.len(), cell)?.pairs()
}

/// Those of [`candidate_pairs`] of one of the first `count` positions (a) and one of the others (b), which are few, and may have a large
/// reach.
///
/// # Errors
/// As [`candidate_pairs`].
pub fn candidate_pairs_with_others(
    positions: &[Vec3],
    reach: &[f64],
    count: usize,
    cell: Option<&Cell>,
) -> Result<Vec<CandidatePair>, NeighborError> {
    Search::checked(positions, reach, count, cell)?.pairs_with_others(count)
}

/// A particle in the order of a grid.
#[derive(Debug, Clone, Copy)]
struct Entry {
    /// Position, wrapped into the cell if there is one, m.
    position: Vec3,
    reach: f64,
    index: u32,
}

/// The particles of one size class, sorted by box.
struct Level {
    largest_reach: f64,
    /// Boxes per axis.
    counts: [i64; 3],
    /// Boxes per unit of grid coordinate (m without a cell; fraction of the cell with one).
    boxes_per_unit: Vec3,
    /// Boxes per meter of distance.
    boxes_per_meter: Vec3,
    /// Box number of each entry, ascending.
    keys: Vec<u64>,
    entries: Vec<Entry>,
}

struct Search<'a> {
    positions: &'a [Vec3],
    reach: &'a [f64],
    lattice: Option<Lattice>,
    /// Corner of the grids without a cell, m.
    corner: Vec3,
    /// Bound of the rounding errors of wrapped positions, m.
    slack: f64,
    /// Coarsest first; none is empty.
    levels: Vec<Level>,
}

impl<'a> Search<'a> {
    /// A search among the first `count` of these positions.
    fn checked(
        positions: &'a [Vec3],
        reach: &'a [f64],
        count: usize,
        cell: Option<&Cell>,
    ) -> Result<Self, NeighborError> {
        if positions.len() != reach.len() {
            return Err(NeighborError::LengthMismatch { positions: positions.len(), reaches: reach.len() });
        }
        if u32::try_from(positions.len()).is_err() {
            return Err(NeighborError::TooManyParticles { count: positions.len() });
        }
        if let Some(error) = first_position_not_finite(positions) {
            return Err(error);
        }
        if let Some(index) = reach.iter().position(|r| !(r.is_finite() && *r >= 0.0)) {
            return Err(NeighborError::BadReach { index, reach: reach[index] });
        }
        let lattice = cell.map(Lattice::new).transpose()?;
        let search = Self::new(positions, reach, count, lattice.as_ref());
        search.check_distance()?;
        search.check_images()?;
        Ok(search)
    }

    fn new(positions: &'a [Vec3], reach: &'a [f64], count: usize, lattice: Option<&Lattice>) -> Self {
        let largest = reach.iter().copied().fold(0.0, f64::max);
        let far = positions.par_iter().map(Vec3::amax).reduce(|| 0.0, f64::max);
        let period = lattice.map_or(0.0, |l| l.cell.matrix.abs().sum());
        // Wrapping and shifting are a handful of operations on numbers up to `far` and `period`, some of which cancel
        // in a skewed cell: 64 rounding errors bound them with a margin.
        let skew = lattice.map_or(1.0, |l| l.inverse.abs().sum() * l.cell.matrix.abs().sum());
        // Without a cell nothing is wrapped or shifted, so one distant particle costs the others nothing.
        let slack = if lattice.is_some() { 64.0 * f64::EPSILON * skew * (far + period) } else { 0.0 };

        let level_of = |r: f64| {
            let mut bound = 0.5 * largest;
            let mut level = 0;
            while r < bound && level + 1 < LEVELS {
                bound *= 0.5;
                level += 1;
            }
            level
        };
        let mut members: Vec<Vec<u32>> = vec![Vec::new(); LEVELS];
        for (index, r) in reach[..count].iter().enumerate() {
            members[level_of(*r)].push(index as u32);
        }
        let (low, high) = typical_bounds(positions);
        let mut search = Self { positions, reach, lattice: lattice.copied(), corner: low, slack, levels: Vec::new() };
        // At most 10⁶ boxes span the particles, however small the reach.
        let smallest_box = 1.0e-6 * (high - low).amax();
        for list in members.into_iter().filter(|list| !list.is_empty()) {
            let level = search.level(list, smallest_box);
            search.levels.push(level);
        }
        search
    }

    fn level(&self, list: Vec<u32>, smallest_box: f64) -> Level {
        let largest_reach = list.iter().map(|&i| self.reach[i as usize]).fold(0.0, f64::max);
        let size = (2.0 * largest_reach).max(smallest_box).max(f64::MIN_POSITIVE);
        let mut level = Level {
            largest_reach,
            counts: [BOXES_PER_AXIS; 3],
            boxes_per_unit: Vec3::repeat((1.0 / size).min(f64::MAX)),
            boxes_per_meter: Vec3::repeat((1.0 / size).min(f64::MAX)),
            keys: Vec::new(),
            entries: Vec::new(),
        };
        if let Some(lattice) = &self.lattice {
            for axis in 0..3 {
                let count = (lattice.widths[axis] / size).floor().clamp(1.0, BOXES_PER_AXIS as f64);
                level.counts[axis] = count as i64;
                level.boxes_per_unit[axis] = count;
                level.boxes_per_meter[axis] = count / lattice.widths[axis];
            }
        }
        let mut order: Vec<(u64, u32)> = list
            .into_par_iter()
            .map(|index| {
                let u = self.grid_coordinate(&level, &self.wrapped(index));
                (level.key(u.x.floor() as i64, u.y.floor() as i64, u.z.floor() as i64), index)
            })
            .collect();
        order.par_sort_unstable();
        level.keys = order.par_iter().map(|(key, _)| *key).collect();
        level.entries = order
            .par_iter()
            .map(|&(_, index)| Entry { position: self.wrapped(index), reach: self.reach[index as usize], index })
            .collect();
        level
    }

    fn wrapped(&self, index: u32) -> Vec3 {
        let position = &self.positions[index as usize];
        self.lattice.as_ref().map_or(*position, |lattice| lattice.wrapped(position))
    }

    /// Coordinates of a wrapped position on a level's grid, in boxes.
    fn grid_coordinate(&self, level: &Level, position: &Vec3) -> Vec3 {
        match &self.lattice {
            Some(lattice) => (lattice.inverse * position).component_mul(&level.boxes_per_unit),
            // The particles start in the middle of the range. Positions beyond either end share the last box: still
            // correct, but slow if there are many.
            None => {
                (position - self.corner).component_mul(&level.boxes_per_unit).add_scalar((BOXES_PER_AXIS / 2) as f64)
            }
        }
    }

    /// Rounding of wrapped positions must be small relative to every reach; otherwise a search would also visit very
    /// many boxes.
    fn check_distance(&self) -> Result<(), NeighborError> {
        let reaches = self.levels.iter().map(|level| level.largest_reach).filter(|reach| *reach > 0.0);
        let reach = reaches.fold(f64::INFINITY, f64::min);
        if self.slack <= LARGEST_SLACK * reach {
            return Ok(());
        }
        let distance = self.positions.iter().map(Vec3::amax).fold(0.0, f64::max);
        Err(NeighborError::TooFar { distance, reach, limit: distance * LARGEST_SLACK * reach / self.slack })
    }

    /// A particle must not see an image of itself whose number exceeds an `i8`.
    fn check_images(&self) -> Result<(), NeighborError> {
        let (Some(lattice), Some(coarsest)) = (&self.lattice, self.levels.first()) else { return Ok(()) };
        let reach = coarsest.largest_reach;
        for axis in 0..3 {
            let width = lattice.widths[axis];
            if 2.0 * reach / width >= 127.0 {
                let index = self.reach.iter().position(|r| *r == reach).unwrap_or(0);
                return Err(NeighborError::CellTooThin { index, reach, axis, width });
            }
        }
        Ok(())
    }

    fn pairs(&self) -> Result<Vec<CandidatePair>, NeighborError> {
        let tasks: Vec<(usize, usize)> = self
            .levels
            .iter()
            .enumerate()
            .flat_map(|(level, grid)| (0..grid.entries.len()).step_by(CHUNK).map(move |first| (level, first)))
            .collect();
        let watch = Watch::here();
        let found: Vec<Result<Vec<CandidatePair>, NeighborError>> = tasks
            .par_iter()
            .map(|&(level, first)| {
                watch.look();
                let own = &self.levels[level];
                let entries = &own.entries[first..(first + CHUNK).min(own.entries.len())];
                let mut out = Vec::with_capacity(4 * entries.len());
                for coarser in &self.levels[..level] {
                    self.query(entries, coarser, None, &mut out)?;
                }
                self.query(entries, own, Some(first), &mut out)?;
                Ok(out)
            })
            .collect();
        // In the order of the tasks, so that always the same one of several errors is reported.
        let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        sorted(self.positions.len(), &found)
    }

    fn pairs_with_others(&self, count: usize) -> Result<Vec<CandidatePair>, NeighborError> {
        let watch = Watch::here();
        let others: Vec<usize> = (count..self.positions.len()).collect();
        let found: Vec<Result<Vec<CandidatePair>, NeighborError>> = others
            .par_iter()
            .map(|&index| {
                watch.look();
                let (number, mut out) = (index as u32, Vec::new());
                let seeker = Entry { position: self.wrapped(number), reach: self.reach[index], index: number };
                self.levels.iter().try_for_each(|level| self.query(&[seeker], level, None, &mut out))?;
                Ok(out)
            })
            .collect();
        let found = found.into_iter().collect::<Result<Vec<_>, _>>()?;
        sorted(self.positions.len(), &found)
    }

    /// Partners of some particles in a level. `first`: number of the first of them, if the level is their own: then only partners after
    /// them in the order of the grid, in which each pair occurs once. (From a box seen as box d of another, that one is box −d.)
    fn query(
        &self,
        seekers: &[Entry],
        level: &Level,
        first: Option<usize>,
        out: &mut Vec<CandidatePair>,
    ) -> Result<(), NeighborError> {
        // Where the search in each row of boxes ended for the previous particle: usually a good start.
        let mut hints = [0_usize; 32];
        let period = level.counts;
        let periodic = self.lattice.is_some();
        for (number, entry) in seekers.iter().enumerate() {
            let own = first.map(|first| (first + number, Level::place(level.keys[first + number])));
            let cutoff = entry.reach + level.largest_reach + self.slack;
            let u = self.grid_coordinate(level, &entry.position);
            // 1e-6 boxes cover the rounding of coordinates up to 2²¹ boxes (2²¹·2⁻⁵² = 5e-10).
            let half = (level.boxes_per_meter * cutoff).add_scalar(1.0e-6);
            let mut low = [0; 3];
            let mut high = [0; 3];
            for axis in 0..3 {
                low[axis] = (u[axis] - half[axis]).floor() as i64;
                high[axis] = (u[axis] + half[axis]).floor() as i64;
                if !periodic {
                    low[axis] = low[axis].clamp(0, BOXES_PER_AXIS - 1);
                    high[axis] = high[axis].clamp(0, BOXES_PER_AXIS - 1);
                }
            }
            // A facet may be a thousand times as long as the particles are: then most rows are empty.
            if !periodic && own.is_none() && (high[1] - low[1] + 1) * (high[2] - low[2] + 1) > level.keys.len() as i64 {
                for other in &level.entries {
                    self.meet(entry, other, &Vec3::zeros(), [0; 3], out)?;
                }
                continue;
            }
            let mut row = 0;
            for z in own.map_or(low[2], |(_, own)| own[2])..=high[2] {
                let start = own.filter(|(_, own)| own[2] == z).map_or(low[1], |(_, own)| own[1]);
                for y in start..=high[1] {
                    let mut after = own.filter(|(_, own)| [own[1], own[2]] == [y, z]);
                    let mut x = after.map_or(low[0], |(_, own)| own[0]);
                    while x <= high[0] {
                        // The part of the row within one period.
                        let (inside, image) = if periodic {
                            (
                                [x.rem_euclid(period[0]), y.rem_euclid(period[1]), z.rem_euclid(period[2])],
                                [x.div_euclid(period[0]), y.div_euclid(period[1]), z.div_euclid(period[2])],
                            )
                        } else {
                            ([x, y, z], [0; 3])
                        };
                        let last = (inside[0] + high[0] - x).min(period[0] - 1);
                        let begin = if let Some((own, _)) = after.take() {
                            own + 1
                        } else {
                            let hint = &mut hints[row % 32];
                            *hint = lower_bound(&level.keys, level.key(inside[0], inside[1], inside[2]), *hint);
                            *hint
                        };
                        let end = level.key(last, inside[1], inside[2]);
                        let shift = match &self.lattice {
                            Some(lattice) if image != [0; 3] => {
                                lattice.cell.matrix * Vec3::new(image[0] as f64, image[1] as f64, image[2] as f64)
                            }
                            _ => Vec3::zeros(),
                        };
                        let row_of_boxes = level.keys[begin..].iter().zip(&level.entries[begin..]);
                        for (_, other) in row_of_boxes.take_while(|(key, _)| **key <= end) {
                            self.meet(entry, other, &shift, image, out)?;
                        }
                        x += last - inside[0] + 1;
                        row += 1;
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds the pair of two particles if they are within their reaches, the second one seen at its wrapped position plus `shift`.
    #[inline]
    fn meet(
        &self,
        seeker: &Entry,
        other: &Entry,
        shift: &Vec3,
        image: [i64; 3],
        out: &mut Vec<CandidatePair>,
    ) -> Result<(), NeighborError> {
        let limit = seeker.reach + other.reach + self.slack;
        if (other.position + shift - seeker.position).norm_squared() > limit * limit {
            return Ok(());
        }
        if let Some(pair) = self.confirm(seeker.index, other.index, image)? {
            // Their number follows from the reach, which a user chooses.
            if out.len() == out.capacity() {
                reserve(out, out.len().max(CHUNK))?;
            }
            out.push(pair);
        }
        Ok(())
    }

    /// The pair in its final form, if the condition of [`candidate_pairs`] holds for the unwrapped positions.
    ///
    /// `image` is the one between the wrapped positions.
    fn confirm(&self, seeker: u32, other: u32, image: [i64; 3]) -> Result<Option<CandidatePair>, NeighborError> {
        let (a, b) = (seeker.min(other), seeker.max(other));
        // Without a cell nothing was wrapped, so the distance of the search is the final one.
        let Some(lattice) = &self.lattice else { return Ok(Some(CandidatePair { a, b, image: [0; 3] })) };
        let (x_a, x_b) = (&self.positions[a as usize], &self.positions[b as usize]);
        let limit = self.reach[a as usize] + self.reach[b as usize];
        let sign = if seeker <= other { 1.0 } else { -1.0 };
        let wrapped = Vec3::new(image[0] as f64, image[1] as f64, image[2] as f64) * sign;
        let mut true_image = wrapped - lattice.cell_of(x_b) + lattice.cell_of(x_a);
        if a == b && true_image.iter().find(|m| **m != 0.0).is_some_and(|m| *m < 0.0) {
            true_image = -true_image;
        }
        // Round as the solver does: shift first, then difference.
        if (x_b + lattice.cell.matrix * true_image - x_a).norm_squared() > limit * limit {
            return Ok(None);
        }
        let mut small = [0_i8; 3];
        for axis in 0..3 {
            if !(-128.0..=127.0).contains(&true_image[axis]) {
                return Err(NeighborError::ImageOutOfRange { a, b, image: true_image.into() });
            }
            small[axis] = true_image[axis] as i8;
        }
        Ok(Some(CandidatePair { a, b, image: small }))
    }
}

impl Level {
    /// Number of a box, x running fastest.
    fn key(&self, x: i64, y: i64, z: i64) -> u64 {
        let inside = |value: i64, axis: usize| value.clamp(0, self.counts[axis] - 1) as u64;
        inside(z, 2) << (2 * AXIS_BITS) | inside(y, 1) << AXIS_BITS | inside(x, 0)
    }

    /// The box with this number.
    fn place(key: u64) -> [i64; 3] {
        [0, AXIS_BITS, 2 * AXIS_BITS].map(|shift| (key >> shift) as i64 & (BOXES_PER_AXIS - 1))
    }
}

/// Room for so many more pairs.
fn reserve(pairs: &mut Vec<CandidatePair>, more: usize) -> Result<(), NeighborError> {
    let count = pairs.len() + more;
    pairs.try_reserve(more).map_err(|_| NeighborError::Memory { count, bytes: count * size_of::<CandidatePair>() })
}

/// The pairs found, of `count` particles, in ascending order.
fn sorted(count: usize, found: &[Vec<CandidatePair>]) -> Result<Vec<CandidatePair>, NeighborError> {
    // By the first particle, and then those of each.
    let mut end = vec![0_usize; count + 1];
    found.iter().flatten().for_each(|pair| end[pair.a as usize + 1] += 1);
    for a in 0..count {
        end[a + 1] += end[a];
    }
    let mut pairs = Vec::new();
    reserve(&mut pairs, end[count])?;
    pairs.resize(end[count], CandidatePair { a: 0, b: 0, image: [0; 3] });
    for pair in found.iter().flatten() {
        let place = &mut end[pair.a as usize];
        pairs[*place] = *pair;
        *place += 1;
    }
    pairs.par_chunk_by_mut(|p, q| p.a == q.a).for_each(<[CandidatePair]>::sort_unstable);
    Ok(pairs)
}

/// First index in ascending `keys` whose key is at least `target`, searched outwards from `hint` in growing strides.
fn lower_bound(keys: &[u64], target: u64, hint: usize) -> usize {
    let hint = hint.min(keys.len());
    let mut stride = 1;
    let (low, high) = if hint < keys.len() && keys[hint] < target {
        let mut low = hint + 1;
        let mut high = low;
        while high < keys.len() && keys[high] < target {
            low = high + 1;
            high += stride;
            stride *= 2;
        }
        (low, high.min(keys.len()))
    } else {
        let mut high = hint;
        let mut low = hint;
        while low > 0 && keys[low - 1] >= target {
            high = low - 1;
            low = low.saturating_sub(stride);
            stride *= 2;
        }
        (low, high)
    };
    low + keys[low..high].partition_point(|key| *key < target)
}
