//! Shapes of aggregates and pores.

use std::sync::Arc;

use super::Polyhedron;
use super::polyhedron::middle_width;
use crate::PackingError;
use crate::shape::Mesh;
use concordem_contact::math::{Mat3, Vec3};
use std::f64::consts::PI;

/// Shape of an inclusion of unit size: the middle one of its three widths along its axes is 1 m, because a sieve measures this
/// one. In the plane the smaller width is 1 m.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum Form {
    /// A sphere; a disc in the plane.
    Sphere,
    /// An ellipsoid; an ellipse in the plane.
    Ellipsoid {
        /// Longest over middle axis.
        elongation: f64,
        /// Shortest over middle axis.
        flatness: f64,
    },
    /// A convex polyhedron.
    Polyhedron(Arc<Polyhedron>),
    /// A closed triangle mesh.
    Mesh(Arc<MeshForm>),
}

/// A closed triangle mesh as the shape of inclusions. Two of them are apart if their convex hulls are; a point is inside if the
/// mesh itself contains it.
#[derive(Debug, Clone, PartialEq)]
pub struct MeshForm {
    mesh: Mesh,
    volume: f64,
    reach: f64,
}

impl MeshForm {
    /// The mesh, scaled to unit size and moved so that the center of its bounding box is the origin.
    ///
    /// # Errors
    /// Triangles without a common orientation, which do not determine a volume.
    pub fn new(mesh: &Mesh) -> Result<Self, PackingError> {
        let (low, high) = mesh.bounds();
        let size = crate::positive("a width of the mesh", middle_width(&[low, high]))?;
        let mesh = mesh.moved(&(-0.5 * (low + high)), 1.0 / size)?;
        let volume = mesh.volume()?;
        let reach = mesh.vertices().iter().map(Vec3::norm).fold(0.0, f64::max);
        Ok(Self { mesh, volume, reach })
    }
}

impl Form {
    /// Semi-axes of an ellipsoid of unit size, m.
    fn axes(elongation: f64, flatness: f64) -> Vec3 {
        Vec3::new(0.5 * elongation, 0.5, 0.5 * flatness)
    }

    /// Volume at unit size, m³; the area at unit size if `planar`, m² (of the section z = 0).
    pub fn measure(&self, planar: bool) -> f64 {
        match self {
            Self::Sphere if planar => 0.25 * PI,
            Self::Sphere => PI / 6.0,
            Self::Ellipsoid { elongation, .. } if planar => 0.25 * PI * elongation,
            Self::Ellipsoid { elongation, flatness } => PI / 6.0 * elongation * flatness,
            Self::Polyhedron(body) => body.volume(),
            Self::Mesh(body) => body.volume,
        }
    }

    /// Largest distance of a point of the surface from the center at unit size, m.
    fn reach(&self) -> f64 {
        match self {
            Self::Sphere => 0.5,
            Self::Ellipsoid { elongation, flatness } => Self::axes(*elongation, *flatness).max(),
            Self::Polyhedron(body) => body.vertices().iter().map(Vec3::norm).fold(0.0, f64::max),
            Self::Mesh(body) => body.reach,
        }
    }

    /// The point of the body of unit size that lies farthest in a direction, which need not be a unit vector.
    fn support(&self, direction: &Vec3) -> Vec3 {
        let farthest = |vertices: &[Vec3]| {
            let mut best = (f64::NEG_INFINITY, Vec3::zeros());
            for vertex in vertices {
                let reach = vertex.dot(direction);
                if reach > best.0 {
                    best = (reach, *vertex);
                }
            }
            best.1
        };
        match self {
            Self::Sphere => direction * (0.5 / direction.norm()),
            Self::Ellipsoid { elongation, flatness } => {
                let axes = Self::axes(*elongation, *flatness);
                let scaled = axes.component_mul(direction);
                axes.component_mul(&scaled) / scaled.norm()
            }
            Self::Polyhedron(body) => farthest(body.vertices()),
            Self::Mesh(body) => farthest(body.mesh.vertices()),
        }
    }

    /// Whether the body of unit size contains a point, at least `margin` away from its surface.
    fn contains(&self, point: &Vec3, margin: f64) -> bool {
        match self {
            Self::Sphere => 0.5 - point.norm() >= margin,
            Self::Ellipsoid { elongation, flatness } => {
                let axes = Self::axes(*elongation, *flatness);
                point.component_div(&axes).norm_squared() <= 1.0
                    && (margin <= 0.0 || distance_to_ellipsoid(&axes, point) >= margin)
            }
            Self::Polyhedron(body) => body.contains(point, margin),
            Self::Mesh(body) => body.mesh.contains(point, margin),
        }
    }
}

/// Distance of an inner point from the surface of an ellipsoid with semi-axes `e`, m.
///
/// The nearest point is `e_i² y_i/(t + e_i²)` with the root `t` of `Σ (e_i y_i/(t + e_i²))² = 1` above `−min e²` (Eberly 2013,
/// Distance from a Point to an Ellipse, an Ellipsoid, or a Hyperellipsoid, equation 12); bisection locates it to the last
/// digit. Coordinates next to zero are moved away from it by 1e-12 of the axis, which moves the distance by no more.
fn distance_to_ellipsoid(e: &Vec3, point: &Vec3) -> f64 {
    let y = point.zip_map(e, |x, e| x.abs().max(1e-12 * e));
    let square = e.component_mul(e);
    let excess = |t: f64| e.component_mul(&y).component_div(&square.add_scalar(t)).norm_squared() - 1.0;
    let (mut low, mut high) = (-f64::INFINITY, 0.0);
    for i in 0..3 {
        low = low.max(e[i] * y[i] - square[i]);
    }
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        if excess(middle) > 0.0 { low = middle } else { high = middle }
    }
    let nearest = square.component_mul(&y).component_div(&square.add_scalar(high));
    (nearest - y).norm()
}

/// An aggregate or a pore.
#[derive(Debug, Clone, PartialEq)]
pub struct Inclusion {
    /// Shape.
    pub form: Form,
    /// Size, m: the middle one of the three widths.
    pub size: f64,
    /// Center, m.
    pub center: Vec3,
    /// Rotation from the axes of the shape to space.
    pub rotation: Mat3,
    /// Number of the group that it belongs to.
    pub group: usize,
}

impl Inclusion {
    /// Volume, m³; area of the section by the plane of the centers if `planar`, m².
    pub fn measure(&self, planar: bool) -> f64 {
        self.form.measure(planar) * if planar { self.size * self.size } else { self.size * self.size * self.size }
    }

    /// Largest distance of a point of the surface from the center, m.
    pub fn reach(&self) -> f64 {
        self.form.reach() * self.size
    }

    /// The point (m) that lies farthest in a direction, which need not be a unit vector.
    pub fn support(&self, direction: &Vec3) -> Vec3 {
        self.center + self.rotation * self.form.support(&self.rotation.tr_mul(direction)) * self.size
    }

    /// Whether a point (m) lies inside, at least `margin` (m) away from the surface.
    pub fn contains(&self, point: &Vec3, margin: f64) -> bool {
        let offset = point - self.center;
        let body = self.rotation.tr_mul(&offset) / self.size;
        self.form.contains(&body, margin / self.size)
    }

    /// Half of the widths of the box along the axes around the center that contains the body, m.
    pub(super) fn half_box(&self) -> Vec3 {
        if matches!(self.form, Form::Sphere) {
            return Vec3::repeat(0.5 * self.size);
        }
        Vec3::from_fn(|i, _| {
            let mut axis = Vec3::zeros();
            axis[i] = 1.0;
            let (ahead, behind) = (self.support(&axis)[i], self.support(&-axis)[i]);
            (ahead - self.center[i]).max(self.center[i] - behind)
        })
    }
}
