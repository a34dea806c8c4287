//! Regions of space for averages, and the weight of contacts across their border.

mod polyhedron;

use super::OperatorError;
use super::error::check_volume;
use concordem_contact::math::{Mat3, Vec3};

/// A half-space bounded by a plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct HalfSpace {
    /// A point of the plane, m.
    pub point: Vec3,
    /// Normal out of the half-space (any length).
    pub normal: Vec3,
}

/// A region of space. A region that is infinite in one direction is a region of the plane, with the volume for unit
/// depth.
#[derive(Debug, Clone, PartialEq)]
pub enum Region {
    /// All particles, with a reference volume: a specimen, or a periodic cell.
    All {
        /// Volume, m³.
        volume: f64,
    },
    /// `low ≤ x < high`; an infinite side has unit depth.
    Box {
        /// Lower corner, m.
        low: Vec3,
        /// Upper corner, m.
        high: Vec3,
    },
    /// Ball.
    Sphere {
        /// Center, m.
        center: Vec3,
        /// Radius, m.
        radius: f64,
    },
    /// Circular cylinder with flat ends; an infinite `half_length` means unit depth.
    Cylinder {
        /// Center, m.
        center: Vec3,
        /// Axis, a unit vector.
        axis: Vec3,
        /// Radius, m.
        radius: f64,
        /// From the center to either end, m.
        half_length: f64,
    },
    /// Image of the unit ball under `x → center + axes·x`.
    Ellipsoid {
        /// Center, m.
        center: Vec3,
        /// Half axes as columns (any linear map), m.
        axes: Mat3,
    },
    /// Intersection of half-spaces, with its volume (m³).
    HalfSpaces {
        /// The half-spaces.
        planes: Vec<HalfSpace>,
        /// Volume, m³.
        volume: f64,
    },
    /// A parallelepiped `corner + edges·s`, `0 ≤ s < 1`.
    Parallelepiped {
        /// A corner, m.
        corner: Vec3,
        /// Edges as columns, m.
        edges: Mat3,
    },
    /// Marked particles (a material, a named set, any condition), with the volume that they represent.
    Particles {
        /// Whether each particle belongs.
        member: Vec<bool>,
        /// Volume, m³.
        volume: f64,
    },
}

/// Weight of a contact that crosses the border of a region.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Truncation {
    /// Zero: both centers must lie inside (ERDC 2019, §5.1). Too low by about `¾ l/R` in a sphere.
    InternalOnly,
    /// One half: unbiased on average.
    HalfCrossing,
    /// The fraction of the branch vector inside: unbiased, and exactly additive over a partition of space.
    #[default]
    BranchClipped,
}

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
    /// The whole of a periodic cell with the given edge vectors (m).
    pub fn periodic_cell(edges: &Mat3) -> Self {
        Self::All { volume: edges.determinant().abs() }
    }

    /// A cube of the side `side` (m).
    pub fn cube(center: Vec3, side: f64) -> Self {
        let half = Vec3::repeat(0.5 * side);
        Self::Box { low: center - half, high: center + half }
    }

    /// A disc in the plane z = 0, of unit depth.
    pub fn disc(center: Vec3, radius: f64) -> Self {
        Self::Cylinder { center, axis: Vec3::z(), radius, half_length: f64::INFINITY }
    }

    /// A rectangle in the plane z = 0, of unit depth.
    pub fn rectangle(low: [f64; 2], high: [f64; 2]) -> Self {
        Self::Box {
            low: Vec3::new(low[0], low[1], f64::NEG_INFINITY),
            high: Vec3::new(high[0], high[1], f64::INFINITY),
        }
    }

    /// The particles among `count` whose index meets a condition; they represent the volume `volume` (m³).
    pub fn of_particles(count: usize, condition: impl FnMut(usize) -> bool, volume: f64) -> Self {
        Self::Particles { member: (0..count).map(condition).collect(), volume }
    }

    /// All particles of a material, which represent the volume `volume` (m³).
    pub fn of_material(material: &[u16], wanted: u16, volume: f64) -> Self {
        Self::of_particles(material.len(), |p| material[p] == wanted, volume)
    }

    /// Boxes that fill `low … high` in `count` steps along each axis: the cells of a field map, x fastest.
    pub fn grid(low: Vec3, high: Vec3, count: [usize; 3]) -> Vec<Self> {
        let corner = |i: [usize; 3]| {
            // Both neighbors compute their common border from the same numbers, so that they agree to the last bit. An
            // infinite side, as across a plane, keeps its ends.
            Vec3::from_fn(|k, _| match i[k] {
                0 => low[k],
                step if step == count[k] => high[k],
                step => low[k] + (high[k] - low[k]) * (step as f64 / count[k] as f64),
            })
        };
        let mut cells = Vec::with_capacity(count.iter().product());
        for z in 0..count[2] {
            for y in 0..count[1] {
                for x in 0..count[0] {
                    cells.push(Self::Box { low: corner([x, y, z]), high: corner([x + 1, y + 1, z + 1]) });
                }
            }
        }
        cells
    }

    /// The region after its points moved by `x → origin + deformation·(x − origin) + displacement`. A list of particles
    /// keeps its particles; its volume is scaled.
    #[must_use]
    pub fn moved(&self, deformation: &Mat3, origin: &Vec3, displacement: &Vec3) -> Self {
        let image = |x: &Vec3| origin + deformation * (x - origin) + displacement;
        let growth = deformation.determinant().abs();
        if *deformation == Mat3::identity() {
            return self.translated(displacement);
        }
        match self {
            Self::All { volume } => Self::All { volume: volume * growth },
            Self::Box { low, high } => {
                Self::Parallelepiped { corner: image(low), edges: deformation * Mat3::from_diagonal(&(high - low)) }
            }
            Self::Sphere { center, radius } => Self::Ellipsoid { center: image(center), axes: deformation * *radius },
            Self::Ellipsoid { center, axes } => Self::Ellipsoid { center: image(center), axes: deformation * axes },
            Self::Parallelepiped { corner, edges } => {
                Self::Parallelepiped { corner: image(corner), edges: deformation * edges }
            }
            Self::Cylinder { center, axis, radius, half_length } => {
                // A cylinder stays a cylinder only under rotation, and stretch along and across its axis. For other
                // deformations this is an approximation: the axis follows, and the radius gives the right volume.
                let along = deformation * axis;
                let stretch = along.norm();
                Self::Cylinder {
                    center: image(center),
                    axis: along / stretch,
                    radius: radius * (growth / stretch).sqrt(),
                    half_length: half_length * stretch,
                }
            }
            Self::HalfSpaces { planes, volume } => {
                let normals = deformation.try_inverse().unwrap_or_else(Mat3::identity).transpose();
                let planes = planes
                    .iter()
                    .map(|plane| HalfSpace { point: image(&plane.point), normal: normals * plane.normal })
                    .collect();
                Self::HalfSpaces { planes, volume: volume * growth }
            }
            Self::Particles { member, volume } => Self::Particles { member: member.clone(), volume: volume * growth },
        }
    }

    /// The translated region.
    #[must_use]
    pub fn translated(&self, by: &Vec3) -> Self {
        let mut moved = self.clone();
        match &mut moved {
            Self::All { .. } | Self::Particles { .. } => {}
            Self::Box { low, high } => {
                *low += by;
                *high += by;
            }
            Self::Sphere { center, .. } | Self::Cylinder { center, .. } | Self::Ellipsoid { center, .. } => {
                *center += by;
            }
            Self::Parallelepiped { corner, .. } => *corner += by,
            Self::HalfSpaces { planes, .. } => planes.iter_mut().for_each(|plane| plane.point += by),
        }
        moved
    }

    /// Volume, m³ (per unit depth for regions that are infinite in one direction).
    ///
    /// # Errors
    /// A region without a valid shape or volume.
    pub fn volume(&self) -> Result<f64, OperatorError> {
        use std::f64::consts::PI;
        let positive = |kind, name, value: f64| {
            if value > 0.0 {
                Ok(value)
            } else {
                Err(OperatorError::Region { kind, name, value, demand: "it must be positive" })
            }
        };
        let volume = match self {
            Self::All { volume } | Self::Particles { volume, .. } => *volume,
            Self::HalfSpaces { planes, volume } => {
                if let Some(plane) = planes.iter().find(|plane| plane.normal.norm_squared() == 0.0) {
                    positive("half-space", "length of its normal", plane.normal.norm())?;
                }
                *volume
            }
            Self::Box { low, high } => {
                let mut volume = 1.0;
                for k in 0..3 {
                    let side = positive("box", ["side along x", "side along y", "side along z"][k], high[k] - low[k])?;
                    volume *= if side.is_infinite() { 1.0 } else { side };
                }
                volume
            }
            Self::Sphere { radius, .. } => {
                let r = positive("sphere", "radius", *radius)?;
                4.0 / 3.0 * PI * (r * r * r)
            }
            Self::Cylinder { axis, radius, half_length, .. } => {
                let r = positive("cylinder", "radius", *radius)?;
                let h = positive("cylinder", "half length", *half_length)?;
                // The tolerance accepts a unit vector whose components are rounded to 1e-6.
                if (axis.norm() - 1.0).abs() > 1e-6 {
                    let (name, value) = ("length of its axis", axis.norm());
                    return Err(OperatorError::Region { kind: "cylinder", name, value, demand: "it must be 1" });
                }
                PI * (r * r) * if h.is_infinite() { 1.0 } else { 2.0 * h }
            }
            Self::Ellipsoid { axes, .. } => {
                4.0 / 3.0 * PI * positive("ellipsoid", "determinant of its axes", axes.determinant().abs())?
            }
            Self::Parallelepiped { edges, .. } => {
                positive("parallelepiped", "determinant of its edges", edges.determinant().abs())?
            }
        };
        check_volume("the region", volume)
    }

    /// Whether the particle `p` at `x` (m) belongs to the region.
    #[inline]
    pub fn contains(&self, p: usize, x: &Vec3) -> bool {
        match self {
            Self::All { .. } => true,
            Self::Box { low, high } => (0..3).all(|k| low[k] <= x[k] && x[k] < high[k]),
            Self::Sphere { center, radius } => (x - center).norm_squared() < radius * radius,
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let along = r.dot(axis);
                along.abs() < *half_length && (r - axis * along).norm_squared() < radius * radius
            }
            Self::Ellipsoid { center, axes } => {
                axes.try_inverse().is_some_and(|inverse| (inverse * (x - center)).norm_squared() < 1.0)
            }
            Self::Parallelepiped { corner, edges } => edges.try_inverse().is_some_and(|inverse| {
                let s = inverse * (x - corner);
                (0..3).all(|k| (0.0..1.0).contains(&s[k]))
            }),
            Self::HalfSpaces { planes, .. } => planes.iter().all(|plane| (x - plane.point).dot(&plane.normal) < 0.0),
            Self::Particles { member, .. } => member.get(p).copied().unwrap_or(false),
        }
    }

    /// Fraction of the segment from `x` to `x + l` inside the region, 0 to 1.
    pub fn fraction_of_segment(&self, x: &Vec3, l: &Vec3) -> f64 {
        self.part_of_segment(x, l).map_or(0.0, |[from, to]| to - from)
    }

    /// The part of the segment from `x` to `x + l` inside the region, as an interval of fractions of its length. There
    /// is one part, because all regions with a shape are convex.
    pub(super) fn part_of_segment(&self, x: &Vec3, l: &Vec3) -> Option<[f64; 2]> {
        let mut range = [0.0_f64, 1.0];
        match self {
            Self::All { .. } | Self::Particles { .. } => {}
            Self::Box { low, high } => {
                for k in 0..3 {
                    cut_slab(&mut range, x[k], l[k], low[k], high[k]);
                }
            }
            Self::Sphere { center, radius } => cut_ball(&mut range, &(x - center), l, *radius),
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let (along, rate) = (r.dot(axis), l.dot(axis));
                cut_slab(&mut range, along, rate, -half_length, *half_length);
                cut_ball(&mut range, &(r - axis * along), &(l - axis * rate), *radius);
            }
            Self::Ellipsoid { center, axes } => {
                let inverse = axes.try_inverse().unwrap_or_else(Mat3::zeros);
                cut_ball(&mut range, &(inverse * (x - center)), &(inverse * l), 1.0);
            }
            Self::Parallelepiped { corner, edges } => {
                let inverse = edges.try_inverse().unwrap_or_else(Mat3::zeros);
                let (s, t) = (inverse * (x - corner), inverse * l);
                for k in 0..3 {
                    cut_slab(&mut range, s[k], t[k], 0.0, 1.0);
                }
            }
            Self::HalfSpaces { planes, .. } => {
                for plane in planes {
                    cut_slab(
                        &mut range,
                        (x - plane.point).dot(&plane.normal),
                        l.dot(&plane.normal),
                        f64::NEG_INFINITY,
                        0.0,
                    );
                }
            }
        }
        (range[1] > range[0]).then_some(range)
    }

    /// Center of the region, m; `None` if it has none.
    pub fn center(&self) -> Option<Vec3> {
        match self {
            Self::All { .. } | Self::Particles { .. } | Self::HalfSpaces { .. } => None,
            Self::Box { low, high } => {
                // The center of an infinite side is the plane z = 0.
                let middle = (low + high) * 0.5;
                Some(middle.map(|m| if m.is_nan() { 0.0 } else { m }))
            }
            Self::Sphere { center, .. } | Self::Cylinder { center, .. } | Self::Ellipsoid { center, .. } => {
                Some(*center)
            }
            Self::Parallelepiped { corner, edges } => Some(corner + edges * Vec3::repeat(0.5)),
        }
    }

    /// Bounding box of the region; `None` if it is infinite or has no shape.
    pub(super) fn bounds(&self) -> Option<(Vec3, Vec3)> {
        let around = |center: &Vec3, half: Vec3| Some((center - half, center + half));
        match self {
            Self::All { .. } | Self::Particles { .. } | Self::HalfSpaces { .. } => None,
            Self::Box { low, high } => Some((*low, *high)),
            Self::Sphere { center, radius } => around(center, Vec3::repeat(*radius)),
            Self::Cylinder { center, axis, radius, half_length } => {
                // Infinite like a disc: finite across the axis.
                let along = axis.map(|a| if a == 0.0 { 0.0 } else { a.abs() * *half_length });
                around(center, along + Vec3::repeat(*radius))
            }
            Self::Ellipsoid { center, axes } => around(center, Vec3::from_fn(|i, _| axes.row(i).norm())),
            Self::Parallelepiped { corner, edges } => {
                let low = Vec3::from_fn(|i, _| edges.row(i).iter().map(|e| e.min(0.0)).sum());
                let high = Vec3::from_fn(|i, _| edges.row(i).iter().map(|e| e.max(0.0)).sum());
                Some((corner + low, corner + high))
            }
        }
    }

    /// Lower bound of the distance from `x` to the border, m: positive inside, negative outside, zero if unknown.
    #[inline(always)]
    pub(super) fn depth(&self, x: &Vec3) -> f64 {
        match self {
            Self::All { .. } => f64::INFINITY,
            Self::Particles { .. } => 0.0,
            Self::Box { low, high } => {
                let side = |k: usize| (x[k] - low[k]).min(high[k] - x[k]);
                side(0).min(side(1)).min(side(2))
            }
            Self::Sphere { center, radius } => radius - (x - center).norm(),
            Self::Cylinder { center, axis, radius, half_length } => {
                let r = x - center;
                let along = r.dot(axis);
                (radius - (r - axis * along).norm()).min(half_length - along.abs())
            }
            Self::Ellipsoid { center, axes } => {
                // The inverse shrinks lengths at most by its norm.
                let inverse = axes.try_inverse().unwrap_or_else(Mat3::zeros);
                (1.0 - (inverse * (x - center)).norm()) / inverse.norm()
            }
            Self::Parallelepiped { corner, edges } => {
                let inverse = edges.try_inverse().unwrap_or_else(Mat3::zeros);
                let s = inverse * (x - corner);
                let side = |k: usize| s[k].min(1.0 - s[k]) / inverse.row(k).norm();
                side(0).min(side(1)).min(side(2))
            }
            Self::HalfSpaces { planes, .. } => planes
                .iter()
                .map(|plane| (plane.point - x).dot(&plane.normal) / plane.normal.norm())
                .fold(f64::INFINITY, f64::min),
        }
    }

    /// Search for the periodic images of particles and segments that reach into the region.
    pub fn images<'a>(&'a self, period: Option<&'a Period>) -> ImageSearch<'a> {
        let mut search = ImageSearch { region: self, period: None, inverse: Mat3::identity(), range: [None; 3] };
        let Some(period) = period else { return search };
        let Some(inverse) = period.edges.try_inverse() else { return search };
        search.period = Some(period);
        search.inverse = inverse;
        search.range = match self {
            Self::HalfSpaces { planes, .. } => polyhedron::reduced_bounds(planes, &period.edges).map(Extent::range),
            _ => self.bounds().map_or([None; 3], |(low, high)| reduced_box(&inverse, &low, &high)),
        };
        search
    }

    /// Reject half-spaces that contain infinitely many periodic images. In every direction of the cell they must be
    /// bounded, or continue unchanged from cell to cell.
    ///
    /// # Errors
    /// [`OperatorError::Unbounded`].
    pub fn check_period(&self, period: Option<&Period>) -> Result<(), OperatorError> {
        let (Self::HalfSpaces { planes, .. }, Some(period)) = (self, period) else { return Ok(()) };
        let bounds = polyhedron::reduced_bounds(planes, &period.edges);
        match bounds.iter().position(|extent| *extent == Extent::Unbounded) {
            Some(axis) => Err(OperatorError::Unbounded { axis }),
            None => Ok(()),
        }
    }
}

/// Extent of a region along an edge of the periodic cell, in numbers of edges.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Extent {
    /// From and to, in numbers of edges.
    Bounded([f64; 2]),
    /// The region does not change if it moves along the edge: one image represents all.
    Invariant,
    /// Infinite.
    Unbounded,
}

impl Extent {
    fn range(self) -> Option<[f64; 2]> {
        if let Self::Bounded(range) = self { Some(range) } else { None }
    }
}

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
    pub(super) fn of(&self, x: &Vec3, l: &Vec3) -> Images {
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

/// The part of `range` (in units of `l`) for which `low ≤ x + s l < high`.
fn cut_slab(range: &mut [f64; 2], x: f64, l: f64, low: f64, high: f64) {
    if l == 0.0 {
        if !(low <= x && x < high) {
            range[1] = range[0];
        }
        return;
    }
    let (a, b) = ((low - x) / l, (high - x) / l);
    range[0] = range[0].max(a.min(b));
    range[1] = range[1].min(a.max(b)).max(range[0]);
}

/// The part of `range` (in units of `l`) for which `|x + s l| < radius`.
fn cut_ball(range: &mut [f64; 2], x: &Vec3, l: &Vec3, radius: f64) {
    let (a, b, c) = (l.norm_squared(), x.dot(l), x.norm_squared() - radius * radius);
    let discriminant = b * b - a * c;
    if a == 0.0 {
        if c >= 0.0 {
            range[1] = range[0];
        }
    } else if discriminant <= 0.0 {
        range[1] = range[0];
    } else {
        // Compute the root without cancellation first, and the other from the product of both.
        let q = -(b + discriminant.sqrt().copysign(b));
        let (first, second) = (q / a, c / q);
        range[0] = range[0].max(first.min(second));
        range[1] = range[1].min(first.max(second)).max(range[0]);
    }
}

/// Integer shifts of images.
pub(super) struct Images {
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

/// Weight in a region of a contact from particle `a` at `x` along `l` to particle `b`.
#[inline]
pub(super) fn weight(region: &Region, truncation: Truncation, a: usize, b: usize, x: &Vec3, l: &Vec3) -> f64 {
    if matches!(region, Region::All { .. }) {
        return 1.0;
    }
    match truncation {
        // All regions are convex: if both ends are inside, so is the whole branch vector.
        Truncation::BranchClipped if region.contains(a, x) && region.contains(b, &(x + l)) => 1.0,
        Truncation::BranchClipped => region.fraction_of_segment(x, l),
        Truncation::InternalOnly | Truncation::HalfCrossing => {
            match (region.contains(a, x), region.contains(b, &(x + l))) {
                (true, true) => 1.0,
                (false, false) => 0.0,
                _ if truncation == Truncation::HalfCrossing => 0.5,
                _ => 0.0,
            }
        }
    }
}

/// Reject invalid arguments, and regions that contain infinitely many images of a period. Returns the volume, m³.
pub(super) fn check(
    region: &Region,
    truncation: Truncation,
    particles: usize,
    period: Option<&Period>,
) -> Result<f64, OperatorError> {
    region.check_period(period)?;
    if let Region::Particles { member, .. } = region {
        super::error::check_length("member", member.len(), particles, "particle")?;
        if truncation == Truncation::BranchClipped {
            return Err(OperatorError::NoSurface);
        }
        if !member.contains(&true) {
            return Err(OperatorError::EmptyRegion { what: "particle" });
        }
    }
    region.volume()
}
