//! Regions in which inclusions are placed.

use super::Inclusion;
use crate::{PackingError, Shape};
use concordem_contact::math::{Mat3, Vec3, sin_cos};
use concordem_solver::state::Cell;
use std::f64::consts::PI;

/// A mould, with inclusions entirely inside, or a periodic cell.
#[derive(Debug, Clone)]
pub struct Region {
    /// Corner, m, and edges of the cell, or of the box around the mould, as columns, m.
    pub(super) origin: Vec3,
    pub(super) edges: Mat3,
    pub(super) inverse: Mat3,
    /// The mould; `None` for a periodic cell.
    mould: Option<Shape>,
    /// Whether all centers lie in the plane z = 0.
    pub(super) planar: bool,
    volume: f64,
}

impl Region {
    /// A mould. In the plane, its section by z = 0.
    ///
    /// # Errors
    /// A shape of which no volume (or no section) is known.
    pub fn mould(shape: Shape, planar: bool) -> Result<Self, PackingError> {
        let bad = |reason: &str| PackingError::BadShape { reason: reason.to_owned() };
        let upright = |base: &Vec3, top: &Vec3| base.x == top.x && base.y == top.y;
        let volume = match &shape {
            Shape::Box { low, high } => {
                let edges = high - low;
                if planar { edges.x * edges.y } else { edges.product() }
            }
            Shape::Cylinder { base, top, radius } if planar => {
                if !upright(base, top) {
                    return Err(bad("a cylinder in the plane needs an axis along z"));
                }
                PI * radius * radius
            }
            Shape::Cylinder { base, top, radius } => PI * radius * radius * (top - base).norm(),
            _ if planar => return Err(bad("aggregates in the plane need a box or a cylinder along z as mould")),
            Shape::Hyperboloid { base, top, end_radius, waist_radius } => {
                // ∫ π a² (1 + ζ²/c²) dζ with the radius at the ends.
                let square = waist_radius * waist_radius;
                PI * (top - base).norm() * (square + (end_radius * end_radius - square) / 3.0)
            }
            Shape::Sphere { radius, .. } => 4.0 / 3.0 * PI * radius * radius * radius,
            Shape::Mesh(mesh) => mesh.volume()?,
        };
        let (low, high) = shape.bounds();
        let mut edges = Mat3::from_diagonal(&(high - low));
        let mut origin = low;
        if planar {
            origin.z = 0.0;
            edges[(2, 2)] = 1.0;
        }
        Self::new(origin, edges, Some(shape), planar, volume)
    }

    /// A periodic cell with one corner at `origin`, m. In the plane the third edge does not count.
    ///
    /// # Errors
    /// A cell without volume.
    pub fn periodic(origin: Vec3, cell: &Cell, planar: bool) -> Result<Self, PackingError> {
        let volume = if planar { cell.volume() / cell.matrix[(2, 2)].abs() } else { cell.volume() };
        let mut edges = cell.matrix;
        let mut origin = origin;
        if planar {
            origin.z = 0.0;
            edges.set_column(2, &Vec3::z());
        }
        Self::new(origin, edges, None, planar, volume)
    }

    fn new(origin: Vec3, edges: Mat3, mould: Option<Shape>, planar: bool, volume: f64) -> Result<Self, PackingError> {
        crate::positive("the volume of the region of the aggregates", volume)?;
        let inverse = edges.try_inverse().ok_or_else(|| PackingError::BadShape {
            reason: "the region of the aggregates has no volume".to_owned(),
        })?;
        Ok(Self { origin, edges, inverse, mould, planar, volume })
    }

    /// Volume, m³; area in the plane, m².
    pub fn volume(&self) -> f64 {
        self.volume
    }

    /// Whether the region repeats itself in space.
    pub fn is_periodic(&self) -> bool {
        self.mould.is_none()
    }

    /// Whether all centers lie in the plane z = 0.
    pub fn is_planar(&self) -> bool {
        self.planar
    }

    /// The point (m) with these relative coordinates (0 to 1) in the cell, or in the box around the mould.
    pub(crate) fn point(&self, relative: &Vec3) -> Vec3 {
        self.origin + self.edges * relative
    }

    /// Whether a sphere lies in the mould; true in a periodic cell.
    pub(crate) fn holds_sphere(&self, center: &Vec3, radius: f64) -> bool {
        self.mould.as_ref().is_none_or(|mould| mould.contains(center, radius))
    }

    /// Moves the inclusion to the place with these relative coordinates (0 to 1) among its possible places, and says whether it
    /// is in the region there, at least `gap` (m) away from the surface of the mould. Places in a box are always possible.
    pub(super) fn put(&self, inclusion: &mut Inclusion, relative: &Vec3, gap: f64) -> bool {
        let half = inclusion.half_box().add_scalar(gap);
        let axes = if self.planar { 2 } else { 3 };
        match &self.mould {
            None => {
                inclusion.center = self.origin + self.edges * relative;
                if self.planar {
                    inclusion.center.z = 0.0;
                }
                true
            }
            Some(mould) => {
                let mut center = Vec3::zeros();
                for i in 0..axes {
                    let free = self.edges[(i, i)] - 2.0 * half[i];
                    if free < 0.0 {
                        return false;
                    }
                    center[i] = self.origin[i] + half[i] + free * relative[i];
                }
                inclusion.center = center;
                self.holds(mould, inclusion, gap)
            }
        }
    }

    /// Whether the inclusion lies in the mould, at least `gap` away from its surface. It is in the box around the mould.
    fn holds(&self, mould: &Shape, inclusion: &Inclusion, gap: f64) -> bool {
        match mould {
            Shape::Box { .. } => true,
            Shape::Cylinder { base, top, radius } => {
                let axis = (top - base).normalize();
                let along = |direction: &Vec3| (inclusion.support(direction) - base).dot(&axis);
                let ends = self.planar || { along(&-axis) >= gap && along(&axis) <= (top - base).norm() - gap };
                ends && Self::within_circle(base, &axis, radius - gap, inclusion)
            }
            _ => mould.contains(&inclusion.center, inclusion.reach() + gap),
        }
    }

    /// Whether the projection of the inclusion along `axis` lies in a circle: it is in the polygon of its tangents in 64
    /// directions, whose corners are not farther away than the largest distance of a tangent over cos(π/64), 1.0012.
    fn within_circle(center: &Vec3, axis: &Vec3, radius: f64, inclusion: &Inclusion) -> bool {
        const DIRECTIONS: u32 = 64;
        if matches!(inclusion.form, super::Form::Sphere) {
            let offset = inclusion.center - center;
            return (offset - axis * offset.dot(axis)).norm() + 0.5 * inclusion.size <= radius;
        }
        let least = axis.iamin();
        let mut first = Vec3::zeros();
        first[least] = 1.0;
        let first = (first - axis * first.dot(axis)).normalize();
        let second = axis.cross(&first);
        let limit = radius * sin_cos(PI / f64::from(DIRECTIONS)).1;
        (0..DIRECTIONS).all(|k| {
            let (sine, cosine) = sin_cos(2.0 * PI * f64::from(k) / f64::from(DIRECTIONS));
            let direction = first * cosine + second * sine;
            (inclusion.support(&direction) - center).dot(&direction) <= limit
        })
    }
}
