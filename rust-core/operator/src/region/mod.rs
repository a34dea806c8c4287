//! Regions of space for averages, and the weight of contacts across their border.

mod images;
mod polyhedron;
mod shape;

pub use images::{ImageSearch, Period};

use super::OperatorError;
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

/// Reject invalid arguments, and regions that contain too many images of a period. `position`: of all particles, m. Returns the volume, m³.
pub(super) fn check(
    region: &Region,
    truncation: Truncation,
    position: &[Vec3],
    period: Option<&Period>,
) -> Result<f64, OperatorError> {
    let volume = region.volume()?;
    region.check_period(period)?;
    super::error::check_finite("position", position)?;
    if let Region::Particles { member, .. } = region {
        super::error::check_length("member", member.len(), position.len(), "particle")?;
        if truncation == Truncation::BranchClipped {
            return Err(OperatorError::NoSurface);
        }
        if !member.contains(&true) {
            return Err(OperatorError::EmptyRegion { what: "particle" });
        }
    }
    Ok(volume)
}
