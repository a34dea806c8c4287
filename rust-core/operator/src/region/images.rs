//! Periodic images that reach into a region.

use super::Region;
use super::polyhedron::{Extent, reduced_bounds};
use crate::OperatorError;
use crate::error::{check_finite, check_volume};
use concordem_contact::math::{Mat3, Vec3};

/// Periodic images: edge vectors as columns (m), and their change over the interval of a displacement (m) or their rate
/// (m/s); zero where only positions matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Period {
    /// Edge vectors as columns, m.
    pub edges: Mat3,
    /// Change or rate of the edge vectors.
    pub change: Mat3,
}

impl Period {
    /// A cell at rest, for operators that read only positions.
    pub fn of(edges: Mat3) -> Self {
        Self { edges, change: Mat3::zeros() }
    }
}

impl Region {
    /// Search for the periodic images of particles and segments that reach into the region.
    pub fn images<'a>(&'a self, period: Option<&'a Period>) -> ImageSearch<'a> {
        let mut search = ImageSearch { region: self, period: None, inverse: Mat3::identity(), range: [None; 3] };
        let Some(period) = period else { return search };
        let Some(inverse) = period.edges.try_inverse() else { return search };
        search.period = Some(period);
        search.inverse = inverse;
        search.range = match self {
            Self::HalfSpaces { planes, .. } => reduced_bounds(planes, &period.edges).map(Extent::range),
            _ => self.bounds().map_or([None; 3], |(low, high)| reduced_box(&inverse, &low, &high)),
        };
        search
    }

    /// Reject half-spaces that contain infinitely many periodic images, and regions that reach over more than 1,000 images. In every
    /// direction of the cell half-spaces must be bounded, or continue unchanged from cell to cell.
    ///
    /// # Errors
    /// [`OperatorError::Unbounded`], [`OperatorError::Images`], [`OperatorError::Volume`] for a cell without volume.
    pub fn check_period(&self, period: Option<&Period>) -> Result<(), OperatorError> {
        let Some(period) = period else { return Ok(()) };
        check_volume("the periodic cell", period.edges.determinant().abs())?;
        check_finite("change", period.change.as_slice())?;
        if let Self::HalfSpaces { planes, .. } = self {
            let bounds = reduced_bounds(planes, &period.edges);
            if let Some(axis) = bounds.iter().position(|extent| *extent == Extent::Unbounded) {
                return Err(OperatorError::Unbounded { axis });
            }
        }
        let extents = self.images(Some(period)).range.into_iter().flatten();
        let images: f64 = extents.map(|[from, to]| to - from + 1.0).product();
        if images > MOST_IMAGES {
            return Err(OperatorError::Images { images, most: MOST_IMAGES });
        }
        Ok(())
    }
}

/// Largest number of images of a cell over which a region may reach: ten cells along each edge. Averages over whole cells repeat
/// themselves, and each image takes as long as the cell.
const MOST_IMAGES: f64 = 1e3;

/// A box in reduced coordinates: from and to along each edge of the cell; `None` if the box is infinite, as across a
/// plane problem, whose cell does not repeat in that direction.
fn reduced_box(inverse: &Mat3, low: &Vec3, high: &Vec3) -> [Option<[f64; 2]>; 3] {
    std::array::from_fn(|k| {
        let row = inverse.row(k);
        let (mut from, mut to) = (0.0, 0.0);
        for i in 0..3 {
            let (a, b) = if row[i] == 0.0 { (0.0, 0.0) } else { (row[i] * low[i], row[i] * high[i]) };
            from += a.min(b);
            to += a.max(b);
        }
        (from.is_finite() && to.is_finite()).then_some([from, to])
    })
}

/// Periodic images that reach into a region; see [`Region::images`].
pub struct ImageSearch<'a> {
    region: &'a Region,
    period: Option<&'a Period>,
    inverse: Mat3,
    /// Extent of the region along each edge of the cell, in numbers of edges; `None`: only the particle itself is
    /// considered.
    range: [Option<[f64; 2]>; 3],
}

impl ImageSearch<'_> {
    /// Images (numbers of edges) whose segment from `x` by `l` (m) may reach into the region.
    pub(crate) fn of(&self, x: &Vec3, l: &Vec3) -> Images {
        if self.period.is_none() {
            return Images::NONE;
        }
        let mut range = [[0, 0]; 3];
        for (k, range) in range.iter_mut().enumerate() {
            let Some([from, to]) = self.range[k] else { continue };
            let row = self.inverse.row(k);
            let (s, t) = ((row * x)[0], (row * l)[0]);
            *range = [(from - (s + t.max(0.0))).ceil() as i32, (to - (s + t.min(0.0))).floor() as i32];
        }
        Images { range, next: [range[0][0], range[1][0], range[2][0]], done: (0..3).any(|k| range[k][0] > range[k][1]) }
    }

    /// Images (numbers of edges) of particle `p` at `x` (m) whose centers lie inside; without a period, the particle itself.
    pub fn inside(&self, p: usize, x: &Vec3) -> impl Iterator<Item = Vec3> {
        let x = *x;
        let images = self.of(&x, &Vec3::zeros());
        images.filter(move |image| self.region.contains(p, &self.period.map_or(x, |period| x + period.edges * image)))
    }
}

/// Integer shifts of images.
pub(crate) struct Images {
    range: [[i32; 2]; 3],
    next: [i32; 3],
    done: bool,
}

impl Images {
    /// Only the particle itself.
    const NONE: Self = Self { range: [[0, 0]; 3], next: [0; 3], done: false };
}

impl Iterator for Images {
    type Item = Vec3;

    fn next(&mut self) -> Option<Vec3> {
        if self.done {
            return None;
        }
        let shift = Vec3::from_fn(|k, _| f64::from(self.next[k]));
        self.done = true;
        for k in 0..3 {
            if self.next[k] < self.range[k][1] {
                self.next[k] += 1;
                self.done = false;
                break;
            }
            self.next[k] = self.range[k][0];
        }
        Some(shift)
    }
}
